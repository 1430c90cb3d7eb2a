//! Finds the flights of an archive.
//!
//! An archive is folders in folders. Flights whose folder or file lies in one folder are of one deployment. A work item is one flight:
//! a flight directory (`flight.csv`), a csv file, a glider's own files in a folder; of the files of single dives that a Seaglider's base
//! station makes, eight that follow each other.

use logs::record::bounded;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};
use logs::import::folder::files_of;
use logs::import::{Origin, READERS, reader_of};
use logs::record::csv;
use logs::{Flight, import, vehicle};

use rig::flight::vehicles;
use rig::spelling::meant_path;

/// One flight of an archive.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Item {
    /// Folder that it lies in, from the archive's own name on.
    pub deployment: String,
    /// Name of the flight in it.
    pub flight: String,
    /// What is read.
    pub files: Vec<PathBuf>,
    /// Vehicle file that it is judged by.
    pub vehicle: PathBuf,
}

fn name_of(path: &Path) -> String {
    path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned())
}

/// The nearest vehicle file in the folder of a flight or above it, up to the archive's own.
fn vehicle_above(files: &[PathBuf], root: &Path) -> anyhow::Result<Option<PathBuf>> {
    let of = |path: &Path| if path.is_dir() { Some(path.to_path_buf()) } else { path.parent().map(Path::to_path_buf) };
    let (Some(folder), Some(end)) = (files.first().and_then(|f| of(f)), of(root)) else { return Ok(None) };
    let inside = folder.ancestors().take_while(|a| a.starts_with(&end));
    let nearest = inside.map(|a| vehicle::file_next_to(&a.join("flight.csv"))).find(|found| !matches!(found, Ok(None)));
    Ok(nearest.transpose()?.flatten())
}

/// Single dives of a Seaglider that are read as one flight.
const TOGETHER: usize = 8;

struct Scan<'a> {
    root: &'a Path,
    vehicle: Option<&'a Path>,
    out: Vec<Item>,
}

impl Scan<'_> {
    fn add(&mut self, deployment: &str, files: Vec<PathBuf>) -> anyhow::Result<()> {
        let Some(first) = files.first() else { return Ok(()) };
        let above = || vehicle_above(&files, self.root);
        let vehicle = self.vehicle.map_or_else(above, |named| Ok(Some(named.to_path_buf())))?.with_context(|| {
            format!("{}: no vehicle.json or vehicle.toml in its folder or above; name one for all flights with --vehicle", first.display())
        })?;
        self.out.push(Item { deployment: deployment.to_owned(), flight: name_of(first), files, vehicle });
        Ok(())
    }

    /// All flights in and below a folder, whose name in tables is `label`.
    fn folder(&mut self, folder: &Path, label: &str) -> anyhow::Result<()> {
        let files: Vec<PathBuf> = files_of(folder).with_context(|| folder.display().to_string())?;
        let visible = |p: &Path| !name_of(p).starts_with('.');
        let of_reader = |k: usize| files.iter().filter(|f| visible(f) && reader_of(f) == Some(k)).cloned().collect::<Vec<_>>();
        let (joined, single): (Vec<usize>, Vec<usize>) = (0..READERS.len()).partition(|k| READERS[*k].joins);
        for file in single.into_iter().flat_map(of_reader).filter(|f| f.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"))) {
            self.add(label, vec![file])?;
        }
        for k in joined {
            let files = of_reader(k);
            let most = if READERS[k].a_dive_a_file { TOGETHER } else { files.len().max(1) };
            for chunk in files.chunks(most) {
                self.add(label, chunk.to_vec())?;
            }
        }
        let entries = std::fs::read_dir(folder).with_context(|| folder.display().to_string())?;
        let mut folders: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).filter(|p| p.is_dir() && visible(p)).collect();
        folders.sort();
        for inner in folders {
            if inner.join("flight.csv").is_file() {
                self.add(label, vec![inner])?;
            } else {
                self.folder(&inner, &format!("{label}/{}", name_of(&inner)))?;
            }
        }
        Ok(())
    }
}

/// The flights of all paths, in the order of their names; `vehicle` is that of all of them, else each has the nearest vehicle file above it.
///
/// # Errors
/// No such path, no flight, a flight without a vehicle, or two flights of one name, with the fix.
pub fn items(paths: &[PathBuf], vehicle: Option<&Path>) -> anyhow::Result<Vec<Item>> {
    vehicle.map_or(Ok(()), vehicles::is_there)?;
    let mut out = Vec::new();
    for path in paths {
        ensure!(path.exists(), "{}: no such file or folder{}", path.display(), meant_path(path));
        let root = path.canonicalize().with_context(|| path.display().to_string())?;
        let mut scan = Scan { root: &root, vehicle, out: Vec::new() };
        let is_flight = !root.is_dir() || root.join("flight.csv").is_file();
        if is_flight {
            let folder = root.parent().map(name_of).unwrap_or_default();
            scan.add(&folder, vec![root.clone()])?;
        } else {
            scan.folder(&root, &name_of(&root))?;
        }
        ensure!(
            !scan.out.is_empty(),
            "{}: no flight in this folder; a flight is a folder with flight.csv, a csv file, or a glider's own files",
            path.display()
        );
        out.append(&mut scan.out);
    }
    out.sort();
    if let Some(two) = out.windows(2).find(|w| (&w[0].deployment, &w[0].flight) == (&w[1].deployment, &w[1].flight)) {
        let [a, b] = [0, 1].map(|k| two[k].files[0].display().to_string());
        bail!("{a} and {b} would both be {}/{} in the table; name the folder above both, or each once", two[0].deployment, two[0].flight);
    }
    Ok(out)
}

/// What the import wrote of a flight: the import.json of its folder, null where there is none.
#[must_use]
pub fn import_json(folder: &Path) -> serde_json::Value {
    bounded::text(&folder.join("import.json"), bounded::DOCUMENT).ok().and_then(|t| serde_json::from_str(&t).ok()).unwrap_or_default()
}

/// Unix time at which the clock of an imported flight is zero, of its import.json.
#[must_use]
pub fn start_unix_s(import: &serde_json::Value) -> Option<f64> {
    import.pointer("/report/start_unix_s").and_then(serde_json::Value::as_f64).filter(|s| s.is_finite())
}

/// Where the segments' planes of an imported flight lie on the globe, of its import.json.
#[must_use]
pub fn origins(import: &serde_json::Value) -> Vec<Origin> {
    let number = |o: &serde_json::Value, key: &str| o.get(key).and_then(serde_json::Value::as_f64);
    let origin = |o: &serde_json::Value| {
        Some(Origin {
            segment: u32::try_from(o.get("segment")?.as_u64()?).ok()?,
            unix_s: number(o, "unix_s")?,
            lat_deg: number(o, "lat_deg")?,
            lon_deg: number(o, "lon_deg")?,
        })
    };
    import.pointer("/report/origins").and_then(|o| o.as_array()).map_or_else(Vec::new, |o| o.iter().filter_map(origin).collect())
}

/// Reads a flight of any kind.
///
/// # Errors
/// What is wrong with a file, or why it cannot be compared with a model.
pub fn read(files: &[PathBuf]) -> anyhow::Result<Flight> {
    Ok(read_dated(files)?.0)
}

/// Reads a flight of any kind, and the Unix time at which its clock is zero, where that is known.
///
/// # Errors
/// What is wrong with a file, or why it cannot be compared with a model.
pub fn read_dated(files: &[PathBuf]) -> anyhow::Result<(Flight, Option<f64>)> {
    let Placed { flight, zero_unix_s, .. } = read_placed(files)?;
    Ok((flight, zero_unix_s))
}

/// A flight with what its import says of date and place.
#[derive(Clone, Debug)]
pub struct Placed {
    /// The flight.
    pub flight: Flight,
    /// Unix time at which its clock is zero.
    pub zero_unix_s: Option<f64>,
    /// Where its segments' planes lie on the globe.
    pub origins: Vec<Origin>,
}

/// Reads a flight of any kind with its date and place.
///
/// # Errors
/// What is wrong with a file, or why it cannot be compared with a model.
pub fn read_placed(files: &[PathBuf]) -> anyhow::Result<Placed> {
    let first = files.first().context("no file to read")?;
    let is_csv = first.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
    let is_folder = first.join("flight.csv").is_file();
    if files.len() == 1 && (is_csv || is_folder) {
        let folder = if is_folder { Some(first.as_path()) } else { first.parent().filter(|_| name_of(first) == "flight.csv") };
        let import = folder.map(import_json).unwrap_or_default();
        return Ok(Placed { flight: csv::flight(first)?, zero_unix_s: start_unix_s(&import), origins: origins(&import) });
    }
    let import::Imported { mut flight, report, .. } = import::import_all(files, &[], None)?;
    if let Some(why) = report.not_comparable() {
        bail!("{}: {why}", first.display());
    }
    flight.name = name_of(first);
    Ok(Placed { flight, zero_unix_s: report.start_unix_s, origins: report.origins })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn put(path: &Path) {
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, "x").expect("written");
    }

    #[test]
    fn flights_are_found_with_their_deployment_and_nearest_vehicle() {
        let root = std::env::temp_dir().join(format!("glider-archive-{}", std::process::id())).join("fleet");
        for file in ["vehicle.json", "a/may/one/flight.csv", "a/may/two/flight.csv", "a/vehicle.toml", "b/log.csv", "b/notes.md"] {
            put(&root.join(file));
        }
        for dive in 1..=10 {
            put(&root.join(format!("c/p171{dive:04}.nc")));
        }
        let root = root.canonicalize().expect("there");
        let all = items(std::slice::from_ref(&root), None).expect("flights");
        let line = |i: &Item| {
            format!("{}/{} {} {}", i.deployment, i.flight, i.files.len(), i.vehicle.strip_prefix(&root).expect("below").display())
        };
        let lines: Vec<String> = all.iter().map(line).collect();
        assert_eq!(
            lines,
            [
                "fleet/a/may/one 1 a/vehicle.toml",
                "fleet/a/may/two 1 a/vehicle.toml",
                "fleet/b/log.csv 1 vehicle.json",
                "fleet/c/p1710001.nc 8 vehicle.json",
                "fleet/c/p1710009.nc 2 vehicle.json",
            ]
        );
        let given = root.join("a/vehicle.toml");
        assert!(items(std::slice::from_ref(&root), Some(&given)).expect("flights").iter().all(|i| i.vehicle == given));
        std::fs::remove_file(root.join("vehicle.json")).expect("removed");
        let refused = |paths: &[PathBuf]| format!("{:#}", items(paths, None).expect_err("refused"));
        assert!(refused(std::slice::from_ref(&root)).contains("--vehicle"));
        assert!(refused(&[root.join("d")]).contains("no such"));
        let twice = items(&[root.join("a/may"), root.join("a/may/one")], Some(&given)).expect_err("refused");
        assert!(format!("{twice:#}").contains("both"));
        std::fs::remove_dir_all(root.parent().expect("above")).expect("removed");
    }
}

//! Files dropped on the page: a flight with its vehicle, or whatever `glider import` reads.

use super::requests::File;
use anyhow::{Context as _, ensure};
use base64::Engine as _;
use logs::import::Imported;
use logs::{Flight, Vehicle};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Ending of a file's name, in small letters.
fn ending(name: &str) -> String {
    Path::new(name).extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase()
}

/// Whether this is a vehicle file: of the kinds of files that a page takes, no log ends so.
fn is_vehicle(file: &File) -> bool {
    matches!(ending(&file.name).as_str(), "json" | "toml")
}

impl File {
    fn bytes(&self) -> anyhow::Result<Vec<u8>> {
        match &self.base64 {
            Some(text) => base64::engine::general_purpose::STANDARD.decode(text).with_context(|| format!("{}: not whole", self.name)),
            None => Ok(self.text.clone().into_bytes()),
        }
    }

    fn text(&self) -> anyhow::Result<String> {
        logs::vehicle::text::of_bytes(self.bytes()?).map_err(|why| anyhow::anyhow!("{}: {why}", self.name))
    }
}

/// A folder for as long as it takes to read it.
pub(super) struct Scratch(pub PathBuf);

impl Scratch {
    pub(super) fn new() -> anyhow::Result<Self> {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let name = format!("glider-dropped-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir(&folder).with_context(|| format!("cannot make folder {}", folder.display()))?;
        Ok(Self(folder))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).ok();
    }
}

/// The flight, its vehicle, and what is to be said of how they were read.
///
/// # Errors
/// What is wrong with the files, and where.
pub fn read(files: &[File]) -> anyhow::Result<(Flight, Vehicle, Vec<String>)> {
    let (vehicles, logs): (Vec<&File>, Vec<&File>) = files.iter().partition(|f| is_vehicle(f));
    ensure!(!logs.is_empty(), "drop a flight: flight.csv with its vehicle file, or a glider's own log files");
    ensure!(vehicles.len() < 2, "{} and {}: drop one vehicle file", vehicles[0].name, vehicles[1].name);
    let vehicle = || vehicles.first().map(|f| anyhow::Ok(logs::vehicle::parse_text(&f.text()?, Path::new(&f.name))?)).transpose();
    if let ([csv], [_]) = (&logs[..], &vehicles[..])
        && ending(&csv.name) == "csv"
    {
        let name = Path::new(&csv.name).file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        let flight = logs::record::csv::parse(&csv.text()?, Path::new(&csv.name), &name)?;
        return Ok((flight, vehicle()?.context("a vehicle file")?, Vec::new()));
    }
    imported(&logs, vehicle()?)
}

/// A glider's own files, as `glider import` takes them.
fn imported(logs: &[&File], vehicle: Option<Vehicle>) -> anyhow::Result<(Flight, Vehicle, Vec<String>)> {
    let scratch = Scratch::new()?;
    for file in logs {
        let name = Path::new(&file.name).file_name().with_context(|| format!("{:?} is no name of a file", file.name))?;
        std::fs::write(scratch.0.join(name), file.bytes()?)?;
    }
    let all = [scratch.0.clone()];
    // Of a single file the reader names the file, not the folder that it lies in here.
    let paths = match logs {
        [one] => vec![scratch.0.join(Path::new(&one.name).file_name().unwrap_or_default())],
        _ => all.to_vec(),
    };
    let read = logs::import::import_all(&paths, &all, None);
    let shown = |text: String| text.replace(&format!("{}/", scratch.0.display()), "");
    let read = read.map_err(|e| anyhow::anyhow!(shown(e.to_string())))?;
    let made = read.vehicle_text();
    let Imported { flight, report, vehicle_file, .. } = read;
    if let Some(why) = report.not_comparable() {
        anyhow::bail!("{}: {why}", logs[0].name);
    }
    let mut notes = vec![format!("read as {}", report.kind)];
    let vehicle = match (vehicle, made) {
        (Some(vehicle), _) => vehicle,
        (None, Some((name, text))) => {
            if vehicle_file.is_none() {
                notes.push("no vehicle file was dropped with it: the usual numbers of its class, with wide tolerances".into());
            }
            logs::vehicle::parse_text(&text, Path::new(name))?
        }
        (None, None) => anyhow::bail!("{}: drop its vehicle.json or vehicle.toml together with it", logs[0].name),
    };
    notes.extend(report.left_out.into_iter().map(|what| format!("left out: {what}")));
    notes.extend(report.notes);
    Ok((flight, vehicle, notes.into_iter().map(shown).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::diagnosis::write_case;
    use plant::trials::catalogue::{Effect, Strength};
    use plant::trials::{Site, Spec, Wing, generate};

    fn text(name: &str, text: &str) -> File {
        File { name: name.into(), text: text.into(), base64: None }
    }

    fn bytes(name: &str, bytes: &[u8]) -> File {
        File { name: name.into(), text: String::new(), base64: Some(base64::engine::general_purpose::STANDARD.encode(bytes)) }
    }

    /// A short flight in our format, with its vehicle.
    fn case(name: &str) -> (PathBuf, Vec<u8>, Vec<u8>) {
        let folder = std::env::temp_dir().join(format!("glider-dropped-test-{name}-{}", std::process::id()));
        let spec = Spec::single(Site::Lake, Wing::Standard, Effect::ClimbDrag, Strength::Strong);
        let case = write_case(&folder, &generate(&spec, 5, 0)).expect("a case can be written");
        let read = |name: &str| std::fs::read(case.join(name)).expect("just written");
        let (flight, vehicle) = (read("flight.csv"), read("vehicle.json"));
        (folder, flight, vehicle)
    }

    #[test]
    fn a_flight_and_its_vehicle_are_read_as_they_are() {
        let (folder, csv, vehicle) = case("ours");
        let (flight, stated, notes) = read(&[bytes("flight.csv", &csv), bytes("vehicle.json", &vehicle)]).expect("our own files");
        assert!(flight.len() > 1000 && notes.is_empty(), "{notes:?}");
        // From an archive, without a vehicle: the same rows, with the numbers of a class.
        let nc = folder.join("archive.nc");
        let about = logs::export::netcdf::About { start_unix_s: Some(1.7e9), written_unix_s: 1.78e9, ..Default::default() };
        logs::export::netcdf::write(&flight, &nc, &about).expect("written");
        let archive = std::fs::read(&nc).expect("just written");
        let (again, of_class, notes) = read(&[bytes("../../archive.nc", &archive)]).expect("what the import reads");
        // Rows without a pressure are no rows of an archive.
        assert!(again.len() <= flight.len() && again.len() * 100 > flight.len() * 99, "{} of {}", again.len(), flight.len());
        assert!(notes[0].starts_with("read as") && notes.iter().any(|n| n.contains("its class")), "{notes:?}");
        assert!(notes.iter().all(|n| !n.contains("glider-dropped")), "{notes:?}");
        assert_ne!(of_class.name, stated.name);
        let (_, shown, _) = read(&[bytes("archive.nc", &archive), bytes("vehicle.json", &vehicle)]).expect("with its vehicle");
        assert_eq!(shown.name, stated.name);
        std::fs::remove_dir_all(folder).ok();
    }

    #[test]
    fn what_cannot_be_read_is_named_and_leaves_nothing_behind() {
        let rows = (0..40).map(|k| format!("{},{},-0.4,1025.1\n", 4 * k, 5 + k)).collect::<String>();
        let micro = format!("time_s,pressure_dbar,m_pitch_rad,sci_density_kg_m3\n{rows}");
        let broken = File { name: "log.dbd".into(), text: String::new(), base64: Some("!".into()) };
        for (files, said) in [
            (vec![], "drop a flight"),
            (vec![text("vehicle.toml", "")], "drop a flight"),
            (vec![text("a.json", "{}"), text("b.toml", ""), text("f.csv", "")], "one vehicle file"),
            (vec![broken], "log.dbd"),
            (vec![text("notes.txt", "nothing of a flight\n")], "notes.txt"),
            (vec![bytes("flight.csv", &[0xff, 0xfe]), text("vehicle.json", "{}")], "flight.csv"),
            (vec![text("..", "time\n")], ".."),
            (vec![text("micro.csv", &micro)], "micro.csv: has no m_ballast_pumped_cc: without it the force"),
        ] {
            let why = read(&files).expect_err("nothing to read").to_string();
            assert!(why.contains(said), "{why}");
            assert!(!why.contains("glider-dropped"), "{why}");
        }
    }
}

//! Which reader a file is for: by its name where the name says it, else by its first bytes.

use std::path::{Path, PathBuf};

use super::classes::Class;
use super::report::{ImportError, Imported};

/// A format of logs. A new one is a file with such a constant, and its line in the list of readers.
pub struct Reader {
    /// What its files are called to a person.
    pub name: &'static str,
    /// Whether a file is of it.
    pub claims: fn(&Path) -> bool,
    /// Whether any number of files of it make one flight; of others each is one, or two are, of a vehicle's two computers.
    pub joins: bool,
    /// Whether a file is a dive, of which a mission has hundreds.
    pub a_dive_a_file: bool,
    /// Files that belong to those named.
    pub partners: fn(&[PathBuf]) -> Vec<PathBuf>,
    /// Reads the files of one flight; lists of sensors may lie in the folders behind.
    pub import: fn(&[PathBuf], &[PathBuf]) -> Result<Imported, ImportError>,
    /// The class of its gliders by how deep they went, dbar.
    pub class: fn(f64) -> Class,
}

impl Reader {
    /// A format whose files stand alone.
    pub const PLAIN: Self = Self {
        name: "",
        claims: |_| false,
        joins: true,
        a_dive_a_file: false,
        partners: <[PathBuf]>::to_vec,
        import: |_, _| Err(ImportError { file: String::new(), what: String::new() }),
        class: |_| Class::Unknown,
    };
}

/// Whether a file ends in one of these, whatever the case.
pub(super) fn ends_in(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|e| endings.iter().any(|end| e.eq_ignore_ascii_case(end)))
}

/// What a file is by its ending that holds a flight in a form which is not read, and the way to one that is.
#[must_use]
pub fn way_to_readable(path: &Path) -> Option<&'static str> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let ends = |all: &[&str]| all.iter().any(|e| name.ends_with(e));
    Some(match () {
        () if ends(&[".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tar.xz"]) => {
            "is an archive: take its files out first (tar xf), then name their folder"
        }
        () if ends(&[".zip", ".7z", ".rar"]) => "is an archive: take its files out first (unzip), then name their folder",
        () if ends(&[".gz"]) => "is compressed: gunzip it first, then name what comes out",
        () if ends(&[".bz2"]) => "is compressed: bunzip2 it first, then name what comes out",
        () if ends(&[".xz"]) => "is compressed: unxz it first, then name what comes out",
        () if ends(&[".mat"]) => "is a MATLAB file: write its flight as csv first (writetable), one column a channel with its unit",
        () if ends(&[".xlsx", ".xls", ".xlsm", ".ods"]) => "is a spreadsheet: save the sheet of the flight as csv first",
        () => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::super::raw_log::{Clock, RawLog, RawSeries};
    use super::super::{READERS, import_by};
    use super::*;

    /// A lab's own format: lines of a time, a depth in feet, a pitch in degrees and the strokes of its pump.
    const LAB: Reader = Reader { name: "lab", claims: |path| ends_in(path, &["lab"]), import: |files, _| lab(&files[0]), ..Reader::PLAIN };

    fn lab(path: &Path) -> Result<Imported, ImportError> {
        let text = std::fs::read_to_string(path).map_err(|e| ImportError::new(path, e.to_string()))?;
        let column = |k: usize| text.lines().map(|l| l.split(' ').nth(k).and_then(|f| f.parse().ok()).unwrap_or(f64::NAN)).collect();
        let mut raw = RawLog { clocks: vec![Clock { times: column(0), said: Vec::new() }], ..RawLog::default() };
        let series = [("depth", "feet"), ("pitch", "degrees"), ("ballast", "in3")].into_iter().zip(1..);
        raw.series.extend(series.map(|((name, unit), k)| RawSeries::column(name, unit, column(k))));
        raw.flight("lab").map(|(flight, report)| Imported::new(flight, report)).map_err(|what| ImportError::new(path, what))
    }

    #[test]
    fn a_new_format_is_one_constant_and_its_line_in_the_list() {
        let path = std::env::temp_dir().join(format!("glider-{}.lab", std::process::id()));
        // Two dives to 100 ft, a pressure of damage, and two minutes afloat between them.
        let depth = |k: i32| if k % 130 < 100 { f64::from(100 - (2 * (k % 130) - 100).abs()) } else { 0.0 };
        let line = |k: i32| {
            format!("{} {} {} 12\n", 1_600_000_000 + 4 * k, if k == 33 { 1e35 } else { depth(k) }, if k % 130 < 50 { -25 } else { 25 })
        };
        std::fs::write(&path, (0..230).map(line).collect::<String>()).expect("written");
        assert!(super::super::import(&path, &[]).is_err(), "of no known kind yet");
        let readers: Vec<&'static Reader> = READERS.into_iter().chain([&LAB]).collect();
        let got = import_by(&readers, std::slice::from_ref(&path), &[], None).expect("an import");
        let deepest = got.flight.pressure_pa.iter().copied().fold(0.0, f64::max) * 1e-4;
        assert!((deepest - 30.48 / 0.993).abs() < 0.3 && got.flight.len() == 229, "{deepest} dbar, {} rows", got.flight.len());
        assert!((got.flight.pitch_rad[10] + 25_f64.to_radians()).abs() < 1e-12 && got.report.segments.len() == 2, "{:?}", got.report);
        std::fs::remove_file(path).ok();
    }

    #[test]
    fn regress_endings_that_are_not_read_are_answered_with_the_way() {
        for (name, said) in [
            ("f.csv.gz", "gunzip"),
            ("p1710104.nc.gz", "gunzip"),
            ("F.CSV.GZ", "gunzip"),
            ("raw.zip", "unzip"),
            ("raw.tar.gz", "tar xf"),
            ("log.mat", "writetable"),
            ("log.xlsx", "as csv"),
        ] {
            assert!(super::super::reader_of(Path::new(name)).is_none(), "{name}");
            assert!(way_to_readable(Path::new(name)).is_some_and(|way| way.contains(said)), "{name}");
        }
        let name_of = |path: &str| super::super::reader_of(Path::new(path)).map(|k| super::super::READERS[k].name);
        assert_eq!(name_of("table.tsv"), Some("csv"));
        assert_eq!(way_to_readable(Path::new("mat")), None);
        assert_eq!(name_of("sea035.12.gli.sub.36.gz"), Some("SeaExplorer raw files"));
    }
}

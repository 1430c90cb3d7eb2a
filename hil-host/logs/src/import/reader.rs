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
    use super::*;

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

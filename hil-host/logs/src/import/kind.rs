//! What a file is: by its name where the name says it, else by its first bytes.

use std::path::Path;

use super::{dba, seaexplorer, seaglider, seaglider_raw, slocum};

/// Kinds of files that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Slocum binary.
    Slocum,
    /// Slocum data as text.
    SlocumText,
    /// One dive of a Seaglider's base station.
    SeagliderDive,
    /// A Seaglider's own text files.
    SeagliderRaw,
    /// Raw text of a SeaExplorer.
    SeaExplorer,
    /// Any other NetCDF.
    Netcdf,
    /// Text with columns.
    Csv,
}

impl Kind {
    /// What it is called to a person.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Slocum => "Slocum binary",
            Self::SlocumText => "Slocum text (dba)",
            Self::SeagliderDive => "Seaglider dives",
            Self::SeagliderRaw => "Seaglider log and eng files",
            Self::SeaExplorer => "SeaExplorer raw files",
            Self::Netcdf => "NetCDF",
            Self::Csv => "csv",
        }
    }

    /// Whether several files of it make one flight.
    #[must_use]
    pub fn joins(self) -> bool {
        self != Self::Csv
    }

    /// The kind of `path`, none if it is not known.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_ascii_lowercase());
        match ending.as_str() {
            _ if slocum::is_slocum(path) => Some(Self::Slocum),
            _ if seaglider::dive_of(path).is_some() => Some(Self::SeagliderDive),
            _ if seaglider_raw::is_raw(path) => Some(Self::SeagliderRaw),
            _ if seaexplorer::name_of(path).is_some() => Some(Self::SeaExplorer),
            "nc" | "nc4" | "cdf" => Some(Self::Netcdf),
            _ if dba::is_dba(&head(path)) => Some(Self::SlocumText),
            "csv" | "csvp" | "csv0" | "tsv" | "txt" => Some(Self::Csv),
            _ => None,
        }
    }
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

/// The first bytes of a file.
fn head(path: &Path) -> Vec<u8> {
    let mut bytes = Vec::new();
    if let Ok(file) = std::fs::File::open(path) {
        let _ = std::io::Read::read_to_end(&mut std::io::Read::take(file, dba::HEAD as u64), &mut bytes);
    }
    bytes
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
            assert_eq!(Kind::of(Path::new(name)), None, "{name}");
            assert!(way_to_readable(Path::new(name)).is_some_and(|way| way.contains(said)), "{name}");
        }
        assert_eq!(Kind::of(Path::new("table.tsv")), Some(Kind::Csv));
        assert_eq!(way_to_readable(Path::new("mat")), None);
        assert_eq!(Kind::of(Path::new("sea035.12.gli.sub.36.gz")), Some(Kind::SeaExplorer));
    }
}

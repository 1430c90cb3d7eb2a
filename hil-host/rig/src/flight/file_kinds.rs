//! What a file is by its content, so that one named in place of another is answered with what it is and what belongs there.

use super::surfacing;
use anyhow::ensure;
use std::io::Read as _;
use std::path::Path;

/// What commands read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A csv of a flight, or the folder of one.
    Flight,
    /// A vehicle file.
    Vehicle,
    /// A mission file.
    Mission,
    /// A truth file of a simulated world.
    Truth,
    /// A flight table.
    Table,
    /// A controller configuration.
    Config,
    /// A flight image.
    Image,
    /// Messages of surfacings.
    Surfacings,
}

impl Kind {
    /// What belongs there, and where it comes from.
    fn way(self, path: &Path) -> String {
        match self {
            Self::Flight => "expected is a flight: its folder, or its csv; other files become one by glider import".into(),
            Self::Vehicle => match logs::vehicle::files_next_to(path).first().filter(|_| path.is_dir()) {
                Some(inside) => format!("did you mean `{}`?", inside.display()),
                None => "expected is a vehicle file (.json or .toml); built in: glider list vehicles".into(),
            },
            Self::Mission => "expected is a mission file (TOML with [[leg]]), or one by name: glider list missions".into(),
            Self::Truth => "expected is a truth file (TOML): docs/truth-file.md".into(),
            Self::Table => "expected is a flight table (.bin): glider table --out FOLDER writes one".into(),
            Self::Config => "expected is a controller configuration (.toml): glider upload PORT config --read shows one".into(),
            Self::Image => "expected is a firmware image (ELF): scripts/build-firmware makes it".into(),
            Self::Surfacings => "expected are messages of surfacings: a file .srf, or the log of a terminal".into(),
        }
    }
}

/// What a file looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Seen {
    Is(Kind),
    FlightFolder,
    Folder,
    NetCdf,
    Json,
}

impl Seen {
    const fn words(self) -> &'static str {
        match self {
            Self::Is(Kind::Flight) => "a csv",
            Self::Is(Kind::Vehicle) => "a vehicle file",
            Self::Is(Kind::Mission) => "a mission file",
            Self::Is(Kind::Truth) => "a truth file",
            Self::Is(Kind::Table) => "a flight table",
            Self::Is(Kind::Config) => "a controller configuration",
            Self::Is(Kind::Image) => "a firmware image",
            Self::FlightFolder => "the folder of a flight",
            Self::Folder => "a folder",
            Self::NetCdf => "a NetCDF file",
            Self::Json => "a JSON file",
            Self::Is(Kind::Surfacings) => "messages of surfacings",
        }
    }
}

/// What a file looks like; none: not known, and its reader says what is wrong with it.
fn seen(path: &Path) -> Option<Seen> {
    if path.is_dir() {
        return Some(if logs::record::csv::csv_of(path).is_ok() { Seen::FlightFolder } else { Seen::Folder });
    }
    // Of a pipe the first bytes would be lost to its reader, or never come.
    if !path.is_file() {
        return None;
    }
    let mut head = Vec::new();
    std::fs::File::open(path).ok()?.take(1 << 16).read_to_end(&mut head).ok()?;
    match head.as_slice() {
        [0x7f, b'E', b'L', b'F', ..] => Some(Seen::Is(Kind::Image)),
        [0x89, b'H', b'D', b'F', ..] | [b'C', b'D', b'F', ..] => Some(Seen::NetCdf),
        _ if surfacing::begins(&head) => Some(Seen::Is(Kind::Surfacings)),
        _ => of_text(std::str::from_utf8(&head).ok()?),
    }
}

/// Whether a file is messages of surfacings, or a terminal's log with some.
#[must_use]
pub fn is_surfacings(path: &Path) -> bool {
    seen(path) == Some(Seen::Is(Kind::Surfacings))
}

fn of_text(text: &str) -> Option<Seen> {
    let text = text.trim_start_matches('\u{feff}');
    let lines = || text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with('#'));
    let first = lines().next()?;
    if first.starts_with('{') {
        let vehicle = ["\"hydro\"", "\"mass_kg\"", "\"glider-"].iter().any(|key| text.contains(key));
        return Some(if vehicle { Seen::Is(Kind::Vehicle) } else { Seen::Json });
    }
    let begins = |heads: &[&str]| lines().any(|l| heads.iter().any(|h| l.starts_with(h)));
    // A truth file has a mass too, in a table of its own.
    let top = |heads: &[&str]| lines().take_while(|l| !l.starts_with('[')).any(|l| heads.iter().any(|h| l.starts_with(h)));
    let columns = first.split([',', ';', '\t']).count();
    let kind = if top(&["format = \"glider-", "mass_kg"]) || begins(&["[hydro]"]) {
        Kind::Vehicle
    } else if begins(&["[[leg]]"]) {
        Kind::Mission
    } else if begins(&["[[effects]]", "[ocean", "[actuators", "[[faults]]"]) {
        Kind::Truth
    } else if columns > 2 && !first.contains('=') {
        Kind::Flight
    } else {
        return None;
    };
    Some(Seen::Is(kind))
}

/// Refuses a file that is plainly of another kind; one whose kind is not known goes on to its reader.
///
/// # Errors
/// What it is, and what belongs there.
pub fn expect(path: &Path, wanted: Kind) -> anyhow::Result<()> {
    let found = seen(path);
    let fits = match found {
        Some(Seen::Is(kind)) => kind == wanted,
        // Its reader says what the folder lacks.
        Some(Seen::FlightFolder | Seen::Folder) => wanted == Kind::Flight,
        // A vehicle may be JSON with keys of its own.
        Some(Seen::Json) => wanted == Kind::Vehicle,
        Some(Seen::NetCdf) => false,
        // An image is nothing but an image.
        None => wanted != Kind::Image,
    };
    ensure!(fits, "{}: is {}; {}", path.display(), found.map_or("no firmware image", Seen::words), wanted.way(path));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine as _;
    use base64::engine::general_purpose::STANDARD;

    #[test]
    fn messages_of_surfacings_are_recognised_in_a_file_and_in_a_terminal_log() {
        let path = std::env::temp_dir().join(format!("glider-kind-{}", std::process::id()));
        let is = |bytes: &[u8]| {
            std::fs::write(&path, bytes).expect("written");
            is_surfacings(&path)
        };
        let message = signals::Surfacing::default().encode();
        let line = format!("GliderDos I -3 >\nsurfacing,{}\n", STANDARD.encode(&message));
        assert!(is(&message) && is(line.as_bytes()) && is(&[&message[..], &[7; 9]].concat()));
        assert!(!is(b"time_s,surfacing,\n1,2,3\n") && !is(&message[..53]) && !is(b"surfacing,\n") && !is(b""));
        std::fs::remove_file(&path).expect("removed");
    }

    #[test]
    fn every_kind_is_recognised_by_its_content() {
        for vehicle in ["comet", "modena", "slocum-standard", "slocum-low-ar-sea"] {
            let text =
                std::fs::read_to_string(format!("{}/../../vehicles/{vehicle}.toml", env!("CARGO_MANIFEST_DIR"))).expect("a vehicle file");
            assert_eq!(of_text(&text), Some(Seen::Is(Kind::Vehicle)), "{vehicle}");
        }
        assert_eq!(of_text("{\n  \"mass_kg\": 60.0\n}"), Some(Seen::Is(Kind::Vehicle)));
        assert_eq!(of_text("# two\nwings = \"low-ar\"\n\n[[leg]]\ndives = 2\n"), Some(Seen::Is(Kind::Mission)));
        assert_eq!(
            of_text("[ocean]\nbackground_rms_m_s = 0.003\n[vehicle]\nmass_kg = 61.0\n[[effects]]\nkind = \"stall\"\n"),
            Some(Seen::Is(Kind::Truth))
        );
        assert_eq!(of_text("[vehicle]\nmass_kg = 61.0\n"), None, "a truth file, or a cut vehicle file");
        assert_eq!(of_text("time_s,pressure_dbar,m_pitch_rad\n1,2,3\n"), Some(Seen::Is(Kind::Flight)));
        // What a person has cut or misspelt stays with its reader, which names the line.
        for text in ["", "dives = 3\n", "nothing to fly\n", "crush_depth_m = 240.0\n", "effects = \"drag\"\n"] {
            assert_eq!(of_text(text), None, "{text}");
        }
    }
}

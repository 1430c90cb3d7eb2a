//! What a file is by its content, so that one named in place of another is answered with what it is and what belongs there.

use anyhow::bail;
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
}

impl Kind {
    /// What belongs there, and where it comes from.
    fn way(self, path: &Path) -> String {
        match self {
            Self::Flight => "expected is a flight: its folder, or its csv; other files become one by glider import".into(),
            Self::Vehicle => match discovery::vehicle::file_next_to(path).filter(|_| path.is_dir()) {
                Some(inside) => format!("did you mean `{}`?", inside.display()),
                None => "expected is a vehicle file (.json or .toml); built in: glider list vehicles".into(),
            },
            Self::Mission => "expected is a mission file (TOML with [[leg]]), or one by name: glider list missions".into(),
            Self::Truth => "expected is a truth file (TOML): docs/truth-file.md".into(),
            Self::Table => "expected is a flight table (.bin): glider table --out FOLDER writes one".into(),
            Self::Config => "expected is a controller configuration (.toml): glider upload PORT config --read shows one".into(),
            Self::Image => "expected is a firmware image (ELF): scripts/build-firmware makes it".into(),
        }
    }
}

/// What a file looks like: its kind, and how a person calls it.
type Seen = (Option<Kind>, &'static str);

/// What a file looks like; none: not known, and its reader says what is wrong with it.
fn seen(path: &Path) -> Option<Seen> {
    if path.is_dir() {
        let flight = discovery::record::csv::csv_of(path).is_ok();
        return Some(if flight { (Some(Kind::Flight), "the folder of a flight") } else { (None, "a folder") });
    }
    let mut head = Vec::new();
    std::fs::File::open(path).ok()?.take(1 << 16).read_to_end(&mut head).ok()?;
    match head.as_slice() {
        [0x7f, b'E', b'L', b'F', ..] => return Some((Some(Kind::Image), "a firmware image")),
        [0x89, b'H', b'D', b'F', ..] | [b'C', b'D', b'F', ..] => return Some((None, "a NetCDF file")),
        _ => {}
    }
    of_text(std::str::from_utf8(&head).ok()?)
}

fn of_text(text: &str) -> Option<Seen> {
    let lines = || text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with('#'));
    let first = lines().next()?;
    if first.starts_with('{') {
        let vehicle = ["\"hydro\"", "\"mass_kg\"", "\"glider-"].iter().any(|key| text.contains(key));
        return Some(if vehicle { (Some(Kind::Vehicle), "a vehicle file") } else { (None, "a JSON file") });
    }
    let begins = |heads: &[&str]| lines().any(|l| heads.iter().any(|h| l.starts_with(h)));
    // A truth file has a mass too, in a table of its own.
    let top = |heads: &[&str]| lines().take_while(|l| !l.starts_with('[')).any(|l| heads.iter().any(|h| l.starts_with(h)));
    if top(&["format = \"glider-", "mass_kg"]) || begins(&["[hydro]"]) {
        return Some((Some(Kind::Vehicle), "a vehicle file"));
    }
    if begins(&["[[leg]]"]) {
        return Some((Some(Kind::Mission), "a mission file"));
    }
    if begins(&["[[effects]]", "[ocean", "[actuators", "[[faults]]"]) {
        return Some((Some(Kind::Truth), "a truth file"));
    }
    let columns = first.split([',', ';', '\t']).count();
    (columns > 2 && !first.contains('=')).then_some((Some(Kind::Flight), "a csv"))
}

/// Refuses a file that is plainly of another kind; one that cannot be told goes on to its reader.
///
/// # Errors
/// What it is, and what belongs there.
pub fn expect(path: &Path, wanted: Kind) -> anyhow::Result<()> {
    if wanted == Kind::Flight && path.is_dir() {
        // Its reader says what the folder lacks.
        return Ok(());
    }
    let seen = seen(path).filter(|s| s.0 != Some(wanted));
    // A vehicle may be JSON in words of its own; an image is nothing but an image.
    let seen = seen.filter(|s| !(wanted == Kind::Vehicle && s.1 == "a JSON file"));
    let seen = seen.or((wanted == Kind::Image && !is_image(path)).then_some((None, "no firmware image")));
    match seen {
        Some((_, what)) => bail!("{}: is {what}; {}", path.display(), wanted.way(path)),
        None => Ok(()),
    }
}

fn is_image(path: &Path) -> bool {
    matches!(seen(path), Some((Some(Kind::Image), _)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_told_by_its_content() {
        let of = |text: &str| of_text(text).and_then(|s| s.0);
        for vehicle in ["comet", "modena", "slocum-standard", "slocum-low-ar-sea"] {
            let text =
                std::fs::read_to_string(format!("{}/../vehicles/{vehicle}.toml", env!("CARGO_MANIFEST_DIR"))).expect("a vehicle file");
            assert_eq!(of(&text), Some(Kind::Vehicle), "{vehicle}");
        }
        assert_eq!(of("{\n  \"mass_kg\": 60.0\n}"), Some(Kind::Vehicle));
        assert_eq!(of("# two\nwings = \"low-ar\"\n\n[[leg]]\ndives = 2\n"), Some(Kind::Mission));
        assert_eq!(
            of("[ocean]\nbackground_rms_m_s = 0.003\n[vehicle]\nmass_kg = 61.0\n[[effects]]\nkind = \"stall\"\n"),
            Some(Kind::Truth)
        );
        assert_eq!(of("[vehicle]\nmass_kg = 61.0\n"), None, "a truth file, or a cut vehicle file");
        assert_eq!(of("time_s,pressure_dbar,m_pitch_rad\n1,2,3\n"), Some(Kind::Flight));
        // What a person has cut or misspelt stays with its reader, which names the line.
        for text in ["", "dives = 3\n", "nothing to fly\n", "crush_depth_m = 240.0\n", "effects = \"drag\"\n"] {
            assert_eq!(of(text), None, "{text}");
        }
    }
}

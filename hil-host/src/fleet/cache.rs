//! What is kept of a flight: what its dives say, under the hash of everything that goes into it: the flight's bytes, the vehicle file's, and
//! the program's.

use logs::record::bounded;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use logs::digest::hex;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use crate::fleet::part::DiveRow;
use rig::flight::vehicles;

/// What the dives of a flight say, or why nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Rows, the dives in order.
    pub rows: Vec<DiveRow>,
    /// Why the flight was left out; empty where it was not.
    pub left_out: String,
}

fn feed(hash: &mut Sha256, path: &Path) -> anyhow::Result<()> {
    if path.is_dir() {
        let mut inner: Vec<PathBuf> =
            std::fs::read_dir(path).with_context(|| path.display().to_string())?.filter_map(|e| e.ok().map(|e| e.path())).collect();
        inner.sort();
        return inner.iter().filter(|p| p.is_file()).try_for_each(|p| feed(hash, p));
    }
    let bytes = bounded::bytes(path, bounded::LOG).with_context(|| path.display().to_string())?;
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    hash.update((name.len() as u64).to_le_bytes());
    hash.update(name);
    hash.update((bytes.len() as u64).to_le_bytes());
    hash.update(bytes);
    Ok(())
}

/// Key of a flight.
///
/// # Errors
/// A file that cannot be read.
pub fn key(program: &str, columns: &[String], files: &[PathBuf], vehicle: &Path) -> anyhow::Result<String> {
    let mut hash = Sha256::new();
    hash.update(program);
    columns.iter().for_each(|c| hash.update(c));
    if vehicles::is_built_in(vehicle) {
        hash.update(vehicles::text(vehicle)?);
    } else {
        feed(&mut hash, vehicle)?;
    }
    files.iter().try_for_each(|f| feed(&mut hash, f))?;
    Ok(hex(&hash.finalize()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_changes_with_flight_vehicle_and_program() {
        let folder = std::env::temp_dir().join(format!("glider-key-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("flight")).expect("a folder");
        let (log, vehicle) = (folder.join("flight/flight.csv"), folder.join("v.json"));
        std::fs::write(&log, "a").expect("written");
        std::fs::write(&vehicle, "v").expect("written");
        let key = |program: &str| key(program, &["drag".into()], &[folder.join("flight")], &vehicle).expect("a key");
        let first = key("p");
        assert!(first == key("p") && first != key("q") && first.len() == 64);
        std::fs::write(&vehicle, "w").expect("written");
        let second = key("p");
        std::fs::write(&log, "b").expect("written");
        assert!(second != first && key("p") != second);
        std::fs::remove_dir_all(&folder).expect("removed");
    }
}

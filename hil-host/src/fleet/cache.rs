//! One file a flight with what its dives say, named by the hash of everything that goes into it: the flight's bytes, the vehicle file's,
//! and the program's. A file is there whole or not at all, so a run that is killed goes on where it was.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use anyhow::Context as _;
use discovery::workbench::refitted_file::{hex, sha256};
use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};

use crate::fleet::part::DiveRow;
use crate::whole_file;

/// What the dives of a flight say, or why nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Rows, the dives in order.
    pub rows: Vec<DiveRow>,
    /// Why the flight was left out; empty where it was not.
    pub left_out: String,
}

static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// Says which file is the program, where this is a part of another (an extension module of Python); once.
pub fn program_is(file: PathBuf) {
    PROGRAM.get_or_init(|| file);
}

/// Hash of the program that runs: what another build says is asked anew.
///
/// # Errors
/// The program's file cannot be read.
pub fn program() -> anyhow::Result<String> {
    let file = PROGRAM.get().cloned().map_or_else(std::env::current_exe, Ok).context("the program does not know its own file")?;
    Ok(sha256(&std::fs::read(&file).with_context(|| file.display().to_string())?))
}

fn feed(hash: &mut Sha256, path: &Path) -> anyhow::Result<()> {
    if path.is_dir() {
        let mut inner: Vec<PathBuf> =
            std::fs::read_dir(path).with_context(|| path.display().to_string())?.filter_map(|e| e.ok().map(|e| e.path())).collect();
        inner.sort();
        return inner.iter().filter(|p| p.is_file()).try_for_each(|p| feed(hash, p));
    }
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let name = path.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    hash.update((name.len() as u64).to_le_bytes());
    hash.update(name);
    hash.update((bytes.len() as u64).to_le_bytes());
    hash.update(bytes);
    Ok(())
}

/// Name of a flight's file in the cache.
///
/// # Errors
/// A file that cannot be read.
pub fn key(program: &str, columns: &[String], files: &[PathBuf], vehicle: &Path) -> anyhow::Result<String> {
    let mut hash = Sha256::new();
    hash.update(program);
    columns.iter().for_each(|c| hash.update(c));
    feed(&mut hash, vehicle)?;
    files.iter().try_for_each(|f| feed(&mut hash, f))?;
    Ok(hex(&hash.finalize()))
}

fn file(folder: &Path, key: &str) -> PathBuf {
    folder.join(format!("{key}.json"))
}

/// Puts an entry into the cache.
///
/// # Errors
/// The folder cannot be written.
pub fn store(folder: &Path, key: &str, entry: &Entry) -> anyhow::Result<()> {
    // As text: JSON readers may round a number's last bit, and the bytes of a table must not depend on whether it was kept.
    let bits = |v: &f64| format!("{:016x}", v.to_bits());
    let rows: Vec<Value> = entry
        .rows
        .iter()
        .map(|r| json!({"dive": r.dive, "segment": r.segment, "rows": r.rows, "numbers": r.numbers.iter().map(bits).collect::<Vec<_>>()}))
        .collect();
    let document = json!({"key": key, "left_out": entry.left_out, "rows": rows});
    let path = file(folder, key);
    whole_file::write(&path, format!("{document}\n")).with_context(|| format!("cannot write {}", path.display()))
}

/// The entry of a key; none where it is not there or is no whole one.
#[must_use]
pub fn load(folder: &Path, key: &str, numbers: usize) -> Option<Entry> {
    let document: Value = serde_json::from_slice(&std::fs::read(file(folder, key)).ok()?).ok()?;
    if document["key"] != key {
        return None;
    }
    let whole = |v: &Value| i32::try_from(v.as_i64()?).ok();
    let row = |r: &Value| -> Option<DiveRow> {
        let bits = |v: &Value| u64::from_str_radix(v.as_str()?, 16).ok().map(f64::from_bits);
        let all: Vec<f64> = r["numbers"].as_array()?.iter().map(bits).collect::<Option<_>>()?;
        (all.len() == numbers).then_some(DiveRow {
            dive: whole(&r["dive"])?,
            segment: whole(&r["segment"])?,
            rows: whole(&r["rows"])?,
            numbers: all,
        })
    };
    Some(Entry {
        rows: document["rows"].as_array()?.iter().map(row).collect::<Option<_>>()?,
        left_out: document["left_out"].as_str()?.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_entry_comes_back_bit_by_bit_and_a_cut_one_is_not_there() {
        let folder = std::env::temp_dir().join(format!("glider-cache-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let row = DiveRow { dive: 1, segment: 0, rows: 99, numbers: vec![0.1 + 0.2, f64::NAN, -0.0] };
        let entry = Entry { rows: vec![row], left_out: String::new() };
        store(&folder, "ab", &entry).expect("written");
        let back = load(&folder, "ab", 3).expect("there");
        let bits = |e: &Entry| e.rows[0].numbers.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&back), bits(&entry));
        assert!(load(&folder, "ab", 2).is_none(), "of another table");
        let text = std::fs::read_to_string(folder.join("ab.json")).expect("there");
        std::fs::write(folder.join("ab.json"), &text[..text.len() / 2]).expect("written");
        assert!(load(&folder, "ab", 3).is_none() && load(&folder, "cd", 3).is_none());
        std::fs::remove_dir_all(&folder).expect("removed");
    }

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

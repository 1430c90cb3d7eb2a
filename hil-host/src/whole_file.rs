//! Files are written beside their name and renamed: whole or not at all; and none is replaced that nobody meant to replace.
//!
//! A killed program or a full disk leaves the old file, or none, under the final name; at most a `.part` beside it.

use std::io;
use std::path::{Path, PathBuf};

use anyhow::ensure;

/// The name beside `path` under which it is written first.
fn part_of(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.part", std::process::id()))
}

/// Writes `path` whole, in place of what is there.
///
/// # Errors
/// The disk is full, the folder is not there or may not be written.
pub fn write(path: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> io::Result<()> {
    through(path.as_ref(), |file| io::Write::write_all(file, bytes.as_ref()))
}

/// Writes `path` whole by what `f` writes.
///
/// # Errors
/// Those of `f`, and as [`write()`].
pub fn through<E: From<io::Error>>(path: &Path, f: impl FnOnce(&mut std::fs::File) -> Result<(), E>) -> Result<(), E> {
    at(path, |part| {
        let mut file = std::fs::File::create(part)?;
        f(&mut file)?;
        file.sync_all()?;
        Ok(())
    })
}

/// Makes `path` of what `f` makes under the name that it is given, a file or a folder.
///
/// # Errors
/// Those of `f`, and as [`write()`].
pub fn at<E: From<io::Error>>(path: &Path, f: impl FnOnce(&Path) -> Result<(), E>) -> Result<(), E> {
    let part = part_of(path);
    let made = f(&part).and_then(|()| Ok(std::fs::rename(&part, path)?));
    if made.is_err() {
        let _ = if part.is_dir() { std::fs::remove_dir_all(&part) } else { std::fs::remove_file(&part) };
    }
    made
}

/// Whether `out` may be written: it is none of the inputs, ends as its content does, and is not there yet unless `force`.
///
/// # Errors
/// Why not, with the way out.
pub fn may_write(out: &Path, inputs: &[&Path], endings: &[&str], force: bool) -> anyhow::Result<()> {
    let name = out.display();
    let same = |a: &Path, b: &Path| a == b || a.canonicalize().is_ok_and(|a| b.canonicalize().is_ok_and(|b| a == b));
    for input in inputs {
        ensure!(!same(out, input), "{name}: is an input of this command; name another file with --out");
        // A flight named by its folder is the files in it.
        let inside = ["flight.csv", "vehicle.json", "vehicle.toml", "import.json"].iter().any(|n| same(out, &input.join(n)));
        ensure!(!inside, "{name}: belongs to the flight that is read; name another file with --out");
    }
    let ending = out.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    if !endings.is_empty() {
        let all: Vec<String> = endings.iter().map(|e| format!(".{e}")).collect();
        ensure!(endings.contains(&ending.as_str()), "{name}: would be written as {}; end its name so", all.join(" or "));
    }
    ensure!(!out.is_dir(), "{name}: is a folder; name a file");
    ensure!(force || !out.exists(), "{name}: exists; name another file, or replace it with --force");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("glider-whole-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        folder
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_no_other() {
        let folder = folder("old");
        let path = folder.join("a.json");
        write(&path, "old").expect("written");
        let failed: io::Result<()> = through(&path, |file| {
            io::Write::write_all(file, b"half")?;
            Err(io::Error::other("disk full"))
        });
        assert!(failed.is_err());
        assert_eq!(std::fs::read_to_string(&path).expect("there"), "old");
        assert_eq!(std::fs::read_dir(&folder).expect("a folder").count(), 1);
        std::fs::remove_dir_all(&folder).expect("removed");
    }

    #[test]
    fn inputs_existing_files_and_other_endings_are_refused() {
        let folder = folder("refused");
        let (csv, other) = (folder.join("flight.csv"), folder.join("there.json"));
        write(&csv, "x").expect("written");
        write(&other, "x").expect("written");
        let refused =
            |out: &Path, force| may_write(out, &[&folder], &["json", "csv"], force).map_err(|e| e.to_string()).expect_err("refused");
        assert!(refused(&csv, true).contains("belongs to the flight"));
        assert!(refused(&folder.join("a.html"), true).contains(".json or .csv"));
        assert!(refused(&other, false).contains("--force"));
        let round_about = folder.join("..").join(folder.file_name().expect("a name")).join("flight.csv");
        assert!(refused(&round_about, true).contains("belongs"), "by another way to the same file");
        assert!(
            may_write(&other, &[&folder], &["json"], true).is_ok()
                && may_write(&folder.join("new.json"), &[&folder], &["json"], false).is_ok()
        );
        std::fs::remove_dir_all(&folder).expect("removed");
    }
}

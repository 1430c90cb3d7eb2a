//! Files are written beside their name and renamed: whole or not at all; and none is replaced that nobody meant to replace.
//!
//! A killed program or a full disk leaves the old file, or none, under the final name; at most a `.part` next to it, which the next command
//! that may write the file clears away.

use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context as _, bail, ensure};

/// The name beside `path` under which it is written first.
fn part_of(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.part", std::process::id()))
}

/// Age from which a part is left over: until then it may be written by a process of another machine, which is not seen from here.
const LEFT_OVER: Duration = Duration::from_secs(60);

/// Removes the parts of `path` that killed programs left: old ones, of processes that no longer live (seen on Linux alone).
fn clear_left_over(path: &Path) {
    let begin = format!(".{}.", path.file_name().unwrap_or_default().to_string_lossy());
    let left_over = |e: std::fs::DirEntry| {
        let id: u32 = e.file_name().to_str()?.strip_prefix(&begin)?.strip_suffix(".part")?.parse().ok()?;
        let is_dead = Path::new("/proc/self").exists() && !Path::new(&format!("/proc/{id}")).exists();
        (is_dead && e.metadata().ok()?.modified().ok()?.elapsed().ok()? > LEFT_OVER).then(|| e.path())
    };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    std::fs::read_dir(folder).into_iter().flatten().flatten().filter_map(left_over).for_each(|part| remove(&part));
}

fn remove(part: &Path) {
    let _ = if part.is_dir() { std::fs::remove_dir_all(part) } else { std::fs::remove_file(part) };
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

/// Makes `path` of what `f` makes under the name that it is given, a file or a folder; the folder that it is to lie in is made too.
///
/// # Errors
/// Those of `f`, and as [`write()`].
pub fn at<E: From<io::Error>>(path: &Path, f: impl FnOnce(&Path) -> Result<(), E>) -> Result<(), E> {
    let part = part_of(path);
    if let Some(folder) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder)?;
    }
    let made = f(&part).and_then(|()| Ok(std::fs::rename(&part, path)?));
    if made.is_err() {
        remove(&part);
    }
    made
}

/// Makes the folder `path` of what `f` makes under the name that it is given, in place of a folder that holds files of these names.
///
/// Whenever the program is killed, the old folder or the new one is whole: for the moment between two renames both lie beside `path`, under
/// names that begin with a dot.
///
/// # Errors
/// Those of `f`, and as [`write()`]; then the old folder stays.
pub fn in_place_of<E: From<io::Error>>(path: &Path, names: &[&str], f: impl FnOnce(&Path) -> Result<(), E>) -> Result<(), E> {
    let old = part_of(path).with_extension("old");
    let mut moved = false;
    let made = at(path, |part| {
        f(part)?;
        for file in std::fs::read_dir(part)? {
            std::fs::File::open(file?.path())?.sync_all()?;
        }
        if path.exists() {
            std::fs::rename(path, &old)?;
            moved = true;
        }
        Ok(())
    });
    if moved && made.is_err() {
        std::fs::rename(&old, path)?;
    } else if moved {
        // By name: what came in meanwhile stays where it can be found.
        names.iter().for_each(|n| drop(std::fs::remove_file(old.join(n))));
        let _ = std::fs::remove_dir(&old);
    }
    made
}

/// Whether the folder `out` may be written: it is not there yet, or with `force` holds nothing but files of these names (with the first of
/// them, unless it is empty) and none of the inputs. What killed programs left of it goes.
///
/// # Errors
/// Why not, with the way out.
pub fn may_write_folder(out: &Path, inputs: &[&Path], names: &[&str], force: bool) -> anyhow::Result<()> {
    let name = out.display();
    clear_left_over(out);
    if !out.exists() {
        return Ok(());
    }
    let way = if out.is_dir() { "; its files are replaced with --force" } else { "" };
    ensure!(force, "{name} exists: name a new folder with --out, nothing is overwritten{way}");
    ensure!(out.is_dir(), "{name}: is a file, which is not replaced by a folder; name another with --out");
    let whole = out.canonicalize().with_context(|| format!("{name}: cannot be read"))?;
    let holds = |path: &Path| path.canonicalize().is_ok_and(|p| p.starts_with(&whole));
    if let Some(input) = inputs.iter().find(|i| holds(i)) {
        bail!("{name}: is or holds {}, which this command reads; name another folder with --out", input.display());
    }
    ensure!(!holds(Path::new(".")), "{name}: is or holds the folder you are in, which cannot be replaced; name another with --out");
    let inside = std::fs::read_dir(out).with_context(|| format!("{name}: cannot be read"))?.flatten();
    let is_own = |e: &std::fs::DirEntry| names.iter().any(|n| e.file_name() == *n) && !e.path().is_dir();
    let (own, mut others): (Vec<_>, Vec<_>) = inside.partition(is_own);
    others.sort_by_key(std::fs::DirEntry::file_name);
    let listed: Vec<String> = others.iter().take(6).map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    let more = if others.len() > 6 { format!(" and {} more", others.len() - 6) } else { String::new() };
    ensure!(others.is_empty(), "{name}: holds {}{more} too, which would be lost; name another folder with --out", listed.join(", "));
    let mark = names.first().copied().unwrap_or_default();
    ensure!(own.is_empty() || out.join(mark).exists(), "{name}: has no {mark}: not made by this command; name another folder with --out");
    Ok(())
}

/// Whether `out` may be written: it is none of the inputs, ends as its content does, and is not there yet unless `force`. What killed
/// programs left of it goes.
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
    clear_left_over(out);
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
        let deep = folder.join("new/folder/b.json");
        write(&deep, "b").expect("with its folder");
        assert_eq!(std::fs::read_to_string(&deep).expect("there"), "b");
        std::fs::remove_dir_all(&folder).expect("removed");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn regress_parts_of_killed_programs_are_cleared_away() {
        let folder = folder("parts");
        let mut child = std::process::Command::new("true").spawn().expect("starts");
        child.wait().expect("ends");
        let [dead, own] = [child.id(), std::process::id()];
        let age = |path: &Path, seconds| {
            let file = std::fs::File::open(path).expect("there");
            file.set_modified(std::time::SystemTime::now() - Duration::from_secs(seconds)).expect("set");
        };
        let names = [format!(".a.nc.{dead}.part"), format!(".b.nc.{dead}.part"), format!(".a.nc.{own}.part"), format!(".x.{dead}.part")];
        for name in &names[..3] {
            std::fs::write(folder.join(name), "half").expect("written");
        }
        std::fs::create_dir(folder.join(&names[3])).expect("made");
        names.iter().for_each(|name| age(&folder.join(name), 61));
        may_write(&folder.join("a.nc"), &[], &["nc"], false).expect("it may");
        may_write_folder(&folder.join("x"), &[], &[], false).expect("it may");
        assert_eq!([0, 1, 2, 3].map(|i| folder.join(&names[i]).exists()), [false, true, true, false]);
        age(&folder.join(&names[1]), 3);
        may_write(&folder.join("b.nc"), &[], &["nc"], false).expect("it may");
        assert!(folder.join(&names[1]).exists(), "it may be of another machine");
        std::fs::remove_dir_all(&folder).expect("removed");
    }

    #[test]
    fn a_folder_is_replaced_whole_and_only_where_nothing_else_is_lost() {
        const NAMES: [&str; 2] = ["import.json", "flight.csv"];
        let folder = folder("folder");
        let out = folder.join("out");
        let said =
            |inputs: &[&Path], force| may_write_folder(&out, inputs, &NAMES, force).map_err(|e| e.to_string()).err().unwrap_or_default();
        let put = |name: &str, text: &str| write(out.join(name), text).expect("written");
        assert_eq!(said(&[&folder], false), "", "a new one, inside of what is read");
        std::fs::create_dir(&out).expect("made");
        assert_eq!(said(&[], true), "", "an empty one");
        put("flight.csv", "old");
        assert!(said(&[], true).contains("has no import.json"));
        put("import.json", "old");
        assert!(said(&[], false).contains("nothing is overwritten; its files are replaced with --force"));
        assert_eq!(said(&[&folder], true), "");
        assert!(said(&[&out], true).contains("which this command reads") && said(&[&out.join("flight.csv")], true).contains("reads"));
        put("notes.txt", "mine");
        assert!(said(&[], true).contains("holds notes.txt too"), "{}", said(&[], true));
        std::fs::remove_file(out.join("notes.txt")).expect("removed");
        // A failure leaves the old one, a success nothing but the new one.
        let failed: io::Result<()> = in_place_of(&out, &NAMES, |part| {
            std::fs::create_dir(part)?;
            Err(io::Error::other("disk full"))
        });
        assert!(failed.is_err() && std::fs::read(out.join("flight.csv")).expect("there") == b"old");
        let made: io::Result<()> = in_place_of(&out, &NAMES, |part| {
            std::fs::create_dir(part)?;
            std::fs::write(part.join("import.json"), "new")
        });
        made.expect("made");
        assert_eq!(std::fs::read(out.join("import.json")).expect("there"), b"new");
        assert_eq!((std::fs::read_dir(&out).expect("it").count(), std::fs::read_dir(&folder).expect("it").count()), (1, 1));
        write(folder.join("file"), "x").expect("written");
        assert!(may_write_folder(&folder.join("file"), &[], &NAMES, true).is_err_and(|e| e.to_string().contains("is a file")));
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

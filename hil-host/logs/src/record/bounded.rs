//! Files read whole, with a bound: a device has no end, a pipe may never begin, and a file larger than memory ends the program.

use std::fs::File;
use std::io::{Error, ErrorKind, Read as _, Result};
use std::path::Path;

/// Most bytes of a log: a year of a glider's rows as text is half of that.
pub const LOG: u64 = 2 << 30;
/// Most bytes of what people write or programs leave for them: vehicle, mission, truth, configuration, flight table.
pub const DOCUMENT: u64 = 16 << 20;

fn refused(why: String) -> Error {
    Error::new(ErrorKind::InvalidInput, why)
}

fn larger(most: u64) -> Error {
    refused(format!("is larger than {} MB, the most that is read of such a file", most >> 20))
}

/// A regular file that has at most `most` bytes, for a reader that goes about in it.
///
/// # Errors
/// What the system says; that it is no regular file, or larger, with the bound.
pub fn file(path: &Path, most: u64) -> Result<File> {
    let known = std::fs::metadata(path)?;
    if !known.is_file() && !known.is_dir() {
        return Err(refused(format!(
            "is no regular file but a pipe, a socket or a device: copy what comes out of it to a file first (at most {} MB are read)",
            most >> 20
        )));
    }
    if known.len() > most { Err(larger(most)) } else { File::open(path) }
}

/// The bytes of a regular file that has at most `most`.
///
/// # Errors
/// As [`file()`].
pub fn bytes(path: &Path, most: u64) -> Result<Vec<u8>> {
    let file = file(path, most)?;
    let mut out = Vec::with_capacity(usize::try_from(file.metadata()?.len().min(most)).unwrap_or(0));
    // It may grow while it is read, or say that it is empty.
    file.take(most + 1).read_to_end(&mut out)?;
    if out.len() as u64 > most { Err(larger(most)) } else { Ok(out) }
}

/// The same as text.
///
/// # Errors
/// The same, and [`ErrorKind::InvalidData`] where it is not UTF-8.
pub fn text(path: &Path, most: u64) -> Result<String> {
    String::from_utf8(bytes(path, most)?).map_err(|e| Error::new(ErrorKind::InvalidData, e.utf8_error()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_endless_and_oversized_files_are_refused_with_the_bound() {
        let why = bytes(Path::new("/dev/zero"), DOCUMENT).expect_err("refused").to_string();
        assert!(why.contains("a device") && why.contains("16 MB"), "{why}");
        let path = std::env::temp_dir().join(format!("glider-bounded-{}", std::process::id()));
        std::fs::write(&path, "seven b").expect("written");
        assert_eq!(text(&path, 7).expect("read"), "seven b");
        let kept = std::fs::File::options().write(true).open(&path).expect("a file");
        // A hole: nothing of it is on the disk.
        kept.set_len(DOCUMENT + 1).expect("grown");
        let why = bytes(&path, DOCUMENT).expect_err("refused").to_string();
        assert!(why.contains("larger than 16 MB"), "{why}");
        std::fs::remove_file(&path).expect("removed");
    }
}

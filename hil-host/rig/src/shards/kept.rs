//! Results under the hash of everything that goes into them, in a folder or in memory.
//!
//! A file is there whole or not at all, and one that was cut is taken for none: a run that is killed goes on where it was.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use anyhow::Context as _;
use logs::digest::{hex, sha256};
use logs::record::bounded;
use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest as _, Sha256};

use crate::whole_file;

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
    static HASH: OnceLock<String> = OnceLock::new();
    if let Some(known) = HASH.get() {
        return Ok(known.clone());
    }
    let file = PROGRAM.get().cloned().map_or_else(std::env::current_exe, Ok).context("the program does not know its own file")?;
    let hash = sha256(&bounded::bytes(&file, bounded::LOG).with_context(|| file.display().to_string())?);
    Ok(HASH.get_or_init(|| hash).clone())
}

/// Key of an item: the hash of the program and of all that is named, each separated from the next.
///
/// # Errors
/// The program's file cannot be read.
pub fn key(of: &[&str]) -> anyhow::Result<String> {
    let mut hash = Sha256::new();
    for text in std::iter::once(program()?.as_str()).chain(of.iter().copied()) {
        hash.update((text.len() as u64).to_le_bytes());
        hash.update(text);
    }
    Ok(hex(&hash.finalize()))
}

/// Bytes of a sum that say whether a file is whole.
const SUM: usize = 8;

/// Where results are.
#[derive(Debug)]
pub enum Kept {
    /// A file each in this folder.
    Folder(PathBuf),
    /// Those of parts that are merged; nothing is added.
    Merged(HashMap<String, Vec<u8>>),
}

impl Kept {
    fn file(folder: &Path, key: &str) -> PathBuf {
        folder.join(format!("{key}.kept"))
    }

    /// The bytes of a result, and themselves as a value; none where they are not there, cut, or no such value.
    #[must_use]
    pub fn load<T: DeserializeOwned>(&self, key: &str) -> Option<(Vec<u8>, T)> {
        let bytes = match self {
            Self::Merged(all) => all.get(key)?.clone(),
            Self::Folder(folder) => {
                let mut bytes = bounded::bytes(&Self::file(folder, key), bounded::LOG).ok()?;
                let sum = bytes.split_off(bytes.len().checked_sub(SUM)?);
                (Sha256::digest(&bytes)[..SUM] == sum[..]).then_some(bytes)?
            }
        };
        let value = postcard::from_bytes(&bytes).ok()?;
        Some((bytes, value))
    }

    /// Keeps a result; its bytes.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn store<T: Serialize>(&self, key: &str, value: &T) -> anyhow::Result<Vec<u8>> {
        // Not as text: readers of JSON may round a number's last bit, and no report must depend on whether a result was kept.
        let bytes = postcard::to_extend(value, Vec::new()).context("a result cannot be kept")?;
        if let Self::Folder(folder) = self {
            let path = Self::file(folder, key);
            let sum = Sha256::digest(&bytes);
            whole_file::write(&path, [&bytes[..], &sum[..SUM]].concat()).with_context(|| format!("cannot write {}", path.display()))?;
        }
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_comes_back_bit_by_bit_and_a_cut_one_is_not_there() {
        let folder = std::env::temp_dir().join(format!("glider-kept-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let kept = Kept::Folder(folder.clone());
        let value = (vec![0.1 + 0.2, f64::NAN, -0.0], "x".to_owned(), Some(3_u64));
        let bytes = kept.store("ab", &value).expect("written");
        let (same, back): (_, (Vec<f64>, String, Option<u64>)) = kept.load("ab").expect("there");
        let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!((same, bits(&back.0), back.1, back.2), (bytes.clone(), bits(&value.0), value.1, value.2));
        let merged = Kept::Merged(HashMap::from([("ab".to_owned(), bytes)]));
        assert!(merged.load::<(Vec<f64>, String, Option<u64>)>("ab").is_some());
        let path = Kept::file(&folder, "ab");
        let whole = std::fs::read(&path).expect("there");
        for cut in [0, 5, whole.len() - 1] {
            std::fs::write(&path, &whole[..cut]).expect("written");
            assert!(kept.load::<(Vec<f64>, String, Option<u64>)>("ab").is_none(), "{cut}");
        }
        assert!(kept.load::<u8>("cd").is_none());
        std::fs::remove_dir_all(&folder).expect("removed");
    }

    #[test]
    fn a_key_separates_its_texts() {
        let key = |of: &[&str]| key(of).expect("a key");
        assert!(key(&["a", "bc"]) != key(&["ab", "c"]) && key(&["a"]) == key(&["a"]) && key(&["a"]).len() == 64);
    }
}

//! Texts and lists of the program itself that were kept and come back: they live as long as it does, each once.

use std::collections::HashSet;
use std::hash::Hash;
use std::sync::{LazyLock, Mutex};

use serde::{Deserialize, Deserializer};

/// A text of the program itself; under this name `serde` does not take it for one that is borrowed from what it reads.
pub type Text = &'static str;

/// The values of one kind.
pub type All<T> = LazyLock<Mutex<HashSet<&'static T>>>;

/// The one copy of a value; there are few of them (words of rules, causes), however many results hold them.
pub fn interned<T: Eq + Hash + ?Sized + 'static>(all: &All<T>, value: Box<T>) -> &'static T {
    let mut all = all.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    if let Some(known) = all.get(&*value).copied() {
        return known;
    }
    let new: &'static T = Box::leak(value);
    all.insert(new);
    new
}

fn text_of(text: String) -> &'static str {
    static ALL: All<str> = LazyLock::new(Mutex::default);
    interned(&ALL, text.into_boxed_str())
}

/// One text.
///
/// # Errors
/// What the reader says.
pub fn text<'de, D: Deserializer<'de>>(from: D) -> Result<&'static str, D::Error> {
    String::deserialize(from).map(text_of)
}

/// A text or none.
///
/// # Errors
/// What the reader says.
pub fn text_or_none<'de, D: Deserializer<'de>>(from: D) -> Result<Option<&'static str>, D::Error> {
    Ok(Option::<String>::deserialize(from)?.map(text_of))
}

/// Several texts.
///
/// # Errors
/// What the reader says.
pub fn texts<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<&'static str>, D::Error> {
    Ok(Vec::<String>::deserialize(from)?.into_iter().map(text_of).collect())
}

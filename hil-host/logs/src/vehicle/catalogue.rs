//! Effects with a name: those of [`hydro`], and what a program that uses this library adds to them.

use std::sync::OnceLock;

use hydro::effects::{CATALOGUE, Effect, SeenIn};

static MORE: OnceLock<Vec<&'static Effect>> = OnceLock::new();

/// Adds effects to the catalogue, for the whole program: once, before the first flight is looked at.
///
/// # Errors
/// The catalogue was extended before, or a name is taken.
pub fn extend(more: Vec<&'static Effect>) -> Result<(), String> {
    if let Some(e) = more.iter().find(|e| hydro::effects::by_name(e.name).is_some()) {
        return Err(format!("the catalogue has an effect {} already", e.name));
    }
    MORE.set(more).map_err(|_| "the catalogue was extended before".to_owned())
}

/// Every effect there is.
pub fn all() -> impl Iterator<Item = &'static Effect> {
    CATALOGUE.iter().chain(MORE.get().into_iter().flatten()).copied()
}

/// The effect with this name.
#[must_use]
pub fn by_name(name: &str) -> Option<&'static Effect> {
    all().find(|e| e.name == name)
}

/// The effect that is a horizontal current, which only the way between GPS fixes shows.
#[must_use]
pub fn current() -> Option<&'static Effect> {
    all().find(|e| e.seen_in == SeenIn::Displacement)
}

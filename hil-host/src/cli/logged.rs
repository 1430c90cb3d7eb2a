//! A flight with the hash of its log.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use discovery::workbench::calibrate::Logged;
use logs::digest::sha256;
use logs::record::bounded;

use super::diagnose::load;

/// The file of a flight.
pub(crate) fn log_of(flight: &Path) -> PathBuf {
    if flight.is_dir() { flight.join("flight.csv") } else { flight.to_path_buf() }
}

/// A flight with the hash of its log, and its vehicle.
///
/// # Errors
/// Bad input, with the file and the fix.
pub(crate) fn logged(flight: &Path, vehicle: Option<&Path>) -> anyhow::Result<(Logged, logs::Vehicle)> {
    let (read, vehicle) = load(flight, vehicle)?;
    let log = log_of(flight);
    let bytes = bounded::bytes(&log, bounded::LOG).with_context(|| log.display().to_string())?;
    Ok((Logged { flight: read, sha256: sha256(&bytes) }, vehicle))
}

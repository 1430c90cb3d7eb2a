//! Gives the linker the memory map and the scripts of cortex-m-rt and defmt,
//! and builds the boot loader that lies in flash before the image.
//! Link arguments live here and not in the cargo configuration, so that a
//! RUSTFLAGS variable cannot drop them.

use object::{Object, ObjectSegment};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

/// Address of the boot loader.
const BOOT: u64 = 0x0800_0000;
/// What it is made of, beside its own folder.
const BOOT_SOURCES: [&str; 5] = ["boot", "store/src", "store/Cargo.toml", "devices/src", "devices/Cargo.toml"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=../memory.x");
    println!("cargo::rerun-if-changed=image.x");
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let here = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    fs::copy(here.join("../memory.x"), out.join("memory.x"))?;
    fs::copy(here.join("image.x"), out.join("image.x"))?;
    fs::write(out.join("boot.bin"), boot_loader(&here, &out)?)?;
    println!("cargo::rustc-link-search={}", out.display());
    for arg in ["-Tlink.x", "-Tdefmt.x", "-Timage.x", "--nmagic", "--no-rosegment"] {
        println!("cargo::rustc-link-arg-bins={arg}");
        println!("cargo::rustc-link-arg-tests={arg}");
    }
    Ok(())
}

/// Bytes of the boot loader from the start of flash on. It is a program of its own with a memory map of its own, so cargo builds it in
/// a folder of its own beside the image's: `TARGET_DIR/thumbv7em-none-eabihf/boot`.
fn boot_loader(here: &Path, out: &Path) -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    BOOT_SOURCES.iter().for_each(|source| println!("cargo::rerun-if-changed={source}"));
    let triple = env::var("TARGET")?;
    let profile = out.ancestors().nth(3).ok_or("OUT_DIR is not that of cargo")?;
    let folder = profile.with_file_name("boot");
    let mut cargo = Command::new(env::var("CARGO")?);
    cargo.args(["build", "--quiet", "--profile", "flight", "-p", "boot", "--bin", "boot", "--target", &triple, "--target-dir"]);
    cargo.arg(&folder).current_dir(here).env_remove("CARGO_TARGET_DIR").env_remove("CARGO_ENCODED_RUSTFLAGS");
    if !cargo.status()?.success() {
        return Err("the boot loader does not build: cargo says above why".into());
    }
    let elf = fs::read(folder.join(&triple).join("flight/boot"))?;
    let mut bytes = Vec::new();
    for segment in object::File::parse(&*elf)?.segments() {
        let data = segment.data()?;
        if let Some(at) = segment.address().checked_sub(BOOT).filter(|at| *at < 1 << 20 && !data.is_empty()) {
            bytes.resize(bytes.len().max(at as usize + data.len()), 0xff);
            bytes[at as usize..at as usize + data.len()].copy_from_slice(data);
        }
    }
    Ok(bytes)
}

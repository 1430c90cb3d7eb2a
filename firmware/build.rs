//! Gives the linker the memory map and the scripts of cortex-m-rt and defmt.
//! Link arguments live here and not in the cargo configuration, so that a
//! RUSTFLAGS variable cannot drop them.

use std::path::PathBuf;
use std::{env, fs};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=../memory.x");
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let map = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("../memory.x");
    fs::copy(map, out.join("memory.x"))?;
    println!("cargo::rustc-link-search={}", out.display());
    for script in ["link.x", "defmt.x"] {
        println!("cargo::rustc-link-arg-bins=-T{script}");
        println!("cargo::rustc-link-arg-tests=-T{script}");
    }
    for arg in ["--nmagic", "--no-rosegment"] {
        println!("cargo::rustc-link-arg-bins={arg}");
        println!("cargo::rustc-link-arg-tests={arg}");
    }
    Ok(())
}

//! Gives the linker the boot loader's memory map.

use std::path::PathBuf;
use std::{env, fs};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=boot.x");
    println!("cargo::rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::copy("boot.x", out.join("boot.x"))?;
    println!("cargo::rustc-link-search={}", out.display());
    for arg in ["-Tboot.x", "--nmagic", "--no-rosegment"] {
        println!("cargo::rustc-link-arg-bins={arg}");
    }
    Ok(())
}

//! What the image takes, and what it can never do.
//!
//! `audit ELF [KIB]` reads the linked image itself, not the compiler's promises:
//!
//! - flash against its place (256 KiB of 1 MiB, or KIB), RAM against its share (64 KiB of 128 KiB);
//! - no panic: no function of `core::panicking` was linked;
//! - no heap: no allocator symbol was linked;
//! - the worst-case stack, from every stack adjustment and every call in the
//!   machine code ([`thumb`], [`stack`]), against the RAM set apart for it; statics
//!   and that RAM against the chip's share.
//!
//! Exits 1 if a promise is broken, 2 if the file cannot be read.

mod image;
mod stack;
mod thumb;

use anyhow::{Context, Result};
use image::Image;
use std::process::ExitCode;

/// Flash the image may take: its slot, KiB.
const FLASH_KIB: u64 = 256;
/// RAM the image may take with its stack, bytes.
const RAM: u64 = 64 * 1024;
/// Words of pattern at the end of the stack, bytes.
const CANARY: u64 = 64;
/// Linked into every panic, and into nothing else.
const PANICS: &[&str] = &["core::panicking::", "rust_begin_unwind"];
/// Linked into every allocation.
const HEAP: &[&str] = &["__rust_alloc", "__rg_alloc", "alloc::alloc::", "malloc"];

fn audit(path: &str, flash: u64) -> Result<bool> {
    let bytes = std::fs::read(path).with_context(|| format!("{path}: cannot read the image; scripts/build-firmware makes it"))?;
    let image = Image::read(&bytes).with_context(|| format!("{path}: not a Cortex-M image"))?;
    let mut kept = true;
    let mut promise = |what: &str, holds: bool, why: String| {
        println!("{} {what}: {why}", if holds { "ok  " } else { "FAIL" });
        kept &= holds;
    };
    promise("flash", image.flash <= flash, format!("{} of {flash} bytes", image.flash));
    for (what, names) in [("no panic", PANICS), ("no heap", HEAP)] {
        let found: Vec<&str> = image.functions.iter().map(|f| f.name.as_str()).filter(|n| names.iter().any(|p| n.contains(p))).collect();
        let why = if found.is_empty() { format!("none of {} functions", image.functions.len()) } else { found.join(", ") };
        promise(what, found.is_empty(), why);
    }
    let worst = stack::worst(&image)?;
    println!("     deepest path, bytes of stack and function:");
    for (bytes, name) in &worst.path {
        println!("     {bytes:6}  {name}");
    }
    for (bytes, name) in &worst.exceptions {
        println!("     {bytes:6}  {name} (exception, with its entry frame)");
    }
    let needed = worst.total + CANARY;
    promise("stack", needed <= image.stack, format!("{} at worst + {CANARY} of canary = {needed} of {} bytes", worst.total, image.stack));
    let total = image.statics + image.stack;
    promise("RAM", total <= RAM, format!("{} statics + {} set apart for the stack = {total} of {RAM} bytes", image.statics, image.stack));
    Ok(kept)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (path, kib) = match arguments.as_slice() {
        [path] => (path, Some(FLASH_KIB)),
        [path, kib] => (path, kib.parse().ok()),
        _ => (&String::new(), None),
    };
    let Some(kib) = kib else {
        eprintln!("usage: audit ELF [KIB of flash]");
        return ExitCode::from(2);
    };
    match audit(path, 1024 * kib) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(e) => {
            eprintln!("audit: {e:#}");
            ExitCode::from(2)
        }
    }
}

//! Tests that run on the target: in QEMU, or on a board.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    println!("skipped: on-target tests need the target (scripts/check-firmware runs them in QEMU)");
}
#[cfg(target_os = "none")]
use semihosting as _;

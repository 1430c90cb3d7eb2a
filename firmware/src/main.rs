//! The image for the science bay board, STM32F405.
//!
//! It only wires: bytes of the line, or readings of the vehicle's own
//! sensors, go to [`helm`]; what it answers goes back to the line, or to the
//! actuators. Everything that decides is in the libraries, tested on a laptop.
//!
//! One ELF for the chip and for QEMU's `netduinoplus2`: what the emulator
//! lacks (clock tree, watchdog, SPI, ADC, GPIO inputs) is waited for with a
//! bound and lived without.
//!
//! On a laptop this program prints what the image is.
//!
//! # Dependencies
//!
//! * `cortex-m`, `cortex-m-rt`, `critical-section`: start, interrupts and the sections in which there are none
//! * `stm32f4`: registers of the chip by name
//! * `defmt`: the log that a laptop decodes
//! * `embedded-hal`, `embedded-io`: what the drivers are written against
//! * `heapless`: queues of bytes
//! * `semihosting`: how a test under QEMU ends
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod backseat_role;
#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
mod chip;
#[cfg(target_os = "none")]
mod facts;
#[cfg(target_os = "none")]
mod image;
#[cfg(target_os = "none")]
mod shelf;

mod version;

#[cfg(not(target_os = "none"))]
fn main() {
    let [major, minor, patch] = version::FIRMWARE;
    println!("glider firmware {major}.{minor}.{patch} for STM32F405 (build it with `cargo flight`)");
    println!("wire version      {}", signals::WIRE_VERSION);
    println!("control cycle     {} ms", helm::session::CYCLE_MS);
    println!("line patience     {} ms", helm::silence::PATIENCE_MS);
    let config = control::Config::default();
    let boot = helm::Boot { firmware: version::FIRMWARE, ..helm::Boot::default() };
    let manifest = helm::Helm::new(config, boot, helm::RamStorage::default()).manifest();
    println!("table standard    {:08x}", manifest.table_standard);
    println!("table low ar      {:08x}", manifest.table_low_ar);
}

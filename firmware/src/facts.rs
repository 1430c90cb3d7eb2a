//! What lies in flash beside the image: the boot loader before it, an empty journal, and the facts of its slot ([`store::image`]).
//!
//! The boot loader is built by this crate's `build.rs`; one ELF is the whole of what a probe has to flash.

use store::image::{BOARD, MAGIC, NO_ID};

unsafe extern "C" {
    /// From image.x: its address is the image's length.
    static __image_length: u32;
}

/// As [`store::image::Facts`] reads them; the length is known to the linker alone.
#[repr(C)]
struct Facts {
    magic: u32,
    board: [u8; 8],
    length: *const u32,
    firmware: [u8; 3],
    wire: u8,
    id: u32,
    erased: [u32; 2],
}

// SAFETY: the pointer is a number, and nothing follows it.
unsafe impl Sync for Facts {}

#[used]
#[unsafe(link_section = ".facts")]
static FACTS: Facts = Facts {
    magic: MAGIC,
    board: BOARD,
    length: &raw const __image_length,
    firmware: crate::version::FIRMWARE,
    wire: signals::WIRE_VERSION,
    id: NO_ID,
    erased: [u32::MAX; 2],
};

const BOOT_BYTES: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/boot.bin"));

#[used]
#[unsafe(link_section = ".boot")]
static BOOT: [u8; BOOT_BYTES.len()] = *include_bytes!(concat!(env!("OUT_DIR"), "/boot.bin"));

/// Its two sectors are erased with what a probe flashes: an image without a seal is believed beside an empty journal only.
#[used]
#[unsafe(link_section = ".journal0")]
static JOURNAL_0: [u8; 16] = [0xff; 16];
#[used]
#[unsafe(link_section = ".journal1")]
static JOURNAL_1: [u8; 16] = [0xff; 16];

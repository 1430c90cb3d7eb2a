//! What a debug probe reads out of RAM: one up channel in SEGGER's RTT layout.
//!
//! Own code because the published crates panic when opened twice, and this
//! image has no panic in it. Layout: SEGGER UM08001 chapter 16, as probe-rs
//! and defmt's tools read it. A probe that does not read loses lines; nothing
//! here waits.

use core::ptr::{addr_of, addr_of_mut};

const SIZE: u32 = 512;

#[repr(C)]
struct Channel {
    name: *const u8,
    buffer: *mut u8,
    size: u32,
    write: u32,
    read: u32,
    /// 0: skip what does not fit.
    flags: u32,
}

#[repr(C)]
struct Control {
    id: [u8; 16],
    up_channels: u32,
    down_channels: u32,
    up: Channel,
}

static mut BUFFER: [u8; SIZE as usize] = [0; SIZE as usize];

#[unsafe(export_name = "_SEGGER_RTT")]
static mut CONTROL: Control = Control {
    id: [0; 16],
    up_channels: 1,
    down_channels: 0,
    up: Channel { name: core::ptr::null(), buffer: core::ptr::null_mut(), size: SIZE, write: 0, read: 0, flags: 0 },
};

/// Makes the channel known: the id is written last, and not as one string, so
/// that a probe finds no copy of it in flash.
pub fn open() {
    let id = *b"TTR REGGES";
    // SAFETY: called once, before anything is logged; the probe only changes `read`.
    unsafe {
        addr_of_mut!(CONTROL.up.name).write_volatile(c"defmt".as_ptr().cast());
        addr_of_mut!(CONTROL.up.buffer).write_volatile(addr_of_mut!(BUFFER).cast());
        for (i, letter) in id.iter().rev().enumerate() {
            addr_of_mut!(CONTROL.id).cast::<u8>().add(i).write_volatile(*letter);
        }
    }
}

/// Puts all bytes, or none if they do not fit.
pub fn write(bytes: &[u8]) {
    // SAFETY: one writer (the log's guard); indices are kept below SIZE, and a
    // probe that writes nonsense to `read` can only make us drop bytes.
    unsafe {
        let mut at = addr_of!(CONTROL.up.write).read_volatile() % SIZE;
        let read = addr_of!(CONTROL.up.read).read_volatile() % SIZE;
        let free = (read.wrapping_sub(at).wrapping_sub(1)) % SIZE;
        if bytes.len() > free as usize {
            return;
        }
        for byte in bytes {
            addr_of_mut!(BUFFER).cast::<u8>().add(at as usize).write_volatile(*byte);
            at = (at.wrapping_add(1)) % SIZE;
        }
        addr_of_mut!(CONTROL.up.write).write_volatile(at);
    }
}

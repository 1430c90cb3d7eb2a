//! Where the defmt log goes: USART2 (115200 8N1, works in QEMU and without a
//! probe) and RTT (what `probe-rs run` shows).
//!
//! Only the main loop logs, never an interrupt, so sending does not mask
//! interrupts; a second writer (a panic in the middle of a log line) finds the
//! log taken and stays silent.

use super::rtt;
use core::sync::atomic::{AtomicBool, Ordering};
use stm32f4::stm32f405::USART2;

/// Longest wait for room in the transmitter, loops: 10 characters at 16 MHz.
const SEND_WAIT: u32 = 4_000;

static TAKEN: AtomicBool = AtomicBool::new(false);
static mut ENCODER: defmt::Encoder = defmt::Encoder::new();

#[defmt::global_logger]
struct Log;

defmt::timestamp!("{=u64:ms}", super::clock::now_ms());

/// Opens both ways out.
pub fn open(port: &USART2) {
    let divisor = super::uart::divisor(super::uart::BAUD);
    port.brr().write(|w| w.div_mantissa().set((divisor >> 4) as u16).div_fraction().set((divisor & 0xf) as u8));
    port.cr1().write(|w| w.ue().enabled().te().enabled());
    rtt::open();
}

fn write(bytes: &[u8]) {
    // SAFETY: only USART2's transmitter is touched, and only here after `open`.
    let port = unsafe { &*USART2::ptr() };
    for byte in bytes {
        if (0..SEND_WAIT).any(|_| port.sr().read().txe().bit_is_set()) {
            port.dr().write(|w| w.dr().set(u16::from(*byte)));
        }
    }
    rtt::write(bytes);
}

// SAFETY: one thread logs, guarded against itself by TAKEN; nothing is written without it.
unsafe impl defmt::Logger for Log {
    fn acquire() {
        if TAKEN.load(Ordering::Relaxed) {
            super::last_words::reset(super::last_words::Cause::Panic);
        }
        TAKEN.store(true, Ordering::Relaxed);
        // SAFETY: TAKEN was free.
        unsafe { (*(&raw mut ENCODER)).start_frame(write) };
    }

    unsafe fn flush() {}

    unsafe fn release() {
        // SAFETY: defmt calls this after `acquire`.
        unsafe { (*(&raw mut ENCODER)).end_frame(write) };
        TAKEN.store(false, Ordering::Relaxed);
    }

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: defmt calls this between `acquire` and `release`.
        unsafe { (*(&raw mut ENCODER)).write(bytes, write) };
    }
}

//! What the last run left behind, in RAM that a reset does not clear.
//!
//! A record with its CRC says whether a mission was under way and, after a
//! panic or a fault, why the chip was reset. After a power cut the RAM holds
//! noise, the CRC does not match, and the journal on flash has to know.

use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;
use helm::Mark;
use signals::link::CRC32;
use stm32f4::stm32f405::RCC;

/// Why the chip was reset by its own software.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
#[repr(u32)]
pub enum Cause {
    /// Not by software: power, reset pin or watchdog.
    Unknown = 0,
    /// A panic (integer overflow is one).
    Panic = 1,
    /// Hard fault.
    Fault = 2,
    /// The stack grew into its canary.
    Stack = 3,
    /// An interrupt nobody handles.
    Interrupt = 4,
}

/// What is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LastWords {
    /// The mission under way, if there was one.
    pub mark: Mark,
    /// Why the reset.
    pub cause: Cause,
    /// Resets since power-up.
    pub resets: u32,
    /// Configurable fault status (CFSR, Armv7-M ARM B3.2.15) where the cause is a fault, else 0.
    pub status: u32,
    /// Air pressure that depth is reckoned from, Pa, bit by bit; 0: not measured yet.
    pub air: u32,
}

const WORDS: usize = 6;

#[unsafe(link_section = ".uninit.LAST_WORDS")]
static mut RECORD: MaybeUninit<[u32; WORDS]> = MaybeUninit::uninit();

/// What the last run left; `None` after a power cut.
pub fn read() -> Option<LastWords> {
    // SAFETY: any bits are valid u32s; one thread, no reference escapes.
    let words = unsafe { core::ptr::read_volatile((&raw const RECORD).cast::<[u32; WORDS]>()) };
    let [mark, cause, resets, status, air, crc] = words;
    if crc != checksum([mark, cause, resets, status, air]) {
        return None;
    }
    let cause = match cause {
        1 => Cause::Panic,
        2 => Cause::Fault,
        3 => Cause::Stack,
        4 => Cause::Interrupt,
        _ => Cause::Unknown,
    };
    Some(LastWords { mark: Mark(mark as u8), cause, resets, status, air })
}

/// What lies where the record should: after a power cut a number that nobody knows.
pub fn noise() -> u32 {
    // SAFETY: as in `read`.
    let words = unsafe { core::ptr::read_volatile((&raw const RECORD).cast::<[u32; WORDS]>()) };
    words.iter().fold(0, |sum: u32, word| sum.rotate_left(7) ^ word)
}

/// Why the chip was reset, as its reset controller says, bits 25 to 31 of RCC_CSR (RM0090 7.3.21): brown-out 1, pin 2, power 4, software 8,
/// independent watchdog 16, window watchdog 32, low power 64. Clears them.
pub fn reset_flags(rcc: &RCC) -> u8 {
    let flags = rcc.csr().read().bits() >> 25;
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    flags as u8
}

/// Leaves a record for the next run.
pub fn write(words: LastWords) {
    let body = [u32::from(words.mark.0), words.cause as u32, words.resets, words.status, words.air];
    let [a, b, c, d, e] = body;
    // SAFETY: one thread writes; handlers that write never return.
    unsafe { core::ptr::write_volatile((&raw mut RECORD).cast::<[u32; WORDS]>(), [a, b, c, d, e, checksum(body)]) };
}

/// Notes why, keeps the rest, and resets the chip.
pub fn reset(cause: Cause) -> ! {
    // SAFETY: reading the fault status has no effect.
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    if let Some(words) = read() {
        write(LastWords { cause, status, ..words });
    }
    SCB::sys_reset()
}

fn checksum(words: [u32; 5]) -> u32 {
    let mut digest = CRC32.digest();
    for word in words {
        digest.update(&word.to_le_bytes());
    }
    digest.finalize()
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    reset(Cause::Panic)
}

/// Called by [`super::fault`].
#[unsafe(no_mangle)]
extern "C" fn after_fault() -> ! {
    reset(Cause::Fault)
}

#[exception]
unsafe fn DefaultHandler(_: i16) {
    reset(Cause::Interrupt)
}

//! What the last run left behind, in RAM that a reset does not clear.
//!
//! A record with its CRC says whether a mission was under way; why the chip was
//! reset is in the [`black_box`]. After a power cut the RAM holds
//! noise, the CRC does not match, and the journal on flash has to know.

use super::black_box;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;
use helm::Mark;
pub use signals::autopsy::Cause;
use signals::autopsy::Registers;
use signals::link::CRC32;
use stm32f4::stm32f405::RCC;

/// What is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LastWords {
    /// The mission under way, if there was one.
    pub mark: Mark,
    /// Resets since power-up.
    pub resets: u32,
    /// Air pressure that depth is reckoned from, Pa, bit by bit; 0: not measured yet.
    pub air: u32,
}

const WORDS: usize = 4;

#[unsafe(link_section = ".uninit.LAST_WORDS")]
static mut RECORD: MaybeUninit<[u32; WORDS]> = MaybeUninit::uninit();

/// What the last run left; `None` after a power cut.
pub fn read() -> Option<LastWords> {
    // SAFETY: any bits are valid u32s; one thread, no reference escapes.
    let words = unsafe { core::ptr::read_volatile((&raw const RECORD).cast::<[u32; WORDS]>()) };
    let [mark, resets, air, crc] = words;
    (crc == checksum([mark, resets, air])).then_some(LastWords { mark: Mark(mark as u8), resets, air })
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
    let body = [u32::from(words.mark.0), words.resets, words.air];
    let [a, b, c] = body;
    // SAFETY: one thread writes; handlers that write never return.
    unsafe { core::ptr::write_volatile((&raw mut RECORD).cast::<[u32; WORDS]>(), [a, b, c, checksum(body)]) };
}

/// Notes why, and resets the chip.
pub fn reset(cause: Cause) -> ! {
    reset_at(cause, Registers::default())
}

fn reset_at(cause: Cause, frame: Registers) -> ! {
    black_box::note(cause, frame);
    SCB::sys_reset()
}

fn checksum(words: [u32; 3]) -> u32 {
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
extern "C" fn after_fault(sp: u32, lr: u32, pc: u32, xpsr: u32) -> ! {
    reset_at(Cause::Fault, Registers { sp, lr, pc, xpsr, ..Registers::default() })
}

#[exception]
unsafe fn DefaultHandler(interrupt: i16) {
    // Interrupts are numbered from 0, exceptions from 16 before them.
    reset_at(Cause::Interrupt, Registers { xpsr: u32::from(interrupt.wrapping_add(16) as u16), ..Registers::default() })
}

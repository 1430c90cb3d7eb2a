//! The recorder of [`helm::black_box`] in RAM that a reset does not clear, and what the chip says of a fault.

use core::mem::MaybeUninit;
use cortex_m::peripheral::SCB;
use helm::black_box::{BlackBox, Memory, WORDS};
use signals::Answer;
use signals::autopsy::{CALLERS, Cause, Note, Registers};
use signals::link::CRC32;

#[unsafe(link_section = ".uninit.BLACK_BOX")]
static mut RECORD: MaybeUninit<[u32; WORDS]> = MaybeUninit::uninit();
static mut RECORDER: BlackBox<Kept> = BlackBox::new(Kept);

unsafe extern "C" {
    // From memory.x and cortex-m-rt's link.x: only their addresses mean something.
    static _stack_start: u32;
    static _stack_end: u32;
    static __stext: u32;
    static __etext: u32;
    static __srodata: u32;
    static __erodata: u32;
    static __sdata: u32;
    static __edata: u32;
    static __sidata: u32;
}

/// The words of [`RECORD`].
struct Kept;

impl Memory for Kept {
    fn get(&self, at: usize) -> u32 {
        // SAFETY: inside; any bits are a valid u32, and a volatile read takes what lies there.
        if at < WORDS { unsafe { (&raw const RECORD).cast::<u32>().add(at).read_volatile() } } else { 0 }
    }
    fn set(&mut self, at: usize, word: u32) {
        if at < WORDS {
            // SAFETY: inside, and only the recorder writes there.
            unsafe { (&raw mut RECORD).cast::<u32>().add(at).write_volatile(word) };
        }
    }
}

fn recorder() -> &'static mut BlackBox<Kept> {
    // SAFETY: one thread; the handlers that come here never return.
    unsafe { &mut *(&raw mut RECORDER) }
}

/// Begins a run of this image; what is kept of a fault.
pub fn open(began: u8, firmware: [u8; 3], image: u32) -> Option<Note> {
    recorder().open(began, firmware, image)
}

/// Keeps a finished cycle.
pub fn cycle(answer: &Answer) {
    recorder().cycle(answer, super::clock::now_ms());
}

/// What may be read of it: see [`helm::Storage::read_autopsy`].
pub fn read(at: u32, out: &mut [u8]) -> u32 {
    recorder().read(at, out)
}

/// Notes why the chip will be reset; of the frame what the handler saw.
pub fn note(cause: Cause, frame: Registers) {
    // SAFETY: reading the fault registers has no effect.
    let scb = unsafe { &*SCB::PTR };
    let registers = Registers { cfsr: scb.cfsr.read(), hfsr: scb.hfsr.read(), mmfar: scb.mmfar.read(), bfar: scb.bfar.read(), ..frame };
    let callers = if cause == Cause::Fault { callers(frame.sp) } else { [0; CALLERS] };
    recorder().fault(cause, registers, callers, super::clock::now_ms());
}

/// Identity of the image: CRC-32 of its code, its constants and its initial values, as they lie in flash.
pub fn image() -> u32 {
    let data = (&raw const __edata).addr().saturating_sub((&raw const __sdata).addr());
    let parts = [
        (&raw const __stext, (&raw const __etext).addr().saturating_sub((&raw const __stext).addr())),
        (&raw const __srodata, (&raw const __erodata).addr().saturating_sub((&raw const __srodata).addr())),
        (&raw const __sidata, data),
    ];
    let mut digest = CRC32.digest();
    for (start, length) in parts {
        // SAFETY: flash between symbols of the linker; nothing writes it.
        digest.update(unsafe { core::slice::from_raw_parts(start.cast::<u8>(), length) });
    }
    digest.finalize()
}

/// Words of the stack above `sp` that point into code behind a call, innermost first. Some may be left over from calls that returned.
fn callers(sp: u32) -> [u32; CALLERS] {
    let (end, top) = ((&raw const _stack_end).addr(), (&raw const _stack_start).addr());
    let mut found = [0; CALLERS];
    let mut places = found.iter_mut();
    let mut at = (sp as usize & !3).max(end);
    while at < top {
        // SAFETY: inside the stack's RAM, aligned.
        let word = unsafe { core::ptr::with_exposed_provenance::<u32>(at).read_volatile() };
        at = at.saturating_add(4);
        if is_behind_a_call(word) {
            let Some(place) = places.next() else { break };
            *place = word;
        }
    }
    found
}

/// A Thumb address whose instruction before is BL or BLX (Armv7-M ARM A7.7.18, A7.7.19).
fn is_behind_a_call(address: u32) -> bool {
    let at = address as usize & !1;
    let code = (&raw const __stext).addr().saturating_add(4)..(&raw const __etext).addr();
    if address & 1 == 0 || !code.contains(&at) {
        return false;
    }
    // SAFETY: inside the code, halfword aligned.
    let half = |back: usize| unsafe { core::ptr::with_exposed_provenance::<u16>(at.wrapping_sub(back)).read_volatile() };
    let (first, second) = (half(4), half(2));
    (first & 0xf800 == 0xf000 && second & 0xd000 == 0xd000) || second & 0xff87 == 0x4780
}

//! What time it is: milliseconds since boot, u64, never wrapping.
//!
//! The chip runs at 16 MHz either way: from its crystal (16 MHz, ±50 ppm)
//! where it starts and measures as one of 16 MHz ([`devices::crystal`]), else
//! from the internal oscillator (HSI, 16 MHz ±4 %, DS8626 table 41). Baud
//! rates and ticks are the same numbers for both.
//! If it stops in flight the clock security system switches to HSI and raises
//! NMI: a reset, which comes up on HSI.
//!
//! QEMU models no clock tree and counts SysTick at the F405's highest clock;
//! it is recognised by TIM2 once, so that a second is a second there too.

use super::registers::Registers;
use core::cell::Cell;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::exception;
use critical_section::Mutex;
use devices::crystal;
use signals::Timebase;
use stm32f4::stm32f405::{RCC, TIM2};

/// Core and bus clock, Hz.
pub const CORE_HZ: u32 = crystal::HZ;
/// Longest wait for the crystal, loops of ≥ 4 cycles (≥ 5 ms; start-up is 2 ms, DS8626 table 39).
const CRYSTAL_WAIT: u32 = 20_000;
/// Rate at which QEMU's netduinoplus2 counts SysTick, Hz; it counts TIM2 once per virtual nanosecond.
const EMULATED_TICK_HZ: u32 = 168_000_000;

static MILLIS: Mutex<Cell<u64>> = Mutex::new(Cell::new(0));

/// Starts the crystal, with bounded waits, and takes it into use if it is the right one. Its frequency as measured, Hz; 0: it was not.
pub fn start_crystal(rcc: &RCC, registers: &mut Registers) -> (Timebase, u32) {
    rcc.cr().modify(|_, w| w.hseon().on());
    let ready = (0..CRYSTAL_WAIT).any(|_| rcc.cr().read().hserdy().is_ready());
    let hz = if ready { crystal::measure(registers) } else { None };
    if !hz.is_some_and(crystal::is_right) {
        rcc.cr().modify(|_, w| w.hseon().off());
        return (if hz.is_some() { Timebase::WrongCrystal } else { Timebase::NoCrystal }, hz.unwrap_or(0));
    }
    rcc.cr().modify(|_, w| w.csson().on());
    rcc.cfgr().modify(|_, w| w.sw().hse());
    let taken = (0..CRYSTAL_WAIT).any(|_| rcc.cfgr().read().sws().is_hse());
    (if taken { Timebase::Crystal } else { Timebase::NoCrystal }, hz.unwrap_or(0))
}

/// Starts the millisecond tick at `start_ms`; returns the rate SysTick really has, Hz.
pub fn start_tick(syst: &mut SYST, tim2: &TIM2, start_ms: u64) -> u32 {
    syst.set_clock_source(SystClkSource::Core);
    syst.set_reload(0x00ff_ffff);
    syst.clear_current();
    syst.enable_counter();
    tim2.cr1().modify(|_, w| w.cen().enabled());
    // TIM2 is read outside of SysTick: an emulator that is held up in between makes it count more, never less.
    let t0 = tim2.cnt().read().bits();
    let s0 = SYST::get_current();
    let mut ticks = 0;
    for _ in 0..20_000 {
        ticks = s0.wrapping_sub(SYST::get_current()) & 0x00ff_ffff;
        if ticks > CORE_HZ / 1_000 {
            break;
        }
    }
    let counts = tim2.cnt().read().bits().wrapping_sub(t0);
    // On the chip both run from the same 16 MHz.
    let hz = if counts > 2 * ticks { EMULATED_TICK_HZ } else { CORE_HZ };
    critical_section::with(|cs| MILLIS.borrow(cs).set(start_ms));
    // Counts down from the reload value to 0: one tick more than that.
    syst.set_reload((hz / 1_000).clamp(1_000, 0x00ff_ffff).saturating_sub(1));
    syst.clear_current();
    syst.enable_interrupt();
    hz
}

/// Milliseconds since boot.
pub fn now_ms() -> u64 {
    critical_section::with(|cs| MILLIS.borrow(cs).get())
}

/// The tick stands still, and nothing of it is left to be served.
pub fn hold_tick(syst: &mut SYST) {
    syst.disable_counter();
    syst.disable_interrupt();
    cortex_m::peripheral::SCB::clear_pendst();
}

/// It goes on at `now_ms`; the time since boot never goes back.
pub fn resume_tick(syst: &mut SYST, now_ms: u64) {
    critical_section::with(|cs| {
        let millis = MILLIS.borrow(cs);
        millis.set(millis.get().max(now_ms));
    });
    syst.clear_current();
    syst.enable_interrupt();
    syst.enable_counter();
}

/// No tick was counted for so long.
pub fn stood_still(ms: u64) {
    critical_section::with(|cs| {
        let millis = MILLIS.borrow(cs);
        millis.set(millis.get().saturating_add(ms));
    });
}

#[exception]
fn SysTick() {
    critical_section::with(|cs| {
        let millis = MILLIS.borrow(cs);
        millis.set(millis.get().saturating_add(1));
    });
}

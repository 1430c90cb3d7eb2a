//! Sleep between two interrupts, and STOP mode between two cycles ([`devices::stop`]).

use super::clock;
use super::registers::Registers;
use super::uart;
use bay::Woken;
use cortex_m::peripheral::SYST;
use devices::rtc::Rtc;
use devices::stop::Stops;
use signals::Timebase;

/// Longest sleep, ms: bytes of the compass are heard when they have come, as in the parts seat.
const NAP_MS: u64 = 20;

/// What stands still, and time over it.
pub struct Standstill {
    syst: SYST,
    stops: Stops,
}

impl Standstill {
    /// None yet.
    pub const fn new(syst: SYST, stops: Stops) -> Self {
        Self { syst, stops }
    }

    /// Until then at the latest, or a byte of the line; the tick wakes it in between.
    pub fn sleep(&self, until_ms: u64) {
        let until_ms = until_ms.min(clock::now_ms().saturating_add(NAP_MS));
        for _ in 0..=NAP_MS {
            if uart::take_heard() || clock::now_ms() >= until_ms {
                return;
            }
            cortex_m::asm::wfi();
        }
    }

    /// STOP mode. Interrupts are held off until the clock is as it was.
    pub fn stop(&mut self, rtc: &mut Rtc<Registers>, until_ms: u64) -> Option<Woken> {
        uart::let_out();
        let now_ms = clock::now_ms();
        let Self { syst, stops } = self;
        let woken = critical_section::with(|_| {
            // The tick is held for a stop that is made, and for no other: what it does not count would be lost.
            let woken = stops.stop(rtc, now_ms, until_ms.saturating_sub(now_ms), |_| {
                clock::hold_tick(syst);
                cortex_m::asm::dsb();
                cortex_m::asm::wfi();
                cortex_m::asm::isb();
            })?;
            clock::resume_tick(syst, woken.now_ms);
            Some(woken)
        })?;
        let base = woken.crystal_lost.then_some(Timebase::NoCrystal);
        if base.is_some() {
            defmt::error!("the crystal did not start again: on the internal oscillator");
        }
        Some(Woken { by_line: woken.by_line, base, ppm: Stops::ppm() })
    }
}

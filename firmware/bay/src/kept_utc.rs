//! UTC over a reset: kept beside the count of the chip's calendar clock, and reckoned on from that after it.

use devices::registers::Registers;
use devices::rtc::Rtc;
use helm::UtcClock;

/// The calendar clock and what is kept beside its count.
#[derive(Debug)]
pub struct KeptUtc<R> {
    /// The calendar clock.
    pub rtc: Rtc<R>,
}

impl<R: Registers> KeptUtc<R> {
    /// Takes UTC up again, where it was kept. `now_ms`: since boot.
    #[inline(never)]
    pub fn open(registers: R, clock: &mut UtcClock, now_ms: u64) -> Self {
        clock.tick(now_ms);
        let mut rtc = Rtc::open(registers, now_ms);
        if let (Some(oscillator), Some(count_ms)) = (rtc.oscillator(), rtc.count_ms()) {
            clock.wake(rtc.kept(), count_ms, oscillator.ppm());
        }
        Self { rtc }
    }

    /// Keeps it as it is now; call it about once a second. `now_ms`: since boot.
    pub fn keep(&mut self, clock: &UtcClock, now_ms: u64) {
        self.rtc.poll(now_ms);
        if let Some(words) = self.rtc.count_ms().and_then(|count_ms| clock.keep(count_ms)) {
            self.rtc.keep(words);
        }
    }
}

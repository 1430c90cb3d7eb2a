//! The independent watchdog: resets the chip when no control step is finished.

use stm32f4::stm32f405::IWDG;

/// Time without a feed, in ticks of 4 ms at the nominal 32 kHz: 12 s, three cycles (17–47 kHz: 8–23 s, DS8626 table 42).
const TIMEOUT_TICKS: u16 = 3_000;

/// The watchdog, running for good.
pub struct Watchdog(IWDG);

impl Watchdog {
    /// Starts it; nothing but a reset stops it.
    pub fn start(iwdg: IWDG) -> Self {
        iwdg.kr().write(|w| w.key().start());
        iwdg.kr().write(|w| w.key().unlock());
        iwdg.pr().write(|w| w.pr().divide_by128()); // 250 Hz
        iwdg.rlr().write(|w| w.rl().set(TIMEOUT_TICKS));
        iwdg.kr().write(|w| w.key().feed());
        Self(iwdg)
    }

    /// A control step is finished, or there is no mission to step.
    pub fn feed(&mut self) {
        self.0.kr().write(|w| w.key().feed());
    }
}

//! The independent watchdog: resets the chip when the control loop stops.

use stm32f4::stm32f405::IWDG;

/// Time without a feed, ms, at the nominal 32 kHz (17–47 kHz: 1.4–3.8 s, DS8626 table 42).
pub const TIMEOUT_MS: u16 = 2_000;

/// The watchdog, running for good.
pub struct Watchdog(IWDG);

impl Watchdog {
    /// Starts it; nothing but a reset stops it.
    pub fn start(iwdg: IWDG) -> Self {
        iwdg.kr().write(|w| w.key().start());
        iwdg.kr().write(|w| w.key().unlock());
        iwdg.pr().write(|w| w.pr().divide_by32()); // 1 kHz
        iwdg.rlr().write(|w| w.rl().set(TIMEOUT_MS));
        iwdg.kr().write(|w| w.key().feed());
        Self(iwdg)
    }

    /// The control loop is alive.
    pub fn feed(&mut self) {
        self.0.kr().write(|w| w.key().feed());
    }
}

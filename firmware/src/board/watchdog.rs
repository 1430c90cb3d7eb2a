//! The independent watchdog: resets the chip when no control step is finished.

use stm32f4::stm32f405::IWDG;

/// Time without a feed, in ticks of 4 ms at the nominal 32 kHz: 12 s, three cycles (17–47 kHz: 8–23 s, DS8626 table 42).
const TIMEOUT_TICKS: u16 = 3_000;

/// Looks at its status until the boot loader's setting of it is taken over: 5 ticks of 17 kHz at most, a look takes 4 cycles at least.
const STATUS_LOOKS: u32 = 2_000;

/// The watchdog, running for good.
pub struct Watchdog(IWDG);

impl Watchdog {
    /// Starts it; nothing but a reset stops it.
    pub fn start(iwdg: IWDG) -> Self {
        iwdg.kr().write(|w| w.key().start());
        // A setting that is still on its way would make the next one void (RM0090, 21.4.4).
        let _ = (0..STATUS_LOOKS).any(|_| iwdg.sr().read().bits() == 0);
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

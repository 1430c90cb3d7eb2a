//! Which part has its supply when: switches that are off at reset, and how long a part needs before it is asked.
//!
//! The same times are what `glider power` reckons shares with.

use embedded_hal::digital::OutputPin;
use signals::{Phase, Reading};

/// A compass speaks so long after it was switched on, ms (guess: its manual does not say).
pub const COMPASS_START_MS: u64 = 1_000;
/// Time between two of its sentences, ms.
pub const COMPASS_PERIOD_MS: u64 = 200;
/// So long before a reading it is switched on, ms: its start, the two sentences that must agree, a third for one that is damaged, and
/// what is left of the third when it is read.
pub const COMPASS_LEAD_MS: u64 = COMPASS_START_MS + 3 * COMPASS_PERIOD_MS + 100;
/// An attitude of this reading is not older, ms; else the compass stays on.
pub const COMPASS_FRESH_MS: u64 = 3 * COMPASS_PERIOD_MS;
/// Pots and leak loop stand so long after their supply was switched on, ms: five times 1 ms of their filters (guess).
pub const POTS_START_MS: u32 = 6;
/// And the hull's pressure sensor, ms: warm-up of 20 ms (MPXA6115A table 1).
pub const HULL_START_MS: u32 = 22;
/// Gliding deeper than this the receiver is off, m: a fix needs an antenna in air.
pub const GPS_OFF_M: f32 = 5.0;
/// Rate of the fin, rad/s (guess), and time the servo holds it after its way, ms.
pub const FIN_RATE_RAD_S: f32 = 0.1;
/// See above.
pub const FIN_HOLD_MS: u64 = 300;

/// One switch.
#[derive(Debug)]
pub struct Supply<O> {
    pin: O,
    on: bool,
}

impl<O: OutputPin> Supply<O> {
    /// Off.
    pub fn new(pin: O) -> Self {
        let mut supply = Self { pin, on: false };
        supply.put(false);
        supply
    }

    /// Whether it is on.
    pub const fn is_on(&self) -> bool {
        self.on
    }

    /// Switches; says whether it was off and is on now.
    pub fn put(&mut self, on: bool) -> bool {
        // A pin that cannot be written is a part that does not answer, or one that stays on.
        let _ = if on { self.pin.set_high() } else { self.pin.set_low() };
        let begins = on && !self.on;
        self.on = on;
        begins
    }
}

/// Pins that switch.
pub struct SupplyPins<O> {
    /// Compass.
    pub compass: O,
    /// GPS receiver.
    pub gps: O,
    /// ADC and what hangs on its inputs: pots, hull pressure, leak loop.
    pub analog: O,
    /// Both motor bridges (nSLEEP).
    pub bridges: O,
    /// The fin's servo.
    pub servo: O,
}

/// All switches.
#[derive(Debug)]
pub struct Supplies<O> {
    /// Compass.
    pub compass: Supply<O>,
    /// GPS receiver.
    pub gps: Supply<O>,
    /// ADC and what hangs on its inputs.
    pub analog: Supply<O>,
    /// Both motor bridges.
    pub bridges: Supply<O>,
}

impl<O: OutputPin> Supplies<O> {
    /// All off; the servo's goes with the servo.
    pub fn new(pins: SupplyPins<O>) -> (Self, Supply<O>) {
        let SupplyPins { compass, gps, analog, bridges, servo } = pins;
        let supplies =
            Self { compass: Supply::new(compass), gps: Supply::new(gps), analog: Supply::new(analog), bridges: Supply::new(bridges) };
        (supplies, Supply::new(servo))
    }

    /// Nothing has its supply that speaks by itself or moves.
    pub const fn are_off(&self) -> bool {
        !(self.compass.on || self.gps.on || self.analog.on || self.bridges.on)
    }
}

/// Whether the receiver is to be on: anywhere but on a glide whose depth is known to be below [`GPS_OFF_M`]. After an abort, and where
/// no depth is measured, it may be what sees the surface.
#[must_use]
pub fn gps_wanted(phase: Phase, depth: Reading) -> bool {
    let gliding = matches!(phase, Phase::Dive | Phase::InflectLow | Phase::Climb | Phase::InflectHigh);
    let deep = matches!(depth, Reading::Sampled { value, .. } if value > GPS_OFF_M);
    !(gliding && deep)
}

#[cfg(test)]
mod tests {
    use super::gps_wanted;
    use signals::{Phase, Reading};

    #[test]
    fn the_receiver_is_off_only_where_it_can_see_nothing() {
        for (phase, depth, wanted) in [
            (Phase::Dive, Reading::now(100.0), false),
            (Phase::Climb, Reading::now(5.1), false),
            (Phase::Climb, Reading::now(4.9), true),
            (Phase::Dive, Reading::Missing, true),
            (Phase::Dive, Reading::now(f32::NAN), true),
            (Phase::Safe, Reading::now(900.0), true),
            (Phase::Surface, Reading::now(900.0), true),
            (Phase::Comms, Reading::now(6.0), true),
        ] {
            assert_eq!(gps_wanted(phase, depth), wanted, "{phase:?} {depth:?}");
        }
    }
}

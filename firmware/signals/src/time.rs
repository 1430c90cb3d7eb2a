//! Monotonic time as an argument: a u64 of microseconds never wraps in a
//! mission (584,000 years); the 32-bit wraps that broke other vehicles
//! (71.6 min in µs, 49.7 days in ms) are only numbers here.

use serde::{Deserialize, Serialize};

/// Monotonic time since the controller's own epoch, µs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Micros(pub u64);

impl Micros {
    /// From whole milliseconds.
    #[must_use]
    pub const fn from_millis(ms: u64) -> Self {
        Self(ms.saturating_mul(1_000))
    }

    /// From whole seconds.
    #[must_use]
    pub const fn from_secs(s: u64) -> Self {
        Self(s.saturating_mul(1_000_000))
    }

    /// Time elapsed since `earlier`; zero when the clock went backwards.
    #[must_use]
    pub const fn since(self, earlier: Self) -> Self {
        Self(self.0.saturating_sub(earlier.0))
    }

    /// This time plus a span, saturating at the end of time.
    #[must_use]
    pub const fn plus(self, span: Self) -> Self {
        Self(self.0.saturating_add(span.0))
    }

    /// Seconds as f32: for spans, not for absolute times (24-bit mantissa).
    #[must_use]
    pub fn seconds(self) -> f32 {
        // By halves: 32 bits are one instruction, 64 a library call (and a
        // branch between them is folded into the call).
        let (high, low) = ((self.0 >> 32) as u32, self.0 as u32);
        (high as f32 * 4_294_967_296.0 + low as f32) * 1e-6
    }
}

/// Where the board has its UTC from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum TimeSource {
    /// The host set it.
    Host,
    /// Fixes of the GPS receiver.
    Gps,
    /// Reckoned over a reset by the chip's own calendar clock.
    Kept,
}

/// UTC as a board knows it. Leap seconds are not counted, as in Unix time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Utc {
    /// Since 1970-01-01, ms.
    pub ms: u64,
    /// True UTC is at most so far from it, ms.
    pub within_ms: u32,
    /// Where it is from.
    pub source: TimeSource,
}

/// What a board's milliseconds come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Timebase {
    /// Not a chip: the time comes from the program that runs the controller.
    #[default]
    Elsewhere,
    /// The crystal, measured and right.
    Crystal,
    /// The internal oscillator: the crystal does not start, or cannot be measured.
    NoCrystal,
    /// The internal oscillator: the crystal is not the one that the board is built for.
    WrongCrystal,
}

/// What a board says of its time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Clock {
    /// What it runs on.
    pub base: Timebase,
    /// Since it was started, ms; none: it has no clock of its own.
    pub board_ms: Option<u64>,
    /// UTC at that moment; none: unknown.
    pub utc: Option<Utc>,
}

#[cfg(test)]
mod tests {
    use super::Micros;

    #[test]
    fn a_span_across_both_32_bit_wraps_is_just_a_span() {
        for wrap in [1u64 << 32, (1u64 << 32) * 1000] {
            let before = Micros(wrap - 30_000_000);
            let after = before.plus(Micros::from_secs(60));
            assert_eq!(after.since(before), Micros::from_secs(60));
            assert_eq!(before.since(after), Micros(0), "a clock that jumps back gives a zero span, not a huge one");
        }
    }
}

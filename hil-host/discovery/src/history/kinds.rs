//! The kinds of change that a mission is asked for, and the likelihood ratio from which one is named.
//!
//! **Threshold.** The run length of such a test in standard normal noise is known (Siegmund and Venkatraman 1995):
//! `ARL(h) ≈ √(2π) e^{h²/2} / (h ∫₀^∞ x ν²(x) dx)`, ν(x) ≈ e^{−0.583 x}, for one number tested both ways. The kinds are as many tests
//! (two-sided ones count one, one-sided ones half); the threshold is where all together have one alarm in [`DIVES_PER_ALARM`] dives.

use super::numbers::{BALLAST_OFFSET, COMPRESSIBILITY, DRAG_LEVEL, NUMBERS, PITCH_OFFSET, SLOPE_OF_LIFT};

/// Column of the pressure sensor's zero, behind the eight numbers: it is read afloat, and is none of theirs.
pub const AFLOAT_ZERO: usize = NUMBERS;
/// Columns of a dive in a mission.
pub const FOLLOWED: usize = NUMBERS + 1;

/// Dives in which one false alarm is accepted.
pub const DIVES_PER_ALARM: f64 = 1000.0;

/// How a change goes on from its onset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// At once, for good.
    Step,
    /// In proportion to the time since.
    Growth,
}

impl Shape {
    /// Name in documents.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Growth => "growth",
        }
    }
}

/// One kind of change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kind {
    /// Name.
    pub name: &'static str,
    /// What it is, in words.
    pub about: &'static str,
    /// Column of a dive's summary that changes ([`super::numbers`], or [`AFLOAT_ZERO`]).
    pub number: usize,
    /// How.
    pub shape: Shape,
    /// Sign of its size in the number (a leak is more mass); 0: either.
    pub sign: f64,
}

const fn kind(name: &'static str, about: &'static str, number: usize, shape: Shape, sign: f64) -> Kind {
    Kind { name, about, number, shape, sign }
}

/// All kinds.
pub const KINDS: [Kind; 9] = [
    kind("snag", "something caught on the vehicle, or a part bent: more drag at once", DRAG_LEVEL, Shape::Step, 1.0),
    kind("drag_shed", "what hung on the vehicle is gone: less drag at once", DRAG_LEVEL, Shape::Step, -1.0),
    kind("fouling", "growth on the hull: drag that grows", DRAG_LEVEL, Shape::Growth, 1.0),
    kind("wing_lost_or_bent", "less lift at once: a wing lost, loose or bent", SLOPE_OF_LIFT, Shape::Step, -1.0),
    kind("ballast_moved", "another trim at once: weight lost or taken in, water in the hull if heavier", BALLAST_OFFSET, Shape::Step, 0.0),
    kind(
        "trim_drifts",
        "weight that comes or goes: growth, water in the hull, or a density that drifts",
        BALLAST_OFFSET,
        Shape::Growth,
        0.0,
    ),
    kind("pitch_sensor_stepped", "another zero of the pitch sensor, or something inside has moved it", PITCH_OFFSET, Shape::Step, 0.0),
    kind("pressure_sensor_stepped", "another zero of the pressure sensor", AFLOAT_ZERO, Shape::Step, 0.0),
    kind("hull_softened", "another compressibility of the hull: gas or oil where there was none", COMPRESSIBILITY, Shape::Step, 0.0),
];

/// Alarms a dive in noise at a threshold, all kinds together.
#[must_use]
pub fn alarm_rate(threshold: f64) -> f64 {
    /// Of ν(x) ≈ e^{−2·0.583 x}: ∫ x ν² dx.
    const INTEGRAL: f64 = 1.0 / (4.0 * 0.583 * 0.583);
    let tests: f64 = KINDS.iter().map(|k| if k.sign == 0.0 { 1.0 } else { 0.5 }).sum();
    tests * threshold * INTEGRAL * (-0.5 * threshold * threshold).exp() / std::f64::consts::TAU.sqrt()
}

/// The threshold with one alarm in so many dives.
#[must_use]
pub fn threshold(dives_per_alarm: f64) -> f64 {
    let (mut low, mut high) = (1.5, 12.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if alarm_rate(middle) * dives_per_alarm > 1.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accuracy_the_threshold_is_where_the_alarms_are_as_many_as_asked() {
        for dives in [100.0, 1000.0, 1e5] {
            assert!((alarm_rate(threshold(dives)) * dives - 1.0).abs() < 1e-6);
        }
        // One number both ways: the run length of 4.0 sigma is 2.5066 e⁸ / (4.0 · 0.7356) = 2540 dives.
        let tests: f64 = KINDS.iter().map(|k| if k.sign == 0.0 { 1.0 } else { 0.5 }).sum();
        assert!((tests / alarm_rate(4.0) / 2540.0 - 1.0).abs() < 0.01, "{}", tests / alarm_rate(4.0));
    }
}

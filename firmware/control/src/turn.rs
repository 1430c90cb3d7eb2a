//! When to start a turn so that it ends at the turn depth.
//!
//! The pump runs at a constant rate r from −V to +V; speed follows the square
//! root of the net buoyancy, so from vertical speed w the vehicle goes on for
//! ```text
//! z = w ( 2/3 · V/r + lag )
//! ```
//! The lag (added mass, pump slower under pressure, cycle) is learned from
//! each turn; it starts long, so that the first turn is early rather than late.

use crate::bound::Bound;
use crate::config::Config;

/// Lag before any turn was flown, s: speed mode ≈ 10 s (m+m₁)U/2D, and half a cycle.
const LAG_FIRST_S: f32 = 12.0;
/// Bounds of the learned lag, s.
const LAG_RANGE_S: core::ops::RangeInclusive<f32> = -20.0..=120.0;
/// The turn aims this far inside the band, m: depth noise and water motion.
const AIM_INSIDE_M: f32 = 0.3;

/// What one kind of turn (low or high) has taught.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Turn {
    lag_s: f32,
}

impl Default for Turn {
    fn default() -> Self {
        Self { lag_s: LAG_FIRST_S }
    }
}

/// A turn under way, for learning.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Underway {
    /// Depth travelled towards the limit since the pump was started, m.
    pub(crate) from_m: f32,
    /// Vertical speed towards the limit at that moment, m/s.
    pub(crate) speed_m_s: f32,
    /// Ballast to undo at that moment, m³.
    pub(crate) ballast_m3: f32,
    /// Farthest depth reached, in the direction of the limit, m.
    pub(crate) peak_m: f32,
}

fn pump_span_s(config: &Config, ballast_m3: f32) -> f32 {
    2.0 / 3.0 * ballast_m3.at_least(0.0).at_most(config.pump_m3) / config.pump_rate_m3_s
}

impl Turn {
    /// Way still made after starting the pump now, m; never negative.
    #[inline(never)]
    pub(crate) fn carry_m(&self, config: &Config, speed_m_s: f32, ballast_m3: f32) -> f32 {
        let lag = if LAG_RANGE_S.contains(&self.lag_s) { self.lag_s } else { LAG_FIRST_S };
        (speed_m_s.at_least(0.0) * (pump_span_s(config, ballast_m3) + lag)).at_least(0.0) + AIM_INSIDE_M
    }

    /// Learns from a finished turn: quickly towards longer, slowly towards shorter.
    #[cold]
    #[inline(never)]
    pub(crate) fn learn(&mut self, config: &Config, turn: &Underway) {
        if !(turn.speed_m_s > 0.03) {
            return;
        }
        let lag = (turn.peak_m - turn.from_m) / turn.speed_m_s - pump_span_s(config, turn.ballast_m3);
        let share = if lag > self.lag_s { 0.8 } else { 0.4 };
        let next = self.lag_s + share * (lag - self.lag_s);
        self.lag_s = if next.is_finite() { next.at_least(*LAG_RANGE_S.start()).at_most(*LAG_RANGE_S.end()) } else { LAG_FIRST_S };
    }
}

#[cfg(test)]
mod tests {
    use super::{LAG_RANGE_S, Turn, Underway};
    use crate::config::Config;

    #[test]
    fn a_lag_that_no_turn_can_have_taught_is_the_first_one_again() {
        let c = Config::default();
        let turn = |speed_m_s, peak_m| Underway { from_m: 20.0, speed_m_s, ballast_m3: 2e-4, peak_m };
        for lag_s in [f32::NAN, f32::INFINITY, -20.1, 120.1] {
            assert_eq!(Turn { lag_s }.carry_m(&c, 0.2, 2e-4), Turn::default().carry_m(&c, 0.2, 2e-4), "{lag_s}");
            let mut taught = Turn { lag_s };
            taught.learn(&c, &turn(0.2, 25.0));
            assert!(LAG_RANGE_S.contains(&taught.lag_s), "{lag_s}: {taught:?}");
        }
        // 5 m at 0.2 m/s are 25 s, of which the pump's two thirds are known: quickly towards longer, slowly towards shorter.
        let lag_s = 25.0 - 2.0 / 3.0 * 2e-4 / c.pump_rate_m3_s;
        for (from_s, share) in [(lag_s - 10.0, 0.8), (lag_s + 10.0, 0.4)] {
            let mut taught = Turn { lag_s: from_s };
            taught.learn(&c, &turn(0.2, 25.0));
            assert!((taught.lag_s - (from_s + share * (lag_s - from_s))).abs() < 1e-3, "{taught:?}");
            assert!((Turn { lag_s: from_s }.carry_m(&c, 0.2, 2e-4) - 0.2 * (25.0 - lag_s + from_s) - 0.3).abs() < 1e-4);
        }
        for (speed_m_s, peak_m) in [(0.03, 25.0), (f32::NAN, 25.0), (0.2, f32::NAN), (0.2, f32::INFINITY)] {
            let mut taught = Turn::default();
            taught.learn(&c, &turn(speed_m_s, peak_m));
            assert_eq!(taught, Turn::default(), "nothing is learned at {speed_m_s} m/s to {peak_m} m");
        }
    }
}

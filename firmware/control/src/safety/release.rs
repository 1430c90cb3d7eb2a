//! The drop weight: when to fire it, and firing it again.
//!
//! ```text
//! 0 ........ working ............ at risk ............ crush
//!   after max_burn,     after min_burn,       at once
//!   not rising          not rising
//! at risk = crush − sink rate × (release time + reaction)
//! ```
//! "Not rising": no metre gained towards the surface since. Near the surface
//! with a buoyant pump the weight is kept for twice max_burn: that may be ice
//! or a keel, not a failure to float; but a heavy vehicle hangs below a layer
//! of light water just there, and nobody finds it. Without a depth, time alone decides: max_burn with
//! evidence of buoyancy, min_burn without.

use super::Watch;
use crate::bound::{Bound, all_finite};
use crate::config::Config;
use signals::{Abort, Weight};

/// Slowest sinking reckoned with in the at-risk rule, m/s.
const SINK_FLOOR_M_S: f32 = 0.05;
/// Reaction, s: two looks and the command's own cycle (12 s), and the time a sinking vehicle takes to stop (m U / 2 D, 8 s).
const REACTION_S: f32 = 20.0;
/// Way towards the surface that counts as rising, m.
const RISING_M: f32 = 1.0;
/// Shallower than this a buoyant vehicle is held by something above, m.
const KEEL_M: f32 = 8.0;
/// Shallower than this the vehicle is at the surface, or at the underside of ice, m.
const SURFACE_M: f32 = 2.0;
/// Deeper than this the antenna is under water, m: never heard for an hour there is lost, under ice or under light water.
const AWASH_M: f32 = 0.7;
/// Firings before the release is left on for good.
const FIRINGS: u8 = 5;

/// Depth zones of the rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Zone {
    /// Down to the working depth.
    Working,
    /// Deeper, with time left.
    Over,
    /// No time left: the weight must go now to be gone before crush depth.
    AtRisk,
}

/// The zone at a depth and sink rate (down positive).
pub(crate) fn zone(config: &Config, depth_m: f32, sink_m_s: f32) -> Zone {
    let at_risk = config.crush_depth_m - sink_m_s.at_least(SINK_FLOOR_M_S) * (config.release_time_s + REACTION_S);
    if depth_m >= at_risk.at_least(config.working_depth_m) {
        Zone::AtRisk
    } else if depth_m > config.working_depth_m {
        Zone::Over
    } else {
        Zone::Working
    }
}

/// Memory of the rule.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Release {
    fired: bool,
    firings: u8,
    firing_s: f32,
    not_rising_s: f32,
    mark_m: f32,
    marked: bool,
    at_risk: u8,
    lost: u8,
}

impl Release {
    /// The weight went without being fired: the vehicle is too light to dive.
    pub(crate) fn lost(&mut self, weight: Weight) -> bool {
        self.lost = if weight == Weight::Released && !self.fired { self.lost.saturating_add(1) } else { 0 };
        self.lost >= 3
    }

    pub(crate) fn has_fired(&self) -> bool {
        self.fired
    }

    /// Whether the release is to be on in this cycle.
    pub(crate) fn fire(&mut self, w: &Watch<'_>, abort: Option<Abort>) -> bool {
        if !all_finite([self.firing_s, self.not_rising_s, self.mark_m]) {
            *self = Self { fired: self.fired, ..Self::default() };
        }
        let dt = w.seen.dt_s;
        self.fired |= self.wanted(w, abort, dt);
        if !self.fired || w.frame.weight == Weight::Released {
            return false;
        }
        self.firing_s += dt;
        if self.firing_s > 1.5 * w.config.release_time_s + 30.0 && w.frame.weight == Weight::Held && self.firings < FIRINGS {
            // Off for one cycle, then again: a contact that did not close may do so now.
            self.firing_s = 0.0;
            self.firings += 1;
            return false;
        }
        true
    }

    fn wanted(&mut self, w: &Watch<'_>, abort: Option<Abort>, dt: f32) -> bool {
        let seen = w.seen;
        let buoyant = seen.ballast_m3.is_some_and(|b| b > 0.5 * w.config.pump_m3);
        if seen.depth_age_s < 10.0 {
            let zone = zone(w.config, seen.depth_m, seen.rate_m_s);
            // Believed at the second look, whether or not anything else has noticed.
            self.at_risk = if zone == Zone::AtRisk { self.at_risk.saturating_add(1) } else { 0 };
            // What cannot be undone waits longer where the two sensors contradict each other.
            if self.at_risk >= if seen.depths_disagree { 6 } else { 2 } {
                return true;
            }
        }
        if abort.is_none() || seen.afloat {
            self.not_rising_s = 0.0;
            self.marked = false;
            return false;
        }
        let known = seen.depth_age_s < 10.0;
        if !self.marked || (known && seen.depth_m < self.mark_m - RISING_M) {
            self.marked = true;
            self.mark_m = seen.depth_m;
            self.not_rising_s = 0.0;
        }
        self.not_rising_s = (self.not_rising_s + dt).at_most(1e6);
        if !known {
            return self.not_rising_s >= if buoyant { w.config.max_burn_s } else { w.config.min_burn_s };
        }
        if seen.depth_m < KEEL_M && buoyant {
            return seen.depth_m > AWASH_M && self.not_rising_s >= 2.0 * w.config.max_burn_s;
        }
        let patience = match zone(w.config, seen.depth_m, seen.rate_m_s) {
            // At risk was dealt with above, by counts.
            Zone::AtRisk | Zone::Over => w.config.min_burn_s,
            Zone::Working if !buoyant => w.config.min_burn_s,
            Zone::Working => w.config.max_burn_s,
        };
        // At the surface without fix or shore (ice, lost antenna): floating, not failing.
        seen.depth_m > SURFACE_M && self.not_rising_s >= patience
    }
}

#[cfg(test)]
mod tests {
    use super::{Zone, zone};
    use crate::config::Config;

    #[test]
    fn zones_meet_exactly_at_working_depth_and_at_risk_depth() {
        let c = Config::default();
        assert_eq!(zone(&c, 200.0, 0.0), Zone::Working);
        assert_eq!(zone(&c, 200.01, 0.0), Zone::Over);
        // 250 − 0.12 · 140 = 233.2 m.
        assert_eq!(zone(&c, 233.1, 0.12), Zone::Over);
        assert_eq!(zone(&c, 233.21, 0.12), Zone::AtRisk);
        // Rising: the floor of the sink rate still counts.
        assert_eq!(zone(&c, 242.9, -0.3), Zone::Over);
        assert_eq!(zone(&c, 243.1, -0.3), Zone::AtRisk);
        // So fast that no depth below working is safe; above it the leg's own limit acts.
        assert_eq!(zone(&c, 201.0, 2.0), Zone::AtRisk);
        assert_eq!(zone(&c, f32::NAN, 0.1), Zone::Working);
    }
}

//! The drop weight: when to fire it. The wish is withdrawn when the weight is known to be gone; burning and resting is the release's own.
//!
//! ```text
//! 0 ........ working ............ at risk ............ crush
//!   after max_burn,     after min_burn,       at once
//!   not rising          not rising
//! at risk = crush − sink rate × (release time + reaction)
//! ```
//! Two signs say that the pump alone will not do, and end the patience at any
//! depth: water in the hull (three samples of five) where the way up takes
//! longer than the release, and *sinking on* with the pump commanded out for a
//! minute (aborted: 12 s below the at-risk depth, with a leak or without a pump). A glider
//! climbs at 0.2 m/s on its pump; no water sinks that fast for so long, but a
//! flooding, netted or hunted one does. A leak of 20 g/min takes all the
//! buoyancy of a 236 cc pump in twelve minutes: waiting for "not rising" let a
//! vehicle come up from 190 m to 82 m and go down again beyond its hull.
//!
//! The budget comes before the clock: where the motion shows more on the vehicle
//! than the pump lifts ([`super::load`]), or the depth is unknown and the pump is
//! not where it lifts after the time that its stroke takes, waiting wins nothing.
//!
//! "Not rising": no metre gained towards the surface since. Near the surface
//! with a buoyant pump the weight is kept for twice max_burn: that may be ice
//! or a keel, not a failure to float; but a heavy vehicle hangs below a layer
//! of light water just there, and nobody finds it. Without a depth, time alone decides: max_burn with
//! evidence of buoyancy, min_burn without.

use super::{Verdict, Watch};
use crate::angle::sqrt;
use crate::bound::{Bound, all_finite};
use crate::config::Config;
use crate::mutant::Watch as Of;
use signals::{Phase, Weight};

/// Slowest sinking reckoned with in the at-risk rule, m/s.
const SINK_FLOOR_M_S: f32 = 0.05;
/// Reaction, s: two samples and the command's own cycle (12 s), and the time a sinking vehicle takes to stop (m U / 2 D, 8 s).
const REACTION_S: f32 = 20.0;
/// How far a turn may go beyond the working depth where a narrow band at 0.3 m/s leaves no time to judge the rate, m: two cycles' way.
const OVERSHOOT_M: f32 = 2.0;
/// Way towards the surface that counts as rising, m.
const RISING_M: f32 = 1.0;
/// Shallower than this a buoyant vehicle is held by something above, m.
const KEEL_M: f32 = 8.0;
/// Shallower than this the vehicle is at the surface, or at the underside of ice, m.
const NEAR_SURFACE_M: f32 = 2.0;
/// Deeper than this the antenna is under water, m: never heard for an hour there is lost, under ice or under light water.
const AWASH_M: f32 = 0.7;
/// Sinking that counts, m/s: above the noise of the depth rate.
pub const SINKS_M_S: f32 = 0.03;
/// Slower than this a depth stands still, m/s: noise of the rate.
const STANDS_M_S: f32 = 0.02;
/// Sinking on though commanded up, s: three times what a turn takes to stop sinking.
pub const SINKS_S: f32 = 60.0;
/// The same below the at-risk depth, with a leak or without a pump, s: three samples.
const SINKS_SHORT_S: f32 = 12.0;
/// A steep climb is tried for so long before the vehicle is taken for one that sinks whatever it does, s: the battery's way and the turn
/// of the nose. Tail first it falls three times as fast as in a glide; in water that sinks it rises by then.
const TRIAL_S: f32 = 24.0;
/// Sinking so much faster in the steep climb than before it is a load that pulls the vehicle down tail first, m/s: in water that sinks it
/// sinks slower there.
const FASTER_M_S: f32 = 0.05;
/// So long the pump has to be out before sinking on counts, s: a slow pump has only just begun to lift then.
const OUT_S: f32 = 20.0;
/// Share of the pump's range commanded out that must make the vehicle rise.
pub(super) const RISES: f32 = 0.4;
/// Slow ascent on the pump alone, m/s: nearer to the surface than release time × this the weight would go when it is up.
pub const ASCENT_M_S: f32 = 0.2;

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

/// Depth at which the weight must be fired to be gone before crush depth, m.
fn at_risk_m(config: &Config, sink_m_s: f32) -> f32 {
    config.crush_depth_m - sink_m_s.at_least(SINK_FLOOR_M_S) * (config.release_time_s + REACTION_S)
}

/// Half as much again as the pump needs over its whole range, s.
#[must_use]
pub fn pump_stroke_s(config: &Config) -> f32 {
    3.0 * config.pump_m3 / config.pump_rate_m3_s
}

/// Depth rate of a glide on so much ballast, m/s, down: the slow ascent's, with the root of the ballast. For dead reckoning; half as
/// much again or less is what tables and pitches make of it.
pub(crate) fn steady_m_s(config: &Config, ballast_m3: f32) -> f32 {
    let rate = ASCENT_M_S * sqrt(ballast_m3.abs() / config.pump_m3);
    if ballast_m3 > 0.0 { -rate } else { rate }
}

/// Time that the pump may still need to make the vehicle rise, s: half as much again as over its whole range.
fn pump_time_s(w: &Watch<'_>) -> f32 {
    let out = w.seen.ballast_m3.is_some_and(|at| at > RISES * w.config.pump_m3);
    if out { 0.0 } else { pump_stroke_s(w.config) }
}

/// The zone at a depth and sink rate (down positive).
pub(crate) fn zone(config: &Config, depth_m: f32, sink_m_s: f32) -> Zone {
    if depth_m >= at_risk_m(config, sink_m_s).at_least(config.working_depth_m + OVERSHOOT_M) {
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
    firing_s: f32,
    not_rising_s: f32,
    /// Time sinking though commanded up, s.
    sinking_s: f32,
    /// Time that the pump has been out, s.
    out_s: f32,
    /// Time since the abort, s.
    aborted_s: f32,
    /// Depth rate when the ascent began, m/s.
    ascent_from_m_s: f32,
    /// The vehicle sinks in the ascent for long with its weight fired, or faster than before, and does not rise yet.
    sunk: bool,
    /// Time spent where the surface should be with the antenna under water, since it was last out, s.
    unheard_s: f32,
    mark_m: f32,
    marked: bool,
    at_risk: u8,
    lost: u8,
    /// The weight went without being fired, whatever its monitor says since.
    gone: bool,
}

impl Release {
    /// The rule has wished for nothing so far.
    pub(crate) fn is_quiet(&self) -> bool {
        !self.fired && !self.gone && self.lost == 0
    }

    /// The weight went without being fired: the vehicle is too light to dive.
    pub(crate) fn lost(&mut self, weight: Weight) -> bool {
        self.lost = if weight == Weight::Released && !self.fired { self.lost.saturating_add(1) } else { 0 };
        self.gone |= self.lost >= 3;
        self.lost >= 3
    }

    /// Fired before a reset: fired anew, for as long as at first.
    pub(crate) fn fire_on(&mut self) {
        self.fired = true;
    }

    pub(crate) fn has_fired(&self) -> bool {
        self.fired
    }

    /// Whether the vehicle sinks on though it is commanded to rise and has had the time to.
    pub(crate) fn sinks(&mut self, w: &Watch<'_>, aborted: bool, loaded: bool) -> bool {
        let seen = w.seen;
        // Aborted, the pump is commanded out whatever a retry says in this cycle.
        let wanted_up = aborted || w.commanded.ballast_m3 > RISES * w.config.pump_m3;
        // With a load that is known of, what does not rise sinks on, until the weight is fired.
        let loaded = loaded && !self.fired;
        let slowest_m_s = if loaded { -SINKS_M_S } else { SINKS_M_S };
        let sinks = wanted_up && seen.depth_age_s <= 0.0 && seen.rate_m_s > slowest_m_s && !seen.afloat;
        self.sinking_s = if sinks { (self.sinking_s + seen.dt_s).at_most(1e4) } else { self.sinking_s * seen.unchanged() };
        let out = pump_time_s(w) <= 0.0;
        self.out_s = if out { (self.out_s + seen.dt_s).at_most(1e4) } else { 0.0 };
        let patience_s = if loaded { SINKS_SHORT_S } else { SINKS_S };
        let found = self.sinking_s >= Of::SinksOn.after(patience_s + pump_time_s(w))
            && (!out || self.out_s >= if loaded { 2.0 * OUT_S } else { OUT_S });
        let all = w.ballast_m3 > 0.9 * w.config.pump_m3;
        if found && !aborted && !all {
            self.sinking_s = TRIAL_S; // what the climb's ballast did not do, all of it and a steep climb may
        }
        found
    }

    /// Whether the vehicle sinks though pump and weight do what they can: slowly is then the best it can do.
    pub(crate) fn sunk(&self) -> bool {
        self.sunk
    }

    /// Whether the vehicle floats below the surface: twice it waited for shore in vain, with its antenna under water. Once
    /// may be ice, and is tried again elsewhere.
    pub(crate) fn floats_below(&mut self, w: &Watch<'_>) -> bool {
        if w.seen.afloat {
            self.unheard_s = 0.0;
        } else if matches!(w.phase, Phase::Comms | Phase::Done) && w.seen.depth_m > AWASH_M {
            self.unheard_s = (self.unheard_s + w.seen.dt_s).at_most(1e6);
        }
        self.unheard_s > Of::FloatsBelow.after(1.9 * w.config.comms_patience_s)
    }

    /// Whether the release is to be on in this cycle.
    pub(crate) fn fire(&mut self, w: &Watch<'_>, v: &Verdict) -> bool {
        if !all_finite([
            self.firing_s,
            self.not_rising_s,
            self.sinking_s,
            self.out_s,
            self.aborted_s,
            self.ascent_from_m_s,
            self.unheard_s,
            self.mark_m,
        ]) {
            *self = Self { fired: self.fired, gone: self.gone, ..Self::default() };
        }
        let dt = w.seen.dt_s;
        let before_s = self.aborted_s;
        self.aborted_s = if v.abort.is_none() || w.seen.afloat { 0.0 } else { (self.aborted_s + dt).at_most(1e6) };
        if before_s <= 0.0 {
            self.ascent_from_m_s = w.seen.rate_m_s;
        }
        self.fired |= self.wanted(w, v, dt);
        let faster = w.seen.rate_m_s > self.ascent_from_m_s.at_least(0.0) + FASTER_M_S;
        let falls = faster && self.sinking_s >= SINKS_SHORT_S && self.aborted_s >= SINKS_SHORT_S && self.out_s >= OUT_S;
        // Ends when it rises; a glide so flat that it hardly sinks goes on. A minute of sinking, the end of it in the ascent, tells it too.
        self.sunk &= w.seen.depth_age_s <= 0.0 && w.seen.rate_m_s >= 0.0;
        self.sunk |= falls || self.fired && self.sinking_s >= SINKS_S + pump_time_s(w) && self.aborted_s >= TRIAL_S;
        if !self.fired {
            return false;
        }
        // Without the weight the ascent is tried anew: water that sinks is not won in a glide.
        let gone_after_s = w.config.release_time_s + REACTION_S;
        let held = self.firing_s < gone_after_s;
        self.firing_s = (self.firing_s + dt).at_most(1e6);
        if held && self.firing_s >= gone_after_s {
            self.sunk = false;
            self.sinking_s = 0.0;
            self.ascent_from_m_s = w.seen.rate_m_s;
        }
        // At first whatever the monitor says: it may be wrong, and a wire once hot burns through.
        self.firing_s <= 1.5 * w.config.release_time_s + 30.0 || w.frame.weight != Weight::Released
    }

    fn wanted(&mut self, w: &Watch<'_>, v: &Verdict, dt: f32) -> bool {
        let seen = w.seen;
        let buoyant = seen.ballast_m3.is_some_and(|b| b > 0.5 * w.config.pump_m3);
        if seen.depth_age_s < 10.0 {
            let zone = zone(w.config, seen.depth_m, seen.rate_m_s);
            // Believed at the second look, whether or not anything else has noticed.
            self.at_risk = if zone == Zone::AtRisk { self.at_risk.saturating_add(1) } else { 0 };
            // What cannot be undone waits longer where the two sensors contradict each other.
            let samples = if seen.depths_disagree { 6 } else { 2 };
            if self.at_risk >= samples && Of::AtRisk.enabled() {
                return true;
            }
        }
        // An antenna that is heard with a depth that stands still: the depth may be what is wrong.
        let heard = seen.afloat || seen.antenna && seen.rate_m_s.abs() < STANDS_M_S;
        if v.abort.is_none() || heard {
            self.not_rising_s = 0.0;
            self.marked = false;
            return false;
        }
        // A depth above the surface, with the antenna under water, is none.
        let known = seen.depth_age_s < 10.0 && seen.depth_m > -RISING_M - NEAR_SURFACE_M;
        let far = !known || seen.depth_m > ASCENT_M_S * w.config.release_time_s;
        if (v.leak_stands && Of::LeakWeight.enabled() || v.pump_loses) && far {
            return true;
        }
        let out = seen.ballast_m3.is_none_or(|at| at > RISES * w.config.pump_m3);
        let pump_lost = v.pump_lost && !out;
        if !known && !out && Of::BlindWeight.enabled() && (v.pump_lost || self.aborted_s > pump_stroke_s(w.config)) {
            return true;
        }
        let at_risk = seen.depth_m >= at_risk_m(w.config, seen.rate_m_s);
        let patience = if pump_lost || v.leak_stands || v.loaded || at_risk { SINKS_SHORT_S } else { SINKS_S };
        let patience = Of::SinksOn.after(patience + if pump_lost { 0.0 } else { pump_time_s(w) });
        if self.sinking_s >= patience && Of::SinksOn.enabled() {
            return true;
        }
        // Waves under the surface are no rise.
        if !self.marked || (known && seen.depth_m.at_least(KEEL_M) < self.mark_m - RISING_M) {
            self.marked = true;
            self.mark_m = seen.depth_m;
            self.not_rising_s = 0.0;
        }
        self.not_rising_s = (self.not_rising_s + dt).at_most(1e6);
        if !known {
            let patience = if buoyant { w.config.max_burn_s } else { w.config.min_burn_s };
            return self.not_rising_s >= Of::NotRising.after(patience) && Of::NotRising.enabled();
        }
        if seen.depth_m < KEEL_M && (buoyant || seen.depth_m <= NEAR_SURFACE_M) {
            return seen.depth_m > AWASH_M
                && self.not_rising_s >= Of::NotRising.after(2.0 * w.config.max_burn_s)
                && Of::NotRising.enabled();
        }
        let patience = match zone(w.config, seen.depth_m, seen.rate_m_s) {
            // At risk was dealt with above, by counts.
            Zone::AtRisk | Zone::Over => w.config.min_burn_s,
            Zone::Working if !buoyant => w.config.min_burn_s,
            Zone::Working => w.config.max_burn_s,
        };
        self.not_rising_s >= Of::NotRising.after(patience) && Of::NotRising.enabled()
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
        // So fast that no depth below working is safe; a turn's overshoot is allowed, and above it the leg's own limit acts.
        assert_eq!(zone(&c, 202.1, 2.0), Zone::AtRisk);
        assert_eq!(zone(&c, 201.9, 2.0), Zone::Over);
        assert_eq!(zone(&c, f32::NAN, 0.1), Zone::Working);
    }
}

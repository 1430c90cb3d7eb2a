//! How deep, by the truth: what every mission owes as long as its depth is measured, whatever else broke.
//!
//! | deeper than | owed |
//! |---|---|
//! | the mission's deepest leg by 10 m and 5 %, or the working depth by 5 m and 2 % | an abort ([`demands::TOO_DEEP_S`]) |
//! | the working depth, and the depth from which the weight, heated for its whole time, goes above crush depth at the rate of now | the weight fired ([`demands::AT_RISK_S`]) |
//!
//! Both depths are reckoned from the truth and the vehicle's limits. A mission whose depth sensors are among its faults is judged by
//! where it ends alone.

use super::demands;
use super::lattice::Case;
use crate::flight::cycle::Cycle;
use crate::seats::CYCLE_S;
use control::Config;
use plant::faults::Target;

/// Rule broken: deeper than the mission allows, and no abort.
pub const TOO_DEEP: &str = "too deep without an abort";
/// Rule broken: at the depth at risk, and the weight not fired.
pub const AT_RISK: &str = "at the depth at risk without the weight fired";

/// Slowest sinking reckoned with below the working depth, m/s.
const SINK_FLOOR_M_S: f64 = 0.05;

/// Whether a depth is beyond what leg and vehicle allow.
#[must_use]
pub fn too_deep(depth_m: f64, config: &Config, deepest_m: f64) -> bool {
    let z = depth_m - demands::DEPTH_NOISE_M;
    let below = |depth_m: f64, (by_m, share): (f64, f64)| (depth_m + by_m).max(depth_m * share);
    z > below(deepest_m, demands::OVER_LEG).min(below(f64::from(config.working_depth_m), demands::OVER_WORKING))
}

/// Whether the weight, fired now, is gone no sooner than at crush depth.
#[must_use]
pub fn at_risk(depth_m: f64, sink_m_s: f64, config: &Config) -> bool {
    let way_m = sink_m_s.max(SINK_FLOOR_M_S) * f64::from(config.release_time_s);
    let from_m = (f64::from(config.crush_depth_m) - way_m).max(f64::from(config.working_depth_m));
    depth_m - demands::DEPTH_NOISE_M > from_m
}

/// Watches one mission.
#[derive(Clone, Copy, Debug)]
pub struct Zones {
    measured: bool,
    too_deep_s: f64,
    at_risk_s: f64,
}

impl Zones {
    /// For this case.
    #[must_use]
    pub fn of(case: &Case) -> Self {
        let measured = !case.faults.iter().any(|f| matches!(f.target, Target::Depth | Target::Depth2));
        Self { measured, too_deep_s: 0.0, at_risk_s: 0.0 }
    }

    /// Takes a cycle; the rule broken in it, if any. `fired`: the weight was, until now.
    pub fn see(&mut self, cycle: &Cycle<'_>, config: &Config, deepest_m: f64, fired: bool) -> Option<&'static str> {
        if !self.measured {
            return None;
        }
        let (t, aborted) = (cycle.truth, cycle.answer.trace.abort.is_some());
        let stands = |since_s: f64, zone: bool| if zone { since_s + CYCLE_S } else { 0.0 };
        self.too_deep_s = stands(self.too_deep_s, !aborted && too_deep(t.depth_m, config, deepest_m));
        self.at_risk_s = stands(self.at_risk_s, !fired && at_risk(t.depth_m, t.sink_rate_m_s, config));
        if self.too_deep_s > demands::TOO_DEEP_S {
            Some(TOO_DEEP)
        } else if self.at_risk_s > demands::AT_RISK_S {
            Some(AT_RISK)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use control::Settings;
    use plant::Truth;
    use signals::{Abort, Answer, SensorFrame};

    #[test]
    fn too_deep_and_at_risk_follow_from_leg_limits_and_release() {
        let c = Config::new(Settings::slocum_200()).expect("valid");
        // 190 m: 10 m more; 198 m of 200 m: five below the working depth come first; half a metre of noise.
        for (depth_m, leg_m, is) in [(200.4, 190.0, false), (200.6, 190.0, true), (205.4, 198.0, false), (205.6, 198.0, true)] {
            assert_eq!(too_deep(depth_m, &c, leg_m), is, "{depth_m} of {leg_m}");
        }
        // 120 s at 0.3 m/s above 250 m; never above the working depth; and 6 m where it hardly sinks.
        for (depth_m, sink, is) in [(214.4, 0.3, false), (214.6, 0.3, true), (199.0, 1.0, false), (244.0, 0.0, false), (245.0, -0.2, true)]
        {
            assert_eq!(at_risk(depth_m, sink, &c), is, "{depth_m} at {sink} m/s");
        }
    }

    #[test]
    fn a_rule_is_broken_after_its_time_and_not_with_a_wrong_depth() {
        let c = Config::new(Settings::slocum_200()).expect("valid");
        let case = |fault: &str| Case {
            water: super::super::lattice::Water::Edge,
            wings: signals::Wings::Standard,
            seed: 0,
            faults: vec![fault.parse().expect("a fault")],
            line: None,
        };
        let sees = |fault: &str, depth_m: f64, abort: Option<Abort>, fired: bool| {
            let (frame, truth, mut answer) = (SensorFrame::default(), Truth { depth_m, ..Truth::default() }, Answer::default());
            answer.trace.abort = abort;
            let mut zones = Zones::of(&case(fault));
            (1..20).find_map(|n| {
                let cycle = Cycle { time_s: 0.0, frame: &frame, answer: &answer, truth: &truth, resets: 0 };
                zones.see(&cycle, &c, 190.0, fired).map(|rule| (n, rule))
            })
        };
        assert_eq!(sees("pump:slow", 210.0, None, false), Some((5, TOO_DEEP)));
        assert_eq!(sees("pump:slow", 248.0, Some(Abort::OverDepth), false), Some((4, AT_RISK)));
        assert_eq!(sees("pump:slow", 248.0, Some(Abort::OverDepth), true), None);
        assert_eq!(sees("pump:slow", 199.0, None, false), None);
        assert_eq!(sees("depth2:drift", 248.0, None, false), None);
    }
}

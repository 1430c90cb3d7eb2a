//! The healthy twin of a case: what the pump was asked for, and when.
//!
//! Until its fault acts a mission is its twin, bit for bit. So the twin knows
//! before the mission is flown when a fault that waits for a phase begins, where
//! the pump then stands, and when it is next asked to be elsewhere: no earlier
//! can a pump that holds still, or one that stands where it was sent, be told
//! from a sound one. A battery that runs away is seen on its way, if it has one.

use super::bounds;
use super::demands;
use super::expect::Ahead;
use super::lattice::Case;
use crate::flight::closed_loop::{Setup, fly};
use crate::seats::Link;
use crate::seats::in_process::InProcess;
use anyhow::anyhow;
use plant::faults::{Kind, Target};
use plant::{Fault, World};
use signals::Phase;

/// Pump error that no controller need mind, m³: what the law leaves alone, 0.1 N.
const NEAR_M3: f64 = demands::PUMP_NEAR_M3;

/// One control cycle of the twin.
#[derive(Clone, Copy, Debug)]
struct Moment {
    time_s: f64,
    phase: Phase,
    /// Where the pump stands, and where it is asked to be, m³.
    pump_m3: f64,
    asked_m3: f64,
    battery_m: f64,
}

/// What is kept of a healthy flight.
#[derive(Clone, Debug)]
pub struct Twin {
    moments: Vec<Moment>,
    limit_m3: f64,
    travel_m: f64,
}

/// Whether a drive with this fault stands still: stuck, standing all the time, or moving at no rate.
pub(super) fn halts(fault: &Fault) -> bool {
    match fault.kind {
        Kind::Stuck => true,
        Kind::Intermittent => fault.size >= 1.0,
        Kind::Slow => fault.size <= 0.0,
        _ => false,
    }
}

impl Twin {
    /// Flies the twin of a case.
    ///
    /// # Errors
    /// The world cannot be, or the controller does not answer.
    pub fn of(case: &Case) -> anyhow::Result<Self> {
        let twin = case.twin();
        let mut world = World::new(twin.scenario()).map_err(|e| anyhow!("{e}"))?;
        let actuators = world.scenario().actuators;
        let (limit_m3, travel_m) = (actuators.pump.volume_m3, actuators.battery_travel_m);
        let mut moments = Vec::new();
        fly(&mut world, &mut Link::new(InProcess::default()), &Setup::new(twin.mission()), &mut |c| {
            let asked_m3 = f64::from(c.answer.command.ballast_m3);
            let (phase, battery_m) = (c.answer.trace.phase, c.truth.battery_mass_m);
            moments.push(Moment { time_s: c.time_s, phase, pump_m3: c.truth.ballast_m3, asked_m3, battery_m });
            Ok(())
        })?;
        Ok(Self { moments, limit_m3, travel_m })
    }

    /// The twin of a case that cannot be judged without one: of a fault that holds pump, feedback or battery somewhere.
    ///
    /// # Errors
    /// As for [`Self::of`].
    pub fn if_needed(case: &Case) -> anyhow::Result<Option<Self>> {
        let needs = |f: &Fault| {
            matches!(
                (f.target, f.kind),
                (Target::Pump, Kind::Runaway | Kind::Stuck)
                    | (Target::BallastFeedback, Kind::Stuck)
                    | (Target::Command, Kind::Lost)
                    | (Target::MassMotor, Kind::Runaway)
            )
        };
        // Of a pair only the pump's place is asked for, by the budget.
        if matches!(case.faults.as_slice(), [one] if needs(one)) { Self::of(case).map(Some) } else { Self::for_budget(case) }
    }

    /// The twin of a case whose budget cannot be made without one: of a pump that sticks.
    ///
    /// # Errors
    /// As for [`Self::of`].
    pub fn for_budget(case: &Case) -> anyhow::Result<Option<Self>> {
        let stuck = case.faults.iter().any(|f| f.target == Target::Pump && halts(f));
        stuck.then(|| Self::of(case)).transpose()
    }

    /// When the phase is entered that a fault waits for, s; none: it never is.
    fn entered_s(&self, fault: &Fault) -> Option<f64> {
        self.moments.iter().find(|m| fault.phase.is_none_or(|p| p == m.phase)).map(|m| m.time_s)
    }

    /// When a fault begins, s; none: its phase is never reached.
    #[must_use]
    pub fn onset_s(&self, fault: &Fault) -> Option<f64> {
        self.entered_s(fault).map(|s| s + fault.delay_s)
    }

    /// Where a fault holds the pump, or its feedback, m³; none: it does neither, or never begins.
    #[must_use]
    pub fn held_m3(&self, fault: &Fault) -> Option<f64> {
        match (fault.target, fault.kind) {
            (Target::Pump, Kind::Runaway) => Some(fault.size * self.limit_m3),
            // Without commands it goes out by itself.
            (Target::Command, Kind::Lost) => Some(self.limit_m3),
            // A motor stops at once; a sensor repeats its first reading after the phase is known.
            (Target::Pump, _) if halts(fault) => self.pump_m3_at(self.onset_s(fault)?, f64::NEG_INFINITY),
            (Target::BallastFeedback, Kind::Stuck) => self.pump_m3_at(self.onset_s(fault)?, self.entered_s(fault)?),
            _ => None,
        }
    }

    /// Where the pump is at the first moment from `from_s` on that is after `after_s`, m³.
    fn pump_m3_at(&self, from_s: f64, after_s: f64) -> Option<f64> {
        self.moments.iter().find(|m| m.time_s >= from_s && m.time_s > after_s).map(|m| m.pump_m3)
    }

    /// What the twin knows of a fault before it is flown.
    #[must_use]
    pub fn ahead(&self, fault: &Fault) -> Ahead {
        Ahead { pump_needed_s: self.asked_elsewhere_s(fault), mass_way_m: self.mass_way_m(fault) }
    }

    /// Way that a battery motor running away has before it when it begins, m; none for any other fault.
    fn mass_way_m(&self, fault: &Fault) -> f64 {
        let runs = (fault.target, fault.kind) == (Target::MassMotor, Kind::Runaway);
        let at = self.onset_s(fault).filter(|_| runs).and_then(|onset_s| self.moments.iter().find(|m| m.time_s >= onset_s));
        at.map_or(0.0, |m| (fault.size * self.travel_m - m.battery_m).abs())
    }

    /// Time from a fault's onset until the pump is asked, and not only for a cycle, to be elsewhere than where the fault holds
    /// it, s. Infinite where it never is again. Asked for less time than its tries take, a stuck pump is not found out.
    #[must_use]
    pub fn asked_elsewhere_s(&self, fault: &Fault) -> f64 {
        let (Some(onset_s), Some(held_m3)) = (self.onset_s(fault), self.held_m3(fault)) else { return f64::INFINITY };
        let mut since_s = None;
        for m in self.moments.iter().filter(|m| m.time_s >= onset_s) {
            let elsewhere = (m.asked_m3 - held_m3).abs() > NEAR_M3;
            since_s = elsewhere.then(|| since_s.unwrap_or(m.time_s));
            if let Some(since_s) = since_s.filter(|s| m.time_s - s >= bounds::pump_tries_s()) {
                return since_s - onset_s;
            }
        }
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::lattice::Water;
    use plant::actuators::Pump;
    use signals::Wings;

    #[test]
    fn the_twin_knows_when_a_fault_begins_and_when_the_pump_is_next_needed() {
        let case = |fault: &str| Case {
            water: Water::Shallow,
            wings: Wings::Standard,
            seed: 3,
            faults: vec![fault.parse().expect("a fault")],
            line: None,
        };
        let twin = Twin::of(&case("pump:stuck@climb")).expect("flies");
        let fault = |text: &str| text.parse::<Fault>().expect("a fault");
        let first = |phase: &str| twin.onset_s(&fault(&format!("pump:stuck@{phase}"))).expect("reached");
        // Asked to turn in the very cycle: at once. The dive's first cycle asks the floating vehicle's pump in.
        for phase in ["dive", "inflect_low", "inflect_high"] {
            assert_eq!(twin.asked_elsewhere_s(&fault(&format!("pump:stuck@{phase}"))), 0.0, "{phase}");
        }
        // At rest in the climb: when the upper turn begins, and so for the feedback. Run away to the buoyant end: the same.
        let climb_s = first("inflect_high") - first("climb");
        assert!(climb_s > 100.0, "{climb_s}");
        for text in ["pump:stuck@climb", "ballast:stuck@climb", "pump:runaway=1@climb"] {
            assert_eq!(twin.asked_elsewhere_s(&fault(text)), climb_s, "{text}");
        }
        assert_eq!(twin.asked_elsewhere_s(&fault("pump:stuck@climb+20s")), climb_s - 20.0);
        // Run away to the sink end while diving: at the lower turn. Half way through a stroke: now.
        assert_eq!(twin.asked_elsewhere_s(&fault("pump:runaway=-1@dive+40s")), first("inflect_low") - first("dive") - 40.0);
        assert_eq!(twin.asked_elsewhere_s(&fault("pump:stuck@inflect_low+8s")), 0.0);
        // Run away at the surface one cycle before the dive asks for the same: at the lower turn too.
        assert_eq!(twin.asked_elsewhere_s(&fault("pump:runaway=-1@surface")), first("inflect_low") - first("surface"));
        // Without commands it goes out: when the dive that began is to be flown.
        assert_eq!(twin.asked_elsewhere_s(&fault("command:lost@inflect_low")), first("inflect_high") - first("inflect_low"));
        // What holds no pump has no such time.
        assert_eq!(twin.asked_elsewhere_s(&fault("depth:stuck@climb")), f64::INFINITY);
        assert_eq!(twin.held_m3(&fault("pump:runaway=-1@climb")), Some(-230e-6));
        // At the surface the battery stands at its forward end; in a climb it is two centimetres from there.
        let ways = ["comms", "climb"].map(|phase| twin.ahead(&fault(&format!("mass_motor:runaway=1@{phase}+20s"))).mass_way_m);
        assert!(ways[0] < 0.001 && ways[1] > 0.02, "{ways:?}");
    }

    #[test]
    fn the_pumps_tolerance_is_above_its_error_and_below_any_glides_need() {
        for pump in [Pump::shallow_100(), Pump::shallow_200(), Pump::deep()] {
            // Its dead-band and three times the noise of its feedback.
            assert!(NEAR_M3 > pump.dead_band_m3 + 3.0 * 0.3e-6 && NEAR_M3 < 0.1 * pump.volume_m3, "{pump:?}");
        }
    }
}

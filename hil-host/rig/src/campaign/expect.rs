//! What the controller owes to each fault.
//!
//! The global rules hold for every case (surface, crush depth, ranges, latch).
//! On top of them every fault of the catalogue has a row here; one without is
//! held against the controller. Four kinds of row:
//!
//! | | the mission |
//! |---|---|
//! | `Abort` | is over within a bound, by one of these first causes: the law sees the fault for certain |
//! | `Home` | has turned for the surface within a bound; an abort on the way only by these causes |
//! | `Mission` | goes on: harmless by design |
//! | `Tolerated` | goes on or is aborted, by these causes only: the effect decides; what it owes once the effect shows are its duties |
//!
//! Bounds count from the fault's onset, duties from their sign, and both are
//! sums of what is demanded ([`super::bounds`]); the judge adds the
//! control cycle between onset and reading. Where the failed part shows only when
//! it is next needed, the time until then is that of the mission's own healthy
//! twin ([`super::twin`]).

use super::bounds::{self, THREE_SAMPLES_S};
use super::demands;
use super::signs::Sign;
use crate::seats::CYCLE_S;
use control::Config;
use plant::Fault;
use plant::faults::{Kind, Target};
use signals::{Abort, Phase};

/// Age until which the law believes a reading, s.
const FRESH_S: f64 = CYCLE_S + demands::LATE_S;

/// Permitted first causes of an abort.
pub type Causes = &'static [Abort];

/// Expected behaviour beyond the global rules.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(from = "super::blocks::Owed", into = "super::blocks::Owed")]
pub enum Expect {
    /// Abort with one of these first causes within this many seconds.
    Abort(Causes, f64),
    /// No later than this many seconds the vehicle has turned for the surface; an abort on the way only with one of these causes.
    Home(Causes, f64),
    /// The mission goes on: no abort.
    Mission,
    /// The mission goes on, or an abort with one of these causes; and these duties.
    Tolerated(Causes, Vec<Duty>),
}

/// What is owed once a sign has stood for so long.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Duty {
    /// What shows.
    pub sign: Sign,
    /// What is owed then.
    pub act: Act,
    /// After how long, s.
    pub within_s: f64,
}

/// What a duty asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Act {
    /// An abort.
    Abort,
    /// An abort, or no more dive.
    Turn,
}

/// What the healthy twin knows of a fault before it is flown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ahead {
    /// Time from the onset until the pump is asked to be elsewhere than where the fault holds it or its feedback, s.
    pub pump_needed_s: f64,
    /// Way that a battery motor running away has before it, m.
    pub mass_way_m: f64,
}

impl Ahead {
    /// Of a fault that holds neither pump nor battery.
    pub const NOTHING: Self = Self { pump_needed_s: f64::INFINITY, mass_way_m: 0.0 };
}

impl Expect {
    /// Kind of row, as in the report.
    #[must_use]
    pub const fn kind(&self) -> &'static str {
        match self {
            Self::Abort(..) => "abort",
            Self::Home(..) => "home",
            Self::Mission => "mission",
            Self::Tolerated(..) => "tolerated",
        }
    }

    /// First causes that are right.
    #[must_use]
    pub const fn causes(&self) -> Causes {
        match self {
            Self::Abort(causes, _) | Self::Home(causes, _) | Self::Tolerated(causes, _) => causes,
            Self::Mission => &[],
        }
    }

    /// Duties that go with it.
    #[must_use]
    pub fn duties(&self) -> &[Duty] {
        match self {
            Self::Tolerated(_, duties) => duties,
            _ => &[],
        }
    }
}

fn owes(sign: Sign, within_s: f64) -> Duty {
    Duty { sign, act: Act::Abort, within_s }
}

/// What is owed to a single fault; none: it has no row.
#[must_use]
pub fn expect(fault: &Fault, config: &Config, ahead: &Ahead) -> Option<Expect> {
    let rule = match fault.target {
        Target::Depth | Target::Depth2 => depth(fault),
        Target::Pitch => pitch(fault),
        Target::Heading => heading(fault),
        Target::BallastFeedback => ballast_feedback(fault, config, ahead),
        Target::MassFeedback => mass_feedback(fault, config),
        Target::FinFeedback => fin_feedback(fault),
        Target::Roll | Target::Density | Target::Altitude => bystander(fault),
        Target::Voltage => gauge(fault, Sign::Volts, &[Abort::Undervoltage]),
        Target::Charge => gauge(fault, Sign::Charge, &[Abort::LowCharge]),
        Target::VacuumGauge => gauge(fault, Sign::Vacuum, &[Abort::Vacuum]),
        Target::LeakDetector | Target::WeightMonitor | Target::Gps | Target::Comms => detector(fault),
        Target::Pump | Target::MassMotor | Target::FinMotor | Target::Release | Target::Command => actuator(fault, config, ahead),
        Target::Hull | Target::Vehicle | Target::Sea | Target::Power => outside(fault, config),
        _ => None,
    };
    Some(match rule? {
        // A fault that is over before the bound need not be seen, and no dive is missed for one that is over.
        Expect::Abort(causes, bound) if fault.duration_s.is_some_and(|d| d < bound) => Expect::Tolerated(causes, Vec::new()),
        Expect::Home(&[], _) if fault.duration_s.is_some() => Expect::Mission,
        Expect::Home(causes, _) if fault.duration_s.is_some() => Expect::Tolerated(causes, Vec::new()),
        rule => rule,
    })
}

/// What is owed to the only depth sensor; none: the rules of every mission, no more.
#[must_use]
pub fn alone(fault: &Fault) -> Option<Expect> {
    const CAUSE: Causes = &[Abort::SensorDepth];
    let bound_s = demands::alone_s(fault.kind)?;
    Some(match fault.kind {
        Kind::Stuck => Expect::Abort(&[Abort::StuckDepth], bound_s),
        Kind::Drift => Expect::Abort(CAUSE, bound_s),
        // Bridged and back: no reason to end anything.
        _ if fault.duration_s.is_some_and(|s| s <= demands::HEALS_S) => Expect::Mission,
        // Turned for the surface when it is missed, and not one dive more; aborted when it does not come back.
        _ => Expect::Home(CAUSE, demands::NO_DEPTH_S + 3.0 * CYCLE_S),
    })
}

/// Begins at the surface.
fn afloat(fault: &Fault) -> bool {
    matches!(fault.phase, Some(Phase::Surface | Phase::Comms))
}

/// Begins in a turn.
fn turning(fault: &Fault) -> bool {
    matches!(fault.phase, Some(Phase::InflectLow | Phase::InflectHigh))
}

/// Begins while a dive is entered: the pump runs, and the battery with it.
fn begins_dive(fault: &Fault, config: &Config) -> bool {
    fault.phase == Some(Phase::Dive) && fault.delay_s < bounds::turn_s(config)
}

/// Depth sensors: the other one measures on. None is an abort as long as they do not contradict each other.
fn depth(fault: &Fault) -> Option<Expect> {
    use Kind as K;
    let in_water = !matches!(fault.phase, Some(Phase::Surface | Phase::Comms) | None);
    // In a turn nothing can be expected to move before the pump has changed sides: 472 cc at 13 cc/s.
    let turning_s = if turning(fault) { 37.0 } else { 0.0 };
    let wrong = |causes| {
        Expect::Tolerated(causes, vec![Duty { sign: Sign::DepthWrong(fault.target), act: Act::Turn, within_s: bounds::depth_wrong_s() }])
    };
    Some(match fault.kind {
        // Silent or absurd, or honestly stamped and too old.
        K::Off | K::Nan | K::Inf | K::Sentinel | K::Delayed => Expect::Home(&[], bounds::unbacked_s()),
        // A wrong reading must be found out.
        K::Stuck if in_water => Expect::Abort(&[Abort::StuckDepth, Abort::SensorDepth], 60.0 + CYCLE_S + turning_s),
        // At the surface it is right; under way it parts from the other one.
        K::Stuck | K::Drift | K::Flip | K::Bias => wrong(&[Abort::SensorDepth]),
        // Of ±1200 m 82 m are within reach of what was believed 20 s ago: believed, and the count of a lost sensor begins anew.
        // What is believed of it leads upward, if at all.
        K::Garbage => {
            Expect::Home(&[Abort::OverDepth], bounds::by_chance_s(demands::UNBACKED_S, f64::INFINITY, 1.0 - 82.0 / 2400.0) + 3.0 * CYCLE_S)
        }
        // Two in eight come in time; a new level is believed at its third.
        K::Slow | K::Intermittent | K::Spike => Expect::Mission,
        _ => return None,
    })
}

/// Pitch: without it the vehicle comes home after a minute.
fn pitch(fault: &Fault) -> Option<Expect> {
    use Kind as K;
    const CAUSE: Causes = &[Abort::SensorPitch];
    let lost_s = demands::PITCH_LOST_S;
    Some(match fault.kind {
        K::Off | K::Nan | K::Inf | K::Sentinel | K::Delayed => Expect::Abort(CAUSE, lost_s),
        K::Slow => Expect::Abort(CAUSE, bounds::by_the_clock_s(lost_s, 1.0, fault.size, FRESH_S)),
        // Of ±20 rad one in twelve is a pitch.
        K::Garbage => Expect::Abort(CAUSE, bounds::by_chance_s(lost_s, 1.0, 1.0 - 3.2 / 40.0)),
        // Every other reading is enough to fly by; luck may run out.
        K::Intermittent => Expect::Tolerated(CAUSE, Vec::new()),
        K::Stuck => Expect::Tolerated(CAUSE, vec![owes(Sign::PitchFrozen, bounds::pitch_inconsistent_s())]),
        K::Flip | K::Drift => Expect::Tolerated(CAUSE, vec![owes(Sign::PitchOpposed, bounds::pitch_inconsistent_s())]),
        // 0.15 rad flatter one way and steeper the other: it still sinks and rises. One reading in twenty is not wrong for 20 s.
        K::Bias | K::Spike => Expect::Mission,
        _ => return None,
    })
}

/// Heading: the mission comes home at its next climb; a wrong one leads elsewhere, not into danger.
fn heading(fault: &Fault) -> Option<Expect> {
    use Kind as K;
    // Two cycles until the climb is known as one.
    let lost = |causes| Expect::Tolerated(causes, vec![owes(Sign::HeadingLost, 2.0 * CYCLE_S)]);
    Some(match fault.kind {
        K::Off | K::Nan | K::Inf | K::Sentinel | K::Delayed | K::Intermittent => lost(&[Abort::NoHeading]),
        // Random headings may be lost for a minute, or sweep two turns.
        K::Garbage => lost(&[Abort::NoHeading, Abort::FinStuck]),
        K::Stuck | K::Slow | K::Bias | K::Drift | K::Spike | K::Flip => Expect::Mission,
        _ => return None,
    })
}

/// Position of the pump as reported.
fn ballast_feedback(fault: &Fault, config: &Config, ahead: &Ahead) -> Option<Expect> {
    use Kind as K;
    const LOST: Causes = &[Abort::BallastFeedback];
    // Whether the depth answers decides between the two.
    const EITHER: Causes = &[Abort::BallastFeedback, Abort::PumpStuck];
    // "At" the wait is enough here, not beyond it.
    let lost_s = demands::FEEDBACK_LOST_S - 0.1;
    let at_rest_s = bounds::stroke_s(config) + bounds::no_answer_s();
    Some(match fault.kind {
        K::Off | K::Nan | K::Inf | K::Sentinel | K::Delayed => Expect::Abort(LOST, demands::FEEDBACK_LOST_S),
        // What is read of a pump that went there and back between two readings looks like one that runs the wrong way.
        K::Slow => Expect::Abort(EITHER, bounds::by_the_clock_s(lost_s, 1.0, fault.size, FRESH_S)),
        // What comes every other time is enough to follow the pump by; luck may run out.
        K::Intermittent => Expect::Tolerated(LOST, Vec::new()),
        // Of ±8000 cc one in thirty is a place of the pump.
        K::Garbage => Expect::Abort(EITHER, bounds::by_chance_s(lost_s, 1.0, 1.0 - 1.0 / 30.0)),
        // At rest a feedback stuck where the pump stands is no different from a sound one.
        K::Stuck => Expect::Abort(EITHER, ahead.pump_needed_s + bounds::no_answer_s()),
        // Elsewhere than the pump was sent, once it stands; beyond its range no answer at all.
        K::Flip => Expect::Abort(EITHER, at_rest_s),
        K::Bias => Expect::Abort(EITHER, at_rest_s.max(bounds::stroke_s(config) + demands::FEEDBACK_LOST_S)),
        K::Drift => Expect::Abort(EITHER, demands::PUMP_NEAR_M3 / fault.size.abs() * 3600.0 + at_rest_s),
        // Twice running it looks like a pump that runs the wrong way.
        K::Spike => Expect::Tolerated(EITHER, Vec::new()),
        _ => return None,
    })
}

/// Position of the battery as reported.
fn mass_feedback(fault: &Fault, config: &Config) -> Option<Expect> {
    use Kind as K;
    const CAUSE: Causes = &[Abort::MassStuck];
    // Each cycle without it counts, each with it takes a quarter back.
    let (lost_s, back) = (demands::MASS_LOST_S, 0.25);
    let at_rest_s = 2.0 * f64::from(config.battery_m / config.battery_rate_m_s) + bounds::mass_s() + bounds::turn_s(config);
    Some(match fault.kind {
        K::Off | K::Nan | K::Inf | K::Sentinel | K::Delayed => Expect::Abort(CAUSE, lost_s),
        K::Slow => Expect::Abort(CAUSE, bounds::by_the_clock_s(lost_s, back, fault.size, FRESH_S)),
        K::Intermittent => Expect::Abort(CAUSE, bounds::by_chance_s(lost_s, back, fault.size)),
        // Of ±1 m one in thirty is a place of the battery.
        K::Garbage => Expect::Abort(CAUSE, bounds::by_chance_s(lost_s, back, 1.0 - 1.2 * f64::from(config.battery_m))),
        // Where the battery stands it seems elsewhere, and wherever it is held instead.
        K::Bias => Expect::Abort(CAUSE, at_rest_s),
        K::Drift => {
            Expect::Abort(CAUSE, (demands::MASS_NEAR_M + f64::from(config.battery_deadband_m)) / fault.size.abs() * 3600.0 + at_rest_s)
        }
        K::Stuck => Expect::Tolerated(CAUSE, vec![off_pitch(config)]),
        // Held where it says it is, the battery goes to the other side, and that reads as where it is wanted: one cycle of three counts.
        K::Flip => {
            let found_s = bounds::by_the_clock_s(lost_s, back, 3.0 * CYCLE_S, CYCLE_S);
            Expect::Tolerated(CAUSE, vec![owes(Sign::PitchOff, found_s + bounds::turn_s(config))])
        }
        K::Spike => Expect::Mission,
        _ => return None,
    })
}

/// Six millimetres of battery are 0.15 rad of pitch: what keeps the vehicle that far off its pitch is found as a stuck mass.
fn off_pitch(config: &Config) -> Duty {
    // A turn moves the order, and the wait begins anew.
    owes(Sign::PitchOff, bounds::mass_s() + bounds::turn_s(config))
}

/// Position of the fin as reported: nothing but a check.
fn fin_feedback(fault: &Fault) -> Option<Expect> {
    use Kind as K;
    Some(match fault.kind {
        K::Off | K::Nan | K::Inf | K::Sentinel | K::Delayed | K::Slow | K::Intermittent | K::Spike => Expect::Mission,
        K::Stuck | K::Garbage | K::Bias | K::Drift | K::Flip => {
            Expect::Tolerated(&[Abort::FinStuck], vec![owes(Sign::FinElsewhere, bounds::fin_s())])
        }
        _ => return None,
    })
}

/// No effect on the safety loop, whatever it says: roll and density are not used, the bottom is out of the altimeter's range and
/// a false one turns a dive.
fn bystander(fault: &Fault) -> Option<Expect> {
    use Kind as K;
    match fault.kind {
        K::Off | K::Stuck | K::Slow | K::Delayed | K::Intermittent | K::Garbage | K::Bias | K::Drift | K::Spike => Some(Expect::Mission),
        K::Nan | K::Inf | K::Sentinel | K::Flip => Some(Expect::Mission),
        _ => None,
    }
}

/// Gauges of battery and hull: another one is left, or none is needed; what they say counts if three samples of five say it.
fn gauge(fault: &Fault, sign: Sign, causes: Causes) -> Option<Expect> {
    use Kind as K;
    Some(match fault.kind {
        K::Off | K::Nan | K::Inf | K::Sentinel | K::Stuck | K::Slow | K::Delayed | K::Intermittent | K::Flip => Expect::Mission,
        // 77.6 kPa and 20 kPa are more than 87.8 kPa; 2 V and a third of the charge are not missed.
        K::Bias if fault.target == Target::VacuumGauge && fault.size > 0.0 => Expect::Abort(causes, THREE_SAMPLES_S),
        K::Bias => Expect::Mission,
        K::Garbage | K::Drift | K::Spike => Expect::Tolerated(causes, vec![owes(sign, 0.0)]),
        _ => return None,
    })
}

/// What only says yes or no.
fn detector(fault: &Fault) -> Option<Expect> {
    use Kind as K;
    use Target as T;
    Some(match (fault.target, fault.kind) {
        (T::LeakDetector, K::Alarm) => Expect::Abort(&[Abort::Leak], 0.0),
        (T::LeakDetector, K::Chatter) => Expect::Tolerated(&[Abort::Leak], vec![owes(Sign::Leak, 0.0)]),
        (T::WeightMonitor, K::Alarm) => Expect::Abort(&[Abort::Degraded], THREE_SAMPLES_S),
        // One that never answered is taken for none that is fitted.
        (T::LeakDetector, K::Off) if fault.delay_s <= 0.0 && fault.phase.is_none_or(|p| p == Phase::Surface) => Expect::Mission,
        // Silent: nobody would know of water in the hull.
        (T::LeakDetector, K::Off) => Expect::Home(&[], demands::DETECTOR_S + 3.0 * CYCLE_S),
        (T::LeakDetector, K::Stuck) | (T::WeightMonitor, K::Off) => Expect::Mission,
        (T::Gps | T::Comms, K::Off | K::Intermittent) => Expect::Mission,
        _ => return None,
    })
}

/// Actuators and the commands to them.
fn actuator(fault: &Fault, config: &Config, ahead: &Ahead) -> Option<Expect> {
    use Kind as K;
    use Target as T;
    Some(match (fault.target, fault.kind) {
        // At rest a pump that sticks, and one run away to where it is, are no different from sound ones.
        (T::Pump, K::Stuck) => {
            Expect::Abort(&[Abort::PumpStuck, Abort::BallastFeedback, Abort::OverDepth], ahead.pump_needed_s + bounds::no_answer_s())
        }
        // Out at the upper turn the vehicle stops rising at the surface, as if its depth had answered to a pump going in.
        (T::Pump, K::Runaway) if fault.size > 0.0 => {
            Expect::Abort(&[Abort::PumpStuck, Abort::BallastFeedback], ahead.pump_needed_s + bounds::no_answer_s())
        }
        (T::Pump, K::Runaway) => Expect::Abort(&[Abort::PumpStuck], ahead.pump_needed_s + bounds::no_answer_s()),
        // Three commands missed, then the pump runs out by itself. A vehicle that reaches the surface stops rising, as if its
        // depth had answered to a pump going in. The battery does not follow either.
        (T::Command, K::Lost) => Expect::Abort(
            &[Abort::PumpStuck, Abort::BallastFeedback, Abort::MassStuck],
            ahead.pump_needed_s + 3.0 * CYCLE_S + bounds::no_answer_s(),
        ),
        // Three in a row are missed now and then, and a fourth looks like a pump running away.
        (T::Command, K::Intermittent) => Expect::Tolerated(&[Abort::PumpStuck], Vec::new()),
        // A tenth of the rate is way, but a turn takes ten times as long and as deep.
        (T::Pump, K::Slow) => {
            Expect::Tolerated(&[Abort::OverDepth, Abort::Stalled], vec![too_deep(), owes(Sign::SinksOn, bounds::sinks_on_s(config))])
        }
        (T::Pump, K::LeakBack | K::Intermittent) => Expect::Mission,
        // Two samples, each 4 mm farther off: 8 mm at 2.5 mm/s and a look. In a turn the order moves as well, and so it does when the
        // dive begins.
        (T::MassMotor, K::Runaway) if ahead.mass_way_m > 0.02 && !turning(fault) && !afloat(fault) && !begins_dive(fault, config) => {
            Expect::Abort(&[Abort::MassStuck], 2.0 * CYCLE_S + CYCLE_S)
        }
        (T::MassMotor, K::Runaway | K::Stuck) => Expect::Tolerated(&[Abort::MassStuck], vec![off_pitch(config)]),
        (T::MassMotor | T::FinMotor, K::Slow | K::Intermittent) => Expect::Mission,
        (T::FinMotor, K::Stuck | K::Runaway) => Expect::Tolerated(&[Abort::FinStuck], vec![owes(Sign::FinElsewhere, bounds::fin_s())]),
        // Not needed as long as nothing else breaks.
        (T::Release, K::Stuck) => Expect::Mission,
        // The wire burns for 120 s.
        (T::Release, K::Spurious) => Expect::Abort(&[Abort::Degraded], f64::from(config.release_time_s) + THREE_SAMPLES_S),
        _ => return None,
    })
}

/// Two samples, and one for the filter.
fn too_deep() -> Duty {
    owes(Sign::TooDeep, 3.0 * CYCLE_S)
}

/// Hull, vehicle, water and supply.
fn outside(fault: &Fault, config: &Config) -> Option<Expect> {
    use Kind as K;
    use Target as T;
    let heavy = |causes| {
        let turned_s = demands::NO_WAY_S + 2.0 * CYCLE_S;
        // A dive in vain, a turn, and a climb in vain; held at the upper turn's depth it is a second dive instead, which is over sooner.
        let climbed_s = turned_s + bounds::turn_s(config) + demands::CLIMB_STALLED_S;
        let turn = Duty { sign: Sign::DivesInVain, act: Act::Turn, within_s: turned_s };
        Expect::Tolerated(causes, vec![too_deep(), owes(Sign::SinksOn, bounds::sinks_on_s(config)), turn, owes(Sign::NoWay, climbed_s)])
    };
    Some(match (fault.target, fault.kind) {
        // A spoonful of 2 g at 20 g/min.
        (T::Hull, K::Leak) => Expect::Abort(&[Abort::Leak], 6.0),
        // 71 kPa (5 °C, the pump out) towards an atmosphere with 600 s: 87.8 kPa is crossed after 484 s, at 22 Pa/s; 3 σ of the gauge are 300 Pa.
        (T::Hull, K::VacuumLoss) => Expect::Abort(&[Abort::Vacuum], 484.0 + 300.0 / 22.0 + THREE_SAMPLES_S),
        (T::Power, K::Undervoltage) => Expect::Abort(&[Abort::Undervoltage], THREE_SAMPLES_S),
        (T::Power, K::LowCharge) => Expect::Abort(&[Abort::LowCharge], THREE_SAMPLES_S),
        (T::Power, K::BrownOut) => Expect::Abort(&[Abort::Reset], CYCLE_S),
        // Slower, and never still.
        (T::Vehicle, K::Fouling) => Expect::Mission,
        // A list of 0.2 rad and a circle of 33 m: the fin may not hold it.
        (T::Vehicle, K::WingLoss) => Expect::Tolerated(&[Abort::FinStuck], vec![owes(Sign::FinElsewhere, bounds::fin_s())]),
        // Pulled down by as much as the pump lifts, or more.
        // Lighter by as much it does not sink.
        (T::Vehicle, K::Trim | K::Dragged) => heavy(&[Abort::OverDepth, Abort::Stalled, Abort::StuckDepth]),
        // Held: a depth that does not move though it must, or no way.
        (T::Vehicle, K::Net) => heavy(&[Abort::Stalled, Abort::StuckDepth]),
        // No reason to drop anything: tried again elsewhere. Light water takes 1.3 N of the pump's 2.3 N.
        (T::Sea, K::Ice | K::Lens | K::Current | K::Upwelling) => Expect::Mission,
        _ => return None,
    })
}

#[cfg(test)]
mod tests;

//! Which missions the campaign flies: fault × phase × onset × wings, all
//! pairs, faults of the line, and a healthy twin for every seed.
//!
//! Faults of either sign where their size has one. Pairs fly in shallow water and at the edge.
//!
//! Two missions: `shallow` (3–27 m, 100 m vehicle in 300 m of water, so that
//! the crush depth is in reach) and `edge` (5–190 m, 200 m vehicle in 500 m).
//! Both pass through every phase. Random missions with random faults are drawn as well ([`super::draw`], [`super::breaks`]).

use super::draw::{Class, Draw};
use crate::flight::worlds;
use plant::faults::{Kind, Target, catalogue};
use plant::{Fault, Scenario};
use signals::{Leg, Mission, Phase, Wings};
use std::sync::OnceLock;

/// Seeds in use; case `n` flies with seed `n % SEEDS`, so that every case has a healthy twin among `SEEDS` × wings × missions.
pub const SEEDS: u64 = 64;
/// Onset of the second, transient variant of each fault, s after the phase begins.
const SECOND_ONSET_S: f64 = 45.0;
/// Duration of that variant, s.
const TRANSIENT_S: f64 = 90.0;
/// Duration of what no vehicle can end by itself (net, ice, something dragging it down), s. A third of an hour: beyond the
/// patience limits of the law's way watch, within those of the mission.
const HELD_S: f64 = 1200.0;
/// Force of what drags the vehicle down, N: more than the pump can lift, less than pump and drop weight together.
const DRAG_N: f64 = 3.0;

/// Phases at whose beginning faults start.
pub const PHASES: [Phase; 6] = [Phase::Surface, Phase::Dive, Phase::InflectLow, Phase::Climb, Phase::InflectHigh, Phase::Comms];

/// Which mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Water {
    /// 3–27 m.
    Shallow,
    /// 5–190 m, near the working depth.
    Edge,
    /// 5–190 m, eight dives, with one depth sensor.
    Alone,
    /// Twenty-five dives of 5–30 m, three hours without the surface, and then one to 190 m, with one depth sensor.
    Late,
    /// Mission, vehicle, fittings and water drawn from the case's seed.
    Drawn,
}

/// What is done to the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum LineFault {
    /// Frames vanish, both ways.
    Drop,
    /// A bit flips.
    Flip,
    /// The frame's end is missing.
    Truncate,
    /// The frame comes twice.
    Duplicate,
    /// Random bytes before the frame.
    Noise,
}

/// All faults of the line.
pub const LINE_FAULTS: [LineFault; 5] = [LineFault::Drop, LineFault::Flip, LineFault::Truncate, LineFault::Duplicate, LineFault::Noise];

/// One mission of the campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Mission and water.
    pub water: Water,
    /// Wings.
    pub wings: Wings,
    /// Seed of all noise.
    pub seed: u64,
    /// What breaks; none: a healthy twin, unless the line is bad.
    pub faults: Vec<Fault>,
    /// What is done to the line.
    pub line: Option<LineFault>,
}

impl Case {
    /// What to fly.
    #[must_use]
    pub fn mission(&self) -> Mission {
        let leg = match self.water {
            Water::Drawn => return Draw::new(self.seed).mission,
            Water::Shallow => Leg { dives: 3, ..Leg::default() },
            Water::Alone => Leg { dives: 8, depth_min_m: 5.0, depth_max_m: 190.0, ..Leg::default() },
            Water::Edge => Leg { dives: 3, depth_min_m: 5.0, depth_max_m: 190.0, ..Leg::default() },
            Water::Late => Leg { dives: 25, depth_min_m: 5.0, depth_max_m: 30.0, ..Leg::default() },
        };
        let deep = Leg { dives: 1, depth_min_m: 5.0, depth_max_m: 190.0, ..Leg::default() };
        let hours = match self.water {
            Water::Shallow => 3,
            Water::Alone | Water::Late => 24,
            Water::Edge | Water::Drawn => 8,
        };
        Mission {
            wings: self.wings,
            legs: std::iter::once(leg).chain((self.water == Water::Late).then_some(deep)).collect(),
            max_duration_s: hours * 3600,
            surface_every: if matches!(self.water, Water::Alone | Water::Late) { 0 } else { 2 },
        }
    }

    /// The world to fly in.
    #[must_use]
    pub fn scenario(&self) -> Scenario {
        if self.water == Water::Drawn {
            let mut s = Draw::new(self.seed).scenario();
            s.faults.extend(self.faults.iter().copied());
            return s;
        }
        let mut s = worlds::for_mission(&self.mission());
        s.ocean.water_depth_m = if self.water == Water::Shallow { 300.0 } else { 500.0 };
        // Ballasted for its working depth, not for the water below it.
        static DENSITY: [OnceLock<Option<f64>>; 2] = [OnceLock::new(), OnceLock::new()];
        let [shallow, edge] = &DENSITY;
        let density = if self.water == Water::Shallow { shallow } else { edge };
        s.vehicle.ballasted_density_kg_m3 = *density.get_or_init(|| worlds::density_at(&s, 0.4 * s.vehicle.crush_depth_m));
        s.sensors.depth2.absent = matches!(self.water, Water::Alone | Water::Late);
        s.seed = self.seed;
        s.faults.clone_from(&self.faults);
        s
    }

    /// The healthy mission with the same noise.
    #[must_use]
    pub fn twin(&self) -> Self {
        Self { faults: Vec::new(), line: None, ..self.clone() }
    }

    /// One line for tables: faults as `glider fly --fault` takes them.
    #[must_use]
    pub fn name(&self) -> String {
        let mut parts: Vec<String> = self.faults.iter().map(ToString::to_string).collect();
        parts.extend(self.line.map(|l| format!("line:{l:?}").to_lowercase()));
        if parts.is_empty() { "healthy".to_owned() } else { parts.join(" + ") }
    }
}

/// A fault as the campaign injects it: what would hold the vehicle for good has an end.
fn injected(target: Target, kind: Kind) -> Option<Fault> {
    let fault = Fault::new(target, kind)?;
    Some(match (target, kind) {
        (Target::Vehicle, Kind::Dragged) => Fault { size: DRAG_N, ..fault }.lasting(HELD_S),
        (Target::Vehicle, Kind::Net) | (Target::Sea, Kind::Ice) => fault.lasting(HELD_S),
        _ => fault,
    })
}

/// What can be wrong with the only depth sensor; drifts from 5 to 60 m an hour either way.
fn alone() -> Vec<Fault> {
    let depth = catalogue().filter(|e| e.0 == Target::Depth && e.1 != Kind::Drift).filter_map(|e| Fault::new(e.0, e.1));
    depth.flat_map(|f| std::iter::once(f).chain(f.mirrored())).chain(drifts()).collect()
}

/// A depth that drifts, m/h, either way.
fn drifts() -> Vec<Fault> {
    let drift = |size| Fault::new(Target::Depth, Kind::Drift).map(|f| Fault { size, ..f });
    let drifts = [5.0, 10.0, 20.0, 40.0, 60.0].into_iter().filter_map(drift);
    drifts.flat_map(|f| std::iter::once(f).chain(f.mirrored())).collect()
}

/// Weights at the deepest point, g: more than the pump lifts, less than pump and weight do, and no more time than the release takes.
fn heavy_at_depth() -> Vec<Fault> {
    let weight = |size| Fault::new(Target::Vehicle, Kind::Trim).map(|f| Fault { size, ..f }.at(Phase::InflectLow, 0.0));
    [300.0, 400.0, 500.0, 600.0].into_iter().filter_map(weight).collect()
}

/// Neither a depth nor a pump that lifts: nothing is left to wait for.
fn blind_and_sinking() -> Vec<Fault> {
    let depth = Fault::new(Target::Depth, Kind::Off).map(|f| f.at(Phase::Dive, 900.0));
    let pump = Fault::new(Target::Pump, Kind::Runaway).map(|f| f.at(Phase::Dive, 900.0));
    depth.into_iter().chain(pump).collect()
}

/// Water that comes in behind a dead leak detector, g/min: nothing but the motion shows it.
fn unseen_leaks() -> Vec<Vec<Fault>> {
    let dead = Fault::new(Target::LeakDetector, Kind::Off).map(|f| f.at(Phase::Dive, 0.0));
    let onsets = [(Phase::Dive, 20.0), (Phase::Dive, 900.0), (Phase::Climb, 60.0)];
    let leak = |(rate, (phase, late_s))| Fault::new(Target::Hull, Kind::Leak).map(|f| Fault { size: rate, ..f }.at(phase, late_s));
    let leaks = [10.0, 20.0, 40.0].into_iter().flat_map(|rate| onsets.map(|onset| (rate, onset))).filter_map(leak);
    leaks.map(|leak| dead.into_iter().chain([leak]).collect()).collect()
}

/// Weights of about what the pump lifts, g: the vehicle hangs in layered water, near the surface (178 at the edge, 202 in shallow
/// water) or below.
fn hangs() -> Vec<Vec<Fault>> {
    let weight = |size, phase| Fault::new(Target::Vehicle, Kind::Trim).map(|f| vec![Fault { size, ..f }.at(phase, 20.0)]);
    [178.0, 202.0, 220.0].into_iter().flat_map(|size| [Phase::Dive, Phase::Climb].map(|phase| weight(size, phase))).flatten().collect()
}

/// The whole lattice, without twins, in a fixed order.
#[must_use]
pub fn cases() -> Vec<Case> {
    let one_way: Vec<Fault> = catalogue().filter_map(|(target, kind, _, _)| injected(target, kind)).collect();
    let all: Vec<Fault> = one_way.iter().flat_map(|f| std::iter::once(*f).chain(f.mirrored())).collect();
    let mut cases = Vec::new();
    let mut add = |water, wings, faults, line| {
        let seed = cases.len() as u64 % SEEDS;
        cases.push(Case { water, wings, seed, faults, line });
    };
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        for fault in &all {
            for phase in PHASES {
                add(Water::Shallow, wings, vec![fault.at(phase, 0.0)], None);
                add(Water::Shallow, wings, vec![fault.at(phase, SECOND_ONSET_S).lasting(TRANSIENT_S)], None);
                add(Water::Edge, wings, vec![fault.at(phase, 0.0)], None);
            }
        }
        for fault in alone() {
            add(Water::Alone, wings, vec![fault.at(Phase::Dive, 20.0)], None);
            add(Water::Alone, wings, vec![fault.at(Phase::Dive, 900.0)], None);
        }
        add(Water::Alone, wings, blind_and_sinking(), None);
        for faults in unseen_leaks().into_iter().chain(hangs()) {
            add(Water::Shallow, wings, faults.clone(), None);
            add(Water::Edge, wings, faults, None);
        }
        for line in LINE_FAULTS {
            for _ in 0..8 {
                add(Water::Shallow, wings, Vec::new(), Some(line));
            }
        }
    }
    for seed in (0..).filter(|seed| Draw::new(*seed).class == Class::Deep).take(4) {
        let deep = |faults| Case { water: Water::Drawn, wings: Draw::new(seed).mission.wings, seed, faults, line: None };
        cases.extend(unseen_leaks().into_iter().map(deep));
    }
    let mut add = |water, wings, faults, line| {
        let seed = cases.len() as u64 % SEEDS;
        cases.push(Case { water, wings, seed, faults, line });
    };
    // All pairs, onset phases and wings spread over them.
    let mut n = 0usize;
    for (i, first) in all.iter().enumerate() {
        for second in all.iter().skip(i + 1) {
            let phase = |k: usize| PHASES.get(k % PHASES.len()).copied().unwrap_or(Phase::Dive);
            let wings = if n.is_multiple_of(2) { Wings::Standard } else { Wings::LowAspectRatio };
            if (first.target, first.kind) == (second.target, second.kind) {
                continue; // the same with the other sign
            }
            // At the edge one begins in mid-glide, where the pump has rested and the depth is past half way.
            let late_s = if n.is_multiple_of(3) { 900.0 } else { 20.0 };
            add(Water::Shallow, wings, vec![first.at(phase(n / 2), 0.0), second.at(phase(n / 12), 20.0)], None);
            add(Water::Edge, wings, vec![first.at(phase(n / 12), late_s), second.at(phase(n / 2), late_s)], None);
            n += 1;
        }
    }
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        for fault in heavy_at_depth() {
            add(Water::Edge, wings, vec![fault], None);
        }
        for fault in drifts() {
            add(Water::Late, wings, vec![fault.at(Phase::Dive, 20.0)], None);
        }
    }
    cases
}

/// Healthy missions drawn at random, numbers `first` on.
#[must_use]
pub fn drawn(first: u64, missions: u64) -> Vec<Case> {
    let healthy = |seed| Case { water: Water::Drawn, wings: Draw::new(seed).mission.wings, seed, faults: Vec::new(), line: None };
    (first..first + missions).map(healthy).collect()
}

/// Sets of faults that are flown on each drawn mission: single ones and pairs in turn.
pub const SETS: u64 = 6;

/// A drawn mission with the sets of faults it is flown with, given how long its healthy flight takes, s.
pub fn broken(healthy: &Case, span_s: f64) -> impl Iterator<Item = Case> + '_ {
    (0..SETS).map(move |k| {
        let count = if k.is_multiple_of(2) { 1 } else { 2 };
        Case { faults: super::breaks::draw(healthy.seed, k, count, span_s), ..healthy.clone() }
    })
}

/// Every k-th case, so that the sample has all parts of the lattice.
#[must_use]
pub fn spread(cases: Vec<Case>, wanted: usize) -> Vec<Case> {
    let all = cases.len();
    if wanted >= all {
        return cases;
    }
    cases.into_iter().enumerate().filter(|(i, _)| i * wanted / all != (i + 1) * wanted / all).map(|(_, c)| c).collect()
}

/// The twins of `cases`, each once.
#[must_use]
pub fn twins(cases: &[Case]) -> Vec<Case> {
    let mut seen = std::collections::HashSet::new();
    cases.iter().filter(|c| seen.insert((c.water, c.wings, c.seed))).map(Case::twin).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lattice_has_every_single_fault_in_every_phase_and_every_pair_once() {
        let cases = cases();
        let one_way = catalogue().count();
        let faults = catalogue().map(|e| 1 + usize::from(injected(e.0, e.1).is_some_and(|f| f.mirrored().is_some()))).sum::<usize>();
        assert!(faults > one_way + 40, "{faults}");
        assert!(cases.len() > 10_000, "{}", cases.len());
        assert!(spread(cases.clone(), 0).is_empty(), "a sample may be of random missions alone");
        let singles = cases.iter().filter(|c| c.faults.len() == 1 && !matches!(c.water, Water::Alone | Water::Late)).count();
        assert_eq!(cases.iter().filter(|c| c.water == Water::Alone).count(), (14 + 10) * 2 * 2 + 2);
        assert_eq!(singles, faults * PHASES.len() * 3 * 2 + hangs().len() * 2 * 2 + heavy_at_depth().len() * 2);
        assert_eq!(cases.iter().filter(|c| c.water == Water::Late).count(), 10 * 2);
        let pairs: std::collections::HashSet<_> = cases
            .iter()
            .filter(|c| c.faults.len() == 2 && c.water == Water::Edge)
            .map(|c| (c.faults[0].target, c.faults[0].kind, c.faults[1].target, c.faults[1].kind))
            .collect();
        assert_eq!(pairs.len(), one_way * (one_way - 1) / 2);
        let mut phases: std::collections::HashSet<_> = std::collections::HashSet::new();
        cases.iter().filter(|c| c.faults.len() == 2).for_each(|c| {
            phases.insert((c.faults[0].phase, c.faults[1].phase));
        });
        assert_eq!(phases.len(), 36, "pairs start in every combination of phases");
    }
}

//! Does the campaign notice a law that is broken? One watch at a time is made blind, or to wait twice as long
//! ([`control::mutant`]), and the campaign is flown until a mission is not as it should be.
//!
//! The broken law is that of the whole process: nothing else may fly meanwhile.

use super::breaks::draw_of;
use super::lattice::{Case, Water, cases, drawn, spread};
use super::{Verdict, run};
use control::mutant::{Mutant, Watch, set};
use plant::faults::{Kind, Target};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::sync::OnceLock;

/// Random missions that broken laws are tried on: the first, and how many.
const RANDOM: (u64, u64) = (7 << 40, 400);
/// Sets of faults for each.
const MUTANT_SETS: u64 = 3;

/// Random missions and how long a healthy vehicle takes, s; flown once, with the law as it is.
fn random_missions() -> anyhow::Result<&'static [(Case, f64)]> {
    static FLOWN: OnceLock<Vec<(Case, f64)>> = OnceLock::new();
    if FLOWN.get().is_none() {
        let verdicts = drawn(RANDOM.0, RANDOM.1).par_iter().map(run).collect::<anyhow::Result<Vec<Verdict>>>()?;
        let _ = FLOWN.set(verdicts.into_iter().map(|v| (v.case, v.duration_s)).collect());
    }
    Ok(FLOWN.get().map_or(&[], Vec::as_slice))
}

/// Random missions with the faults by which only a vehicle that does not come home differs from a sound law; none for a watch that is
/// owed its abort by a row of its own.
fn at_random(watch: Watch) -> anyhow::Result<Vec<Case>> {
    use Watch as W;
    let kinds: &[(Target, Kind)] = match watch {
        W::Leak | W::LeakWeight => &[(Target::Hull, Kind::Leak)],
        W::LoadInDive | W::LoadInClimb => &[(Target::LeakDetector, Kind::Off), (Target::Hull, Kind::Leak)],
        W::DriftEndsDive | W::DriftSurfaces | W::AfloatOffset => &[(Target::Depth, Kind::Drift)],
        W::OverDepth => &[(Target::Pump, Kind::Slow)],
        W::PumpTries | W::BlindWeight => &[(Target::Pump, Kind::Stuck), (Target::Depth, Kind::Off)],
        W::AtRisk | W::SinksOn | W::NotRising | W::FloatsBelow | W::ClimbNoWay | W::DiveNoWay => &[(Target::Vehicle, Kind::Trim)],
        _ => return Ok(Vec::new()),
    };
    let sets = |(case, span_s): &(Case, f64)| {
        let (case, span_s) = (case.clone(), *span_s);
        (0..MUTANT_SETS).map(move |k| Case { faults: draw_of(kinds, case.seed, k, span_s), ..case.clone() })
    };
    Ok(random_missions()?.iter().flat_map(sets).collect())
}

/// The missions that a law broken like this is tried on, in order: single faults that the watch is there for, the only depth
/// sensor, pairs with such a fault, `wanted` of the rest of the lattice, spread over it, and random missions with such faults.
fn missions(watch: Watch, wanted: usize) -> anyhow::Result<Vec<Case>> {
    let text = meant_for(watch);
    let rank = |c: &Case| match (c.name().contains(text), c.faults.len(), c.water) {
        (true, 1, _) => 0,
        (_, _, Water::Alone | Water::Late) => 1,
        (true, ..) => 2,
        _ => 3,
    };
    let (rest, mut order): (Vec<Case>, Vec<Case>) = cases().into_iter().partition(|c| rank(c) == 3);
    order.sort_by_key(rank);
    order.extend(spread(rest, wanted));
    order.extend(at_random(watch)?);
    Ok(order)
}

/// Missions flown before it is asked whether one of them noticed.
const MISSIONS_AT_ONCE: usize = 48;

/// What became of one mutant.
#[derive(Clone, Debug)]
pub struct Trial {
    /// How the law was broken.
    pub mutant: Mutant,
    /// Missions flown.
    pub flown: usize,
    /// The first mission that noticed, and what was wrong with it.
    pub caught_by: Option<(String, String)>,
}

impl Trial {
    /// One entry of the JSON list.
    #[must_use]
    pub fn document(&self) -> Value {
        let (case, why) = self.caught_by.clone().unzip();
        json!({ "mutant": format!("{:?}", self.mutant), "flown": self.flown, "caught": case.is_some(), "by": case, "why": why })
    }
}

/// Faults that a watch is there for: missions with them are flown first.
#[must_use]
pub const fn meant_for(watch: Watch) -> &'static str {
    use Watch as W;
    match watch {
        W::Leak | W::LeakWeight | W::LoadInDive | W::LoadInClimb => "hull:leak",
        W::Detector => "leak:off",
        W::Vacuum => "hull:vacuum_loss",
        W::Volts => "power:undervoltage",
        W::Charge => "power:low_charge",
        W::NoDepth | W::Unbacked => "depth:off",
        W::BlindWeight => "depth:off@dive+900s + pump",
        W::DepthsApart => "depth:flip",
        W::AfloatOffset | W::DriftEndsDive | W::DriftSurfaces => "depth:drift",
        W::OverDepth => "pump:slow",
        W::AtRisk | W::SinksOn => "vehicle:",
        W::DepthStuck => "depth:stuck",
        W::PitchLost => "pitch:off",
        W::PitchStill => "pitch:stuck",
        W::PitchOpposed => "pitch:flip",
        W::HeadingLost => "heading:off",
        W::PumpFeedback => "ballast:off",
        W::PumpAway => "pump:runaway",
        W::PumpTries => "pump:stuck",
        W::MassAway | W::MassStops => "mass_motor:runaway",
        W::MassLost => "battery_mass:off",
        W::Fin => "fin:",
        W::DiveNoWay | W::ClimbNoWay => "vehicle:net",
        W::NotRising | W::FloatsBelow => "vehicle:trim",
        W::WeightLost => "release:spurious",
    }
}

/// Flies missions with the law broken like this until one notices; one that is wrong with the law as it is tells nothing.
///
/// # Errors
/// A world cannot be, or the controller does not answer.
pub fn trial(mutant: Mutant, wanted: usize) -> anyhow::Result<Trial> {
    let (Mutant::Blind(watch) | Mutant::Slow(watch)) = mutant;
    let mut trial = Trial { mutant, flown: 0, caught_by: None };
    for batch in missions(watch, wanted)?.chunks(MISSIONS_AT_ONCE) {
        set(&[mutant]);
        let verdicts = batch.par_iter().map(run).collect::<anyhow::Result<Vec<Verdict>>>();
        set(&[]);
        trial.flown += batch.len();
        for v in verdicts?.iter().filter(|v| v.wrong()) {
            if !run(&v.case)?.wrong() {
                let why = v.broken.iter().copied().chain(v.unmet).collect::<Vec<_>>().join(", ");
                trial.caught_by = Some((format!("{:?} {:?} {}", v.case.water, v.case.wings, v.case.name()), why));
                return Ok(trial);
            }
        }
    }
    Ok(trial)
}

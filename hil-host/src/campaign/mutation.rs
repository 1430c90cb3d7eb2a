//! Does the campaign notice a law that is broken? One watch at a time is made blind, or to wait twice as long
//! ([`control::mutant`]), and the campaign is flown until a mission is not as it should be.
//!
//! The broken law is that of the whole process: nothing else may fly meanwhile.

use super::lattice::{Case, Water, cases, spread};
use super::{Verdict, run};
use control::mutant::{Mutant, Watch, set};
use rayon::prelude::*;
use serde_json::{Value, json};

/// The missions that a law broken like this is tried on, in order: single faults that the watch is there for, the only depth
/// sensor, pairs with such a fault, and `wanted` of the rest of the lattice, spread over it.
fn missions(watch: Watch, wanted: usize) -> Vec<Case> {
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
    order
}

/// Missions flown before it is asked whether one of them noticed.
const BATCH: usize = 48;

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
const fn meant_for(watch: Watch) -> &'static str {
    use Watch as W;
    match watch {
        W::Leak | W::LeakWeight | W::LoadInDive | W::LoadInClimb => "hull:leak",
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
    for batch in missions(watch, wanted).chunks(BATCH) {
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

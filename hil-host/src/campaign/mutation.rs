//! Does the campaign notice a law that is broken? One watch at a time is made blind, or to wait twice as long
//! ([`control::mutant`]), and the campaign is flown until a mission is not as it should be.
//!
//! The broken law is that of the whole process: nothing else may fly meanwhile.

use super::lattice::Case;
use super::{Verdict, run};
use control::mutant::{Mutant, Watch, set};
use rayon::prelude::*;
use serde_json::{Value, json};

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
        W::NoDepth | W::BlindWeight => "depth2:off",
        W::Unbacked => "depth:off",
        W::DepthsApart => "depth:bias",
        W::DepthLeaps | W::AfloatLie | W::DoubtEndsDive | W::DoubtSurfaces => "depth:drift",
        W::OverDepth | W::AtRisk | W::SinksOn => "vehicle:",
        W::DepthStuck => "depth:stuck",
        W::PitchLost => "pitch:off",
        W::PitchStill => "pitch:stuck",
        W::PitchOpposed => "pitch:flip",
        W::HeadingLost => "heading:off",
        W::PumpFeedback => "ballast:off",
        W::PumpAway => "pump:runaway",
        W::PumpTries => "pump:stuck",
        W::MassAway => "mass_motor:runaway",
        W::MassStops | W::MassLost => "battery_mass:off",
        W::Fin => "fin_motor:",
        W::NotRising | W::DiveNoWay | W::ClimbNoWay | W::FloatsBelow => "vehicle:net",
        W::WeightLost => "release:spurious",
        W::FiresAgain => "release:stuck",
    }
}

/// Flies the cases with the law broken like this until one notices.
///
/// # Errors
/// A world cannot be, or the controller does not answer.
pub fn trial(mutant: Mutant, cases: &[Case]) -> anyhow::Result<Trial> {
    let (Mutant::Blind(watch) | Mutant::Slow(watch)) = mutant;
    let text = meant_for(watch);
    // Singles first, then what the watch is there for, then all the rest.
    let mut order: Vec<&Case> = cases.iter().collect();
    order.sort_by_key(|c| (!c.name().contains(text), c.faults.len()));
    let mut trial = Trial { mutant, flown: 0, caught_by: None };
    set(Some(mutant));
    for batch in order.chunks(BATCH) {
        let verdicts = batch.par_iter().map(|c| run(c)).collect::<anyhow::Result<Vec<Verdict>>>();
        let verdicts = match verdicts {
            Ok(verdicts) => verdicts,
            Err(e) => {
                set(None);
                return Err(e);
            }
        };
        trial.flown += batch.len();
        if let Some(v) = verdicts.iter().find(|v| v.wrong()) {
            let why = v.broken.iter().copied().chain(v.unmet).collect::<Vec<_>>().join(", ");
            trial.caught_by = Some((format!("{:?} {:?} {}", v.case.water, v.case.wings, v.case.name()), why));
            break;
        }
    }
    set(None);
    Ok(trial)
}

//! Random faults: which, how large, of which sign, when in the mission, for how long.
//!
//! | drawn | range |
//! |---|---|
//! | fault | one or two of the catalogue, each alike |
//! | size | 0.3 to 6 times the catalogue's, in proportion, within what [`plant::faults::sizes`] allows; either sign where it has one |
//! | onset | any moment of the healthy twin's flight |
//! | duration | for good, or in one of three 20 s to 30 min; what holds or pulls the vehicle always ends |
//!
//! Two sorts are drawn for themselves: leaks that no detector shows ([`hidden_leak`]), and faults that heal ([`healing`]).

use super::draw::{Dice, Draw};
use super::lattice::{Case, Water};
use plant::Fault;
use plant::faults::{Kind, Target, catalogue, sizes};

/// What would hold or pull the vehicle for good lasts so long at most, s.
const HELD_S: f64 = 1200.0;
/// Water behind a dead detector, g/min.
const HIDDEN_G_MIN: (f64, f64) = (5.0, 50.0);
/// A fault that heals does so after this time, s.
const HEALS_S: (f64, f64) = (8.0, 120.0);
/// Most that something pulls, N: more than pump and drop weight lift (6.7 N) is no race but a loss.
const PULL_N: f64 = 6.0;

/// The `which`-th set of `count` faults for the mission of this number, whose healthy flight takes `span_s`.
#[must_use]
pub fn draw(mission: u64, which: u64, count: usize, span_s: f64) -> Vec<Fault> {
    let mut dice = Dice::new(mission, 1000 + which);
    (0..count).filter_map(|_| one(&mut dice, span_s)).collect()
}

/// The `which`-th set with exactly these faults, drawn in size, sign, onset and duration.
#[must_use]
pub fn draw_of(kinds: &[(Target, Kind)], mission: u64, which: u64, span_s: f64) -> Vec<Fault> {
    let mut dice = Dice::new(mission, 1000 + which);
    kinds.iter().filter_map(|(target, kind)| sized(&mut dice, *target, *kind, span_s)).collect()
}

/// A slow leak behind a detector that is silent or stuck at *dry*, by turns in 3–27 m, 5–190 m, and on a random mission; it begins in the
/// first half of the least time that the mission takes.
#[must_use]
pub fn hidden_leak(number: u64) -> Case {
    let mut dice = Dice::new(number, 2000);
    let water = [Water::Shallow, Water::Edge, Water::Drawn][(number % 3) as usize];
    let wings = if (number / 3).is_multiple_of(2) { signals::Wings::Standard } else { signals::Wings::LowAspectRatio };
    let detector = if (number / 6).is_multiple_of(2) { Kind::Off } else { Kind::Stuck };
    let mut case = drawn(number, water, wings);
    let span_s = 0.5 * f64::from(case.mission().least_duration_s());
    let leak = Fault::new(Target::Hull, Kind::Leak).map(|f| Fault {
        size: dice.between(HIDDEN_G_MIN.0, HIDDEN_G_MIN.1).round(),
        delay_s: dice.between(0.0, span_s).round(),
        ..f
    });
    case.faults = leak.into_iter().chain(Fault::new(Target::LeakDetector, detector)).collect();
    case
}

/// A random mission with one fault that is over within two minutes and leaves nothing behind: no water, no weight gone, no reset.
#[must_use]
pub fn healing(number: u64) -> Case {
    let mut dice = Dice::new(number, 2001);
    let mut case = drawn(number, Water::Drawn, signals::Wings::Standard);
    let span_s = f64::from(case.mission().least_duration_s());
    let leaves = |f: &Fault| {
        matches!((f.target, f.kind), (Target::Hull, Kind::Leak) | (Target::Release, Kind::Spurious) | (Target::Power, Kind::BrownOut))
    };
    let fault = std::iter::repeat_with(|| one(&mut dice, span_s)).flatten().find(|f| !leaves(f));
    case.faults = fault.map(|f| f.lasting(dice.between(HEALS_S.0, HEALS_S.1).round())).into_iter().collect();
    case
}

fn drawn(seed: u64, water: Water, wings: signals::Wings) -> Case {
    let wings = if water == Water::Drawn { Draw::new(seed).mission.wings } else { wings };
    Case { water, wings, seed, faults: Vec::new(), line: None }
}

fn one(dice: &mut Dice, span_s: f64) -> Option<Fault> {
    let (target, kind, ..) = catalogue().nth(dice.below(catalogue().count()))?;
    sized(dice, target, kind, span_s)
}

fn sized(dice: &mut Dice, target: Target, kind: Kind, span_s: f64) -> Option<Fault> {
    let fault = Fault::new(target, kind)?;
    let range = sizes(target, kind);
    let share = 0.3 * 20f64.powf(dice.unit());
    let sign = if dice.chance(0.5) && fault.mirrored().is_some() { -1.0 } else { 1.0 };
    let mut size = (sign * share * fault.size).clamp(*range.start(), *range.end());
    let ends = dice.chance(1.0 / 3.0);
    let mut duration_s = 20.0 * 90f64.powf(dice.unit());
    let held = matches!((target, kind), (Target::Vehicle, Kind::Net | Kind::Dragged) | (Target::Sea, Kind::Ice));
    if held {
        duration_s = duration_s.min(HELD_S);
    }
    if kind == Kind::Dragged {
        size = size.min(PULL_N);
    }
    // Whole seconds: what is printed is what was flown.
    let fault = Fault { size: (size * 1e8).round() / 1e8, delay_s: (dice.unit() * span_s).round(), ..fault };
    Some(if ends || held { fault.lasting(duration_s.round()) } else { fault })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_hidden_leaks_are_slow_and_what_heals_is_over_in_two_minutes() {
        for number in 0..60 {
            let leak = hidden_leak(number);
            let [hull, detector] = leak.faults[..] else { panic!("{leak:?}") };
            assert!((5.0..=50.0).contains(&hull.size) && detector.target == Target::LeakDetector, "{leak:?}");
            let heals = healing(number);
            assert!(heals.faults.len() == 1 && heals.faults[0].duration_s.is_some_and(|s| s <= 120.0), "{heals:?}");
        }
    }
}

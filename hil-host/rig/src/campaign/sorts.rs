//! Two sorts of missions that are drawn for themselves: leaks that no detector shows, and faults that heal.

use super::breaks::one;
use super::draw::{Dice, Draw};
use super::lattice::{Case, Water};
use plant::Fault;
use plant::faults::{Kind, Target};

/// Water behind a dead detector, g/min.
const HIDDEN_G_MIN: (f64, f64) = (5.0, 50.0);
/// A fault that heals does so after this time, s.
const HEALED_AFTER_S: (f64, f64) = (8.0, 120.0);

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
    case.faults = fault.map(|f| f.lasting(dice.between(HEALED_AFTER_S.0, HEALED_AFTER_S.1).round())).into_iter().collect();
    case
}

fn drawn(seed: u64, water: Water, wings: signals::Wings) -> Case {
    let wings = if water == Water::Drawn { Draw::new(seed).mission.wings } else { wings };
    Case { water, wings, seed, faults: Vec::new(), line: None }
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

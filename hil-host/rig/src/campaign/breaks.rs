//! Random faults: which, how large, of which sign, when in the mission, for how long.
//!
//! | drawn | range |
//! |---|---|
//! | fault | one or two of the catalogue, each alike |
//! | size | 0.3 to 6 times the catalogue's, in proportion, within what [`plant::faults::sizes`] allows; either sign where it has one |
//! | onset | any moment of the healthy twin's flight |
//! | duration | for good, or in one of three 20 s to 30 min; what holds or pulls the vehicle always ends |

use super::draw::Dice;
use plant::Fault;
use plant::faults::{Kind, Target, catalogue, sizes};

/// What would hold or pull the vehicle for good lasts so long at most, s.
const HELD_S: f64 = 1200.0;
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

pub(super) fn one(dice: &mut Dice, span_s: f64) -> Option<Fault> {
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

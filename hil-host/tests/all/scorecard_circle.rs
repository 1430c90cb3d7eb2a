//! From a hidden effect to range: what the answers are worth to the controller that flies with them, in worlds whose truth is known.

use hil_host::score::whole_loop::{Case, Closed, close};
use plant::EffectKind;
use signals::Wings;

fn closed(wings: Wings, hidden: Option<EffectKind>, size: f64) -> Closed {
    let folder = std::env::temp_dir().join(format!("scorecard-circle-{}-{wings:?}-{hidden:?}-{size}", std::process::id()));
    let closed = close(Case { wings, hidden, size, seed: 1 }, &folder).expect("a closed circle");
    std::fs::remove_dir_all(folder).ok();
    closed
}

/// Two flights of one vehicle in one sea that differ in a table's last digits differ by up to 2 % of range: the controller learns on
/// the way.
const LIKE_TRUTH: f64 = 0.04;

fn regains(wings: Wings, hidden: EffectKind, size: f64, at_least: f64) {
    let c = closed(wings, Some(hidden), size);
    assert!(c.in_class && c.no_table.is_none(), "{c:?}");
    assert!(c.possible_gain() > at_least && c.gain() > c.possible_gain() - LIKE_TRUTH, "{} of {}: {c:?}", c.gain(), c.possible_gain());
}

#[test]
fn scorecard_nothing_is_named_and_nothing_changes_where_nothing_is_hidden() {
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        let c = closed(wings, None, 0.0);
        assert!(c.verdict == "adequate" && c.gain() == 0.0 && c.possible_gain().abs() < LIKE_TRUTH, "{c:?}");
    }
}

#[test]
fn scorecard_a_mended_law_of_lift_flies_as_far_as_the_truth() {
    regains(Wings::Standard, EffectKind::LiftSlopeError, 2.0, 0.10);
}

/// Once 4 to 8 % of range lost with the new table, and with the truth's: the controller was not told how to read its pitch.
#[test]
fn regress_a_pitch_sensor_that_is_known_to_be_off_costs_no_range() {
    regains(Wings::Standard, EffectKind::PitchOffset, 2.0, 0.03);
}

/// Once there was no table: "refused on board".
#[test]
fn regress_an_angle_of_zero_lift_has_a_table() {
    let c = closed(Wings::LowAspectRatio, Some(EffectKind::ZeroLiftAngle), 2.0);
    assert!(c.answer == ["zero_lift_angle"] && c.no_table.is_none() && c.gain() > -LIKE_TRUTH, "{c:?}");
}

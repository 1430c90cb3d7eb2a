//! What `glider add` writes is what it told: the new vehicle file flies as the fit did.

use crate::case::read_back;
use discovery::diagnosis::diagnose;
use discovery::hypotheses::search::Depth;
use discovery::workbench::add::{Added, add};
use discovery::workbench::compare;
use hydro::effects::{Effect, by_name};
use logs::vehicle::{self, expression};
use logs::{Flight, Vehicle};
use plant::trials::catalogue::{Effect as Hidden, Strength};
use plant::trials::{Banking, Site, Spec, Wing, plan};
use std::path::Path;

/// A flight that hides one strong effect, and its vehicle.
fn hiding(effect: Hidden, site: Site, wing: Wing, lifelike: Option<Banking>, seed: u64) -> (Flight, Vehicle) {
    let spec = Spec { lifelike, ..Spec::single(site, wing, effect, Strength::Strong) };
    read_back(&spec, seed, 0)
}

fn named(name: &str) -> &'static Effect {
    by_name(name).expect("in the catalogue")
}

/// The new vehicle, read back, after its error was seen to be the one told.
fn flown(flight: &Flight, done: &Added) -> Vehicle {
    let back = vehicle::parse(done.vehicle.clone(), Path::new("new.json")).expect("what is written reads back");
    let error = compare::compare(flight, &back).block_error_m_s;
    // A twentieth of the error: the file has no place for the zeros of the pressure and speed sensors and of the compass.
    assert!((error / done.heldout_m_s[2] - 1.0).abs() < 0.05, "the file flies {error} m/s, told {:?}", done.heldout_m_s);
    back
}

/// Who adds what the diagnosis named gets the error that the diagnosis told. Two flights of which it was eight times and a third more: one
/// whose two effects, one after the other, end in a hollow, and one much of which is near a stall that only the named effect explains.
#[test]
fn regress_adding_what_was_named_gives_the_error_that_was_stated() {
    for index in [238, 29] {
        let (log, v) = read_back(&plan(index + 1, 20_261_144, None)[index], 20_261_144, index);
        let done = diagnose(&log, &v, Depth::Pairs, &|_, _| {}).expect("a diagnosis");
        let answer: Vec<_> = done.answer.iter().map(|name| named(name)).collect();
        assert!(!answer.is_empty(), "{index}: {:?}", done.verdict);
        let added = add(&log, &v, &answer, b"parent").expect("a fit");
        // The diagnosis has fitted more hypotheses on the way and rests elsewhere in the same hollow: a twentieth.
        let ratio = added.heldout_m_s[2] / done.block_error_m_s[2];
        assert!((ratio - 1.0).abs() < 0.05, "{index}: {:?} added, {:?} told", added.heldout_m_s, done.block_error_m_s);
    }
}

/// Who adds an effect to a vehicle whose hull is late gets the lag with it, in the new vehicle file too.
#[test]
fn regress_an_effect_added_to_a_late_hull_comes_with_the_lag() {
    let (log, v) = hiding(Hidden::PitchScale, Site::Lake, Wing::Standard, Some(Banking::Tilts), 3);
    let done = add(&log, &v, &[named("pitch_scale")], b"parent").expect("a fit");
    assert!(done.vehicle["hull_lag_share"].as_f64().is_some_and(|share| share > 0.3), "{:?}", done.notes);
    let back = flown(&log, &done);
    assert_eq!(Some(back.constants.hull_lag_share), done.vehicle["hull_lag_share"].as_f64());
}

/// An effect that the file has already was fitted as a change of it and written as all of it: the new file flew three times as far off
/// as the fit that was told. One number, one with a shape, and one that calibration writes into every file.
#[test]
fn regress_an_effect_that_the_file_has_already_is_fitted_anew_as_a_whole() {
    for (hidden, name) in [(Hidden::RollTurnDrag, "roll_turn_drag"), (Hidden::Stall, "stall"), (Hidden::BallastScale, "ballast_scale")] {
        let (log, v) = hiding(hidden, Site::Lake, Wing::Standard, None, 7);
        let effect = named(name);
        let first = add(&log, &v, &[effect], b"parent").expect("a fit");
        assert!(first.heldout_m_s[2] < 0.7 * first.heldout_m_s[0], "{name}: {:?}", first.heldout_m_s);
        let with = flown(&log, &first);
        let second = add(&log, &with, &[effect], b"parent").expect("a fit");
        assert!(second.notes.iter().any(|n| n.contains(name) && n.contains("fitted anew")), "{:?}", second.notes);
        flown(&log, &second);
        // As given is with what the file has; and the whole size is told, inside the interval that the first fit gave.
        assert!((second.heldout_m_s[0] / first.heldout_m_s[2] - 1.0).abs() < 0.05, "{name}: {:?}", second.heldout_m_s);
        let (a, b) = (&first.parameters[0], &second.parameters[0]);
        assert!(a.low <= b.value && b.value <= a.high, "{name}: {} to {}, then {}", a.low, a.high, b.value);
    }
}

/// A file that has too much of an effect: the effect is named, with the sign that mends it, though nature has no vortex that takes lift
/// away; and adding it finds all of it.
#[test]
fn regress_too_much_of_an_effect_in_the_file_is_named_as_a_change_of_it() {
    let (log, v) = hiding(Hidden::VortexLiftBodywing, Site::Lake, Wing::LowAspectRatio, None, 7);
    let vortex = named("vortex_lift_bodywing");
    let first = add(&log, &v, &[vortex], b"parent").expect("a fit");
    let mut with = flown(&log, &first);
    for a in with.effects.iter_mut().filter(|a| a.effect.name == vortex.name) {
        a.values[0] *= 2.0;
    }
    let d = diagnose(&log, &with, Depth::Pairs, &|_, _| {}).expect("a diagnosis");
    let size = d.candidates[0].parameters.iter().find(|p| p.name == "vortex_lift_bodywing.k").map(|p| p.value);
    assert!(d.answer == ["vortex_lift_bodywing"] && size.is_some_and(|k| k < 0.0), "{:?} {size:?}", d.answer);
    assert!(d.notes.iter().any(|n| n.contains("change of it")), "{:?}", d.notes);
    let again = add(&log, &with, &[vortex], b"parent").expect("a fit");
    let (a, b) = (&first.parameters[0], &again.parameters[0]);
    assert!(a.low <= b.value && b.value <= a.high, "{} to {}, then {}", a.low, a.high, b.value);
}

/// Two expressions of one target are two effects: the second was written over the first.
#[test]
fn regress_a_second_expression_of_one_target_leaves_the_first_where_it_is() {
    let (log, v) = hiding(Hidden::RollTurnDrag, Site::Lake, Wing::Standard, None, 7);
    let own = |text: &str| expression::parse(text).expect("parses") as &'static Effect;
    let first = add(&log, &v, &[own("cd += k*roll^2")], b"parent").expect("a fit");
    let second = add(&log, &flown(&log, &first), &[own("cd += k*U")], b"parent").expect("a fit");
    let both = flown(&log, &second);
    let texts: Vec<&str> = both.effects.iter().filter_map(|a| a.effect.expression).collect();
    assert!(texts.len() == 2 && texts.contains(&"cd += k*roll^2") && texts.contains(&"cd += k*U"), "{texts:?}");
}

/// The law over a wider range of angles of attack is refitted with the format's: the new file flies as it was told.
#[test]
fn regress_a_refit_of_a_vehicle_with_a_wide_law_refits_that_too() {
    let (log, mut v) = hiding(Hidden::ClimbDrag, Site::Lake, Wing::LowAspectRatio, None, 4);
    let c = v.constants;
    let wide = serde_json::json!({
        "lift_slope_per_rad": c.lift_slope_per_rad, "lift_quadratic_per_rad2": c.lift_quadratic_per_rad2, "slope_loss_per_rad2": 0.0,
        "cd0": 1.1 * c.cd0, "hull_drag_per_rad2": c.hull_drag_per_rad2, "hull_drag_per_rad3": 0.0,
    });
    v.document["hydro"]["wide"] = wide;
    let v = vehicle::parse(v.document, Path::new("wide.json")).expect("reads");
    let done = add(&log, &v, &[named("climb_drag")], b"parent").expect("a fit");
    flown(&log, &done);
    // What was stated a tenth too large is 2.5 of its tolerances off, and found out.
    let cd0 = done.vehicle["hydro"]["wide"]["cd0"].as_f64().expect("a number");
    assert!((cd0 / c.cd0 - 1.0).abs() < 0.06, "{cd0} of {}", c.cd0);
}

//! How well the diagnosis names what is hidden, on a fixed handful of sealed cases; `glider scorecard discovery` does it at length.
//!
//! Truth is the plant: its own force law, coloured water motion, calibration scatter and sensor faults.

mod case;

use discovery::diagnosis::{self, report};
use discovery::hypotheses::search::Depth;
use discovery::record::csv;
use discovery::vehicle;
use hil_host::score;
use plant::trials::catalogue::{Effect, Outside, Strength};
use plant::trials::{Banking, Kind, Site, Spec, Wing, generate, plan};
use serde_json::Value;
use std::path::{Path, PathBuf};

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("glider-scorecard-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    folder
}

fn ask(flight: &Path) -> Result<Value, String> {
    let v = vehicle::read(&flight.join("vehicle.json")).map_err(|e| e.to_string())?;
    answer(&csv::flight(flight).map_err(|e| e.to_string())?, &v)
}

fn answer(f: &discovery::Flight, v: &discovery::Vehicle) -> Result<Value, String> {
    let d = diagnosis::diagnose(f, v, Depth::Pairs, &|_, _| {}).map_err(|e| e.to_string())?;
    Ok(report::document(&d, v, "case"))
}

/// What is named, in the order of the alphabet.
fn sorted_answer(told: &Value) -> Vec<String> {
    let mut named: Vec<String> = told["answer"].as_array().expect("a list").iter().map(|e| e.as_str().expect("a name").into()).collect();
    named.sort();
    named
}

/// What is told of one case of a plan.
fn told(seed: u64, index: usize) -> Value {
    told_of(seed, index, 1.0)
}

/// What is told of it by a vehicle file whose drag due to angle of attack is so many times nature's.
fn told_of(seed: u64, index: usize, drag_due_to_angle: f64) -> Value {
    told_by(seed, index, &|v| {
        v.constants.induced_k *= drag_due_to_angle;
        v.constants.hull_drag_per_rad2 *= drag_due_to_angle;
    })
}

/// What is told of it where nobody knows the moments in pitch: by depth, speed and fixes alone.
fn told_without_battery(seed: u64, index: usize) -> Value {
    told_by(seed, index, &|v| v.moments = None)
}

/// What is told of it by another vehicle file.
fn told_by(seed: u64, index: usize, change: &dyn Fn(&mut discovery::Vehicle)) -> Value {
    let (f, mut v) = case::read_back(&plan(index + 1, seed, None)[index], seed, index);
    change(&mut v);
    answer(&f, &v).expect("a diagnosis")
}

fn one(spec: &Spec, seed: u64, depth: Depth) -> diagnosis::Diagnosis {
    let (f, v) = case::read_back(spec, seed, 0);
    diagnosis::diagnose(&f, &v, depth, &|_, _| {}).expect("a diagnosis")
}

fn spec(site: Site, kind: Kind, effects: Vec<Effect>, outside: Option<Outside>) -> Spec {
    Spec { site, wing: Wing::Standard, kind, effects, outside, strength: Some(Strength::Strong), lifelike: None }
}

fn clean(site: Site, wing: Wing) -> Spec {
    Spec { wing, strength: None, ..spec(site, Kind::Clean, Vec::new(), None) }
}

/// Twenty cases as they come. The bounds lie one case below what a hundred and more cases of other seeds showed in each group.
#[test]
fn scorecard_hidden_effects_are_named_nothing_is_named_where_nothing_is_hidden_and_strangers_stay_unnamed() {
    let folder = folder("subset");
    let scored = score::diagnosis::run(&plan(20, 5, None), 5, &folder, 2, &ask, &|| {}).expect("the cases run");
    std::fs::remove_dir_all(folder).ok();
    let card = score::diagnosis::summary(&scored);
    let right = |kind: Kind, is: &dyn Fn(&score::diagnosis::Scored) -> bool| {
        let all: Vec<_> = scored.iter().filter(|s| s.kind == kind).collect();
        (all.iter().filter(|s| is(s)).count(), all.len())
    };
    let clean = right(Kind::Clean, &|s| s.verdict == "adequate");
    let singles = right(Kind::Single, &|s| s.in_class);
    let pairs = right(Kind::Pair, &|s| s.hidden.iter().any(|h| s.answer.contains(h)));
    let off = right(Kind::Off, &|s| s.verdict == "unexplained");
    eprintln!("clean {clean:?} singles {singles:?} pairs (one named) {pairs:?} off {off:?}; {:#}", card["confusion"]);
    assert_eq!((clean.1, singles.1, pairs.1, off.1), (4, 9, 4, 3), "the plan deals other cases");
    assert!(clean.0 >= 4 - 1 && singles.0 >= 9 - 2 && pairs.0 >= 4 - 1 && off.0 >= 3 - 1, "{clean:?} {singles:?} {pairs:?} {off:?}");
    // The error after a right answer is that of the refit which is told the truth, to 5 % in the median.
    let ratio = card["error_after_over_known_truth_of_exact_answers"].as_f64().expect("some answers are exact");
    assert!(ratio <= 1.05, "{ratio}");
}

/// Effects that were lost once. A drag that depends on speed strained the calibration to where the model does not glide. A vertical
/// current peaks where nature has it, not at mid-depth. Pairs that had been weighed against another null stayed ahead of the right
/// one. Rows near the stall that a weak lift explained were left out all the same. Rows near the stall asked for vortices beside a
/// weak lift, which the others do not know of. Glides that followed a slow launch were left out, more than half of the flight. Pairs
/// stayed where they were when one of their members alone found a better fit. Stalls were flown beyond the end of the law, whose
/// continuation was taken for known: a drag effect beside them made up for it. More was asked of a stall than of other effects, while
/// the form of the law near it was taken for known. Ordinary water motion with a period of minutes was taken for something left over.
/// Singles that were not fitted again kept odds of another size of the water motion, and with what remains beside one of them it
/// seemed to tell more than the right pair. What remains was asked beside such a single, whose rows and colour were of before. Vortices
/// whose size the flight hardly limits, for it trades against the angle of their onset, were too large to be true.
#[test]
fn regress_effects_that_the_search_or_the_second_look_lost_once_are_named() {
    let lost: [(u64, usize, &[&str]); 16] = [
        (20_261_121, 129, &["reynolds_drag"]),
        (777_001, 63, &["vertical_current"]),
        (424_242, 8, &["horizontal_current", "pitch_scale"]),
        (55_501, 130, &["lift_slope_error"]),
        (777_001, 120, &["lift_slope_error"]),
        (313_131, 229, &["biofouling_drag"]),
        (313_131, 153, &["induced_drag_error", "ballast_scale"]),
        (313_131, 262, &["induced_drag_error", "pressure_drift"]),
        (525_252, 255, &["stall"]),
        (969_696, 95, &["stall"]),
        (313_131, 58, &["stall", "ballast_scale"]),
        (313_131, 189, &["stall"]),
        (969_696, 59, &["stall"]),
        (20_261_128, 138, &["induced_drag_error", "thermal_expansion"]),
        (20_261_131, 287, &["internal_wave"]),
        (20_261_131, 220, &["vortex_lift_bodywing"]),
    ];
    for (seed, index, names) in lost {
        let told = told(seed, index);
        assert_eq!((&told["verdict"], &told["answer"]), (&"explained".into(), &serde_json::json!(names)), "case {index} of seed {seed}");
    }
}

/// Scatter inside two tolerances is in every vehicle, beyond three it is something missing. Once a calibration number paid for the way
/// between as a normal variable does, and a drag level of three and a half tolerances was called scatter beside what else was named.
#[test]
fn regress_a_drag_level_beyond_its_scatter_is_named_beside_another_effect() {
    for (index, other) in [(68, "internal_wave"), (108, "pitch_offset")] {
        let told = told_without_battery(313_131, index);
        let mut answer: Vec<&str> = told["answer"].as_array().expect("names").iter().filter_map(|n| n.as_str()).collect();
        answer.sort_unstable();
        assert_eq!(answer, ["drag_level_error", other], "case {index}: {}", told["verdict"]);
    }
}

/// Once more was asked of effects that choose their angle, and a look-alike without one was named in the place of the best hypothesis,
/// to which the tool itself gave a probability of a hundredth.
#[test]
fn regress_where_something_is_missing_the_most_probable_hypothesis_is_the_answer() {
    let told = told(313_131, 203);
    assert_eq!(told["answer"], serde_json::json!(["vortex_lift_bodywing"]));
    assert_eq!(told["answer"], told["candidates"][0]["effects"]);
}

/// No file knows the drag due to angle of attack to a hundredth. Two hundredths were named induced drag once in these clean flights,
/// and something in 6 of 120 others; with a tolerance for it, in 1.
#[test]
fn regress_a_drag_law_that_is_two_hundredths_off_is_not_called_missing_physics() {
    for (index, drag_due_to_angle) in [(21, 1.02), (246, 0.98)] {
        let told = told_of(313_131, index, drag_due_to_angle);
        assert_eq!(told["verdict"], "adequate", "case {index}: {}", told["answer"]);
    }
}

/// The fitted segments have shown that the vehicle glides after its launches. On the check segments, where pressure may not be looked
/// at, the model once stayed stalled after one, and the error of a right answer was twice that of none.
#[test]
fn regress_a_launch_of_a_check_segment_ends_as_those_of_the_fitted_segments_do() {
    let told = told(313_131, 138);
    assert_eq!(told["answer"], serde_json::json!(["zero_lift_angle", "climb_drag"]));
    let error = |which: &str| told["error"][which].as_f64().expect("an error, cm/s");
    // 0.32 of 0.24 cm/s; 0.73 while stalled.
    assert!(error("best") < 1.6 * error("noise_floor") && error("best") < error("recalibrated"), "{}", told["error"]);
}

/// Launches and turns of the low-aspect-ratio wings are flown beyond the given law, the glides after them are not: nature's share is
/// held below 15 % elsewhere in this file. Once half of a flight and more was left out, because a model may stall after any launch.
#[test]
fn validate_of_a_clean_flight_hardly_more_is_left_out_than_launches_and_turns() {
    for (site, seed) in [(Site::Lake, 99), (Site::Lake, 100), (Site::Sea, 99)] {
        let d = one(&clean(site, Wing::LowAspectRatio), seed, Depth::Pairs);
        assert_eq!(d.verdict, diagnosis::Verdict::Adequate, "{site:?} {seed}: {:?}", d.answer);
        // 110 s of each launch in a yo of ten minutes, and turns as above: a third. Once it was more than one.
        assert!(d.brink * 3 < d.rows, "{site:?} {seed}: {} rows left out, {} observations fitted", d.brink, d.rows);
    }
}

/// Nobody has a name for a leak, and the tool must say that, and what it looks like.
#[test]
fn scorecard_a_leak_is_unexplained_and_what_remains_follows_trim() {
    let d = one(&spec(Site::Lake, Kind::Off, Vec::new(), Some(Outside::Leak)), 3, Depth::Pairs);
    assert_eq!(d.verdict, diagnosis::Verdict::Unexplained, "{:?} {:?}", d.answer, d.remainder.first());
    assert!(d.remainder.iter().take(3).any(|f| f.variable.contains("trim")), "{:?}", d.remainder);
}

/// Two effects that pull apart hide behind a third: ballast offset and thermal expansion behind compressibility, which alone led by
/// 28 log odds, so that no pair without it was asked. And a pair that starts from the wrong one of its two may stay in a hollow: side
/// edges and an angle of zero lift were called a lift slope and an angle of zero lift, which fitted worse by 21 of chi².
#[test]
fn regress_pairs_that_the_best_single_effect_hides_are_found() {
    let hidden = told(20_261_140, 173);
    // A density bias is the same force as a ballast offset in one density.
    let found = [["ballast_offset", "thermal_expansion"], ["density_bias", "thermal_expansion"]];
    assert!(found.iter().any(|f| sorted_answer(&hidden) == *f), "{}", hidden["answer"]);
    let hollow = told(20_261_140, 238);
    assert_eq!(sorted_answer(&hollow), ["side_edge_lift", "zero_lift_angle"], "{}", hollow["answer"]);
}

/// Far from its model a flight strains the calibration before any effect is there, up to its limits, and all that starts from it stays
/// there: added mass was called thermal expansion beside an induced drag (chi² 2,874 where 1,665 is to be had), a compressibility
/// nothing. Let go, both are found. And beside a wave that leads only two effects were tried, of which neither was the vortex lift
/// that both resemble.
#[test]
fn regress_pairs_that_a_strained_calibration_or_a_wave_hides_are_found() {
    for (seed, index, names) in [
        (20_261_150, 153, ["added_mass", "induced_drag_error"]),
        (20_261_150, 53, ["hull_compressibility", "induced_drag_error"]),
        (20_261_151, 68, ["internal_wave", "vortex_lift_bodywing"]),
    ] {
        let told = told(seed, index);
        assert_eq!(sorted_answer(&told), names, "case {index} of seed {seed}: {}", told["verdict"]);
    }
}

/// A second effect had to be worth more than the form of the first may differ by from nature's, whether another form would explain it or
/// not: a pitch scale beside drag in turns and a drag level beside fouling were not named.
#[test]
fn regress_a_second_effect_that_no_form_of_the_first_explains_is_named() {
    for (index, names) in [(133, ["pitch_scale", "roll_turn_drag"]), (288, ["biofouling_drag", "drag_level_error"])] {
        let told = told(20_261_152, index);
        assert_eq!(sorted_answer(&told), names, "case {index}: {}", told["verdict"]);
    }
}

/// Real bodies do more than the nominal model: geometry tilts lift with the roll, and a hull follows the water's temperature late.
/// The first was called drag in turns beside whatever else was missing, the second made a wrong thermal expansion unexplained.
#[test]
fn regress_what_every_body_does_and_the_nominal_model_leaves_out_is_not_named() {
    for (site, effect) in [
        (Site::Sea, Effect::InducedDragError),
        (Site::Sea, Effect::AddedMass),
        (Site::Sea, Effect::RollTurnDrag),
        (Site::Lake, Effect::ThermalExpansion),
    ] {
        let body = Spec { wing: Wing::LowAspectRatio, lifelike: Some(Banking::Tilts), ..spec(site, Kind::Single, vec![effect], None) };
        let d = one(&body, 2, Depth::Pairs);
        assert_eq!(d.answer, [effect.names().0], "{:?} {:?} {:?}", d.verdict, d.remainder.first(), d.notes);
    }
}

/// A hull that follows the water's temperature late is what every body has: through a thermocline the trim that it moves was called
/// something unknown, or an effect was named for it.
#[test]
fn regress_a_hull_that_is_late_is_no_riddle_and_hides_nothing() {
    for wing in [Wing::Standard, Wing::LowAspectRatio] {
        let body = Spec { lifelike: Some(Banking::Tilts), ..clean(Site::Lake, wing) };
        let d = one(&body, 3, Depth::Pairs);
        assert_eq!(d.verdict, diagnosis::Verdict::Adequate, "{wing:?} {:?} {:?}", d.answer, d.remainder.first());
        assert!(d.sensors.iter().any(|s| s.what.contains("late") && s.value > 0.0), "{wing:?} {:?}", d.sensors);
        let scaled = Spec { lifelike: Some(Banking::Tilts), wing, ..spec(Site::Lake, Kind::Single, vec![Effect::PitchScale], None) };
        let d = one(&scaled, 3, Depth::Pairs);
        assert_eq!(d.answer, ["pitch_scale"], "{wing:?} {:?} {:?}", d.verdict, d.remainder.first());
    }
}

/// Lift that tilts with the roll is followed beside nothing too: two clean flights of others were unexplained, following the roll.
#[test]
fn regress_lift_that_tilts_is_followed_where_nothing_is_missing() {
    for wing in [Wing::Standard, Wing::LowAspectRatio] {
        let d = one(&Spec { lifelike: Some(Banking::Tilts), ..clean(Site::Sea, wing) }, 2, Depth::Pairs);
        assert_eq!(d.verdict, diagnosis::Verdict::Adequate, "{wing:?} {:?} {:?}", d.answer, d.remainder.first());
    }
}

/// A body that turns as it banks flies slower in turns for no missing reason: nine clean flights in 26 of somebody whose bodies do were told
/// to have a drag in turns, and so were most with something else missing.
#[test]
fn regress_a_turn_in_three_dimensions_is_no_missing_drag_and_hides_none() {
    let turning = Some(Banking::Turns);
    for (site, wing) in [(Site::Sea, Wing::LowAspectRatio), (Site::Lake, Wing::LowAspectRatio), (Site::Sea, Wing::Standard)] {
        let d = one(&Spec { lifelike: turning, ..clean(site, wing) }, 2, Depth::Pairs);
        assert_eq!(d.verdict, diagnosis::Verdict::Adequate, "{site:?} {wing:?} {:?} {:?}", d.answer, d.remainder.first());
        let turn = d.sensors.iter().find(|s| s.what.contains("turn")).map_or(0.0, |s| s.value);
        assert!((0.5..1.2).contains(&turn), "{site:?} {wing:?} {:?}", d.sensors);
    }
    for (effect, name) in [(Effect::RollTurnDrag, "roll_turn_drag"), (Effect::BallastScale, "ballast_scale")] {
        let body = Spec { lifelike: turning, wing: Wing::LowAspectRatio, ..spec(Site::Sea, Kind::Single, vec![effect], None) };
        let d = one(&body, 2, Depth::Pairs);
        assert_eq!(d.answer, [name], "{:?} {:?}", d.verdict, d.remainder.first());
    }
}

/// A list is no turn: drag of turning that knows none is a drag of one side where the roll that is measured has one, and was told as that.
#[test]
fn regress_a_drag_in_turns_is_found_whatever_the_list() {
    let body = Spec { wing: Wing::LowAspectRatio, ..spec(Site::Sea, Kind::Single, vec![Effect::RollTurnDrag], None) };
    let (mut f, v) = case::read_back(&body, 2, 0);
    f.roll_rad.iter_mut().for_each(|roll| *roll += 0.03);
    let d = diagnosis::diagnose(&f, &v, Depth::Pairs, &|_, _| {}).expect("a diagnosis");
    assert_eq!(d.answer, ["roll_turn_drag"], "{:?} {:?}", d.verdict, d.remainder.first());
    let list = &d.candidates[0].parameters[1];
    assert!(list.name == "roll_turn_drag.list_rad" && list.low < 0.035 && list.high > 0.025, "{list:?}");
}

/// A pump that is late moves the trim near the thermocline as a late hull does, and more: it stays unknown.
#[test]
fn regress_a_late_pump_is_not_taken_for_a_late_hull() {
    let told = told(20_261_152, 284);
    assert_eq!(told["verdict"], "unexplained", "{}", told["answer"]);
}

/// A density that is biased and a ballast that is off do the same at sea. Their fits had come to rest in two places, and one of the two
/// was told with odds of e^20 to one against the other.
#[test]
fn regress_what_does_the_same_is_as_likely_wherever_its_fit_came_to_rest() {
    let told = told(20_261_177, 278);
    let odds = |effect: &str| {
        let pair = serde_json::json!(["biofouling_drag", effect]);
        let of = told["candidates"].as_array().expect("a list").iter().find(|c| c["effects"] == pair).expect("listed");
        of["evidence"].as_str().and_then(|e| e.strip_prefix("log odds ")?.split(' ').next()?.parse::<f64>().ok()).expect("log odds")
    };
    let apart = odds("ballast_offset") - odds("density_bias");
    assert!(apart.abs() < 3.0, "{apart}");
    assert_eq!(told["verdict"], "ambiguous", "{told}");
}

/// A second effect that is nearly as likely as not is said so; and where the first alone leaves a remainder that the second explains,
/// the flight is no riddle.
#[test]
fn regress_a_second_effect_that_is_nearly_as_likely_as_not_is_said_so() {
    let nearly = told_without_battery(20_261_152, 278);
    assert_eq!(nearly["answer"], serde_json::json!(["added_mass"]));
    let both = serde_json::json!(["added_mass", "pitch_scale"]);
    assert!(nearly["equivalent"].as_array().is_some_and(|e| e.contains(&both)), "{}", nearly["equivalent"]);
    // With the battery as a witness there is no doubt.
    let certain = told(20_261_152, 278);
    assert_eq!(
        (certain["verdict"].as_str(), sorted_answer(&certain)),
        (Some("explained"), vec!["added_mass".into(), "pitch_scale".into()])
    );
    // Both are hidden in either; here the second is likelier than not.
    let likelier = told(20_261_140, 148);
    assert_eq!(likelier["answer"], serde_json::json!(["vertical_current", "drag_level_error"]));
    let alone = serde_json::json!(["vertical_current"]);
    assert!(likelier["equivalent"].as_array().is_some_and(|e| e.contains(&alone)), "{}", likelier["equivalent"]);
    let explained = told(20_261_140, 278);
    assert_eq!(explained["verdict"], "ambiguous", "{}", explained["remainder"]);
    assert_eq!(explained["answer"], serde_json::json!(["vertical_current", "thermal_expansion"]));
}

/// A calibration that strains for what is missing flies this vehicle into a stall where there is none: nine rows of ten were left out of
/// the first look, and the answer was a riddle with an error of 5.2 cm/s. Where the rows that the vehicle as given asks for tell all
/// dives better, they are taken; but no effect is named that only those of them ask for which the other look leaves out.
#[test]
fn regress_a_stall_that_only_a_strained_calibration_flies_into_leaves_nothing_out() {
    let strained = told(20_261_146, 88);
    assert_eq!(strained["answer"], serde_json::json!(["induced_drag_error", "roll_turn_drag"]), "{}", strained["verdict"]);
    let error = strained["error"]["best"].as_f64();
    // 0.22 of 0.24 cm/s that a refit of the known truth leaves.
    assert!(error.is_some_and(|e| e < 0.3), "{}", strained["error"]);
    let alone = told(20_261_145, 129);
    assert_eq!(alone["answer"], serde_json::json!(["induced_drag_error"]), "{}", alone["verdict"]);
    let error = alone["error"]["best"].as_f64();
    // 0.45 cm/s at a noise floor of 0.39; 1.54 where half of the flight is stalled by a drag that is shared out wrongly.
    assert!(error.is_some_and(|e| e < 0.6), "{}", alone["error"]);
}

/// A fit may rest on a ledge: its signatures promise a fall of chi² and the next small step stalls a leg. Edge lift beside an induced
/// drag stayed at the end of its range and was called vortex lift; and a flight that mostly stalls was explained wrongly, with an error
/// of 6.5 cm/s at a floor of 0.4, since the drag that all went to the hull could not get to the wings.
#[test]
fn regress_fits_that_rest_on_a_ledge_go_on_from_elsewhere() {
    for (seed, index, names) in
        [(20_261_164, 158, ["induced_drag_error", "side_edge_lift"]), (20_261_165, 268, ["induced_drag_error", "zero_lift_angle"])]
    {
        let told = told(seed, index);
        assert_eq!(sorted_answer(&told), names, "case {index} of seed {seed}: {}", told["verdict"]);
    }
}

/// Where a leg stalls with the next small step of a number, a difference across that ledge made the number look known two and a half times
/// as well as it is, and the evidence two to three log odds too low: two weak effects went unnamed.
#[test]
fn regress_a_leg_that_nearly_stalls_makes_no_number_look_known() {
    for (index, name, narrow) in [(49, "induced_drag_error", 0.09), (125, "lift_slope_error", 0.0)] {
        let told = told(20_261_167, index);
        let interval = &told["candidates"][0]["parameters"][format!("{name}.rel_error")];
        let width = interval["high"].as_f64().zip(interval["low"].as_f64()).map(|(high, low)| high - low);
        assert!(width.is_some_and(|w| w > narrow), "case {index}: {interval}");
        assert_eq!(told["answer"], serde_json::json!([name]), "case {index}: {}", told["verdict"]);
    }
}

/// Rows near the stall are left out of fits, but nobody is to believe that the model is right there.
#[test]
fn validate_a_model_that_misses_near_the_stall_alone_says_so() {
    let says_so = |told: &Value| told["notes"].to_string().contains("near the stall the model misses by");
    assert!(says_so(&told(20_261_152, 4)));
    assert!(!says_so(&told(20_261_146, 88)));
}

/// Growth need not be steady: nature's goes with the power 1.233 of time here, which a straight line misses by 115 log odds.
#[test]
fn accuracy_the_power_of_a_growth_is_found() {
    let told = told(20_261_140, 198);
    let power = &told["candidates"][0]["parameters"]["biofouling_drag.power"]["value"];
    assert!(power.as_f64().is_some_and(|p| (p - 1.233).abs() < 0.05), "{power}");
}

/// What makes drag or displaced volume vary in a way that no name has: it was called biofouling with something else, or nothing at all,
/// by a tool that asked strangers for trim and pitch only and knew no period shorter than the sea's.
#[test]
fn regress_strangers_that_act_through_drag_or_have_a_period_of_their_own_are_unexplained() {
    for (name, stranger, site, variable) in [
        ("heading", Outside::DragByHeading, Site::Lake, "heading (drag)"),
        ("line", Outside::LineCaught, Site::Sea, "segment (drag)"),
        ("breath", Outside::Breathing, Site::Sea, "time (a period of the vehicle's own)"),
    ] {
        let d = one(&spec(site, Kind::Off, Vec::new(), Some(stranger)), 3, Depth::Pairs);
        assert_eq!(d.verdict, diagnosis::Verdict::Unexplained, "{name} {:?} {:?}", d.answer, d.remainder.first());
        assert_eq!(d.remainder[0].variable, variable, "{name} {:?}", d.remainder);
    }
}

/// Two effects with a name can follow a strong stranger: a ballast offset and thermal expansion followed trapped air once, and both
/// added masses a late engine. The stranger itself tells it better, which shows only when model and stranger are fitted together: beside
/// nothing its step is too long for linear theory, and beside a named effect that effect has to give way. A stall that ends late was
/// called a stall: without a memory it explains most of such a flight.
#[test]
fn regress_a_strong_stranger_is_not_called_two_effects_that_follow_it() {
    let strange = [
        (969_696, 84, "pressure of enclosed air (trim)"),
        (20_261_126, 124, "pressure of enclosed air (trim)"),
        (20_261_127, 64, "ballast some time ago (trim)"),
        (20_261_128, 197, "angle of attack some time ago (a stall that ends late)"),
        (20_261_129, 224, "angle of attack some time ago (a stall that ends late)"),
        // Called a lift slope that is too low: most legs stay separated all the way.
        (20_261_133, 57, "angle of attack some time ago (a stall that ends late)"),
        (20_261_141, 244, "angle of attack some time ago (a stall that ends late)"),
    ];
    for (seed, index, variable) in strange {
        let told = told(seed, index);
        assert_eq!(
            (&told["verdict"], &told["remainder"][0]["variable"]),
            (&"unexplained".into(), &variable.into()),
            "case {index} of seed {seed}"
        );
    }
}

/// A wave beside an effect is reached from either; listed twice, it looked half as probable as it is.
#[test]
fn regress_no_hypothesis_is_listed_twice() {
    let told = told(20261170, 225);
    let mut sets: Vec<Vec<&str>> = Vec::new();
    for c in told["candidates"].as_array().expect("a list") {
        let mut names: Vec<&str> = c["effects"].as_array().expect("names").iter().filter_map(Value::as_str).collect();
        names.sort_unstable();
        assert!(!names.is_empty() && !sets.contains(&names), "{names:?} twice");
        sets.push(names);
    }
    assert!(sets.contains(&vec!["internal_wave", "pitch_offset"]), "{sets:?}");
}

/// Weed that is caught after the last dive that is fitted, and lost again, leaves nothing where the model is fitted: two flights of others
/// were called adequate with four times the ordinary error in the dive they were checked on.
#[test]
fn regress_what_happens_in_a_check_segment_alone_is_not_called_adequate() {
    let (mut f, v) = case::read_back(&clean(Site::Sea, Wing::Standard), 4, 0);
    let told = |f: &discovery::Flight| diagnosis::diagnose(f, &v, Depth::Pairs, &|_, _| {}).expect("a diagnosis");
    assert_eq!(told(&f).verdict, diagnosis::Verdict::Adequate);
    let checked = v.check_segments[0];
    for (segment, ballast_m3) in f.segment.iter().zip(&mut f.ballast_m3) {
        // A pump that holds a third of its stroke back.
        *ballast_m3 *= if *segment == checked { 1.5 } else { 1.0 };
    }
    let d = told(&f);
    assert_eq!(d.verdict, diagnosis::Verdict::Unexplained, "{:?} {:?}", d.answer, d.notes);
    let said = d.notes.iter().find(|n| n.contains("on the check segments the recalibrated model leaves"));
    assert!(said.is_some_and(|n| v.check_segments.len() < 2 || n.contains(&format!("in segment {checked}"))), "{:?}", d.notes);
}

/// A hull expands with temperature: where none was measured, no single name can be certain.
#[test]
fn scorecard_without_temperature_a_name_is_never_certain() {
    let (mut f, v) = case::read_back(&spec(Site::Lake, Kind::Single, vec![Effect::DragLevelError], None), 2, 0);
    f.temperature_degc.fill(f64::NAN);
    let d = diagnosis::diagnose(&f, &v, Depth::Pairs, &|_, _| {}).expect("a diagnosis");
    assert_ne!(d.verdict, diagnosis::Verdict::Explained, "{:?}", d.answer);
    assert!(d.notes.iter().any(|n| n.contains("no temperature")), "{:?}", d.notes);
}

/// A third effect is sought on request only, and must not push a true pair from its place.
#[test]
fn scorecard_three_effects_are_tried_on_request_and_a_single_stays_first() {
    let single = spec(Site::Lake, Kind::Single, vec![Effect::DragLevelError], None);
    for (depth, triples) in [(Depth::Pairs, false), (Depth::Triples, true)] {
        let d = one(&single, 2, depth);
        assert_eq!(d.answer, ["drag_level_error"], "{depth:?} {:?}", d.verdict);
        assert_eq!(d.candidates.iter().any(|c| c.effects.len() == 3), triples, "{depth:?}");
    }
}

/// The format says that only launches and turns are flown beyond the angle of attack where the given law ends.
#[test]
fn prop_clean_trials_fly_beyond_the_given_law_at_launches_and_turns_only() {
    for (i, site) in [Site::Lake, Site::Sea].into_iter().enumerate() {
        for index in 0..2 {
            let case = generate(&clean(site, Wing::LowAspectRatio), 70 + i as u64, index);
            for share in case.truth.stalled_share {
                // A launch and two turns of half a minute each in a lake yo of ten minutes.
                assert!((0.0..0.15).contains(&share), "{:?}: {:?}", case.name, case.truth.stalled_share);
            }
        }
    }
}

/// A pitch sensor on another computer's clock is a second late in every turn. That is no effect of the catalogue, and the tool says
/// which variable to look at.
#[test]
fn scorecard_a_pitch_whose_clock_is_late_is_unexplained_and_what_remains_follows_the_rate_of_pitch() {
    let (mut f, v) = case::read_back(&clean(Site::Lake, Wing::Standard), 4, 0);
    let told = |f: &discovery::Flight| diagnosis::diagnose(f, &v, Depth::Pairs, &|_, _| {}).expect("a diagnosis");
    assert_eq!(told(&f).verdict, diagnosis::Verdict::Adequate);
    let known: Vec<(f64, f64)> = f.time_s.iter().copied().zip(f.pitch_rad.iter().copied()).filter(|(_, p)| p.is_finite()).collect();
    for (time_s, pitch) in f.time_s.iter().zip(&mut f.pitch_rad).filter(|(_, p)| p.is_finite()) {
        let t = time_s - 1.0;
        let after = known.partition_point(|k| k.0 < t).clamp(1, known.len() - 1);
        let (a, b) = (known[after - 1], known[after]);
        *pitch = a.1 + (b.1 - a.1) * ((t - a.0) / (b.0 - a.0)).clamp(0.0, 1.0);
    }
    let late = told(&f);
    assert_eq!(late.verdict, diagnosis::Verdict::Unexplained, "{:?}", late.answer);
    assert!(late.remainder[0].variable.starts_with("rate of pitch"), "{:?}", late.remainder);
}

//! An effect of one's own is one row: defined here and put into the catalogue, it is diagnosed, added and planned for.
//!
//! The catalogue is the process's: these tests start themselves again, so that no other diagnosis meets the effect.

use crate::case::read_back;
use discovery::diagnosis::diagnose;
use discovery::hypotheses::search::Depth;
use discovery::model::integrator::track;
use discovery::preprocess::prepare;
use discovery::workbench::add::{Added, add};
use discovery::workbench::next_flight::{Reach, plan};
use hydro::effects::{Active, Continuation, Effect, Parameter};
use logs::vehicle::{self, catalogue};
use logs::{Flight, Vehicle};
use plant::trials::{Site, Spec, Wing};
use std::path::Path;
use std::process::Command;

/// Drag where the flow at the wing tips separates, CD += k (|α| − α0)² beyond an onset angle. It only ever costs.
static TIP_SEPARATION_DRAG: Effect = Effect {
    name: NAME,
    physics: "the flow at the wing tips separates beyond an angle of attack and costs drag",
    separated_by: "legs at shallow pitch beside steep ones",
    usual_sign: 1.0,
    starts_at: Some(10.0),
    parameters: &[
        Parameter::new("k", "1/rad^2", 0.0, (0.0, 300.0), 20.0, "guess"),
        Parameter::new("onset_rad", "rad", 0.1, (0.03, 0.2), 0.03, "guess"),
    ],
    drag: Some(&|p, at, _, _| {
        let beyond = at.alpha_rad.abs() - p[1];
        if beyond > 0.0 { p[0] * beyond * beyond } else { 0.0 }
    }),
    ..Effect::NONE
};

const NAME: &str = "tip_separation_drag";

/// Pressure from which a row is under water, Pa.
const UNDER_WATER_PA: f64 = 2e4;
/// Size and onset that are hidden.
const HIDDEN: [f64; 2] = [8.0, 0.08];

/// A flight of the plant whose depth shows the effect as well. The shift is the model's own: that the catalogue is open is tested here,
/// not how well a form is found that nature has otherwise.
fn flight(wing: Wing) -> (Flight, Vehicle) {
    let spec = Spec::clean(Site::Lake, wing);
    let (mut log, v) = read_back(&spec, 11, 0);
    let mut hidden = Active::sized(&TIP_SEPARATION_DRAG, HIDDEN[0]);
    hidden.values[1] = HIDDEN[1];
    for run in &prepare(&log, &v).runs {
        let depths = |effects: &[Active]| track(run, v.constants, effects, v.water_depth_m, Continuation::Rising).depth_m;
        for (row, (with, without)) in depths(&[hidden]).into_iter().zip(depths(&[])).enumerate() {
            let pressure = &mut log.pressure_pa[run.first_row + row];
            // Afloat it reads what it did; what would come up early or late is lost.
            if *pressure > UNDER_WATER_PA {
                let shifted = *pressure + 1e4 * (with - without);
                *pressure = if shifted > UNDER_WATER_PA { shifted } else { f64::NAN };
            }
        }
    }
    // What else would have shown it.
    log.speed_m_s = None;
    for column in [&mut log.gps_east_m, &mut log.gps_north_m, &mut log.battery_mass_m] {
        column.fill(f64::NAN);
    }
    (log, v)
}

/// Runs the test of this name in a process of its own; whether this is that process.
fn alone(test: &str) -> bool {
    const ALONE: &str = "GLIDER_TEST_ALONE";
    if std::env::var_os(ALONE).is_some() {
        return true;
    }
    let program = std::env::current_exe().expect("this program");
    let out = Command::new(program).args(["--exact", test, "--include-ignored", "--nocapture"]).env(ALONE, "1").output().expect("runs");
    let text = String::from_utf8_lossy(&out.stdout).into_owned() + &String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success() && text.contains("1 passed"), "{text}");
    false
}

fn diagnosed_added_and_planned_for(wing: Wing, error_m_s: fn(&Added) -> [f64; 3]) {
    catalogue::extend(vec![&TIP_SEPARATION_DRAG]).expect("it is new");
    assert!(catalogue::extend(vec![&TIP_SEPARATION_DRAG]).is_err(), "once is enough");
    let (log, v) = flight(wing);
    let d = diagnose(&log, &v, Depth::Pairs, &|_, _| {}).expect("a diagnosis");
    assert_eq!(d.answer, [NAME], "{:?}: {:?} {:?}", d.verdict, d.equivalent, d.notes);

    let added = add(&log, &v, &[&TIP_SEPARATION_DRAG], b"parent").expect("a fit");
    let [_, recalibrated, with_effect] = error_m_s(&added);
    assert!(with_effect < 0.7 * recalibrated, "{:?} {:?}", added.fitted_m_s, added.heldout_m_s);
    assert!(added.heldout_m_s[2] < added.heldout_m_s[1], "{:?}", added.heldout_m_s);
    let back = vehicle::parse(added.vehicle, Path::new("new.json")).expect("what is written reads back");
    let own = back.effects.iter().find(|a| a.effect.name == NAME).expect("it is switched on");
    assert!((own.values[0] / HIDDEN[0] - 1.0).abs() < 0.5 && (own.values[1] - HIDDEN[1]).abs() < 0.03, "{:?}", own.values);

    let planned = plan(&d, &v, |_| Reach::UNKNOWN).expect("a plan");
    assert!(planned.tied.iter().flatten().any(|n| *n == NAME), "{:?}", planned.tied);
}

#[test]
fn an_effect_of_ones_own_is_diagnosed_added_and_planned_for() {
    if alone("own_effect::an_effect_of_ones_own_is_diagnosed_added_and_planned_for") {
        // Few rows of the dives kept out fly beyond the onset: the fitted ones show it.
        diagnosed_added_and_planned_for(Wing::Standard, |added| added.fitted_m_s);
    }
}

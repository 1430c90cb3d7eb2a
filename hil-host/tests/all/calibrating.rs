//! A vehicle that was calibrated is judged by what is known of it.

use crate::case::written;
use discovery::diagnosis::{Verdict, diagnose};
use discovery::hypotheses::search::Depth;
use discovery::workbench::calibrate::{Calibrated, Logged, Options, calibrate};
use logs::vehicle;
use logs::{Flight, Vehicle};
use plant::trials::{Site, Spec, Wing, generate_flown, generate_natural};
use std::path::Path;

const SEED: u64 = 20_261_126;

fn clean() -> Spec {
    Spec::clean(Site::Sea, Wing::Standard)
}

fn from(flights: Vec<Flight>, vehicle: &Vehicle) -> (Calibrated, Vehicle) {
    let logs: Vec<Logged> = flights.into_iter().enumerate().map(|(k, flight)| Logged { flight, sha256: format!("{k}") }).collect();
    let done = calibrate(&logs, vehicle, &Options::default(), b"parent", &|_, _| ()).expect("calibrated");
    let known = vehicle::parse(done.vehicle.clone(), Path::new("known.json")).expect("what is written reads back");
    (done, known)
}

/// Some rows of a flight.
fn some_rows(flight: &Flight, wanted: impl Fn(usize) -> bool) -> Flight {
    let mut out = flight.clone();
    let kept: Vec<usize> = (0..flight.len()).filter(|i| wanted(*i)).collect();
    let pick = |of: &Vec<f64>| kept.iter().map(|i| of[*i]).collect::<Vec<f64>>();
    out.time_s = pick(&flight.time_s);
    out.segment = kept.iter().map(|i| flight.segment[*i]).collect();
    out.columns_mut().into_iter().for_each(|c| *c = pick(c));
    out.speed_m_s = flight.speed_m_s.as_ref().map(pick);
    out.extra.values_mut().for_each(|c| *c = pick(c));
    out
}

/// The file that is written says what the plant's vehicle is: within what it calls its tolerances, which are narrower than those given.
#[test]
fn accuracy_calibrated_numbers_are_the_plants_within_their_tolerances() {
    let (mut within, mut asked) = (0, 0);
    for index in 0..3 {
        let case = generate_natural(&clean(), SEED, index);
        let (flight, given) = written(&case);
        let (done, known) = from(vec![flight], &given);
        assert!(known.tolerance.cd0_relative < 0.75 * given.tolerance.cd0_relative, "{}", known.tolerance.cd0_relative);
        let nature = &case.truth.nature;
        let of = |name: &str| done.numbers.iter().find(|n| n.name == name).expect(name);
        for (name, truth) in
            [("cd0", nature.cd0), ("hull_compressibility", nature.compressibility), ("thermal_expansion", nature.thermal_expansion)]
        {
            let (low, high) = of(name).interval().expect("a tolerance");
            asked += 1;
            within += usize::from((low..=high).contains(&truth));
        }
        assert_eq!(done.vehicle["provenance"]["command"], "calibrate");
        assert_eq!(done.vehicle["provenance"]["flights"][0]["sha256"], "0");
    }
    // Of nine 90 % intervals at least seven: fewer has a probability of 5 %.
    assert!(within >= 7, "{within} of {asked}");
}

/// A drag that is a third less in the file than the vehicle has, tolerances kept, is named on the next flight; nothing on a quiet one.
#[test]
fn accuracy_a_drag_the_calibrated_file_lacks_is_named_else_nothing() {
    let first = generate_natural(&clean(), SEED, 0);
    let (flight, given) = written(&first);
    let (done, known) = from(vec![flight], &given);
    let next = generate_flown(&clean(), SEED, 0, None, Some(&[[0.4, 2.3e-4], [0.5, 2.4e-4], [0.35, 2.2e-4], [0.45, 2.5e-4]]));
    let (next, _) = written(&next);
    let quiet = diagnose(&next, &known, Depth::Singles, &|_, _| ()).expect("a diagnosis");
    assert_eq!(quiet.verdict, Verdict::Adequate, "{:?} {:?}", quiet.answer, quiet.notes);
    let mut document = done.vehicle.clone();
    document["hydro"]["cd0"] = (document["hydro"]["cd0"].as_f64().expect("a number") / 1.87).into();
    let changed = vehicle::parse(document, Path::new("changed.json")).expect("reads");
    let found = diagnose(&next, &changed, Depth::Singles, &|_, _| ()).expect("a diagnosis");
    assert!(found.equivalent.iter().any(|set| set == &["drag_level_error"]), "{:?} {:?}", found.verdict, found.equivalent);
}

/// Two flights of one vehicle, each calibrated alone, agree within the tolerances they write; together they know more.
#[test]
fn accuracy_two_flights_of_one_vehicle_agree_within_what_each_says() {
    let case = generate_natural(&clean(), SEED, 1);
    let (flight, given) = written(&case);
    let half = |odd: bool| some_rows(&flight, |i| (flight.segment[i] % 2 == 1) == odd);
    let mut open = given.clone();
    (open.fit_segments, open.check_segments) = (Vec::new(), Vec::new());
    let [(a, known_a), (b, known_b)] = [false, true].map(|odd| from(vec![half(odd)], &open));
    let (both, known) = from(vec![half(false), half(true)], &open);
    for (k, (a, b)) in a.numbers.iter().zip(&b.numbers).enumerate().filter(|(_, (a, _))| a.tolerance.is_some()) {
        let [sa, sb] = [a, b].map(|n| n.tolerance.expect("stated")[1]);
        // Ten numbers: one beyond three standard deviations has a probability of 3 %.
        assert!(
            (a.value[1] - b.value[1]).abs() < 3.0 * sa.hypot(sb),
            "{}: {} ± {sa}, {} ± {sb}",
            both.numbers[k].name,
            a.value[1],
            b.value[1]
        );
    }
    let least = known_a.tolerance.cd0_relative.min(known_b.tolerance.cd0_relative);
    assert!(known.tolerance.cd0_relative < least, "{} {least}", known.tolerance.cd0_relative);
}

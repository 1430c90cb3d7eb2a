//! A sample of the fault campaign in this process: healthy vehicles on random missions, the lattice, random faults, and the only
//! depth sensor that drifts. The whole of it is `glider faults`; less than a minute on two cores.

use rayon::prelude::*;
use rig::campaign::lattice::{Case, SETS, Water, broken, cases, drawn, spread};
use rig::campaign::{self, Verdict};

fn fly(cases: &[Case]) -> Vec<Verdict> {
    cases.par_iter().map(|c| campaign::run(c).expect("flies")).collect()
}

fn told(verdicts: &[&Verdict]) -> String {
    verdicts.iter().take(5).map(|v| format!("{:#}\n", v.document())).collect()
}

#[test]
fn healthy_vehicles_fly_random_missions_and_broken_ones_come_home() {
    let healthy = fly(&drawn(7_000, 200));
    let early: Vec<_> = healthy.iter().filter(|v| v.wrong() || v.abort.is_some()).collect();
    assert!(early.is_empty(), "{} of {}: {}", early.len(), healthy.len(), told(&early));
    let faults: Vec<Case> = healthy.iter().flat_map(|v| broken(&v.case, v.duration_s).collect::<Vec<_>>()).collect();
    let flown = fly(&faults);
    assert_eq!(flown.len(), 200 * SETS as usize);
    assert!(flown.iter().filter(|v| v.at_depth()).count() > 600, "most are flown at depth");
    let lost: Vec<_> = flown.iter().filter(|v| v.wrong()).collect();
    assert!(lost.is_empty(), "{} of {}: {}", lost.len(), flown.len(), told(&lost));
    // Set apart are races that nobody wins, and few.
    assert!(flown.iter().filter(|v| v.apart()).count() * 50 < flown.len());
}

#[test]
fn a_sample_of_the_lattice_does_what_its_faults_are_owed() {
    let flown = fly(&spread(cases(), 1500));
    let wrong: Vec<_> = flown.iter().filter(|v| v.wrong()).collect();
    assert!(wrong.is_empty(), "{} of {}: {}", wrong.len(), flown.len(), told(&wrong));
}

#[test]
fn the_only_depth_sensor_may_be_wrong_in_any_way_and_the_hull_is_safe() {
    let alone: Vec<Case> = cases().into_iter().filter(|c| c.water == Water::Alone).collect();
    let flown = fly(&alone);
    let wrong: Vec<_> = flown.iter().filter(|v| v.wrong()).collect();
    assert!(wrong.is_empty() && alone.len() > 50, "{} of {}: {}", wrong.len(), flown.len(), told(&wrong));
}

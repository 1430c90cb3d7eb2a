//! Each fault has a row, and its bounds are as they were reckoned.

use super::*;
use crate::campaign::lattice::PHASES;
use control::Settings;
use plant::faults::catalogue;

fn owed(fault: &str, pump_needed_s: f64) -> Expect {
    let config = Config::new(Settings::slocum_100()).expect("valid");
    expect(&fault.parse().expect("a fault"), &config, &Ahead { pump_needed_s, mass_way_m: 0.0 }).expect("has a row")
}

#[test]
fn every_fault_has_a_row_in_every_phase_lasting_and_passing() {
    let config = Config::default();
    for (target, kind, ..) in catalogue() {
        let fault = Fault::new(target, kind).expect("in the catalogue");
        for fault in PHASES.iter().flat_map(|p| [fault.at(*p, 0.0), fault.at(*p, 45.0).lasting(90.0)]).chain([fault]) {
            let expect = expect(&fault, &config, &Ahead::NOTHING).unwrap_or_else(|| panic!("{fault}: no row"));
            // What may end a mission has a cause; what is owed has a time.
            assert_eq!(expect.causes().is_empty(), matches!(expect, Expect::Mission | Expect::Home(&[], _)), "{fault}: {expect:?}");
            assert!(expect.duties().iter().all(|d| d.within_s.is_finite()), "{fault}: {expect:?}");
        }
    }
}

#[test]
fn a_held_pump_is_due_from_when_it_is_needed_and_never_otherwise() {
    for fault in ["pump:stuck@climb", "pump:runaway=-1@dive", "ballast:stuck@climb"] {
        let bound = |needed_s| match owed(fault, needed_s) {
            Expect::Abort(_, bound) => bound,
            other => panic!("{fault}: {other:?}"),
        };
        assert_eq!((bound(0.0), bound(2316.0), bound(f64::INFINITY)), (88.0, 2404.0, f64::INFINITY), "{fault}");
    }
    // Over before the bound: no abort is owed, and none but for these causes is right.
    assert_eq!(owed("ballast:stuck@climb,80s", 0.0), Expect::Tolerated(&[Abort::BallastFeedback, Abort::PumpStuck], Vec::new()));
    // Its feedback silent: needed or not.
    assert_eq!(owed("ballast:off@climb", f64::INFINITY), Expect::Abort(&[Abort::BallastFeedback], 180.0));
}

#[test]
fn what_can_take_the_vehicle_down_is_bounded_by_what_it_does() {
    for fault in ["pump:slow@dive", "vehicle:trim@dive", "vehicle:dragged=3@dive,1200s", "vehicle:net@dive,1200s"] {
        let signs: Vec<Sign> = owed(fault, 0.0).duties().iter().map(|d| d.sign).collect();
        assert!(signs.contains(&Sign::TooDeep) && signs.contains(&Sign::SinksOn), "{fault}: {signs:?}");
    }
    for fault in ["depth:drift@dive", "depth2:flip@climb", "depth:stuck@surface", "depth:bias=3@comms"] {
        assert!(owed(fault, 0.0).duties().iter().any(|d| matches!(d.sign, Sign::DepthWrong(_))), "{fault}");
    }
}

#[test]
fn what_is_due_by_the_clock_is_within_two_minutes_but_slow_faults() {
    for (target, kind, ..) in catalogue() {
        let fault = Fault::new(target, kind).expect("in the catalogue").at(Phase::InflectLow, 0.0);
        let config = Config::default();
        let ahead = Ahead { pump_needed_s: 0.0, ..Ahead::NOTHING };
        let bound = match expect(&fault, &config, &ahead) {
            Some(Expect::Abort(_, bound) | Expect::Home(_, bound)) => bound,
            _ => continue,
        };
        // Vacuum through a seal and a drift are slow, a battery that does not follow moves no depth; by chance: some more.
        let slow = matches!((target, kind), (Target::Hull, Kind::VacuumLoss) | (_, Kind::Drift | Kind::Slow) | (Target::MassFeedback, _));
        let by_chance = matches!(kind, Kind::Intermittent | Kind::Garbage);
        // The wire burns for two minutes; a feedback that is off shows when the pump rests after its turn, and one that the turn carries
        // beyond its range is missing from there on.
        let limit_s = match (target, kind) {
            (Target::BallastFeedback, Kind::Bias) => 217.0,
            (Target::Release, Kind::Spurious) | (Target::BallastFeedback, _) => 180.0,
            _ => 120.0,
        };
        assert!(bound <= limit_s || slow || by_chance && bound <= 900.0, "{}:{} {bound} s", target.name(), kind.name());
    }
}

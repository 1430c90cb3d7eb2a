//! How a mission is judged.

use super::*;
use signals::Wings;

fn verdict(faults: &[&str]) -> Verdict {
    let faults = faults.iter().map(|f| f.parse().expect("a fault")).collect();
    run(&Case { water: Water::Shallow, wings: Wings::Standard, seed: 46, faults, line: None }).expect("flies")
}

#[test]
fn a_loss_with_an_upward_force_left_is_a_failure_others_are_set_apart() {
    // A litre of water a minute: a race that nobody wins, full buoyancy, weight and all.
    let race = verdict(&["hull:leak=1000@dive+120s"]);
    assert!(!race.home() && race.apart() && race.means.race == Some(false) && race.means.for_good_n > 0.0, "{race:?}");
    // The same loss with that race winnable is a failure.
    let won = Verdict { means: Means { race: Some(true), ..race.means }, ..race.clone() };
    assert!(!won.home() && !won.apart(), "{won:?}");
    let s = Summary::of(std::slice::from_ref(&won), &[]);
    assert_eq!((s.missions, s.safe, s.apart, s.passed()), (1, 0, 0, false));
    let none = verdict(&["pump:runaway=-1@inflect_high", "release:stuck@surface+20s"]);
    assert!(!none.home() && none.apart() && none.unmet.is_none(), "{none:?}");
    let s = Summary::of(std::slice::from_ref(&none), &[]);
    assert_eq!((s.missions, s.apart, s.apart_home, s.unmet), (0, 1, 0, 0));
}

#[test]
fn a_load_that_lets_go_in_time_is_survived_without_the_weight() {
    let held = verdict(&["release:stuck@climb", "vehicle:dragged=3@inflect_high+20s,1200s"]);
    assert!(held.means.while_all_act_n < 0.0 && !held.apart() && held.safe(), "{held:?}");
    // 125 m is where the hull fails.
    assert!(held.max_depth_m < 100.0, "{}", held.max_depth_m);
}

#[test]
fn an_abort_counts_only_with_its_cause_in_its_time_and_after_its_sign() {
    let config = Config::default();
    let unmet = |fault: &str, abort: Option<(Abort, f64)>, missed: Option<&'static str>, duration_s: f64| {
        let faults: Vec<plant::Fault> = vec![fault.parse().expect("a fault")];
        let case = Case { water: Water::Edge, wings: Wings::Standard, seed: 0, faults, line: None };
        let owed = expect::expect(&case.faults[0], &config, &Ahead::NOTHING);
        let means = Means::of(&case, None).expect("a world");
        let mut judge = Judge::of(&case, &config, means, owed);
        (judge.onsets, judge.abort, judge.missed) = (vec![Some(100.0)], abort, missed);
        judge.unmet(true, duration_s)
    };
    let late = |s: f64| Some((Abort::SensorPitch, s));
    assert_eq!(unmet("pitch:off@dive", late(64.0), None, 5e3), None);
    assert_eq!(unmet("pitch:off@dive", late(68.0), None, 5e3), Some("abort too late"));
    assert_eq!(unmet("pitch:off@dive", Some((Abort::Stalled, 8.0)), None, 5e3), Some("abort with another cause"));
    assert_eq!(unmet("pitch:off@dive", None, None, 5e3), Some("no abort"));
    assert_eq!(unmet("pitch:off@dive", None, None, 150.0), None, "over before the bound");
    // Over after 40 s: not owed, but no other cause, and not for ever.
    assert_eq!(unmet("pitch:off@dive,40s", None, None, 5e3), None);
    assert_eq!(unmet("pitch:off@dive,40s", Some((Abort::Stalled, 8.0)), None, 5e3), Some("abort with another cause"));
    assert_eq!(unmet("pitch:off@dive,40s", late(2e3), None, 5e3), Some("abort long after the fault"));
    assert_eq!(unmet("roll:off@dive", late(8.0), None, 5e3), Some("abort for a harmless fault"));
    assert_eq!(unmet("depth:off@dive", Some((Abort::SensorDepth, 8.0)), None, 5e3), Some("abort with another cause"));
    assert_eq!(unmet("pump:slow@dive", None, Some("too deep"), 5e3), Some("too deep"));
    assert_eq!(unmet("voltage:spike@dive", Some((Abort::Undervoltage, 8.0)), None, 5e3), Some("abort without its sign"));
}

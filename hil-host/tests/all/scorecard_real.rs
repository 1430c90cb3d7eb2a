//! Real flights with a known injected error, the bounded subset; `glider scorecard real` asks all. Needs `GLIDER_FLIGHTS`.

use hil_host::score::real::ask::Program;
use hil_host::score::real::flights::Data;
use hil_host::score::real::{below, document, line, missions, ready, replayed, run};
use std::path::PathBuf;

const INJECTED_ERRORS: [&str; 4] = ["nothing", "compressibility x0.3", "cd0 /1.5", "clock +5 s"];

#[test]
fn scorecard_real_injected_errors_of_the_subset_are_above_their_floors() {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) else {
        eprintln!("skipped: no flights (set GLIDER_FLIGHTS)");
        return;
    };
    let data = Data::built_in().expect("the list");
    let flights = ready(&root, &data, &|e| e.quick, &|why| eprintln!("left out: {why}")).expect("calibrated");
    assert!(!flights.is_empty(), "{}: no flight of the bounded subset", root.display());
    let folder = std::env::temp_dir().join(format!("glider-real-test-{}", std::process::id()));
    let binary = PathBuf::from(env!("CARGO_BIN_EXE_glider"));
    let scored = run(&flights, &|l| INJECTED_ERRORS.contains(&l.name), &data, Program { file: &binary, with: &[] }, &folder, 2, &|s| {
        eprintln!("{s:?}")
    });
    std::fs::remove_dir_all(&folder).ok();
    let card = document(&flights, &scored.expect("asked"), &[], &data);
    eprintln!("{}", line(&card));
    assert_eq!(card["all"]["failures"], 0, "{card:#}");
    assert_eq!(card["all"]["contradictions"], serde_json::json!([]));
    // A file calibrated on 22,000 s of another day is narrower than that of a vehicle nobody knows, and not narrower than its scatter.
    for f in &flights {
        let t = |v: &serde_json::Value| v["tolerance_1sigma"]["cd0_relative"].as_f64().expect("stated");
        assert!(t(&f.quiet) < 0.5 * t(&f.shipped) && t(&f.quiet) > 0.001, "{} of {}", t(&f.quiet), t(&f.shipped));
    }
    let low = below(&card["all"], &data.floors["quick"]);
    assert!(low.is_empty(), "{low:?}");
}

/// Vehicles judged by their own earlier dives: untouched ones quiet, large errors named, whatever the make.
#[test]
fn scorecard_real_missions_are_judged_by_their_own_history() {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) else {
        eprintln!("skipped: no flights (set GLIDER_FLIGHTS)");
        return;
    };
    let all = missions::missions(&root, &|why| eprintln!("left out: {why}")).expect("a folder");
    for (controls, in_class) in
        [(12, &[("slocum_modena2015_month", 0.9), ("seaexplorer_sea035_m010", 0.5)][..]), (6, &[("seaglider_sg171_dives", 0.55)][..])]
    {
        let scored: Vec<_> = all.iter().filter_map(|m| missions::score(m, controls)).collect();
        for (name, least) in in_class {
            let Some(one) = scored.iter().find(|s| s.name == *name) else { continue };
            let share = one.sizes[0].in_class.ratio();
            assert!(share >= *least, "{name}: {share:.2} of large errors in class with {controls} controls, at least {least}");
        }
        let sum = missions::together(&scored);
        let low = missions::below(&sum);
        assert!(low.is_empty() && sum.quiet.all > 4, "{low:?}");
    }
}

/// Dives replayed through the code that flies: what packets of 109 bytes say is what the full logs say.
#[test]
fn scorecard_packets_of_a_real_month_say_what_its_logs_say() {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) else {
        eprintln!("skipped: no flights (set GLIDER_FLIGHTS)");
        return;
    };
    let all = missions::missions(&root, &|why| eprintln!("left out: {why}")).expect("a folder");
    let month = all.iter().find(|m| m.name == "slocum_modena2015_month").expect("the month");
    let [untouched, errors] = replayed::agreement(month, 12);
    eprintln!("{untouched:#?} {errors:#?}");
    let (right, all) = (untouched.packet.right + errors.packet.right, untouched.packet.all + errors.packet.all);
    assert!(right as f64 >= 0.98 * all as f64, "{right} of {all} verdicts are those of the logs");
    // What is lost is not lost to the twelve bits.
    assert_eq!((errors.exact.right, untouched.exact.right), (errors.packet.right, untouched.packet.right));
    // The same month from packets alone, and with a drag event in its last quarter.
    let event = month.units() * 3 / 4;
    let healthy = replayed::from_packets_alone(month, usize::MAX);
    let alarms = healthy.iter().flatten().filter(|names| !names.is_empty()).count();
    let fouled = replayed::from_packets_alone(month, event);
    let first = fouled.iter().skip(event).position(|names| names.as_ref().is_some_and(|n| n.contains(&"drag_level".to_owned())));
    eprintln!("from packets alone: {alarms} alarms of {} surfacings; the drag event in surfacing {first:?} after it", healthy.len());
    assert_eq!(alarms, 0, "{healthy:?}");
    assert!(first.is_some_and(|k| k < 2), "{fouled:?}");
}

/// The detector that flies, with a history of the mission's first dives: quiet ones raise no alarm, half as much drag again does in the
/// first or second surfacing.
#[test]
fn scorecard_detector_on_board_alarms_at_a_drag_event() {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) else {
        eprintln!("skipped: no flights (set GLIDER_FLIGHTS)");
        return;
    };
    let all = missions::missions(&root, &|why| eprintln!("left out: {why}")).expect("a folder");
    let month = all.iter().find(|m| m.name == "slocum_modena2015_month").expect("the month");
    for controls in [6, 12, 24] {
        let said = replayed::detected(month, controls).expect("a history");
        eprintln!("{controls} dives of history: {said:?}");
        // At most one in 300.
        assert!(300 * said.quiet.right <= said.quiet.all && said.quiet.all > 15, "{said:?}");
        assert_eq!(said.in_two.right, said.in_two.all, "{said:?}");
    }
}

//! `glider faults --seat parts` and `--bus`: the board on its own parts.

use super::super::shards::file_report;
use super::super::{Output, Verdict};
use super::{Args, bar};
use indicatif::ParallelProgressIterator;
use rayon::prelude::*;
use rig::campaign::lattice::{cases, spread};
use rig::campaign::own_parts::{self, Both};
use rig::flight::closed_loop::End;
use serde_json::json;
use std::time::Instant;

/// Missions of the lattice without `--sample`.
const SAMPLE_MISSIONS: usize = 500;

/// Flies a sample of the lattice on own parts and on frames.
///
/// # Errors
/// A world that cannot be, a board that fell silent, a file that cannot be written.
pub fn missions(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let started = Instant::now();
    let mut chosen = cases();
    chosen.retain(|c| c.line.is_none() && c.faults.iter().all(own_parts::can_have));
    if let Some(text) = &args.only {
        chosen.retain(|c| c.name().contains(text.as_str()));
        anyhow::ensure!(!chosen.is_empty(), "--only {text}: no case that this board can have has this in its name");
    }
    let mut chosen = spread(chosen, args.sample.unwrap_or(SAMPLE_MISSIONS));
    for case in &mut chosen {
        case.seed = case.seed.wrapping_add(args.seed.wrapping_mul(rig::campaign::lattice::SEEDS));
    }
    let bar = bar(chosen.len() as u64, "missions, both ways");
    let flown = chosen.par_iter().progress_with(bar.clone()).map(own_parts::run).collect::<anyhow::Result<Vec<Both>>>()?;
    bar.finish_and_clear();
    let other: Vec<&Both> = flown.iter().filter(|b| !b.alike()).collect();
    let lost = flown.iter().filter(|b| b.frames.iter().all(|e| e.home()) && !b.own.iter().all(|e| e.home())).count();
    let cause = |b: &&Both| b.alike() && !b.own.iter().any(|own| b.frames.contains(own));
    let causes = flown.iter().filter(cause).count();
    let words = |ends: &[End]| ends.iter().map(ToString::to_string).collect::<Vec<_>>();
    let report = |b: &Both| {
        json!({ "case": b.case.name(), "water": format!("{:?}", b.case.water), "wings": format!("{:?}", b.case.wings), "seed": b.case.seed,
            "on_frames": words(&b.frames), "on_own_parts": words(&b.own), "max_depth_m": b.max_depth_m.round(), "hangs": b.hangs })
    };
    let document = json!({ "missions": flown.len(), "ended_otherwise": other.iter().map(|b| report(b)).collect::<Vec<_>>(), "lost_on_own_parts_only": lost,
        "same_end_other_cause": causes, "wall_s": started.elapsed().as_secs_f64().round(),
        "other_causes": flown.iter().filter(cause).map(report).collect::<Vec<_>>() });
    file_report(args.out.as_deref(), format!("{document:#}\n").as_bytes())?;
    output.emit(&document, || {
        println!(
            "{} fault missions on own parts and on frames: {} end otherwise, {lost} lost on own parts only, {causes} with another first cause; {:.0} s",
            flown.len(),
            other.len(),
            started.elapsed().as_secs_f64()
        );
        for b in other.iter().take(if args.list { other.len() } else { 20 }) {
            let (own, frames) = (words(&b.own).join(", "), words(&b.frames).join(", "));
            println!("  {:?} {:?} seed {} {}: on own parts {own}; on frames {frames}", b.case.water, b.case.wings, b.case.seed, b.case.name());
        }
    });
    Ok(if other.is_empty() { Verdict::Ok } else { Verdict::Negative })
}

/// Disturbs the buses.
///
/// # Errors
/// As above.
pub fn bus(n: u64, args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let started = Instant::now();
    let bar = bar(n, "bus faults");
    let tally = own_parts::bus_faults(n, args.seed, &|made| bar.inc(made))?;
    bar.finish_and_clear();
    let document = json!({ "faults": tally.faults, "cycles": tally.cycles, "missions": tally.missions, "home": tally.home, "readings": tally.readings,
        "missing": tally.missing, "false_readings": tally.false_readings.len(), "hangs": tally.hangs, "bridge_shorted": tally.shorted,
        "wall_s": started.elapsed().as_secs_f64().round(),
        "examples": tally.false_readings.iter().take(50).map(|(what, read, truth)| json!({ "what": what, "read": read, "true": truth })).collect::<Vec<_>>() });
    file_report(args.out.as_deref(), format!("{document:#}\n").as_bytes())?;
    output.emit(&document, || {
        println!(
            "{} bus faults in {} cycles of {} missions, {} of them home: {} hangs, {} of {} readings missing, {} false; {:.0} s",
            tally.faults,
            tally.cycles,
            tally.missions,
            tally.home,
            tally.hangs,
            tally.missing,
            tally.readings,
            tally.false_readings.len(),
            started.elapsed().as_secs_f64()
        );
        for (what, read, truth) in tally.false_readings.iter().take(if args.list { usize::MAX } else { 20 }) {
            println!("  {what}: {read} read, {truth} true");
        }
    });
    Ok(if tally.passed() { Verdict::Ok } else { Verdict::Negative })
}

//! `glider faults`.

use super::{Output, Verdict};
use crate::campaign::lattice::{Case, SETS, broken, cases, drawn, spread, twins};
use crate::campaign::{self, Summary, through_seat};
use crate::fleet::part::Shard;
use crate::seats::Choice;
use crate::terminal::table;
use anyhow::{Context, bail};
use control::mutant::Mutant;
use indicatif::{ParallelProgressIterator, ProgressBar, ProgressIterator, ProgressStyle};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

/// Share of the broken laws that the campaign has to notice.
const LEAST_SCORE: f64 = 0.95;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:\n  glider faults\n  glider faults --sample 500 --seed 3\n  glider faults --only depth:stuck --list\n  \
glider faults --seat qemu --sample 200\n  glider faults --html out/faults.html --out out/faults.json\n  glider faults --healthy 20000\n  glider faults --mutation\n  glider faults --part 2/8 --out part2.json\n  glider faults --seat parts --sample 500\n  glider faults --bus 100000\n\nWith --seat the sample is flown through that seat and in this process; verdicts and actuator streams must be equal. With --seat parts\n\
each ends on the board's own parts as on frames; --bus disturbs its buses: no hang, no reading of what is not there.\n\
A mission that nobody could bring home (pump and weight less the load at rest, or the best moves five minutes after the fault) is set\n\
apart under no_means_left and owes an abort, full buoyancy and the weight; every other one has to come home.\n\
Every fault alone is owed an abort within a bound, a way home, an undisturbed mission, or, where its effect decides, an abort for the right\n\
cause at most, in time after a sign of it: the report and by_fault in the JSON list all of them, with the worst latency seen.\n\
Exit code 1 if any mission was unsafe, any healthy twin aborted, or any fault's own expectation was not met.")]
pub struct Args {
    /// in-process, or a seat (pty, qemu, parts, PORT) through which a sample is flown and compared.
    #[arg(long, default_value = "in-process")]
    pub(super) seat: String,
    /// Fly this many missions of the lattice, spread over it; default: all (200 through a seat).
    #[arg(long, value_name = "N")]
    pub(super) sample: Option<usize>,
    /// Of the missions flown so many are random ones with random faults; default: 45,000, of a sample a third, through a seat none.
    #[arg(long, value_name = "N")]
    random: Option<u64>,
    /// Changes all noise of the campaign, and which missions are drawn.
    #[arg(long, default_value_t = 0)]
    pub(super) seed: u64,
    /// Fly only this part of the missions, as 2/8: to share a campaign among machines or nights.
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    part: Shard,
    /// Only cases whose name contains this; with --mutation only broken laws.
    #[arg(long, value_name = "TEXT")]
    pub(super) only: Option<String>,
    /// Fly this many random missions with healthy vehicles instead; each has to be flown to its end.
    #[arg(long, value_name = "N", conflicts_with_all = ["only", "sample"])]
    healthy: Option<u64>,
    /// Break the law instead, one watch at a time, and count how often the campaign notices; --sample: missions for each besides those
    /// with the faults that the watch is there for [default: 1000].
    #[arg(long, conflicts_with_all = ["healthy"])]
    mutation: bool,
    /// Disturb the buses of a board on its own parts instead, so many times.
    #[arg(long, value_name = "N", conflicts_with_all = ["only", "healthy", "mutation", "sample"])]
    bus: Option<u64>,
    /// Print every case that is not as it should be.
    #[arg(long)]
    pub(super) list: bool,
    /// Write the whole list as JSON.
    #[arg(long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,
    /// Write the report here.
    #[arg(long, value_name = "FILE", default_value = "out/faults.html")]
    html: PathBuf,
    /// Image for the QEMU seat.
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if let Some(path) = &args.out {
        crate::whole_file::may_write(path, &[], &["json"], output.force)?;
    }
    if let Some(n) = args.healthy {
        return healthy(n, args, output);
    }
    if args.mutation {
        return mutation(args, output);
    }
    if let Some(n) = args.bus {
        return super::faults_own_parts::bus(n, args, output);
    }
    let choice: Choice = args.seat.parse().unwrap_or(Choice::InProcess);
    if choice == Choice::Parts {
        return super::faults_own_parts::missions(args, output);
    }
    let in_seat = choice != Choice::InProcess;
    let (mut chosen, random) = chosen(args, &choice)?;
    let started = Instant::now();
    let twins = twins(&chosen);
    let missions = args.part.range(args.seed.wrapping_mul(1 << 32), random.div_ceil(SETS));
    let drawn = drawn(missions.start, missions.end - missions.start);
    let bar = bar((chosen.len() + twins.len() + drawn.len() * (1 + SETS as usize)) as u64, "missions");
    let fly_all = |cases: &[Case]| cases.par_iter().progress_with(bar.clone()).map(campaign::run).collect::<anyhow::Result<Vec<_>>>();
    let mut healthy = fly_all(&twins)?;
    let mut faulty = fly_all(&chosen)?;
    let calm = fly_all(&drawn)?;
    chosen = calm.iter().flat_map(|v| broken(&v.case, v.duration_s).collect::<Vec<_>>()).collect();
    faulty.extend(fly_all(&chosen)?);
    healthy.extend(calm);
    bar.finish_and_clear();
    let seat = if in_seat { Some(compare(args, &choice, &faulty)?) } else { None };
    let summary = Summary::of(&faulty, &healthy);
    let wall_s = started.elapsed().as_secs_f64();
    let bad: Vec<&campaign::Verdict> = faulty.iter().chain(&healthy).filter(|v| v.wrong()).collect();
    let apart: Vec<Value> = faulty.iter().filter(|v| v.apart()).map(campaign::Verdict::document).collect();
    let mut document = json!({
        "summary": { "missions": summary.missions, "safe": summary.safe, "below_crush": summary.below_crush, "false_aborts": summary.false_aborts,
            "wall_s": (wall_s * 100.0).round() / 100.0, "twins": summary.twins, "expectation_not_met": summary.unmet, "beyond_any_controller": summary.apart, "of_these_home": summary.apart_home,
            "deeper_than_100_m": summary.at_depth, "pairs_at_depth": summary.pairs_at_depth, "bad_line_changed_commands": summary.line_changed, "seed": args.seed, "seat": choice.to_string() },
        "not_as_expected": bad.iter().map(|v| v.document()).collect::<Vec<_>>(),
        "no_means_left": apart,
        "by_fault": campaign::tally::rows(&faulty).iter().map(campaign::tally::Row::document).collect::<Vec<_>>(),
    });
    if let (Some(map), Some(seat)) = (document.as_object_mut(), &seat) {
        map.insert("through_seat".to_owned(), seat.clone());
    }
    if let Some(path) = &args.out {
        let mut whole = document.clone();
        whole["cases"] = faulty.iter().chain(&healthy).map(campaign::Verdict::document).collect();
        crate::whole_file::write(path, format!("{whole:#}\n")).with_context(|| format!("{}: cannot write", path.display()))?;
    }
    let through = seat.as_ref().map(|s| {
        let different = s["different"].as_array().map_or(0, Vec::len);
        format!(
            "{} of them through {} too, {different} with another verdict or actuator stream",
            s["missions"],
            s["seat"].as_str().unwrap_or_default()
        )
    });
    campaign::report::page(&summary, &faulty, &healthy, wall_s, through.as_deref()).write(&args.html)?;
    document["report"] = json!(args.html);
    output.emit(&document, || print(&summary, &faulty, &bad, wall_s, seat.as_ref(), args));
    let seat_equal = seat.is_none_or(|s| s["different"].as_array().is_some_and(Vec::is_empty));
    Ok(if summary.passed() && seat_equal { Verdict::Ok } else { Verdict::Negative })
}

/// The missions of the lattice that are flown, and how many random ones.
fn chosen(args: &Args, choice: &Choice) -> anyhow::Result<(Vec<Case>, u64)> {
    let in_seat = *choice != Choice::InProcess;
    let mut chosen = cases();
    for case in &mut chosen {
        case.seed = case.seed.wrapping_add(args.seed.wrapping_mul(campaign::lattice::SEEDS));
    }
    if let Some(text) = &args.only {
        chosen.retain(|c| c.name().contains(text.as_str()));
        if chosen.is_empty() {
            bail!("--only {text}: no case has this in its name; names are as in glider fly --fault");
        }
    }
    let wanted = args.sample.or(in_seat.then_some(200)).unwrap_or(chosen.len());
    let random = if in_seat || args.only.is_some() { 0 } else { args.random.unwrap_or(args.sample.map_or(45_000, |n| n as u64 / 3)) };
    chosen = if in_seat {
        through_seat::sample(chosen, choice, wanted)
    } else {
        spread(chosen, wanted.saturating_sub(if args.sample.is_some() { random as usize } else { 0 }))
    };
    let part = args.part.range(0, chosen.len() as u64);
    chosen = chosen.into_iter().skip(part.start as usize).take((part.end - part.start) as usize).collect();
    Ok((chosen, random))
}

/// Flies random missions with healthy vehicles.
fn healthy(n: u64, args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let started = Instant::now();
    let missions = args.part.range(args.seed.wrapping_mul(1 << 32), n);
    let n = missions.end - missions.start;
    let bar = bar(n, "healthy missions");
    let flights = missions.into_par_iter().progress_with(bar.clone()).map(campaign::healthy::run).collect::<anyhow::Result<Vec<_>>>()?;
    bar.finish_and_clear();
    let failed: Vec<_> = flights.iter().filter(|f| !f.done()).collect();
    let mut ends: BTreeMap<String, u64> = BTreeMap::new();
    flights.iter().for_each(|f| *ends.entry(if f.done() { "done".into() } else { format!("NOT FLOWN: {}", f.end) }).or_default() += 1);
    let document = json!({ "missions": n, "not_flown_to_the_end": failed.len(), "ends": ends, "wall_s": started.elapsed().as_secs_f64().round(),
        "failed": failed.iter().map(|f| f.document()).collect::<Vec<_>>() });
    if let Some(path) = &args.out {
        crate::whole_file::write(path, format!("{document:#}\n")).with_context(|| format!("{}: cannot write", path.display()))?;
    }
    output.emit(&document, || {
        println!(
            "{n} random missions with healthy vehicles, {} not flown to their end; {:.0} s",
            failed.len(),
            started.elapsed().as_secs_f64()
        );
        ends.iter().for_each(|(end, n)| println!("  {n:6} {end}"));
        for f in failed.iter().take(if args.list { failed.len() } else { 10 }) {
            println!(
                "  mission {}: {}, {} of {} dives, {:?} {:?}",
                f.seed,
                f.end,
                f.dives,
                f.draw.mission.dives(),
                f.draw.class,
                f.draw.fitted
            );
        }
    });
    Ok(if failed.is_empty() { Verdict::Ok } else { Verdict::Negative })
}

/// Breaks one watch after the other.
fn mutation(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let started = Instant::now();
    let wanted = args.sample.unwrap_or(1000);
    let only = args.only.as_deref().unwrap_or_default();
    let mutants: Vec<Mutant> = Mutant::all().filter(|m| format!("{m:?}").contains(only)).collect();
    if mutants.is_empty() {
        bail!("--only {only}: no broken law has this in its name; names are as Blind(OverDepth), Slow(PitchLost)");
    }
    let bar = bar(mutants.len() as u64, "broken laws");
    let trials =
        mutants.iter().progress_with(bar.clone()).map(|m| campaign::mutation::trial(*m, wanted)).collect::<anyhow::Result<Vec<_>>>()?;
    bar.finish_and_clear();
    let caught = trials.iter().filter(|t| t.caught_by.is_some()).count();
    let score = caught as f64 / trials.len() as f64;
    let document = json!({ "broken_laws": trials.len(), "caught": caught, "score": (score * 1e3).round() / 1e3, "missions_of_the_rest": wanted,
        "wall_s": started.elapsed().as_secs_f64().round(), "trials": trials.iter().map(campaign::mutation::Trial::document).collect::<Vec<_>>() });
    if let Some(path) = &args.out {
        crate::whole_file::write(path, format!("{document:#}\n")).with_context(|| format!("{}: cannot write", path.display()))?;
    }
    output.emit(&document, || {
        for t in &trials {
            match &t.caught_by {
                Some((case, why)) => println!("{:?}: caught after {} missions by {case}: {why}", t.mutant, t.flown),
                None => println!("{:?}: NOT CAUGHT in {} missions", t.mutant, t.flown),
            }
        }
        println!("{caught} of {} broken laws caught: score {score:.3}; {:.0} s", trials.len(), started.elapsed().as_secs_f64());
    });
    Ok(if score >= LEAST_SCORE { Verdict::Ok } else { Verdict::Negative })
}

/// Progress on standard error.
pub(super) fn bar(n: u64, what: &str) -> ProgressBar {
    let template = format!("{{bar:30}} {{pos}}/{{len}} {what} {{elapsed}}, {{eta}} left");
    ProgressBar::new(n).with_style(ProgressStyle::with_template(&template).unwrap_or(ProgressStyle::default_bar()))
}

/// Flies the cases through another seat and compares with what they did in this process.
fn compare(args: &Args, choice: &Choice, here: &[campaign::Verdict]) -> anyhow::Result<Value> {
    let started = Instant::now();
    let bar = ProgressBar::new(here.len() as u64).with_style(
        ProgressStyle::with_template("{bar:30} {pos}/{len} through the seat {elapsed}, {eta} left").unwrap_or(ProgressStyle::default_bar()),
    );
    let lanes = std::thread::available_parallelism().map_or(1, usize::from);
    let different = through_seat::compare(here, choice, args.elf.as_deref(), lanes, &|| bar.inc(1))?;
    bar.finish_and_clear();
    let different: Vec<Value> =
        different.iter().map(|(here, there)| json!({ "here": here.document(), "there": there.document() })).collect();
    Ok(json!({ "seat": choice.to_string(), "missions": here.len(), "different": different, "wall_s": started.elapsed().as_secs_f64() }))
}

fn print(s: &Summary, faulty: &[campaign::Verdict], bad: &[&campaign::Verdict], wall_s: f64, seat: Option<&Value>, args: &Args) {
    let mut targets: BTreeMap<&str, [u64; 4]> = BTreeMap::new();
    let mut latencies: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for v in faulty.iter().filter(|v| !v.apart()) {
        let name = match (v.case.faults.as_slice(), v.case.line) {
            ([one], _) => one.target.name(),
            (_, Some(_)) => "line",
            _ => "pairs",
        };
        let row = targets.entry(name).or_default();
        row[0] += 1;
        row[1] += u64::from(v.safe());
        row[2] += u64::from(v.abort.is_some());
        row[3] += u64::from(v.unmet.is_some());
        if let (Some((_, after)), true) = (v.abort, v.case.faults.len() == 1) {
            latencies.entry(name).or_default().push(after);
        }
    }
    let mut t = table(["fault in", "missions", "safe", "aborted", "not as expected", "median latency, s"]);
    for (name, [missions, safe, aborted, unmet]) in targets {
        let median = latencies.get_mut(name).map(|l| {
            l.sort_by(f64::total_cmp);
            l.get(l.len() / 2).copied().unwrap_or(f64::NAN)
        });
        t.add_row([
            name.to_owned(),
            missions.to_string(),
            safe.to_string(),
            aborted.to_string(),
            unmet.to_string(),
            median.map_or(String::new(), |m| format!("{m:.0}")),
        ]);
    }
    println!("{t}");
    println!("{} of them deeper than 100 m, {} with two faults at once there", s.at_depth, s.pairs_at_depth);
    println!("{} fault missions: {} safe, {} below crush depth, {} not as expected", s.missions, s.safe, s.below_crush, s.unmet);
    println!(
        "{} healthy twins: {} false aborts; {} more missions that nobody could bring home by their budgets, {} of them home all the same",
        s.twins, s.false_aborts, s.apart, s.apart_home
    );
    println!("bad line: {} missions with other commands than their twin; {wall_s:.0} s", s.line_changed);
    if let Some(seat) = seat {
        let different = seat["different"].as_array().map_or(0, Vec::len);
        println!(
            "{}: {} missions, {different} with another verdict or actuator stream",
            seat["seat"].as_str().unwrap_or(""),
            seat["missions"]
        );
    }
    let shown = if args.list { bad.len() } else { 20 };
    for v in bad.iter().take(shown) {
        let why = v.broken.iter().copied().chain(v.unmet).collect::<Vec<_>>().join(", ");
        let abort = v.abort.map_or_else(|| "no abort".to_owned(), |(cause, after)| format!("{cause:?} after {after:.0} s"));
        println!(
            "  {:?} {:?} seed {} {}: {why} ({abort}, {}, {:.0} m)",
            v.case.water,
            v.case.wings,
            v.case.seed,
            v.case.name(),
            v.end,
            v.max_depth_m
        );
    }
    if bad.len() > shown {
        println!("  … {} more: --list", bad.len() - shown);
    }
    println!("report: {}", args.html.display());
}

//! `glider faults`.

pub mod own_parts;
mod report;

use super::shards::{MergeArgs, Session, ShardArgs, To, file_report, parts, said_of_shard};
use super::{Output, Verdict};
use anyhow::{Context, bail, ensure};
use control::mutant::Mutant;
use indicatif::{ProgressBar, ProgressIterator, ProgressStyle};
use report::report;
use rig::campaign::blocks::{Block, plan, ranges, verdicts};
use rig::campaign::lattice::{Case, SEEDS, cases, spread};
use rig::campaign::sorts::{healing, hidden_leak};
use rig::campaign::{self, healthy::Flight, through_seat};
use rig::seats::Choice;
use rig::shards::kept::key;
use rig::shards::part;
use rig::shards::work::Done;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Share of the broken laws that the campaign has to notice.
const LEAST_SCORE: f64 = 0.95;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider faults\n  glider faults --resume                                  (goes on after Ctrl-C or a break)\n  glider faults --sample 500 --seed 3\n  glider faults --only depth:stuck --list\n  \
glider faults --seat qemu --sample 200\n  glider faults --html out/faults.html --out out/faults.json\n  glider faults --healthy 20000\n  glider faults --leaks 600\n  glider faults --healing 2000\n  glider faults --mutation\n  glider faults --shard 2/8 --out part2.json              (the second of eight machines)\n  glider faults merge part*.json --out out/faults.json\n  glider faults --seat parts --sample 500\n  glider faults --bus 100000\n\nWith --seat the sample is flown through that seat and in this process; verdicts and actuator streams must be equal. With --seat parts\n\
each ends on the board's own parts as on frames; --bus disturbs its buses: no hang, no reading of what is not there.\n\
A mission that nobody could bring home (pump and weight less the load at rest, or the best moves five minutes after the fault) is set\n\
apart under no_means_left and owes an abort, full buoyancy and the weight; every other one has to come home.\n\
Every fault alone is owed an abort within a bound, a way home, an undisturbed mission, or, where its effect decides, an abort for the right\n\
cause at most, in time after a sign of it: the report and by_fault in the JSON list all of them, with the worst latency seen.\n\
Exit code 1 if any mission was unsafe, any healthy twin aborted, or any fault's own expectation was not met; of a shard,\nif one of its own missions was not as it should be."
)]
pub struct Args {
    #[command(subcommand)]
    then: Option<Then>,
    /// in-process, or a seat (pty, qemu, parts, PORT) through which a sample is flown and compared.
    #[arg(long, default_value = "in-process")]
    pub(super) seat: String,
    /// Fly this many missions of the lattice, spread over it; default: all (200 through a seat).
    #[arg(long, value_name = "N", value_parser = super::count)]
    pub(super) sample: Option<usize>,
    /// Of the missions flown so many are random ones with random faults; default: 45,000, of a sample a third, through a seat none.
    #[arg(long, value_name = "N")]
    random: Option<u64>,
    /// Changes all noise of the campaign, and which missions are drawn.
    #[arg(long, default_value_t = 0)]
    pub(super) seed: u64,
    #[command(flatten)]
    shards: ShardArgs,
    /// Missions that are flown at a time; default: as many as there are cores.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    jobs: usize,
    /// Only cases whose name contains this; with --mutation only broken laws.
    #[arg(long, value_name = "TEXT")]
    pub(super) only: Option<String>,
    /// Fly this many random missions with healthy vehicles instead; each has to be flown to its end.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), conflicts_with_all = ["only", "sample"])]
    healthy: Option<u64>,
    /// Fly this many slow leaks behind a dead detector instead, in shallow, edge and random water.
    #[arg(long, value_name = "N", conflicts_with_all = ["only", "sample", "healthy"])]
    leaks: Option<u64>,
    /// Fly this many random missions with one fault that heals within two minutes instead.
    #[arg(long, value_name = "N", conflicts_with_all = ["only", "sample", "healthy", "leaks"])]
    healing: Option<u64>,
    /// Break the law instead, one watch at a time, and count how often the campaign notices; --sample: missions for each besides those
    /// with the faults that the watch is there for [default: 1000].
    #[arg(long, conflicts_with_all = ["healthy"])]
    mutation: bool,
    /// Disturb the buses of a board on its own parts instead, so many times.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), conflicts_with_all = ["only", "healthy", "mutation", "sample"])]
    bus: Option<u64>,
    /// Print every case that is not as it should be.
    #[arg(long)]
    pub(super) list: bool,
    /// Write the whole list as JSON, without the times that it took, so that its SHA-256 is that of any other such run; of a shard its results.
    #[arg(long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,
    /// Write the report here.
    #[arg(long, value_name = "FILE", default_value = "out/faults.html")]
    html: PathBuf,
    /// Image for the QEMU seat.
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
}

#[derive(clap::Subcommand, Debug)]
enum Then {
    /// Put the parts of shards together: one report, as if one machine had flown all missions.
    #[command(
        after_help = "Examples:\n  glider faults merge part*.json --out out/faults.json\n  glider faults merge part1.json part2.json --json\nExit code as without shards; 2: bad input, as a shard that is missing."
    )]
    Merge(FaultsMergeArgs),
}

/// Arguments of `faults merge`.
#[derive(clap::Args, Debug)]
struct FaultsMergeArgs {
    #[command(flatten)]
    merge: MergeArgs,
    /// Where the page goes; default: as without shards.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
}

/// What a campaign's missions depend on.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Plan {
    seed: u64,
    sample: Option<usize>,
    random: Option<u64>,
    only: Option<String>,
    healthy: Option<u64>,
    leaks: Option<u64>,
    healing: Option<u64>,
    seat: String,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if let Some(Then::Merge(FaultsMergeArgs { merge, html })) = &args.then {
        let alone = args.out.is_none() && args.shards.shard.is_none() && args.sample.is_none() && args.only.is_none();
        ensure!(alone, "what merge is to do stands after it: glider faults merge PART… --out FILE");
        let merged = parts(merge, &["faults"], output)?;
        let plan: Plan = serde_json::from_value(merged.plan.clone()).context("these parts are of another version of glider")?;
        let to = To { out: merge.out.as_deref(), list: merge.list };
        let html = html.as_ref().unwrap_or(&args.html);
        return fly(&plan, &Session::merging("faults", merged), (&to, html), args, output);
    }
    let choice: Choice = args.seat.parse().unwrap_or(Choice::InProcess);
    let in_shards = args.shards.shard.is_some() || args.shards.resume || args.shards.cache.is_some();
    let other = args.mutation || args.bus.is_some() || choice == Choice::Parts;
    ensure!(!(in_shards && other), "--shard, --resume and --cache go with missions of the lattice, random ones and --healthy only");
    ensure!(args.shards.shard.is_none() || choice == Choice::InProcess, "--shard goes with missions in this process, not through a seat");
    if other && let Some(path) = &args.out {
        rig::whole_file::may_write(path, &[], &["json"], output.force)?;
    }
    if args.mutation {
        return mutation(args, output);
    }
    if let Some(n) = args.bus {
        return own_parts::bus(n, args, output);
    }
    if choice == Choice::Parts {
        return own_parts::missions(args, output);
    }
    let (sample, random, only) = (args.sample, args.random, args.only.clone());
    let plan = Plan {
        seed: args.seed,
        sample,
        random,
        only,
        healthy: args.healthy,
        leaks: args.leaks,
        healing: args.healing,
        seat: choice.to_string(),
    };
    let files = (args.out.as_deref(), args.html.as_path());
    let session = Session::open(&args.shards, ("faults", &json!(plan)), files, args.jobs, output)?;
    fly(&plan, &session, (&To { out: args.out.as_deref(), list: args.list }, &args.html), args, output)
}

/// Flies the missions of a plan, or takes them from parts, and reports.
fn fly(plan: &Plan, session: &Session, (to, html): (&To, &Path), args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if let Some(n) = plan.healthy {
        return healthy(n, plan, session, to, output);
    }
    let started = Instant::now();
    let choice: Choice = plan.seat.parse().unwrap_or(Choice::InProcess);
    let blocks = plan.blocks(&choice)?;
    let bar = bar(session.work.shard.items(&blocks).map(|(_, b)| b.missions()).sum(), "missions");
    session.announce(&bar);
    let key = |b: &Block| key(&["faults", &format!("{b:?}")]);
    let done = session.work.run(&blocks, &key, &Block::fly, &|b, _| bar.inc(b.missions())).map_err(|e| session.explained(e))?;
    bar.finish_and_clear();
    if let (false, Some(out)) = (session.is_whole(), to.out) {
        let [healthy, faulty] = verdicts(done.iter().map(|d| (&blocks[d.place], d.value.clone())));
        let all = || faulty.iter().chain(&healthy);
        let wrong: Vec<Value> = all().filter(|v| v.wrong()).map(campaign::Verdict::document).collect();
        let about = json!({ "missions": all().count(), "not_as_expected": wrong, "wall_s": started.elapsed().as_secs_f64().round() });
        let about = session.leave_part(out, done.iter(), about)?;
        let what = format!("{} missions, {} not as expected", about["missions"], wrong.len());
        return Ok(said_of_shard(&about, &what, "glider faults merge", output, !wrong.is_empty()));
    }
    let flown = verdicts(done.into_iter().map(|d| (&blocks[d.place], d.value)));
    let seat = if choice == Choice::InProcess { None } else { Some(compare(args, &choice, &flown[1])?) };
    let verdict = report(&flown, (plan.seed, &choice), seat, (started, session.merges()), (to, html), output)?;
    session.close();
    Ok(verdict)
}

impl Plan {
    /// Its missions.
    fn blocks(&self, choice: &Choice) -> anyhow::Result<Vec<Block>> {
        if let Some(n) = self.leaks {
            return Ok(plan(&self.numbers(n).map(hidden_leak).collect::<Vec<_>>(), 0..0));
        }
        if let Some(n) = self.healing {
            return Ok(plan(&self.numbers(n).map(healing).collect::<Vec<_>>(), 0..0));
        }
        let in_seat = *choice != Choice::InProcess;
        let mut chosen: Vec<Case> = cases();
        for case in &mut chosen {
            case.seed = case.seed.wrapping_add(self.seed.wrapping_mul(SEEDS));
        }
        if let Some(text) = &self.only {
            chosen.retain(|c| c.name().contains(text.as_str()));
            if chosen.is_empty() {
                bail!("--only {text}: no case has this in its name; names are as in glider fly --fault");
            }
        }
        let wanted = self.sample.or(in_seat.then_some(200)).unwrap_or(chosen.len());
        let random = if in_seat || self.only.is_some() { 0 } else { self.random.unwrap_or(self.sample.map_or(45_000, |n| n as u64 / 3)) };
        chosen = if in_seat {
            through_seat::sample(chosen, choice, wanted)
        } else {
            spread(chosen, wanted.saturating_sub(if self.sample.is_some() { random as usize } else { 0 }))
        };
        Ok(plan(&chosen, self.numbers(random.div_ceil(campaign::lattice::SETS))))
    }

    /// Numbers of so many random missions.
    const fn numbers(&self, missions: u64) -> Range<u64> {
        let first = self.seed.wrapping_mul(1 << 32);
        first..first + missions
    }
}

/// Flies random missions with healthy vehicles.
fn healthy(n: u64, plan: &Plan, session: &Session, to: &To, output: &Output) -> anyhow::Result<Verdict> {
    let started = Instant::now();
    let blocks = ranges(plan.numbers(n), 1);
    let bar = bar(session.work.shard.items(&blocks).map(|(_, b)| b.end - b.start).sum(), "healthy missions");
    session.announce(&bar);
    let make = |numbers: &Range<u64>| numbers.clone().map(campaign::healthy::run).collect::<anyhow::Result<Vec<Flight>>>();
    let key = |numbers: &Range<u64>| key(&["faults --healthy", &format!("{numbers:?}")]);
    let done = session.work.run(&blocks, &key, &make, &|b, _| bar.inc(b.end - b.start)).map_err(|e| session.explained(e))?;
    bar.finish_and_clear();
    let flights: Vec<Flight> = done.iter().flat_map(|d: &Done<Vec<Flight>>| d.value.iter().cloned().map(Flight::drawn_again)).collect();
    let failed: Vec<_> = flights.iter().filter(|f| !f.done()).collect();
    let mut ends: BTreeMap<String, u64> = BTreeMap::new();
    flights.iter().for_each(|f| *ends.entry(if f.done() { "done".into() } else { format!("NOT FLOWN: {}", f.end) }).or_default() += 1);
    let mut document = json!({ "missions": flights.len(), "not_flown_to_the_end": failed.len(), "ends": ends,
        "wall_s": started.elapsed().as_secs_f64().round(), "failed": failed.iter().map(|f| f.document()).collect::<Vec<_>>() });
    if let (false, Some(out)) = (session.is_whole(), to.out) {
        let about = session.leave_part(out, done.iter(), document)?;
        let what = format!("{} missions, {} not flown to their end", about["missions"], failed.len());
        return Ok(said_of_shard(&about, &what, "glider faults merge", output, !failed.is_empty()));
    }
    document["sha256"] = file_report(to.out, part::report(&document).as_bytes())?.into();
    session.close();
    output.emit(&document, || {
        println!(
            "{} random missions with healthy vehicles, {} not flown to their end; {:.0} s",
            flights.len(),
            failed.len(),
            started.elapsed().as_secs_f64()
        );
        ends.iter().for_each(|(end, n)| println!("  {n:6} {end}"));
        for f in failed.iter().take(if to.list { failed.len() } else { 10 }) {
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
    file_report(args.out.as_deref(), format!("{document:#}\n").as_bytes())?;
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

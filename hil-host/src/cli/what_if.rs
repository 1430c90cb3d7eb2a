//! `glider what-if`.

use super::diagnose::load;
use super::fly::table_of;
use super::{Output, Verdict};
use crate::pages::{Axis, Chart, Mark, Page, Section, Series, Table};
use crate::terminal::{say, table};
use crate::what_if::{Flown, Interval, Refit, Reproduced, flown, interval, reproduced};
use anyhow::{Context as _, anyhow, bail, ensure};
use indicatif::{ProgressBar, ProgressStyle};
use plant::{Effect, EffectKind, Fault, Scenario};
use rayon::prelude::*;
use rig::flight::closed_loop::Setup;
use rig::flight::frames::{FRAMES, Start};
use rig::flight::{config_file, mission_file, worlds};
use rig::replay::law::Law;
use rig::replay::record::Record;
use rig::spelling::near;
use rig::whole_file;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider what-if out/flight                              can its world be refitted: does the law that flew do as it did
  glider what-if out/flight --table new.bin              the same mission with another table
  glider what-if out/flight --mission sea                another mission
  glider what-if out/flight --law 3f2c1ab                the law of a commit
  glider what-if out/flight --fault pump:stuck@dive+60s  if that had broken
  glider what-if out/flight --effect drag_level_error=0.3 --out what-if.html
  glider what-if modena --vehicle modena.toml --mission sea --table new.bin

Drag, lift, trim and sensors of the vehicle are refitted to all dives of the log, the water is the measured one; worlds are drawn from
what the fit leaves open, and both laws fly in the same ones. A log that glider fly --log wrote holds the mission and the law's settings;
of others --mission says what is flown. `glider replay` asks a law with the recorded sensors held.

Exit code: 0 the refitted world does as the log, but for what chance makes; 1 it does not: look at `glider diagnose`; 2 bad input.")]
pub struct Args {
    /// Flight directory (flight.csv and vehicle.json|toml) or csv file.
    #[arg(value_name = "FLIGHT")]
    flight: PathBuf,
    /// Vehicle file, or a built-in one by name; default: the one beside the flight.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// Another mission.
    #[arg(long, value_name = "NAME|FILE")]
    mission: Option<String>,
    /// Another flight table (.bin), or that of a vehicle file.
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Another controller configuration.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Another law: an image (ELF), a program, a commit.
    #[arg(long, value_name = "ELF|PROGRAM|COMMIT")]
    law: Option<String>,
    /// A fault, again for more.
    #[arg(long = "fault", value_name = "SPEC")]
    faults: Vec<String>,
    /// An effect of the vehicle or the water with its size, again for more; size 0 takes one of the vehicle file away.
    #[arg(long = "effect", value_name = "NAME=SIZE")]
    effects: Vec<String>,
    /// Worlds that are drawn.
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u64).range(4..=1000))]
    worlds: u64,
    /// Seed of the draws.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// A page with both flights.
    #[arg(long, value_name = "FILE.html")]
    out: Option<PathBuf>,
}

/// What is other than in the log.
struct Change {
    setup: Setup,
    law: Law,
    faults: Vec<Fault>,
    effects: Vec<Effect>,
    words: Vec<String>,
}

impl Change {
    /// The world as it is changed.
    fn of(&self, scenario: &Scenario) -> Scenario {
        let mut scenario = scenario.clone();
        scenario.faults.extend(self.faults.iter().cloned());
        for effect in &self.effects {
            if effect.value == 0.0 {
                scenario.effects.retain(|e| e.kind != effect.kind);
            } else {
                scenario.effects.push(*effect);
            }
        }
        scenario
    }
}

fn effect(text: &str) -> anyhow::Result<Effect> {
    let (name, size) = text.split_once('=').with_context(|| format!("--effect {text}: write NAME=SIZE, such as drag_level_error=0.3"))?;
    let names = EffectKind::ALL.iter().map(|k| k.name());
    let Some(kind) = EffectKind::ALL.iter().find(|k| k.name() == name) else {
        let meant = near(name, names).map_or_else(String::new, |meant| format!("; did you mean `{meant}`?"));
        bail!("--effect {name}: no effect of that name{meant} (glider list effects)");
    };
    let value: f64 = size.parse().ok().filter(|v: &f64| v.is_finite()).with_context(|| format!("--effect {text}: {size} is no number"))?;
    Ok(Effect { kind: *kind, value, aux: None })
}

/// What the log says of the law that flew; of a log of another controller the mission that is asked.
fn flown_with(args: &Args) -> anyhow::Result<(Setup, bool)> {
    if args.flight.join(FRAMES).exists() {
        let record = Record::read(&args.flight, None)?;
        let config = record.config()?;
        let Start { mission, table, .. } = record.start;
        return Ok((Setup { config, table: (!table.is_empty()).then_some(table), ..Setup::new(mission) }, true));
    }
    let name = args.mission.as_deref().with_context(|| {
        format!("{}: its log does not hold a mission of this controller; say with --mission what is flown", args.flight.display())
    })?;
    Ok((Setup::new(mission_file::load(name, worlds::limits)?), false))
}

fn change(args: &Args, before: &Setup) -> anyhow::Result<Change> {
    let mut words = Vec::new();
    let mut setup = before.clone();
    if let Some(name) = &args.mission {
        setup.mission = mission_file::load(name, worlds::limits)?;
        setup.mission.wings = before.mission.wings;
        setup.config = worlds::config(&setup.mission);
        words.push(format!("the mission {name}"));
    }
    if let Some(path) = &args.config {
        setup.config = config_file::load(path)?;
        words.push(format!("the configuration {}", path.display()));
    }
    if let Some(path) = &args.table {
        setup.table = Some(table_of(path, setup.mission.wings)?);
        words.push(format!("the table {}", path.display()));
    }
    let law = args.law.as_deref().map_or(Ok(Law::Here), Law::named)?;
    if law != Law::Here {
        words.push(law.describe());
    }
    let faults = args.faults.iter().map(|spec| spec.parse().map_err(|e: String| anyhow!("{e}"))).collect::<anyhow::Result<Vec<Fault>>>()?;
    words.extend(args.faults.iter().map(|fault| format!("the fault {fault}")));
    let effects = args.effects.iter().map(|text| effect(text)).collect::<anyhow::Result<Vec<_>>>()?;
    words.extend(args.effects.iter().map(|effect| format!("the effect {effect}")));
    Ok(Change { setup, law, faults, effects, words })
}

/// Figures of a flight that both laws are compared by: name, unit, digits, value.
type Figure = (&'static str, &'static str, usize, fn(&Flown) -> f64);

const FIGURES: [Figure; 6] = [
    ("distance", "m", 0, |f| f.outcome.distance_m),
    ("duration", "h", 2, |f| f.outcome.duration_s / 3600.0),
    ("dives", "", 1, |f| f.outcome.dives.into()),
    ("deepest", "m", 1, |f| f.outcome.max_depth_m),
    ("L/D", "", 3, |f| f.outcome.achieved_l_over_d()),
    ("energy", "J/m", 2, |f| f.outcome.joule_per_m().unwrap_or(f64::NAN)),
];

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if let Some(out) = &args.out {
        whole_file::may_write(out, &[&args.flight], &["html"], output.force)?;
    }
    let (flight, vehicle) = load(&args.flight, args.vehicle.as_deref())?;
    let (before, is_ours) = flown_with(args)?;
    let change = change(args, &before)?;
    ensure!(is_ours || change.words.len() > 1, "say what else is other than today: --table, --config, --law, --fault or --effect");
    let refit = Refit::of(&flight, &vehicle, &before.mission, before.mission.wings)?;
    let worlds = (0..args.worlds).map(|k| refit.drawn(args.seed + k)).collect::<anyhow::Result<Vec<_>>>()?;
    let is_changed = change.words.len() > usize::from(!is_ours);
    let bar = ProgressBar::new(args.worlds * (1 + u64::from(is_changed)))
        .with_style(ProgressStyle::with_template("{bar:30} {pos}/{len} flights  {elapsed}").unwrap_or(ProgressStyle::default_bar()));
    let all = |law: &Law, setup: &Setup, worlds: &[Scenario], name: &str| -> anyhow::Result<Vec<Flown>> {
        let one = |(k, world): (usize, &Scenario)| {
            let folder = std::env::temp_dir().join(format!("glider-what-if-{}-{name}-{k}", std::process::id()));
            let done = flown(world, setup, &mut *law.open()?, &folder);
            bar.inc(1);
            done
        };
        worlds.par_iter().enumerate().map(one).collect()
    };
    let as_flown = all(&Law::Here, &before, &worlds, "before")?;
    let changed = match is_changed {
        true => Some(all(&change.law, &change.setup, &worlds.iter().map(|w| change.of(w)).collect::<Vec<_>>(), "after")?),
        false => None,
    };
    bar.finish_and_clear();
    let drawn: Vec<_> = as_flown.iter().map(|f| f.dives.clone()).collect();
    let reproduced = if is_ours { reproduced(&refit.recorded, &drawn) } else { Reproduced { inside: Vec::new(), wider: 1.0 } };
    let comparison = Comparison { args, flight: &flight, change: &change, is_fitted: refit.is_fitted, reproduced, as_flown, changed };
    if let Some(out) = &args.out {
        comparison.page(out)?;
    }
    output.emit(&comparison.document(), || comparison.say());
    Ok(if comparison.is_trusted() { Verdict::Ok } else { Verdict::Negative })
}

/// Both laws in the same worlds.
struct Comparison<'a> {
    args: &'a Args,
    flight: &'a logs::Flight,
    change: &'a Change,
    is_fitted: bool,
    reproduced: Reproduced,
    as_flown: Vec<Flown>,
    changed: Option<Vec<Flown>>,
}

/// Share of the dives that a right world holds in 90 % intervals; it is not believed where so few would be held once in twenty.
const HELD: f64 = 0.9;
const BY_CHANCE: f64 = 0.05;
/// By how much at most intervals are widened of a world that is believed (a guess).
const WIDEST: f64 = 3.0;

/// Probability that of `n` dives of a right world `k` or fewer are inside (binomial).
fn chance_of_so_few(k: usize, n: usize) -> f64 {
    let mut term = (1.0 - HELD).powi(n as i32);
    let mut sum = term;
    for i in 0..k {
        term *= (n - i) as f64 / (i + 1) as f64 * HELD / (1.0 - HELD);
        sum += term;
    }
    sum.min(1.0)
}

impl Comparison<'_> {
    fn count(&self) -> [usize; 2] {
        [0, 1].map(|k| self.reproduced.inside.iter().filter(|i| i[k]).count())
    }

    fn is_trusted(&self) -> bool {
        let n = self.reproduced.inside.len();
        self.reproduced.wider <= WIDEST && self.count().iter().all(|k| chance_of_so_few(*k, n) >= BY_CHANCE)
    }

    /// As flown, as changed, and the difference in the same world.
    fn intervals(&self, figure: &Figure) -> [Option<Interval>; 3] {
        let of = |flown: &[Flown]| flown.iter().map(figure.3).collect::<Vec<f64>>();
        let before = of(&self.as_flown);
        let after = self.changed.as_deref().map(of);
        let difference = after.as_ref().map(|after| after.iter().zip(&before).map(|(a, b)| a - b).collect::<Vec<f64>>());
        let wide = |values: &Vec<f64>| {
            let i = interval(values, 0.0);
            Interval { half: i.half * self.reproduced.wider, ..i }
        };
        [Some(wide(&before)), after.as_ref().map(wide), difference.as_ref().map(wide)]
    }

    fn ends(flown: &[Flown]) -> Vec<(String, usize)> {
        let mut out: Vec<(String, usize)> = Vec::new();
        for end in flown.iter().map(|f| f.outcome.end.to_string()) {
            match out.iter_mut().find(|(e, _)| *e == end) {
                Some((_, n)) => *n += 1,
                None => out.push((end, 1)),
            }
        }
        out
    }

    fn document(&self) -> Value {
        let one = |i: Option<Interval>| i.map(|i| json!({ "mean": i.mean, "low": i.mean - i.half, "high": i.mean + i.half }));
        let figure = |f: &Figure| {
            let [before, after, difference] = self.intervals(f).map(one);
            json!({ "figure": f.0, "unit": f.1, "as_flown": before, "changed": after, "difference": difference })
        };
        let ends = |f: &[Flown]| Self::ends(f).into_iter().map(|(end, n)| json!({ "end": end, "worlds": n })).collect::<Vec<_>>();
        let [depth, way] = self.count();
        json!({ "flight": self.args.flight, "change": self.change.words, "worlds": self.as_flown.len(), "is_refitted": self.is_fitted,
            "reproduced": { "dives": self.reproduced.inside.len(), "in_depth_and_time": depth, "in_way": way, "widened_by": self.reproduced.wider, "is_trusted": self.is_trusted() },
            "figures": FIGURES.iter().map(figure).collect::<Vec<_>>(),
            "ends": { "as_flown": ends(&self.as_flown), "changed": self.changed.as_deref().map(ends) }, "page": self.args.out })
    }

    /// How far the refitted world is to be trusted.
    fn trust(&self) -> String {
        let n = self.reproduced.inside.len();
        let [depth, way] = self.count();
        match n {
            0 => "this log was not flown by this law: how far the refitted world is right cannot be shown with it".to_owned(),
            _ => format!(
                "{}, with the law that flew: {depth} of {n} dives as deep and as long as recorded, {way} of {n} with their way over ground, within 90 % intervals widened by {:.1} as these dives ask for{}",
                if self.is_fitted {
                    "refitted to the log"
                } else {
                    "the file's numbers within its tolerances, for the dives are too short to refit them"
                },
                self.reproduced.wider,
                if self.is_trusted() { "" } else { "; the vehicle has something that its file has not: glider diagnose" }
            ),
        }
    }

    fn rows(&self) -> Vec<Vec<String>> {
        let row = |f: &Figure| {
            let digits = f.2;
            let shown = |i: Option<Interval>, sign: bool| match i {
                None => String::new(),
                Some(i) if sign => format!("{:+.digits$} ± {:.digits$} {}", i.mean, i.half, f.1),
                Some(i) => format!("{:.digits$} ± {:.digits$} {}", i.mean, i.half, f.1),
            };
            let [before, after, difference] = self.intervals(f);
            vec![f.0.to_owned(), shown(before, false), shown(after, false), shown(difference, true)]
        };
        let ends = |f: &[Flown]| Self::ends(f).iter().map(|(end, n)| format!("{end} in {n}")).collect::<Vec<_>>().join(", ");
        let end = vec!["end".to_owned(), ends(&self.as_flown), self.changed.as_deref().map(ends).unwrap_or_default(), String::new()];
        FIGURES.iter().map(row).chain([end]).collect()
    }

    const HEAD: [&'static str; 4] = ["", "law that flew", "changed", "difference in the same world"];

    fn words(&self) -> String {
        if self.change.words.is_empty() { "nothing".to_owned() } else { self.change.words.join(", ") }
    }

    fn say(&self) {
        say(&format!("Changed: {}. {} worlds drawn from the fit; ± is 90 %.", self.words(), self.as_flown.len()));
        let mut t = table(Self::HEAD);
        t.add_rows(self.rows());
        println!("{t}");
        say(&crate::terminal::wrapped(&self.trust(), 0));
        if let Some(out) = &self.args.out {
            say(&format!("page  {}", out.display()));
        }
    }

    fn page(&self, out: &Path) -> anyhow::Result<()> {
        let line = |name: &str, track: &[(f64, f64)]| {
            let (t, z): (Vec<f64>, Vec<f64>) = track.iter().map(|(t, z)| (t / 3600.0, *z)).unzip();
            Series::new(name, &t, &z)
        };
        let start = self.flight.time_s.first().copied().unwrap_or(0.0);
        let recorded: Vec<(f64, f64)> =
            self.flight.time_s.iter().zip(&self.flight.pressure_pa).map(|(t, p)| (t - start, p / 1e4)).collect();
        let mut chart =
            Chart::new("Depth", Mark::Line, Axis::new("time", "h"), Axis::new("depth", "m").down()).with(line("recorded", &recorded));
        let first = |flown: &[Flown]| flown.first().map(|f| f.track.clone()).unwrap_or_default();
        chart = chart.with(line("refitted, law that flew", &first(&self.as_flown)));
        if let Some(changed) = &self.changed {
            chart = chart.with(line("refitted, changed", &first(changed)));
        }
        let table =
            Table { caption: "± is 90 % over the drawn worlds".into(), head: Self::HEAD.map(Into::into).to_vec(), rows: self.rows() };
        let mut page = Page {
            title: format!("What if: {}", self.words()),
            provenance: super::report::provenance(&self.args.flight)?,
            ..Page::default()
        };
        page.answer.push(("How far it is to be trusted".into(), self.trust()));
        page.sections.push(Section {
            title: "Both flights".into(),
            lead: "The first of the drawn worlds. With a fault both flights are the same up to the moment it strikes.".into(),
            items: vec![chart.into(), table.into()],
        });
        page.write(out)
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn so_few_dives_inside_is_the_binomial_tail() {
        let near = |k: usize, n: usize, p: f64| (super::chance_of_so_few(k, n) - p).abs() < 5e-4;
        assert!(near(7, 11, 0.0185) && near(8, 11, 0.0896) && near(0, 1, 0.1) && near(11, 11, 1.0) && near(0, 0, 1.0));
    }
}

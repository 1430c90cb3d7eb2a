//! `glider scorecard loop`: the whole circle in worlds whose truth is known.

use super::super::{Output, Verdict};
use crate::score::whole_loop::{Closed, cases, close_all};
use crate::terminal::{say, table};
use anyhow::ensure;
use indicatif::{ProgressBar, ProgressStyle};
use plant::EffectKind;
use rig::flight::mission_file::wings_name;
use serde_json::json;

/// Arguments of `scorecard loop`.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider scorecard loop\n  glider scorecard loop --sizes 1 --seed 7 --json\n\nEach effect the plant knows, on both wing sets: eight dives are flown and diagnosed, what is named is added, and the mission\n\
to 200 m is flown in the same world with the table of the vehicle as stated, with the new one, and with a table of the truth.\nExit code 1 when an answer costs more than 5 % of the range anywhere."
)]
pub struct LoopArgs {
    /// Sizes of what is hidden, in medium sizes.
    #[arg(long, value_delimiter = ',', default_value = "1,2")]
    sizes: Vec<f64>,
    /// Seed of the worlds.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// Loss of range from which an answer has done harm, 1: two flights that differ in their water alone do by half of it.
const HARM: f64 = 0.05;

/// Runs the command.
///
/// # Errors
/// A circle that cannot be closed.
pub fn run(args: &LoopArgs, output: &Output) -> anyhow::Result<Verdict> {
    ensure!(args.sizes.iter().all(|s| s.is_finite() && *s > 0.0), "--sizes: numbers above 0, such as 1,2");
    let all = cases(&args.sizes, args.seed);
    let bar = ProgressBar::new(all.len() as u64);
    bar.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} circles {eta}")?);
    let folder = std::env::temp_dir().join(format!("glider-circles-{}-{}", args.seed, std::process::id()));
    let closed = close_all(&all, &folder, || bar.inc(1));
    std::fs::remove_dir_all(&folder).ok();
    let closed = closed?;
    bar.finish_and_clear();

    let total = Total::of(&closed);
    let document = json!({ "seed": args.seed, "summary": total.document(), "circles": closed });
    output.emit(&document, || {
        let mut t = table(TABLE_HEAD);
        for c in &closed {
            t.add_row(row(c));
        }
        println!("{t}");
        say(&total.sentence());
    });
    Ok(if total.worst < -HARM { Verdict::Negative } else { Verdict::Ok })
}

/// What all circles came to.
struct Total {
    named: usize,
    tabulated: usize,
    of: usize,
    gain: f64,
    possible: f64,
    worst: f64,
}

impl Total {
    fn of(closed: &[Closed]) -> Self {
        let named = || closed.iter().filter(|c| !c.answer.is_empty());
        Self {
            named: named().count(),
            tabulated: named().filter(|c| c.no_table.is_none()).count(),
            of: closed.len(),
            gain: named().map(Closed::gain).sum(),
            possible: named().map(Closed::possible_gain).sum(),
            worst: named().map(Closed::gain).fold(0.0, f64::min),
        }
    }

    fn document(&self) -> serde_json::Value {
        json!({ "circles": self.of, "named": self.named, "tables": self.tabulated, "gain_sum": self.gain, "possible_gain_sum": self.possible,
            "worst": self.worst })
    }

    fn sentence(&self) -> String {
        let mean = |sum: f64| 100.0 * sum / self.named.max(1) as f64;
        format!(
            "Something named in {} of {}, a table made in {} of them. Range with the new tables {:+.2} % in the mean, {:+.2} % with those of the truth; worst {:+.2} %.",
            self.named,
            self.of,
            self.tabulated,
            mean(self.gain),
            mean(self.possible),
            100.0 * self.worst
        )
    }
}

const TABLE_HEAD: [&str; 11] = ["wings", "hidden", "size", "verdict", "answer", "in class", "cm/s", "L/D old", "new", "truth's", "range"];

fn row(c: &Closed) -> [String; 11] {
    [
        wings_name(c.case.wings).to_owned(),
        c.case.hidden.map_or("nothing", EffectKind::name).to_owned(),
        format!("{}", c.case.size),
        c.verdict.to_owned(),
        c.answer.join(" + "),
        if c.in_class { "yes" } else { "no" }.to_owned(),
        format!("{:.2} {:.2} {:.2}", 100.0 * c.error_m_s[0], 100.0 * c.error_m_s[1], 100.0 * c.error_m_s[2]),
        format!("{:.3}", c.l_over_d[0]),
        c.no_table.clone().unwrap_or_else(|| format!("{:.3}", c.l_over_d[1])),
        format!("{:.3}", c.l_over_d[2]),
        if c.answer.is_empty() { String::new() } else { format!("{:+.1} of {:+.1} %", 100.0 * c.gain(), 100.0 * c.possible_gain()) },
    ]
}

//! `glider scorecard real --controls N`: missions judged by their own history.

use std::path::Path;

use serde_json::json;

use super::super::shards::file_report;
use super::super::{Output, Verdict};
use super::cases_bar;
use crate::score::real::missions::{Scored, Share, below, missions, score, together};
use crate::terminal::{say, table};

/// Runs it.
///
/// # Errors
/// The folder cannot be read, or holds no mission.
pub(super) fn run(root: &Path, controls: &[u64], out: Option<&Path>, list: bool, output: &Output) -> anyhow::Result<Verdict> {
    let all = missions(root, &|why| eprintln!("left out: {why}"))?;
    anyhow::ensure!(!all.is_empty(), "{}: no mission with steady dives", root.display());
    let bar = cases_bar(all.len() * controls.len(), "missions");
    let (mut cards, mut low) = (Vec::new(), Vec::new());
    for &n in controls {
        let scored = all.iter().filter_map(|mission| {
            let scored = score(mission, n as usize);
            bar.inc(1);
            scored
        });
        let scored: Vec<Scored> = scored.collect();
        let sum = together(&scored);
        low.extend(below(&sum));
        cards.push(json!({"controls": n, "missions": scored, "all": sum}));
        if !output.json {
            print(&scored, &sum, list);
        }
    }
    bar.finish_and_clear();
    let card = json!({"schema": "glider-scorecard-history/1", "by_controls": cards, "below_goals": low});
    file_report(out, format!("{card:#}").as_bytes())?;
    output.emit(&card, || low.iter().for_each(|why| say(&format!("below the goal: {why}"))));
    Ok(if low.is_empty() { Verdict::Ok } else { Verdict::Negative })
}

fn print(scored: &[Scored], sum: &Scored, list: bool) {
    let mut t = table(["mission", "quiet", "sensors", "class", "wrong", "held", "class/2", "wrong/2", "held/2"]);
    for s in scored.iter().chain(std::iter::once(sum)) {
        let share = |s: Share| format!("{}/{}", s.right, s.all);
        let mut row = vec![s.name.clone(), share(s.quiet), share(s.unseen)];
        for of in s.sizes {
            row.extend([share(of.in_class), of.wrong.right.to_string(), format!("{:.2}", of.held.ratio())]);
        }
        t.add_row(row);
    }
    println!("{t}");
    say(&format!("{} controls; sensors: a late clock or another pressure zero is quiet; /2: errors of half the size", sum.controls));
    say(&format!("chances of {} untouched dives: p {:.2} of a uniform law", sum.chances.len(), sum.uniform));
    for s in scored {
        for (unit, class) in &s.alarms {
            say(&format!("{}: {unit}: {}", s.name, class.join(" | ")));
        }
        if list {
            s.answers.iter().for_each(|a| say(&a.to_string()));
        }
    }
}

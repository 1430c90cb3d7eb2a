//! `glider replay --bisect`: which of a row of laws or tables turned a flight.

use super::{abort_words, watches};
use crate::cli::fly::table_of;
use crate::cli::{Output, Verdict};
use crate::terminal::row;
use anyhow::{Context as _, ensure};
use rig::replay::bisect::bisect;
use rig::replay::law::{Law, commits};
use rig::replay::play::{Played, play};
use rig::replay::record::Record;
use serde_json::json;
use signals::Abort;
use std::collections::BTreeMap;
use std::path::Path;

/// One of the row.
struct Candidate {
    name: String,
    law: Law,
    table: Option<Vec<u8>>,
}

fn candidates(row: &str, record: &Record) -> anyhow::Result<Vec<Candidate>> {
    if let Some((a, b)) = row.split_once("..") {
        let all = commits(a, b)?.into_iter().map(|law| Candidate { name: law.describe(), law, table: None });
        return Ok(all.collect());
    }
    let one = |name: &str| {
        let path = Path::new(name);
        let is_table = path.extension().is_some_and(|e| e == "bin" || e == "json" || e == "toml");
        let (law, table) =
            if is_table { (Law::Here, Some(table_of(path, record.start.mission.wings)?)) } else { (Law::named(name)?, None) };
        Ok(Candidate { name: name.to_owned(), law, table })
    };
    let all = row.split(',').map(one).collect::<anyhow::Result<Vec<_>>>()?;
    ensure!(all.len() > 1, "--bisect {row}: name commits as A..B, or at least two laws or tables with a comma between them");
    Ok(all)
}

/// What a candidate does that the search goes by.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Does {
    Aborts(Option<Abort>, usize),
    IsEqual(bool),
}

/// Runs the search.
///
/// # Errors
/// No such row, or a law that cannot be asked.
pub fn run(row_of: &str, flight: &Path, record: &Record, output: &Output) -> anyhow::Result<Verdict> {
    let all = candidates(row_of, record)?;
    let mut asked: BTreeMap<usize, Played> = BTreeMap::new();
    let mut ask = |i: usize| -> anyhow::Result<Played> {
        if let Some(played) = asked.get(&i) {
            return Ok(played.clone());
        }
        let one = all.get(i).context("no such law")?;
        if !output.json {
            eprintln!("asking {}", one.name);
        }
        let played = play(&mut *one.law.open()?, record, one.table.as_deref(), &mut |_, _| true).with_context(|| one.name.clone())?;
        asked.insert(i, played.clone());
        Ok(played)
    };
    let abort = |p: &Played| Does::Aborts(p.aborts[1].map(|a| a.1), p.aborts[1].map_or(0, |a| a.0));
    let by_abort = abort(&ask(0)?) != abort(&ask(all.len() - 1)?);
    let found = bisect(all.len(), |i| ask(i).map(|p| if by_abort { abort(&p) } else { Does::IsEqual(p.is_equal()) }))?;
    let Some(found) = found else {
        output.emit(&json!({ "flight": flight, "laws": all.len(), "found": null }), || {
            row("no change", "the first and the last of the row do the same with this flight");
        });
        return Ok(Verdict::Negative);
    };
    let pair = [ask(found.index - 1)?, ask(found.index)?];
    let (Some(new), Some(old)) = (all.get(found.index), all.get(found.index - 1)) else { return Ok(Verdict::Negative) };
    // Of the two the one that does not as recorded says where they part.
    let (differing, law) = if pair[1].is_equal() { (&pair[0], old) } else { (&pair[1], new) };
    let watches = watches(record, law.table.as_deref(), &law.law, differing)?;
    let aborts = [&pair[0], &pair[1]].map(|p| abort_words(record, p.aborts[1]));
    let first = differing.first.as_ref().map(|f| (record.time_s(f.cycle), f.differences.iter().map(|d| d.words()).collect::<Vec<_>>()));
    let document = json!({ "flight": flight, "laws": all.len(), "asked": found.asked, "found": new.name, "before_it": old.name,
        "aborts": aborts, "first_s": first.as_ref().map(|f| f.0), "signals": first.as_ref().map(|f| f.1.clone()), "watches": watches });
    output.emit(&document, || {
        row("the change", &new.name);
        row(
            "found",
            &format!("by {} of {} laws, {}", found.asked, all.len(), if by_abort { "by their aborts" } else { "by their orders" }),
        );
        row("abort before", &aborts[0]);
        row("abort with it", &aborts[1]);
        if let Some((time_s, signals)) = &first {
            row("they part", &format!("{time_s:.0} s after the start: {}", signals.join("; ")));
        }
        watches.iter().for_each(|w| row("as if a watch", &format!("were broken in one of both: {w}")));
    });
    Ok(Verdict::Ok)
}

//! Asks the dives of every flight, from the cache where it has them.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use discovery::workbench::dive_estimates::dive_estimates;
use logs::digest::sha256;
use logs::{Vehicle, vehicle};

use crate::fleet::archive::{Item, read};
use crate::fleet::cache::{self, Entry};
use crate::fleet::copies::copies;
use crate::fleet::part::{DiveRow, Part, Row, dive_row, number_columns};
use rig::flight::vehicles;
use rig::shards::kept::program;
use rig::shards::shard::Shard;
use rig::shards::work::{Done, Work};

/// What a run made.
#[derive(Clone, Debug)]
pub struct Mapped {
    /// The dives.
    pub part: Part,
    /// Flights, and how many of them the cache had.
    pub flights: [usize; 2],
}

/// A vehicle file as flights are judged by it, and its name in tables.
struct Judge {
    vehicle: Vehicle,
    label: String,
}

fn judge(file: &Path) -> anyhow::Result<Judge> {
    let text = vehicles::text(file)?;
    let vehicle = vehicle::parse_text(&text, file)?;
    let stem = file.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let name = if vehicle.name.is_empty() { stem } else { vehicle.name.clone() };
    // Two files of one name are two vehicles; one file in two places is one.
    let label = format!("{name} {}", &sha256(text.as_bytes())[..8]);
    Ok(Judge { vehicle, label })
}

/// What is said of a flight whose log is another flight's too.
fn copy_of(first: &Item) -> Entry {
    Entry { rows: Vec::new(), left_out: format!("the same log as {}/{}, which is counted", first.deployment, first.flight) }
}

fn asked(item: &Item, judge: &Judge) -> Entry {
    let rows = read(&item.files).and_then(|flight| Ok(dive_estimates(&flight, &judge.vehicle)?));
    match rows {
        Ok(all) => Entry { rows: all.iter().enumerate().map(|(k, e)| dive_row(k + 1, e)).collect(), left_out: String::new() },
        Err(why) => {
            // Paths differ from machine to machine, the table must not.
            let folder = item.files.first().and_then(|f| f.parent()).map_or_else(String::new, |p| format!("{}/", p.display()));
            Entry { rows: Vec::new(), left_out: format!("{why:#}").replace(&folder, "") }
        }
    }
}

/// Rows of a flight, as the table has them.
fn rows(item: &Item, judge: &Judge, entry: &Entry, columns: usize) -> Vec<Row> {
    let row = |dive| Row {
        vehicle: judge.label.clone(),
        deployment: item.deployment.clone(),
        flight: item.flight.clone(),
        left_out: entry.left_out.clone(),
        dive,
    };
    let nothing = DiveRow { dive: 0, segment: 0, rows: 0, numbers: vec![f64::NAN; columns] };
    if entry.rows.is_empty() { vec![row(nothing)] } else { entry.rows.iter().cloned().map(row).collect() }
}

/// Asks the flights of a shard, of copies of one log the first; `tick` gets the name of each that is done.
///
/// # Errors
/// A vehicle file that cannot be read, a flight's file that cannot be hashed, or a cache that cannot be written. A flight that cannot be
/// asked is no error: its row says why.
pub fn map(items: &[Item], work: &Work, tick: &(dyn Fn(&str) + Sync)) -> anyhow::Result<Mapped> {
    let mut judges: HashMap<&PathBuf, Judge> = HashMap::new();
    for (_, item) in work.shard.items(items) {
        if !judges.contains_key(&item.vehicle) {
            judges.insert(&item.vehicle, judge(&item.vehicle)?);
        }
    }
    let (program, columns) = (program()?, number_columns());
    let judge_of = |item: &Item| judges.get(&item.vehicle).context("a vehicle that was read");
    let first = copies(items, &program, work)?;
    let plan: Vec<(&Item, Option<&Item>)> = items.iter().zip(first.iter().map(|of| of.map(|k| &items[k]))).collect();
    let done: Vec<Done<Entry>> = work.run(
        &plan,
        &|(item, first)| {
            let copy = first
                .map_or_else(String::new, |f| format!("{}/{} is a copy of {}/{}", item.deployment, item.flight, f.deployment, f.flight));
            cache::key(&format!("{program}{copy}"), &columns, &item.files, &item.vehicle)
        },
        &|(item, first)| first.map_or_else(|| Ok(asked(item, judge_of(item)?)), |first| Ok(copy_of(first))),
        &|(item, _), _| tick(&item.flight),
    )?;
    let mut all = Vec::new();
    for Done { place, value, .. } in &done {
        all.extend(rows(&items[*place], judge_of(&items[*place])?, value, columns.len()));
    }
    let shard = Some(work.shard).filter(|s| *s != Shard::WHOLE);
    Ok(Mapped { part: Part::new(shard, all), flights: [done.len(), done.iter().filter(|d| d.was_kept).count()] })
}

//! Asks the dives of every flight, from the cache where it has them.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use discovery::workbench::dive_estimates::dive_estimates;
use discovery::workbench::refitted_file::sha256;
use discovery::{Vehicle, vehicle};
use rayon::prelude::*;

use crate::fleet::archive::{Item, read};
use crate::fleet::cache::{self, Entry};
use crate::fleet::part::{DiveRow, Part, Row, Shard, dive_row, number_columns};

/// How a run goes.
#[derive(Clone, Debug)]
pub struct Run<'a> {
    /// Folder of the cache.
    pub cache: &'a Path,
    /// Which flights; none for all.
    pub shard: Option<Shard>,
    /// Flights that are asked at a time.
    pub jobs: usize,
}

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
    let vehicle = vehicle::read(file)?;
    let bytes = std::fs::read(file).with_context(|| file.display().to_string())?;
    let stem = file.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    let name = if vehicle.name.is_empty() { stem } else { vehicle.name.clone() };
    // Two files of one name are two vehicles; one file in two places is one.
    let label = format!("{name} {}", &sha256(&bytes)[..8]);
    Ok(Judge { vehicle, label })
}

fn asked(item: &Item, judge: &Judge) -> Entry {
    let rows = read(&item.files).and_then(|flight| Ok(dive_estimates(&flight, &judge.vehicle, &|_, _| ())?));
    match rows {
        Ok(all) => Entry { rows: all.iter().enumerate().map(|(k, e)| dive_row(k + 1, e)).collect(), left_out: String::new() },
        Err(why) => {
            // Paths differ from machine to machine, the table must not.
            let folder = item.files.first().and_then(|f| f.parent()).map_or_else(String::new, |p| format!("{}/", p.display()));
            Entry { rows: Vec::new(), left_out: format!("{why:#}").replace(&folder, "") }
        }
    }
}

/// Asks all flights of a run; `tick` gets the name of each that is done.
///
/// # Errors
/// A vehicle file that cannot be read, a flight's file that cannot be hashed, or a cache that cannot be written. A flight that cannot be
/// asked is no error: its row says why.
pub fn map(items: &[Item], run: &Run, tick: &(dyn Fn(&str) + Sync)) -> anyhow::Result<Mapped> {
    let mine: Vec<&Item> =
        items.iter().enumerate().filter(|(k, _)| run.shard.is_none_or(|s| k % s.of == s.number - 1)).map(|(_, i)| i).collect();
    let mut judges: HashMap<&PathBuf, Judge> = HashMap::new();
    for item in &mine {
        if !judges.contains_key(&item.vehicle) {
            judges.insert(&item.vehicle, judge(&item.vehicle)?);
        }
    }
    std::fs::create_dir_all(run.cache).with_context(|| run.cache.display().to_string())?;
    let (program, columns) = (cache::program()?, number_columns());
    let one = |item: &&Item| -> anyhow::Result<(Vec<Row>, bool)> {
        let judge = judges.get(&item.vehicle).context("a vehicle that was read")?;
        let key = cache::key(&program, &columns, &item.files, &item.vehicle)?;
        let kept = cache::load(run.cache, &key, columns.len());
        let had = kept.is_some();
        let entry = match kept {
            Some(entry) => entry,
            None => {
                let entry = asked(item, judge);
                cache::store(run.cache, &key, &entry)?;
                entry
            }
        };
        tick(&item.flight);
        let row = |dive| Row {
            vehicle: judge.label.clone(),
            deployment: item.deployment.clone(),
            flight: item.flight.clone(),
            left_out: entry.left_out.clone(),
            dive,
        };
        let nothing = || DiveRow { dive: 0, segment: 0, rows: 0, numbers: vec![f64::NAN; columns.len()] };
        let rows = if entry.rows.is_empty() { vec![row(nothing())] } else { entry.rows.iter().cloned().map(row).collect() };
        Ok((rows, had))
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(run.jobs).build().context("cannot start the worker threads")?;
    let all: Vec<(Vec<Row>, bool)> = pool.install(|| mine.par_iter().map(one).collect::<anyhow::Result<_>>())?;
    let flights = [all.len(), all.iter().filter(|a| a.1).count()];
    Ok(Mapped { part: Part::new(run.shard, all.into_iter().flat_map(|a| a.0).collect()), flights })
}

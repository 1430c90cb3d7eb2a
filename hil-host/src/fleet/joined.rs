//! The logs of a mission as one flight.

use anyhow::Context as _;
use discovery::workbench::mission_clock::{When, one_clock};
use logs::import::Origin;

use super::archive::Placed;

/// One flight of logs of one mission, in the order of their times: segments are numbered anew.
///
/// # Errors
/// No log.
pub fn joined(logs: Vec<Placed>) -> anyhow::Result<(Placed, Vec<String>)> {
    let clock = one_clock(&logs.iter().map(|l| When::of(&l.flight, l.zero_unix_s)).collect::<Vec<_>>());
    let mut logs: Vec<Option<Placed>> = logs.into_iter().map(Some).collect();
    let (mut out, mut segments): (Option<Placed>, u32) = (None, 0);
    for (which, zero_s) in &clock.flights {
        let Some(mut log) = logs[*which].take() else { continue };
        log.flight.time_s.iter_mut().for_each(|t| *t += zero_s);
        log.flight.segment.iter_mut().for_each(|s| *s += segments);
        log.origins.iter_mut().for_each(|o| o.segment += segments);
        segments = log.flight.segment.iter().max().map_or(segments, |s| s + 1);
        match &mut out {
            None => out = Some(Placed { zero_unix_s: log.zero_unix_s.map(|z| z - zero_s), ..log }),
            Some(all) => append(all, log),
        }
    }
    Ok((out.context("no flight to read")?, clock.notes))
}

fn append(all: &mut Placed, log: Placed) {
    all.flight.time_s.extend(&log.flight.time_s);
    all.flight.segment.extend(&log.flight.segment);
    all.flight.columns_mut().into_iter().zip(log.flight.columns()).for_each(|(column, more)| column.extend(more));
    // Columns that not all logs have are of no use here.
    all.flight.extra.clear();
    all.flight.speed_m_s = None;
    all.origins.extend::<Vec<Origin>>(log.origins);
}

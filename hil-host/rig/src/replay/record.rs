//! A recorded flight: what the controller was given, cycle by cycle.

use crate::flight::frames::{self, Entry, Start};
use anyhow::{Context, bail, ensure};
use control::Config;
use signals::{Abort, Answer, SensorFrame};
use std::path::Path;

/// One control cycle and what came before it.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// What was measured.
    pub frame: SensorFrame,
    /// What was answered.
    pub answer: Answer,
    /// What the controller was told between the last cycle and this one.
    pub before: Before,
}

/// What happens to a controller besides its frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Before {
    /// Nothing.
    Nothing,
    /// Its supply was interrupted.
    Reset,
    /// It was called home.
    Recall,
}

/// A recorded flight.
#[derive(Clone, Debug)]
pub struct Record {
    /// What the controller was given first.
    pub start: Start,
    /// Its cycles.
    pub steps: Vec<Step>,
    /// Why it can be replayed no further than this; none: it is whole.
    pub ends: Option<String>,
}

/// Number of the first frame of a mission, at most.
const FIRST_SEQ: u32 = 1;
/// Table in use, and none where the controller has its own.
const NO_TABLE: u32 = 0;

impl Record {
    /// Reads the record of a flight. `given` says what a log of a board does not hold.
    ///
    /// # Errors
    /// No record, a damaged one, or one without what the controller was given and nobody gives it.
    pub fn read(path: &Path, given: Option<Start>) -> anyhow::Result<Self> {
        Self::of(&frames::read(path)?, given).with_context(|| path.display().to_string())
    }

    /// From the entries of a file.
    ///
    /// # Errors
    /// As above.
    pub fn of(entries: &[Entry], given: Option<Start>) -> anyhow::Result<Self> {
        let recorded = entries.iter().find_map(|e| if let Entry::Start(start) = e { Some(start.clone()) } else { None });
        let Some(start) = recorded.or(given) else {
            bail!(
                "a board's log does not hold its mission: name the one that was flown with --mission (and --config, --table if they were uploaded)"
            );
        };
        let (mut steps, mut ends): (Vec<Step>, _) = (Vec::new(), None);
        let mut before = Before::Nothing;
        for entry in entries {
            let (frame, answer) = match entry {
                Entry::Start(_) => continue,
                Entry::Reset => {
                    before = Before::Reset;
                    continue;
                }
                Entry::Cycle(frame, answer) => (frame, answer),
            };
            let last = steps.last();
            if let Some(why) = gap(last, frame, answer) {
                ends = Some(why);
                break;
            }
            let new_cause = answer.trace.abort.filter(|_| last.is_none_or(|l| l.answer.trace.abort.is_none()));
            if new_cause == Some(Abort::Operator) {
                before = Before::Recall;
            }
            steps.push(Step { frame: *frame, answer: *answer, before });
            before = Before::Nothing;
        }
        ensure!(!steps.is_empty(), "{}", ends.unwrap_or_else(|| "no control cycle is in it".to_owned()));
        Ok(Self { start, steps, ends })
    }

    /// The configuration that was flown.
    ///
    /// # Errors
    /// No configuration that a controller of this release takes.
    pub fn config(&self) -> anyhow::Result<Config> {
        Config::new(self.start.settings).map_err(|e| anyhow::anyhow!("the configuration that was flown is refused by this release: {e:?}"))
    }

    /// Identity of the table that was flown; none: no cycle had one.
    #[must_use]
    pub fn table_id(&self) -> Option<u32> {
        self.steps.iter().map(|s| s.answer.trace.table_id).find(|id| *id != NO_TABLE)
    }

    /// Time of a cycle since the first, s.
    #[must_use]
    pub fn time_s(&self, index: usize) -> f64 {
        let time = |i: usize| self.steps.get(i).map_or(0, |s| s.frame.time.0);
        time(index).saturating_sub(time(0)) as f64 * 1e-6
    }

    /// The cycle at a time since the first, or the last one before it.
    #[must_use]
    pub fn index(&self, time_s: f64) -> usize {
        let start = self.steps.first().map_or(0, |s| s.frame.time.0);
        let until = start.saturating_add((time_s.max(0.0) * 1e6) as u64);
        self.steps.partition_point(|s| s.frame.time.0 <= until).saturating_sub(1)
    }
}

/// Why a law cannot be stepped on to this cycle with what the record holds.
fn gap(last: Option<&Step>, frame: &SensorFrame, answer: &Answer) -> Option<String> {
    let seconds = frame.time.0 as f64 * 1e-6;
    let cause = answer.trace.abort.filter(|_| last.is_none_or(|l| l.answer.trace.abort.is_none()));
    if matches!(cause, Some(Abort::LinkLost | Abort::Overrun)) {
        return Some(format!(
            "at {seconds:.0} s of the board's clock {cause:?} came from outside the law, with steps that are in no record"
        ));
    }
    match last {
        None if frame.seq > FIRST_SEQ => Some(format!("it begins with cycle {}: the law's state before it is not known", frame.seq)),
        Some(last) if frame.seq != last.frame.seq.wrapping_add(1) => Some(format!(
            "cycles {} to {} are not in it (a board keeps every cycle for about six hours, then fewer): the law's state after them is not known",
            last.frame.seq.wrapping_add(1),
            frame.seq.wrapping_sub(1)
        )),
        _ => None,
    }
}

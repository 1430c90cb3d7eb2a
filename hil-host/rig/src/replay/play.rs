//! A record stepped through a law.

use super::difference::{Difference, differences, same_orders};
use super::record::{Before, Record};
use crate::seats::{Seat, SeatError};
use anyhow::Context;
use signals::{Abort, Answer};

/// What came of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Played {
    /// Cycles stepped.
    pub cycles: usize,
    /// Of them those with a signal that differs.
    pub differing: usize,
    /// The first of them.
    pub first: Option<First>,
    /// The first cycle with an order to an actuator that differs: after it the sensors are no longer those of this law's flight.
    pub first_order: Option<usize>,
    /// First cause of an abort and its cycle: as recorded, and by this law.
    pub aborts: [Option<(usize, Abort)>; 2],
}

/// The first cycle with a signal that differs.
#[derive(Clone, Debug, PartialEq)]
pub struct First {
    /// Its number.
    pub cycle: usize,
    /// What this law answers.
    pub answer: Answer,
    /// Signals that differ, from cause to effect.
    pub differences: Vec<Difference>,
}

/// Gives a law what the controller was given before its first frame; `table` instead of the recorded one.
///
/// # Errors
/// The law does not answer, or refuses what it is given.
pub fn begin(seat: &mut dyn Seat, record: &Record, table: Option<&[u8]>) -> anyhow::Result<u32> {
    let manifest = seat.hello()?;
    seat.configure(&manifest, &record.config()?)?;
    let table = table.unwrap_or(&record.start.table);
    if !table.is_empty() {
        seat.tabulate(record.start.mission.wings, table)?;
    }
    Ok(seat.begin(&record.start.mission)?)
}

/// One cycle, and what the controller was told before it.
///
/// # Errors
/// The law does not answer.
pub fn step(seat: &mut dyn Seat, record: &Record, index: usize) -> Result<Answer, SeatError> {
    let Some(step) = record.steps.get(index) else { return Ok(Answer::default()) };
    match step.before {
        Before::Nothing => {}
        Before::Reset => seat.reset()?,
        Before::Recall => seat.recall()?,
    }
    seat.exchange(&step.frame)
}

/// Steps a record through a law and compares. `watch` sees every cycle's answer; it may end the replay.
///
/// # Errors
/// The law does not answer, or refuses what it is given.
pub fn play(
    seat: &mut dyn Seat,
    record: &Record,
    table: Option<&[u8]>,
    watch: &mut dyn FnMut(usize, &Answer) -> bool,
) -> anyhow::Result<Played> {
    begin(seat, record, table)?;
    let mut played = Played { cycles: 0, differing: 0, first: None, first_order: None, aborts: [None, None] };
    for (i, recorded) in record.steps.iter().enumerate() {
        let answer = step(seat, record, i).with_context(|| format!("cycle {i}"))?;
        played.take(i, &recorded.answer, &answer);
        if !watch(i, &answer) {
            break;
        }
    }
    Ok(played)
}

impl Played {
    /// Whether every bit is as recorded.
    #[must_use]
    pub fn is_equal(&self) -> bool {
        self.differing == 0
    }

    fn take(&mut self, i: usize, recorded: &Answer, answer: &Answer) {
        self.cycles += 1;
        let found = differences(recorded, answer);
        if !found.is_empty() {
            self.differing += 1;
            self.first.get_or_insert(First { cycle: i, answer: *answer, differences: found });
        }
        if self.first_order.is_none() && !same_orders(recorded, answer) {
            self.first_order = Some(i);
        }
        for (first, of) in self.aborts.iter_mut().zip([recorded, answer]) {
            if first.is_none() {
                *first = of.trace.abort.map(|abort| (i, abort));
            }
        }
    }
}

//! Any time of a recorded flight in the law that is built here: copies of the controller at regular times, and steps from the last
//! of them.

use super::play::begin;
use super::record::{Before, Record};
use crate::seats::Link;
use crate::seats::in_process::{Board, InProcess};
use control::mutant::{Mutant, set};
use signals::{Answer, ToBoard, ToHost};

/// Cycles between two copies: a seek steps through fewer.
const BETWEEN: usize = 1024;

/// A law in the middle of a recorded flight.
pub struct Stepper<'a> {
    record: &'a Record,
    /// The controller before cycle [`BETWEEN`] × its place.
    copies: Vec<Board>,
    now: Board,
    /// The next cycle.
    at: usize,
}

impl<'a> Stepper<'a> {
    /// At the start of a flight.
    ///
    /// # Errors
    /// The law refuses what it is given.
    pub fn new(record: &'a Record, table: Option<&[u8]>) -> anyhow::Result<Self> {
        let mut link = Link::new(InProcess::default());
        begin(&mut link, record, table)?;
        let now = link.wire().board().clone();
        Ok(Self { record, copies: Vec::new(), now, at: 0 })
    }

    /// The next cycle.
    #[must_use]
    pub fn at(&self) -> usize {
        self.at
    }

    /// What the law has learned of its table by now: factors of the drag level, the drag due to lift and the lift.
    pub fn learned(&mut self) -> Option<[f32; 3]> {
        self.now.helm().learned()
    }

    /// One cycle; none at the end of the record, and where the law refuses the frame.
    pub fn step(&mut self) -> Option<Answer> {
        let step = self.record.steps.get(self.at)?;
        if self.at == BETWEEN * self.copies.len() {
            self.copies.push(self.now.clone());
        }
        self.at += 1;
        match step.before {
            Before::Nothing => {}
            Before::Reset => self.now.reset(),
            Before::Recall => drop(self.now.helm().handle(ToBoard::Recall)),
        }
        match self.now.helm().handle(ToBoard::Sensor(step.frame)) {
            ToHost::Answer(answer) => Some(answer),
            _ => None,
        }
    }

    /// Goes to a cycle, to step it next.
    pub fn seek(&mut self, index: usize) {
        let known = (index / BETWEEN).min(self.copies.len().saturating_sub(1));
        if let Some(copy) = self.copies.get(known)
            && (index < self.at || BETWEEN * known > self.at)
        {
            (self.now, self.at) = (copy.clone(), BETWEEN * known);
        }
        while self.at < index && self.step().is_some() {}
    }

    /// The watches of this law that explain another one's answer at a cycle: broken like this, this law gives it too. The law of
    /// the whole process is broken meanwhile: nothing else may fly.
    pub fn broken_alike(&mut self, index: usize, other: &Answer) -> Vec<Mutant> {
        let from = (index / BETWEEN).saturating_sub(1) * BETWEEN;
        self.seek(from);
        let (start, at) = (self.now.clone(), self.at);
        let copies = std::mem::take(&mut self.copies);
        let as_recorded = |mutant: &Mutant| {
            set(&[*mutant]);
            (self.now, self.at) = (start.clone(), at);
            let mut answer = None;
            while self.at <= index {
                answer = self.step();
            }
            set(&[]);
            self.copies.clear();
            answer.is_some_and(|a| super::difference::differences(other, &a).is_empty())
        };
        let found = Mutant::all().filter(as_recorded).collect();
        (self.now, self.at, self.copies) = (start, at, copies);
        found
    }
}

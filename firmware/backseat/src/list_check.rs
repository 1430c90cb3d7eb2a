//! Is the glider's list of sensors ours? Its file is asked for, block by block, up to four times.
//!
//! A line that was damaged on the way makes another list of ours, so a difference is believed when it was read twice without damage.

use crate::base64;
use crate::ini::{IniError, Item, Reader};
use crate::sensors::{Generation, List};
use signals::Micros;

/// No block for so long: the file is asked for again.
const BLOCK: Micros = Micros::from_secs(4);
const TRIES: u8 = 4;
const MISMATCHES: u8 = 2;

/// What is to be done next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Next {
    Nothing,
    /// Ask for the file.
    Ask,
    /// Ask for the next block.
    GoOn,
    /// It is ours.
    Ours,
    /// It is another one.
    Other,
    /// It cannot be read.
    Unreadable,
}

/// Reading the file.
#[derive(Clone, Debug)]
pub(crate) struct ListCheck {
    list: List,
    reader: Reader,
    /// When it was asked for, or the last block came, or a try failed.
    since: Micros,
    /// Between two tries.
    pausing: bool,
    tries: u8,
    mismatches: u8,
    same: bool,
    /// Damaged lines before the first block of this try.
    damaged: Option<u32>,
}

impl ListCheck {
    pub(crate) const fn new(list: List) -> Self {
        Self { list, reader: Reader::new(), since: Micros(0), pausing: false, tries: 0, mismatches: 0, same: true, damaged: None }
    }

    /// Whether it is time to ask.
    pub(crate) fn poll(&mut self, now: Micros) -> Next {
        let due = self.tries == 0 || (self.pausing && now.since(self.since) > self.pause());
        if due {
            if self.tries >= TRIES {
                return Next::Unreadable;
            }
            let (tries, mismatches) = (self.tries.saturating_add(1), self.mismatches);
            *self = Self { since: now, tries, mismatches, ..Self::new(self.list) };
            return Next::Ask;
        }
        if !self.pausing && now.since(self.since) >= BLOCK {
            self.failed(now);
        }
        Next::Nothing
    }

    /// Between two tries, 1 to 4 s: what damages a line may have a period.
    fn pause(&self) -> Micros {
        let spread = self.since.0.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33;
        Micros(1_000_000u64.saturating_add(spread % 3_000_000))
    }

    /// This try is lost.
    pub(crate) fn failed(&mut self, now: Micros) {
        (self.pausing, self.since) = (true, now);
    }

    /// A block of the file; an empty one is its end. `damaged`: lines damaged so far.
    pub(crate) fn block(&mut self, now: Micros, damaged: u32, block: &[u8]) -> Next {
        if self.pausing || self.tries == 0 {
            return Next::Nothing;
        }
        let before = *self.damaged.get_or_insert(damaged);
        if block.is_empty() {
            return self.end(now, damaged == before);
        }
        self.since = now;
        let Self { list, reader, same, .. } = self;
        let decoded = base64::decode(block, |byte| *same &= is_ours(*list, reader.push(byte)));
        match decoded {
            Err(_) => {
                self.failed(now);
                Next::Nothing
            }
            Ok(()) if self.list.generation == Generation::Newer => Next::GoOn,
            Ok(()) => Next::Nothing,
        }
    }

    fn end(&mut self, now: Micros, undamaged: bool) -> Next {
        let last = self.reader.finish();
        if self.same && is_ours(self.list, last) && self.reader.sensors() == self.list.count() {
            return Next::Ours;
        }
        self.mismatches = self.mismatches.saturating_add(u8::from(undamaged));
        if self.mismatches >= MISMATCHES {
            return Next::Other;
        }
        self.failed(now);
        Next::Nothing
    }
}

/// Whether a line of the glider's file is that of our list.
fn is_ours(list: List, item: Option<Result<Item, IniError>>) -> bool {
    match item {
        None | Some(Ok(Item::Baud(_) | Item::PacketSize(_))) => true,
        Some(Ok(Item::Sensor { index, section, name, .. })) => {
            list.get(index).is_some_and(|ours| ours.name == name.as_str()) && list.section(index) == Some(section)
        }
        Some(Err(_)) => false,
    }
}

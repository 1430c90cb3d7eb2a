//! What each sentence of the glider changes.

use super::{Core, HEARD_AGAIN, HEARD_WITHIN, Stage, State};
use crate::list_check::{ListCheck, Next};
use crate::readings::Fate;
use crate::sensors::{Generation, Sensor};
use crate::sentence::{self, FromGlider, Pairs, words};
use signals::Micros;

impl Core {
    pub(super) fn sentence(&mut self, now: Micros, damaged: u32, body: &[u8]) {
        self.heard_line = now;
        match sentence::read(body) {
            FromGlider::Hi => {
                self.heard = now;
                self.relink(now);
            }
            FromGlider::By => {
                if !matches!(self.state, State::Wait | State::Lost) {
                    self.state = State::Paused;
                    self.paused = now;
                    // Whoever starts it again may have changed the list.
                    if self.stage != Stage::Other {
                        self.stage = Stage::List;
                    }
                }
            }
            FromGlider::Sensors(pairs) => self.sensors(now, pairs),
            FromGlider::File(block) if self.reads_list() => {
                let next = self.check.block(now, damaged, block);
                self.go_on(now, next);
            }
            FromGlider::Error(_) => {
                self.counters.errors = self.counters.errors.saturating_add(1);
                if self.reads_list() {
                    self.check.failed(now);
                }
            }
            FromGlider::Next => self.report.taken(now, &mut self.voice),
            FromGlider::File(_) | FromGlider::Directory(_) => {}
            FromGlider::Unknown => self.counters.unknown_sentences = self.counters.unknown_sentences.saturating_add(1),
        }
    }

    fn sensors(&mut self, now: Micros, pairs: Pairs<'_>) {
        self.heard = now;
        match self.state {
            State::Wait | State::Paused => self.relink(now),
            State::Late => {
                let aborted = self.last.is_some_and(|answer| answer.trace.abort.is_some());
                self.state = if aborted { State::Listen } else { State::Ready };
            }
            State::Lost | State::Linked | State::Mute | State::Ready | State::Listen => {}
        }
        let mut believed = false;
        for pair in pairs.iter() {
            let fate = match pair {
                Some((index, value)) => {
                    let fate = self.readings.take(index, value, now);
                    if index == Sensor::Time.index()
                        && fate == Fate::Taken
                        && let Some(glider_s) = value
                    {
                        self.pace.glider_time(now, glider_s);
                    }
                    fate
                }
                None => Fate::UnknownIndex,
            };
            let c = &mut self.counters;
            let counter = match fate {
                Fate::Taken => {
                    believed = true;
                    continue;
                }
                Fate::NewLevel => {
                    believed = true;
                    &mut c.new_levels
                }
                Fate::OutOfRange => &mut c.out_of_range,
                Fate::TooFast => &mut c.too_fast,
                Fate::UnknownIndex | Fate::Ours => &mut c.unknown_pairs,
            };
            *counter = counter.saturating_add(1);
        }
        self.pace.fresh |= believed;
        if believed && self.state == State::Lost {
            self.hear_again(now);
        }
    }

    /// A lost line speaks; the window begins with the first sentence heard.
    fn hear_again(&mut self, now: Micros) {
        let (first, count) = self.heard_again;
        self.heard_again = if count == 0 || now.since(first) > HEARD_WITHIN { (now, 1) } else { (first, count.saturating_add(1)) };
        if self.heard_again.1 < HEARD_AGAIN {
            return;
        }
        if matches!(self.stage, Stage::Echo { .. }) {
            self.state = State::Listen;
            self.opened = now;
        } else {
            self.relink(now);
        }
    }

    /// The glider's program started, or is heard for the first time: its list may be another one now.
    fn relink(&mut self, now: Micros) {
        if self.state == State::Paused {
            self.resumed = now;
        }
        self.state = State::Linked;
        self.stage = Stage::List;
        self.readings.clear();
        self.check = ListCheck::new(self.list);
        self.voice.begin_anew();
        self.pace.forget();
    }

    /// Goes on with the glider's list as its check says.
    pub(super) fn go_on(&mut self, now: Micros, next: Next) {
        let newer = self.list.generation == Generation::Newer;
        let body = match next {
            Next::Nothing => return,
            Next::Ask if newer => words(&[b"FR", b"extctl.ini", b"config"]),
            Next::Ask => words(&[b"FR", b"extctl.ini"]),
            Next::GoOn => words(&[b"GO"]),
            Next::Ours => {
                self.stage = Stage::Echo { sent: now, tries: 0 };
                return;
            }
            Next::Other => {
                self.stage = Stage::Other;
                return self.mute(b"backseat: extctl.ini is another one, mute");
            }
            Next::Unreadable => return self.mute(b"backseat: extctl.ini cannot be read, mute"),
        };
        if let Ok(body) = body {
            self.voice.send(&body);
        }
    }

    fn reads_list(&self) -> bool {
        self.state == State::Linked && self.stage == Stage::List
    }
}

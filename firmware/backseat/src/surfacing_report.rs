//! The short message of a surfacing ([`signals::surfacing`]), to the shore by way of the glider.
//!
//! Once per surfacing: in a step that sees the vehicle at the surface, when the shore is heard, or after [`WAITS`] such steps.
//!
//! | | newer software | older |
//! |---|---|---|
//! | file `TTTTTTTT.srf` among the science computer's `logs` | `FW`, `FO`; after each `NEXT` another `FO`, after the last `FC` | `FW`, `FO` …, `FC` |
//! | lines on the glider's terminal, one a step | `TXT,surfacing,` and a piece of the message in base64 | none |
//!
//! `TTTTTTTT` is the glider's time, s, in hex. Without `NEXT` both sentences are said again, [`TRIES`] times at most.

use crate::base64;
use crate::line::to_hex;
use crate::sensors::Generation;
use crate::voice::Voice;
use signals::surfacing::{Bytes, OfGlides, is_dive, is_up};
use signals::{Answer, Evidence, Micros, SensorFrame};

/// Steps at the surface after which the message is made without word from shore: a minute.
const WAITS: u8 = 15;
/// Times that a file is offered.
const TRIES: u8 = 4;
/// The glider takes a block within this, else the file is offered again from its start.
const NEXT_WITHIN: Micros = Micros::from_secs(8);
/// Bytes of a piece, so that its line has room for them: a message without a packet is one piece, one with it three.
const PIECE: usize = 55;

type Block = heapless::Vec<u8, { PIECE.div_ceil(3) * 4 }>;

/// A message on its way, piece by piece: as a file, and as lines of text.
#[derive(Clone, Debug)]
struct File {
    name: [u8; 12],
    message: Bytes,
    /// Pieces that were said as text, and that the glider took.
    said: u8,
    taken: u8,
    tries: u8,
    offered: Option<Micros>,
    /// As a file it is written, or given up.
    filed: bool,
}

impl File {
    /// A piece in base64; none beyond the last.
    fn piece(&self, number: u8) -> Option<Block> {
        let mut block = Block::new();
        base64::encode(self.message.chunks(PIECE).nth(usize::from(number))?, &mut block).ok()?;
        Some(block)
    }

    /// One more piece as text.
    fn say(&mut self, voice: &mut Voice) {
        if let Some(block) = self.piece(self.said) {
            voice.say_fields(&[b"TXT", b"surfacing", &block]);
            self.said = self.said.saturating_add(1);
        }
    }
}

/// Evidence since the last message, and the message that is on its way.
#[derive(Clone, Debug)]
pub(crate) struct Report {
    evidence: Option<Evidence>,
    /// Steps at the surface since the last dive.
    surfaced: u8,
    reported: bool,
    file: Option<File>,
}

impl Report {
    pub(crate) const fn new() -> Self {
        Self { evidence: None, surfaced: 0, reported: false, file: None }
    }

    /// Takes a step; begins a report where one is due. One piece of it is said as text in each step.
    pub(crate) fn take(
        &mut self,
        frame: &SensorFrame,
        answer: &Answer,
        glider_s: f64,
        voice: &mut Voice,
        glides: impl FnOnce() -> Option<OfGlides>,
    ) {
        if let Some(file) = &mut self.file {
            file.say(voice);
            if file.filed && file.piece(file.said).is_none() {
                self.file = None;
            }
        }
        let evidence = self.evidence.get_or_insert_with(Evidence::default);
        evidence.take(frame, answer);
        if is_dive(&answer.trace) {
            (self.surfaced, self.reported) = (0, false);
        }
        if self.reported || !is_up(&answer.trace) {
            return;
        }
        self.surfaced = self.surfaced.saturating_add(1);
        if !frame.surface.comms && self.surfaced < WAITS {
            return;
        }
        evidence.carry(glides());
        let message = evidence.told().encode();
        let mut file = File { name: name(glider_s), message, said: 0, taken: 0, tries: 0, offered: None, filed: false };
        file.say(voice);
        self.file = Some(file);
        (self.reported, self.evidence) = (true, None);
    }

    /// Offers the file where that is due.
    pub(crate) fn poll(&mut self, now: Micros, voice: &mut Voice) {
        let Some(file) = self.file.as_mut().filter(|file| !file.filed) else { return };
        if file.offered.is_some_and(|at| now.since(at) < NEXT_WITHIN) {
            return;
        }
        if file.tries >= TRIES {
            file.filed = true;
            return;
        }
        (file.tries, file.offered, file.taken) = (file.tries.saturating_add(1), Some(now), 0);
        voice.send_words(&[b"FW", &file.name, b"logs"]);
        self.send_piece(voice);
        while voice.generation() == Generation::Older && self.file.as_ref().is_some_and(|file| !file.filed) {
            self.taken(now, voice);
        }
    }

    fn send_piece(&self, voice: &mut Voice) {
        if let Some(block) = self.file.as_ref().and_then(|file| file.piece(file.taken)) {
            voice.send_words(&[b"FO", &block]);
        }
    }

    /// The glider took the block: the next one, or the end.
    pub(crate) fn taken(&mut self, now: Micros, voice: &mut Voice) {
        let Some(file) = self.file.as_mut().filter(|file| file.offered.is_some() && !file.filed) else { return };
        (file.taken, file.offered) = (file.taken.saturating_add(1), Some(now));
        if file.piece(file.taken).is_some() {
            self.send_piece(voice);
            return;
        }
        file.filed = true;
        voice.send_words(&[b"FC"]);
    }
}

/// Eight hex digits and an ending: as long as the science computer allows.
fn name(glider_s: f64) -> [u8; 12] {
    let mut name = *b"00000000.srf";
    let mut left = glider_s as u32;
    for place in name.iter_mut().take(8).rev() {
        *place = to_hex(left as u8).to_ascii_lowercase();
        left >>= 4;
    }
    name
}

//! The short message of a surfacing ([`signals::surfacing`]), to the shore by way of the glider.
//!
//! Once per surfacing: in a step that sees the vehicle at the surface, when the shore is heard, or after [`WAITS`] such steps.
//!
//! | | newer software | older |
//! |---|---|---|
//! | file `TTTTTTTT.srf` among the science computer's `logs` | `FW`, `FO`; after `NEXT` `FC` | `FW`, `FO`, `FC` |
//! | line on the glider's terminal | `TXT,surfacing,` and the message in base64 | none |
//!
//! `TTTTTTTT` is the glider's time, s, in hex. Without `NEXT` both sentences are said again, [`TRIES`] times at most.

use crate::base64;
use crate::line::to_hex;
use crate::sensors::Generation;
use crate::voice::Voice;
use signals::surfacing::{SURFACING_BYTES, is_dive, is_up};
use signals::{Answer, Evidence, Micros, SensorFrame};

/// Steps at the surface after which the message is made without word from shore: a minute.
const WAITS: u8 = 15;
/// Times that a file is offered.
const TRIES: u8 = 4;
/// The glider takes a block within this, else it is offered again.
const NEXT_WITHIN: Micros = Micros::from_secs(8);

type Block = heapless::Vec<u8, { SURFACING_BYTES.div_ceil(3) * 4 }>;

/// A file on its way.
#[derive(Clone, Debug)]
struct File {
    name: [u8; 12],
    block: Block,
    tries: u8,
    offered: Option<Micros>,
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

    /// Takes a step; begins a report where one is due.
    pub(crate) fn take(&mut self, frame: &SensorFrame, answer: &Answer, glider_s: f64, voice: &mut Voice) {
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
        let mut block = Block::new();
        if base64::encode(&evidence.told().encode(), &mut block).is_ok() {
            voice.say_fields(&[b"TXT", b"surfacing", &block]);
            self.file = Some(File { name: name(glider_s), block, tries: 0, offered: None });
        }
        (self.reported, self.evidence) = (true, None);
    }

    /// Offers the file where that is due.
    pub(crate) fn poll(&mut self, now: Micros, voice: &mut Voice) {
        let Some(file) = &mut self.file else { return };
        if file.offered.is_some_and(|at| now.since(at) < NEXT_WITHIN) {
            return;
        }
        if file.tries >= TRIES {
            self.file = None;
            return;
        }
        (file.tries, file.offered) = (file.tries.saturating_add(1), Some(now));
        voice.send_words(&[b"FW", &file.name, b"logs"]);
        voice.send_words(&[b"FO", &file.block]);
        if voice.generation() == Generation::Older {
            self.taken(voice);
        }
    }

    /// The glider took the block.
    pub(crate) fn taken(&mut self, voice: &mut Voice) {
        if self.file.take_if(|file| file.offered.is_some()).is_some() {
            voice.send_words(&[b"FC"]);
        }
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

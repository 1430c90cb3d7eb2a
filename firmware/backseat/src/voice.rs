//! What is said, and whether it arrives: sentences on their way out, the parameters and mode bits sent last.

use crate::Unfit;
use crate::orders::{self, bits};
use crate::readings::Readings;
use crate::sensors::{Generation, List, Sensor};
use crate::sentence::{self, Body, words};
use signals::Micros;

/// Bytes on their way out.
const OUTBOX: usize = 640;
/// Orders of so many cycles may still be on their way.
const ORDERS_ON_THE_WAY: usize = 4;
/// Parameters agree within this.
const ECHO_WITHIN: f32 = 1e-3;
/// Cycles without an echo of ours after which they count.
const UNECHOED: u8 = 5;
/// Mode bits that are set are sent again after this.
const MODE_AGAIN: Micros = Micros::from_secs(16);

/// Texts that are said once.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Once {
    NoMission = 1,
    NoEcho = 2,
}

/// See the file's text.
#[derive(Clone, Debug)]
pub(crate) struct Voice {
    list: List,
    out: heapless::Deque<u8, OUTBOX>,
    sent: [Option<[f32; 5]>; ORDERS_ON_THE_WAY],
    unechoed: u8,
    mode: Option<(u32, Micros)>,
    said: u8,
    /// Sentences that did not fit the line.
    pub(crate) dropped: u32,
    /// Orders with a value that must not be sent.
    pub(crate) unsendable: u32,
}

impl Voice {
    pub(crate) const fn new(list: List) -> Self {
        Self {
            list,
            out: heapless::Deque::new(),
            sent: [None; ORDERS_ON_THE_WAY],
            unechoed: 0,
            mode: None,
            said: 0,
            dropped: 0,
            unsendable: 0,
        }
    }

    /// The glider may have forgotten all that was said.
    pub(crate) fn begin_anew(&mut self) {
        (self.sent, self.unechoed, self.mode, self.said) = ([None; ORDERS_ON_THE_WAY], 0, None, 0);
    }

    /// For another list, before anything is said.
    pub(crate) const fn expect(&mut self, list: List) {
        self.list = list;
    }

    pub(crate) fn has_to_say(&self) -> bool {
        !self.out.is_empty()
    }

    pub(crate) fn next_byte(&mut self) -> Option<u8> {
        self.out.pop_front()
    }

    /// A whole sentence, or none of it.
    pub(crate) fn send(&mut self, body: &Body) {
        let framed = sentence::framed(body).unwrap_or_default();
        let room = self.out.capacity().saturating_sub(self.out.len()) >= framed.len();
        if !room || framed.is_empty() {
            self.dropped = self.dropped.saturating_add(1);
            return;
        }
        for byte in &framed {
            let _ = self.out.push_back(*byte);
        }
    }

    /// The five parameters.
    pub(crate) fn write(&mut self, values: &[f32; 5]) {
        match orders::sentences(values) {
            Ok(bodies) => {
                bodies.iter().for_each(|body| self.send(body));
                let [first, second, third, _] = self.sent;
                self.sent = [Some(*values), first, second, third];
            }
            Err(Unfit) => self.unsendable = self.unsendable.saturating_add(1),
        }
    }

    /// The mode bits wanted, when they change and again while one is set.
    pub(crate) fn mode(&mut self, wanted: u32, now: Micros) {
        let due = match self.mode {
            None => true,
            Some((sent, at)) => sent != wanted || (wanted != 0 && now.since(at) >= MODE_AGAIN),
        };
        if due && let Ok(body) = sentence::mode(bits::ALL, wanted) {
            self.send(&body);
            self.mode = Some((wanted, now));
        }
    }

    /// The mode bits are sent anew at the next order.
    pub(crate) fn forget_mode(&mut self) {
        self.mode = None;
    }

    /// Which software listens.
    pub(crate) const fn generation(&self) -> Generation {
        self.list.generation
    }

    /// A sentence of text fields.
    pub(crate) fn send_words(&mut self, fields: &[&[u8]]) {
        match words(fields) {
            Ok(body) => self.send(&body),
            Err(Unfit) => self.dropped = self.dropped.saturating_add(1),
        }
    }

    /// A line on the glider's terminal.
    pub(crate) fn say(&mut self, text: &[u8]) {
        self.say_fields(&[b"TXT", text]);
    }

    /// The same, of several fields: the first is `TXT`.
    pub(crate) fn say_fields(&mut self, fields: &[&[u8]]) {
        if self.generation() == Generation::Newer {
            self.send_words(fields);
        }
    }

    pub(crate) fn say_once(&mut self, what: Once, text: &[u8]) {
        if self.said & what as u8 == 0 {
            self.said |= what as u8;
            self.say(text);
        }
    }

    /// Whether the list has echoes of the parameters.
    pub(crate) fn has_echo(&self) -> bool {
        self.list.get(Sensor::EchoBallast.index()).is_some()
    }

    /// Whether the parameters sent last came back since.
    pub(crate) fn arrived(&self, readings: &Readings, since: Micros) -> bool {
        self.sent.first().copied().flatten().is_some_and(|values| is_echoed(readings, &values, since))
    }

    /// Whether the parameters in use have for many cycles been none of those sent; to be asked once per cycle.
    pub(crate) fn is_unheard(&mut self, readings: &Readings) -> bool {
        if !self.has_echo() || self.sent.iter().any(Option::is_none) {
            return false;
        }
        let known = self.sent.iter().flatten().any(|values| is_echoed(readings, values, Micros(0)));
        self.unechoed = if known { 0 } else { self.unechoed.saturating_add(1) };
        self.unechoed > UNECHOED
    }
}

fn is_echoed(readings: &Readings, values: &[f32; 5], since: Micros) -> bool {
    let echoes = [Sensor::EchoBallast, Sensor::EchoMass, Sensor::EchoFin, Sensor::EchoDive, Sensor::EchoClimb];
    let near = |(sensor, value): (&Sensor, &f32)| readings.since(*sensor, since).is_some_and(|v| libm::fabsf(v - value) < ECHO_WITHIN);
    echoes.iter().zip(values).all(near)
}

//! The board's half of the line with a toy law: what it is told, and what it says.

#![allow(dead_code)] // each test uses its part of it

use crate::sensors::List;
use crate::{Generation, Law, Limits, Session, Setup, Targets};
use signals::surfacing::OfGlides;
use signals::{Abort, ActuatorCommand, Answer, Micros, Phase, SensorFrame, Trace};

/// A law that dives, and comes up for good when the line is lost.
#[derive(Default)]
pub struct Toy {
    /// Frames it was stepped with.
    pub frames: Vec<SensorFrame>,
    /// The silence that it was first told of.
    pub lost: Option<Micros>,
    /// A mission is under way: it was begun, or was before a reset.
    pub under_way: bool,
    /// What it answers instead of a dive.
    pub answers: Option<(Phase, f32)>,
    /// What the glides say.
    pub glides: Option<OfGlides>,
    silences: u64,
}

impl Toy {
    fn answer(&self, seq: u32) -> Answer {
        let (ballast_m3, phase, abort, depth_m) = match (self.lost, self.answers) {
            (Some(_), _) => (236e-6, Phase::Safe, Some(Abort::LinkLost), f32::NAN),
            (None, Some((phase, depth_m))) => (236e-6, phase, None, depth_m),
            (None, None) => (-236e-6, Phase::Dive, None, f32::NAN),
        };
        Answer {
            command: ActuatorCommand { seq, ballast_m3, battery_mass_m: 0.0127, ..Default::default() },
            trace: Trace { phase, abort, depth_m, ..Default::default() },
        }
    }
}

impl Law for Toy {
    fn begin(&mut self, _: &Limits) -> Option<Targets> {
        self.under_way = true;
        Some(Targets { dive_m: 195.0, climb_m: 2.0 })
    }

    fn glides(&mut self) -> Option<OfGlides> {
        self.glides.take()
    }

    fn step(&mut self, frame: &SensorFrame) -> Option<Answer> {
        if !self.under_way {
            return None;
        }
        self.frames.push(*frame);
        self.silences = 0;
        Some(self.answer(frame.seq))
    }

    fn silent(&mut self, silence: Micros) -> Option<Answer> {
        let due = silence.since(Micros::from_secs(60)).0 / 4_000_000;
        let more = due > self.silences;
        self.silences = due;
        if !more || !self.under_way {
            return None;
        }
        self.lost.get_or_insert(silence);
        Some(self.answer(0))
    }
}

pub fn limits() -> Limits {
    Limits { ballast_m3: 236e-6, battery_m: 0.0254, fin_rad: 0.45, battery_step_m: 1.8e-3 }
}

pub fn line(body: &str) -> String {
    format!("${body}*{:02x}\r\n", crate::line::checksum(body.as_bytes()))
}

/// Session, law and clock.
pub struct Bench {
    pub session: Session,
    pub law: Toy,
    pub now_ms: u64,
    pub said: String,
    pub list: List,
}

impl Bench {
    pub fn new(list: List) -> Self {
        let session = Session::new(Setup { list, rho_kg_m3: 1025.0, limits: limits() });
        Self { session, law: Toy::default(), now_ms: 0, said: String::new(), list }
    }

    pub fn now(&self) -> Micros {
        Micros::from_millis(self.now_ms)
    }

    pub fn hear(&mut self, bytes: &[u8]) {
        for b in bytes {
            self.session.byte(self.now(), *b);
        }
        self.poll();
    }

    pub fn poll(&mut self) {
        let now = self.now();
        self.session.poll(now, &mut self.law);
        while let Some(b) = self.session.next_byte() {
            self.said.push(char::from(b));
        }
    }

    pub fn wait(&mut self, ms: u64) {
        for _ in 0..ms / 100 {
            self.now_ms += 100;
            self.poll();
        }
    }

    pub fn said(&mut self) -> String {
        std::mem::take(&mut self.said)
    }

    pub fn ini(&self) -> String {
        let mut text = String::from("mp # parameters\n");
        for index in 0..self.list.count() {
            let entry = self.list.get(index).expect("in the list");
            match (self.list.generation, index) {
                (Generation::Older, 0) => text = "os\n".to_owned(),
                (Generation::Newer, 5) => text += "os\n",
                (_, 8) => text += "is\n",
                _ => {}
            }
            text += &format!("{} {}\n", entry.name, if index < 5 && self.list.generation == Generation::Newer { "" } else { entry.unit });
        }
        text
    }

    /// Sends a file in blocks of 600; the session asks for the next one, or not.
    pub fn send_file(&mut self, text: &str) {
        for block in text.as_bytes().chunks(600) {
            let mut encoded = heapless::Vec::<u8, 900>::new();
            crate::base64::encode(block, &mut encoded).expect("room");
            self.hear(line(&format!("FI,{}", String::from_utf8_lossy(&encoded))).as_bytes());
            self.wait(200);
        }
        self.hear(line("FI").as_bytes());
    }

    /// Lets time pass and sends the file as often as it is asked for.
    pub fn serve(&mut self, text: &str, ms: u64) {
        let mut asked = 0;
        for _ in 0..ms / 200 {
            let now = self.said.matches("$FR,").count();
            if now > asked {
                asked = now;
                self.send_file(text);
            }
            self.wait(200);
        }
    }

    /// Up to READY.
    pub fn open(&mut self) {
        self.hear(b"$HI*01\r\n");
        self.wait(200);
        let ini = self.ini();
        self.send_file(&ini);
        self.wait(300);
        self.hear(line("SD,31:0,9:10").as_bytes());
        self.wait(200);
    }

    pub fn cycle(&mut self, depth: f64) {
        self.hear(line(&format!("SD,8:{},9:{depth}", 1_767_225_600.0 + self.now_ms as f64 * 1e-3)).as_bytes());
        self.wait(4000);
    }
}

//! The computer at the line: sentences in and out, files, and the way to the flight computer.
//!
//! Written apart from the board's half: both are held against sentences of public projects, not only against each other.

use crate::{OnBadWrite, Switches};
use std::collections::{BTreeMap, VecDeque};

/// Median time between this computer and the flight computer, s (public logs: 1.9 and 2.1 s, at most 4.3 s).
pub const LAG_S: f64 = 2.0;
/// Sensors in one `SD`.
const PAIRS: usize = 4;
/// A parameter that jumps by more in one cycle is noted, cc or its unit: four seconds of the slowest pump.
const JUMP: f32 = 16.0;

/// What reaches the flight computer.
#[derive(Clone, Debug, PartialEq)]
pub enum Write {
    /// A parameter, by number.
    Parameter(usize, f32),
    /// Mode bits under a mask.
    Mode(u32, u32),
}

/// The list of sensors as the glider reads it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct List {
    /// Section and name, by index.
    pub sensors: Vec<(String, String)>,
    /// Bytes of a file in one block.
    pub packet_size: usize,
    /// Whether there is a section `mp`.
    pub newer: bool,
}

impl List {
    /// Reads `extctl.ini`.
    #[must_use]
    pub fn read(text: &str) -> Self {
        let mut list = Self { packet_size: 600, ..Self::default() };
        let mut section = String::new();
        for line in text.lines() {
            let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
            match words.as_slice() {
                [] => {}
                [word @ ("mp" | "os" | "is" | "baud" | "packet_size")] => {
                    section = (*word).to_owned();
                    list.newer |= *word == "mp";
                }
                ["packet_size", n] => list.packet_size = n.parse().unwrap_or(600),
                ["baud", _] => {}
                [n, ..] if section == "packet_size" => list.packet_size = n.parse().unwrap_or(600),
                [_, ..] if section == "baud" => {}
                [name, ..] => list.sensors.push((section.clone(), (*name).to_owned())),
            }
        }
        list
    }

    fn index_of(&self, name: &str) -> Option<usize> {
        self.sensors.iter().position(|(section, n)| section == "is" && n == name)
    }
}

/// The science computer's program for the backseat.
#[derive(Debug)]
pub struct Science {
    list: List,
    switches: Switches,
    /// Files by name.
    pub files: BTreeMap<String, Vec<u8>>,
    line: Vec<u8>,
    reading: VecDeque<Vec<u8>>,
    writing: Option<(String, Vec<u8>)>,
    to_flight: VecDeque<(f64, Write)>,
    to_line: VecDeque<(f64, String)>,
    /// Between this computer and the flight computer, s.
    pub lag_s: f64,
    /// The program runs.
    pub on: bool,
    first: bool,
    last: BTreeMap<usize, f32>,
    /// When the board was last heard with a right checksum, s.
    pub heard_s: Option<f64>,
    /// What an operator would read.
    pub log: Vec<String>,
    /// Sentences of the board that were taken.
    pub taken: Vec<(f64, String)>,
    /// Lines of the board with a wrong checksum or none.
    pub damaged: u32,
}

fn sum(body: &[u8]) -> u8 {
    body.iter().fold(0, |s, b| s ^ b)
}

fn framed(body: &str) -> String {
    format!("${body}*{:02x}\r\n", sum(body.as_bytes()))
}

/// Up to 15 significant digits, no exponent, as `%.15g` writes such numbers.
fn shown(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let before = value.abs().log10().floor() as i32 + 1;
    let text = format!("{value:.*}", usize::try_from(15 - before.max(-4)).unwrap_or(0));
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

fn base64(bytes: &[u8]) -> String {
    let mut out = heapless::Vec::<u8, 1024>::new();
    let _ = backseat::base64::encode(bytes, &mut out);
    String::from_utf8(out.to_vec()).unwrap_or_default()
}

impl Science {
    /// With this `extctl.ini` in its `config`.
    #[must_use]
    pub fn new(ini: &str, switches: Switches) -> Self {
        Self {
            list: List::read(ini),
            switches,
            files: BTreeMap::from([("extctl.ini".to_owned(), ini.as_bytes().to_vec())]),
            line: Vec::new(),
            reading: VecDeque::new(),
            writing: None,
            to_flight: VecDeque::new(),
            to_line: VecDeque::new(),
            lag_s: LAG_S,
            on: false,
            first: true,
            last: BTreeMap::new(),
            heard_s: None,
            log: Vec::new(),
            taken: Vec::new(),
            damaged: 0,
        }
    }

    /// The program starts or stops.
    pub fn switch(&mut self, on: bool, now_s: f64) {
        if on != self.on {
            self.say(now_s, if on { "HI" } else { "BY" });
            (self.on, self.first) = (on, true);
        }
    }

    fn say(&mut self, now_s: f64, body: &str) {
        self.to_line.push_back((now_s, framed(body)));
    }

    /// Sensors that the flight computer updated at `now_s`, by name.
    pub fn sensors(&mut self, now_s: f64, updated: &[(&str, f64)]) {
        if !self.on {
            return;
        }
        let pairs: Vec<String> = updated
            .iter()
            .filter(|(_, value)| value.is_finite())
            .filter_map(|(name, value)| self.list.index_of(name).map(|i| format!("{i}:{}", shown(*value))))
            .collect();
        // At first all sensors in one sentence.
        let per_line = if std::mem::take(&mut self.first) { 32 } else { PAIRS };
        for some in pairs.chunks(per_line) {
            self.to_line.push_back((now_s + self.lag_s, framed(&format!("SD,{}", some.join(",")))));
        }
    }

    /// Sentences that are due on the line.
    pub fn due_on_line(&mut self, now_s: f64, out: &mut Vec<u8>) {
        while self.to_line.front().is_some_and(|(due, _)| *due <= now_s) {
            if let Some((_, text)) = self.to_line.pop_front() {
                out.extend(text.bytes());
            }
        }
    }

    /// Writes that have reached the flight computer.
    pub fn due_in_flight(&mut self, now_s: f64) -> Vec<Write> {
        let n = self.to_flight.iter().take_while(|(due, _)| *due <= now_s).count();
        self.to_flight.drain(..n).map(|(_, write)| write).collect()
    }

    /// Bytes of the board.
    pub fn bytes(&mut self, now_s: f64, bytes: &[u8]) {
        for byte in bytes {
            if *byte != b'\r' && *byte != b'\n' {
                self.line.push(*byte);
                continue;
            }
            let line = std::mem::take(&mut self.line);
            if line.is_empty() || !self.on {
                continue;
            }
            let text = String::from_utf8_lossy(&line).into_owned();
            match text.rsplit_once('$').and_then(|(_, f)| f.rsplit_once('*')) {
                Some((body, hex)) if hex.len() == 2 && u8::from_str_radix(hex, 16) == Ok(sum(body.as_bytes())) => {
                    let body = body.to_owned();
                    self.heard_s = Some(now_s);
                    self.sentence(now_s, &body);
                    self.taken.push((now_s, body));
                }
                _ => self.damaged += 1,
            }
        }
    }

    fn sentence(&mut self, now_s: f64, body: &str) {
        let fields: Vec<&str> = body.split(',').collect();
        match fields.as_slice() {
            ["SW", pairs @ ..] => {
                for pair in pairs {
                    self.write(now_s, pair);
                }
            }
            ["MD", mask, value] => {
                if let (Ok(mask), Ok(value)) = (mask.parse(), value.parse()) {
                    self.to_flight.push_back((now_s + self.lag_s, Write::Mode(mask, value)));
                }
            }
            ["TXT", text @ ..] => self.log.push(format!("{now_s:.0} s: {}", text.join(","))),
            ["FR", name, ..] => match self.files.get(*name) {
                Some(bytes) => {
                    self.reading = bytes.chunks(self.list.packet_size.clamp(1, 725)).map(<[u8]>::to_vec).collect();
                    self.block(now_s);
                    while !self.list.newer && !self.reading.is_empty() {
                        self.block(now_s);
                    }
                    if !self.list.newer {
                        self.say(now_s, "FI");
                    }
                }
                None => self.say(now_s, "ER,2"),
            },
            ["GO"] if self.list.newer => self.block(now_s),
            ["FW", name, ..] => self.writing = Some(((*name).to_owned(), Vec::new())),
            ["FO", block] => {
                let mut taken = Vec::new();
                let fine = backseat::base64::decode(block.as_bytes(), |b| taken.push(b)).is_ok();
                if let (true, Some((name, bytes))) = (fine, &mut self.writing) {
                    bytes.extend(taken);
                    if !self.switches.needs_close {
                        self.files.insert(name.clone(), bytes.clone());
                    }
                    self.say(now_s, "NEXT");
                } else {
                    self.say(now_s, "ER,3");
                }
            }
            ["FC"] => {
                if let Some((name, bytes)) = self.writing.take() {
                    self.files.insert(name, bytes);
                }
            }
            ["LS", ..] => {
                let names: String = self.files.keys().map(|n| format!("c:/config/{n},")).collect();
                self.say(now_s, &format!("DIR,{names}"));
            }
            _ => self.log.push(format!("{now_s:.0} s: unknown sentence {body}")),
        }
    }

    fn block(&mut self, now_s: f64) {
        match self.reading.pop_front() {
            Some(bytes) => {
                let block = base64(&bytes);
                self.say(now_s, &format!("FI,{block}"));
            }
            None => self.say(now_s, "FI"),
        }
    }

    fn write(&mut self, now_s: f64, pair: &str) {
        let parsed = pair.split_once(':').and_then(|(i, v)| Some((i.parse::<usize>().ok()?, v.parse::<f64>().ok()?)));
        let Some((index, value)) = parsed.filter(|(_, v)| v.is_finite()) else {
            self.log.push(format!("{now_s:.0} s: bad pair {pair}"));
            return;
        };
        let (on_bad, name) = match self.list.sensors.get(index) {
            None => (self.switches.bad_index, String::new()),
            Some((section, name)) if section == "is" => (self.switches.input_write, name.clone()),
            Some((_, name)) => (OnBadWrite::Take, name.clone()),
        };
        match on_bad {
            OnBadWrite::Ignore => return,
            OnBadWrite::Error => {
                self.say(now_s, "ER,1");
                return;
            }
            OnBadWrite::Take => {}
        }
        let letter = name.strip_prefix("u_mission_param_").and_then(|l| l.bytes().next());
        if let Some(number) = letter.map(|l| usize::from(l.wrapping_sub(b'a'))) {
            let value = value as f32;
            if let Some(before) = self.last.insert(number, value)
                && (value - before).abs() > JUMP
            {
                self.log.push(format!("{now_s:.0} s: {name} jumps from {before} to {value}"));
            }
            self.to_flight.push_back((now_s + self.lag_s, Write::Parameter(number, value)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{List, framed, shown};

    #[test]
    fn validate_numbers_and_sentences_of_a_captured_trace() {
        for (value, text) in [(0.0, "0"), (42.75, "42.75"), (1_767_225_604.01, "1767225604.01"), (-0.3491, "-0.3491")] {
            assert_eq!(shown(value), text);
        }
        assert!(shown(670.4 / 3.0).len() <= 16);
        assert_eq!(framed("SD,8:1767225604.01,9:42.75,11:-0.3491"), "$SD,8:1767225604.01,9:42.75,11:-0.3491*39\r\n");
        assert_eq!(framed("FI"), "$FI*0f\r\n");
    }

    #[test]
    fn the_list_is_read_in_both_generations() {
        let newer = List::read("mp\nu_mission_param_a\nos # ours\nsci_generic_a nodim\nis\nm_depth m\nbaud\n9600\npacket_size\n500\n");
        assert_eq!((newer.sensors.len(), newer.packet_size, newer.newer), (3, 500, true));
        assert!(!List::read("os\nu_mission_param_a X\nis\nm_depth m\n").newer);
    }
}

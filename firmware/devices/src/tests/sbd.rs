//! The modem's driver against answers from the command reference, right and damaged: it ends, and believes no session that was none.

use crate::sbd::{End, LIMIT_MS, OFF_MS, Sbd, Step, Why};
use embedded_hal::digital::{self, OutputPin};
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use proptest::prelude::*;
use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;

/// A modem that answers at once, and what may be wrong with it.
#[derive(Default)]
struct Modem {
    powered: bool,
    switched: u32,
    coming: VecDeque<u8>,
    line: Vec<u8>,
    expects: Option<usize>,
    loaded: Vec<u8>,
    number: u16,
    commands: Vec<String>,
    shore: Vec<Vec<u8>>,
    /// Status of the next sessions, then 0.
    statuses: VecDeque<u16>,
    /// A session is said to have gone well and has not.
    lies: bool,
    deaf: bool,
    stuck: bool,
    silent: bool,
    /// What happens to the n-th byte that it sends: taken out, doubled, or bits of it turned.
    damage: Vec<(usize, u16)>,
    said: usize,
    /// Random bytes in place of all answers.
    noise: Option<Vec<u8>>,
}

impl Modem {
    fn say(&mut self, text: &str) {
        if self.silent {
            return;
        }
        for byte in text.bytes() {
            let damage = self.damage.iter().find(|(at, _)| *at == self.said).map(|(_, how)| *how);
            self.said += 1;
            match damage {
                Some(256) => {}
                Some(257) => self.coming.extend([byte, byte]),
                Some(bits) => self.coming.push_back(byte ^ bits as u8),
                None => self.coming.push_back(byte),
            }
        }
    }

    fn take(&mut self, byte: u8) {
        self.line.push(byte);
        if let Some(n) = self.expects {
            if self.line.len() == n + 2 {
                let sum = self.line.split_off(n);
                self.loaded = std::mem::take(&mut self.line);
                self.expects = None;
                let right = self.loaded.iter().map(|b| u16::from(*b)).sum::<u16>().to_be_bytes();
                self.say(if sum == right { "\r\n0\r\n\r\nOK\r\n" } else { "\r\n2\r\n\r\nOK\r\n" });
            }
            return;
        }
        if byte != b'\r' {
            return;
        }
        let command = String::from_utf8(std::mem::take(&mut self.line)).expect("text").trim_end().to_owned();
        self.commands.push(command.clone());
        match command.as_str() {
            "AT+CSQ" => self.say(if self.deaf { "\r\n+CSQ:0\r\n\r\nOK\r\n" } else { "\r\n+CSQ:3\r\n\r\nOK\r\n" }),
            "AT+SBDS" => {
                let text = format!("\r\n+SBDS: {}, {}, 0, -1\r\n\r\nOK\r\n", u8::from(!self.loaded.is_empty()), self.number);
                self.say(&text);
            }
            "AT+SBDIX" => {
                let status = self.statuses.pop_front().unwrap_or(0);
                let text = format!("\r\n+SBDIX: {status}, {}, {}, 0, 0, 0\r\n\r\nOK\r\n", self.number, if status > 4 { 2 } else { 0 });
                if status <= 4 && !self.lies {
                    self.number = self.number.wrapping_add(1);
                    self.shore.push(self.loaded.clone());
                }
                self.say(&text);
            }
            _ => match command.strip_prefix("AT+SBDWB=") {
                Some(n) => {
                    self.expects = Some(n.parse().expect("a length"));
                    self.say("\r\nREADY\r\n");
                }
                None => self.say("\r\nOK\r\n"),
            },
        }
    }
}

#[derive(Clone, Default)]
struct Wire(Rc<RefCell<Modem>>);

impl ErrorType for Wire {
    type Error = Infallible;
}
impl Read for Wire {
    fn read(&mut self, out: &mut [u8]) -> Result<usize, Infallible> {
        let mut modem = self.0.borrow_mut();
        Ok(out.iter_mut().zip(std::iter::from_fn(|| modem.coming.pop_front())).map(|(to, byte)| *to = byte).count())
    }
}
impl ReadReady for Wire {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        let mut modem = self.0.borrow_mut();
        if let Some(noise) = modem.noise.clone()
            && modem.coming.is_empty()
        {
            modem.coming.extend(noise);
        }
        Ok(!modem.coming.is_empty())
    }
}
impl Write for Wire {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        bytes.iter().for_each(|byte| self.0.borrow_mut().take(*byte));
        Ok(bytes.len())
    }
    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
impl WriteReady for Wire {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.0.borrow().stuck)
    }
}
impl digital::ErrorType for Wire {
    type Error = Infallible;
}
impl OutputPin for Wire {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.borrow_mut().powered = false;
        Ok(())
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        let mut modem = self.0.borrow_mut();
        (modem.powered, modem.switched) = (true, modem.switched + 1);
        modem.loaded.clear();
        Ok(())
    }
}

/// Sends one message; how it ended, and when.
fn send(modem: Modem, message: &[u8]) -> (End, u64, Rc<RefCell<Modem>>) {
    let wire = Wire(Rc::new(RefCell::new(modem)));
    let mut driver = Sbd::new(wire.clone(), wire.clone());
    let mut now_ms = OFF_MS;
    assert!(!wire.0.borrow().powered && driver.begin(message, now_ms));
    loop {
        assert!(wire.0.borrow().powered);
        if let Some(end) = driver.poll(now_ms) {
            assert!(!wire.0.borrow().powered && driver.step() == Step::Off);
            return (end, now_ms - OFF_MS, wire.0);
        }
        now_ms += 20;
        assert!(now_ms < OFF_MS + LIMIT_MS + 10_000, "it hangs at {:?}", driver.step());
    }
}

const SENT: End = End::Sent { incoming: false, waiting: 0 };

#[test]
fn validate_a_message_goes_out_as_the_command_reference_says() {
    let (end, took_ms, modem) = send(Modem { number: 65_535, ..Modem::default() }, b"hello");
    let modem = modem.borrow();
    assert_eq!((end, modem.shore.as_slice()), (SENT, &[b"hello".to_vec()][..]), "and the number of sessions goes round");
    let said: Vec<&str> = modem.commands.iter().map(String::as_str).collect();
    assert_eq!(said, ["AT", "ATE0", "AT&D0", "AT&K0", "AT+SBDMTA=0", "AT+CSQ", "AT+SBDWB=5", "AT+SBDS", "AT+SBDIX", "AT+SBDS", "AT*F"]);
    assert!(took_ms < 12_000, "{took_ms} ms with a modem that answers at once");
    for length in [1, 9, 10, 54, 99, 100] {
        let message: Vec<u8> = (0..length).map(|i| 255 - i).collect();
        let (end, _, modem) = send(Modem::default(), &message);
        assert_eq!((end, &modem.borrow().shore[0]), (SENT, &message), "{length} bytes");
    }
    let wire = Wire::default();
    let mut driver = Sbd::new(wire.clone(), wire);
    assert!(!driver.begin(&[], 9_000) && !driver.begin(&[0; 101], 9_000) && !driver.begin(&[1], OFF_MS - 1));
}

#[test]
fn each_failure_is_named_and_bounded() {
    let failed = |modem: Modem| {
        let (end, took_ms, modem) = send(modem, &[7; 54]);
        assert!(modem.borrow().shore.is_empty());
        (end, took_ms)
    };
    assert_eq!(failed(Modem { silent: true, ..Modem::default() }).0, End::Failed(Why::Silent));
    assert_eq!(failed(Modem { stuck: true, ..Modem::default() }).0, End::Failed(Why::Silent));
    assert_eq!(failed(Modem { deaf: true, ..Modem::default() }).0, End::Failed(Why::NoNetwork));
    for status in [5, 10, 18, 32, 35, 36, 65_535] {
        assert_eq!(failed(Modem { statuses: [status].into(), ..Modem::default() }).0, End::Failed(Why::Status(status)));
    }
    assert_eq!(failed(Modem { lies: true, ..Modem::default() }).0, End::Failed(Why::Unproven));
}

/// `+SBDIX: 32` without its 3 is a success, and so is 13 without its 1: one line alone proves nothing.
#[test]
fn a_byte_lost_doubled_or_turned_makes_no_session() {
    for status in [10, 13, 18, 32, 36] {
        let all = send(Modem { statuses: [status].into(), ..Modem::default() }, &[7; 54]).2.borrow().said;
        for at in 0..all {
            for how in [1, 2, 4, 8, 16, 32, 64, 128, 256, 257] {
                let modem = Modem { statuses: [status].into(), damage: vec![(at, how)], ..Modem::default() };
                let (end, _, modem) = send(modem, &[7; 54]);
                assert!(modem.borrow().shore.is_empty() == matches!(end, End::Failed(_)), "status {status}, byte {at}, {how}: {end:?}");
            }
        }
    }
}

#[test]
fn a_stop_in_any_step_is_off_in_three_seconds_and_no_word_from_shore() {
    for after_ms in (0..12_000).step_by(100) {
        let wire = Wire::default();
        let mut driver = Sbd::new(wire.clone(), wire.clone());
        assert!(driver.begin(&[7; 54], OFF_MS));
        let mut end = None;
        let mut stopped = None;
        for ms in (OFF_MS..OFF_MS + after_ms + 3_100).step_by(20) {
            if ms >= OFF_MS + after_ms && stopped.is_none() {
                stopped = Some(driver.step());
                driver.stop(ms);
            }
            end = end.or(driver.poll(ms));
        }
        assert!(!wire.0.borrow().powered, "{after_ms} ms");
        match stopped {
            Some(Step::Off | Step::Flush) => assert_eq!(end, Some(SENT)),
            _ => assert_eq!(end, Some(End::Failed(Why::Stopped)), "{stopped:?}"),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn prop_random_bytes_end_in_time_and_are_no_word_from_shore(noise in prop::collection::vec(any::<u8>(), 1..400), stuck: bool) {
        let (end, took_ms, _) = send(Modem { silent: true, noise: Some(noise), stuck, ..Modem::default() }, &[7; 54]);
        prop_assert!(matches!(end, End::Failed(_)), "{end:?}");
        prop_assert!(took_ms <= LIMIT_MS + 3_020);
    }

    #[test]
    fn prop_lines_of_its_own_in_any_order_are_bounded(
        lines in prop::collection::vec(
            prop::sample::select(&["OK", "ERROR", "READY", "0", "2", "+CSQ:0", "+CSQ:4", "+SBDS: 1, 5, 0, -1", "+SBDS: 1, 6, 0, -1",
                "+SBDIX: 0, 5, 0, 0, 0, 0", "+SBDIX: 32, 5, 2, 0, 0, 0", "SBDRING"][..]), 1..40)
    ) {
        let noise: Vec<u8> = lines.iter().flat_map(|line| format!("\r\n{line}\r\n").into_bytes()).collect();
        let (_, took_ms, _) = send(Modem { silent: true, noise: Some(noise), ..Modem::default() }, &[7; 54]);
        prop_assert!(took_ms <= LIMIT_MS + 3_020);
    }

    /// Any bytes taken out, doubled or turned: what is believed has taken place, and what failed is said to have failed.
    #[test]
    fn prop_damaged_answers_make_no_session(
        damage in prop::collection::vec((0usize..260, 0u16..258), 1..6),
        statuses in prop::collection::vec(prop::sample::select(&[0u16, 2, 10, 13, 17, 18, 32, 35, 36][..]), 1..3),
        number in prop::sample::select(&[0u16, 9, 99, 999, 65_535][..]),
    ) {
        let (end, took_ms, modem) = send(Modem { damage, statuses: statuses.into(), number, ..Modem::default() }, &[7; 54]);
        let shore = modem.borrow().shore.len();
        prop_assert!(took_ms <= LIMIT_MS + 3_020);
        if let End::Sent { .. } = end {
            prop_assert_eq!(shore, 1);
        }
    }
}

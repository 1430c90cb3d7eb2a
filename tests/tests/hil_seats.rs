//! The same messages through every seat, and what a seat says when nobody, or
//! somebody else, is at the other end.

use hil_host::seats::in_process::InProcess;
use hil_host::seats::port::Port;
use hil_host::seats::pty::{Pty, Terminal};
use hil_host::seats::{Link, Seat, SeatError, Wire};
use signals::link::CRC32;
use signals::{Micros, Mission, Reading, SensorFrame};
use std::time::Duration;

fn frame(seq: u32) -> SensorFrame {
    SensorFrame {
        seq,
        time: Micros::from_secs(4 * u64::from(seq)),
        depth_m: Reading::now(0.1 * seq as f32),
        pitch_rad: Reading::now(-0.2),
        ..SensorFrame::default()
    }
}

fn talk(seat: &mut dyn Seat) -> Vec<signals::Answer> {
    seat.hello().unwrap();
    seat.begin(&Mission::default()).unwrap();
    (0..50).map(|seq| seat.exchange(&frame(seq)).unwrap()).collect()
}

#[test]
fn hil_in_process_and_pseudo_terminal_give_equal_answers() {
    let direct = talk(&mut Link::new(InProcess::default()));
    let serial = talk(&mut Link::new(Pty::new().unwrap()));
    assert_eq!(direct, serial);
}

/// Loses every third frame on the way there, damages every fifth on the way back.
struct Noisy {
    inner: InProcess,
    sent: u32,
    received: u32,
}

impl Wire for Noisy {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.sent += 1;
        if self.sent.is_multiple_of(3) { Ok(()) } else { self.inner.send(bytes) }
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> std::io::Result<usize> {
        let n = self.inner.receive(into, wait)?;
        if n > 0 {
            self.received += 1;
            if self.received.is_multiple_of(5) {
                into[n / 2] ^= 0x10;
            }
        }
        Ok(n)
    }

    fn describe(&self) -> String {
        "noisy line".to_owned()
    }
}

#[test]
fn lost_and_damaged_frames_are_sent_again_and_change_no_answer() {
    let clean = talk(&mut Link::new(InProcess::default()));
    let mut noisy = Link::new(Noisy { inner: InProcess::default(), sent: 0, received: 0 });
    assert_eq!(talk(&mut noisy), clean);
    assert!(noisy.resent > 10, "{} frames were sent again", noisy.resent);
}

#[test]
fn a_board_of_another_wire_version_is_named() {
    let terminal = Terminal::serve(|_, out| {
        // Version 9, CRC right: version ‖ one byte ‖ crc, in COBS (no zero inside).
        let body = [9u8, 1];
        let mut raw = body.to_vec();
        raw.extend_from_slice(&CRC32.checksum(&body).to_le_bytes());
        assert!(!raw.contains(&0));
        out.push(raw.len() as u8 + 1);
        out.extend_from_slice(&raw);
        out.push(0);
    })
    .unwrap();
    let mut seat = Link::new(Port::open(&terminal.name).unwrap());
    let e = seat.hello().unwrap_err();
    assert!(matches!(e, SeatError::Version { theirs: 9, .. }), "{e}");
    assert!(!e.to_string().contains('\n'));
}

#[test]
fn silence_is_given_up_on() {
    let terminal = Terminal::serve(|_, _| {}).unwrap();
    let mut seat = Link::new(Port::open(&terminal.name).unwrap()).patience(Duration::from_millis(600));
    assert!(matches!(seat.hello().unwrap_err(), SeatError::NoAnswer { .. }));
}

#[test]
fn a_pulled_plug_is_an_error_and_not_a_wait() {
    let terminal = Terminal::with_controller().unwrap();
    let mut seat = Link::new(Port::open(&terminal.name).unwrap());
    seat.hello().unwrap();
    drop(terminal);
    let e = seat.hello().unwrap_err();
    assert!(matches!(e, SeatError::Lost { .. } | SeatError::NoAnswer { .. }), "{e}");
}

//! The same messages through every seat, and what a seat says when nobody, or
//! somebody else, is at the other end.

use control::{Config, Settings};
use rig::flight::closed_loop::recover;
use rig::seats::in_process::InProcess;
use rig::seats::link::upload::upload;
use rig::seats::port::Port;
use rig::seats::pty::{Pty, Terminal};
use rig::seats::{Link, Seat, SeatError, Wire};
use signals::link::{CRC32, MAX_WIRE, WIRE_VERSION};
use signals::{Micros, Mission, Object, Reading, Refusal, Reply, Request, SensorFrame, ToBoard, ToHost, decode, encode};
use std::time::Duration;

fn frame(seq: u32) -> SensorFrame {
    SensorFrame {
        seq,
        time: Micros::from_secs(4 * u64::from(seq)),
        depth_m: Reading::now(0.1 * seq as f32),
        pitch_rad: Reading::now(-0.2),
        ballast_m3: Reading::now(230e-6),
        battery_mass_m: Reading::now(0.0),
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
        // Another version, CRC right: version ‖ one byte ‖ crc, in COBS (no zero inside).
        let body = [WIRE_VERSION + 1, 1];
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
    assert!(matches!(e, SeatError::Version { theirs, .. } if theirs == WIRE_VERSION + 1), "{e}");
    assert!(!e.to_string().contains('\n'));
}

#[test]
fn silence_is_given_up_on_and_noise_is_not_called_silence() {
    let told = |answer: &'static [u8]| {
        let terminal = Terminal::serve(move |_, out| out.extend_from_slice(answer)).unwrap();
        let mut seat = Link::new(Port::open(&terminal.name).unwrap()).patience(Duration::from_millis(600));
        let e = seat.hello().unwrap_err();
        assert!(matches!(e, SeatError::NoAnswer { .. }));
        e.to_string()
    };
    let silence = told(b"");
    assert!(silence.contains("not a byte came"), "{silence}");
    for noise in [&b"\x00\x00\x00"[..], b"\xe0\x1c\xfe\x80\xf8\x00\x1c", b"NuttShell (NSH)\r\nnsh> "] {
        let said = told(noise);
        assert!(said.contains("none of them a frame") && said.contains("baud rate") && !said.contains('\n'), "{said}");
    }
}

/// The board with another program on the same line: what that one says and is answered.
struct Shared {
    inner: InProcess,
    /// Said by the other program before every frame of ours.
    other: Vec<Request>,
    /// Comes to us before every answer, as one to another request.
    stray: Vec<ToHost>,
    to: u16,
}

fn framed(reply: &Reply) -> Vec<u8> {
    let mut out = [0; MAX_WIRE];
    let n = encode(reply, &mut out).unwrap();
    out[..n].to_vec()
}

impl Wire for Shared {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        for request in std::mem::take(&mut self.other) {
            let mut out = [0; MAX_WIRE];
            let n = encode(&request, &mut out).unwrap();
            self.inner.send(&out[..n])?;
        }
        let request: Request = decode(&mut bytes[..bytes.len() - 1].to_vec()).unwrap();
        self.to = request.id.wrapping_add(1000);
        self.inner.send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], wait_for: Duration) -> std::io::Result<usize> {
        let stray: Vec<u8> = self.stray.iter().flat_map(|said| framed(&Reply { to: self.to, message: said.clone() })).collect();
        into[..stray.len()].copy_from_slice(&stray);
        let n = self.inner.receive(&mut into[stray.len()..], wait_for)?;
        Ok(if n == 0 { 0 } else { n + stray.len() })
    }

    fn describe(&self) -> String {
        "shared line".to_owned()
    }
}

#[test]
fn replies_to_somebody_else_end_nothing() {
    let stray = vec![ToHost::Refused(Refusal::Safe), ToHost::Done { crc: 0 }, ToHost::Refused(Refusal::Session)];
    let mut shared = Link::new(Shared { inner: InProcess::default(), other: vec![], stray, to: 0 });
    assert_eq!(talk(&mut shared), talk(&mut Link::new(InProcess::default())));
}

#[test]
fn a_hello_of_another_program_ends_no_flight() {
    let hello = |nonce| Request { session: 0, id: 9, message: ToBoard::Hello { nonce } };
    let mut link = Link::new(Shared { inner: InProcess::default(), other: vec![], stray: vec![], to: 0 });
    link.hello().unwrap();
    link.begin(&Mission::default()).unwrap();
    for seq in 0..3 {
        link.wire().other = vec![hello(seq)];
        assert_eq!(link.exchange(&frame(seq)).unwrap().command.seq, seq);
    }
    link.wire().other = vec![hello(77)];
    link.recall().unwrap();
    assert_eq!(link.exchange(&frame(3)).unwrap().trace.abort, Some(signals::Abort::Operator));
}

#[test]
fn what_was_uploaded_in_between_is_noticed_and_not_flown() {
    let mut link = Link::new(InProcess::default());
    let manifest = link.hello().unwrap();
    link.configure(&manifest, &Config::default()).unwrap();
    let mut bytes = helm::Content::new();
    helm::objects::config_bytes(&Config::new(Settings { crush_depth_m: 240.0, ..Settings::default() }).unwrap(), &mut bytes);
    helm::Storage::save(link.wire().board().helm().storage(), Object::Config, &bytes).unwrap();
    let e = link.begin(&Mission::default()).unwrap_err();
    assert!(matches!(e, SeatError::Other { what: "configuration", .. }), "{e}");
    assert!(!link.hello().unwrap().under_way, "and the mission is called off");
}

#[test]
fn a_configuration_beyond_the_vehicles_limits_is_refused_by_the_board() {
    let mut link = Link::new(InProcess::default());
    link.hello().unwrap();
    let settings = Settings { crush_depth_m: 9000.0, undervoltage_v: 0.0, no_comms_s: u32::MAX, ..Settings::default() };
    let mut bytes = helm::Content::new();
    helm::objects::config_bytes(&Config::new(settings).unwrap(), &mut bytes);
    let e = upload(&mut link, Object::Config, &bytes, |_, _| {}).unwrap_err().to_string();
    assert!(e.contains("CrushDepth") && !e.contains('\n'), "{e}");
}

#[test]
fn a_mission_whose_host_went_away_is_named_and_can_be_taken_back() {
    let mut link = Link::new(InProcess::default());
    link.hello().unwrap();
    link.begin(&Mission::default()).unwrap();
    for seq in 0..3 {
        link.exchange(&frame(seq)).unwrap();
    }
    // Another program on the same board.
    let mut next = Link::new(std::mem::take(link.wire()));
    let manifest = next.hello().unwrap();
    assert_eq!((manifest.under_way, manifest.last_seq), (true, Some(2)));
    let e = next.begin(&Mission::default()).unwrap_err();
    assert!(matches!(e, SeatError::Refused { why: Refusal::UnderWay, .. }), "{e}");
    assert!(e.to_string().contains("under way") && e.to_string().contains("--recover"), "{e}");
    assert!(matches!(next.exchange(&frame(2000)), Err(SeatError::Refused { why: Refusal::Sequence { last: 2 }, .. })));
    recover(&mut next).unwrap();
    next.begin(&Mission::default()).unwrap();
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

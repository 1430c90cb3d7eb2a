//! The image in QEMU against the same session on the host: equal messages in,
//! equal answers out, over a real byte stream.
//!
//! Needs the image (`scripts/build-firmware`) and `qemu-system-arm`; says so
//! loudly where they are missing.

use helm::{Boot, Helm, RamStorage};
use signals::link::MAX_WIRE;
use signals::{Micros, Mission, Reading, Receiver, Refusal, Reply, Request, SensorFrame, Switch, ToBoard, ToHost, encode};
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// QEMU with the image, killed when dropped.
struct Board {
    qemu: Child,
    line: UnixStream,
    receiver: Receiver,
    folder: PathBuf,
    session: u32,
    id: u16,
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.qemu.kill();
        let _ = self.qemu.wait();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

fn image() -> Option<PathBuf> {
    let target =
        std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../target"), PathBuf::from);
    let elf = target.join("thumbv7em-none-eabihf/flight/firmware");
    let qemu = Command::new("qemu-system-arm").arg("--version").stdout(Stdio::null()).status();
    if elf.is_file() && qemu.is_ok_and(|s| s.success()) {
        return Some(elf);
    }
    eprintln!("skipped: no image at {} or no qemu-system-arm; scripts/build-firmware makes the image", elf.display());
    None
}

impl Board {
    fn start(elf: &Path, name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("glider-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let socket = folder.join("line");
        let qemu = Command::new("qemu-system-arm")
            .args(["-M", "netduinoplus2", "-display", "none", "-monitor"])
            .arg(format!("unix:{},server=on,wait=off", folder.join("monitor").display()))
            .arg("-serial")
            .arg(format!("unix:{},server=on,wait=on", socket.display()))
            .arg("-serial")
            .arg(format!("file:{}", folder.join("log").display()))
            .arg("-kernel")
            .arg(elf)
            .stdin(Stdio::null())
            .spawn()
            .unwrap();
        let deadline = Instant::now() + Duration::from_secs(20);
        let line = loop {
            match UnixStream::connect(&socket) {
                Ok(line) => break line,
                Err(e) => assert!(Instant::now() < deadline, "no line: {e}"),
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        line.set_read_timeout(Some(Duration::from_millis(500))).unwrap();
        Self { qemu, line, receiver: Receiver::new(), folder, session: 0, id: 0 }
    }

    /// The reset pin: RAM stays.
    fn reset(&mut self) {
        let mut monitor = UnixStream::connect(self.folder.join("monitor")).unwrap();
        monitor.write_all(b"system_reset\n").unwrap();
        std::thread::sleep(Duration::from_millis(500));
        self.receiver = Receiver::new();
    }

    fn send(&mut self, message: &ToBoard) {
        let mut wire = [0; MAX_WIRE];
        let request = Request { session: self.session, id: self.id, message: message.clone() };
        let n = encode(&request, &mut wire).unwrap();
        self.line.write_all(&wire[..n]).unwrap();
    }

    fn hear(&mut self) -> Option<ToHost> {
        let mut buffer = [0; 1];
        loop {
            match self.line.read(&mut buffer) {
                Ok(1) => {
                    if let Some(Ok(Reply { to, message })) = self.receiver.push(buffer[0])
                        && to == self.id
                    {
                        return Some(message);
                    }
                }
                Ok(_) => panic!("QEMU closed the line"),
                Err(_) => return None,
            }
        }
    }

    /// Asks until answered; a frame may be asked again, it is not stepped again.
    fn ask(&mut self, message: &ToBoard) -> ToHost {
        self.id += 1;
        for _ in 0..40 {
            self.send(message);
            if let Some(answer) = self.hear() {
                if let ToHost::Hello { session, .. } = answer {
                    self.session = session;
                }
                return answer;
            }
        }
        panic!("no answer to {message:?}");
    }
}

fn frame(seq: u32) -> SensorFrame {
    // A triangle of depth, so that every phase of the law is met.
    let t = (seq % 120) as f32;
    let depth = if t < 60.0 { 0.5 * t } else { 0.5 * (120.0 - t) };
    SensorFrame {
        seq,
        time: Micros::from_secs(4 * u64::from(seq)),
        depth_m: Reading::now(depth),
        pitch_rad: Reading::now(if t < 60.0 { -0.3 } else { 0.3 }),
        roll_rad: Reading::now(0.01),
        heading_rad: Reading::now(1.0),
        ballast_m3: Reading::now(if t < 60.0 { -2e-4 } else { 2e-4 }),
        battery_mass_m: Reading::now(0.0),
        fin_rad: Reading::now(0.0),
        density_kg_m3: Reading::now(1025.0),
        temperature_degc: Reading::now(12.0),
        battery_v: Reading::now(14.0),
        charge: Reading::now(0.9),
        vacuum_pa: Reading::now(70_000.0),
        leak: Switch::Clear,
        ..SensorFrame::default()
    }
}

#[test]
fn the_image_answers_like_the_session_on_the_host() {
    let Some(elf) = image() else { return };
    let mut board = Board::start(&elf, "line");
    let mut host = Helm::new(control::Config::default(), Boot::default(), RamStorage::default());
    let ToHost::Hello { nonce: 77, manifest, .. } = board.ask(&ToBoard::Hello { nonce: 77 }) else { panic!("no hello") };
    assert!(manifest.hil);
    host.handle(ToBoard::Hello { nonce: 77 });
    let begin = ToBoard::Begin(Mission::default());
    let ToHost::Ready { table_id, config, mission, image } = board.ask(&begin) else { panic!("not taken") };
    assert_eq!(ToHost::Ready { table_id, config, mission, image: None }, host.handle(begin), "the host's is no image");
    assert_eq!(image, manifest.image);
    assert_eq!(image.map(|image| image.standing), Some(signals::Standing::Flashed), "started by the boot loader, its journal empty");
    let start = Instant::now();
    for seq in 0..500 {
        let message = ToBoard::Sensor(frame(seq));
        assert_eq!(board.ask(&message), host.handle(message), "frame {seq}");
    }
    println!("500 frames, {:.0} round trips/s", 500.0 / start.elapsed().as_secs_f64());
}

#[test]
fn a_launch_is_refused_with_the_bench_strap_and_frames_are_flown() {
    let Some(elf) = image() else { return };
    let mut board = Board::start(&elf, "strap");
    board.ask(&ToBoard::Hello { nonce: 1 });
    // A pin that nothing drives reads low in QEMU: the strap of a bench.
    assert_eq!(board.ask(&ToBoard::Launch(Mission::default())), ToHost::Refused(Refusal::Strap));
    let ToHost::Hello { manifest, .. } = board.ask(&ToBoard::Hello { nonce: 2 }) else { panic!("no hello") };
    assert!(manifest.hil && !manifest.under_way);
    assert!(matches!(board.ask(&ToBoard::Begin(Mission::default())), ToHost::Ready { .. }));
    assert!(matches!(board.ask(&ToBoard::Sensor(frame(0))), ToHost::Answer(_)));
    // Whoever asks while a mission is under way changes nothing.
    assert!(matches!(board.ask(&ToBoard::Launch(Mission::default())), ToHost::Refused(_)));
    assert!(matches!(board.ask(&ToBoard::Sensor(frame(1))), ToHost::Answer(_)));
}

#[test]
fn a_reset_during_a_mission_comes_up_safe_and_never_dives_again() {
    let Some(elf) = image() else { return };
    let mut board = Board::start(&elf, "reset");
    board.ask(&ToBoard::Hello { nonce: 1 });
    assert!(matches!(board.ask(&ToBoard::Begin(Mission::default())), ToHost::Ready { .. }));
    for seq in 0..5 {
        assert!(matches!(board.ask(&ToBoard::Sensor(frame(seq))), ToHost::Answer(_)));
    }
    board.reset();
    // The session is lost with the memory; the seat is remembered with the mission.
    assert_eq!(board.ask(&ToBoard::Sensor(frame(5))), ToHost::Refused(Refusal::Session));
    board.ask(&ToBoard::Hello { nonce: 1 });
    let ToHost::Answer(answer) = board.ask(&ToBoard::Sensor(frame(5))) else { panic!("no answer after the reset") };
    assert_eq!((answer.trace.phase, answer.trace.abort), (signals::Phase::Safe, Some(signals::Abort::Reset)));
    assert!(answer.command.ballast_m3 > 0.0);
    board.ask(&ToBoard::Hello { nonce: 2 });
    assert_eq!(board.ask(&ToBoard::Begin(Mission::default())), ToHost::Refused(Refusal::Safe));
}

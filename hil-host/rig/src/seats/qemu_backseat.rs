//! The flight image in QEMU in its role of a Slocum's backseat, with its clock in our hands.
//!
//! QEMU has no pins: the image is copied, and the one function that looks at the role's jumper says yes in the copy. Everything else is
//! the image that flies. The glider's line is USART1, our own protocol is on USART3.
//!
//! A flight takes hours, so the board's time is that of the simulated glider: the tick of its processor is stopped, its count of
//! milliseconds written through QEMU's test port, and after every moment one tick is raised by hand. The board says through a word in
//! its RAM how many bytes it has dealt with: what it does at a moment is the same in every run, byte for byte.

use super::link::upload::upload;
use super::link::{Link, Wire};
use super::qemu::{find_program, warn_if_old};
use super::{Seat, qemu};
use anyhow::{Context, bail, ensure};
use control::Config;
use frontseat::flight::Backseat;
use helm::{Content, objects};
use logs::record::bounded;
use object::{Object, ObjectSection, ObjectSymbol};
use signals::{Micros, Mission};
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// A board that does not take its turn within this is stuck.
const TURN: Duration = Duration::from_secs(10);
/// Without an answer for so long its line is looked at.
const DRAIN: Duration = Duration::from_millis(20);
/// Time that the emulator takes for a byte, measured.
const BYTE: Duration = Duration::from_micros(20);
/// Between two looks at what it says.
const BETWEEN_READS: Duration = Duration::from_micros(40);
/// Control of the processor's tick, and its register of pending exceptions (Armv7-M ARM B3.3.3, B3.2.4).
const TICK_CONTROL: u64 = 0xE000_E010;
const PENDING: u64 = 0xE000_ED04;
const PEND_TICK: u32 = 1 << 26;
/// `movs r0, #1; bx lr`
const SAYS_YES: [u8; 4] = [0x01, 0x20, 0x70, 0x47];

/// Where the image keeps what is read and written from outside.
#[derive(Clone, Copy, Debug)]
struct Places {
    millis: u64,
    pulse: u64,
}

/// A copy of the image whose jumper is fitted.
fn with_jumper(image: &Path, to: &Path) -> anyhow::Result<Places> {
    let mut bytes = bounded::bytes(image, bounded::LOG).with_context(|| image.display().to_string())?;
    let file = object::File::parse(&*bytes).with_context(|| format!("{}: no ELF", image.display()))?;
    let named = |words: [&str; 2]| {
        let of = |name: &str| words.iter().all(|word| name.contains(word));
        let found = file.symbols().find(|s| s.size() > 0 && s.name().is_ok_and(of));
        found.map(|s| s.address()).with_context(|| format!("{}: no {}: not our image, or an old one", image.display(), words.join("::")))
    };
    let places = Places { millis: named(["clock", "MILLIS"])?, pulse: named(["backseat_role", "PULSE"])? };
    // Bit 0 says Thumb.
    let jumper = named(["backseat_role", "jumper_is_fitted"])? & !1;
    let at = file
        .sections()
        .filter_map(|s| Some((s.address(), s.file_range()?)))
        .find(|(address, (_, size))| (*address..address + size).contains(&jumper))
        .map(|(address, (offset, _))| (offset + jumper - address) as usize);
    let code = at.and_then(|at| bytes.get_mut(at..at + SAYS_YES.len())).context("the image has no code where its jumper is read")?;
    code.copy_from_slice(&SAYS_YES);
    std::fs::write(to, &bytes).with_context(|| to.display().to_string())?;
    Ok(places)
}

/// QEMU's test port: words of the chip's memory, read and written while it runs.
struct Memory {
    port: BufReader<UnixStream>,
    answer: String,
    line: Line,
}

/// What the board says. The emulator stands still while nobody takes its bytes: some 280 of them, then it answers no test port either.
struct Line {
    stream: UnixStream,
    said: Vec<u8>,
}

impl Line {
    /// Takes what is there.
    fn drain(&mut self) -> anyhow::Result<()> {
        let mut piece = [0; 1024];
        loop {
            match self.stream.read(&mut piece) {
                Ok(0) => bail!("{} closed the line", qemu::PROGRAM),
                Ok(n) => self.said.extend(piece.iter().take(n)),
                Err(e) if e.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e).context("QEMU's line"),
            }
        }
    }
}

impl Memory {
    fn ask(&mut self, command: &str) -> anyhow::Result<u32> {
        self.port.get_mut().write_all(format!("{command}\n").as_bytes()).context("QEMU's test port")?;
        self.answer.clear();
        let until = Instant::now() + TURN;
        while let Err(e) = self.port.read_line(&mut self.answer) {
            let waits = matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) && Instant::now() < until;
            if !waits {
                return Err(e).context("QEMU's test port");
            }
            self.line.drain()?;
        }
        match self.answer.trim().split_once(' ') {
            Some(("OK", hex)) => {
                u32::from_str_radix(hex.trim_start_matches("0x"), 16).with_context(|| format!("QEMU's test port: {command}: {hex}"))
            }
            None if self.answer.trim() == "OK" => Ok(0),
            _ => bail!("QEMU's test port: {command}: {}", self.answer.trim()),
        }
    }

    fn word(&mut self, address: u64) -> anyhow::Result<u32> {
        self.ask(&format!("readl {address:#x}"))
    }

    fn write_word(&mut self, address: u64, value: u32) -> anyhow::Result<()> {
        self.ask(&format!("writel {address:#x} {value:#x}")).map(drop)
    }

    fn write_long(&mut self, address: u64, value: u64) -> anyhow::Result<()> {
        self.ask(&format!("writeq {address:#x} {value:#x}")).map(drop)
    }
}

/// The service line.
struct Service(UnixStream);

impl Wire for Service {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.0.write_all(bytes)
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> std::io::Result<usize> {
        self.0.set_read_timeout(Some(wait.max(Duration::from_millis(1))))?;
        match self.0.read(into) {
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) => Ok(0),
            done => done,
        }
    }

    fn describe(&self) -> String {
        "QEMU netduinoplus2 (STM32F405) with the flight image as a backseat, service line on USART3".to_owned()
    }
}

/// QEMU's folder and, once it runs, its process: both end with this.
struct Emulator {
    folder: PathBuf,
    child: Option<Child>,
}

/// QEMU with the image as a backseat; ends when dropped.
pub struct QemuBackseat {
    _emulator: Emulator,
    monitor: UnixStream,
    memory: Memory,
    places: Places,
    /// Bytes sent to it.
    sent: u32,
    /// When it was switched on or reset: its clock begins there.
    booted: Micros,
}

impl Drop for Emulator {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            let _ = child.kill();
            let _ = child.wait();
        }
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

fn connect(path: &Path, child: &mut Child) -> anyhow::Result<UnixStream> {
    let until = Instant::now() + TURN;
    loop {
        match UnixStream::connect(path) {
            Ok(stream) => {
                stream.set_read_timeout(Some(TURN))?;
                return Ok(stream);
            }
            Err(e) => {
                ensure!(child.try_wait()?.is_none() && Instant::now() < until, "{} does not open {}: {e}", qemu::PROGRAM, path.display())
            }
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

impl QemuBackseat {
    /// Starts the image and stores configuration and mission over its service line.
    ///
    /// # Errors
    /// One line: what is missing, and the fix.
    pub fn start(image: &Path, mission: &Mission, config: &Config) -> anyhow::Result<Self> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        ensure!(image.is_file(), "{}: no such firmware image; build it with scripts/build-firmware", image.display());
        warn_if_old(image);
        let program =
            find_program().with_context(|| format!("{} is not installed (Debian: apt install qemu-system-arm)", qemu::PROGRAM))?;
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let folder = std::env::temp_dir().join(format!("glider-backseat-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let mut emulator = Emulator { folder: folder.clone(), child: None };
        let places = with_jumper(image, &folder.join("image"))?;
        let socket = |name: &str| format!("unix:{},server=on,wait=off", folder.join(name).display());
        let child = Command::new(&program)
            .args(["-M", "netduinoplus2", "-accel", "tcg", "-display", "none", "-qtest-log", "none"])
            .args(["-monitor", &socket("monitor")])
            .args(["-qtest", &socket("memory"), "-serial", &socket("line"), "-serial", "null", "-serial", &socket("service"), "-kernel"])
            .arg(folder.join("image"))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .with_context(|| format!("cannot start {}", program.display()))?;
        let child = emulator.child.insert(child);
        let mut open = |name: &str| connect(&folder.join(name), child);
        let (memory, monitor, line, service) = (open("memory")?, open("monitor")?, open("line")?, open("service")?);
        memory.set_read_timeout(Some(DRAIN))?;
        line.set_nonblocking(true)?;
        let line = Line { stream: line, said: Vec::new() };
        let memory = Memory { port: BufReader::new(memory), answer: String::new(), line };
        let mut board = Self { _emulator: emulator, monitor, memory, places, sent: 0, booted: Micros(0) };
        let until = Instant::now() + TURN;
        board.wait(until, "does not start", |_, passes| passes > 0)?;
        store(service, mission, config)?;
        board.memory.write_word(TICK_CONTROL, 0)?;
        Ok(board)
    }

    /// The reset pin, at a time of the flight: the RAM that a reset does not clear stays, what was stored without a flash is lost.
    ///
    /// # Errors
    /// It does not come up.
    pub fn reset(&mut self, now: Micros) -> anyhow::Result<()> {
        self.memory.write_long(self.places.pulse, 0)?;
        self.sent = 0;
        self.monitor.write_all(b"system_reset\n").context("QEMU's monitor")?;
        self.wait(Instant::now() + TURN, "does not come up", |_, passes| passes > 0)?;
        self.memory.write_word(TICK_CONTROL, 0)?;
        self.booted = now;
        self.clock(0)
    }

    /// Waits for what the board says of bytes dealt with and passes made.
    fn wait(&mut self, until: Instant, what: &str, done: impl Fn(u32, u32) -> bool) -> anyhow::Result<u32> {
        loop {
            let (heard, passes) = (self.memory.word(self.places.pulse)?, self.memory.word(self.places.pulse + 4)?);
            if done(heard, passes) {
                return Ok(passes);
            }
            // Every look holds the emulator up.
            std::thread::sleep(BETWEEN_READS);
            ensure!(Instant::now() < until, "the image in QEMU {what}: {heard} of {} bytes dealt with, {passes} passes", self.sent);
        }
    }

    fn clock(&mut self, ms: u64) -> anyhow::Result<()> {
        self.memory.write_long(self.places.millis, ms)
    }
}

/// Hands over what is to be flown.
fn store(service: UnixStream, mission: &Mission, config: &Config) -> anyhow::Result<()> {
    let mut link = Link::new(Service(service));
    let manifest = link.hello()?;
    link.configure(&manifest, config)?;
    let mut bytes = Content::new();
    objects::mission_bytes(mission, &mut bytes);
    upload(&mut link, signals::Object::Mission, &bytes, |_, _| ())?;
    Ok(())
}

impl Backseat for QemuBackseat {
    fn pass(&mut self, now: Micros, heard: &[u8], said: &mut Vec<u8>) -> anyhow::Result<()> {
        let (now_ms, until) = (now.since(self.booted).0 / 1000, Instant::now() + TURN);
        if !heard.is_empty() {
            self.clock(now_ms)?;
            let stream = &mut self.memory.line.stream;
            stream.set_nonblocking(false)?;
            stream.write_all(heard).context("QEMU's line")?;
            stream.set_nonblocking(true)?;
            self.sent = self.sent.wrapping_add(heard.len() as u32);
            let sent = self.sent;
            std::thread::sleep(BYTE * heard.len() as u32);
            self.wait(until, "takes no bytes", |heard, _| heard == sent)?;
        }
        if now_ms > 0 {
            let passes = self.memory.word(self.places.pulse + 4)?;
            // The tick counts one more.
            self.clock(now_ms - 1)?;
            self.memory.write_word(PENDING, PEND_TICK)?;
            self.wait(until, "does not wake", |_, now| now != passes)?;
        }
        // The emulator sends a byte before it goes on: all of them are here.
        self.memory.line.drain()?;
        said.append(&mut self.memory.line.said);
        Ok(())
    }
}

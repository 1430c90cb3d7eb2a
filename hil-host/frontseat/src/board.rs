//! The controller as a Slocum's backseat: built for this computer, called directly or behind a pseudo-terminal; or a board on a port.
//!
//! Behind the pseudo-terminal every byte goes through the terminal; only the clock is shared, so that a flight takes seconds and not
//! hours. A board has a clock of its own: it is flown in real time.

use crate::flight::Backseat;
use crate::mission::own_turn_m;
use anyhow::{Context, anyhow, bail, ensure};
use backseat::sensors::List;
use backseat::{Law, Limits, Session, Targets};
use control::{Config, Settings};
use helm::{Boot, Helm, RamStorage};
use serialport::{SerialPort, TTYPort};
use signals::{Answer, Micros, Mission, SensorFrame, ToBoard, ToHost};
use std::io::{ErrorKind, Read, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Speed set on the pseudo-terminal; it has none.
const BAUD: u32 = 115_200;

/// A side that does not take its turn within this is not there any more.
const TURN: Duration = Duration::from_secs(10);

/// The controller behind the session: it flies one mission within the vehicle's limits.
pub struct Flown {
    mission: Mission,
    config: Config,
    helm: Option<Helm<RamStorage>>,
}

impl Flown {
    /// A mission to be flown when the line is open.
    #[must_use]
    pub fn new(mission: Mission, config: Config) -> Self {
        Self { mission, config, helm: None }
    }
}

impl Law for Flown {
    fn begin(&mut self, limits: &Limits) -> Option<Targets> {
        let s = *self.config.settings();
        let within = Settings {
            pump_m3: s.pump_m3.min(limits.ballast_m3),
            battery_m: s.battery_m.min(limits.battery_m),
            fin_rad: s.fin_rad.min(limits.fin_rad),
            battery_deadband_m: s.battery_deadband_m.max(limits.battery_step_m).min(limits.battery_m),
            ..s
        };
        let config = Config::new(within).ok()?;
        let mut mission = self.mission.clone();
        for leg in &mut mission.legs {
            leg.ballast_m3 = leg.ballast_m3.min(within.pump_m3);
        }
        let targets = Targets { dive_m: own_turn_m(&mission), climb_m: 2.0 };
        let mut helm = Helm::new(config, Boot::default(), RamStorage::default());
        helm.handle(ToBoard::Hello { nonce: 1 });
        let begun = matches!(helm.handle(ToBoard::Begin(mission)), ToHost::Ready { .. });
        self.helm = begun.then_some(helm);
        begun.then_some(targets)
    }

    fn step(&mut self, frame: &SensorFrame) -> Option<Answer> {
        match self.helm.as_mut()?.handle(ToBoard::Sensor(*frame)) {
            ToHost::Answer(answer) => Some(answer),
            _ => None,
        }
    }

    fn silent(&mut self, silence: Micros) -> Option<Answer> {
        self.helm.as_mut()?.silent(silence)
    }
}

/// Step of the battery mass just beyond the glider's dead band of 0.068 in (public default), m. With its own step of 0.4 mm the law
/// trims in steps that the glider ignores: 0.85 and 0.79 of (L/D)max in 0–200 m instead of 0.96 and 0.95.
const BATTERY_STEP_M: f32 = 1.05 * 0.068 * 0.0254;

/// What the board of a mission knows before the glider speaks.
#[must_use]
pub fn setup(list: List, config: &Config, rho_kg_m3: f32) -> backseat::Setup {
    let limits =
        Limits { ballast_m3: config.pump_m3, battery_m: config.battery_m, fin_rad: config.fin_rad, battery_step_m: BATTERY_STEP_M };
    backseat::Setup { list, rho_kg_m3, limits }
}

/// The board's program on this computer.
pub struct Board {
    /// The session.
    pub session: Session,
    /// What it flies.
    pub law: Flown,
}

impl Board {
    /// Just switched on.
    #[must_use]
    pub fn new(setup: backseat::Setup, law: Flown) -> Self {
        Self { session: Session::new(setup), law }
    }
}

impl Backseat for Board {
    fn pass(&mut self, now: Micros, heard: &[u8], said: &mut Vec<u8>) -> anyhow::Result<()> {
        for byte in heard {
            self.session.byte(now, *byte);
        }
        self.session.poll(now, &mut self.law);
        while let Some(byte) = self.session.next_byte() {
            said.push(byte);
        }
        Ok(())
    }
}

/// Whose turn it is, and how many bytes are on the terminal.
#[derive(Debug, Default)]
struct Turn {
    board: bool,
    now: Micros,
    bytes: usize,
    over: bool,
}

#[derive(Debug, Default)]
struct Shared {
    turn: Mutex<Turn>,
    changed: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Turn> {
        self.turn.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for a turn; none when the flight is over or the other side is gone.
    fn wait(&self, for_board: bool) -> Option<(Micros, usize)> {
        let waits = |t: &mut Turn| t.board != for_board && !t.over;
        let (turn, _) = self.changed.wait_timeout_while(self.lock(), TURN, waits).unwrap_or_else(PoisonError::into_inner);
        (turn.board == for_board && !turn.over).then_some((turn.now, turn.bytes))
    }

    fn pass(&self, to_board: bool, now: Micros, bytes: usize) {
        let mut turn = self.lock();
        (turn.board, turn.now, turn.bytes) = (to_board, now, bytes);
        self.changed.notify_all();
    }
}

fn read_all(port: &mut impl Read, bytes: usize, into: &mut Vec<u8>) -> std::io::Result<()> {
    let from = into.len();
    into.resize(from + bytes, 0);
    port.read_exact(into.get_mut(from..).unwrap_or_default())
}

/// A [`Board`] behind a pseudo-terminal.
pub struct Terminal {
    /// Name of the terminal.
    pub name: String,
    port: Box<dyn SerialPort>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Terminal {
    /// Starts the board's thread.
    ///
    /// # Errors
    /// The system gives no pseudo-terminal.
    pub fn start(mut board: Board) -> anyhow::Result<Self> {
        let (mut master, slave) = TTYPort::pair().context("this system gives no pseudo-terminal")?;
        let name = slave.name().context("pseudo-terminal without a name")?;
        master.set_timeout(TURN)?;
        let port = serialport::new(&name, BAUD).timeout(TURN).open().with_context(|| format!("cannot open {name}"))?;
        let shared = Arc::new(Shared::default());
        let mine = Arc::clone(&shared);
        let thread = std::thread::spawn(move || {
            // Keeps the terminal alive as long as the board is.
            let _slave = slave;
            let (mut heard, mut said) = (Vec::new(), Vec::new());
            loop {
                let Some((now, bytes)) = mine.wait(true) else {
                    // Nobody flies for a while: wait on, unless it is over.
                    if mine.lock().over {
                        return;
                    }
                    continue;
                };
                heard.clear();
                said.clear();
                let fine = read_all(&mut master, bytes, &mut heard).is_ok() && board.pass(now, &heard, &mut said).is_ok();
                if !fine || master.write_all(&said).is_err() {
                    mine.lock().over = true;
                    mine.changed.notify_all();
                    return;
                }
                mine.pass(false, now, said.len());
            }
        });
        Ok(Self { name, port, shared, thread: Some(thread) })
    }
}

impl Backseat for Terminal {
    fn pass(&mut self, now: Micros, heard: &[u8], said: &mut Vec<u8>) -> anyhow::Result<()> {
        self.port.write_all(heard).context("the pseudo-terminal")?;
        self.shared.pass(true, now, heard.len());
        let Some((_, bytes)) = self.shared.wait(false) else { bail!("the board behind {} does not answer", self.name) };
        read_all(&mut self.port, bytes, said).context("the pseudo-terminal")
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.shared.lock().over = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// A board on a serial port, in real time.
pub struct OnPort {
    name: String,
    port: Box<dyn SerialPort>,
    began: Option<Instant>,
    heard_anything: bool,
}

impl OnPort {
    /// The board on an open port.
    #[must_use]
    pub fn new(name: &str, port: Box<dyn SerialPort>) -> Self {
        Self { name: name.to_owned(), port, began: None, heard_anything: false }
    }

    fn lost(&self, e: &std::io::Error) -> anyhow::Error {
        anyhow!("{}: line lost ({e})", self.name)
    }
}

/// A board that says nothing for so long is none.
const SAYS_SOMETHING: Duration = Duration::from_secs(60);

impl Backseat for OnPort {
    fn pass(&mut self, now: Micros, heard: &[u8], said: &mut Vec<u8>) -> anyhow::Result<()> {
        let began = *self.began.get_or_insert_with(Instant::now);
        self.port.write_all(heard).map_err(|e| self.lost(&e))?;
        let due = Duration::from_micros(now.0);
        let mut piece = [0; 512];
        loop {
            let left = due.saturating_sub(began.elapsed());
            self.port.set_timeout(left.clamp(Duration::from_millis(1), Duration::from_millis(50)))?;
            let n = match self.port.read(&mut piece) {
                Ok(n) => n,
                Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock) => 0,
                Err(e) => return Err(self.lost(&e)),
            };
            said.extend(piece.iter().take(n));
            self.heard_anything |= n > 0;
            if left.is_zero() {
                break;
            }
        }
        ensure!(
            self.heard_anything || began.elapsed() < SAYS_SOMETHING,
            "{}: the board says nothing: check the crossing of TX and RX, the baud rate and that its role is the backseat",
            self.name
        );
        Ok(())
    }
}

//! The controller as a Slocum's backseat: built for this computer, called directly or behind a pseudo-terminal; or a board on a port.
//!
//! Behind the pseudo-terminal every byte goes through the terminal; only the clock is shared, so that a flight takes seconds and not
//! hours. A board has a clock of its own: it is flown in real time.

use crate::other_end::Backseat;
use anyhow::{Context, anyhow, bail, ensure};
use backseat::{Law, Limits, Session, Targets};
use bay::{BackseatLaw, Outside, RunBackseat};
use control::Config;
use helm::{Boot, Content, Helm, Mark, RamStorage, Storage, objects};
use serialport::{SerialPort, TTYPort};
use signals::surfacing::OfGlides;
use signals::{Answer, Micros, Mission, Object, SensorFrame, Strap};
use std::collections::VecDeque;
use std::convert::Infallible;
use std::io::{ErrorKind, Read, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Speed set on the pseudo-terminal; it has none.
const BAUD: u32 = 115_200;

/// A side that does not take its turn within this is not there any more.
const TURN: Duration = Duration::from_secs(10);

/// A controller with one mission in store.
fn helm_with(mission: &Mission, config: Config) -> Helm<RamStorage> {
    let mut helm = Helm::new(config, Boot::default(), RamStorage::default());
    let mut bytes = Content::new();
    objects::mission_bytes(mission, &mut bytes);
    // It is there or, too long for a board, it is not: then none is begun.
    let _ = helm.storage().save(Object::Mission, &bytes);
    helm
}

/// The controller behind the session, without its line: it flies one mission within the vehicle's limits.
pub struct Flown(Helm<RamStorage>);

impl Flown {
    /// A mission to be flown when the line is open.
    #[must_use]
    pub fn new(mission: &Mission, config: Config) -> Self {
        Self(helm_with(mission, config))
    }
}

impl Law for Flown {
    fn begin(&mut self, limits: &Limits) -> Option<Targets> {
        BackseatLaw::new(&mut self.0).begin(limits)
    }

    fn step(&mut self, frame: &SensorFrame) -> Option<Answer> {
        BackseatLaw::new(&mut self.0).step(frame)
    }

    fn silent(&mut self, silence: Micros) -> Option<Answer> {
        BackseatLaw::new(&mut self.0).silent(silence)
    }

    fn glides(&mut self) -> Option<OfGlides> {
        BackseatLaw::new(&mut self.0).glides()
    }
}

/// A port that is two queues.
#[derive(Debug, Default)]
struct Queues {
    heard: VecDeque<u8>,
    said: VecDeque<u8>,
}

impl embedded_io::ErrorType for Queues {
    type Error = Infallible;
}

impl embedded_io::Read for Queues {
    fn read(&mut self, out: &mut [u8]) -> Result<usize, Infallible> {
        let there = out.len().min(self.heard.len());
        out.iter_mut().zip(self.heard.drain(..there)).for_each(|(to, byte)| *to = byte);
        Ok(there)
    }
}

impl embedded_io::ReadReady for Queues {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.heard.is_empty())
    }
}

impl embedded_io::Write for Queues {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.said.extend(bytes);
        Ok(bytes.len())
    }
    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl embedded_io::WriteReady for Queues {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(true)
    }
}

/// The time since the board was switched on, in that of the flight; no pins, no watchdog.
#[derive(Debug, Default)]
struct Clock {
    now: Micros,
    booted: Micros,
}

impl Outside for Clock {
    fn now_ms(&mut self) -> u64 {
        self.now.since(self.booted).0 / 1000
    }
    fn feed(&mut self) {}
    fn remember(&mut self, _: Mark, _: f32) {}
    fn lost_bytes(&mut self) -> u32 {
        0
    }
    fn strap(&mut self) -> Strap {
        Strap::Backseat
    }
}

/// The board's loop on this computer, with a mission in store.
pub struct Board {
    session: Session,
    helm: Helm<RamStorage>,
    run: RunBackseat<Queues, Queues>,
    clock: Clock,
    setup: backseat::Setup,
    config: Config,
}

impl Board {
    /// Just switched on.
    #[must_use]
    pub fn new(setup: backseat::Setup, mission: &Mission, config: Config) -> Self {
        let mut clock = Clock::default();
        let run = RunBackseat::new(Queues::default(), Queues::default(), &mut clock);
        Self { session: Session::new(setup), helm: helm_with(mission, config.clone()), run, clock, setup, config }
    }

    /// A reset: what is stored, and the mark of a mission under way, are all that is left.
    pub fn reset(&mut self, now: Micros) {
        let boot = Boot { mark: self.helm.mark(), ..Boot::default() };
        self.helm = Helm::new(self.config.clone(), boot, self.helm.storage().clone());
        self.clock = Clock { now, booted: now };
        self.run = RunBackseat::new(Queues::default(), Queues::default(), &mut self.clock);
        self.session = Session::new(self.setup);
    }

    /// What its own line would say: the controller behind it.
    pub fn helm(&mut self) -> &mut Helm<RamStorage> {
        &mut self.helm
    }

    /// State of the glider's line.
    #[must_use]
    pub fn state(&self) -> backseat::State {
        self.session.state()
    }
}

impl Backseat for Board {
    fn pass(&mut self, now: Micros, heard: &[u8], said: &mut Vec<u8>) -> anyhow::Result<()> {
        self.clock.now = now;
        self.run.line.heard.extend(heard);
        loop {
            self.run.pass(&mut self.session, &mut self.helm, &mut self.clock);
            if self.run.line.heard.is_empty() {
                break;
            }
        }
        said.extend(self.run.line.said.drain(..));
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

/// How it stands with a board on a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Standing {
    /// It has said nothing yet, and is given up after so long.
    Silent {
        /// What is left of [`OnPort::patience`].
        left: Duration,
    },
    /// It has spoken; this long since the flight began.
    Speaking(Duration),
}

/// A board on a serial port, in real time.
pub struct OnPort<'a> {
    name: String,
    port: Box<dyn SerialPort>,
    began: Option<Instant>,
    heard_anything: bool,
    watch: Box<dyn FnMut(Standing) + 'a>,
    /// A board that says nothing for so long is none.
    pub patience: Duration,
}

impl<'a> OnPort<'a> {
    /// The board on an open port; `watch` is told at every pass how it stands.
    #[must_use]
    pub fn new(name: &str, port: Box<dyn SerialPort>, watch: impl FnMut(Standing) + 'a) -> Self {
        Self { name: name.to_owned(), port, began: None, heard_anything: false, watch: Box::new(watch), patience: SAYS_SOMETHING }
    }

    fn lost(&self, e: &std::io::Error) -> anyhow::Error {
        anyhow!("{}: line lost ({e})", self.name)
    }
}

/// A board that says nothing for so long is none.
pub const SAYS_SOMETHING: Duration = Duration::from_secs(60);

impl Backseat for OnPort<'_> {
    fn pass(&mut self, now: Micros, heard: &[u8], said: &mut Vec<u8>) -> anyhow::Result<()> {
        let began = *self.began.get_or_insert_with(Instant::now);
        let since = began.elapsed();
        (self.watch)(if self.heard_anything {
            Standing::Speaking(since)
        } else {
            Standing::Silent { left: self.patience.saturating_sub(since) }
        });
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
            self.heard_anything || began.elapsed() < self.patience,
            "{}: the board has said nothing for {:.0} s. Check its power, that TX and RX are crossed, that --baud is that of its line (9600 \
             for a backseat), and the jumper at PC9 that makes it one; a board without it flies without --extctl",
            self.name,
            self.patience.as_secs_f64()
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{Backseat as _, OnPort, Standing, TTYPort};
    use serialport::SerialPort as _;
    use signals::Micros;
    use std::io::Write as _;
    use std::time::Duration;

    /// A port at whose other end nobody is, or somebody who speaks once.
    fn flown(speaks: bool, watch: &mut Vec<Standing>) -> anyhow::Result<()> {
        let (mut other, port) = TTYPort::pair().expect("a pseudo-terminal");
        other.set_timeout(Duration::from_millis(50)).expect("a time");
        if speaks {
            other.write_all(b"$SD*00\n").expect("a pseudo-terminal");
        }
        let mut board = OnPort::new("/dev/port", Box::new(port), |standing| watch.push(standing));
        board.patience = Duration::from_millis(300);
        (0..8).try_for_each(|k| board.pass(Micros(k * 100_000), b"", &mut Vec::new()))
    }

    #[test]
    fn a_silent_port_counts_down_and_ends_with_the_remedy() {
        let mut told = Vec::new();
        let why = flown(false, &mut told).expect_err("nobody is there").to_string();
        assert!(why.contains("/dev/port") && why.contains("--baud") && why.contains("PC9"), "{why}");
        let left: Vec<Duration> = told.iter().filter_map(|s| if let Standing::Silent { left } = s { Some(*left) } else { None }).collect();
        assert!(left.len() == told.len() && left.len() >= 3, "told at once and on: {told:?}");
        assert!(left.first().is_some_and(|l| *l > Duration::from_millis(250)) && left.is_sorted_by(|a, b| a >= b), "{left:?}");
        let mut told = Vec::new();
        flown(true, &mut told).expect("it has spoken");
        assert!(matches!(told.last(), Some(Standing::Speaking(_))), "{told:?}");
    }
}

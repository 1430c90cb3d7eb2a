//! The controller behind a pseudo-terminal, opened like any serial port.

use super::BAUD;
use super::in_process::Board;
use super::link::Wire;
use super::port;
use anyhow::Context;
use serialport::{SerialPort, TTYPort};
use std::io::{ErrorKind, Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// How often an idle board thread looks whether it shall end, ms.
const IDLE: Duration = Duration::from_millis(50);

/// A pseudo-terminal with something behind it that answers bytes.
pub struct Terminal {
    /// Name under which the other end opens it.
    pub name: String,
    /// Keeps the terminal alive while nobody has it open.
    _slave: TTYPort,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Terminal {
    /// Starts `board` behind a new terminal: it gets what comes in and says
    /// what goes out.
    ///
    /// # Errors
    /// The system gives no pseudo-terminal.
    pub fn serve(mut board: impl FnMut(&[u8], &mut Vec<u8>) + Send + 'static) -> anyhow::Result<Self> {
        let (mut master, slave) = TTYPort::pair().context("this system gives no pseudo-terminal; use --seat in-process")?;
        let name = slave.name().context("pseudo-terminal without a name")?;
        master.set_timeout(IDLE)?;
        let stop = Arc::new(AtomicBool::new(false));
        let asked = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let mut incoming = [0u8; 1024];
            let mut answer = Vec::new();
            while !asked.load(Ordering::Relaxed) {
                match master.read(&mut incoming) {
                    Ok(n) => {
                        answer.clear();
                        board(incoming.get(..n).unwrap_or_default(), &mut answer);
                        if master.write_all(&answer).is_err() {
                            return;
                        }
                    }
                    Err(e) if e.kind() == ErrorKind::TimedOut => {}
                    Err(_) => return,
                }
            }
        });
        Ok(Self { name, _slave: slave, stop, thread: Some(thread) })
    }

    /// Serves a controller built for this computer.
    ///
    /// # Errors
    /// The system gives no pseudo-terminal.
    pub fn with_controller() -> anyhow::Result<Self> {
        let mut board = Board::default();
        Self::serve(move |bytes, out| board.take(bytes, |answer| out.extend_from_slice(answer)))
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Wire through a pseudo-terminal.
pub struct Pty {
    port: Box<dyn SerialPort>,
    terminal: Terminal,
}

impl Pty {
    /// A controller that was just started, behind a new terminal.
    ///
    /// # Errors
    /// The system gives no pseudo-terminal.
    pub fn new() -> anyhow::Result<Self> {
        let terminal = Terminal::with_controller()?;
        let port =
            serialport::new(&terminal.name, BAUD).open().with_context(|| format!("cannot open the pseudo-terminal {}", terminal.name))?;
        Ok(Self { port, terminal })
    }
}

impl Wire for Pty {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        port::send(&mut *self.port, bytes)
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> std::io::Result<usize> {
        port::receive(&mut *self.port, into, wait)
    }

    fn describe(&self) -> String {
        format!("controller built for this computer behind the pseudo-terminal {}", self.terminal.name)
    }
}

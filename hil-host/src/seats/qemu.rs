//! The flight image in QEMU: `netduinoplus2` is an STM32F405, the chip of the
//! science bay board.
//!
//! USART1 (the link) becomes a pseudo-terminal, USART2 (the defmt log) a file,
//! QEMU's monitor the child's standard input: it is asked to reset the chip.
//! The RAM that a reset does not clear is kept, as on the board. The child
//! dies with the seat.

use super::link::Wire;
use super::port::{self, BAUD};
use anyhow::{Context, bail};
use serialport::SerialPort;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// The emulator's command.
pub const PROGRAM: &str = "qemu-system-arm";
/// Where the image lies below the target directory.
const IMAGE: &str = "thumbv7em-none-eabihf/flight/firmware";
/// QEMU names its terminal within this time or never, s. Starting took 0.1–0.3 s here.
const START: Duration = Duration::from_secs(10);

/// A running QEMU with the image.
pub struct Qemu {
    child: Child,
    monitor: Option<ChildStdin>,
    port: Option<Box<dyn SerialPort>>,
    name: String,
}

/// Whether the emulator can be started.
#[must_use]
pub fn is_installed() -> bool {
    find_program().is_some()
}

fn find_program() -> Option<PathBuf> {
    std::env::split_paths(&std::env::var_os("PATH")?).map(|dir| dir.join(PROGRAM)).find(|p| p.is_file())
}

/// Finds the flight image: `$GLIDER_ELF`, else below the target directory this program was built into.
///
/// # Errors
/// Says how to build it.
pub fn find_image() -> anyhow::Result<PathBuf> {
    if let Some(path) = std::env::var_os("GLIDER_ELF") {
        let path = PathBuf::from(path);
        anyhow::ensure!(path.is_file(), "GLIDER_ELF names {}, which is not a file; unset it or build the image", path.display());
        return Ok(path);
    }
    let exe = std::env::current_exe().unwrap_or_default();
    let near = exe.ancestors().skip(1).map(|dir| dir.join(IMAGE));
    let here = std::iter::once(PathBuf::from("target").join(IMAGE));
    near.chain(here)
        .find(|p| p.is_file())
        .context("no firmware image for QEMU; build it with scripts/build-firmware, or name one with --elf FILE")
}

impl Qemu {
    /// Starts the image.
    ///
    /// # Errors
    /// One line: what is missing, and the fix.
    pub fn start(image: &Path, board_log: Option<PathBuf>) -> anyhow::Result<Self> {
        anyhow::ensure!(image.is_file(), "{}: no such firmware image; build it with scripts/build-firmware", image.display());
        let program = find_program()
            .with_context(|| format!("{PROGRAM} is not installed; install it (Debian: apt install qemu-system-arm) or use --seat pty"))?;
        let log = match board_log {
            Some(path) => format!("file:{}", path.display()),
            None => "null".to_owned(),
        };
        let mut child = Command::new(&program)
            .args(["-M", "netduinoplus2", "-nographic", "-monitor", "stdio", "-kernel"])
            .arg(image)
            .args(["-serial", "pty", "-serial", &log])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start {}", program.display()))?;
        match terminal_of(&mut child).and_then(|name| {
            let port = serialport::new(&name, BAUD).open().with_context(|| format!("cannot open QEMU's terminal {name}"))?;
            Ok((name, Some(port)))
        }) {
            Ok((name, port)) => Ok(Self { monitor: child.stdin.take(), child, port, name }),
            Err(e) => {
                let _ = child.kill();
                let _ = child.wait();
                Err(e)
            }
        }
    }
}

impl Qemu {
    /// The terminal that USART1 is behind.
    #[must_use]
    pub fn terminal(&self) -> &str {
        &self.name
    }

    /// Lets go of the terminal, so that another program may open it.
    pub fn unplug(&mut self) {
        self.port = None;
    }

    fn plugged(&mut self) -> std::io::Result<&mut dyn SerialPort> {
        match &mut self.port {
            Some(port) => Ok(&mut **port),
            None => Err(std::io::ErrorKind::NotConnected.into()),
        }
    }

    /// Says a line to QEMU's monitor.
    ///
    /// # Errors
    /// QEMU is gone.
    pub fn monitor(&mut self, line: &str) -> std::io::Result<()> {
        let monitor = self.monitor.as_mut().ok_or(std::io::ErrorKind::BrokenPipe)?;
        monitor.write_all(line.as_bytes())?;
        monitor.write_all(b"\n")?;
        monitor.flush()
    }
}

/// Reads the name of the first serial line's terminal from what QEMU prints.
fn terminal_of(child: &mut Child) -> anyhow::Result<String> {
    let (sender, lines) = mpsc::channel::<String>();
    let follow = |source: Option<Box<dyn std::io::Read + Send>>| {
        let sender = sender.clone();
        if let Some(source) = source {
            // Keeps draining so that QEMU never blocks on a full pipe.
            std::thread::spawn(move || BufReader::new(source).lines().map_while(Result::ok).for_each(|l| drop(sender.send(l))));
        }
    };
    follow(child.stdout.take().map(|s| Box::new(s) as _));
    follow(child.stderr.take().map(|s| Box::new(s) as _));
    drop(sender);
    let until = Instant::now() + START;
    let mut said = Vec::new();
    loop {
        match lines.recv_timeout(until.saturating_duration_since(Instant::now())) {
            Ok(line) => {
                let named = line.split("redirected to ").nth(1).and_then(|rest| rest.split_whitespace().next());
                if let Some(name) = named {
                    return Ok(name.to_owned());
                }
                said.push(line);
            }
            Err(_) => bail!(
                "{PROGRAM} did not offer a serial line: {}",
                if said.is_empty() { "it said nothing".to_owned() } else { said.join(" | ") }
            ),
        }
    }
}

impl Wire for Qemu {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        port::send(self.plugged()?, bytes)
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> std::io::Result<usize> {
        port::receive(self.plugged()?, into, wait)
    }

    fn reset(&mut self) -> bool {
        self.monitor("system_reset").is_ok()
    }

    fn describe(&self) -> String {
        format!("QEMU netduinoplus2 (STM32F405) with the flight image, USART1 on {}", self.name)
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

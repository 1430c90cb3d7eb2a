//! The flight image in QEMU: `netduinoplus2` is an STM32F405, the chip of the
//! science bay board.
//!
//! USART1 (the link) becomes a pseudo-terminal, USART2 (the defmt log) a file,
//! QEMU's monitor the child's standard input: it is asked to reset the chip.
//! The RAM that a reset does not clear is kept, as on the board. The child
//! dies with the seat.

use super::BAUD;
use super::link::Wire;
use super::port;
use anyhow::{Context, bail};
use serialport::SerialPort;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Once, mpsc};
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

pub(super) fn find_program() -> Option<PathBuf> {
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

/// A source in the working tree newer than the image made from it, by the list of sources that cargo leaves beside the image;
/// none outside that tree, or for an image without such a list.
#[must_use]
pub fn newer_source(image: &Path, tree: &Path) -> Option<PathBuf> {
    let made = std::fs::metadata(image).and_then(|m| m.modified()).ok()?;
    let list = std::fs::read_to_string(image.with_extension("d")).ok()?;
    // `image: source source …`, a blank in a name escaped.
    let (_, sources) = list.split_once(": ")?;
    let named = sources.replace("\\ ", "\0");
    let paths = named.split_whitespace().map(|path| PathBuf::from(path.replace('\0', " ")));
    paths.filter(|path| path.starts_with(tree)).find(|path| std::fs::metadata(path).and_then(|m| m.modified()).is_ok_and(|at| at > made))
}

/// Says once, on stderr, that the image is older than its sources.
pub(super) fn warn_if_old(image: &Path) {
    static SAID: Once = Once::new();
    let here = std::env::current_dir().unwrap_or_default();
    let Some(tree) = here.ancestors().find(|dir| dir.join("firmware/control").is_dir()) else { return };
    if let Some(source) = newer_source(image, tree) {
        SAID.call_once(|| {
            eprintln!(
                "warning: {} is older than {}; what flies is not what is written: scripts/build-firmware",
                image.display(),
                source.strip_prefix(tree).unwrap_or(&source).display()
            );
        });
    }
}

impl Qemu {
    /// Starts the image.
    ///
    /// # Errors
    /// One line: what is missing, and the fix.
    pub fn start(image: &Path, board_log: Option<PathBuf>) -> anyhow::Result<Self> {
        anyhow::ensure!(image.is_file(), "{}: no such firmware image; build it with scripts/build-firmware", image.display());
        warn_if_old(image);
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

    /// Lets go of the terminal, so that another program may open it. QEMU looks once a second whether anybody has: what is said before
    /// waits in the terminal, whole.
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

#[cfg(test)]
mod tests {
    use super::newer_source;
    use std::time::{Duration, SystemTime};

    #[test]
    fn an_image_is_old_when_one_of_its_sources_is_newer() {
        let tree = std::env::temp_dir().join(format!("glider-old-image-{}", std::process::id())).join("a tree");
        std::fs::create_dir_all(&tree).expect("writes");
        let file = |name: &str, age_s: u64| {
            let path = tree.join(name);
            std::fs::write(&path, "x").expect("writes");
            let at = SystemTime::now() - Duration::from_secs(age_s);
            std::fs::File::options().append(true).open(&path).and_then(|f| f.set_modified(at)).expect("a time");
            path
        };
        let (image, law, _other) = (file("firmware", 100), file("law.rs", 200), file("other.rs", 10));
        let escaped = law.display().to_string().replace(' ', "\\ ");
        assert_eq!(newer_source(&image, &tree), None, "no list of sources");
        std::fs::write(image.with_extension("d"), format!("{}: {escaped} /nowhere/gone.rs\n", image.display())).expect("writes");
        assert_eq!(newer_source(&image, &tree), None, "built after its source was written");
        file("law.rs", 50);
        assert_eq!(newer_source(&image, &tree), Some(law));
        assert_eq!(newer_source(&image, &tree.join("elsewhere")), None, "another tree");
        let _ = std::fs::remove_dir_all(tree.ancestors().nth(1).unwrap_or(&tree));
    }
}

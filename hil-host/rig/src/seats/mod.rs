//! Which controller answers: the same messages through four kinds of wire.
//!
//! | seat | controller | wire | proves |
//! |---|---|---|---|
//! | in-process | built for this computer | function call on encoded bytes | law, framing |
//! | pty | built for this computer | pseudo-terminal opened as a serial port | + serial handling of the host |
//! | QEMU | the Cortex-M4F image | emulated USART behind a pseudo-terminal | + the image, its interrupts and buffers |
//! | PORT | the image on a board | a real serial port | + the board |
//!
//! The board on its own [`parts`] is none of these: it measures and moves by itself, with the image's drivers on models of its parts.
//! A Slocum's backseat ([`frontseat`]) neither: there the controller is a Slocum's backseat, and a simulated front seat stands between it and the plant.
//!
//! Lockstep: one [`SensorFrame`] out, one [`Answer`] back, bounded waits, the
//! same frame again when the line damaged it (the board answers a repeated
//! frame without a second step). A seat never blocks for good: after
//! [`link::GIVE_UP`] it says so.

use control::Config;
use signals::{Answer, Manifest, Mission, SensorFrame, Wings};
use std::path::{Path, PathBuf};

pub mod clock;
pub mod error;
pub mod image;
pub mod in_process;
pub mod link;
pub mod options;
pub mod own_flash;
pub mod parts;
pub mod port;
pub mod program;
pub mod pty;
pub mod qemu;
pub mod qemu_backseat;
pub mod stock;

pub use error::{SeatError, UploadError};
pub use link::{Link, Wire};

/// Line speed of the board's USART1, baud (firmware's setting).
pub const BAUD: u32 = 115_200;
/// Control cycle, s (the paper's vehicle samples every 4 s).
pub const CYCLE_S: f64 = 4.0;

/// A controller at the other end of some wire.
pub trait Seat {
    /// Handshake; says who answers.
    ///
    /// # Errors
    /// No answer, another wire version, line gone.
    fn hello(&mut self) -> Result<Manifest, SeatError>;
    /// Has the controller fly with this configuration: uploaded if it is not the one in use.
    ///
    /// # Errors
    /// As above, or the controller refuses it.
    fn configure(&mut self, manifest: &Manifest, config: &Config) -> Result<(), SeatError>;
    /// Has the controller fly with this table of these wings.
    ///
    /// # Errors
    /// As above, or the controller refuses it; one that flies without a table.
    fn tabulate(&mut self, wings: Wings, table: &[u8]) -> Result<(), SeatError>;
    /// Tells a controller in SAFE that its vehicle is out of the water. Nothing happens to one that is not.
    ///
    /// # Errors
    /// As above, or the controller still believes itself below the surface.
    fn recover(&mut self) -> Result<(), SeatError>;
    /// Hands over the mission; returns the identity of the table it will be flown with.
    ///
    /// # Errors
    /// As above, or the controller refuses the mission.
    fn begin(&mut self, mission: &Mission) -> Result<u32, SeatError>;
    /// One control cycle.
    ///
    /// # Errors
    /// As above.
    fn exchange(&mut self, frame: &SensorFrame) -> Result<Answer, SeatError>;
    /// Orders the vehicle home.
    ///
    /// # Errors
    /// As above.
    fn recall(&mut self) -> Result<(), SeatError>;
    /// The supply was interrupted: the controller starts again, knowing only what its flash knows.
    ///
    /// # Errors
    /// This seat cannot reset its controller.
    fn reset(&mut self) -> Result<(), SeatError>;
    /// One line for a person: which controller over which wire.
    fn describe(&self) -> String;
}

/// Which seat is asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Choice {
    /// The controller called directly.
    InProcess,
    /// The controller behind a pseudo-terminal.
    Pty,
    /// The image in QEMU.
    Qemu,
    /// The controller as a Slocum's backseat; no seat of sensor frames.
    Extctl,
    /// The board's own drivers on models of its parts; no seat of sensor frames either.
    Parts,
    /// A serial port with a board.
    Port(String),
}

impl std::str::FromStr for Choice {
    type Err = std::convert::Infallible;

    fn from_str(s: &str) -> Result<Self, Self::Err> {
        Ok(match s {
            "in-process" => Self::InProcess,
            "pty" => Self::Pty,
            "qemu" => Self::Qemu,
            "extctl" => Self::Extctl,
            "parts" => Self::Parts,
            port => Self::Port(port.to_owned()),
        })
    }
}

impl std::fmt::Display for Choice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::InProcess => f.write_str("in-process"),
            Self::Pty => f.write_str("pty"),
            Self::Qemu => f.write_str("qemu"),
            Self::Extctl => f.write_str("extctl"),
            Self::Parts => f.write_str("parts"),
            Self::Port(p) => f.write_str(p),
        }
    }
}

/// Opens a seat. `elf` overrides the image looked for by [`qemu::find_image`];
/// `board_log` is where a QEMU board's own (defmt) log goes.
///
/// # Errors
/// One line: what is missing and how to get it.
pub fn open(choice: &Choice, elf: Option<&Path>, board_log: Option<PathBuf>) -> anyhow::Result<Box<dyn Seat>> {
    Ok(match choice {
        Choice::InProcess => Box::new(Link::new(in_process::InProcess::default())),
        Choice::Pty => Box::new(Link::new(pty::Pty::new()?)),
        Choice::Qemu => {
            let image = match elf {
                Some(path) => path.to_owned(),
                None => qemu::find_image()?,
            };
            Box::new(Link::new(qemu::Qemu::start(&image, board_log)?))
        }
        Choice::Extctl => anyhow::bail!("the backseat line carries no sensor frames: glider fly --seat extctl flies it"),
        Choice::Parts => anyhow::bail!("the board on its own parts takes no sensor frames: glider fly --seat parts flies it"),
        Choice::Port(name) => {
            let port = port::Port::open(name).map_err(|e| anyhow::anyhow!("{e:#}; without a board: --seat in-process, pty or qemu"))?;
            Box::new(Link::new(port))
        }
    })
}

//! Why a seat does not fly, in words that say what to do.

use signals::{Limit, Refusal, WIRE_VERSION};

/// Why a seat does not fly.
#[derive(Debug)]
#[non_exhaustive]
pub enum SeatError {
    /// Nothing usable came back.
    NoAnswer {
        /// What was asked.
        asked: &'static str,
        /// Who was asked.
        seat: String,
        /// How long, s.
        waited_s: u64,
        /// What was heard meanwhile.
        heard: Heard,
    },
    /// The board speaks another version of the wire.
    Version {
        /// Who.
        seat: String,
        /// Its version.
        theirs: u8,
    },
    /// The board understood and will not.
    Refused {
        /// What was asked.
        asked: &'static str,
        /// Why not.
        why: Refusal,
    },
    /// The board would fly something else than it was given.
    Other {
        /// What differs: table, configuration or mission.
        what: &'static str,
        /// Its CRC-32 as given.
        given: u32,
        /// As the board says.
        taken: u32,
    },
    /// The line broke.
    Lost {
        /// Who.
        seat: String,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A mission on its own sensors is under way: the board takes no frames from the line.
    OwnSensors {
        /// Who.
        seat: String,
    },
    /// The message does not fit a frame.
    TooLong,
    /// The supply of this seat's controller cannot be interrupted.
    NoReset {
        /// Who.
        seat: String,
    },
}

/// What came over a line that gave no answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Heard {
    /// Bytes.
    pub bytes: u64,
    /// Frames of this protocol among them.
    pub frames: u64,
}

impl std::fmt::Display for SeatError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoAnswer { asked, seat, waited_s, heard } => {
                write!(f, "{seat}: no answer to {asked} within {waited_s} s; ")?;
                match heard {
                    Heard { bytes: 0, .. } => {
                        f.write_str("not a byte came: check the cable, the power and that the board runs this project's firmware")
                    }
                    Heard { bytes, frames: 0 } => write!(
                        f,
                        "{bytes} bytes came, none of them a frame: another baud rate than {}, another firmware, or noise on the line",
                        super::BAUD
                    ),
                    Heard { bytes, frames } => {
                        write!(
                            f,
                            "{bytes} bytes with {frames} whole frames came, none of them the answer: a bad line, or another program on it"
                        )
                    }
                }
            }
            Self::Version { seat, theirs } => write!(
                f,
                "{seat}: speaks wire version {theirs}, this program version {WIRE_VERSION}; use glider and firmware of one release (cargo flash)"
            ),
            Self::Refused { asked, why } => write!(f, "the controller refuses {asked}: {}", words(*why)),
            Self::Other { what, given, taken } => write!(
                f,
                "the controller would fly another {what} ({taken:08x}) than it was given ({given:08x}): something else was uploaded in between; nothing was started, repeat"
            ),
            Self::Lost { seat, cause } => write!(f, "{seat}: line lost ({cause}); plug the board in again and repeat"),
            Self::OwnSensors { seat } => write!(
                f,
                "{seat}: takes no frames of a host: a mission on the vehicle's own sensors is under way (wait for its end, or recall it and recover the vehicle), or it is a Slocum's backseat (docs/backseat.md)"
            ),
            Self::TooLong => f.write_str("message does not fit a frame"),
            Self::NoReset { seat } => write!(f, "{seat}: cannot interrupt its supply; fly power:brown_out with --seat in-process"),
        }
    }
}

impl std::error::Error for SeatError {}

/// A refusal and the way out.
#[must_use]
pub fn words(why: Refusal) -> String {
    match why {
        Refusal::NotNow => "not now (NotNow): say hello first".to_owned(),
        Refusal::Session => "another program said hello to this board meanwhile (Session); end it and repeat".to_owned(),
        Refusal::UnderWay => {
            "a mission is under way on the board (UnderWay): glider fly --recover calls it home in the simulation, or reset the board on deck".to_owned()
        }
        Refusal::NoMission => "no mission is under way on the board (NoMission): it was reset, or recovered by another program".to_owned(),
        Refusal::OwnSensors => "the mission is flown on the vehicle's own sensors (OwnSensors)".to_owned(),
        Refusal::Sequence { last: u32::MAX } => "the frames of a mission are numbered from 0 (Sequence)".to_owned(),
        Refusal::Sequence { last } => {
            format!("not the next frame: the board's mission stands at frame {last} (Sequence); it belongs to another flight")
        }
        Refusal::Safe => {
            "the vehicle is in SAFE and takes nothing before it is recovered (Safe): glider fly --recover, afloat".to_owned()
        }
        Refusal::Time => "not a believable time (Time): set this computer's clock, or the board has none".to_owned(),
        Refusal::Strap => "the strap on the board says no (Strap): fitted, it flies on frames from a host; taken out, on its own sensors".to_owned(),
        Refusal::NotAfloat => format!(
            "it was not seen at the surface for long enough (NotAfloat): {} s by two depth sensors that agree, {} s by one alone",
            helm::afloat::TWINS_MS / 1000,
            helm::afloat::ALONE_MS / 1000
        ),
        Refusal::Limit(Limit::Class) => {
            "its pump is that of another vehicle than the board is built into, or of none (Limit Class)".to_owned()
        }
        Refusal::Limit(limit) => format!("{limit:?} lies beyond what this class of vehicle may be told (Limit)"),
        Refusal::NoImages => "this controller keeps no images of its firmware (NoImages): a simulated one, or flash this release once with cargo flash".to_owned(),
        Refusal::OnTrial => {
            "the image on the board is on trial (OnTrial): fit the strap and fly it on the bench (glider fly --seat PORT), or glider upload PORT image --rollback".to_owned()
        }
        Refusal::OtherBoard => "no image for this board (OtherBoard): scripts/build-firmware makes one".to_owned(),
        Refusal::Older => "the image is of an older version than the one that runs (Older): --force takes it all the same".to_owned(),
        Refusal::NothingBefore => "there is no image before the one that runs (NothingBefore): upload the one you want".to_owned(),
        Refusal::Mission(why) => format!("{why:?}"),
        other => format!("{other:?}"),
    }
}

/// Why an upload did not take effect.
#[derive(Debug)]
#[non_exhaustive]
pub enum UploadError {
    /// The line or the board.
    Seat(SeatError),
    /// What was read back differs from what was sent, from this byte on.
    ReadBack(usize),
}

impl From<SeatError> for UploadError {
    fn from(e: SeatError) -> Self {
        Self::Seat(e)
    }
}

impl std::fmt::Display for UploadError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Seat(e) => e.fmt(f),
            Self::ReadBack(at) => write!(f, "the board stored something else than was sent, from byte {at} on; upload again"),
        }
    }
}

impl std::error::Error for UploadError {}

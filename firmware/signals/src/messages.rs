//! What may cross the serial line: everything a host may ask of the board, and everything the board may answer.

use crate::frame::{Answer, Phase, SensorFrame};
use crate::image::{Image, Older};
use crate::mission::{Mission, MissionError, Wings};
use crate::preflight::Preflight;
use crate::time::Clock;
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// Largest piece of an upload or read-back, bytes.
pub const CHUNK: usize = 128;

/// Things that can be stored on the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Object {
    /// L/D table of a wing set.
    Table(Wings),
    /// Controller configuration.
    Config,
    /// Mission.
    Mission,
    /// Flight log, raw as it lies on flash: read back only.
    Log,
    /// What is kept of the last run that a fault ended ([`crate::autopsy`]): read back only.
    Autopsy,
    /// An image of the firmware: uploaded and rolled back only, and what it changes begins with a restart.
    Image(Older),
    /// What healthy dives of the vehicle say of its numbers (`evidence::History`).
    History,
}

/// Why a message had no effect.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Refusal {
    /// Not in this state (no hello since the last mission, no mission to recall).
    NotNow,
    /// Not of the present session: say hello first. What was recorded in another one has no effect.
    Session,
    /// A mission is armed or under way.
    UnderWay,
    /// No mission is armed or under way.
    NoMission,
    /// The mission is flown on the vehicle's own sensors; frames of the host mean nothing to it.
    OwnSensors,
    /// Not the next frame: too old, or too far ahead of this one, the last that was stepped.
    Sequence {
        /// Its number; none was stepped in this mission yet: [`u32::MAX`].
        last: u32,
    },
    /// Not seen afloat for long enough.
    NotAfloat,
    /// Configuration beyond what this class of vehicle may ever be told.
    Limit(Limit),
    /// Mission not flyable.
    Mission(MissionError),
    /// Object does not fit its slot.
    TooLong,
    /// Chunk is not where the last one ended.
    OutOfOrder,
    /// Content does not match its CRC, or is not a valid object.
    Corrupt,
    /// Table is for other wings, or of another format.
    WrongTable,
    /// Flash did not take it.
    Storage,
    /// The vehicle is in SAFE and stays there.
    Safe,
    /// The strap on the board says the other: frames from a host on the bench only, own sensors in deployment only.
    Strap,
    /// No believable UTC, or the board has no clock to keep it.
    Time,
    /// This controller keeps no images of its firmware.
    NoImages,
    /// The image that runs is on trial: a control step on the bench confirms it.
    OnTrial,
    /// No image, or one for another board.
    OtherBoard,
    /// An image of an older version than the one that runs.
    Older,
    /// There is no image before the one that runs.
    NothingBefore,
}

/// Which limit of the vehicle's class a configuration crosses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Limit {
    /// No class of vehicle has such a pump, or it is not that of the vehicle the board is built into.
    Class,
    /// Deeper working depth.
    WorkingDepth,
    /// Deeper crush depth.
    CrushDepth,
    /// Larger pump range.
    Pump,
    /// Shorter release of the weight.
    ReleaseTime,
    /// Longer wait before the weight goes.
    Burn,
    /// Lower voltage.
    Undervoltage,
    /// Smaller reserve of charge.
    Reserve,
    /// Poorer hull vacuum.
    Vacuum,
    /// Longer without word from shore.
    NoComms,
    /// Longer wait at the surface.
    CommsPatience,
}

/// What the board says of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// Firmware version major, minor, patch.
    pub firmware: [u8; 3],
    /// Identity (CRC-32) of the table in use, standard wings.
    pub table_standard: u32,
    /// Identity (CRC-32) of the table in use, low aspect ratio wings.
    pub table_low_ar: u32,
    /// CRC-32 of the configuration.
    pub config: u32,
    /// Control cycle, ms.
    pub cycle_ms: u32,
    /// Boots since first flash; 0 when not counted.
    pub boots: u32,
    /// False: the mission under way is flown on the vehicle's own sensors, or the board is a backseat.
    pub hil: bool,
    /// A mission is armed or under way, or the vehicle is in SAFE.
    pub under_way: bool,
    /// Phase of the mission under way, or of the last one.
    pub phase: Phase,
    /// Number of the last frame stepped in it.
    pub last_seq: Option<u32>,
    /// The image that runs; none: a controller that is no image.
    pub image: Option<Image>,
}

/// What the receiving side has seen; all counters saturate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Frames accepted.
    pub accepted: u32,
    /// Frames refused: COBS, length or CRC.
    pub damaged: u32,
    /// Frames of another wire version.
    pub version: u32,
    /// Frames with valid CRC whose content is not a message.
    pub unknown: u32,
    /// Bytes lost because a buffer was full.
    pub overflow: u32,
    /// Sensor frames repeated (answered again without a step).
    pub repeated: u32,
    /// Sensor frames out of order, not stepped.
    pub stale: u32,
}

/// Everything the host may say.
// One lives at a time in a static buffer; boxing is not an option without a heap.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToBoard {
    /// Handshake: asks for a session. A mission under way goes on as it was.
    Hello {
        /// Repeated in the answer, so that an old answer is not taken for a new one. The same nonce again gives the same session.
        nonce: u32,
    },
    /// Take this mission (the stored one if it has no legs) and start it with the next sensor frame of the host: hardware in the
    /// loop. Its frames are numbered from 0.
    Begin(Mission),
    /// Take this mission (the stored one if it has no legs) and start it on the vehicle's own sensors.
    Launch(Mission),
    /// One control cycle.
    Sensor(SensorFrame),
    /// Abort now and come home.
    Recall,
    /// An upload of `length` bytes with this CRC-32 starts.
    UploadBegin {
        /// What is uploaded.
        object: Object,
        /// Its length, bytes.
        length: u32,
        /// Its CRC-32.
        crc: u32,
    },
    /// A piece of it.
    UploadChunk {
        /// Where it belongs.
        offset: u32,
        /// The bytes.
        data: Vec<u8, CHUNK>,
    },
    /// All sent: check, store, use from the next mission on.
    UploadCommit,
    /// Go back to the version before.
    Rollback(Object),
    /// Send back what is stored.
    ReadBack {
        /// What to read.
        object: Object,
        /// From where.
        offset: u32,
    },
    /// Send counters.
    Report,
    /// The vehicle is out of the water: forget the mission and leave SAFE.
    /// Refused unless it was seen afloat for some time.
    Recovered,
    /// Measure with the vehicle's own sensors now, on deck; with `stroke` move pump and battery mass first. Ask again for what came of it.
    Check {
        /// Begin a stroke of pump and battery mass.
        stroke: bool,
    },
    /// Say what time it is; on deck UTC can be set first.
    Clock {
        /// UTC when this message ends, ms since 1970-01-01, and how far it may be off, ms.
        set: Option<(u64, u32)>,
    },
    /// Start again, on deck: a staged image is installed, or the one before it put back. The answer comes first.
    Restart,
    /// Say what the chip's option bytes are; on deck they can be set. Ask again for what came of it.
    OptionBytes {
        /// Set them as this board needs them.
        set: bool,
    },
}

/// One message to the board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// Session given by the board with the last hello; 0 for what needs none (hello, report, read-back).
    pub session: u32,
    /// Repeated in the reply; the repeat of a request keeps its number.
    pub id: u16,
    /// The message.
    pub message: ToBoard,
}

/// One message to the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reply {
    /// Number of the request that is answered.
    pub to: u16,
    /// The message.
    pub message: ToHost,
}

/// Everything the board may say.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToHost {
    /// Answer to [`ToBoard::Hello`].
    Hello {
        /// Of the hello.
        nonce: u32,
        /// To be named in every request that changes something; another one after every new hello and every reset.
        session: u32,
        /// Who answers.
        manifest: Manifest,
    },
    /// The mission is taken.
    Ready {
        /// Identity of the table it will be flown with.
        table_id: u32,
        /// CRC-32 of the configuration it will be flown with.
        config: u32,
        /// CRC-32 of the mission, as it would be stored.
        mission: u32,
        /// The image that will fly it; none: a controller that is no image.
        image: Option<Image>,
    },
    /// Answer to one sensor frame.
    Answer(Answer),
    /// The upload, rollback or recall took effect.
    Done {
        /// CRC-32 of the object now in use; 0 where there is none.
        crc: u32,
    },
    /// Next upload chunk may come.
    Continue {
        /// Bytes received so far.
        offset: u32,
    },
    /// Content of a stored object.
    Content {
        /// From where.
        offset: u32,
        /// Whole length, bytes.
        length: u32,
        /// The bytes; empty at the end.
        data: Vec<u8, CHUNK>,
    },
    /// Nothing was done, and why.
    Refused(Refusal),
    /// Link statistics.
    Counters(Counters),
    /// Like [`ToHost::Done`], but flash did not keep it: in use until the next reset.
    Volatile {
        /// CRC-32 of the object now in use; 0 where there is none.
        crc: u32,
    },
    /// What the last check on deck found.
    Checked(Preflight),
    /// What time it is, after the setting that was asked for.
    Clock(Clock),
    /// Option bytes as FLASH_OPTCR has them; none where there is no chip.
    OptionBytes(Option<u32>),
}

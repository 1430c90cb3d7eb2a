//! Where uploaded objects live: the trait, and a copy in RAM.

use crate::mark::Mark;
use heapless::Vec;
use signals::{Answer, Image, Object, Older, Refusal, SensorFrame, Utc, Wings};

/// Largest object, bytes: a table is the largest.
pub const MAX_OBJECT: usize = polar::MAX_TABLE;
/// Kinds of objects.
pub const OBJECTS: usize = 5;

/// Bytes of one object.
pub type Content = Vec<u8, MAX_OBJECT>;

/// Replaces what is in `out`, byte by byte: heapless' slice copy keeps an
/// overflow check. `false` if it does not fit.
pub fn fill(out: &mut Content, bytes: &[u8]) -> bool {
    out.clear();
    bytes.iter().all(|byte| out.push(*byte).is_ok())
}

/// How long a stored object lasts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// On flash, read back and compared: survives a power cut.
    ForGood,
    /// In RAM only: lost at the next reset.
    UntilReset,
}

/// What is asked of the images of the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ask<'a> {
    /// An image of so many bytes will be staged.
    Begin(u32),
    /// Its bytes from here on; answered with how many are there.
    Piece(u32, &'a [u8]),
    /// It is complete: check it and have it installed at the next restart.
    Commit {
        /// Its length, bytes.
        length: u32,
        /// CRC-32 of these bytes.
        crc: u32,
        /// Whether it may be older than `running`.
        older: Older,
        /// Version that runs.
        running: [u8; 3],
    },
    /// Forget what is not complete.
    Abandon,
    /// The image that runs has finished a control step.
    Confirm,
    /// Take back an installation that has not begun, or have the image before put back at the next restart.
    GoBack,
}

/// What keeps objects. Two generations of each: the one in use and the one
/// before it.
pub trait Storage {
    /// Copies the generation in use to `out`; `false` if there is none.
    fn load(&mut self, object: Object, out: &mut Content) -> bool;
    /// Makes `bytes` the generation in use, the former one the one before.
    ///
    /// # Errors
    /// [`Refusal::TooLong`] or [`Refusal::Storage`]; what was in use still is.
    fn save(&mut self, object: Object, bytes: &[u8]) -> Result<Kept, Refusal>;
    /// Forgets the generation in use and goes back to the one before it, or
    /// to what is built in.
    ///
    /// # Errors
    /// [`Refusal::Storage`]; what was in use still is.
    fn rollback(&mut self, object: Object) -> Result<Kept, Refusal>;
    /// Keeps the mark of a mission under way; cheap when it is kept already.
    fn mark(&mut self, _mark: Mark) {}
    /// A mission is taken: its log begins.
    fn begin_log(&mut self) {}
    /// Offers one control cycle to the flight log, with its UTC where that is known.
    fn log(&mut self, _utc: Option<Utc>, _frame: &SensorFrame, _answer: &Answer) {}
    /// A mark or log entry of this run could not be written.
    fn log_lost(&mut self) -> bool {
        false
    }
    /// Copies the log from byte `at` on, raw as it lies on flash; returns its whole length, bytes, 0 where there is none.
    fn read_log(&mut self, _at: u32, _out: &mut [u8]) -> u32 {
        0
    }
    /// The same of what is kept of a run that a fault ended ([`crate::black_box`]).
    fn read_autopsy(&mut self, _at: u32, _out: &mut [u8]) -> u32 {
        0
    }
    /// The image that runs; none: a controller that is no image.
    fn image(&self) -> Option<Image> {
        None
    }
    /// Does something with the images of the firmware.
    ///
    /// # Errors
    /// Why it is not done; the image that runs goes on.
    fn ask_images(&mut self, _ask: Ask<'_>) -> Result<u32, Refusal> {
        Err(Refusal::NoImages)
    }
}

impl<S: Storage> Storage for &mut S {
    fn load(&mut self, object: Object, out: &mut Content) -> bool {
        (**self).load(object, out)
    }
    fn save(&mut self, object: Object, bytes: &[u8]) -> Result<Kept, Refusal> {
        (**self).save(object, bytes)
    }
    fn rollback(&mut self, object: Object) -> Result<Kept, Refusal> {
        (**self).rollback(object)
    }
    fn mark(&mut self, mark: Mark) {
        (**self).mark(mark);
    }
    fn begin_log(&mut self) {
        (**self).begin_log();
    }
    fn log(&mut self, utc: Option<Utc>, frame: &SensorFrame, answer: &Answer) {
        (**self).log(utc, frame, answer);
    }
    fn log_lost(&mut self) -> bool {
        (**self).log_lost()
    }
    fn read_log(&mut self, at: u32, out: &mut [u8]) -> u32 {
        (**self).read_log(at, out)
    }
    fn read_autopsy(&mut self, at: u32, out: &mut [u8]) -> u32 {
        (**self).read_autopsy(at, out)
    }
    fn image(&self) -> Option<Image> {
        (**self).image()
    }
    fn ask_images(&mut self, ask: Ask<'_>) -> Result<u32, Refusal> {
        (**self).ask_images(ask)
    }
}

/// Number of an object's place, below [`OBJECTS`]; that of the log has none.
#[must_use]
pub const fn place(object: Object) -> usize {
    match object {
        Object::Table(Wings::Standard) => 0,
        Object::Table(Wings::LowAspectRatio) => 1,
        Object::Config => 2,
        Object::Mission => 3,
        Object::History => 4,
        // Nowhere: they have rings or slots of their own.
        Object::Log | Object::Autopsy | Object::Image(_) => OBJECTS,
    }
}

/// Two generations of every object in RAM: the host-built seats' storage.
#[derive(Clone, Debug, Default)]
pub struct RamStorage {
    newest: [Option<Content>; OBJECTS],
    before: [Option<Content>; OBJECTS],
}

impl RamStorage {
    /// Nothing stored.
    #[must_use]
    pub const fn new() -> Self {
        Self { newest: [const { None }; OBJECTS], before: [const { None }; OBJECTS] }
    }

    /// Whether there is a generation of `object` in use here.
    pub(crate) fn holds(&self, object: Object) -> bool {
        matches!(self.newest.get(place(object)), Some(Some(_)))
    }

    /// Drops both generations.
    pub(crate) fn forget(&mut self, object: Object) {
        for generation in [&mut self.newest, &mut self.before] {
            if let Some(content) = generation.get_mut(place(object)) {
                *content = None;
            }
        }
    }
}

impl Storage for RamStorage {
    fn load(&mut self, object: Object, out: &mut Content) -> bool {
        match self.newest.get(place(object)) {
            Some(Some(content)) => fill(out, content),
            _ => {
                out.clear();
                false
            }
        }
    }

    fn save(&mut self, object: Object, bytes: &[u8]) -> Result<Kept, Refusal> {
        let mut content = Content::new();
        if !fill(&mut content, bytes) {
            return Err(Refusal::TooLong);
        }
        let newest = self.newest.get_mut(place(object)).ok_or(Refusal::Storage)?;
        let before = self.before.get_mut(place(object)).ok_or(Refusal::Storage)?;
        *before = newest.replace(content);
        Ok(Kept::UntilReset)
    }

    fn rollback(&mut self, object: Object) -> Result<Kept, Refusal> {
        let newest = self.newest.get_mut(place(object)).ok_or(Refusal::Storage)?;
        let before = self.before.get_mut(place(object)).ok_or(Refusal::Storage)?;
        *newest = before.take();
        Ok(Kept::UntilReset)
    }
}

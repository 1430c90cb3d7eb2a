//! Whether a mission is under way: what a reset must find again, in one byte.

use signals::Abort;

/// Where sensor frames come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Seat {
    /// On deck: the next mission decides, by [`signals::ToBoard::Begin`] or [`signals::ToBoard::Launch`].
    Open,
    /// From the host over the line (hardware in the loop).
    #[default]
    Host,
    /// From the vehicle's own sensors; frames from the line are refused.
    Sensors,
    /// From the glider whose backseat the board is; frames from our line are refused.
    Backseat,
}

/// Whether a mission is under way, where its frames come from, why it was aborted, and whether the weight was fired.
///
/// ```text
/// bits 0..2   0 no mission, 1 on frames from the host, 3 as a backseat, else on the vehicle's own sensors
/// bits 2..7   0 no abort, else the number of its first cause + 1
/// bit 7       the drop weight was fired
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mark(pub u8);

impl Mark {
    /// No mission under way.
    pub const NONE: Self = Self(0);

    /// A mission under way.
    #[must_use]
    pub const fn mission(seat: Seat, first_cause: Option<Abort>, weight_fired: bool) -> Self {
        let cause = match first_cause {
            Some(cause) => (cause as u8).wrapping_add(1) & 0x1f,
            None => 0,
        };
        let number = match seat {
            Seat::Open | Seat::Host => 1,
            Seat::Sensors => 2,
            Seat::Backseat => 3,
        };
        Self((weight_fired as u8) << 7 | cause << 2 | number)
    }

    /// What counts after a reset, of what RAM and flash remember. Either is enough: after a power cut the RAM knows nothing, a broken
    /// flash never does.
    #[must_use]
    pub const fn after_reset(ram: Self, flash: Option<Self>) -> Self {
        match flash {
            Some(flash) if !ram.in_mission() => flash,
            _ => ram,
        }
    }

    /// Anything but zero means a mission: rather SAFE once too often.
    #[must_use]
    pub const fn in_mission(self) -> bool {
        self.0 != 0
    }

    /// Where the frames of the mission come from; [`Seat::Open`] without one.
    #[must_use]
    pub const fn seat(self) -> Seat {
        match (self.0, self.0 & 3) {
            (0, _) => Seat::Open,
            (_, 1) => Seat::Host,
            (_, 3) => Seat::Backseat,
            _ => Seat::Sensors,
        }
    }

    /// The drop weight was fired: fire it on after a reset.
    #[must_use]
    pub const fn weight_fired(self) -> bool {
        self.0 & 0x80 != 0
    }

    /// Why the mission was aborted; none: it was not, or the number means nothing.
    #[must_use]
    pub fn first_cause(self) -> Option<Abort> {
        let number = ((self.0 >> 2) & 0x1f).checked_sub(1)?;
        postcard::from_bytes(&[number]).ok()
    }
}

/// The mark in three copies, and whether the mission is over and the vehicle floats: one flipped bit does not change what they say.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Copies([u32; 3]);

impl Copies {
    /// Nothing was ever sealed: a controller that was just made.
    const NEW: u32 = 0x4E45_5721;
    /// Phase Done: nothing for a reset to find.
    const OVER: u32 = 1 << 8;

    pub(crate) const fn new() -> Self {
        Self([Self::NEW; 3])
    }

    pub(crate) const fn keep(&mut self, mark: Mark, over: bool) {
        self.0 = [mark.0 as u32 | if over { Self::OVER } else { 0 }; 3];
    }

    /// What two of three say; three different ones mean a mission.
    const fn word(&self) -> u32 {
        let [a, b, c] = self.0;
        if a == b || a == c {
            a
        } else if b == c {
            b
        } else {
            0xff
        }
    }

    /// The mission that is flown, or over with the vehicle still afloat; `None` for a controller that was
    /// just made.
    pub(crate) const fn mission(&self) -> Option<Mark> {
        match self.word() {
            Self::NEW => None,
            word => Some(Mark(word as u8)),
        }
    }

    /// What a reset must find again.
    pub(crate) const fn mark(&self) -> Option<Mark> {
        match self.word() {
            Self::NEW => None,
            word if word & Self::OVER != 0 => Some(Mark::NONE),
            word => Some(Mark(word as u8)),
        }
    }
}

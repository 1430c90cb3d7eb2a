//! What goes wrong on the buses, one fault at a time.

/// One disturbance of a bus or a part on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusFault {
    /// The byte after so many is not acknowledged.
    Nack {
        /// Bytes before it.
        bytes: u32,
    },
    /// After so many bits so many in a row are read wrongly.
    Flip {
        /// Bits before.
        bits: u32,
        /// Wrong ones.
        run: u32,
    },
    /// The data line is held low.
    DataLow {
        /// For so long, ms.
        ms: u32,
    },
    /// A part cut off in the middle of a byte holds the data line.
    DataHeld {
        /// For so many clocks.
        clocks: u32,
    },
    /// The clock is held low.
    ClockLow {
        /// For so long, ms.
        ms: u32,
    },
    /// A part does not answer.
    Deaf {
        /// Its address.
        address: u8,
        /// For so long, ms.
        ms: u32,
    },
    /// The supply of a part is interrupted.
    PartReset {
        /// Its address.
        address: u8,
    },
    /// Bytes of the compass are disturbed.
    CompassNoise {
        /// How many.
        bytes: u32,
    },
    /// The compass is silent.
    CompassSilent {
        /// For so long, ms.
        ms: u32,
    },
    /// Bytes read from the flash are disturbed.
    FlashNoise {
        /// How many.
        bytes: u32,
    },
    /// The flash does not answer.
    FlashAbsent {
        /// For so long, ms.
        ms: u32,
    },
    /// The flash takes its longest times from now on, or its usual ones again.
    FlashPace {
        /// Longest.
        slow: bool,
    },
}

/// Addresses of the parts on the I²C.
const ADDRESSES: [u8; 3] = [0x76, 0x48, 0x40];

impl BusFault {
    /// A fault of any kind and size; `random(n)` is a number below n.
    pub fn draw(mut random: impl FnMut(u32) -> u32) -> Self {
        let kind = random(12);
        let address = ADDRESSES[random(3) as usize % 3];
        match kind {
            0 => Self::Nack { bytes: random(250) },
            1 => Self::Flip { bits: random(2_000), run: 1 },
            2 => Self::Flip { bits: random(2_000), run: 2 + random(30) },
            3 => Self::DataLow { ms: 1 + random(3_000) },
            4 => Self::DataHeld { clocks: 1 + random(20) },
            5 => Self::ClockLow { ms: 1 + random(3_000) },
            6 => Self::Deaf { address, ms: 1 + random(3_000) },
            7 => Self::PartReset { address },
            8 => Self::CompassNoise { bytes: 1 + random(40) },
            9 => Self::CompassSilent { ms: 1 + random(3_000) },
            10 => Self::FlashNoise { bytes: 1 + random(300) },
            _ => match random(2) {
                0 => Self::FlashAbsent { ms: 1 + random(3_000) },
                _ => Self::FlashPace { slow: random(2) == 0 },
            },
        }
    }
}

//! What a board keeps of a run over a reset: words, the same in RAM, on the line and in a file (there little endian).
//!
//! ```text
//! note of the present run                    NOTE words
//! note of the last run that a fault ended    NOTE words          where there was one
//! its last finished cycles, a ring           CYCLES × CYCLE words
//! ```
//!
//! Each note and each cycle ends with the CRC-32 of the words before it: after a power cut RAM holds noise, and noise is nothing.

use crate::frame::Answer;
use crate::link::CRC32;

/// Words of a note.
pub const NOTE: usize = 24;
/// Words of a cycle.
pub const CYCLE: usize = 8;
/// Cycles that are kept: the last four minutes.
pub const CYCLES: usize = 64;
/// Words of a run: its note and its cycles.
pub const RUN: usize = NOTE + CYCLES * CYCLE;
/// Return addresses that are kept of a stack.
pub const CALLERS: usize = 7;

/// First word of a note; another layout gets another one.
const GUARD: u32 = 0x4154_5031;

/// Resets as the chip flags them, bits 25 to 31 of `RCC_CSR` (RM0090 7.3.21) moved down to 0.
pub mod flag {
    /// The supply fell below the brown-out level; also set by a power-up.
    pub const BROWN_OUT: u8 = 1;
    /// Reset pin; every other reset pulls it too.
    pub const PIN: u8 = 1 << 1;
    /// Power-up.
    pub const POWER: u8 = 1 << 2;
    /// By the program.
    pub const SOFTWARE: u8 = 1 << 3;
    /// Independent watchdog.
    pub const WATCHDOG: u8 = 1 << 4;
    /// Window watchdog.
    pub const WINDOW: u8 = 1 << 5;
    /// Low-power mode entered against the option bytes.
    pub const LOW_POWER: u8 = 1 << 6;
}

/// What ended a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)]
pub enum Cause {
    /// No fault: power, reset pin, or it goes on.
    #[default]
    None = 0,
    /// A panic (integer overflow is one).
    Panic = 1,
    /// Hard fault.
    Fault = 2,
    /// The stack grew into its canary.
    Stack = 3,
    /// An interrupt nobody handles.
    Interrupt = 4,
    /// No cycle was finished in time.
    Watchdog = 5,
    /// The supply fell below the brown-out level.
    Supply = 6,
}

impl Cause {
    const fn of(word: u32) -> Self {
        match word {
            1 => Self::Panic,
            2 => Self::Fault,
            3 => Self::Stack,
            4 => Self::Interrupt,
            5 => Self::Watchdog,
            6 => Self::Supply,
            _ => Self::None,
        }
    }

    /// What ended a run whose program had no time to say it.
    #[must_use]
    pub const fn by_flags(flags: u8) -> Self {
        if flags & (flag::WATCHDOG | flag::WINDOW) != 0 {
            Self::Watchdog
        } else if flags & (flag::BROWN_OUT | flag::POWER) == flag::BROWN_OUT {
            Self::Supply
        } else {
            Self::None
        }
    }

    /// In a word.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Panic => "panic",
            Self::Fault => "fault",
            Self::Stack => "stack",
            Self::Interrupt => "interrupt",
            Self::Watchdog => "watchdog",
            Self::Supply => "supply",
        }
    }
}

/// Registers at a fault (Armv7-M ARM B3.2.15 to B3.2.18, B1.5.6).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Registers {
    /// Configurable fault status.
    pub cfsr: u32,
    /// Hard fault status.
    pub hfsr: u32,
    /// Address of a memory management fault.
    pub mmfar: u32,
    /// Address of a bus fault.
    pub bfar: u32,
    /// Stack pointer when the handler was entered; the frame lies there.
    pub sp: u32,
    /// Program counter of the frame; 0: no frame could be stacked.
    pub pc: u32,
    /// Link register of the frame.
    pub lr: u32,
    /// Program status of the frame; of an interrupt nobody handles its exception number.
    pub xpsr: u32,
}

/// What is noted of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Note {
    /// Runs since power-up before this one.
    pub run: u32,
    /// What ended it.
    pub cause: Cause,
    /// Flags of the reset it began with.
    pub began: u8,
    /// Flags of the reset it ended with; 0: it goes on.
    pub ended: u8,
    /// Firmware version major, minor, patch.
    pub firmware: [u8; 3],
    /// Identity of the image: CRC-32 of its code, constants and initial values.
    pub image: u32,
    /// Time since its start when the fault was noted, 0.01 s; 0: nobody was there to note it.
    pub time_cs: u32,
    /// Of the processor.
    pub registers: Registers,
    /// What lay on the stack above the frame and returns behind a call, innermost first; 0: no more.
    pub callers: [u32; CALLERS],
}

impl Note {
    /// As words, with their CRC.
    #[must_use]
    pub fn words(&self) -> [u32; NOTE] {
        let Registers { cfsr, hfsr, mmfar, bfar, sp, pc, lr, xpsr } = self.registers;
        let [major, minor, patch] = self.firmware;
        let [a, b, c, d, e, f, g] = self.callers;
        let flags = u32::from_le_bytes([self.began, self.ended, 0, 0]);
        let firmware = u32::from_le_bytes([major, minor, patch, 0]);
        let mut words = [
            GUARD,
            self.run,
            self.cause as u32,
            flags,
            firmware,
            self.image,
            self.time_cs,
            cfsr,
            hfsr,
            mmfar,
            bfar,
            sp,
            pc,
            lr,
            xpsr,
            a,
            b,
            c,
            d,
            e,
            f,
            g,
            0,
            0,
        ];
        seal(&mut words);
        words
    }

    /// From words; `None` where they are none.
    #[must_use]
    pub fn read(words: &[u32; NOTE]) -> Option<Self> {
        let [GUARD, run, cause, flags, firmware, image, time_cs, cfsr, hfsr, mmfar, bfar, sp, pc, lr, xpsr, a, b, c, d, e, f, g, _, _] =
            *words
        else {
            return None;
        };
        if !is_sealed(words) {
            return None;
        }
        let [began, ended, ..] = flags.to_le_bytes();
        let [major, minor, patch, _] = firmware.to_le_bytes();
        Some(Self {
            run,
            cause: Cause::of(cause),
            began,
            ended,
            firmware: [major, minor, patch],
            image,
            time_cs,
            registers: Registers { cfsr, hfsr, mmfar, bfar, sp, pc, lr, xpsr },
            callers: [a, b, c, d, e, f, g],
        })
    }
}

/// What is kept of a finished control cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cycle {
    /// Number of the frame.
    pub seq: u32,
    /// Time since boot when it was finished, 0.01 s.
    pub time_cs: u32,
    /// Number of the phase.
    pub phase: u8,
    /// Number of the first abort; 255: none.
    pub abort: u8,
    /// Dives completed.
    pub dives: u16,
    /// Degradations.
    pub flags: u32,
    /// Depth believed by the law, m.
    pub depth_m: f32,
    /// Pitch aimed at, rad.
    pub pitch_setpoint_rad: f32,
    /// Ballast commanded, m³.
    pub ballast_m3: f32,
}

impl Cycle {
    /// Of an answer, finished at a time since boot, 0.01 s.
    #[must_use]
    pub fn of(answer: &Answer, time_cs: u32) -> Self {
        let trace = &answer.trace;
        Self {
            seq: answer.command.seq,
            time_cs,
            phase: trace.phase as u8,
            abort: trace.abort.map_or(u8::MAX, |abort| abort as u8),
            dives: trace.dives,
            flags: trace.flags.0,
            depth_m: trace.depth_m,
            pitch_setpoint_rad: trace.pitch_setpoint_rad,
            ballast_m3: answer.command.ballast_m3,
        }
    }

    /// As words, with their CRC.
    #[must_use]
    pub fn words(&self) -> [u32; CYCLE] {
        let [low, high] = self.dives.to_le_bytes();
        let state = u32::from_le_bytes([self.phase, self.abort, low, high]);
        let floats = [self.depth_m, self.pitch_setpoint_rad, self.ballast_m3].map(f32::to_bits);
        let [depth, pitch, ballast] = floats;
        let mut words = [self.seq, self.time_cs, state, self.flags, depth, pitch, ballast, 0];
        seal(&mut words);
        words
    }

    /// From words; `None` where they are none.
    #[must_use]
    pub fn read(words: &[u32; CYCLE]) -> Option<Self> {
        let [seq, time_cs, state, flags, depth, pitch, ballast, _] = *words;
        let [phase, abort, low, high] = state.to_le_bytes();
        is_sealed(words).then_some(Self {
            seq,
            time_cs,
            phase,
            abort,
            dives: u16::from_le_bytes([low, high]),
            flags,
            depth_m: f32::from_bits(depth),
            pitch_setpoint_rad: f32::from_bits(pitch),
            ballast_m3: f32::from_bits(ballast),
        })
    }
}

fn seal(words: &mut [u32]) {
    if let Some((last, body)) = words.split_last_mut() {
        *last = checksum(body);
    }
}

fn is_sealed(words: &[u32]) -> bool {
    words.split_last().is_some_and(|(last, body)| *last == checksum(body))
}

fn checksum(words: &[u32]) -> u32 {
    let mut digest = CRC32.digest();
    words.iter().for_each(|word| digest.update(&word.to_le_bytes()));
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn note() -> Note {
        let registers = Registers { cfsr: 0x8200, hfsr: 1 << 30, mmfar: 1, bfar: 2, sp: 3, pc: 4, lr: 5, xpsr: 6 };
        Note {
            run: 7,
            cause: Cause::Fault,
            began: flag::PIN,
            ended: flag::SOFTWARE,
            firmware: [1, 2, 3],
            image: 8,
            time_cs: 9,
            registers,
            callers: [1, 2, 3, 4, 5, 6, 7],
        }
    }

    #[test]
    fn what_is_written_is_read_and_every_flipped_bit_is_nothing() {
        let mut answer = Answer::default();
        (answer.command.seq, answer.command.ballast_m3) = (4, 2e-4);
        (answer.trace.abort, answer.trace.dives, answer.trace.depth_m) = (Some(crate::Abort::Leak), 300, 12.5);
        let cycle = Cycle::of(&answer, 77);
        assert_eq!(Note::read(&note().words()), Some(note()));
        assert_eq!(Cycle::read(&cycle.words()), Some(cycle));
        assert_eq!((cycle.abort, Cycle::of(&Answer::default(), 0).abort), (1, 255));
        for bit in 0..32 * NOTE {
            let mut words = note().words();
            words[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(Note::read(&words), None, "bit {bit}");
        }
        for bit in 0..32 * CYCLE {
            let mut words = cycle.words();
            words[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(Cycle::read(&words), None, "bit {bit}");
        }
        assert_eq!((Note::read(&[0; NOTE]), Cycle::read(&[0; CYCLE])), (None, None), "cleared RAM");
    }

    #[test]
    fn a_reset_without_a_word_of_the_program_is_named_by_its_flags() {
        for (flags, cause) in [
            (0, Cause::None),
            (flag::PIN, Cause::None),
            (flag::POWER | flag::PIN | flag::BROWN_OUT, Cause::None),
            (flag::BROWN_OUT | flag::PIN, Cause::Supply),
            (flag::WATCHDOG | flag::PIN, Cause::Watchdog),
            (flag::WINDOW, Cause::Watchdog),
            (flag::SOFTWARE | flag::PIN, Cause::None),
        ] {
            assert_eq!(Cause::by_flags(flags), cause, "{flags:#x}");
        }
    }
}

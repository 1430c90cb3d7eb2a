//! A board's UTC, asked for and set by this computer's.

use super::error::SeatError;
use super::link::{Link, Wire};
use serde_json::{Value, json};
use signals::{Clock, Refusal, Timebase, ToBoard, ToHost};
use std::time::{SystemTime, UNIX_EPOCH};

/// Times that a setting is tried: the answer to one may be lost, or come late.
const SETTING_TRIES: u32 = 3;
/// A board's loop may be busy for so long when the message ends, ms.
const BUSY_MS: f64 = 100.0;

/// How far a board's UTC is from this computer's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Off {
    /// Board less this computer, s.
    pub off_s: f64,
    /// The difference is known to this, s: half the time that question and answer took.
    pub known_s: f64,
    /// The board itself holds its UTC right to this, s.
    pub within_s: f64,
}

/// What came of setting it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setting {
    /// This board has no clock.
    NoClock,
    /// It was set.
    Set {
        /// How far it was off before; none: it was unknown.
        before: Option<Off>,
        /// How far it is off now.
        after: Off,
        /// What the board's clock runs on.
        base: Timebase,
    },
}

/// This computer's UTC, ms since 1970.
#[must_use]
pub fn system_ms() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64() * 1e3)
}

/// The board's time, this computer's in the middle of the question, and half the time that it took, ms.
fn ask<W: Wire>(link: &mut Link<W>, here_ms: &dyn Fn() -> f64) -> Result<(Clock, Option<Off>, f64), SeatError> {
    const WHAT: &str = "what time it is";
    let start_ms = here_ms();
    let clock = link.request(WHAT, &ToBoard::Clock { set: None }, |answer| match answer {
        ToHost::Clock(clock) => Some(Ok(clock)),
        ToHost::Refused(why) => Some(Err(SeatError::Refused { asked: WHAT, why })),
        _ => None,
    })??;
    let half_ms = 0.5 * (here_ms() - start_ms).max(0.0);
    let off = clock.utc.map(|utc| Off {
        off_s: (utc.ms as f64 - start_ms - half_ms) * 1e-3,
        known_s: half_ms * 1e-3,
        within_s: f64::from(utc.within_ms) * 1e-3,
    });
    Ok((clock, off, half_ms))
}

/// Sets a board's UTC by this computer's ([`system_ms`]), and looks whether it took it. On deck only.
///
/// # Errors
/// Line lost, or the board refuses: a mission is under way, or this computer's own clock says nonsense.
pub fn set<W: Wire>(link: &mut Link<W>, here_ms: &dyn Fn() -> f64) -> Result<Setting, SeatError> {
    const WHAT: &str = "this computer's UTC";
    let (clock, before, mut half_ms) = ask(link, here_ms)?;
    if clock.board_ms.is_none() {
        return Ok(Setting::NoClock);
    }
    for _ in 0..SETTING_TRIES {
        let within_ms = half_ms + BUSY_MS;
        let message = ToBoard::Clock { set: Some(((here_ms() + half_ms) as u64, within_ms as u32)) };
        // Not repeated: said a second time it would be late. Whether it came is asked below.
        let said = link.once(WHAT, &message, |answer| match answer {
            ToHost::Clock(_) => Some(Ok(())),
            ToHost::Refused(why) => Some(Err(SeatError::Refused { asked: WHAT, why })),
            _ => None,
        });
        match said {
            Ok(Err(refused)) => return Err(refused),
            Err(lost @ SeatError::Lost { .. }) => return Err(lost),
            _ => {}
        }
        let (_, after, half) = ask(link, here_ms)?;
        if let Some(after) = after.filter(|a| a.off_s.abs() <= a.within_s + a.known_s) {
            return Ok(Setting::Set { before, after, base: clock.base });
        }
        half_ms = half;
    }
    Err(SeatError::Refused { asked: WHAT, why: Refusal::Time })
}

impl Setting {
    /// For a person.
    #[must_use]
    pub fn words(&self) -> String {
        match self {
            Self::NoClock => "this board keeps no time: its records have no date".to_owned(),
            Self::Set { before: None, after, .. } => format!("set (it was unknown), right to {:.2} s", after.within_s),
            Self::Set { before: Some(before), after, .. } => {
                let way = if before.off_s < 0.0 { "slow" } else { "fast" };
                format!("set (it was {:.2} s {way}), right to {:.2} s", before.off_s.abs(), after.within_s)
            }
        }
    }

    /// What the board's crystal is, or what is wrong with it.
    ///
    /// # Errors
    /// It does not run, or is another one: in words.
    pub const fn crystal(&self) -> Result<&'static str, &'static str> {
        match self {
            Self::Set { base: Timebase::NoCrystal, .. } => {
                Err("does not start: the board runs on its internal oscillator, 4 % off at worst")
            }
            Self::Set { base: Timebase::WrongCrystal, .. } => {
                Err("is not one of 16 MHz: the board runs on its internal oscillator, 4 % off at worst")
            }
            Self::Set { base: Timebase::Crystal, .. } => Ok("measured: 16 MHz"),
            _ => Ok("none on this board"),
        }
    }

    /// For a program.
    #[must_use]
    pub fn document(&self) -> Value {
        match self {
            Self::NoClock => Value::Null,
            Self::Set { before, after, .. } => {
                json!({ "was_off_s": before.map(|b| b.off_s), "off_s": after.off_s, "within_s": after.within_s })
            }
        }
    }
}

//! A board's option bytes, asked for and set over the line, and what is wrong with them in words.

use super::error::SeatError;
use super::link::{Link, Wire};
use devices::options::{Deviation, deviations};
use signals::{ToBoard, ToHost};

/// Questions whether they were set: half a second of the board's.
const QUESTIONS: u32 = 10;

fn ask<W: Wire>(link: &mut Link<W>, set: bool) -> Result<Option<u32>, SeatError> {
    let asked = if set { "to set its option bytes" } else { "its option bytes" };
    link.request(asked, &ToBoard::OptionBytes { set }, |answer| match answer {
        ToHost::OptionBytes(found) => Some(Ok(found)),
        ToHost::Refused(why) => Some(Err(SeatError::Refused { asked, why })),
        _ => None,
    })?
}

/// What they are (FLASH_OPTCR); none: no chip.
///
/// # Errors
/// The board does not answer.
pub fn read<W: Wire>(link: &mut Link<W>) -> Result<Option<u32>, SeatError> {
    ask(link, false)
}

/// Sets what can be set, on deck. `wait` lets the board work. What they are then.
///
/// # Errors
/// The board does not answer, or refuses: a mission is under way.
pub fn set<W: Wire>(link: &mut Link<W>, wait: &dyn Fn()) -> Result<Option<u32>, SeatError> {
    let before = ask(link, true)?;
    for _ in 0..QUESTIONS {
        let now = ask(link, false)?;
        if now != before || !deviations(now.unwrap_or(0)).any(can_be_set) {
            return Ok(now);
        }
        wait();
    }
    Ok(before)
}

fn can_be_set(deviation: Deviation) -> bool {
    !matches!(deviation, Deviation::Protected | Deviation::ProtectedForEver)
}

fn word(deviation: Deviation) -> &'static str {
    match deviation {
        Deviation::BrownOut => "brown-out reset below level 3",
        Deviation::Watchdog => "watchdog not started by hardware",
        Deviation::LowPowerReset => "a reset instead of STOP",
        Deviation::Protected => "read-out protection 1: take it away with a debugger, which erases the chip",
        Deviation::ProtectedForEver => "read-out protection 2: fit another chip",
    }
}

/// As they should be, or what is not and what mends it.
///
/// # Errors
/// What is wrong.
pub fn words(found: Option<u32>) -> Result<String, String> {
    let Some(optcr) = found else { return Err("not read: no chip, or firmware of another release".to_owned()) };
    let wrong: Vec<_> = deviations(optcr).collect();
    if wrong.is_empty() {
        return Ok(format!("brown-out level 3, watchdog by hardware, readable (FLASH_OPTCR {optcr:08x})"));
    }
    let mend = if wrong.iter().any(|d| can_be_set(*d)) { "; set them with --set-option-bytes" } else { "" };
    Err(format!("{}{mend}", wrong.into_iter().map(word).collect::<Vec<_>>().join(", ")))
}

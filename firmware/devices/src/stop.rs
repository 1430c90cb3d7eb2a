//! STOP mode of the STM32F405 (RM0090 rev 19, 5.3.5), ended by the calendar clock's wake-up timer (26.3.6) or by the first edge on the line.
//!
//! The chip's clocks stand still meanwhile, so the milliseconds since boot are taken from the calendar clock's count: always the whole
//! count since the first stop and never a sum of small ones, so that its step of 4 ms is counted once. Where that clock does not run on
//! its crystal, or at a pace that the chip's own clock contradicts, there is no stop.

use crate::options::{Deviation, deviations};
use crate::registers::Registers;
use crate::rtc::{CR as RTC_CR, ISR, Oscillator, PWR_CR, Rtc, WPR, WUTR};

/// Longest stop, ms: the independent watchdog, which counts on, is 8.1 s at its fastest.
pub const MOST_MS: u64 = 4_000;
/// Time the calendar clock is watched beside the chip's own before the first stop, ms.
const PROOF_MS: u64 = 1_000;
/// Step of the count, twice: of the moment before and of the one after, ms.
pub const STEP_MS: u64 = 8;
/// The chip's own clock may be off by this part (internal oscillator: 4 %, DS8626 table 41).
const PART: u64 = 20;
/// Wake-up timer: a sixteenth of the crystal, Hz.
const WAKE_HZ: u64 = 2_048;

const WUTE: u32 = 1 << 10;
const WUTIE: u32 = 1 << 14;
const WUCKSEL: u32 = 7;
const WUTWF: u32 = 1 << 2;
const WUTF: u32 = 1 << 10;
/// Initialisation mode: the one bit of ISR that is not cleared by 0 alone.
const INIT: u32 = 1 << 7;

/// External interrupt lines: 22 is the wake-up timer, 10 the line's receiver at PA10 (EXTICR at reset: port A).
const IMR: u32 = 0x4001_3c00;
const RTSR: u32 = IMR + 0x08;
const FTSR: u32 = IMR + 0x0c;
const PR: u32 = IMR + 0x14;
const TIMER_LINE: u32 = 1 << 22;
const RECEIVER_LINE: u32 = 1 << 10;
/// Interrupts 3 (wake-up timer) and 40 (lines 10 to 15): enabled, so that they end WFI; never served.
const ISER: u32 = 0xe000_e100;
const ICER: u32 = 0xe000_e180;
const ICPR: u32 = 0xe000_e280;
const INTERRUPTS: [(u32, u32); 2] = [(0, 1 << 3), (4, 1 << 8)];
/// Deep sleep instead of sleep.
const SCR: u32 = 0xe000_ed10;
const SLEEPDEEP: u32 = 1 << 2;
/// Regulator and flash in low power, not standby.
const LPDS: u32 = 1;
const PDDS: u32 = 1 << 1;
const CWUF: u32 = 1 << 2;
const FPDS: u32 = 1 << 9;
/// Crystal on, ready, watched; chosen as the clock.
const RCC_CR: u32 = 0x4002_3800;
const HSEON: u32 = 1 << 16;
const HSERDY: u32 = 1 << 17;
const CSSON: u32 = 1 << 19;
const CFGR: u32 = 0x4002_3808;
const SW: u32 = 3;
const SW_HSE: u32 = 1;
const SWS: u32 = 3 << 2;
const SWS_HSE: u32 = 1 << 2;
/// Longest wait for a flag, readings: the crystal takes 2 ms (DS8626 table 39).
const CRYSTAL_WAIT: u32 = 20_000;

/// What a stop was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Woken {
    /// Milliseconds since boot.
    pub now_ms: u64,
    /// The line ended it: its first byte is lost.
    pub by_line: bool,
    /// The chip ran on its crystal before, and does no longer: it did not start again.
    pub crystal_lost: bool,
}

/// Time over all stops since boot.
#[derive(Debug)]
pub struct Stops {
    /// Count and time since boot when stops began.
    first: Option<(u64, u64)>,
    /// And when the chip last ran on.
    last: (u64, u64),
    proved: bool,
    refused: bool,
}

impl Stops {
    /// None yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { first: None, last: (0, 0), proved: false, refused: false }
    }

    /// None yet, on a chip with these option bytes: with some a stop would be a reset.
    #[must_use]
    pub fn of(optcr: Option<u32>) -> Self {
        let resets = optcr.is_some_and(|optcr| deviations(optcr).any(|d| d == Deviation::LowPowerReset));
        Self { refused: resets, ..Self::new() }
    }

    /// How far the milliseconds since boot may be off, parts of a million of the time passed; beside [`STEP_MS`].
    #[must_use]
    pub const fn ppm() -> u32 {
        Oscillator::Crystal.ppm()
    }

    /// Stops for `ms` at most. `halt` waits for an interrupt, with interrupts held off. None: not now.
    pub fn stop<R: Registers>(&mut self, rtc: &mut Rtc<R>, now_ms: u64, ms: u64, halt: impl FnOnce(&mut R)) -> Option<Woken> {
        if self.refused || rtc.oscillator() != Some(Oscillator::Crystal) {
            (self.first, self.proved) = (None, false);
            return None;
        }
        let count_ms = rtc.count_ms()?;
        let ms = ms.min(MOST_MS);
        if !self.is_believed(count_ms, now_ms) || ms == 0 || !arm(&mut rtc.registers, ms) {
            return None;
        }
        let (by_line, crystal_lost) = sleep(&mut rtc.registers, halt);
        disarm(&mut rtc.registers);
        let count_ms = rtc.count_ms();
        Some(Woken { now_ms: self.after(count_ms, now_ms, ms), by_line, crystal_lost })
    }

    /// Whether the calendar clock has kept pace with the chip's own since the chip last ran on.
    fn is_believed(&mut self, count_ms: u64, now_ms: u64) -> bool {
        if self.first.is_none() {
            (self.first, self.last) = (Some((count_ms, now_ms)), (count_ms, now_ms));
        }
        let (count, ms) = self.last;
        let awake_ms = now_ms.saturating_sub(ms);
        if !self.proved && awake_ms < PROOF_MS {
            return false;
        }
        self.refused = count_ms.saturating_sub(count).abs_diff(awake_ms) > STEP_MS.saturating_add(awake_ms / PART);
        self.proved = !self.refused;
        self.proved
    }

    /// Time since boot after a stop that was to last `ms`.
    fn after(&mut self, count_ms: Option<u64>, before_ms: u64, ms: u64) -> u64 {
        let awake_ms = before_ms.saturating_sub(self.last.1);
        let latest_ms = before_ms.saturating_add(ms).saturating_add(STEP_MS).saturating_add(awake_ms / PART);
        let counted = count_ms.zip(self.first).map(|(count, (first, at_ms))| at_ms.saturating_add(count.saturating_sub(first)));
        // A count that is not there, or says what the timer cannot: as long as the timer was set to, and the last stop.
        let Some(counted) = counted.filter(|counted| *counted <= latest_ms) else {
            self.refused = true;
            return before_ms.saturating_add(ms);
        };
        let now_ms = counted.max(before_ms);
        self.last = (count_ms.unwrap_or(0), now_ms);
        now_ms
    }
}

impl Default for Stops {
    fn default() -> Self {
        Self::new()
    }
}

fn set<R: Registers>(registers: &mut R, address: u32, clear: u32, bits: u32) {
    let now = registers.read(address);
    registers.write(address, now & !clear | bits);
}

fn wait<R: Registers>(registers: &mut R, address: u32, mask: u32, value: u32) -> bool {
    (0..CRYSTAL_WAIT).any(|_| registers.read(address) & mask == value)
}

/// Sets the wake-up timer; false: it cannot be set.
fn arm<R: Registers>(registers: &mut R, ms: u64) -> bool {
    unlock(registers);
    set(registers, RTC_CR, WUTE | WUTIE, 0);
    let ready = wait(registers, ISR, WUTWF, WUTWF);
    if ready {
        // At most 8,192 of 65,536.
        let ticks = (ms.min(MOST_MS).wrapping_mul(WAKE_HZ) / 1_000).max(1) as u32;
        registers.write(WUTR, ticks.wrapping_sub(1));
        registers.write(ISR, !(WUTF | INIT));
        set(registers, RTC_CR, WUCKSEL, WUTE | WUTIE);
    }
    registers.write(WPR, 0xff);
    set(registers, RTSR, 0, TIMER_LINE);
    set(registers, FTSR, 0, RECEIVER_LINE);
    registers.write(PR, TIMER_LINE | RECEIVER_LINE);
    ready
}

/// The stop itself, and the clock as it was. Whether the line ended it; whether the crystal did not start again.
fn sleep<R: Registers>(registers: &mut R, halt: impl FnOnce(&mut R)) -> (bool, bool) {
    let crystal = registers.read(CFGR) & SWS == SWS_HSE;
    set(registers, IMR, 0, TIMER_LINE | RECEIVER_LINE);
    for (at, bit) in INTERRUPTS {
        registers.write(ISER.saturating_add(at), bit);
    }
    set(registers, PWR_CR, PDDS, LPDS | FPDS | CWUF);
    set(registers, SCR, 0, SLEEPDEEP);
    halt(registers);
    set(registers, SCR, SLEEPDEEP, 0);
    // It runs on the internal oscillator now, at the same 16 MHz.
    let mut lost = false;
    if crystal && registers.read(CFGR) & SWS != SWS_HSE {
        set(registers, RCC_CR, 0, HSEON);
        lost = !wait(registers, RCC_CR, HSERDY, HSERDY);
        if lost {
            set(registers, RCC_CR, HSEON, 0);
        } else {
            set(registers, RCC_CR, 0, CSSON);
            set(registers, CFGR, SW, SW_HSE);
            lost = !wait(registers, CFGR, SWS, SWS_HSE);
        }
    }
    (registers.read(PR) & RECEIVER_LINE != 0, lost)
}

/// Timer off, and nothing left that is waiting to be served.
fn disarm<R: Registers>(registers: &mut R) {
    unlock(registers);
    set(registers, RTC_CR, WUTE | WUTIE, 0);
    registers.write(ISR, !(WUTF | INIT));
    registers.write(WPR, 0xff);
    set(registers, IMR, TIMER_LINE | RECEIVER_LINE, 0);
    registers.write(PR, TIMER_LINE | RECEIVER_LINE);
    for (at, bit) in INTERRUPTS {
        registers.write(ICER.saturating_add(at), bit);
        registers.write(ICPR.saturating_add(at), bit);
    }
}

fn unlock<R: Registers>(registers: &mut R) {
    registers.write(WPR, 0xca);
    registers.write(WPR, 0x53);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn proved() -> Stops {
        let mut stops = Stops::new();
        assert!(!stops.is_believed(50_000, 1_000), "not watched yet");
        assert!(!stops.is_believed(50_500, 1_500));
        assert!(stops.is_believed(51_004, 2_000));
        stops
    }

    #[test]
    fn where_a_stop_would_be_a_reset_there_is_none() {
        assert!(Stops::of(Some(0x0fff_aa81)).refused && Stops::of(Some(0x0fff_aa41)).refused);
        assert!(!Stops::of(Some(0x0fff_aaed)).refused && !Stops::of(None).refused);
    }

    #[test]
    fn a_calendar_clock_at_another_pace_stops_nothing() {
        for count_ms in [50_000, 50_900, 51_100, 53_000, 0] {
            let mut stops = Stops::new();
            stops.is_believed(50_000, 1_000);
            assert!(!stops.is_believed(count_ms, 2_000) && stops.refused, "{count_ms}");
        }
        let mut stops = proved();
        stops.after(Some(52_000), 2_000, 1_000);
        assert!(!stops.is_believed(52_000, 3_500), "it stood still while the chip ran");
    }

    #[test]
    fn accuracy_steps_of_the_count_do_not_add_up() {
        let mut stops = proved();
        // A count that goes up in steps of 4 ms; a stop of 997.3 ms and 3.1 ms of work in turn, the chip's clock counting whole ms.
        let (mut true_ms, mut now_ms) = (1_000.0f64, 2_000u64);
        let count = |true_ms: f64| 50_000 + (true_ms / 3.906_25).floor() as u64 * 390_625 / 100_000;
        for _ in 0..100_000 {
            assert!(stops.is_believed(count(true_ms), now_ms));
            true_ms += 997.3;
            now_ms = stops.after(Some(count(true_ms)), now_ms, 998);
            true_ms += 3.1;
            now_ms += 3;
        }
        assert!((now_ms as f64 - 1_000.0 - true_ms).abs() <= STEP_MS as f64, "{now_ms} {true_ms}");
    }

    #[test]
    fn a_count_that_jumps_or_is_gone_is_the_last_stop() {
        for count_ms in [None, Some(60_000), Some(52_500)] {
            let mut stops = proved();
            assert_eq!(stops.after(count_ms, 2_000, 1_000), 3_000, "{count_ms:?}");
            assert!(stops.refused);
        }
        // Ended early, or a count that went back: time does not.
        assert_eq!(proved().after(Some(51_300), 2_000, 1_000), 2_300);
        assert_eq!(proved().after(Some(50_000), 2_000, 1_000), 2_000);
    }
}

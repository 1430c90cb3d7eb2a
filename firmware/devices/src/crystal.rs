//! The crystal of the STM32F405 (HSE), measured against its internal oscillator (HSI) before the chip runs on it.
//!
//! Timer 11 can capture edges of the crystal divided for the calendar clock (RM0090 19.4.6, TI1_RMP = 10): one sixteenth of it, every
//! eighth edge, timed in cycles of HSI. HSI is right to 4 % from -10 to 85 °C (DS8626 table 41), so 12 and 20 MHz are distinguished from 16 MHz,
//! and 16.384 MHz is not.

use crate::registers::Registers;

/// What the board is built for, Hz: crystal and internal oscillator alike.
pub const HZ: u32 = 16_000_000;
/// A crystal that measures farther from it than this part of a hundred is another one.
const PERCENT: u32 = 6;
const CFGR: u32 = 0x4002_3808;
const RTCPRE: u32 = 0x1f << 16;
const SIXTEENTH: u32 = 16 << 16;
const APB2ENR: u32 = 0x4002_3844;
const TIM11EN: u32 = 1 << 18;
const CR1: u32 = 0x4001_4800;
const SR: u32 = CR1 + 0x10;
const CAPTURED: u32 = 1 << 1;
const MISSED: u32 = 1 << 9;
const CCMR1: u32 = CR1 + 0x18;
/// Channel 1 is an input, every eighth edge.
const EIGHTH: u32 = 0b1101;
const CCER: u32 = CR1 + 0x20;
const ARR: u32 = CR1 + 0x2c;
const CCR1: u32 = CR1 + 0x34;
const OR: u32 = CR1 + 0x50;
const CRYSTAL: u32 = 0b10;
/// Captures that are timed: 0.5 ms, of which a cycle of HSI is one part in 8,192.
const CAPTURES: u32 = 64;
/// Cycles of the crystal in that time.
const CYCLES: u64 = CAPTURES as u64 * 8 * 16;
/// Longest wait, readings.
const CAPTURE_WAIT: u32 = 40_000;

/// Frequency of the running crystal, Hz, right to what HSI is; none: no edges came, or some were missed. The chip runs on HSI.
pub fn measure(registers: &mut impl Registers) -> Option<u32> {
    let (cfgr, apb2enr) = (registers.read(CFGR), registers.read(APB2ENR));
    registers.write(APB2ENR, apb2enr | TIM11EN);
    registers.write(CFGR, cfgr & !RTCPRE | SIXTEENTH);
    for (address, value) in [(OR, CRYSTAL), (CCMR1, EIGHTH), (ARR, 0xffff), (CCER, 1), (SR, 0), (CR1, 1)] {
        registers.write(address, value);
    }
    let cycles = time(registers);
    for address in [CR1, CCER, CCMR1, OR] {
        registers.write(address, 0);
    }
    registers.write(CFGR, cfgr);
    registers.write(APB2ENR, apb2enr);
    let hz = CYCLES.wrapping_mul(u64::from(HZ)).checked_div(u64::from(cycles?))?;
    u32::try_from(hz).ok()
}

/// Cycles of HSI that the captures take.
fn time(registers: &mut impl Registers) -> Option<u32> {
    let mut first = None;
    let mut count = 0u32;
    for _ in 0..CAPTURE_WAIT {
        let status = registers.read(SR);
        if status & MISSED != 0 {
            return None;
        }
        if status & CAPTURED == 0 {
            continue;
        }
        let at = registers.read(CCR1);
        let Some(first) = first else {
            first = Some(at);
            continue;
        };
        count = count.saturating_add(1);
        if count == CAPTURES {
            return Some(at.wrapping_sub(first) & 0xffff);
        }
    }
    None
}

/// Whether a measured frequency is that of the board's crystal.
#[must_use]
pub const fn is_right(hz: u32) -> bool {
    hz.abs_diff(HZ) <= HZ / 100 * PERCENT
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Timer and crystal; a reading takes so many cycles of HSI.
    struct Chip {
        crystal_hz: f64,
        hsi_hz: f64,
        per_read: u64,
        now: u64,
        next: f64,
        written: std::collections::BTreeMap<u32, u32>,
        status: u32,
        captured: u32,
        reads: u32,
    }

    impl Chip {
        fn new(crystal_hz: f64, hsi_hz: f64, per_read: u64) -> Self {
            Self {
                crystal_hz,
                hsi_hz,
                per_read,
                now: 65_000,
                next: 65_000.0,
                written: Default::default(),
                status: 0,
                captured: 0,
                reads: 0,
            }
        }
        fn is_set_up(&self) -> bool {
            let set = |a: u32, v: u32| self.written.get(&a) == Some(&v);
            set(OR, 2) && set(CCMR1, 0b1101) && set(CCER, 1) && set(CR1, 1) && self.written.get(&CFGR).is_some_and(|v| v >> 16 & 31 == 16)
        }
    }

    impl Registers for Chip {
        fn read(&mut self, address: u32) -> u32 {
            self.reads += 1;
            self.now += self.per_read;
            while self.is_set_up() && self.crystal_hz > 0.0 && self.next <= self.now as f64 {
                self.status |= if self.status & CAPTURED != 0 { MISSED } else { CAPTURED };
                self.captured = self.next as u64 as u32 & 0xffff;
                self.next += 8.0 * 16.0 / self.crystal_hz * self.hsi_hz;
            }
            match address {
                SR => self.status,
                CCR1 => {
                    self.status &= !CAPTURED;
                    self.captured
                }
                _ => self.written.get(&address).copied().unwrap_or(0),
            }
        }
        fn write(&mut self, address: u32, value: u32) {
            self.written.insert(address, value);
        }
    }

    #[test]
    fn the_right_crystal_is_recognised_at_any_temperature_of_the_sea() {
        for hsi_hz in [15.4e6, 16.0e6, 16.6e6] {
            for (mhz, right) in [(16.0, true), (8.0, false), (12.0, false), (14.318, false), (18.432, false), (20.0, false), (25.0, false)]
            {
                let mut chip = Chip::new(mhz * 1e6, hsi_hz, 12);
                let hz = measure(&mut chip).unwrap();
                assert!((f64::from(hz) / (mhz * 1e6) * hsi_hz / 16e6 - 1.0).abs() < 3e-4, "{mhz} MHz: {hz}");
                assert_eq!(is_right(hz), right, "{mhz} MHz measures {hz} with HSI at {hsi_hz}");
                // Nothing is left running.
                assert!([CR1, CCER, CFGR, APB2ENR, OR].iter().all(|a| chip.written.get(a) == Some(&0)));
            }
        }
    }

    #[test]
    fn no_edges_or_missed_ones_are_no_measurement_and_the_wait_ends() {
        let mut dead = Chip::new(0.0, 16e6, 12);
        assert_eq!(measure(&mut dead), None);
        assert!(dead.reads < CAPTURE_WAIT + 10);
        assert_eq!(measure(&mut Chip::new(16e6, 16e6, 90)), None, "a loop too slow for its captures");
    }
}

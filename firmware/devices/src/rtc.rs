//! The STM32F405's calendar clock (RM0090 chapter 26): milliseconds that go on over a reset, and registers that it leaves alone.
//!
//! It is never set to a date: it counts from the moment it was started, and whoever asks writes into the registers beside it which
//! UTC belonged to which count. Its crystal (LSE, 32,768 Hz) is waited for without standing still; where it does not start, the
//! internal oscillator (LSI) counts, at half to one and a half its pace. Where nothing counts (no such block, as in QEMU; a crystal that
//! stopped) there is no count, and after the next reset UTC is unknown.

use crate::gps::days;
use crate::registers::Registers;

/// RCC: clock of the power block; backup domain; LSI.
const APB1ENR: u32 = 0x4002_3840;
const PWREN: u32 = 1 << 28;
const BDCR: u32 = 0x4002_3870;
const LSEON: u32 = 1;
const LSERDY: u32 = 1 << 1;
const FROM_LSE: u32 = 1 << 8;
const FROM_LSI: u32 = 2 << 8;
const FROM: u32 = 3 << 8;
const RTCEN: u32 = 1 << 15;
const BDRST: u32 = 1 << 16;
const CSR: u32 = 0x4002_3874;
const LSION: u32 = 1;
const LSIRDY: u32 = 1 << 1;
/// PWR: writing to the backup domain allowed.
pub(crate) const PWR_CR: u32 = 0x4000_7000;
const DBP: u32 = 1 << 8;
/// RTC.
const TR: u32 = 0x4000_2800;
const DR: u32 = TR + 0x04;
pub(crate) const CR: u32 = TR + 0x08;
const BYPSHAD: u32 = 1 << 5;
pub(crate) const ISR: u32 = TR + 0x0c;
const INIT: u32 = 1 << 7;
const INITF: u32 = 1 << 6;
const PRER: u32 = TR + 0x10;
pub(crate) const WUTR: u32 = TR + 0x14;
pub(crate) const WPR: u32 = TR + 0x24;
const SSR: u32 = TR + 0x28;
const BACKUP: u32 = TR + 0x50;

/// 2001-01-01, a Monday: a year other than 0 is one that was set.
const FIRST_DAY: u32 = 0x0001_2101;
/// Longest wait for a flag, readings: it takes two cycles of the slow clock, 0.1 ms.
const FLAG_WAIT: u32 = 10_000;
/// Longest wait for the crystal, ms: 2 s are usual (DS8626 table 40).
const CRYSTAL_MS: u64 = 5_000;
/// Time between two looks at whether it counts, ms.
const LOOK_MS: u64 = 4_000;
/// Words that a reset leaves alone: of the chip's 20 as many as are used.
pub const WORDS: usize = 6;

/// What counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Oscillator {
    /// Crystal.
    Crystal,
    /// Internal: 17 to 47 kHz, 32 typical (DS8626 table 42).
    Internal,
}

impl Oscillator {
    /// How far the truth may be from what it counts, parts of a million: of the crystal twice what one of ±20 ppm drifts from 25 to
    /// 0 °C; a count at 17 kHz falls short by 0.89 of itself.
    #[must_use]
    pub const fn ppm(self) -> u32 {
        match self {
            Self::Crystal => 100,
            Self::Internal => 900_000,
        }
    }

    /// Counts below a second, less one.
    const fn last_part(self) -> u32 {
        match self {
            Self::Crystal => 255,
            Self::Internal => 249,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Absent,
    /// The crystal was asked to start.
    Starting {
        since_ms: u64,
    },
    Counting(Oscillator),
}

/// The clock.
#[derive(Debug)]
pub struct Rtc<R> {
    pub(crate) registers: R,
    state: State,
    /// Count and time since boot at the last look.
    looked: Option<(u64, u64)>,
}

impl<R: Registers> Rtc<R> {
    /// Takes it as the last run left it, or starts it.
    pub fn open(registers: R, now_ms: u64) -> Self {
        let mut rtc = Self { registers, state: State::Absent, looked: None };
        rtc.set(APB1ENR, PWREN);
        rtc.set(PWR_CR, DBP);
        if !rtc.wait(PWR_CR, DBP) {
            return rtc;
        }
        let found = rtc.registers.read(BDCR);
        rtc.state = match found & (RTCEN | FROM) {
            f if f == RTCEN | FROM_LSE && found & LSERDY != 0 => State::Counting(Oscillator::Crystal),
            f if f == RTCEN | FROM_LSI && rtc.start_internal() => State::Counting(Oscillator::Internal),
            _ => {
                // A crystal that stands still, or nothing yet: what is kept there means nothing.
                rtc.registers.write(BDCR, BDRST);
                rtc.registers.write(BDCR, LSEON);
                State::Starting { since_ms: now_ms }
            }
        };
        rtc
    }

    /// What counts; none: nothing does, or not yet.
    #[must_use]
    pub const fn oscillator(&self) -> Option<Oscillator> {
        match self.state {
            State::Counting(oscillator) => Some(oscillator),
            _ => None,
        }
    }

    /// Goes on with starting it, and looks whether it counts. `now_ms`: since boot.
    pub fn poll(&mut self, now_ms: u64) {
        match self.state {
            State::Absent => {}
            State::Starting { since_ms } => {
                if self.registers.read(BDCR) & LSERDY != 0 {
                    self.start(Oscillator::Crystal, FROM_LSE);
                } else if now_ms.saturating_sub(since_ms) >= CRYSTAL_MS {
                    self.registers.write(BDCR, 0);
                    self.state = State::Absent;
                    if self.start_internal() {
                        self.start(Oscillator::Internal, FROM_LSI);
                    }
                }
            }
            State::Counting(oscillator) => self.look(oscillator, now_ms),
        }
    }

    /// One that stands still or runs at another pace than its oscillator can is none.
    fn look(&mut self, oscillator: Oscillator, now_ms: u64) {
        let Some(count_ms) = self.count_ms() else { return self.fail() };
        let Some((before_ms, at_ms)) = self.looked else {
            self.looked = Some((count_ms, now_ms));
            return;
        };
        let passed_ms = now_ms.saturating_sub(at_ms);
        if passed_ms >= LOOK_MS {
            // The board's own clock may be off by a twentieth, the count by 4 ms.
            let most = passed_ms / 20 + passed_ms.saturating_mul(u64::from(oscillator.ppm())) / 1_000_000 + 8;
            if count_ms.saturating_sub(before_ms).abs_diff(passed_ms) > most {
                return self.fail();
            }
            self.looked = Some((count_ms, now_ms));
        }
    }

    fn fail(&mut self) {
        self.keep([0; WORDS]);
        self.state = State::Absent;
    }

    /// What it counts, ms.
    pub fn count_ms(&mut self) -> Option<u64> {
        let oscillator = self.oscillator()?;
        let mut last = self.raw();
        for _ in 0..4 {
            let now = self.raw();
            if now == last {
                return decode(now, oscillator.last_part());
            }
            last = now;
        }
        None
    }

    fn raw(&mut self) -> [u32; 3] {
        [SSR, TR, DR].map(|address| self.registers.read(address))
    }

    /// The words that were kept.
    pub fn kept(&mut self) -> [u32; WORDS] {
        let mut address = BACKUP;
        [(); WORDS].map(|()| {
            let word = self.registers.read(address);
            address = address.saturating_add(4);
            word
        })
    }

    /// Keeps words; nothing where nothing counts.
    pub fn keep(&mut self, words: [u32; WORDS]) {
        if self.oscillator().is_some() {
            let mut address = BACKUP;
            for word in words {
                self.registers.write(address, word);
                address = address.saturating_add(4);
            }
        }
    }

    fn start_internal(&mut self) -> bool {
        self.set(CSR, LSION);
        self.wait(CSR, LSIRDY)
    }

    fn start(&mut self, oscillator: Oscillator, from: u32) {
        self.set(BDCR, from);
        self.set(BDCR, RTCEN);
        self.registers.write(WPR, 0xca);
        self.registers.write(WPR, 0x53);
        self.set(ISR, INIT);
        let ready = self.wait(ISR, INITF);
        if ready {
            // The synchronous part first, in two writes (26.3.5).
            self.registers.write(PRER, oscillator.last_part());
            self.registers.write(PRER, 127 << 16 | oscillator.last_part());
            // Read directly: the copies would have to be waited for after each reset.
            self.set(CR, BYPSHAD);
            self.registers.write(TR, 0);
            self.registers.write(DR, FIRST_DAY);
        }
        let isr = self.registers.read(ISR);
        self.registers.write(ISR, isr & !INIT);
        self.registers.write(WPR, 0xff);
        self.state = if ready { State::Counting(oscillator) } else { State::Absent };
    }

    fn set(&mut self, address: u32, bits: u32) {
        let now = self.registers.read(address);
        self.registers.write(address, now | bits);
    }

    fn wait(&mut self, address: u32, bits: u32) -> bool {
        (0..FLAG_WAIT).any(|_| self.registers.read(address) & bits == bits)
    }
}

/// Milliseconds since 2000; none for what is no date.
fn decode([ssr, tr, dr]: [u32; 3], last_part: u32) -> Option<u64> {
    let (h, m, s) = (bcd(tr >> 16 & 0x3f)?, bcd(tr >> 8 & 0x7f)?, bcd(tr & 0x7f)?);
    let (year, month, day) = (bcd(dr >> 16 & 0xff)?, bcd(dr >> 8 & 0x1f)?, bcd(dr & 0x3f)?);
    let sound = h < 24 && m < 60 && s < 60 && (1..=12).contains(&month) && (1..=31).contains(&day) && year > 0 && ssr <= last_part;
    // Below 2^32 s for a hundred years.
    let of_day = h.wrapping_mul(3600).wrapping_add(m.wrapping_mul(60)).wrapping_add(s);
    let day = days(year.wrapping_add(2000), month, day);
    let parts = u64::from(last_part.saturating_sub(ssr)).wrapping_mul(1_000) / u64::from(last_part.saturating_add(1)).max(1);
    let seconds = u64::from(day).wrapping_mul(86_400).wrapping_add(u64::from(of_day));
    sound.then(|| seconds.wrapping_mul(1_000).wrapping_add(parts))
}

fn bcd(byte: u32) -> Option<u32> {
    let (tens, ones) = (byte >> 4, byte & 0xf);
    (tens < 10 && ones < 10).then(|| tens.wrapping_mul(10).wrapping_add(ones))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_is_milliseconds_and_nonsense_is_none() {
        let first = decode([255, 0, FIRST_DAY], 255).unwrap();
        assert_eq!(first, 978_307_200_000); // date -u -d 2001-01-01 +%s
        assert_eq!(decode([127, 0x23_59_59, FIRST_DAY], 255), Some(first + 86_399_500));
        assert_eq!(decode([249, 0, 0x24_42_29], 249).map(|ms| ms / 1000), Some(1_709_164_800)); // 2024-02-29
        for (raw, part) in [
            ([0, 0, 0], 255),
            ([0, 0, 0x2101], 255),
            ([0, 0x24_00_00, FIRST_DAY], 255),
            ([0, 0x0a, FIRST_DAY], 255),
            ([250, 0, FIRST_DAY], 249),
        ] {
            assert_eq!(decode(raw, part), None, "{raw:x?}");
        }
    }

    /// Reads the same everywhere, and counts how often it is asked.
    struct All(u32, u32);

    impl Registers for All {
        fn read(&mut self, _: u32) -> u32 {
            self.1 += 1;
            self.0
        }
        fn write(&mut self, _: u32, _: u32) {}
    }

    #[test]
    fn where_there_is_no_such_block_nothing_counts_and_no_wait_is_without_end() {
        for word in [0, u32::MAX, 0x100, 0x102, RTCEN | FROM_LSE | LSERDY | DBP, RTCEN | FROM_LSI | DBP | LSIRDY] {
            let mut rtc = Rtc::open(All(word, 0), 0);
            for now_ms in (0..60_000).step_by(1_000) {
                rtc.poll(now_ms);
                rtc.keep([1; WORDS]);
            }
            assert_eq!((rtc.oscillator(), rtc.count_ms()), (None, None), "{word:#x}");
            assert!(rtc.registers.1 < 4 * FLAG_WAIT, "{word:#x}: {}", rtc.registers.1);
        }
    }
}

//! UTC, as an offset to the board's milliseconds since boot.
//!
//! The host sets it on deck, fixes of the GPS receiver set it at the surface, and over a reset it is reckoned on by the chip's
//! calendar clock. It dates records and nothing else: no decision of a flight depends on it. What is not known is unknown, and
//! what is known has a bound that grows with the time since it was set; beyond [`MOST_WITHIN_MS`] it is unknown again.

use signals::link::CRC32;
use signals::{Clock, Refusal, TimeSource, Timebase, Utc};

/// UTC that is believed, ms since 1970: from 2026 to 2099. A GPS receiver whose week counter has rolled over says 19.6 years less.
pub const BELIEVED_MS: core::ops::Range<u64> = 1_767_225_600_000..4_102_444_800_000;
/// A UTC that may be farther off is none, ms.
pub const MOST_WITHIN_MS: u32 = 3_600_000;
/// A fix says the second before it: it comes within one second, receiver and 9,600 baud together (guess).
const FIX_LATE_MS: u64 = 500;
const FIX_WITHIN_MS: u32 = 500;
/// Two fixes say the same when they differ by no more, ms.
const SAME_MS: u64 = 2_000;
/// Error of the chip's clock: crystal (board.md), and internal oscillator from -10 to 85 °C (DS8626 table 41), parts of a million.
const CRYSTAL_PPM: u32 = 50;
const INTERNAL_PPM: u32 = 40_000;
/// Words in which UTC is kept over a reset.
pub const KEPT: usize = 6;
/// Two readings of two clocks are not of the same moment: ms.
const READ_MS: u32 = 10;

/// What time it is.
#[derive(Clone, Copy, Debug)]
pub struct UtcClock {
    /// Since boot; none: whoever runs this has no clock.
    now_ms: Option<u64>,
    base: Timebase,
    /// Least error of the time since boot, where the chip's clock stood still meanwhile, parts of a million.
    stops_ppm: u32,
    /// UTC, and the moment it was set.
    set: Option<(Utc, u64)>,
    /// The last fix: UTC and when it came.
    fix: Option<(u64, u64)>,
}

impl UtcClock {
    /// Nothing known, not even that the board runs on its crystal.
    #[must_use]
    pub const fn new() -> Self {
        Self { now_ms: None, base: Timebase::Elsewhere, stops_ppm: 0, set: None, fix: None }
    }

    /// What the board runs on.
    pub const fn runs_on(&mut self, base: Timebase) {
        self.base = base;
    }

    /// The chip's clock stood still for a while; time since boot was taken from one that is right to `ppm`.
    pub const fn stopped(&mut self, ppm: u32) {
        self.stops_ppm = ppm;
    }

    /// Sets the time since boot.
    pub const fn tick(&mut self, now_ms: u64) {
        self.now_ms = Some(now_ms);
    }

    /// UTC now.
    #[must_use]
    pub fn utc(&self) -> Option<Utc> {
        self.at(self.now_ms?)
    }

    fn at(&self, now_ms: u64) -> Option<Utc> {
        let (utc, set_ms) = self.set?;
        let ppm = if self.base == Timebase::Crystal { CRYSTAL_PPM } else { INTERNAL_PPM }.max(self.stops_ppm);
        on(utc, now_ms.saturating_sub(set_ms), ppm)
    }

    /// What is said of it on the line.
    #[must_use]
    pub fn said(&self) -> Clock {
        Clock { base: self.base, board_ms: self.now_ms, utc: self.utc() }
    }

    /// The host sets it.
    ///
    /// # Errors
    /// [`Refusal::Time`].
    pub fn set(&mut self, ms: u64, within_ms: u32) -> Result<(), Refusal> {
        let now_ms = self.now_ms.ok_or(Refusal::Time)?;
        if !BELIEVED_MS.contains(&ms) || within_ms > MOST_WITHIN_MS {
            return Err(Refusal::Time);
        }
        self.set = Some((Utc { ms, within_ms, source: TimeSource::Host }, now_ms));
        Ok(())
    }

    /// A fix came at `came_ms`. It counts if the one before says the same; it is taken if it is surer than what is known, or if that
    /// cannot be true beside it.
    pub fn fix(&mut self, utc_s: u32, came_ms: u64) {
        let ms = u64::from(utc_s).saturating_mul(1_000).saturating_add(FIX_LATE_MS);
        if !BELIEVED_MS.contains(&ms) {
            return;
        }
        let before = self.fix.replace((ms, came_ms));
        let due = before.map(|(before, at_ms)| before.saturating_add(came_ms.saturating_sub(at_ms)));
        if due.is_none_or(|due| due.abs_diff(ms) > SAME_MS) {
            return;
        }
        let known = self.at(came_ms);
        let off = |known: Utc| known.ms.abs_diff(ms) > u64::from(known.within_ms.saturating_add(FIX_WITHIN_MS));
        if known.is_none_or(|known| known.within_ms >= FIX_WITHIN_MS || off(known)) {
            self.set = Some((Utc { ms, within_ms: FIX_WITHIN_MS, source: TimeSource::Gps }, came_ms));
        }
    }

    /// What a reset must find again, beside the count of a clock that goes on: `count_ms` now.
    #[must_use]
    pub fn keep(&self, count_ms: u64) -> Option<[u32; KEPT]> {
        let utc = self.utc()?;
        let [a, b, c, d, e] = [high(count_ms), count_ms as u32, high(utc.ms), utc.ms as u32, utc.within_ms];
        Some([a, b, c, d, e, sum([a, b, c, d, e])])
    }

    /// Takes UTC up again after a reset. The clock that went on counts `count_ms` now, and is right to `ppm`.
    pub fn wake(&mut self, kept: [u32; KEPT], count_ms: u64, ppm: u32) {
        let [a, b, c, d, within_ms, crc] = kept;
        let (then_ms, ms) = (word(a, b), word(c, d));
        if crc != sum([a, b, c, d, within_ms]) || count_ms < then_ms || !BELIEVED_MS.contains(&ms) {
            return;
        }
        let kept = Utc { ms, within_ms: within_ms.saturating_add(READ_MS), source: TimeSource::Kept };
        let now_ms = self.now_ms.unwrap_or(0);
        self.set = on(kept, count_ms.saturating_sub(then_ms), ppm).map(|utc| (utc, now_ms));
    }
}

impl Default for UtcClock {
    fn default() -> Self {
        Self::new()
    }
}

/// UTC a time later by a clock that is right to `ppm`; none where it may be off by too much.
fn on(utc: Utc, passed_ms: u64, ppm: u32) -> Option<Utc> {
    let drift = passed_ms.saturating_mul(u64::from(ppm)) / 1_000_000;
    let within_ms = utc.within_ms.saturating_add(u32::try_from(drift).unwrap_or(u32::MAX));
    (within_ms <= MOST_WITHIN_MS).then(|| Utc { ms: utc.ms.saturating_add(passed_ms), within_ms, ..utc })
}

const fn high(value: u64) -> u32 {
    (value >> 32) as u32
}

const fn word(high: u32, low: u32) -> u64 {
    (high as u64) << 32 | low as u64
}

fn sum(words: [u32; 5]) -> u32 {
    let mut digest = CRC32.digest();
    for word in words {
        digest.update(&word.to_le_bytes());
    }
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOON: u64 = 1_777_636_800_000; // 2026-05-01 12:00

    fn clock_at(now_ms: u64) -> UtcClock {
        let mut clock = UtcClock::new();
        clock.runs_on(Timebase::Crystal);
        clock.tick(now_ms);
        clock
    }

    fn clock() -> UtcClock {
        clock_at(10_000)
    }

    #[test]
    fn utc_is_unknown_until_set_and_its_bound_grows() {
        let mut c = clock();
        assert_eq!(c.said(), Clock { base: Timebase::Crystal, board_ms: Some(10_000), utc: None });
        assert_eq!(UtcClock::new().set(NOON, 20), Err(Refusal::Time), "no clock to keep it");
        for bad in [0, 1_000_000_000_000, BELIEVED_MS.end, u64::MAX] {
            assert_eq!(c.set(bad, 20), Err(Refusal::Time), "{bad}");
        }
        assert_eq!(c.set(NOON, MOST_WITHIN_MS + 1), Err(Refusal::Time));
        assert_eq!(c.utc(), None);
        c.set(NOON, 20).unwrap();
        let day = 86_400_000;
        c.tick(10_000 + day);
        // 50 ppm of a day are 4.32 s.
        assert_eq!(c.utc(), Some(Utc { ms: NOON + day, within_ms: 4_340, source: TimeSource::Host }));
        c.stopped(100);
        assert_eq!(c.utc().map(|utc| utc.within_ms), Some(8_660), "and of a clock that stood still, 100 ppm");
        c.tick(10_000 + 1000 * day);
        assert_eq!(c.utc(), None, "off by 72 minutes at worst is unknown");
        c.tick(u64::MAX);
        assert_eq!(c.utc(), None);
    }

    #[test]
    fn a_fix_counts_when_the_one_before_says_the_same() {
        let s = (NOON / 1000) as u32;
        let mut c = clock();
        c.fix(s, 10_000);
        assert_eq!(c.utc(), None, "one fix alone");
        c.fix(s + 7_000, 11_000);
        assert_eq!(c.utc(), None, "two that differ");
        c.fix(s + 7_001, 12_000);
        c.tick(12_000);
        assert_eq!(c.utc(), Some(Utc { ms: NOON + 7_001_500, within_ms: 500, source: TimeSource::Gps }));
        // A receiver whose weeks have rolled over.
        let mut c = clock();
        (0..5).for_each(|i| c.fix(s - 1024 * 7 * 86_400 + i, 10_000 + 1_000 * u64::from(i)));
        assert_eq!(c.utc(), None);
    }

    #[test]
    fn a_surer_time_stays_and_one_that_cannot_be_true_goes() {
        let s = (NOON / 1000) as u32;
        let mut c = clock();
        c.set(NOON, 20).unwrap();
        (0..3).for_each(|i| c.fix(s + i, 10_000 + 1_000 * u64::from(i)));
        assert_eq!(c.utc().map(|u| u.source), Some(TimeSource::Host), "right to 20 ms, and the fix to 500");
        (0..3).for_each(|i| c.fix(s + 60 + i, 20_000 + 1_000 * u64::from(i)));
        c.tick(22_000);
        assert_eq!(c.utc(), Some(Utc { ms: NOON + 62_500, within_ms: 500, source: TimeSource::Gps }), "50 s off is not 20 ms");
        c.tick(22_000 + 86_400_000);
        (0..3).for_each(|i| c.fix(s + 62 + 86_400 + i, 22_000 + 86_400_000 + 1_000 * u64::from(i)));
        assert_eq!(c.utc().map(|u| u.within_ms), Some(500), "a day later the fix is the surer one");
    }

    #[test]
    fn a_reset_is_bridged_with_an_honest_bound_and_damage_is_unknown() {
        let mut c = clock();
        assert_eq!(c.keep(5), None);
        c.set(NOON, 20).unwrap();
        let kept = c.keep(77_000).unwrap();
        // The crystal of the calendar, and the internal oscillator.
        for (ppm, within_ms) in [(100, 36), (900_000, 54_030)] {
            let mut woken = clock_at(400);
            woken.wake(kept, 77_000 + 60_000, ppm);
            assert_eq!(woken.utc(), Some(Utc { ms: NOON + 60_000, within_ms, source: TimeSource::Kept }));
        }
        let woken = |kept, count| {
            let mut woken = clock_at(400);
            woken.wake(kept, count, 100);
            woken.utc()
        };
        assert_eq!(woken([0; KEPT], 77_000), None, "registers after a power cut");
        assert_eq!(woken(kept, 76_999), None, "a count that went back");
        let [a, b, _, d, e, _] = kept;
        assert_eq!(woken([a, b, 0, d, e, sum([a, b, 0, d, e])], 77_000), None, "1970");
        for bit in 0..32 * KEPT {
            let mut bad = kept;
            bad[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(woken(bad, 77_000 + (1 << 40)), None, "bit {bit}");
            assert_eq!(woken(bad, u64::MAX), None, "bit {bit}");
        }
    }
}

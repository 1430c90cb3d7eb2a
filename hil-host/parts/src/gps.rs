//! A GPS receiver, NMEA 0183 at 9,600 baud: one RMC sentence a second, valid with the antenna out.

use crate::os5000::with_sum;
use crate::talker::Says;
use crate::{Sample, Work};

/// Time from its supply to a fix, ns: without the satellites' orbits, and with them (u-blox MAX-M8 data sheet: 26 and 1 s under a good
/// sky; half as much again). How long the antenna has to be out is the surroundings' to say ([`Sample::fix`]).
const COLD_NS: u64 = 39_000_000_000;
const HOT_NS: u64 = 1_500_000_000;
/// Orbits serve for so long, ns: four hours; kept by the backup supply.
const ORBITS_NS: u64 = 4 * 3_600_000_000_000;

/// The receiver.
#[derive(Default)]
pub struct Gps {
    /// When its supply was switched on, ns.
    on_ns: Option<u64>,
    /// When it last had a fix, ns, and whether that was so when it was switched on.
    fix_ns: Option<u64>,
    hot: bool,
}

/// The bench is switched on on the first of May 2026 at noon: UTC then, s since 1970.
const START_S: u64 = 1_777_636_800;

/// UTC on the bench, ms since 1970, so long after it is switched on.
#[must_use]
pub const fn utc_ms(now_ns: u64) -> u64 {
    1_000 * START_S + now_ns / 1_000_000
}

impl Says for Gps {
    const BAUD: u64 = 9_600;
    const PERIOD_NS: u64 = 1_000_000_000;
    const START_NS: u64 = 0;
    const WORK: Work = Work::Gps;

    fn forget(&mut self) {
        self.on_ns = None;
    }

    fn sentence(&mut self, sample: &Sample, now_ns: u64) -> String {
        let fix = self.has_fix(sample.fix, now_ns);
        let s = utc_ms(now_ns) / 1_000;
        let time = format!("{:02}{:02}{:02}.00", s / 3600 % 24, s / 60 % 60, s % 60);
        let day = 1 + (s / 86_400 - START_S / 86_400) % 31;
        with_sum(&if fix {
            format!("GNRMC,{time},A,4342.5000,N,00715.3000,E,0.10,,{day:02}0526,,,A")
        } else {
            format!("GNRMC,{time},V,,,,,,,{day:02}0526,,,N")
        })
    }
}

impl Gps {
    fn has_fix(&mut self, sky: bool, now_ns: u64) -> bool {
        if self.on_ns.is_none() {
            // The first sentence comes a second after its supply.
            self.on_ns = Some(now_ns.saturating_sub(Self::PERIOD_NS));
            self.hot = self.fix_ns.is_some_and(|at| now_ns - at < ORBITS_NS);
        }
        let on_ns = now_ns - self.on_ns.unwrap_or(now_ns);
        let fix = sky && on_ns >= if self.hot { HOT_NS } else { COLD_NS };
        self.fix_ns = if fix { Some(now_ns) } else { self.fix_ns };
        fix
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fix_takes_its_time_cold_and_hot() {
        let mut gps = Gps::default();
        let mut until_fix_s = |from_s: u64| {
            gps.forget();
            (from_s..).find(|s| gps.has_fix(true, s * 1_000_000_000)).map(|s| s - from_s)
        };
        assert_eq!(until_fix_s(100), Some(38), "cold, a second after the first sentence's");
        assert_eq!(until_fix_s(10_000), Some(1), "hot");
        assert_eq!(until_fix_s(30_000), Some(38), "orbits too old");
        assert!(!gps.has_fix(false, 40_000_000_000_000));
    }
}

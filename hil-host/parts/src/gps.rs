//! A GPS receiver, NMEA 0183 at 9,600 baud: one RMC sentence a second, valid with the antenna out.

use crate::Sample;
use crate::os5000::with_sum;
use crate::talker::Says;

/// The receiver.
pub struct Gps;

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

    fn sentence(sample: &Sample, now_ns: u64) -> String {
        let s = utc_ms(now_ns) / 1_000;
        let time = format!("{:02}{:02}{:02}.00", s / 3600 % 24, s / 60 % 60, s % 60);
        let day = 1 + (s / 86_400 - START_S / 86_400) % 31;
        with_sum(&if sample.fix {
            format!("GNRMC,{time},A,4342.5000,N,00715.3000,E,0.10,,{day:02}0526,,,A")
        } else {
            format!("GNRMC,{time},V,,,,,,,{day:02}0526,,,N")
        })
    }
}

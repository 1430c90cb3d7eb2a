//! OceanServer OS5000 (manual 4.0): attitude at 19,200 baud, set to five sentences a second.

use crate::talker::Says;
use crate::{Sample, Work};

/// The compass.
#[derive(Default)]
pub struct Os5000;

impl Says for Os5000 {
    const BAUD: u64 = 19_200;
    const PERIOD_NS: u64 = 200_000_000;
    /// Guess: its manual does not say.
    const START_NS: u64 = 1_000_000_000;
    const WORK: Work = Work::Compass;

    fn sentence(&mut self, sample: &Sample, _now_ns: u64) -> String {
        let [pitch, roll, heading] = sample.attitude_rad;
        let degrees = |x: Option<f64>, letter: char| x.map_or(String::new(), |x| format!("{letter}{:.1}", x.to_degrees()));
        // It counts round the circle; far beyond it is no heading that it could say.
        let heading = heading.map(|h| if h.abs() < 14.0 { h.rem_euclid(std::f64::consts::TAU) } else { h });
        let body = format!("{}{}{}T{:.1}", degrees(heading, 'C'), degrees(pitch, 'P'), degrees(roll, 'R'), sample.temperature_c);
        with_sum(&body)
    }
}

/// A sentence around its text, with the XOR of it.
pub(crate) fn with_sum(body: &str) -> String {
    format!("${body}*{:02X}\r\n", body.bytes().fold(0u8, |x, b| x ^ b))
}

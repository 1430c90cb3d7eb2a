//! How much time passed since the last step, whatever the caller's clock does.

use signals::Micros;

/// Longest span one step believes, µs (a minute). A longer gap is a pause of the
/// controller or a jump of the clock; neither may look like hours of flight.
const LONGEST_STEP_US: u32 = 60_000_000;

/// Time as flown: never goes back, never jumps, never wraps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clock {
    last: Option<Micros>,
    /// Time flown so far.
    pub run: Micros,
}

impl Clock {
    /// Takes the caller's time; returns the span to integrate over, 0..60 s.
    /// Zero for a repeated tick and for a clock that went back.
    pub fn advance(&mut self, now: Micros) -> f32 {
        let span_us = match self.last {
            Some(last) if now > last => u32::try_from(now.since(last).0).map_or(LONGEST_STEP_US, |span| span.min(LONGEST_STEP_US)),
            _ => 0,
        };
        self.last = Some(now);
        self.run = self.run.plus(Micros(u64::from(span_us)));
        span_us as f32 * 1e-6
    }
}

#[cfg(test)]
mod tests {
    use super::Clock;
    use signals::Micros;

    #[test]
    fn jumps_repeats_and_wraps_give_bounded_spans() {
        let mut c = Clock::default();
        let wrap = 1u64 << 32;
        assert_eq!(c.advance(Micros(wrap - 2_000_000)), 0.0);
        assert_eq!(c.advance(Micros(wrap + 2_000_000)), 4.0);
        assert_eq!(c.advance(Micros(wrap + 2_000_000)), 0.0);
        assert_eq!(c.advance(Micros(5)), 0.0);
        assert_eq!(c.advance(Micros(4_000_005)), 4.0);
        assert_eq!(c.advance(Micros(u64::MAX)), 60.0);
        assert_eq!(c.run, Micros(68_000_000));
    }
}

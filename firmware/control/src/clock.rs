//! How much time passed since the last step, whatever the caller's clock does.

use signals::Micros;

/// Longest span one step believes, s. A longer gap is a pause of the
/// controller or a jump of the clock; neither may look like hours of flight.
const LONGEST_STEP_S: f32 = 60.0;

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
        let span = self.last.map_or(Micros(0), |last| now.since(last));
        self.last = Some(now);
        let span = Micros(span.0.min((LONGEST_STEP_S * 1e6) as u64));
        self.run = self.run.plus(span);
        span.seconds()
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

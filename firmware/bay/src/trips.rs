//! A motor bridge that has switched itself off: put to sleep for a look, which clears it, and tried again.
//!
//! The line (nFAULT, low) is believed a bounded number of times and then not at all until nothing is wanted: one that is broken, or
//! shorted to ground, must not keep a pump from its way. A bridge that is gone is a motor without motion, and given up as that.

use embedded_hal::digital::InputPin;

/// Bridges are put to sleep so often while a motor is wanted to move.
const RESTARTS: u8 = 5;

/// The line of both bridges.
#[derive(Debug)]
pub struct Trips<I> {
    line: I,
    restarts: u8,
}

impl<I: InputPin> Trips<I> {
    /// Nothing wanted yet.
    pub const fn new(line: I) -> Self {
        Self { line, restarts: 0 }
    }

    /// Whether the bridges are to be awake until the next look. `driving`: a motor is wanted to move; `were_awake`: since the last look.
    pub fn awake(&mut self, driving: bool, were_awake: bool) -> bool {
        if !driving {
            self.restarts = 0;
            return false;
        }
        // Asleep the line says nothing, and a line that cannot be read is no fault.
        let off = were_awake && self.restarts < RESTARTS && self.line.is_low().unwrap_or(false);
        self.restarts = self.restarts.saturating_add(u8::from(off));
        !off
    }
}

#[cfg(test)]
mod tests {
    use super::{RESTARTS, Trips};
    use core::convert::Infallible;
    use embedded_hal::digital::{ErrorType, InputPin};

    struct Line(bool);

    impl ErrorType for Line {
        type Error = Infallible;
    }

    impl InputPin for Line {
        fn is_high(&mut self) -> Result<bool, Infallible> {
            Ok(self.0)
        }
        fn is_low(&mut self) -> Result<bool, Infallible> {
            Ok(!self.0)
        }
    }

    fn looks(trips: &mut Trips<Line>, n: usize) -> Vec<bool> {
        let mut on = false;
        (0..n)
            .map(|_| {
                on = trips.awake(true, on);
                on
            })
            .collect()
    }

    #[test]
    fn a_bridge_that_switched_itself_off_sleeps_for_one_look() {
        let mut trips = Trips::new(Line(true));
        assert_eq!(looks(&mut trips, 3), [true, true, true]);
        trips.line.0 = false;
        assert!(!trips.awake(true, true));
        trips.line.0 = true;
        assert_eq!(looks(&mut trips, 3), [true, true, true]);
    }

    #[test]
    fn a_line_that_is_shorted_stops_no_motor() {
        let mut trips = Trips::new(Line(false));
        let on = looks(&mut trips, 100);
        assert_eq!(on.iter().filter(|on| !**on).count(), usize::from(RESTARTS));
        assert!(on.iter().skip(2 * usize::from(RESTARTS)).all(|on| *on));
        // Nothing is wanted: what follows is another way, on which it is believed again.
        assert!(!trips.awake(false, true));
        assert_eq!(looks(&mut trips, 2), [true, false]);
    }
}

//! The drop weight: burn wire behind two switches in series.
//!
//! One stuck or glitching pin must not drop the weight, and a weight that did
//! not go must be fired again. Arm first, at the next look fire; the wire gets
//! [`BURN_S`], rests for [`REST_S`] (the battery recovers), and again, until the
//! wish is withdrawn, which in this firmware it never is.

use embedded_hal::digital::OutputPin;

/// Time of one burn, s (public pilot guide's burn time).
pub const BURN_S: f32 = 120.0;
/// Rest between burns, s (guess).
pub const REST_S: f32 = 60.0;

/// What it does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Doing {
    /// Both switches open.
    Idle,
    /// First switch closed.
    Armed,
    /// Both closed, for so long, s.
    Burning(f32),
    /// Resting, for so long, s.
    Resting(f32),
}

/// The release with its pins.
#[derive(Debug)]
pub struct Release<A, F> {
    arm: A,
    fire: F,
    doing: Doing,
    /// Burns started.
    pub burns: u32,
}

impl<A: OutputPin, F: OutputPin> Release<A, F> {
    /// Both switches open.
    pub fn new(arm: A, fire: F) -> Self {
        let mut release = Self { arm, fire, doing: Doing::Idle, burns: 0 };
        release.switch(false, false);
        release
    }

    /// One look, `dt_s` seconds after the last.
    pub fn look(&mut self, wanted: bool, dt_s: f32) -> Doing {
        self.doing = match (wanted, self.doing) {
            (false, _) => Doing::Idle,
            (true, Doing::Idle) => Doing::Armed,
            (true, Doing::Armed) => {
                self.burns = self.burns.saturating_add(1);
                Doing::Burning(0.0)
            }
            (true, Doing::Burning(t)) if t + dt_s < BURN_S => Doing::Burning(t + dt_s),
            (true, Doing::Burning(_)) => Doing::Resting(0.0),
            (true, Doing::Resting(t)) if t + dt_s < REST_S => Doing::Resting(t + dt_s),
            (true, Doing::Resting(_)) => Doing::Armed,
        };
        let burning = matches!(self.doing, Doing::Burning(_));
        self.switch(burning || self.doing == Doing::Armed, burning);
        self.doing
    }

    /// Both switches open, whatever was wanted.
    pub fn stop(&mut self) {
        self.doing = Doing::Idle;
        self.switch(false, false);
    }

    fn switch(&mut self, arm: bool, fire: bool) {
        // A pin that cannot be written is looked at again at the next look.
        let _ = if fire { self.fire.set_high() } else { self.fire.set_low() };
        let _ = if arm { self.arm.set_high() } else { self.arm.set_low() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_hal_mock::eh1::digital::{Mock, State, Transaction};

    #[test]
    fn arms_before_it_fires_and_opens_both_when_not_wanted() {
        let set = |states: &[State]| Mock::new(&states.iter().map(|s| Transaction::set(*s)).collect::<Vec<_>>());
        use State::{High, Low};
        let (mut arm, mut fire) = (set(&[Low, High, High, Low, High, Low]), set(&[Low, Low, High, Low, Low, Low]));
        let mut release = Release::new(arm.clone(), fire.clone());
        assert_eq!(release.look(true, 1.0), Doing::Armed);
        assert_eq!(release.look(true, 1.0), Doing::Burning(0.0));
        assert_eq!(release.look(false, 1.0), Doing::Idle);
        assert_eq!(release.look(true, 1.0), Doing::Armed);
        release.stop();
        arm.done();
        fire.done();
    }

    #[test]
    fn fires_again_and_again() {
        struct Pin;
        impl embedded_hal::digital::ErrorType for Pin {
            type Error = core::convert::Infallible;
        }
        impl OutputPin for Pin {
            fn set_low(&mut self) -> Result<(), Self::Error> {
                Ok(())
            }
            fn set_high(&mut self) -> Result<(), Self::Error> {
                Ok(())
            }
        }
        let mut release = Release::new(Pin, Pin);
        let burning = (0..3600).filter(|_| matches!(release.look(true, 1.0), Doing::Burning(_))).count();
        assert!(release.burns >= 18, "{} burns in an hour", release.burns);
        assert!((2000..2600).contains(&burning), "{burning} s of burning in an hour");
    }
}

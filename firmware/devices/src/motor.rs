//! A motor that moves something to a position: pump piston, battery mass.
//!
//! An H-bridge (TI DRV8873, PH/EN off, two PWM inputs) and a position pot. Full
//! speed to within the dead band, nothing inside it. It stops by itself when
//! the position is unknown for longer than a grace, when it does not move
//! though driven, and at a time limit: no end stop is ground at.

use embedded_hal::pwm::SetDutyCycle;

/// What a motor may do.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Not driven for less than this distance, in the position's unit.
    pub dead_band: f32,
    /// Least motion expected in [`Limits::stall_s`] when driven.
    pub least_motion: f32,
    /// Time in which it must have moved, s.
    pub stall_s: f32,
    /// Longest drive in one go without arriving, s.
    pub longest_s: f32,
    /// Longest drive without a position, s: open loop, then stop.
    pub blind_s: f32,
}

/// What it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doing {
    /// There, or nothing wanted.
    Holding,
    /// Driving towards larger positions (`true`) or smaller.
    Driving(bool),
    /// Gave up: driven and did not move, or took too long. Tried again when the
    /// wish changes.
    Stalled,
    /// No position for too long.
    Blind,
}

/// One motor with its bridge.
#[derive(Debug)]
pub struct Motor<F, R> {
    forward: F,
    reverse: R,
    limits: Limits,
    wanted: f32,
    last: Option<f32>,
    driven_s: f32,
    still_s: f32,
    blind_s: f32,
    mark: f32,
    stalled: bool,
    toward: bool,
}

impl<F: SetDutyCycle, R: SetDutyCycle> Motor<F, R> {
    /// A motor at rest.
    pub const fn new(forward: F, reverse: R, limits: Limits) -> Self {
        Self {
            forward,
            reverse,
            limits,
            wanted: 0.0,
            last: None,
            driven_s: 0.0,
            still_s: 0.0,
            blind_s: 0.0,
            mark: 0.0,
            stalled: false,
            toward: true,
        }
    }

    /// One look: where it is, where it should be, seconds since the last look.
    /// A wish that is not finite is no wish.
    pub fn look(&mut self, position: Option<f32>, wanted: f32, dt_s: f32) -> Doing {
        let wanted = if wanted.is_finite() { wanted } else { self.wanted };
        if (wanted - self.wanted).abs() > self.limits.dead_band {
            (self.stalled, self.driven_s, self.still_s, self.blind_s) = (false, 0.0, 0.0, 0.0);
        }
        self.wanted = wanted;
        let doing = self.decide(position.filter(|p| p.is_finite()), dt_s);
        let bridge = match doing {
            Doing::Driving(true) => self.reverse.set_duty_cycle_fully_off().is_ok() && self.forward.set_duty_cycle_fully_on().is_ok(),
            Doing::Driving(false) => self.forward.set_duty_cycle_fully_off().is_ok() && self.reverse.set_duty_cycle_fully_on().is_ok(),
            _ => false,
        };
        if !bridge {
            self.stop();
        }
        doing
    }

    /// Both off: the bridge brakes. Errors leave nothing better to try.
    pub fn stop(&mut self) {
        let _ = self.forward.set_duty_cycle_fully_off();
        let _ = self.reverse.set_duty_cycle_fully_off();
    }

    fn decide(&mut self, position: Option<f32>, dt_s: f32) -> Doing {
        let limits = self.limits;
        let Some(at) = position else {
            self.blind_s += dt_s;
            return if self.blind_s > limits.blind_s || self.stalled { Doing::Blind } else { Doing::Driving(self.wanted_side()) };
        };
        self.blind_s = 0.0;
        self.last = Some(at);
        let off = self.wanted - at;
        if off.abs() <= limits.dead_band {
            (self.driven_s, self.still_s, self.mark) = (0.0, 0.0, at);
            return Doing::Holding;
        }
        if self.stalled {
            return Doing::Stalled;
        }
        self.driven_s += dt_s;
        self.still_s += dt_s;
        if (at - self.mark).abs() >= limits.least_motion {
            (self.mark, self.still_s) = (at, 0.0);
        }
        if self.still_s > limits.stall_s || self.driven_s > limits.longest_s {
            self.stalled = true;
            return Doing::Stalled;
        }
        self.toward = off > 0.0;
        Doing::Driving(self.toward)
    }

    /// The side the wish lies on, by the last position known; up without one.
    fn wanted_side(&self) -> bool {
        self.last.is_none_or(|at| self.wanted > at)
    }
}

#[cfg(test)]
mod tests {
    use super::{Doing, Limits, Motor};
    use core::convert::Infallible;
    use embedded_hal::pwm::{ErrorType, SetDutyCycle};
    use std::cell::Cell;
    use std::rc::Rc;

    #[derive(Clone, Default)]
    struct Pwm(Rc<Cell<u16>>);
    impl ErrorType for Pwm {
        type Error = Infallible;
    }
    impl SetDutyCycle for Pwm {
        fn max_duty_cycle(&self) -> u16 {
            100
        }
        fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
            self.0.set(duty);
            Ok(())
        }
    }

    const LIMITS: Limits = Limits { dead_band: 0.1, least_motion: 0.05, stall_s: 2.0, longest_s: 60.0, blind_s: 20.0 };

    fn motor() -> (Pwm, Pwm, Motor<Pwm, Pwm>) {
        let (f, r) = (Pwm::default(), Pwm::default());
        (f.clone(), r.clone(), Motor::new(f, r, LIMITS))
    }

    #[test]
    fn goes_there_and_stops_never_driving_both_ways() {
        let (f, r, mut m) = motor();
        let mut at = 0.0f32;
        for wanted in [5.0, -5.0, 0.3] {
            for _ in 0..200 {
                m.look(Some(at), wanted, 0.1);
                assert!(f.0.get() == 0 || r.0.get() == 0);
                at += 0.01 * (f32::from(f.0.get()) - f32::from(r.0.get())) * 0.1;
            }
            assert!((at - wanted).abs() <= 0.2, "{at} for {wanted}");
            assert_eq!((f.0.get(), r.0.get()), (0, 0));
        }
    }

    #[test]
    fn a_stuck_motor_is_let_go_until_the_wish_changes() {
        let (f, _, mut m) = motor();
        let seconds = (0..100).take_while(|_| m.look(Some(0.0), 5.0, 0.1) == Doing::Driving(true)).count();
        assert!((19..=22).contains(&seconds), "{seconds} tenths");
        assert_eq!((m.look(Some(0.0), 5.0, 0.1), f.0.get()), (Doing::Stalled, 0));
        assert_eq!(m.look(Some(0.0), -5.0, 0.1), Doing::Driving(false));
    }

    #[test]
    fn without_a_position_it_drives_blind_for_a_bounded_time() {
        let (f, _, mut m) = motor();
        let tenths = (0..1000).take_while(|_| m.look(None, 5.0, 0.1) == Doing::Driving(true)).count();
        assert!((195..=205).contains(&tenths), "{tenths}");
        assert_eq!(f.0.get(), 0);
        assert_eq!(m.look(Some(f32::NAN), 5.0, 0.1), Doing::Blind, "NaN is no position");
    }

    #[test]
    fn a_wish_that_is_not_a_number_moves_nothing() {
        let (f, r, mut m) = motor();
        assert_eq!(m.look(Some(0.0), f32::NAN, 0.1), Doing::Holding);
        assert_eq!((f.0.get(), r.0.get()), (0, 0));
    }
}

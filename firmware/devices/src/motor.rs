//! A motor that moves something to a position: pump piston, battery mass.
//!
//! An H-bridge (TI DRV8873, PH/EN off, two PWM inputs) and a position pot. Full
//! speed to within the dead band, nothing inside it. It stops by itself when
//! no position, or no motion, is seen for longer than the way that was wanted
//! takes: a motor that stands and a pot that stands look alike, and a pump must
//! reach its end without its pot. The bridge limits the current meanwhile.

use embedded_hal::pwm::SetDutyCycle;

/// What a motor may do.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Not driven for less than this distance, in the position's unit.
    pub dead_band: f32,
    /// Least change of position that is motion: a few times the noise of the pot.
    pub least_motion: f32,
    /// Way per second when driven.
    pub rate: f32,
    /// Whole way from end to end.
    pub stroke: f32,
    /// Least time without motion after which it is given up, s.
    pub stall_s: f32,
}

/// A motor that shows no motion is driven for as long as the whole way should take and this share more: it may be
/// the pot that stands.
const SPARE: f32 = 1.2;
/// Shortest time between two looks, s.
const SHORTEST_S: f32 = 0.01;

/// What it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doing {
    /// There, or nothing wanted.
    Holding,
    /// Driving towards larger positions (`true`) or smaller.
    Driving(bool),
    /// Gave up: driven and did not move. Tried again when the wish changes.
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
    /// Last position seen.
    last: Option<f32>,
    /// Where it was last seen to move.
    mark: Option<f32>,
    /// Driven without motion for, s.
    still_s: f32,
    given_up: bool,
    doing: Doing,
}

impl<F: SetDutyCycle, R: SetDutyCycle> Motor<F, R> {
    /// A motor at rest.
    pub const fn new(forward: F, reverse: R, limits: Limits) -> Self {
        Self { forward, reverse, limits, wanted: 0.0, last: None, mark: None, still_s: 0.0, given_up: false, doing: Doing::Holding }
    }

    /// Other limits from now on: of the mission's configuration.
    pub const fn limit(&mut self, limits: Limits) {
        self.limits = limits;
    }

    /// One look: where it is, where it should be, seconds since the last look.
    /// A wish that is not finite is no wish.
    pub fn look(&mut self, position: Option<f32>, wanted: f32, dt_s: f32) -> Doing {
        let wanted = if wanted.is_finite() { wanted } else { self.wanted };
        if (wanted - self.wanted).abs() > self.limits.dead_band {
            (self.given_up, self.still_s, self.mark) = (false, 0.0, self.last);
        }
        self.wanted = wanted;
        self.doing = self.decide(position.filter(|p| p.is_finite()), dt_s);
        let bridge = match self.doing {
            Doing::Driving(true) => self.reverse.set_duty_cycle_fully_off().is_ok() && self.forward.set_duty_cycle_fully_on().is_ok(),
            Doing::Driving(false) => self.forward.set_duty_cycle_fully_off().is_ok() && self.reverse.set_duty_cycle_fully_on().is_ok(),
            _ => false,
        };
        if !bridge {
            self.stop();
        }
        self.doing
    }

    /// Time until the next look is due, s: none while it rests; sooner than `look_s` where it arrives sooner.
    pub fn next_look_s(&self, look_s: f32) -> Option<f32> {
        let Doing::Driving(_) = self.doing else { return None };
        let way = self.last.map_or(self.limits.stroke, |at| (self.wanted - at).abs());
        let arrival_s = way / self.limits.rate;
        // A wish or a rate that is no number: the ordinary look.
        Some(if arrival_s < look_s { arrival_s.max(SHORTEST_S) } else { look_s })
    }

    /// Both off: the bridge brakes. Errors leave nothing better to try.
    pub fn stop(&mut self) {
        let _ = self.forward.set_duty_cycle_fully_off();
        let _ = self.reverse.set_duty_cycle_fully_off();
    }

    fn decide(&mut self, position: Option<f32>, dt_s: f32) -> Doing {
        let limits = self.limits;
        if let Some(at) = position {
            if (self.wanted - at).abs() <= limits.dead_band {
                (self.last, self.mark, self.still_s, self.given_up) = (position, position, 0.0, false);
                return Doing::Holding;
            }
            self.last = position;
            if self.mark.is_none_or(|mark| (at - mark).abs() >= limits.least_motion) {
                (self.mark, self.still_s) = (position, 0.0);
            }
        }
        let way = self.mark.map_or(limits.stroke, |mark| (self.wanted - mark).abs());
        let patience_s = SPARE * way / limits.rate;
        self.given_up |= self.still_s > if patience_s > limits.stall_s { patience_s } else { limits.stall_s };
        if self.given_up {
            return if position.is_some() { Doing::Stalled } else { Doing::Blind };
        }
        self.still_s += dt_s;
        Doing::Driving(self.last.is_none_or(|at| self.wanted > at))
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

    const LIMITS: Limits = Limits { dead_band: 0.1, least_motion: 0.05, rate: 1.0, stroke: 20.0, stall_s: 2.0 };

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
        m.look(Some(0.0), 0.0, 0.1);
        let tenths = (0..100).take_while(|_| m.look(Some(0.0), 5.0, 0.1) == Doing::Driving(true)).count();
        assert!((58..=64).contains(&tenths), "{tenths}: the way takes 5 s");
        assert_eq!((m.look(Some(0.0), 5.0, 0.1), f.0.get()), (Doing::Stalled, 0));
        assert_eq!(m.look(Some(0.0), -5.0, 0.1), Doing::Driving(false));
        assert_eq!(m.look(Some(-5.0), -5.0, 0.1), Doing::Holding);
        let tenths = (0..100).take_while(|_| m.look(Some(-5.0), -5.3, 0.1) == Doing::Driving(false)).count();
        assert!((20..=23).contains(&tenths), "{tenths}: a short way has the least patience");
    }

    #[test]
    fn a_slow_motor_is_never_given_up() {
        let (f, _, mut m) = motor();
        let mut at = 0.0f32;
        for _ in 0..2500 {
            m.look(Some(at), 20.0, 0.1);
            at += 0.01 * if f.0.get() > 0 { 1.0 } else { 0.0 };
        }
        assert!((at - 20.0).abs() <= 0.11, "{at}: a tenth of its rate");
    }

    #[test]
    fn the_last_look_comes_when_it_arrives() {
        let (_, _, mut m) = motor();
        m.look(Some(0.0), 5.0, 0.1);
        assert_eq!(m.next_look_s(0.2), Some(0.2));
        m.look(Some(4.85), 5.0, 0.1);
        assert!(m.next_look_s(0.2).is_some_and(|s| (s - 0.15).abs() < 1e-3));
        m.look(Some(4.95), 5.0, 0.1);
        assert_eq!(m.next_look_s(0.2), None);
    }

    #[test]
    fn without_a_position_it_drives_blind_for_a_bounded_time() {
        let (f, _, mut m) = motor();
        let tenths = (0..1000).take_while(|_| m.look(None, 5.0, 0.1) == Doing::Driving(true)).count();
        assert!((235..=245).contains(&tenths), "{tenths}: it may lie anywhere");
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

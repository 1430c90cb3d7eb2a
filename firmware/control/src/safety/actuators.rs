//! Pump, battery mass and fin: do they follow?
//!
//! ```text
//! pump: follows --no way for 8 s--> retry (3 ×: stop one cycle, drive) --> reverse 30 cc --> drive --> PumpStuck
//! ```
//! A pump that fails while the depth answers to the command all the same has
//! lost its feedback, not its way: BallastFeedback.

use super::{Verdict, Watch};
use crate::angle::wrap;
use crate::bound::{Bound, all_finite};
use crate::mutant::Watch as Of;
use signals::{Abort, Flags};

/// Pump error that is left alone, m³: a few times the dead-band of real pumps.
pub const PUMP_NEAR_M3: f32 = 12e-6;
/// Way that counts as way, m³.
const PUMP_WAY_M3: f32 = 3e-6;
/// Shortest time without way before a retry, s.
pub const PUMP_WAIT_S: f32 = 8.0;
/// Way in the wrong direction that no command explains, m³.
pub const PUMP_AWAY_M3: f32 = 40e-6;
/// How far the pump is reversed to free it, m³.
const PUMP_REVERSE_M3: f32 = 30e-6;
/// Retries before the reverse.
pub const RETRIES: u8 = 3;
/// Without feedback the vehicle turns for the surface after this, s: the pump goes there by its rate and time. Five readings running.
pub const FEEDBACK_MISSED_S: f32 = 20.0;
/// Feedback missing for this long is lost, s: the vehicle is on its way up, on a pump that has had five times what it needs.
pub const FEEDBACK_LOST_S: f32 = 180.0;
/// Depth rate that answers a command, m/s.
const ANSWER_M_S: f32 = 0.05;
/// Battery mass error that is left alone, m.
pub const MASS_NEAR_M: f32 = 1.5e-3;
/// Way of the battery mass that counts as way, m.
const MASS_MOVES_M: f32 = 0.3e-3;
/// Battery mass without way for this long is stopped, s (or two cycles, and what the line to its motor was seen to delay).
pub const MASS_WAIT_S: f32 = 2.0;
/// How many cycles old an order may be when the motor follows it: the delay margin of the pitch loop.
const ORDERS: usize = 6;
/// Farther from every order of these cycles than this, and from the newest, is away, m.
const MASS_AWAY_M: f32 = 4e-3;
/// Mass stopped in all for this long: abort, s.
pub const MASS_LOST_S: f32 = 120.0;
/// Fin error left alone, rad; time without way, s.
pub const FIN: (f32, f32) = (0.1, 60.0);
/// Heading swept in one direction that is a spiral: two full turns, rad.
const SPIRAL_RAD: f32 = 12.566;

#[derive(Clone, Copy, Debug, PartialEq)]
struct Follower {
    /// NaN: nothing ordered so far.
    target: f32,
    mark: f32,
    nearest: f32,
    still_s: f32,
}

impl Default for Follower {
    fn default() -> Self {
        Self { target: f32::NAN, mark: 0.0, nearest: 0.0, still_s: 0.0 }
    }
}

impl Follower {
    /// Time without way towards `target`, s, and how much farther off than the nearest it has come.
    fn watch(&mut self, target: f32, at: f32, near: f32, way: f32, dt_s: f32) -> (f32, f32) {
        let off = (target - at).abs();
        // What is overwritten need not be checked first.
        if off < near || (target - self.target).abs() > near || !all_finite([self.target, self.mark, self.nearest, self.still_s]) {
            *self = Self { target, mark: at, nearest: off, still_s: 0.0 };
            return (0.0, 0.0);
        }
        self.nearest = self.nearest.at_most(off);
        // Both from the target of now: one that has crept since is no way made.
        if (target - self.mark).abs() - off > way {
            self.mark = at;
            self.still_s = 0.0;
        } else {
            self.still_s += dt_s;
        }
        (self.still_s, off - self.nearest)
    }
}

/// The orders that a motor may be on its way to: what is commanded takes effect some cycles later over a slow line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Orders {
    /// Position ordered, m, newest first; 0 before the first.
    last: [f32; ORDERS],
}

impl Orders {
    fn note(&mut self, order: f32) {
        let mut newer = order;
        for at in &mut self.last {
            newer = core::mem::replace(at, newer);
        }
    }

    /// Whether `at` lies between the orders, or within `near` of one of them.
    fn lead_to(&self, at: f32, near: f32) -> bool {
        let (low, high) = self.last.iter().fold((at, at), |(low, high), x| (low.at_most(*x), high.at_least(*x)));
        let nearest = self.last.iter().any(|x| (x - at).abs() <= near);
        nearest || low < at && at < high
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ActuatorWatch {
    pump: Follower,
    pump_tries: u8,
    pump_wanted_m3: f32,
    rate_at_first_try_m_s: f32,
    pump_lost_s: f32,
    /// Found not to follow, and not come to where it is wanted since.
    pump_failed: bool,
    away: u8,
    mass: Follower,
    mass_stopped_s: f32,
    /// Stopped in the cycle before: what is commanded is where it stands, not where it is wanted.
    mass_held: bool,
    /// And in the one before that.
    mass_was_held: bool,
    mass_away: u8,
    mass_orders: Orders,
    /// Longest that the mass stood and then went where it was sent, s: what the line to its motor delays.
    mass_lag_s: f32,
    fin: Follower,
    fin_lost_s: f32,
    swept_rad: f32,
    last_heading_rad: f32,
}

impl ActuatorWatch {
    pub(super) fn watch(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        let all = [
            self.pump_wanted_m3,
            self.rate_at_first_try_m_s,
            self.pump_lost_s,
            self.mass_stopped_s,
            self.mass_lag_s,
            self.fin_lost_s,
            self.swept_rad,
            self.last_heading_rad,
        ];
        if !all_finite(all) {
            *self = Self::default();
        }
        self.watch_pump(w, v);
        self.watch_mass(w, v);
        self.watch_fin(w, v);
        v.pump_lost = self.pump_failed;
    }

    fn watch_pump(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        let dt = w.seen.dt_s;
        let Some(at) = w.seen.ballast_m3 else {
            v.flag(Flags::PUMP_OPEN_LOOP);
            self.pump_lost_s = (self.pump_lost_s + dt).at_most(1e6);
            if self.pump_lost_s >= FEEDBACK_MISSED_S && Of::PumpFeedback.enabled() {
                v.climb = true;
                v.home_for_now = true;
                v.pump_full = true;
            }
            if self.pump_lost_s >= Of::PumpFeedback.after(FEEDBACK_LOST_S) && Of::PumpFeedback.enabled() {
                v.cause(Abort::BallastFeedback);
            }
            return;
        };
        self.pump_lost_s = (self.pump_lost_s - dt).at_least(0.0);
        // A retry or reverse in the last cycle is ours; judge against what was wanted before it.
        if self.pump_tries == 0 {
            self.pump_wanted_m3 = w.commanded.ballast_m3;
        }
        let wanted = self.pump_wanted_m3;
        let (still_s, away) = self.pump.watch(wanted, at, PUMP_NEAR_M3, PUMP_WAY_M3, dt);
        if still_s <= 0.0 {
            self.pump_tries = 0;
        }
        self.pump_failed &= (wanted - at).abs() > PUMP_NEAR_M3;
        self.away = if away > PUMP_AWAY_M3 && self.pump_tries <= RETRIES { self.away.saturating_add(1) } else { 0 };
        if self.away >= 2 && Of::PumpAway.enabled() {
            v.cause(Abort::PumpStuck);
            self.pump_failed = true;
        }
        if still_s >= Of::PumpTries.after(PUMP_WAIT_S.at_least(2.0 * w.cycle_s())) && Of::PumpTries.enabled() {
            if self.pump_tries == 0 {
                self.rate_at_first_try_m_s = w.seen.rate_m_s;
            }
            self.pump_tries = self.pump_tries.saturating_add(1);
            self.pump.still_s = 0.0;
            self.pump.mark = at;
            match self.pump_tries {
                0..=RETRIES => v.pump_instead_m3 = Some(at),
                n if n == RETRIES + 1 => {
                    let back = if wanted > at { -PUMP_REVERSE_M3 } else { PUMP_REVERSE_M3 };
                    v.pump_instead_m3 = Some((at + back).at_least(-w.config.pump_m3).at_most(w.config.pump_m3));
                }
                _ => {
                    let answered = (w.seen.rate_m_s - self.rate_at_first_try_m_s) * (wanted - at) < 0.0
                        && (w.seen.rate_m_s - self.rate_at_first_try_m_s).abs() > ANSWER_M_S;
                    v.cause(if answered { Abort::BallastFeedback } else { Abort::PumpStuck });
                    self.pump_failed |= !answered;
                    self.pump_tries = 1;
                }
            }
        }
    }

    fn watch_mass(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        let dt = w.seen.dt_s;
        // Where it was stopped is an order once; where it goes on to after that is none.
        if !(self.mass_held && self.mass_was_held) {
            self.mass_orders.note(w.commanded.battery_mass_m);
        }
        let stopped = match w.seen.battery_m {
            None => true,
            Some(at) => {
                let wanted = if self.mass_held { self.mass.target } else { w.commanded.battery_mass_m };
                let (stood_s, stood_at) = (self.mass.still_s, self.mass.mark);
                let (still_s, away) = self.mass.watch(wanted, at, MASS_NEAR_M, MASS_MOVES_M, dt);
                let shortest_s = MASS_WAIT_S.at_least(2.0 * w.cycle_s());
                if still_s <= 0.0 && stood_s >= shortest_s && (at - stood_at).abs() > MASS_MOVES_M {
                    self.mass_lag_s = self.mass_lag_s.at_least(stood_s).at_most(ORDERS as f32 * w.config.cycle_s);
                }
                let away = away > MASS_AWAY_M && !self.mass_orders.lead_to(at, MASS_AWAY_M);
                self.mass_away = if away { self.mass_away.saturating_add(1) } else { 0 };
                if self.mass_away >= 2 && Of::MassAway.enabled() {
                    v.cause(Abort::MassStuck);
                }
                // Stopped for a while, then tried again.
                still_s >= MASS_WAIT_S && Of::MassStops.enabled() && {
                    let wait = Of::MassStops.after(shortest_s.at_least(self.mass_lag_s + shortest_s));
                    let rounds = (still_s - wait) / (8.0 * wait);
                    still_s >= wait && rounds % 1.0 < 0.75
                }
            }
        };
        self.mass_was_held = self.mass_held;
        self.mass_held = stopped && w.seen.battery_m.is_some();
        if stopped {
            v.flag(Flags::MASS_STOPPED);
            v.hold_mass = true;
            self.mass_stopped_s = (self.mass_stopped_s + dt).at_most(1e6);
        } else {
            self.mass_stopped_s = (self.mass_stopped_s - 0.25 * dt).at_least(0.0);
        }
        if self.mass_stopped_s > Of::MassLost.after(MASS_LOST_S) && Of::MassLost.enabled() {
            v.cause(Abort::MassStuck);
        }
    }

    fn watch_fin(&mut self, w: &Watch<'_>, v: &mut Verdict) {
        let dt = w.seen.dt_s;
        let lost = match w.seen.fin_rad {
            None => false,
            Some(at) => self.fin.watch(w.commanded.fin_rad, at, FIN.0, 0.02, dt).0 > Of::Fin.after(FIN.1),
        };
        if lost && Of::Fin.enabled() {
            v.cause(Abort::FinStuck);
        }
        let Some(heading) = w.seen.heading_rad else { return };
        let turned = wrap(heading - self.last_heading_rad);
        self.last_heading_rad = heading;
        if !w.gliding() || turned * self.swept_rad < 0.0 && turned.abs() > 0.1 {
            self.swept_rad = 0.0;
        } else {
            // Noise of a compass sweeps nowhere; what leaks out in ten minutes is no spiral.
            self.swept_rad = (self.swept_rad + turned) * (1.0 - (dt / 600.0).at_most(1.0));
        }
        if self.swept_rad.abs() > SPIRAL_RAD {
            v.cause(Abort::FinStuck);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Follower, MASS_NEAR_M};

    #[test]
    fn an_order_that_creeps_towards_a_stuck_motor_is_no_way_of_the_motor() {
        let (mut follower, at) = (Follower::default(), 0.025);
        // From 21 mm off to 19.6 mm off within one cycle: less than would begin the watch anew.
        assert_eq!(follower.watch(0.004, at, MASS_NEAR_M, 0.3e-3, 4.0).0, 0.0);
        let still: Vec<f32> = (0..3).map(|_| follower.watch(0.0054, at, MASS_NEAR_M, 0.3e-3, 4.0).0).collect();
        assert_eq!(still, [4.0, 8.0, 12.0]);
        // A motor on its way makes way.
        assert_eq!(follower.watch(0.0054, at - 0.001, MASS_NEAR_M, 0.3e-3, 4.0).0, 0.0);
    }
}

//! What to believe of a sensor frame.
//!
//! Every reading passes a door (finite, in range, fresh); depth moreover a
//! rate gate, a zero taken at the surface, a choice between two sensors and a
//! filter that gives the depth rate.
//!
//! Rules (and the accident behind each):
//! * a spike is never acted on: |z − predicted| ≤ 2 m/s · age + 1 m, and a new
//!   level is believed only after three samples agree (one bad altimeter hit
//!   turned gliders; 9999 became a depth of 9690 m);
//! * an old reading is projected by its age, not held;
//! * without a depth the vehicle is followed by dead reckoning: the rate of now fades into the one that pump and pitch give it.
//!   A lone sensor that was missing for [`NO_DEPTH_S`] is believed again at the third reading running that agrees with the one before
//!   and with dead reckoning (one that does not is followed, and known as a leap). One of two that was
//!   lost for [`UNBACKED_S`] needs three that agree as well;
//! * two depths that disagree by more than 1 m: the deeper one, since it leads
//!   to ascent.

use crate::bound::{Bound, all_finite};
use crate::config::Config;
use crate::mutant::Watch as Of;
use signals::{Reading, SensorFrame};

/// Largest believable vertical speed of vehicle or water, m/s (faults list, 4).
const GATE_M_S: f32 = 2.0;
/// Believable step on top of it, m: noise and surface waves.
const GATE_M: f32 = 1.0;
/// Depths closer than this agree, m.
const AGREE_M: f32 = 1.0;
/// Two depths farther from each other than this, m, and [`APART_SHARE`] of the depth, contradict each other.
pub const APART_M: f32 = 3.0;
/// Share of the depth by which two sound transducers may differ.
pub const APART_SHARE: f32 = 0.01;
/// Deeper than this no antenna is out of the water, m: the largest zero error of a transducer, waves, and as much again as both.
const ANTENNA_M: f32 = 6.0;
/// Density when the CTD gives none, kg/m³: mid-latitude sea surface.
const DENSITY_DEFAULT: f32 = 1025.0;
/// Largest zero error of a pressure transducer that is taken out at the surface, m.
pub const ZERO_MAX_M: f32 = 1.5;
/// Time constant of the depth filter, s: two cycles of noise averaging, a fifth of the shortest turn.
const FILTER_S: f32 = 5.0;

/// Without a depth the vehicle turns for the surface after this, s: four cycles. In so long a glide goes 5 m, dead reckoning errs by
/// one, and of readings that are missing by chance, three in a hundred, four running are missing once in 1,400 h.
pub const NO_DEPTH_S: f32 = 16.0;
/// A lone sensor that leaps is not believed for this long, s; then the mission is aborted, and it is.
pub const LEAP_S: f32 = 8.0;
/// Time in which the rate of now becomes the steady one, s: the speed mode of a glider, 10 s, and half a turn of its pump.
const RECKON_S: f32 = 20.0;
/// Error of dead reckoning, m and m/s: the filter's, and a slow ascent's, which sinking water, layers and another drag make.
const RECKON_ERROR: (f32, f32) = (3.0, 0.25);

/// A sensor not believed for this long is lost, s: seven readings, so that one that comes and goes is kept.
pub const UNBACKED_S: f32 = 30.0;
/// A reading is believed until it is a cycle and this much old, ms.
pub const LATE_MS: u32 = 3000;

/// One depth sensor behind its gate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Channel {
    value_m: f32,
    /// Time since the value was believed, s; meaningless before `seeded`.
    age_s: f32,
    seeded: bool,
    rejected: u8,
    rejected_m: f32,
    zero_m: f32,
    /// The last reading believed is none that dead reckoning allows, and no other sensor measured.
    leapt: bool,
}

/// Where the vehicle is expected, whatever this sensor says.
#[derive(Clone, Copy, Debug)]
struct Expected {
    /// Depth, m, and its rate, m/s, within the gate.
    depth_m: f32,
    rate_m_s: f32,
    /// Time for which no sensor at all has measured, s.
    blind_s: f32,
}

impl Channel {
    /// Takes a reading; returns the depth if there is a believable new one.
    fn take(&mut self, reading: Reading, deepest_m: f32, max_age_ms: u32, at: &Expected, dt_s: f32, afloat: bool) -> Option<f32> {
        let since_s = self.age_s + dt_s;
        let taken = self.judge(reading, deepest_m, max_age_ms, at, dt_s, since_s, afloat);
        if taken.is_none() {
            self.age_s = since_s.at_most(1e4);
        }
        taken
    }

    #[inline(always)]
    fn judge(
        &mut self,
        reading: Reading,
        deepest_m: f32,
        max_age_ms: u32,
        at: &Expected,
        dt_s: f32,
        since_s: f32,
        afloat: bool,
    ) -> Option<f32> {
        let (Some(raw), Reading::Sampled { age_ms, .. }) = (reading.accept(-10.0..=deepest_m, max_age_ms), reading) else {
            // Readings running begin anew; where the other sensor measures, silence between slow answers is no disagreement.
            if at.blind_s > 0.0 || !unanswered(reading, max_age_ms) {
                self.rejected = 0;
            }
            return None;
        };
        if afloat && raw.abs() < 3.0 {
            self.zero_m += (raw.at_least(-ZERO_MAX_M).at_most(ZERO_MAX_M) - self.zero_m) * 0.2;
        }
        let value = raw - self.zero_m + at.rate_m_s * (age_ms as f32 * 1e-3);
        let reach = GATE_M + GATE_M_S * since_s.at_most(20.0);
        let near = (value - self.value_m).abs() <= reach;
        let same = self.rejected > 0 && (value - self.rejected_m).abs() <= GATE_M + GATE_M_S * dt_s;
        let backed = if at.blind_s <= 0.0 { since_s <= UNBACKED_S } else { since_s < NO_DEPTH_S && !same };
        if !self.seeded || near && backed {
            self.believe(value);
            return Some(value);
        }
        // A new level, and one of a sensor that was lost, must be seen three times before it is believed, and not before a lone
        // sensor was missing for too long.
        self.rejected = if same { self.rejected.saturating_add(1) } else { 1 };
        self.rejected_m = value;
        if self.rejected >= 3 && since_s - dt_s >= LEAP_S {
            let reckoned = (value - at.depth_m).abs() <= RECKON_ERROR.0 + RECKON_ERROR.1 * at.blind_s;
            self.believe(value);
            self.leapt = at.blind_s > 0.0 && !reckoned;
            return Some(value);
        }
        None
    }

    fn believe(&mut self, value: f32) {
        self.value_m = value;
        self.age_s = 0.0;
        self.seeded = true;
        self.rejected = 0;
        self.leapt = false;
    }
}

/// Position feedback of a motor behind its gate: a motor cannot be where its
/// rate does not take it. A new place is believed when three samples agree.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Position {
    last: f32,
    age_s: f32,
    rejected: f32,
    rejects: u8,
    seeded: bool,
}

impl Position {
    fn take(&mut self, reading: Option<f32>, slack: f32, rate: f32, dt_s: f32) -> Option<f32> {
        let age_s = self.age_s + dt_s;
        if let Some(at) = reading
            && (!self.seeded || (at - self.last).abs() <= slack + rate * age_s || self.third(at, slack + rate * dt_s))
        {
            *self = Self { last: at, seeded: true, ..Self::default() };
            return reading;
        }
        self.age_s = age_s.at_most(1e3);
        None
    }

    /// Whether this is the third sample running at a place out of reach.
    #[cold]
    fn third(&mut self, at: f32, near: f32) -> bool {
        let same = self.rejects > 0 && (at - self.rejected).abs() <= near;
        self.rejects = if same { self.rejects.saturating_add(1) } else { 1 };
        self.rejected = at;
        self.rejects >= 3
    }
}

/// What is believed in this cycle. All numbers are finite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// Span since the last step, s.
    pub dt_s: f32,
    /// Depth, m, down.
    pub depth_m: f32,
    /// Depth measured in this cycle, unfiltered, m.
    pub measured_m: Option<f32>,
    /// Depth rate, m/s, down.
    pub rate_m_s: f32,
    /// Time since a depth was measured, s.
    pub depth_age_s: f32,
    /// A lone depth sensor says a depth to which dead reckoning leads in no way.
    pub depth_leapt: bool,
    /// Both depth sensors answered and differ by more than they may.
    pub depths_disagree: bool,
    /// Of two depth sensors that have been believed, one has not been for half a minute.
    pub depth_unbacked: bool,
    /// No more than one depth sensor has ever been believed.
    pub depth_alone: bool,
    /// Pitch, rad.
    pub pitch_rad: Option<f32>,
    /// Roll, rad.
    pub roll_rad: Option<f32>,
    /// Heading, rad.
    pub heading_rad: Option<f32>,
    /// Pump position, m³.
    pub ballast_m3: Option<f32>,
    /// Battery mass position, m.
    pub battery_m: Option<f32>,
    /// Fin angle, rad.
    pub fin_rad: Option<f32>,
    /// Water density, kg/m³ (default when not measured).
    pub density_kg_m3: f32,
    /// The density is the default.
    pub density_default: bool,
    /// Height above the bottom, m.
    pub altitude_m: Option<f32>,
    /// Fix or shore in this cycle, wherever the vehicle is.
    pub antenna: bool,
    /// Antenna out of the water: fix or shore in this cycle, and a depth at which that can be.
    pub afloat: bool,
    /// GPS fix in this cycle.
    pub fix: bool,
    /// Shore heard in this cycle.
    pub shore: bool,
    /// Nothing at all answered.
    pub silent: bool,
    /// A field held something that is not a measurement.
    pub refused: bool,
}

impl Seen {
    /// What a count of what the depth rate shows is multiplied with where it does not count on: one lost sample takes nothing from it.
    pub(crate) fn unchanged(&self) -> f32 {
        if self.depth_age_s > 0.0 && self.depth_age_s <= LEAP_S { 1.0 } else { 0.0 }
    }
}

/// Memory of the sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Senses {
    pub(crate) first: Channel,
    pub(crate) second: Channel,
    ballast: Position,
    battery: Position,
    depth_m: f32,
    rate_m_s: f32,
    depth_age_s: f32,
    seeded: bool,
}

impl Senses {
    /// Reads one frame. `steady_m_s`: depth rate of a steady glide on the pump as it stands, for dead reckoning.
    pub(crate) fn observe(&mut self, config: &Config, dt_s: f32, frame: &SensorFrame, steady_m_s: f32) -> Seen {
        if !self.sane() {
            *self = Self::default();
        }
        let max_age_ms = ((config.cycle_s * 1000.0) as u32).saturating_add(LATE_MS);
        let antenna = frame.surface.gps_fix || frame.surface.comms;
        let afloat = antenna && self.depth_m <= ANTENNA_M + RECKON_ERROR.1 * self.depth_age_s;
        let deepest = config.crush_depth_m * 1.5;
        let at = Expected { depth_m: self.depth_m, rate_m_s: self.rate_m_s, blind_s: self.depth_age_s };
        let a = self.first.take(frame.depth_m, deepest, max_age_ms, &at, dt_s, afloat);
        let b = self.second.take(frame.depth2_m, deepest, max_age_ms, &at, dt_s, afloat);
        let (measured, differ_m) = match (a, b) {
            (Some(a), Some(b)) if (a - b).abs() > AGREE_M => (Some(a.at_least(b)), (a - b).abs()),
            (Some(a), _) => (Some(a), 0.0),
            (None, b) => (b, 0.0),
        };
        match measured {
            Some(z) => self.filter(z, dt_s),
            None => self.reckon(dt_s, steady_m_s, afloat),
        }
        // Any winding is taken: differences are wrapped where they are used.
        let angle = -7.0..=13.0;
        let density_kg_m3 = frame.density_kg_m3.accept(990.0..=1060.0, 60_000);
        let mut seen = Seen {
            dt_s,
            depth_m: self.depth_m,
            measured_m: measured,
            rate_m_s: self.rate_m_s,
            depth_age_s: self.depth_age_s,
            depth_leapt: a.is_some() && self.first.leapt || b.is_some() && self.second.leapt,
            depths_disagree: differ_m > APART_M + APART_SHARE * self.depth_m.abs(),
            depth_unbacked: self.first.seeded
                && self.second.seeded
                && self.first.age_s.at_least(self.second.age_s) > Of::Unbacked.after(UNBACKED_S),
            depth_alone: !(self.first.seeded && self.second.seeded),
            pitch_rad: frame.pitch_rad.accept(-1.6..=1.6, max_age_ms).map(|r| config.pitch_sensor.true_rad(r)),
            roll_rad: frame.roll_rad.accept(angle.clone(), max_age_ms),
            heading_rad: frame.heading_rad.accept(angle, max_age_ms),
            ballast_m3: self.ballast.take(
                frame.ballast_m3.accept(-1.2 * config.pump_m3..=1.2 * config.pump_m3, max_age_ms),
                20e-6,
                4.0 * config.pump_rate_m3_s,
                dt_s,
            ),
            battery_m: self.battery.take(
                frame.battery_mass_m.accept(-1.2 * config.battery_m..=1.2 * config.battery_m, max_age_ms),
                2e-3,
                2.0 * config.battery_rate_m_s,
                dt_s,
            ),
            fin_rad: frame.fin_rad.accept(-1.0..=1.0, max_age_ms),
            density_kg_m3: density_kg_m3.unwrap_or(DENSITY_DEFAULT),
            density_default: density_kg_m3.is_none(),
            altitude_m: frame.altitude_m.accept(0.3..=100.0, max_age_ms),
            antenna,
            afloat,
            fix: frame.surface.gps_fix && afloat,
            shore: frame.surface.comms && afloat,
            silent: false,
            refused: false,
        };
        let missing = |r: Reading| matches!(r, Reading::Missing);
        // Where one was believed, one has answered.
        seen.silent = measured.is_none()
            && seen.pitch_rad.is_none()
            && seen.ballast_m3.is_none()
            && !antenna
            && [frame.depth_m, frame.depth2_m, frame.pitch_rad, frame.ballast_m3].into_iter().all(|r| unanswered(r, max_age_ms));
        seen.refused = (!missing(frame.depth_m) && a.is_none())
            || (!missing(frame.depth2_m) && b.is_none())
            || (!missing(frame.pitch_rad) && seen.pitch_rad.is_none())
            || (!missing(frame.heading_rad) && seen.heading_rad.is_none())
            || (!missing(frame.ballast_m3) && seen.ballast_m3.is_none())
            || (!missing(frame.battery_mass_m) && seen.battery_m.is_none())
            || (!missing(frame.density_kg_m3) && seen.density_default)
            || (!missing(frame.temperature_degc) && frame.temperature_degc.accept(-5.0..=45.0, 60_000).is_none());
        seen
    }

    /// Dead reckoning: where no depth is measured, and the antenna does not say that it is zero.
    fn reckon(&mut self, dt_s: f32, steady_m_s: f32, afloat: bool) {
        self.depth_age_s = (self.depth_age_s + dt_s).at_most(1e6);
        if afloat {
            (self.depth_m, self.rate_m_s) = (0.0, 0.0);
            return;
        }
        let faded = dt_s / (dt_s + RECKON_S);
        self.rate_m_s += (steady_m_s.at_least(-GATE_M_S).at_most(GATE_M_S) - self.rate_m_s) * faded;
        self.depth_m = (self.depth_m + self.rate_m_s * dt_s).at_least(0.0);
    }

    /// Critically damped α-β filter: no lag at constant rate.
    fn filter(&mut self, z: f32, dt_s: f32) {
        self.depth_age_s = 0.0;
        if !self.seeded || (z - self.depth_m).abs() > 20.0 {
            self.seeded = true;
            self.depth_m = z;
            self.rate_m_s = 0.0;
            return;
        }
        if dt_s <= 0.0 {
            return;
        }
        let r = 1.0 / (1.0 + dt_s / FILTER_S);
        let predicted = self.depth_m + self.rate_m_s * dt_s;
        let surprise = z - predicted;
        self.depth_m = predicted + (1.0 - r * r) * surprise;
        self.rate_m_s = (self.rate_m_s + (1.0 - r) * (1.0 - r) * surprise / dt_s).at_least(-GATE_M_S).at_most(GATE_M_S);
    }

    fn sane(&self) -> bool {
        let (a, b, c, d) = (&self.first, &self.second, &self.ballast, &self.battery);
        all_finite([
            a.value_m,
            a.age_s,
            a.rejected_m,
            b.value_m,
            b.age_s,
            b.rejected_m,
            c.last,
            c.age_s,
            c.rejected,
            d.last,
            d.age_s,
            d.rejected,
            self.depth_m,
            self.depth_age_s,
        ]) && a.zero_m.abs() <= ZERO_MAX_M
            && b.zero_m.abs() <= ZERO_MAX_M
            && self.rate_m_s.abs() <= GATE_M_S
    }
}

/// Missing or too old; a refused value is an answer, if a bad one.
fn unanswered(reading: Reading, max_age_ms: u32) -> bool {
    match reading {
        Reading::Missing => true,
        Reading::Sampled { age_ms, .. } => age_ms > max_age_ms,
    }
}

#[cfg(test)]
mod tests {
    use super::Senses;
    use crate::config::Config;
    use signals::{Reading, SensorFrame};

    fn frame(a: Reading, b: Reading) -> SensorFrame {
        SensorFrame { depth_m: a, depth2_m: b, ..SensorFrame::default() }
    }

    #[test]
    fn a_steady_descent_gives_depth_and_rate_without_lag() {
        let (c, mut s) = (Config::default(), Senses::default());
        let mut seen = s.observe(&c, 0.0, &frame(Reading::now(0.0), Reading::Missing), 0.0);
        for i in 1..40 {
            seen = s.observe(&c, 4.0, &frame(Reading::now(i as f32 * 0.6), Reading::Missing), 0.0);
        }
        assert!((seen.depth_m - 39.0 * 0.6).abs() < 0.01, "{seen:?}");
        assert!((seen.rate_m_s - 0.15).abs() < 1e-3, "{seen:?}");
    }

    #[test]
    fn a_pitch_sensor_that_is_known_to_be_off_is_read_as_what_is_true() {
        let mut settings = *Config::default().settings();
        settings.pitch_sensor = crate::PitchSensor { zero_rad: 0.03, per_reading: 0.8 };
        let (c, mut s) = (Config::new(settings).expect("valid"), Senses::default());
        let mut pitch =
            |reading: f32| s.observe(&c, 4.0, &SensorFrame { pitch_rad: Reading::now(reading), ..SensorFrame::default() }, 0.0).pitch_rad;
        // Readings of a true pitch of -0.4 rad and 0.4 rad.
        for (reading, truth) in [(-0.47, -0.4), (0.53, 0.4)] {
            assert!(pitch(reading).is_some_and(|p| (p - truth).abs() < 1e-6), "{reading}: {:?}", pitch(reading));
        }
        assert_eq!(pitch(f32::NAN), None);
    }

    #[test]
    fn one_spike_is_ignored_and_a_step_is_accepted_at_the_third_sample() {
        let (c, mut s) = (Config::default(), Senses::default());
        for _ in 0..5 {
            s.observe(&c, 4.0, &frame(Reading::now(10.0), Reading::Missing), 0.0);
        }
        let seen = s.observe(&c, 4.0, &frame(Reading::now(150.0), Reading::Missing), 0.0);
        assert!((seen.depth_m - 10.0).abs() < 0.1 && seen.refused);
        let seen = s.observe(&c, 4.0, &frame(Reading::now(10.0), Reading::Missing), 0.0);
        assert!((seen.depth_m - 10.0).abs() < 0.1 && !seen.refused);
        for _ in 0..2 {
            let seen = s.observe(&c, 4.0, &frame(Reading::now(60.0), Reading::Missing), 0.0);
            assert!(seen.depth_m < 20.0);
        }
        assert!(s.observe(&c, 4.0, &frame(Reading::now(60.0), Reading::Missing), 0.0).depth_m > 50.0);
    }

    #[test]
    fn of_two_depths_the_deeper_is_taken_and_a_dead_one_is_replaced() {
        let (c, mut s) = (Config::default(), Senses::default());
        let mut seen = s.observe(&c, 4.0, &frame(Reading::now(10.0), Reading::now(10.2)), 0.0);
        assert!((seen.depth_m - 10.0).abs() < 1e-3);
        for _ in 0..20 {
            seen = s.observe(&c, 4.0, &frame(Reading::now(10.0), Reading::now(15.0)), 0.0);
        }
        assert!((seen.depth_m - 15.0).abs() < 0.1 && seen.depths_disagree);
        let seen = s.observe(&c, 4.0, &frame(Reading::now(f32::NAN), Reading::now(15.0)), 0.0);
        assert_eq!(seen.depth_age_s, 0.0);
    }

    #[test]
    fn one_of_two_depths_that_was_lost_is_believed_again_at_its_third_reading() {
        let (c, mut s) = (Config::default(), Senses::default());
        let mut unbacked = |second: Reading| s.observe(&c, 4.0, &frame(Reading::now(10.0), second), 0.0).depth_unbacked;
        assert!(!unbacked(Reading::now(10.0)));
        let lost: Vec<bool> = (0..8).map(|_| unbacked(Reading::Missing)).collect();
        assert_eq!(lost.iter().filter(|l| **l).count(), 1, "{lost:?}");
        // A chance hit among garbage is none.
        assert!([10.0, 900.0, 10.0, 10.0, 900.0].iter().all(|z| unbacked(Reading::now(*z))));
        assert!([true, true, false].iter().all(|lost| unbacked(Reading::now(10.0)) == *lost));
        // One that answers every 16 s is back at its third answer too.
        assert!((0..9).any(|_| unbacked(Reading::Missing)));
        let slow: Vec<bool> = (0..9).map(|k| unbacked(if k % 4 == 0 { Reading::now(10.0) } else { Reading::Missing })).collect();
        assert_eq!(slow.iter().position(|lost| !lost), Some(8), "{slow:?}");
    }
}

//! Signs: what a fault does, as the truth and the raw frames show it.
//!
//! Where the effect of a fault decides what it is owed, the time of its sign
//! does. A sign is reckoned here, in f64, from the world's truth, the frames
//! and the commands on the wire, never from what the law believes. It stands
//! while its fault acts and its condition holds without a break. Thresholds lie
//! a sensor's noise beyond those that the law states, so that a sign that
//! stands is one the law must see too.

use super::demands;
use crate::flight::cycle::Cycle;
use crate::seats::CYCLE_S;
use control::Config;
use plant::faults::Target;
use signals::{Phase, Reading, Switch};

/// What can be seen of a fault.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Sign {
    /// This depth sensor says nothing usable, or is off the true depth by more than two sensors may differ.
    DepthWrong(Target),
    /// The vehicle rises and its compass has said nothing usable for a minute.
    HeadingLost,
    /// The pitch reading stands still though the vehicle has pitched since.
    PitchFrozen,
    /// The pitch reading has the other sign than the pitch, and than what is asked for.
    PitchOpposed,
    /// The leak detector says alarm.
    Leak,
    /// Three of the last five voltages are below the limit.
    Volts,
    /// Three of the last five charges are below the reserve.
    Charge,
    /// Three of the last five pressures in the hull are above the limit.
    Vacuum,
    /// The fin's reading stays away from a steady command.
    FinElsewhere,
    /// Beyond the depth that the leg or the hull allows.
    TooDeep,
    /// Sinks though its pump is commanded out.
    SinksOn,
    /// A dive that makes no way.
    DivesInVain,
    /// Glides and makes no way.
    NoWay,
    /// Glides at another pitch than is asked for.
    PitchOff,
}

impl Sign {
    /// In words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::DepthWrong(_) => "depth reading wrong",
            Self::HeadingLost => "rising without heading",
            Self::PitchFrozen => "pitch frozen though it changed",
            Self::PitchOpposed => "pitch of the wrong sign",
            Self::Leak => "leak alarm",
            Self::Volts => "voltage low in 3 of 5",
            Self::Charge => "charge low in 3 of 5",
            Self::Vacuum => "hull pressure high in 3 of 5",
            Self::FinElsewhere => "fin away from its command",
            Self::TooDeep => "too deep",
            Self::SinksOn => "sinks with the pump commanded out",
            Self::DivesInVain => "no way made in a dive",
            Self::NoWay => "no way made",
            Self::PitchOff => "pitch not as asked for",
        }
    }

    /// Whether the law looks at nothing but the same readings: then an abort without the sign is a false one.
    #[must_use]
    pub const fn exact(self) -> bool {
        matches!(self, Self::Leak | Self::Volts | Self::Charge | Self::Vacuum)
    }
}

/// Rate that no filter takes for rest, m/s: the law's own limit and as much again as its noise.
const RATE_NOISE_M_S: f64 = 0.02;
/// Steps of a fin that the law takes for way, rad, and its noise.
const FIN_NOISE_RAD: f64 = 0.02;
/// A vehicle that has risen for this long is in its climb: a turn's dwell and a cycle, s.
const RISEN_S: f64 = 12.0;

/// Watches for one sign of one fault.
#[derive(Clone, Debug)]
pub struct Witness {
    sign: Sign,
    since_s: Option<f64>,
    /// Whether the condition was ever met.
    seen: bool,
    mark: (f64, f64),
    lost_s: f64,
    risen_s: f64,
    turned: bool,
    samples: u8,
}

impl Witness {
    /// For this sign.
    #[must_use]
    pub const fn of(sign: Sign) -> Self {
        Self { sign, since_s: None, seen: false, mark: (f64::NAN, f64::NAN), lost_s: 0.0, risen_s: 0.0, turned: false, samples: 0 }
    }

    /// Whether the sign was ever there.
    #[must_use]
    pub const fn seen(&self) -> bool {
        self.seen
    }

    /// Takes a cycle in which the fault acts or not; how long the sign has stood, s.
    pub fn see(&mut self, cycle: &Cycle<'_>, config: &Config, deepest_m: f64, acts: bool) -> Option<f64> {
        if !acts {
            *self = Self { seen: self.seen, ..Self::of(self.sign) };
            return None;
        }
        let shows = self.shows(cycle, config, deepest_m);
        self.seen |= shows;
        self.since_s = shows.then(|| self.since_s.unwrap_or(cycle.time_s));
        self.since_s.map(|since| cycle.time_s - since)
    }

    fn shows(&mut self, c: &Cycle<'_>, config: &Config, deepest_m: f64) -> bool {
        let (t, f, command) = (c.truth, c.frame, &c.answer.command);
        let phase = c.answer.trace.phase;
        let gliding = matches!(phase, Phase::Dive | Phase::InflectLow | Phase::Climb | Phase::InflectHigh);
        match self.sign {
            Sign::DepthWrong(target) => {
                let reading = if target == Target::Depth2 { f.depth2_m } else { f.depth_m };
                let apart_m = demands::APART.0 + demands::APART.1 * t.depth_m.abs();
                // Up to ZERO_MAX_M of it is taken for a zero at the surface.
                let most_m = apart_m + demands::ZERO_M + demands::DEPTH_NOISE_M;
                !fresh(reading, config).is_some_and(|z| (z - t.depth_m).abs() <= most_m)
            }
            Sign::HeadingLost => {
                // Any winding is a heading: two turns either side and one more.
                let known = fresh(f.heading_rad, config).is_some_and(|h| (-7.0..=13.0).contains(&h));
                self.lost_s = if known { 0.0 } else { self.lost_s + CYCLE_S };
                self.risen_s = if t.sink_rate_m_s < -demands::SINKS.0 { self.risen_s + CYCLE_S } else { 0.0 };
                self.lost_s > demands::HEADING_LOST_S && self.risen_s >= RISEN_S
            }
            Sign::PitchFrozen => {
                if !gliding {
                    (self.mark, self.turned) = ((f64::NAN, f64::NAN), false);
                    return false;
                }
                let pitch = fresh(f.pitch_rad, config).unwrap_or(f64::NAN);
                if self.mark.0 != pitch {
                    (self.mark, self.turned) = ((pitch, t.pitch_rad.tan()), false);
                }
                // Half as much again as must show: the trim law's slopes may be off by that.
                self.turned |= (t.pitch_rad.tan() - self.mark.1).abs() > 1.5 * demands::MUST_SHOW_RAD;
                self.turned
            }
            Sign::PitchOpposed => {
                let pitch = fresh(f.pitch_rad, config).unwrap_or(0.0);
                let sinking = t.sink_rate_m_s;
                matches!(phase, Phase::Dive | Phase::Climb)
                    && pitch * t.pitch_rad < 0.0
                    // So far apart that no error of the trim law hides it.
                    && (pitch.tan() - t.pitch_rad.tan()).abs() > demands::OPPOSED
                    && sinking.abs() > demands::SINKS.0 + RATE_NOISE_M_S
                    && sinking * t.ballast_m3 < 0.0
            }
            Sign::Leak => f.leak == Switch::Alarm,
            Sign::Volts => self.three_of_five(f.battery_v, demands::VOLTS, |v| v < config.undervoltage_v),
            Sign::Charge => self.three_of_five(f.charge, demands::CHARGE, |v| v < config.reserve_charge),
            Sign::Vacuum => self.three_of_five(f.vacuum_pa, demands::VACUUM_PA, |v| v > config.vacuum_max_pa),
            Sign::FinElsewhere => {
                // No fin stands beyond a radian: that is no reading.
                let Some(fin) = fresh(f.fin_rad, config).filter(|fin| fin.abs() <= 1.0) else { return false };
                let asked = f64::from(command.fin_rad);
                let off = (fin - asked).abs();
                let (mark_asked, mark_off) = self.mark;
                let steady = (asked - mark_asked).abs() < demands::FIN.0 - FIN_NOISE_RAD && off > mark_off - FIN_NOISE_RAD;
                if !steady {
                    self.mark = (asked, off);
                }
                steady && off > demands::FIN.0 + FIN_NOISE_RAD
            }
            Sign::TooDeep => super::zones::too_deep(t.depth_m, config, deepest_m),
            Sign::SinksOn => {
                command.ballast_m3 > 0.5 * config.pump_m3 && t.sink_rate_m_s > demands::SINKS.0 + RATE_NOISE_M_S && !t.at_surface
            }
            Sign::NoWay | Sign::DivesInVain => {
                let tries = if self.sign == Sign::NoWay { gliding } else { phase == Phase::Dive };
                if !tries || !((t.depth_m - self.mark.0).abs() < demands::WAY_M - demands::DEPTH_NOISE_M) {
                    self.mark.0 = t.depth_m;
                    return false;
                }
                true
            }
            Sign::PitchOff => gliding && (t.pitch_rad - f64::from(c.answer.trace.pitch_setpoint_rad)).abs() > demands::MUST_SHOW_RAD,
        }
    }

    fn three_of_five(&mut self, reading: Reading, range: std::ops::RangeInclusive<f32>, alarm: impl Fn(f32) -> bool) -> bool {
        let is = reading.accept(range, 60_000).is_some_and(alarm);
        self.samples = (self.samples << 1 | u8::from(is)) & 0b1_1111;
        self.samples.count_ones() >= 3
    }
}

/// A finite reading no older than the law believes.
fn fresh(reading: Reading, config: &Config) -> Option<f64> {
    let oldest_ms = (config.cycle_s * 1e3) as u32 + (demands::LATE_S * 1e3) as u32;
    reading.accept(f32::MIN..=f32::MAX, oldest_ms).map(f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant::Truth;
    use signals::{ActuatorCommand, Answer, SensorFrame, Trace};

    struct Shown {
        frame: SensorFrame,
        truth: Truth,
        answer: Answer,
    }

    /// Gliding down on its way, everything measured as it is.
    fn sound(depth_m: f64) -> Shown {
        let truth = Truth { depth_m, sink_rate_m_s: 0.2, pitch_rad: -0.4, ballast_m3: -200e-6, ..Truth::default() };
        let frame = SensorFrame {
            depth_m: Reading::now(depth_m as f32),
            depth2_m: Reading::now(depth_m as f32),
            pitch_rad: Reading::now(-0.4),
            heading_rad: Reading::now(1.0),
            fin_rad: Reading::now(0.0),
            battery_v: Reading::now(15.0),
            ..SensorFrame::default()
        };
        let trace = Trace { phase: Phase::Dive, pitch_setpoint_rad: -0.4, ..Trace::default() };
        Shown { frame, truth, answer: Answer { command: ActuatorCommand::default(), trace } }
    }

    /// How long a sign has stood after each of `cycles`, 4 s apart.
    fn stood(sign: Sign, cycles: &[Shown]) -> Vec<Option<f64>> {
        let (config, mut witness) = (Config::default(), Witness::of(sign));
        let at = |(i, s): (usize, &Shown)| {
            let cycle = Cycle { time_s: 4.0 * i as f64, frame: &s.frame, answer: &s.answer, truth: &s.truth, resets: 0 };
            witness.see(&cycle, &config, 190.0, true)
        };
        cycles.iter().enumerate().map(at).collect()
    }

    #[test]
    fn a_sound_glide_shows_no_sign_at_all() {
        let glide: Vec<Shown> = (0..300).map(|i| sound(0.5 * f64::from(i))).collect();
        let (depth, depth2) = (Sign::DepthWrong(Target::Depth), Sign::DepthWrong(Target::Depth2));
        for sign in [
            depth,
            depth2,
            Sign::HeadingLost,
            Sign::PitchFrozen,
            Sign::PitchOpposed,
            Sign::Leak,
            Sign::Volts,
            Sign::Charge,
            Sign::Vacuum,
            Sign::FinElsewhere,
            Sign::TooDeep,
            Sign::SinksOn,
            Sign::NoWay,
            Sign::DivesInVain,
            Sign::PitchOff,
        ] {
            assert!(stood(sign, &glide).iter().all(Option::is_none), "{sign:?}");
        }
    }

    #[test]
    fn a_sign_stands_from_its_first_cycle_until_a_break_or_the_faults_end() {
        let off = || Shown { frame: SensorFrame { depth_m: Reading::Missing, ..sound(20.0).frame }, ..sound(20.0) };
        let got = stood(Sign::DepthWrong(Target::Depth), &[sound(20.0), off(), off(), sound(20.0), off()]);
        assert_eq!(got, [None, Some(0.0), Some(4.0), None, Some(0.0)]);
        // The other sensor is not the one that is off.
        assert!(stood(Sign::DepthWrong(Target::Depth2), &[off()]).iter().all(Option::is_none));
        let mut witness = Witness::of(Sign::DepthWrong(Target::Depth));
        let s = off();
        let cycle = Cycle { time_s: 0.0, frame: &s.frame, answer: &s.answer, truth: &s.truth, resets: 0 };
        assert_eq!(witness.see(&cycle, &Config::default(), 190.0, false), None);
        assert!(!witness.seen());
    }

    #[test]
    fn each_sign_is_shown_just_beyond_what_the_law_tolerates() {
        let shows = |sign, change: &dyn Fn(&mut Shown, usize)| {
            let mut cycles: Vec<Shown> = (0..60).map(|i| sound(20.0 + 0.8 * f64::from(i))).collect();
            cycles.iter_mut().enumerate().for_each(|(i, s)| change(s, i));
            stood(sign, &cycles).last().copied().flatten().is_some()
        };
        let off = |by: f64| move |s: &mut Shown, _: usize| s.frame.depth_m = Reading::now((s.truth.depth_m + by) as f32);
        // 3 m, 1 %, 1.5 m of zero and 0.5 m of noise.
        assert!(shows(Sign::DepthWrong(Target::Depth), &off(6.0)) && !shows(Sign::DepthWrong(Target::Depth), &off(5.0)));
        let leg = |z: f64| move |s: &mut Shown, _: usize| s.truth.depth_m = z;
        // The leg's 190 m and 10 m, noise on top.
        assert!(shows(Sign::TooDeep, &leg(200.6)) && !shows(Sign::TooDeep, &leg(200.0)));
        let out = |rate: f64| {
            move |s: &mut Shown, _: usize| {
                s.truth.sink_rate_m_s = rate;
                s.answer.command.ballast_m3 = 230e-6;
            }
        };
        assert!(shows(Sign::SinksOn, &out(0.06)) && !shows(Sign::SinksOn, &out(0.03)));
        let still = |s: &mut Shown, _: usize| s.truth.depth_m = 20.0;
        assert!(shows(Sign::NoWay, &still) && shows(Sign::DivesInVain, &still));
        // tan 0.4 is 0.42: 0.225 of it have to be gone.
        let frozen = |rad: f64| move |s: &mut Shown, i: usize| s.truth.pitch_rad = if i > 30 { rad } else { -0.4 };
        assert!(shows(Sign::PitchFrozen, &frozen(-0.18)) && !shows(Sign::PitchFrozen, &frozen(-0.21)));
        let opposed = |s: &mut Shown, _: usize| s.frame.pitch_rad = Reading::now(0.4);
        assert!(shows(Sign::PitchOpposed, &opposed));
        let asked = |rad: f32| move |s: &mut Shown, _: usize| s.answer.trace.pitch_setpoint_rad = rad;
        assert!(shows(Sign::PitchOff, &asked(-0.2)) && !shows(Sign::PitchOff, &asked(-0.3)));
        let rises = |lost: bool| {
            move |s: &mut Shown, _: usize| {
                s.truth.sink_rate_m_s = -0.2;
                s.frame.heading_rad = if lost { Reading::now(f32::NAN) } else { s.frame.heading_rad };
            }
        };
        assert!(shows(Sign::HeadingLost, &rises(true)) && !shows(Sign::HeadingLost, &rises(false)));
        let fin = |rad: f32| move |s: &mut Shown, _: usize| s.frame.fin_rad = Reading::now(rad);
        assert!(shows(Sign::FinElsewhere, &fin(0.13)) && !shows(Sign::FinElsewhere, &fin(0.1)) && !shows(Sign::FinElsewhere, &fin(5.0)));
        // Two low of five are none, three are.
        let low = |n: usize| move |s: &mut Shown, i: usize| s.frame.battery_v = Reading::now(if i % 5 < n { 9.0 } else { 15.0 });
        assert!(shows(Sign::Volts, &low(3)) && !shows(Sign::Volts, &low(2)));
    }
}

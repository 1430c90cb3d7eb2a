//! Which behaviour commands what now, and what the motors are then told.
//!
//! Priority is the order in the mission file: abend, surface, yo and set_heading. Pitch by the glider's own servo is its battery position
//! moved by the pitch error once per cycle, outside a dead band (public default 3°).

use crate::measured::Measured;
use crate::mission::{Behaviour, LINK, Read};
use crate::science::Write;
use signals::ActuatorCommand;

/// Dead band of the pitch servo, rad (public: 3°).
const PITCH_DEAD_BAND_RAD: f64 = 0.052;
/// Battery per pitch error in a cycle, in/rad (guess: a third of what the trim law says, so that it does not overshoot).
const PITCH_GAIN_IN_RAD: f64 = 0.6;
/// Fin per heading error, rad/rad (guess).
const HEADING_GAIN: f64 = 0.5;
/// Pitch of the emergency's climb, rad (45°).
const EMERGENCY_PITCH_RAD: f64 = 0.785;
/// Afloat above this, m.
const SURFACE_M: f64 = 1.0;
/// At the surface a surface behaviour waits so long at most, s.
const SURFACE_WAIT_S: f64 = 300.0;
/// Depth that must change within a behaviour's hover time, m (guess).
const HOVER_M: f64 = 1.0;
/// Abort: the weight goes at the earliest after this, when the vehicle does not rise, s; at the latest after the other.
const BURN_S: (f64, f64) = (600.0, 14_400.0);
/// An abort that is over: afloat for this long, s.
const ABORT_OVER_S: f64 = 60.0;

/// How far the motors go and how small a step they ignore, in the glider's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motors {
    /// Pump, cc: limit and dead band.
    pub pump_cc: (f64, f64),
    /// Battery, in.
    pub battery_in: (f64, f64),
    /// Fin, rad.
    pub fin_rad: (f64, f64),
}

/// Why the mission was aborted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Abort {
    /// Deeper than allowed.
    OverDepth,
    /// The same depth for too long.
    SameDepth,
    /// Voltage.
    Undervolts,
    /// Vacuum out of its window.
    Vacuum,
    /// Leak.
    Leak,
    /// Mission too long.
    Overtime,
}

/// What the front seat is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Doing {
    /// Yo, going down by its own count.
    Dive,
    /// Yo, going up.
    Climb,
    /// A surface behaviour, by number in the file.
    Surface(usize),
    /// Aborted.
    Aborted(Abort),
    /// The mission is over: the glider's own shell.
    Over,
}

/// Front seat's memory of a mission.
#[derive(Clone, Debug)]
pub struct FlightComputer {
    mission: Read,
    motors: Motors,
    /// Parameters a…, stored as the glider does.
    pub parameters: [f32; 12],
    /// Mode word.
    pub mode: u32,
    /// What it is doing.
    pub doing: Doing,
    since_s: f64,
    half_cycles: u32,
    hover: (f64, f64),
    same_depth: (f64, f64),
    last_comms_s: f64,
    afloat_s: f64,
    /// Sent to the motors last, in the glider's units.
    pub ordered: [f64; 3],
    weight: bool,
}

/// What is wanted of pump (cc), battery (in, or pitch in rad) and fin (rad).
struct Wanted {
    pump_cc: f64,
    pitch: Pitch,
    fin_rad: f64,
}

enum Pitch {
    BatteryIn(f64),
    ServoRad(f64),
}

impl FlightComputer {
    /// At the surface, with a mission begun at `now_s`.
    #[must_use]
    pub fn new(mission: Read, motors: Motors, now_s: f64) -> Self {
        let mut parameters = [0.0; 12];
        for (name, value) in &mission.sensors {
            if let Some(letter) = name.strip_prefix("u_mission_param_").and_then(|l| l.bytes().next())
                && let Some(p) = parameters.get_mut(usize::from(letter.wrapping_sub(b'a')))
            {
                *p = *value as f32;
            }
        }
        Self {
            mission,
            motors,
            parameters,
            mode: 0,
            doing: Doing::Dive,
            since_s: now_s,
            half_cycles: 0,
            hover: (now_s, 0.0),
            same_depth: (now_s, 0.0),
            last_comms_s: now_s,
            afloat_s: 0.0,
            ordered: [motors.pump_cc.0, 0.0, 0.0],
            weight: false,
        }
    }

    /// Takes what the board wrote.
    pub fn obey(&mut self, writes: &[Write]) {
        for write in writes {
            match *write {
                Write::Parameter(number, value) => {
                    if let Some(p) = self.parameters.get_mut(number) {
                        *p = value;
                    }
                }
                Write::Mode(mask, value) => self.mode = self.mode & !mask | value & mask,
            }
        }
    }

    /// Whether the mission has ended, orderly or not.
    #[must_use]
    pub const fn is_over(&self) -> bool {
        matches!(self.doing, Doing::Over)
    }

    fn behaviour(&self, name: &str) -> Option<&Behaviour> {
        self.mission.behaviours.iter().find(|b| b.name == name)
    }

    /// An argument, or the parameter it is linked to.
    fn argument(&self, behaviour: &Behaviour, name: &str) -> Option<f64> {
        let value = behaviour.get(name)?;
        if value < LINK {
            return Some(value);
        }
        self.parameters.get((value - LINK) as usize).map(|p| f64::from(*p))
    }

    /// One flight cycle. `silent_s`: how long the backseat has been silent, where the front seat minds.
    pub fn cycle(&mut self, now_s: f64, dt_s: f64, m: &Measured, started_s: f64, minds_silence: bool) -> ActuatorCommand {
        self.afloat_s = if m.depth_m < SURFACE_M { self.afloat_s + dt_s } else { 0.0 };
        if m.comms && m.depth_m < SURFACE_M {
            self.last_comms_s = now_s;
        }
        self.judge(now_s, m, started_s);
        self.surface(now_s, m, minds_silence);
        self.yo(now_s, m);
        let wanted = self.wanted(m);
        self.order(wanted, m)
    }

    fn begin(&mut self, doing: Doing, now_s: f64, depth_m: f64) {
        (self.doing, self.since_s, self.hover) = (doing, now_s, (now_s, depth_m));
    }

    fn judge(&mut self, now_s: f64, m: &Measured, started_s: f64) {
        if let Doing::Aborted(_) = self.doing {
            let elapsed = now_s - self.since_s;
            self.weight |= (elapsed > BURN_S.0 && m.depth_m > SURFACE_M && m.rising_m_s <= 0.0) || elapsed > BURN_S.1;
            if self.afloat_s > ABORT_OVER_S {
                self.begin(Doing::Over, now_s, m.depth_m);
            }
            return;
        }
        if self.is_over() {
            return;
        }
        if (m.depth_m - self.same_depth.1).abs() > HOVER_M || m.depth_m < SURFACE_M {
            self.same_depth = (now_s, m.depth_m);
        }
        let Some(abend) = self.behaviour("abend") else { return };
        let limit = |name: &str| abend.get(name).unwrap_or(f64::INFINITY);
        let cause = [
            (m.depth_m > limit("overdepth"), Abort::OverDepth),
            (now_s - self.same_depth.0 > limit("samedepth_for"), Abort::SameDepth),
            (m.volts < abend.get("undervolts").unwrap_or(0.0), Abort::Undervolts),
            (m.vacuum_inhg > limit("vacuum_max") || m.vacuum_inhg < abend.get("vacuum_min").unwrap_or(-1.0), Abort::Vacuum),
            (m.leak, Abort::Leak),
            (now_s - started_s > limit("max_mission_time"), Abort::Overtime),
        ]
        .into_iter()
        .find(|c| c.0);
        if let Some((_, cause)) = cause {
            self.begin(Doing::Aborted(cause), now_s, m.depth_m);
        }
    }

    fn surface(&mut self, now_s: f64, m: &Measured, minds_silence: bool) {
        if matches!(self.doing, Doing::Aborted(_) | Doing::Over) {
            return;
        }
        let bit_of = |b: &Behaviour| if b.get("start_when") == Some(15.0) { b.get("when_secs").map_or(0, |bit| bit as u32) } else { 0 };
        let asked = self.mission.behaviours.iter().position(|b| {
            b.name == "surface"
                && match b.get("start_when") {
                    Some(12.0) => minds_silence || now_s - self.last_comms_s > b.get("when_secs").unwrap_or(f64::INFINITY),
                    Some(15.0) => self.mode & bit_of(b) != 0,
                    _ => false,
                }
        });
        match (self.doing, asked) {
            (Doing::Surface(now), _) => {
                let Some(b) = self.mission.behaviours.get(now) else { return };
                let bit = bit_of(b);
                let (ends, cleared) = (b.get("end_action") == Some(0.0), bit != 0 && self.mode & bit == 0);
                if ends && self.afloat_s > ABORT_OVER_S {
                    self.begin(Doing::Over, now_s, m.depth_m);
                } else if !ends && m.depth_m < SURFACE_M && (cleared || self.afloat_s > SURFACE_WAIT_S) {
                    self.begin(Doing::Dive, now_s, m.depth_m);
                } else if let Some(other) = asked.filter(|other| *other < now) {
                    self.begin(Doing::Surface(other), now_s, m.depth_m);
                }
            }
            (_, Some(asked)) => self.begin(Doing::Surface(asked), now_s, m.depth_m),
            _ => {}
        }
    }

    fn yo(&mut self, now_s: f64, m: &Measured) {
        let Some(yo) = self.behaviour("yo").cloned() else { return };
        if (m.depth_m - self.hover.1).abs() > HOVER_M {
            self.hover = (now_s, m.depth_m);
        }
        let hovers = |name: &str| now_s - self.hover.0 > yo.get(name).unwrap_or(f64::INFINITY);
        let all = yo.get("num_half_cycles_to_do").filter(|n| *n >= 0.0);
        match self.doing {
            Doing::Dive if m.depth_m >= self.argument(&yo, "d_target_depth").unwrap_or(0.0) || hovers("d_stop_when_hover_for") => {
                self.half_cycles += 1;
                self.begin(Doing::Climb, now_s, m.depth_m);
            }
            Doing::Climb => {
                let last = all.is_some_and(|n| f64::from(self.half_cycles + 1) >= n);
                let top_m = if last { 0.0 } else { self.argument(&yo, "c_target_depth").unwrap_or(0.0) };
                if m.depth_m <= top_m.max(if last { SURFACE_M } else { 0.0 }) || hovers("c_stop_when_hover_for") {
                    self.half_cycles += 1;
                    self.begin(if last { Doing::Over } else { Doing::Dive }, now_s, m.depth_m);
                }
            }
            _ => {}
        }
    }

    fn wanted(&self, m: &Measured) -> Wanted {
        let up = |pitch| Wanted { pump_cc: self.motors.pump_cc.0, pitch: Pitch::ServoRad(pitch), fin_rad: 0.0 };
        let afloat = m.depth_m < SURFACE_M;
        match self.doing {
            // At the surface the battery goes forward: antenna up.
            Doing::Surface(_) | Doing::Aborted(_) | Doing::Over if afloat => {
                Wanted { pump_cc: self.motors.pump_cc.0, pitch: Pitch::BatteryIn(self.motors.battery_in.0), fin_rad: 0.0 }
            }
            Doing::Surface(which) => {
                let emergency = self.mission.behaviours.get(which).and_then(|b| b.get("when_secs")) == Some(2.0);
                up(if emergency { EMERGENCY_PITCH_RAD } else { crate::mission::OWN_PITCH_RAD })
            }
            Doing::Aborted(_) | Doing::Over => up(crate::mission::OWN_PITCH_RAD),
            Doing::Dive | Doing::Climb => {
                let Some(yo) = self.behaviour("yo") else { return up(crate::mission::OWN_PITCH_RAD) };
                let way = if self.doing == Doing::Dive { "d" } else { "c" };
                let of = |what: &str| self.argument(yo, &format!("{way}_{what}"));
                let value = of("pitch_value").unwrap_or(0.0);
                Wanted {
                    pump_cc: of("bpump_value").unwrap_or(self.motors.pump_cc.0),
                    pitch: if of("use_pitch") == Some(1.0) { Pitch::BatteryIn(value) } else { Pitch::ServoRad(value) },
                    fin_rad: self.fin(m),
                }
            }
        }
    }

    fn fin(&self, m: &Measured) -> f64 {
        let Some(set) = self.behaviour("set_heading") else { return 0.0 };
        let value = self.argument(set, "heading_value").unwrap_or(0.0);
        if set.get("use_heading") == Some(4.0) {
            return value;
        }
        let error = (value - m.heading_rad + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
        HEADING_GAIN * error
    }

    /// Clips, ignores steps within the dead bands, and keeps what was ordered.
    fn order(&mut self, wanted: Wanted, m: &Measured) -> ActuatorCommand {
        let battery_in = match wanted.pitch {
            Pitch::BatteryIn(inches) => inches,
            Pitch::ServoRad(pitch) => match m.pitch_rad - pitch {
                error if error.abs() > PITCH_DEAD_BAND_RAD => m.battery_in + PITCH_GAIN_IN_RAD * error,
                _ => self.ordered[1],
            },
        };
        let limits = [self.motors.pump_cc, self.motors.battery_in, self.motors.fin_rad];
        for ((ordered, value), (limit, dead_band)) in self.ordered.iter_mut().zip([wanted.pump_cc, battery_in, wanted.fin_rad]).zip(limits)
        {
            // What is not finite changes nothing.
            if value.is_finite() {
                let value = value.clamp(-limit, limit);
                if (value - *ordered).abs() > dead_band {
                    *ordered = value;
                }
            }
        }
        let [cc, inches, fin] = self.ordered;
        ActuatorCommand {
            seq: 0,
            ballast_m3: (cc * 1e-6) as f32,
            battery_mass_m: (inches * 0.0254) as f32,
            fin_rad: fin as f32,
            drop_weight: self.weight,
            beacon: matches!(self.doing, Doing::Aborted(_) | Doing::Over),
        }
    }
}

//! Which pitch to fly for a goal, and what glide a measured pitch means.
//!
//! Steady glide over a table C_L(α), C_D(α) (all angles as magnitudes):
//! ```text
//! tan γ = C_D / C_L          γ glide angle below (dive) or above (climb) the horizon
//! |θ|   = γ − α              θ pitch
//! U²    = 2 B / (ρ S √(C_L² + C_D²))        B net buoyancy, N
//! ```
//! At (L/D)max dγ/dα = 0, so pitch falls one for one with α there; past it the
//! pitch has a minimum (dγ/dα = 1) below which no steady glide exists: the
//! vehicle falls flat. The setpoint stays away from it by a share of α and a
//! margin in pitch: the minimum is taken for a vehicle whose C_D/C_L is worse
//! than the table's by [`crate::Settings::table_doubt`]. (Lift cannot be
//! checked in flight: at these pitches 10 % of lift slope moves the depth rate
//! by 0.1 mm/s. So the margin is kept, not learned.)
//!
//! The search over α is spread over control cycles ([`Choice::advance`]), so
//! that one step stays cheap.

use crate::angle::{atan, sqrt, tan};
use crate::bound::{Bound, all_finite};
use crate::config::Config;
use polar::Table;
use signals::{Goal, Leg};

/// Points of the search in α.
const GRID: u8 = 32;
/// Points looked at in one control cycle.
const PER_STEP: u8 = 3;
/// Steepest and flattest pitch that is ever aimed at, rad.
pub(crate) const PITCH_RANGE: core::ops::RangeInclusive<f32> = 0.05..=0.75;
/// Pump: volume × pressure over this, guess from small piston pumps.
const PUMP_EFFICIENCY: f32 = 0.4;
/// Energy of one turn apart from pressure (valves, battery mass, fin), J. Guess.
const TURN_J: f32 = 60.0;

/// Steady glide at one angle of attack.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Steady {
    tan_gamma: f32,
    pitch_rad: f32,
    /// Speed through the water, m/s.
    speed_m_s: f32,
    sin_gamma: f32,
    cos_gamma: f32,
}

fn steady(table: &Table<'_>, alpha_rad: f32, buoyancy_n: f32, rho_kg_m3: f32) -> Option<Steady> {
    let c = table.at(alpha_rad);
    if !(c.cl > 1e-5 && c.cd > 1e-6) {
        return None;
    }
    let tan_gamma = c.cd / c.cl;
    let force = sqrt(c.cl * c.cl + c.cd * c.cd);
    let speed_m_s = sqrt(2.0 * buoyancy_n / (rho_kg_m3 * table.area_m2() * force));
    let s = Steady { tan_gamma, pitch_rad: atan(tan_gamma) - alpha_rad, speed_m_s, sin_gamma: c.cd / force, cos_gamma: c.cl / force };
    (s.pitch_rad.is_finite() && s.speed_m_s.is_finite()).then_some(s)
}

/// What is gained at one angle of attack; larger is better.
fn worth(goal: Goal, leg: &Leg, s: &Steady) -> f32 {
    let height_m = (leg.depth_max_m - leg.depth_min_m).at_least(1.0);
    let sink_m_s = (s.speed_m_s * s.sin_gamma).at_least(1e-3);
    match goal {
        Goal::BestGlide | Goal::FixedPitch { .. } => -s.tan_gamma,
        Goal::BestSpeed => s.speed_m_s * s.cos_gamma,
        Goal::Current { along_track_m_s } => {
            let ground = s.speed_m_s * s.cos_gamma + along_track_m_s;
            // Against a stronger current: lose as little ground per time as can be.
            if ground > 0.0 { ground / sink_m_s } else { ground }
        }
        Goal::BestRange { hotel_w } => {
            let pump_j = TURN_J + 2.0 * leg.ballast_m3 * 1025.0 * 9.81 * leg.depth_max_m / PUMP_EFFICIENCY;
            let distance_m = 2.0 * height_m / s.tan_gamma;
            distance_m / (pump_j + hotel_w * 2.0 * height_m / sink_m_s)
        }
    }
}

/// The pitch magnitude for a leg, found over several cycles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Choice {
    leg: Option<Leg>,
    table_id: u32,
    next: u8,
    best: f32,
    best_alpha_rad: f32,
    best_pitch_rad: f32,
    flattest_rad: f32,
    pitch_rad: f32,
    preset: bool,
}

impl Default for Choice {
    fn default() -> Self {
        Self {
            leg: None,
            table_id: 0,
            next: GRID,
            best: f32::MIN,
            best_alpha_rad: 0.0,
            best_pitch_rad: 0.0,
            flattest_rad: 1.0,
            pitch_rad: 0.0,
            preset: true,
        }
    }
}

impl Choice {
    /// Works on the choice for `leg` for one cycle.
    pub(crate) fn advance(&mut self, config: &Config, table: Option<&Table<'_>>, leg: &Leg) {
        let id = table.map_or(0, Table::id);
        if self.leg != Some(*leg) || self.table_id != id || !self.sane() {
            self.begin(config, leg, id);
        }
        let Some(table) = table else { return };
        if self.next >= GRID {
            return;
        }
        let top = (table.best_alpha_rad() * 2.5).at_most(table.alpha_max_rad());
        let buoyancy_n = leg.ballast_m3.at_least(20e-6) * 1025.0 * 9.81;
        for _ in 0..PER_STEP {
            if self.next >= GRID {
                return;
            }
            self.next += 1;
            let alpha = top * f32::from(self.next) / f32::from(GRID);
            let Some(s) = steady(table, alpha, buoyancy_n, 1025.0) else { continue };
            // The flattest pitch that still glides if the vehicle is that much worse than its table.
            self.flattest_rad = self.flattest_rad.at_most(atan(s.tan_gamma * config.table_doubt) - alpha);
            let value = worth(leg.goal, leg, &s);
            if value > self.best && PITCH_RANGE.contains(&s.pitch_rad) && alpha <= table.best_alpha_rad() * 1.05 {
                self.best = value;
                self.best_alpha_rad = alpha;
                self.best_pitch_rad = s.pitch_rad;
            }
            if self.next == GRID {
                self.settle(config, table, leg);
            }
        }
    }

    fn begin(&mut self, config: &Config, leg: &Leg, table_id: u32) {
        // Until the search is done: the last pitch, at first the preset.
        let last = if PITCH_RANGE.contains(&self.pitch_rad) { self.pitch_rad } else { config.preset_pitch_rad };
        *self = Self { leg: Some(*leg), table_id, next: 0, pitch_rad: last, ..Self::default() };
        match leg.goal {
            Goal::FixedPitch { pitch_rad } => {
                self.pitch_rad = pitch_rad.at_least(*PITCH_RANGE.start()).at_most(*PITCH_RANGE.end());
                self.preset = false;
                self.next = GRID;
            }
            _ if table_id == 0 => self.pitch_rad = config.preset_pitch_rad,
            _ => {}
        }
    }

    fn settle(&mut self, config: &Config, table: &Table<'_>, leg: &Leg) {
        if self.best_alpha_rad <= 0.0 {
            self.pitch_rad = config.preset_pitch_rad;
            return;
        }
        // Never nearer to the stall than a share of α*.
        let alpha = match leg.goal {
            Goal::BestGlide => table.best_alpha_rad() * config.alpha_share,
            _ => self.best_alpha_rad.at_most(table.best_alpha_rad() * config.alpha_share),
        };
        let pitch = steady(table, alpha, 1.0, 1025.0).map_or(self.best_pitch_rad, |s| s.pitch_rad);
        let pitch = pitch.at_least(self.flattest_rad);
        let steepest = match leg.goal {
            // No known glider glides best steeper than the stock preset; a table that says so is not believed that far.
            Goal::BestGlide => config.preset_pitch_rad,
            _ => *PITCH_RANGE.end(),
        };
        self.pitch_rad = pitch.max(*PITCH_RANGE.start()).min(steepest);
        self.preset = false;
    }

    /// |pitch| to fly, rad.
    pub(crate) fn pitch_rad(&self, config: &Config) -> f32 {
        if PITCH_RANGE.contains(&self.pitch_rad) { self.pitch_rad } else { config.preset_pitch_rad }
    }

    /// The pitch is the preset: no table, or none that can be used.
    pub(crate) fn is_preset(&self) -> bool {
        self.preset && (self.next >= GRID || self.table_id == 0)
    }

    fn sane(&self) -> bool {
        all_finite([self.pitch_rad, self.best_alpha_rad, self.best_pitch_rad, self.flattest_rad])
    }
}

/// Angle of attack, speed and path angle as believed; for the trace and for the watch on performance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Estimate {
    /// α, rad, positive when the flow comes from below (dive).
    pub(crate) alpha_rad: f32,
    /// Speed through the water, m/s.
    pub(crate) speed_m_s: f32,
    /// Path angle, rad, up positive.
    pub(crate) gamma_rad: f32,
}

impl Estimate {
    /// One Newton step of |θ| + α = γ(α), warm-started; speed from the depth
    /// rate. Quasi-steady: in a turn the last values fade.
    pub(crate) fn advance(&mut self, table: Option<&Table<'_>>, dt_s: f32, pitch_rad: Option<f32>, rate_m_s: f32, steady_now: bool) {
        if !all_finite([self.alpha_rad, self.speed_m_s, self.gamma_rad]) {
            *self = Self::default();
        }
        let (Some(table), Some(pitch)) = (table, pitch_rad) else { return };
        let down = rate_m_s > 0.0;
        let side = if down { 1.0 } else { -1.0 };
        let theta = -pitch * side;
        let alpha = (self.alpha_rad * side).at_least(0.01).at_most(table.best_alpha_rad().at_least(0.02));
        let c = table.at(alpha);
        if !(c.cl > 1e-5 && c.cd > 1e-6) {
            return;
        }
        let gamma = atan(c.cd / c.cl);
        // Fixed point α ← C_D / (C_L/α · tan(θ+α)): C_L/α is nearly constant, converges in 2..4 steps.
        let path = (theta + alpha).at_least(0.05).at_most(0.9);
        let next = c.cd / (c.cl / alpha * tan(path));
        let next = 0.5 * (alpha + next.at_least(0.005).at_most(table.alpha_max_rad()));
        self.alpha_rad = next * side;
        self.gamma_rad = -side * if steady_now { path } else { gamma.at_most(path) };
        let sin = { tan(path) / sqrt(1.0 + tan(path) * tan(path)) };
        let speed = (rate_m_s.abs() / sin.at_least(0.05)).at_most(2.0);
        let share = if steady_now { 1.0 } else { dt_s / (dt_s + 15.0) };
        self.speed_m_s += (speed - self.speed_m_s) * share;
    }
}

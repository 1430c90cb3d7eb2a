//! Which pitch to fly for a goal, and what glide a measured pitch means.
//!
//! Steady glide over a polar C_L(α), C_D(α) (all angles as magnitudes):
//! ```text
//! tan γ = C_D / C_L          γ glide angle below (dive) or above (climb) the horizon
//! |θ|   = γ − α              θ pitch
//! U²    = 2 B / (ρ S √(C_L² + C_D²))        B net buoyancy, N
//! ```
//! At (L/D)max dγ/dα = 0, so pitch falls one for one with α there; past it the
//! pitch has a minimum (dγ/dα = 1) below which no steady glide exists: the
//! vehicle falls flat. No pitch is aimed at where it answers less than half of
//! a change of α.
//!
//! The polar is the table as the flight has corrected it ([`crate::belief`]).
//! The first pitch is that of a vehicle whose C_D/C_L is worse than the table's
//! by [`crate::Settings::table_uncertainty`]; once two pairs were measured it goes
//! flatter, slowly, and steeper at once. Each glide begins steeper for some
//! seconds: from rest the flow has to come to the wings first, and at the best
//! pitch a vehicle may fall flat as steadily as it glides. Where the band leaves
//! room, the way round the first deep turns is flown steeper too (a lesson).
//!
//! The search over α takes one point per cycle of steady glide, over and over:
//! so one step stays cheap and what was learned is used within a minute.

use crate::angle::{atan, sqrt};
use crate::belief::{Belief, Steady};
use crate::bound::{Bound, all_finite};
use crate::config::Config;
use polar::Table;
use signals::{Goal, Leg};

/// Points of the search in α.
const GRID: u8 = 16;
/// First and last α of the search over that of the table's (L/D)max.
const SPAN: (f32, f32) = (0.2, 1.7);
/// Least answer of pitch to α (1 − dγ/dα) at which a pitch is aimed.
const AIMED_ANSWER_MIN: f32 = 0.5;
/// Flatter by at most this per measurement, rad (1.7°).
const FLATTEN_RAD: f32 = 0.03;
/// Flatter than the table's best glide by at most this, rad (2.5°): farther the table is not to be corrected but replaced.
const BEYOND_RAD: f32 = 0.044;
/// Steeper by this, up to that, when the wings have let go, rad (2°, 26°).
const RETREAT_RAD: f32 = 0.035;
const RETREAT_MAX_RAD: f32 = 0.4538;
/// Steeper by this in a lesson, rad (5°): there the drag level shows, apart from lift.
const LESSON_RAD: f32 = 0.087;
/// Pairs after which the pitch may go flatter than at first: a steep and a flat one.
const FIRM_PAIRS: u8 = 2;
/// Dives of the mission in which a lesson may be.
const LESSONS: u16 = 3;
/// Dives of the mission, from 0, that are flown steeper all the way where drag without lift and drag due to lift are learned apart, and
/// by how much, rad (8°).
const STEEP_DIVES: core::ops::RangeInclusive<u16> = 1..=2;
const STEEP_DIVE_RAD: f32 = 0.14;
/// Steepest and flattest pitch that is ever aimed at, rad.
pub(crate) const PITCH_RANGE: core::ops::RangeInclusive<f32> = 0.05..=0.75;
/// C_D/C_L learned over that of the table from which on the vehicle counts as degraded (fouling, kelp, a bent wing), 1.
const DEGRADED: f32 = 1.2;
/// Pump: volume × pressure over this, guess from small piston pumps.
const PUMP_EFFICIENCY: f32 = 0.5;
/// Gauge pressure of a hull's vacuum, Pa: 7 inHg, against which the pump works at the surface.
const SUCTION_PA: f32 = 23_700.0;
/// Power of a running pump (motor and valves) besides its hydraulic work, W, at this rate, m³/s; it grows with the eighth root of the
/// rate: 8, 10 and 11 W at 4, 13 and 32 cm³/s. Guess.
const PUMP_W: (f32, f32) = (8.3, 4e-6);
/// Power of the motor of the battery mass while it runs, W. Guess.
const MASS_W: f32 = 2.0;
/// Way of the battery mass in one turn, m: between the places of a dive and a climb of 25°, and the way there.
const MASS_WAY_M: f32 = 0.02;
/// Time of a turn besides its pump's in which the vehicle makes hardly any way, s: its entry.
const TURN_S: f32 = 20.0;

/// Energy that pump and battery mass take for one dive and climb, J.
#[must_use]
pub fn dive_j(config: &Config, leg: &Leg) -> f32 {
    let moved_m3 = 2.0 * leg.ballast_m3;
    let pump_s = moved_m3 / config.pump_rate_m3_s;
    let running_w = PUMP_W.0 * sqrt(sqrt(sqrt(config.pump_rate_m3_s / PUMP_W.1)));
    let work_j = moved_m3 * (1025.0 * 9.81 * leg.depth_max_m + SUCTION_PA) / PUMP_EFFICIENCY;
    // Out at the lower turn, in at the upper one.
    work_j + 2.0 * (running_w * pump_s + MASS_W * MASS_WAY_M / config.battery_rate_m_s)
}

/// What is gained at one angle of attack; larger is better.
fn worth(config: &Config, leg: &Leg, s: &Steady) -> f32 {
    if let Goal::BestGlide | Goal::FixedPitch { .. } = leg.goal {
        return -s.tan_gamma;
    }
    let speed_m_s = s.speed_m_s();
    let sink_m_s = (speed_m_s * s.sin_gamma).at_least(1e-3);
    match leg.goal {
        Goal::BestGlide | Goal::FixedPitch { .. } | Goal::BestSpeed => speed_m_s * s.cos_gamma,
        Goal::Current { along_track_m_s } => {
            let ground = speed_m_s * s.cos_gamma + along_track_m_s;
            // Against a stronger current: lose as little ground per time as can be.
            if ground > 0.0 { ground / sink_m_s } else { ground }
        }
        Goal::BestRange { hotel_w } => {
            let way_m = 2.0 * (leg.depth_max_m - leg.depth_min_m).at_least(1.0);
            let turns_s = 2.0 * (2.0 * leg.ballast_m3 / config.pump_rate_m3_s + TURN_S);
            way_m / s.tan_gamma / (dive_j(config, leg) + hotel_w * (way_m / sink_m_s + turns_s))
        }
    }
}

/// Depth rate of the steady glide at a pitch (magnitude) with a ballast volume, m/s, by the table as it is: what flight has taught
/// may itself come of a load. Bisection in α, with which the pitch falls; flatter than the flattest glide it is that one's.
pub(crate) fn table_rate_m_s(table: &Table<'_>, pitch_rad: f32, ballast_m3: f32) -> Option<f32> {
    let as_it_is = Belief::of(table);
    let (mut low, mut high) = (0.005, table.best_alpha_rad() * 1.5);
    for _ in 0..8 {
        let middle = 0.5 * (low + high);
        let s = as_it_is.steady(table, middle, ballast_m3)?;
        if s.gamma_rad() - middle > pitch_rad { low = middle } else { high = middle }
    }
    let s = as_it_is.steady(table, high, ballast_m3)?;
    Some(s.speed_m_s() * s.sin_gamma)
}

/// By how much steeper than the best pitch is flown to learn from it, rad; `now`: at a glide's beginning and in a lesson.
pub(crate) fn steeper_rad(config: &Config, leg: &Leg, dives: u16, now: bool) -> f32 {
    if config.learns_levels && leg.goal == Goal::BestGlide && STEEP_DIVES.contains(&dives) {
        STEEP_DIVE_RAD
    } else if now {
        LESSON_RAD
    } else {
        0.0
    }
}

/// The pitch magnitude for a leg, and what it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Choice {
    pub(crate) belief: Belief,
    leg: Option<u8>,
    table_id: u32,
    /// Points of the search under way that were looked at.
    next: u8,
    best: f32,
    best_pitch_rad: f32,
    best_tan_gamma: f32,
    pitch_rad: f32,
    /// Not flatter than this: the wings let go there, or it is too far from the table, rad.
    flattest_rad: f32,
    preset: bool,
    fixed: bool,
    degraded: bool,
}

impl Default for Choice {
    fn default() -> Self {
        Self {
            belief: Belief::default(),
            leg: None,
            table_id: 0,
            next: 0,
            best: f32::MIN,
            best_pitch_rad: 0.0,
            best_tan_gamma: 0.0,
            pitch_rad: 0.0,
            flattest_rad: 0.0,
            preset: true,
            fixed: false,
            degraded: false,
        }
    }
}

impl Choice {
    /// Keeps up with leg and table; nearly nothing to do in most cycles.
    pub(crate) fn follow(&mut self, config: &Config, table: Option<&Table<'_>>, id: u32, number: u8, leg: &Leg) {
        if self.leg == Some(number)
            && self.table_id == id
            && all_finite([self.pitch_rad, self.flattest_rad, self.best, self.best_pitch_rad])
        {
            return;
        }
        self.begin(config, table, id, number, leg);
    }

    #[cold]
    #[inline(never)]
    fn begin(&mut self, config: &Config, table: Option<&Table<'_>>, id: u32, number: u8, leg: &Leg) {
        // Between legs: the last pitch until the search is through. A new table: nothing is known of it.
        let last = if PITCH_RANGE.contains(&self.pitch_rad) && !self.preset { self.pitch_rad } else { 0.0 };
        if self.table_id != id {
            self.belief.reset(table, config.learns_levels);
            self.flattest_rad = 0.0;
        }
        (self.leg, self.table_id) = (Some(number), id);
        (self.next, self.best, self.best_pitch_rad) = (0, f32::MIN, 0.0);
        (self.preset, self.fixed) = (false, false);
        match (leg.goal, table) {
            (Goal::FixedPitch { pitch_rad }, _) => {
                self.fixed = true;
                self.pitch_rad = pitch_rad.at_least(*PITCH_RANGE.start()).at_most(*PITCH_RANGE.end());
            }
            (_, Some(_)) if last > 0.0 => self.pitch_rad = last,
            (_, Some(table)) => {
                let alpha = table.best_alpha_rad();
                self.flattest_rad = atan(1.0 / table.best_l_over_d()) - alpha - BEYOND_RAD;
                self.pitch_rad = (atan(config.table_uncertainty / table.best_l_over_d()) - alpha * config.alpha_share)
                    .at_least(*PITCH_RANGE.start())
                    .at_most(config.preset_pitch_rad);
            }
            (_, None) => {
                self.preset = true;
                self.pitch_rad = config.preset_pitch_rad;
            }
        }
    }

    /// One cycle of steady glide: looks at one more point.
    #[inline(never)]
    pub(crate) fn search(&mut self, config: &Config, table: &Table<'_>, leg: &Leg, dives: u16) {
        if self.fixed || self.preset || self.next >= GRID {
            return;
        }
        let step = (SPAN.1 - SPAN.0) / f32::from(GRID - 1);
        let alpha = table.best_alpha_rad() * (SPAN.0 + step * f32::from(self.next));
        self.next = self.next.saturating_add(1);
        if let Some(s) = self.belief.steady(table, alpha.at_most(table.alpha_max_rad()), leg.ballast_m3.at_least(20e-6)) {
            let value = worth(config, leg, &s);
            if value > self.best && s.answer() > AIMED_ANSWER_MIN {
                let pitch_rad = s.gamma_rad() - s.alpha_rad;
                if PITCH_RANGE.contains(&pitch_rad) {
                    self.best = value;
                    // A little on the side away from the stall, where it is near and the table is all that is known of it.
                    let known = config.learns_levels && dives >= *STEEP_DIVES.start();
                    let flat = !known && (leg.goal == Goal::BestGlide || pitch_rad <= self.steep_rad());
                    let margin_rad = if flat { s.alpha_rad * (1.0 - config.alpha_share) } else { 0.0 };
                    self.best_pitch_rad = pitch_rad + margin_rad;
                    self.best_tan_gamma = s.tan_gamma;
                }
            }
        }
    }

    /// A measurement is complete: the pitch found by the search over it is flown.
    #[cold]
    #[inline(never)]
    pub(crate) fn settle(&mut self, config: &Config, table: &Table<'_>, leg: &Leg) {
        // A fixed or preset pitch is never searched for.
        if self.next < GRID {
            return;
        }
        if self.best > f32::MIN {
            let steepest = match leg.goal {
                // No known glider glides best steeper than the stock preset; a table that says so is not believed that far.
                Goal::BestGlide => config.preset_pitch_rad,
                _ => *PITCH_RANGE.end(),
            };
            let flatter = if self.belief.pairs() >= FIRM_PAIRS { FLATTEN_RAD } else { 0.0 };
            self.pitch_rad = self.best_pitch_rad.at_least(self.pitch_rad - flatter).at_least(self.flattest_rad).at_most(steepest);
            self.degraded = leg.goal == Goal::BestGlide && self.best_tan_gamma * table.best_l_over_d() > DEGRADED;
        }
        self.next = 0;
        self.best = f32::MIN;
    }

    /// The wings have let go at the pitch flown, or no such glide is believed in: steeper, and not that flat again.
    #[cold]
    pub(crate) fn retreat(&mut self) {
        self.flattest_rad = (self.pitch_rad + RETREAT_RAD).at_most(RETREAT_MAX_RAD);
        self.pitch_rad = self.flattest_rad.at_least(self.pitch_rad);
    }

    /// Whether a lesson is due: the table is not confirmed yet and the goal leaves the pitch to be chosen.
    pub(crate) fn wants_lesson(&self, dives: u16) -> bool {
        !self.fixed && !self.preset && dives < LESSONS && self.belief.pairs() < FIRM_PAIRS
    }

    /// |pitch| to fly, rad.
    pub(crate) fn pitch_rad(&self, config: &Config, steeper_rad: f32) -> f32 {
        let pitch = if PITCH_RANGE.contains(&self.pitch_rad) { self.pitch_rad } else { config.preset_pitch_rad };
        if steeper_rad > 0.0 && !self.fixed { (pitch + steeper_rad).at_most(*PITCH_RANGE.end()) } else { pitch }
    }

    /// The pitch is steeper than the table's best glide by enough for the flow to come to the wings by itself.
    pub(crate) fn is_steep(&self) -> bool {
        self.pitch_rad > self.steep_rad()
    }

    fn steep_rad(&self) -> f32 {
        self.flattest_rad + BEYOND_RAD + RETREAT_RAD
    }

    /// The pitch is the preset: no table, or none that can be used.
    pub(crate) fn is_preset(&self) -> bool {
        self.preset
    }

    /// The flight says that the vehicle's best glide is worse than the table's by more than its uncertainty.
    pub(crate) fn is_degraded(&self) -> bool {
        self.degraded
    }
}

/// Angle of attack, speed and path angle as believed, for the trace.
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
    /// One Newton step of γ(α) − α = |θ|, started at the last α; speed from the
    /// depth rate. Quasi-steady: in a turn the last values fade. Answers the
    /// steady glide that belongs to the pitch.
    pub(crate) fn advance(
        &mut self,
        table: &Table<'_>,
        belief: &Belief,
        dt_s: f32,
        pitch_rad: f32,
        rate_m_s: f32,
        ballast_m3: f32,
        steady_now: bool,
    ) -> Option<Steady> {
        if !all_finite([self.alpha_rad, self.speed_m_s, self.gamma_rad]) {
            *self = Self::default();
        }
        let side = if rate_m_s > 0.0 { 1.0 } else { -1.0 };
        let theta = -pitch_rad * side;
        let most = (table.best_alpha_rad() * SPAN.1).at_most(table.alpha_max_rad());
        let alpha = (self.alpha_rad * side).at_least(0.01).at_most(most);
        let mut now = belief.steady(table, alpha, ballast_m3.abs().at_least(20e-6))?;
        let gamma_rad = now.gamma_rad();
        let change = (gamma_rad - alpha - theta) / now.answer().at_least(0.3);
        let next = (alpha + change.at_least(-0.02).at_most(0.02)).at_least(0.01).at_most(most);
        self.alpha_rad = next * side;
        let path = (theta + next).at_least(0.05).at_most(0.9);
        self.gamma_rad = -side * if steady_now { path } else { gamma_rad.at_most(path) };
        let speed = (rate_m_s.abs() / now.sin_gamma.at_least(0.05)).at_most(2.0);
        let share = if steady_now { 1.0 } else { dt_s / (dt_s + 15.0) };
        self.speed_m_s += (speed - self.speed_m_s) * share;
        // Not there yet, or no such glide: nothing to compare with.
        now.alpha_rad = alpha;
        (change.abs() < 0.01).then_some(now)
    }
}

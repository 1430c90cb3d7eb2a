//! The forward model: unsteady motion in the vertical plane, driven by measured pitch, ballast and water.
//!
//! Body axes, u along the body, n across it and up, both relative to the water; q = dθ/dt (FORMAT section 3):
//! ```text
//! m(1+k1) du/dt = F_u + q m(1+k2) n        F_u = −D cos α + L sin α + B sin θ
//! m(1+k2) dn/dt = F_n − q m(1+k1) u        F_n =  L cos α + D sin α + B cos θ
//! α = atan2(−n, u)    w = −(u sin θ + n cos θ)   (positive down)
//! ```
//! Fourth order on a fixed grid, exponential across the hull ([`crate::model::integrator`]). Afloat (observed depth below [`crate::preprocess::FLOAT_M`] and buoyant) the
//! vehicle is held at rest.
//! Water motion shifts depth but not the forces: it is slow against the vehicle's own time scales.

use crate::preprocess::{Input, Run};
use hydro::effects::{Active, Beyond, Constants, ForceModel, Place, Sensed};
use std::borrow::Cow;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// What the model says at the rows of a run.
#[derive(Clone, Debug, Default)]
pub struct Track {
    /// Depth of the model since the first row, m (water motion and pressure error included).
    pub depth_m: Vec<f64>,
    /// Vertical velocity, m/s, positive down (water motion included).
    pub sink_m_s: Vec<f64>,
    /// Speed through the water, m/s.
    pub speed_m_s: Vec<f64>,
    /// Angle of attack, rad.
    pub alpha_rad: Vec<f64>,
    /// Way made through the water and with the current, (east, north), m.
    pub displacement_m: (f64, f64),
    /// Half steps that it took.
    pub half_steps: u64,
}

/// Cosine of the roll from which no glider turns: 60 degrees, beyond which a reading is of something else.
const STEEPEST_TURN: f64 = 0.5;

/// What drives the vehicle at one half step of the grid.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    pub(crate) buoyancy_n: f64,
    /// ½ ρ S.
    pub(crate) dynamic: f64,
    pub(crate) sin_pitch: f64,
    pub(crate) cos_pitch: f64,
    pub(crate) rate: f64,
    pub(crate) roll: f64,
    pub(crate) temperature: f64,
    /// What a bank leaves of lift in the vertical plane.
    pub(crate) upright: f64,
    /// Cosine of the roll of a body that turns as it banks; 1 where the model knows no such turn.
    pub(crate) level: f64,
}

/// α = atan2(−n, u), rad. Near the axis, where a glider nearly always flies, by a polynomial (least squares on Chebyshev points of
/// tan²α in 0..0.16, error below 2e-13 rad): the arc tangent was a sixth of the time of a fit.
pub(crate) fn angle_of_attack(u: f64, n: f64) -> f64 {
    if u <= 0.0 || n.abs() > 0.4 * u {
        return (-n).atan2(u);
    }
    small_angle(u, n)
}

/// The polynomial of [`angle_of_attack`], of one vehicle or of several side by side.
pub(crate) fn small_angle<T>(u: T, n: T) -> T
where
    T: Copy + From<f64> + Neg<Output = T> + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Div<Output = T>,
{
    let c = T::from;
    let x = -n / u;
    let s = x * x;
    let low =
        (c(0.999_999_999_999_566_6) - c(0.333_333_332_983_024) * s) + s * s * (c(0.199_999_953_476_835) - c(0.142_854_779_522_801_7) * s);
    let high = (c(0.111_051_768_035_459_4) - c(0.090_090_542_909_586_4) * s)
        + s * s * (c(0.070_522_572_057_953_97) - c(0.039_098_735_521_716_9) * s);
    x * (low + s * s * s * s * high)
}

/// Sine and cosine: up to 0.25 rad by their series, within 1e-15.
fn sin_cos_of_small(x: f64) -> (f64, f64) {
    if x.abs() > 0.25 {
        return x.sin_cos();
    }
    let s = x * x;
    let sin = 1.0 + s * (-1.0 / 6.0 + s * (1.0 / 120.0 + s * (-1.0 / 5040.0 + s * (1.0 / 362_880.0 - s * (1.0 / 39_916_800.0)))));
    let cos = 1.0 + s * (-0.5 + s * (1.0 / 24.0 + s * (-1.0 / 720.0 + s * (1.0 / 40_320.0 - s * (1.0 / 3_628_800.0)))));
    (x * sin, cos)
}

/// A run of a flight under a law: what is simulated.
#[derive(Clone, Debug)]
pub struct Job<'a> {
    /// The run.
    pub run: &'a Run,
    /// Nominal constants.
    pub constants: Constants,
    /// Effects that are on.
    pub effects: Cow<'a, [Active]>,
    /// From when to when the flow is known to attach, s: the angle of attack stays where the law is good.
    pub attached: &'a [(f64, f64)],
    /// Time by which pitch, roll and ballast are logged later than the pressure of the same instant, s.
    pub clock_s: f64,
}

impl Job<'_> {
    /// Whether the points of another job are this one's too: the same run, volume and sensors.
    pub(crate) fn shares_points(&self, other: &Self) -> bool {
        std::ptr::eq(self.run, other.run)
            && self.clock_s == other.clock_s
            && self.constants_of_points() == other.constants_of_points()
            && same(self.effects_on_points(), other.effects_on_points())
    }

    /// The constants that points depend on, effects included.
    fn constants_of_points(&self) -> Constants {
        Constants {
            lift_slope_per_rad: 0.0,
            lift_quadratic_per_rad2: 0.0,
            cd0: 0.0,
            induced_k: 0.0,
            hull_drag_per_rad2: 0.0,
            slope_loss_per_rad2: 0.0,
            hull_drag_per_rad3: 0.0,
            added_mass_surge: 0.0,
            added_mass_heave: 0.0,
            beyond: Beyond::default(),
            ..ForceModel::new(self.constants, &self.effects).constants
        }
    }

    fn effects_on_points(&self) -> impl Iterator<Item = &Active> {
        self.effects.iter().filter(|a| a.effect.sensed.is_some() || a.effect.volume_m3.is_some())
    }

    /// Whether another job is the same simulation.
    #[must_use]
    pub fn is(&self, other: &Self) -> bool {
        std::ptr::eq(self.run, other.run)
            && self.clock_s == other.clock_s
            && self.constants == other.constants
            && same(self.effects.iter(), other.effects.iter())
    }
}

fn same<'a>(a: impl Iterator<Item = &'a Active>, b: impl Iterator<Item = &'a Active>) -> bool {
    let key = |a: &Active| (std::ptr::from_ref(a.effect).cast::<()>(), a.effect.name, a.values);
    a.map(key).eq(b.map(key))
}

/// What the sensors of a run say, made true: the inputs of the simulation at half steps of the grid.
pub(crate) fn points(run: &Run, model: &ForceModel, clock_s: f64) -> Vec<Point> {
    let input = |j: usize| if clock_s == 0.0 { run.inputs[j] } else { on_the_clock_of_pressure(run, clock_s, j) };
    let area = model.constants.reference_area_m2;
    let pitch_slope = |s: Sensed| (model.truth(Sensed { pitch_rad: s.pitch_rad + 1e-3, ..s }).pitch_rad - model.truth(s).pitch_rad) / 1e-3;
    let affine = model.pitch_is_affine();
    let slope = if run.inputs.is_empty() { 1.0 } else { pitch_slope(input(0).sensed) };
    // One by one: a copy of all inputs is as large as what is made of them.
    let point = |j: usize| {
        let i = input(j);
        let true_now = model.truth(i.sensed);
        let (sin_pitch, cos_pitch) = i.turned(true_now.pitch_rad);
        let mut rate = i.pitch_rate_rad_s;
        if true_now.pitch_rad != i.sensed.pitch_rad {
            rate *= if affine { slope } else { pitch_slope(i.sensed) };
        }
        let level = 1.0 - model.constants.banked_turn * (1.0 - i.cos_roll.max(STEEPEST_TURN));
        Point {
            buoyancy_n: model.net_buoyancy_n(&true_now),
            dynamic: 0.5 * true_now.density_kg_m3 * area,
            sin_pitch,
            cos_pitch,
            rate: rate * level,
            roll: i.roll_rad,
            temperature: true_now.temperature_degc,
            upright: 1.0 - model.constants.bank_tilt * (1.0 - i.cos_roll),
            level,
        }
    };
    (0..run.inputs.len()).map(point).collect()
}

/// The input of a run at half step `j` with pitch, roll and ballast as they were at the instant of the pressure, where they are logged so
/// much later.
fn on_the_clock_of_pressure(run: &Run, clock_s: f64, j: usize) -> Input {
    let all = &run.inputs;
    let last = all.len() - 1;
    let x = (j as f64 + clock_s / (0.5 * run.step_s)).clamp(0.0, last as f64);
    let k = (x as usize).min(last.saturating_sub(1));
    let (a, b, f) = (&all[k], &all[(k + 1).min(last)], x - k as f64);
    let mix = |pick: fn(&Input) -> f64| pick(a) + f * (pick(b) - pick(a));
    let mut now = all[j];
    now.sensed.pitch_rad = mix(|i| i.sensed.pitch_rad);
    (now.sin_pitch, now.cos_pitch) = all[j].turned(now.sensed.pitch_rad);
    now.pitch_rate_rad_s = mix(|i| i.pitch_rate_rad_s);
    now.sensed.ballast_m3 = mix(|i| i.sensed.ballast_m3);
    now.roll_rad = mix(|i| i.roll_rad);
    now.cos_roll = mix(|i| i.cos_roll);
    now
}

impl Input {
    /// Sine and cosine of a pitch near the measured one.
    pub(crate) fn turned(&self, pitch_rad: f64) -> (f64, f64) {
        let off = pitch_rad - self.sensed.pitch_rad;
        if off == 0.0 {
            return (self.sin_pitch, self.cos_pitch);
        }
        let (sin, cos) = sin_cos_of_small(off);
        (self.sin_pitch * cos + self.cos_pitch * sin, self.cos_pitch * cos - self.sin_pitch * sin)
    }
}

/// What the water's own motion, the pressure sensor and a current add, at the measured depth and by the water's own clock.
pub(crate) fn add_water(out: &mut Track, run: &Run, model: &ForceModel, gravity_m_s2: f64, water_depth_m: f64) {
    // Waves that are effects of a vehicle file have no known phase.
    let phase_rad = 0.0;
    let mut shift = 0.0;
    let mut before = (0.0, f64::NAN);
    let rows = if model.acts_on_depth() { out.depth_m.len() } else { 0 };
    for i in 0..rows {
        let time_s = run.time_s[i];
        let depth_m = run.depth_at_row(i, gravity_m_s2);
        let up = model.water_up_m_s(&Place { time_s, depth_m, water_depth_m, phase_rad });
        if i > 0 {
            shift -= 0.5 * (up + before.0) * (time_s - before.1);
        }
        before = (up, time_s);
        out.depth_m[i] += shift + model.pressure_error_pa(time_s) / (1000.0 * gravity_m_s2);
        out.sink_m_s[i] -= up;
    }
    let (east, north) = model.current_m_s();
    if run.displacement_s.is_finite() {
        out.displacement_m.0 += east * run.displacement_s;
        out.displacement_m.1 += north * run.displacement_s;
    }
}

/// By how much a pressure port so far ahead of the centre is deeper than it at a row, m.
pub(crate) fn port_shift_m(run: &Run, row: usize, port_m: f64) -> f64 {
    if port_m == 0.0 { 0.0 } else { -port_m * run.input_at_row(row, 0.25 * run.step_s).sin_pitch }
}

/// The depth of a track as a pressure port so far ahead of the centre sees it.
pub(crate) fn see_from_port(run: &Run, track: &mut Track, port_m: f64) {
    if port_m != 0.0 {
        track.depth_m.iter_mut().enumerate().for_each(|(row, d)| *d += port_shift_m(run, row, port_m));
    }
}

impl Run {
    /// Observed depth of a row with gaps filled, m.
    #[must_use]
    pub fn depth_at_row(&self, row: usize, gravity_m_s2: f64) -> f64 {
        if self.depth_m[row].is_finite() { self.depth_m[row] } else { self.pressure_pa[row] / (1015.0 * gravity_m_s2) }
    }

    /// The inputs so long after a row (before it, if negative): the last half step begun by then.
    #[must_use]
    pub fn input_at_row(&self, row: usize, ahead_s: f64) -> &Input {
        let half_steps = ((self.time_s[row] - self.time_s[0] + ahead_s).max(0.0) / (0.5 * self.step_s)) as usize;
        &self.inputs[half_steps.min(self.inputs.len() - 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::{angle_of_attack, sin_cos_of_small};

    #[test]
    fn accuracy_sine_and_cosine_of_small_angles_to_1e_15() {
        for i in -400..=400 {
            let x = f64::from(i) * 1e-3;
            let (sin, cos) = sin_cos_of_small(x);
            assert!((sin - x.sin()).abs() < 1e-15 && (cos - x.cos()).abs() < 1e-15, "{x}");
        }
    }

    #[test]
    fn accuracy_angle_of_attack_is_the_arc_tangent_to_2e_13_rad_on_every_side() {
        for i in 0..=2000 {
            let angle = (f64::from(i) - 1000.0) * 1e-3 * std::f64::consts::PI;
            let (u, n) = (0.3 * angle.cos(), -0.3 * angle.sin());
            let (ours, exact) = (angle_of_attack(u, n), (-n).atan2(u));
            assert!((ours - exact).abs() < 2e-13, "{angle}: {ours} {exact}");
        }
    }
}

//! The forward model: unsteady motion in the vertical plane, driven by measured pitch, ballast and water.
//!
//! Body axes, u along the body, n across it and up, both relative to the water; q = dθ/dt (FORMAT section 3):
//! ```text
//! m(1+k1) du/dt = F_u + q m(1+k2) n        F_u = −D cos α + L sin α + B sin θ
//! m(1+k2) dn/dt = F_n − q m(1+k1) u        F_n =  L cos α + D sin α + B cos θ
//! α = atan2(−n, u)    w = −(u sin θ + n cos θ)   (positive down)
//! ```
//! Classical Runge–Kutta on a fixed grid. Afloat (observed depth below [`FLOAT_M`] and buoyant) the vehicle is held at rest.
//! Water motion shifts depth but not the forces: it is slow against the vehicle's own time scales.

use crate::prepare::{FLOAT_M, Run};
use hydro::effects::{Active, Constants, Continuation, Flow, ForceModel, Place, Sensed};

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
}

#[derive(Clone, Copy)]
struct Point {
    buoyancy_n: f64,
    dynamic: f64,
    sin_pitch: f64,
    cos_pitch: f64,
    rate: f64,
    roll: f64,
    time: f64,
    temperature: f64,
}

/// α = atan2(−n, u), rad. Near the axis, where a glider nearly always flies, by a polynomial (least squares on Chebyshev points of
/// tan²α in 0..0.16, error below 2e-13 rad): the arc tangent was a sixth of the time of a fit.
pub(crate) fn angle_of_attack(u: f64, n: f64) -> f64 {
    if u <= 0.0 || n.abs() > 0.4 * u {
        return (-n).atan2(u);
    }
    let x = -n / u;
    let s = x * x;
    let low = (0.999_999_999_999_566_6 - 0.333_333_332_983_024 * s) + s * s * (0.199_999_953_476_835 - 0.142_854_779_522_801_7 * s);
    let high = (0.111_051_768_035_459_4 - 0.090_090_542_909_586_4 * s) + s * s * (0.070_522_572_057_953_97 - 0.039_098_735_521_716_9 * s);
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

struct Body<'a> {
    model: &'a ForceModel<'a>,
    surge_kg: f64,
    heave_kg: f64,
}

impl Body<'_> {
    fn rates(&self, p: &Point, u: f64, n: f64) -> (f64, f64, f64) {
        let speed = (u * u + n * n).sqrt();
        let sink = -(u * p.sin_pitch + n * p.cos_pitch);
        let (mut along, mut across) = (p.buoyancy_n * p.sin_pitch, p.buoyancy_n * p.cos_pitch);
        if speed > 1e-6 {
            let f = self.model.coefficients(&Flow {
                alpha_rad: angle_of_attack(u, n),
                speed_m_s: speed,
                roll_rad: p.roll,
                climb_m_s: -sink,
                time_s: p.time,
                temperature_degc: p.temperature,
            });
            let pressure = p.dynamic * speed;
            let (lift, drag) = (pressure * f.cl, pressure * f.cd);
            // With cos α = u/U and sin α = −n/U.
            along += -drag * u - lift * n;
            across += lift * u - drag * n;
        }
        let du = (along + p.rate * self.heave_kg * n) / self.surge_kg;
        let dn = (across - p.rate * self.surge_kg * u) / self.heave_kg;
        (du, dn, sink)
    }
}

/// Runs the model over one run of a flight. `beyond` is how lift goes on beyond the valid angle of attack.
#[must_use]
pub fn track(run: &Run, nominal: Constants, effects: &[Active], water_depth_m: f64, beyond: Continuation) -> Track {
    // Waves that are effects of a vehicle file have no known phase.
    let phase_rad = 0.0;
    let model = ForceModel::new(nominal, effects).continued(beyond);
    let mass = nominal.mass_kg;
    let body = Body {
        model: &model,
        surge_kg: mass * (1.0 + model.constants.added_mass_surge).max(0.02),
        heave_kg: mass * (1.0 + model.constants.added_mass_heave).max(0.02),
    };
    let area = model.constants.reference_area_m2;
    let pitch_slope = |s: Sensed| (model.truth(Sensed { pitch_rad: s.pitch_rad + 1e-3, ..s }).pitch_rad - model.truth(s).pitch_rad) / 1e-3;
    let affine = model.pitch_is_affine();
    let slope = run.inputs.first().map_or(1.0, |i| pitch_slope(i.sensed));
    let points: Vec<Point> = run
        .inputs
        .iter()
        .map(|i| {
            let true_now = model.truth(i.sensed);
            let (mut sin_pitch, mut cos_pitch, mut rate) = (i.sin_pitch, i.cos_pitch, i.pitch_rate_rad_s);
            let off = true_now.pitch_rad - i.sensed.pitch_rad;
            if off != 0.0 {
                let (sin, cos) = sin_cos_of_small(off);
                (sin_pitch, cos_pitch) = (sin_pitch * cos + cos_pitch * sin, cos_pitch * cos - sin_pitch * sin);
                rate *= if affine { slope } else { pitch_slope(i.sensed) };
            }
            Point {
                buoyancy_n: model.net_buoyancy_n(&true_now),
                dynamic: 0.5 * true_now.density_kg_m3 * area,
                sin_pitch,
                cos_pitch,
                rate,
                roll: i.roll_rad,
                time: i.sensed.time_s,
                temperature: true_now.temperature_degc,
            }
        })
        .collect();

    let n_rows = run.time_s.len();
    let mut out = Track {
        depth_m: Vec::with_capacity(n_rows),
        sink_m_s: Vec::with_capacity(n_rows),
        speed_m_s: Vec::with_capacity(n_rows),
        alpha_rad: Vec::with_capacity(n_rows),
        displacement_m: (0.0, 0.0),
    };
    let h = run.step_s;
    let (mut u, mut n, mut z) = (run.start_speed_m_s, 0.0_f64, 0.0_f64);
    let mut row = 0;
    let steps = (points.len() - 1) / 2;
    for k in 0..steps {
        let (p0, p1, p2) = (&points[2 * k], &points[2 * k + 1], &points[2 * k + 2]);
        let t0 = p0.time;
        let afloat = p0.buoyancy_n >= 0.0 && run.inputs[2 * k].depth_m < FLOAT_M;
        let (u0, n0, z0) = (u, n, z);
        let mut sink0 = 0.0;
        if afloat {
            (u, n) = (0.0, 0.0);
        } else {
            let (a1, b1, c1) = body.rates(p0, u, n);
            let (a2, b2, c2) = body.rates(p1, u + 0.5 * h * a1, n + 0.5 * h * b1);
            let (a3, b3, c3) = body.rates(p1, u + 0.5 * h * a2, n + 0.5 * h * b2);
            let (a4, b4, c4) = body.rates(p2, u + h * a3, n + h * b3);
            sink0 = c1;
            u += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
            n += h / 6.0 * (b1 + 2.0 * b2 + 2.0 * b3 + b4);
            z += h / 6.0 * (c1 + 2.0 * c2 + 2.0 * c3 + c4);
            let i = &run.inputs[2 * k + 1];
            let horizontal = 0.5 * (u0 + u) * p1.cos_pitch - 0.5 * (n0 + n) * p1.sin_pitch;
            out.displacement_m.0 += h * horizontal * i.sin_heading;
            out.displacement_m.1 += h * horizontal * i.cos_heading;
        }
        let sink1 = if afloat { 0.0 } else { -(u * p2.sin_pitch + n * p2.cos_pitch) };
        while row < n_rows && run.time_s[row] < t0 + h {
            let x = ((run.time_s[row] - t0) / h).clamp(0.0, 1.0);
            let (x2, x3) = (x * x, x * x * x);
            // Cubic Hermite between grid points.
            out.depth_m.push(
                z0 * (2.0 * x3 - 3.0 * x2 + 1.0) + h * sink0 * (x3 - 2.0 * x2 + x) + z * (3.0 * x2 - 2.0 * x3) + h * sink1 * (x3 - x2),
            );
            out.sink_m_s.push(sink0 + (sink1 - sink0) * x);
            let (ur, nr) = (u0 + (u - u0) * x, n0 + (n - n0) * x);
            let speed = (ur * ur + nr * nr).sqrt();
            out.speed_m_s.push(speed);
            out.alpha_rad.push(if speed > 1e-6 { angle_of_attack(ur, nr) } else { 0.0 });
            row += 1;
        }
        if row == n_rows {
            break;
        }
    }
    if effects.is_empty() {
        return out;
    }
    // The water's own motion, at the measured depth and by its own clock.
    let mut shift = 0.0;
    let mut before = (0.0, f64::NAN);
    for i in 0..out.depth_m.len() {
        let time_s = run.time_s[i];
        let depth_m = run.depth_at_row(i, nominal.gravity_m_s2);
        let up = model.water_up_m_s(&Place { time_s, depth_m, water_depth_m, phase_rad });
        if i > 0 {
            shift -= 0.5 * (up + before.0) * (time_s - before.1);
        }
        before = (up, time_s);
        out.depth_m[i] += shift + model.pressure_error_pa(time_s) / (1000.0 * nominal.gravity_m_s2);
        out.sink_m_s[i] -= up;
    }
    let (east, north) = model.current_m_s(&Place { time_s: 0.0, depth_m: 0.0, water_depth_m, phase_rad });
    if run.displacement_s.is_finite() {
        out.displacement_m.0 += east * run.displacement_s;
        out.displacement_m.1 += north * run.displacement_s;
    }
    out
}

impl Run {
    /// Observed depth of a row with gaps filled, m.
    #[must_use]
    pub fn depth_at_row(&self, row: usize, gravity_m_s2: f64) -> f64 {
        if self.depth_m[row].is_finite() { self.depth_m[row] } else { self.pressure_pa[row] / (1015.0 * gravity_m_s2) }
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

//! Planned dives: the glide that follows from planned pitch and ballast by the vehicle's model, with drag and trim as the mission's own
//! steady glides have them.

use super::current::Vector;
use super::mission::Dive;
use crate::history::glide::Glider;
use crate::history::numbers::{BALLAST_OFFSET, DRAG_LEVEL, NUMBERS, Numbers};
use crate::history::rows::{Unit, median, units};
use crate::preprocess::dives::evenly;
use hydro::effects::{Constants, ForceModel, Sensed};
use hydro::glide::{GlideError, Trim, steady};
use logs::Vehicle;
use logs::record::flight::Flight;
use nalgebra::{Matrix2, Vector2};

/// A dive as it is ordered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Order {
    /// Size of the measured pitch, rad.
    pub pitch_rad: f64,
    /// Ballast drive to either side of neutral, m³.
    pub ballast_m3: f64,
    /// Shallow and deep turn, m.
    pub depth_m: [f64; 2],
    /// Heading, rad clockwise from north.
    pub heading_rad: f64,
}

/// A number with its standard deviation.
pub type WithError = (f64, f64);

/// Drag and trim of a mission's steady glides.
#[derive(Clone, Debug)]
pub struct Glides {
    units: Vec<Unit>,
    constants: Constants,
    /// Drag against the vehicle file's, -.
    pub drag_relative: WithError,
    /// Mass against the vehicle file's, kg.
    pub trim_kg: WithError,
}

/// Rows that are fitted, at most; steps of the fit.
const MOST_ROWS: usize = 600;
const FIT_STEPS: usize = 30;

impl Glides {
    /// Fits drag and trim to the vertical velocities of the steady rows, within the tolerances of the vehicle file.
    ///
    /// # Errors
    /// No segment glides steadily for long enough.
    pub fn of(flight: &Flight, vehicle: &Vehicle) -> Result<Self, String> {
        let mut units = units(flight);
        let rows: usize = units.iter().map(|u| u.rows.len()).sum();
        if rows == 0 {
            return Err("no dive of this flight glides steadily for long enough to learn drag and trim from".to_owned());
        }
        let blocks: usize = units.iter().map(Unit::blocks).sum();
        for u in &mut units {
            let kept = evenly(u.rows.len(), (MOST_ROWS * u.rows.len() / rows).max(4));
            u.rows = kept.into_iter().map(|k| u.rows[k]).collect();
        }
        let glider = Glider::of_units(vehicle, &units);
        let tolerance = [glider.tolerance[DRAG_LEVEL], glider.tolerance[BALLAST_OFFSET]];
        let rises = |drag: f64, trim: f64| -> Vec<f64> {
            let mut x = Numbers::zeros();
            (x[DRAG_LEVEL], x[BALLAST_OFFSET]) = (drag, trim);
            let x: [f64; NUMBERS] = glider.moved(&x);
            units.iter().flat_map(|u| glider.rises(u, &x)).collect()
        };
        let measured: Vec<f64> = units.iter().flat_map(|u| u.rows.iter().map(|r| r.rise_m_s)).collect();
        let (mut at, mut curvature) = (Vector2::zeros(), Matrix2::identity());
        for _ in 0..FIT_STEPS {
            const BY: f64 = 0.03;
            let here = rises(at[0], at[1]);
            let ahead = [rises(at[0] + BY, at[1]), rises(at[0], at[1] + BY)];
            let off: Vec<f64> = measured.iter().zip(&here).map(|(m, h)| m - h).collect();
            // Rows of a block share the water's motion: together they count as one.
            let spread = (1.4826 * median(off.iter().map(|o| o.abs()))).max(1e-4);
            let weight = blocks as f64 / measured.len() as f64 / (spread * spread);
            curvature = Matrix2::from_diagonal(&Vector2::new(tolerance[0].powi(-2), tolerance[1].powi(-2)));
            let mut slope = -curvature * at;
            for (k, off) in off.iter().enumerate() {
                let column = Vector2::new(ahead[0][k] - here[k], ahead[1][k] - here[k]) / BY;
                // Beyond three spreads a row pulls no stronger (Huber).
                let pull = (3.0 * spread / off.abs()).min(1.0);
                slope += column * (off * weight * pull);
                curvature += column * column.transpose() * (weight * pull);
            }
            let step = curvature.try_inverse().map_or(Vector2::zeros(), |inverse| inverse * slope);
            // No further than half a size of its number at once: beyond no buoyancy the model is flat.
            at += step * (0.5 / step.amax().max(0.5));
        }
        let scatter = curvature.try_inverse().unwrap_or_default();
        let of = |k: usize, number: usize| (at[k] * glider.sizes[number], scatter[(k, k)].sqrt() * glider.sizes[number]);
        let (drag, trim_kg) = (of(0, DRAG_LEVEL), of(1, BALLAST_OFFSET));
        let mut constants = vehicle.constants;
        constants.cd0 *= drag.0.exp();
        constants.mass_kg += trim_kg.0;
        Ok(Self { units, constants, drag_relative: (drag.0.exp() - 1.0, drag.0.exp() * drag.1), trim_kg })
    }

    /// Median size of the measured pitch of the steady glides, rad.
    #[must_use]
    pub fn usual_pitch_rad(&self) -> f64 {
        median(self.units.iter().flat_map(|u| u.rows.iter().map(|r| r.pitch_rad.abs())))
    }

    /// Median density and temperature near a depth (dbar are metres here), on the way down and up.
    fn water(&self, depth_m: f64) -> (f64, f64) {
        let rows = || self.units.iter().flat_map(|u| &u.rows);
        let nearest = rows().map(|r| (r.pressure_pa / 1e4 - depth_m).abs()).fold(f64::INFINITY, f64::min);
        let near = || rows().filter(|r| (r.pressure_pa / 1e4 - depth_m).abs() <= nearest + 10.0);
        (median(near().map(|r| r.density_kg_m3)), median(near().map(|r| r.temperature_degc)))
    }

    /// The dive that follows from an order.
    ///
    /// # Errors
    /// The vehicle does not glide so.
    pub fn dive(&self, order: &Order, vehicle: &Vehicle) -> Result<Dive, String> {
        /// Depths at which the glide is asked.
        const LEVELS: usize = 5;
        let law = ForceModel::new(self.constants, &vehicle.effects);
        let [top, bottom] = order.depth_m;
        let part_m = (bottom - top) / LEVELS as f64;
        let (mut time_s, mut way_m) = (0.0, 0.0);
        for k in 0..LEVELS {
            let depth_m = top + (k as f64 + 0.5) * part_m;
            let (density_kg_m3, temperature_degc) = self.water(depth_m);
            for sign in [-1.0, 1.0] {
                let truth = law.truth(Sensed {
                    time_s: 0.0,
                    pitch_rad: sign * order.pitch_rad,
                    ballast_m3: sign * order.ballast_m3,
                    density_kg_m3,
                    temperature_degc,
                    hull_degc: temperature_degc,
                    pressure_pa: depth_m * 1e4,
                });
                let net_buoyancy_n = law.net_buoyancy_n(&truth);
                let trim = Trim { pitch_rad: truth.pitch_rad, net_buoyancy_n, rho_kg_m3: density_kg_m3 };
                let glide = steady(&law, &trim).map_err(|e| {
                    let (pitch, cc) = (sign * order.pitch_rad.to_degrees(), sign * order.ballast_m3 * 1e6);
                    let why = if matches!(e, GlideError::TooFlat { .. }) { "too flat" } else { "no buoyancy that way" };
                    format!("with drag and trim as flown the vehicle does not glide at {depth_m:.0} m, {pitch:.0}°, {cc:.0} cc: {why}")
                })?;
                let part_s = part_m / glide.lowest.sink_m_s.abs();
                time_s += part_s;
                way_m += glide.lowest.horizontal_m_s * part_s;
            }
        }
        Ok(Dive { time_s, through_water: Vector::from_polar(way_m, std::f64::consts::FRAC_PI_2 - order.heading_rad) })
    }
}

//! Planned dives: the glide that follows from planned pitch and ballast by the vehicle's model, with its eight numbers as the mission's
//! own steady glides have them.

use super::current::Vector;
use super::mission::Dive;
use crate::history::glide::Glider;
use crate::history::numbers::{BALLAST_OFFSET, DRAG_LEVEL, NUMBERS};
use crate::history::posterior::posterior;
use crate::history::rows::{Row, Unit, median, units};
use logs::Vehicle;
use logs::record::flight::Flight;

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

/// A mission's steady glides and the vehicle that they show.
#[derive(Clone, Debug)]
pub struct Glides {
    units: Vec<Unit>,
    glider: Glider,
    /// The eight numbers beyond the vehicle file's.
    by: [f64; NUMBERS],
    /// Drag against the vehicle file's, -.
    pub drag_relative: WithError,
    /// Mass against the vehicle file's, kg.
    pub trim_kg: WithError,
}

impl Glides {
    /// Fits the eight numbers to the vertical velocities of the steady rows.
    ///
    /// # Errors
    /// No segment glides steadily for long enough.
    pub fn of(flight: &Flight, vehicle: &Vehicle) -> Result<Self, String> {
        let units = units(flight);
        let glider = Glider::of_units(vehicle, &units);
        let (mean, covariance) = posterior(&units, &glider)
            .ok_or_else(|| "no dive of this flight glides steadily for long enough to learn drag and trim from".to_owned())?;
        let by = glider.moved(&mean);
        let sigma = |i: usize| covariance[(i, i)].sqrt() * glider.sizes[i];
        let drag_relative = (by[DRAG_LEVEL].exp_m1(), by[DRAG_LEVEL].exp() * sigma(DRAG_LEVEL));
        let trim_kg = (by[BALLAST_OFFSET], sigma(BALLAST_OFFSET));
        Ok(Self { units, glider, by, drag_relative, trim_kg })
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
    pub fn dive(&self, order: &Order) -> Result<Dive, String> {
        /// Depths at which the glide is asked.
        const LEVELS: usize = 5;
        let [top, bottom] = order.depth_m;
        let part_m = (bottom - top) / LEVELS as f64;
        let (mut time_s, mut way_m) = (0.0, 0.0);
        for k in 0..LEVELS {
            let depth_m = top + (k as f64 + 0.5) * part_m;
            let (density_kg_m3, temperature_degc) = self.water(depth_m);
            for way in [-1.0, 1.0] {
                let (pitch_rad, ballast_m3) = (way * order.pitch_rad, way * order.ballast_m3);
                let pressure_pa = depth_m * 1e4;
                let row = Row { way, pitch_rad, ballast_m3, density_kg_m3, temperature_degc, pressure_pa, ..Row::default() };
                let [forward_m_s, rise_m_s] = self.glider.speeds(&row, &self.by).ok_or_else(|| {
                    let (pitch, cc) = (pitch_rad.to_degrees(), ballast_m3 * 1e6);
                    format!("as its dives show it, the vehicle has no buoyancy to glide at {depth_m:.0} m, {pitch:.0}°, {cc:.0} cc")
                })?;
                let part_s = part_m / rise_m_s.abs();
                time_s += part_s;
                way_m += forward_m_s * part_s;
            }
        }
        Ok(Dive { time_s, through_water: Vector::from_polar(way_m, std::f64::consts::FRAC_PI_2 - order.heading_rad) })
    }
}

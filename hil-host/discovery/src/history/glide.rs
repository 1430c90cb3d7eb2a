//! The steady glide of a vehicle at rows of a dive, as a function of the eight numbers, and its derivatives.
//!
//! Valid for steady rows with |pitch| > 0.14 rad. The law of forces is the vehicle's own with all its effects that act in a steady
//! glide; a bank's tilt and inertia are left out, as the rows leave turns out.

use super::numbers::{
    BALLAST_OFFSET, BALLAST_SCALE, COMPRESSIBILITY, DRAG_LEVEL, EXPANSION, NUMBERS, Numbers, PITCH_OFFSET, PITCH_SCALE, SLOPE_OF_LIFT,
    sizes,
};
use super::rows::{Row, Unit, drive_m3, mean_temperature_degc};
use hydro::effects::{Active, Constants, Flow, ForceModel, Sensed};
use logs::vehicle::Vehicle;

/// Net buoyancy below which the glide is not asked: the floor is smooth so that a fit is led back, N.
const LEAST_BUOYANCY_N: f64 = 0.02;
/// Largest angle of attack of a steady glide, rad.
const STEADY_ALPHA_MAX_RAD: f64 = 0.35;
/// Step of the derivative by the angle, rad.
const STEP_RAD: f64 = 1e-6;
/// Angle (rad) and speed (m/s) move by no more when they are found: differences of rows a step apart are to show nothing of it.
const CONVERGED: f64 = 1e-10;
/// Density at which the offsets of two files are compared, kg/m³.
const CLAIM_DENSITY_KG_M3: f64 = 1025.0;
const MOST_NEWTON_STEPS: usize = 60;
/// Step of the differences, in sizes.
const DIFFERENCE_OF_SIZE: f64 = 0.03;

/// A vehicle whose numbers may be off.
#[derive(Clone, Debug)]
pub struct Glider {
    constants: Constants,
    effects: Vec<Active>,
    /// Temperature at which an error of the expansion is no error of trim, °C.
    pub reference_degc: f64,
    /// Stroke of the buoyancy engine to either side, m³.
    pub drive_m3: f64,
    /// Sizes of the numbers.
    pub sizes: Numbers,
    /// How far off the file's own numbers may be, 1 sigma, in sizes: its tolerances.
    pub tolerance: Numbers,
}

/// Tolerances of a vehicle file in sizes, none below a tenth. A vehicle is trimmed anew for each deployment, whatever its file says of the
/// last. No file states how well it knows the scale of its pitch sensor: as well as drag, which mirrors it.
fn tolerance(vehicle: &Vehicle, sizes: &Numbers) -> Numbers {
    const LEAST: f64 = 0.1;
    const RETRIMMED_KG: f64 = 0.05;
    let t = &vehicle.tolerance;
    let mut out = Numbers::from_element(1.0);
    out[DRAG_LEVEL] = t.cd0_relative;
    out[BALLAST_OFFSET] = (t.trim_volume_m3 * CLAIM_DENSITY_KG_M3).max(RETRIMMED_KG);
    out[COMPRESSIBILITY] = t.hull_compressibility_relative * vehicle.constants.compressibility_per_pa;
    out[EXPANSION] = t.hull_thermal_expansion_relative * vehicle.constants.thermal_expansion_per_k;
    out[PITCH_OFFSET] = t.pitch_zero_rad;
    out[BALLAST_SCALE] = t.ballast_gain_relative;
    out[SLOPE_OF_LIFT] = t.lift_slope_relative;
    out[PITCH_SCALE] = sizes[PITCH_SCALE] * (out[DRAG_LEVEL] / sizes[DRAG_LEVEL]).min(1.0);
    let in_sizes = out.component_div(sizes);
    in_sizes.map(|x| if x.is_finite() { x.max(LEAST) } else { 1.0 })
}

/// The same at some numbers.
struct Law<'a> {
    force: ForceModel<'a>,
    pitch: (f64, f64),
    ballast: (f64, f64),
}

/// Angle of attack and speed: where the search for those of a neighbour starts.
#[derive(Clone, Copy, Debug)]
struct Start {
    alpha_rad: f64,
    speed_m_s: f64,
}

const COLD: Start = Start { alpha_rad: 0.05, speed_m_s: 0.3 };

impl Glider {
    /// The vehicle of a file with what its flights say of temperature and engine.
    #[must_use]
    pub fn new(vehicle: &Vehicle, reference_degc: f64, drive_m3: f64) -> Self {
        let sizes = sizes(drive_m3);
        let tolerance = tolerance(vehicle, &sizes);
        Self { constants: vehicle.constants, effects: vehicle.effects.clone(), reference_degc, drive_m3, sizes, tolerance }
    }

    /// The same of units that are to be its history.
    #[must_use]
    pub fn of_units(vehicle: &Vehicle, units: &[Unit]) -> Self {
        Self::new(vehicle, mean_temperature_degc(units), drive_m3(units))
    }

    /// Moves the file's numbers by so many sizes.
    #[must_use]
    pub fn moved(&self, by: &Numbers) -> [f64; NUMBERS] {
        std::array::from_fn(|i| by[i] * self.sizes[i])
    }

    /// What the file claims of the eight numbers, in their units (logarithms of drag and lift; the offset is what it weighs more than
    /// the water that it displaces at the reference): two files differ by the difference of these.
    #[must_use]
    pub fn claims(&self) -> [f64; NUMBERS] {
        let force = ForceModel::new(self.constants, &self.effects);
        let at = |pitch_rad: f64, ballast_m3: f64| {
            force.truth(Sensed {
                time_s: 0.0,
                pitch_rad,
                ballast_m3,
                density_kg_m3: CLAIM_DENSITY_KG_M3,
                temperature_degc: self.reference_degc,
                hull_degc: self.reference_degc,
                pressure_pa: 0.0,
            })
        };
        let (rest, moved) = (at(0.0, 0.0), at(0.1, 1e-4));
        let c = &force.constants;
        let mut out = [0.0; NUMBERS];
        out[DRAG_LEVEL] = c.cd0.ln();
        out[BALLAST_OFFSET] = -force.net_buoyancy_n(&rest) / c.gravity_m_s2;
        out[COMPRESSIBILITY] = c.compressibility_per_pa;
        out[EXPANSION] = c.thermal_expansion_per_k;
        out[PITCH_OFFSET] = rest.pitch_rad;
        out[PITCH_SCALE] = ((moved.pitch_rad - rest.pitch_rad) / 0.1).ln();
        out[BALLAST_SCALE] = ((moved.ballast_m3 - rest.ballast_m3) / 1e-4).ln();
        out[SLOPE_OF_LIFT] = c.lift_slope_per_rad.ln();
        out
    }

    /// Volume of the hull at the surface and the temperature of the flights, m³: what a board reckons with.
    #[must_use]
    pub fn hull_m3(&self) -> f64 {
        let c = ForceModel::new(self.constants, &self.effects).constants;
        c.hull_volume_m3 * (1.0 + c.thermal_expansion_per_k * (self.reference_degc - c.reference_temperature_degc))
    }

    /// The law of forces with drag level and lift slope moved by `x`, in their units: what a board's table is made of.
    #[must_use]
    pub fn forces(&self, x: &[f64; NUMBERS]) -> ForceModel<'_> {
        self.law(x).force
    }

    fn law(&self, x: &[f64; NUMBERS]) -> Law<'_> {
        let mut c = self.constants;
        c.cd0 *= x[DRAG_LEVEL].exp();
        c.lift_slope_per_rad *= x[SLOPE_OF_LIFT].exp();
        c.mass_kg += x[BALLAST_OFFSET];
        c.compressibility_per_pa += x[COMPRESSIBILITY];
        c.thermal_expansion_per_k += x[EXPANSION];
        // Expansion about the temperature of the flights, not of the file.
        let at_rest_m3 = -c.hull_volume_m3 * x[EXPANSION] * (self.reference_degc - c.reference_temperature_degc);
        Law {
            force: ForceModel::new(c, &self.effects),
            pitch: (x[PITCH_SCALE].exp(), x[PITCH_OFFSET]),
            ballast: (x[BALLAST_SCALE].exp(), at_rest_m3),
        }
    }

    /// Vertical velocities at the rows of a unit, m/s, up.
    #[must_use]
    pub fn rises(&self, unit: &Unit, x: &[f64; NUMBERS]) -> Vec<f64> {
        let law = self.law(x);
        unit.rows.iter().map(|row| law.rise(row, COLD).0).collect()
    }

    /// Speed forward and upward at a row, m/s; none where nothing drives the vehicle its way.
    #[must_use]
    pub fn speeds(&self, row: &Row, x: &[f64; NUMBERS]) -> Option<[f64; 2]> {
        let law = self.law(x);
        let (rise_m_s, at) = law.rise(row, COLD);
        let forward_m_s = (at.speed_m_s.powi(2) - rise_m_s.powi(2)).max(0.0).sqrt();
        (law.buoyancy_n(row.way, law.truth(row)) > LEAST_BUOYANCY_N && rise_m_s != 0.0).then_some([forward_m_s, rise_m_s])
    }

    /// Vertical velocities, and their derivatives by the numbers in sizes.
    pub(super) fn linearised(&self, unit: &Unit, x: &[f64; NUMBERS]) -> (Vec<f64>, Vec<Numbers>) {
        let law = self.law(x);
        let (base, at): (Vec<f64>, Vec<Start>) = unit.rows.iter().map(|row| law.rise(row, COLD)).unzip();
        let mut columns = vec![Numbers::zeros(); base.len()];
        for i in 0..NUMBERS {
            let mut ahead = *x;
            ahead[i] += DIFFERENCE_OF_SIZE * self.sizes[i];
            let law = self.law(&ahead);
            for ((row, column), (start, base)) in unit.rows.iter().zip(&mut columns).zip(at.iter().zip(&base)) {
                column[i] = (law.rise(row, *start).0 - base) / DIFFERENCE_OF_SIZE;
            }
        }
        (base, columns)
    }
}

impl Law<'_> {
    /// What is true at a row by the effects that are on.
    fn truth(&self, row: &Row) -> Sensed {
        self.force.truth(Sensed {
            time_s: row.time_s,
            pitch_rad: row.pitch_rad,
            ballast_m3: row.ballast_m3,
            density_kg_m3: row.density_kg_m3,
            temperature_degc: row.temperature_degc,
            hull_degc: row.temperature_degc,
            pressure_pa: row.pressure_pa,
        })
    }

    /// Net buoyancy, N, the way it goes.
    fn buoyancy_n(&self, way: f64, sensed: Sensed) -> f64 {
        let filled = Sensed { ballast_m3: self.ballast.0 * sensed.ballast_m3 + self.ballast.1, ..sensed };
        way * self.force.net_buoyancy_n(&filled)
    }

    /// Vertical velocity at a row, and where its balance was found.
    fn rise(&self, row: &Row, start: Start) -> (f64, Start) {
        let c = &self.force.constants;
        let sensed = self.truth(row);
        let pitch = row.way * (self.pitch.0 * sensed.pitch_rad + self.pitch.1);
        let buoyancy = self.buoyancy_n(row.way, sensed);
        let buoyancy = if buoyancy > LEAST_BUOYANCY_N {
            buoyancy
        } else {
            LEAST_BUOYANCY_N * (buoyancy / LEAST_BUOYANCY_N - 1.0).clamp(-30.0, 0.0).exp()
        };
        let pitch = pitch.max(0.05);
        let dynamic = 0.5 * sensed.density_kg_m3 * c.reference_area_m2;
        let Start { mut alpha_rad, mut speed_m_s } = start;
        for _ in 0..MOST_NEWTON_STEPS {
            let flow = |alpha: f64| Flow {
                alpha_rad: -row.way * alpha,
                speed_m_s,
                roll_rad: row.roll_rad,
                climb_m_s: row.way * speed_m_s,
                time_s: row.time_s,
                temperature_degc: row.temperature_degc,
                attached: true,
            };
            let balance = |alpha: f64| {
                let f = self.force.coefficients(&flow(alpha));
                (f.cd + row.way * f.cl * (alpha + pitch).tan(), f.cd)
            };
            let (here, drag) = balance(alpha_rad);
            let slope = (balance(alpha_rad + STEP_RAD).0 - here) / STEP_RAD;
            // Lift that grows steeper than drag falls short of: away from the stall.
            let to = (alpha_rad - here / slope.min(-0.05)).clamp(0.0, STEADY_ALPHA_MAX_RAD - 2.0 * STEP_RAD);
            let speed = (buoyancy * (pitch + to).sin() / (dynamic * drag.max(1e-6))).max(0.0).sqrt();
            let moved = (to - alpha_rad).abs() + (speed - speed_m_s).abs();
            (alpha_rad, speed_m_s) = (to, speed);
            if !(moved > CONVERGED) {
                break;
            }
        }
        (row.way * speed_m_s * (pitch + alpha_rad).sin(), Start { alpha_rad, speed_m_s })
    }
}

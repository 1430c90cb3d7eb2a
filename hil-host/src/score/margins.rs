//! How far is the pitch loop from instability?
//!
//! The law's only feedback in a steady glide is one integral: battery position by the pitch error, once per control cycle.
//!
//! ```text
//! x(k)  = x(k−1) + g · (tan θ(k) − tan θ_wanted) / |T2|       g = T / (T + 35 s),  T2 of the law's own trim law
//! L(z)  = g / |T2| · 1/(1 − z⁻¹) · G(z)                        G: tan θ by battery position, from cycle to cycle
//! ```
//! G is measured, not derived: the plant's full unsteady motion about a steady glide, a step of the battery mass by 1 mm, the
//! difference of two runs. So no linear model is believed that the law's author wrote. Gain and phase margin are those of L on
//! the unit circle; the delay margin is the phase margin over the crossover frequency, in control cycles.
//!
//! Not covered: dead bands (they turn a small loop gain into a small limit cycle), the search for the pitch, the turns.

use anyhow::{Context, anyhow};
use control::Settings;
use plant::actuators::{Actuators, Pump};
use plant::ocean::{Ocean, Profile};
use plant::sensors::Sensors;
use plant::{Scenario, Start, Vehicle, World};
use signals::{ActuatorCommand, Wings};
use std::f64::consts::PI;

/// Time constant of the law's integral, s (control, `trim.rs`).
pub const LEARN_S: f64 = 35.0;
/// Step of the battery mass that measures the response, m.
const STEP_M: f64 = 1e-3;
/// Time until a glide is steady, s.
const SETTLES_S: f64 = 500.0;
/// Length of the response, cycles.
const CYCLES: usize = 70;
/// Frequencies up to half the control rate.
const FREQUENCIES: usize = 4000;
/// Water deep enough that no run meets the bottom, m.
const BOTTOMLESS_M: f64 = 5000.0;

/// A glide and its vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glide {
    /// Wings.
    pub wings: Wings,
    /// Pitch down, rad, positive.
    pub pitch_rad: f64,
    /// Ballast drive, m³.
    pub ballast_m3: f64,
    /// Centre of gravity below centre of buoyancy, m.
    pub height_m: f64,
    /// Control cycle, s.
    pub cycle_s: f64,
    /// The law's T2 over that of its built-in trim law.
    pub t2_factor: f64,
}

impl Glide {
    /// The built-in vehicle at 26° and full drive.
    #[must_use]
    pub fn nominal(wings: Wings) -> Self {
        Self {
            wings,
            pitch_rad: 0.4538,
            ballast_m3: 230e-6,
            height_m: Vehicle::default().metacentric_height_m,
            cycle_s: 4.0,
            t2_factor: 1.0,
        }
    }
}

/// Margins of a glide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Speed through the water, m/s.
    pub speed_m_s: f64,
    /// Gain margin, dB.
    pub gain_db: f64,
    /// Phase margin, degrees.
    pub phase_deg: f64,
    /// Delay margin, control cycles.
    pub delay_cycles: f64,
    /// Largest of |pitch error| in the last quarter of a closed-loop run from a unit error; below 0.05 it has settled.
    pub left: f64,
}

/// The response of a glide: tan θ after a unit step of the battery, cycle by cycle.
#[derive(Clone, Debug)]
pub struct Response {
    glide: Glide,
    /// Speed through the water, m/s.
    pub speed_m_s: f64,
    /// Impulse response of tan θ, 1/m, from the first cycle on; the battery forward is positive here.
    pub impulse: Vec<f64>,
}

fn world(glide: &Glide) -> anyhow::Result<World> {
    // Neutral at every depth: a glide stays the glide that it is.
    let vehicle = Vehicle {
        metacentric_height_m: glide.height_m,
        crush_depth_m: BOTTOMLESS_M,
        compressibility_per_pa: 0.0,
        thermal_expansion_per_k: 0.0,
        ..Vehicle::deep()
    };
    // One more millimetre must be possible at any pitch.
    let actuators = Actuators {
        battery_travel_m: 0.08,
        battery_dead_band_m: 0.0,
        pump: Pump { volume_m3: glide.ballast_m3, dead_band_m3: 0.0, ..Pump::shallow_200() },
        ..Actuators::default()
    };
    let start = Start { depth_m: 20.0, pitch_rad: -glide.pitch_rad, ballast_m3: Some(-glide.ballast_m3), ..Start::default() };
    let ocean = Ocean { profile: Profile::Uniform(1025.0), water_depth_m: BOTTOMLESS_M, ..Ocean::deep() };
    let scenario = Scenario { wings: glide.wings, vehicle, actuators, ocean, start, sensors: Sensors::perfect(), ..Scenario::default() };
    World::new(scenario).map_err(|e| anyhow!("{e}"))
}

/// The vehicle after `SETTLES_S` with the battery at `x`.
fn settled(glide: &Glide, x: f64) -> anyhow::Result<World> {
    let mut world = world(glide)?;
    world.advance(&command(glide, x), SETTLES_S);
    Ok(world)
}

fn command(glide: &Glide, x: f64) -> ActuatorCommand {
    ActuatorCommand { ballast_m3: -glide.ballast_m3 as f32, battery_mass_m: x as f32, ..ActuatorCommand::default() }
}

/// Measures the response of a glide.
///
/// # Errors
/// No battery position gives this pitch in a steady glide.
pub fn respond(glide: &Glide) -> anyhow::Result<Response> {
    let (mut low, mut high) = (-0.07, 0.07);
    for _ in 0..18 {
        let middle = 0.5 * (low + high);
        // Forward is nose down.
        if settled(glide, middle)?.truth().pitch_rad > -glide.pitch_rad { low = middle } else { high = middle }
    }
    let x = 0.5 * (low + high);
    let mut still = settled(glide, x)?;
    let mut stepped = still.clone();
    let truth = still.truth();
    if (truth.pitch_rad + glide.pitch_rad).abs() > 0.01 {
        return Err(anyhow!("no steady glide at {:.1} deg with {:?} wings", glide.pitch_rad.to_degrees(), glide.wings));
    }
    let mut step = vec![0.0];
    for _ in 0..CYCLES {
        still.advance(&command(glide, x), glide.cycle_s);
        stepped.advance(&command(glide, x + STEP_M), glide.cycle_s);
        step.push((stepped.truth().pitch_rad.tan() - still.truth().pitch_rad.tan()) / STEP_M);
    }
    let impulse = step.windows(2).map(|w| w[1] - w[0]).collect();
    Ok(Response { glide: *glide, speed_m_s: truth.speed_m_s, impulse })
}

impl Response {
    /// Integral gain per cycle over |T2|, m.
    fn gain(&self) -> f64 {
        let t2 = f64::from(-Settings::slocum_200().trim.per_battery_m) * self.glide.t2_factor;
        self.glide.cycle_s / (self.glide.cycle_s + LEARN_S) / t2
    }

    /// Open loop at a frequency (radians per cycle): real and imaginary part.
    #[must_use]
    pub fn open_loop(&self, omega: f64) -> (f64, f64) {
        // Nose up moves the mass forward, forward is nose down: the loop is negative feedback of −impulse.
        let (mut re, mut im) = (0.0, 0.0);
        for (k, h) in self.impulse.iter().enumerate() {
            let angle = -omega * (k + 1) as f64;
            re -= h * angle.cos();
            im -= h * angle.sin();
        }
        // 1/(1 − e^(−iω))
        let (a, b) = (1.0 - omega.cos(), omega.sin());
        let size = a * a + b * b;
        let (ire, iim) = (a / size, -b / size);
        let g = self.gain();
        (g * (re * ire - im * iim), g * (re * iim + im * ire))
    }

    /// Margins.
    ///
    /// # Errors
    /// The loop never crosses a gain of 1.
    pub fn margins(&self) -> anyhow::Result<Margins> {
        let (mut gain_db, mut phase_deg, mut delay) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
        let mut before: Option<(f64, f64)> = None;
        for i in 1..=FREQUENCIES {
            let omega = PI * i as f64 / FREQUENCIES as f64;
            let (re, im) = self.open_loop(omega);
            let size = re.hypot(im);
            if let Some((size_before, im_before)) = before {
                if size_before >= 1.0 && size < 1.0 || size_before < 1.0 && size >= 1.0 {
                    // Phase above −180°, 0..360: a loop that turned further has less.
                    let phase = (im.atan2(re) + PI).rem_euclid(2.0 * PI);
                    let phase = if phase > PI { phase - 2.0 * PI } else { phase };
                    phase_deg = phase_deg.min(phase.to_degrees());
                    delay = delay.min(phase / omega);
                }
                if re < 0.0 && im_before * im <= 0.0 {
                    gain_db = gain_db.min(-20.0 * size.log10());
                }
            }
            before = Some((size, im));
        }
        if !phase_deg.is_finite() {
            return Err(anyhow!("the loop never crosses a gain of 1"));
        }
        Ok(Margins { speed_m_s: self.speed_m_s, gain_db, phase_deg, delay_cycles: delay, left: self.left() })
    }

    /// Closed loop in time, from a unit error: what is left of it in the last quarter of 300 cycles.
    fn left(&self) -> f64 {
        let g = self.gain();
        let (mut moves, mut x, mut left) = (vec![0.0f64], 0.0f64, 0.0f64);
        for k in 1..=300usize {
            let answer: f64 = self.impulse.iter().enumerate().filter_map(|(j, h)| moves.get(k.checked_sub(j + 1)?).map(|x| h * x)).sum();
            let error = 1.0 + answer;
            if k > 225 {
                left = left.max(error.abs());
            }
            x += g * error;
            moves.push(x);
        }
        left
    }
}

/// The envelope: both wings, three pitches, two drives, three heights.
#[must_use]
pub fn envelope() -> Vec<Glide> {
    let mut all = Vec::new();
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        for pitch_deg in [20.0f64, 26.0, 35.0] {
            for ballast_m3 in [130e-6, 236e-6, 263e-6] {
                for height in [0.7, 1.0, 1.3] {
                    let nominal = Glide::nominal(wings);
                    all.push(Glide { pitch_rad: pitch_deg.to_radians(), ballast_m3, height_m: nominal.height_m * height, ..nominal });
                }
            }
        }
    }
    all
}

/// Margins of every glide, in order.
///
/// # Errors
/// A glide that does not exist.
pub fn all(glides: &[Glide]) -> anyhow::Result<Vec<(Glide, Margins)>> {
    use rayon::prelude::*;
    glides.par_iter().map(|g| Ok((*g, respond(g)?.margins().with_context(|| format!("{g:?}"))?))).collect()
}

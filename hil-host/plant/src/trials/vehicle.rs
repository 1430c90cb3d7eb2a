//! What the vehicle file claims, and by how much the real vehicle differs from it.
//!
//! [`Nominal`] is written to `vehicle.json`; [`Scatter`] is the ordinary
//! calibration scatter that every trial carries (truncated at 2 sigma, so that a
//! clean trial is clean by the format's own definition). Numbers follow the
//! format's two example vehicles and vary between cases where the format lets them.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde_json::{Value, json};

use super::{Site, Wing};

/// The vehicle file of one trial.
#[derive(Clone, Debug)]
pub struct Nominal {
    /// Lake or sea.
    pub site: Site,
    /// Wing set.
    pub wing: Wing,
    /// g, m/s².
    pub gravity: f64,
    /// m, kg.
    pub mass_kg: f64,
    /// V0, m³ at zero gauge pressure, reference temperature, ballast reading 0.
    pub hull_volume_m3: f64,
    /// eps, 1/Pa.
    pub compressibility: f64,
    /// alphaT, 1/K.
    pub thermal_expansion: f64,
    /// T0, °C.
    pub reference_temperature_degc: f64,
    /// S and S_w, m².
    pub area_m2: f64,
    /// S_h, m².
    pub hull_area_m2: f64,
    /// a_w, 1/rad on S_w.
    pub wing_lift_slope: f64,
    /// a_h, 1/rad on S_h.
    pub hull_lift_slope: f64,
    /// a2, 1/rad² on S.
    pub lift_quadratic: f64,
    /// CD0 on S.
    pub cd0: f64,
    /// K.
    pub induced_k: f64,
    /// CDb, 1/rad² on S.
    pub hull_drag: f64,
    /// k1, k2 as fractions of the mass.
    pub added_mass: [f64; 2],
    /// Water depth H, m.
    pub water_depth_m: f64,
    /// Nominal rms of the background water motion, m/s.
    pub background_rms_m_s: f64,
    /// Nominal correlation time of it, s.
    pub background_time_s: f64,
    /// Sensors.
    pub sensors: Sensors,
    /// Segments reserved for the error figures.
    pub check: [usize; 2],
}

/// Sensor figures of one trial.
#[derive(Clone, Debug)]
pub struct Sensors {
    /// Nominal sample period, s.
    pub period_s: f64,
    /// Pressure noise (standard deviation) and resolution, dbar.
    pub pressure_dbar: [f64; 2],
    /// Pitch noise and resolution, rad.
    pub pitch_rad: [f64; 2],
    /// Heading noise, rad.
    pub heading_rad: f64,
    /// Position noise, m.
    pub gps_m: f64,
    /// Noise of the speed channel, m/s; `None` where the vehicle has none.
    pub speed_m_s: Option<f64>,
}

/// 1-sigma calibration tolerances, `tolerance_1sigma` of the file.
pub const TOLERANCE: [(&str, f64); 11] = [
    ("cd0_relative", 0.04),
    ("lift_slope_relative", 0.04),
    ("lift_quadratic_relative", 0.05),
    ("trim_volume_cc", 2.5),
    ("ballast_gain_relative", 0.008),
    ("pitch_zero_rad", 0.0026),
    ("hull_compressibility_relative", 0.04),
    ("hull_thermal_expansion_relative", 0.05),
    ("added_mass_surge", 0.03),
    ("added_mass_heave", 0.08),
    ("battpos_zero_m", 0.002),
];

/// Relative scale uncertainty of the speed channel, 1 sigma (format's example).
pub const SPEED_SCALE_1SIGMA: f64 = 0.006;
/// Compass bias, rad, 1 sigma (format's example).
pub const HEADING_BIAS_1SIGMA_RAD: f64 = 0.015;

/// Drawn deviations, in the order and unit of [`TOLERANCE`], then speed scale and compass bias.
#[derive(Clone, Debug)]
pub struct Scatter {
    /// Values in the order of [`TOLERANCE`].
    pub values: [f64; 11],
    /// Relative scale error of the speed channel.
    pub speed_scale: f64,
    /// Compass bias, rad.
    pub heading_bias_rad: f64,
}

/// A normal deviate cut at 2 sigma by drawing again.
pub fn normal_within_2_sigma(rng: &mut ChaCha8Rng) -> f64 {
    loop {
        let z: f64 = rng.sample(StandardNormal);
        if z.abs() <= 2.0 {
            return z;
        }
    }
}

impl Scatter {
    /// Draws one vehicle.
    pub fn draw(rng: &mut ChaCha8Rng) -> Self {
        let mut values = [0.0; 11];
        for (v, (_, sigma)) in values.iter_mut().zip(TOLERANCE) {
            *v = sigma * normal_within_2_sigma(rng);
        }
        Self {
            values,
            speed_scale: SPEED_SCALE_1SIGMA * normal_within_2_sigma(rng),
            heading_bias_rad: HEADING_BIAS_1SIGMA_RAD * normal_within_2_sigma(rng),
        }
    }

    /// A vehicle that is exactly its file.
    #[must_use]
    pub fn none() -> Self {
        Self { values: [0.0; 11], speed_scale: 0.0, heading_bias_rad: 0.0 }
    }
}

impl Nominal {
    /// Draws the vehicle file. `mid_density` is the density the hull is trimmed for, kg/m³.
    pub fn draw(site: Site, wing: Wing, mid_density: f64, has_speed: bool, rng: &mut ChaCha8Rng) -> Self {
        let (wing_lift_slope, lift_quadratic, induced_k, hull_drag) = match wing {
            Wing::Standard => (3.45, 1.4, 0.075, 2.0),
            Wing::LowAspectRatio => (0.5, 4.5, 0.35, 1.0),
        };
        let (rms, time, depth) = match site {
            Site::Lake => (rng.random_range(0.0018..0.0028), rng.random_range(30.0..60.0), rng.random_range(33.0..39.0)),
            Site::Sea => (rng.random_range(0.0030..0.0046), rng.random_range(80.0..140.0), rng.random_range(215.0..260.0)),
        };
        let round = |x: f64, step: f64| (x / step).round() * step;
        let mass_kg = round(rng.random_range(64.0..72.0), 0.1);
        let period_s = [1.0, 2.0, 4.0, 4.0][rng.random_range(0..4)];
        let pressure_resolution = [0.01, 0.02][rng.random_range(0..2)];
        let first_check = rng.random_range(1..4);
        Self {
            site,
            wing,
            gravity: 9.81,
            mass_kg,
            hull_volume_m3: round(mass_kg / mid_density, 1e-8),
            compressibility: 5e-10,
            thermal_expansion: 5e-5,
            reference_temperature_degc: 10.0,
            area_m2: 0.11,
            hull_area_m2: 0.0356,
            wing_lift_slope,
            hull_lift_slope: 1.2,
            lift_quadratic,
            cd0: 0.15,
            induced_k,
            hull_drag,
            added_mass: [0.2, 0.92],
            water_depth_m: round(depth, 1.0),
            background_rms_m_s: round(rms, 1e-4),
            background_time_s: round(time, 5.0),
            sensors: Sensors {
                period_s,
                pressure_dbar: [round(rng.random_range(0.010..0.022), 0.005), pressure_resolution],
                pitch_rad: [round(rng.random_range(0.0013..0.0028), 1e-4), 0.00175],
                heading_rad: 0.026,
                gps_m: 3.0,
                speed_m_s: has_speed.then(|| round(rng.random_range(0.008..0.014), 1e-3)),
            },
            check: [first_check, rng.random_range(4..7)],
        }
    }

    /// Lift slope of wing and hull together on S, 1/rad.
    #[must_use]
    pub fn lift_slope(&self) -> f64 {
        (self.wing_lift_slope * self.area_m2 + self.hull_lift_slope * self.hull_area_m2) / self.area_m2
    }

    /// The document `vehicle.json`.
    #[must_use]
    pub fn document(&self, case: &str) -> Value {
        let tolerance: serde_json::Map<String, Value> = TOLERANCE.iter().map(|(k, v)| ((*k).to_owned(), json!(v))).collect();
        let fit: Vec<usize> = (0..super::SEGMENTS).filter(|s| !self.check.contains(s)).collect();
        let s = &self.sensors;
        let (wing_name, aspect_ratio) = match self.wing {
            Wing::Standard => ("standard", 5.536),
            Wing::LowAspectRatio => ("low_ar", 0.3155),
        };
        json!({
            "format": "glider-trial/1",
            "case": case,
            "site": self.site.id(),
            "gravity_m_s2": self.gravity,
            "mass_kg": self.mass_kg,
            "hull_volume_m3": self.hull_volume_m3,
            "hull_compressibility_per_pa": self.compressibility,
            "hull_thermal_expansion_per_k": self.thermal_expansion,
            "reference_temperature_degc": self.reference_temperature_degc,
            "wing": { "name": wing_name, "aspect_ratio": aspect_ratio, "area_m2": self.area_m2, "sweep_deg": 45.0 },
            "hydro": {
                "reference_area_m2": self.area_m2,
                "wing_lift_slope_per_rad": self.wing_lift_slope,
                "hull_lift_slope_per_rad": self.hull_lift_slope,
                "hull_area_m2": self.hull_area_m2,
                "lift_quadratic_per_rad2": self.lift_quadratic,
                "cd0": self.cd0,
                "induced_k": self.induced_k,
                "hull_drag_per_rad2": self.hull_drag,
                "added_mass_surge": self.added_mass[0],
                "added_mass_heave": self.added_mass[1],
            },
            "pitch": {
                "inertia_kg_m2": PITCH.inertia,
                "metacentric_height_m": PITCH.metacentric_height,
                "battery_mass_kg": PITCH.battery_mass,
                "ballast_arm_m": PITCH.ballast_arm,
                "length_m": PITCH.length,
                "cm_alpha": PITCH.cm_alpha,
                "cm_q": PITCH.cm_q,
            },
            "tolerance_1sigma": tolerance,
            "sensors": {
                "sample_period_s": s.period_s,
                "pressure_noise_dbar": s.pressure_dbar[0],
                "pressure_resolution_dbar": s.pressure_dbar[1],
                "pitch_noise_rad": s.pitch_rad[0],
                "pitch_resolution_rad": s.pitch_rad[1],
                "ballast_resolution_cc": 1.0,
                "heading_noise_rad": s.heading_rad,
                "heading_bias_1sigma_rad": HEADING_BIAS_1SIGMA_RAD,
                "gps_noise_m": s.gps_m,
                "speed_noise_m_s": s.speed_m_s,
                "speed_scale_1sigma": s.speed_m_s.map(|_| SPEED_SCALE_1SIGMA),
            },
            "background_vertical_water_motion": {
                "rms_m_s": self.background_rms_m_s,
                "correlation_time_s": self.background_time_s,
            },
            "horizontal_current": if self.site == Site::Lake { "none" } else { "unknown" },
            "water_depth_m": self.water_depth_m,
            "segments": { "fit": fit, "check": self.check },
        })
    }
}

/// Pitch dynamics of the format's section 4 (SI units), the same for every case.
pub struct Pitch {
    /// I, kg m².
    pub inertia: f64,
    /// h, m.
    pub metacentric_height: f64,
    /// m_b, kg.
    pub battery_mass: f64,
    /// x_p, m.
    pub ballast_arm: f64,
    /// l, m.
    pub length: f64,
    /// cm_alpha, 1/rad.
    pub cm_alpha: f64,
    /// cm_q, s/m form of the format.
    pub cm_q: f64,
}

/// The values of the format's example vehicles.
pub const PITCH: Pitch =
    Pitch { inertia: 20.0, metacentric_height: 0.005, battery_mass: 9.0, ballast_arm: 0.7, length: 1.8, cm_alpha: -0.1, cm_q: -0.55 };

//! The force law of the vehicle that really flew.
//!
//! Small-angle lift and drag are those of the vehicle file times its calibration
//! scatter. What is missing from the file is added here in forms of its own:
//! other onsets, powers, references and smoothings than a tool is likely to
//! assume (format, section 6.3). Beyond 0.35 rad, where the format leaves the
//! law free and says that only launches and turns are flown, the normal force goes
//! on growing with the cross-flow, sin², as on slender bodies and wings of low
//! aspect ratio (Jorgensen, NASA TR R-474, 1977); the axial force falls with the cosine.

use super::small_structure::SmallStructure;
use super::vehicle::{Nominal, Scatter};

/// Angle at which the given polar ends, rad (format, section 3).
pub(super) const ALPHA_END_RAD: f64 = 0.35;
/// Normal-force coefficient of the hull and wing broadside, on S (flat plate and cylinder about 1.1 to 2, guess).
const BROADSIDE_CN: f64 = 3.2;

/// Extra normal force `k e^p 0.1^(2-p)`, e the angle beyond the onset.
#[derive(Clone, Copy, Debug)]
pub struct NormalForce {
    /// k, 1/rad² on S.
    pub k: f64,
    /// Onset, rad.
    pub onset: f64,
    /// Growth p.
    pub power: f64,
    /// Width over which the force sets in, rad.
    pub width: f64,
}

/// CD0 times (Re/Re_ref)^-n.
#[derive(Clone, Copy, Debug)]
pub struct ReynoldsDrag {
    /// n.
    pub exponent: f64,
    /// Speed at which the drag is the file's, m/s.
    pub reference_speed: f64,
    /// Whether the viscosity of the water (temperature) enters too.
    pub viscous: bool,
}

/// Loss of lift slope beyond an angle.
#[derive(Clone, Copy, Debug)]
pub struct Stall {
    /// Angle, rad.
    pub angle: f64,
    /// Share of the lift slope that is lost.
    pub loss: f64,
    /// Smoothing width, rad.
    pub width: f64,
    /// Reattachment happens this far below the angle, rad (0: no hysteresis).
    pub hysteresis: f64,
}

impl Stall {
    /// Whether flow is separated at an angle of attack of this size, after it was or was not.
    #[must_use]
    pub fn separates(&self, size: f64, separated: bool) -> bool {
        size > if separated { self.angle - self.hysteresis } else { self.angle }
    }
}

/// CD0 (1 + rate t), with a mild curvature in time.
#[derive(Clone, Copy, Debug)]
pub struct Fouling {
    /// Mean rate over the trial, 1/day.
    pub rate_per_day: f64,
    /// Power of time.
    pub power: f64,
    /// Duration of the trial, day.
    pub duration_day: f64,
}

/// Effects outside the catalogue.
#[derive(Clone, Copy, Debug, Default)]
pub struct OffCatalogue {
    /// Hull temperature follows the water with this time constant, s (0: at once); with the expansion multiplier.
    pub hull_thermal_lag_s: f64,
    /// Share of the expansion that lags, relative to the hull's own (above 1: oil and foam lag too).
    pub hull_thermal_gain: f64,
    /// Water in free-flooding spaces exchanged with this time constant, s.
    pub flood_lag_s: f64,
    /// Volume of the free-flooding spaces, m³.
    pub flood_volume_m3: f64,
    /// Free air at the surface, m³.
    pub trapped_air_m3: f64,
    /// The engine's volume follows its reading with this time constant, s.
    pub ballast_lag_s: f64,
    /// Density error of the CTD: time constant of the cell's thermal error, s, and size kg/m³ per K.
    pub cell_lag_s: f64,
    /// kg/m³ per K of temperature difference between cell and water.
    pub cell_gain: f64,
    /// Drag area grows with dynamic pressure (bending wings): relative per (m/s)².
    pub bending: f64,
    /// Pitch sensor error depending on heading, rad.
    pub pitch_by_heading: f64,
    /// Pitch sensor error growing with pressure, rad per MPa, saturating.
    pub pitch_by_depth: f64,
    /// Trim differs per segment, m³.
    pub segment_trim: [f64; super::SEGMENTS],
    /// Water taken in during a segment, m³/s.
    pub leak: f64,
    /// Lift and drag differ with the sign of roll.
    pub roll_bias: f64,
    /// CD0 depends on heading, relative amplitude (a wing or a mast that is bent, in waves of one direction).
    pub drag_by_heading: f64,
    /// Segment from which on something hangs at the hull, and the CD0 it adds, relative.
    pub caught: (usize, f64),
    /// Displaced volume that comes and goes, m³, and its period, s (an engine whose valve leaks and is pumped up again).
    pub breathing: (f64, f64),
}

impl OffCatalogue {
    /// Factor on CD0 in a segment, on a heading, rad.
    #[must_use]
    pub fn drag(&self, segment: usize, heading: f64) -> f64 {
        let caught = if segment >= self.caught.0 { self.caught.1 } else { 0.0 };
        1.0 + self.drag_by_heading * libm::cos(heading - 1.0) + caught
    }

    /// Displaced volume that is there at a time of a segment, s, and should not be, m³.
    #[must_use]
    pub fn breath(&self, t: f64) -> f64 {
        let (volume, period) = self.breathing;
        if volume == 0.0 { 0.0 } else { volume * libm::sin(core::f64::consts::TAU * t / period) }
    }
}

/// The real vehicle.
#[derive(Clone, Debug)]
pub struct Nature {
    /// Mass, kg.
    pub mass: f64,
    /// V0, m³, trim included.
    pub volume: f64,
    /// eps, 1/Pa, at the surface.
    pub compressibility: f64,
    /// Relative change of eps per MPa.
    pub compressibility_slope: f64,
    /// alphaT, 1/K, at T0.
    pub thermal_expansion: f64,
    /// Relative change of alphaT per K.
    pub thermal_slope: f64,
    /// T0, °C.
    pub reference_temperature: f64,
    /// True ballast = reading (1 + gain).
    pub ballast_gain: f64,
    /// Measured pitch = true (1 + scale) + zero.
    pub pitch_zero: f64,
    /// See `pitch_zero`.
    pub pitch_scale: f64,
    /// Zero of the battery position, m.
    pub battery_zero: f64,
    /// S, m².
    pub area: f64,
    /// Linear lift slope on S, 1/rad.
    pub lift_slope: f64,
    /// a2 on S, 1/rad².
    pub lift_quadratic: f64,
    /// Zero-lift angle, rad.
    pub zero_lift: f64,
    /// Share of it that the hull's drag turns with: 0 for wings set at an angle, 1 for a vehicle crooked as a whole.
    pub zero_lift_hull: f64,
    /// CD0 on S.
    pub cd0: f64,
    /// K.
    pub induced_k: f64,
    /// CDb, 1/rad².
    pub hull_drag: f64,
    /// k1, k2.
    pub added_mass: [f64; 2],
    /// Body–wing vortex force.
    pub vortex: Option<NormalForce>,
    /// Side-edge force.
    pub side_edge: Option<NormalForce>,
    /// Speed-dependent drag.
    pub reynolds: Option<ReynoldsDrag>,
    /// Stall.
    pub stall: Option<Stall>,
    /// Fouling.
    pub fouling: Option<Fouling>,
    /// Drag by roll: k (1/rad², on S at 0.25 rad) and power.
    pub roll_drag: [f64; 2],
    /// Relative increase of CD0 when climbing.
    pub climb_drag: f64,
    /// CTD density minus true density, kg/m³.
    pub density_bias: f64,
    /// Pressure drift, dbar/day.
    pub pressure_drift: f64,
    /// Off-catalogue.
    pub off: OffCatalogue,
    /// What the vehicle does as it banks; nothing in the format's nominal model.
    pub banking: Option<Banking>,
    /// What no model has; nothing where the flight is to be as clean as a model.
    pub small: Option<SmallStructure>,
}

/// What a vehicle does as it banks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Banking {
    /// Lift tilts out of the vertical plane, and that is all.
    Tilts,
    /// It turns as the net buoyancy across the wings has it, and slips: a body with added mass in three dimensions.
    Turns,
}

/// Conditions of one instant.
#[derive(Clone, Copy, Debug)]
pub struct Instant {
    /// Water density, kg/m³.
    pub rho: f64,
    /// Water temperature, °C.
    pub temperature: f64,
    /// Time since the start of the trial, day.
    pub day: f64,
    /// True roll, rad.
    pub roll: f64,
    /// Whether the flow is separated (hysteretic stall).
    pub separated: bool,
    /// Factor on CD0.
    pub drag: f64,
}

fn softplus(x: f64, width: f64) -> f64 {
    let r = x / width;
    if r > 30.0 {
        x
    } else if r < -30.0 {
        0.0
    } else {
        width * libm::log1p(libm::exp(r))
    }
}

/// Kinematic viscosity of fresh water relative to 10 °C (fit to handbook values 1.57e-6 at 4 °C, 1.00e-6 at 20 °C).
fn relative_viscosity(temperature: f64) -> f64 {
    libm::exp(-0.0272 * (temperature - 10.0))
}

impl Nature {
    /// The vehicle of the file with its calibration scatter.
    #[must_use]
    pub fn new(nominal: &Nominal, scatter: &Scatter) -> Self {
        let [cd0, slope, quadratic, trim_cc, gain, pitch_zero, eps, alpha_t, k1, k2, battery_zero] = scatter.values;
        Self {
            mass: nominal.mass_kg,
            volume: nominal.hull_volume_m3 + trim_cc * 1e-6,
            compressibility: nominal.compressibility * (1.0 + eps),
            compressibility_slope: 0.0,
            thermal_expansion: nominal.thermal_expansion * (1.0 + alpha_t),
            thermal_slope: 0.0,
            reference_temperature: nominal.reference_temperature_degc,
            ballast_gain: gain,
            pitch_zero,
            pitch_scale: 0.0,
            battery_zero,
            area: nominal.area_m2,
            lift_slope: nominal.lift_slope() * (1.0 + slope),
            lift_quadratic: nominal.lift_quadratic * (1.0 + quadratic),
            zero_lift: 0.0,
            zero_lift_hull: 0.0,
            cd0: nominal.cd0 * (1.0 + cd0),
            induced_k: nominal.induced_k,
            hull_drag: nominal.hull_drag,
            added_mass: [nominal.added_mass[0] + k1, nominal.added_mass[1] + k2],
            vortex: None,
            side_edge: None,
            reynolds: None,
            stall: None,
            fouling: None,
            roll_drag: [0.0, 2.0],
            climb_drag: 0.0,
            density_bias: 0.0,
            pressure_drift: 0.0,
            off: OffCatalogue::default(),
            banking: None,
            small: None,
        }
    }

    /// The same vehicle, hidden effects included, with another calibration scatter.
    #[must_use]
    pub fn rescattered(&self, from: &Scatter, to: &Scatter) -> Self {
        let (a, b) = (&from.values, &to.values);
        let ratio = |i: usize| (1.0 + b[i]) / (1.0 + a[i]);
        let step = |i: usize| b[i] - a[i];
        let mut v = self.clone();
        v.cd0 *= ratio(0);
        v.lift_slope *= ratio(1);
        v.lift_quadratic *= ratio(2);
        v.volume += step(3) * 1e-6;
        v.ballast_gain += step(4);
        v.pitch_zero += step(5);
        v.compressibility *= ratio(6);
        v.thermal_expansion *= ratio(7);
        v.added_mass[0] += step(8);
        v.added_mass[1] += step(9);
        v.battery_zero += step(10);
        v
    }

    /// Displaced volume, m³, at gauge pressure (Pa), hull temperature (°C) and ballast reading (m³).
    #[must_use]
    pub fn displaced(&self, pressure: f64, hull_temperature: f64, ballast: f64) -> f64 {
        let dt = hull_temperature - self.reference_temperature;
        let squeeze = self.compressibility * pressure * (1.0 + self.compressibility_slope * pressure * 1e-6);
        let swell = self.thermal_expansion * dt * (1.0 + self.thermal_slope * dt);
        let air = self.off.trapped_air_m3 / (1.0 + pressure.max(0.0) / 101_325.0);
        self.volume * (1.0 - squeeze + swell) + ballast * (1.0 + self.ballast_gain) + air
    }

    /// Lift in the vertical plane and drag, N, at angle of attack (rad) and speed (m/s); `climb` is the rate of climb through the water, m/s.
    #[must_use]
    pub fn lift_and_drag(&self, alpha: f64, speed: f64, climb: f64, at: &Instant) -> (f64, f64) {
        let q = 0.5 * at.rho * self.area * speed * speed;
        let upright = if self.banking == Some(Banking::Tilts) { libm::cos(at.roll) } else { 1.0 };
        let edge = ALPHA_END_RAD.copysign(alpha);
        if alpha.abs() <= ALPHA_END_RAD {
            let (cl, cd) = self.coefficients(alpha, speed, climb, at);
            return (q * cl * upright, q * cd);
        }
        let (cl, cd) = self.coefficients(edge, speed, climb, at);
        let (sin_e, cos_e, sin_a, cos_a) = (libm::sin(edge), libm::cos(edge), libm::sin(alpha), libm::cos(alpha));
        let (normal_e, axial_e) = (cl * cos_e + cd * sin_e, cd * cos_e - cl * sin_e);
        let backwards = cos_a < 0.0 && sin_a.abs() < sin_e.abs();
        let normal = if backwards {
            normal_e * sin_a / sin_e
        } else {
            let crossflow = (sin_a * sin_a - sin_e * sin_e) / (cos_e * cos_e);
            normal_e + (BROADSIDE_CN.copysign(alpha) - normal_e) * crossflow
        };
        let axial = axial_e * cos_a / cos_e;
        let (cl, cd) = (normal * cos_a - axial * sin_a, normal * sin_a + axial * cos_a);
        (q * cl * upright, q * cd)
    }

    fn coefficients(&self, alpha: f64, speed: f64, climb: f64, at: &Instant) -> (f64, f64) {
        let a = alpha - self.zero_lift;
        let size = a.abs();
        // Stalled flow gives the lift of a smaller angle.
        let mut linear = a;
        if let Some(s) = &self.stall {
            let angle = if at.separated { s.angle - s.hysteresis } else { s.angle };
            let lost = s.loss * softplus(size - angle, s.width);
            linear -= lost.copysign(a);
        }
        let cl = self.lift_slope * linear + self.lift_quadratic * linear * linear.abs();
        let mut cd0 = self.cd0 * at.drag;
        if let Some(r) = &self.reynolds {
            let ratio = speed.max(0.03) / r.reference_speed / if r.viscous { relative_viscosity(at.temperature) } else { 1.0 };
            cd0 *= libm::pow(ratio.clamp(0.2, 4.0), -r.exponent);
        }
        if let Some(f) = &self.fouling {
            let full = f.rate_per_day * f.duration_day;
            cd0 *= 1.0 + full * libm::pow((at.day / f.duration_day).max(0.0), f.power);
        }
        cd0 *= 1.0 + self.climb_drag * 0.5 * (1.0 + libm::tanh(climb / 0.02));
        cd0 *= 1.0 + self.off.bending * (speed * speed - 0.09);
        let mut cd = cd0 + self.induced_k * cl * cl + self.hull_drag * (alpha - self.zero_lift_hull * self.zero_lift).powi(2);
        let roll = at.roll.abs();
        if self.roll_drag[0] != 0.0 && roll > 0.0 {
            cd += self.roll_drag[0] * 0.0625 * libm::pow(roll / 0.25, self.roll_drag[1]);
        }
        cd *= 1.0 + self.off.roll_bias * libm::tanh(at.roll / 0.1);
        let mut normal = 0.0;
        for force in [&self.vortex, &self.side_edge].into_iter().flatten() {
            let e = if force.width > 0.0 {
                softplus(alpha.abs() - force.onset, force.width)
            } else {
                libm::sin((alpha.abs() - force.onset).max(0.0))
            };
            normal += (force.k * libm::pow(e, force.power) * libm::pow(0.1, 2.0 - force.power)).copysign(alpha);
        }
        // A force normal to the plate: lift N cos, drag N sin.
        (cl + normal * libm::cos(alpha), cd + normal * libm::sin(alpha))
    }
}

//! How does the vehicle move under its forces?
//!
//! Body axes x forward, z down, origin at the centre of buoyancy; u, w are
//! relative to the water, q = θ'. Depth z positive down.
//! ```text
//! north' = (u c + w s) cos ψ + U_n      east' = (u c + w s) sin ψ + U_e      z' = −u s + w c + W     (s, c = sin θ, cos θ)
//! | m+m1    0      m z_g | u'     | −(m+m3) w q + m x_g q² + X − F s                                         |
//! | 0       m+m3  −m x_g | w'  =  |  (m+m1) u q + m z_g q² + Z + F c                                         |
//! | m z_g  −m x_g  I     | q'     | −m z_g w q − m x_g u q − m g (z_g s + x_g c) + (K_0 V² + K u w) + K_q q V − K_qq q|q| |
//! F = (m − ρ V) g + what holds or drags;  m x_g = m_b x_b − ρ V_b x_bal
//! r' = (V κ(fin) − r)(V/l + 0.05)        roll = list + k κ
//! ```
//! K is net of the Munk moment. In a current that changes with depth the
//! relative velocity also feels −U_z z'. A vertical water acceleration carries
//! the neutrally buoyant vehicle along (Froude–Krylov) and does not appear.
//!
//! Sources: Graver (2005) and Leonard & Graver (2001) as restated in the
//! project's notes; K_qq by strip theory. Integrated by the classical
//! Runge-Kutta method of order 4; steps end where an actuator starts or stops,
//! so that the order is kept ([`crate::world`]).

use crate::effects::{Effect, EffectKind as E};
use crate::forces::Law;
use crate::ocean::{Column, GRAVITY_M_S2, Water};
use crate::scenario::Scenario;
use crate::vehicle::Aero;

/// Waterplane area of the floating hull, m². A tenth of the true one (guess): the float is softer than the real one so that
/// half-second steps resolve it.
const WATERPLANE_M2: f64 = 0.03;
/// Damping of heave and surge while floating, N s/m (guess: settles in a few swings).
const FLOAT_DAMPING: f64 = 80.0;
/// Stiffness and damping of bottom, ice and net, N/m and N s/m (guess: centimetres under the pump's drive).
const CONTACT: (f64, f64) = (400.0, 150.0);
/// Quadratic pitch damping, N m s²: ½ρ C_dc d L⁴/32 with C_dc 1.1, d 0.213 m, L 1.5 m.
const PITCH_DAMPING_QUADRATIC: f64 = 18.5;
/// Fin angle of the tightest turn, rad (Slocum's hard-over).
const FIN_FULL_RAD: f64 = 0.45;

/// State vector: north, east, depth (m), pitch (rad), u, w (m/s), q (rad/s), heading (rad), turn rate (rad/s).
pub(crate) type State = [f64; 9];

/// Constants of the vehicle with its effects.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub(crate) law: Law,
    pub(crate) hull_volume_m3: f64,
    pub(crate) compressibility: f64,
    pub(crate) expansion: f64,
    pub(crate) reference_temperature: f64,
    pub(crate) added_surge: f64,
    pub(crate) added_heave: f64,
    pub(crate) inertia: f64,
    pub(crate) zg: f64,
    pub(crate) battery_mass: f64,
    pub(crate) ballast_arm: f64,
    pub(crate) curvature_full: f64,
    /// Sine of the fin angle of the tightest turn.
    fin_full_sin: f64,
    pub(crate) yaw_length: f64,
    pub(crate) roll_per_curvature: f64,
    pub(crate) fin_area: f64,
    pub(crate) turn_drag: f64,
}

impl Body {
    /// A vehicle ballasted to float freely in the water it was trimmed in, of this density; its effects do not change the trim.
    pub(crate) fn ballasted(scenario: &Scenario, trim: &Water, trim_rho: f64) -> Self {
        let (v, effects) = (&scenario.vehicle, &scenario.effects);
        let sum = |k| Effect::sum(effects, k);
        let stretch = 1.0 - v.compressibility_per_pa * trim.pressure_pa
            + v.thermal_expansion_per_k * (trim.temperature - v.reference_temperature_degc);
        Self {
            law: Law::new(v.aero.unwrap_or_else(|| Aero::of(scenario.wings)), effects),
            hull_volume_m3: v.mass_kg / trim_rho / stretch,
            compressibility: v.compressibility_per_pa * (1.0 + sum(E::HullCompressibility)),
            expansion: v.thermal_expansion_per_k * (1.0 + sum(E::ThermalExpansion)),
            reference_temperature: v.reference_temperature_degc,
            added_surge: v.added_mass_surge_kg + sum(E::AddedMass) * v.mass_kg,
            added_heave: v.added_mass_heave_kg + sum(E::HeaveAddedMass) * v.mass_kg,
            inertia: v.inertia_kg_m2,
            zg: v.metacentric_height_m,
            battery_mass: v.battery_mass_kg,
            ballast_arm: v.ballast_arm_m,
            curvature_full: 1.0 / v.turn_radius_m,
            fin_full_sin: FIN_FULL_RAD.sin(),
            yaw_length: v.yaw_length_m,
            roll_per_curvature: v.roll_per_curvature_rad_m,
            fin_area: v.fin_area_m2,
            turn_drag: v.turn_drag_m4,
        }
    }
}

/// A quantity that moves linearly during one step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Ramp {
    pub(crate) start: f64,
    pub(crate) rate: f64,
}

impl Ramp {
    fn at(self, dt: f64) -> f64 {
        self.start + self.rate * dt
    }
}

/// What acts during one step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inputs {
    pub(crate) ballast: Ramp,
    pub(crate) battery: Ramp,
    pub(crate) fin: Ramp,
    /// Background vertical water motion, down positive, m/s.
    pub(crate) background: Ramp,
    pub(crate) mass: f64,
    /// Constant extra displaced volume, m³.
    pub(crate) extra_volume: f64,
    /// Trapped air at the surface, m³.
    pub(crate) air: f64,
    /// Hull temperature when it lags the water, °C.
    pub(crate) hull_temperature: Option<f64>,
    /// Flooded volume (m³) and density of the water in it.
    pub(crate) flooded: Option<(f64, f64)>,
    pub(crate) drag_factor: f64,
    pub(crate) wing_share: f64,
    pub(crate) list: f64,
    /// Turn curvature from a lost wing or the like, 1/m.
    pub(crate) curvature_bias: f64,
    /// Extra force down, N.
    pub(crate) pull: f64,
    /// Held at this depth (net, mud).
    pub(crate) held: Option<f64>,
    /// Cannot rise above this depth (ice).
    pub(crate) ceiling: f64,
    /// Lens: (depth of its lower edge, change of density).
    pub(crate) lens: Option<(f64, f64)>,
    pub(crate) current: (f64, f64),
    /// Steady vertical water velocity (down positive) of the lowest mode.
    pub(crate) sink: f64,
    /// Internal wave: amplitude (down positive, m/s), angular frequency (rad/s), phase at the step's start (rad).
    pub(crate) wave: (f64, f64, f64),
}

impl Inputs {
    /// Nothing but a vehicle at rest of this mass.
    pub(crate) fn still(mass: f64) -> Self {
        Self {
            ballast: Ramp::default(),
            battery: Ramp::default(),
            fin: Ramp::default(),
            background: Ramp::default(),
            mass,
            extra_volume: 0.0,
            air: 0.0,
            hull_temperature: None,
            flooded: None,
            drag_factor: 1.0,
            wing_share: 1.0,
            list: 0.0,
            curvature_bias: 0.0,
            pull: 0.0,
            held: None,
            ceiling: f64::NEG_INFINITY,
            lens: None,
            current: (0.0, 0.0),
            sink: 0.0,
            wave: (0.0, 0.0, 0.0),
        }
    }

    /// Vertical water velocity (down positive) and lift of the isopycnals at depth `z`.
    pub(crate) fn vertical_water(&self, z: f64, dt: f64, bottom: f64) -> (f64, f64) {
        let mut w = self.background.at(dt);
        let mut lifted = 0.0;
        if self.sink != 0.0 || self.wave.0 != 0.0 {
            let mode = (std::f64::consts::PI * (z / bottom).clamp(0.0, 1.0)).sin();
            let (s, c) = (self.wave.2 + self.wave.1 * dt).sin_cos();
            w += mode * (self.sink + self.wave.0 * c);
            if self.wave.1 > 0.0 {
                lifted = -mode * self.wave.0 / self.wave.1 * s;
            }
        }
        (w, lifted)
    }
}

impl Body {
    /// Displaced volume without the ballast tank, m³.
    pub(crate) fn volume(&self, pressure_pa: f64, temperature: f64) -> f64 {
        self.hull_volume_m3 * (1.0 - self.compressibility * pressure_pa + self.expansion * (temperature - self.reference_temperature))
    }

    /// Turn curvature commanded by a fin angle, 1/m.
    fn curvature(&self, fin: f64) -> f64 {
        self.curvature_full * fin.sin() / self.fin_full_sin
    }

    /// Roll in a turn, rad.
    pub(crate) fn roll(&self, list: f64, y: &State) -> f64 {
        let v = (y[4] * y[4] + y[5] * y[5]).sqrt();
        list + (self.roll_per_curvature * y[8] / (v + 0.02)).clamp(-0.6, 0.6)
    }

    /// Time derivative of the state, `dt` after the step's start.
    pub(crate) fn derivative(&self, column: &Column, i: &Inputs, dt: f64, y: &State) -> State {
        let [_, _, z, theta, u, w, q, psi, r] = *y;
        let (s, c) = theta.sin_cos();
        let (sin_psi, cos_psi) = psi.sin_cos();
        let (w_water, lifted) = i.vertical_water(z, dt, column.depth_m);
        let water = column.at(z, lifted);
        let mut rho = water.rho;
        if let Some((edge, change)) = i.lens {
            // A metre thick interface.
            rho += change * (0.5 - (z - edge)).clamp(0.0, 1.0);
        }
        let ballast = i.ballast.at(dt);
        let mut volume = self.volume(water.pressure_pa, i.hull_temperature.unwrap_or(water.temperature)) + ballast + i.extra_volume;
        if i.air > 0.0 {
            volume += i.air * 101_325.0 / (101_325.0 + water.pressure_pa);
        }
        if z < 0.0 {
            volume -= (-z * WATERPLANE_M2).min(volume);
        }
        let z_dot = -u * s + w * c + w_water;
        let mut down = (i.mass - rho * volume) * GRAVITY_M_S2 + i.pull;
        if let Some((v, rho_inside)) = i.flooded {
            down += v * (rho_inside - rho) * GRAVITY_M_S2;
        }
        let mut grip = 0.0;
        if z < 0.0 {
            let wet = (-z / 0.01).min(1.0) * FLOAT_DAMPING;
            down -= wet * z_dot;
            grip += wet;
        }
        let (stiff, damp) = CONTACT;
        if z > column.depth_m {
            down -= stiff * (z - column.depth_m) + damp * z_dot.max(0.0);
            grip += damp;
        }
        if z < i.ceiling {
            down += stiff * (i.ceiling - z) - damp * z_dot.min(0.0);
            grip += damp;
        }
        if let Some(at) = i.held {
            down -= stiff * (z - at) + damp * z_dot;
            grip += damp;
        }
        let fin = i.fin.at(dt);
        let v2 = u * u + w * w;
        let v = v2.sqrt();
        let kappa = r / (v + 0.02);
        let roll = i.list + (self.roll_per_curvature * kappa).clamp(-0.6, 0.6);
        let extra = self.fin_area * fin * fin + self.turn_drag * kappa * kappa + self.law.roll_drag_m2 * roll * roll;
        let f = self.law.forces(rho, u, w, i.drag_factor, extra, i.wing_share);
        let a = &self.law.aero;

        let m = i.mass;
        let mxg = self.battery_mass * i.battery.at(dt) - rho * ballast * self.ballast_arm;
        let mzg = m * self.zg;
        let (m1, m3) = (m + self.added_surge, m + self.added_heave);
        let x = -m3 * w * q + mxg * q * q + f.x_n - down * s - grip * u;
        let zz = m1 * u * q + mzg * q * q + f.z_n * (1.0 - 0.5 * roll * roll) + down * c;
        let mm = -mzg * w * q - mxg * u * q - GRAVITY_M_S2 * (mzg * s + mxg * c)
            + a.moment_zero * v2
            + a.moment_slope * u * w
            + a.moment_rate * q * v
            - PITCH_DAMPING_QUADRATIC * q * q.abs();
        let (b, d) = (mzg, -mxg);
        let q_dot = (mm - b * x / m1 - d * zz / m3) / (self.inertia - b * b / m1 - d * d / m3);
        let shear = (water.north_z * cos_psi + water.east_z * sin_psi) * z_dot;
        let u_dot = (x - b * q_dot) / m1 - shear * c;
        let w_dot = (zz - d * q_dot) / m3 - shear * s;
        let ahead = u * c + w * s;
        let r_dot = (v * (self.curvature(fin) + i.curvature_bias) - r) * (v / self.yaw_length + 0.05);
        [ahead * cos_psi + water.north + i.current.0, ahead * sin_psi + water.east + i.current.1, z_dot, q, u_dot, w_dot, q_dot, r, r_dot]
    }

    /// One Runge-Kutta step of length `h`.
    pub(crate) fn step(&self, column: &Column, i: &Inputs, h: f64, y: &State) -> State {
        let along = |k: &State, by: f64| -> State { std::array::from_fn(|n| y[n] + by * k[n]) };
        let k1 = self.derivative(column, i, 0.0, y);
        let k2 = self.derivative(column, i, 0.5 * h, &along(&k1, 0.5 * h));
        let k3 = self.derivative(column, i, 0.5 * h, &along(&k2, 0.5 * h));
        let k4 = self.derivative(column, i, h, &along(&k3, h));
        std::array::from_fn(|n| y[n] + h / 6.0 * (k1[n] + 2.0 * (k2[n] + k3[n]) + k4[n]))
    }
}

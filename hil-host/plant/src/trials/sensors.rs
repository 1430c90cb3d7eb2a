//! What the log shows of what happened: sampling, noise, resolution, gaps, spikes, outages, GPS at the surface.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::vehicle::{Nominal, Scatter};
use super::voyage::{Moment, Orders, STEP_S, Voyage};

/// One row of `flight.csv`; NaN is an empty field.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// s.
    pub time_s: f64,
    /// 0..7.
    pub segment: usize,
    /// dbar.
    pub pressure_dbar: f64,
    /// rad.
    pub pitch_rad: f64,
    /// rad.
    pub roll_rad: f64,
    /// rad, 0..2 pi.
    pub heading_rad: f64,
    /// cm³.
    pub ballast_cc: f64,
    /// m.
    pub battery_m: f64,
    /// °C.
    pub temperature_degc: f64,
    /// kg/m³.
    pub density_kg_m3: f64,
    /// m, east and north.
    pub gps_m: [f64; 2],
    /// m/s.
    pub speed_m_s: f64,
    /// Not in the log: depth that the true relative velocity and the missing effects' water motion give, m (no background).
    pub known_depth_m: f64,
    /// Not in the log: the part of it that the missing effects' water motion gives, m.
    pub stirred_depth_m: f64,
}

/// Frequencies of defects per sample, after the format's examples.
const MISSING: f64 = 0.004;
const PRESSURE_SPIKE: f64 = 0.0008;
const PITCH_SPIKE: f64 = 0.0012;
const DENSITY_SPIKE: f64 = 0.0005;
const SPEED_SPIKE: f64 = 0.002;
/// Speed samples without a lock.
const SPEED_MISSING: f64 = 0.03;

/// Constant errors of one log.
#[derive(Clone, Copy, Debug)]
pub struct Zero {
    /// Pressure zero, dbar.
    pub pressure_dbar: f64,
}

fn at_resolution(x: f64, step: f64) -> f64 {
    (x / step).round() * step
}

/// Samples one segment.
pub fn sample(
    voyage: &Voyage<'_>,
    scatter: &Scatter,
    zero: Zero,
    segment: usize,
    orders: &Orders,
    moments: &[Moment],
    rng: &mut ChaCha8Rng,
) -> Vec<Row> {
    let nominal: &Nominal = voyage.nominal;
    let nature = voyage.nature;
    let s = &nominal.sensors;
    let normal = |rng: &mut ChaCha8Rng| rng.sample::<f64, _>(StandardNormal);
    let duration = moments.last().map_or(0.0, |m| m.t);
    // About one CTD outage of a minute per two segments of lake, more at sea; fixed count keeps them rare.
    let mut outages: Vec<(f64, f64)> = Vec::new();
    if rng.random_bool(0.35) {
        let from = rng.random_range(0.1..0.85) * duration;
        outages.push((from, from + rng.random_range(45.0..75.0)));
    }
    let descended = moments.iter().position(|m| !m.floating).unwrap_or(0);
    let surfaced = moments.iter().rposition(|m| !m.floating).map_or(duration, |i| moments[i].t);
    let launched = moments.get(descended).map_or(0.0, |m| m.t);
    let mut next_fix = 0.0;
    let mut rows = Vec::with_capacity((duration / s.period_s) as usize + 2);
    let jitter = 0.04 * s.period_s;
    let count = (duration / s.period_s) as usize;
    // The moments before and after a time, and where it lies between them.
    let at = |t: f64| {
        let x = (t / step_of(moments)).clamp(0.0, (moments.len() - 1) as f64);
        let k = (x as usize).min(moments.len().saturating_sub(2));
        (&moments[k], &moments[k + 1], x - k as f64)
    };
    for i in 0..=count {
        let t = (i as f64 * s.period_s + if i == 0 { 0.0 } else { rng.random_range(-jitter..jitter) }).clamp(0.0, duration);
        let t = (t / 0.05).round() * 0.05;
        let (a, b, f) = at(t);
        let mix = |p: f64, q: f64| p + (q - p) * f;
        let day = (orders.start_s + t) / 86_400.0;
        let mut pressure = mix(a.pressure, b.pressure) / 1e4
            + zero.pressure_dbar
            + nature.pressure_drift * day
            + s.pressure_dbar[0] * normal(rng) * if a.floating { 0.9 } else { 1.0 };
        if rng.random_bool(PRESSURE_SPIKE) {
            pressure += rng.random_range(2.5..7.0) * if rng.random_bool(0.6) { 1.0 } else { -1.0 };
        }
        // What the flight computer reads, by a clock of its own.
        let (c, d, g) = at(t - nature.small.as_ref().map_or(0.0, |small| small.clock_lag_s));
        let mix_read = |p: f64, q: f64| p + (q - p) * g;
        let heading = mix_read(c.heading, d.heading);
        let mut pitch =
            voyage.measured_pitch(mix_read(c.pitch, d.pitch), heading, mix_read(c.pressure, d.pressure)) + s.pitch_rad[0] * normal(rng);
        if rng.random_bool(PITCH_SPIKE) {
            pitch += rng.random_range(0.25..0.75) * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        }
        let cell_error = nature.off.cell_gain * (mix(a.cell_temperature, b.cell_temperature) - mix(a.temperature, b.temperature));
        let mut density = mix(a.density, b.density) + nature.density_bias + cell_error + 0.005 * normal(rng);
        if rng.random_bool(DENSITY_SPIKE) {
            density += rng.random_range(0.5..1.3) * if rng.random_bool(0.7) { 1.0 } else { -1.0 };
        }
        let temperature = mix(a.temperature, b.temperature) + 0.005 * normal(rng);
        let speed_true = mix(libm::hypot(a.velocity[0], a.velocity[1]), libm::hypot(b.velocity[0], b.velocity[1]));
        let mut speed = match s.speed_m_s {
            Some(noise) if !a.floating => speed_true * (1.0 + scatter.speed_scale) + noise * normal(rng),
            _ => f64::NAN,
        };
        if rng.random_bool(SPEED_SPIKE) {
            speed += rng.random_range(0.25..0.6) * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        }
        if rng.random_bool(SPEED_MISSING) {
            speed = f64::NAN;
        }
        let afloat = a.floating && (t <= launched + 0.5 || t >= surfaced);
        let mut gps = [f64::NAN; 2];
        if afloat && t >= next_fix {
            gps = core::array::from_fn(|i| mix(a.position[i], b.position[i]) + s.gps_m * normal(rng));
            next_fix = t + 8.0 - 0.6 * s.period_s.min(2.0);
        }
        let lost = outages.iter().any(|&(from, to)| t >= from && t < to);
        let gone = |x: f64, rng: &mut ChaCha8Rng| if rng.random_bool(MISSING) { f64::NAN } else { x };
        let heading_measured = (heading + scatter.heading_bias_rad + s.heading_rad * normal(rng)).rem_euclid(core::f64::consts::TAU);
        let row = Row {
            time_s: orders.start_s + t,
            segment,
            pressure_dbar: gone(at_resolution(pressure, s.pressure_dbar[1]), rng),
            pitch_rad: gone(at_resolution(pitch, s.pitch_rad[1]), rng),
            roll_rad: at_resolution(mix_read(c.roll, d.roll) + 0.0087 * normal(rng), 0.001_745),
            heading_rad: (heading_measured * 1000.0).floor() / 1000.0,
            ballast_cc: (mix_read(c.ballast, d.ballast) * 1e6 + 0.5 * normal(rng)).round(),
            battery_m: mix_read(c.battery, d.battery) + 1e-4 * normal(rng),
            temperature_degc: if lost { f64::NAN } else { gone(temperature, rng) },
            density_kg_m3: if lost { f64::NAN } else { gone(density, rng) },
            gps_m: gps,
            speed_m_s: speed,
            known_depth_m: mix(a.known_depth, b.known_depth),
            stirred_depth_m: mix(a.stirred_depth, b.stirred_depth),
        };
        rows.push(row);
    }
    rows
}

fn step_of(moments: &[Moment]) -> f64 {
    moments.get(1).map_or(STEP_S, |m| m.t)
}

//! What the log shows of what happened: sampling, noise, resolution, gaps, spikes, outages, GPS at the surface.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::orders::Orders;
use super::vehicle::Scatter;
use super::voyage::{Moment, STEP_S, Voyage};

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

/// One segment as it is sampled: what was flown, and the errors of this log.
struct Log<'a> {
    voyage: &'a Voyage<'a>,
    scatter: &'a Scatter,
    zero: Zero,
    start_s: f64,
    moments: &'a [Moment],
}

/// Two moments next to a time, and where it lies between them.
struct Between<'a> {
    before: &'a Moment,
    after: &'a Moment,
    share: f64,
}

impl Between<'_> {
    fn mix(&self, of: impl Fn(&Moment) -> f64) -> f64 {
        let (p, q) = (of(self.before), of(self.after));
        p + (q - p) * self.share
    }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    rng.sample::<f64, _>(StandardNormal)
}

fn sign(rng: &mut ChaCha8Rng, positive: f64) -> f64 {
    if rng.random_bool(positive) { 1.0 } else { -1.0 }
}

/// A value that is sometimes missing.
fn or_missing(x: f64, rng: &mut ChaCha8Rng) -> f64 {
    if rng.random_bool(MISSING) { f64::NAN } else { x }
}

/// CTD outages of a minute, s: about one per two segments of lake, more at sea; fixed count keeps them rare.
fn draw_outage(duration: f64, rng: &mut ChaCha8Rng) -> Option<(f64, f64)> {
    if !rng.random_bool(0.35) {
        return None;
    }
    let from = rng.random_range(0.1..0.85) * duration;
    Some((from, from + rng.random_range(45.0..75.0)))
}

impl Log<'_> {
    fn at(&self, t: f64) -> Between<'_> {
        let x = (t / step_of(self.moments)).clamp(0.0, (self.moments.len() - 1) as f64);
        let k = (x as usize).min(self.moments.len().saturating_sub(2));
        Between { before: &self.moments[k], after: &self.moments[k + 1], share: x - k as f64 }
    }

    fn pressure_dbar(&self, t: f64, now: &Between<'_>, rng: &mut ChaCha8Rng) -> f64 {
        let s = &self.voyage.nominal.sensors;
        let day = (self.start_s + t) / 86_400.0;
        let calm = if now.before.floating { 0.9 } else { 1.0 };
        let mut pressure = now.mix(|m| m.pressure) / 1e4
            + self.zero.pressure_dbar
            + self.voyage.nature.pressure_drift * day
            + s.pressure_dbar[0] * normal(rng) * calm;
        if rng.random_bool(PRESSURE_SPIKE) {
            pressure += rng.random_range(2.5..7.0) * sign(rng, 0.6);
        }
        pressure
    }

    fn pitch_rad(&self, read: &Between<'_>, heading: f64, rng: &mut ChaCha8Rng) -> f64 {
        let s = &self.voyage.nominal.sensors;
        let mut pitch = self.voyage.measured_pitch(read.mix(|m| m.pitch), heading, read.mix(|m| m.pressure)) + s.pitch_rad[0] * normal(rng);
        if rng.random_bool(PITCH_SPIKE) {
            pitch += rng.random_range(0.25..0.75) * sign(rng, 0.5);
        }
        pitch
    }

    fn density_kg_m3(&self, now: &Between<'_>, rng: &mut ChaCha8Rng) -> f64 {
        let nature = self.voyage.nature;
        let cell_error = nature.off.cell_gain * (now.mix(|m| m.cell_temperature) - now.mix(|m| m.temperature));
        let mut density = now.mix(|m| m.density) + nature.density_bias + cell_error + 0.005 * normal(rng);
        if rng.random_bool(DENSITY_SPIKE) {
            density += rng.random_range(0.5..1.3) * sign(rng, 0.7);
        }
        density
    }

    fn speed_m_s(&self, now: &Between<'_>, rng: &mut ChaCha8Rng) -> f64 {
        let speed_true = now.mix(|m| libm::hypot(m.velocity[0], m.velocity[1]));
        let mut speed = match self.voyage.nominal.sensors.speed_m_s {
            Some(noise) if !now.before.floating => speed_true * (1.0 + self.scatter.speed_scale) + noise * normal(rng),
            _ => f64::NAN,
        };
        if rng.random_bool(SPEED_SPIKE) {
            speed += rng.random_range(0.25..0.6) * sign(rng, 0.5);
        }
        if rng.random_bool(SPEED_MISSING) {
            speed = f64::NAN;
        }
        speed
    }
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
    let log = Log { voyage, scatter, zero, start_s: orders.start_s, moments };
    let s = &voyage.nominal.sensors;
    let clock_lag_s = voyage.nature.small.as_ref().map_or(0.0, |small| small.clock_lag_s);
    let duration = moments.last().map_or(0.0, |m| m.t);
    let outage = draw_outage(duration, rng);
    let descended = moments.iter().position(|m| !m.floating).unwrap_or(0);
    let surfaced = moments.iter().rposition(|m| !m.floating).map_or(duration, |i| moments[i].t);
    let launched = moments.get(descended).map_or(0.0, |m| m.t);
    let mut next_fix = 0.0;
    let mut rows = Vec::with_capacity((duration / s.period_s) as usize + 2);
    let jitter = 0.04 * s.period_s;
    let count = (duration / s.period_s) as usize;
    for i in 0..=count {
        let t = (i as f64 * s.period_s + if i == 0 { 0.0 } else { rng.random_range(-jitter..jitter) }).clamp(0.0, duration);
        let t = (t / 0.05).round() * 0.05;
        let now = log.at(t);
        let pressure = log.pressure_dbar(t, &now, rng);
        // What the flight computer reads, by a clock of its own.
        let read = log.at(t - clock_lag_s);
        let heading = read.mix(|m| m.heading);
        let pitch = log.pitch_rad(&read, heading, rng);
        let density = log.density_kg_m3(&now, rng);
        let temperature = now.mix(|m| m.temperature) + 0.005 * normal(rng);
        let speed = log.speed_m_s(&now, rng);
        let afloat = now.before.floating && (t <= launched + 0.5 || t >= surfaced);
        let mut gps = [f64::NAN; 2];
        if afloat && t >= next_fix {
            gps = core::array::from_fn(|i| now.mix(|m| m.position[i]) + s.gps_m * normal(rng));
            next_fix = t + 8.0 - 0.6 * s.period_s.min(2.0);
        }
        let lost = outage.is_some_and(|(from, to)| t >= from && t < to);
        let heading_measured = (heading + scatter.heading_bias_rad + s.heading_rad * normal(rng)).rem_euclid(core::f64::consts::TAU);
        let row = Row {
            time_s: orders.start_s + t,
            segment,
            pressure_dbar: or_missing(at_resolution(pressure, s.pressure_dbar[1]), rng),
            pitch_rad: or_missing(at_resolution(pitch, s.pitch_rad[1]), rng),
            roll_rad: at_resolution(read.mix(|m| m.roll) + 0.0087 * normal(rng), 0.001_745),
            heading_rad: (heading_measured * 1000.0).floor() / 1000.0,
            ballast_cc: (read.mix(|m| m.ballast) * 1e6 + 0.5 * normal(rng)).round(),
            battery_m: read.mix(|m| m.battery) + 1e-4 * normal(rng),
            temperature_degc: if lost { f64::NAN } else { or_missing(temperature, rng) },
            density_kg_m3: if lost { f64::NAN } else { or_missing(density, rng) },
            gps_m: gps,
            speed_m_s: speed,
            known_depth_m: now.mix(|m| m.known_depth),
            stirred_depth_m: now.mix(|m| m.stirred_depth),
        };
        rows.push(row);
    }
    rows
}

fn step_of(moments: &[Moment]) -> f64 {
    moments.get(1).map_or(STEP_S, |m| m.t)
}

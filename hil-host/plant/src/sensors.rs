//! What do the sensors say?
//!
//! Per channel: `reading = quantise(lag(truth) + bias + noise)`, sampled every
//! `period_s`, missing with probability `dropout`; then the faults.

use crate::faults::{ANALOGUE, Kind, Schedule};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};
use signals::Reading;

/// One sensor channel, SI units of its quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Channel {
    /// Standard deviation of white noise.
    pub noise: f64,
    /// Resolution; 0: continuous.
    pub resolution: f64,
    /// Constant error.
    pub bias: f64,
    /// First-order lag, s.
    pub lag_s: f64,
    /// Sample period, s; 0: sampled when asked.
    pub period_s: f64,
    /// Probability that a sample is missing.
    pub dropout: f64,
    /// Not fitted: never gives anything.
    pub absent: bool,
}

const fn channel(noise: f64, resolution: f64, lag_s: f64) -> Channel {
    Channel { noise, resolution, bias: 0.0, lag_s, period_s: 0.0, dropout: 0.0, absent: false }
}

/// All sensor channels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sensors {
    /// Main depth, m.
    pub depth: Channel,
    /// Second depth, m.
    pub depth2: Channel,
    /// Pitch, rad.
    pub pitch: Channel,
    /// Roll, rad.
    pub roll: Channel,
    /// Heading, rad.
    pub heading: Channel,
    /// Pump position, m³.
    pub ballast: Channel,
    /// Battery position, m.
    pub battery_mass: Channel,
    /// Fin position, rad.
    pub fin: Channel,
    /// Density, kg/m³.
    pub density: Channel,
    /// Height above the bottom, m.
    pub altitude: Channel,
    /// Voltage, V.
    pub voltage: Channel,
    /// Charge, 0..1.
    pub charge: Channel,
    /// Internal pressure, Pa.
    pub vacuum: Channel,
    /// Density with which depth is computed from pressure, kg/m³; none: that for which the vehicle is ballasted.
    pub depth_density_kg_m3: Option<f64>,
    /// Range of the altimeter, m.
    pub altimeter_range_m: f64,
    /// Time at the surface until the first GPS fix, s.
    pub first_fix_s: f64,
    /// Time at the surface until the shore is heard, s.
    pub first_comms_s: f64,
}

impl Default for Sensors {
    /// Slocum-like: noise and resolution of pressure and pitch as in the example flights of the format; the others are guesses.
    fn default() -> Self {
        Self {
            depth: channel(0.02, 0.01, 0.3),
            depth2: channel(0.03, 0.01, 0.5),
            pitch: channel(0.0014, 0.00175, 0.2),
            roll: channel(0.002, 0.00175, 0.2),
            heading: channel(0.02, 0.00175, 0.5),
            ballast: channel(0.3e-6, 0.2e-6, 0.0),
            battery_mass: channel(5e-5, 2e-5, 0.0),
            fin: channel(0.002, 0.001, 0.0),
            density: channel(0.01, 0.001, 1.0),
            altitude: channel(0.1, 0.1, 0.0),
            voltage: channel(0.02, 0.01, 0.0),
            charge: channel(0.0, 0.001, 0.0),
            vacuum: channel(100.0, 50.0, 0.0),
            depth_density_kg_m3: None,
            altimeter_range_m: 50.0,
            first_fix_s: 30.0,
            first_comms_s: 45.0,
        }
    }
}

impl Sensors {
    /// Channels without any error: every reading is the truth.
    #[must_use]
    pub fn perfect() -> Self {
        let mut s = Self::default();
        for c in s.channels_mut() {
            *c = Channel::default();
        }
        s
    }

    /// Every noise, resolution and lag times `factor`.
    #[must_use]
    pub fn worse(mut self, factor: f64) -> Self {
        for c in self.channels_mut() {
            c.noise *= factor;
            c.resolution *= factor;
            c.lag_s *= factor;
        }
        self
    }

    pub(crate) fn channels(&self) -> [Channel; COUNT] {
        let mut copy = *self;
        copy.channels_mut().map(|c| *c)
    }

    /// All of them.
    pub fn channels_mut(&mut self) -> [&mut Channel; COUNT] {
        [
            &mut self.depth,
            &mut self.depth2,
            &mut self.pitch,
            &mut self.roll,
            &mut self.heading,
            &mut self.ballast,
            &mut self.battery_mass,
            &mut self.fin,
            &mut self.density,
            &mut self.altitude,
            &mut self.voltage,
            &mut self.charge,
            &mut self.vacuum,
        ]
    }
}

/// Number of analogue channels, in the order of `ANALOGUE`.
pub const COUNT: usize = ANALOGUE.len();

/// State of one channel.
#[derive(Clone, Debug)]
struct Line {
    channel: Channel,
    lagged: Option<f64>,
    last: Option<(f64, f64)>,
    frozen: Option<f64>,
    history: Vec<(f64, f64)>,
}

/// All channels with their memory.
#[derive(Clone, Debug)]
pub(crate) struct Suite {
    lines: Vec<Line>,
    last_time: Option<f64>,
}

impl Suite {
    pub(crate) fn new(sensors: &Sensors) -> Self {
        let line = |channel| Line { channel, lagged: None, last: None, frozen: None, history: Vec::new() };
        Self { lines: sensors.channels().into_iter().map(line).collect(), last_time: None }
    }

    /// Reads all channels at `now`; `None` in `truth`: nothing to see (altimeter out of range).
    pub(crate) fn read(&mut self, now: f64, truth: [Option<f64>; COUNT], faults: &Schedule, rng: &mut ChaCha8Rng) -> [Reading; COUNT] {
        let dt = self.last_time.map_or(f64::INFINITY, |t| now - t);
        self.last_time = Some(now);
        std::array::from_fn(|i| {
            let reading = self.lines[i].read(now, dt, truth[i], rng);
            if faults.is_empty() { reading } else { self.lines[i].fail(i, now, reading, faults, rng) }
        })
    }
}

impl Line {
    fn read(&mut self, now: f64, dt: f64, truth: Option<f64>, rng: &mut ChaCha8Rng) -> Reading {
        let c = self.channel;
        let Some(truth) = truth.filter(|_| !c.absent) else {
            self.lagged = None;
            return Reading::Missing;
        };
        let lagged = match self.lagged {
            Some(old) if c.lag_s > 0.0 => truth + (old - truth) * (-dt / c.lag_s).exp(),
            _ => truth,
        };
        self.lagged = Some(lagged);
        if let Some((value, at)) = self.last.filter(|(_, at)| c.period_s > 0.0 && now - at < c.period_s) {
            return sampled(value, now - at);
        }
        let noise: f64 = if c.noise > 0.0 { StandardNormal.sample(rng) } else { 0.0 };
        let mut value = lagged + c.bias + c.noise * noise;
        if c.resolution > 0.0 {
            value = (value / c.resolution).round() * c.resolution;
        }
        if c.dropout > 0.0 && rng.random::<f64>() < c.dropout {
            return Reading::Missing;
        }
        self.last = Some((value, now));
        sampled(value, 0.0)
    }

    fn fail(&mut self, index: usize, now: f64, healthy: Reading, faults: &Schedule, rng: &mut ChaCha8Rng) -> Reading {
        let (target, [_, _, large]) = ANALOGUE[index];
        let mut reading = healthy;
        let mut stuck = false;
        for (fault, since) in faults.active(now).filter(|(f, _)| f.target == target) {
            let size = fault.size;
            let shifted = |by: f64| match healthy {
                Reading::Sampled { value, age_ms } => Reading::Sampled { value: (f64::from(value) + by) as f32, age_ms },
                Reading::Missing => Reading::Missing,
            };
            reading = match fault.kind {
                Kind::Off => Reading::Missing,
                Kind::Stuck => {
                    stuck = true;
                    if self.frozen.is_none() {
                        self.frozen = match healthy {
                            Reading::Sampled { value, .. } => Some(f64::from(value)),
                            Reading::Missing => None,
                        };
                    }
                    self.frozen.map_or(Reading::Missing, |v| Reading::now(v as f32))
                }
                Kind::Slow | Kind::Delayed => {
                    if let Reading::Sampled { value, age_ms } = healthy {
                        let keep = self.history.last().is_none_or(|(at, _)| fault.kind == Kind::Delayed || now - at >= size);
                        if keep {
                            self.history.push((now - f64::from(age_ms) * 1e-3, f64::from(value)));
                        }
                    }
                    let old = if fault.kind == Kind::Slow { 0.0 } else { size };
                    while self.history.len() > 1 && self.history[1].0 <= now - old {
                        self.history.remove(0);
                    }
                    match self.history.first() {
                        Some((at, value)) if now - at >= old => sampled(*value, now - at),
                        _ => Reading::Missing,
                    }
                }
                Kind::Intermittent if rng.random::<f64>() < size => Reading::Missing,
                Kind::Garbage => Reading::now((large.abs() * 20.0 * (2.0 * rng.random::<f64>() - 1.0)) as f32),
                Kind::Bias => shifted(size),
                Kind::Drift => shifted(size * since / 3600.0),
                Kind::Spike if rng.random::<f64>() < 0.05 => shifted(size),
                Kind::Nan => Reading::now(f32::NAN),
                Kind::Inf => Reading::now(f32::INFINITY),
                Kind::Sentinel => Reading::now(9999.0),
                Kind::Flip => match healthy {
                    Reading::Sampled { value, age_ms } => Reading::Sampled { value: -value, age_ms },
                    Reading::Missing => Reading::Missing,
                },
                _ => reading,
            };
        }
        if !stuck {
            self.frozen = None;
        }
        reading
    }
}

fn sampled(value: f64, age_s: f64) -> Reading {
    Reading::Sampled { value: value as f32, age_ms: (age_s * 1e3).round() as u32 }
}

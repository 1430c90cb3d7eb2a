//! A plain reading of the format: nominal model (section 3) driven by the log, block error (section 6.1), and a refit of the
//! calibration quantities inside their tolerances.
//!
//! Serves to size the hidden effects and to show that the generator is right:
//! the example trials' published errors must come out of it, clean cases must
//! fall to their noise floor, and the true vehicle must explain its own flight.

use super::nature::{Instant, Nature};
use super::sensors::Row;
use super::vehicle::{Nominal, Scatter, TOLERANCE};

/// Longest sub-step of the model, s.
const SUB_STEP_S: f64 = 0.5;
/// Length of a block, s (format, section 6.1).
const BLOCK_S: f64 = 20.0;
/// A block is dropped if any sample in it or this long before is shallow, s and m (format, section 6.1).
const AFTER_SURFACE: (f64, f64) = (60.0, 2.0);
/// Parameters refitted: all tolerances but the battery zero, which the measured pitch already contains.
const FITTED: usize = 10;

/// Cleaned columns of one segment.
#[derive(Clone, Debug)]
struct Segment {
    number: usize,
    time: Vec<f64>,
    /// Pressure as measured without spikes, NaN kept.
    dbar: Vec<f64>,
    /// Gap-free inputs.
    pressure_pa: Vec<f64>,
    pitch: Vec<f64>,
    pitch_rate: Vec<f64>,
    roll: Vec<f64>,
    ballast: Vec<f64>,
    temperature: Vec<f64>,
    density: Vec<f64>,
    /// Depth from pressure, m (NaN kept).
    depth: Vec<f64>,
    known_depth: Vec<f64>,
    stirred_depth: Vec<f64>,
}

/// A log prepared for the model.
#[derive(Clone, Debug)]
pub struct Log {
    segments: Vec<Segment>,
}

/// One valid block.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// Segment.
    pub segment: usize,
    /// Observed depth rate, m/s.
    pub observed: f64,
    /// Rate that the missing effects' water motion gives, m/s (NaN for a log without truth).
    pub stirred: f64,
    /// Rate of what was true without the background motion, m/s (NaN for a log without truth).
    pub known: f64,
    /// Model's rate, m/s.
    pub modelled: f64,
}

/// Replaces samples that stand off the median of five by more than `limit` with NaN.
fn without_spikes(x: &[f64], limit: f64) -> Vec<f64> {
    (0..x.len())
        .map(|i| {
            let mut near: Vec<f64> = x[i.saturating_sub(2)..(i + 3).min(x.len())].iter().copied().filter(|v| v.is_finite()).collect();
            near.sort_by(f64::total_cmp);
            let median = near.get(near.len() / 2).copied().unwrap_or(f64::NAN);
            if (x[i] - median).abs() > limit { f64::NAN } else { x[i] }
        })
        .collect()
}

fn filled(t: &[f64], x: &[f64]) -> Vec<f64> {
    let mut out = x.to_vec();
    let known: Vec<usize> = (0..x.len()).filter(|&i| x[i].is_finite()).collect();
    let mut k = 0;
    for i in 0..x.len() {
        if x[i].is_finite() {
            continue;
        }
        while k + 1 < known.len() && known[k + 1] < i {
            k += 1;
        }
        let left = known.get(k).copied().filter(|&j| j < i);
        let right = known.iter().copied().find(|&j| j > i);
        out[i] = match (left, right) {
            (Some(a), Some(b)) => x[a] + (x[b] - x[a]) * (t[i] - t[a]) / (t[b] - t[a]),
            (Some(a), None) => x[a],
            (None, Some(b)) => x[b],
            (None, None) => f64::NAN,
        };
    }
    out
}

fn slope(t: &[f64], x: &[f64]) -> f64 {
    let n = t.len() as f64;
    let (mt, mx) = (t.iter().sum::<f64>() / n, x.iter().sum::<f64>() / n);
    let (mut a, mut b) = (0.0, 0.0);
    for (p, q) in t.iter().zip(x) {
        a += (p - mt) * (q - mx);
        b += (p - mt) * (p - mt);
    }
    a / b
}

impl Log {
    /// Prepares rows.
    #[must_use]
    pub fn new(rows: &[Row], gravity: f64) -> Self {
        let mut segments = Vec::new();
        for number in 0..super::SEGMENTS {
            let part: Vec<&Row> = rows.iter().filter(|r| r.segment == number).collect();
            if part.len() < 10 {
                continue;
            }
            let column = |f: fn(&Row) -> f64| part.iter().map(|r| f(r)).collect::<Vec<f64>>();
            let time = column(|r| r.time_s);
            let dbar = without_spikes(&column(|r| r.pressure_dbar), 1.5);
            let pitch = filled(&time, &without_spikes(&column(|r| r.pitch_rad), 0.15));
            let density = filled(&time, &without_spikes(&column(|r| r.density_kg_m3), 0.3));
            let filled_dbar = filled(&time, &dbar);
            let n = time.len();
            let pitch_rate = (0..n)
                .map(|i| {
                    // Over at least 6 s, so that pitch noise does not become rate.
                    let (mut a, mut b) = (i, i);
                    while time[b] - time[a] < 6.0 && (a > 0 || b + 1 < n) {
                        a = a.saturating_sub(1);
                        b = (b + 1).min(n - 1);
                    }
                    (pitch[b] - pitch[a]) / (time[b] - time[a]).max(1.0)
                })
                .collect();
            let mut depth = Vec::with_capacity(n);
            let (mut z, mut last) = (filled_dbar[0] * 1e4 / (density[0] * gravity), filled_dbar[0]);
            for i in 0..n {
                z += (filled_dbar[i] - last) * 1e4 / (density[i] * gravity);
                last = filled_dbar[i];
                depth.push(if dbar[i].is_finite() { z } else { f64::NAN });
            }
            segments.push(Segment {
                number,
                pressure_pa: filled_dbar.iter().map(|p| p * 1e4).collect(),
                temperature: filled(&time, &column(|r| r.temperature_degc)),
                roll: column(|r| r.roll_rad),
                ballast: column(|r| r.ballast_cc * 1e-6),
                known_depth: column(|r| r.known_depth_m),
                stirred_depth: column(|r| r.stirred_depth_m),
                time,
                dbar,
                pitch,
                pitch_rate,
                density,
                depth,
            });
        }
        Self { segments }
    }

    /// The log less the water motion of the missing effects.
    pub(super) fn without_stirring(mut self) -> Self {
        for s in &mut self.segments {
            s.depth.iter_mut().zip(&s.stirred_depth).for_each(|(z, d)| *z -= d);
        }
        self
    }

    /// Mean density of the water, kg/m³.
    pub(super) fn mean_density(&self) -> f64 {
        let all = || self.segments.iter().flat_map(|s| &s.density);
        all().sum::<f64>() / all().count() as f64
    }

    /// Blocks of the wanted segments under a vehicle.
    #[must_use]
    pub fn blocks(&self, vehicle: &Nature, gravity: f64, wanted: impl Fn(usize) -> bool) -> Vec<Block> {
        let mut out = Vec::new();
        for s in self.segments.iter().filter(|s| wanted(s.number)) {
            let model = s.model_depth(vehicle, gravity);
            let last = *s.time.last().unwrap_or(&0.0);
            let mut from = s.time[0];
            while from < last {
                let to = from + BLOCK_S;
                let inside: Vec<usize> =
                    (0..s.time.len()).filter(|&i| s.time[i] >= from && s.time[i] < to && s.depth[i].is_finite()).collect();
                let first = s.time.iter().copied().find(|&t| t >= from).unwrap_or(from);
                let shallow = (0..s.time.len()).any(|i| {
                    s.time[i] >= first - AFTER_SURFACE.0
                        && s.time[i] < to
                        && s.dbar[i].is_finite()
                        && s.pressure_pa[i] < AFTER_SURFACE.1 * s.density[i] * gravity
                });
                let spans = inside.len() >= 3 && s.time[inside[inside.len() - 1]] - s.time[inside[0]] >= 10.0;
                if spans && !shallow {
                    let pick = |x: &[f64]| inside.iter().map(|&i| x[i]).collect::<Vec<f64>>();
                    let t = pick(&s.time);
                    out.push(Block {
                        segment: s.number,
                        observed: slope(&t, &pick(&s.depth)),
                        known: slope(&t, &pick(&s.known_depth)),
                        stirred: slope(&t, &pick(&s.stirred_depth)),
                        modelled: slope(&t, &pick(&model)),
                    });
                }
                from = to;
            }
        }
        out
    }
}

impl Segment {
    /// Depth by integrating the model's sink rate over the log's instants, m from the first row.
    fn model_depth(&self, v: &Nature, gravity: f64) -> Vec<f64> {
        let n = self.time.len();
        let start_day = 1.0 / 86_400.0;
        let [k1, k2] = v.added_mass;
        let (mu, mn) = (v.mass * (1.0 + k1), v.mass * (1.0 + k2));
        let surface = {
            let mut first: Vec<f64> = (0..n).filter(|&i| self.time[i] < self.time[0] + 15.0).map(|i| self.pressure_pa[i]).collect();
            first.sort_by(f64::total_cmp);
            first[first.len() / 2]
        };
        let (mut u, mut w, mut depth, mut separated) = (0.0_f64, 0.0_f64, 0.0_f64, false);
        let mut out = Vec::with_capacity(n);
        out.push(0.0);
        for i in 0..n - 1 {
            let dt = self.time[i + 1] - self.time[i];
            let steps = (dt / SUB_STEP_S).ceil().max(1.0) as usize;
            let h = dt / steps as f64;
            for k in 0..steps {
                if let Some(stall) = &v.stall {
                    separated = stall.separates(libm::atan2(-w, u).abs(), separated);
                }
                let rate = |f: f64, u: f64, w: f64| -> [f64; 3] {
                    let mix = |x: &[f64]| x[i] + (x[i + 1] - x[i]) * f;
                    let theta = (mix(&self.pitch) - v.pitch_zero) / (1.0 + v.pitch_scale);
                    let q = mix(&self.pitch_rate);
                    let rho = mix(&self.density) - v.density_bias;
                    let temperature = mix(&self.temperature);
                    let pressure = mix(&self.pressure_pa);
                    let (st, ct) = (libm::sin(theta), libm::cos(theta));
                    let sink = -(u * st + w * ct);
                    let speed = libm::hypot(u, w);
                    let alpha = libm::atan2(-w, u);
                    let day = (self.time[i] + f * dt) * start_day;
                    let at = Instant { rho, temperature, day, roll: mix(&self.roll), separated, drag: 1.0 };
                    let (lift, drag) = v.lift_and_drag(alpha, speed, -sink, &at);
                    let b = gravity * (rho * v.displaced(pressure, temperature, mix(&self.ballast)) - v.mass);
                    let (sa, ca) = (libm::sin(alpha), libm::cos(alpha));
                    let fu = -drag * ca + lift * sa + b * st + q * mn * w;
                    let fw = lift * ca + drag * sa + b * ct - q * mu * u;
                    [fu / mu, fw / mn, sink]
                };
                let f = k as f64 / steps as f64;
                let a = rate(f, u, w);
                let m = rate(f + 0.5 / steps as f64, u + 0.5 * h * a[0], w + 0.5 * h * a[1]);
                u += h * m[0];
                w += h * m[1];
                depth += h * m[2];
                // Afloat: carried by the surface.
                let near = self.pressure_pa[i] - surface < 800.0;
                if near && m[2] < 0.0 {
                    (u, w) = (0.0, 0.0);
                }
            }
            out.push(depth);
        }
        out
    }
}

/// Root mean square of observed − modelled.
#[must_use]
pub fn block_error(blocks: &[Block]) -> f64 {
    rms(blocks.iter().map(|b| b.observed - b.modelled))
}

/// Root mean square of observed − known: what a model with the exact truth cannot fall below, m/s.
#[must_use]
pub fn floor(blocks: &[Block]) -> f64 {
    rms(blocks.iter().map(|b| b.observed - b.known))
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for v in values {
        sum += v * v;
        n += 1.0;
    }
    libm::sqrt(sum / n)
}

/// Block error on the check segments of a refit that is told the truth of the hidden effects (form and size, water motion
/// included) and has to find only the calibration quantities, m/s. `None` for effects with a memory, which the reference model
/// has not.
#[must_use]
pub fn known_truth_error(log: &Log, nominal: &Nominal, truth: &super::Truth) -> Option<f64> {
    if truth.kind == super::Kind::Off {
        return None;
    }
    let calm = log.clone().without_stirring();
    let build = |s: &Scatter| truth.nature.rescattered(&truth.scatter, s);
    let fitted = build(&recalibrated(&calm, nominal, build));
    Some(block_error(&calm.blocks(&fitted, nominal.gravity, |s| nominal.check.contains(&s))))
}

/// The calibration quantities that fit best, with priors of their tolerances cut at 3 sigma (Gauss–Newton, block residuals of the
/// fit segments, noise widened for its correlation). `build` turns a scatter into a vehicle.
#[must_use]
pub fn recalibrated(log: &Log, nominal: &Nominal, build: impl Fn(&Scatter) -> Nature) -> Scatter {
    let fit = |s: usize| !nominal.check.contains(&s);
    let noise = nominal.background_rms_m_s * libm::sqrt(1.0 + 2.0 * nominal.background_time_s / BLOCK_S);
    let mut x = [0.0; FITTED];
    let scatter = |x: &[f64; FITTED]| {
        let mut s = Scatter::none();
        for (i, v) in x.iter().enumerate() {
            s.values[i] = v * TOLERANCE[i].1;
        }
        s
    };
    let residual = |x: &[f64; FITTED]| -> Vec<f64> {
        log.blocks(&build(&scatter(x)), nominal.gravity, fit).iter().map(|b| (b.observed - b.modelled) / noise).collect()
    };
    for _ in 0..3 {
        let r0 = residual(&x);
        let mut jacobian = Vec::with_capacity(FITTED);
        for i in 0..FITTED {
            let mut y = x;
            y[i] += 0.5;
            jacobian.push(residual(&y).iter().zip(&r0).map(|(a, b)| (a - b) / 0.5).collect::<Vec<f64>>());
        }
        // (J'J + I) d = -(J'r + x)
        let mut a = vec![vec![0.0; FITTED + 1]; FITTED];
        for i in 0..FITTED {
            for j in 0..FITTED {
                a[i][j] = jacobian[i].iter().zip(&jacobian[j]).map(|(p, q)| p * q).sum();
            }
            a[i][i] += 1.0;
            a[i][FITTED] = -(jacobian[i].iter().zip(&r0).map(|(p, q)| p * q).sum::<f64>() + x[i]);
        }
        for i in 0..FITTED {
            let pivot = a[i].clone();
            for row in a.iter_mut().skip(i + 1) {
                let f = row[i] / pivot[i];
                row.iter_mut().zip(&pivot).for_each(|(r, p)| *r -= f * p);
            }
        }
        let mut d = [0.0; FITTED];
        for i in (0..FITTED).rev() {
            let rest: f64 = (i + 1..FITTED).map(|j| a[i][j] * d[j]).sum();
            d[i] = (a[i][FITTED] - rest) / a[i][i];
        }
        for i in 0..FITTED {
            x[i] = (x[i] + d[i]).clamp(-3.0, 3.0);
        }
    }
    scatter(&x)
}

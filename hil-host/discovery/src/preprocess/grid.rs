//! The grid that a model is run on, and the inputs at every half step of it.

use crate::preprocess::channels::Channels;
use crate::preprocess::gaps::long_gaps;
use crate::preprocess::interpolate::{PITCH_WINDOW_S, fill, hermite, local_quadratic};
use crate::preprocess::run::Input;
use hydro::effects::{HULL_LAG_S, Sensed};
use logs::record::plausible::quantile;

/// Shortest and longest grid step of the simulation, s. In a turn of 12 s from leg to leg steps of 4 s find the sink rate within 0.05 mm/s
/// rms and steps of 8 s within 2 mm/s (test of the integrator).
pub const STEPS_S: (f64, f64) = (2.0, 4.0);

/// Grid step for rows at these times: half of what is usual between two. Longer ones lose what a dense log shows of its turns (real ones
/// of Slocums fit worse by a hundredth with 4 s).
pub(crate) fn step_s(time_s: &[f64]) -> f64 {
    let apart: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
    (0.5 * quantile(&apart, 0.5)).clamp(STEPS_S.0, STEPS_S.1)
}

/// Inputs at half steps from the first row of a run on; `zero` is the depth that the sensor shows afloat, m.
pub(crate) fn inputs(channels: &Channels, whole_depth: &[f64], zero: f64, step: f64) -> Vec<Input> {
    let Channels { time, pitch, turning, .. } = channels;
    let [sin_heading, cos_heading] = &channels.whole_ahead;
    let whole_pitch = fill(time, pitch, 0.0);
    // A local fit would reach over a gap with samples of one side.
    let mut in_gap = vec![false; time.len()];
    for (a, b) in long_gaps(time, pitch) {
        in_gap[a..b].fill(true);
    }
    let count = ((time[time.len() - 1] - time[0]) / (0.5 * step)).ceil() as usize + 3;
    let mut inputs = Vec::with_capacity(count);
    let follows = 1.0 - (-0.5 * step / HULL_LAG_S).exp();
    let mut hull_degc = channels.temperature[0];
    let (mut at, mut from) = (0usize, 0usize);
    for j in 0..count {
        let t = time[0] + j as f64 * 0.5 * step;
        while at + 2 < time.len() && time[at + 1] <= t {
            at += 1;
        }
        let f = ((t - time[at]) / (time[at + 1] - time[at])).clamp(0.0, 1.0);
        let mix = |v: &[f64]| v[at] + (v[at + 1] - v[at]) * f;
        let within = t.min(time[time.len() - 1]);
        let (theta, q) = if in_gap[at] {
            (mix(&whole_pitch), (whole_pitch[at + 1] - whole_pitch[at]) / (time[at + 1] - time[at]))
        } else if turning[at].max(turning[at + 1]) > 0.0 {
            hermite(time, &whole_pitch, at, within)
        } else {
            local_quadratic(time, pitch, within, PITCH_WINDOW_S, &mut from)
        };
        let (temperature_degc, roll_rad) = (mix(&channels.temperature), mix(&channels.roll));
        hull_degc += follows * (temperature_degc - hull_degc);
        let (sh, ch) = (mix(sin_heading), mix(cos_heading));
        let norm = sh.hypot(ch).max(1e-9);
        inputs.push(Input {
            sensed: Sensed {
                time_s: t,
                pitch_rad: theta,
                ballast_m3: mix(&channels.ballast),
                density_kg_m3: mix(&channels.density),
                temperature_degc,
                hull_degc,
                pressure_pa: mix(&channels.whole_pressure),
            },
            pitch_rate_rad_s: q,
            sin_pitch: theta.sin(),
            cos_pitch: theta.cos(),
            roll_rad,
            cos_roll: roll_rad.cos(),
            sin_heading: sh / norm,
            cos_heading: ch / norm,
            depth_m: mix(whole_depth) - zero,
            cd0_relative: 1.0,
        });
    }
    inputs
}

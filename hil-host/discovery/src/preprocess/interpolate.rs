//! Values between samples: straight lines over gaps, the mean of a resting engine, and for pitch, whose rate matters, a local quadratic
//! or, where it swings within a few samples, a cubic.

/// Half width of the local fit of pitch, s (shorter than the pitch mode of 16 s, longer than two samples).
pub const PITCH_WINDOW_S: f64 = 9.0;

/// Linear interpolation in time over missing values; ends are held. All-NaN input gives `fallback`.
pub(crate) fn fill(time: &[f64], value: &[f64], fallback: f64) -> Vec<f64> {
    let known: Vec<usize> = (0..value.len()).filter(|&i| value[i].is_finite()).collect();
    let (Some(&first), Some(&last)) = (known.first(), known.last()) else { return vec![fallback; value.len()] };
    let mut out = value.to_vec();
    out[..first].fill(value[first]);
    out[last..].fill(value[last]);
    for pair in known.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        for i in a + 1..b {
            out[i] = value[a] + (value[b] - value[a]) * (time[i] - time[a]) / (time[b] - time[a]);
        }
    }
    out
}

/// Mean over up to five rows where the ballast engine rests (spread below 4 cc): takes the resolution out, keeps strokes.
pub(crate) fn quiet_ballast(value: &[f64]) -> Vec<f64> {
    (0..value.len())
        .map(|i| {
            let window = &value[i.saturating_sub(4)..(i + 5).min(value.len())];
            let (lo, hi) = window.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
            if hi - lo < 4.5e-6 { window.iter().sum::<f64>() / window.len() as f64 } else { value[i] }
        })
        .collect()
}

/// How often a window is widened, and by how much: from 9 s to two and a half minutes, which of samples a minute apart holds four.
const WIDENED: usize = 6;
const WIDER: f64 = 1.6;

/// Half widths of a window, s, narrowest first.
fn half_widths_s(half_s: f64) -> impl Iterator<Item = f64> {
    std::iter::successors(Some(half_s), |width| Some(width * WIDER)).take(WIDENED + 1)
}

/// Half width, s, to which a window is widened to hold four samples this far apart, s; not a number where it would be too wide.
#[must_use]
pub fn widened_s(half_s: f64, apart_s: f64) -> f64 {
    half_widths_s(half_s).find(|width| *width > 2.0 * apart_s).unwrap_or(f64::NAN)
}

/// Value and slope at `t` of a weighted local quadratic fit to the finite samples within ±`half` (widened until four are found); the
/// nearest value and no slope where there are none.
pub(crate) fn local_quadratic(time: &[f64], value: &[f64], t: f64, half: f64, from: &mut usize) -> (f64, f64) {
    quadratic(time, value, t, half, from).unwrap_or_else(|| {
        let known = (0..time.len()).filter(|&i| value[i].is_finite());
        let nearest = known.min_by(|&a, &b| (time[a] - t).abs().total_cmp(&(time[b] - t).abs()));
        (nearest.map_or(0.0, |i| value[i]), 0.0)
    })
}

/// The same; none without four samples.
fn quadratic(time: &[f64], value: &[f64], t: f64, half: f64, from: &mut usize) -> Option<(f64, f64)> {
    for width in half_widths_s(half) {
        while *from > 0 && time[*from] > t - width {
            *from -= 1;
        }
        while *from + 1 < time.len() && time[*from] < t - width {
            *from += 1;
        }
        let (mut s, mut b, mut count) = ([0.0_f64; 5], [0.0_f64; 3], 0);
        for i in *from..time.len() {
            let x = (time[i] - t) / width;
            if x >= 1.0 {
                break;
            }
            if x <= -1.0 || !value[i].is_finite() {
                continue;
            }
            let k = 1.0 - x * x;
            let w = k * k;
            let (x2, y) = (x * x, value[i]);
            count += 1;
            s[0] += w;
            s[1] += w * x;
            s[2] += w * x2;
            s[3] += w * x2 * x;
            s[4] += w * x2 * x2;
            b[0] += w * y;
            b[1] += w * x * y;
            b[2] += w * x2 * y;
        }
        if count >= 4 {
            let m = nalgebra::Matrix3::new(s[0], s[1], s[2], s[1], s[2], s[3], s[2], s[3], s[4]);
            if let Some(c) = m.lu().solve(&nalgebra::Vector3::new(b[0], b[1], b[2]))
                && c.iter().all(|v| v.is_finite())
            {
                return Some((c[0], c[1] / width));
            }
        }
    }
    None
}

/// Value and slope at `t`, between samples `at` and `at` + 1, of the cubic with the slopes of its neighbours there: what swings within
/// a few samples must not be smoothed away.
pub(crate) fn hermite(time: &[f64], value: &[f64], at: usize, t: f64) -> (f64, f64) {
    let slope = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(time.len() - 1));
        (value[b] - value[a]) / (time[b] - time[a])
    };
    let h = time[at + 1] - time[at];
    let x = ((t - time[at]) / h).clamp(0.0, 1.0);
    let (m0, m1, rise) = (h * slope(at), h * slope(at + 1), value[at + 1] - value[at]);
    // v0 + m0 x + (3 rise − 2 m0 − m1) x² + (m0 + m1 − 2 rise) x³
    let (c2, c3) = (3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise);
    (value[at] + x * (m0 + x * (c2 + x * c3)), (m0 + x * (2.0 * c2 + 3.0 * x * c3)) / h)
}

/// Slope at `t` of the local quadratic fit within ±`half`, widened; not a number where four samples are too far apart.
#[must_use]
pub fn local_slope(time: &[f64], value: &[f64], t: f64, half: f64, from: &mut usize) -> f64 {
    quadratic(time, value, t, half, from).map_or(f64::NAN, |c| c.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accuracy_a_cubic_meets_a_swing_of_16_s_that_the_local_fit_flattens() {
        let time: Vec<f64> = (0..20).map(|i| 4.0 * f64::from(i)).collect();
        let omega = std::f64::consts::TAU / 16.0;
        let pitch: Vec<f64> = time.iter().map(|t| 0.3 * (omega * t).sin()).collect();
        let (mut worst, mut of_rate, mut flattened) = (0.0_f64, 0.0_f64, 0.0_f64);
        for i in 0..160 {
            let t = 20.0 + 0.1 * f64::from(i);
            let (exact, rate) = (0.3 * (omega * t).sin(), 0.3 * omega * (omega * t).cos());
            let (v, q) = hermite(&time, &pitch, (t / 4.0) as usize, t);
            worst = worst.max((v - exact).abs());
            of_rate = of_rate.max((q - rate).abs());
            flattened = flattened.max((local_quadratic(&time, &pitch, t, PITCH_WINDOW_S, &mut 0).0 - exact).abs());
        }
        // Four samples a period: slopes by central differences are 2/pi of the true 0.118 rad/s. By hand 0.0279 rad and 0.0428 rad/s,
        // where the local fit is off by 0.0549 rad.
        assert!(worst < 0.028 && of_rate < 0.043 && flattened > 0.0549, "{worst} rad, {of_rate} rad/s, {flattened} rad");
    }

    #[test]
    fn accuracy_local_fit_gives_value_and_rate_of_a_parabola() {
        let time: Vec<f64> = (0..30).map(|i| f64::from(i) * 3.7).collect();
        let value: Vec<f64> = time.iter().map(|t| 0.3 - 0.01 * t + 1e-4 * t * t).collect();
        let mut from = 0;
        let (v, q) = local_quadratic(&time, &value, 41.3, 9.0, &mut from);
        assert!((v - (0.3 - 0.413 + 1e-4 * 41.3 * 41.3)).abs() < 1e-9 && (q - (-0.01 + 2e-4 * 41.3)).abs() < 1e-9, "{v} {q}");
    }
}

//! Which rows of a flight are steady, and how fast did the glider really rise or sink there?
//!
//! Observed vertical velocity: pressure on a 1 s grid, Savitzky–Golay derivative
//! (order 2, 21 points: the slope of the least-squares parabola over ±10 s),
//! divided by ρg of the sample, positive up. Grids never cross a gap.
//!
//! Steady: deeper than `z_min`, shallower than the flight's 99.5th percentile of
//! depth less `z_off`, |pitch| above 11°, the pump still for ±30 s (no
//! |d ballast/dt| above 0.3 cc/s), and pitch and ballast of the same sign.
//!
//! Against the published columns of the four Slocum flights: the same samples
//! but for 2 of 2834 to 9423, w to 0.007 cm/s rms.

use serde::Serialize;

use crate::record::flight::Flight;

/// Standard gravity as the published figures take it, m/s².
const GRAVITY_M_S2: f64 = 9.81;

/// Half width of the derivative's window, s (source: the published figures' 21 s).
const DERIVATIVE_HALF_WINDOW_S: usize = 10;
/// A jump in time longer than this starts a new grid, s (CTD outages of a minute must not become straight lines).
const MAX_GAP_S: f64 = 30.0;

/// The steady filter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SteadyFilter {
    /// No sample shallower than this, m.
    pub z_min_m: f64,
    /// No sample deeper than the 99.5th percentile less this, m.
    pub z_off_m: f64,
    /// No flatter pitch than this, rad.
    pub pitch_min_rad: f64,
    /// The pump is still below this, m³/s.
    pub ballast_rate_max_m3_s: f64,
    /// Time that the pump must have been, and stay, still, s.
    pub ballast_halo_s: usize,
}

impl SteadyFilter {
    /// The filter for a flight of this depth: (z_min, z_off) of the published figures is
    /// (10, 6) for 41 m and (10, 10) for 189 m; shallower than 30 m it is a guess.
    #[must_use]
    pub fn for_depth(max_depth_m: f64) -> Self {
        let (z_min_m, z_off_m) = match max_depth_m {
            d if d > 100.0 => (10.0, 10.0),
            d if d > 30.0 => (10.0, 6.0),
            _ => (6.0, 4.0),
        };
        Self { z_min_m, z_off_m, pitch_min_rad: 11.0_f64.to_radians(), ballast_rate_max_m3_s: 0.3e-6, ballast_halo_s: 30 }
    }
}

/// Depth of every row, m, from the median density of the flight; good to 1 % and used for choosing only.
#[must_use]
pub fn depth_m(flight: &Flight) -> Vec<f64> {
    let density = interpolated_quantile(&flight.density_kg_m3, 0.5);
    flight.pressure_pa.iter().map(|p| p / (density * GRAVITY_M_S2)).collect()
}

/// Observed vertical velocity of every row, m/s, positive up; NaN within 10 s of a gap.
#[must_use]
pub fn vertical_velocity(flight: &Flight) -> Vec<f64> {
    let mut out = vec![f64::NAN; flight.len()];
    for piece in pieces(flight) {
        let Some(grid) = Grid::of(&flight.time_s, &flight.pressure_pa, &piece) else { continue };
        let slope = savitzky_golay_slope(&grid.value);
        for i in piece {
            out[i] = -grid.at(&slope, flight.time_s[i]) / (flight.density_kg_m3[i] * GRAVITY_M_S2);
        }
    }
    out
}

/// Whether each row passes `filter`.
#[must_use]
pub fn steady(flight: &Flight, filter: &SteadyFilter) -> Vec<bool> {
    let depth = depth_m(flight);
    let deepest = interpolated_quantile(&depth, 0.995) - filter.z_off_m;
    let mut out = vec![false; flight.len()];
    for piece in pieces(flight) {
        let Some(grid) = Grid::of(&flight.time_s, &flight.ballast_m3, &piece) else { continue };
        let n = grid.value.len();
        let mut moving = vec![false; n];
        for k in 0..n.saturating_sub(1) {
            if (grid.value[k + 1] - grid.value[k]).abs() > filter.ballast_rate_max_m3_s {
                let halo = k.saturating_sub(filter.ballast_halo_s)..(k + filter.ballast_halo_s + 1).min(n);
                moving[halo].fill(true);
            }
        }
        for i in piece {
            let at = flight.time_s[i] - grid.start_s;
            let (low, high) = (at.floor() as usize, at.ceil() as usize);
            let still = !moving[low.min(n - 1)] && !moving[high.min(n - 1)];
            let pitch = flight.pitch_rad[i];
            let same_sign = pitch * flight.ballast_m3[i] > 0.0;
            out[i] = still && same_sign && depth[i] > filter.z_min_m && depth[i] < deepest && pitch.abs() > filter.pitch_min_rad;
        }
    }
    out
}

/// Runs of rows without a gap and inside one segment.
fn pieces(flight: &Flight) -> Vec<std::ops::Range<usize>> {
    let mut out = Vec::new();
    let mut start = 0;
    for i in 1..=flight.len() {
        let ends =
            i == flight.len() || flight.segment.get(i) != flight.segment.get(i - 1) || flight.time_s[i] - flight.time_s[i - 1] > MAX_GAP_S;
        if ends {
            out.push(start..i);
            start = i;
        }
    }
    out
}

/// A channel on a 1 s grid.
struct Grid {
    start_s: f64,
    value: Vec<f64>,
}

impl Grid {
    /// Linear interpolation of the finite values; `None` for a piece too short to differentiate.
    fn of(time_s: &[f64], value: &[f64], piece: &std::ops::Range<usize>) -> Option<Self> {
        let known: Vec<usize> = piece.clone().filter(|i| value[*i].is_finite()).collect();
        let (start_s, end_s) = (time_s[piece.start], time_s[piece.end - 1]);
        let n = (end_s - start_s).floor() as usize + 1;
        if known.len() < 2 || n < 2 * DERIVATIVE_HALF_WINDOW_S + 1 {
            return None;
        }
        let mut k = 0;
        let value = (0..n)
            .map(|j| {
                let t = start_s + j as f64;
                while k + 2 < known.len() && time_s[known[k + 1]] <= t {
                    k += 1;
                }
                let (a, b) = (known[k], known[k + 1]);
                // Held, not extrapolated, outside the known values.
                let share = ((t - time_s[a]) / (time_s[b] - time_s[a])).clamp(0.0, 1.0);
                value[a] + share * (value[b] - value[a])
            })
            .collect();
        Some(Self { start_s, value })
    }

    /// Value of `on_grid` at time `t`, linear; NaN next to NaN.
    fn at(&self, on_grid: &[f64], t: f64) -> f64 {
        let at = (t - self.start_s).max(0.0);
        let low = (at.floor() as usize).min(on_grid.len() - 1);
        let high = (low + 1).min(on_grid.len() - 1);
        let share = at - low as f64;
        if share == 0.0 { on_grid[low] } else { on_grid[low] + share * (on_grid[high] - on_grid[low]) }
    }
}

/// Slope of the least-squares parabola over ±10 points, per point; NaN where the window does not fit.
fn savitzky_golay_slope(value: &[f64]) -> Vec<f64> {
    let h = DERIVATIVE_HALF_WINDOW_S as i64;
    let norm: i64 = (1..=h).map(|k| 2 * k * k).sum();
    let mut out = vec![f64::NAN; value.len()];
    for (centre, window) in value.windows(2 * DERIVATIVE_HALF_WINDOW_S + 1).enumerate() {
        let sum: f64 = window.iter().zip(-h..=h).map(|(v, k)| v * k as f64).sum();
        out[centre + DERIVATIVE_HALF_WINDOW_S] = sum / norm as f64;
    }
    out
}

/// Quantile of the finite values, linear between order statistics; NaN if there are none.
#[must_use]
pub fn interpolated_quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = q * last as f64;
    let (low, share) = (at.floor() as usize, at.fract());
    sorted[low] + share * (sorted[(low + 1).min(last)] - sorted[low])
}

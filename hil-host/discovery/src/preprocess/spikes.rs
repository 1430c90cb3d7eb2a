//! Single samples that cannot be: which values of a sensor are spikes?
//!
//! Three rules. A sample that most of its neighbours could only reach faster than the vehicle or the water can change is none of the
//! vehicle's; this holds however many spikes stand close together. And a sample that is neither between its neighbours nor near any
//! interpolation or extrapolation of them is one too (a running median would eat the turning points); how near is a threshold, and what
//! a vehicle may do between two samples of a sparse log. Two samples together far off a line that goes on behind them as it came are two
//! spikes, even where they support each other.

use crate::preprocess::gaps::SEEN_S;

/// Neighbours on each side that a leap is judged by.
const NEIGHBOURS: usize = 3;

/// Rounds of looking for samples without support: spikes that stand together.
const MOST_ROUNDS: usize = 4;

/// Fastest changes that are believed, per second: several times what gliders and water show.
pub struct Fastest {
    /// Pressure, Pa/s: a metre a second.
    pub pressure_pa_s: f64,
    /// Pitch and roll, rad/s.
    pub angle_rad_s: f64,
    /// Density, kg/(m³ s): a halocline of 1 kg/m³ per metre.
    pub density_kg_m3_s: f64,
    /// Temperature, K/s.
    pub temperature_k_s: f64,
    /// Speed, m/s².
    pub speed_m_s2: f64,
}

/// See [`Fastest`].
pub const FASTEST: Fastest = Fastest { pressure_pa_s: 1e4, angle_rad_s: 0.15, density_kg_m3_s: 0.5, temperature_k_s: 2.0, speed_m_s2: 0.2 };

/// Puts NaN in place of spikes: of leaps faster than `fastest` (per second), then of samples that no neighbour supports within
/// `threshold`. Returns how many.
pub fn despike(time: &[f64], value: &mut [f64], threshold: f64, fastest: f64) -> usize {
    despike_by(time, value, &|_| threshold, fastest)
}

/// The same with a threshold of its own for each row.
pub fn despike_by(time: &[f64], value: &mut [f64], threshold: &dyn Fn(usize) -> f64, fastest: f64) -> usize {
    let mut removed = leaps(time, value, threshold, fastest) + excursions(time, value, threshold);
    // Where one has gone, the one beside it stands alone.
    for _ in 0..MOST_ROUNDS {
        let more = unsupported(time, value, threshold);
        removed += more;
        if more == 0 {
            break;
        }
    }
    removed
}

/// Swing of the pitch about its new value while a glider turns between dive and climb, rad, and the period of its pitch mode, s: a
/// Slocum's mode is 16 s; in simulated turns of both wing sets the top of a swing, 4 s from its neighbours, misses all lines through
/// them by up to 0.19 rad, while a sensor's spikes are 0.25 rad and more.
const TURN_SWING: (f64, f64) = (0.16, 16.0);
/// Pump stroke that makes a turn, m³, and how long before and after it the pitch may swing, s: one period and the stroke's end.
pub const TURN_STROKE_M3: f64 = 20e-6;
const TURN_S: f64 = 20.0;

/// What a sample of pitch may differ from all lines through its neighbours because the vehicle turns there, rad: at the top of a
/// swing, neighbours a sampling period away.
pub fn turn_allowance(time: &[f64], pitch: &[f64], ballast_m3: &[f64]) -> Vec<f64> {
    let (swing, period_s) = TURN_SWING;
    let n = time.len();
    let (mut from, mut to) = (0, 0);
    let neighbours = neighbours(pitch);
    (0..n)
        .map(|i| {
            while time[i] - time[from] > TURN_S {
                from += 1;
            }
            while to + 1 < n && time[to + 1] - time[i] <= TURN_S {
                to += 1;
            }
            // In a sparse log the stroke is between neighbours.
            let [before, after] = neighbours[i];
            let near = &ballast_m3[from.min(before)..=to.max(after)];
            let stroke = near.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), b| (l.min(*b), h.max(*b)));
            let phase = (std::f64::consts::TAU * interval_s(time, i, [before, after]) / period_s).min(std::f64::consts::PI);
            if stroke.1 - stroke.0 > TURN_STROKE_M3 { swing * (1.0 - phase.cos()) } else { 0.0 }
        })
        .collect()
}

/// Swing of the depth rate of a vehicle that turns, m/s, and the period of such swings, s: from diving to climbing in half a minute. A
/// guess at the fastest; slower turns miss less.
const DEPTH_SWING: (f64, f64) = (0.4, 60.0);

/// What a sample of depth may be off the cubic through its neighbours because the vehicle turns between them, m: `(2/3) A (1 − cos φ)²`
/// for a swing of amplitude A that turns by φ from one sample to the next.
pub fn depth_allowance(time: &[f64], depth: &[f64]) -> Vec<f64> {
    let (rate, period_s) = DEPTH_SWING;
    let frequency = std::f64::consts::TAU / period_s;
    let miss = |apart_s: f64| (1.0 - (frequency * apart_s).min(std::f64::consts::PI).cos()).powi(2);
    let neighbours = neighbours(depth);
    (0..time.len()).map(|i| 2.0 / 3.0 * rate / frequency * miss(interval_s(time, i, neighbours[i]))).collect()
}

/// The nearest rows with a value before and after each row; the row itself where there is none.
fn neighbours(value: &[f64]) -> Vec<[usize; 2]> {
    let n = value.len();
    let mut out: Vec<[usize; 2]> = (0..n).map(|i| [i, i]).collect();
    let (mut last, mut next) = (None, None);
    for i in 0..n {
        out[i][0] = last.unwrap_or(i);
        out[n - 1 - i][1] = next.unwrap_or(n - 1 - i);
        last = if value[i].is_finite() { Some(i) } else { last };
        next = if value[n - 1 - i].is_finite() { Some(n - 1 - i) } else { next };
    }
    out
}

/// Time between a sample and its neighbours, s: the mean of both sides.
fn interval_s(time: &[f64], i: usize, [before, after]: [usize; 2]) -> f64 {
    let sides = usize::from(before < i) + usize::from(after > i);
    (time[after] - time[before]) / sides.max(1) as f64
}

/// Rows with a value.
fn known(value: &[f64]) -> Vec<usize> {
    (0..value.len()).filter(|&i| value[i].is_finite()).collect()
}

/// Value at time `t` of the line through two samples.
fn on_line(time: &[f64], value: &[f64], [i, j]: [usize; 2], t: f64) -> f64 {
    value[i] + (value[j] - value[i]) * (t - time[i]) / (time[j] - time[i])
}

/// Value at time `t` of the cubic through four samples.
fn on_cubic(time: &[f64], value: &[f64], through: [usize; 4], t: f64) -> f64 {
    let weight = |i: usize| through.iter().filter(|&&j| j != i).map(|&j| (t - time[j]) / (time[i] - time[j])).product::<f64>();
    through.iter().map(|&i| value[i] * weight(i)).sum()
}

/// Samples that cannot be reached from most of their neighbours.
fn leaps(time: &[f64], value: &mut [f64], threshold: &dyn Fn(usize) -> f64, fastest: f64) -> usize {
    let index = known(value);
    let apart = |i: usize, j: usize| (value[i] - value[j]).abs() > threshold(i).max(threshold(j)) + fastest * (time[i] - time[j]).abs();
    let alone = |k: usize| {
        let near = (k.saturating_sub(NEIGHBOURS)..(k + NEIGHBOURS + 1).min(index.len())).filter(|&j| j != k);
        let (mut far, mut all) = (0, 0);
        for j in near {
            all += 1;
            far += usize::from(apart(index[k], index[j]));
        }
        far >= 3 && 2 * far > all
    };
    let bad: Vec<usize> = (0..index.len()).filter(|&k| alone(k)).map(|k| index[k]).collect();
    bad.iter().for_each(|&i| value[i] = f64::NAN);
    bad.len()
}

/// How many thresholds two samples together must be off the line, and the longest time between the samples before and behind them, s:
/// a period of the pitch mode (and what samples jitter), in which nothing goes out and comes back to rest; with one between them half
/// as much again.
const FAR_OUT: f64 = 3.0;
const EXCURSION_S: f64 = 17.0;
const EXCURSION_APART_S: f64 = 24.0;

/// Two or three samples far off a line that the samples before them and those behind them agree on: neighbours, or two with one between
/// them that lies on it.
fn excursions(time: &[f64], value: &mut [f64], threshold: &dyn Fn(usize) -> f64) -> usize {
    let index = known(value);
    let off = |i: usize, j: usize, at: usize| (value[at] - on_line(time, value, [i, j], time[at])).abs();
    let agree = |from: usize, to: usize, at: usize| off(from, to, at) <= threshold(at);
    let far = |from: usize, to: usize, at: usize| off(from, to, at) > FAR_OUT * threshold(at);
    let together = |w: &[usize]| {
        let (from, to) = (w[1], w[w.len() - 2]);
        let out = w[2..w.len() - 2].iter().all(|&at| far(from, to, at));
        time[to] - time[from] <= EXCURSION_S && out && agree(w[0], from, to) && agree(to, w[w.len() - 1], from)
    };
    // What swings to and fro does not begin and end with it.
    let apart = |w: &[usize]| {
        let is_far = |at: usize| far(w[1], w[5], at);
        let out = is_far(w[2]) && is_far(w[4]) && !is_far(w[0]) && !is_far(w[6]);
        time[w[5]] - time[w[1]] <= EXCURSION_APART_S && out && agree(w[1], w[5], w[3])
    };
    let mut bad: Vec<usize> = Vec::new();
    for n in [6, 7] {
        bad.extend(index.windows(n).filter(|w| together(w)).flat_map(|w| w[2..n - 2].to_vec()));
    }
    bad.extend(index.windows(7).filter(|w| apart(w)).flat_map(|w| [w[2], w[4]]));
    bad.sort_unstable();
    bad.dedup();
    bad.iter().for_each(|&i| value[i] = f64::NAN);
    bad.len()
}

/// Single samples that no interpolation or extrapolation of their neighbours meets.
fn unsupported(time: &[f64], value: &mut [f64], threshold: &dyn Fn(usize) -> f64) -> usize {
    let index = known(value);
    let n = index.len();
    let line = |a: usize, b: usize, t: f64, v: &[f64]| on_line(time, v, [index[a], index[b]], t);
    let mut bad = Vec::new();
    for (k, &i) in index.iter().enumerate() {
        let t = time[i];
        // Predictions that leave the sample out; a turning point is met by at least one of them, a spike by none.
        let mut guesses = Vec::with_capacity(5);
        if k >= 1 && k + 1 < n {
            guesses.push(line(k - 1, k + 1, t, value));
            // On its way from one neighbour to the other.
            let (a, b) = (value[index[k - 1]], value[index[k + 1]]);
            guesses.push(value[i].clamp(a.min(b), a.max(b)));
        }
        if k >= 2 && k + 1 < n {
            guesses.push(line(k - 2, k + 1, t, value));
        }
        if k >= 1 && k + 2 < n {
            guesses.push(line(k - 1, k + 2, t, value));
        }
        if k >= 2 {
            guesses.push(line(k - 2, k - 1, t, value));
        }
        if k + 2 < n {
            guesses.push(line(k + 1, k + 2, t, value));
        }
        // The flank of a turn's swing is met by no line through its neighbours, but by a cubic.
        if k >= 2 && k + 2 < n {
            guesses.push(on_cubic(time, value, [index[k - 2], index[k - 1], index[k + 1], index[k + 2]], t));
        }
        // At the ends there is nothing to interpolate: let the neighbours be held, and what begins or ends in a change be believed, which
        // in a sparse log may be between the end and its neighbour.
        let beyond = if k == 0 {
            Some([1, 2])
        } else if k + 1 == n && n > 2 {
            Some([n - 3, n - 2])
        } else {
            None
        };
        let steady = |[a, b]: [usize; 2]| {
            let near = |at: usize| (time[index[at]] - t).abs() <= SEEN_S;
            b < n && near(if k == 0 { a } else { b }) && (value[index[a]] - value[index[b]]).abs() <= threshold(i)
        };
        if beyond.is_some_and(|pair| !steady(pair)) {
            continue;
        }
        if k < 2 || k + 2 >= n {
            for j in [k.saturating_sub(2), k.saturating_sub(1), k + 1, k + 2] {
                if j != k && j < n {
                    guesses.push(value[index[j]]);
                }
            }
        }
        let off = guesses.iter().map(|g| (value[i] - g).abs()).fold(f64::INFINITY, f64::min);
        if guesses.len() >= 3 && off > threshold(i) {
            bad.push((i, off));
        }
    }
    // Of two adjacent suspects only the larger is a spike.
    bad.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut taken: Vec<usize> = Vec::new();
    for (i, _) in bad {
        if !taken.iter().any(|&j| i.abs_diff(j) <= 1) {
            taken.push(i);
        }
    }
    for &i in &taken {
        value[i] = f64::NAN;
    }
    taken.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_is_removed_and_a_turning_point_is_not() {
        let time: Vec<f64> = (0..40).map(|i| f64::from(i) * 4.0).collect();
        let mut depth: Vec<f64> = time.iter().map(|t| 20.0 - (t - 80.0).abs() * 0.15).collect();
        depth[10] += 3.0;
        let clean = depth.clone();
        assert_eq!(despike(&time, &mut depth, 0.27, 1.0), 1);
        assert!(depth[10].is_nan());
        assert!((0..40).all(|i| i == 10 || depth[i] == clean[i]));
    }

    #[test]
    fn regress_two_spikes_in_a_row_are_both_removed_and_a_turn_of_pitch_stays() {
        let time: Vec<f64> = (0..30).map(|i| f64::from(i) * 4.0).collect();
        // As logged: both of one sensor's errors, then a turn as fast as a glider's pitch mode of 16 s allows.
        let mut steps: Vec<f64> = time.iter().map(|t| 0.317 * ((t - 84.0) / 8.0).tanh()).collect();
        steps[4] = -0.98;
        steps[5] = 0.2135;
        let mut pitch = steps.clone();
        assert_eq!(despike(&time, &mut pitch, 0.043, 0.15), 2);
        assert!((0..30).all(|i| if i == 4 || i == 5 { pitch[i].is_nan() } else { pitch[i] == steps[i] }));
    }

    #[test]
    fn regress_the_swing_of_a_fast_turn_is_no_spike_and_one_in_a_glide_is() {
        // As flown: 0.56 rad at the top of the swing, 0.1 rad above all lines through its neighbours.
        let turn = [-0.2555, -0.2573, -0.259, -0.2398, -0.0455, 0.3115, 0.5653, 0.4428, 0.4095, 0.4935, 0.5093, 0.4953, 0.4795];
        let pump = [-230.0, -230.0, -230.0, -90.0, 50.0, 190.0, 230.0, 230.0, 230.0, 230.0, 230.0, 230.0, 230.0];
        let glide = 10;
        let mut pitch = vec![-0.255; glide];
        pitch.extend(turn);
        pitch[4] += 0.2;
        let mut ballast = vec![-230e-6; glide];
        ballast.extend(pump.iter().map(|cc| cc * 1e-6));
        let time: Vec<f64> = (0..pitch.len()).map(|i| 4.0 * i as f64).collect();
        let allowed = turn_allowance(&time, &pitch, &ballast);
        let clean = pitch.clone();
        assert_eq!(despike_by(&time, &mut pitch, &|i| 0.043 + allowed[i], 0.15), 1);
        assert!((0..pitch.len()).all(|i| if i == 4 { pitch[i].is_nan() } else { pitch[i] == clean[i] }), "{pitch:?}");
        // Without knowing of the turn its top would go too.
        let mut pitch = clean;
        assert!(despike(&time, &mut pitch, 0.043, 0.15) > 1);
    }

    #[test]
    fn regress_the_flank_of_a_steep_turn_is_no_spike() {
        // As flown by a pitch sensor that reads a tenth too much: 0.49 is 0.22 rad off all lines through its neighbours. Each turn
        // without it was late, and that read as an angle of zero lift.
        let turn = [-0.445, -0.441, -0.445, -0.425, -0.093, 0.490, 0.623, 0.509, 0.469, 0.47];
        let pump = [-150.0, -150.0, -150.0, -9.0, 130.0, 150.0, 150.0, 150.0, 150.0, 150.0].map(|cc| cc * 1e-6);
        let begun = [0.390, 0.299, -0.168, -0.534, -0.575, -0.46, -0.42];
        let begun_pump = [100.0, -41.0, -100.0, -100.0, -100.0, -100.0, -100.0].map(|cc| cc * 1e-6);
        let time: Vec<f64> = (0..turn.len()).map(|i| 4.0 * i as f64).collect();
        for (pitch, pump) in [(&turn[..], &pump[..]), (&begun[..], &begun_pump[..])] {
            let allowed = turn_allowance(&time[..pitch.len()], pitch, pump);
            let mut pitch = pitch.to_vec();
            assert_eq!(despike_by(&time[..pitch.len()], &mut pitch, &|i| 0.043 + allowed[i], 0.15), 0, "{pitch:?}");
        }
        let mut spiked = turn;
        spiked[7] -= 0.4;
        let allowed = turn_allowance(&time, &spiked, &pump);
        assert_eq!(despike_by(&time, &mut spiked, &|i| 0.043 + allowed[i], 0.15), 1);
        assert!(spiked[7].is_nan(), "{spiked:?}");
    }

    #[test]
    fn regress_two_spikes_in_line_with_each_other_are_both_removed() {
        // As logged: the second lies where the line to the first goes on, the first half way to the second.
        let mut pitch = vec![0.6825, 0.6790, 0.6825, 0.6790, 0.3133, -0.0560, 0.6790, 0.6755, 0.6737, 0.6755, 0.6790, 0.6790];
        let time: Vec<f64> = (0..pitch.len()).map(|i| 4.0 * i as f64).collect();
        assert_eq!(despike(&time, &mut pitch, 0.043, 0.15), 2);
        assert!((0..pitch.len()).all(|i| pitch[i].is_nan() == (i == 4 || i == 5)), "{pitch:?}");
        // A turn that goes as far and does not come back stays.
        let turn = [0.68, 0.68, 0.68, 0.68, 0.31, -0.06, -0.43, -0.68, -0.68, -0.68, -0.68, -0.68];
        assert_eq!(despike(&time, &mut turn.clone(), 0.043, 0.15), 0);
    }

    #[test]
    fn regress_two_opposite_spikes_around_a_good_sample_are_both_removed() {
        // As logged: the line through the second spike meets the first by accident.
        let time: Vec<f64> = (0..12).map(|i| f64::from(i) * 2.0).collect();
        let mut depth: Vec<f64> = time.iter().map(|t| 85.0 - 0.25 * t).collect();
        let clean = depth.clone();
        depth[5] = 87.46;
        depth[7] = 76.4;
        assert_eq!(despike(&time, &mut depth, 0.27, 1.0), 2);
        assert!((0..12).all(|i| if i == 5 || i == 7 { depth[i].is_nan() } else { depth[i] == clean[i] }));
        // As logged in a turn, every 4 s and slower than a leap: each lies on the line through the other and the one between them.
        let mut speed = vec![0.171, 0.182, 0.167, 0.182, 0.219, -0.337, 0.229, 0.864, 0.244, 0.252, 0.267, 0.268];
        let time: Vec<f64> = (0..speed.len()).map(|i| 4.05 * i as f64).collect();
        assert_eq!(despike(&time, &mut speed, 0.1, 0.2), 2);
        assert!((0..12).all(|i| speed[i].is_nan() == (i == 5 || i == 7)), "{speed:?}");
        // What swings on stays.
        let swing: Vec<f64> = time.iter().map(|t| 0.5 * (t * std::f64::consts::TAU / 16.2).sin()).collect();
        assert_eq!(despike(&time, &mut swing.clone(), 0.1, 1.0), 0);
    }

    /// A log of every 30 s of a vehicle that turns: 13 % of the depths of a real SeaExplorer were once left out, nearly all at turns.
    #[test]
    fn regress_turns_of_a_sparse_log_are_no_spikes_and_spikes_are() {
        let (mut wrong, mut found) = (0, 0);
        for (every, phase) in [(10.0, 3.0), (20.0, 11.0), (30.0, 0.0), (30.0, 13.0), (40.0, 27.0)] {
            let time: Vec<f64> = (0..60).map(|i| every * f64::from(i) + phase).collect();
            let middle = time[30] + 0.4 * every - phase;
            // Down at 0.25 m/s and up again, by a stroke of half a minute; the pitch overshoots.
            let mut depth: Vec<f64> = time.iter().map(|t| 300.0 - 0.25 * 15.0 * ((t - middle) / 15.0).cosh().ln()).collect();
            let turn = |t: f64| ((t - middle) / 8.0).tanh();
            let swing = |t: f64| if t > middle { 0.12 * (-(t - middle) / 15.0).exp() * ((t - middle) / 2.5).sin() } else { 0.0 };
            let mut pitch: Vec<f64> = time.iter().map(|t| 0.42 * turn(*t) + swing(*t)).collect();
            let mut ballast: Vec<f64> = time.iter().map(|t| 230e-6 * ((t - middle) / 15.0).clamp(-1.0, 1.0)).collect();
            let pitch_by: Vec<f64> = turn_allowance(&time, &pitch, &ballast).iter().map(|a| 0.043 + a).collect();
            let depth_by: Vec<f64> = depth_allowance(&time, &depth).iter().map(|a| 0.15 + a).collect();
            wrong += despike_by(&time, &mut depth, &|i| depth_by[i], 1.0);
            wrong += despike_by(&time, &mut pitch, &|i| pitch_by[i], 0.15);
            wrong += despike(&time, &mut ballast, TURN_STROKE_M3, 1e-3);
            // A dive that begins with the stroke.
            let begun = &mut [252e-6, 113e-6, -252e-6, -252e-6, -252e-6, -252e-6];
            wrong += despike(&time[..6], begun, TURN_STROKE_M3, 1e-3);
            depth[12] += 80.0;
            pitch[12] += 0.3;
            found += despike_by(&time, &mut depth, &|i| depth_by[i], 1.0) + despike_by(&time, &mut pitch, &|i| pitch_by[i], 0.15);
            assert!(depth[12].is_nan() && pitch[12].is_nan());
        }
        assert!(wrong == 0 && found == 10, "{wrong} {found}");
    }

    /// Logged once a minute, the vehicle is afloat in the first sample and under way in the next: that was a spike of pitch and ballast.
    #[test]
    fn regress_the_ends_of_a_sparse_log_are_no_spikes() {
        let ballast: Vec<f64> = [201.0, -200.0, -201.0, -201.0, -200.0, 57.0, 200.0, 201.0, 200.0, -30.0].map(|cc| cc * 1e-6).to_vec();
        for (apart_s, ends) in [(60.0, 0), (4.0, 2)] {
            let time: Vec<f64> = (0..ballast.len()).map(|i| apart_s * i as f64).collect();
            let mut seen = ballast.clone();
            assert_eq!(despike(&time, &mut seen, TURN_STROKE_M3, 1e-3), ends, "{seen:?}");
        }
    }
}

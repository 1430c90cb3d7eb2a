//! What a log does not say though it has rows for it: long silences, changes that nobody saw, and sensors that stick.
//!
//! Inputs are filled in linearly where they are missing. Over a turn that is wrong, and a model that is fed with it must not be
//! compared with what was measured there. A value that repeats itself where the sensor never does is none.

/// An input that has had no value for this long is unknown, s: twice the CTD outages of FORMAT section 1.
pub const SILENT_S: f64 = 120.0;
/// A change within so long has been seen, s: half a period of a Slocum's pitch mode (16 s; Nyquist's interval) and what samples jitter. In a
/// sparser log nobody knows when between two samples a vehicle turned, and at 0.5 m/s of new depth rate a few seconds make metres.
pub(crate) const SEEN_S: f64 = 9.0;
/// How long a vehicle still feels an input that was wrong, s: three time constants of surge.
const FELT_S: f64 = 30.0;
/// Repetitions of a value in a row that are ordinary, and the probability beyond which more of them are.
const FEWEST_REPEATED: usize = 4;
const BY_CHANCE: f64 = 1e-3;
/// A sensor that repeats itself more often than this does so by its resolution, or because the vehicle rests.
const OFTEN: f64 = 0.5;

/// Rows that are further than [`SILENT_S`] from any known value.
pub(crate) fn far_from_known(time: &[f64], value: &[f64]) -> Vec<bool> {
    let known: Vec<f64> = time.iter().zip(value).filter(|(_, v)| v.is_finite()).map(|(t, _)| *t).collect();
    let near = |t: f64| {
        let k = known.partition_point(|x| *x < t);
        [k.checked_sub(1), Some(k)].into_iter().flatten().filter_map(|k| known.get(k)).any(|x| (x - t).abs() <= SILENT_S)
    };
    time.iter().map(|t| !near(*t)).collect()
}

/// From which row to which an input was not seen for long: the rows of the values before and after.
pub(crate) fn long_gaps(time: &[f64], value: &[f64]) -> Vec<(usize, usize)> {
    let known: Vec<usize> = (0..value.len()).filter(|&i| value[i].is_finite()).collect();
    known.windows(2).map(|w| (w[0], w[1])).filter(|&(a, b)| time[b] - time[a] > SEEN_S).collect()
}

/// Rows over which an input changed by more than `much` while it was not seen for long, and those that still feel it.
pub(crate) fn changed_unseen(time: &[f64], value: &[f64], much: f64) -> Vec<bool> {
    let mut unseen = vec![false; time.len()];
    for (a, b) in long_gaps(time, value).into_iter().filter(|&(a, b)| (value[b] - value[a]).abs() > much) {
        (a + 1..time.len()).take_while(|&row| time[row] <= time[b] + FELT_S).for_each(|row| unseen[row] = true);
    }
    unseen
}

/// Puts NaN in place of values that a stuck sensor repeats, among the rows that are `judged`: more often in a row than chance does it, and
/// left by more than `by`. The first of them may be true. Returns how many.
pub(crate) fn unstick(value: &mut [f64], judged: &dyn Fn(usize) -> bool, by: f64) -> usize {
    let known: Vec<usize> = (0..value.len()).filter(|&i| value[i].is_finite() && judged(i)).collect();
    let repeats: Vec<bool> = known.windows(2).map(|w| value[w[0]] == value[w[1]]).collect();
    let count = repeats.len() as f64;
    let share = repeats.iter().filter(|r| **r).count() as f64 / count.max(1.0);
    if share > OFTEN {
        return 0;
    }
    let mut stuck = Vec::new();
    for run in repeats.chunk_by(|a, b| a == b).scan(0, |from, run| {
        *from += run.len();
        Some((*from - run.len(), run))
    }) {
        let (from, repeated) = (run.0, run.1.len());
        let by_chance = count * share.powi(i32::try_from(repeated).unwrap_or(i32::MAX));
        let Some(next) = known.get(from + repeated + 1) else { continue };
        if run.1[0] && repeated >= FEWEST_REPEATED && by_chance < BY_CHANCE && (value[*next] - value[known[from]]).abs() > by {
            stuck.extend_from_slice(&known[from + 1..=from + repeated]);
        }
    }
    stuck.iter().for_each(|&i| value[i] = f64::NAN);
    stuck.len()
}

/// Share of repeats from which a channel holds its values from one sample of a slower one to the next, and by how many times the
/// least change the usual one may be larger for a coarse sensor, which repeats itself too but changes by multiples of its resolution.
const HELD_SHARE: f64 = 0.4;
const COARSE: f64 = 1.5;

/// Puts NaN in place of the repeats of a channel that is held between the samples of a slower one, among the rows that are `judged`:
/// each value stands where it comes first. Returns which rows they are.
pub(crate) fn thin_held(value: &mut [f64], judged: &dyn Fn(usize) -> bool) -> Vec<usize> {
    let known: Vec<usize> = (0..value.len()).filter(|&i| value[i].is_finite() && judged(i)).collect();
    let mut changes: Vec<f64> = known.windows(2).map(|w| (value[w[1]] - value[w[0]]).abs()).collect();
    let repeats: Vec<usize> = known.windows(2).filter(|w| value[w[0]] == value[w[1]]).map(|w| w[1]).collect();
    if (repeats.len() as f64) < HELD_SHARE * changes.len() as f64 {
        return Vec::new();
    }
    changes.retain(|c| *c > 0.0);
    changes.sort_by(f64::total_cmp);
    let (Some(least), Some(usual)) = (changes.first(), changes.get(changes.len() / 2)) else { return Vec::new() };
    let steps = changes.iter().filter(|c| (*c / least - (*c / least).round()).abs() < 1e-3).count();
    if *usual <= COARSE * least && 20 * steps > 19 * changes.len() {
        return Vec::new();
    }
    repeats.iter().for_each(|&i| value[i] = f64::NAN);
    repeats
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_that_nobody_saw_is_unknown_and_a_silence_without_one_is_not() {
        let time: Vec<f64> = (0..60).map(|i| 4.0 * f64::from(i)).collect();
        let mut pitch: Vec<f64> = time.iter().map(|t| if *t < 120.0 { -0.4 } else { 0.4 }).collect();
        assert!(!changed_unseen(&time, &pitch, 0.1).contains(&true), "a turn that was logged");
        pitch[25..35].fill(f64::NAN);
        let unseen = changed_unseen(&time, &pitch, 0.1);
        // From the first row without a value, 100 s, to 30 s after the next value at 140 s.
        assert!((0..60).all(|i| unseen[i] == (25..=42).contains(&i)), "{unseen:?}");
        let mut glide = vec![-0.4; 60];
        glide[25..35].fill(f64::NAN);
        assert!(!changed_unseen(&time, &glide, 0.1).contains(&true), "nothing happened");
        // Logged every 32 s, a turn may have been at any time between two samples; glides are known.
        let rare: Vec<f64> = (0..60).map(|i| if i % 8 == 0 { if i < 30 { -0.4 } else { 0.4 } } else { f64::NAN }).collect();
        let unseen = changed_unseen(&time, &rare, 0.1);
        // From after the last value before the turn, 96 s, to 30 s after the next, 128 s.
        assert!((0..60).all(|i| unseen[i] == (25..=39).contains(&i)), "{unseen:?}");
    }

    #[test]
    fn repeats_of_a_stuck_sensor_are_removed_and_of_a_coarse_one_kept() {
        // 0.15 m/s down at a resolution of 100 Pa, every 4 s; then stuck for a minute.
        let sinking = |i: i32| (f64::from(i) * 6000.0 / 100.0).round() * 100.0;
        let mut pressure: Vec<f64> = (0..200).map(sinking).collect();
        let whole = pressure.clone();
        pressure[80..95].fill(whole[80]);
        assert_eq!(unstick(&mut pressure, &|_| true, 0.0), 14);
        assert!((0..200).all(|i| if (81..95).contains(&i) { pressure[i].is_nan() } else { pressure[i] == whole[i] }));
        let before = whole.clone();
        let mut untouched = whole;
        assert_eq!(unstick(&mut untouched, &|_| true, 0.0), 0);
        assert_eq!(untouched, before);
        // Pitch at a resolution of a degree hardly ever changes in a glide; nor does what is not judged count.
        let mut coarse: Vec<f64> = (0..200).map(|i| if i % 50 < 25 { -0.42 } else { 0.44 }).collect();
        assert_eq!(unstick(&mut coarse, &|_| true, 0.1), 0);
        let mut afloat = vec![0.0; 30];
        afloat.extend((0..100).map(sinking));
        assert_eq!(unstick(&mut afloat, &|i| i >= 30, 0.0), 0);
        // Stuck, but let go where it was: nothing is lost.
        let mut held: Vec<f64> = (0..200).map(|i| -0.42 + 0.002 * f64::from(i * 7 % 5)).collect();
        held[80..95].fill(-0.42);
        assert_eq!(unstick(&mut held.clone(), &|_| true, 0.1), 0);
        held[95..].iter_mut().for_each(|p| *p += 0.84);
        assert_eq!(unstick(&mut held, &|_| true, 0.1), 14);
    }
}

//! What the battery says: the nose of a glider stands where the moments in pitch balance (FORMAT section 4).
//!
//! ```text
//! I q' = −m_b g (x_b + x_b0) cos θ − m g h sin θ + ρ g V_b x_p cos θ + ½ ρ U² S l cm_α α + ½ ρ S l² cm_q (U + 0.35) q
//! ```
//! Solved for the battery's position x_b and averaged over half a minute, all of it is measured but the zero x_b0, the speed U and the
//! angle of attack α, and those two the model has. So each quiet half minute measures what no other sensor does: a pitch that is wrong
//! in proportion, the lift that an angle of attack gives, an angle at which there is none.
//!
//! The numbers of the moments are the vehicle file's; one that states none, or a log without the battery's position, is judged without.
//! How far they are to be trusted the flight itself says: where the moments of a whole flight do not balance by the best hypothesis
//! there is, they count for as little as they miss by.

use crate::likelihood::{Column, Problem};
use crate::model::dynamics::Track;
use crate::model::parameters::{
    BALLAST_ARM, BATTERY_MASS, BATTERY_ZERO, METACENTRIC_HEIGHT, PITCH_DAMPING, PITCH_MOMENT, State, tolerance_of,
};
use crate::preprocess::{Input, Run};
use hydro::effects::{ALPHA_VALID_RAD, Active, Constants, ForceModel, Sensed};
use logs::vehicle::Vehicle;
use logs::vehicle::pitch_moments::PitchMoments;
use std::ops::RangeInclusive;

/// Speed that the damping of the pitch adds to that of the glide, m/s (FORMAT section 4).
const DAMPED_AT_M_S: f64 = 0.35;
/// Length of a stretch, s: twice the time in which the pitch settles, half of that in which a leg of a shallow dive is flown.
const STRETCH_S: f64 = 30.0;
/// Longest time between two rows of a stretch, s.
const ROWS_APART_S: f64 = 12.0;
/// Most that engine and battery move between two rows of a stretch, m³ and m: where in between they did is not seen.
const STILL_M3: f64 = 4e-6;
const STILL_M: f64 = 1.5e-3;
/// Fastest that a quiet nose turns, rad/s: at this rate a damping that is off by its tolerance moves the battery by about its noise.
/// While the nose swings through an inflection the flow has not settled either.
const STEADY_RAD_S: f64 = 0.0015;
/// Least share of the battery's mass that a fit may try.
const LEAST_MASS: f64 = 0.1;
/// Resolution of a battery's position, m (a tenth of a millimetre in the format's examples), for logs that do not say.
const RESOLUTION_M: f64 = 1e-4;
/// Share of a sample's variance that is left in the smoothed pitch at one instant, per second between samples: of a quadratic over
/// ±[`crate::preprocess::PITCH_WINDOW_S`].
const SMOOTHED_PER_S: f64 = 0.22;
/// A deviation counts no more than this, in typical ones, when the noise factor is estimated.
const MOST_DEVIATIONS: f64 = 3.0;
/// Likeness of neighbours beyond which it is not believed: what follows a slow variable is no noise.
const MOST_ALIKE: f64 = 0.8;
/// Change of the noise factor that is worth a new search.
const CHANGED: f64 = 1.25;
/// Damping beyond which the noise of the pitch's rate is no reason against less of it, tolerances over the file's.
const FULL_DAMPING: f64 = 2.0;
/// Noise factor from which it is reported.
const REPORTED_FACTOR: f64 = 1.5;

/// Keys of the numbers in the vehicle file, and the deviation from which one is spoken of, tolerances.
pub(crate) const MOMENT_NUMBERS: [(usize, &str); 5] = [
    (BATTERY_MASS, "battery_mass_kg"),
    (METACENTRIC_HEIGHT, "metacentric_height_m"),
    (BALLAST_ARM, "ballast_arm_m"),
    (PITCH_MOMENT, "cm_alpha"),
    (PITCH_DAMPING, "cm_q"),
];
const SURELY_OFF: f64 = 4.0;

/// A quiet stretch of a run, and where the battery was in it.
#[derive(Clone, Debug)]
pub(crate) struct Stretch {
    rows: RangeInclusive<usize>,
    battery_m: f64,
    /// Noise of that and of what it is compared with, 1 sigma, m.
    sigma_m: f64,
    /// Share of its square that is noise of the pitch's rate, which comes with the damping.
    of_rate: f64,
}

/// Mean over rows of what a row has, weighted by time.
fn mean(time_s: &[f64], rows: &RangeInclusive<usize>, of: impl Fn(usize) -> f64) -> f64 {
    let (from, to) = (*rows.start(), *rows.end());
    let sum: f64 = (from..to).map(|i| 0.5 * (of(i) + of(i + 1)) * (time_s[i + 1] - time_s[i])).sum();
    sum / (time_s[to] - time_s[from])
}

/// Damping moment per rate of pitch, N m s/rad.
fn damping(moments: &PitchMoments, c: &Constants, density_kg_m3: f64, speed_m_s: f64) -> f64 {
    0.5 * density_kg_m3 * c.reference_area_m2 * moments.length_m * moments.length_m * moments.cm_q * (speed_m_s + DAMPED_AT_M_S)
}

/// Quiet stretches of a run, of rows that take part.
pub(crate) fn stretches(moments: &PitchMoments, vehicle: &Vehicle, run: &Run, used: &[bool]) -> Vec<Stretch> {
    let (time, c, s) = (&run.time_s, &vehicle.constants, &vehicle.sensors);
    let pitch = s.pitch_sigma_rad();
    let per_rad = c.mass_kg / moments.battery_mass_kg * moments.metacentric_height_m;
    let damping = damping(moments, c, 1020.0, 0.3) / (moments.battery_mass_kg * c.gravity_m_s2);
    let steady = |i: usize| run.input_at_row(i, 0.0).pitch_rate_rad_s.abs() < STEADY_RAD_S;
    let goes_on = |i: usize| {
        let (moved, pumped) = (run.battery_m[i + 1] - run.battery_m[i], run.ballast_m3[i + 1] - run.ballast_m3[i]);
        let still = moved.abs() < STILL_M && pumped.abs() < STILL_M3;
        used[i] && used[i + 1] && time[i + 1] - time[i] < ROWS_APART_S && still && steady(i) && steady(i + 1)
    };
    let mut out = Vec::new();
    let mut from = 0;
    for i in 0..time.len().saturating_sub(1) {
        // Unknown positions are not still.
        if !goes_on(i) {
            from = i + 1;
            continue;
        }
        let length = time[i + 1] - time[from];
        if length < STRETCH_S {
            continue;
        }
        let rows = from..=i + 1;
        let count = (i + 2 - from) as f64;
        // A move is at an unknown instant between two rows.
        let unseen = (from..=i).map(|k| ((run.battery_m[k + 1] - run.battery_m[k]) * (time[k + 1] - time[k]) / length).powi(2));
        let of_rate = 2.0 * (SMOOTHED_PER_S * length / (count - 1.0)).min(1.0) * (pitch * damping / length).powi(2);
        let variance = (RESOLUTION_M.powi(2) / 12.0 + (pitch * per_rad).powi(2)) / count + of_rate + unseen.sum::<f64>() / 12.0;
        out.push(Stretch {
            battery_m: mean(time, &rows, |k| run.battery_m[k]),
            rows,
            sigma_m: variance.sqrt(),
            of_rate: of_rate / variance,
        });
        from = i + 1;
    }
    out
}
/// What is to be paid for a damping off by `z` tolerances, where so much noise of the pitch's rate is heard through it.
fn noise_in_damping(heard: f64, tolerance: f64, z: f64) -> (f64, f64, f64) {
    // u = z far below, and a constant far beyond.
    let less = (FULL_DAMPING - z).min(700.0).exp();
    let (u, share) = (FULL_DAMPING - less.ln_1p(), less / (1.0 + less));
    let whole = 1.0 + tolerance * u;
    let slope = -heard * tolerance * whole * share;
    let curvature = heard * tolerance * share * (whole * (1.0 - share) - tolerance * share);
    (heard * (1.0 - whole * whole), slope, curvature)
}

impl Problem<'_> {
    /// Where the battery was in the quiet stretches of run `k`, in their noise.
    pub(crate) fn whiten_battery_seen(&self, k: usize, out: &mut Vec<f64>) {
        out.extend(self.stretches[k].iter().map(|s| s.battery_m / (s.sigma_m * self.moment_noise_factor)));
    }

    /// Where the moments in pitch want it, in the same.
    pub(crate) fn whiten_battery_wanted(
        &self,
        k: usize,
        run: &Run,
        state: &State,
        (constants, effects): &(Constants, Vec<Active>),
        t: &Track,
        out: &mut Vec<f64>,
    ) {
        let Some(m) = &self.vehicle.moments else { return };
        let stretches = &self.stretches[k];
        let (Some(first), Some(last)) = (stretches.first(), stretches.last()) else { return };
        let rows = *first.rows.start()..=*last.rows.end();
        let from = *rows.start();
        let factor = |index: usize| self.of_file(state, index);
        let (height, arm, turning) = (factor(METACENTRIC_HEIGHT), factor(BALLAST_ARM), factor(PITCH_MOMENT));
        let zero_m = state.calibration[BATTERY_ZERO] * m.battery_zero_m;
        let battery_kg = m.battery_mass_kg * factor(BATTERY_MASS).max(LEAST_MASS);
        let weight = battery_kg * constants.gravity_m_s2;
        // The damping's own number is of the damping per mass of the battery, as it is heard here.
        let damped_weight = m.battery_mass_kg * constants.gravity_m_s2;
        // Half of a half step ahead: the nearest.
        let inputs: Vec<&Input> = rows.clone().map(|row| run.input_at_row(row, 0.25 * run.step_s)).collect();
        // The reading of the engine itself: volume from elsewhere does not act at its arm.
        let model = ForceModel::new(*constants, effects);
        let seen = |(input, row): (&&Input, usize)| model.truth(Sensed { ballast_m3: run.ballast_m3[row], ..input.sensed });
        let sensed: Vec<Sensed> = inputs.iter().zip(rows.clone()).map(seen).collect();
        let wanted: Vec<f64> = rows
            .zip(inputs.iter().zip(&sensed))
            .map(|(row, (input, s))| {
                let (sin, cos) = input.turned(s.pitch_rad);
                let (speed, alpha) = (t.speed_m_s[row], t.alpha_rad[row].clamp(-ALPHA_VALID_RAD, ALPHA_VALID_RAD));
                let dynamic = 0.5 * s.density_kg_m3 * speed * speed * constants.reference_area_m2;
                let upright = -constants.mass_kg / battery_kg * m.metacentric_height_m * height * sin;
                let flow = dynamic * m.length_m * m.cm_alpha * turning * alpha / weight;
                (upright + flow) / cos + s.density_kg_m3 * s.ballast_m3 * m.ballast_arm_m * arm / battery_kg
            })
            .collect();
        for stretch in stretches {
            let (a, b) = (*stretch.rows.start(), *stretch.rows.end());
            let steady = mean(&run.time_s, &stretch.rows, |row| wanted[row - from]);
            let speed = 0.5 * (t.speed_m_s[a] + t.speed_m_s[b]);
            let (then, now) = (&sensed[a - from], &sensed[b - from]);
            let damping = factor(PITCH_DAMPING) * damping(m, constants, now.density_kg_m3, speed) * (now.pitch_rad - then.pitch_rad);
            let swinging = m.inertia_kg_m2 * (inputs[b - from].pitch_rate_rad_s - inputs[a - from].pitch_rate_rad_s);
            let length = (run.time_s[b] - run.time_s[a]) * inputs[a - from].cos_pitch;
            let turned = (damping / damped_weight - swinging / weight) / length;
            out.push((steady + turned - zero_m) / (stretch.sigma_m * self.moment_noise_factor));
        }
    }

    /// What a damping of the pitch off by `z` tolerances seems to gain by the noise of the pitch's rate alone, which it multiplies: that
    /// much is to be paid for it (penalty, and half of its slope and curvature), or every flight asks for less damping than there is.
    /// Beyond [`FULL_DAMPING`] nothing is given back: a file that overstates the noise of its pitch would ask for ever more damping.
    pub(crate) fn noise_in_damping(&self) -> impl Fn(f64) -> (f64, f64, f64) + use<> {
        let heard = self.stretches.iter().flatten().map(|s| s.of_rate).sum::<f64>() / self.moment_noise_factor.powi(2);
        let tolerance = tolerance_of(self.vehicle, PITCH_DAMPING);
        move |z| noise_in_damping(heard, tolerance, z)
    }

    /// What a state takes a relative number of the calibration for, in shares of the vehicle file's.
    fn of_file(&self, state: &State, index: usize) -> f64 {
        1.0 + state.calibration[index] * tolerance_of(self.vehicle, index)
    }

    /// Where in a whitened vector the battery of run `k` is.
    fn battery_range(&self, k: usize) -> std::ops::Range<usize> {
        let end = self.offsets[k + 1];
        end - self.stretches[k].len()..end
    }

    /// A signature over all runs without what the battery says of it: its noise has a colour that is not known well enough to detect an
    /// effect outside the catalogue in.
    pub(crate) fn without_battery(&self, mut values: Vec<f64>) -> Column {
        (0..self.runs.len()).for_each(|k| values[self.battery_range(k)].fill(0.0));
        self.column(0, values)
    }

    /// Factor on the noise of the moments by what a state leaves of them: 1 where they balance to the noise of the sensors.
    fn moment_noise_factor_at(&self, state: &State) -> f64 {
        if self.stretches.iter().all(Vec::is_empty) {
            return self.moment_noise_factor;
        }
        let residual: Vec<f64> = self.data.iter().zip(self.model(state)).map(|(d, m)| (d - m) * self.moment_noise_factor).collect();
        let missed: Vec<&[f64]> = (0..self.runs.len()).map(|k| &residual[self.battery_range(k)]).collect();
        let mut sizes: Vec<f64> = missed.iter().copied().flatten().map(|r| r.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        // A few stretches must not set it; half of a normal variable's deviations are beyond 0.6745.
        let most = MOST_DEVIATIONS * sizes[sizes.len() / 2] / 0.6745;
        // A state without a glide says nothing.
        if !most.is_finite() {
            return self.moment_noise_factor;
        }
        let held = |r: f64| r.clamp(-most, most);
        let square: f64 = sizes.iter().map(|r| held(*r).powi(2)).sum();
        let product: f64 = missed.iter().flat_map(|run| run.windows(2)).map(|r| held(r[0]) * held(r[1])).sum();
        let alike = (product / square).clamp(0.0, MOST_ALIKE);
        let factor = (square / sizes.len() as f64 * (1.0 + alike) / (1.0 - alike)).sqrt();
        if factor.is_finite() { factor.max(1.0) } else { self.moment_noise_factor }
    }

    /// What the battery's position has told of itself, for the report.
    pub(crate) fn moments_said(&self, state: &State) -> Vec<String> {
        let count: usize = self.stretches.iter().map(Vec::len).sum();
        let mut notes = Vec::new();
        if count == 0 {
            return notes;
        }
        let of = if self.moment_noise_factor < REPORTED_FACTOR {
            String::new()
        } else {
            format!(", their noise raised: they miss by {:.1} times what the sensors' noise would leave", self.moment_noise_factor)
        };
        notes.push(format!("the position of the battery was compared with the moments in pitch in {count} quiet half minutes{of}"));
        let factor = |index: usize| self.of_file(state, index);
        for (index, key) in MOMENT_NUMBERS {
            let off = factor(index) * if index == PITCH_DAMPING { factor(BATTERY_MASS) } else { 1.0 } - 1.0;
            if state.calibration[index].abs() > SURELY_OFF {
                notes.push(format!("by the position of the battery pitch.{key} of the vehicle file is off by {:+.0} %", 100.0 * off));
            }
        }
        notes
    }

    /// Sets the noise factor of the moments to what a state asks for, where that is clearly more or less than before. Whether it was.
    pub(crate) fn scale_moment_noise(&mut self, state: &State) -> bool {
        let factor = self.moment_noise_factor_at(state);
        let changed = (factor / self.moment_noise_factor).max(self.moment_noise_factor / factor) > CHANGED;
        if changed {
            self.moment_noise_factor = factor;
            self.set_colour(self.colour);
        }
        changed
    }

    /// Signatures of the calibration numbers that nothing but the battery feels, from the first, per step of each.
    pub(crate) fn battery_columns(&self, at: &State, steps: &[f64]) -> Vec<Vec<f64>> {
        if self.stretches.iter().all(Vec::is_empty) {
            return vec![vec![0.0; self.data.len()]; steps.len()];
        }
        let law = self.law(at);
        let tracks = self.fitted_tracks(at);
        let wanted = |k: usize, state: &State| {
            let mut out = Vec::new();
            self.whiten_battery_wanted(k, self.runs[k], state, &law, &tracks[k], &mut out);
            out
        };
        let base: Vec<Vec<f64>> = (0..self.runs.len()).map(|k| wanted(k, at)).collect();
        let column = |(number, step): (usize, &f64)| {
            let mut shifted = at.clone();
            shifted.calibration[BATTERY_ZERO + number] += step;
            let mut values = vec![0.0; self.data.len()];
            for (k, base) in base.iter().enumerate() {
                let range = self.battery_range(k);
                values[range].iter_mut().zip(wanted(k, &shifted).iter().zip(base)).for_each(|(v, (b, a))| *v = (b - a) / step);
            }
            values
        };
        steps.iter().enumerate().map(column).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::noise_in_damping;
    use logs::vehicle::pitch_moments::PitchMoments;
    use std::path::Path;

    /// A battery that is slow moves little from row to row while the nose still swings, and what holds a swinging nose is not what holds
    /// a quiet one: such half minutes missed by up to seven times their noise, and drags were named for it in flights of others.
    #[test]
    fn regress_a_nose_that_swings_is_not_quiet_however_slow_the_battery() {
        let text = include_str!("../../../../vehicles/slocum-standard.toml");
        let vehicle = logs::vehicle::parse_text(text, Path::new("v.toml")).expect("reads");
        let moments = PitchMoments {
            inertia_kg_m2: 20.0,
            metacentric_height_m: 0.005,
            battery_mass_kg: 9.0,
            ballast_arm_m: 0.7,
            length_m: 1.8,
            cm_alpha: -0.1,
            cm_q: -0.5,
            battery_zero_m: 0.002,
        };
        // Rows 4 s apart; the nose turns by 0.9 rad about 200 s, with a time constant of 12 s.
        let mut run = crate::model::integrator::tests::run(200.0, 0.45, false);
        run.battery_m = run.time_s.iter().map(|t| 1e-4 * ((t - 200.0) / 4.0).clamp(-20.0, 20.0)).collect();
        let quiet = super::stretches(&moments, &vehicle, &run, &run.used);
        let swings = |row: usize| (run.time_s[row] - 200.0).abs() < 20.0;
        assert!(!quiet.iter().any(|s| s.rows.clone().any(swings)), "{quiet:?}");
        // 170 s before and after in half minutes and a row.
        assert!(quiet.len() >= 8, "{quiet:?}");
    }

    /// Noise that a damping of share w multiplies leaves w² of itself: what a fit seems to gain by less damping it pays here.
    #[test]
    fn accuracy_less_damping_pays_for_the_noise_and_more_gains_nothing() {
        let (heard, tolerance) = (280.0, 0.05);
        let paid = |z: f64| noise_in_damping(heard, tolerance, z);
        for z in [-30.0, -12.0, -3.0, 0.0, 1.5, 2.5, 6.0, 40.0] {
            let (_, slope, curvature) = paid(z);
            let step = 1e-4;
            let [before, after] = [paid(z - step), paid(z + step)];
            // Half of the slope and curvature of the penalty, differenced over 1e-4 tolerances.
            assert!(((after.0 - before.0) / (4.0 * step) - slope).abs() < 1e-5 * (1.0 + slope.abs()), "{z}: {slope}");
            assert!(((after.1 - before.1) / (2.0 * step) - curvature).abs() < 1e-5 * (1.0 + curvature.abs()), "{z}: {curvature}");
        }
        // Half of the damping and 95 % of it.
        let noise = |z: f64| heard * (1.0 + tolerance * z).powi(2);
        assert!((paid(-10.0).0 - paid(-1.0).0 - (noise(-1.0) - noise(-10.0))).abs() < 0.03 * heard);
        assert!((paid(60.0).0 - paid(20.0).0).abs() < 1e-6 * heard, "no end to what more damping would gain");
    }
}

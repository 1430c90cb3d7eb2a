//! Model against measurement, as the vehicle file stands: how far off, and where.

use crate::criticism::localise::{Finding, rank, residuals};
use crate::diagnosis::check_segments;
use crate::diagnosis::judged::{Judged, as_given_m_s, is_fitted};
use crate::likelihood::Problem;
use crate::likelihood::block_error::{blocks, rms, sampled_every_s};
use crate::model::branch::Branch;
use crate::model::parameters::State;
use crate::preprocess::{Prepared, local_slope, prepare, widened_s};
use hydro::effects::Constants;
use logs::record::flight::Flight;
use logs::vehicle::Vehicle;

/// Half width of the window in which depth rates of single rows are formed, s (21 s in all, order 2, as Savitzky and Golay); of sparse
/// logs it is widened.
const RATE_WINDOW_S: f64 = 10.5;

/// One row of the comparison, for plots.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Segment.
    pub segment: u32,
    /// Time, s.
    pub time_s: f64,
    /// Depth, m.
    pub depth_m: f64,
    /// Measured depth rate, m/s, positive down.
    pub observed_m_s: f64,
    /// Modelled depth rate through the same filter, m/s.
    pub modelled_m_s: f64,
    /// Modelled speed through the water, m/s.
    pub speed_m_s: f64,
    /// Modelled angle of attack, rad.
    pub alpha_rad: f64,
    /// Steady flight.
    pub steady: bool,
}

/// A comparison.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// Rms of the depth-rate residual over submerged rows, m/s.
    pub rms_m_s: f64,
    /// The same over steady rows.
    pub steady_rms_m_s: f64,
    /// Width of the window in which those depth rates are formed, s; not a number where samples are too far apart.
    pub rate_window_s: f64,
    /// Block error of FORMAT section 6.1, m/s, on the segments by which a diagnosis prints it: those it keeps out of its fits, else the fitted.
    pub block_error_m_s: f64,
    /// Usual length of its blocks, s.
    pub block_s: f64,
    /// Number of its blocks, and whether they are of segments that are kept out of fits.
    pub blocks: (usize, bool),
    /// What ordinary water motion and sensors alone would leave of the block error, m/s.
    pub noise_floor_m_s: f64,
    /// Where it fails, best lead first.
    pub findings: Vec<Finding>,
    /// Rows, for plots.
    pub samples: Vec<Sample>,
    /// Mean bias and rms of the speed through the water, measured minus modelled, m/s; none without a speed sensor.
    pub speed_error_m_s: Option<(f64, f64)>,
    /// What had to be repaired.
    pub notes: Vec<String>,
}

impl Comparison {
    /// The width of the depth rates' window in words, put into `named` in place of `{}`; where there is none, why.
    #[must_use]
    pub fn filter(&self, named: &str) -> String {
        if self.rate_window_s.is_finite() {
            named.replace("{}", &format!("{:.0} s", self.rate_window_s))
        } else {
            "samples are too far apart for depth rates".into()
        }
    }
}

/// One number of the law.
type Constant = fn(&Constants) -> f64;

/// Numbers of the law with the range that vehicles have them in (guess: twice as wide as the built-in and the imported ones).
const USUAL_RANGES: [(&str, Constant, f64, f64); 7] = [
    ("hydro.cd0", |c| c.cd0, 0.005, 2.0),
    ("hydro.hull_drag_per_rad2", |c| c.hull_drag_per_rad2, -1.0, 70.0),
    ("hydro.induced_k", |c| c.induced_k, -0.1, 5.0),
    ("lift slope on S (hydro.wing_lift_slope_per_rad, hydro.hull_lift_slope_per_rad and their areas)", |c| c.lift_slope_per_rad, 0.1, 25.0),
    ("hydro.lift_quadratic_per_rad2", |c| c.lift_quadratic_per_rad2, -20.0, 50.0),
    ("hydro.added_mass_surge", |c| c.added_mass_surge, 0.0, 1.0),
    ("hydro.added_mass_heave", |c| c.added_mass_heave, 0.0, 3.0),
];

impl Comparison {
    /// Why its numbers say nothing: numbers that no vehicle has, or where and how the model diverged and which numbers of the vehicle are to
    /// be looked at. None where neither is so.
    #[must_use]
    pub fn diverged(&self, vehicle: &Vehicle) -> Option<String> {
        /// No glider is as fast, nor falls as fast, m/s.
        const FASTEST_M_S: f64 = 20.0;
        /// Widths of the usual range beyond it at which the model still flies, and no vehicle does (guess).
        const FAR: f64 = 10.0;
        let beyond = |widths: f64| -> Vec<String> {
            let numbers = USUAL_RANGES.iter().map(|(name, of, low, high)| (name, of(&vehicle.constants), *low, *high));
            let unusual =
                numbers.filter(|(_, value, low, high)| !(low - widths * (high - low)..=high + widths * (high - low)).contains(value));
            unusual.map(|(name, value, low, high)| format!("{name} = {value} (usual: {low} to {high})")).collect()
        };
        let impossible = beyond(FAR);
        if !impossible.is_empty() {
            return Some(format!("no vehicle has {}", impossible.join(", ")));
        }
        let astray = self.samples.iter().find(|s| !(s.speed_m_s.abs() < FASTEST_M_S) || s.modelled_m_s.abs() > FASTEST_M_S)?;
        let named = beyond(0.0);
        let suspects = if named.is_empty() { "the numbers under hydro and the sizes of effects".to_owned() } else { named.join(", ") };
        Some(format!(
            "the model diverged with this vehicle: {:.3e} m/s through the water at {:.0} s of segment {}. Look at {suspects}",
            astray.speed_m_s, astray.time_s, astray.segment
        ))
    }
}

/// Compares a flight with its vehicle's model.
#[must_use]
pub fn compare(flight: &Flight, vehicle: &Vehicle) -> Comparison {
    let prepared: Prepared = prepare(flight, vehicle);
    // Nothing is fitted here: which segments a fit would leave out is no news.
    let check = check_segments(vehicle, &prepared, &mut Vec::new());
    let problem = Problem::new(&prepared, vehicle, |s| is_fitted(vehicle, &check, s));
    let judged = Judged::of(&prepared, vehicle, &check);
    let (printed, held_out) = judged.printed();
    let (branch, state) = (Branch::of_file(vehicle), State::nominal());
    let mut samples = Vec::new();
    let mut all = Vec::new();
    let mut speed = Vec::new();
    for run in &prepared.runs {
        let track = branch.track(run, vehicle, &state);
        all.extend(residuals(run, &blocks(run), &track));
        let (mut from_a, mut from_b) = (0, 0);
        for row in 0..run.time_s.len() {
            let t = run.time_s[row];
            let observed_m_s = local_slope(&run.time_s, &run.depth_m, t, RATE_WINDOW_S, &mut from_a);
            let modelled_m_s = local_slope(&run.time_s, &track.depth_m, t, RATE_WINDOW_S, &mut from_b);
            if !run.used[row] {
                continue;
            }
            let input = |ahead: f64| run.input_at_row(row, ahead);
            let steady = (input(-30.0).sensed.ballast_m3 - input(30.0).sensed.ballast_m3).abs() < 6e-6
                && input(0.0).sensed.pitch_rad.abs() > 0.19
                && (input(0.0).sensed.pitch_rad < 0.0) == (observed_m_s > 0.0)
                && (input(-30.0).depth_m < input(30.0).depth_m) == (observed_m_s > 0.0);
            if run.speed_m_s[row].is_finite() {
                speed.push(run.speed_m_s[row] - track.speed_m_s[row]);
            }
            samples.push(Sample {
                segment: run.segment,
                time_s: t,
                depth_m: run.depth_m[row],
                observed_m_s,
                modelled_m_s,
                speed_m_s: track.speed_m_s[row],
                alpha_rad: track.alpha_rad[row],
                steady,
            });
        }
    }
    let residual = |s: &Sample| s.observed_m_s - s.modelled_m_s;
    // A row without four samples near it has no rate.
    let rms_of = |of: &dyn Fn(&Sample) -> bool| rms(samples.iter().filter(|s| of(s)).map(residual).filter(|r| r.is_finite()));
    let rate_window_s = 2.0 * widened_s(RATE_WINDOW_S, sampled_every_s(&prepared.runs));
    Comparison {
        rate_window_s,
        rms_m_s: rms_of(&|_| true),
        steady_rms_m_s: rms_of(&|s| s.steady),
        block_error_m_s: as_given_m_s(&prepared, vehicle, printed),
        block_s: problem.block_s(),
        blocks: (printed.iter().map(|(_, list)| list.len()).sum(), held_out),
        noise_floor_m_s: problem.noise_floor_m_s(),
        findings: rank(&all),
        speed_error_m_s: (!speed.is_empty()).then(|| (speed.iter().sum::<f64>() / speed.len() as f64, rms(speed.iter().copied()))),
        samples,
        notes: crate::preprocess::sanity::contradiction(&prepared)
            .map(|why| format!("the inputs contradict a dive: {why}"))
            .into_iter()
            .chain(crate::preprocess::sanity::cannot_dive(&prepared, vehicle))
            .chain(vehicle.notes())
            .chain(prepared.notes.iter().cloned())
            .collect(),
    }
}

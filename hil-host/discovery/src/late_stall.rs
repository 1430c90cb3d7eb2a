//! A stall that ends late: flow that comes from below stays attached up to a larger angle of attack than the one at which separated
//! flow attaches again. The catalogue's stall has no such memory; beside a stall it is asked, so that the tool can say that something
//! else is there, never answered.

use crate::calibration::State;
use crate::evidence::log_mean_exp;
use crate::fit::{Effort, Fit, Jacobian, fit};
use crate::prepare::Run;
use crate::problem::Problem;

/// How far beyond the angle at which it ends a stall may begin, rad (guess: sections at chord Reynolds numbers of 1e5 show 2 to 7
/// degrees).
const LATE_RAD: [f64; 4] = [0.03, 0.06, 0.09, 0.12];
/// Where the stall is looked for, in shares of that from where it is without a memory.
const FROM: [f64; 4] = [0.0, -0.35, -0.7, -1.0];
/// Iterations of each fit.
const ITERATIONS: usize = 5;

/// Log Bayes factor of a memory beside a fit with a stall, averaged over its sizes; none where nothing stalls.
#[must_use]
pub fn log_bayes(problem: &Problem, beside: &Fit) -> Option<f64> {
    let stall = beside.state.effects.iter().position(|a| a.effect.name() == "stall")?;
    let parameter = &beside.state.effects[stall].effect.parameters()[0];
    let told = LATE_RAD.map(|late| {
        let runs: Vec<Run> = problem.runs.iter().map(|run| Run { stalls_late_rad: late, ..(*run).clone() }).collect();
        let with_memory = Problem { runs: runs.iter().collect(), ..problem.clone() };
        let starts = FROM.map(|share| {
            let mut state: State = beside.state.clone();
            let angle = &mut state.effects[stall].values[0];
            *angle = (*angle + share * late).clamp(parameter.low, parameter.high);
            state
        });
        let misfit = |model: &Vec<f64>| problem.data.iter().zip(model).map(|(d, m)| (d - m) * (d - m)).sum::<f64>();
        let misfits: Vec<f64> = with_memory.models(&starts).iter().map(misfit).collect();
        let first = (0..starts.len()).min_by(|a, b| misfits[*a].total_cmp(&misfits[*b])).unwrap_or(0);
        let f = fit(&with_memory, &Jacobian::new(&with_memory, &starts[first]), &starts[first], Effort::of(ITERATIONS));
        let told = 0.5 * (beside.chi2 - f.chi2) - 0.5 * (f.log_det - beside.log_det);
        if told.is_finite() { told } else { f64::NEG_INFINITY }
    });
    Some(log_mean_exp(&told))
}

//! A stall that ends late: flow that comes from below stays attached up to a larger angle of attack than the one at which separated
//! flow attaches again. The catalogue's stall has no such memory; beside a stall it is asked, and in the place of a lift slope that is
//! too low (legs that stay separated all the way have one), so that the tool can say that something else is there, never answered.

use crate::inference::evidence::{log_evidence, log_mean_exp};
use crate::inference::gauss_newton::{Effort, Fit, fit_from};
use crate::likelihood::Problem;
use crate::model::parameters::State;
use crate::preprocess::Run;
use hydro::effects::Active;

/// How far beyond the angle at which it ends a stall may begin, rad (guess: sections at chord Reynolds numbers of 1e5 show 2 to 7
/// degrees).
const LATE_RAD: [f64; 4] = [0.03, 0.06, 0.09, 0.12];
/// Where the stall is looked for, in shares of that from where it is without a memory.
const FROM: [f64; 4] = [0.0, -0.35, -0.7, -1.0];
/// Where its end is looked for if no stall is there yet, rad.
const ENDS_RAD: [f64; 4] = [0.03, 0.06, 0.1, 0.15];
/// Iterations of each fit, and how often signatures are renewed where no stall was there.
const ITERATIONS: usize = 5;
const RENEWALS: usize = 3;

/// The effect that loses lift, whether it is a stall, if there is one.
fn loses_lift(state: &State) -> Option<(usize, bool)> {
    let at = |wanted: &dyn Fn(&Active) -> bool| state.effects.iter().position(wanted);
    let stall = at(&|a| a.effect.name() == "stall").map(|k| (k, true));
    stall.or_else(|| at(&|a| a.effect.name() == "lift_slope_error" && a.values[0] < 0.0).map(|k| (k, false)))
}

/// Log Bayes factor of a stall with a memory in the place of what loses lift in a fit, averaged over the sizes of the memory; none
/// where nothing does.
#[must_use]
pub fn log_bayes(problem: &Problem, beside: &Fit) -> Option<f64> {
    let (lost, is_stall) = loses_lift(&beside.state)?;
    let before = log_evidence(problem, beside);
    let renewals = if is_stall { 0 } else { RENEWALS };
    let told = LATE_RAD.map(|late| {
        let runs: Vec<Run> = problem.runs.iter().map(|run| Run { stalls_late_rad: late, ..(*run).clone() }).collect();
        let with_memory = Problem { runs: runs.iter().collect(), ..problem.clone() };
        let angles = if is_stall { FROM.map(|share| beside.state.effects[lost].values[0] + share * late) } else { ENDS_RAD };
        let starts = angles.map(|angle_rad| {
            let mut state: State = beside.state.clone();
            let stall = &mut state.effects[lost];
            if !is_stall {
                *stall = problem.active(&hydro::effects::Stall, angle_rad);
            }
            let parameter = &stall.effect.parameters()[0];
            stall.values[0] = angle_rad.clamp(parameter.low, parameter.high);
            state
        });
        let misfit = |model: &Vec<f64>| problem.data.iter().zip(model).map(|(d, m)| (d - m) * (d - m)).sum::<f64>();
        let misfits: Vec<f64> = with_memory.models(&starts).iter().map(misfit).collect();
        let first = (0..starts.len()).min_by(|a, b| misfits[*a].total_cmp(&misfits[*b])).unwrap_or(0);
        let from = |state: &State| fit_from(&with_memory, state, Effort::of(ITERATIONS));
        let mut f = from(&starts[first]);
        for _ in 0..renewals {
            f = from(&f.state);
        }
        let told = log_evidence(&with_memory, &f) - before;
        if told.is_finite() { told } else { f64::NEG_INFINITY }
    });
    Some(log_mean_exp(&told))
}

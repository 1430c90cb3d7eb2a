//! Effects that nobody has named, as hypotheses: does the data want a structure that follows some variable, larger than models are wrong by?
//!
//! Families of smooth vertical velocities (by leg, depth, time, time since the last turning point, stratification, roll, heading,
//! ballast rate) and of changes of the inputs ([`crate::criticism::unmodelled`]) are offered to a whitened residual with normal
//! amplitudes, what is fitted and the model discrepancy marginalised. Of each, two hypotheses are compared by their marginal likelihoods:
//! ```text
//! usual      none, or a size as models are usually wrong by: half-normal, as that of the discrepancy is
//! unknown    an effect: a size that is log-uniform from there to sixteen times as much
//! ```
//! so a structure that is small is no effect, however many rows vouch for it. No named effect is involved.

use crate::criticism::against_usual::{Form, unknown_against_usual};
use crate::criticism::periodogram::periods;
use crate::criticism::unmodelled::unmodelled_effects;
use crate::inference::discrepancy_size::USUAL_M_S;
use crate::inference::posterior::{Fit, Linearisation};
use crate::likelihood::covariates::{Traits, traits};
use crate::likelihood::{Column, Problem};

/// What a family found.
#[derive(Clone, Debug)]
pub struct Family {
    /// Which variable it follows.
    pub variable: &'static str,
    /// Log Bayes factor of an unknown effect against what models are usually wrong by.
    pub log_bayes: f64,
    /// Amplitude of the vertical velocity that fits best, m/s; none for what acts through trim or pitch.
    pub scale_m_s: Option<f64>,
    /// Period, s, for families in time.
    pub period_s: Option<f64>,
}

impl Family {
    /// Whether it may be the water's motion, which may have a period of some minutes or more (a wave is in the catalogue).
    #[must_use]
    pub fn may_be_water(&self) -> bool {
        self.period_s.is_some() && self.variable != OWN_PERIOD
    }
}

/// What a period of about a minute or two is called.
const OWN_PERIOD: &str = "time (a period of the vehicle's own)";
/// Amplitudes of a period of the vehicle's own that are tried, m/s.
const OWN_M_S: [f64; 6] = [0.0005, 0.001, 0.002, 0.004, 0.008, 0.016];
/// Bins of depth.
const DEPTH_BINS: usize = 8;
/// Periods of slow changes in time that are tried, s.
const PERIODS_S: [f64; 6] = [240.0, 420.0, 720.0, 1200.0, 2100.0, 3600.0];

/// Whether a fit's residual is what its state leaves of this problem's data.
fn is_of(problem: &Problem, fit: &Fit) -> bool {
    let left = problem.models(std::slice::from_ref(&fit.state)).remove(0);
    let apart = |((d, m), r): ((&f64, &f64), &f64)| (d - m - r).powi(2);
    left.len() == fit.residual.values.len()
        && problem.data.iter().zip(&left).zip(fit.residual.values.iter()).map(apart).sum::<f64>() < 1e-9 * (1.0 + fit.chi2)
}

/// What a whitened column of a vertical velocity of 1 m/s is long: down on dives and up on climbs, in all runs.
pub(crate) fn whitened_m_s(problem: &Problem, all: &[Traits]) -> f64 {
    let steady = problem.rate_column(&|k, row| if all[k].down[row] { 1.0 } else { -1.0 });
    steady.plain_dot(&steady).sqrt()
}

/// Vertical velocities that follow one variable, whitened.
struct Basis {
    variable: &'static str,
    columns: Vec<Column>,
    period_s: Option<f64>,
}

impl Basis {
    fn of(variable: &'static str, columns: Vec<Column>) -> Self {
        Self { variable, columns, period_s: None }
    }

    /// What a fit says of it.
    fn family(&self, linearisation: &Linearisation, whitened_m_s: f64) -> Family {
        let form = Form::new(&self.columns.iter().collect::<Vec<_>>(), linearisation, whitened_m_s);
        let (log_bayes, _, size) = unknown_against_usual(&[form]);
        Family { variable: self.variable, log_bayes, scale_m_s: Some(size * USUAL_M_S), period_s: self.period_s }
    }
}

/// Each leg on its own: what changes from leg to leg (time, speed, pitch, ballast).
fn by_leg(problem: &Problem, all: &[Traits]) -> Basis {
    let mut legs = Vec::new();
    for k in 0..problem.runs.len() {
        for wanted in [true, false] {
            let shift = problem.integrated(k, &|k, row| f64::from(u8::from(all[k].down[row] == wanted)));
            legs.push(problem.depth_column(k, &|row| shift[row]));
        }
    }
    Basis::of("leg", legs)
}

/// Sign of a leg: 1 on dives.
fn sign(all: &[Traits], k: usize, row: usize) -> f64 {
    if all[k].down[row] { 1.0 } else { -1.0 }
}

/// Hats over bins of depth, the same on dives and climbs or of the other sign.
fn by_depth(problem: &Problem, all: &[Traits]) -> Basis {
    let g = problem.vehicle.constants.gravity_m_s2;
    let depth = |k: usize, row: usize| problem.runs[k].depth_at_row(row, g);
    let deepest = (0..problem.runs.len())
        .flat_map(|k| (0..problem.runs[k].time_s.len()).map(move |row| (k, row)))
        .map(|(k, row)| depth(k, row))
        .fold(1.0, f64::max);
    let hat = |k: usize, row: usize, bin: usize| {
        let x = depth(k, row) / deepest * DEPTH_BINS as f64 - bin as f64;
        (1.0 - x.abs()).max(0.0)
    };
    let mut bins = Vec::new();
    for bin in 0..=DEPTH_BINS {
        bins.push(problem.rate_column(&|k, row| hat(k, row, bin)));
        bins.push(problem.rate_column(&|k, row| hat(k, row, bin) * sign(all, k, row)));
    }
    Basis::of("depth", bins)
}

/// Decays after a turning point.
fn since_turn(problem: &Problem, all: &[Traits]) -> Basis {
    let mut turns = Vec::new();
    for decay in [15.0, 60.0, 200.0] {
        let after = |k: usize, row: usize| (-all[k].since_turn_s[row] / decay).exp();
        turns.push(problem.rate_column(&|k, row| after(k, row)));
        turns.push(problem.rate_column(&|k, row| after(k, row) * sign(all, k, row)));
    }
    Basis::of("time since the last turning point", turns)
}

/// In proportion to an input, or a power of it.
fn by_input(problem: &Problem, all: &[Traits]) -> [Basis; 5] {
    let rate = |of: &dyn Fn(usize, usize) -> f64| problem.rate_column(of);
    let input = |k: usize, row: usize| problem.runs[k].input_at_row(row, 0.0);
    let stratification = vec![rate(&|k, row| all[k].stratification[row]), rate(&|k, row| all[k].stratification[row] * sign(all, k, row))];
    let roll = vec![
        rate(&|k, row| all[k].roll[row] * 4.0 * sign(all, k, row)),
        rate(&|k, row| all[k].roll[row].abs() * 4.0 * sign(all, k, row)),
        rate(&|k, row| all[k].roll[row].abs() * 4.0),
    ];
    let ballast_rate = vec![rate(&|k, row| all[k].ballast_rate[row]), rate(&|k, row| all[k].ballast_rate[row].abs())];
    let ballast = vec![rate(&|k, row| all[k].ballast[row].powi(2)), rate(&|k, row| all[k].ballast[row].powi(3))];
    let heading = vec![rate(&|k, row| input(k, row).sin_heading), rate(&|k, row| input(k, row).cos_heading)];
    [
        Basis::of("stratification", stratification),
        Basis::of("roll", roll),
        Basis::of("ballast rate", ballast_rate),
        Basis::of("ballast", ballast),
        Basis::of("heading", heading),
    ]
}

/// A sine and a cosine in each run.
fn by_time(problem: &Problem, period: f64) -> Basis {
    let omega = 2.0 * std::f64::consts::PI / period;
    let mut columns = Vec::new();
    for k in 0..problem.runs.len() {
        for shift in [0.0, 0.25] {
            let phase = shift * 2.0 * std::f64::consts::PI;
            let depth = problem.integrated(k, &|k, row| (omega * problem.runs[k].time_s[row] + phase).sin());
            columns.push(problem.depth_column(k, &|row| depth[row]));
        }
    }
    Basis { variable: "time", columns, period_s: Some(period) }
}

/// Tests every family on the residual of each of these fits; of each, best first. An effect outside the catalogue that could reach the log Bayes
/// factor that decides there (the number with the fit) is fitted, not only tried.
#[must_use]
pub fn families(problem: &Problem, fits: &[(&Fit, f64)]) -> Vec<Vec<Family>> {
    debug_assert!(fits.iter().all(|(fit, _)| is_of(problem, fit)), "a fit of other rows or another colour is asked for what remains");
    let linearisations: Vec<Option<Linearisation>> = fits.iter().map(|(fit, _)| fit.linearisation()).collect();
    let all: Vec<Traits> = problem.runs.iter().map(|run| traits(run)).collect();
    let whitened_m_s = whitened_m_s(problem, &all);
    let mut out: Vec<Vec<Family>> = vec![Vec::new(); fits.len()];
    let mut ask = |basis: Basis| {
        for (found, linearisation) in out.iter_mut().zip(&linearisations) {
            found.extend(linearisation.iter().map(|linearisation| basis.family(linearisation, whitened_m_s)));
        }
    };
    ask(by_leg(problem, &all));
    ask(by_depth(problem, &all));
    ask(since_turn(problem, &all));
    by_input(problem, &all).into_iter().for_each(&mut ask);
    PERIODS_S.iter().for_each(|period| ask(by_time(problem, *period)));
    for (found, own) in out.iter_mut().zip(periods(problem, &linearisations, &OWN_M_S)) {
        found.extend(own.map(|p| Family {
            variable: OWN_PERIOD,
            log_bayes: p.log_bayes,
            scale_m_s: Some(p.amplitude_m_s),
            period_s: Some(p.period_s),
        }));
    }
    let ends = problem.work() + problem.most_work() / 6;
    for ((found, linearisation), (_, decides)) in out.iter_mut().zip(&linearisations).zip(fits) {
        let Some(linearisation) = linearisation else { continue };
        let through = |variable: &'static str, log_bayes: f64| Family { variable, log_bayes, scale_m_s: None, period_s: None };
        let asked = unmodelled_effects(problem, linearisation.fit);
        found.extend(asked.iter().map(|s| through(s.variable, s.log_bayes(problem, linearisation, whitened_m_s, *decides, ends))));
        found.sort_by(|a, b| b.log_bayes.total_cmp(&a.log_bayes));
    }
    out
}

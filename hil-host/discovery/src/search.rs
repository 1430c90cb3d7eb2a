//! Which hypothesis do the data prefer: nothing, one effect, two effects; and does anything structured remain.
//!
//! Every hypothesis gets a log evidence: likelihood at the most probable state times the volume of the posterior over the volume
//! of the prior (Laplace). Sizes have a log-uniform prior over the typical range, so all effects pay about the same for being
//! able to explain; an effect that deviates a calibration number must deviate it beyond the tolerance, because inside it is no
//! discovery. Singles are fitted with the full model from several starts; pairs are screened with whitened signatures after the
//! calibration is projected out, and the best ones fitted.

use crate::fit::{Effort, Fit, Jacobian, fit, linear, own_tolerance, start_at};
use crate::problem::{Column, N_CALIBRATION, Problem, State, Wave, calibration_of, tolerance_of};
use hydro::effects::{Active, CATALOGUE, Effect};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;

/// Prior probability that nothing is missing, that one effect is, that two are.
pub const PRIOR: (f64, f64, f64) = (0.25, 0.65, 0.10);
/// Name of the effect whose phase is free in every run.
pub const WAVE: &str = "internal_wave";

/// A hypothesis that was fitted.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Names of its effects, most important first.
    pub effects: Vec<&'static str>,
    /// Log evidence relative to nothing missing (prior odds in it).
    pub log_odds: f64,
    /// Fall of chi² against nothing missing.
    pub gain: f64,
    /// The fit.
    pub fit: Fit,
}

/// Amplitudes a wave is tried at, m/s.
const WAVE_SCALES: [f64; 5] = [0.002, 0.004, 0.008, 0.016, 0.032];

fn wave_periods() -> impl Iterator<Item = f64> {
    (0..22).map(|k| 420.0 * 1.125_f64.powi(k))
}

/// ln of the mean of exp.
#[must_use]
pub fn log_mean_exp(values: &[f64]) -> f64 {
    let top = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !top.is_finite() {
        return f64::NEG_INFINITY;
    }
    top + (values.iter().map(|v| (v - top).exp()).sum::<f64>() / values.len() as f64).ln()
}

/// Sign that an effect has by what it is (growth grows, vortices add force); 0 if either is as likely.
fn usual_sign(effect: &str) -> f64 {
    match effect {
        "vortex_lift_bodywing"
        | "side_edge_lift"
        | "roll_turn_drag"
        | "biofouling_drag"
        | "climb_drag"
        | "added_mass"
        | "heave_added_mass"
        | "reynolds_drag" => 1.0,
        _ => 0.0,
    }
}

/// Prior of an effect's size, integrated against the normal posterior N(value, sigma): `ln E[p]`.
#[must_use]
pub fn log_size_prior(problem: &Problem, effect: &dyn Effect, value: f64, sigma: f64) -> f64 {
    let p = &effect.parameters()[0];
    if effect.name() == "stall" {
        // An angle: uniform where the wings fly.
        let (low, high) = (0.03, 0.25);
        let inside = normal_between(low, high, value, sigma);
        return (inside.max(1e-12) / (high - low)).ln();
    }
    // A deviation inside two tolerances is scatter, beyond three a discovery.
    let hole = own_tolerance(problem, effect.name());
    let smallest = hole.map_or(p.typical / 30.0, |t| 2.2 * t);
    let largest = hole.map_or(p.typical * 12.0, |t| (60.0 * t).max(p.typical * 12.0));
    let one_sided = p.low >= 0.0;
    let steps = 60;
    let width = (largest / smallest).ln() / f64::from(steps);
    let sigma = sigma.max(1e-12 * p.typical);
    let mut sum = 0.0;
    for side in [1.0, -1.0] {
        if one_sided && side < 0.0 {
            continue;
        }
        let usual = usual_sign(effect.name());
        let weight = if usual == 0.0 || one_sided {
            1.0
        } else if usual == side {
            1.9
        } else {
            0.1
        };
        for k in 0..steps {
            let a = smallest * (width * f64::from(k)).exp();
            let b = a * width.exp();
            let mass = if side > 0.0 { normal_between(a, b, value, sigma) } else { normal_between(-b, -a, value, sigma) };
            let middle = (a * b).sqrt();
            let admitted = hole.map_or(1.0, |t| 1.0 / (1.0 + (-(middle / t - 2.8) / 0.15).exp()));
            sum += mass * admitted / middle * weight;
        }
    }
    let volume = (largest / smallest).ln() * if one_sided { 1.0 } else { 2.0 };
    (sum / volume).max(1e-300).ln()
}

/// Probability of a normal variable between two values.
fn normal_between(a: f64, b: f64, mean: f64, sigma: f64) -> f64 {
    let scale = sigma * std::f64::consts::SQRT_2;
    let (x, y) = ((a - mean) / scale, (b - mean) / scale);
    // On the far side use the complement, so that tails keep their digits.
    if x > 0.0 {
        0.5 * (erfc(x) - erfc(y))
    } else if y < 0.0 {
        0.5 * (erfc(-y) - erfc(-x))
    } else {
        1.0 - 0.5 * (erfc(-x) + erfc(y))
    }
}

/// Complementary error function, relative error below 1.2e-7 (Numerical Recipes' Chebyshev fit, 3rd ed. section 6.2).
fn erfc(x: f64) -> f64 {
    let z = x.abs();
    let t = 2.0 / (2.0 + z);
    let poly = -z * z - 1.265_512_23
        + t * (1.000_023_68
            + t * (0.374_091_96
                + t * (0.096_784_18
                    + t * (-0.186_288_06
                        + t * (0.278_868_07 + t * (-1.135_203_98 + t * (1.488_515_87 + t * (-0.822_152_23 + t * 0.170_872_77))))))));
    let value = t * poly.exp();
    if x >= 0.0 { value } else { 2.0 - value }
}

/// Log evidence of a fit up to a constant common to all hypotheses.
#[must_use]
pub fn log_evidence(problem: &Problem, f: &Fit) -> f64 {
    let mut z = -0.5 * f.chi2 - 0.5 * f.log_det;
    for p in f.precision.iter().skip(N_CALIBRATION) {
        z += 0.5 * if *p > 0.0 { p.ln() } else { (2.0 * PI).ln() };
    }
    for &(effect, parameter, sigma) in &f.sigma {
        let a = &f.state.effects[effect];
        if parameter == 0 {
            z += log_size_prior(problem, a.effect, a.values[0], sigma);
        }
    }
    z
}

/// Everything the search found.
#[derive(Debug)]
pub struct Found {
    /// Nothing missing, calibration refitted.
    pub null: Fit,
    /// All hypotheses fitted, best first.
    pub candidates: Vec<Candidate>,
    /// Cosines between signatures of single effects after the calibration is projected out.
    pub likeness: Vec<(&'static str, &'static str, f64)>,
}

struct Screen<'a> {
    problem: &'a Problem<'a>,
    jacobian: Jacobian,
    null: Fit,
    null_evidence: f64,
    waves: Vec<(f64, u32, Vec<Column>)>,
}

impl Screen<'_> {
    fn candidate(&self, f: Fit, prior: f64, extra: f64) -> Candidate {
        let mut effects: Vec<&'static str> = f.state.effects.iter().map(|a| a.effect.name()).collect();
        if f.state.wave.is_some() {
            effects.push(WAVE);
        }
        let worse = !(f.chi2 <= self.null.chi2 + 0.5);
        let log_odds = log_evidence(self.problem, &f) - self.null_evidence + (prior / PRIOR.0).ln() + extra;
        let log_odds = if worse || log_odds.is_nan() { f64::NEG_INFINITY } else { log_odds };
        Candidate { effects, log_odds, gain: self.null.chi2 - f.chi2, fit: f }
    }

    fn fit(&self, start: &State, wave_prior: f64, iterations: usize) -> Fit {
        fit(self.problem, &self.jacobian, start, wave_prior, Effort { iterations, renew: false })
    }

    /// Starts to try for one effect beside the effects of `beside`.
    fn starts(&self, effect: &'static dyn Effect) -> Vec<f64> {
        let p = &effect.parameters()[0];
        // A flight far from its model may sit behind a hill: look from further away too.
        if self.null.chi2 > FAR_OFF * self.problem.data.len() as f64 && effect.name() != "stall" {
            return vec![p.off, (p.off + 1.5 * p.typical).min(p.high), (p.off - 1.5 * p.typical).max(p.low)];
        }
        match effect.name() {
            "stall" => vec![0.05, 0.10, 0.16],
            "vortex_lift_bodywing" => vec![0.5 * p.typical],
            _ => vec![p.off],
        }
    }

    /// Best fit of `effect` added to a state.
    fn best_with(&self, base: &State, effect: &'static dyn Effect, iterations: usize) -> Fit {
        let mut best: Option<Fit> = None;
        for size in self.starts(effect) {
            let mut start = base.clone();
            let mut active = start_at(effect, size);
            if effect.name() == "horizontal_current" {
                active = self.current_start(base);
            }
            start.effects.push(active);
            // Wide tolerances: the calibration must find its way anew beside each effect.
            let far = crate::start::is_uncalibrated(self.problem.vehicle);
            let f = if far { crate::start::descend(self.problem, &start) } else { self.fit(&start, 0.01, iterations) };
            if best.as_ref().is_none_or(|b| f.chi2 < b.chi2) {
                best = Some(f);
            }
        }
        let best = best.unwrap_or_else(|| self.null.clone());
        // Far from the calibrated nominal model the signatures are others: renew them there and go on.
        if self.null.chi2 - best.chi2 > RENEW_GAIN {
            let jacobian = Jacobian::new(self.problem, &best.state);
            let again = fit(self.problem, &jacobian, &best.state, 0.01, Effort { iterations: 5, renew: false });
            if again.chi2 <= best.chi2 {
                return again;
            }
        }
        best
    }

    /// Stall where it promises nothing: the angle out of reach, no discovery.
    fn fit_stall(&self, gain: f64) -> Fit {
        let mut start = self.null.state.clone();
        start.effects.push(start_at(&hydro::effects::Stall, 0.2));
        let iterations = if gain > 1.0 { 4 } else { 0 };
        self.fit(&start, 0.01, iterations)
    }

    /// A current from the displacement residuals, as a start of its fit.
    fn current_start(&self, base: &State) -> Active {
        let (mut east, mut north, mut n) = (0.0, 0.0, 0.0);
        for run in &self.problem.runs {
            if let Some((e, no, _)) = run.displacement_m {
                let t = self.problem.track(run, base);
                east += (e - t.displacement_m.0) / run.displacement_s;
                north += (no - t.displacement_m.1) / run.displacement_s;
                n += 1.0;
            }
        }
        let mut a = start_at(&hydro::effects::HorizontalCurrent, 0.0);
        if n > 0.0 {
            a.values[0] = (east / n).hypot(north / n).max(1e-3);
            a.values[1] = (east / n).atan2(north / n);
        }
        a
    }

    /// Scans period, mode and amplitude of a wave on the residual of a fit: best (period, mode, scale) and the log Bayes factor.
    fn scan_wave(&self, f: &Fit) -> (f64, u32, f64, f64) {
        let n = f.columns.len();
        let mut curvature = DMatrix::from_fn(n, n, |i, j| if j <= i { f.columns[i].dot(&f.columns[j]) } else { 0.0 });
        for i in 0..n {
            for j in i + 1..n {
                curvature[(i, j)] = curvature[(j, i)];
            }
            curvature[(i, i)] = (curvature[(i, i)] + f.precision[i]).max(1e-12);
        }
        let Some(base) = curvature.cholesky() else { return (1200.0, 1, 0.01, f64::NEG_INFINITY) };
        let whole = Column { from: 0, values: f.residual.clone() };
        let mut best = (1200.0, 1, 0.01, f64::NEG_INFINITY);
        let mut all = Vec::new();
        for (period, mode, columns) in &self.waves {
            let prepared = Offer::new(columns, &f.columns, &base, &whole);
            for scale in WAVE_SCALES {
                // Second modes are rarer than first ones.
                let log_bayes = prepared.log_bayes(scale / 2.0_f64.sqrt()) - if *mode == 1 { 0.0 } else { 1.0 };
                all.push(log_bayes);
                if log_bayes > best.3 {
                    best = (*period, *mode, scale, log_bayes);
                }
            }
        }
        (best.0, best.1, best.2, log_mean_exp(&all))
    }

    fn with_wave(&self, f: &Fit, iterations: usize) -> (Fit, f64) {
        let (period_s, mode, scale, log_bayes) = self.scan_wave(f);
        let mut start = f.state.clone();
        start.wave = Some(Wave { period_s, mode, amplitude_m_s: vec![(0.0, 0.0); self.problem.runs.len()] });
        let fitted = self.fit(&start, scale, iterations);
        // The scan has averaged over period, mode and amplitude; the fit knows only the best of them.
        let at_best = log_evidence(self.problem, &fitted) - log_evidence(self.problem, f);
        if !(fitted.chi2 <= f.chi2) {
            return (fitted, f64::NEG_INFINITY);
        }
        (fitted, log_bayes - at_best)
    }
}

/// Extra columns offered to a residual, with what is fitted already projected out.
pub struct Offer {
    gram: DMatrix<f64>,
    match_: DVector<f64>,
}

impl Offer {
    /// Projects the columns.
    #[must_use]
    pub fn new(extra: &[Column], base: &[Column], base_curvature: &nalgebra::Cholesky<f64, nalgebra::Dyn>, residual: &Column) -> Self {
        let (n, m) = (base.len(), extra.len());
        let cross = DMatrix::from_fn(n, m, |i, j| base[i].dot(&extra[j]));
        let mut gram = DMatrix::from_fn(m, m, |i, j| if j <= i { extra[i].dot(&extra[j]) } else { 0.0 });
        for i in 0..m {
            for j in i + 1..m {
                gram[(i, j)] = gram[(j, i)];
            }
        }
        gram -= cross.transpose() * base_curvature.solve(&cross);
        Self { gram, match_: DVector::from_fn(m, |i, _| extra[i].dot(residual)) }
    }

    /// Log Bayes factor for normal amplitudes of this scale.
    #[must_use]
    pub fn log_bayes(&self, scale: f64) -> f64 {
        let s2 = scale * scale;
        let mut scaled = &self.gram * s2;
        for i in 0..self.match_.len() {
            scaled[(i, i)] += 1.0;
        }
        let Some(c) = scaled.cholesky() else { return f64::NEG_INFINITY };
        let log_det: f64 = 2.0 * c.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        0.5 * s2 * self.match_.dot(&c.solve(&self.match_)) - 0.5 * log_det
    }
}

fn wave_library(problem: &Problem) -> Vec<(f64, u32, Vec<Column>)> {
    let mut out = Vec::new();
    for mode in [1, 2] {
        for period in wave_periods() {
            out.push((period, mode, problem.wave_columns(period, mode)));
        }
    }
    out
}

/// Signature of an effect at a state: difference of the model per unit of size, at a size that is felt.
fn signature(problem: &Problem, at: &State, base: &[f64], effect: &'static dyn Effect, size: f64) -> Column {
    let mut with = at.clone();
    let mut active = start_at(effect, size);
    if effect.name() == "horizontal_current" {
        active.values[1] = 0.0;
    }
    with.effects.push(active);
    let unit = if effect.name() == "stall" { 1.0 } else { size - effect.parameters()[0].off };
    let values = problem.model(&with).iter().zip(base).map(|(a, b)| (a - b) / unit).collect();
    Column { from: 0, values }
}

struct Signature {
    effect: &'static dyn Effect,
    column: Column,
}

fn signatures(problem: &Problem, at: &State, jacobian: Option<&Jacobian>) -> Vec<Signature> {
    let base = problem.model(at);
    let mut out = Vec::new();
    for effect in CATALOGUE.iter().copied() {
        let p = &effect.parameters()[0];
        let sizes: Vec<f64> = match effect.name() {
            WAVE | "horizontal_current" => continue,
            "stall" => vec![0.05, 0.09, 0.15],
            _ => vec![p.off + 0.25 * p.typical],
        };
        if let (Some(j), Some(k)) = (jacobian, calibration_of(effect.name())) {
            // A calibration number's own signature, in the effect's unit.
            let unit = tolerance_of(problem.vehicle, k);
            let column = Column { from: 0, values: j.columns[k].values.iter().map(|v| v / unit).collect() };
            out.push(Signature { effect, column });
            continue;
        }
        for size in sizes {
            out.push(Signature { effect, column: signature(problem, at, &base, effect, size) });
        }
    }
    out
}

/// Chi² per innovation of the calibrated nominal model from which fits start from several values.
const FAR_OFF: f64 = 2.5;
/// Nothing missing: the calibration fitted twice, the second time with signatures taken at the first fit.
fn calibrated(problem: &Problem) -> (Jacobian, Fit) {
    let from = Jacobian::new(problem, &problem.start);
    let first = fit(problem, &from, &problem.start, 0.01, Effort { iterations: 3, renew: false });
    let jacobian = Jacobian::new(problem, &first.state);
    let null = fit(problem, &jacobian, &first.state, 0.01, Effort { iterations: 2, renew: false });
    (jacobian, null)
}

/// Fits the calibration alone, and the calibration with these effects.
#[must_use]
pub fn fit_named(problem: &Problem, effects: &[&'static dyn Effect]) -> (Fit, Fit) {
    let (jacobian, null) = calibrated(problem);
    let null_evidence = log_evidence(problem, &null);
    let waves = if effects.iter().any(|e| e.name() == WAVE) { wave_library(problem) } else { Vec::new() };
    let screen = Screen { problem, jacobian, null: null.clone(), null_evidence, waves };
    let mut out = null.clone();
    for effect in effects.iter().filter(|e| e.name() != WAVE) {
        out = screen.best_with(&out.state, *effect, 8);
    }
    if !screen.waves.is_empty() {
        out = screen.with_wave(&out, 3).0;
    }
    (null, out)
}

/// Share of a single effect's log odds that its form may be wrong by.
const FORM_SHARE: f64 = 0.01;
/// And at most this: many forms (sensors, volumes, currents) are exact.
const FORM_MOST: f64 = 1.5;
/// Gain of chi² from which signatures are renewed at the fit.
const RENEW_GAIN: f64 = 40.0;
/// Gain of chi² below which a linear estimate is as good as a fit.
const WORTH_A_FIT: f64 = 4.0;
/// Most singles, and most pairs, that are fitted with the full model.
const MOST_SINGLES: usize = 9;
const MOST_PAIRS: usize = 14;
/// Odds by which any hypothesis with a wave is marked down: it has two amplitudes per run to follow noise of another colour with.
const WAVE_HANDICAP: f64 = 6.0;

/// Searches all singles and the promising pairs. `tick` is told what is being done and which share is done.
#[must_use]
pub fn search(problem: &Problem, tick: &dyn Fn(&str, f64)) -> Found {
    tick("calibration", 0.05);
    let (jacobian, null) = calibrated(problem);
    let null_evidence = log_evidence(problem, &null);
    let waves = wave_library(problem);
    let screen = Screen { problem, jacobian, null, null_evidence, waves };
    let single_prior = PRIOR.1 / CATALOGUE.len() as f64;
    let pair_prior = PRIOR.2 / (CATALOGUE.len() * (CATALOGUE.len() - 1) / 2) as f64;

    // Linear estimates of all, full fits of those that matter.
    tick("single effects", 0.15);
    let signs = signatures(problem, &screen.null.state, Some(&screen.jacobian));
    let mut linear_gain: Vec<(f64, usize)> = Vec::new();
    let mut linear_fits: Vec<Fit> = Vec::new();
    for (i, s) in signs.iter().enumerate() {
        let f = linear(&screen.null, start_at(s.effect, s.effect.parameters()[0].off), &s.column);
        linear_gain.push((screen.null.chi2 - f.chi2, i));
        linear_fits.push(f);
    }
    linear_gain.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut found: Vec<Candidate> = Vec::new();
    let mut fitted = 0;
    let best_gain = linear_gain.first().map_or(0.0, |g| g.0);
    for &(gain, i) in &linear_gain {
        let effect = signs[i].effect;
        if found.iter().any(|c| c.effects == [effect.name()]) {
            continue;
        }
        let f = if (gain > WORTH_A_FIT && fitted < MOST_SINGLES && gain > 0.1 * best_gain) || fitted < 2 {
            fitted += 1;
            tick(effect.name(), 0.15 + 0.03 * fitted as f64);
            screen.best_with(&screen.null.state, effect, 6)
        } else if effect.name() == "stall" {
            // Its signature has no size: the linear estimate would be of an amplitude.
            screen.fit_stall(gain)
        } else {
            linear_fits[i].clone()
        };
        found.push(screen.candidate(f, single_prior, 0.0));
    }
    if let Some(current) = hydro::effects::by_name("horizontal_current").filter(|_| problem.has_displacement()) {
        let f = screen.best_with(&screen.null.state, current, 6);
        found.push(screen.candidate(f, single_prior, 0.0));
    }
    let (f, extra) = screen.with_wave(&screen.null, 2);
    found.push(screen.candidate(f, single_prior, extra - WAVE_HANDICAP));
    found.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));

    // Geometry of the signatures after the calibration is projected out.
    tick("pairs", 0.5);
    let projected = project(&screen.null, &signs);
    let mut likeness = Vec::new();
    let mut ranked: Vec<(f64, usize, usize)> = Vec::new();
    for i in 0..signs.len() {
        for j in i + 1..signs.len() {
            if signs[i].effect.name() == signs[j].effect.name() {
                continue;
            }
            let (gi, gj, gij) = (projected.0[(i, i)], projected.0[(j, j)], projected.0[(i, j)]);
            likeness.push((signs[i].effect.name(), signs[j].effect.name(), gij / (gi * gj).max(1e-300).sqrt()));
            ranked.push((pair_score(problem, &signs, &projected, i, j), i, j));
        }
    }
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
    let best_single = found.first().map_or(0.0, |c| c.log_odds);
    let worthwhile = ranked.first().is_some_and(|r| r.0 + (pair_prior / PRIOR.0).ln() > (0.5 * best_single).max(-2.0));
    let mut pairs: Vec<(&'static dyn Effect, &'static dyn Effect)> = Vec::new();
    let mut add = |a: &'static dyn Effect, b: &'static dyn Effect| {
        let known =
            pairs.iter().any(|(x, y)| (x.name() == a.name() && y.name() == b.name()) || (x.name() == b.name() && y.name() == a.name()));
        if !known && a.name() != b.name() && pairs.len() < MOST_PAIRS {
            pairs.push((a, b));
        }
        !known
    };
    let mut wave_pairs: Vec<Candidate> = Vec::new();
    // From the best singles, with signatures renewed at their fits.
    let leaders: Vec<Candidate> =
        found.iter().filter(|c| c.log_odds > best_single - 25.0 - 0.3 * best_single.max(0.0)).take(4).cloned().collect();
    for single in &leaders {
        if best_single < -1.0 {
            break;
        }
        let renewed = signatures(problem, &single.fit.state, None);
        let (gram, match_) = project(&single.fit, &renewed);
        let mut second: Vec<(f64, usize)> = (0..renewed.len())
            .map(|i| {
                let (g, b) = (gram[(i, i)].max(1e-300), match_[i]);
                (0.5 * b * b / g + log_size_prior_of(problem, &renewed[i], b / g, g.powf(-0.5)), i)
            })
            .filter(|s| s.0 > -1.0)
            .collect();
        second.sort_by(|a, b| b.0.total_cmp(&a.0));
        if single.effects == [WAVE] {
            let offset = single.log_odds - screen.candidate(single.fit.clone(), single_prior, 0.0).log_odds;
            for (_, i) in second.iter().take(2) {
                let f = screen.best_with(&single.fit.state, renewed[*i].effect, 4);
                wave_pairs.push(screen.candidate(f, pair_prior, offset));
            }
        } else {
            let first = single.fit.state.effects[0].effect;
            for (_, i) in second.iter().take(4) {
                add(first, renewed[*i].effect);
            }
            let (f, extra) = screen.with_wave(&single.fit, 2);
            wave_pairs.push(screen.candidate(f, pair_prior, extra - WAVE_HANDICAP));
            if let Some(current) = hydro::effects::by_name("horizontal_current").filter(|_| problem.has_displacement()) {
                add(first, current);
            }
        }
    }
    if worthwhile {
        let top = ranked[0].0;
        let mut taken = 0;
        for (score, i, j) in &ranked {
            if taken < 6 && *score > top - 12.0 - 0.15 * top.max(0.0) && add(signs[*i].effect, signs[*j].effect) {
                taken += 1;
            }
        }
    }
    found.extend(wave_pairs);
    let total = pairs.len();
    for (k, (a, b)) in pairs.into_iter().enumerate() {
        tick("pairs", 0.55 + 0.4 * k as f64 / total as f64);
        // Start from the better of the two singles.
        let gain = |e: &dyn Effect| found.iter().find(|c| c.effects == [e.name()]).map_or(f64::NEG_INFINITY, |c| c.gain);
        let (first, second) = if gain(a) >= gain(b) { (a, b) } else { (b, a) };
        let Some(base) = found.iter().find(|c| c.effects == [first.name()]).map(|c| c.fit.state.clone()) else { continue };
        let f = screen.best_with(&base, second, 6);
        found.push(screen.candidate(f, pair_prior, 0.0));
    }
    // Forms of nature differ a little from ours, and a second effect can mend that: it must be worth more than the difference.
    let alone: Vec<(&'static str, f64)> = found.iter().filter(|c| c.effects.len() == 1).map(|c| (c.effects[0], c.log_odds)).collect();
    for c in found.iter_mut().filter(|c| c.effects.len() > 1) {
        let first = alone.iter().filter(|(n, _)| c.effects.contains(n)).map(|a| a.1).fold(0.0, f64::max);
        c.log_odds -= (FORM_SHARE * first).min(FORM_MOST);
    }
    found.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    Found { null: screen.null, candidates: found, likeness }
}

fn log_size_prior_of(problem: &Problem, s: &Signature, value: f64, sigma: f64) -> f64 {
    if s.effect.name() == "stall" {
        // Amplitude one is the effect itself.
        return -0.5 * (value - 1.0).powi(2) / (0.25 + sigma * sigma);
    }
    log_size_prior(problem, s.effect, s.effect.parameters()[0].off + value, sigma) + sigma.ln() + 0.5 * (2.0 * PI).ln()
}

/// Inner products of signatures and of their match with the residual, after what is fitted is projected out.
fn project(f: &Fit, signs: &[Signature]) -> (DMatrix<f64>, DVector<f64>) {
    let (n, m) = (f.columns.len(), signs.len());
    let mut curvature = DMatrix::from_fn(n, n, |i, j| if j <= i { f.columns[i].dot(&f.columns[j]) } else { 0.0 });
    for i in 0..n {
        for j in i + 1..n {
            curvature[(i, j)] = curvature[(j, i)];
        }
        curvature[(i, i)] = (curvature[(i, i)] + f.precision[i]).max(1e-12) * (1.0 + 1e-9);
    }
    let cross = DMatrix::from_fn(n, m, |i, j| f.columns[i].dot(&signs[j].column));
    let mut gram = DMatrix::from_fn(m, m, |i, j| if j <= i { signs[i].column.dot(&signs[j].column) } else { 0.0 });
    for i in 0..m {
        for j in i + 1..m {
            gram[(i, j)] = gram[(j, i)];
        }
    }
    if let Some(c) = curvature.cholesky() {
        gram -= cross.transpose() * c.solve(&cross);
    }
    let whole = Column { from: 0, values: f.residual.clone() };
    let b = DVector::from_fn(m, |i, _| signs[i].column.dot(&whole));
    (gram, b)
}

fn pair_score(problem: &Problem, signs: &[Signature], projected: &(DMatrix<f64>, DVector<f64>), i: usize, j: usize) -> f64 {
    let (g, b) = projected;
    let (a, c, d) = (g[(i, i)] * (1.0 + 1e-6) + 1e-300, g[(i, j)], g[(j, j)] * (1.0 + 1e-6) + 1e-300);
    let det = a * d - c * c;
    if !(det > 0.0) {
        return f64::NEG_INFINITY;
    }
    let (x, y) = ((d * b[i] - c * b[j]) / det, (a * b[j] - c * b[i]) / det);
    let gain = x * b[i] + y * b[j];
    let (sx, sy) = ((d / det).sqrt(), (a / det).sqrt());
    0.5 * gain + log_size_prior_of(problem, &signs[i], x, sx) + log_size_prior_of(problem, &signs[j], y, sy)
}

//! One hypothesis at a time: the calibration with these effects, fitted, and how much it is to be believed.
//!
//! Every hypothesis gets a log evidence: likelihood at the most probable state times the volume of the posterior over the volume
//! of the prior (Laplace). Sizes have a log-uniform prior over the typical range, so all effects pay about the same for being
//! able to explain; an effect that deviates a calibration number must deviate it beyond the tolerance, because inside it is no
//! discovery.

use crate::hypotheses::sensitivity::{log_size_prior_of, project, signatures};
use crate::inference::evidence::{PRIOR, log_evidence};
use crate::inference::gauss_newton::{Effort, fit};
use crate::inference::numeric::log_mean_exp;
use crate::inference::posterior::Fit;
use crate::inference::projected_columns::ProjectedColumns;
use crate::likelihood::Problem;
use crate::likelihood::jacobian::Jacobian;
use crate::model::internal_wave::{Kind, PARTS, Wave, ordinary_amplitude_m_s, stretched};
use crate::model::parameters::{State, calibration_of, is_law, tolerance_of};
use hydro::effects::{Active, Effect, Onset, Parameter, SeenIn, WAVE};
use std::sync::Arc;

/// A hypothesis that was fitted.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Names of its effects, most important first.
    pub effects: Vec<&'static str>,
    /// Log evidence relative to nothing missing (prior odds in it).
    pub log_odds: f64,
    /// Part of it that corrects the evidence of the fit: a wave's kind is one of many.
    pub correction: f64,
    /// Fall of chi² against nothing missing.
    pub gain: f64,
    /// The fit.
    pub fit: Fit,
    /// Signatures of the calibration taken near it; none if those of nothing missing served.
    pub(crate) own: Option<Arc<Jacobian>>,
}

/// Whether a calibration number deviates further than any vehicle scatters.
pub(crate) fn is_far_from_file(state: &State) -> bool {
    state.calibration.iter().enumerate().any(|(i, z)| is_law(i) && z.abs() > FAR_TOLERANCES)
}

/// Names of the effects of a state.
pub(crate) fn named(state: &State) -> Vec<&'static str> {
    state.effects.iter().map(|a| a.effect.name).chain(state.wave.is_some().then_some(WAVE)).collect()
}

/// Amplitudes a wave is tried at, m/s.
const WAVE_SCALES: [f64; 5] = [0.002, 0.004, 0.008, 0.016, 0.032];
/// Odds by which any hypothesis with a wave is marked down: it has amplitudes in every run to follow noise of another colour with.
const WAVE_HANDICAP: f64 = 4.5;
/// Chi² per innovation of the calibrated nominal model from which fits start from several values.
const FAR_OFF: f64 = 2.5;
/// Or a calibration number that deviates by this many tolerances: what is missing pulls at it.
const FAR_TOLERANCES: f64 = 4.0;
/// Steps that every start of a fit takes, and how many starts go on from there.
const SCOUT_STEPS: usize = 1;
const KEPT_STARTS: usize = 1;
/// Gain of chi² from which signatures are renewed at the fit.
pub(crate) const RENEW_GAIN: f64 = 40.0;
/// Gain of chi² below which the calibration rests, and most rounds of signatures until then.
const AT_REST: f64 = 2.0;
const MOST_ROUNDS: usize = 4;
/// Mean square of the innovations up to which a hypothesis leaves hardly more than noise.
pub(crate) const TELLS_ALL: f64 = 1.3;

/// Whether a size is at the end of what is possible.
pub(crate) fn size_at_end(a: &Active) -> bool {
    a.effect.parameters.iter().zip(&a.values).take(1).any(|(p, v)| at_end(p, *v))
}

fn at_end(p: &Parameter, v: f64) -> bool {
    let margin = 1e-3 * (p.high - p.low);
    // Zero is the bound of what only grows, and no size.
    (v - p.high).abs() < margin || ((v - p.low).abs() < margin && p.low != p.off)
}

/// Tens of minutes: 7 to 58. A longer wave is a drift of each dive of its own and explains anything.
fn wave_periods() -> impl Iterator<Item = f64> {
    (0..19).map(|k| 420.0 * 1.125_f64.powi(k))
}

/// Kinds of waves that are tried. Their signatures are made when they are asked for: of all of them they are seven times the flight.
pub(crate) type Waves = Vec<Kind>;

/// All kinds: periods and modes, in depth and, where the water is stratified, in stretched depth.
pub(crate) fn wave_library(problem: &Problem) -> Waves {
    let mut shapes = vec![None];
    shapes.extend(stretched(&problem.runs, problem.vehicle).map(Some));
    let kinds = shapes.iter().flat_map(|shape| [1, 2].into_iter().flat_map(move |mode| wave_periods().map(move |p| (shape, mode, p))));
    kinds.map(|(shape, mode, period_s)| Kind { period_s, mode, stretched: shape.clone() }).collect()
}

/// Nothing missing: the calibration fitted until it rests, each time with signatures taken at the fit before.
fn calibrated(problem: &Problem, start: &State) -> (Jacobian, Fit) {
    let mut jacobian = Jacobian::new(problem, start);
    let mut null = fit(problem, &jacobian, start, Effort::of(3));
    for _ in 0..MOST_ROUNDS {
        jacobian = Jacobian::new(problem, &null.state);
        let next = fit(problem, &jacobian, &null.state, Effort::of(3));
        let gained = null.chi2 - next.chi2;
        null = next;
        if !(gained > AT_REST) {
            break;
        }
    }
    (jacobian, null)
}

/// Fits the calibration alone, and the calibration with these effects.
#[must_use]
pub fn fit_named(problem: &Problem, effects: &[&'static Effect]) -> (Fit, Fit) {
    let (waves, plain): (Vec<_>, Vec<_>) = effects.iter().copied().partition(|e| e.seen_in == SeenIn::Waves);
    let library = if waves.is_empty() { Vec::new() } else { wave_library(problem) };
    let screen = Screen::new(problem, &problem.start, &library);
    let mut out = screen.one_by_one(&plain);
    // The calibration that was fitted with the first alone may be in another local minimum.
    if plain.len() > 1 && out.mean_square() > TELLS_ALL {
        let back: Vec<_> = plain.iter().rev().copied().collect();
        let others = [screen.one_by_one(&back), screen.together(&plain)];
        out = others.into_iter().fold(out, |best, f| if f.chi2 < best.chi2 { f } else { best });
    }
    if !waves.is_empty() {
        out = screen.with_wave(&Jacobian::new(problem, &out.state), &out, 3).0;
    }
    (screen.null, out)
}

/// What all hypotheses of one search share: nothing missing, its signatures, and the waves that are tried.
pub(crate) struct Screen<'a> {
    pub(crate) problem: &'a Problem<'a>,
    pub(crate) jacobian: Jacobian,
    pub(crate) null: Fit,
    null_evidence: f64,
    waves: &'a Waves,
}

impl<'a> Screen<'a> {
    pub(crate) fn new(problem: &'a Problem<'a>, start: &State, waves: &'a Waves) -> Self {
        let (jacobian, null) = calibrated(problem, start);
        let null_evidence = log_evidence(problem, &null);
        Self { problem, jacobian, null, null_evidence, waves }
    }

    pub(crate) fn candidate(&self, f: Fit, prior: f64, correction: f64) -> Candidate {
        let effects = named(&f.state);
        let worse = !(f.chi2 <= self.null.chi2 + 0.5);
        let odds = log_evidence(self.problem, &f) - self.null_evidence + (prior / PRIOR.0).ln() + correction;
        // A wave no larger than ordinary water motion is ordinary water motion.
        let ordinary = ordinary_amplitude_m_s(self.problem.vehicle);
        let is_water = f.state.wave.as_ref().is_some_and(|w| w.rms_amplitude_m_s() < ordinary);
        let log_odds = if worse || is_water || odds.is_nan() { f64::NEG_INFINITY } else { odds };
        Candidate { effects, log_odds, correction, gain: self.null.chi2 - f.chi2, fit: f, own: None }
    }

    pub(crate) fn has_waves(&self) -> bool {
        !self.waves.is_empty()
    }

    /// Another fit of nothing missing, and its signatures.
    pub(crate) fn set_null(&mut self, jacobian: Jacobian, null: Fit) {
        self.null_evidence = log_evidence(self.problem, &null);
        (self.jacobian, self.null) = (jacobian, null);
    }

    /// The Jacobian to fit further effects of a hypothesis with.
    pub(crate) fn jacobian_at<'b>(&'b self, c: Option<&'b Candidate>) -> &'b Jacobian {
        c.and_then(|c| c.own.as_deref()).unwrap_or(&self.jacobian)
    }

    pub(crate) fn fit(&self, jacobian: &Jacobian, start: &State, iterations: usize) -> Fit {
        fit(self.problem, jacobian, start, Effort::of(iterations))
    }

    /// Whether a fit leaves the flight far from its model, or moves the calibration far to come near.
    fn is_far_off(&self, f: &Fit) -> bool {
        f.chi2 > FAR_OFF * self.problem.data.len() as f64 || is_far_from_file(&f.state)
    }

    /// Starts to try for one effect.
    fn starts(effect: &'static Effect, far_off: bool) -> Vec<f64> {
        let p = &effect.parameters[0];
        match effect.onset {
            Some(onset) => onset.starts_rad.to_vec(),
            // A flight far from its model may sit in a local minimum: start from further away too.
            None if far_off => {
                let aside = [(p.off + 1.5 * p.typical).min(p.high), (p.off - 1.5 * p.typical).max(p.low)];
                std::iter::once(p.off).chain(aside.into_iter().filter(|s| *s != p.off)).collect()
            }
            None => vec![effect.start()],
        }
    }

    /// Effects added one after the other to nothing missing.
    fn one_by_one(&self, effects: &[&'static Effect]) -> Fit {
        effects.iter().fold(self.null.clone(), |f, effect| self.renewed(self.best_with(&self.jacobian, &f, effect, 8), 5).0)
    }

    /// Effects fitted together from the vehicle as given.
    fn together(&self, effects: &[&'static Effect]) -> Fit {
        let starting = |effect: &&'static Effect| {
            let starts = Self::starts(effect, false);
            self.problem.active(effect, starts[starts.len() / 2])
        };
        let start = State { effects: effects.iter().map(starting).collect(), ..self.problem.start.clone() };
        crate::inference::initial_guess::descend(self.problem, &start)
    }

    fn start(&self, base: &State, effect: &'static Effect, size: f64) -> State {
        let mut start = base.clone();
        let mut size = size;
        // What the calibration has taken belongs to the effect that deviates the same number: the same law, at no cost by the prior.
        if let Some(k) = calibration_of(effect) {
            let p = &effect.parameters[0];
            size = (size + start.calibration[k] * tolerance_of(self.problem.vehicle, k)).clamp(p.low, p.high);
            start.calibration[k] = 0.0;
        }
        start.effects.push(if effect.seen_in == SeenIn::Displacement {
            self.current_start(base, effect)
        } else {
            self.problem.active(effect, size)
        });
        start
    }

    /// Goes on from a fit with signatures taken there.
    pub(crate) fn renewed(&self, f: Fit, iterations: usize) -> (Fit, Arc<Jacobian>) {
        let jacobian = Jacobian::new(self.problem, &f.state);
        let again = fit(self.problem, &jacobian, &f.state, Effort::of(iterations));
        (if again.chi2 <= f.chi2 { again } else { f }, Arc::new(jacobian))
    }

    /// Best fit of `effect` added to a state.
    pub(crate) fn best_with(&self, jacobian: &Jacobian, base: &Fit, effect: &'static Effect, iterations: usize) -> Fit {
        let first = base.state.effects.is_empty();
        let far_off = self.is_far_off(base);
        let mut bases = vec![base.state.clone()];
        if first && far_off {
            // What the calibration had to become without the effect may lie behind a hill.
            bases.push(State::nominal());
        }
        let sizes = Self::starts(effect, far_off);
        let mut starts: Vec<State> = bases.iter().flat_map(|base| sizes.iter().map(|size| self.start(base, effect, *size))).collect();
        let mut left = iterations;
        if starts.len() > KEPT_STARTS {
            // All go a little way; those that are lowest then go on.
            let scout = Effort { rough: true, ..Effort::of(SCOUT_STEPS) };
            let mut scouts: Vec<Fit> = starts.iter().map(|start| fit(self.problem, jacobian, start, scout)).collect();
            scouts.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
            starts = scouts.into_iter().take(KEPT_STARTS).map(|f| f.state).collect();
            left = iterations.saturating_sub(SCOUT_STEPS);
        }
        starts
            .iter()
            .map(|start| self.fit(jacobian, start, left))
            .min_by(|a, b| a.chi2.total_cmp(&b.chi2))
            .unwrap_or_else(|| self.null.clone())
    }

    /// An effect beyond an onset angle where it promises nothing: the angle out of reach, no discovery.
    pub(crate) fn fit_unfelt(&self, effect: &'static Effect, onset: Onset) -> Fit {
        self.fit(&self.jacobian, &self.start(&self.null.state, effect, onset.unfelt_rad), 0)
    }

    /// A current from the displacement residuals, as a start of its fit.
    fn current_start(&self, base: &State, current: &'static Effect) -> Active {
        let left = self.problem.currents_m_s(base);
        let (east, north) = left.iter().fold((0.0, 0.0), |s, c| (s.0 + c.0, s.1 + c.1));
        let mut a = self.problem.active(current, 0.0);
        if !left.is_empty() {
            a.values[0] = (east.hypot(north) / left.len() as f64).max(1e-3);
            a.values[1] = east.atan2(north);
        }
        a
    }

    /// Scans kind and amplitude of a wave on the residual of a fit: best kind, its scale, and what the average log Bayes factor over all
    /// kinds and scales falls short of that of the best.
    fn scan_wave(&self, f: &Fit) -> Option<(Kind, f64, f64)> {
        let linearisation = f.linearisation()?;
        let mut best: Option<(&Kind, f64, f64)> = None;
        let mut all = Vec::new();
        for kind in self.waves {
            let prepared = ProjectedColumns::new(&self.problem.wave_columns(kind), &linearisation);
            for scale in WAVE_SCALES {
                // Second modes are rarer than first ones.
                let log_bayes = prepared.log_bayes(scale / 2.0_f64.sqrt()) - if kind.mode == 1 { 0.0 } else { 1.0 };
                all.push(log_bayes);
                if best.is_none_or(|b| log_bayes > b.2) {
                    best = Some((kind, scale, log_bayes));
                }
            }
        }
        best.map(|(kind, scale, log_odds)| (kind.clone(), scale, log_mean_exp(&all) - log_odds))
    }

    /// The best wave added to a fit, and what its log evidence is to be corrected by for its kind being one of many.
    pub(crate) fn with_wave(&self, jacobian: &Jacobian, f: &Fit, iterations: usize) -> (Fit, f64) {
        let Some((kind, scale_m_s, fewer)) = self.scan_wave(f) else { return (f.clone(), f64::NEG_INFINITY) };
        let wave = Some(Wave { kind, amplitude_m_s: vec![[0.0; PARTS]; self.problem.runs.len()], scale_m_s });
        let fitted = self.fit(jacobian, &State { wave, ..f.state.clone() }, iterations);
        let better = fitted.chi2 <= f.chi2;
        (fitted, if better { fewer - WAVE_HANDICAP } else { f64::NEG_INFINITY })
    }

    /// Effects that would gain most over what is fitted, best first: log odds (no prior) and effect. `own` are signatures of the
    /// calibration taken there.
    pub(crate) fn seconds(&self, f: &Fit, own: Option<&Jacobian>) -> Vec<(f64, &'static Effect)> {
        let renewed = signatures(self.problem, &f.state, own);
        let Some(linearisation) = f.linearisation() else { return Vec::new() };
        let (gram, match_) = project(&linearisation, &renewed);
        let mut second: Vec<(f64, &'static Effect)> = (0..renewed.len())
            .map(|i| {
                let (g, b) = (gram[(i, i)].max(1e-300), match_[i]);
                (0.5 * b * b / g + log_size_prior_of(self.problem, &renewed[i], b / g, g.powf(-0.5)), renewed[i].effect)
            })
            .filter(|s| s.0 > -1.0)
            .collect();
        second.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut seen: Vec<&str> = f.state.effects.iter().map(|a| a.effect.name).collect();
        second.retain(|s| {
            !seen.contains(&s.1.name) && {
                seen.push(s.1.name);
                true
            }
        });
        second
    }
}

//! Several flights of one vehicle: its numbers and what is left uncertain of them, so that the next flight is judged by what is known.
//!
//! Every flight is fitted by itself, and what it says of the vehicle is kept as [`Information`], model discrepancy and its own numbers
//! (trim, pitch zero, clock, pressure zero, …: `OWN`) integrated out. The pooled numbers are the place at which all flights are
//! linearised again, until that lowers their misfit no more: a Gauss–Newton fit to all logs at once, in pieces of 27 numbers.
//!
//! The tolerances that are written are what the next flight's numbers are expected within: posterior of the mean, discrepancy in it, and
//! the scatter between flights ([`crate::workbench::pooling`]). Where held-out dives are worse than fitted ones, a flight's information
//! counts by so much less. Trim and pitch zero are set anew at each ballasting: their tolerance is that of the file and the scatter of the
//! flights about their mean, one degree of freedom each (scaled inverse chi²), unless all flights are of one deployment.
//!
//! Not covered: correlation of the numbers (a vehicle file has a tolerance for each, no more); law numbers that no file states a
//! tolerance of are refitted, and start from the same prior again.

use crate::diagnosis::judged::{Blocks, ErrorsMs, Judged, are_worse_than_the_file, errors_m_s};
use crate::diagnosis::settle::estimate_anew;
use crate::diagnosis::{NothingToFit, check_segments, prepared_problem};
use crate::hypotheses::candidate::fit_named;
use crate::hypotheses::identifiability::discrepancy_of;
use crate::likelihood::block_error::block_errors;
use crate::likelihood::jacobian::{Jacobian, symmetric};
use crate::likelihood::{Column, Problem};
use crate::model::parameters::{
    BATTERY_ZERO, CALIBRATION, CLOCK_OFFSET, HEADING_BIAS, N_CALIBRATION, PARAMETERS, PITCH_ZERO, PRESSURE_PORT, PRESSURE_ZERO,
    SPEED_SCALE, STATED, State, TRIM_VOLUME, bounds, set_tolerance, tolerance_of, wide_tail,
};
pub use crate::model::reported_numbers::Number;
use crate::model::reported_numbers::reported_numbers;
use crate::model::sensor_findings::{SensorFinding, sensor_findings};
use crate::preprocess::{Prepared, prepare};
use crate::workbench::pooling::{self, Information, Pooled, pool};
use crate::workbench::refitted_file::{numbers, tolerances, zeros};
use logs::digest::sha256;
use logs::record::flight::Flight;
use logs::vehicle::{Tolerance, Vehicle};
use nalgebra::{DMatrix, DVector};
use serde_json::{Map, Value, json};

/// Numbers of one deployment: set when the vehicle is ballasted, or of its sensors and clocks. All others are the vehicle's.
const OWN: [usize; 8] = [TRIM_VOLUME, PITCH_ZERO, CLOCK_OFFSET, SPEED_SCALE, HEADING_BIAS, PRESSURE_ZERO, PRESSURE_PORT, BATTERY_ZERO];

/// Numbers that [`Options::free`] may name.
#[must_use]
pub fn free_names() -> &'static [&'static str] {
    &CALIBRATION[..STATED]
}

/// Times that all flights are linearised anew, and the fall of chi² that is worth another.
const MOST_LINEARISATIONS: usize = 5;
const WORTH: f64 = 0.5;
/// Scatter between flights that is told of, in tolerances of the file.
const DISAGREE: f64 = 1.0;

/// One flight and the hash of its log.
#[derive(Debug)]
pub struct Logged {
    /// The flight.
    pub flight: Flight,
    /// SHA-256 of its file.
    pub sha256: String,
}

/// How flights are taken together.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Numbers ([`free_names`]) of which the file's tolerance is not believed.
    pub free: Vec<String>,
    /// Whether all flights, and the next, are of one deployment: trim and pitch zero are the vehicle's then.
    pub one_deployment: bool,
}

/// One flight as it was calibrated.
#[derive(Debug)]
pub struct FlightCalibration {
    /// Name.
    pub flight: String,
    /// SHA-256 of its log.
    pub sha256: String,
    /// Segments that were fitted.
    pub fitted_segments: Vec<u32>,
    /// Block errors on fitted and on held-out segments, m/s: as given, calibrated.
    pub error_m_s: [[f64; 2]; 2],
    /// Error that ordinary water motion and sensor noise alone would leave, m/s.
    pub noise_floor_m_s: f64,
    /// Rms velocity that the model is wrong by, m/s.
    pub discrepancy_m_s: f64,
    /// Its own trim, cm³, and pitch zero, rad, relative to the file given, with 1 sigma.
    pub own: [(f64, f64); 2],
    /// Sensors that are found to be off.
    pub sensors: Vec<SensorFinding>,
}

/// What calibrating brought.
#[derive(Debug)]
pub struct Calibrated {
    /// Flights in the order given.
    pub flights: Vec<FlightCalibration>,
    /// Numbers of the vehicle.
    pub numbers: Vec<Number>,
    /// The new vehicle file.
    pub vehicle: Value,
    /// What had to be repaired or assumed.
    pub notes: Vec<String>,
}

/// A name that [`Options::free`] does not know.
#[derive(Debug)]
pub enum Refused {
    /// No such number.
    Name(String),
    /// A flight on which nothing can be fitted.
    Nothing(NothingToFit),
}

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Name(name) => {
                let all = free_names();
                write!(f, "no number `{name}` to free; there are {}", all.join(", "))
            }
            Self::Nothing(why) => why.fmt(f),
        }
    }
}

impl std::error::Error for Refused {}

impl From<NothingToFit> for Refused {
    fn from(why: NothingToFit) -> Self {
        Self::Nothing(why)
    }
}

/// The vehicle with the tolerances of some numbers set wide.
fn freed(vehicle: &Vehicle, names: &[String]) -> Result<Vehicle, Refused> {
    let mut out = vehicle.clone();
    for name in names {
        let index = free_names().iter().position(|n| n == name).ok_or_else(|| Refused::Name(name.clone()))?;
        let freed = PARAMETERS[index].stated().map_or(0.0, |s| s.freed);
        let tolerance = freed.max(tolerance_of(&out, index));
        set_tolerance(&mut out, index, tolerance);
    }
    Ok(out)
}

/// A flight made ready, fitted by itself.
struct Fitted<'a> {
    problem: Problem<'a>,
    state: State,
    error_m_s: f64,
    /// By how much held-out dives are worse than fitted ones, at least 1.
    scatter: f64,
    blocks: [Blocks; 2],
}

impl<'a> Fitted<'a> {
    fn of(flight: &Flight, vehicle: &'a Vehicle, prepared: &'a Prepared, notes: &mut Vec<String>) -> Result<Self, NothingToFit> {
        let mut own = prepared.notes.clone();
        let check = check_segments(vehicle, prepared, &mut own);
        let (mut problem, _) = prepared_problem(flight, vehicle, prepared, &check, &mut own)?;
        let (mut fit, _) = fit_named(&problem, &[]);
        problem.prepare_discrepancy(&fit.state);
        estimate_anew(&mut problem, &fit);
        fit = crate::diagnosis::settle::settled(&problem, &fit.state);
        notes.extend(own.into_iter().map(|n| format!("{}: {n}", flight.name)));
        let Judged { fitted, kept_out } = Judged::of(prepared, vehicle, &check);
        let blocks = [fitted, kept_out];
        let [fitted, held_out] = [0, 1].map(|i| block_errors(&problem, prepared, &[&fit.state], &blocks[i], i == 0)[0]);
        // NaN, where nothing was held out, is no scatter.
        let scatter = (held_out / fitted).max(1.0);
        Ok(Self { problem, state: fit.state, error_m_s: fitted.max(held_out), scatter, blocks })
    }

    /// What the flight says of all calibration numbers around a state, and its misfit; priors are not in it.
    fn says(&self, at: &State) -> Option<(Says, f64)> {
        let jacobian = Jacobian::new(&self.problem, at);
        let residual = self.problem.residual(&self.problem.model(at));
        let (discrepancy, _) = discrepancy_of(&self.problem, at, self.error_m_s);
        let columns: Vec<&Column> = jacobian.columns.iter().chain(&discrepancy).collect();
        let all = information_of(&columns, &residual, &at.calibration);
        let prior = (0..columns.len()).map(|i| f64::from(u8::from(i >= N_CALIBRATION)));
        let numbers: Vec<usize> = (0..N_CALIBRATION).collect();
        let weighed = |mut i: Information| {
            let weight = self.scatter.powi(-2);
            i.matrix *= weight;
            i.vector *= weight;
            i
        };
        let best = weighed(information_of(&columns[..N_CALIBRATION], &residual, &at.calibration));
        let known = weighed(all.with_prior(prior).marginal(&numbers)?);
        Some((Says { best, known }, self.scatter.powi(-2) * residual.dot(&residual)))
    }
}

/// What a flight says of the calibration numbers: where they are best, and what is known of them once a discrepancy that the fit
/// could have followed is integrated out too.
struct Says {
    best: Information,
    known: Information,
}

/// H and b of columns and a residual at values of the first of them (the others are at nothing).
pub(crate) fn information_of(columns: &[&Column], residual: &Column, at: &[f64]) -> Information {
    let n = columns.len();
    let matrix = symmetric(n, |i, j| columns[i].dot(columns[j]));
    let here = DVector::from_fn(n, |i, _| at.get(i).copied().unwrap_or(0.0));
    let vector = DVector::from_fn(n, |i, _| columns[i].dot(residual)) + &matrix * here;
    Information { matrix, vector }
}

/// Precision of the prior of a number, and what its value costs by it.
fn prior(vehicle: &Vehicle, index: usize, z: f64) -> (f64, f64) {
    wide_tail(vehicle, index, z).map_or((1.0, z * z), |(cost, precision)| (precision, cost))
}

/// Scatter of a number between flights that is usual, in its tolerances: half of what carefully ballasted vehicles of a kind differ by, and
/// no more than a third of the file's tolerance. A guess; what flights show takes its place.
fn usual_scatter(vehicle: &Vehicle, index: usize) -> f64 {
    /// Shares of a careful tolerance, of the file's, and of a number that no file states one of.
    const SHARES: [f64; 3] = [0.5, 0.3, 0.2];
    if index >= STATED {
        return SHARES[2];
    }
    let careful = Vehicle { tolerance: Tolerance::default(), ..vehicle.clone() };
    (SHARES[0] * tolerance_of(&careful, index) / tolerance_of(vehicle, index)).min(SHARES[1])
}

/// Which numbers are the vehicle's and which a flight's own.
struct Split {
    shared: Vec<usize>,
    own: Vec<usize>,
}

impl Split {
    fn of(one_deployment: bool) -> Self {
        let is_own = |i: &usize| OWN.contains(i) && !(one_deployment && (*i == TRIM_VOLUME || *i == PITCH_ZERO));
        let (own, shared) = (0..N_CALIBRATION).partition(is_own);
        Self { shared, own }
    }

    fn place(&self, index: usize) -> Option<usize> {
        self.shared.iter().position(|i| *i == index)
    }
}

/// Information of every flight around its state, and their misfit with all priors.
struct Round {
    all: Vec<Says>,
    cost: f64,
}

fn linearised(flights: &[Fitted], states: &[State], split: &Split) -> Option<Round> {
    let mut round = Round { all: Vec::new(), cost: 0.0 };
    for (flight, state) in flights.iter().zip(states) {
        let (says, misfit) = flight.says(state)?;
        round.all.push(says);
        round.cost += misfit + split.own.iter().map(|&i| prior(flight.problem.vehicle, i, state.calibration[i]).1).sum::<f64>();
    }
    if let (Some(flight), Some(first)) = (flights.first(), states.first()) {
        round.cost += split.shared.iter().map(|&i| prior(flight.problem.vehicle, i, first.calibration[i]).1).sum::<f64>();
    }
    Some(round)
}

/// The shared numbers pooled, and each flight's own beside them with their covariance.
struct Joint {
    pooled: Pooled,
    states: Vec<State>,
    own: Vec<DMatrix<f64>>,
}

fn joint(vehicle: &Vehicle, all: &[Says], states: &[State], split: &Split) -> Option<Joint> {
    let own_prior = |state: &State| {
        let mut precision = vec![0.0; N_CALIBRATION];
        split.own.iter().for_each(|&i| precision[i] = prior(vehicle, i, state.calibration[i]).0);
        precision
    };
    let shared = |of: &dyn Fn(&Says) -> Information| -> Option<Vec<Information>> {
        all.iter().zip(states).map(|(says, state)| of(says).with_prior(own_prior(state)).marginal(&split.shared)).collect()
    };
    let first = states.first()?;
    let precision: Vec<f64> = split.shared.iter().map(|&i| prior(vehicle, i, first.calibration[i]).0).collect();
    let usual: Vec<f64> = split.shared.iter().map(|&i| usual_scatter(vehicle, i)).collect();
    let mut pooled = pool(&shared(&|s| s.known.clone())?, &precision, &usual)?;
    pooled.mean = pooling::joint(&shared(&|s| s.best.clone())?, &precision)?.0;
    let clamped = |i: usize, z: f64| bounds(vehicle, i).map_or(z, |(low, high)| z.clamp(low, high));
    let (mut to, mut own) = (Vec::new(), Vec::new());
    for (says, state) in all.iter().zip(states) {
        let mut next = state.clone();
        split.shared.iter().zip(pooled.mean.iter()).for_each(|(&i, z)| next.calibration[i] = clamped(i, *z));
        // A flight's own numbers where the shared ones are these.
        let own_given_shared = |one: &Information| {
            let one = one.with_prior(own_prior(state));
            let n = split.own.len();
            let matrix = DMatrix::from_fn(n, n, |a, b| one.matrix[(split.own[a], split.own[b])]);
            let across = |a: usize| split.shared.iter().map(|&i| one.matrix[(split.own[a], i)] * next.calibration[i]).sum::<f64>();
            let vector = DVector::from_fn(n, |a, _| one.vector[split.own[a]] - across(a));
            Information { matrix, vector }.estimate()
        };
        let (mean, _) = own_given_shared(&says.best)?;
        own.push(own_given_shared(&says.known)?.1);
        split.own.iter().zip(mean.iter()).for_each(|(&i, z)| next.calibration[i] = clamped(i, *z));
        to.push(next);
    }
    Some(Joint { pooled, states: to, own })
}

/// Fits all flights together. `tick` is told what is being done and which share is done.
///
/// # Errors
/// A flight without a dive that a model could be compared with, or a number to free that is none.
pub fn calibrate(
    flights: &[Logged],
    vehicle: &Vehicle,
    options: &Options,
    parent: &[u8],
    tick: &dyn Fn(&str, f64),
) -> Result<Calibrated, Refused> {
    let vehicle = &freed(vehicle, &options.free)?;
    let split = Split::of(options.one_deployment);
    let prepared: Vec<Prepared> = flights.iter().map(|l| prepare(&l.flight, vehicle)).collect();
    let mut notes = Vec::new();
    let mut fitted = Vec::new();
    for (k, (logged, prepared)) in flights.iter().zip(&prepared).enumerate() {
        tick(&logged.flight.name, 0.7 * k as f64 / flights.len() as f64);
        fitted.push(Fitted::of(&logged.flight, vehicle, prepared, &mut notes)?);
    }
    tick("all flights together", 0.7);
    let none =
        || Refused::Nothing(NothingToFit::because("the curvature of the fit is not positive: nothing can be known from these flights"));
    let mut states: Vec<State> = fitted.iter().map(|f| f.state.clone()).collect();
    let round = linearised(&fitted, &states, &split).ok_or_else(none)?;
    let mut now = joint(vehicle, &round.all, &states, &split).ok_or_else(none)?;
    states.clone_from(&now.states);
    let mut round = linearised(&fitted, &states, &split).ok_or_else(none)?;
    for k in 0..MOST_LINEARISATIONS {
        tick("all flights together", 0.75 + 0.25 * k as f64 / MOST_LINEARISATIONS as f64);
        now = joint(vehicle, &round.all, &states, &split).ok_or_else(none)?;
        let next = linearised(&fitted, &now.states, &split).ok_or_else(none)?;
        let better = round.cost - next.cost;
        if !(better > 0.0) {
            break;
        }
        (round, states) = (next, now.states.clone());
        if better < WORTH {
            break;
        }
    }
    let mut together = Together { vehicle, split, fitted, prepared: &prepared, states, joint: now, keeps_file: false };
    let mut errors = together.errors_m_s();
    if are_worse_than_the_file(&errors) {
        notes.push("the fit leaves a larger depth-rate error than the vehicle file as given: its numbers stay".into());
        together.states.fill(State::nominal());
        together.keeps_file = true;
        errors = together.errors_m_s();
    }
    Ok(calibrated(&together, &errors, flights, options, parent, notes))
}

/// Standard deviation of trim and pitch zero of the next deployment, in tolerances: one degree of freedom of the file's, and one of each
/// flight but the first.
fn next_deployment(states: &[State], index: usize) -> (f64, f64) {
    let n = states.len() as f64;
    let mean = states.iter().map(|s| s.calibration[index]).sum::<f64>() / n;
    let square: f64 = states.iter().map(|s| (s.calibration[index] - mean).powi(2)).sum();
    (mean, ((1.0 + square) / n).sqrt())
}

/// Flights as they were fitted together, and the vehicle that the next one starts from.
struct Together<'a> {
    vehicle: &'a Vehicle,
    split: Split,
    fitted: Vec<Fitted<'a>>,
    prepared: &'a [Prepared],
    states: Vec<State>,
    joint: Joint,
    /// Whether the fit was no better than the file, whose numbers stay.
    keeps_file: bool,
}

impl Together<'_> {
    /// Errors of each flight, as given and at its state.
    fn errors_m_s(&self) -> Vec<ErrorsMs> {
        let of = |((f, prepared), state): ((&Fitted, &Prepared), &State)| errors_m_s(&f.problem, prepared, state, &f.blocks);
        self.fitted.iter().zip(self.prepared).zip(&self.states).map(of).collect()
    }

    /// Shared numbers, the mean of what is set anew, and within what the next flight's numbers are expected, in tolerances.
    fn next(&self) -> (State, [f64; STATED]) {
        if self.keeps_file {
            return (State::nominal(), [1.0; STATED]);
        }
        let mut state = self.states.first().cloned().unwrap_or_else(State::nominal);
        OWN.iter().filter(|i| **i >= STATED).for_each(|&i| state.calibration[i] = 0.0);
        self.at_bounds().into_iter().for_each(|i| state.calibration[i] = 0.0);
        let mut left = [1.0; STATED];
        for (i, left) in left.iter_mut().enumerate() {
            if let Some(place) = self.split.place(i) {
                // No less certain than the file was, unless flights scatter by more.
                *left = self.joint.pooled.next(place).min(1.0).max(self.joint.pooled.scatter[place]);
            } else {
                (state.calibration[i], *left) = next_deployment(&self.states, i);
            }
            if self.at_bounds().contains(&i) {
                (state.calibration[i], *left) = (0.0, 1.0);
            }
        }
        (state, left)
    }

    /// Shared numbers that the fit pressed against the end of what is possible: nothing is known of them.
    fn at_bounds(&self) -> Vec<usize> {
        /// Share of the range that counts as its end.
        const END: f64 = 1e-3;
        let at = |i: usize| self.states.first().map_or(0.0, |s| s.calibration[i]);
        let pressed = |i: &usize| {
            let range = bounds(self.vehicle, *i);
            at(*i) != 0.0 && range.is_some_and(|(low, high)| at(*i) <= low + END * (high - low) || at(*i) >= high - END * (high - low))
        };
        self.split.shared.iter().copied().filter(pressed).collect()
    }

    /// Flight `k`, as it is told.
    fn flight(&self, k: usize, logged: &Logged, error_m_s: ErrorsMs) -> FlightCalibration {
        let (fitted, state, prepared) = (&self.fitted[k], &self.states[k], &self.prepared[k]);
        let sigma = |i: usize| match (self.split.own.iter().position(|o| *o == i), self.split.place(i)) {
            (Some(at), _) => self.joint.own[k][(at, at)].max(0.0).sqrt(),
            (None, Some(at)) => self.joint.pooled.covariance[(at, at)].max(0.0).sqrt(),
            (None, None) => f64::NAN,
        };
        let own = |i: usize| [state.calibration[i], sigma(i)].map(|z| z * tolerance_of(self.vehicle, i));
        FlightCalibration {
            flight: logged.flight.name.clone(),
            sha256: logged.sha256.clone(),
            fitted_segments: fitted.problem.runs.iter().map(|r| r.segment).collect(),
            error_m_s,
            noise_floor_m_s: fitted.problem.noise_floor_m_s(),
            discrepancy_m_s: fitted.problem.discrepancy.size_m_s,
            own: [TRIM_VOLUME, PITCH_ZERO].map(own).map(|[value, sigma]| (value, sigma)),
            sensors: sensor_findings(self.vehicle, state, sigma, prepared.clock_shift_s),
        }
    }

    /// The new vehicle file.
    fn document(&self, state: &State, left: &[f64; STATED], flights: &[FlightCalibration], options: &Options, parent: &[u8]) -> Value {
        let mut document = numbers(self.vehicle, state);
        document["tolerance_1sigma"] = tolerances(self.vehicle, &document, state, left).into();
        let mut on = document.get("effects").and_then(Value::as_object).cloned().unwrap_or_default();
        on.extend(zeros(self.vehicle, state).into_iter().map(|z| (z.effect.to_owned(), z.entry())));
        document["effects"] = on.into();
        let of_flight = |t: &FlightCalibration| json!({"flight": t.flight, "sha256": t.sha256, "fitted_segments": t.fitted_segments, "discrepancy_m_s": t.discrepancy_m_s});
        let calibration: Map<String, Value> =
            CALIBRATION.iter().zip(state.calibration).map(|(name, z)| ((*name).to_owned(), json!(z))).collect();
        document["provenance"] = json!({
            "tool": concat!("glider ", env!("CARGO_PKG_VERSION")),
            "command": "calibrate",
            "parent": self.vehicle.path.file_name().map(|n| n.to_string_lossy()),
            "parent_sha256": sha256(parent),
            "flights": flights.iter().map(of_flight).collect::<Vec<_>>(),
            "freed": options.free,
            "one_deployment": options.one_deployment,
            "branch": self.fitted.first().map(|f| f.problem.branch.document()),
            "calibration_in_tolerances": calibration,
            "tolerances": "1 sigma of the next flight: posterior, model discrepancy in it, and scatter between flights",
        });
        document
    }
}

fn calibrated(
    of: &Together,
    errors: &[ErrorsMs],
    flights: &[Logged],
    options: &Options,
    parent: &[u8],
    mut notes: Vec<String>,
) -> Calibrated {
    let (state, left) = of.next();
    let calibrated: Vec<FlightCalibration> = flights.iter().enumerate().map(|(k, logged)| of.flight(k, logged, errors[k])).collect();
    let vehicle = of.document(&state, &left, &calibrated, options, parent);
    for i in of.at_bounds() {
        notes.push(format!("{} went to the end of what is possible: nothing is known of it, and it stays as in the file", CALIBRATION[i]));
    }
    let between = |i: usize| of.split.place(i).map(|at| of.joint.pooled.scatter[at]);
    let numbers = reported_numbers(of.vehicle, &state, &left, between);
    for n in &numbers {
        if let (Some(between), Some([before, _])) = (n.between_flights, n.tolerance)
            && between > DISAGREE * before
        {
            notes.push(format!(
                "the flights disagree about {}: it scatters by {between:.3} {} between them, more than the file's tolerance of {before:.3}; was the vehicle changed in between?",
                n.name, n.unit
            ));
        }
    }
    Calibrated { flights: calibrated, numbers, vehicle, notes }
}

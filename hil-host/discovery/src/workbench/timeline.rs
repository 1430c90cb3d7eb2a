//! Drag, lift, trim, pitch zero, compressibility and pressure zero over a mission, dive by dive, with the changes named and dated.
//!
//! Flights are taken one after the other ([`Mission::add`]); of each dive only its information is kept ([`crate::workbench::tracking`]),
//! so memory does not grow with the logs. What changed is asked at the end of all of it ([`crate::workbench::changes`]).
//!
//! The level of a dive is its estimate beside the changes that were found: drag and trim follow the dive alone, the others are held near
//! what is expected by their scatter, since one drive setting tells hardly more than two of them apart.
//!
//! Range: for a given pitch, the way made good over the depth flown is the cotangent of the glide angle, by the law of the file with and
//! without the change. Trim costs none of it but pump stroke.

use crate::diagnosis::NothingToFit;
use crate::history::changes::Own;
use crate::history::rows::{Unit, units};
use crate::model::parameters::{NINETY, State, tolerance_of};
use crate::preprocess::{Prepared, Run, prepare};
use crate::workbench::change_kinds::{Shape, alarm_rate, threshold};
use crate::workbench::changes::{Change, Found, Observed, find};
pub use crate::workbench::event::{Event, Level};
use crate::workbench::mission_history;
use crate::workbench::tracking::{
    AT_COMPRESSIBILITY, AT_DRAG, AT_LIFT, AT_TRIM, Dive, N, REFERENCE_DIVES, Reference, TRACKED, for_missions, start_precision,
};
use hydro::effects::{ALPHA_VALID_RAD, DAY_S, Flow, ForceModel, REFERENCE_TEMPERATURE_DEGC};
use logs::record::flight::Flight;
use logs::vehicle::Vehicle;
use nalgebra::{DMatrix, DVector};

/// Fewest dives of which changes are asked.
pub const FEWEST_DIVES: usize = 5;
/// How far a dive's drag and trim may be from what is expected, and the others at least, in steps.
const OPEN: f64 = 10.0;
const NEAR_STEPS: f64 = 0.3;

/// One dive of the timeline.
#[derive(Clone, Debug)]
pub struct Row {
    /// Number in the mission, from 1.
    pub number: usize,
    /// Flight.
    pub flight: String,
    /// Segment or dive in it.
    pub segment: u32,
    /// Day since the start of the mission at which it began.
    pub day: f64,
    /// Deepest point, m.
    pub depth_m: f64,
    /// Rows compared.
    pub rows: usize,
    /// Mean square of its innovations.
    pub misfit: f64,
    /// What is followed, in the units of [`TRACKED`].
    pub levels: [Level; N],
}

/// A mission as it was followed.
#[derive(Clone, Debug)]
pub struct Timeline {
    /// Dives in order.
    pub rows: Vec<Row>,
    /// Changes in order of their onset.
    pub events: Vec<Event>,
    /// Scatter from dive to dive, 1 sigma, in the units of [`TRACKED`]; NaN where too few dives tell.
    pub scatter: [f64; N],
    /// Levels at the start of the mission.
    pub start: [Level; N],
    /// Threshold, standard deviations, and the false alarms that are expected of so many dives.
    pub threshold: f64,
    /// Expected false alarms.
    pub expected_false_alarms: f64,
    /// Rms velocity that the model is wrong by, m/s.
    pub discrepancy_m_s: f64,
    /// Its steady dives, each beside the quiet ones before it; none of a mission with too few.
    pub history: Vec<mission_history::Dive>,
    /// What was left out.
    pub notes: Vec<String>,
}

/// A dive and where it is from.
#[derive(Clone, Debug)]
struct Followed {
    flight: String,
    day: f64,
    dive: Dive,
}

/// A mission as its flights come in.
pub struct Mission {
    vehicle: Vehicle,
    reference: Option<Reference>,
    waiting: Vec<(String, f64, Prepared)>,
    dives: Vec<Followed>,
    units: Vec<Unit>,
    notes: Vec<String>,
}

impl Mission {
    /// With the vehicle that it is judged by.
    #[must_use]
    pub fn new(vehicle: &Vehicle) -> Self {
        Self {
            vehicle: for_missions(vehicle),
            reference: None,
            waiting: Vec::new(),
            dives: Vec::new(),
            units: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Adds the next flight of the mission, whose clock began at second `zero_s` of the mission's ([`crate::workbench::mission_clock`]).
    /// `tick` is told how many of its dives are done, and of how many.
    ///
    /// # Errors
    /// The first dives cannot be compared with the model.
    pub fn add(&mut self, flight: &Flight, zero_s: f64, tick: &(dyn Fn(usize, usize) + Sync)) -> Result<(), NothingToFit> {
        let prepared = prepare(flight, &self.vehicle);
        let mut steady = units(flight);
        steady.iter_mut().flat_map(|u| &mut u.rows).for_each(|r| r.time_s += zero_s);
        self.units.append(&mut steady);
        self.notes.extend(prepared.notes.iter().map(|n| format!("{}: {n}", flight.name)));
        self.waiting.push((flight.name.clone(), zero_s, prepared));
        let waiting: usize = self.waiting.iter().map(|w| w.2.runs.len()).sum();
        if self.reference.is_some() || waiting >= REFERENCE_DIVES {
            self.follow(tick)?;
        }
        Ok(())
    }

    fn follow(&mut self, tick: &(dyn Fn(usize, usize) + Sync)) -> Result<(), NothingToFit> {
        if self.reference.is_none() {
            let name = self.waiting.first().map_or("", |w| w.0.as_str()).to_owned();
            self.reference = Some(Reference::of(&self.vehicle, &first_dives(&self.waiting), &name)?);
        }
        let Some(reference) = &self.reference else { return Ok(()) };
        for (flight, zero_s, prepared) in self.waiting.drain(..) {
            let all = prepared.runs.len();
            let earlier = self.dives.len();
            for (run, dive) in prepared.runs.iter().zip(followed(reference, &prepared, tick)) {
                let Some(dive) = dive else {
                    self.notes
                        .push(format!("{flight}: segment {}: too little of it can be compared with the model; left out", run.segment));
                    continue;
                };
                let of_flight = self.dives.get_mut(earlier..).and_then(<[Followed]>::last_mut);
                match of_flight.filter(|l| l.dive.segment == dive.segment) {
                    // The other part of a dive with a gap.
                    Some(last) => {
                        last.dive.information.add(&dive.information);
                        last.dive.rows += dive.rows;
                        last.dive.depth_m = last.dive.depth_m.max(dive.depth_m);
                    }
                    None => self.dives.push(Followed { flight: flight.clone(), day: (zero_s + dive.time_s[0]) / DAY_S, dive }),
                }
            }
            tick(all, all);
        }
        Ok(())
    }

    /// What each dive so far says.
    #[must_use]
    pub fn observed(&self) -> Vec<Observed> {
        self.dives.iter().map(|d| Observed { information: d.dive.information.clone(), day: d.day }).collect()
    }

    /// What the vehicle file knows of the start of the mission, per step².
    #[must_use]
    pub fn start_precision(&self) -> [f64; N] {
        start_precision(&self.vehicle)
    }

    /// What the mission shows; an alarm is false once in so many dives.
    ///
    /// # Errors
    /// No dive that could be compared with the model.
    pub fn finish(&mut self, dives_per_alarm: f64) -> Result<Timeline, NothingToFit> {
        self.follow(&|_, _| ())?;
        if self.dives.is_empty() {
            return Err(NothingToFit::because("no dive of these flights could be compared with the model"));
        }
        let (observed, precision) = (self.observed(), self.start_precision());
        let threshold = threshold(dives_per_alarm);
        let found = if observed.len() >= FEWEST_DIVES { find(&observed, &precision, threshold) } else { None };
        if found.is_none() {
            self.notes.push(format!("{} dives are too few to ask what changed; at least {FEWEST_DIVES} are needed", observed.len()));
        }
        let mut done = self.timeline(found.as_ref(), threshold);
        if let Some(own) = Own::of(std::mem::take(&mut self.units), &self.vehicle) {
            let days: Vec<f64> = done.rows.iter().map(|r| r.day).collect();
            let (events, notes) = mission_history::borne_out(&own, done.events, &days);
            (done.events, done.history) = (events, mission_history::dives(&own));
            done.notes.extend(notes);
        }
        Ok(done)
    }

    fn timeline(&self, found: Option<&Found>, threshold: f64) -> Timeline {
        let nothing = (DVector::zeros(N), DMatrix::zeros(N, N));
        let (mean, covariance) = found.map_or(&nothing, |f| &f.start);
        let changes: &[Change] = found.map_or(&[], |f| &f.changes);
        let scatter: [f64; N] = found.map_or([NEAR_STEPS; N], |f| f.scatter);
        let days: Vec<f64> = self.dives.iter().map(|d| d.day).collect();
        let rows = self.dives.iter().enumerate().map(|(d, one)| Row {
            number: d + 1,
            flight: one.flight.clone(),
            segment: one.dive.segment,
            day: one.day,
            depth_m: one.dive.depth_m,
            rows: one.dive.rows,
            misfit: one.dive.misfit,
            levels: levels(&one.dive, &expected(mean, changes, d, &days), &scatter),
        });
        Timeline {
            rows: rows.collect(),
            events: changes.iter().map(|c| self.event(c, mean, &days)).collect(),
            scatter: std::array::from_fn(|k| if found.is_some() { scatter[k] * TRACKED[k].step } else { f64::NAN }),
            start: std::array::from_fn(|k| level(mean[k], covariance[(k, k)].max(0.0).sqrt(), TRACKED[k].step)),
            threshold,
            expected_false_alarms: alarm_rate(threshold) * self.dives.len() as f64,
            discrepancy_m_s: self.reference.as_ref().map_or(0.0, |r| r.discrepancy_m_s),
            history: Vec::new(),
            notes: self.notes.clone(),
        }
    }

    fn event(&self, change: &Change, start: &DVector<f64>, days: &[f64]) -> Event {
        let end = days.last().copied().unwrap_or(0.0);
        let onset_day = days.get(change.onset).copied().unwrap_or(0.0);
        let size = self.sized(change.kind.number, change.size, change.sigma, start);
        let number = |onset: usize| if onset == 0 { 0 } else { onset + 1 };
        let growth = change.kind.shape == Shape::Growth;
        let others = change.others.iter().map(|(kind, onset, size, sigma)| {
            let other = Change { kind: *kind, onset: *onset, size: *size, sigma: *sigma, others: Vec::new(), ..change.clone() };
            (other, self.sized(kind.number, *size, *sigma, start))
        });
        Event {
            dive: number(change.onset),
            day: onset_day,
            between: (number(change.onset_between.0), number(change.onset_between.1)),
            size,
            per_day: (growth && end > onset_day).then(|| size.value / (end - onset_day)),
            range_percent: self.range_percent(change.kind.number, size.value / 100.0, start),
            others: others.collect(),
            change: change.clone(),
        }
    }

    /// A size in its unit. Levels are relative to the number that the vehicle had before, which is known as well as the file says.
    fn sized(&self, number: usize, size: f64, sigma: f64, start: &DVector<f64>) -> Level {
        let t = &TRACKED[number];
        if !matches!(number, AT_DRAG | AT_LIFT | AT_COMPRESSIBILITY) {
            return level(size, sigma, t.step);
        }
        let before = (1.0 + start[number] * t.step / 100.0).max(0.1);
        let relative = tolerance_of(&self.vehicle, t.index);
        level(size / before, (sigma / before).hypot(size / before * relative), t.step)
    }

    /// Change of range, %, where drag or lift is off by a share.
    fn range_percent(&self, number: usize, share: f64, start: &DVector<f64>) -> Option<f64> {
        if !matches!(number, AT_DRAG | AT_LIFT) {
            return None;
        }
        let mean = |of: usize| {
            let all: Vec<f64> = self.dives.iter().map(|d| d.dive.pitch_rad[of].abs()).filter(|p| p.is_finite()).collect();
            all.iter().sum::<f64>() / all.len() as f64
        };
        let way = |drag: f64, lift: f64| -> Option<f64> {
            let legs = [true, false].map(|down| glide_angle_rad(&self.vehicle, mean(usize::from(!down)), down, drag, lift));
            let legs: Vec<f64> = legs.into_iter().flatten().collect();
            (!legs.is_empty()).then(|| legs.iter().map(|g| 1.0 / g.tan()).sum::<f64>() / legs.len() as f64)
        };
        let level = |k: usize| 1.0 + start[k] * TRACKED[k].step / 100.0;
        let before = way(level(AT_DRAG), level(AT_LIFT))?;
        let after = if number == AT_DRAG {
            way(level(AT_DRAG) * (1.0 + share), level(AT_LIFT))
        } else {
            way(level(AT_DRAG), level(AT_LIFT) * (1.0 + share))
        };
        // Where no glide at small angle of attack is left at this pitch, all of it is lost.
        Some(after.map_or(-100.0, |after| 100.0 * (after / before - 1.0)))
    }
}

/// The runs of the first dives, as one flight; rows are numbered through.
pub(crate) fn first_dives(waiting: &[(String, f64, Prepared)]) -> Prepared {
    let (mut runs, mut has_temperature, mut row): (Vec<Run>, bool, usize) = (Vec::new(), false, 0);
    for (number, run) in waiting.iter().flat_map(|w| &w.2.runs).take(REFERENCE_DIVES).enumerate() {
        let mut run = run.clone();
        (run.first_row, run.segment) = (row, number as u32);
        row += run.time_s.len();
        runs.push(run);
    }
    for w in waiting {
        has_temperature |= w.2.has_temperature;
    }
    Prepared { runs, displacements: Vec::new(), notes: Vec::new(), has_temperature, clock_shift_s: None }
}

/// All runs of a flight, on two threads; each starts where the one before it ended.
fn followed(reference: &Reference, prepared: &Prepared, tick: &(dyn Fn(usize, usize) + Sync)) -> Vec<Option<Dive>> {
    let all = prepared.runs.len();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let some = |runs: &[Run]| -> Vec<Option<Dive>> {
        let mut start: State = reference.start();
        let mut out = Vec::with_capacity(runs.len());
        for run in runs {
            // A dive that went astray must not lead the next one astray.
            let best = reference.dive(prepared, run, &start).or_else(|| reference.dive(prepared, run, &reference.start()));
            if let Some((_, state)) = &best {
                start.clone_from(state);
            }
            out.push(best.map(|b| b.0));
            tick(1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed), all);
        }
        out
    };
    let (first, second) = prepared.runs.split_at(all / 2);
    std::thread::scope(|scope| {
        let other = scope.spawn(|| some(second));
        let mut out = some(first);
        out.extend(other.join().unwrap_or_else(|_| vec![None; second.len()]));
        out
    })
}

fn level(value: f64, sigma: f64, step: f64) -> Level {
    Level { value: value * step, low: (value - NINETY * sigma) * step, high: (value + NINETY * sigma) * step }
}

/// What dive `d` is expected to be, in steps.
fn expected(start: &DVector<f64>, changes: &[Change], d: usize, days: &[f64]) -> DVector<f64> {
    let mut out = start.clone();
    for c in changes.iter().filter(|c| d >= c.onset) {
        out[c.kind.number] += c.size * c.gone_at(d, days);
    }
    out
}

/// Estimates of one dive near what is expected.
fn levels(dive: &Dive, expected: &DVector<f64>, scatter: &[f64; N]) -> [Level; N] {
    let width = |k: usize| if k == AT_DRAG || k == AT_TRIM { OPEN } else { scatter[k].max(NEAR_STEPS) };
    let mut information = dive.information.with_prior((0..N).map(|k| width(k).powi(-2)));
    (0..N).for_each(|k| information.vector[k] += expected[k] * width(k).powi(-2));
    let none = || (expected.clone(), DMatrix::from_element(N, N, f64::NAN));
    let (mean, covariance) = information.estimate().unwrap_or_else(none);
    std::array::from_fn(|k| level(mean[k], covariance[(k, k)].sqrt(), TRACKED[k].step))
}

/// Angle of the steady glide at a pitch (both positive), rad: where drag over lift is its tangent; none where no angle of attack of the
/// law gives one.
fn glide_angle_rad(vehicle: &Vehicle, pitch_rad: f64, down: bool, drag: f64, lift: f64) -> Option<f64> {
    /// Speed, and rate of climb or descent, that effects of the file are taken at, m/s.
    const SPEED_M_S: [f64; 2] = [0.3, 0.15];
    let mut constants = vehicle.constants;
    constants.cd0 *= drag;
    constants.lift_slope_per_rad *= lift;
    let model = ForceModel::new(constants, &vehicle.effects);
    let sign = if down { 1.0 } else { -1.0 };
    let misses = |alpha: f64| {
        let at = Flow {
            alpha_rad: sign * alpha,
            speed_m_s: SPEED_M_S[0],
            roll_rad: 0.0,
            climb_m_s: -sign * SPEED_M_S[1],
            time_s: 0.0,
            temperature_degc: REFERENCE_TEMPERATURE_DEGC,
            attached: true,
        };
        let f = model.coefficients(&at);
        sign * f.cl * (pitch_rad + alpha).tan() - f.cd
    };
    let (mut low, mut high) = (1e-4, ALPHA_VALID_RAD);
    if !(misses(low) < 0.0 && misses(high) > 0.0) {
        return None;
    }
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if misses(middle) < 0.0 { low = middle } else { high = middle }
    }
    Some(pitch_rad + high)
}

//! Drag, lift, trim, pitch zero, compressibility and pressure zero over a mission, dive by dive, with the changes named and dated.
//!
//! Flights are taken one after the other ([`Mission::add`]); of each dive only its steady rows are kept, so memory does not grow with the
//! logs. What changed, and what each dive says given those before it, is asked of the mission as its own history at the end
//! ([`crate::history::mission`]).
//!
//! Range: for a given pitch, the way made good over the depth flown is the cotangent of the glide angle, by the law of the file with and
//! without the change. Trim costs none of it but pump stroke.

use crate::diagnosis::NothingToFit;
use crate::history::changes::Change;
use crate::history::glide::Glider;
use crate::history::kinds::{FOLLOWED, Shape, alarm_rate, threshold};
use crate::history::mission as history;
use crate::history::mission::{Compared, Dives, FEWEST_DIVES, SentDive};
use crate::history::numbers::{ALL, DRAG_LEVEL, NUMBERS, Numbers, SLOPE_OF_LIFT};
use crate::history::rows::{FEWEST_OF_A_LEG, FEWEST_STEADY_ROWS, units};
use crate::history::shown::{LEVELS_SHOWN, N, value};
use crate::model::parameters::NINETY;
use hydro::effects::{ALPHA_VALID_RAD, Flow, ForceModel, REFERENCE_TEMPERATURE_DEGC};
use logs::record::flight::Flight;
use logs::vehicle::Vehicle;
use nalgebra::DVector;
use std::collections::BTreeMap;

/// A value with its 90 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// Value.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// A change as it is said.
#[derive(Clone, Debug)]
pub struct Event {
    /// What was found.
    pub change: Change,
    /// Number of the first dive that has it.
    pub dive: usize,
    /// Day of it.
    pub day: f64,
    /// First and last dive number that it may have begun with, 90 %.
    pub between: (usize, usize),
    /// Size in the unit of its number: of a growth, what it has grown to by the end.
    pub size: Level,
    /// Of a growth, per day.
    pub per_day: Option<f64>,
    /// Change of range at the flown pitch, %.
    pub range_percent: Option<f64>,
    /// Kinds that the dives do not tell from it, with their sizes.
    pub others: Vec<(Change, Level)>,
    /// Numbers that moved, by their columns, where it is none of the kinds; empty where its kind holds.
    pub several: Vec<(usize, Level)>,
}

impl Event {
    /// Name of its kind.
    #[must_use]
    pub fn name(&self) -> &'static str {
        if self.several.is_empty() { self.change.kind.name } else { "unnamed" }
    }

    /// What it is, in words.
    #[must_use]
    pub fn about(&self) -> &'static str {
        if self.several.is_empty() { self.change.kind.about } else { "none of the kinds describes it: several numbers moved together" }
    }
}

/// One dive of the timeline.
#[derive(Clone, Debug)]
pub struct Row {
    /// Number in the mission, from 1.
    pub number: usize,
    /// Flight.
    pub flight: String,
    /// Segment or dive in it.
    pub segment: u32,
    /// Day since the start of the mission at which its first steady row is.
    pub day: f64,
    /// Deepest steady row, m.
    pub depth_m: f64,
    /// Steady rows.
    pub rows: usize,
    /// What is followed, in the units of [`LEVELS_SHOWN`].
    pub levels: [Level; N],
    /// What it says compared with the quiet ones before it; none of the first ones.
    pub compared: Option<Compared>,
}

impl Row {
    /// What departs in it, in words; none where it is quiet.
    #[must_use]
    pub fn departs(&self) -> Option<String> {
        let j = &self.compared.as_ref()?.judgement;
        if !j.class.is_empty() {
            return Some(j.class.iter().map(|i| ALL[*i].name.replace('_', " ")).collect::<Vec<_>>().join(" or "));
        }
        j.departs.as_ref().map(|d| format!("none of the numbers: it follows {} ({})", d.0.variable, d.0.about))
    }
}

/// A mission as it was followed.
#[derive(Clone, Debug)]
pub struct Timeline {
    /// Dives in order.
    pub rows: Vec<Row>,
    /// Changes in order of their onset.
    pub events: Vec<Event>,
    /// Scatter from dive to dive, 1 sigma, in the units of [`LEVELS_SHOWN`].
    pub scatter: [f64; N],
    /// Levels at the start of the mission.
    pub start: [Level; N],
    /// Threshold, standard deviations.
    pub threshold: f64,
    /// False alarms that are expected of so many dives.
    pub expected_false_alarms: f64,
    /// What was left out.
    pub notes: Vec<String>,
}

/// Where a steady dive is from.
#[derive(Clone, Debug)]
pub struct Followed {
    /// Its flight.
    pub flight: String,
    /// Segment or dive in it.
    pub segment: u32,
    /// Deepest place, m.
    pub depth_m: f64,
    /// Steady rows.
    pub rows: usize,
}

/// A mission as its flights come in.
#[derive(Clone, Debug)]
pub struct Mission {
    vehicle: Vehicle,
    dives: Vec<Followed>,
    of: Dives,
    left_out: usize,
    notes: Vec<String>,
}

impl Mission {
    /// With the vehicle that it is judged by.
    #[must_use]
    pub fn new(vehicle: &Vehicle) -> Self {
        Self { vehicle: vehicle.clone(), dives: Vec::new(), of: Dives::Logged(Vec::new()), left_out: 0, notes: Vec::new() }
    }

    /// Of what surfacings sent, counted from the numbers of the vehicle file of `glider`.
    #[must_use]
    pub fn of_sent(vehicle: &Vehicle, glider: Glider, sent: Vec<(Followed, SentDive)>, notes: Vec<String>) -> Self {
        let (dives, all) = sent.into_iter().unzip();
        Self { vehicle: vehicle.clone(), dives, of: Dives::Sent(all, Box::new(glider)), left_out: 0, notes }
    }

    /// Adds the next flight of the mission, whose clock began at second `zero_s` of the mission's ([`crate::workbench::mission_clock`]).
    pub fn add(&mut self, flight: &Flight, zero_s: f64) {
        /// Pressure of a metre, Pa.
        const METRE_PA: f64 = 1e4;
        let mut deepest: BTreeMap<u32, f64> = BTreeMap::new();
        for (segment, p) in flight.segment.iter().zip(&flight.pressure_pa) {
            let of = deepest.entry(*segment).or_insert(0.0);
            *of = of.max(*p);
        }
        self.notes.extend(flight.unread.iter().map(|note| format!("{}: {note}", flight.name)));
        let Dives::Logged(all) = &mut self.of else { return };
        let steady = units(flight);
        self.left_out += deepest.len().saturating_sub(steady.len());
        for mut unit in steady {
            unit.rows.iter_mut().for_each(|r| r.time_s += zero_s);
            let depth_m = deepest.get(&unit.segment).copied().unwrap_or(f64::NAN) / METRE_PA;
            self.dives.push(Followed { flight: flight.name.clone(), segment: unit.segment, depth_m, rows: unit.rows.len() });
            all.push(unit);
        }
    }

    /// The mission as its own history; a change is named from this threshold on.
    ///
    /// # Errors
    /// No dive that can be judged.
    pub fn followed(&self, threshold: f64) -> Result<history::Mission, NothingToFit> {
        if self.dives.is_empty() {
            return Err(NothingToFit::because(format!(
                "no dive of these flights has {FEWEST_STEADY_ROWS} steady rows of 40 s with pitch, ballast and density, {FEWEST_OF_A_LEG} of them on either leg"
            )));
        }
        Ok(history::Mission::of(self.of.clone(), &self.vehicle, threshold))
    }

    /// What the mission shows; an alarm is false once in so many dives.
    ///
    /// # Errors
    /// No dive that can be judged.
    pub fn finish(&self, dives_per_alarm: f64) -> Result<Timeline, NothingToFit> {
        let threshold = threshold(dives_per_alarm);
        let of = self.followed(threshold)?;
        let (days, compared) = (of.days(), of.one_by_one());
        let levels = of.levels(&compared);
        let claims = Numbers::from_column_slice(&of.glider.claims());
        let shown = |mean: &DVector<f64>, sigma: &DVector<f64>| -> [Level; N] {
            LEVELS_SHOWN.map(|s| level(s.column, mean[s.column], sigma[s.column], &of.glider, &claims))
        };
        let rows = self.dives.iter().zip(compared).zip(levels).enumerate().map(|(d, ((dive, compared), (mean, sigma)))| Row {
            number: d + 1,
            flight: dive.flight.clone(),
            segment: dive.segment,
            day: days[d],
            depth_m: dive.depth_m,
            rows: dive.rows,
            levels: shown(&mean, &sigma),
            compared,
        });
        let between = &of.found.between;
        let start = DVector::from_fn(FOLLOWED, |i, _| between.mean[i] + of.from.get(i).copied().unwrap_or(0.0));
        let of_start = DVector::from_fn(FOLLOWED, |i, _| between.of_mean[(i, i)].sqrt());
        let scatter = LEVELS_SHOWN.map(|s| {
            let one = value(s.column, between.scatter[(s.column, s.column)].sqrt(), &of.glider.sizes, &claims);
            one.abs()
        });
        let mut notes = self.notes.clone();
        if self.left_out > 0 {
            notes.push(format!(
                "{} segments have fewer than {FEWEST_STEADY_ROWS} steady rows of 40 s ({FEWEST_OF_A_LEG} on either leg), or far fewer than the others: left out",
                self.left_out
            ));
        }
        if days.len() < FEWEST_DIVES {
            notes.push(format!("{} dives are too few to ask what changed; at least {FEWEST_DIVES} are needed", days.len()));
        }
        Ok(Timeline {
            rows: rows.collect(),
            events: of.found.changes.iter().map(|c| self.event(c, &of, &start, &days)).collect(),
            scatter,
            start: shown(&start, &of_start),
            threshold,
            expected_false_alarms: alarm_rate(threshold) * days.len() as f64,
            notes,
        })
    }

    fn event(&self, change: &Change, of: &history::Mission, start: &DVector<f64>, days: &[f64]) -> Event {
        let (end, onset_day) = (days[days.len() - 1], days[change.onset]);
        // A share is of what the number was before, not of the file's.
        let mut before = Numbers::from_column_slice(&of.glider.claims());
        (0..NUMBERS).for_each(|i| before[i] += start[i] * of.glider.sizes[i]);
        let sized = |column: usize, size: f64, sigma: f64| level(column, size, sigma, &of.glider, &before);
        let size = sized(change.kind.number, change.size, change.sigma);
        let growth = change.kind.shape == Shape::Growth;
        let others = change.others.iter().map(|(kind, onset, size, sigma)| {
            let other = Change { kind: *kind, onset: *onset, size: *size, sigma: *sigma, others: Vec::new(), ..change.clone() };
            (other, sized(kind.number, *size, *sigma))
        });
        Event {
            dive: change.onset + 1,
            day: onset_day,
            between: (change.onset_between.0 + 1, change.onset_between.1 + 1),
            size,
            per_day: (growth && end > onset_day).then(|| size.value / (end - onset_day)),
            range_percent: if change.several.is_empty() { self.range_percent(change, of, start) } else { None },
            others: others.collect(),
            several: change.several.iter().map(|(column, size, sigma)| (*column, sized(*column, *size, *sigma))).collect(),
            change: change.clone(),
        }
    }

    /// Change of range, %, where drag or lift has changed.
    fn range_percent(&self, change: &Change, of: &history::Mission, start: &DVector<f64>) -> Option<f64> {
        let which = change.kind.number;
        if !matches!(which, DRAG_LEVEL | SLOPE_OF_LIFT) {
            return None;
        }
        let pitches = of.pitch_rad();
        let factor = |column: usize, changed: f64| {
            let own = if column == which { changed } else { 0.0 };
            ((start[column] + own) * of.glider.sizes[column]).exp()
        };
        let way = |changed: f64| -> Option<f64> {
            let legs = [true, false].map(|down| {
                let (drag, lift) = (factor(DRAG_LEVEL, changed), factor(SLOPE_OF_LIFT, changed));
                glide_angle_rad(&self.vehicle, pitches[usize::from(!down)], down, drag, lift)
            });
            let legs: Vec<f64> = legs.into_iter().flatten().collect();
            (!legs.is_empty()).then(|| legs.iter().map(|g| 1.0 / g.tan()).sum::<f64>() / legs.len() as f64)
        };
        let before = way(0.0)?;
        // Where no glide at small angle of attack is left at this pitch, all of it is lost.
        Some(way(change.size).map_or(-100.0, |after| 100.0 * (after / before - 1.0)))
    }
}

/// Sizes of a column in its unit with their 90 % interval.
fn level(column: usize, size: f64, sigma: f64, glider: &Glider, claims: &Numbers) -> Level {
    let of = |s: f64| value(column, s, &glider.sizes, claims);
    let (a, b) = (of(size - NINETY * sigma), of(size + NINETY * sigma));
    Level { value: of(size), low: a.min(b), high: a.max(b) }
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

//! Real missions judged by their vehicle's own history: controls that roll, errors injected into units that are kept out of them.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use discovery::history::glide::Glider;
use discovery::history::judge::{Judgement, judge};
use discovery::history::learn::{Learnt, forward, learn, start};
use discovery::history::numbers::{
    ALL, BALLAST_OFFSET, BALLAST_SCALE, COMPRESSIBILITY, DRAG_LEVEL, EXPANSION, Numbers, PITCH_OFFSET, PITCH_SCALE,
};
use discovery::history::rows::{Unit, units, without_stubs};
use discovery::history::weigh::chance;
use logs::record::csv;
use logs::{Flight, Vehicle, import, vehicle};
use serde::Serialize;
use serde_json::{Value, json};

use super::injected_errors::INJECTED_ERRORS;

/// Flights of one vehicle, in the order of time.
pub struct Mission {
    /// Name of its folder.
    pub name: String,
    vehicle: Vehicle,
    flights: Vec<(Flight, f64)>,
    pub(super) units: Vec<Unit>,
}

impl Mission {
    /// How many steady dives or segments it has.
    #[must_use]
    pub fn units(&self) -> usize {
        self.units.len()
    }
}

/// Errors of one size: as a real mistake, and half of it.
const SIZES: [f64; 2] = [1.0, 0.5];
/// Units that errors are injected into, spread evenly over those that have controls.
const ASKED: usize = 6;
/// Earlier units that a chance is ranked among at least.
const FEW: usize = 4;
/// Units that the start is calibrated on.
const FIRST: usize = 6;

/// What is injected.
#[derive(Clone, Copy, Debug)]
pub(super) enum Error {
    /// ln of the drag level of the file.
    Drag(f64),
    /// Share of the file's compressibility.
    Compressibility(f64),
    /// Share of the file's expansion.
    Expansion(f64),
    /// Pitch of the log, rad.
    PitchOffset(f64),
    PitchScale(f64),
    /// Ballast of the log, cm³ where the engine moves 200.
    Ballast(f64),
    BallastScale(f64),
}

pub(super) const ERRORS: [(&str, Error, usize); 9] = [
    ("cd0 /1.5", Error::Drag(-0.405_465), DRAG_LEVEL),
    ("cd0 x1.5", Error::Drag(0.405_465), DRAG_LEVEL),
    ("compressibility x0.3", Error::Compressibility(-0.7), COMPRESSIBILITY),
    ("compressibility x2", Error::Compressibility(1.0), COMPRESSIBILITY),
    ("expansion x3", Error::Expansion(2.0), EXPANSION),
    ("pitch +2 deg", Error::PitchOffset(0.0349), PITCH_OFFSET),
    ("pitch x1.08", Error::PitchScale(0.08), PITCH_SCALE),
    ("ballast +120 cc", Error::Ballast(120e-6), BALLAST_OFFSET),
    ("ballast x1.08", Error::BallastScale(0.08), BALLAST_SCALE),
];

/// Expansion that a share is of at least, 1/K: some files say that the hull has none.
const LEAST_EXPANSION_PER_K: f64 = 2e-5;

/// Errors of sensors that a judgement must not see.
const UNSEEN: [&str; 4] = ["clock +5 s", "clock -5 s", "pressure zero +1.5 dbar", "pressure zero -1.5 dbar"];

/// A unit, the claimed numbers, and the size that should be found, all in sizes.
pub(super) fn injected(
    unit: &Unit,
    at: &Numbers,
    glider: &Glider,
    (_, error, number): (&str, Error, usize),
    share: f64,
) -> (Unit, Numbers, f64) {
    let (mut unit, mut claimed) = (unit.clone(), *at);
    let now = |i: usize| at[i] * glider.sizes[i];
    let claims = glider.claims();
    let drive = (glider.drive_m3 / 200e-6).min(1.0);
    let (file, found) = match error {
        Error::Drag(ln) => (share * ln, -share * ln),
        Error::Compressibility(of) => {
            let by = share * of * (claims[COMPRESSIBILITY] + now(COMPRESSIBILITY));
            (by, -by)
        }
        Error::Expansion(of) => {
            let by = share * of * (claims[EXPANSION] + now(EXPANSION)).max(LEAST_EXPANSION_PER_K);
            (by, -by)
        }
        Error::PitchOffset(by) => {
            unit.rows.iter_mut().for_each(|r| r.pitch_rad += share * by);
            (0.0, -share * by * now(PITCH_SCALE).exp())
        }
        Error::PitchScale(by) => {
            unit.rows.iter_mut().for_each(|r| r.pitch_rad *= 1.0 + share * by);
            (0.0, -(share * by).ln_1p())
        }
        Error::Ballast(by) => {
            unit.rows.iter_mut().for_each(|r| r.ballast_m3 += share * by * drive);
            (0.0, share * by * drive * 1026.0 * now(BALLAST_SCALE).exp())
        }
        Error::BallastScale(by) => {
            unit.rows.iter_mut().for_each(|r| r.ballast_m3 *= 1.0 + share * by);
            (0.0, -(share * by).ln_1p())
        }
    };
    claimed[number] += file / glider.sizes[number];
    (unit, claimed, found / glider.sizes[number])
}

/// How many of how many.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Share {
    /// Right ones.
    pub right: usize,
    /// All.
    pub all: usize,
}

impl Share {
    pub(super) fn count(&mut self, right: bool) {
        self.right += usize::from(right);
        self.all += 1;
    }

    fn add(&mut self, other: Self) {
        self.right += other.right;
        self.all += other.all;
    }

    /// Ratio; NaN of nothing.
    #[must_use]
    pub fn ratio(self) -> f64 {
        self.right as f64 / self.all as f64
    }
}

/// Errors of one size.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct OfSize {
    /// Injected, against the whole size.
    pub share: f64,
    /// Named in class.
    pub in_class: Share,
    /// Something else named.
    pub wrong: Share,
    /// 90 % intervals that hold the truth.
    pub held: Share,
}

/// One mission's, or all missions', score.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Scored {
    /// Mission.
    pub name: String,
    /// Units.
    pub units: usize,
    /// Controls.
    pub controls: usize,
    /// Untouched units that are quiet.
    pub quiet: Share,
    /// Units with a late clock or another pressure zero that are quiet.
    pub unseen: Share,
    /// Errors by size.
    pub sizes: [OfSize; 2],
    /// Forward chances of untouched units, with their floors.
    pub chances: Vec<(f64, f64)>,
    /// Probability of chances that are as far from uniform.
    pub uniform: f64,
    /// Mean chi² of the last history, each of its units against the others.
    pub chi2: f64,
    /// What was named where nothing is: unit and class.
    pub alarms: Vec<(String, Vec<String>)>,
    /// Answers to the injected errors.
    pub answers: Vec<Value>,
}

pub(super) fn names(class: &[usize]) -> Vec<String> {
    class.iter().map(|i| ALL[*i].name.to_owned()).collect()
}

/// All missions below a folder: folders with logs in them.
///
/// # Errors
/// The folder cannot be read.
pub fn missions(root: &Path, left_out: &dyn Fn(&str)) -> anyhow::Result<Vec<Mission>> {
    let mut folders: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(root).with_context(|| root.display().to_string())? {
        let path = entry?.path();
        if path.is_dir() {
            folders.push(path);
        }
    }
    folders.sort();
    if folders.is_empty() {
        folders.push(root.to_path_buf());
    }
    let mut out = Vec::new();
    for folder in folders {
        match mission(&folder) {
            Ok(mission) => out.push(mission),
            Err(e) => left_out(&format!("{}: {e:#}", folder.display())),
        }
    }
    Ok(out)
}

/// The flights of a folder: one in the own format, csv files of one flight each, or what an import takes for one flight.
fn flights(folder: &Path) -> anyhow::Result<Vec<(Flight, f64, Option<Vehicle>)>> {
    let own = folder.join("flight.csv");
    if own.is_file() {
        return Ok(vec![(csv::flight(&own)?, 0.0, None)]);
    }
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)?.filter_map(|e| Some(e.ok()?.path())).collect();
    files.retain(|p| p.extension().is_some_and(|e| e == "csv"));
    files.sort();
    let parts = if files.is_empty() { vec![folder.to_path_buf()] } else { files };
    let mut out = Vec::new();
    for part in parts {
        let imported = import::import(&part, &[])?;
        let text = imported.vehicle_text();
        let vehicle = text.map(|(name, text)| vehicle::parse_text(&text, Path::new(name))).transpose()?;
        out.push((imported.flight, imported.report.start_unix_s.unwrap_or(0.0), vehicle));
    }
    out.sort_by(|a, b| a.1.total_cmp(&b.1));
    Ok(out)
}

fn on_clock(mut all: Vec<Unit>, zero_s: f64) -> Vec<Unit> {
    all.iter_mut().flat_map(|u| &mut u.rows).for_each(|r| r.time_s += zero_s);
    all
}

fn mission(folder: &Path) -> anyhow::Result<Mission> {
    let all = flights(folder)?;
    let stated = vehicle::file_next_to(folder)?.map(|p| vehicle::read(&p)).transpose()?;
    let zero = all.first().map_or(0.0, |f| f.1);
    let of = |(flight, unix, _): &(Flight, f64, Option<Vehicle>)| on_clock(units(flight), unix - zero);
    let found = without_stubs(all.iter().flat_map(of).collect());
    let vehicle = stated.or_else(|| all.iter().find_map(|f| f.2.clone().filter(|_| !units(&f.0).is_empty())));
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let vehicle = vehicle.with_context(|| format!("{name}: no dive with steady legs, or no vehicle file"))?;
    Ok(Mission { name, vehicle, flights: all.into_iter().map(|f| (f.0, f.1 - zero)).collect(), units: found })
}

/// At most `n` of them, evenly spread.
pub(super) fn spread(all: &[usize], n: usize) -> Vec<usize> {
    if all.len() <= n {
        return all.to_vec();
    }
    (0..n).map(|k| all[k * (all.len() - 1) / (n - 1)]).collect()
}

/// The history before a unit: its last quiet units, learnt once each.
pub(super) struct Histories<'a> {
    mission: &'a Mission,
    pub(super) glider: Glider,
    pub(super) from: Numbers,
    quiet: Vec<usize>,
    controls: usize,
    learnt: HashMap<Vec<usize>, Learnt>,
}

impl<'a> Histories<'a> {
    pub(super) fn new(mission: &'a Mission, controls: usize) -> Self {
        let units = &mission.units;
        let glider = Glider::of_units(&mission.vehicle, units);
        let first: Vec<&Unit> = units.iter().take(controls.min(FIRST)).collect();
        let from = start(&first, &glider);
        let quiet = forward(units, &glider, &from, controls).iter().enumerate().filter(|(_, f)| f.quiet).map(|(i, _)| i).collect();
        Self { mission, glider, from, quiet, controls, learnt: HashMap::new() }
    }

    pub(super) fn before(&mut self, i: usize) -> &Learnt {
        let quiet: Vec<usize> = self.quiet.iter().copied().filter(|j| *j < i).collect();
        let from = if quiet.len() >= self.controls.min(3) { quiet } else { (0..i).collect() };
        let last = from[from.len().saturating_sub(self.controls)..].to_vec();
        let (units, glider, start) = (&self.mission.units, &self.glider, &self.from);
        self.learnt.entry(last).or_insert_with_key(|last| learn(&last.iter().map(|j| &units[*j]).collect::<Vec<_>>(), glider, start))
    }
}

/// The part of the log that a unit was made of, and when its flight began.
pub(super) fn part_of(mission: &Mission, unit: &Unit) -> Option<(Flight, f64)> {
    let (flight, zero_s) = mission.flights.iter().rfind(|f| f.1 <= unit.start_s() && unit.id.starts_with(&f.0.name))?;
    let segment = unit.id.rsplit(' ').next()?.parse::<u32>().ok()?;
    let first = flight.segment.iter().position(|s| *s == segment)?;
    let end = flight.segment.iter().rposition(|s| *s == segment)? + 1;
    Some((flight.part(first..end), *zero_s))
}

/// The unit as it would be with an error of a sensor in the log; none where it is not steady any more.
fn with_sensor_error(mission: &Mission, unit: &Unit, name: &str) -> Option<Unit> {
    let error = INJECTED_ERRORS.iter().find(|e| e.name == name)?;
    let (mut part, zero_s) = part_of(mission, unit)?;
    error.tell(&mut part, &mut json!({}));
    on_clock(units(&part), zero_s).into_iter().next()
}

/// Scores a mission with so many controls; none where it has too few units.
#[must_use]
pub fn score(mission: &Mission, controls: usize) -> Option<Scored> {
    let units = &mission.units;
    if units.len() < controls + 2 {
        return None;
    }
    let mut histories = Histories::new(mission, controls);
    let mut out = Scored { name: mission.name.clone(), units: units.len(), controls, ..Scored::default() };
    let judged: Vec<usize> = (controls..units.len()).collect();
    let mut earlier = Vec::new();
    for &i in &judged {
        let history = histories.before(i).clone();
        let said = judge(&units[i], &histories.glider, &history, &history.at);
        out.quiet.count(said.is_quiet());
        if !said.is_quiet() {
            let departs = said.departs.map(|d| format!("none of the numbers, follows {}", d.0.variable));
            out.alarms.push((units[i].id.clone(), names(&said.class).into_iter().chain(departs).collect()));
        }
        if earlier.len() >= FEW {
            out.chances.push(chance(said.chi2, &earlier));
        }
        earlier.push(said.chi2);
        out.chi2 = history.chi2;
    }
    out.uniform = uniformity(&out.chances);
    for i in spread(&judged, ASKED) {
        let history = histories.before(i).clone();
        for (k, share) in SIZES.into_iter().enumerate() {
            out.sizes[k].share = share;
            for error in ERRORS {
                let (unit, claimed, truth) = injected(&units[i], &history.at, &histories.glider, error, share);
                let said = judge(&unit, &histories.glider, &history, &claimed);
                score_error(&mut out, k, (&unit.id, error.0, error.2), &said, truth);
            }
        }
        for name in UNSEEN {
            if let Some(unit) = with_sensor_error(mission, &units[i], name) {
                let said = judge(&unit, &histories.glider, &history, &history.at);
                out.unseen.count(said.is_quiet());
                out.answers.push(json!({"unit": unit.id, "error": name, "class": names(&said.class)}));
            }
        }
    }
    Some(out)
}

fn score_error(out: &mut Scored, k: usize, (unit, name, number): (&str, &str, usize), said: &Judgement, truth: f64) {
    let of = &mut out.sizes[k];
    let right = said.class.contains(&number);
    let (low, high) = said.interval(number);
    of.in_class.count(right);
    of.wrong.count(!said.class.is_empty() && !right);
    of.held.count((low..=high).contains(&truth));
    out.answers.push(json!({"unit": unit, "error": name, "share": of.share, "class": names(&said.class), "truth": truth,
        "interval": [low, high], "ln_bayes": said.ln_bayes}));
}

/// Probability of a distance as large between chances and a uniform law (Kolmogorov and Smirnov, asymptotic), each chance in the
/// middle of its step.
#[must_use]
pub fn uniformity(chances: &[(f64, f64)]) -> f64 {
    let mut p: Vec<f64> = chances.iter().map(|(p, floor)| p - 0.5 * floor).collect();
    p.sort_by(f64::total_cmp);
    let n = p.len() as f64;
    let far = |(i, p): (usize, &f64)| (p - i as f64 / n).max((i as f64 + 1.0) / n - p);
    let distance = p.iter().enumerate().map(far).fold(0.0, f64::max);
    let x = (n.sqrt() + 0.12 + 0.11 / n.sqrt()) * distance;
    let sum: f64 = (1..=100).map(|k| if k % 2 == 1 { 2.0 } else { -2.0 } * (-2.0 * f64::from(k * k) * x * x).exp()).sum();
    if x < 0.2 { 1.0 } else { sum.clamp(0.0, 1.0) }
}

/// What is to be reached on vehicles that nobody tuned to, from so many controls on.
const GOAL_CONTROLS: usize = 6;
const GOAL_QUIET: f64 = 0.97;
const GOAL_QUIET_OF_FEW: f64 = 0.95;
const GOAL_WRONG: f64 = 0.02;
const GOAL_HELD: f64 = 0.87;
const GOAL_UNIFORM: f64 = 0.05;
/// Healthy units from which their chances tell of a law.
const MANY: usize = 100;

/// Which goals a score misses.
#[must_use]
pub fn below(s: &Scored) -> Vec<String> {
    let mut out = Vec::new();
    let quiet = if s.controls >= GOAL_CONTROLS { GOAL_QUIET } else { GOAL_QUIET_OF_FEW };
    let mut ask = |right: bool, what: String| {
        if !right {
            out.push(format!("{} controls: {what}", s.controls))
        }
    };
    ask(!(s.quiet.ratio() < quiet), format!("{:.3} of untouched units are quiet, at least {quiet}", s.quiet.ratio()));
    ask(!(s.unseen.ratio() < quiet), format!("{:.3} of late clocks and pressure zeros are quiet, at least {quiet}", s.unseen.ratio()));
    for of in s.sizes {
        let (wrong, held, share) = (of.wrong.ratio(), of.held.ratio(), of.share);
        ask(!(wrong > GOAL_WRONG), format!("{wrong:.3} of errors of size {share} are misnamed, at most {GOAL_WRONG}"));
        ask(!(held < GOAL_HELD), format!("{held:.3} of intervals of size {share} hold the truth, at least {GOAL_HELD}"));
    }
    ask(s.chances.len() < MANY || s.uniform > GOAL_UNIFORM, format!("chances are not uniform: p {:.3}, above {GOAL_UNIFORM}", s.uniform));
    out
}

/// All missions together.
#[must_use]
pub fn together(all: &[Scored]) -> Scored {
    let mut sum = Scored { name: "all".into(), chi2: f64::NAN, ..Scored::default() };
    for one in all {
        sum.units += one.units;
        sum.controls = one.controls;
        sum.quiet.add(one.quiet);
        sum.unseen.add(one.unseen);
        sum.chances.extend(&one.chances);
        for (sum, one) in sum.sizes.iter_mut().zip(one.sizes) {
            sum.share = one.share;
            sum.in_class.add(one.in_class);
            sum.wrong.add(one.wrong);
            sum.held.add(one.held);
        }
    }
    // Missions may be of the same days, one log at two rates: their chances are not put together as if they were independent (Bonferroni).
    let asked = all.iter().filter(|one| one.uniform.is_finite());
    sum.uniform = (asked.clone().map(|one| one.uniform).fold(1.0, f64::min) * asked.count() as f64).min(1.0);
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accuracy_chances_that_bunch_are_not_uniform() {
        let even: Vec<(f64, f64)> = (1..=200).map(|i| (f64::from(i) / 200.0, 0.005)).collect();
        assert!(uniformity(&even) > 0.99);
        let bunched: Vec<(f64, f64)> = even.iter().map(|(p, floor)| (p * p, *floor)).collect();
        assert!(uniformity(&bunched) < 1e-3);
        // The 5 % point of 100 is 1.358 / (10 + .12 + .011).
        let moved: Vec<(f64, f64)> = (0..100).map(|i| ((f64::from(i) + 0.5) / 100.0 + 0.129, 0.0)).collect();
        assert!((uniformity(&moved) - 0.05).abs() < 0.01, "{}", uniformity(&moved));
    }

    #[test]
    fn a_score_below_the_goals_says_which() {
        let good = Share { right: 100, all: 100 };
        let none = Share { right: 0, all: 100 };
        let sizes = [1.0, 0.5].map(|share| OfSize { share, in_class: good, wrong: none, held: good });
        let mut scored = Scored { controls: 12, quiet: good, unseen: good, sizes, ..Scored::default() };
        assert!(below(&scored).is_empty());
        scored.quiet.right = 96;
        scored.sizes[1].wrong.right = 3;
        let said = below(&scored);
        assert!(said.len() == 2 && said[0].contains("0.960 of untouched") && said[1].contains("size 0.5 are misnamed"), "{said:?}");
    }
}

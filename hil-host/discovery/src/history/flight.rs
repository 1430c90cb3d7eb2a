//! A flight judged by the history of its vehicle, as every command says it.

use super::file::{Edited, History};
use super::glide::Glider;
use super::judge::{Judgement, judge, judge_summary, moved_alone};
use super::learn::{FEWEST_CONTROLS, Learnt, WINDOW, of_summaries};
use super::numbers::{ALL, NUMBERS, Numbers, in_effect};
use super::rows::{median, units};
use super::sent::Sent;
use super::weigh::chance;
use crate::model::parameters::NINETY;
use logs::record::bounded;
use logs::record::flight::Flight;
use logs::vehicle::Vehicle;
use nalgebra::DVector;
use serde_json::{Value, json};
use std::path::Path;

/// Most units of a flight that are judged: its last ones.
const MOST: usize = 24;

/// By what a flight was judged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum By {
    /// A history of its vehicle.
    History(String),
    /// Its own segments before the one that is judged: an error that all of them share does not show.
    OwnSegments,
    /// Nothing but the usual sizes of errors.
    Nothing,
}

/// What a flight says beside its vehicle's history.
#[derive(Clone, Debug)]
pub struct Said {
    /// By what.
    pub by: By,
    /// Quiet units that it was judged by.
    pub controls: usize,
    /// Units of the flight, and how many of them are not quiet.
    pub units: (usize, usize),
    /// The unit that stands for the flight.
    pub unit: String,
    /// What is said of it.
    pub judgement: Judgement,
    /// How probable it is that a healthy unit departs as much, and the least that this could be.
    pub chance: (f64, f64),
    /// Why the history judges nothing.
    pub gate: Option<String>,
    /// Numbers that the vehicle file claims otherwise than the one that the history was learnt with.
    pub edited: Edited,
    glider: Glider,
}

/// Judges the last units of a flight: the one with the median evidence stands for all, so that a single odd dive names nothing.
fn by_last<T>(of: &[T], judged: impl Fn(&T) -> Judgement) -> Option<(usize, usize, Judgement)> {
    let last = &of[of.len().saturating_sub(MOST)..];
    let mut all: Vec<(usize, Judgement)> = last.iter().map(judged).enumerate().collect();
    let loud = all.iter().filter(|j| !j.1.is_quiet()).count();
    let best = |j: &Judgement| j.ln_bayes.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    all.sort_by(|a, b| best(&a.1).total_cmp(&best(&b.1)));
    let middle = (all.len().checked_sub(1)?) / 2;
    let (place, judgement) = all.swap_remove(middle);
    Some((of.len() - last.len() + place, loud, judgement))
}

/// Judges a flight by a history of its vehicle; none where it has no steady dive.
#[must_use]
pub fn by_history(history: &History, name: &str, flight: &Flight, vehicle: &Vehicle) -> Option<Said> {
    let all = units(flight);
    let learnt = history.learnt();
    let glider = history.glider(vehicle);
    let (place, loud, judgement) = by_last(&all, |u| judge(u, &glider, &learnt, &learnt.at))?;
    Some(said_by(history, &learnt, name, vehicle, (all.len(), loud), &all[place].id, judgement))
}

/// What a history says with a judgement of one unit, of so many units and so many that are not quiet.
fn said_by(
    history: &History,
    learnt: &Learnt,
    name: &str,
    vehicle: &Vehicle,
    units: (usize, usize),
    unit: &str,
    judgement: Judgement,
) -> Said {
    Said {
        by: By::History(name.to_owned()),
        controls: learnt.units.len(),
        units,
        unit: unit.to_owned(),
        chance: chance(judgement.chi2, &history.earlier_chi2()),
        judgement,
        gate: History::gate(learnt),
        edited: history.edited(vehicle),
        glider: history.glider(vehicle),
    }
}

/// Judges dives of which surfacings sent the summaries, counted from the numbers of the vehicle file, as a flight of so many units; none
/// of none.
#[must_use]
pub fn by_sent(history: &History, name: &str, all: &[(String, Sent)], vehicle: &Vehicle) -> Option<Said> {
    let learnt = history.learnt();
    let judged = |(_, sent): &(String, Sent)| {
        let mut sent = sent.clone();
        sent.count_from(&learnt.at);
        judge_summary(&sent.summary(Some(learnt.usual_level)), &learnt)
    };
    let (place, loud, judgement) = by_last(all, judged)?;
    Some(said_by(history, &learnt, name, vehicle, (all.len(), loud), &all[place].0, judgement))
}

/// Judges each surfacing of a mission by the quiet ones before it, from what they sent alone; none of the first three.
#[must_use]
pub fn sent_one_by_one(all: &[(String, Sent)], glider: &Glider) -> Vec<Option<Said>> {
    let mut quiet: Vec<&Sent> = Vec::new();
    let (mut earlier, mut out) = (Vec::new(), Vec::new());
    for (unit, sent) in all {
        if quiet.len() < FEWEST_CONTROLS {
            quiet.push(sent);
            out.push(None);
            continue;
        }
        let last = &quiet[quiet.len().saturating_sub(WINDOW)..];
        let usual = median(last.iter().map(|s| s.level(None)));
        let summaries = last.iter().map(|s| s.summary(Some(usual))).collect();
        let learnt = of_summaries(summaries, &[], Numbers::zeros(), &DVector::zeros(NUMBERS), usual);
        let judgement = judge_summary(&sent.summary(Some(usual)), &learnt);
        let (is_quiet, chance) = (judgement.is_quiet(), chance(judgement.chi2, &earlier));
        if is_quiet {
            earlier.push(judgement.chi2);
            quiet.push(sent);
        }
        let (controls, gate, units) = (learnt.units.len(), History::gate(&learnt), (1, usize::from(!is_quiet)));
        let (unit, edited, glider) = (unit.clone(), Edited::zeros(), glider.clone());
        out.push(Some(Said { by: By::OwnSegments, controls, units, unit, judgement, chance, gate, edited, glider }));
    }
    out
}

/// Judges a flight of a vehicle without a history: by its own earlier segments where there are enough, else says only what moved.
#[must_use]
pub fn without_history(flight: &Flight, vehicle: &Vehicle) -> Option<Said> {
    /// Segments that are a history for the last of them.
    const ENOUGH: usize = 6;
    let all = units(flight);
    let (last, before) = all.split_last()?;
    if before.len() >= ENOUGH
        && let Some(history) = History::learnt_from(&[super::file::Logged { units: before.to_vec(), sha256: String::new() }], vehicle, "")
    {
        let (glider, learnt) = (history.glider(vehicle), history.learnt());
        let judgement = judge(last, &glider, &learnt, &learnt.at);
        let loud = usize::from(!judgement.is_quiet());
        let chance = chance(judgement.chi2, &history.earlier_chi2());
        let (controls, gate) = (learnt.units.len(), History::gate(&learnt));
        let (unit, edited) = (last.id.clone(), Edited::zeros());
        return Some(Said { by: By::OwnSegments, controls, units: (all.len(), loud), unit, judgement, chance, gate, edited, glider });
    }
    let glider = Glider::of_units(vehicle, &all);
    let judgement = moved_alone(last, &glider);
    let (unit, edited) = (last.id.clone(), Edited::zeros());
    Some(Said { by: By::Nothing, controls: 0, units: (all.len(), 0), unit, judgement, chance: (1.0, 1.0), gate: None, edited, glider })
}

/// The history beside a vehicle file judges a flight; without one its own segments do.
#[must_use]
pub fn judged(flight: &Flight, vehicle: &Vehicle, notes: &mut Vec<String>) -> Option<Said> {
    let Some(path) = History::next_to(&vehicle.path) else { return without_history(flight, vehicle) };
    match read(&path) {
        Ok(history) => by_history(&history, &path.display().to_string(), flight, vehicle),
        Err(why) => {
            notes.push(format!("the history beside the vehicle file is not used: {why}"));
            without_history(flight, vehicle)
        }
    }
}

/// Reads a history.
///
/// # Errors
/// What is wrong, and where.
pub fn read(path: &Path) -> Result<History, String> {
    if !path.exists() {
        return Err(format!("{}: no such history; `glider calibrate` writes one beside the vehicle file", path.display()));
    }
    let text = bounded::text(path, bounded::DOCUMENT).map_err(|e| format!("{}: {e}", path.display()))?;
    History::parse(&text, path)
}

impl Said {
    /// Whether its answer takes the place of one without a history.
    #[must_use]
    pub fn decides(&self) -> bool {
        matches!(self.by, By::History(_)) && self.gate.is_none()
    }

    /// Effects named, the most probable first.
    #[must_use]
    pub fn class(&self) -> Vec<&'static str> {
        self.judgement.class.iter().map(|i| ALL[*i].effect).collect()
    }

    /// Effects of the class with those that mirror them on any vehicle.
    #[must_use]
    pub fn with_mirrors(&self) -> Vec<&'static str> {
        let mut out = self.class();
        for mirror in self.judgement.class.iter().filter_map(|i| ALL[*i].mirror) {
            if !out.contains(&mirror) {
                out.push(mirror);
            }
        }
        out
    }

    /// A size of a number with its 90 % interval as the first parameter of its effect.
    #[must_use]
    pub fn size(&self, number: usize, (size, sigma): (f64, f64)) -> [f64; 3] {
        let claims = self.glider.claims();
        let of = |s: f64| in_effect(number, s * self.glider.sizes[number], claims[number]);
        let (a, b) = (of(size - NINETY * sigma), of(size + NINETY * sigma));
        [of(size), a.min(b), a.max(b)]
    }

    /// What moved of each number: its value and 90 % interval in what it is known to scatter by, and the value in words.
    pub fn moved(&self) -> impl Iterator<Item = (&'static str, [f64; 3], String)> + '_ {
        (0..NUMBERS).map(|i| {
            let ((size, sigma), scatter) = (self.judgement.moved[i], self.judgement.scatter[i]);
            // As the value runs that is stated: more mass is less volume.
            let size = size * self.size(i, (1.0, 0.0))[0].signum();
            let at = [size, size - NINETY * sigma, size + NINETY * sigma].map(|v| v / scatter);
            (ALL[i].name, at, self.value_in_words(i, self.judgement.moved[i]))
        })
    }

    /// Least size of a number that would have been named, as the first parameter of its effect.
    #[must_use]
    pub fn least_named(&self, number: usize) -> f64 {
        self.size(number, (self.judgement.least[number], 0.0))[0].abs()
    }

    fn entry(&self, number: usize, of: (f64, f64)) -> Value {
        let n = &ALL[number];
        let [value, low, high] = self.size(number, of);
        let parameter = n.parameter();
        json!({"number": n.name, "effect": n.effect, "parameter": parameter.name, "unit": parameter.unit, "value": value, "low": low, "high": high,
            "mirror": n.mirror})
    }

    /// As JSON.
    #[must_use]
    pub fn document(&self) -> Value {
        let j = &self.judgement;
        let named = |i: &usize| {
            let mut entry = self.entry(*i, j.alone[*i]);
            entry["ln_bayes"] = json!(j.ln_bayes[*i]);
            entry
        };
        json!({
            "by": match &self.by { By::History(file) => file.as_str(), By::OwnSegments => "own earlier segments", By::Nothing => "usual sizes of errors" },
            "decides": self.decides(),
            "controls": self.controls,
            "units": {"judged": self.units.0.min(MOST), "not_quiet": self.units.1, "stands_for_all": self.unit},
            "class": j.class.iter().map(named).collect::<Vec<_>>(),
            "chance": {"p": self.chance.0, "floor": self.chance.1, "chi2_per_number": j.chi2},
            "moved": (0..NUMBERS).map(|i| self.entry(i, j.moved[i])).collect::<Vec<_>>(),
            "departs": j.departs.map(|(d, ln)| json!({"variable": d.variable, "about": d.about, "ln_bayes": ln})),
            "gate": self.gate,
            "says": self.words(),
        })
    }

    /// Numbers that moved by more than their interval, in words.
    #[must_use]
    pub fn moved_in_words(&self) -> String {
        let far = |i: &usize| self.judgement.moved[*i].0.abs() > NINETY * self.judgement.moved[*i].1;
        let all: Vec<String> = (0..NUMBERS).filter(far).map(|i| self.in_words(i, self.judgement.moved[i])).collect();
        if all.is_empty() {
            "no number moved from the earlier dives beyond its interval".into()
        } else {
            format!("what moved: {}", all.join("; "))
        }
    }

    fn in_words(&self, number: usize, of: (f64, f64)) -> String {
        format!("{} {}", ALL[number].name.replace('_', " "), self.value_in_words(number, of))
    }

    fn value_in_words(&self, number: usize, of: (f64, f64)) -> String {
        let [value, low, high] = self.size(number, of);
        let (factor, unit) = match ALL[number].parameter().unit {
            "rad" => (1f64.to_degrees(), " deg"),
            "1" => (100.0, " %"),
            "cm^3" => (1.0, " cm3"),
            _ => (1.0, ""),
        };
        let [value, low, high] = [value, low, high].map(|v| v * factor);
        let digits = (1.0 - (0.5 * (high - low)).max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{value:+.digits$}{unit} (90 %: {low:+.digits$} to {high:+.digits$})")
    }

    /// In words.
    #[must_use]
    pub fn words(&self) -> String {
        if let Some(gate) = &self.gate {
            return format!("{gate}; {}.", self.moved_in_words());
        }
        let j = &self.judgement;
        let (p, floor) = self.chance;
        let by = match &self.by {
            By::History(_) => format!("the last {} quiet dives of this vehicle", self.controls),
            By::OwnSegments => format!("the flight's own {} earlier segments (`glider timeline` judges each of them)", self.controls),
            By::Nothing => {
                // What moved is said by the fit of all rows: steady glides alone give other numbers.
                return "Without a history: three earlier dives of this vehicle (glider calibrate) would tell whether what moved is a change."
                    .into();
            }
        };
        if let Some((d, _)) = j.departs {
            return format!(
                "Beside {by} something changed that none of the numbers describes: it follows {} ({}). Chance of a healthy dive {p:.3} (at least {floor:.3}).",
                d.variable, d.about
            );
        }
        if j.class.is_empty() {
            return format!("Beside {by} nothing departs (chance {p:.2}); {}.", self.moved_in_words());
        }
        let names: Vec<String> = j.class.iter().map(|i| self.in_words(*i, j.alone[*i])).collect();
        let mirrors: Vec<&str> = self.with_mirrors().into_iter().filter(|m| !self.class().contains(m)).collect();
        let mirrors = if mirrors.is_empty() { String::new() } else { format!("; depth alone cannot tell it from {}", mirrors.join(", ")) };
        format!("Beside {by} this departs: {}{mirrors}. Chance of a healthy dive {p:.3} (at least {floor:.3}).", names.join(", or "))
    }
}

//! The dives of a mission as their own history: which names of changes they bear out, and what each dive says beside those before it.

use super::changes::Change;
use super::event::Event;
use super::tracking::{AT_COMPRESSIBILITY, AT_DRAG, AT_LIFT, AT_PITCH_ZERO, AT_TRIM, TRACKED};
use crate::history::changes::{Compared, Own};
use crate::history::numbers::{self, ALL};
use crate::history::weigh::{class, stands};
use hydro::effects::DAY_S;

/// What the history says of one dive of a mission.
#[derive(Clone, Debug)]
pub struct Dive {
    /// Day of the mission at which it began.
    pub day: f64,
    /// Flight and segment.
    pub id: String,
    /// What is said of it; none of the first ones.
    pub compared: Option<Compared>,
}

impl Dive {
    /// What departs in it, in words; none where it is quiet.
    #[must_use]
    pub fn departs(&self) -> Option<String> {
        let j = &self.compared.as_ref()?.judgement;
        let names = |class: &[usize]| class.iter().map(|i| ALL[*i].name.replace('_', " ")).collect::<Vec<_>>().join(" or ");
        let unnamed =
            |d: &(crate::history::structure::Departure, f64)| format!("none of the numbers: it follows {} ({})", d.0.variable, d.0.about);
        if j.class.is_empty() { j.departs.as_ref().map(unnamed) } else { Some(names(&j.class)) }
    }
}

/// Numbers of the history that say the same as a tracked number; depth alone does not tell a scale of pitch from drag.
fn same(tracked: usize) -> &'static [usize] {
    match tracked {
        AT_DRAG => &[numbers::DRAG_LEVEL, numbers::PITCH_SCALE],
        AT_LIFT => &[numbers::SLOPE_OF_LIFT],
        AT_TRIM => &[numbers::BALLAST_OFFSET],
        AT_PITCH_ZERO => &[numbers::PITCH_OFFSET],
        AT_COMPRESSIBILITY => &[numbers::COMPRESSIBILITY],
        _ => &[],
    }
}

/// The dives beside those before them.
#[must_use]
pub fn dives(own: &Own) -> Vec<Dive> {
    let all = own.units.iter().zip(own.one_by_one());
    all.map(|(u, compared)| Dive { day: u.start_s() / DAY_S, id: u.id.clone(), compared }).collect()
}

/// Events that the dives bear out as their own history; of the others why they are none. `days` are those of the dives that the
/// events count.
#[must_use]
pub fn borne_out(own: &Own, events: Vec<Event>, days: &[f64]) -> (Vec<Event>, Vec<String>) {
    let mut notes = Vec::new();
    let kept = events.into_iter().filter(|e| match refused(own, &e.change, days) {
        None => true,
        Some(why) => {
            let t = &TRACKED[e.change.kind.number];
            notes.push(format!("{} from dive {} (a change of {}) is not named: {why}", e.change.kind.name, e.dive.max(1), t.name));
            false
        }
    });
    (kept.collect(), notes)
}

/// Why a change is none; nothing where the dives bear it out, or do not see its number.
fn refused(own: &Own, change: &Change, days: &[f64]) -> Option<String> {
    let same = same(change.kind.number);
    if same.is_empty() {
        return None;
    }
    // The dive that the mission counts at the time of a unit.
    let dive_of = |day: f64| days.partition_point(|d| *d <= day + 1e-6).saturating_sub(1);
    let weight: Vec<f64> = own.units.iter().map(|u| change.gone_at(dive_of(u.start_s() / DAY_S), days)).collect();
    let Some(ln) = own.change(&weight) else { return Some("too few quiet dives are before it: it may be the vehicle".into()) };
    let class = class(&ln);
    // Many dives together are known better than the law: of numbers that mirror each other the wrong one may lead. What is said of a
    // wing or a hull must lead all the same.
    let grave = matches!(change.kind.number, AT_LIFT | AT_COMPRESSIBILITY);
    if class.iter().any(|i| same.contains(i)) || (!grave && same.iter().any(|i| stands(ln[*i]))) {
        return None;
    }
    let names: Vec<String> = class.iter().map(|i| ALL[*i].name.replace('_', " ")).collect();
    Some(if names.is_empty() {
        "beside the dives before it nothing departs by more than dives differ".into()
    } else {
        format!("beside the dives before it what departs is {}", names.join(" or "))
    })
}

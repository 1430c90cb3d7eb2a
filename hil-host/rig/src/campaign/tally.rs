//! What each fault was owed and what came of it, over all its missions.

use super::Verdict;
use super::expect::{Act, Expect};
use plant::faults::catalogue;
use serde_json::{Value, json};

/// One fault of the catalogue, alone, over phases, waters, wings and onsets.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// As `glider fly --fault` takes it.
    pub fault: String,
    /// Kinds of what it is owed, the strictest first.
    pub owed: Vec<&'static str>,
    /// Permitted first causes of an abort.
    pub causes: Vec<String>,
    /// Longest bound from the onset, s; none: none of its missions has one, or the fault never shows.
    pub bound_s: Option<f64>,
    /// What is owed by a sign: the sign, the act, and within how long, s.
    pub by_sign: Vec<(&'static str, &'static str, f64)>,
    /// Missions in which it became active.
    pub missions: u64,
    /// Of these, aborted.
    pub aborted: u64,
    /// Of these, expectation not met.
    pub unmet: u64,
    /// Longest time from the onset to the abort, of the missions with a bound, s.
    pub worst_bounded_s: Option<f64>,
    /// Longest time from the onset to the abort, of all, s.
    pub worst_s: Option<f64>,
    /// Longest time from a sign to the abort, s.
    pub worst_after_sign_s: Option<f64>,
}

impl Row {
    fn take(&mut self, v: &Verdict) {
        self.missions += 1;
        self.unmet += u64::from(v.unmet.is_some());
        let most = |a: Option<f64>, b: f64| Some(a.map_or(b, |a| a.max(b)));
        if let Some((_, after_s)) = v.abort {
            self.aborted += 1;
            self.worst_s = most(self.worst_s, after_s);
            if matches!(v.owed, Some(Expect::Abort(..))) {
                self.worst_bounded_s = most(self.worst_bounded_s, after_s);
            }
        }
        if let Some(s) = v.after_sign_s {
            self.worst_after_sign_s = most(self.worst_after_sign_s, s);
        }
        let Some(owed) = &v.owed else { return };
        if !self.owed.contains(&owed.kind()) {
            self.owed.push(owed.kind());
            self.owed.sort_unstable();
        }
        for cause in owed.causes().iter().map(|c| format!("{c:?}")) {
            if !self.causes.contains(&cause) {
                self.causes.push(cause);
            }
        }
        if let Expect::Abort(_, bound) | Expect::Home(_, bound) = owed
            && bound.is_finite()
        {
            self.bound_s = most(self.bound_s, *bound);
        }
        for duty in owed.duties() {
            let act = if duty.act == Act::Abort { "abort" } else { "turn" };
            match self.by_sign.iter_mut().find(|d| (d.0, d.1) == (duty.sign.name(), act)) {
                Some(there) => there.2 = there.2.max(duty.within_s),
                None => self.by_sign.push((duty.sign.name(), act, duty.within_s)),
            }
        }
    }

    /// Missions that went on.
    #[must_use]
    pub const fn went_on(&self) -> u64 {
        self.missions - self.aborted
    }

    /// One entry of the JSON list.
    #[must_use]
    pub fn document(&self) -> Value {
        let by_sign: Vec<Value> =
            self.by_sign.iter().map(|(sign, act, within_s)| json!({ "sign": sign, "act": act, "within_s": within_s.round() })).collect();
        json!({ "fault": self.fault, "owed": self.owed, "causes": self.causes, "bound_s": self.bound_s.map(f64::round), "by_sign": by_sign,
            "worst_of_bound_s": self.worst_bounded_s.map(f64::round), "worst_latency_s": self.worst_s.map(f64::round),
            "worst_after_sign_s": self.worst_after_sign_s.map(f64::round), "missions": self.missions,
            "aborted": self.aborted, "went_on": self.went_on(), "unmet": self.unmet })
    }
}

/// A row for each fault of the catalogue that became active alone, in the catalogue's order.
#[must_use]
pub fn rows(faulty: &[Verdict]) -> Vec<Row> {
    let name = |target: &str, kind: &str| format!("{target}:{kind}");
    let mut rows: Vec<Row> =
        catalogue().map(|(target, kind, ..)| Row { fault: name(target.name(), kind.name()), ..Row::default() }).collect();
    let places: std::collections::HashMap<String, usize> = rows.iter().enumerate().map(|(i, row)| (row.fault.clone(), i)).collect();
    for v in faulty.iter().filter(|v| v.struck) {
        if let [fault] = v.case.faults.as_slice()
            && let Some(row) = places.get(&name(fault.target.name(), fault.kind.name())).and_then(|i| rows.get_mut(*i))
        {
            row.take(v);
        }
    }
    rows.retain(|row| row.missions > 0);
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::lattice::{Case, Water};
    use crate::campaign::run;
    use signals::Wings;

    #[test]
    fn a_row_holds_the_longest_bound_and_latency_and_counts_the_rest() {
        let fly = |fault: &str| {
            let faults = vec![fault.parse().expect("a fault")];
            run(&Case { water: Water::Shallow, wings: Wings::Standard, seed: 5, faults, line: None }).expect("flies")
        };
        let rows = rows(&[fly("depth:stuck@dive"), fly("depth:stuck@inflect_low"), fly("depth:stuck@dive,8s"), fly("roll:off@climb")]);
        let names: Vec<&str> = rows.iter().map(|r| r.fault.as_str()).collect();
        assert_eq!(names, ["depth:stuck", "roll:off"]);
        let stuck = &rows[0];
        assert_eq!((stuck.missions, stuck.aborted, stuck.went_on(), stuck.unmet), (3, 2, 1, 0));
        assert_eq!((stuck.bound_s, stuck.owed.as_slice()), (Some(101.0), &["abort", "tolerated"][..]));
        assert!(stuck.worst_bounded_s.is_some_and(|s| (40.0..=105.0).contains(&s)) && stuck.worst_bounded_s == stuck.worst_s, "{stuck:?}");
        assert_eq!((rows[1].owed.as_slice(), rows[1].bound_s, rows[1].worst_s), (&["mission"][..], None, None));
    }
}

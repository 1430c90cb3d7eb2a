//! The campaign as a page: the verdict first, then where each fault was met and how fast, then what is not as it should be.

use crate::pages::{Axis, Chart, Heat, Item, Mark, Page, Provenance, Section, Series, Table};
use plant::faults::catalogue;
use rig::campaign::lattice::{PHASES, Water};
use rig::campaign::{Summary, Verdict};
use signals::Phase;
use std::collections::BTreeMap;

/// Upper ends of the bins of the latency histogram, s.
const BINS_S: [f64; 9] = [4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0, f64::INFINITY];

/// Name of a phase for a column.
const fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Surface => "surface",
        Phase::Dive => "dive",
        Phase::InflectLow => "turn low",
        Phase::Climb => "climb",
        Phase::InflectHigh => "turn high",
        Phase::Comms => "comms",
        Phase::Done => "done",
        Phase::Safe => "safe",
    }
}

/// Single faults of the campaign: verdicts by fault and phase of onset.
struct Matrix<'a>(BTreeMap<(usize, usize), Vec<&'a Verdict>>);

impl<'a> Matrix<'a> {
    fn of(faulty: &'a [Verdict]) -> Self {
        let names: BTreeMap<_, usize> = catalogue().enumerate().map(|(i, e)| ((e.0.name(), e.1.name()), i)).collect();
        let mut cells: BTreeMap<(usize, usize), Vec<&Verdict>> = BTreeMap::new();
        for v in faulty {
            let [fault] = v.case.faults.as_slice() else { continue };
            let row = names.get(&(fault.target.name(), fault.kind.name())).copied();
            let column = PHASES.iter().position(|p| Some(*p) == fault.phase);
            if let (Some(row), Some(column)) = (row, column) {
                cells.entry((row, column)).or_default().push(v);
            }
        }
        Self(cells)
    }

    /// What a cell says: unsafe and unmet first, else the worst latency of its aborts, else that the mission went on.
    fn text(&self, row: usize, column: usize) -> String {
        let Some(all) = self.0.get(&(row, column)) else { return String::new() };
        let struck: Vec<_> = all.iter().filter(|v| v.struck).collect();
        if all.iter().any(|v| !v.safe() && !v.apart()) {
            return "✗ unsafe".into();
        }
        if all.iter().any(|v| v.unmet.is_some()) {
            return "✗ not as owed".into();
        }
        if struck.is_empty() {
            return "not met".into();
        }
        match Self::worst_s(all) {
            Some(worst) => format!("{worst:.0} s{}", if struck.iter().all(|v| v.abort.is_some()) { "" } else { " or none" }),
            None => "goes on".into(),
        }
    }

    /// How strongly a cell is shaded: by the logarithm of its time, a control cycle to half an hour.
    fn shade(&self, row: usize, column: usize) -> f64 {
        let Some(all) = self.0.get(&(row, column)) else { return f64::NAN };
        if all.iter().any(|v| v.wrong()) {
            return -1.0;
        }
        Self::worst_s(all).map_or(f64::NAN, |worst| ((worst.max(4.0) / 4.0).ln() / 450f64.ln()).min(1.0))
    }

    /// Longest time from the onset of a fault that lasts to the abort, s; none: no abort.
    fn worst_s(all: &[&Verdict]) -> Option<f64> {
        all.iter().filter_map(|v| v.abort).map(|a| a.1).reduce(f64::max)
    }
}

/// The page of a campaign; `flown` says in one line in how long, where, and what a seat made of a sample, if one did.
#[must_use]
pub fn page(s: &Summary, faulty: &[Verdict], healthy: &[Verdict], flown: &str) -> Page {
    let mut answer = vec![(
        "Verdict".to_owned(),
        format!(
            "{}{} of {} fault missions ended at the surface; {} went below crush depth; {} of {} healthy twins aborted.",
            if s.passed() { "" } else { "NOT PASSED: " },
            grouped(s.safe),
            grouped(s.missions),
            s.below_crush,
            s.false_aborts,
            s.twins
        ),
    )];
    answer.push((
        "Expectations".into(),
        format!(
            "{} missions did not do what their fault is owed (an abort with its cause in time, none for a harmless fault); {} flights over a bad line were commanded otherwise than over a good one.",
            s.unmet, s.line_changed
        ),
    ));
    answer.push((
        "No means left".into(),
        match s.apart {
            0 => "Every mission had a force on board that points up for good.".into(),
            n => format!(
                "{n} more missions were set apart before they were flown: what their faults leave of pump and weight does not lift what they load on the vehicle. {} came home all the same; listed below, not counted.",
                s.apart_home
            ),
        },
    ));
    answer.push(("Flown".into(), flown.to_owned()));
    Page {
        title: "Fault campaign".into(),
        answer,
        sections: vec![bad(faulty, healthy), owed(faulty), latencies(faulty), depths(faulty), matrix(faulty), method()],
        provenance: Provenance::of_this_run(),
    }
}

fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let first = digits.len() % 3;
    let mut out = String::new();
    for (i, d) in digits.chars().enumerate() {
        if i > 0 && i % 3 == first {
            out.push(' ');
        }
        out.push(d);
    }
    out
}

fn row(v: &Verdict) -> Vec<String> {
    let why = v.broken.iter().copied().chain(v.unmet).collect::<Vec<_>>().join(", ");
    vec![
        v.case.name(),
        format!("{:?}", v.case.water).to_lowercase(),
        rig::flight::mission_file::wings_name(v.case.wings).to_owned(),
        v.case.seed.to_string(),
        why,
        v.abort.map_or_else(|| "none".to_owned(), |(cause, after)| format!("{cause:?} after {after:.0} s")),
        format!("{:.0} m", v.max_depth_m),
        if v.fired { "fired" } else { "kept" }.to_owned(),
    ]
}

fn bad(faulty: &[Verdict], healthy: &[Verdict]) -> Section {
    let head: Vec<String> =
        ["fault", "water", "wings", "seed", "what", "abort", "deepest", "weight"].into_iter().map(str::to_owned).collect();
    let table = |caption: &str, rows: Vec<Vec<String>>| -> Item {
        if rows.is_empty() {
            format!("{caption}: none.").as_str().into()
        } else {
            Table { caption: caption.into(), head: head.clone(), rows }.into()
        }
    };
    let wrong = faulty.iter().chain(healthy).filter(|v| v.wrong()).map(row).collect();
    Section {
        title: "Not as expected".into(),
        lead:
            "Unsafe missions and unmet expectations count against the controller; missions without any force that points up for good, by a budget of pump, weight and load made before the flight, are shown apart."
                .into(),
        items: vec![table("Not as expected", wrong), apart(faulty)],
    }
}

/// The missions set apart, with their budget.
fn apart(faulty: &[Verdict]) -> Item {
    let caption = "No means left".to_owned();
    let rows: Vec<Vec<String>> = faulty
        .iter()
        .filter(|v| v.apart())
        .map(|v| {
            vec![
                v.case.name(),
                rig::flight::mission_file::wings_name(v.case.wings).to_owned(),
                format!("{:.2} N at {:.0} m", v.means.for_good_n, v.means.at_m),
                v.end.to_string(),
                format!("{:.0} m", v.max_depth_m),
                if v.fired { "fired" } else { "kept" }.to_owned(),
            ]
        })
        .collect();
    if rows.is_empty() {
        return format!("{caption}: none.").as_str().into();
    }
    let head = ["faults", "wings", "upward force at rest, least", "end", "deepest", "weight"].into_iter().map(str::to_owned).collect();
    Table { caption, head, rows }.into()
}

/// What each fault is owed and what came of it.
fn owed(faulty: &[Verdict]) -> Section {
    let seconds = |s: Option<f64>| s.map_or_else(String::new, |s| format!("{s:.0}"));
    let rows = rig::campaign::tally::rows(faulty)
        .into_iter()
        .map(|row| {
            let by_sign =
                row.by_sign.iter().map(|(sign, act, within_s)| format!("{act} {within_s:.0} s after: {sign}")).collect::<Vec<_>>();
            let (aborted, went_on) = (row.aborted.to_string(), row.went_on().to_string());
            let unmet = if row.unmet == 0 { String::new() } else { format!("✗ {}", row.unmet) };
            vec![
                row.fault,
                row.owed.join(", "),
                row.causes.join(", "),
                seconds(row.bound_s),
                seconds(row.worst_bounded_s),
                by_sign.join("; "),
                seconds(row.worst_after_sign_s),
                seconds(row.worst_s),
                aborted,
                went_on,
                unmet,
            ]
        })
        .collect();
    let head = [
        "fault",
        "owed",
        "causes",
        "bound, s",
        "worst of these, s",
        "owed by a sign",
        "worst after it, s",
        "worst of all, s",
        "aborted",
        "went on",
        "not as owed",
    ];
    Section {
        title: "What each fault is owed".into(),
        lead: "abort: one of these first causes within the bound. home: turned for the surface within the bound. mission: no abort. tolerated: the mission may go on, an abort may have these causes only, and what a sign in truth or frames makes due is done in time. Bounds are the longest over phases, waters and wings (a pump is owed an abort from when it is next needed), latencies the longest, both from the fault's onset; reading and answer add a control cycle of 4 s. Tolerated together with another kind: over before its bound.".into(),
        items: vec![Table { caption: "Owed and done, single faults".into(), head: head.map(str::to_owned).to_vec(), rows }.into()],
    }
}

fn latencies(faulty: &[Verdict]) -> Section {
    let singles = || faulty.iter().filter(|v| v.case.faults.len() == 1 && v.struck && !v.apart());
    let mut counts = [0.0; BINS_S.len()];
    for (_, after) in singles().filter_map(|v| v.abort) {
        if let Some(count) = BINS_S.iter().position(|end| after <= *end).and_then(|i| counts.get_mut(i)) {
            *count += 1.0;
        }
    }
    let mut from = 0.0;
    let names = BINS_S.map(|end| {
        let name = if end.is_finite() { format!("{from:.0} to {end:.0} s") } else { format!("over {from:.0} s") };
        from = end;
        name
    });
    let histogram = Chart::bars(
        "From a fault's onset to the abort, single faults",
        Axis::new("missions", ""),
        names.to_vec(),
        "missions",
        &counts,
        &[],
        &[],
    );
    let went_on = singles().filter(|v| v.abort.is_none()).count();
    let mut causes: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (cause, after) in singles().filter_map(|v| v.abort) {
        causes.entry(format!("{cause:?}")).or_default().push(after);
    }
    let rows = causes
        .into_iter()
        .map(|(cause, mut after)| {
            after.sort_by(f64::total_cmp);
            let at = |share: f64| after.get(((after.len() - 1) as f64 * share) as usize).copied().unwrap_or(f64::NAN);
            vec![cause, after.len().to_string(), format!("{:.0}", at(0.5)), format!("{:.0}", at(0.95)), format!("{:.0}", at(1.0))]
        })
        .collect();
    let head = ["first cause", "missions", "median, s", "95 %, s", "longest, s"].into_iter().map(str::to_owned).collect();
    Section {
        title: "How fast".into(),
        lead: format!(
            "A control cycle is 4 s. Long latencies belong to faults that show only when the part is next needed (a pump that sticks in a dive); {went_on} more missions with a single fault went on without an abort."
        ),
        items: vec![histogram.into(), Table { caption: "Latency by first cause, single faults".into(), head, rows }.into()],
    }
}

fn depths(faulty: &[Verdict]) -> Section {
    let of = |water: Water| {
        let points = faulty.iter().filter(|v| v.case.water == water && !v.apart());
        let (x, y): (Vec<f64>, Vec<f64>) = points
            .filter_map(|v| {
                let (_, after) = v.abort?;
                Some((after.max(1.0).log10(), v.max_depth_m))
            })
            .unzip();
        Series::new(if water == Water::Shallow { "shallow (crush 125 m)" } else { "edge (crush 250 m)" }, &x, &y)
    };
    let chart = Chart::new(
        "Deepest point of every aborted mission",
        Mark::Point,
        Axis::new("log10 of the time to the abort in seconds", ""),
        Axis::new("deepest", "m").down(),
    )
    .with(of(Water::Shallow))
    .with(of(Water::Edge));
    Section {
        title: "How deep".into(),
        lead: "Shallow missions turn at 27 m above a hull for 125 m, edge missions at 190 m above one for 250 m: every point must lie above its crush depth.".into(),
        items: vec![chart.into()],
    }
}

fn matrix(faulty: &[Verdict]) -> Section {
    let matrix = Matrix::of(faulty);
    let head = std::iter::once("fault").chain(PHASES.map(phase_name)).map(str::to_owned).collect();
    let columns = || 0..PHASES.len();
    let flown: Vec<_> = catalogue().enumerate().filter(|(i, _)| columns().any(|c| matrix.0.contains_key(&(*i, c)))).collect();
    let name = |e: &plant::faults::Entry| format!("{}:{}", e.0.name(), e.1.name());
    let rows = flown.iter().map(|(i, e)| std::iter::once(name(e)).chain(columns().map(|c| matrix.text(*i, c))).collect()).collect();
    let shade = flown.iter().map(|(i, _)| std::iter::once(f64::NAN).chain(columns().map(|c| matrix.shade(*i, c))).collect()).collect();
    // The picture: worst latency by the part that fails, worst of its kinds.
    let mut targets: Vec<&str> = catalogue().map(|e| e.0.name()).collect();
    targets.dedup();
    targets.sort_unstable();
    targets.dedup();
    let worst = |target: &str, column: usize| {
        let cells = catalogue().enumerate().filter(|(_, e)| e.0.name() == target).filter_map(|(i, _)| matrix.0.get(&(i, column)));
        cells.filter_map(|c| Matrix::worst_s(c)).reduce(f64::max)
    };
    let charts = PHASES.iter().enumerate().map(|(c, phase)| {
        let named: Vec<(&str, f64)> = targets.iter().filter_map(|t| Some((*t, worst(t, c)?))).collect();
        let (names, values): (Vec<String>, Vec<f64>) = named.iter().map(|(n, v)| ((*n).to_owned(), *v)).unzip();
        Item::from(Chart::bars(
            &format!("Onset in: {}", phase_name(*phase)),
            Axis::new("longest time to the abort", "s"),
            names,
            "s",
            &values,
            &[],
            &[],
        ))
    });
    let table = Heat { caption: "Longest time to the abort, by fault and phase of onset".into(), head, rows, shade };
    Section {
        title: "Fault by phase".into(),
        lead: "Each cell holds both wing sets, both waters, and the fault for good and for 90 s. A time: the longest from onset to abort; \"or none\": some of them (transient ones) went on; \"goes on\": no abort; \"not met\": the mission was over before the fault.".into(),
        items: std::iter::once(table.into()).chain(charts).collect(), // the table is the matrix, the bars its outline
    }
}

fn method() -> Section {
    Section {
        title: "How it was judged".into(),
        lead: String::new(),
        items: vec![
            "Every mission: at the surface within its time limit, never below crush depth, every command finite and in range, the first cause of an abort kept, SAFE never left.".into(),
            "Every fault alone: an abort with the right cause within a bound, or none at all where it is harmless, or a way home without an abort where a second sensor is left, or, where its effect decides, an abort with the right cause at most, due in time after a sign of it. Bounds are sums of demanded times, whatever the law waits for; signs are reckoned from the truth and the frames.".into(),
            "A healthy twin with the same noise flies each mission without an abort.".into(),
            "Before it is flown every mission has a budget: the upward force at rest that the best of pump and weight still gives, less what the faults load on the vehicle for good, where it is least between surface and crush depth. Only where that is negative a mission is set apart; it still owes an abort, full buoyancy and the weight. What ends or grows (a pull, water coming in) is a race that has to be won.".into(),
            "A pump that holds still, or its feedback, cannot be distinguished from a sound one before it is needed: the bound counts from the moment at which the healthy twin asks it to be elsewhere.".into(),
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rig::campaign::lattice::{cases, spread, twins};
    use rig::campaign::run;

    #[test]
    fn the_page_says_the_verdict_first_and_shows_what_went_wrong() {
        let some = spread(cases(), 60);
        let healthy: Vec<_> = twins(&some).iter().take(4).map(|c| run(c).expect("flies")).collect();
        let mut faulty: Vec<_> = some.iter().map(|c| run(c).expect("flies")).collect();
        let good = page(&Summary::of(&faulty, &healthy), &faulty, &healthy, "1 s");
        assert!(good.answer[0].1.starts_with("60 of 60 fault missions"), "{:?}", good.answer);
        if let Some(v) = faulty.first_mut() {
            v.broken.push("below crush depth");
        }
        let name = faulty[0].case.name();
        let bad = page(&Summary::of(&faulty, &healthy), &faulty, &healthy, "QEMU: the same");
        assert!(bad.answer[0].1.starts_with("NOT PASSED: 59 of 60"), "{:?}", bad.answer);
        let html = bad.to_html();
        assert!(html.contains(&name) && html.contains("below crush depth") && html.contains("QEMU: the same"));
        assert!(html.len() < 1_000_000);
        assert_eq!(
            (grouped(7), grouped(1234), grouped(29585), grouped(100_000)),
            ("7".into(), "1 234".into(), "29 585".into(), "100 000".into())
        );
    }
}

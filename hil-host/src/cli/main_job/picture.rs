//! The main job's page.

use super::flights::{Findings, Flown};
use crate::pages::{Axis, Chart, Item, Mark, Page, Provenance, Section, Series, Table};
use rig::flight::mission_file::wings_name;

/// Bins of the angle-of-attack histogram, deg.
const PICTURE_BIN_DEG: f64 = 1.0;
const PICTURE_BINS: usize = 16;

/// Draws the page.
#[must_use]
pub fn page(f: &Findings) -> Page {
    let share = |x: &Flown| 100.0 * x.outcome.achieved_l_over_d() / x.best.l_over_d;
    let flown: Vec<String> = f
        .flights
        .iter()
        .map(|x| {
            let (achieved, best) = (x.outcome.achieved_l_over_d(), x.best.l_over_d);
            format!("{}: L/D {achieved:.2} of {best:.2} ({:.0} %), {} dives", wings_name(x.wings), share(x), x.outcome.dives)
        })
        .collect();
    let c = &f.comparison;
    let which = if c.real { "Comet 2016, a real Slocum" } else { "the flight simulated just now (no real one here)" };
    Page {
        title: "Both wing sets, flown and compared".to_owned(),
        answer: vec![
            ("Flown".to_owned(), flown.join("; ")),
            ("Through".to_owned(), format!("{} — {}", f.flights.first().map_or("", |x| x.seat.as_str()), f.why)),
            (
                "How wrong".to_owned(),
                format!(
                    "steady model on {which}: {:.2} cm/s as given, {:.2} cm/s with drag, trim and measured density",
                    c.report.before_cm_s, c.report.after_cm_s
                ),
            ),
            ("What it cannot tell".to_owned(), c.report.identified.clone()),
        ],
        sections: vec![table(f), traces(f), angles(f), steady(f)],
        provenance: Provenance { seed: Some(0), ..Provenance::of_this_run() },
    }
}

fn table(f: &Findings) -> Section {
    let head = ["wings", "dives", "over ground, m", "time, s", "L/D achieved", "(L/D)max", "share, %", "pump, J", "deepest, m", "end"];
    let rows = f
        .flights
        .iter()
        .map(|x| {
            let o = &x.outcome;
            let l_over_d = o.achieved_l_over_d();
            vec![
                wings_name(x.wings).to_owned(),
                o.dives.to_string(),
                format!("{:.0}", o.distance_m),
                format!("{:.0}", o.duration_s),
                format!("{l_over_d:.3}"),
                format!("{:.3}", x.best.l_over_d),
                format!("{:.1}", 100.0 * l_over_d / x.best.l_over_d),
                format!("{:.0}", o.energy_j.0),
                format!("{:.1}", o.max_depth_m),
                o.end.to_string(),
            ]
        })
        .collect();
    Section {
        title: "The flights".to_owned(),
        lead: "Achieved L/D is horizontal way over ground by vertical way, turns included; (L/D)max is the true vehicle's.".to_owned(),
        items: vec![Item::Table(Table { caption: "Mission 3–27 m".to_owned(), head: head.map(str::to_owned).to_vec(), rows })],
    }
}

/// Columns with their names.
type Named = Vec<(String, Vec<f64>)>;

fn traces(f: &Findings) -> Section {
    let each = |title: &str, y: Axis, pick: &dyn Fn(&Flown) -> Named| {
        let mut chart = Chart::new(title, Mark::Line, Axis::new("time", "s"), y).grouped("flight");
        for x in &f.flights {
            for (name, values) in pick(x) {
                chart = chart.with(Series::new(&name, &x.trace.time_s, &values));
            }
        }
        Item::Chart(chart)
    };
    let name = |x: &Flown| wings_name(x.wings).to_owned();
    Section {
        title: "As flown".to_owned(),
        lead: "Pitch follows the angle that the controller's table gives for the best glide; the pump turns the vehicle round.".to_owned(),
        items: vec![
            each("Depth", Axis::new("depth", "m").down(), &|x| vec![(name(x), x.trace.depth_m.clone())]),
            each("Pitch and pitch aimed at", Axis::new("pitch", "deg"), &|x| {
                vec![(name(x), x.trace.pitch_deg.clone()), (format!("{}, aimed at", name(x)), x.trace.aimed_deg.clone())]
            }),
            each("Angle of attack", Axis::new("angle of attack", "deg"), &|x| vec![(name(x), x.trace.alpha_deg.clone())]),
            each("Ballast", Axis::new("ballast", "cc"), &|x| vec![(name(x), x.trace.ballast_cc.clone())]),
        ],
    }
}

fn angles(f: &Findings) -> Section {
    let items = f
        .flights
        .iter()
        .map(|x| {
            let mut share = [0.0; PICTURE_BINS];
            let n = x.trace.gliding_alpha_deg.len().max(1) as f64;
            for a in &x.trace.gliding_alpha_deg {
                if let Some(bin) = share.get_mut((a / PICTURE_BIN_DEG) as usize) {
                    *bin += 100.0 / n;
                }
            }
            let bins = (0..PICTURE_BINS).map(|i| format!("{i}–{}", i + 1)).collect();
            let title =
                format!("{}: |angle of attack| while gliding, deg; best is {:.1}°", wings_name(x.wings), x.best.alpha_rad.to_degrees());
            Item::Chart(Chart::bars(&title, Axis::new("share of cycles", "%"), bins, wings_name(x.wings), &share, &[], &[]))
        })
        .collect();
    Section { title: "How near the best glide".to_owned(), lead: "Bars at the best angle are cycles well flown.".to_owned(), items }
}

fn steady(f: &Findings) -> Section {
    let c = &f.comparison;
    let steps: Vec<String> = c.report.ladder.iter().map(|s| s.title.to_owned()).collect();
    let values: Vec<f64> = c.report.ladder.iter().map(|s| s.rms_cm_s).collect();
    let mut items = vec![Item::Chart(Chart::bars(
        "Error of vertical velocity over steady samples",
        Axis::new("rms", "cm/s"),
        steps,
        "steady model",
        &values,
        &[],
        &[],
    ))];
    items.push(Item::from(c.report.identified.as_str()));
    if let Some(why) = &c.why_not {
        items.push(Item::from(format!("No real flight could be fetched: {why}. The flight compared here is simulated.").as_str()));
    }
    let title = if c.real { "A real flight against the steady model" } else { "A simulated flight against the steady model" };
    Section { title: title.to_owned(), lead: format!("{} steady samples; each step adds one thing.", c.report.samples), items }
}

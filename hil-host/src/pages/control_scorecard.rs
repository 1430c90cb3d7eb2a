//! The flight scorecard as a page: verdict first, then shares of (L/D)max, then where on the polar each law flew.

use crate::pages::{Axis, Chart, Heat, Item, Mark, Page, Provenance, Section, Series, Table};
use crate::score::control_law::{BIN_DEG, Band, Disturbance, Score};
use rig::flight::mission_file::wings_name;

const BANDS: [(Band, &str); 3] = [(Band::Shallow, "3–27 m"), (Band::Sea, "0–200 m"), (Band::Deep, "0–1000 m")];

/// Largest angle of attack shown, degrees: beyond it there are only launches and turns.
const SHOWN_DEG: f64 = 30.0;

/// The page of flights in pairs, ours first. `lost` pairs went to the ordinary controller.
#[must_use]
pub fn page(pairs: &[(&Score, &Score)], lost: usize, not_flown: usize, farthest_m: f64, seed: u64) -> Page {
    let verdict = format!(
        "{} of {} pairs at least as good as the ordinary controller, {not_flown} not flown, farthest {farthest_m:.2} m beyond the depth band",
        pairs.len() - lost,
        pairs.len()
    );
    let worst = pairs.iter().min_by(|a, b| (a.0.share_of_max - a.1.share_of_max).total_cmp(&(b.0.share_of_max - b.1.share_of_max)));
    let mut answer = vec![("Verdict".to_owned(), verdict)];
    if let Some((ours, stock)) = worst {
        answer.push((
            "Where".to_owned(),
            format!(
                "smallest lead: {} wings, {}, {}: {:.3} against {:.3} of (L/D)max",
                wings_name(ours.case.wings),
                band(ours.case.band),
                ours.case.disturbance.name(),
                ours.share_of_max,
                stock.share_of_max
            ),
        ));
    }
    Page {
        title: "Our control law beside the ordinary one".into(),
        answer,
        sections: vec![shares(pairs), histograms(pairs), figures(pairs)],
        provenance: Provenance { seed: Some(seed), ..Provenance::of_this_run() },
    }
}

fn band(wanted: Band) -> &'static str {
    BANDS.iter().find(|b| b.0 == wanted).map_or("", |b| b.1)
}

fn shares(pairs: &[(&Score, &Score)]) -> Section {
    let mut keys: Vec<(String, String)> = Vec::new();
    for (ours, _) in pairs {
        let key = (ours.case.disturbance.name(), wings_name(ours.case.wings).to_owned());
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    let mut heat = Heat {
        caption: "Share of (L/D)max, ours (ordinary controller)".into(),
        head: ["disturbance", "wings"].into_iter().chain(BANDS.map(|b| b.1)).map(str::to_owned).collect(),
        ..Heat::default()
    };
    for (disturbance, wings) in keys {
        let cell = |wanted: Band| {
            let found = pairs
                .iter()
                .find(|(o, _)| o.case.band == wanted && o.case.disturbance.name() == disturbance && wings_name(o.case.wings) == wings);
            found.map_or((String::new(), f64::NAN), |(o, s)| {
                let behind = if o.share_of_max < s.share_of_max { " ✗" } else { "" };
                let shade = if behind.is_empty() { (1.0 - o.share_of_max).max(0.0) } else { -1.0 };
                (format!("{:.3} ({:.3}){behind}", o.share_of_max, s.share_of_max), shade)
            })
        };
        let cells = BANDS.map(|b| cell(b.0));
        heat.shade.push([f64::NAN, f64::NAN].into_iter().chain(cells.iter().map(|c| c.1)).collect());
        heat.rows.push([disturbance, wings].into_iter().chain(cells.into_iter().map(|c| c.0)).collect());
    }
    Section {
        title: "How near the best glide".into(),
        lead: "Achieved L/D through the water over the true vehicle's (L/D)max. Stronger shade: farther from it; ✗ and red: behind the ordinary controller.".into(),
        items: vec![heat.into()],
    }
}

/// Time at each angle of attack in calm water (the paper's figure 11).
fn histograms(pairs: &[(&Score, &Score)]) -> Section {
    let mut items: Vec<Item> = Vec::new();
    for (ours, stock) in pairs.iter().filter(|(o, _)| o.case.disturbance == Disturbance::Calm) {
        let title = format!(
            "{} wings, {}: best at {:.1}°; within 2° of it {:.0} % of the time (ordinary {:.0} %)",
            wings_name(ours.case.wings),
            band(ours.case.band),
            ours.best_alpha_rad.to_degrees(),
            100.0 * ours.share_near_best,
            100.0 * stock.share_near_best
        );
        let series = |name: &str, s: &Score| {
            let shown = s.alpha_histogram.len().min((SHOWN_DEG / BIN_DEG) as usize);
            let centres: Vec<f64> = (0..shown).map(|i| (i as f64 + 0.5) * BIN_DEG).collect();
            let percent: Vec<f64> = s.alpha_histogram.iter().take(shown).map(|share| 100.0 * share).collect();
            Series::new(name, &centres, &percent)
        };
        let chart = Chart::new(&title, Mark::Line, Axis::new("angle of attack", "deg"), Axis::new("share of time", "%"));
        items.push(chart.with(series("ours", ours)).with(series("ordinary controller", stock)).into());
    }
    Section {
        title: "Where on the polar".into(),
        lead:
            "Share of the time at each angle of attack in calm water: the nearer the peak to the best angle, the farther a charge carries."
                .into(),
        items,
    }
}

fn figures(pairs: &[(&Score, &Score)]) -> Section {
    let head = ["band", "disturbance", "wings", "L/D over ground", "near best α", "cost, J/m", "beyond the band, m", "turn, s"];
    let rows = pairs
        .iter()
        .map(|(o, s)| {
            let two = |a: f64, b: f64, digits: usize| format!("{a:.digits$} ({b:.digits$})");
            vec![
                band(o.case.band).to_owned(),
                o.case.disturbance.name(),
                wings_name(o.case.wings).to_owned(),
                two(o.achieved_l_over_d, s.achieved_l_over_d, 2),
                two(o.share_near_best, s.share_near_best, 2),
                two(o.transport_j_m, s.transport_j_m, 1),
                two(o.overshoot_m.max(0.0), s.overshoot_m.max(0.0), 2),
                two(o.inflection_s, s.inflection_s, 0),
            ]
        })
        .collect();
    let table = Table { caption: "Every pair, ours (ordinary controller)".into(), head: head.map(str::to_owned).to_vec(), rows };
    Section { title: "All figures".into(), lead: "The same pump volume and depth band for both.".into(), items: vec![table.into()] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::control_law::{cases, fly_all};
    use signals::Wings;

    #[test]
    fn the_page_says_who_flew_nearer_the_best_glide_and_where_on_the_polar() {
        let scores = fly_all(&cases(&[Wings::Standard], &[Band::Shallow], &[Disturbance::Calm], 1), || ()).expect("flown");
        let [ours, stock] = scores.as_slice() else { panic!("a pair") };
        let p = page(&[(ours, stock)], 0, 0, 0.1, 1);
        assert!(p.answer[0].1.starts_with("1 of 1 pairs at least as good"), "{:?}", p.answer);
        let html = p.to_html();
        let share = format!("{:.3} ({:.3})", ours.share_of_max, stock.share_of_max);
        assert!(html.contains(&share) && html.contains("within 2° of it"), "{share}");
        // The other way round the pair is one that we lose, and the page says so.
        let lost = page(&[(stock, ours)], 1, 0, 0.1, 1);
        assert!(lost.answer[0].1.starts_with("0 of 1 pairs") && lost.to_html().contains('✗'));
    }
}

//! The discovery scorecard as a page: verdict first, then shares by size, then what was said of every hidden effect.

use crate::pages::{Heat, Item, Page, Provenance, Section, Table};
use serde_json::Value;

/// The page of a scorecard document ([`crate::score::diagnosis::summary`] with its `list`).
#[must_use]
pub fn page(card: &Value, seed: u64) -> Page {
    let answer = vec![
        ("Verdict".to_owned(), format!("clean flights called adequate: {}", share(&card["clean"]["adequate"]))),
        (
            "Where".to_owned(),
            format!(
                "strong single effects named first: {}, strong pairs: {}, strong effects outside the catalogue called unexplained: {}",
                share(&card["singles"]["strong"]["exact"]),
                share(&card["pairs"]["strong"]["exact"]),
                share(&card["off"]["strong"])
            ),
        ),
        (
            "Figures".to_owned(),
            format!(
                "90 % intervals contain the truth in {}; error after over that of the known-truth refit {} (median); {} s per case",
                share(&serde_json::json!({"share": card["intervals"]["coverage"], "of": card["intervals"]["of"]})),
                number(&card["error_after_over_known_truth_median"], 3),
                number(&card["wall_s_per_case_median"], 1)
            ),
        ),
    ];
    let sizes = by_size(card);
    let provenance = Provenance { seed: Some(seed), ..Provenance::of_this_run() };
    let sections = vec![
        Section {
            title: "How well, by size".into(),
            lead: "Weak, medium and strong effects leave about 1.5, 3 and 6 noise floors of error when nothing is added. What can be told: a density bias and a ballast offset are one force, a pitch offset is nearly an angle of zero lift, a stall with hysteresis nearly a plain one; where nature's own law prefers the truth to such a twin by less than ten to one, nobody can tell.".into(),
            items: vec![Item::Table(sizes)],
        },
        Section {
            title: "What was said of what".into(),
            lead: "Every hidden effect with the answers it got; some have no name in the catalogue and are to stay unexplained."
                .into(),
            items: vec![Item::Heat(confusion(card))],
        },
    ];
    Page { title: "Hidden effects in sealed flights, and what was said".into(), answer, sections, provenance }
}

fn share(v: &Value) -> String {
    v["share"].as_f64().map_or_else(|| "–".to_owned(), |s| format!("{:.0} % of {}", 100.0 * s, v["of"]))
}

fn number(v: &Value, digits: usize) -> String {
    v.as_f64().map_or_else(|| "–".to_owned(), |x| format!("{x:.digits$}"))
}

/// How well hidden effects are named, by their size.
fn by_size(card: &Value) -> Table {
    let mut sizes = Table {
        caption: "Hidden effects by size: first answer exact, in a class of at most three, at least one named".into(),
        head: [
            "hidden",
            "size",
            "exact",
            "exact where it can be told",
            "in class",
            "one named",
            "error after / noise floor",
            "nominal / noise floor",
        ]
        .map(str::to_owned)
        .into(),
        ..Table::default()
    };
    for kind in ["singles", "pairs"] {
        for size in ["weak", "medium", "strong"] {
            let s = &card[kind][size];
            sizes.rows.push(vec![
                kind.to_owned(),
                size.to_owned(),
                share(&s["exact"]),
                share(&s["exact_where_it_can_be_told"]),
                share(&s["in_class"]),
                share(&s["at_least_one"]),
                number(&s["error_after_over_floor_median"], 2),
                number(&s["nominal_over_floor_median"], 2),
            ]);
        }
    }
    for size in ["medium", "strong"] {
        let dash = || "–".to_owned();
        let [all, where_distinct] = [&card["off"][size], &card["off"][format!("{size}_where_it_can_be_told")]].map(share);
        sizes.rows.push(vec![
            "outside the catalogue (unexplained)".into(),
            size.into(),
            all,
            where_distinct,
            dash(),
            dash(),
            dash(),
            dash(),
        ]);
    }
    sizes
}

/// One row per hidden set, answers with their counts; shaded by the share that is wrong, marked and red where none is right.
fn confusion(card: &Value) -> Heat {
    let mut heat = Heat {
        caption: "Answers by what was hidden (count); shaded: some are not the hidden set itself; ✗ and red: none is".into(),
        head: ["hidden", "answers"].map(str::to_owned).into(),
        ..Heat::default()
    };
    for (truth, said) in card["confusion"].as_object().into_iter().flatten() {
        let said: Vec<(&String, u64)> = said.as_object().into_iter().flatten().filter_map(|(k, n)| Some((k, n.as_u64()?))).collect();
        let wanted = match truth.as_str() {
            "(nothing)" => "(adequate)",
            t if t.starts_with("off:") => "(unexplained)",
            t => t.rsplit_once(' ').map_or(t, |(name, _)| name),
        };
        let right: u64 = said.iter().filter(|(k, _)| *k == wanted).map(|(_, n)| n).sum();
        let all: u64 = said.iter().map(|(_, n)| n).sum();
        let answers = said.iter().map(|(k, n)| format!("{k} ({n})")).collect::<Vec<_>>().join(", ");
        let (mark, shade) = match right {
            0 => (" ✗", -1.0),
            n if n == all => ("", f64::NAN),
            n => ("", 1.0 - n as f64 / all as f64),
        };
        heat.rows.push(vec![truth.clone(), answers + mark]);
        heat.shade.push(vec![f64::NAN, shade]);
    }
    heat
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_leads_with_the_clean_flights_and_marks_what_was_never_named() {
        let card = serde_json::json!({
            "clean": {"adequate": {"share": 0.975, "of": 40}},
            "confusion": {"stall weak": {"(unexplained)": 1}, "(nothing)": {"(adequate)": 39, "stall": 1}, "off:leak strong": {"(unexplained)": 2}},
        });
        let page = page(&card, 7);
        assert!(page.answer[0].1.contains("98 % of 40"), "{}", page.answer[0].1);
        let heat = confusion(&card);
        let shade = |name: &str| heat.shade[heat.rows.iter().position(|r| r[0] == name).expect("a row")][1];
        assert!(shade("stall weak") < 0.0 && (shade("(nothing)") - 0.025).abs() < 1e-12 && shade("off:leak strong").is_nan());
        assert!(heat.rows.iter().all(|r| r[1].ends_with(" ✗") == (r[0] == "stall weak")), "{:?}", heat.rows);
        assert!(page.to_html().contains("Hidden effects in sealed flights"));
    }
}

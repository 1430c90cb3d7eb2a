//! The scorecard of real flights as a page.

use crate::pages::{Heat, Item, Page, Provenance, Section, Table};
use serde_json::Value;

/// The page of a scorecard document ([`crate::score::real::document`]).
#[must_use]
pub fn page(card: &Value) -> Page {
    let sections = vec![
        Section {
            title: "Flights".into(),
            lead: "Development flights may be looked at while the tool is made; judging flights must not set a threshold.".into(),
            items: vec![Item::Table(flights(card))],
        },
        Section {
            title: "Lies".into(),
            lead: "One thing changed in the calibrated vehicle file or in the log. Scored where the expected size, with calibration and model discrepancy marginalised, is large enough.".into(),
            items: vec![Item::Heat(injected_errors(card))],
        },
    ];
    Page {
        title: "Real flights with a known injected error, and what was said".into(),
        answer: answer(&card["all"]),
        sections,
        provenance: Provenance::of_this_run(),
    }
}

fn share(v: &Value) -> String {
    v["share"].as_f64().map_or_else(|| "–".to_owned(), |s| format!("{:.0} % of {}", 100.0 * s, v["of"]))
}

fn number(v: &Value, digits: usize) -> String {
    v.as_f64().map_or_else(|| "–".to_owned(), |x| format!("{x:.digits$}"))
}

/// Every injected error on every flight, in order.
fn list(card: &Value) -> impl Iterator<Item = &Value> {
    card["list"].as_array().into_iter().flatten()
}

fn answer(all: &Value) -> Vec<(String, String)> {
    vec![
        (
            "Verdict".to_owned(),
            format!("injected errors named in class: {}; quiet where nothing is missing: {}", share(&all["named"]), share(&all["quiet"])),
        ),
        (
            "Figures".to_owned(),
            format!(
                "exact {}, sensor findings {}, intervals hold the truth {}; {} CPU s per diagnosis (median), {} at most",
                share(&all["exact"]),
                share(&all["found"]),
                share(&all["interval"]),
                number(&all["cpu_s"]["median"], 1),
                number(&all["cpu_s"]["largest"], 1)
            ),
        ),
    ]
}

fn flights(card: &Value) -> Table {
    let mut table = Table {
        caption: "Flights, with the model discrepancy that is allowed for under their calibrated file".into(),
        head: ["flight", "split", "rows", "calibrated on", "discrepancy, cm/s", "named", "quiet"].map(str::to_owned).into(),
        ..Table::default()
    };
    for f in card["flights"].as_array().into_iter().flatten() {
        let of = |effects: bool| {
            let asked: Vec<&Value> = list(card)
                .filter(|s| s["flight"] == f["name"] && s["expected_sigma"].is_number() == effects && s["scored"] == true)
                .collect();
            format!("{} of {}", asked.iter().filter(|s| s["right"] == true).count(), asked.len())
        };
        table.rows.push(vec![
            f["name"].as_str().unwrap_or("").into(),
            f["split"].as_str().unwrap_or("").into(),
            f["rows"].to_string(),
            f["calibrated_on"].as_str().unwrap_or("itself").into(),
            number(&f["discrepancy_cm_s"], 2),
            of(true),
            of(false),
        ]);
    }
    table
}

fn injected_errors(card: &Value) -> Heat {
    let mut heat = Heat {
        caption: "What was said of each injected error; ✗ and red: not what it should be; pale: the flight cannot show it, not scored"
            .into(),
        head: ["flight", "error", "expected σ", "said", "recalibrated → best, cm/s", "CPU s"].map(str::to_owned).into(),
        ..Heat::default()
    };
    for s in list(card) {
        let names = |v: &Value| v.as_array().into_iter().flatten().filter_map(Value::as_str).collect::<Vec<_>>().join(" + ");
        let said = format!("{} {}", s["verdict"].as_str().unwrap_or(""), names(&s["answer"]));
        let wrong = s["scored"] == true && s["right"] != true;
        heat.rows.push(vec![
            s["flight"].as_str().unwrap_or("").into(),
            s["lie"].as_str().unwrap_or("").into(),
            number(&s["expected_sigma"], 1),
            format!("{}{}", said.trim(), if wrong { " ✗" } else { "" }),
            format!("{} → {}", number(&s["error_cm_s"]["recalibrated"], 2), number(&s["error_cm_s"]["best"], 2)),
            number(&s["cpu_s"], 1),
        ]);
        let shade = if wrong {
            -1.0
        } else if s["scored"] == true {
            f64::NAN
        } else {
            0.1
        };
        heat.shade.push(vec![f64::NAN, f64::NAN, f64::NAN, shade, f64::NAN, f64::NAN]);
    }
    heat
}

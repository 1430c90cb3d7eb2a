//! The rows of the README: what the commands printed with `--json` into a folder, one line each.
//!
//! ```text
//! measured-rows FOLDER README.md     flight.json, real.json, discovery.json and healthy.json of FOLDER, and benches' own figures
//! ```
//! A row whose command was not run keeps its figure. `scripts/measure` runs them all.

use anyhow::{Context as _, bail};
use benches::figures;
use serde_json::Value;
use std::path::Path;

/// Lines of the README between which the table stands.
const MARKERS: (&str, &str) = ("<!-- measured: made by `scripts/measure` -->", "<!-- measured: end -->");

/// 65264 is 65,264.
fn whole(x: f64) -> String {
    let digits = format!("{x:.0}");
    let groups: Vec<String> = digits.as_bytes().rchunks(3).rev().map(|g| String::from_utf8_lossy(g).into_owned()).collect();
    groups.join(",")
}

/// The mean share of ours and of stock in calm water with the built-in table: standard / rail wings.
fn shares(card: &Value, band: &str) -> Option<String> {
    let of = |pilot: &str, wings: &str| {
        let flights = card["flights"].as_array()?;
        let is = |f: &&Value| {
            let c = &f["case"];
            c["band"] == band
                && c["pilot"] == pilot
                && c["disturbance"] == "built_in_table"
                && c["wings"].as_str().is_some_and(|w| w.starts_with(wings))
        };
        flights.iter().find(is)?["share_of_max"].as_f64()
    };
    let pair = |pilot: &str| Some(format!("{:.2} / {:.2}", of(pilot, "Standard")?, of(pilot, "Low")?));
    Some(format!("{} (stock {})", pair("ours")?, pair("stock")?))
}

fn image() -> Option<String> {
    let f = figures().ok()?;
    let of = |key: &str| f.get(&format!("flown.{key}")).map(|v| v.value);
    Some(format!(
        "{} B flash, {} B RAM with the proven worst stack, no panic, no heap; {} instructions mean, {} worst",
        whole(of("flash")?),
        whole(of("statics")? + of("stack")?),
        whole(of("cycle_mean")?),
        whole(of("cycle_worst")?)
    ))
}

fn fit() -> Option<String> {
    let f = figures().ok()?;
    let (ours, theirs) = (f.get("fit.ours")?.value, f.get("fit.dynamic")?.value);
    Some(format!("{:.0} ms; the best open tool {:.2} min", 1e3 * ours, theirs / 60.0))
}

/// How many of how many in all sizes of a kind, as "25 of 27".
fn counted(kind: &Value, at: impl Fn(&Value) -> &Value) -> Option<String> {
    let (mut right, mut all) = (0.0, 0.0);
    for size in ["weak", "medium", "strong"] {
        let one = at(&kind[size]);
        let Some(of) = one["of"].as_f64() else { continue }; // a kind need not have every size
        right += one["share"].as_f64().unwrap_or(0.0) * of; // none of none has no share
        all += of;
    }
    Some(format!("{right:.0} of {all:.0}"))
}

fn discovery(card: &Value) -> Option<String> {
    let clean = &card["clean"]["adequate"];
    let of = clean["of"].as_f64()?;
    Some(format!(
        "clean {:.0} of {of:.0} adequate; one hidden {}, two {} named exactly; outside the catalogue {} unexplained",
        clean["share"].as_f64()? * of,
        counted(&card["singles"], |s| &s["exact"])?,
        counted(&card["pairs"], |s| &s["exact"])?,
        counted(&card["off"], |s| s)?
    ))
}

fn healthy(card: &Value) -> Option<String> {
    let (missions, cut) = (card["missions"].as_f64()?, card["not_flown_to_the_end"].as_f64()?);
    let how = if cut == 0.0 { "all flown whole: no false abort".to_owned() } else { format!("{} not flown to the end", whole(cut)) };
    Some(format!("{}, {how}", whole(missions)))
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, readme] = arguments.as_slice() else { bail!("measured-rows FOLDER README.md") };
    let card = |name: &str| -> Option<Value> {
        let text = std::fs::read_to_string(Path::new(folder).join(format!("{name}.json"))).ok()?;
        serde_json::from_str(&text).ok()
    };
    let flight = card("flight").and_then(|c| Some(format!("3–27 m: {}; 0–200 m: {}", shares(&c, "shallow")?, shares(&c, "sea")?)));
    let real = card("real").and_then(|c| c["line"].as_str().map(str::to_owned));
    let now = [
        ("flight image", image()),
        ("share of (L/D)max", flight),
        ("real flights", real),
        ("hidden effects", card("discovery").and_then(|c| discovery(&c))),
        ("healthy random missions", card("healthy").and_then(|c| healthy(&c))),
        ("dynamic fit", fit()),
    ];
    let before = std::fs::read_to_string(readme).with_context(|| readme.clone())?;
    let (head, rest) = before.split_once(MARKERS.0).with_context(|| format!("{readme}: has no line `{}`", MARKERS.0))?;
    let (table, tail) = rest.split_once(MARKERS.1).with_context(|| format!("{readme}: has no line `{}`", MARKERS.1))?;
    let mut out = String::new();
    for line in table.lines() {
        let figure = now.iter().find(|(what, _)| line.starts_with(&format!("| {what}"))).and_then(|(_, figure)| figure.as_ref());
        let mut cells: Vec<String> = line.split(" | ").map(str::to_owned).collect();
        if let (Some(figure), [_, old, _]) = (figure, cells.as_mut_slice()) {
            figure.clone_into(old);
        }
        out += &(cells.join(" | ") + "\n");
    }
    for (what, figure) in &now {
        println!("{what}: {}", figure.as_deref().unwrap_or("not measured, kept"));
    }
    std::fs::write(readme, format!("{head}{}{}{}{tail}", MARKERS.0, out.trim_end_matches('\n').to_owned() + "\n\n", MARKERS.1))
        .with_context(|| readme.clone())
}

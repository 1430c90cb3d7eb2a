//! Diagnoses every flight directory of a folder that has its truth in `truth/`, one JSON line each; for development.
//! Usage: probe FOLDER [FILTER] [PART/OF]
use discovery::{diagnose, read, vehicle};
use serde_json::json;
use std::path::PathBuf;

fn main() {
    let mut args = std::env::args().skip(1);
    let folder = PathBuf::from(args.next().expect("folder"));
    let filter = args.next().unwrap_or_default();
    let part = args.next().unwrap_or("0/1".into());
    let (part, of) = part.split_once('/').map_or((0, 1), |(a, b)| (a.parse().unwrap_or(0), b.parse().unwrap_or(1)));
    let mut cases: Vec<PathBuf> = std::fs::read_dir(&folder)
        .expect("folder")
        .filter_map(|e| e.ok().map(|e| e.path()))
        .filter(|p| p.join("flight.csv").is_file())
        .collect();
    cases.sort();
    for (i, case) in cases.into_iter().enumerate() {
        let name = case.file_name().expect("name").to_string_lossy().to_string();
        let text = std::fs::read_to_string(folder.join("truth").join(format!("{name}.json"))).expect("truth");
        if i % of != part || !(text.contains(&filter) || name.contains(&filter)) {
            continue;
        }
        let truth: serde_json::Value = serde_json::from_str(&text).expect("json");
        let v = vehicle::read(&case.join("vehicle.json")).expect("vehicle");
        let f = read::flight(&case).expect("flight");
        let t0 = std::time::Instant::now();
        let d = diagnose::diagnose(&f, &v, &|_, _| {}).expect("diagnosis");
        let c: Vec<_> = d.candidates.iter().take(12).map(|c| json!({"e": c.effects, "o": c.log_odds, "g": c.gain, "p": c.parameters.iter().map(|p| json!([p.name, p.value, p.low, p.high])).collect::<Vec<_>>(), "ec": c.error_check_m_s})).collect();
        println!(
            "{}",
            json!({"case": name, "site": v.site, "wing": v.document["wing"]["name"], "truth": truth, "verdict": d.verdict.name(), "answer": d.answer, "eq": d.equivalent, "c": c,
            "r": d.remainder.iter().take(3).map(|f| json!([f.variable, f.log_bayes, f.scale_m_s, f.period_s])).collect::<Vec<_>>(), "rows": d.rows, "ms": d.misfit, "brink": d.brink, "colour": d.colour,
            "err": d.block_error_m_s, "z": d.recalibrated.calibration, "t": t0.elapsed().as_secs_f64()})
        );
    }
}

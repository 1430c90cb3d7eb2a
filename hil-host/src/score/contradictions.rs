//! Whether a diagnosis contradicts itself: a sentence that a number of the same document denies.

use serde_json::Value;

/// What contradicts what in a document of `glider diagnose --json`; nothing in that of a diagnosis that failed.
#[must_use]
pub fn contradictions(d: &Value) -> Vec<String> {
    if d["verdict"].is_null() {
        return Vec::new();
    }
    let number = |v: &Value| v.as_f64().unwrap_or(f64::NAN);
    let text = |key: &str| d[key].as_str().unwrap_or_default();
    let list = |key: &str| d[key].as_array().cloned().unwrap_or_default();
    let (verdict, says) = (text("verdict"), text("explanation"));
    let mut out = Vec::new();
    let mut must = |holds: bool, what: String| {
        if !holds {
            out.push(what);
        }
    };
    let names: Vec<&str> = d["answer"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    must(names.is_empty() == matches!(verdict, "adequate" | "unexplained"), format!("{verdict} with the answer {names:?}"));
    must(
        verdict != "ambiguous" || list("equivalent").len() > 1 || !list("reasons").is_empty() || d["history"]["decides"] == true,
        "ambiguous between nothing".into(),
    );
    for n in list("moved") {
        let ordered = number(&n["low"]) <= number(&n["here"]) && number(&n["here"]) <= number(&n["high"]);
        must(ordered || n["low"].is_null(), format!("an interval without its value: {n}"));
        // What the fit pressed against the end of what is possible has no interval.
        let [width, shift] = [number(&n["high"]) - number(&n["low"]), number(&n["here"]) - number(&n["file"])];
        must(n["low"].is_null() || shift == 0.0 || width > 1e-5 * shift.abs(), format!("an interval of no width: {n}"));
        // What left its interval is said wherever the fits speak.
        let outside = number(&n["file"]) < number(&n["low"]) || number(&n["file"]) > number(&n["high"]);
        let said = says.contains(n["name"].as_str().unwrap_or("?")) || says.contains(" more");
        must(!outside || said || !says.contains("Moved: "), format!("moved and not said: {n}"));
    }
    for h in list("could_hide") {
        must(!names.contains(&h["effect"].as_str().unwrap_or("")), format!("named, and could hide: {h}"));
        must(h["up_to"].is_null() || number(&h["up_to"]) > 0.0, format!("a size that is none: {h}"));
    }
    let worth = &d["worth"];
    let ordered = 0.0 <= number(&worth["low"])
        && number(&worth["low"]) <= number(&worth["range_gain"])
        && number(&worth["range_gain"]) <= number(&worth["high"]);
    must(worth.is_null() || ordered, format!("{worth}"));
    // Errors in words are those of the document; what rises is not said to fall.
    let [before, recalibrated, best] = ["baseline", "recalibrated", "best"].map(|k| number(&d["error"][k]));
    must(!says.contains("falls from") || (best <= before && best <= recalibrated), format!("an error that rises is said to fall: {says}"));
    must(
        !says.contains("instead of") || says.contains(&format!("{recalibrated:.2} cm/s instead of {before:.2}")),
        format!("other errors than {}: {says}", d["error"]),
    );
    let leads = number(&d["probability_nothing_missing"]) < 0.1;
    must(
        !(verdict == "adequate" && leads && d["history"]["decides"] != true) || says.contains(" leads by "),
        format!("adequate, and nothing is improbable: {says}"),
    );
    out
}

#[test]
fn a_contradiction_is_found() {
    let d = serde_json::json!({
        "verdict": "adequate", "answer": [], "error": {"baseline": 1.0, "recalibrated": 0.5, "best": 0.5}, "probability_nothing_missing": 1e-9,
        "explanation": "the depth-rate error is 0.60 cm/s instead of 1.00 cm/s. Moved: nothing.",
        "moved": [{"name": "cd0", "file": 0.1, "low": 0.2, "here": 0.25, "high": 0.3},
            {"name": "pitch_zero", "file": 0.9, "low": 0.499_999_9, "here": 0.5, "high": 0.500_000_1}], "worth": null,
    });
    assert_eq!(contradictions(&d).len(), 5, "{:?}", contradictions(&d));
}

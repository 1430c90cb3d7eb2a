//! A diagnosis as JSON (the contract) and as words.

use crate::criticism::law::{self, Law};
use crate::criticism::localise::{Finding, rank, residuals};
use crate::diagnosis::verdict::unknown_in_words;
use crate::diagnosis::{Diagnosis, Ranked, Reason, Verdict};
use crate::history::flight::Said;
use crate::inference::estimate::Estimate;
use crate::likelihood::block_error::blocks;
use crate::model::parameters::State;
use logs::vehicle::Vehicle;
use logs::vehicle::catalogue::by_name;
use serde_json::{Value, json};

/// A number for JSON: null where there is none, no more digits than mean something.
#[must_use]
pub fn number(v: f64) -> Value {
    if !v.is_finite() {
        return Value::Null;
    }
    if v == 0.0 {
        return json!(0.0);
    }
    let digits = 5 - v.abs().log10().floor() as i32;
    let scale = 10_f64.powi(digits.clamp(-12, 15));
    json!((v * scale).round() / scale)
}

/// Where a state fails, over all segments.
#[must_use]
pub fn where_it_fails(diagnosis: &Diagnosis, vehicle: &Vehicle, state: &State) -> Vec<Finding> {
    let mut all = Vec::new();
    for run in &diagnosis.prepared.runs {
        let track = diagnosis.branch.track(run, vehicle, state);
        all.extend(residuals(run, &blocks(run), &track));
    }
    rank(&all)
}

/// Findings as the `where` list.
#[must_use]
pub fn findings(list: &[Finding]) -> Value {
    list.iter()
        .map(|f| {
            json!({
                "variable": f.variable,
                "range": [number(f.range.0), number(f.range.1)],
                "unit": f.unit,
                "share_of_error": number(f.share_of_error),
                "phase": f.phase,
                "mean_residual_cm_s": number(f.mean_m_s * 100.0),
                "p_value": number(f.p_value),
            })
        })
        .collect()
}

fn parameters(c: &Ranked) -> Value {
    c.parameters
        .iter()
        .map(|p| (p.name.clone(), json!({"value": number(p.value), "low": number(p.low), "high": number(p.high), "unit": p.unit})))
        .collect::<serde_json::Map<String, Value>>()
        .into()
}

fn candidate(c: &Ranked) -> Value {
    json!({
        "effects": c.effects,
        "parameters": parameters(c),
        "error_after": number(c.error_fitted_m_s * 100.0),
        "error_after_heldout": number(c.error_check_m_s * 100.0),
        "probability": number(c.probability),
        "evidence": format!("log odds {:+.1} against nothing missing, chi2 falls by {:.1}", c.log_odds, c.gain),
    })
}

/// The whole report.
#[must_use]
pub fn document(d: &Diagnosis, vehicle: &Vehicle, flight: &str) -> Value {
    let heldout = d.block_error_m_s[0].is_finite();
    let [nominal, recalibrated, after] = if heldout { d.block_error_m_s } else { d.fitted_error_m_s };
    let mut out = json!({
        "flight": flight,
        "vehicle": vehicle.path.display().to_string(),
        "tool": env!("CARGO_PKG_VERSION"),
        "verdict": d.verdict.name(),
        "error": {
            "metric": format!("{:.0} s block depth-rate rms, {} segments", d.block_s, if heldout { "check" } else { "fitted" }),
            "unit": "cm/s",
            "baseline": number(nominal * 100.0),
            "recalibrated": number(recalibrated * 100.0),
            "best": number(after * 100.0),
            "noise_floor": number(d.noise_floor_m_s * 100.0),
        },
        "answer": d.answer,
        "equivalent": d.equivalent,
        "candidates": d.candidates.iter().map(candidate).collect::<Vec<_>>(),
        "probability_nothing_missing": number(d.probability_nothing),
        "where": findings(&where_it_fails(d, vehicle, &d.recalibrated)),
        "remainder": d.remainder.iter().take(5).map(|f| json!({
            "variable": f.variable, "log_bayes": number(f.log_bayes), "amplitude_cm_s": f.scale_m_s.map_or(Value::Null, |s| number(s * 100.0)),
            "period_s": f.period_s.map_or(Value::Null, number),
        })).collect::<Vec<_>>(),
        "laws": d.laws.iter().map(Law::document).collect::<Vec<_>>(),
        "discrepancy_cm_s": number(d.discrepancy_m_s * 100.0),
        "remains": d.remains.iter().map(|r| json!({
            "variable": r.variable, "phase": r.phase, "size_cm_s": number(r.size_m_s * 100.0),
        })).collect::<Vec<_>>(),
        "sensor_findings": d.sensors.iter().map(|s| json!({
            "name": s.name, "what": s.what, "value": number(s.value), "low": number(s.low), "high": number(s.high), "unit": s.unit,
        })).collect::<Vec<_>>(),
        "reasons": d.reasons.iter().map(|r| json!({ "reason": r.code(), "text": r.text() })).collect::<Vec<_>>(),
        "explanation": explanation(d),
        "next_flight": next_flight(d),
        "in_words": four_parts(d).into_iter().map(|(part, text)| (part.to_lowercase().replace(' ', "_"), text.into()))
            .collect::<serde_json::Map<String, Value>>(),
        "notes": d.notes,
        "check_segments": d.check,
        "history": d.history.as_ref().map(Said::document),
    });
    if let (Some(document), Value::Object(parts)) = (out.as_object_mut(), d.parts.document()) {
        document.extend(parts);
    }
    if heldout {
        out["block_error_m_s"] = json!({"nominal": number(nominal), "recalibrated": number(recalibrated), "after": number(after)});
    }
    out
}

/// One paragraph for a person: the verdict, what moved, what could hide.
#[must_use]
pub fn explanation(d: &Diagnosis) -> String {
    let moved = || format!("{} Moved: {}.", verdict_in_words(d), d.parts.moved_in_words());
    let hides = d.parts.hidden_in_words();
    format!("{}{} Could hide: {hides}.", d.answered_by().map_or_else(moved, Said::words), in_any_case(d))
}

/// The four parts of the answer, each with its heading: what moved, what is missing, what could hide, what next and its worth.
#[must_use]
pub fn four_parts(d: &Diagnosis) -> [(&'static str, String); 4] {
    let moved = d.answered_by().map_or_else(|| d.parts.moved_in_words(), Said::moved_in_words);
    let missing = d.answered_by().map_or_else(|| verdict_in_words(d), Said::words) + &in_any_case(d);
    [("What moved", moved), ("What is missing", missing), ("What could hide", d.parts.hidden_in_words()), ("What next", next_flight(d))]
}

/// A value with its interval: angles in degrees, as many digits as the interval deserves.
pub(super) fn in_words(value: f64, low: f64, high: f64, unit: &str) -> String {
    let (factor, unit) = match unit {
        "rad" => (180.0 / std::f64::consts::PI, "deg"),
        "1" => (1.0, ""),
        other => (1.0, other),
    };
    let [value, low, high] = [value, low, high].map(|v| v * factor);
    let width = 0.5 * (high - low);
    if width < 1e-5 && value.abs() < 1e-3 {
        return format!("{value:.2e} ({low:.2e} to {high:.2e}) {unit}").trim_end().to_owned();
    }
    // Two digits of half the interval.
    let digits = if width > 0.0 { (1.0 - width.log10().floor()).clamp(0.0, 9.0) as usize } else { 3 };
    format!("{value:.digits$} ({low:.digits$} to {high:.digits$}) {unit}").trim_end().to_owned()
}

/// A parameter by its name.
fn parameter_in_words(p: &Estimate) -> String {
    let name = p.name.strip_suffix("_rad").unwrap_or(&p.name);
    format!("{name} = {}", in_words(p.value, p.low, p.high, p.unit))
}

/// What is said with any verdict: the model's own discrepancy and the sensors that are off.
fn in_any_case(d: &Diagnosis) -> String {
    let mut out = String::new();
    if d.discrepancy_m_s > 0.0 {
        let follows: Vec<String> =
            d.remains.iter().take(3).map(|r| format!("{:.2} cm/s by {} ({})", r.size_m_s * 100.0, r.variable, r.phase)).collect();
        out += &format!(" Whatever is named, the model stays off by about {:.2} cm/s: {}.", d.discrepancy_m_s * 100.0, follows.join(", "));
    }
    for s in &d.sensors {
        out += &format!(" Found: {} {}.", s.what, in_words(s.value, s.low, s.high, s.unit));
    }
    out
}

fn verdict_in_words(d: &Diagnosis) -> String {
    let [nominal, recalibrated, after] = if d.block_error_m_s[0].is_finite() { d.block_error_m_s } else { d.fitted_error_m_s };
    let cm = |v: f64| format!("{:.2} cm/s", v * 100.0);
    let floor = format!("ordinary water motion and sensors alone would leave {}", cm(d.noise_floor_m_s));
    match d.verdict {
        Verdict::Adequate => format!(
            "Nothing is missing that this flight could show: with the calibration refitted the depth-rate error is {} instead of {}, and {floor}.{}",
            cm(recalibrated),
            cm(nominal),
            too_small(d)
        ),
        Verdict::Unexplained => {
            let f = d.remainder.first();
            let what = f.map_or_else(String::new, |f| {
                let period = f.period_s.map_or_else(String::new, |p| {
                    let (value, unit) = if p < 300.0 { (p, "s") } else { (p / 60.0, "min") };
                    format!(" with a period of about {value:.0} {unit}")
                });
                let size = f.scale_m_s.map_or_else(String::new, |s| format!(", about {}", cm(s)));
                format!(" What is left follows the {}{period}{size}.", unknown_in_words(f.variable))
            });
            let best = d.candidates.first().filter(|c| c.log_odds > 0.0);
            let best = best.map_or_else(String::new, |c| format!(" Nearest known: {}, which is not enough.", c.effects.join(" with ")));
            let law = if d.laws.is_empty() { String::new() } else { format!(" As a law: {}.", law::in_words(&d.laws)) };
            let why: Vec<String> = d.reasons.iter().map(Reason::text).collect();
            format!(
                "No known effect explains this flight: recalibrated, the model misses the depth rate by {}, and {floor}.{what}{law}{best} Why no name: {}.",
                cm(recalibrated),
                why.join("; ")
            )
        }
        Verdict::Explained | Verdict::Ambiguous => {
            let physics: Vec<String> =
                d.answer.iter().filter_map(|n| by_name(n).map(|e| format!("{}: {}", n.replace('_', " "), e.physics))).collect();
            let size: Vec<String> = d
                .candidates
                .iter()
                .find(|c| c.effects == d.answer)
                .map_or_else(Vec::new, |c| c.parameters.iter().map(parameter_in_words).collect());
            let mut rivals = if d.equivalent.len() > 1 {
                let names: Vec<String> = d.equivalent.iter().skip(1).map(|e| e.join(" with ")).collect();
                format!(" This flight cannot tell it from {}.", names.join(", nor from "))
            } else {
                String::new()
            };
            for why in d.reasons.iter().filter(|r| matches!(r, Reason::SizeMayBeNone { .. })) {
                rivals += &format!(" Not sure: {}.", why.text());
            }
            format!(
                "Missing: {}. {}. The depth-rate error {}; {floor}.{rivals}",
                physics.join("; and "),
                size.join(", "),
                change(nominal, recalibrated, after)
            )
        }
    }
}

/// A name that leads and is too little to be named, or several of which none leads by enough.
fn too_small(d: &Diagnosis) -> String {
    let why = d.reasons.iter().find(|r| matches!(r, Reason::TooSmall { .. })).map(Reason::text);
    let why = why.or_else(|| (d.probability_nothing < 0.1).then(|| "less than the ten to one that a name asks".into()));
    let first = d.candidates.iter().find(|c| !c.effects.is_empty());
    why.zip(first).map_or_else(String::new, |(why, c)| {
        format!(" Of the known effects {} leads by {:.1} log units: {why}.", c.effects.join(" with "), c.log_odds)
    })
}

/// How the depth-rate error changes, m/s, in words.
fn change(nominal: f64, recalibrated: f64, after: f64) -> String {
    let cm = |v: f64| format!("{:.2} cm/s", v * 100.0);
    let before = format!("{} (vehicle file as given) and {} (recalibrated)", cm(nominal), cm(recalibrated));
    // A few blocks kept out of a fit say little.
    if after <= nominal.min(recalibrated) {
        format!("falls from {before} to {}", cm(after))
    } else {
        format!("was {before} and is {} with it: the fit is better, this error is not; fly more before you rely on it", cm(after))
    }
}

/// What to fly next, and what the refitted polar is worth.
#[must_use]
pub fn next_flight(d: &Diagnosis) -> String {
    format!("{} Worth: {}.", mission_in_words(d), d.parts.worth_in_words())
}

fn mission_in_words(d: &Diagnosis) -> String {
    match d.verdict {
        Verdict::Adequate => {
            "None needed for this question; a flight at other pitches and drives would show more of what could hide (`glider next-flight` plans one, or says why not)."
                .into()
        }
        Verdict::Unexplained => {
            // Too few dives to keep one out of the fit: the cheapest that can be done about it.
            let more = if d.check.is_empty() {
                " Of this vehicle import four dives or more together, so that some can check the fit."
            } else {
                ""
            };
            format!("{}; then diagnose again.{more}", check_of(d.remainder.first().map_or("", |f| f.variable)))
        }
        Verdict::Explained | Verdict::Ambiguous => {
            let advice = d.answer.first().and_then(|n| by_name(n)).map_or("", |e| e.separated_by);
            format!("To be surer: {advice}. `glider next-flight` writes the mission.")
        }
    }
}

/// A check on deck or a mission that tells more of something that follows a variable.
fn check_of(variable: &str) -> &'static str {
    const CHECKS: [(&str, &str); 14] = [
        ("heading", "Swing the compass and level the pitch sensor, or fly legs on four headings at one pitch"),
        ("pitch", "Level the pitch sensor on a tilt table, or fly legs at three pitches with one ballast"),
        ("drag", "Look over hull and wings for what grew or caught there, or fly a leg at half the ballast"),
        ("trim", "Weigh the vehicle again (air, water, oil), or hold one depth for ten minutes and read the ballast"),
        ("temperature", "Compare the CTD with a second one, or dive twice through the thermocline at two pitches"),
        ("density", "Compare the CTD with a second one, or dive twice through the thermocline at two pitches"),
        ("ballast", "Calibrate the engine's reading on deck, or fly legs at two ballasts with one pitch"),
        ("turning point", "Fly longer legs: fewer turns in the same water"),
        ("leg", "Fly the same leg four times and see whether it repeats"),
        ("depth", "Compare the two pressure sensors over the whole depth, or fly to half the depth and to all of it"),
        ("roll", "Check the roll sensor and the battery's roll, or fly one leg straight and one in a turn to each side"),
        ("stratification", "Fly the same dive in mixed water"),
        ("period", "Log faster: something on board swings; look at pitch control and pump"),
        ("time", "Fly the same dive an hour later: water that moves does not repeat"),
    ];
    // The variable itself before what it acts through.
    let itself = variable.split(" (").next().unwrap_or(variable);
    let known = [itself, variable].iter().find_map(|of| CHECKS.iter().find(|(word, _)| of.contains(word)));
    known.map_or("Fly the same dive again and see whether it repeats", |c| c.1)
}

/// `time_s,w_before_m_s,w_after_m_s` (positive down) on the rows of the check segments.
#[must_use]
pub fn prediction(d: &Diagnosis, vehicle: &Vehicle) -> String {
    let mut out = String::from("time_s,w_before_m_s,w_after_m_s\n");
    let nominal = State::nominal();
    for run in d.prepared.runs.iter().filter(|r| d.check.contains(&r.segment)) {
        let both = d.branch.tracks(run, vehicle, &[&nominal, &d.after]);
        for (i, t) in run.time_s.iter().enumerate() {
            out += &format!("{t:.3},{:.5},{:.5}\n", both[0].sink_m_s[i], both[1].sink_m_s[i]);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::{change, in_words};

    #[test]
    fn accuracy_digits_follow_the_interval_and_angles_are_in_degrees() {
        assert_eq!(in_words(0.052_36, 0.049, 0.055_7, "rad"), "3.00 (2.81 to 3.19) deg");
        assert_eq!(in_words(-121.34, -150.0, -92.7, "cm3"), "-121 (-150 to -93) cm3");
        assert_eq!(in_words(0.153_21, 0.148, 0.158, "1"), "0.1532 (0.1480 to 0.1580)");
    }

    #[test]
    fn regress_an_error_that_rises_is_not_said_to_fall() {
        assert_eq!(change(0.0093, 0.006, 0.0031), "falls from 0.93 cm/s (vehicle file as given) and 0.60 cm/s (recalibrated) to 0.31 cm/s");
        let worse = change(0.0028, 0.0043, 0.0047);
        assert!(
            worse.starts_with("was 0.28 cm/s (vehicle file as given)")
                && worse.contains("is 0.47 cm/s with it")
                && !worse.contains("falls"),
            "{worse}"
        );
        assert!(!change(0.004, 0.003, f64::NAN).contains("falls"));
    }
}

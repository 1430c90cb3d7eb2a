//! Adds named effects to a vehicle: refit, error before and after, and a new vehicle file that says where it came from.
//!
//! An effect that the file has switched on already is fitted anew: what is told is all of it, and the new file says that.

use crate::diagnosis::judged::{Blocks, Judged, as_given_m_s};
use crate::diagnosis::settle::{estimate_anew, settled};
use crate::diagnosis::{NothingToFit, check_segments, prepared_problem};
use crate::hypotheses::candidate::fit_named;
use crate::hypotheses::identifiability::posterior_tolerances;
use crate::inference::estimate::{Estimate, estimates};
use crate::inference::posterior::Fit;
use crate::likelihood::Problem;
use crate::likelihood::block_error::block_errors;
use crate::model::branch::Branch;
use crate::model::parameters::{CALIBRATION, State};
use crate::model::sensor_findings::{SensorFinding, sensor_findings};
use crate::preprocess::{Prepared, prepare};
use crate::workbench::refitted_file::{numbers, tolerances, zeros};
use hydro::effects::{Active, Effect};
use logs::digest::sha256;
use logs::record::flight::Flight;
use logs::vehicle::Vehicle;
use logs::vehicle::effects_table::new_key;
use serde_json::{Value, json};

/// What adding brought.
#[derive(Debug)]
pub struct Added {
    /// Block error on the fitted segments, m/s: vehicle as given, recalibrated only, with the effects.
    pub fitted_m_s: [f64; 3],
    /// The same on segments kept out of the fit; NaN if there are none.
    pub heldout_m_s: [f64; 3],
    /// Error that ordinary water motion and sensor noise alone would leave, m/s.
    pub noise_floor_m_s: f64,
    /// Parameters with 90 % intervals.
    pub parameters: Vec<Estimate>,
    /// The new vehicle file.
    pub vehicle: Value,
    /// Fall of chi² against recalibration alone.
    pub gain: f64,
    /// What had to be repaired or assumed.
    pub notes: Vec<String>,
    /// Calibration alone refitted.
    pub recalibrated: State,
    /// Calibration and effects refitted together, beside a vehicle whose file says nothing of these effects.
    pub after: State,
    /// Which branch the model was taken to be on beyond the valid angle of attack.
    pub branch: Branch,
    /// Sensors that are found to be off.
    pub sensors: Vec<SensorFinding>,
    /// Rms velocity that the model is wrong by, m/s.
    pub discrepancy_m_s: f64,
}

/// Times that mask, noise and discrepancy are estimated anew.
const ESTIMATIONS: usize = 2;

/// Adds effects and refits calibration and effects together on the segments that may be fitted.
///
/// # Errors
/// No dive in the flight that a model could be compared with.
pub fn add(flight: &Flight, vehicle: &Vehicle, effects: &[&'static Effect], parent: &[u8]) -> Result<Added, NothingToFit> {
    let prepared: Prepared = prepare(flight, vehicle);
    let mut notes = prepared.notes.clone();
    let check = check_segments(vehicle, &prepared, &mut notes);
    let (as_given, _) = prepared_problem(flight, vehicle, &prepared, &check, &mut notes)?;
    let base = vehicle.without(effects);
    let mut problem = Problem { vehicle: &base, ..as_given.clone() };
    let (mut null, mut fit) = fit_named(&problem, effects);
    let own: Vec<Active> = effects.iter().filter_map(|e| vehicle.switched_on(e)).collect();
    if !own.is_empty() {
        let names: Vec<&str> = own.iter().map(|a| a.effect.name).collect();
        notes.push(format!("the vehicle file has {} already: fitted anew, and reported as a whole", names.join(", ")));
        // What the file says may be a better start than nothing.
        if own.len() == effects.len() {
            let again = settled(&problem, &State { effects: own.clone(), ..as_given.start.clone() });
            fit = if again.chi2 < fit.chi2 { again } else { fit };
        }
    }
    problem.prepare_discrepancy(&null.state);
    let mut anew = !own.is_empty();
    for _ in 0..ESTIMATIONS {
        if !estimate_anew(&mut problem, &fit) {
            break;
        }
        fit = settled(&problem, &fit.state);
        anew = true;
    }
    let as_given = Problem { vehicle, ..problem.clone() };
    if anew {
        null = settled(&as_given, &null.state);
    }
    let judged = Judged::of(&prepared, vehicle, &check);
    let errors = |list: &Blocks, wave| {
        let recalibrated = block_errors(&as_given, &prepared, &[&null.state], list, wave);
        let after = block_errors(&problem, &prepared, &[&fit.state], list, wave);
        [as_given_m_s(&prepared, vehicle, list), recalibrated[0], after[0]]
    };
    let parameters = estimates(&fit);
    let (fitted_m_s, heldout_m_s) = (errors(&judged.fitted, true), errors(&judged.kept_out, false));
    let mut document = document(&problem, &fit.state, effects, &parameters, flight, parent);
    narrow(&mut document, &problem, &fit, [fitted_m_s[2], heldout_m_s[2]]);
    let sensors = sensor_findings(vehicle, &fit.state, |i| fit.covariance[(i, i)].max(0.0).sqrt(), prepared.clock_shift_s);
    notes.extend(sensors.iter().map(|s| format!("{}: {:.3} {} ({:.3} to {:.3})", s.what, s.value, s.unit, s.low, s.high)));
    Ok(Added {
        fitted_m_s,
        heldout_m_s,
        noise_floor_m_s: problem.noise_floor_m_s(),
        parameters,
        vehicle: document,
        gain: null.chi2 - fit.chi2,
        notes,
        recalibrated: null.state,
        after: fit.state,
        branch: problem.branch,
        sensors,
        discrepancy_m_s: problem.discrepancy.size_m_s,
    })
}

/// Narrows the tolerances of a refitted file to what the fit leaves uncertain: what is off by more is a change of the vehicle, which a
/// recalibration must not take up. `errors_m_s` are those of fitted and of held-out dives.
fn narrow(document: &mut Value, problem: &Problem, fit: &Fit, errors_m_s: [f64; 2]) {
    let Some(left) = posterior_tolerances(problem, fit, errors_m_s) else { return };
    document["tolerance_1sigma"] = tolerances(problem.vehicle, document, &fit.state, &left).into();
}

/// The vehicle file with refitted numbers, the effects on, and their provenance. The parent's other keys are kept.
fn document(
    problem: &Problem,
    state: &State,
    effects: &[&'static Effect],
    parameters: &[Estimate],
    flight: &Flight,
    parent: &[u8],
) -> Value {
    let mut d = numbers(problem.vehicle, state);
    d["effects"] = switched_on(&d, problem.vehicle, state, effects, parameters).into();
    d["provenance"] = provenance(problem, state, effects, flight, parent);
    d
}

/// The parent's effects and those that are added.
fn switched_on(
    d: &Value,
    vehicle: &Vehicle,
    state: &State,
    effects: &[&'static Effect],
    parameters: &[Estimate],
) -> serde_json::Map<String, Value> {
    let mut on = d.get("effects").and_then(Value::as_object).cloned().unwrap_or_default();
    for effect in effects {
        let mut entry = serde_json::Map::new();
        let prefix = format!("{}.", effect.name);
        for p in parameters.iter().filter(|p| p.name.starts_with(&prefix)) {
            let value = json!({"value": p.value, "low": p.low, "high": p.high, "unit": p.unit});
            entry.insert(p.name[prefix.len()..].to_string(), value);
        }
        for a in state.effects.iter().filter(|a| a.effect.name == effect.name) {
            let stated = effect.parameters.iter().zip(a.values).filter(|(p, _)| p.is_stated());
            entry.extend(stated.map(|(p, value)| (p.name.to_string(), json!({"value": value, "unit": p.unit}))));
        }
        if let Some(text) = effect.expression {
            entry.insert("expression".into(), json!(text));
        }
        on.insert(new_key(&on, effect), entry.into());
    }
    for zero in zeros(vehicle, state) {
        let name = zero.effect;
        let refitted = parameters.iter().find(|p| p.name == format!("{name}.{}", zero.parameter));
        let entry = match refitted.filter(|_| effects.iter().any(|e| e.name == name)) {
            Some(p) => json!({zero.parameter: {
                "value": zero.before + p.value + zero.shift, "low": zero.before + p.low + zero.shift,
                "high": zero.before + p.high + zero.shift, "unit": zero.unit,
            }}),
            None => zero.entry(),
        };
        on.insert(name.into(), entry);
    }
    on
}

/// Where the numbers come from.
fn provenance(problem: &Problem, state: &State, effects: &[&'static Effect], flight: &Flight, parent: &[u8]) -> Value {
    let z = &state.calibration;
    let calibration: serde_json::Map<String, Value> = CALIBRATION.iter().zip(z).map(|(name, z)| ((*name).to_owned(), json!(z))).collect();
    json!({
        "tool": concat!("glider ", env!("CARGO_PKG_VERSION")),
        "parent": problem.vehicle.path.file_name().map(|n| n.to_string_lossy()),
        "parent_sha256": sha256(parent),
        "flight": flight.name,
        "fitted_segments": problem.runs.iter().map(|r| r.segment).collect::<Vec<_>>(),
        "branch": problem.branch.document(),
        "added": effects.iter().map(|e| e.name).collect::<Vec<_>>(),
        "calibration_in_tolerances": calibration,
        "intervals": "90 %, with the colour of the water motion accounted for",
    })
}

//! `glider add`.

use super::diagnose::load;
use super::{Output, Verdict};
use crate::terminal::{Ladder, parameter, wrapped};
use anyhow::Context as _;
use discovery::diagnosis::report;
use discovery::history::flight::{Said, judged};
use discovery::model::parameters::{State, is_nuisance};
use discovery::workbench::add;
use discovery::workbench::add::Added;
use discovery::workbench::calibrate::free_names;
use hydro::effects::{CATALOGUE, Effect, by_name};
use logs::vehicle::{self, expression};
use rig::flight::vehicles;
use rig::spelling::meant;
use rig::whole_file;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider add side_edge_lift --flight trial_dir --out vehicle2.json\n  glider add hull_compressibility,thermal_expansion --flight f.csv --vehicle v.json --out v2.json\n  glider add 'cd += k*abs(roll)*U' --flight trial_dir --out v2.json\n\nAn expression is TARGET += EXPRESSION; targets: cd cl cn (alpha U roll climb phase t), volume_cc pitch_rad density_kg_m3\n(p z T rho ballast pitch t), water_up_m_s (z H t). Every other name is a parameter to fit, the one written first from zero.\nAn effect that the vehicle file has already is fitted anew, and reported as a whole.\nExit code 1: the error on segments kept out of the fit is not below that of the file as given, or of recalibration alone."
)]
pub struct Args {
    /// Names of effects, separated by commas, or one expression.
    #[arg(value_name = "EFFECT[,EFFECT…]|EXPRESSION")]
    effects: String,
    /// Flight directory (flight.csv and vehicle.json|toml) or csv file.
    #[arg(long, value_name = "DIR|CSV")]
    flight: PathBuf,
    /// Vehicle file, or a built-in one by name; default: the one beside the flight.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// Where to write the new vehicle file (.json or .toml).
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

fn effects_of(text: &str) -> anyhow::Result<Vec<&'static Effect>> {
    if expression::is_expression(text) {
        return Ok(vec![expression::parse(text)? as &'static Effect]);
    }
    let mut effects: Vec<&'static Effect> = Vec::new();
    for name in text.split(',').map(str::trim) {
        let effect = by_name(name).with_context(|| {
            let all: Vec<&str> = CATALOGUE.iter().map(|e| e.name).collect();
            let meant = meant(name, all.iter().copied());
            format!("no effect `{name}`{meant} (all: glider list effects; or write an expression: `cd += k*roll^2`)")
        })?;
        anyhow::ensure!(effects.iter().all(|e| e.name != name), "`{name}` is named twice: name every effect once");
        effects.push(effect);
    }
    Ok(effects)
}

/// Writes a vehicle file, as TOML where its name ends so, else as JSON.
///
/// # Errors
/// The file cannot be written.
pub(crate) fn write_vehicle(out: &Path, document: &Value) -> anyhow::Result<()> {
    let text =
        if out.extension().is_some_and(|e| e == "toml") { toml::to_string_pretty(&in_toml(document))? } else { format!("{document:#}\n") };
    whole_file::write(out, text).with_context(|| format!("cannot write {}", out.display()))
}

/// What was added, as one JSON document.
#[must_use]
pub fn document(added: &Added, effects: &[&'static Effect], flight: &str) -> Value {
    let n = |v: f64| report::number(v * 100.0);
    let parameters: serde_json::Map<String, Value> = added
        .parameters
        .iter()
        .map(|p| {
            let v = json!({"value": report::number(p.value), "low": report::number(p.low), "high": report::number(p.high), "unit": p.unit});
            (p.name.clone(), v)
        })
        .collect();
    json!({
        "flight": flight,
        "effects": effects.iter().map(|e| e.name).collect::<Vec<_>>(),
        "unit": "cm/s",
        "error_before": n(added.fitted_m_s[0]),
        "error_recalibrated": n(added.fitted_m_s[1]),
        "error_after": n(added.fitted_m_s[2]),
        "error_before_heldout": n(added.heldout_m_s[0]),
        "error_recalibrated_heldout": n(added.heldout_m_s[1]),
        "error_after_heldout": n(added.heldout_m_s[2]),
        "parameters": parameters,
        "vehicle": Value::Null,
        "chi2_gain": report::number(added.gain),
        "notes": added.notes,
    })
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let effects = effects_of(&args.effects)?;
    let (flight, vehicle) = load(&args.flight, args.vehicle.as_deref())?;
    if let Some(effect) = effects.iter().find(|e| vehicle.lacks_depth_for(e)) {
        let (file, name) = (vehicle.path.display(), effect.name);
        anyhow::bail!("{file}: water_depth_m: is missing, or 0: {name} moves the water over all of it; state the depth of the water, m");
    }
    let parent = vehicles::text(&vehicle.path)?.into_bytes();
    if let Some(out) = &args.out {
        let own_files = vehicle::files_next_to(&args.flight);
        let inputs: Vec<&Path> = [&args.flight, &vehicle.path].into_iter().chain(&own_files).map(PathBuf::as_path).collect();
        whole_file::may_write(out, &inputs, &["json", "toml"], output.force)?;
    }
    let mut added = add::add(&flight, &vehicle, &effects, &parent)?;
    let history = judged(&flight, &vehicle, &mut added.notes);
    if let Some(out) = &args.out {
        write_vehicle(out, &added.vehicle)?;
    }
    let mut document = document(&added, &effects, &args.flight.display().to_string());
    document["noise_floor"] = report::number(added.noise_floor_m_s * 100.0);
    document["history"] = history.as_ref().map_or(Value::Null, Said::document);
    document["vehicle"] = args.out.as_ref().map(|o| o.display().to_string()).into();
    let ladder = |[as_given, recalibrated, with]: [f64; 3], held_out| Ladder {
        as_given,
        recalibrated: Some(recalibrated),
        with: Some((args.effects.clone(), with)),
        floor: Some(added.noise_floor_m_s),
        held_out,
    };
    let held_out = added.heldout_m_s[0].is_finite();
    let errors = if held_out { added.heldout_m_s } else { added.fitted_m_s };
    let mut ladders = vec![ladder(added.fitted_m_s, false)];
    ladders.extend(held_out.then(|| ladder(added.heldout_m_s, true)));
    output.emit(&document, || {
        for note in &added.notes {
            println!("{}", wrapped(&format!("Note: {note}"), 6));
        }
        for p in &added.parameters {
            println!("{}", parameter(p));
        }
        println!();
        for ladder in &ladders {
            println!("{}", ladder.text());
        }
        // Why an effect may be true and yet take little off beyond recalibration.
        if let Some(what) = far(&added.recalibrated) {
            println!("{}", wrapped(&what, 2));
        }
        if let Some(said) = &history {
            println!("{}", wrapped(&format!("History: {}", said.words()), 9));
        }
        if let Some(out) = &args.out {
            println!("New vehicle file: {}", out.display());
        }
        println!("{}", wrapped(&worth(errors, &args.effects), 0));
    });
    let falls = errors[2] <= errors[0] && errors[2] <= errors[1];
    Ok(if falls { Verdict::Ok } else { Verdict::Negative })
}

/// A missing effect is a deviation beyond so many tolerances (flight format, section 5): so is a number that was refitted there.
const FAR: f64 = 3.0;

/// Numbers that recalibration alone had to bend too far to be a calibration.
fn far(recalibrated: &State) -> Option<String> {
    let deviations = free_names().iter().zip(recalibrated.calibration).enumerate();
    let far = deviations.filter(|(k, (_, z))| !is_nuisance(*k) && z.abs() > FAR).map(|(_, (name, z))| format!("{name} {z:+.1}"));
    let far: Vec<String> = far.collect();
    (!far.is_empty()).then(|| format!("Recalibrated beyond {FAR} tolerances of the vehicle file: {}.", far.join(", ")))
}

/// Whether it was worth it, by the segments that judge.
fn worth([as_given, recalibrated, with]: [f64; 3], effects: &str) -> String {
    let cm = |e: f64| format!("{:.3} cm/s", 100.0 * e);
    if !(with <= recalibrated) {
        return format!("Not worth adding: with {effects} {}, and recalibrated alone {}.", cm(with), cm(recalibrated));
    }
    if !(with <= as_given) {
        return format!("Not worth adding: with {effects} {}, and as given {}.", cm(with), cm(as_given));
    }
    let share = 100.0 * (1.0 - with / as_given);
    format!(
        "The error falls by {share:.0} %, from {} to {}; of this the effect, beyond recalibration: {}.",
        cm(as_given),
        cm(with),
        cm(recalibrated - with)
    )
}

/// The same in TOML, which has no null: such keys are left out. (Not through `Serialize`: a dependency turns on serde_json's
/// arbitrary precision, under which every number would become a table.)
fn in_toml(v: &Value) -> Option<toml::Value> {
    Some(match v {
        Value::Null => return None,
        Value::Bool(b) => (*b).into(),
        Value::Number(n) => n.as_i64().map(toml::Value::from).or(n.as_f64().map(toml::Value::from))?,
        Value::String(s) => s.as_str().into(),
        Value::Array(a) => a.iter().filter_map(in_toml).collect::<Vec<_>>().into(),
        Value::Object(o) => o.iter().filter_map(|(k, v)| Some((k.clone(), in_toml(v)?))).collect::<toml::Table>().into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a TOML file must still say when it is read back: every number a number, nothing lost but nulls.
    #[test]
    fn a_vehicle_written_as_toml_reads_back_as_the_same_json() {
        let text = include_str!("../../../vehicles/modena.toml");
        let json: Value = toml::from_str(text).expect("reads");
        let written = toml::to_string_pretty(&in_toml(&json).expect("an object")).expect("toml");
        assert!(written.contains("mass_kg = 70.0\n"), "{written}");
        let back: Value = toml::from_str(&written).expect("reads back");
        assert_eq!(back, json);
    }
}

//! Our side of the comparison with other people's tools: the same data, one task per call, its CPU time from data in memory to
//! the answer, printed as one line of JSON. Called by `benches/peers/compare.py`.
//!
//! ```text
//! ours fit FLIGHT ROWS.csv [EFFECT…]  dynamic fit of the calibration, and of effects; depths of every block row
//! ours cases FOLDER N SEED            N sealed cases with one hidden effect each, and what is hidden
//! ours find CASE MATRIX.csv           diagnosis; the linear problem that a sparse regression is given
//! ```

use anyhow::{Context, bail};
use benches::cpu_time;
use discovery::diagnosis;
use discovery::likelihood::Problem;
use discovery::likelihood::block_error::blocks;
use discovery::model::parameters::{N_CALIBRATION, State};
use discovery::preprocess::prepare;
use discovery::workbench::add;
use hydro::effects::{Active, CATALOGUE, by_name};
use logs::{Flight, Vehicle};
use plant::trials::{Kind, generate, plan};
use serde_json::json;
use std::fmt::Write as _;
use std::path::Path;

/// Fits of one call: the first also warms caches, the median counts.
const REPEATS: usize = 5;

fn load(path: &Path) -> anyhow::Result<(Flight, Vehicle)> {
    let vehicle = logs::vehicle::file_next_to(path)?.with_context(|| format!("{}: no vehicle file beside it", path.display()))?;
    Ok((logs::record::csv::flight(path)?, logs::vehicle::read(&vehicle)?))
}

/// Median CPU seconds of a piece of work, and what it made.
fn timed<T>(repeats: usize, work: impl Fn() -> T) -> (f64, T) {
    let mut seconds = Vec::new();
    let out = loop {
        let begin = cpu_time();
        let out = work();
        seconds.push((cpu_time() - begin).as_secs_f64());
        if seconds.len() >= repeats {
            break out;
        }
    };
    seconds.sort_by(f64::total_cmp);
    (seconds[seconds.len() / 2], out)
}

fn fit(path: &Path, rows: &Path, names: &[&str]) -> anyhow::Result<()> {
    let named = names.iter().map(|n| by_name(n).with_context(|| format!("there is no effect named {n}")));
    let named: Vec<_> = named.collect::<anyhow::Result<_>>()?;
    let (flight, vehicle) = load(path)?;
    let (seconds, fitted) = timed(REPEATS, || add::add(&flight, &vehicle, &named, &[]));
    let fitted = fitted?;
    let prepared = prepare(&flight, &vehicle);
    let mut text = String::from("time_s,block,check,depth_m,model_m\n");
    let mut block = 0;
    for run in &prepared.runs {
        let model = fitted.branch.track(run, &vehicle, &fitted.after);
        let check = u8::from(vehicle.check_segments.contains(&run.segment));
        for b in blocks(run) {
            for &row in &b.rows {
                writeln!(text, "{},{block},{check},{},{}", run.time_s[row], run.depth_m[row], model.depth_m[row])?;
            }
            block += 1;
        }
    }
    std::fs::write(rows, text)?;
    println!("{}", json!({"seconds": seconds, "fitted_m_s": fitted.fitted_m_s[2], "heldout_m_s": fitted.heldout_m_s[2]}));
    Ok(())
}

fn cases(folder: &Path, n: usize, seed: u64) -> anyhow::Result<()> {
    let mut all = Vec::new();
    for (i, spec) in plan(n, seed, Some(Kind::Single)).iter().enumerate() {
        let path = hil_host::score::diagnosis::write_case(folder, &generate(spec, seed, i))?;
        all.push(json!({"path": path, "hidden": spec.effects.iter().map(|e| e.names().0).collect::<Vec<_>>()}));
    }
    println!("{}", json!(all));
    Ok(())
}

fn find(path: &Path, matrix: &Path) -> anyhow::Result<()> {
    let (flight, vehicle) = load(path)?;
    let (seconds, found) = timed(1, || diagnosis::diagnose(&flight, &vehicle, discovery::hypotheses::search::Depth::Pairs, &|_, _| {}));
    let found = found?;
    let prepared = prepare(&flight, &vehicle);
    let fitted = |s: u32| !vehicle.check_segments.contains(&s) && (vehicle.fit_segments.is_empty() || vehicle.fit_segments.contains(&s));
    let begin = cpu_time();
    let problem = Problem::new(&prepared, &vehicle, fitted);
    // Signatures by differences at the recalibrated state: what each number would add to the whitened residual.
    let base_state = &found.recalibrated;
    let base = problem.model(base_state);
    let column = |beside: &State, step: f64| -> Vec<f64> { problem.model(beside).iter().zip(&base).map(|(b, a)| (b - a) / step).collect() };
    let mut columns: Vec<(String, Vec<f64>)> = vec![("y".into(), problem.data.iter().zip(&base).map(|(d, m)| d - m).collect())];
    for k in 0..N_CALIBRATION {
        let mut beside = base_state.clone();
        beside.calibration[k] += 0.5;
        columns.push((format!("calibration{k}"), column(&beside, 0.5)));
    }
    for effect in CATALOGUE.iter().filter(|e| e.name != "internal_wave") {
        let p = effect.parameters[0];
        let step = if p.off + p.typical <= p.high { 0.1 * p.typical } else { -0.1 * p.typical };
        let mut beside = base_state.clone();
        beside.effects.push(Active::sized(effect, p.off + step));
        columns.push((effect.name.to_owned(), column(&beside, step)));
    }
    let matrix_seconds = (cpu_time() - begin).as_secs_f64();
    let mut text = columns.iter().map(|c| c.0.as_str()).collect::<Vec<_>>().join(",");
    for i in 0..base.len() {
        text.push('\n');
        text += &columns.iter().map(|c| format!("{:e}", c.1[i])).collect::<Vec<_>>().join(",");
    }
    std::fs::write(matrix, text + "\n")?;
    let told = json!({"seconds": seconds, "matrix_seconds": matrix_seconds, "answer": found.answer, "equivalent": found.equivalent,
        "verdict": found.verdict.name()});
    println!("{told}");
    Ok(())
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments.as_slice() {
        ["fit", flight, rows, effects @ ..] => fit(Path::new(flight), Path::new(rows), effects),
        ["cases", folder, n, seed] => cases(Path::new(folder), n.parse()?, seed.parse()?),
        ["find", case, matrix] => find(Path::new(case), Path::new(matrix)),
        _ => bail!("ours fit FLIGHT ROWS.csv [EFFECT…] | ours cases FOLDER N SEED | ours find CASE MATRIX.csv"),
    }
}

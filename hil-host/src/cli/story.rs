//! `glider loop`.

use super::diagnose::{ask, bar, load};
use super::{Output, Verdict, report};
use crate::pages::flight_report;
use crate::pages::{Axis, Chart, Page, Section, Table};
use crate::score;
use crate::score::both_tables;
use crate::score::story::{self, Flown};
use crate::terminal::{row, say};
use anyhow::Context as _;
use control::Settings;
use discovery::hypotheses::search::Depth;
use discovery::workbench::add;
use logs::vehicle;
use plant::trials::{Site, Spec, Wing, catalogue, generate};
use rig::flight::closed_loop::Setup;
use rig::flight::vehicles::{self, Model};
use rig::whole_file;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider loop\n  glider loop --flight trial_dir --out out/story\n  glider loop --flight flight.csv --vehicle vehicle.json --json\n\n\
Without --flight: the paper's puzzle. A rail-wing glider is flown in a simulated lake whose truth has body-wing vortex lift that its \
model lacks.\nExit code 1: nothing was found that could be added."
)]
pub struct Args {
    /// Flight directory or csv file; default: the paper's puzzle, simulated.
    #[arg(long, value_name = "DIR|CSV")]
    flight: Option<PathBuf>,
    /// Vehicle file, or a built-in one by name; default: the one beside the flight.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// Where the new vehicle, the tables and the page go.
    #[arg(long, default_value = DEFAULT_OUT, value_name = "DIR")]
    out: PathBuf,
    /// Seed of the simulated puzzle.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

/// The paper's puzzle as a sealed case below `out`.
fn puzzle(args: &Args) -> anyhow::Result<PathBuf> {
    let spec = Spec::single(Site::Lake, Wing::LowAspectRatio, catalogue::Effect::VortexLiftBodywing, catalogue::Strength::Strong);
    score::diagnosis::write_case(&args.out.join("puzzle"), &generate(&spec, args.seed, 0))
}

/// Where results go if nothing else is asked for: this command's own.
const DEFAULT_OUT: &str = "out/loop";

/// Whether the folder may be written: no flight lies in it, and nothing there is replaced that nobody meant to replace.
fn may_write(args: &Args, force: bool) -> anyhow::Result<()> {
    let name = args.out.display();
    anyhow::ensure!(!args.out.join("flight.csv").exists(), "{name}: holds a flight; name another folder with --out");
    let own = args.out == Path::new(DEFAULT_OUT) || args.out.join(PAGE).exists();
    let own_files = args.flight.as_deref().map(vehicle::files_next_to).unwrap_or_default();
    let inputs: Vec<&Path> = args.flight.iter().chain(&args.vehicle).chain(&own_files).map(PathBuf::as_path).collect();
    for file in ["vehicle.json", "table-before.bin", "table-after.bin", PAGE] {
        whole_file::may_write(&args.out.join(file), &inputs, &[], force || own)?;
    }
    // Before the search, which takes a while.
    std::fs::create_dir_all(&args.out).with_context(|| format!("{name}: cannot make this folder"))
}

const PAGE: &str = "story.html";

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    may_write(args, output.force)?;
    let path = match &args.flight {
        Some(path) => path.clone(),
        None => puzzle(args)?,
    };
    let (flight, model) = load(&path, args.vehicle.as_deref())?;
    let bar = bar();
    let found = ask(&flight, &model, Depth::Pairs, &bar, 80.0)?;
    let parent = vehicles::text(&model.path)?.into_bytes();
    let effects: Vec<_> = found.answer.iter().filter_map(|n| hydro::effects::by_name(n)).collect();
    if effects.is_empty() {
        bar.finish_and_clear();
        let document = json!({"flight": path, "verdict": found.verdict.name(), "answer": [], "explanation": discovery::diagnosis::report::explanation(&found)});
        output.emit(&document, || {
            say(&format!("Verdict: {}. Nothing to add.", found.verdict.name()));
            say(&discovery::diagnosis::report::explanation(&found));
        });
        return Ok(Verdict::Negative);
    }
    bar.set_message("adding it and refitting");
    let added = add::add(&flight, &model, &effects, &parent)?;
    let new_file = args.out.join("vehicle.json");
    let text = format!("{:#}\n", added.vehicle);
    whole_file::write(&new_file, &text).with_context(|| format!("cannot write {}", new_file.display()))?;
    let refitted = vehicle::parse_text(&text, &new_file)?;

    bar.set_message("new flight table, and flying with the old and the new one");
    bar.set_position(90);
    let (old, new) = (story::table_of(&model, &parent)?, story::table_of(&refitted, text.as_bytes())?);
    let mission = story::mission(new.spec.wings)?;
    let world = story::world_of(&Model::of_coefficients(&refitted, 0)?, &mission);
    for (name, table) in [("table-before.bin", &old), ("table-after.bin", &new)] {
        whole_file::write(args.out.join(name), &table.bytes).with_context(|| format!("cannot write {name}"))?;
    }
    // The world has the vehicle's glide, not its sensors.
    let true_sensor = Settings::default().pitch_sensor;
    let before = story::fly_with(old, true_sensor, &world, &mission)?;
    let after = story::fly_with(new, true_sensor, &world, &mission)?;
    bar.set_message("both tables in worlds within the new vehicle's tolerances");
    let tables = [&before, &after].map(|flown| flown.table.bytes.as_slice());
    let drawn = both_tables::in_drawn_worlds(tables, &Setup::new(mission), &world, Some(&refitted), &|_| ());
    bar.finish_and_clear();

    let heldout = added.heldout_m_s[0].is_finite();
    let errors = if heldout { added.heldout_m_s } else { added.fitted_m_s };
    let ratios = [&before, &after].map(|flown| flown.outcome.achieved_l_over_d());
    let page = args.out.join(PAGE);
    let mut document = json!({
        "flight": path, "verdict": found.verdict.name(), "answer": found.answer, "equivalent": found.equivalent,
        "error_unit": "m/s", "error_on": if heldout { "held-out segments" } else { "fitted segments" },
        "error_before": errors[0], "error_recalibrated": errors[1], "error_after": errors[2],
        "parameters": added.parameters.iter().map(|p| (p.name.clone(), json!({"value": p.value, "low": p.low, "high": p.high, "unit": p.unit}))).collect::<serde_json::Map<_, _>>(),
        "vehicle": new_file, "table_before": flown(&before), "table_after": flown(&after),
        "achieved_l_over_d_before": ratios[0], "achieved_l_over_d_after": ratios[1], "page": page,
    });
    both_tables::add_to(&mut document, json!({}), ratios, Some(&drawn));
    let worth = document["range_gain_in_words"].as_str().unwrap_or_default();
    let mut whole = flight_report::page(&found, &model, &flight.name, report::provenance(&path)?);
    fly_section(&mut whole, &before, &after, worth);
    whole.write(&page)?;
    output.emit(&document, || {
        row("1  compare", &format!("{:.3} cm/s as given, {:.3} recalibrated", 100.0 * errors[0], 100.0 * errors[1]));
        row("2  diagnose", &format!("{}: {}", found.verdict.name(), found.answer.join(" + ")));
        row("3  add", &format!("{:.3} cm/s with it, vehicle in {}", 100.0 * errors[2], new_file.display()));
        let best = |f: &Flown| format!("{:.3} at {:.2}°", f.table.spec.best_l_over_d, f.table.spec.best_alpha_rad.to_degrees());
        row("4  table", &format!("best L/D {}, before {}", best(&after), best(&before)));
        row("5  fly", &format!("L/D {:.3} with the old table, {:.3} with the new: {worth}", ratios[0], ratios[1]));
        row("   page", &page.display().to_string());
    });
    Ok(Verdict::Ok)
}

fn flown(f: &Flown) -> Value {
    json!({
        "id": format!("{:08x}", f.table.id()), "best_l_over_d": f.table.spec.best_l_over_d, "best_alpha_rad": f.table.spec.best_alpha_rad,
        "end": f.outcome.end.to_string(), "dives": f.outcome.dives, "distance_m": f.outcome.distance_m, "share_near_best": f.outcome.share_near_best,
    })
}

fn fly_section(page: &mut Page, before: &Flown, after: &Flown, worth: &str) {
    let names = vec!["old table".to_owned(), "new table".to_owned()];
    let ratios = [before.outcome.achieved_l_over_d(), after.outcome.achieved_l_over_d()];
    let chart = Chart::bars("L/D over ground, 0–200 m", Axis::new("L/D", ""), names, "L/D", &ratios, &[], &[]);
    let row = |name: &str, f: &Flown| {
        vec![
            name.to_owned(),
            format!("{:08x}", f.table.id()),
            format!("{:.3}", f.table.spec.best_l_over_d),
            format!("{:.2}°", f.table.spec.best_alpha_rad.to_degrees()),
            format!("{:.3}", f.outcome.achieved_l_over_d()),
            format!("{:.0} %", 100.0 * f.outcome.share_near_best),
            f.outcome.end.to_string(),
        ]
    };
    let head = ["", "table id", "(L/D)max believed", "at angle of attack", "L/D flown", "time within 2° of the true best", "end"];
    let table = Table {
        caption: "The controller with both tables in the world the flight revealed".into(),
        head: head.map(Into::into).to_vec(),
        rows: vec![row("old", before), row("new", after)],
    };
    page.answer.push(("Worth it".into(), format!("New table against old: {worth}.")));
    page.sections.push(Section {
        title: "Flown with the old and the new table".into(),
        lead: "The world is the refitted vehicle in the simulator's own force law; both flights differ only in the table.".into(),
        items: vec![chart.into(), table.into()],
    });
}

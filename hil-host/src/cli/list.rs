//! `glider list`: what there is to name in the other commands.

use super::{Output, Verdict};
use crate::pages::effect_list;
use crate::terminal::{parameter_range, say, table, wrapped, wrapped_from};
use anyhow::bail;
use discovery::history::kinds::KINDS;
use discovery::history::shown::{LEVELS_SHOWN, place};
use hydro::effects::{CATALOGUE, Effect};
use logs::import::classes::Class;
use rig::flight::mission_file;
use rig::flight::vehicles::BUILT_IN_VEHICLES;
use rig::spelling::meant;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// What is listed.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// Effects that may be missing from a model: what `diagnose` asks and `add` takes.
    Effects,
    /// Faults that `fly --fault` injects.
    Faults,
    /// Vehicle files that come with the program.
    Vehicles,
    /// Missions that come with the program.
    Missions,
    /// Changes that `timeline` names.
    Changes,
}

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider list effects\n  glider list effects climb_drag\n  glider list faults --json\n  glider list changes"
)]
pub struct Args {
    /// What to list.
    #[arg(value_enum)]
    what: What,
    /// An effect to tell at length.
    name: Option<String>,
}

/// Runs the command.
///
/// # Errors
/// A name that is none.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if let (Some(name), true) = (&args.name, args.what != What::Effects) {
        bail!("`{name}`: only an effect is explained at length: glider list effects NAME");
    }
    match args.what {
        What::Effects => effects(args.name.as_deref(), output)?,
        What::Faults => faults(output),
        What::Vehicles => vehicles(output),
        What::Missions => missions(output),
        What::Changes => changes(output),
    }
    Ok(Verdict::Ok)
}

fn document(e: &'static Effect) -> Value {
    json!({"name": e.name, "kind": effect_list::kind(e), "about": e.physics, "words": effect_list::in_words(e.name), "physics": e.physics,
           "separated_by": e.separated_by, "parameters": effect_list::parameters(e)})
}

fn effects(name: Option<&str>, output: &Output) -> anyhow::Result<()> {
    if let Some(name) = name {
        let Some(e) = hydro::effects::by_name(name) else {
            bail!("no effect `{name}`{}; all: glider list effects", meant(name, CATALOGUE.iter().map(|e| e.name)));
        };
        output.emit(&document(e), || {
            println!("{} ({}, {})", e.name, effect_list::in_words(e.name), effect_list::kind(e).to_lowercase());
            println!("{}", wrapped(e.physics, 0));
            for p in e.parameters.iter().filter(|p| !p.is_stated()) {
                println!("  {}", parameter_range(p));
            }
            println!("{}", wrapped(&format!("Told from its look-alikes by: {}", e.separated_by), 2));
        });
        return Ok(());
    }
    output.emit(&json!({"items": CATALOGUE.iter().map(|e| document(e)).collect::<Vec<_>>()}), || {
        for (kind, inside) in effect_list::by_kind() {
            println!("{kind}");
            for e in inside {
                println!("  {:<22} {}", e.name, wrapped_from(25, e.physics, 25));
            }
        }
        println!("\nOne of them at length: glider list effects NAME");
    });
    Ok(())
}

fn faults(output: &Output) {
    let mut of: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    plant::faults::catalogue().for_each(|(target, kind, ..)| of.entry(target.name()).or_default().push(kind.name()));
    let list: Vec<Value> = plant::faults::catalogue()
        .map(|(target, kind, size, meaning)| json!({"name": format!("{}:{}", target.name(), kind.name()), "kind": "fault", "about": meaning, "size": size}))
        .collect();
    output.emit(&json!({"items": list}), || {
        for (target, kinds) in &of {
            println!("{}", wrapped(&format!("{target}: {}", kinds.join(", ")), 2));
        }
        println!("\nWritten target:kind[=size][@phase][+delay][,duration], such as\n  glider fly --fault depth:stuck@dive+120s,300s");
    });
}

fn vehicles(output: &Output) {
    let built_in = BUILT_IN_VEHICLES.iter().map(|(name, text)| ((*name).to_owned(), "built in", first_words(text)));
    let classes = Class::ALL.iter().map(|c| (c.name().to_owned(), "class", c.about().to_owned()));
    let all: Vec<(String, &str, String)> = built_in.chain(classes).collect();
    let list: Vec<Value> = all.iter().map(|(name, kind, about)| json!({"name": name, "kind": kind, "about": about})).collect();
    output.emit(&json!({"items": list}), || {
        let mut t = table(["name", "", "what it is"]);
        for (name, kind, about) in &all {
            t.add_row([name.as_str(), kind, about.as_str()]);
        }
        println!("{t}");
        say("built in: by name, glider polar --vehicle slocum-low-ar-sea; class: glider import --class");
    });
}

fn changes(output: &Output) {
    let list: Vec<Value> = KINDS
        .iter()
        .map(|k| json!({"name": k.name, "kind": k.shape.id(), "about": k.about, "number": LEVELS_SHOWN[place(k.number)].name}))
        .collect();
    output.emit(&json!({"items": list}), || {
        for k in &KINDS {
            println!(
                "  {:<24} {}",
                k.name,
                wrapped_from(27, &format!("{} ({} of {})", k.about, k.shape.id(), LEVELS_SHOWN[place(k.number)].name), 27)
            );
        }
    });
}

/// What a vehicle file says it is: its `about`, else its first comment.
fn first_words(text: &str) -> String {
    let about = text.lines().find_map(|l| l.strip_prefix("about = ")).map(|l| l.trim_matches('"'));
    let comment = text.lines().find_map(|l| l.strip_prefix('#')).map(str::trim);
    about.or(comment).unwrap_or_default().to_owned()
}

fn missions(output: &Output) {
    let list: Vec<Value> = mission_file::BUILT_IN
        .iter()
        .zip(mission_file::WHAT)
        .map(|(name, what)| json!({"name": name, "kind": "mission", "about": what}))
        .collect();
    output.emit(&json!({"items": list}), || {
        for (name, what) in mission_file::BUILT_IN.iter().zip(mission_file::WHAT) {
            println!("{}", wrapped(&format!("{name}: {what}"), 2));
        }
        say("\nTaken by name: glider fly --mission sweep. One of your own: a TOML file such as glider next-flight writes.");
    });
}

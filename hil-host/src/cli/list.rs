//! `glider list`: what there is, one line each.

use super::{Output, Verdict};
use crate::flight::vehicles::BUILT_IN;
use discovery::import::classes::Class;
use hydro::effects::CATALOGUE;
use serde_json::json;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:\n  glider list vehicles\n  glider list effects --json")]
pub struct Args {
    /// Of what.
    #[arg(value_enum)]
    what: What,
}

/// What is listed.
#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum What {
    /// Built-in vehicle files (for --vehicle), and classes of gliders (for import --class).
    Vehicles,
    /// Physical effects that `add` and `diagnose` know.
    Effects,
}

/// Runs the command.
///
/// # Errors
/// None; the signature is that of every command.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let items: Vec<(String, &str, String)> = match args.what {
        What::Vehicles => {
            let built_in = BUILT_IN.iter().map(|(name, text)| ((*name).to_owned(), "built in", first_words(text)));
            let classes = Class::ALL.iter().map(|c| (c.name().to_owned(), "class", c.about().to_owned()));
            built_in.chain(classes).collect()
        }
        What::Effects => CATALOGUE.iter().map(|e| (e.name().to_owned(), "effect", e.physics().to_owned())).collect(),
    };
    let list: Vec<_> = items.iter().map(|(name, kind, about)| json!({"name": name, "kind": kind, "about": about})).collect();
    output.emit(&json!({ "items": list }), || {
        let width = items.iter().map(|i| i.0.len()).max().unwrap_or(0);
        for (name, kind, about) in &items {
            println!("{name:width$}  {kind:8}  {about}");
        }
    });
    Ok(Verdict::Ok)
}

/// What a vehicle file says it is: its `about`, else its first comment.
fn first_words(text: &str) -> String {
    let about = text.lines().find_map(|l| l.strip_prefix("about = ")).map(|l| l.trim_matches('"'));
    let comment = text.lines().find_map(|l| l.strip_prefix('#')).map(str::trim);
    about.or(comment).unwrap_or_default().to_owned()
}

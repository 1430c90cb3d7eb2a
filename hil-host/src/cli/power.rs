//! `glider power`.

use super::{Output, Verdict};
use crate::terminal::{say, table};
use anyhow::anyhow;
use plant::World;
use rig::flight::closed_loop::{End, Setup};
use rig::flight::power::{AT_V, budget};
use rig::flight::{mission_file, worlds};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:\n  glider power --mission sea\n  glider power --mission mission.toml --json\n\n\
The mission is flown on models of the board's parts with the image's own loop; each part's time in each state is counted there.\n\
Currents come from datasheets; a guess says so. No board has been measured yet.")]
pub struct Args {
    /// Built-in mission or a TOML file.
    #[arg(long, default_value = "sea")]
    mission: String,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let mission = mission_file::load(&args.mission, worlds::limits)?;
    let world = World::new(worlds::for_mission(&mission)).map_err(|e| anyhow!("{e}"))?;
    let found = budget(world, &Setup::new(mission)).map_err(|e| anyhow!("{e}"))?;
    output.emit(&found.document(), || {
        let mut t = table(["part, state", "mA", "rail V", "% of time", "mean mA", "source"]);
        for r in &found.rows {
            t.add_row([
                r.what.clone(),
                format!("{:.2}", r.ma),
                format!("{:.1}", r.rail_v),
                format!("{:.2}", 100.0 * r.share),
                format!("{:.2}", r.mean_ma),
                r.source.to_owned(),
            ]);
        }
        println!("{t}");
        say(&format!(
            "controller and sensors  {:.1} mA mean at {AT_V:.0} V; pump, battery and fin {:.1} mA",
            found.electronics_ma, found.motors_ma
        ));
        say(&format!("mission                 {:.1} h, {}", found.flight.duration_s / 3600.0, found.flight.end));
        say(&format!("battery                 empty after {:.0} days of such missions", found.endurance_days()));
    });
    Ok(if found.flight.end == End::Done { Verdict::Ok } else { Verdict::Negative })
}

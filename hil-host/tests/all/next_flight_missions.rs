//! Every mission that `next-flight` writes can be flown, and is: by the vehicle that flew the flight it was planned from.

use anyhow::{Context as _, anyhow};
use discovery::diagnosis;
use discovery::hypotheses::search::Depth;
use discovery::workbench::next_flight::Plan;
use hil_host::next_mission;
use logs::record::csv;
use logs::vehicle;
use plant::{Effect, EffectKind, Scenario, World};
use rig::flight::closed_loop::{End, Setup, fly};
use rig::flight::recorder::Recorder;
use rig::flight::{mission_file, worlds};
use rig::seats::Link;
use rig::seats::in_process::InProcess;
use signals::{Mission, Wings};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Flies a mission in a world; its log goes into a folder, if one is named.
fn flown(scenario: &Scenario, mission: &Mission, log: Option<&Path>) -> anyhow::Result<End> {
    let mut world = World::new(scenario.clone()).map_err(|e| anyhow!("{e}"))?;
    let setup = Setup::new(mission.clone());
    let mut recorder = log.map(|dir| Recorder::create(dir, &world, &setup)).transpose()?;
    let out = fly(&mut world, &mut Link::new(InProcess::default()), &setup, &mut |c| recorder.as_mut().map_or(Ok(()), |r| r.push(c)))?;
    recorder.map_or(Ok(()), |r| r.finish(serde_json::json!({})))?;
    Ok(out.end)
}

/// The end of the planned flight; none where no mission tells anything apart.
fn next(wings: Wings, mission: &str, hidden: EffectKind, folder: &Path) -> anyhow::Result<Option<End>> {
    let mission = Mission { wings, ..mission_file::built_in(mission).context("a built-in mission")? };
    let mut scenario = Scenario { wings, seed: 7, effects: vec![Effect::typical(hidden)], ..worlds::for_mission(&mission) };
    scenario.ocean.background_rms_m_s = 0.003;
    flown(&scenario, &mission, Some(folder))?;
    let (flight, vehicle) = (csv::flight(folder)?, vehicle::read(&folder.join("vehicle.json"))?);
    let found = diagnosis::diagnose(&flight, &vehicle, Depth::Pairs, &|_, _| {})?;
    let Some(plan) = next_mission::plan(&found, &vehicle)?.ok().filter(Plan::tells_apart) else {
        return Ok(None);
    };
    let planned = mission_file::parse(&plan.mission(next_mission::wings(&vehicle)), "next.toml", worlds::limits)?;
    Ok(Some(flown(&scenario, &planned, None)?))
}

#[test]
fn every_planned_mission_is_flown_to_its_end() {
    let folder = std::env::temp_dir().join(format!("glider-next-{}", std::process::id()));
    let mut ends = Vec::new();
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        for mission in ["shallow", "sea"] {
            for hidden in [EffectKind::ClimbDrag, EffectKind::DragLevelError, EffectKind::BallastScale, EffectKind::PitchOffset] {
                let name = format!("{wings:?}-{mission}-{}", hidden.name());
                let end = next(wings, mission, hidden, &folder.join(&name)).unwrap_or_else(|e| panic!("{name}: {e:#}"));
                println!("{name}: {end:?}");
                ends.extend(end.map(|end| (name, end)));
            }
        }
    }
    let _ = std::fs::remove_dir_all(&folder);
    assert!(ends.len() >= 4, "of 16 flights few can be planned from: {ends:?}");
    assert!(ends.iter().all(|(_, end)| *end == End::Done), "{ends:?}");
}

/// A SeaExplorer moves 500 cc either side of neutral, and needs more than a Slocum's 263 at 700 m.
#[test]
fn regress_a_pump_larger_than_any_that_is_simulated_is_named() {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) else {
        eprintln!("skipped: no flights (GLIDER_FLIGHTS is not set)");
        return;
    };
    let folder = std::env::temp_dir().join(format!("glider-large-pump-{}", std::process::id()));
    let glider = |args: &[&Path]| Command::new(env!("CARGO_BIN_EXE_glider")).args(args).arg("--json").output().expect("runs").stdout;
    let logs = ["gli.sub.40", "pld1.sub.40", "gli.sub.41", "pld1.sub.41"].map(|f| root.join(format!("seaexplorer_sea035/sea035.12.{f}")));
    let mut import: Vec<&Path> = vec![Path::new("import")];
    import.extend(logs.iter().map(PathBuf::as_path));
    import.extend([Path::new("--out"), &folder]);
    glider(&import);
    let said: serde_json::Value =
        serde_json::from_slice(&glider(&[Path::new("next-flight"), Path::new("--flight"), &folder])).expect("a document");
    let why = said["why"].as_str().unwrap_or_default();
    assert!(why.starts_with("with 263 cc, the largest pump that is simulated, no leg") && why.ends_with("own moved 500 cc"), "{said}");
    std::fs::remove_dir_all(&folder).expect("removed");
}

//! What a newcomer does with the README alone, in an empty folder: its blocks of commands, run as printed, each of five at most.

use plant::World;
use rig::flight::closed_loop::{Setup, fly};
use rig::flight::vehicles::Model;
use rig::flight::{mission_file, tables, worlds};
use rig::seats::Link;
use rig::seats::in_process::InProcess;
use serde_json::Value;
use signals::{Goal, Mission};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The fenced block of a kind that comes first behind these words.
fn block(page: &str, behind: &str, kind: &str) -> String {
    let rest = page.split_once(behind).unwrap_or_else(|| panic!("the README says {behind:?}")).1;
    let fence = format!("```{kind}\n");
    let block = rest.split_once(&fence).unwrap_or_else(|| panic!("a block of {kind} behind {behind:?}")).1;
    block.split_once("```").expect("its end").0.to_owned()
}

fn commands(page: &str, behind: &str) -> Vec<String> {
    let lines = block(page, behind, "sh");
    let commands: Vec<String> = lines.lines().map(|l| l.split(" #").next().unwrap_or_default().trim().to_owned()).collect();
    assert!((1..=5).contains(&commands.len()) && commands.iter().all(|c| c.starts_with("glider")), "{commands:#?}");
    commands
}

fn run(line: &str, work: &Path) -> String {
    let args: Vec<&str> = line.split_whitespace().skip(1).collect();
    let out = Command::new(env!("CARGO_BIN_EXE_glider")).args(args).current_dir(work).stdin(Stdio::null()).output().expect("it starts");
    let text = String::from_utf8_lossy(&out.stdout).into_owned();
    assert_eq!(out.status.code(), Some(0), "{line}\n{text}{}", String::from_utf8_lossy(&out.stderr));
    text
}

fn readme() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md")).expect("the README")
}

fn empty(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("glider-new-user-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("an empty folder");
    folder
}

/// The number between two words of a text.
fn number(text: &str, before: &str, after: &str) -> f64 {
    let inside = text.split_once(before).and_then(|t| t.1.split_once(after)).unwrap_or_else(|| panic!("{before}…{after} in\n{text}")).0;
    inside.trim().parse().unwrap_or_else(|e| panic!("{inside}: {e}"))
}

#[test]
fn the_story_of_the_readme_names_the_effect_and_gains_range() {
    let (page, work) = (readme(), empty("story"));
    std::fs::write(work.join("truth.toml"), block(&page, "The story in four", "toml truth.toml")).expect("written");
    let texts: Vec<String> = commands(&page, "The story in four").iter().map(|c| run(c, &work)).collect();
    assert!(texts[1].contains("Verdict: explained") && texts[1].contains("Missing: climb drag"), "{}", texts[1]);
    let fall = number(&texts[2], "The error falls by ", " %");
    assert!(fall >= 30.0, "{fall} %");
    // Not by recalibration: of what that leaves, the effect takes a third.
    let ladder = texts[2].split_once("kept out of the fit:").expect("their ladder").1;
    let step = |name: &str| number(ladder, &format!("  {name} "), "█");
    let [recalibrated, with] = ["recalibrated", "with climb_drag"].map(step);
    assert!(with <= 0.7 * recalibrated, "{recalibrated} to {with} cm/s");
    let gain = number(&texts[3], "with the other table: ", " % range");
    assert!(gain > 0.0 && texts[3].contains("(90 %:"), "{}", texts[3]);
    // In no world of its own the table says whose vehicle it flew.
    let elsewhere = run("glider fly --table learnt.json", &work);
    assert!(elsewhere.contains("`--world learnt.json`"), "{elsewhere}");
    std::fs::remove_dir_all(&work).expect("removed");
}

#[test]
fn validate_a_raw_log_comes_to_a_table_flown_as_the_readme_says() {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) else {
        eprintln!("skipped: no flights (GLIDER_FLIGHTS is not set)");
        return;
    };
    let (page, work) = (readme(), empty("log"));
    let log = root.join("slocum_comet2016/raw").to_string_lossy().into_owned();
    let texts: Vec<String> = commands(&page, "A log of your own glider").iter().map(|c| run(&c.replace("LOG", &log), &work)).collect();
    assert!(texts[2].lines().any(|l| l.starts_with("Verdict: ")), "{texts:#?}");
    // The vehicle's own world: its table is better there than the first guess.
    assert!(!texts[4].contains("note "), "{}", texts[4]);
    let gain = number(&texts[4], "with the other table: ", " % range");
    assert!(gain > 0.0 && texts[4].contains("(90 %:"), "{}", texts[4]);
    std::fs::remove_dir_all(&work).expect("removed");
}

/// L/D of the sea mission with one pitch held that is best by a vehicle file, in a world.
fn held_at_the_best_pitch_of(vehicle: &Path, truth: &Path) -> f64 {
    let model = Model::load(vehicle, None).expect("a vehicle");
    let best = tables::build(&model, model.wings, 0, 0).expect("a table").spec;
    let mut mission = Mission { wings: model.wings, ..mission_file::built_in("sea").expect("built in") };
    let goal = Goal::FixedPitch { pitch_rad: (1.0 / f64::from(best.best_l_over_d)).atan() as f32 - best.best_alpha_rad };
    mission.legs.iter_mut().for_each(|leg| leg.goal = goal);
    let mut world = World::new(worlds::overlay(&worlds::for_mission(&mission), truth).expect("a truth")).expect("a world");
    fly(&mut world, &mut Link::new(InProcess::default()), &Setup::new(mission), &mut |_| Ok(())).expect("flies").achieved_l_over_d()
}

#[test]
fn accuracy_the_gain_of_a_pitch_and_of_a_mission_are_in_their_intervals() {
    let work = empty("gain");
    for (hidden, size) in [("climb_drag", 0.4), ("drag_level_error", 0.4)] {
        std::fs::write(work.join("truth.toml"), format!("[[effects]]\nkind = \"{hidden}\"\nvalue = {size}\n")).expect("written");
        let json = |line: &str| -> Value { serde_json::from_str(&run(&format!("glider {line} --json --force"), &work)).expect("JSON") };
        json("fly --mission sweep --truth truth.toml --log flown");
        let worth = json("diagnose --flight flown")["worth"].clone();
        json(&format!("add {hidden} --flight flown --out learnt.json"));
        let mission = json("fly --mission sea --truth truth.toml --table learnt.json --beside flown/vehicle.json");
        let drawn = json("fly --mission sea --world learnt.json --table learnt.json --beside flown/vehicle.json");
        let number = |v: &Value| v.as_f64().expect("a number");
        let [old, new] = ["flown/vehicle.json", "learnt.json"].map(|v| held_at_the_best_pitch_of(&work.join(v), &work.join("truth.toml")));
        println!("{hidden}: held {:.4}, said {worth}; mission {} of {}", new / old - 1.0, mission["range_gain"], drawn["range_gain_90"]);
        // Turns and the ends of a dive are no steady glide.
        let [low, high] = ["low", "high"].map(|end| number(&worth[end]));
        assert!((low - 0.01..=high + 0.01).contains(&(new / old - 1.0)), "{hidden}: {new} over {old}, said {worth}");
        let [low, high] = [0, 1].map(|end| number(&drawn["range_gain_90"][end]));
        assert!((low - 0.01..=high + 0.01).contains(&number(&mission["range_gain"])), "{hidden}: {mission}\n{drawn}");
        std::fs::remove_dir_all(work.join("flown")).expect("removed");
    }
    std::fs::remove_dir_all(&work).expect("removed");
}

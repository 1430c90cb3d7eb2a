//! `glider replay` and `glider what-if` on flights with a hidden truth, as a user asks them.

use serde_json::Value;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};

const MISSION: &str =
    "wings = \"standard\"\nmax_duration_h = 24.0\nsurface_every = 1\n\n[[leg]]\ndives = 10\ndepth_min_m = 5.0\ndepth_max_m = 120.0\n";

struct Bench(PathBuf);

impl Bench {
    fn new(name: &str) -> Self {
        let root = std::env::temp_dir().join(format!("glider-otherwise-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&root).expect("a folder");
        std::fs::write(root.join("ten.toml"), MISSION).expect("written");
        Self(root)
    }

    fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_glider"));
        command.args(line.split(' ')).current_dir(&self.0);
        command
    }

    fn json(&self, line: &str) -> (i32, Value) {
        let out = self.command(line).arg("--json").output().expect("runs");
        let document =
            serde_json::from_slice(&out.stdout).unwrap_or_else(|e| panic!("{line}: {e}, {}", String::from_utf8_lossy(&out.stderr)));
        (out.status.code().expect("a code"), document)
    }

    /// Flies the ten dives in a world with a hidden effect.
    fn fly(&self, effect: &str, size: f64, seed: u64) -> String {
        let truth = format!("[ocean]\nbackground_rms_m_s = 0.004\n[[effects]]\nkind = \"{effect}\"\nvalue = {size}\n");
        std::fs::write(self.0.join("truth.toml"), truth).expect("written");
        let (code, _) = self.json(&format!("fly --mission ten.toml --truth truth.toml --seed {seed} --log {effect}"));
        assert_eq!(code, 0, "{effect}");
        effect.to_owned()
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).ok();
    }
}

/// Effects of drag, lift, sensors, buoyancy and water, the vehicle file knowing nothing of them.
#[test]
fn accuracy_a_refitted_world_does_as_the_log_in_nine_of_ten_dives() {
    let bench = Bench::new("reproduced");
    let hidden = [
        ("drag_level_error", 0.3),
        ("pitch_offset", 0.02),
        ("ballast_scale", 0.06),
        ("reynolds_drag", 0.5),
        ("horizontal_current", 0.15),
        ("internal_wave", 0.015),
    ];
    let (mut dives, mut inside) = (0, [0, 0]);
    for (seed, (effect, size)) in (1..).zip(hidden) {
        let (_, said) = bench.json(&format!("what-if {}", bench.fly(effect, size, seed)));
        let r = &said["reproduced"];
        let n = |key: &str| r[key].as_u64().expect(key);
        println!("{effect}: {} of {} in depth and time, {} in way", n("in_depth_and_time"), n("dives"), n("in_way"));
        dives += n("dives");
        inside = [inside[0] + n("in_depth_and_time"), inside[1] + n("in_way")];
    }
    assert!(dives >= 50 && inside.iter().all(|i| 10 * i >= 9 * dives), "{inside:?} of {dives}");
}

/// What another mission changes in the refitted world is what it changes in the hidden one: the 90 % interval held in three of these four
/// (not where the lift is wrong).
#[test]
fn accuracy_what_another_mission_changes_is_what_the_hidden_world_says() {
    let bench = Bench::new("gain");
    let steep = format!("{MISSION}goal = \"fixed-pitch\"\npitch_deg = 35.0\n");
    std::fs::write(bench.0.join("steep.toml"), steep).expect("written");
    let mut held = 0;
    for (effect, size) in [("drag_level_error", 0.6), ("reynolds_drag", 0.3), ("pitch_offset", 0.02), ("lift_slope_error", -0.2)] {
        let (_, said) = bench.json(&format!("what-if {} --mission steep.toml", bench.fly(effect, size, 11)));
        let figures = said["figures"].as_array().expect("figures");
        let distance = figures.iter().find(|f| f["figure"] == "distance").expect("a distance");
        let flown = |mission: &str| {
            let (_, flown) = bench.json(&format!("fly --mission {mission} --truth truth.toml --seed 99"));
            flown["distance_m"].as_f64().expect("a distance")
        };
        let truth = flown("steep.toml") - flown("ten.toml");
        let [low, high] = ["low", "high"].map(|k| distance["difference"][k].as_f64().expect("an interval"));
        println!("{effect}: difference {low:.0} to {high:.0} m, in the hidden world {truth:.0} m");
        held += usize::from((low..=high).contains(&truth) && high < 0.0);
    }
    assert!(held >= 3, "{held} of 4");
}

#[test]
fn a_fault_ends_the_flights_that_it_strikes_and_a_page_has_both() {
    let bench = Bench::new("fault");
    let flight = bench.fly("pitch_offset", 0.01, 3);
    let (_, said) = bench.json(&format!("what-if {flight} --fault pump:stuck@climb+60s --worlds 4 --out page.html"));
    let ends: Vec<&str> = said["ends"]["changed"].as_array().expect("ends").iter().filter_map(|e| e["end"].as_str()).collect();
    assert!(ends.iter().all(|e| e.starts_with("safe: PumpStuck")) && !ends.is_empty(), "{ends:?}");
    let page = std::fs::read_to_string(bench.0.join("page.html")).expect("a page");
    assert!(page.contains("refitted, changed") && page.contains("recorded"));
}

#[test]
fn replay_by_command_finds_the_table_that_changed_the_orders() {
    let bench = Bench::new("replay");
    let flight = bench.fly("drag_level_error", 0.2, 5);
    for (vehicle, folder) in [("slocum-standard-sea", "as_built"), ("slocum-standard", "of_literature")] {
        assert_eq!(bench.json(&format!("table --vehicle {vehicle} --out {folder}")).0, 0);
    }
    let (code, said) = bench.json(&format!("replay {flight}"));
    assert!(code == 0 && said["differing"] == 0 && said["cycles"].as_u64() > Some(3000), "{said:#}");
    let (code, said) = bench.json(&format!("replay {flight} --table of_literature/standard.bin"));
    assert!(code == 1 && said["first"]["signals"][0]["signal"] == "table in use" && said["first_order_s"].is_number(), "{said:#}");
    let row = "as_built/standard.bin,as_built/standard.bin,of_literature/standard.bin,of_literature/standard.bin";
    let (code, said) = bench.json(&format!("replay {flight} --bisect {row}"));
    assert!(code == 0 && said["found"] == "of_literature/standard.bin" && said["before_it"] == "as_built/standard.bin", "{said:#}");
    let (code, said) = bench.json(&format!("replay {flight} --at 600 --cycles 2 --watch est_depth_m-m_depth_m"));
    let off = said["cycles"][0]["watched"]["est_depth_m-m_depth_m"].as_f64().expect("a number");
    assert!(code == 0 && off.abs() < 0.5 && said["cycles"].as_array().map(Vec::len) == Some(2), "{said:#}");
    let mut prompt = bench.command(&format!("replay {flight} --step"));
    let mut child = prompt.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("starts");
    child.stdin.take().expect("open").write_all(b"go 1200\nnext 2\nuntil est_depth_m - 50\nwatch nothing\nquit\n").expect("written");
    let out = String::from_utf8(child.wait_with_output().expect("ends").stdout).expect("text");
    assert!(out.contains("    300     1200 ") && out.contains("`nothing` is no signal"), "{out}");
}

/// An image states its version of the line, a commit's sources do, a program of another version answers in its own.
#[test]
#[cfg(unix)]
fn replay_by_a_law_of_another_wire_says_both_versions_at_once() {
    use std::os::unix::fs::PermissionsExt as _;
    let bench = Bench::new("wire");
    let flight = bench.fly("pitch_offset", 0.01, 3);
    let write = |name: &str, text: &str| {
        std::fs::create_dir_all(bench.0.join(name).parent().expect("a folder")).expect("made");
        std::fs::write(bench.0.join(name), text).expect("written");
    };
    write("firmware/signals/src/link.rs", "pub const WIRE_VERSION: u8 = 3;\n");
    for line in ["init -q .", "add firmware", "-c user.name=a -c user.email=a@b commit -q -m law"] {
        assert!(Command::new("git").args(line.split(' ')).current_dir(&bench.0).status().expect("git").success(), "{line}");
    }
    // Version 3, a byte 7 and their CRC-32, as a frame.
    let crc = signals::link::CRC32.checksum(&[3, 7]).to_le_bytes();
    assert!(!crc.contains(&0), "a frame without zeros is its length and its bytes");
    let frame: String = [7, 3, 7].iter().chain(&crc).chain(&[0]).map(|b| format!("\\{b:03o}")).collect();
    write("other.sh", &format!("#!/bin/sh\nhead -c 1 >/dev/null\nprintf '{frame}'\nexec sleep 20\n"));
    std::fs::set_permissions(bench.0.join("other.sh"), std::fs::Permissions::from_mode(0o755)).expect("a program");
    for law in ["HEAD", "./other.sh"] {
        let asked = std::time::Instant::now();
        let (code, said) = bench.json(&format!("replay {flight} --law {law}"));
        let words = said["error"].as_str().unwrap_or_default();
        assert!(code == 2 && words.contains("wire version 3, this program version"), "{law}: {said}");
        assert!(asked.elapsed().as_secs() < 3, "{law}");
    }
}

/// The sources of this very tree, with a change of the law between two that change nothing: three laws are built.
#[test]
#[ignore = "builds three laws: a minute of two cores"]
fn replay_by_commits_finds_the_one_that_changed_the_orders() {
    let bench = Bench::new("commits");
    let flight = bench.fly("drag_level_error", 0.2, 5);
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace");
    let sources = bench.0.join("sources");
    let git = |words: &[&str]| {
        let name = ["-c", "user.name=a", "-c", "user.email=a@b"];
        let out = Command::new("git").current_dir(&sources).args(name).args(words).output().expect("git");
        assert!(out.status.success(), "{words:?}: {}", String::from_utf8_lossy(&out.stderr));
    };
    std::fs::create_dir_all(&sources).expect("a folder");
    git(&["clone", "--quiet", "--local", &root.to_string_lossy(), "."]);
    git(&["tag", "first"]);
    let control = sources.join("firmware/control/src/lib.rs");
    let law = std::fs::read_to_string(&control).expect("the law");
    let changed = law.replace("const ENTRY_S: f32 = 20.0;", "const ENTRY_S: f32 = 28.0;");
    assert_ne!(law, changed);
    std::fs::write(&control, changed).expect("written");
    git(&["commit", "-qam", "control: enter the glide later"]);
    std::fs::write(sources.join("README.md"), "Another page.\n").expect("written");
    git(&["commit", "-qam", "docs: another page"]);
    let line = format!("replay {} --bisect first..HEAD --json", bench.0.join(flight).display());
    let out = bench.command(&line).current_dir(&sources).output().expect("runs");
    let said: Value = serde_json::from_slice(&out.stdout).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&out.stderr)));
    assert!(said["found"].as_str().is_some_and(|f| f.contains("enter the glide later")), "{said:#}");
}

//! Bad input through the real program: exit code 2, exactly one line, naming
//! what is wrong; and a log that survives its flight.

use rig::seats::pty::Terminal;
use signals::link::{CRC32, WIRE_VERSION};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The `glider` program beside this test's own target directory.
fn glider() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    let profile = test.ancestors().nth(2).unwrap();
    let program = profile.join("glider");
    // Built by `cargo test --workspace`; `cargo test -p tests` alone does not build another package's program.
    assert!(program.is_file(), "{} is not built; run: cargo build -p hil-host (same profile)", program.display());
    program
}

fn run(args: &[&str]) -> Output {
    Command::new(glider()).args(args).output().unwrap()
}

fn refused(args: &[&str], words: &[&str]) {
    let out = run(args);
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{args:?}: {said}");
    assert!(out.stdout.is_empty(), "{args:?} printed on stdout");
    assert_eq!(said.trim_end().lines().count(), 1, "{args:?} said more than one line: {said}");
    for word in words {
        assert!(said.contains(word), "{args:?}: no \"{word}\" in: {said}");
    }
}

fn scratch(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("glider-bad-input-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&dir);
    std::fs::create_dir_all(&dir).unwrap();
    dir
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_missing_mission_file_and_a_wrong_key_are_named() {
    refused(&["fly", "--mission", "nowhere.toml"], &["nowhere.toml", "shallow"]);
    let dir = scratch("mission");
    let file = dir.join("m.toml");
    std::fs::write(&file, "[[leg]]\ndepth_max_m = 9000\n").unwrap();
    refused(&["fly", "--mission", text(&file)], &["m.toml:2:15", "depth_max_m"]);
    let truth = dir.join("t.toml");
    std::fs::write(&truth, "[vehicle]\nmass_kg = \"heavy\"\n").unwrap();
    refused(&["fly", "--truth", text(&truth)], &["t.toml:2:11", "a number"]);
}

#[test]
fn an_unknown_port_fault_wing_or_pace_is_named() {
    refused(&["fly", "--seat", "/dev/no-such-port"], &["/dev/no-such-port", "--seat"]);
    refused(&["monitor", "/dev/no-such-port"], &["/dev/no-such-port"]);
    refused(&["fly", "--fault", "depth:melted"], &["melted", "stuck"]);
    refused(&["fly", "--wings", "none"], &["low-ar"]);
    refused(&["fly", "--realtime", "0"], &["--realtime"]);
    refused(&["faults", "--only", "no such fault"], &["no such fault"]);
}

#[test]
fn a_machine_without_qemu_or_image_is_told_what_to_install() {
    let dir = scratch("qemu");
    let image = dir.join("image.elf");
    std::fs::write(&image, "\u{7f}ELF, as an image begins").unwrap();
    let out = Command::new(glider()).args(["fly", "--seat", "qemu", "--elf", text(&image)]).env("PATH", &dir).output().unwrap();
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{said}");
    assert!(said.contains("qemu-system-arm") && said.contains("pty") && said.trim_end().lines().count() == 1, "{said}");
    refused(&["fly", "--seat", "qemu", "--elf", "no-such-image"], &["no-such-image", "scripts/build-firmware"]);
}

#[test]
fn a_board_of_another_protocol_version_is_named() {
    let terminal = Terminal::serve(|_, out| {
        let body = [WIRE_VERSION + 1, 1];
        let mut raw = body.to_vec();
        raw.extend_from_slice(&CRC32.checksum(&body).to_le_bytes());
        out.push(raw.len() as u8 + 1);
        out.extend_from_slice(&raw);
        out.push(0);
    })
    .unwrap();
    refused(&["fly", "--seat", &terminal.name], &[&format!("version {}", WIRE_VERSION + 1), "flash"]);
}

#[test]
fn a_flight_is_never_overwritten_and_an_unplugged_one_keeps_its_log() {
    let dir = scratch("log");
    let log = dir.join("flight");
    let out = run(&["fly", "--log", text(&log), "--json"]);
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    let summary: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(summary["dives"], 4);
    refused(&["fly", "--log", text(&log)], &["never overwritten"]);

    // The board dies after 100 answers.
    let mut board = rig::seats::in_process::Board::default();
    let mut answers = 0;
    let terminal = Terminal::serve(move |bytes, out| {
        board.take(bytes, |answer| {
            answers += 1;
            if answers <= 100 {
                out.extend_from_slice(answer);
            }
        });
    })
    .unwrap();
    let cut = dir.join("cut");
    refused(&["fly", "--seat", &terminal.name, "--log", text(&cut)], &["no answer", "kept in"]);
    let flight = logs::record::csv::flight(&cut).unwrap();
    assert!(flight.len() > 90 && flight.len() < 100, "{} rows", flight.len());
}

#[test]
fn a_log_is_a_flight_in_the_one_format() {
    let dir = scratch("format");
    let log = dir.join("flight");
    assert_eq!(run(&["fly", "--log", text(&log)]).status.code(), Some(0));
    let flight = logs::record::csv::flight(&log).unwrap();
    let vehicle = logs::vehicle::read(&log.join("vehicle.json")).unwrap();
    assert!(flight.len() > 200);
    assert_eq!(flight.segment.iter().max(), Some(&3), "four dive cycles");
    assert_eq!((vehicle.fit_segments, vehicle.check_segments), (vec![0, 1, 3], vec![2]));
    for column in ["phase", "table_id", "c_ballast_cc", "est_alpha_rad", "truth_alpha_rad"] {
        assert!(flight.extra.contains_key(column), "{column}");
    }
    let deepest = flight.pressure_pa.iter().copied().filter(|p| p.is_finite()).fold(0.0, f64::max);
    // 27 m of fresh water is 2.65e5 Pa; a metre either side for the turn.
    assert!((2.45e5..2.75e5).contains(&deepest), "{deepest} Pa");
}

//! Programs killed while they write: a file is there whole, or as it was before, or not at all.
//!
//! GLIDER_KILLS says how many kills (default 60; the full campaign 1 000).

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn glider(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_glider"));
    command.current_dir(folder).args(args).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

fn run(folder: &Path, args: &[&str]) -> Duration {
    let started = Instant::now();
    let code = glider(folder, args).status().expect("runs").code();
    assert!(code.is_some_and(|c| c < 2), "{args:?}: {code:?}");
    started.elapsed()
}

/// A log of many rows, so that there is something to cut.
fn long_log(folder: &Path) {
    let mut text = String::from("time_s,segment,pressure_dbar,m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3\n");
    for i in 0..60_000_u32 {
        let phase = f64::from(i % 400) / 200.0;
        let down = phase < 1.0;
        let depth = 2.0 + 60.0 * (1.0 - (phase - 1.0).abs());
        let (pitch, ballast) = if down { (-0.4, -200) } else { (0.4, 200) };
        text += &format!("{},0,{depth:.3},{pitch},{ballast},1025.1\n", 4 * i);
    }
    std::fs::write(folder.join("log.csv"), text).expect("written");
}

/// Files of a folder by name, or the file itself; what is still being made is nobody's file.
fn files(path: &Path) -> Vec<PathBuf> {
    if !path.is_dir() {
        return if path.exists() { vec![path.to_path_buf()] } else { Vec::new() };
    }
    let entries = std::fs::read_dir(path).expect("a folder").flatten().map(|e| e.path());
    let mut all: Vec<PathBuf> = entries.flat_map(|p| files(&p)).collect();
    all.retain(|p| !p.file_name().unwrap_or_default().to_string_lossy().ends_with(".part"));
    all.sort();
    all
}

/// Whether a file has its end, by its kind.
fn is_whole(path: &Path) -> bool {
    let bytes = std::fs::read(path).expect("reads");
    let text = || std::str::from_utf8(&bytes).unwrap_or_default();
    match path.extension().and_then(|e| e.to_str()).unwrap_or_default() {
        "csv" => {
            let rows: Vec<&str> = text().lines().collect();
            let fields = rows.first().map_or(0, |r| r.split(',').count());
            bytes.ends_with(b"\n") && rows.len() > 1 && rows.iter().all(|r| r.split(',').count() >= fields.min(2))
        }
        "json" => serde_json::from_slice::<serde_json::Value>(&bytes).is_ok(),
        "toml" => bytes.ends_with(b"\n") && toml::from_str::<toml::Table>(text()).is_ok_and(|t| !t.is_empty()),
        "html" => text().trim_end().ends_with("</html>"),
        "svg" => text().trim_end().ends_with("</svg>"),
        "png" => bytes.windows(4).rev().take(16).any(|w| w == b"IEND"),
        "parquet" => bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"),
        "mcap" => bytes.starts_with(b"\x89MCAP") && bytes.ends_with(b"\x89MCAP0\r\n"),
        // The end of an HDF5 file stands in its superblock (version 2 and 3: bytes 28 to 35; 0: 40 to 47).
        "nc" => {
            let end = |at: usize| bytes.get(at..at + 8).map_or(0, |b| u64::from_le_bytes(b.try_into().expect("8 bytes")));
            bytes.starts_with(b"\x89HDF") && [28, 40].iter().any(|at| end(*at) == bytes.len() as u64)
        }
        "bin" if path.ends_with("frames.bin") => rig::flight::frames::read(path).is_ok(),
        "bin" => polar::Table::parse(&bytes, signals::Wings::Standard).is_ok(),
        _ => true,
    }
}

/// Every command that writes, what it writes, and how many of its kills there are in a hundred.
const WRITERS: [(&[&str], &str, u32); 13] = [
    (&["import", "log.csv", "--out", "imported"], "imported", 14),
    (&["export", "log.csv", "--to", "csv", "--out", "out.csv"], "out.csv", 8),
    (&["export", "log.csv", "--to", "parquet", "--out", "out.parquet"], "out.parquet", 8),
    (&["export", "log.csv", "--to", "netcdf", "--out", "out.nc"], "out.nc", 8),
    (&["export", "log.csv", "--to", "mcap", "--out", "out.mcap"], "out.mcap", 8),
    (&["fly", "--log", "logged"], "logged", 16),
    (&["table", "--vehicle", concat!(env!("CARGO_MANIFEST_DIR"), "/../vehicles/slocum-standard-sea.toml"), "--out", "tables"], "tables", 8),
    (&["add", "drag_level_error", "--flight", "flown", "--out", "added.json"], "added.json", 5),
    (&["report", "--flight", "flown", "--out", "page.html"], "page.html", 5),
    (&["plot", "flight", "--flight", "flown", "--out", "picture.png"], "picture.png", 5),
    (&["plot", "flight", "--flight", "flown", "--out", "picture.svg"], "picture.svg", 5),
    (&["diagnose", "--quick", "--flight", "flown", "--predict", "after.csv"], "after.csv", 4),
    (&["faults", "--healthy", "8", "--resume", "--out", "campaign.json"], "campaign.json", 6),
];

fn scratch() -> PathBuf {
    let folder = std::env::temp_dir().join(format!("glider-killed-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// Kills at a moment of the run, or as soon as something is being written.
fn kill(mut child: Child, folder: &Path, out: &Path, after: Duration, at_writing: bool) {
    let started = Instant::now();
    if at_writing {
        let writing = || {
            let parts =
                |f: &Path| std::fs::read_dir(f).is_ok_and(|d| d.flatten().any(|e| e.file_name().to_string_lossy().ends_with(".part")));
            parts(folder) || (out.is_dir() && parts(out))
        };
        while !writing() && child.try_wait().expect("a child").is_none() && started.elapsed() < Duration::from_secs(60) {
            std::thread::yield_now();
        }
        std::thread::sleep(after);
    } else {
        std::thread::sleep(after);
    }
    let _ = child.kill();
    let _ = child.wait();
}

#[test]
fn regress_a_killed_writer_leaves_whole_files_or_none() {
    let kills: u32 = std::env::var("GLIDER_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(60);
    let folder = scratch();
    long_log(&folder);
    run(&folder, &["fly", "--log", "flown", "--seed", "3"]);
    let (mut killed, mut cut, mut torn) = (0, 0, Vec::new());
    for (args, out, percent) in WRITERS {
        let took = run(&folder, args);
        let out = folder.join(out);
        let whole = files(&out);
        let bytes: Vec<Vec<u8>> = whole.iter().map(|f| std::fs::read(f).expect("reads")).collect();
        assert!(!whole.is_empty() && whole.iter().all(|f| is_whole(f)), "{args:?} as it is: {whole:?}");
        let turns = (kills * percent / 100).max(2);
        for turn in 0..turns {
            let _ = if out.is_dir() { std::fs::remove_dir_all(&out) } else { std::fs::remove_file(&out) };
            // Every second time something stands there already, where a file may be replaced.
            let import = args[0] == "import";
            let old = turn % 2 == 1 && (import || out.extension().is_some());
            let mut all: Vec<&str> = args.to_vec();
            if old && import {
                std::fs::create_dir(&out).expect("a folder");
                whole.iter().zip(&bytes).for_each(|(f, b)| std::fs::write(f, b).expect("written"));
            } else if old {
                std::fs::write(&out, "old").expect("written");
            }
            all.extend(old.then_some("--force"));
            // From the start to a little beyond the usual end, or within three thousandths of a second of writing.
            let share = f64::from(turn) / f64::from(turns);
            let at_writing = turn % 4 < 2;
            let after = if at_writing { Duration::from_secs_f64(3e-3 * share) } else { took.mul_f64(1.1 * share) };
            let child = glider(&folder, &all).spawn().expect("runs");
            let id = child.id();
            kill(child, &folder, &out, after, at_writing);
            killed += 1;
            // Between two renames the old folder lies beside.
            let aside = folder.join(format!(".imported.{id}.old"));
            let there = files(if import && !out.exists() && aside.exists() { &aside } else { &out });
            let as_it_was = old && std::fs::read(&out).is_ok_and(|b| b == b"old");
            if !(as_it_was || there.iter().all(|f| is_whole(f)) && (!old || !there.is_empty())) {
                torn.push(format!("{args:?}, kill {turn}: {there:?}"));
            }
            // A folder of an import is there with all its files or not at all.
            if import && !there.is_empty() && there.len() != whole.len() {
                torn.push(format!("{args:?}, kill {turn}: {} files of {}", there.len(), whole.len()));
            }
            cut += u32::from(as_it_was || there.len() < whole.len());
            for part in std::fs::read_dir(&folder).expect("a folder").flatten().map(|e| e.path()) {
                if [".part", ".old"].iter().any(|end| part.to_string_lossy().ends_with(end)) {
                    let _ = if part.is_dir() { std::fs::remove_dir_all(&part) } else { std::fs::remove_file(&part) };
                }
            }
        }
    }
    std::fs::remove_dir_all(&folder).expect("removed");
    eprintln!("{killed} kills, {cut} before the end, {} torn", torn.len());
    assert!(torn.is_empty(), "{} torn of {killed}: {torn:#?}", torn.len());
    assert!(cut > killed / 4, "only {cut} of {killed} kills came before the end");
}

/// A flight killed in the air is no flight until its journal is named; its rows are all there.
#[test]
fn regress_a_killed_flight_does_not_pose_as_finished() {
    let folder = scratch().join("flight");
    std::fs::create_dir_all(&folder).expect("a folder");
    let mut child = glider(&folder, &["fly", "--log", "cut", "--realtime", "400"]).spawn().expect("flies");
    let journal = folder.join("cut/flight.csv.unfinished");
    let lines = |p: &Path| std::fs::read_to_string(p).map_or(0, |t| t.lines().count());
    let started = Instant::now();
    while lines(&journal) < 40 && started.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(10));
    }
    let _ = child.kill();
    let _ = child.wait();
    let refused = |args: &[&str]| {
        let out = glider(&folder, args).stderr(Stdio::piped()).output().expect("runs");
        assert_eq!(out.status.code(), Some(2), "{args:?}");
        String::from_utf8_lossy(&out.stderr).into_owned()
    };
    let said = refused(&["compare", "--flight", "cut"]);
    assert!(said.contains("not finished") && said.contains("flight.csv.unfinished"), "{said}");
    let said = refused(&["fly", "--log", "cut"]);
    assert!(said.contains("never overwritten"), "{said}");
    let kept = logs::record::csv::flight(&journal).expect("all its rows");
    assert!(kept.len() >= 39 && kept.len() == lines(&journal) - 1, "{} rows", kept.len());
    let vehicle: serde_json::Value =
        serde_json::from_slice(&std::fs::read(folder.join("cut/vehicle.json")).expect("there")).expect("whole");
    assert!(vehicle.get("flight").is_none(), "the end of a flight that has none: {}", vehicle["flight"]);
}

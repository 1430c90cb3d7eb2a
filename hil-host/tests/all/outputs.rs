//! What a command takes and gives: memory, outputs on a full disk or a pipe, inputs that have no end.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn glider(line: &str, work: &Path) -> Command {
    let mut glider = Command::new(env!("CARGO_BIN_EXE_glider"));
    glider.args(line.split_whitespace()).current_dir(work).stdin(Stdio::null());
    glider
}

/// A folder with a flight in `flight`.
fn folder(name: &str) -> Folder {
    let folder = Folder(std::env::temp_dir().join(format!("glider-{name}-{}", std::process::id())));
    std::fs::create_dir_all(&folder.0).expect("a temporary folder");
    assert!(glider("fly --mission shallow --log flight", &folder.0).output().expect("it starts").status.success());
    folder
}

/// Most memory that a program has had in use so far, kB.
fn peak_kb_of(child: &Child) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
    status.lines().find_map(|l| l.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok()).unwrap_or(0)
}

/// Diagnoses a flight and holds the peak of its memory against its bound: four times the flight, 60 MB, and 5 MB for the heaps of the
/// threads that run it (8 MB more on two cores than with one heap for all).
fn holds_its_bound(flight: &str, work: &Path) {
    let log = logs::record::csv::flight(&work.join(flight)).expect("flown or imported");
    // Twelve channels of numbers, the segments, and what the format does not name.
    let flight_kb = log.len() as u64 * (8 * (11 + log.extra.len() as u64) + 4) / 1000;
    let mut child = glider(&format!("diagnose --flight {flight}"), work).stdout(Stdio::null()).spawn().expect("it starts");
    let mut peak_kb = 0;
    let ended = loop {
        peak_kb = peak_kb.max(peak_kb_of(&child));
        match child.try_wait().expect("our own child") {
            Some(status) => break status,
            None => std::thread::sleep(Duration::from_millis(5)),
        }
    };
    eprintln!("{flight}: flight {flight_kb} kB, peak {peak_kb} kB");
    assert!(ended.code().is_some_and(|c| c < 2) && peak_kb > 10_000, "{ended}");
    assert!(peak_kb < 4 * flight_kb + 65_000, "{flight}: {peak_kb} kB for a flight of {flight_kb} kB");
}

/// Every hypothesis kept its own copy of 27 sensitivities: 501 MB for this flight.
#[test]
fn regress_memory_of_a_diagnosis_is_bounded_by_its_flight() {
    let folder = folder("memory");
    std::fs::write(folder.0.join("long.toml"), "[[leg]]\ndives = 60\ndepth_min_m = 3.0\ndepth_max_m = 100.0\n").expect("written");
    assert!(glider("fly --mission long.toml --log long", &folder.0).output().expect("it starts").status.success());
    holds_its_bound("long", &folder.0);
}

/// The inputs of a long dive, 35,000 half steps, were kept twelve times: 65 MB for this one.
#[test]
fn regress_memory_of_a_diagnosis_is_bounded_in_a_long_dive() {
    let Some(flights) = std::env::var_os("GLIDER_FLIGHTS") else {
        eprintln!("SKIPPED LOUDLY: no GLIDER_FLIGHTS with flights of real gliders");
        return;
    };
    let folder = folder("dive");
    let dive = Path::new(&flights).join("seaglider_sg561/p5610009.nc");
    assert!(glider(&format!("import {} --out dive", dive.display()), &folder.0).output().expect("it starts").status.success());
    holds_its_bound("dive", &folder.0);
}

/// Commands that print, those that end at once first.
const PRINT: [&str; 16] = [
    "--help",
    "--version",
    "fly --help",
    "list effects",
    "list effects --json",
    "completions bash",
    "polar",
    "table",
    "power",
    "fly --mission shallow",
    "compare --flight flight",
    "compare --flight flight --json",
    "diagnose --quick --flight flight",
    "monitor flight",
    "compare --flight nowhere --json",
    "surfacing flight/flight.csv",
];

#[test]
fn regress_a_full_disk_behind_the_output_is_exit_code_2() {
    let folder = folder("full");
    let mut bad = String::new();
    for line in PRINT {
        let full = std::fs::File::options().write(true).open("/dev/full").expect("Linux has it");
        let out = glider(line, &folder.0).stdout(full).output().expect("it starts");
        let said = String::from_utf8_lossy(&out.stderr);
        if out.status.code() != Some(2) || said.contains("panicked") {
            bad += &format!("glider {line}: {:?}\n{said}\n", out.status.code());
        }
    }
    assert!(bad.is_empty(), "{bad}");
    let mut cut = glider("list effects", &folder.0).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    drop(cut.stdout.take());
    let out = cut.wait_with_output().expect("it ends");
    assert!(out.status.success() && out.stderr.is_empty(), "{out:?}");
}

#[test]
fn regress_monitor_tells_a_pipe_what_comes() {
    let folder = folder("piped");
    let rows = std::fs::read_to_string(folder.0.join("flight/flight.csv")).expect("flown above");
    let half: Vec<&str> = rows.lines().take(200).collect();
    std::fs::create_dir_all(folder.0.join("under_way")).expect("a folder");
    std::fs::write(folder.0.join("under_way/flight.csv.unfinished"), half.join("\n") + "\n").expect("written");
    for (line, says) in [("monitor under_way", " m, pitch "), ("monitor under_way --json", "\"depth_m\":")] {
        let mut child = glider(line, &folder.0).stdout(Stdio::piped()).spawn().expect("it starts");
        let out = child.stdout.take().expect("piped");
        let (sender, lines) = std::sync::mpsc::channel();
        std::thread::spawn(move || BufReader::new(out).lines().map_while(Result::ok).take(2).for_each(|l| drop(sender.send(l))));
        let first: Vec<_> = (0..2).map_while(|_| lines.recv_timeout(Duration::from_secs(20)).ok()).collect();
        child.kill().expect("it goes on");
        let _ = child.wait();
        assert!(first.len() == 2 && first.iter().all(|l| l.contains(says)), "{line}: {first:?}");
    }
}

/// Commands that read a file which has no end.
const ENDLESS: [&str; 10] = [
    "compare --flight /dev/zero --vehicle flight/vehicle.json",
    "diagnose --flight flight --vehicle /dev/zero",
    "compare --flight PIPE --vehicle flight/vehicle.json",
    "fly --mission /dev/zero",
    "fly --mission PIPE",
    "fly --truth /dev/zero",
    "fly --config PIPE",
    "fly --table /dev/zero",
    "import /dev/zero --out imported",
    "timeline /dev/zero --vehicle flight/vehicle.json",
];

#[test]
fn regress_inputs_without_an_end_are_refused_by_name_and_bound() {
    let folder = folder("endless");
    assert!(Command::new("mkfifo").arg("PIPE").current_dir(&folder.0).status().expect("mkfifo").success());
    let mut bad = String::new();
    for line in ENDLESS {
        let began = Instant::now();
        let mut child = glider(line, &folder.0).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
        let mut peak_kb = 0;
        let ended = loop {
            peak_kb = peak_kb.max(peak_kb_of(&child));
            match child.try_wait().expect("our own child") {
                Some(status) => break status.code(),
                None if began.elapsed() > Duration::from_secs(20) || peak_kb > 500_000 => {
                    child.kill().expect("it goes on");
                    let _ = child.wait();
                    break None;
                }
                None => std::thread::sleep(Duration::from_millis(5)),
            }
        };
        let mut said = String::new();
        let _ = std::io::Read::read_to_string(&mut child.stderr.take().expect("piped"), &mut said);
        let named = ["/dev/zero", "PIPE"].iter().any(|n| line.contains(n) && said.contains(n));
        if ended != Some(2) || !named || !said.contains("no regular file") || peak_kb > 60_000 {
            bad += &format!("glider {line}: {ended:?}, {peak_kb} kB\n{said}\n");
        }
    }
    assert!(bad.is_empty(), "{bad}");
}

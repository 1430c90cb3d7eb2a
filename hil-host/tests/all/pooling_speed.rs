//! What it costs to pool the table of a fleet: time and memory for 1, 100 and 10,000 dives. The tables are made, not flown.
//!
//! `cargo test --release -p hil-host pooling_speed:: -- --nocapture` prints the numbers of docs/fleet.md.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use hil_host::fleet::part::{DiveRow, Part, Row, number_columns};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

/// Vehicles, deployments of each, dives of each.
type Shape = [usize; 3];

/// A table in which every number scatters by its noise, and drag is a tenth of it off in all vehicles.
fn made([vehicles, deployments, dives]: Shape) -> Part {
    let columns = number_columns();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut unit = || (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    let mut rows = Vec::new();
    for v in 0..vehicles {
        for d in 0..deployments {
            for k in 0..dives {
                let number = |name: &String| match name.rsplit_once('_').map_or("", |n| n.1) {
                    "noise" => 0.5 + unit(),
                    "calibration" | "model" => 0.1,
                    _ if name.starts_with("information") => f64::from(u8::from(is_diagonal(name))),
                    _ => 2.0 * unit() - 1.0 + f64::from(u8::from(name == "drag")),
                };
                let numbers = columns.iter().map(number).collect();
                let dive = DiveRow { dive: k as i32 + 1, segment: k as i32, rows: 500, numbers };
                let (vehicle, deployment) = (format!("unit_{v} 0123abcd"), format!("fleet/unit_{v}/{d}"));
                rows.push(Row { vehicle, deployment, flight: "flight".into(), left_out: String::new(), dive });
            }
        }
    }
    Part::new(None, rows)
}

fn is_diagonal(column: &str) -> bool {
    let names = column.trim_start_matches("information_");
    names.len() % 2 == 1 && names.split_at(names.len() / 2).0 == &names[names.len() / 2 + 1..]
}

/// Most memory that a process has had so far, MiB; none where there is no /proc.
fn peak_mib(pid: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// Wall time and memory of `glider fleet merge` on a table.
fn pooled(folder: &Path, shape: Shape) -> (f64, f64, u64) {
    let table = folder.join("fleet.parquet");
    std::fs::write(&table, made(shape).bytes().expect("bytes")).expect("written");
    let clock = Instant::now();
    let mut command = Command::new(env!("CARGO_BIN_EXE_glider"));
    let mut child = command.args(["--json", "fleet", "merge"]).arg(&table).stdout(Stdio::null()).spawn().expect("the program starts");
    let mut peak = 0.0_f64;
    let status = loop {
        peak = peak.max(peak_mib(child.id()).unwrap_or(0.0));
        match child.try_wait().expect("a child") {
            Some(status) => break status,
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    };
    assert!(status.code().is_some_and(|c| c < 2), "{shape:?}: {status}");
    (clock.elapsed().as_secs_f64(), peak, std::fs::metadata(&table).expect("there").len())
}

#[test]
fn ten_thousand_dives_are_pooled_in_seconds_and_little_memory() {
    let folder = std::env::temp_dir().join(format!("glider-pooling-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    for shape in [[1, 1, 1], [2, 5, 10], [25, 8, 50]] {
        let dives = shape.iter().product::<usize>();
        let (wall_s, mib, bytes) = pooled(&folder, shape);
        let each = 1e3 * wall_s / dives as f64;
        eprintln!("{dives} dives: {wall_s:.2} s, {each:.2} ms a dive, {mib:.0} MiB, table of {:.1} MB", bytes as f64 / 1e6);
        // Asked for are ten minutes.
        assert!(wall_s < 60.0 && mib < 500.0, "{dives} dives: {wall_s} s, {mib} MiB");
    }
    std::fs::remove_dir_all(&folder).expect("removed");
}

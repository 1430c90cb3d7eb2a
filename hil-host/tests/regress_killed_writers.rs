//! Programs killed while they write: the file is there whole, or as it was before, or not at all.
//!
//! GLIDER_KILLS says how many kills (default 40; the full campaign 1 000).

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

fn glider(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_glider"));
    command.current_dir(folder).args(args).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// A flight of many rows, so that there is something to cut.
fn flight(folder: &Path) {
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

/// The bytes of a file, or of all files of a folder.
fn content(path: &Path) -> Option<Vec<u8>> {
    if path.is_dir() {
        let mut all: Vec<PathBuf> = std::fs::read_dir(path).ok()?.filter_map(|e| e.ok().map(|e| e.path())).collect();
        all.sort();
        return Some(all.iter().flat_map(|p| std::fs::read(p).unwrap_or_default()).collect());
    }
    std::fs::read(path).ok()
}

#[test]
fn regress_a_killed_writer_leaves_a_whole_file_or_none() {
    let kills: u32 = std::env::var("GLIDER_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(40);
    let folder = std::env::temp_dir().join(format!("glider-killed-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    flight(&folder);
    let cases: [(&[&str], &str); 4] = [
        (&["import", "log.csv", "--out", "flight"], "flight"),
        (&["export", "log.csv", "--to", "csv", "--out", "out.csv"], "out.csv"),
        (&["export", "log.csv", "--to", "parquet", "--out", "out.parquet"], "out.parquet"),
        (&["export", "log.csv", "--to", "netcdf", "--out", "out.nc"], "out.nc"),
    ];
    let mut cut = 0;
    for (args, out) in cases {
        let out = folder.join(out);
        let started = std::time::Instant::now();
        assert!(glider(&folder, args).status().expect("runs").code().is_some_and(|c| c < 2), "{args:?}");
        let took = started.elapsed();
        let whole = content(&out).expect("written");
        for kill in 0..kills / 4 {
            let _ = if out.is_dir() { std::fs::remove_dir_all(&out) } else { std::fs::remove_file(&out) };
            // Every second time something stands there already.
            let old = (kill % 2 == 1 && out.extension().is_some()).then(|| b"old".to_vec());
            let mut all: Vec<&str> = args.to_vec();
            if let Some(old) = &old {
                std::fs::write(&out, old).expect("written");
                all.push("--force");
            }
            let mut child = glider(&folder, &all).spawn().expect("runs");
            // From the start to a little beyond the usual end.
            std::thread::sleep(Duration::from_secs_f64(took.as_secs_f64() * 1.1 * f64::from(kill) / f64::from(kills / 4)));
            let _ = child.kill();
            let _ = child.wait();
            match content(&out) {
                // The date of writing stands in a NetCDF.
                Some(now) => assert!(
                    now.len() == whole.len() || Some(&now) == old.as_ref(),
                    "{args:?}, kill {kill}: {} bytes of {}",
                    now.len(),
                    whole.len()
                ),
                None => assert!(old.is_none(), "{args:?}, kill {kill}: the old file is gone"),
            }
            cut += u32::from(content(&out).is_none_or(|now| Some(now) == old));
        }
    }
    std::fs::remove_dir_all(&folder).expect("removed");
    assert!(cut > kills / 8, "only {cut} of {kills} kills came before the end");
}

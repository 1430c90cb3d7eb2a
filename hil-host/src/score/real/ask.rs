//! One diagnosis by a program of its own, with a limit of time and its CPU seconds counted.

use std::io::Read as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// Which program is asked.
#[derive(Clone, Copy, Debug)]
pub struct Program<'a> {
    /// Its file.
    pub file: &'a Path,
    /// Environment variables that it gets besides those of this process.
    pub with: &'a [(&'a str, &'a str)],
}

/// What came back.
#[derive(Clone, Debug)]
pub struct Asked {
    /// The document, or why there is none.
    pub said: Result<Value, String>,
    /// Wall time, s.
    pub wall_s: f64,
    /// CPU time, s; NaN where the system does not tell.
    pub cpu_s: f64,
}

/// Time between two looks at a running diagnosis.
const DIAGNOSIS_POLL: Duration = Duration::from_millis(50);
/// Ticks of the process clock in a second (fixed at 100 for programs on Linux).
const TICKS: f64 = 100.0;

/// CPU time of a process so far, s; none where there is no /proc.
fn cpu_s(pid: u32) -> Option<f64> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The name in brackets may hold blanks; user and system time are the 12th and 13th words after it.
    let mut words = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let (user, system): (f64, f64) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
    Some((user + system) / TICKS)
}

/// Runs `glider diagnose --flight DIR --json`.
#[must_use]
pub fn diagnose(program: Program<'_>, flight: &Path, limit_s: f64) -> Asked {
    let clock = Instant::now();
    let failed = |why: String, cpu_s: f64| Asked { said: Err(why), wall_s: clock.elapsed().as_secs_f64(), cpu_s };
    let child = Command::new(program.file)
        .envs(program.with.iter().copied())
        .arg("diagnose")
        .arg("--flight")
        .arg(flight)
        .arg("--json")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let mut child = match child {
        Ok(child) => child,
        Err(e) => return failed(format!("{}: {e}", program.file.display()), f64::NAN),
    };
    let drain = |mut from: Box<dyn std::io::Read + Send>| {
        std::thread::spawn(move || {
            let mut text = String::new();
            from.read_to_string(&mut text).map(|_| text).unwrap_or_default()
        })
    };
    let out = child.stdout.take().map(|o| drain(Box::new(o)));
    let err = child.stderr.take().map(|e| drain(Box::new(e)));
    let mut used = f64::NAN;
    let ended = loop {
        used = cpu_s(child.id()).unwrap_or(used);
        match child.try_wait() {
            Ok(Some(_)) => break true,
            Ok(None) if used.max(0.0) < limit_s && clock.elapsed().as_secs_f64() < 6.0 * limit_s => std::thread::sleep(DIAGNOSIS_POLL),
            _ => break false,
        }
    };
    if !ended {
        child.kill().ok();
        child.wait().ok();
        return failed(format!("no answer in {limit_s} CPU s"), used);
    }
    let text = |t: Option<std::thread::JoinHandle<String>>| t.and_then(|t| t.join().ok()).unwrap_or_default();
    let (out, err) = (text(out), text(err));
    match serde_json::from_str(&out) {
        Ok(said) => Asked { said: Ok(said), wall_s: clock.elapsed().as_secs_f64(), cpu_s: used },
        Err(_) => failed(err.trim().to_owned(), used),
    }
}

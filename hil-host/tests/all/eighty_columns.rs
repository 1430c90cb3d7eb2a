//! What commands print for a person fits a terminal of 80 columns, and the last line is the answer.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Each is run in this order in one folder; the last line that is not empty begins with one of these words.
const COMMANDS: &[(&str, &[&str])] = &[
    ("--help", &["Exit code"]),
    ("fly --mission sweep --truth truth.toml --seed 7 --log hidden", &["end            done"]),
    ("add --help", &["file as given, or of recalibration alone."]),
    ("fly --help", &["answered with the list of all."]),
    ("loop --flight hidden --out story", &["   page"]),
    ("fly --wings low-ar --fault hull:leak", &["end            safe"]),
    ("fly --seat parts", &["end            done"]),
    ("fly --seat extctl", &["share of (L/D)max", "  "]),
    ("compare --flight hidden", &["Of the model as given"]),
    ("fly --mission sweep --truth truth.toml --seed 8 --log other", &["end            done"]),
    ("compare --flight hidden --test other", &["Values are of"]),
    ("diagnose --quick --flight hidden", &["Next:", "      "]),
    ("add drag_level_error --flight hidden --out learnt.json", &["beyond recalibration"]),
    ("fly --mission sea --truth truth.toml --table learnt.json --beside hidden/vehicle.json", &["end            done"]),
    ("next-flight --flight hidden --out next.toml", &["Fly it"]),
    ("calibrate --flight hidden --out calibrated.json", &["Calibrated vehicle file"]),
    ("timeline hidden --vehicle hidden/vehicle.json --out mission.pdf", &["No change is named"]),
    ("report --flight hidden --out report.html", &["report.html"]),
    ("plot residual --flight hidden --before hidden/vehicle.json --vehicle learnt.json --width column --out both.pdf", &["both.pdf", "  "]),
    ("export hidden --to netcdf --out hidden.nc", &["wrote hidden.nc"]),
    ("import hidden.nc --out again", &["next: glider compare", "  "]),
    ("monitor hidden", &["end: done"]),
    ("polar", &["(L/D)max"]),
    ("table", &["low-ar wings"]),
    ("table --check", &["The firmware's tables are these"]),
    ("power", &["battery"]),
    ("margins", &["least"]),
    ("paper", &["12 reproduced", "13 reproduced"]),
    ("list effects", &["One of them at length"]),
    ("list effects climb_drag", &["Told from", "  "]),
    ("list faults", &["  glider fly"]),
    ("list vehicles", &["built in", "  "]),
    ("list missions", &["Taken by name", "  "]),
    ("list changes", &["                "]),
    ("faults --healthy 10", &["      10 done"]),
];

#[test]
fn what_is_printed_fits_80_columns_and_ends_with_the_answer() {
    let folder = Folder(std::env::temp_dir().join(format!("glider-columns-{}", std::process::id())));
    std::fs::create_dir_all(&folder.0).expect("a temporary folder");
    let truth = "[[effects]]\nkind = \"drag_level_error\"\nvalue = 0.4\n";
    std::fs::write(folder.0.join("truth.toml"), truth).expect("written");
    let mut bad = String::new();
    for (line, ends) in COMMANDS {
        let text = glider(line, &folder.0);
        for wide in text.lines().filter(|l| l.chars().count() > 80).take(3) {
            bad += &format!("glider {line}\n  {} columns: {wide}\n", wide.chars().count());
        }
        let last = text.lines().rfind(|l| !l.trim().is_empty()).unwrap_or_default();
        if !ends.iter().any(|e| last.starts_with(e)) {
            bad += &format!("glider {line}\n  ends with: {last}\n");
        }
    }
    assert!(bad.is_empty(), "{bad}");
}

fn glider(line: &str, work: &Path) -> String {
    let args: Vec<&str> = line.split_whitespace().collect();
    let out = Command::new(env!("CARGO_BIN_EXE_glider")).args(args).current_dir(work).stdin(Stdio::null()).output().expect("it starts");
    let code = out.status.code();
    assert!(matches!(code, Some(0 | 1)), "glider {line}: exit code {code:?}\n{}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8_lossy(&out.stdout).into_owned()
}

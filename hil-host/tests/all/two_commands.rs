//! Real flights from the files as they come from the glider to a comparison and a diagnosis, without a hand-made vehicle file.
//!
//! GLIDER_FLIGHTS names the folder of flights (data/README there); without it the test says "skipped". Limits are of sources; a flight
//! that misses one is named in a list here with the reason; any other miss fails, and so does a limit that is met and listed as missed.
//! docs/import.md holds the table: a row that differs fails, and GLIDER_FILL_DOCS=1 puts today's rows there. A test for each kind of
//! glider: about equal work.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use hil_host::score::contradictions::contradictions;

/// A flight as its glider or its operator wrote it, and which limits it is known to miss.
struct Real {
    name: &'static str,
    /// In the table of docs/import.md.
    shown: &'static str,
    /// Rms of the steady vertical velocity that a model with constants from elsewhere has on it, cm/s: nominal coefficients of a Slocum
    /// with nothing fitted (data/README), constants of the base station (the same).
    nominal_cm_s: f64,
    misses: &'static [(Limit, &'static str)],
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Limit {
    First,
    Calibrated,
    Parameters,
}

/// No figure of a SeaExplorer with nominal coefficients is known: the largest of the others.
const WORST_NOMINAL_CM_S: f64 = 6.51;

const STEEP: &str = "its pitch sensor reads 16 % steep (the owner's correction), which is no calibration number";

const SEAGLIDERS: [Real; 2] = [
    Real {
        name: "seaglider_sg171",
        shown: "Seaglider SG171, 1 dive",
        nominal_cm_s: 4.7,
        misses: &[(Limit::Calibrated, "one dive through internal waves: nothing to hold out, and 3 s between clocks")],
    },
    Real { name: "seaglider_sg561", shown: "Seaglider SG561, dives 2 to 9", nominal_cm_s: 4.7, misses: &[] },
];

const SEAEXPLORERS: [Real; 1] = [Real {
    name: "seaexplorer_sea035",
    shown: "SeaExplorer SEA035, 14 cycles",
    nominal_cm_s: WORST_NOMINAL_CM_S,
    misses: &[(Limit::Calibrated, "a sample every 30 s and a navigation clock that differs by 12 s")],
}];

const SLOCUMS: [Real; 5] = [
    Real {
        name: "slocum_comet2016/raw",
        shown: "Slocum Comet 2016, DBD and EBD",
        nominal_cm_s: 3.39,
        misses: &[(Limit::Parameters, "lift 3.1 tolerances above a usual Slocum's, with the added mass at its bound as well as within")],
    },
    Real {
        name: "slocum_comet2019/raw",
        shown: "Slocum Comet 2019, DBD and EBD",
        nominal_cm_s: 3.39,
        misses: &[(Limit::Calibrated, STEEP), (Limit::Parameters, STEEP)],
    },
    Real { name: "slocum_modena2015/modena-2015-175-0-1_tidy.csv", shown: "Slocum Modena 175, table", nominal_cm_s: 6.41, misses: &[] },
    Real { name: "slocum_modena2015/modena-2015-187-0-12_tidy.csv", shown: "Slocum Modena 187, table", nominal_cm_s: 6.51, misses: &[] },
    Real { name: "slocum_modena2015/modena-2015-191-0-34_tidy.csv", shown: "Slocum Modena 191, table", nominal_cm_s: 6.41, misses: &[] },
];

/// Vertical velocity of a tuned flight model is good to 0.5 cm/s (Frajka-Williams et al. 2011, J. Atmos. Oceanic Technol. 28, 1641), and
/// the water's own motion that the vehicle file states is 0.5 cm/s.
const CALIBRATED_CM_S: f64 = 0.71;

/// Calibration scatter is within so many tolerances (flight format, section 5).
const SIGMAS: f64 = 3.0;

fn glider(args: &[&str], allowed: &[i32]) -> Value {
    let out = Command::new(env!("CARGO_BIN_EXE_glider")).args(args).arg("--json").output().expect("runs");
    let code = out.status.code().expect("a code");
    assert!(allowed.contains(&code), "{args:?}: exit {code}\n{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap_or_else(|e| panic!("{args:?}: {e}"))
}

/// Limits that the flight misses, and its row of the table.
fn one(root: &Path, real: &Real) -> (Vec<Limit>, String) {
    let flight = real.name.replace('/', "-");
    let folder = std::env::temp_dir().join(format!("glider-two-commands-{}-{flight}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    let (from, to) = (root.join(real.name).to_string_lossy().into_owned(), folder.to_string_lossy().into_owned());
    // Nothing of these files is left out.
    glider(&["import", &from, "--out", &to], &[0]);
    let compared = glider(&["compare", "--flight", &to], &[0]);
    let found = glider(&["diagnose", "--quick", "--flight", &to], &[0]);
    std::fs::remove_dir_all(&folder).expect("removed");
    let number = |v: &Value| v.as_f64().unwrap_or(f64::NAN);
    let (first, calibrated) = (number(&compared["steady_rms_cm_s"]), number(&found["error"]["recalibrated"]));
    assert_eq!(contradictions(&found), [""; 0], "{flight}");
    let numbers = found["recalibration_sigma"].as_object().expect("numbers");
    assert_eq!(numbers.len(), 10, "{numbers:?}");
    // The added mass across the hull is a nuisance: no file knows it, and its prior has a wide tail.
    let far = numbers.iter().filter(|(name, z)| *name != "added_mass_heave" && !(number(z).abs() <= SIGMAS));
    let far: Vec<String> = far.map(|(name, z)| format!("{name} {:+.1}", number(z))).collect();
    let met = [
        (Limit::First, first <= real.nominal_cm_s),
        (Limit::Calibrated, calibrated <= CALIBRATED_CM_S),
        (Limit::Parameters, far.is_empty()),
    ];
    let bold = |limit: Limit, text: String| {
        let missed = met.iter().any(|(l, met)| *l == limit && !met);
        if missed { format!("**{text}**") } else { text }
    };
    let row = format!(
        "| {} | {} | {} | {:.2} | {} | {} |",
        real.shown,
        bold(Limit::First, format!("{first:.2}")),
        bold(Limit::Calibrated, format!("{calibrated:.2}")),
        number(&found["error"]["noise_floor"]),
        found["verdict"].as_str().expect("a verdict"),
        bold(Limit::Parameters, if far.is_empty() { "none".to_owned() } else { far.join(", ") })
    );
    eprintln!("{row}");
    (met.into_iter().filter(|(_, met)| !met).map(|(limit, _)| limit).collect(), row)
}

/// Whether two rows say the same: words equal, numbers to what another machine's rounding may change.
fn same(a: &str, b: &str) -> bool {
    let close = |(a, b): (&str, &str)| match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= 0.02 + 0.02 * b.abs(),
        _ => a == b,
    };
    let words = |row: &str| row.split_whitespace().map(|w| w.trim_matches(['*', ',']).to_owned()).collect::<Vec<_>>();
    let (a, b) = (words(a), words(b));
    a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| close((a, b)))
}

/// Holds the page's rows against today's, or puts these there; what differs.
fn rows_of_the_page(rows: &[String]) -> Vec<String> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/import.md");
    // The tests of this file may be processes, and none may write over what another has put there.
    let alone = std::fs::File::open(&page).expect("a page");
    alone.lock().expect("locked");
    let before = std::fs::read_to_string(&page).expect("a page");
    let mut differ = Vec::new();
    let mut lines: Vec<&str> = before.lines().collect();
    for row in rows {
        let start = row.split_inclusive('|').take(2).collect::<String>();
        match lines.iter_mut().find(|line| line.starts_with(&start)) {
            Some(line) if std::env::var_os("GLIDER_FILL_DOCS").is_some() => *line = row,
            Some(line) if same(row, line) => {}
            line => differ.push(format!("docs/import.md has {line:?}, measured {row}; GLIDER_FILL_DOCS=1 puts it there")),
        }
    }
    let after = lines.join("\n") + "\n";
    if after != before {
        std::fs::write(&page, after).expect("written");
    }
    differ
}

/// Every limit is met that is not listed as missed, and none that is; the page has the rows.
fn validate(flights: &[Real]) {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) else {
        eprintln!("skipped: no flights (GLIDER_FLIGHTS is not set)");
        return;
    };
    let (mut failed, mut rows) = (Vec::new(), Vec::new());
    for real in flights {
        match std::panic::catch_unwind(|| one(&root, real)) {
            Ok((missed, row)) => {
                rows.push(row);
                for (limit, why) in real.misses.iter().filter(|m| missed.contains(&m.0)) {
                    eprintln!("    misses {limit:?}, as known: {why}");
                }
                let met: Vec<Limit> = real.misses.iter().map(|m| m.0).filter(|m| !missed.contains(m)).collect();
                let unknown: Vec<Limit> = missed.into_iter().filter(|m| real.misses.iter().all(|k| k.0 != *m)).collect();
                if !unknown.is_empty() {
                    failed.push(format!("{}: misses {unknown:?}", real.name));
                }
                if !met.is_empty() {
                    failed.push(format!("{}: {met:?} is met now: take it from the list of what it misses", real.name));
                }
            }
            Err(e) => failed.push(e.downcast_ref::<String>().cloned().unwrap_or_default()),
        }
    }
    failed.extend(rows_of_the_page(&rows));
    assert!(failed.is_empty(), "{}: {failed:#?}", failed.len());
}

#[test]
fn validate_every_seaglider_flight_is_diagnosed_by_two_commands() {
    validate(&SEAGLIDERS);
}

#[test]
fn validate_every_seaexplorer_flight_is_diagnosed_by_two_commands() {
    validate(&SEAEXPLORERS);
}

#[test]
fn validate_every_slocum_flight_is_diagnosed_by_two_commands() {
    validate(&SLOCUMS);
}

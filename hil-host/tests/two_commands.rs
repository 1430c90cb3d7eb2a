//! Real flights from the files as they come from the glider to a comparison and a diagnosis, without a hand-made vehicle file.
//!
//! GLIDER_FLIGHTS names the folder of flights (data/README there); without it the test says "skipped".

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// Everything that a glider or its operator wrote: what is named, and the class where the files do not tell it. The first four are
/// diagnosed too; the others take minutes.
const FLIGHTS: [(&str, Option<&str>); 9] = [
    ("seaglider_sg171", None),
    ("slocum_comet2019/raw", None),
    ("slocum_comet2016/comet2016_tidy.csv", Some("slocum-200")),
    ("slocum_modena2015/modena-2015-175-0-1_tidy.csv", Some("slocum-200")),
    ("seaglider_sg561", None),
    ("seaexplorer_sea035", None),
    ("slocum_comet2016/raw", None),
    ("slocum_modena2015/modena-2015-187-0-12_tidy.csv", Some("slocum-200")),
    ("slocum_modena2015/modena-2015-191-0-34_tidy.csv", Some("slocum-200")),
];

const DIAGNOSED: usize = 4;

/// Gliders sink and rise at 10 to 30 cm/s: the first file is off by less than a third of that, a calibrated one by a tenth, cm/s.
const FIRST_CM_S: f64 = 10.0;
const CALIBRATED_CM_S: f64 = 3.0;

fn glider(args: &[&str], allowed: &[i32]) -> Value {
    let out = Command::new(env!("CARGO_BIN_EXE_glider")).args(args).arg("--json").output().expect("runs");
    let code = out.status.code().expect("a code");
    assert!(allowed.contains(&code), "{args:?}: exit {code}\n{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap_or_else(|e| panic!("{args:?}: {e}"))
}

fn one(root: &Path, name: &str, class: Option<&str>, diagnosed: bool) {
    let folder = std::env::temp_dir().join(format!("glider-two-commands-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    let (from, to) = (root.join(name).to_string_lossy().into_owned(), folder.to_string_lossy().into_owned());
    let mut import = vec!["import", &from, "--out", &to];
    import.extend(class.into_iter().flat_map(|c| ["--class", c]));
    // 1: something was left out, and the report says what.
    glider(&import, &[0, 1]);
    let compared = glider(&["compare", "--flight", &to], &[0]);
    let steady = compared["steady_rms_cm_s"].as_f64().unwrap_or(f64::NAN);
    eprintln!("{name}: steady {steady:.2} cm/s by the first vehicle file");
    assert!(steady < FIRST_CM_S, "{name}: {compared:#}");
    if diagnosed {
        let found = glider(&["diagnose", "--quick", "--flight", &to], &[0]);
        let calibrated = found["error"]["recalibrated"].as_f64().unwrap_or(f64::NAN);
        eprintln!("{name}: {calibrated:.2} cm/s recalibrated, {}", found["verdict"]);
        assert!(calibrated < CALIBRATED_CM_S, "{name}: {found:#}");
    }
    std::fs::remove_dir_all(&folder).expect("removed");
}

#[test]
fn validate_every_real_flight_goes_from_its_files_to_a_diagnosis_in_two_commands() {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) else {
        eprintln!("skipped: no flights (GLIDER_FLIGHTS is not set)");
        return;
    };
    let mut failed = Vec::new();
    for (k, (name, class)) in FLIGHTS.into_iter().enumerate() {
        if let Err(e) = std::panic::catch_unwind(|| one(&root, name, class, k < DIAGNOSED)) {
            failed.push(e.downcast_ref::<String>().cloned().unwrap_or_default());
        }
    }
    assert!(failed.is_empty(), "{} of {}: {failed:#?}", failed.len(), FLIGHTS.len());
}

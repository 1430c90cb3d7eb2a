//! The OceanGliders export held against the community's checker (Python packages compliance-checker and cc-plugin-og).
//!
//! Without `compliance-checker` on the PATH it says "skipped".

use std::path::Path;
use std::process::Command;

use discovery::export::netcdf::{About, write};
use discovery::import::import;

#[test]
fn validate_the_export_passes_the_checkers_of_og1_and_cf() {
    let sample = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats/og1");
    let got = import(&sample, &[]).expect("an import");
    let path = std::env::temp_dir().join(format!("glider-og1-{}.nc", std::process::id()));
    let stated = [("PLATFORM_SERIAL_NUMBER", "unit_777"), ("contributor_name", "A Person"), ("contributor_email", "person@example.org")];
    let about = About {
        start_unix_s: got.report.start_unix_s,
        origins: got.report.origins.clone(),
        stated: stated.map(|(k, v)| (k.to_owned(), v.to_owned())).into(),
        written_unix_s: 1.78e9,
        ..About::default()
    };
    write(&got.flight, &path, &about).expect("written");
    let again = import(&path, &[]).expect("our own import reads it");
    assert_eq!((again.flight.len(), again.report.origins.len()), (got.flight.len(), got.report.origins.len()));
    if Command::new("compliance-checker").arg("--version").output().is_err() {
        eprintln!("skipped: no compliance-checker on the PATH (pip install compliance-checker cc-plugin-og)");
        return;
    }
    for test in ["og:1.0", "cf:1.10"] {
        let out = Command::new("compliance-checker").args(["--test", test, "--criteria", "strict"]).arg(&path).output().expect("runs");
        let said = String::from_utf8_lossy(&out.stdout).into_owned();
        // Its one check of vocabularies needs a network; without it the program complains and the checks that ran count.
        assert!(said.contains("All tests passed!"), "{test}: {said}\n{}", String::from_utf8_lossy(&out.stderr));
    }
    std::fs::remove_file(&path).expect("removed");
}

//! Exports held against other people's programs, from the Python registry: the checkers of OceanGliders and CF (compliance-checker with
//! cc-plugin-og), and the reader of MCAP (mcap with mcap-protobuf-support).
//!
//! `scripts/setup-checkers` puts them into `data-cache/checkers`; GLIDER_CHECKERS names another virtual environment. Without one the
//! tests say "skipped".

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::export::{mcap, netcdf};
use crate::import::{Imported, import};
use serde_json::Value;

/// A program of the virtual environment.
fn program(name: &str) -> Option<Command> {
    let fetched = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data-cache/checkers");
    let path = std::env::var_os("GLIDER_CHECKERS").map_or_else(fetched, PathBuf::from).join("bin").join(name);
    if !path.is_file() {
        eprintln!("SKIPPED LOUDLY: no {} (scripts/setup-checkers brings it)", path.display());
        return None;
    }
    Some(Command::new(path))
}

fn sample() -> Imported {
    import(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats/og1"), &[]).expect("an import")
}

fn scratch(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("glider-public-{}-{name}", std::process::id()))
}

#[test]
fn validate_the_export_passes_the_checkers_of_og1_and_cf() {
    let got = sample();
    let path = scratch("og1.nc");
    let stated = [("PLATFORM_SERIAL_NUMBER", "unit_777"), ("contributor_name", "A Person"), ("contributor_email", "person@example.org")];
    let about = netcdf::About {
        start_unix_s: got.report.start_unix_s,
        origins: got.report.origins.clone(),
        stated: stated.map(|(k, v)| (k.to_owned(), v.to_owned())).into(),
        written_unix_s: 1.78e9,
        ..netcdf::About::default()
    };
    netcdf::write(&got.flight, &path, &about).expect("written");
    let again = import(&path, &[]).expect("our own import reads it");
    assert_eq!((again.flight.len(), again.report.origins.len()), (got.flight.len(), got.report.origins.len()));
    for test in ["og:1.0", "cf:1.10"] {
        let Some(mut checker) = program("compliance-checker") else { break };
        let out = checker.args(["--test", test, "--criteria", "strict"]).arg(&path).output().expect("runs");
        let said = String::from_utf8_lossy(&out.stdout).into_owned();
        // Its one check of vocabularies needs a network; without it the program complains and the checks that ran count.
        assert!(said.contains("All tests passed!"), "{test}: {said}\n{}", String::from_utf8_lossy(&out.stderr));
    }
    std::fs::remove_file(&path).expect("removed");
}

/// Messages of each topic by its own descriptors: how many, first and last time, the sum of each number.
const READ_MCAP: &str = "
import json, sys
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
topics = {}
with open(sys.argv[1], 'rb') as f:
    reader = make_reader(f, decoder_factories=[DecoderFactory()])
    for schema, channel, message, value in reader.iter_decoded_messages():
        t = topics.setdefault(channel.topic, {'schema': schema.name, 'count': 0, 'first': message.log_time, 'sum': {}})
        t['count'] += 1
        t['last'] = message.log_time
        for field, v in value.ListFields():
            if isinstance(v, float):
                t['sum'][field.name] = t['sum'].get(field.name, 0.0) + v
    attached = [a.name for a in reader.iter_attachments()]
print(json.dumps({'topics': topics, 'attached': attached}))
";

#[test]
fn validate_mcap_is_read_by_the_public_reader() {
    let Some(mut python) = program("python") else { return };
    let got = sample();
    let (flight, path) = (&got.flight, scratch("flight.mcap"));
    let attached = [("vehicle.json", "application/json", b"{}".to_vec())];
    let streams = mcap::streams(flight);
    let file = std::io::BufWriter::new(std::fs::File::create(&path).expect("a file"));
    mcap::write(flight, &streams, got.report.start_unix_s, &got.report.origins, &attached, file).expect("written");
    let out = python.args(["-c", READ_MCAP]).arg(&path).output().expect("runs");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    std::fs::remove_file(&path).expect("removed");
    let read: Value = serde_json::from_slice(&out.stdout).expect("JSON");
    assert_eq!(read["attached"], serde_json::json!(["vehicle.json"]));
    let measured = &read["topics"]["/glider/measured"];
    assert_eq!((measured["schema"].as_str(), measured["count"].as_u64()), (Some("glider.Measured"), Some(flight.len() as u64)));
    let start = got.report.start_unix_s.expect("a date");
    let last = measured["last"].as_f64().expect("a time") * 1e-9;
    assert!((last - start - flight.time_s[flight.len() - 1]).abs() < 1e-3, "{last}");
    for (name, values) in &streams.iter().find(|s| s.topic == "/glider/measured").expect("measured").fields {
        let ours: f64 = values.iter().filter(|v| v.is_finite()).sum();
        let theirs = measured["sum"][name].as_f64().unwrap_or_else(|| panic!("no {name} in {measured}"));
        assert!((ours - theirs).abs() <= 1e-9 * ours.abs().max(1.0), "{name}: {theirs}, written {ours}");
    }
    let fixes = (0..flight.len()).filter(|k| flight.gps_east_m[*k].is_finite()).count() as u64;
    let read_fixes = &read["topics"]["/glider/fix"];
    assert_eq!((read_fixes["schema"].as_str(), read_fixes["count"].as_u64()), (Some("foxglove.LocationFix"), Some(fixes)));
}

//! The rooms and the direction in which they may see each other.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Which workspace room may use which, dev-dependencies included.
const MAY_USE: &[(&str, &[&str])] = &[
    ("signals", &[]),
    ("polar", &["signals"]),
    ("control", &["signals", "polar"]),
    ("evidence", &["signals", "polar"]),
    ("store", &["signals"]),
    ("devices", &["signals"]),
    ("helm", &["signals", "polar", "control", "evidence", "store"]),
    ("backseat", &["signals"]),
    ("bay", &["signals", "control", "helm", "backseat", "devices"]),
    ("boot", &["store", "devices"]),
    ("audit", &[]),
    ("firmware", &["signals", "polar", "control", "evidence", "helm", "devices", "store", "backseat", "bay"]),
    ("hydro", &[]),
    ("plant", &["signals"]),
    // Written from the datasheets: what they are judged by must not see the drivers.
    ("parts", &[]),
    ("frontseat", &["signals", "control", "helm", "backseat", "bay", "plant"]),
    ("logs", &["hydro"]),
    ("discovery", &["hydro", "logs"]),
    // Which flies never asks what is missing.
    (
        "rig",
        &["signals", "polar", "control", "helm", "store", "backseat", "bay", "devices", "parts", "hydro", "plant", "frontseat", "logs"],
    ),
    ("hil-host", &["signals", "polar", "control", "evidence", "helm", "parts", "hydro", "plant", "frontseat", "logs", "discovery", "rig"]),
    ("python", &["logs", "discovery", "rig", "hil-host"]),
    ("benches", &["signals", "polar", "control", "hydro", "plant", "logs", "discovery", "rig", "hil-host"]),
    (
        "tests",
        &[
            "signals",
            "polar",
            "control",
            "evidence",
            "helm",
            "store",
            "backseat",
            "bay",
            "devices",
            "parts",
            "hydro",
            "plant",
            "frontseat",
            "logs",
            "discovery",
            "rig",
            "hil-host",
        ],
    ),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the workspace").to_path_buf()
}

fn metadata() -> serde_json::Value {
    let out = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(root())
        .output()
        .expect("cargo runs");
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).expect("cargo metadata is JSON")
}

/// Tracked Rust sources below a path pattern; empty outside a git checkout.
fn sources(pattern: &str) -> Vec<(String, String)> {
    let Ok(out) = Command::new("git").args(["ls-files", pattern]).current_dir(root()).output() else { return Vec::new() };
    String::from_utf8_lossy(&out.stdout)
        .lines()
        .filter_map(|l| std::fs::read_to_string(root().join(l)).ok().map(|text| (l.to_owned(), text)))
        .collect()
}

/// Forbidden edges of a dependency list: a test that borrows the truth is an
/// inverse crime as well, so dev-dependencies count.
fn forbidden(edges: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let mut found = Vec::new();
    for (room, uses) in edges {
        let Some((_, allowed)) = MAY_USE.iter().find(|(r, _)| r == room) else {
            found.push(format!("{room} is not a room of the design"));
            continue;
        };
        for used in uses {
            if MAY_USE.iter().any(|(r, _)| r == used) && !allowed.contains(&used.as_str()) {
                found.push(format!("{room} must not see {used}"));
            }
        }
    }
    found
}

#[test]
fn rooms_see_only_what_the_design_allows() {
    let metadata = metadata();
    let mut edges = BTreeMap::new();
    for package in metadata["packages"].as_array().expect("packages") {
        let uses: BTreeSet<String> = package["dependencies"]
            .as_array()
            .expect("dependencies")
            .iter()
            .map(|d| d["name"].as_str().unwrap_or_default().to_owned())
            .collect();
        edges.insert(package["name"].as_str().expect("name").to_owned(), uses);
    }
    assert_eq!(edges.len(), MAY_USE.len(), "cargo metadata lists exactly the rooms: {edges:?}");
    assert_eq!(forbidden(&edges), Vec::<String>::new());
}

#[test]
fn the_crates_that_users_ask_for_by_name_are_used() {
    let metadata = metadata();
    let dependencies = metadata["packages"].as_array().expect("packages").iter().flat_map(|p| p["dependencies"].as_array().expect("list"));
    // Those of programs and libraries, not of their tests.
    let used: BTreeSet<&str> = dependencies.filter(|d| d["kind"].is_null()).filter_map(|d| d["name"].as_str()).collect();
    for wanted in ["heapless", "micromath", "embedded-hal", "defmt", "postcard", "serialport"] {
        assert!(used.contains(wanted), "{wanted} is gone: {used:?}");
    }
}

#[test]
fn cargo_run_at_the_root_means_glider() {
    let metadata = metadata();
    let default = metadata["workspace_default_members"].as_array().expect("default members");
    let mut programs = Vec::new();
    for package in metadata["packages"].as_array().expect("packages").iter().filter(|p| default.contains(&p["id"])) {
        let targets = package["targets"].as_array().expect("targets").iter();
        programs.extend(targets.filter(|t| t["kind"] == serde_json::json!(["bin"])).map(|t| t["name"].clone()));
    }
    assert_eq!(programs, ["glider"], "a second program among the default members makes `cargo run` ambiguous");
}

#[test]
fn at_most_20_test_programs_are_linked() {
    let metadata = metadata();
    let targets = metadata["packages"].as_array().expect("packages").iter().flat_map(|p| p["targets"].as_array().expect("targets"));
    let programs = targets.filter(|t| t["test"] == true).count();
    assert!((10..=20).contains(&programs), "{programs}: tests of a crate are modules of one program; without tests, test = false");
}

/// Dependencies from outside of a room that its page (comments at the head of its library or program) gives no reason for.
fn without_reason(package: &serde_json::Value) -> Vec<String> {
    let of_code = ["lib", "bin", "cdylib", "rlib"];
    let targets = package["targets"].as_array().expect("targets").iter();
    let code = targets.filter(|t| t["kind"].as_array().is_some_and(|kinds| kinds.iter().any(|k| of_code.iter().any(|c| k == c))));
    let page: String = code.filter_map(|t| std::fs::read_to_string(t["src_path"].as_str()?).ok()).collect();
    let page: Vec<&str> = page.lines().filter(|l| l.starts_with("//!")).collect();
    let page = page.join("\n");
    let outside = package["dependencies"].as_array().expect("list").iter().filter(|d| d["kind"].is_null() && d["path"].is_null());
    let names = outside.filter_map(|d| d["name"].as_str()).filter(|name| !page.contains(&format!("`{name}`")));
    names.map(|name| format!("{}: {name}", package["name"])).collect()
}

#[test]
fn the_page_of_a_room_says_why_each_dependency_is_there() {
    let metadata = metadata();
    // Programs beside the rooms: their dependencies are those of what they measure or check.
    let beside = ["tests", "benches", "python", "audit", "boot"];
    let rooms = metadata["packages"].as_array().expect("packages").iter().filter(|p| !beside.iter().any(|b| p["name"] == *b));
    let (rooms, missing): (Vec<_>, Vec<_>) = rooms.map(|p| (p["name"].as_str(), without_reason(p))).unzip();
    assert!(rooms.len() > 15 && missing.concat().is_empty(), "{:?}", missing.concat());
    let one = serde_json::json!({"name": "x", "targets": [], "dependencies": [{"name": "left-pad", "kind": null, "path": null}]});
    assert_eq!(without_reason(&one), ["\"x\": left-pad"]);
}

#[test]
fn a_forbidden_edge_is_found() {
    let edges = BTreeMap::from([("control".to_owned(), BTreeSet::from(["hydro".to_owned(), "polar".to_owned()]))]);
    assert_eq!(forbidden(&edges), ["control must not see hydro"]);
}

#[test]
fn flying_rooms_are_no_std_and_have_no_heap() {
    for room in ["signals", "polar", "control", "evidence", "helm", "devices", "store", "backseat", "bay"] {
        let lib = std::fs::read_to_string(root().join("firmware").join(room).join("src/lib.rs")).expect("room has a lib.rs");
        assert!(lib.contains("no_std"), "{room} must be no_std");
    }
    for (file, text) in sources("firmware/*.rs") {
        assert!(!text.contains("extern crate alloc"), "{file}: no heap in flight code");
    }
}

#[test]
fn no_source_file_has_outgrown_its_question() {
    let long: Vec<String> = sources("*.rs")
        .into_iter()
        .map(|(file, text)| (file, text.lines().count()))
        .filter(|(_, lines)| *lines > 700)
        .map(|(file, lines)| format!("{file}: {lines} lines"))
        .collect();
    assert!(long.is_empty(), "a file over 700 lines is a missing room: {long:?}");
}

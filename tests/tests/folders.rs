//! The order of folders inside discovery and hil-host: each may use only those before it, so there is no circle.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// From a log to a verdict, and what stands beside that flow.
const DISCOVERY: [&str; 14] = [
    "ablation",
    "record",
    "vehicle",
    "preprocess",
    "model",
    "likelihood",
    "inference",
    "hypotheses",
    "criticism",
    "diagnosis",
    "workbench",
    "steady",
    "import",
    "export",
];

/// From a wire to the command line.
const HIL_HOST: [&str; 8] = ["seats", "flight", "score", "pages", "campaign", "paper", "serve", "cli"];

/// Folders of the crate that a source names: `crate::folder::…`, alone or in braces, in code that is not a test module's.
fn folders_used(text: &str) -> BTreeSet<String> {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let code: String = code.lines().map(|l| l.split("//").next().unwrap_or_default()).flat_map(|l| [l, "\n"]).collect();
    let name = |s: &str| s.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut used = BTreeSet::new();
    for after in code.split("crate::").skip(1) {
        let Some(list) = after.strip_prefix('{') else {
            used.insert(name(after));
            continue;
        };
        let (mut depth, mut begins) = (1, true);
        for (i, c) in list.char_indices() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 1 => begins = true,
                c if begins && c.is_alphanumeric() => {
                    used.insert(name(&list[i..]));
                    begins = false;
                }
                _ => {}
            }
            if depth == 0 {
                break;
            }
        }
    }
    used
}

/// What a file of a folder must not use: a later folder, or something that is in no folder.
fn upward(order: &[&str], file: &str, text: &str) -> Vec<String> {
    let folder = file.split('/').next().unwrap_or_default();
    let Some(own) = order.iter().position(|f| *f == folder) else { return vec![format!("{file} is in no folder of the order")] };
    let allowed = &order[..=own];
    folders_used(text).into_iter().filter(|f| !allowed.contains(&f.as_str())).map(|f| format!("{file} uses {f}")).collect()
}

fn rust_files(below: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(below).unwrap_or_else(|e| panic!("{}: {e}", below.display()));
    let paths = entries.map(|e| e.expect("an entry").path());
    paths.flat_map(|p| if p.is_dir() { rust_files(&p) } else { vec![p] }).filter(|p| p.extension().is_some_and(|e| e == "rs")).collect()
}

fn check(source: &str, order: &[&str]) {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(source);
    let files = rust_files(&source);
    let inside = files.iter().filter_map(|p| Some((p.strip_prefix(&source).ok()?.to_str()?, p))).filter(|(name, _)| name.contains('/'));
    let bad: Vec<String> =
        inside.flat_map(|(name, path)| upward(order, name, &std::fs::read_to_string(path).expect("a source file"))).collect();
    assert!(files.len() > 20, "{}: only {} files", source.display(), files.len());
    assert!(bad.is_empty(), "each folder may use only those before it ({order:?}): {bad:#?}");
}

#[test]
fn folders_of_discovery_use_only_those_before_them() {
    check("hil-host/discovery/src", &DISCOVERY);
}

#[test]
fn folders_of_hil_host_use_only_those_before_them() {
    check("hil-host/src", &HIL_HOST);
}

#[test]
fn an_upward_import_is_found_however_it_is_written() {
    let bad = |text: &str| upward(&DISCOVERY, "model/x.rs", text);
    assert_eq!(bad("use crate::likelihood::Problem;\n"), ["model/x.rs uses likelihood"]);
    assert_eq!(bad("use crate::{record::flight::Flight, inference::{evidence, prior}};\n"), ["model/x.rs uses inference"]);
    assert_eq!(bad("fn f() { crate::workbench::add::add() }\n"), ["model/x.rs uses workbench"]);
    assert_eq!(bad("use crate::Problem;\n"), ["model/x.rs uses Problem"]);
    assert_eq!(bad("use crate::preprocess::Run; // crate::likelihood\n#[cfg(test)]\nmod tests {\n use crate::diagnosis;\n}\n"), [""; 0]);
    assert_eq!(upward(&DISCOVERY, "elsewhere/x.rs", ""), ["elsewhere/x.rs is in no folder of the order"]);
}

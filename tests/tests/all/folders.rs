//! The order of folders inside logs, discovery, rig and hil-host: each may use only those before it, so there is no circle.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// From a log to a verdict, and what stands beside that flow; `ablation` has switches for all of them.
const DISCOVERY: [&str; 12] = [
    "ablation",
    "preprocess",
    "model",
    "likelihood",
    "inference",
    "hypotheses",
    "criticism",
    "history",
    "diagnosis",
    "workbench",
    "forecast",
    "steady",
];

/// What was measured, what is stated of the vehicle, files of others; `digest` hashes for all of them.
const LOGS: [&str; 6] = ["digest", "channels", "record", "vehicle", "import", "export"];

/// From a wire to a campaign; `whole_file` writes files for all of them.
const RIG: [&str; 7] = ["whole_file", "spelling", "shards", "seats", "flight", "replay", "campaign"];

/// From figures in a terminal to the command line.
const HIL_HOST: [&str; 11] =
    ["terminal", "packets", "calls", "next_mission", "fleet", "score", "what_if", "pages", "paper", "serve", "cli"];

/// Folders of the crate that a source names: `crate::folder::…`, alone or in braces, in code that is not a test module's.
fn folders_used(text: &str) -> BTreeSet<String> {
    let code = code(text);
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

pub fn rust_files(below: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(below).unwrap_or_else(|e| panic!("{}: {e}", below.display()));
    let paths = entries.map(|e| e.expect("an entry").path());
    paths.flat_map(|p| if p.is_dir() { rust_files(&p) } else { vec![p] }).filter(|p| p.extension().is_some_and(|e| e == "rs")).collect()
}

fn check(source: &str, order: &[&str]) {
    let source = root().join(source);
    let files = rust_files(&source);
    let inside = files
        .iter()
        .filter_map(|p| Some((p.strip_prefix(&source).ok()?.to_str()?, p)))
        .filter(|(name, _)| name.contains('/') && !name.starts_with("tests/"));
    let bad: Vec<String> =
        inside.flat_map(|(name, path)| upward(order, name, &std::fs::read_to_string(path).expect("a source file"))).collect();
    assert!(files.len() > 20, "{}: only {} files", source.display(), files.len());
    assert!(bad.is_empty(), "each folder may use only those before it ({order:?}): {bad:#?}");
}

/// Where an effect may be called by its name: calibration numbers and a key of vehicle files that are called like an effect, what the
/// scorecards hide, and the truths of the plant, which knows no model.
const NAMES_EFFECTS: [&str; 8] = [
    "discovery/src/history/numbers.rs",
    "discovery/src/model/parameters",
    "logs/src/vehicle/mod.rs",
    "src/score/real/injected_errors.rs",
    "plant/src/effects.rs",
    "plant/src/trials/catalogue.rs",
    "plant/src/trials/twin.rs",
    "plant/src/trials/vehicle.rs",
];

fn hil_host() -> PathBuf {
    root().join("hil-host")
}

/// Code of a file without its test module and comments.
fn code(text: &str) -> String {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    code.lines().map(|l| l.split("//").next().unwrap_or_default()).flat_map(|l| [l, "\n"]).collect()
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
fn folders_of_logs_and_rig_use_only_those_before_them() {
    check("hil-host/logs/src", &LOGS);
    check("hil-host/rig/src", &RIG);
}

#[test]
fn an_upward_import_is_found_however_it_is_written() {
    let bad = |text: &str| upward(&DISCOVERY, "model/x.rs", text);
    assert_eq!(bad("use crate::likelihood::Problem;\n"), ["model/x.rs uses likelihood"]);
    assert_eq!(bad("use crate::{preprocess::Run, inference::{evidence, prior}};\n"), ["model/x.rs uses inference"]);
    assert_eq!(bad("fn f() { crate::workbench::add::add() }\n"), ["model/x.rs uses workbench"]);
    assert_eq!(bad("use crate::Problem;\n"), ["model/x.rs uses Problem"]);
    assert_eq!(bad("use crate::preprocess::Run; // crate::likelihood\n#[cfg(test)]\nmod tests {\n use crate::diagnosis;\n}\n"), [""; 0]);
    assert_eq!(upward(&DISCOVERY, "elsewhere/x.rs", ""), ["elsewhere/x.rs is in no folder of the order"]);
}

#[test]
fn no_effect_is_called_by_its_name_outside_the_catalogue() {
    let names: Vec<&str> = hydro::effects::CATALOGUE.iter().map(|e| e.name).collect();
    assert!(names.len() > 20 && names.contains(&"side_edge_lift"), "{names:?}");
    let mut bad = Vec::new();
    for folder in ["discovery/src", "logs/src", "rig/src", "src", "plant/src"] {
        for path in rust_files(&hil_host().join(folder)) {
            let file = path.strip_prefix(hil_host()).expect("below it").to_str().expect("a name").to_owned();
            if path.ends_with("tests.rs") || file.contains("src/tests/") || NAMES_EFFECTS.iter().any(|f| file.starts_with(f)) {
                continue;
            }
            let text = code(&std::fs::read_to_string(&path).expect("a source file"));
            bad.extend(names.iter().filter(|n| text.contains(&format!("\"{n}\""))).map(|n| format!("{file}: {n}")));
        }
    }
    assert!(bad.is_empty(), "ask the effect (a field of its row) instead of comparing its name: {bad:#?}");
}

/// Folder of the workspace.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Every source of the workspace by its path from the root.
pub fn sources() -> Vec<(String, String)> {
    let root = root();
    let files = ["benches", "firmware", "hil-host", "tests"].iter().flat_map(|f| rust_files(&root.join(f)));
    let own = files.filter(|p| !p.components().any(|c| c.as_os_str() == "target"));
    own.map(|p| {
        let name = p.strip_prefix(&root).expect("below it").to_str().expect("a name").to_owned();
        (name, std::fs::read_to_string(&p).expect("a source file"))
    })
    .collect()
}

/// Files of more lines than a file may have.
fn long_files(sources: &[(String, String)]) -> Vec<String> {
    let lines = sources.iter().map(|(name, text)| (name, text.lines().count()));
    lines.filter(|(_, n)| *n > 500).map(|(name, n)| format!("{name}: {n}")).collect()
}

#[test]
fn no_file_is_longer_than_500_lines() {
    let all = sources();
    assert!(all.len() > 400, "only {} sources", all.len());
    assert_eq!(long_files(&all), [""; 0], "a file over 500 lines is a missing room");
    let one = |lines: usize| long_files(&[("x.rs".to_owned(), "\n".repeat(lines))]);
    assert!(one(500).is_empty() && one(501) == ["x.rs: 501"]);
}

/// Functions that carry a leave to be longer than clippy's 80 lines.
fn long_functions(sources: &[(String, String)]) -> Vec<&str> {
    let leave = concat!("clippy::", "too_many_lines");
    sources.iter().filter(|(_, text)| text.contains(leave)).map(|(name, _)| name.as_str()).collect()
}

#[test]
fn no_function_is_let_be_longer_than_80_lines() {
    assert_eq!(long_functions(&sources()), [""; 0], "split it; clippy refuses more than 80 lines (clippy.toml)");
    let leave = format!("#[allow(clippy::{})]\nfn f() {{}}\n", "too_many_lines");
    assert_eq!(long_functions(&[("x.rs".to_owned(), leave)]), ["x.rs"]);
}

/// Names of tests that are longer than 70 characters: functions after `#[test]`.
fn long_test_names(sources: &[(String, String)]) -> Vec<String> {
    let mut long = Vec::new();
    for (_, text) in sources {
        for after in text.split("#[test]").skip(1) {
            let name = after.split("fn ").nth(1).and_then(|f| f.split('(').next()).unwrap_or_default();
            if name.len() > 70 && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
                long.push(name.to_owned());
            }
        }
    }
    long
}

#[test]
fn test_names_have_at_most_70_characters() {
    assert_eq!(long_test_names(&sources()), [""; 0]);
    let named = |n: usize| long_test_names(&[(String::new(), format!("#[test]\nfn {}() {{}}\n", "a".repeat(n)))]).len();
    assert_eq!([named(70), named(71)], [0, 1]);
}

/// Words that only their author can decode, where the field has its own: correlated with, reported, suspected, at its tolerance limit.
const PRIVATE: [&str; 15] = [
    "told", "untold", "beside", "doubt", "doubts", "doubted", "strain", "strained", "hurt", "look", "looks", "lie", "lies", "stranger",
    "brink",
];

/// Identifiers of a source that have such a word in them, in snake case or camel case.
fn private_words(text: &str) -> Vec<String> {
    // Strings are what a user reads; here it is of names.
    let code: String = code(&text.replace("\\\"", "")).split('"').step_by(2).collect::<Vec<_>>().join(" ");
    let names = code.split(|c: char| !c.is_alphanumeric() && c != '_');
    let words = |name: &str| {
        let mut apart = String::new();
        for (before, c) in std::iter::once('_').chain(name.chars()).zip(name.chars()) {
            if before.is_lowercase() && c.is_uppercase() {
                apart.push('_');
            }
            apart.extend(c.to_lowercase());
        }
        apart.split('_').any(|word| PRIVATE.contains(&word))
    };
    names.filter(|name| words(name)).map(str::to_owned).collect()
}

#[test]
fn names_are_made_of_words_of_the_field() {
    assert_eq!(private_words("fn f() { let told = doubtful(DOUBTED_S, x.isTold, \"told\"); } // beside"), ["told", "DOUBTED_S", "isTold"]);
    let ours = |name: &str| name.starts_with("hil-host/") || name.starts_with("firmware/control/");
    let all: Vec<(String, String)> = sources().into_iter().filter(|(name, _)| ours(name)).collect();
    let bad: Vec<String> =
        all.iter().flat_map(|(name, text)| private_words(text).into_iter().map(move |w| format!("{name}: {w}"))).collect();
    assert!(all.len() > 250 && bad.is_empty(), "{} files: {bad:#?}", all.len());
}

/// Files that the guide to logs and discovery names: alone in the paragraph of their folder, or with it.
fn named_in(guide: &str) -> Vec<String> {
    let mut folder = "";
    let mut files = Vec::new();
    for line in guide.lines() {
        folder = line.strip_prefix("**`").and_then(|l| l.split('`').next()).unwrap_or(folder);
        for word in line.split('`').skip(1).step_by(2).filter(|w| w.ends_with(".rs") && !w.contains(' ')) {
            let known = word.split('/').next().is_some_and(|f| (DISCOVERY.contains(&f) || LOGS.contains(&f)) && word.contains('/'));
            files.push(if known || word == "ablation.rs" { word.to_owned() } else { format!("{folder}/{word}") });
        }
    }
    files
}

#[test]
fn the_guide_to_discovery_names_real_files_and_every_folder() {
    let root = root();
    let guide = std::fs::read_to_string(root.join("docs/architecture.md")).expect("docs/architecture.md");
    let guide = guide
        .split("## Inside logs and discovery")
        .nth(1)
        .and_then(|g| g.split("`hil-host/rig/src` in the same way").next())
        .expect("the part");
    let guide = guide.replace("`tests/tests/all/folders.rs`", "").replace("`tests/tests/all/circles.rs`", "");
    let files = named_in(&guide);
    let missing: Vec<&String> = files
        .iter()
        .filter(|f| !["discovery", "logs"].iter().any(|room| root.join("hil-host").join(room).join("src").join(f).is_file()))
        .collect();
    assert!(files.len() > 40 && missing.is_empty(), "{} files named, not there: {missing:?}", files.len());
    for folder in DISCOVERY.iter().chain(&LOGS).filter(|f| !["ablation", "digest"].contains(f)) {
        assert!(guide.contains(&format!("**`{folder}`")), "docs/architecture.md has no paragraph on {folder}");
    }
}

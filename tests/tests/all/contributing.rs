//! What CONTRIBUTING.md promises of an effect: one row and one line.

use hydro::effects::CATALOGUE;
use std::path::Path;

#[test]
fn every_effect_is_registered_and_the_guide_names_real_places() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the workspace");
    let folder = root.join("hil-host/hydro/src/effects");
    let catalogue = std::fs::read_to_string(folder.join("mod.rs")).expect("the catalogue");
    let mut written = 0;
    for entry in std::fs::read_dir(&folder).expect("the folder of effects") {
        let text = std::fs::read_to_string(entry.expect("an entry").path()).expect("a source file");
        for row in text.lines().filter_map(|l| l.strip_prefix("pub static ")?.strip_suffix(": Effect = Effect {")) {
            assert!(catalogue.contains(&format!("::{row},\n")), "{row} is written but has no line in CATALOGUE");
            written += 1;
        }
    }
    assert_eq!(written, CATALOGUE.len());
    let names: std::collections::BTreeSet<&str> = CATALOGUE.iter().map(|e| e.name).collect();
    assert_eq!(names.len(), CATALOGUE.len(), "two effects of one name");

    let guide = std::fs::read_to_string(root.join("CONTRIBUTING.md")).expect("CONTRIBUTING.md");
    for file in ["lift.rs", "drag.rs", "buoyancy.rs", "inertia.rs", "sensing.rs", "water.rs", "mod.rs"] {
        assert!(guide.contains(file) && folder.join(file).is_file(), "{file}");
    }
    for script in guide.split("scripts/").skip(1).filter_map(|s| s.split([' ', '`', '\n']).next()) {
        assert!(root.join("scripts").join(script).is_file(), "scripts/{script}");
    }
}

/// `scripts/test` in a folder of its own, where cargo and the other scripts do nothing but fail when they are asked to.
fn test_command(failing: &str, tools: &[&str]) -> std::process::Output {
    use std::os::unix::fs::PermissionsExt;
    let scripts = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the workspace").join("scripts");
    static MADE: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);
    let own = MADE.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    let scratch = std::env::temp_dir().join(format!("glider-test-command-{}-{own}", std::process::id()));
    std::fs::create_dir_all(scratch.join("scripts")).expect("a scratch folder");
    let put = |place: &Path, text: &[u8]| {
        std::fs::write(place, text).expect("a script");
        std::fs::set_permissions(place, std::fs::Permissions::from_mode(0o755)).expect("its mode");
    };
    let stub = "#!/bin/sh\ncase \"$(basename \"$0\") $*\" in \"$FAILING\"*) exit 3 ;; esac\n";
    for entry in std::fs::read_dir(&scripts).expect("the scripts") {
        let name = entry.expect("an entry").file_name();
        let real = name == "test";
        let text = if real { std::fs::read(scripts.join(&name)).expect("scripts/test") } else { stub.into() };
        put(&scratch.join("scripts").join(&name), &text);
    }
    for tool in tools {
        put(&scratch.join(tool), stub.as_bytes());
    }
    // Of the tools of this machine those of the system.
    let path = format!("{}:/usr/bin:/bin", scratch.display());
    let mut command = std::process::Command::new(scratch.join("scripts/test"));
    let output = command.env("PATH", path).env("FAILING", failing).env("CI", "true").output().expect("scripts/test starts");
    std::fs::remove_dir_all(&scratch).expect("the scratch folder goes");
    output
}

const TOOLS: [&str; 2] = ["cargo", "cargo-deny"];

#[test]
fn regress_no_check_of_dependencies_fails_where_all_must_run() {
    let without = test_command("none", &["cargo"]);
    assert!(!without.status.success() && String::from_utf8_lossy(&without.stderr).contains("no cargo-deny"), "{without:?}");
    // Without the list of known holes the rest is checked.
    let no_list = test_command("cargo deny fetch", &TOOLS);
    assert!(no_list.status.success(), "{no_list:?}");
}

#[test]
fn regress_the_test_command_fails_exactly_when_a_step_does() {
    let sound = test_command("none", &TOOLS);
    assert!(sound.status.success(), "{sound:?}");
    assert!(String::from_utf8_lossy(&sound.stdout).contains("all checks passed"), "{sound:?}");
    let steps =
        ["setup-target", "fetch-samples", "setup-python", "check-firmware", "prove", "cargo fmt", "cargo clippy", "cargo deny --offline"];
    for step in [&steps[..], &["cargo doc", "cargo test --release --workspace --no-fail-fast", "cargo test"]].concat() {
        let failed = test_command(step, &TOOLS);
        assert!(!failed.status.success(), "{step} failed and scripts/test did not: {failed:?}");
        assert!(!String::from_utf8_lossy(&failed.stdout).contains("all checks passed"), "{step}: {failed:?}");
    }
}

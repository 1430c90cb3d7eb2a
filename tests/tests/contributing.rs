//! What CONTRIBUTING.md promises of an effect: one type and one line.

use hydro::effects::{CATALOGUE, Effect};
use std::path::Path;

#[test]
fn every_effect_type_is_registered_and_the_guide_names_real_places() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ lies in the workspace");
    let folder = root.join("hil-host/hydro/src/effects");
    let mut written = Vec::new();
    for entry in std::fs::read_dir(&folder).expect("the folder of effects") {
        let text = std::fs::read_to_string(entry.expect("an entry").path()).expect("a source file");
        written.extend(text.lines().filter_map(|l| l.strip_prefix("impl Effect for ")?.split([' ', '{']).next().map(str::to_owned)));
    }
    let registered: Vec<String> = CATALOGUE.iter().map(|e| format!("{e:?}")).collect();
    for effect in &written {
        assert!(registered.contains(effect), "{effect} is written but has no line in CATALOGUE");
    }
    assert_eq!(written.len(), CATALOGUE.len(), "{written:?}");
    let mut names: Vec<&str> = CATALOGUE.iter().map(|e| Effect::name(*e)).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), CATALOGUE.len(), "two effects of one name");

    let guide = std::fs::read_to_string(root.join("CONTRIBUTING.md")).expect("CONTRIBUTING.md");
    for file in ["lift.rs", "drag.rs", "buoyancy.rs", "inertia.rs", "sensing.rs", "water.rs", "mod.rs"] {
        assert!(guide.contains(file) && folder.join(file).is_file(), "{file}");
    }
    for script in guide.split("scripts/").skip(1).filter_map(|s| s.split([' ', '`', '\n']).next()) {
        assert!(root.join("scripts").join(script).is_file(), "scripts/{script}");
    }
}

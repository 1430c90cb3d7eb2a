//! The Python package as a user has it: its files with the extension module that was built for these tests, its pytest suite and its
//! notebook. `scripts/setup-python` makes the virtual environment (data-cache/python; GLIDER_PYTHON names another); without it this says
//! "SKIPPED LOUDLY".

use std::path::{Path, PathBuf};
use std::process::Command;

fn here() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The interpreter of the environment, if there is one.
fn python() -> Option<PathBuf> {
    let environment = std::env::var_os("GLIDER_PYTHON").map_or_else(|| here().join("../../data-cache/python"), PathBuf::from);
    let python = environment.join("bin/python");
    let ready = python.is_file() && environment.join("ready").is_file();
    if !ready {
        eprintln!("SKIPPED LOUDLY: no {} (scripts/setup-python makes it)", environment.display());
    }
    ready.then_some(python)
}

/// The module that was built for this test: beside its own program.
fn module() -> PathBuf {
    let program = std::env::current_exe().expect("a test has a file");
    let folder = program.parent().expect("in a folder");
    let name = format!("{}glider_workbench{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let file = [folder.join(&name), folder.join("..").join(&name)].into_iter().find(|f| f.is_file());
    file.unwrap_or_else(|| panic!("{name} was not built beside {}", program.display()))
}

fn copied(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("the package").flatten() {
        if entry.path().is_file() {
            std::fs::copy(entry.path(), to.join(entry.file_name())).expect("copied");
        }
    }
}

#[test]
fn the_package_passes_its_tests_and_its_notebook_runs() {
    let Some(python) = python() else { return };
    let folder = std::env::temp_dir().join(format!("glider-python-{}", std::process::id()));
    copied(&here().join("package/glider_workbench"), &folder.join("glider_workbench"));
    std::fs::copy(module(), folder.join("glider_workbench/_core.abi3.so")).expect("copied");
    let out = Command::new(python)
        .args(["-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "--durations=5", "tests"])
        .current_dir(here())
        .env("PYTHONPATH", &folder)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("MPLBACKEND", "agg")
        .env("OPENBLAS_NUM_THREADS", "1")
        .output()
        .expect("pytest starts");
    std::fs::remove_dir_all(&folder).expect("removed");
    let said = String::from_utf8_lossy(&out.stdout);
    eprintln!("{said}");
    assert!(out.status.success() && said.contains(" passed"), "{said}\n{}", String::from_utf8_lossy(&out.stderr));
}

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

/// A folder with the package and the module in it.
fn staged(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("glider-python-{name}-{}", std::process::id()));
    copied(&here().join("package/glider_workbench"), &folder.join("glider_workbench"));
    std::fs::copy(module(), folder.join("glider_workbench/_core.abi3.so")).expect("copied");
    folder
}

/// What a program prints; it has to succeed.
fn said(command: &mut Command) -> String {
    let out = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    let text = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(out.status.success(), "{command:?}: {text}\n{}", String::from_utf8_lossy(&out.stderr));
    text
}

/// A wheel of the module that was built, named and described by maturin as `pip install ./hil-host/python` has it, goes into a new
/// environment by plain `pip install` and works there. Not built anew by maturin, which would compile everything again; numpy, pandas and xarray
/// are those of the tests' environment, so that nothing is fetched.
#[test]
fn a_wheel_installs_in_a_fresh_environment_and_works_there() {
    let Some(python) = python() else { return };
    let stage = staged("wheel");
    let (out, fresh) = (stage.with_extension("out"), stage.with_extension("fresh"));
    let maturin = python.with_file_name("maturin");
    said(
        Command::new(maturin)
            .args(["pep517", "write-dist-info", "--metadata-directory"])
            .arg(&stage)
            .arg("--interpreter")
            .arg(&python)
            .current_dir(here()),
    );
    std::fs::create_dir_all(&out).expect("a folder");
    said(Command::new(&python).args(["-m", "wheel", "pack", "--dest-dir"]).arg(&out).arg(&stage));
    let wheels: Vec<PathBuf> = std::fs::read_dir(&out).expect("wheels").flatten().map(|e| e.path()).collect();
    let [wheel] = wheels.as_slice() else { panic!("{wheels:?}") };
    let name = wheel.file_name().expect("a name").to_string_lossy();
    assert!(name.starts_with("glider_workbench-") && name.contains("-cp310-abi3-"), "one wheel for Python 3.10 and later: {name}");
    said(Command::new(&python).args(["-m", "venv"]).arg(&fresh));
    said(Command::new(fresh.join("bin/pip")).args(["install", "--no-index", "--no-deps", "--disable-pip-version-check"]).arg(wheel));
    let shown = said(Command::new(fresh.join("bin/pip")).args(["show", "glider-workbench"]));
    assert!(shown.contains("Requires: numpy, pandas, xarray"), "{shown}");
    let packages = said(Command::new(&python).args(["-c", "import numpy, pathlib; print(pathlib.Path(numpy.__file__).parents[1])"]));
    let program = "import glider_workbench as gw; print(gw.__file__); print(gw.polar('slocum-standard').attrs['vehicle'], gw.faults(only='roll:off@dive').passed)";
    let work = Command::new(fresh.join("bin/python")).args(["-c", program]).current_dir(&out).env("PYTHONPATH", packages.trim()).output();
    let work = work.expect("python starts");
    let text = String::from_utf8_lossy(&work.stdout).into_owned();
    assert!(
        work.status.success() && text.contains("fresh") && text.trim_end().ends_with("True"),
        "{text}{}",
        String::from_utf8_lossy(&work.stderr)
    );
    for folder in [stage, out, fresh] {
        std::fs::remove_dir_all(folder).expect("removed");
    }
}

#[test]
fn the_package_passes_its_tests_and_its_notebook_runs() {
    let Some(python) = python() else { return };
    let folder = staged("tests");
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

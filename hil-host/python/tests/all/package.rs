//! The Python package as a user has it: a wheel of its files and of the extension module that was built for these tests, installed by pip.
//! From there run its pytest suite, its notebook and the recipes of docs/python.md, and in bare environments what has to work with the
//! oldest and the newest versions of all it needs. `scripts/setup-python` makes the environment (data-cache/python; GLIDER_PYTHON names
//! another); without it this says "SKIPPED LOUDLY".

use std::path::{Path, PathBuf};
use std::process::Command;

fn here() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn root() -> PathBuf {
    here().join("../..").canonicalize().expect("the workspace")
}

/// The environment, if there is one.
fn environment() -> Option<PathBuf> {
    let environment = std::env::var_os("GLIDER_PYTHON").map_or_else(|| root().join("data-cache/python"), PathBuf::from);
    let ready = environment.join("bin/python").is_file() && environment.join("ready").is_file();
    if !ready {
        eprintln!("SKIPPED LOUDLY: no {} (scripts/setup-python makes it)", environment.display());
    }
    ready.then_some(environment)
}

/// The module that was built for this test: beside its own program.
fn module() -> PathBuf {
    let program = std::env::current_exe().expect("a test has a file");
    let folder = program.parent().expect("in a folder");
    let name = format!("{}glider_workbench{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let file = [folder.join(&name), folder.join("..").join(&name)].into_iter().find(|f| f.is_file());
    file.unwrap_or_else(|| panic!("{name} was not built beside {}", program.display()))
}

/// What a program prints; it has to succeed.
fn said(command: &mut Command) -> String {
    let out = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    let text = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(out.status.success(), "{command:?}: {text}\n{}", String::from_utf8_lossy(&out.stderr));
    text
}

fn pip(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.args(["-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--no-index"]).env_remove("PIP_FIND_LINKS");
    command
}

/// A folder of one test, with a wheel in it; removed in the end.
struct Place {
    folder: PathBuf,
    wheel: PathBuf,
}

impl Drop for Place {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.folder).ok();
    }
}

impl Place {
    /// A wheel of the module that was built, named and described by maturin. Not built anew, which would compile everything again.
    fn with_wheel(environment: &Path, name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("glider-python-{name}-{}", std::process::id()));
        let (stage, out) = (folder.join("stage"), folder.join("dist"));
        let package = stage.join("glider_workbench");
        [&package, &out].into_iter().for_each(|f| std::fs::create_dir_all(f).expect("a folder"));
        for entry in std::fs::read_dir(here().join("package/glider_workbench")).expect("the package").flatten() {
            if entry.path().is_file() {
                std::fs::copy(entry.path(), package.join(entry.file_name())).expect("copied");
            }
        }
        std::fs::copy(module(), package.join("_core.abi3.so")).expect("copied");
        let python = environment.join("bin/python");
        let mut maturin = Command::new(environment.join("bin/maturin"));
        maturin.args(["pep517", "write-dist-info", "--metadata-directory"]).arg(&stage).arg("--interpreter").arg(&python);
        said(maturin.current_dir(root()));
        said(Command::new(&python).args(["-m", "wheel", "pack", "--dest-dir"]).arg(&out).arg(&stage));
        let wheels: Vec<PathBuf> = std::fs::read_dir(&out).expect("wheels").flatten().map(|e| e.path()).collect();
        let [wheel] = wheels.as_slice() else { panic!("{wheels:?}") };
        let name = wheel.file_name().expect("a name").to_string_lossy();
        assert!(name.starts_with("glider_workbench-") && name.contains("-cp310-abi3-"), "one wheel for Python 3.10 and later: {name}");
        Self { wheel: wheel.clone(), folder }
    }

    /// An interpreter that has the wheel installed, and with it what the tests need.
    fn installed(&self, environment: &Path) -> PathBuf {
        let (python, fresh) = (environment.join("bin/python"), self.folder.join("fresh"));
        said(Command::new(&python).args(["-m", "venv", "--without-pip"]).arg(&fresh));
        let site = |python: &Path| said(Command::new(python).args(["-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]));
        let (own, of_tests) = (site(&fresh.join("bin/python")), site(&python));
        std::fs::write(Path::new(own.trim()).join("tests.pth"), of_tests).expect("written");
        said(pip(&python).args(["--no-deps", "--no-compile", "--target", own.trim()]).arg(&self.wheel));
        fresh.join("bin/python")
    }
}

/// Runs pytest on some of its files, from an installed wheel.
fn pytest(name: &str, files: &[&str]) {
    let Some(environment) = environment() else { return };
    let place = Place::with_wheel(&environment, name);
    let out = Command::new(place.installed(&environment))
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider", "--durations=5", "--rootdir", "."])
        .args(files.iter().map(|f| format!("tests/{f}")))
        .current_dir(here())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("MPLBACKEND", "agg")
        .env("OPENBLAS_NUM_THREADS", "1")
        .output()
        .expect("pytest starts");
    let said = String::from_utf8_lossy(&out.stdout);
    eprintln!("{said}");
    assert!(out.status.success() && said.contains(" passed"), "{said}\n{}", String::from_utf8_lossy(&out.stderr));
}

/// The page's recipes, the notebook and the types; what else lies in tests/ is [`the_package_passes_its_tests`], in two halves.
const SHOWN: [&str; 3] = ["test_recipes.py", "test_notebook.py", "test_types.py"];

/// The file that the second half begins with.
const MIDDLE: &str = "test_f";

/// The other files of tests/, in the order of their names: those before [`MIDDLE`], or those from it on.
fn others(before: bool) -> Vec<String> {
    let names = std::fs::read_dir(here().join("tests")).expect("tests").flatten().map(|e| e.file_name().to_string_lossy().into_owned());
    let mut others: Vec<String> = names.filter(|n| n.starts_with("test_") && !SHOWN.contains(&n.as_str())).collect();
    others.retain(|n| (n.as_str() < MIDDLE) == before);
    others.sort();
    assert!(others.len() > 1, "{others:?}");
    others
}

#[test]
fn the_recipes_of_the_page_run_from_an_installed_wheel() {
    pytest("recipes", &["test_recipes.py", "test_notebook.py"]);
}

#[test]
fn the_types_are_those_of_the_stubs() {
    pytest("types", &["test_types.py"]);
}

#[test]
fn the_package_passes_its_tests() {
    let files = others(true);
    pytest("tests", &files.iter().map(String::as_str).collect::<Vec<_>>());
}

#[test]
fn the_package_passes_its_other_tests() {
    let files = others(false);
    pytest("others", &files.iter().map(String::as_str).collect::<Vec<_>>());
}

/// `pip install dist/*.whl` where nothing is installed, with the oldest versions that the metadata allow and the newest at hand.
#[test]
fn a_wheel_works_in_bare_environments_of_the_oldest_and_newest_python() {
    let Some(environment) = environment() else { return };
    let place = Place::with_wheel(&environment, "bare");
    for version in ["3.10", "3.13"] {
        let wheels = environment.join(format!("wheels-{version}"));
        let Ok(interpreter) = std::fs::read_to_string(wheels.join("python")) else {
            eprintln!("SKIPPED LOUDLY: no Python {version} (scripts/setup-python)");
            continue;
        };
        let fresh = place.folder.join(version);
        said(Command::new(interpreter.trim()).args(["-m", "venv"]).arg(&fresh));
        let python = fresh.join("bin/python");
        said(pip(&python).args(["--no-compile", "--find-links"]).arg(&wheels).arg(format!("{}[netcdf]", place.wheel.display())));
        let shown = said(Command::new(&python).args(["-m", "pip", "show", "--verbose", "glider-workbench"]));
        for line in ["Requires: numpy, pandas, xarray", "Topic :: Scientific/Engineering :: Oceanography"] {
            assert!(shown.contains(line), "{line} is not in {shown}");
        }
        let work = said(
            Command::new(&python)
                .args(["-W", "error::FutureWarning:glider_workbench", "tests/bare.py"])
                .arg(here().join("../logs/tests/formats"))
                .current_dir(here())
                .env("PYTHONDONTWRITEBYTECODE", "1"),
        );
        assert!(work.contains(&format!("works {version}.")), "{work}");
        eprint!("{work}");
    }
}

/// The source package holds what it is built from (scripts/build-wheels builds it), its licences and its page.
#[test]
fn the_source_package_is_whole() {
    let Some(environment) = environment() else { return };
    let folder = std::env::temp_dir().join(format!("glider-python-source-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    said(Command::new(environment.join("bin/maturin")).args(["sdist", "--out"]).arg(&folder).current_dir(root()));
    let made = std::fs::read_dir(&folder).expect("made").flatten().map(|e| e.path()).next().expect("an archive");
    said(Command::new("tar").arg("-xzf").arg(&made).args(["--strip-components", "1", "-C"]).arg(&folder));
    for file in
        ["LICENSE-MIT", "LICENSE-APACHE", "PKG-INFO", "hil-host/python/README.md", "hil-host/python/package/glider_workbench/py.typed"]
    {
        assert!(folder.join(file).is_file(), "{file} is not in the source package");
    }
    let about = std::fs::read_to_string(folder.join("PKG-INFO")).expect("PKG-INFO");
    assert!(about.contains("License-File: LICENSE-MIT") && about.contains("# glider-workbench"), "{about}");
    for vehicle in std::fs::read_dir(root().join("vehicles")).expect("vehicles").flatten() {
        assert!(folder.join("vehicles").join(vehicle.file_name()).is_file(), "{vehicle:?} is not in the source package");
    }
    said(Command::new("cargo").args(["metadata", "--offline", "--format-version", "1", "--no-deps"]).current_dir(&folder));
    std::fs::remove_dir_all(folder).expect("removed");
}

//! The extension module `glider_workbench._core`: every command of `glider` as a function that returns its JSON document, and flights and
//! tables as columns. What makes xarray and pandas of them is Python, in `package/glider_workbench`; nothing is computed there.
//!
//! The interpreter's lock is given back while Rust works, so threads of a program run meanwhile; Rust works on a thread of its own, and the
//! calling one asks the interpreter for signals, so that Ctrl-C ends the work.
//!
//! PyO3 without its attribute macros: with them the build tools' crates get other features, and everything that is built for the tests of
//! the workspace would be built twice. So the functions take their arguments from a tuple, and the module's one C function is written here.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use hil_host::cli::{self, Verdict};
use hil_host::fleet::archive;
use logs::export::netcdf::Positions;
use logs::export::{named_columns, table::Table};
use logs::import::{Origin, import_all, netcdf, position};
use logs::record::csv::{self, ReadError};
use logs::record::seawater;
use logs::{Flight, stop, vehicle};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCFunction, PyDict, PyTuple};
use pyo3::{create_exception, ffi};
use rig::shards::kept;

create_exception!(
    glider_workbench,
    GliderError,
    PyValueError,
    "Bad input: the message names the file and what to do, as the command `glider` would."
);

fn refused(why: impl std::fmt::Display) -> PyErr {
    GliderError::new_err(why.to_string())
}

/// The one argument of a function.
fn only<'py, T: for<'a> FromPyObject<'a, 'py, Error = PyErr>>(arguments: &Bound<'py, PyTuple>) -> PyResult<T> {
    arguments.get_item(0)?.extract()
}

/// Doubles in the machine's order of bytes, as `numpy.frombuffer` takes them.
fn bytes(py: Python<'_>, values: &[f64]) -> Py<PyBytes> {
    let raw: Vec<u8> = values.iter().flat_map(|v| v.to_ne_bytes()).collect();
    PyBytes::new(py, &raw).unbind()
}

/// How often the interpreter is asked whether somebody pressed Ctrl-C.
const SIGNALS: Duration = Duration::from_millis(50);
/// Stack of the thread that works, bytes: that of a program's first thread.
const STACK: usize = 8 << 20;

/// Does `work` without the interpreter's lock until it is done or a signal's handler raises, which ends it.
fn done<T: Send>(py: Python<'_>, work: impl FnOnce() -> Result<T, String> + Send) -> PyResult<T> {
    let flag = stop::Flag::default();
    let (ends, ended) = mpsc::channel::<()>();
    let of_work = flag.clone();
    let all = move || {
        let _ends = ends;
        stop::heed(Some(of_work));
        work()
    };
    py.detach(move || {
        std::thread::scope(|scope| {
            let worker = std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, all)?;
            let mut raised = None;
            while ended.recv_timeout(SIGNALS) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none() {
                    raised = Python::attach(|py| py.check_signals()).err();
                    flag.store(raised.is_some(), Ordering::Relaxed);
                }
            }
            match (worker.join(), raised) {
                (_, Some(signal)) => Err(signal),
                (Ok(result), None) => result.map_err(refused),
                (Err(panic), None) => {
                    let words = panic.downcast_ref::<String>().cloned().or_else(|| panic.downcast_ref::<&str>().map(|s| (*s).to_owned()));
                    Err(PyRuntimeError::new_err(format!("a fault of the program itself: {}", words.unwrap_or_default())))
                }
            }
        })
    })
}

/// Runs a command in this process: its JSON document, and whether its result is positive (exit code 0, not 1).
fn command(arguments: &Bound<'_, PyTuple>) -> PyResult<(String, bool)> {
    let words: Vec<String> = only(arguments)?;
    let (document, verdict) = done(arguments.py(), || cli::document(&words))?;
    Ok((document.to_string(), verdict == Verdict::Ok))
}

/// A column of a flight: name, unit, values.
type Column = (String, String, Py<PyBytes>);

/// A flight as read, with what its columns do not say.
#[derive(Default)]
struct Known {
    flight: Flight,
    /// Unix time at which its clock is zero, s.
    start_unix_s: Option<f64>,
    origins: Vec<Origin>,
    /// Its vehicle file, as JSON.
    vehicle: Option<String>,
    /// What was found, done and left out.
    notes: Vec<String>,
}

/// The document of a vehicle file; none of one that cannot be used, which a command says when it is asked to.
fn vehicle_json(name: &Path, text: &str) -> Option<String> {
    Some(vehicle::parse_text(text, name).ok()?.document.to_string())
}

/// A flight in the flight format, with what lies next to it.
fn own(path: &Path) -> Result<Known, ReadError> {
    let flight = csv::flight(path)?;
    let folder = if path.is_dir() { Some(path) } else { path.parent().filter(|_| path.ends_with("flight.csv")) };
    let import = folder.map(archive::import_json).unwrap_or_default();
    let vehicle = vehicle::file_next_to(path).ok().flatten().and_then(|f| vehicle_json(&f, &vehicle::text::of_file(&f).ok()?));
    let notes = flight.unread.clone();
    Ok(Known { start_unix_s: archive::start_unix_s(&import), origins: archive::origins(&import), vehicle, notes, flight })
}

/// Files of any origin.
fn imported(files: &[PathBuf]) -> Result<Known, String> {
    let imported = match files {
        // All that an import repairs was repaired when it was read first.
        [one] if netcdf::is_dataset(one) => netcdf::import(one),
        _ => import_all(files, &[], None),
    };
    let mut imported = imported.map_err(|e| e.to_string())?;
    // A segment's first fix may have been left out since the others were counted from it.
    let segments = imported.flight.segment.clone();
    position::rebase(&mut imported.flight, &mut imported.report, &segments);
    let vehicle = imported.vehicle_text().and_then(|(name, text)| vehicle_json(Path::new(name), &text));
    let report = imported.report;
    let notes = report.left_out.into_iter().map(|what| format!("left out: {what}")).chain(report.notes).collect();
    Ok(Known { flight: imported.flight, start_unix_s: report.start_unix_s, origins: report.origins, vehicle, notes })
}

/// A flight of any kind. A csv is one of the flight format, or any other that can be imported.
fn known(files: &[PathBuf]) -> Result<Known, String> {
    let is_csv = |file: &Path| file.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
    let [one] = files else { return imported(files) };
    if !is_csv(one) && !one.join("flight.csv").is_file() {
        return imported(files);
    }
    match own(one) {
        // Its header is another one's.
        Err(ReadError::Content { line: 1, .. }) if is_csv(one) => imported(files),
        // So are its dates, or its names for no value.
        Err(ReadError::Content { line: 2, .. }) if is_csv(one) => imported(files),
        read => read.map_err(|e| e.to_string()),
    }
}

/// What [`read`] returns: name, columns, start, vehicle, notes.
type Read = (String, Vec<Column>, Option<f64>, Option<String>, Vec<String>);

/// Reads a flight of any kind: its name, its columns in the names and units of the flight format and where it was, the Unix time at which
/// its clock is zero, its vehicle file as JSON, and notes.
fn read(arguments: &Bound<'_, PyTuple>) -> PyResult<Read> {
    let (py, files) = (arguments.py(), only::<Vec<PathBuf>>(arguments)?);
    let Known { flight, start_unix_s, origins, vehicle, notes } = done(py, || known(&files))?;
    let places = Positions::of(&flight, &origins, &flight.time_s);
    let depth = flight.pressure_pa.iter().map(|p| seawater::depth_m(*p, places.middle_lat)).collect();
    let mut columns = named_columns(&flight);
    columns.push(("depth".into(), "m".into(), depth));
    if !origins.is_empty() {
        let degrees = [("latitude", "north", places.lat), ("longitude", "east", places.lon)];
        let fixes = [("latitude_gps", "north", places.lat_gps), ("longitude_gps", "east", places.lon_gps)];
        columns.extend(degrees.into_iter().chain(fixes).map(|(name, unit, values)| (name.into(), format!("degrees_{unit}"), values)));
    }
    let columns = columns.into_iter().map(|(name, unit, values)| (name, unit, bytes(py, &values))).collect();
    Ok((flight.name, columns, start_unix_s, vehicle, notes))
}

/// Columns of a table by name: whole numbers, texts and numbers; and what is said of all of it.
type Columns = (Vec<(String, Vec<i32>)>, Vec<(String, Vec<String>)>, Vec<(String, Py<PyBytes>)>, Vec<(String, String)>);

/// Reads a table that `glider fleet` or `glider timeline` wrote.
fn table(arguments: &Bound<'_, PyTuple>) -> PyResult<Columns> {
    let (py, path) = (arguments.py(), only::<PathBuf>(arguments)?);
    let bad = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    let t = done(py, || Table::read(std::fs::File::open(&path).map_err(|e| bad(&e))?).map_err(|e| bad(&e)))?;
    let numbers = t.numbers.iter().map(|(name, values)| (name.clone(), bytes(py, values))).collect();
    Ok((t.whole, t.texts, numbers, t.about))
}

/// Says which file this module is: what another build kept of a fleet is asked anew.
fn identify(arguments: &Bound<'_, PyTuple>) -> PyResult<()> {
    kept::program_is(only(arguments)?);
    Ok(())
}

/// What stands in the module.
fn fill(module: &Bound<'_, PyModule>) -> PyResult<()> {
    let py = module.py();
    module.add("GliderError", py.get_type::<GliderError>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    type Arguments<'a, 'py> = &'a Bound<'py, PyTuple>;
    type Named<'a, 'py> = Option<&'a Bound<'py, PyDict>>;
    module.add("command", PyCFunction::new_closure(py, Some(c"command"), None, |a: Arguments, _: Named| command(a))?)?;
    module.add("read", PyCFunction::new_closure(py, Some(c"read"), None, |a: Arguments, _: Named| read(a))?)?;
    module.add("table", PyCFunction::new_closure(py, Some(c"table"), None, |a: Arguments, _: Named| table(a))?)?;
    module.add("identify", PyCFunction::new_closure(py, Some(c"identify"), None, |a: Arguments, _: Named| identify(a))?)
}

/// The definition of the module, which the interpreter keeps a pointer to.
struct Definition(std::cell::UnsafeCell<ffi::PyModuleDef>);

// SAFETY: the interpreter alone touches it, under its lock.
unsafe impl Sync for Definition {}

static DEFINITION: Definition = Definition(std::cell::UnsafeCell::new(ffi::PyModuleDef {
    m_base: ffi::PyModuleDef_HEAD_INIT,
    m_name: c"_core".as_ptr(),
    m_doc: c"Compiled part of glider_workbench.".as_ptr(),
    m_size: -1,
    m_methods: std::ptr::null_mut(),
    m_slots: std::ptr::null_mut(),
    m_traverse: None,
    m_clear: None,
    m_free: None,
}));

/// Makes the module; called by the interpreter at its import.
///
/// # Safety
/// The calling thread holds the interpreter's lock, as the import system does.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn PyInit__core() -> *mut ffi::PyObject {
    // SAFETY: the lock is held by the caller, the definition is valid for ever, and the pointer is owned.
    unsafe {
        let py = Python::assume_attached();
        let made = Bound::from_owned_ptr_or_err(py, ffi::PyModule_Create(DEFINITION.0.get()));
        let filled = made.and_then(|module| {
            fill(module.cast::<PyModule>().map_err(PyErr::from)?)?;
            Ok(module)
        });
        match filled {
            Ok(module) => module.into_ptr(),
            Err(why) => {
                why.restore(py);
                std::ptr::null_mut()
            }
        }
    }
}

//! The extension module `glider_workbench._core`: every command of `glider` as a function that returns its JSON document, and flights and
//! tables as columns. What makes xarray and pandas of them is Python, in `package/glider_workbench`; nothing is computed there.
//!
//! The interpreter's lock is given back while Rust works, so threads of a program run beside it.
//!
//! PyO3 without its attribute macros: with them the build tools' crates get other features, and everything that is built for the tests of
//! the workspace would be built twice. So the functions take their arguments from a tuple, and the module's one C function is written here.

use std::path::PathBuf;

use hil_host::cli::{self, Verdict};
use hil_host::fleet::archive;
use logs::export::{named_columns, table::Table};
use pyo3::exceptions::PyValueError;
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

/// Runs a command in this process: its JSON document, and whether its result is positive (exit code 0, not 1).
fn command(arguments: &Bound<'_, PyTuple>) -> PyResult<(String, bool)> {
    let words: Vec<String> = only(arguments)?;
    let (document, verdict) = arguments.py().detach(|| cli::document(&words)).map_err(refused)?;
    Ok((document.to_string(), verdict == Verdict::Ok))
}

/// A column of a flight: name, unit, values.
type Column = (String, String, Py<PyBytes>);

/// Reads a flight of any kind: its name, and its columns in the names and units of the flight format.
fn read(arguments: &Bound<'_, PyTuple>) -> PyResult<(String, Vec<Column>)> {
    let (py, files) = (arguments.py(), only::<Vec<PathBuf>>(arguments)?);
    let flight = py.detach(|| archive::read(&files)).map_err(|e| refused(format!("{e:#}")))?;
    let columns = named_columns(&flight).into_iter().map(|(name, unit, values)| (name, unit, bytes(py, &values))).collect();
    Ok((flight.name, columns))
}

/// Columns of a table by name: whole numbers, texts and numbers; and what is said of all of it.
type Columns = (Vec<(String, Vec<i32>)>, Vec<(String, Vec<String>)>, Vec<(String, Py<PyBytes>)>, Vec<(String, String)>);

/// Reads a table that `glider fleet` or `glider timeline` wrote.
fn table(arguments: &Bound<'_, PyTuple>) -> PyResult<Columns> {
    let (py, path) = (arguments.py(), only::<PathBuf>(arguments)?);
    let read = || Table::read(std::fs::File::open(&path)?);
    let t = py.detach(read).map_err(|e| refused(format!("{}: {e}", path.display())))?;
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

//! A case of the plant as its finder meets it: written to files, and read back.

use hil_host::score;
use logs::record::csv;
use logs::{Flight, Vehicle, vehicle};
use plant::trials::{Case, Row, Spec, generate};

/// The log and the vehicle of one case.
#[allow(dead_code, reason = "not every test asks for a case of a plan")]
pub fn read_back(spec: &Spec, seed: u64, index: usize) -> (Flight, Vehicle) {
    written(&generate(spec, seed, index))
}

/// The same of a case at hand.
#[allow(dead_code, reason = "not every test reads a case back")]
pub fn written(case: &Case) -> (Flight, Vehicle) {
    // Tests run beside each other in threads of their own.
    let folder = std::env::temp_dir().join(format!("glider-case-{}-{:?}", std::process::id(), std::thread::current().id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    let case = score::diagnosis::write_case(&folder, case).expect("a case can be written");
    let log = csv::flight(&case).expect("our own log reads");
    let v = vehicle::read(&case.join("vehicle.json")).expect("our own vehicle file reads");
    std::fs::remove_dir_all(folder).ok();
    (log, v)
}

/// Leaves the rows that a logger writes every so many seconds, and the first of each segment.
#[allow(dead_code, reason = "few tests are of sparse logs")]
pub fn log_every(seconds: f64, rows: &mut Vec<Row>) {
    let mut last = (0, f64::NEG_INFINITY);
    rows.retain(|row| {
        let keep = row.segment != last.0 || row.time_s >= last.1 + seconds;
        last = if keep { (row.segment, row.time_s) } else { last };
        keep
    });
}

//! Imports against files of real vehicles, which are not in this repository.
//!
//! GLIDER_FLIGHTS: `slocum_comet2016/raw` (dbd, ebd, cac) with the table made from
//! them by other people's tools. GLIDER_DBD_SAMPLES: the `data` folder of the
//! Python package `dbdreader` 0.6.3 (test input only); `scripts/fetch-samples` brings it.

use std::path::PathBuf;

use crate::Flight;
use crate::import::import;

fn folder(variable: &str, relative: &str) -> Option<PathBuf> {
    let fetched = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../data-cache/samples/dbdreader-0.6.3/dbdreader/data");
    let fetched = (variable == "GLIDER_DBD_SAMPLES" && fetched.is_dir()).then(|| fetched.into_os_string());
    let root = std::env::var_os(variable).or(fetched);
    if root.is_none() {
        eprintln!("skipped: no flights ({variable} is not set)");
    }
    root.map(|r| PathBuf::from(r).join(relative))
}

/// Largest difference of `ours` from `theirs` at the same instants, over the share `keep` of best samples.
fn difference(ours: &Flight, theirs: &Flight, offset_s: f64, channel: impl Fn(&Flight) -> &[f64], keep: f64) -> (f64, usize) {
    let mut all = Vec::new();
    for (i, t) in theirs.time_s.iter().enumerate() {
        let at = t + offset_s;
        let k = ours.time_s.partition_point(|s| *s < at - 0.002);
        if ours.time_s.get(k).is_some_and(|s| (s - at).abs() < 0.002) {
            let (a, b) = (channel(ours)[k], channel(theirs)[i]);
            if a.is_finite() && b.is_finite() {
                all.push((a - b).abs());
            }
        }
    }
    all.sort_by(f64::total_cmp);
    assert!(!all.is_empty(), "no instant in common");
    (all[((all.len() - 1) as f64 * keep) as usize], all.len())
}

#[test]
fn validate_raw_comet_files_reproduce_the_tidy_table() {
    let Some(root) = folder("GLIDER_FLIGHTS", "slocum_comet2016") else { return };
    let imported = import(&root.join("raw"), &[]).expect("an import");
    let theirs = crate::record::csv::flight(&root.join("comet2016_tidy.csv")).expect("the table");
    let ours = &imported.flight;
    assert!(imported.report.files.iter().all(|f| f.problems.is_empty()), "{:?}", imported.report.files);
    let start = imported.report.start_unix_s.expect("Unix time");
    // Unix time of the table's first row, from the file itself.
    let offset = 1_466_704_292.85 - start;
    let rows = theirs.len();
    // Tolerances: the digits printed in the table, in SI.
    type Pick = fn(&Flight) -> &[f64];
    let checks: [(&str, Pick, f64); 3] = [
        ("pressure", |f| &f.pressure_pa, 0.0051e4),
        ("temperature", |f| &f.temperature_degc, 1e-4),
        // And the 75-term polynomial against the exact Gibbs function: 0.001 kg/m3.
        ("density", |f| &f.density_kg_m3, 0.0015),
    ];
    for (name, channel, tolerance) in checks {
        let (worst, n) = difference(ours, &theirs, offset, channel, 1.0);
        assert!(n as f64 > 0.99 * rows as f64, "{name}: only {n} of {rows} rows in common");
        assert!(worst <= tolerance, "{name}: {worst} SI units off, tolerance {tolerance}");
    }
}

/// The table's rule for engineering channels, found by trial: file by file, linear between samples, held at the ends of a file, at
/// the time the CTD sample was stored (`sci_m_present_time` of the cycle that first carries its stamp, about 0.8 s late). Our import
/// takes them at the time the sample was taken, which is what the vehicle did then; here decoding and interpolation are compared
/// by the table's rule.
#[test]
fn validate_engineering_channels_of_the_raw_comet_files() {
    let Some(root) = folder("GLIDER_FLIGHTS", "slocum_comet2016") else { return };
    let theirs = crate::record::csv::flight(&root.join("comet2016_tidy.csv")).expect("the table");
    let raw = |stem: u32, end: &str| {
        let bytes = std::fs::read(root.join(format!("raw/comet-2016-174-05-{stem:03}.{end}"))).expect("a raw file");
        let cache = |crc: &str| std::fs::read(root.join(format!("raw/{crc}.cac"))).ok();
        crate::import::dbd::read(&bytes, cache, |_| true).expect("readable")
    };
    // Digits printed in the table, in SI.
    let checks: [(&str, &[f64], f64, f64); 4] = [
        ("m_pitch", &theirs.pitch_rad, 1.0, 1.1e-5),
        ("m_roll", &theirs.roll_rad, 1.0, 1.1e-5),
        ("m_ballast_pumped", &theirs.ballast_m3, 1e-6, 0.011e-6),
        ("m_battpos", &theirs.battery_mass_m, 0.0254, 1.1e-4 * 0.0254),
    ];
    let mut off = [0_usize; 4];
    let mut compared = [0_usize; 4];
    for stem in 0..10 {
        let (dbd, ebd) = (raw(stem, "dbd"), raw(stem, "ebd"));
        let (taken, stored) = (&ebd.columns["sci_ctd41cp_timestamp"].1, &ebd.columns["sci_m_present_time"].1);
        for (k, (name, column, factor, tolerance)) in checks.into_iter().enumerate() {
            let series = crate::record::resample::Series::new(&dbd.columns["m_present_time"].1, &dbd.columns[name].1);
            let (first, last) = (series.pairs().next().expect("samples"), series.pairs().last().expect("samples"));
            for (i, want) in column.iter().enumerate().filter(|(i, _)| theirs.segment[*i] == stem) {
                let unix = theirs.time_s[i] + 1_466_704_292.85;
                let Some(row) = taken.iter().position(|s| (s - unix).abs() < 0.002) else { continue };
                let got = factor * series.at(stored[row].clamp(first.0, last.0));
                assert!(got.is_finite() && want.is_finite(), "{name}: row {i}");
                compared[k] += 1;
                off[k] += usize::from((got - want).abs() > tolerance);
            }
        }
    }
    eprintln!("{off:?} of {compared:?} differ");
    for k in 0..4 {
        // Every row of the table stands at a CTD sample of ours.
        assert_eq!(compared[k], theirs.len(), "{}", checks[k].0);
        // None differs by more than the printed digits; nothing is left to allow for.
        assert_eq!(off[k], 0, "{}: {} of {} rows differ", checks[k].0, off[k], compared[k]);
    }
}

#[test]
fn validate_packed_files_give_what_plain_ones_give() {
    let Some(data) = folder("GLIDER_DBD_SAMPLES", "") else { return };
    let read = |name: &str| {
        let bytes = std::fs::read(data.join(name)).expect("a sample");
        let cache = |crc: &str| std::fs::read(data.join(format!("cac/{crc}.cac"))).ok();
        crate::import::dbd::read(&bytes, cache, |_| true).expect("a readable sample")
    };
    for (plain, packed) in [("01600001.dbd", "01600001.dcd"), ("01600001.ebd", "01600001.ecd"), ("01600000.ebd", "01600000.ecd")] {
        let (plain, packed) = (read(plain), read(packed));
        assert_eq!((plain.problems.len(), packed.problems.len()), (0, 0), "{:?} {:?}", plain.problems, packed.problems);
        assert_eq!(plain.cycles, packed.cycles);
        for (name, (unit, values)) in &plain.columns {
            let (other_unit, other) = &packed.columns[name];
            assert_eq!(unit, other_unit);
            assert!(values.iter().zip(other).all(|(a, b)| a == b || (a.is_nan() && b.is_nan())), "{name}");
        }
    }
}

#[test]
fn validate_the_corrupt_sample_names_its_block_and_keeps_the_rest() {
    let Some(data) = folder("GLIDER_DBD_SAMPLES", "") else { return };
    let bytes = std::fs::read(data.join("02380108.ecd")).expect("the sample");
    let cache = |crc: &str| std::fs::read(data.join(format!("cac/{crc}.cac"))).ok();
    let file = crate::import::dbd::read(&bytes, cache, |_| true).expect("what is left");
    eprintln!("{} cycles, {:#?}", file.cycles, file.problems);
    assert!(!file.problems.is_empty() && file.problems[0].contains("block"), "{:?}", file.problems);
    assert!(file.cycles > 100);
}

#[test]
fn every_sample_is_read_or_refused_in_one_line() {
    let Some(data) = folder("GLIDER_DBD_SAMPLES", "") else { return };
    let mut read = 0;
    for entry in std::fs::read_dir(&data).expect("samples").flatten() {
        let path = entry.path();
        if !crate::import::slocum::is_slocum(&path) {
            continue;
        }
        let bytes = std::fs::read(&path).expect("bytes");
        let cache = |crc: &str| {
            std::fs::read(data.join(format!("cac/{crc}.cac"))).or_else(|_| std::fs::read(data.join(format!("cac/{crc}.ccc")))).ok()
        };
        match crate::import::dbd::read(&bytes, cache, |_| true) {
            Ok(file) => {
                read += 1;
                eprintln!("{}: {} cycles {:?}", path.display(), file.cycles, file.problems);
            }
            Err(e) => {
                assert!(!e.to_string().contains('\n'));
                eprintln!("{}: {e}", path.display());
            }
        }
    }
    assert!(read > 20, "{read}");
}

/// A dive to 500 m. Its own density leaves out pressure; ours must not.
#[test]
fn validate_a_seaglider_dive_is_read_with_the_right_density() {
    let Some(path) = folder("GLIDER_FLIGHTS", "seaglider_sg171/p1710104.nc") else { return };
    let imported = import(&path, &[]).expect("an import");
    let flight = &imported.flight;
    let deepest = flight.pressure_pa.iter().copied().fold(0.0, f64::max);
    assert!((4.5e6..5.6e6).contains(&deepest), "{deepest} Pa");
    // The base station's own TEOS-10 columns, through the equation of state, are the outside reference.
    let file = netcdf_reader::NcFile::open(&path).expect("NetCDF");
    let column = |name: &str| file.read_variable_unpacked_masked(name).expect("a column");
    let (time, sa, ct) = (column("ctd_time"), column("absolute_salinity"), column("conservative_temperature"));
    let start = imported.report.start_unix_s.expect("Unix time");
    let (mut compared, mut worst) = (0, 0.0_f64);
    for (t, (sa, ct)) in time.iter().zip(sa.iter().zip(ct.iter())) {
        let Some(i) = flight.time_s.iter().position(|s| (s + start - t).abs() < 1e-3) else { continue };
        if let Ok(reference) = gsw::volume::rho(*sa, *ct, flight.pressure_pa[i] * 1e-4)
            && reference.is_finite()
            && flight.density_kg_m3[i].is_finite()
        {
            compared += 1;
            worst = worst.max((reference - flight.density_kg_m3[i]).abs());
        }
    }
    // The regional salinity anomaly that we leave out: up to 0.01 g/kg here.
    assert!(compared > 1000 && worst < 0.01, "{worst} kg/m3 over {compared} rows");
    for (name, column) in [("pitch", &flight.pitch_rad), ("ballast", &flight.ballast_m3), ("roll", &flight.roll_rad)] {
        let known = column.iter().filter(|v| v.is_finite()).count();
        assert!(known as f64 > 0.9 * flight.len() as f64, "{name}: {known} of {}", flight.len());
    }
    // It dives nose down with little oil out, and climbs nose up with much.
    let quarter = flight.len() / 4;
    assert!(flight.pitch_rad[quarter] < -0.1 && flight.pitch_rad[3 * quarter] > 0.1);
    assert!(flight.ballast_m3[quarter] < flight.ballast_m3[3 * quarter]);
}

/// The table took its engineering channels at the time the CTD sample was stored, 0.8 s late (see above); our import does not. So its
/// clocks are that much nearer to each other by the two pressures of the same flight.
#[test]
fn validate_the_steering_computers_pressure_tells_its_clock() {
    let Some(root) = folder("GLIDER_FLIGHTS", "slocum_comet2016") else { return };
    let imported = import(&root.join("raw"), &[]).expect("an import");
    let mapped = imported.report.mapped.iter().find(|m| m.from == "m_pressure").expect("m_pressure is there");
    assert_eq!(mapped.to, crate::record::clock_offset::ENGINEERING_PRESSURE);
    let ours = crate::record::clock_offset::shift_s(&imported.flight).expect("two sensors")[0];
    let table = crate::record::csv::flight(&root.join("comet2016_tidy.csv")).expect("the table");
    let theirs = crate::record::clock_offset::shift_s(&table).expect("two sensors")[0];
    // 0.3 s: the jackknife's standard error of either is 0.3 to 0.4 s, over the same noise.
    assert!((ours - theirs - 0.8).abs() < 0.3, "{ours} s, the table {theirs} s");
}

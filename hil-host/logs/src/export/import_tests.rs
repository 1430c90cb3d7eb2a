//! What we write is read again by our own import.

use super::netcdf::{About, write};
use crate::import::classes::Class;
use crate::record::flight::Flight;

#[test]
fn regress_our_own_export_comes_back_with_its_gaps_columns_and_vehicle() {
    let n = 400;
    let column = |f: &dyn Fn(f64) -> f64| (0..n).map(|i| f(f64::from(i))).collect::<Vec<_>>();
    // Ten rows without a value are 40 s, which an import of other people's files bridges.
    let with_gap = |f: &dyn Fn(f64) -> f64| column(&|i| if (100.0..110.0).contains(&i) { f64::NAN } else { f(i) });
    let saw = |i: f64| 1.0 - (i / 200.0 - 1.0).abs();
    let nose = |i: f64| if i < 200.0 { -0.4 } else { 0.4 };
    let mut flight = Flight {
        time_s: column(&|i| 4.0 * i),
        pressure_pa: column(&|i| 1e4 + 4e5 * saw(i)),
        pitch_rad: with_gap(&|i| nose(i) + 1e-4 * i),
        roll_rad: with_gap(&|i| 0.01 + 1e-5 * i),
        heading_rad: with_gap(&|i| 0.01 * i),
        ballast_m3: with_gap(&|i| 5e-4 * nose(i) - 1e-9 * i),
        battery_mass_m: with_gap(&|i| 0.01 + 1e-6 * i),
        temperature_degc: column(&|i| 15.0 - 5.0 * saw(i)),
        density_kg_m3: column(&|i| 1025.0 + saw(i)),
        speed_m_s: Some(with_gap(&|i| 0.3 + 1e-4 * i)),
        ..Flight::blank(n as usize)
    };
    for (name, f) in [("eng_pressure_bar", 1.0), ("dr_east_m", -3.0), ("time", 7.0), ("Oxygen", 2.0), ("oxygen", 4.0)] {
        flight.extra.insert(name.into(), with_gap(&|i| f * (1.0 + i)));
    }
    let mut vehicle = Class::Slocum200.draft();
    vehicle.set("hull_volume_m3", 0.0634, "");
    let vehicle = crate::vehicle::parse_text(&(vehicle.toml()), std::path::Path::new("v.toml")).map(|v| v.document.to_string());
    let about = About { vehicle_file: Some(vehicle.expect("a vehicle")), ..About::default() };
    let folder = std::env::temp_dir().join(format!("glider-own-netcdf-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join("flight.nc");
    write(&flight, &path, &about).expect("written");
    let read = crate::import::import(&path, &[]).expect("read");
    std::fs::remove_dir_all(&folder).expect("removed");
    assert_eq!((read.report.start_unix_s, read.flight.len()), (None, 400), "no date, all rows");
    assert_eq!(read.vehicle_file, about.vehicle_file);
    assert!(read.report.is_whole(), "{:?}", read.report.left_out);
    let same = |name: &str, got: &[f64], put: &[f64]| {
        for (row, (a, b)) in got.iter().zip(put).enumerate() {
            assert!((a.is_nan() && b.is_nan()) || (a - b).abs() <= 1e-12 * b.abs().max(1.0), "{name}, row {row}: {a} {b}");
        }
    };
    let mut got = read.flight;
    for (k, (a, b)) in got.columns_mut().into_iter().zip(flight.columns_mut()).enumerate() {
        same(&format!("column {k}"), a, b);
    }
    same("speed", got.speed_m_s.as_ref().expect("a speed"), flight.speed_m_s.as_ref().expect("a speed"));
    assert_eq!(got.extra.keys().collect::<Vec<_>>(), flight.extra.keys().collect::<Vec<_>>());
    for (name, values) in &flight.extra {
        same(name, &got.extra[name], values);
    }
}

#[test]
fn regress_rows_of_our_own_export_without_a_pressure_stay() {
    let saw = |i: u32| 1e4 + 4e5 * (1.0 - (f64::from(i) / 200.0 - 1.0).abs());
    let mut flight = Flight {
        time_s: (0..400).map(|i| 4.0 * f64::from(i)).collect(),
        pressure_pa: (0..400).map(saw).collect(),
        pitch_rad: (0..400).map(|i| if i < 200 { -0.4 } else { 0.4 }).collect(),
        ..Flight::blank(400)
    };
    (50..56).for_each(|i| flight.pressure_pa[i] = f64::NAN);
    let path = std::env::temp_dir().join(format!("glider-no-pressure-{}.nc", std::process::id()));
    write(&flight, &path, &About::default()).expect("written");
    let read = crate::import::import(&path, &[]).expect("read");
    std::fs::remove_file(&path).expect("removed");
    assert!(read.flight.len() == 400 && read.report.is_whole(), "{:?}", read.report.left_out);
    assert_eq!(read.flight.pressure_pa.iter().filter(|p| p.is_nan()).count(), 6);
}

#[test]
fn regress_gaps_stay_where_many_rows_have_no_pressure() {
    let saw = |i: u32| 1.0 - (f64::from(i) / 200.0 - 1.0).abs();
    let without = |of: u32, f: &dyn Fn(u32) -> f64| (0..400).map(|i| if i % of == 3 { f64::NAN } else { f(i) }).collect::<Vec<f64>>();
    let mut flight = Flight {
        time_s: (0..400).map(|i| 4.0 * f64::from(i)).collect(),
        pressure_pa: without(7, &|i| 1e4 + 4e5 * saw(i)),
        temperature_degc: without(5, &|i| 15.0 - 5.0 * saw(i)),
        density_kg_m3: without(4, &|i| 1025.0 + saw(i)),
        ..Flight::blank(400)
    };
    flight.extra.insert(crate::import::assembly::SALINITY_COLUMN.into(), without(4, &|i| 33.0 + saw(i)));
    // Without a temperature there is no density.
    let (density, temperature) = (&mut flight.density_kg_m3, &flight.temperature_degc);
    density.iter_mut().zip(temperature).filter(|(_, t)| t.is_nan()).for_each(|(d, _)| *d = f64::NAN);
    let path = std::env::temp_dir().join(format!("glider-holes-{}.nc", std::process::id()));
    write(&flight, &path, &About::default()).expect("written");
    let read = crate::import::import(&path, &[]).expect("read").flight;
    std::fs::remove_file(&path).expect("removed");
    let known = |column: &[f64]| column.iter().map(|v| v.is_finite()).collect::<Vec<bool>>();
    assert_eq!(known(&read.temperature_degc), known(&flight.temperature_degc));
    // Without a pressure there is no density either.
    let both: Vec<bool> = flight.density_kg_m3.iter().zip(&flight.pressure_pa).map(|(d, p)| d.is_finite() && p.is_finite()).collect();
    assert_eq!(known(&read.density_kg_m3), both);
}

#[test]
fn regress_segments_of_our_own_export_stay_with_another_file_there() {
    // Four segments, of which no stay at the surface tells.
    let saw = |i: usize| 1e5 + 4e5 * (1.0 - ((i % 100) as f64 / 50.0 - 1.0).abs());
    let flight = Flight {
        time_s: (0..400).map(|i| 4.0 * f64::from(i)).collect(),
        segment: (0..400).map(|i| i / 100).collect(),
        pressure_pa: (0..400).map(saw).collect(),
        ..Flight::blank(400)
    };
    let folder = std::env::temp_dir().join(format!("glider-two-exports-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    write(&flight, &folder.join("flight.nc"), &About::default()).expect("written");
    std::fs::copy(folder.join("flight.nc"), folder.join("flight (1).nc")).expect("copied");
    let copied = crate::import::import(&folder, &[]).expect("read");
    std::fs::write(folder.join("flight (1).nc"), b"").expect("written");
    let empty = crate::import::import(&folder, &[]).expect("read");
    std::fs::remove_dir_all(&folder).expect("removed");
    for read in [copied, empty] {
        assert_eq!(read.flight.segment, flight.segment, "{:?}", read.report.notes);
        assert_eq!(read.report.segments.len(), 4, "{:?}", read.report.segments);
    }
}

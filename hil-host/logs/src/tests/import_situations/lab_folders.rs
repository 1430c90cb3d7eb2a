//! What lies in a lab's folder beside a log, and logs named by a pattern of the shell.

use std::path::PathBuf;

use crate::import::{import, import_all};

use super::super::made_logs::{CYCLES, START, at, pair};
use super::{folder, said, whole};

#[test]
fn regress_hidden_and_unfinished_files_are_no_logs() {
    let folder = folder("clutter");
    pair(&folder, "a", "alpha", START, |t| t);
    let want = import(&folder, &[]).expect("an import").flight;
    for name in ["._a.dbd", ".a.ebd.swp", "b.dbd.part", "a.dbd~", "b.ebd.crdownload", "._mission.nc", "Thumbs.db", ".DS_Store"] {
        std::fs::write(folder.join(name), b"dbd_label: no log").expect("written");
    }
    let got = import(&folder, &[]).expect("an import");
    assert!(got.report.is_whole() && got.flight.pitch_rad == want.pitch_rad, "{:?}\n{}", got.report.files, said(&got));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_logs_named_by_a_pattern_take_their_other_halves_along() {
    let folder = folder("pattern");
    for (k, stem) in ["a", "b"].into_iter().enumerate() {
        pair(&folder, stem, "alpha", START + 7200.0 * k as f64, |t| t);
    }
    std::fs::write(folder.join("0a1b2c3d.cac"), b"s: T 0 0 8 m_present_time timestamp\n").expect("written");
    let want = import(&folder, &[]).expect("an import").flight;
    let named = |names: &[&str]| names.iter().map(|n| folder.join(n)).collect::<Vec<PathBuf>>();
    for names in [&["a.dbd", "b.dbd"][..], &["a.ebd", "b.ebd"], &["0a1b2c3d.cac", "a.dbd", "a.ebd", "b.dbd", "b.ebd"]] {
        let got = import_all(&named(names), &[], None).unwrap_or_else(|e| panic!("{names:?}: {e}"));
        assert_eq!((&got.flight.pitch_rad, &got.flight.density_kg_m3), (&want.pitch_rad, &want.density_kg_m3), "{names:?}");
    }
    assert!(import_all(&named(&["0a1b2c3d.cac"]), &[], None).is_err(), "a list alone");
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_folders_of_two_computers_are_read_as_one_flight() {
    let folder = folder("offloaded");
    pair(&folder, "a", "alpha", START, |t| t);
    let want = import(&folder, &[]).expect("an import").flight;
    for (nav, sci) in [("nav", "sci"), ("flight/logs", "science/logs"), ("Nav", "PLD1")] {
        for (inner, file) in [(nav, "a.dbd"), (sci, "a.ebd")] {
            std::fs::create_dir_all(folder.join(inner)).expect("a folder");
            std::fs::rename(folder.join(file), folder.join(inner).join(file)).expect("moved");
        }
        let got = import(&folder, &[]).unwrap_or_else(|e| panic!("{nav}, {sci}: {e}"));
        assert_eq!((&got.flight.pitch_rad, &got.flight.density_kg_m3), (&want.pitch_rad, &want.density_kg_m3), "{nav}, {sci}");
        for (inner, file) in [(nav, "a.dbd"), (sci, "a.ebd")] {
            std::fs::rename(folder.join(inner).join(file), folder.join(file)).expect("moved");
            std::fs::remove_dir_all(folder.join(inner.split('/').next().unwrap_or(inner))).expect("removed");
        }
    }
    std::fs::remove_dir_all(folder).ok();
}

/// A csv of the flight computer and one of the science computer, as converters write them: names of the vehicle, no units.
#[test]
fn regress_tables_of_two_computers_are_joined_on_their_clocks() {
    let folder = folder("two-tables");
    let [flight, science] = ["a.dbd.csv", "a.ebd.csv"].map(|n| folder.join(n));
    let row = |k: usize| {
        let (dbar, pitch, cc) = at(k);
        let fix = if k < 3 { "5436.600,1506.000" } else { "," };
        // A few of the science computer's values come here too, late.
        let late = if k.is_multiple_of(50) { "1.0" } else { "" };
        format!("{:.2},{pitch},0.01,1.2,{cc},{:.4},{fix},{late}\n", START + 4.0 * k as f64, 0.1 * dbar)
    };
    let head = "m_present_time,m_pitch,m_roll,m_heading,m_ballast_pumped,m_pressure,m_gps_lat,m_gps_lon,sci_water_pressure\n";
    std::fs::write(&flight, head.to_owned() + &(0..CYCLES).map(row).collect::<String>()).expect("written");
    let row = |k: usize| format!("{:.2},{:.4},{:.3},3.7\n", START + 1.3 + 4.0 * k as f64, 0.1 * at(k).0, 12.0 - 0.05 * at(k).0);
    let head = "sci_m_present_time,sci_water_pressure,sci_water_temp,sci_water_cond\n";
    std::fs::write(&science, head.to_owned() + &(0..CYCLES).map(row).collect::<String>()).expect("written");
    for files in [vec![flight.clone(), science.clone()], vec![science.clone(), flight.clone()], vec![folder.clone()]] {
        let got = import_all(&files, &[], None).unwrap_or_else(|e| panic!("{files:?}: {e}"));
        whole(&got);
        let f = &got.flight;
        assert!(f.len() == CYCLES && f.extra.contains_key(crate::record::clock_offset::ENGINEERING_PRESSURE), "{}", said(&got));
        assert!(f.pressure_pa.iter().enumerate().all(|(k, p)| (p - 1e4 * at(k).0).abs() < 10.0), "the rows of the CTD");
        // Between the vehicle's values 2.7 s before and 1.3 s behind.
        let between = |k: usize| at(k).1 + (at(k + 1).1 - at(k).1) * 1.3 / 4.0;
        assert!((0..CYCLES - 1).all(|k| (f.pitch_rad[k] - between(k)).abs() < 1e-6), "{}", said(&got));
        assert!(got.report.origins.first().is_some_and(|o| (o.lat_deg - 54.61).abs() < 1e-6), "{:?}", got.report.origins);
        assert!(said(&got).contains("two computers: joined on their clocks") && said(&got).contains("class slocum"), "{}", said(&got));
    }
    std::fs::copy(&science, folder.join("b.ebd.csv")).expect("copied");
    let e = import(&folder, &[]).map(|_| ()).expect_err("three").to_string();
    assert!(e.contains("3 files of csv here"), "{e}");
    std::fs::remove_file(&flight).expect("removed");
    let e = import(&folder, &[]).map(|_| ()).expect_err("two of one computer").to_string();
    assert!(e.contains("import one at a time"), "{e}");
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_files_of_another_year_are_named_as_another_mission() {
    let folder = folder("two years");
    pair(&folder, "a", "alpha", START, |t| t);
    pair(&folder, "b", "alpha", START + 3600.0, |t| t);
    pair(&folder, "c", "alpha", START + 500.0 * 86_400.0, |t| t);
    let got = import(&folder, &[]).expect("an import");
    assert!(got.report.left_out.iter().any(|l| l.contains("of another mission? Import it alone")), "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

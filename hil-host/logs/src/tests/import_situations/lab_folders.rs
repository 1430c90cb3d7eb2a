//! What lies in a lab's folder beside a log, and logs named by a pattern of the shell.

use std::path::PathBuf;

use crate::import::{import, import_all};

use super::super::made_logs::{START, pair};
use super::{folder, said};

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
fn regress_files_of_another_year_are_named_as_another_mission() {
    let folder = folder("two years");
    pair(&folder, "a", "alpha", START, |t| t);
    pair(&folder, "b", "alpha", START + 3600.0, |t| t);
    pair(&folder, "c", "alpha", START + 500.0 * 86_400.0, |t| t);
    let got = import(&folder, &[]).expect("an import");
    assert!(got.report.left_out.iter().any(|l| l.contains("of another mission? Import it alone")), "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

//! The dynamic workbench on real Slocum flights: no NaN, no false calm, errors that held-out dives confirm. Needs `GLIDER_FLIGHTS`.

use crate::diagnosis;
use crate::hypotheses::search::Depth;
use logs::record::csv;
use logs::{Flight, Vehicle, vehicle};
use std::path::PathBuf;

fn real(flight: &str, file: &str) -> Option<(Flight, Vehicle)> {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from).filter(|r| r.join(flight).is_file()) else {
        eprintln!("skipped: no flights (set GLIDER_FLIGHTS)");
        return None;
    };
    let vehicle = vehicle::read(&PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../vehicles").join(file)).expect("vehicle");
    Some((csv::flight(&root.join(flight)).expect("flight"), vehicle))
}

const COMET: &str = "slocum_comet2016/comet2016_tidy.csv";
const MODENA: &str = "slocum_modena2015/modena-2015-191-0-34_tidy.csv";
const MODENA_12: &str = "slocum_modena2015/modena-2015-187-0-12_tidy.csv";

/// A vehicle file that is 3 to 7 cm/s off (200 cm³ of trim) must be brought home by the calibration, and everything said is a number.
#[test]
fn validate_uncalibrated_vehicles_are_brought_home_and_nothing_is_nan() {
    for (flight, file, most_m_s) in [(COMET, "comet.toml", 0.0070), (MODENA, "modena.toml", 0.0065)] {
        let Some((flight, vehicle)) = real(flight, file) else { return };
        let d = diagnosis::diagnose(&flight, &vehicle, Depth::Pairs, &|_, _| {}).expect("diagnosis");
        let [nominal, recalibrated, _] = d.block_error_m_s;
        assert!(!d.check.is_empty(), "{}: no dive was kept out of the fit", flight.name);
        assert!(nominal > 0.02, "{nominal}");
        // Published: 0.45 and 0.52 cm/s over steady samples; turns are in ours.
        assert!(recalibrated < most_m_s, "{}: {recalibrated} m/s held out", flight.name);
        assert!(d.fitted_error_m_s[1] < most_m_s, "{}: {:?}", flight.name, d.fitted_error_m_s);
        for c in &d.candidates {
            assert!(!c.log_odds.is_nan() && c.parameters.iter().all(|p| p.value.is_finite()), "{c:?}");
        }
        assert!(d.recalibrated.calibration.iter().all(|z| z.is_finite()));
    }
}

/// The tables of both Slocums have their engineering channels early, as their two pressure sensors show.
#[test]
fn validate_the_two_clocks_of_two_slocums() {
    // The same least squares over all rows with numpy gives -2.6 ± 0.4 and -1.2 ± 0.3 s (jackknife over eighths of the flight).
    for (flight, file, expected_s, within_s) in [(COMET, "comet.toml", -2.6, 0.4), (MODENA_12, "modena.toml", -1.2, 0.3)] {
        let Some((flight, _)) = real(flight, file) else { return };
        let tau = logs::record::clock_offset::shift_s(&flight).expect("two sensors")[0];
        assert!((tau - expected_s).abs() < within_s, "{}: {tau} s", flight.name);
    }
}

/// The vertical velocity knows nothing of the engineering pressure. Without it the clock is a nuisance parameter of the fit, and what the
/// turns say of it is what the two pressures say, which is a finding too.
#[test]
fn validate_the_clock_of_two_pressures_by_the_vertical_velocity() {
    let Some((with, vehicle)) = real(MODENA_12, "modena.toml") else { return };
    let mut without = with.clone();
    without.extra.remove("eng_pressure_bar");
    let tau = logs::record::clock_offset::shift_s(&with).expect("two sensors")[0];
    let [with, without] = [with, without].map(|f| diagnosis::diagnose(&f, &vehicle, Depth::Singles, &|_, _| {}).expect("diagnosis"));
    let clock = |d: &diagnosis::Diagnosis| d.sensors.iter().find(|s| s.name == "clock_offset").map_or(0.0, |s| s.value);
    // The engineering channels are early by 1.2 s; a clock of the fit that is behind is positive.
    let apart = clock(&without) - clock(&with);
    assert!(apart.abs() < 0.6, "{} without, {} with it, {tau} s by the pressures", clock(&without), clock(&with));
}

/// Three days of a deep mission with a vehicle file whose hull is rigid and knows no temperature: the five best hypotheses all have
/// one of the two in them (in one profile of temperature over depth they are nearly one effect), far ahead of nothing missing, and on
/// dives kept out of the fit the best falls below the 0.70 cm/s of a steady model with both terms.
#[test]
#[ignore = "missed since the model discrepancy is marginalised: docs/discovery-score.md"]
fn validate_a_rigid_hull_in_the_file_of_modena_is_found_out() {
    let days = ["175-0-1", "187-0-12", "191-0-34"].map(|day| format!("slocum_modena2015/modena-2015-{day}_tidy.csv"));
    let Some((_, mut vehicle)) = real(&days[0], "modena.toml") else { return };
    vehicle.constants.compressibility_per_pa = 0.0;
    vehicle.constants.thermal_expansion_per_k = 0.0;
    let root = PathBuf::from(std::env::var_os("GLIDER_FLIGHTS").expect("set"));
    let text = |day: &String| std::fs::read_to_string(root.join(day)).expect("a flight");
    // One log: the first file whole, the others without their header.
    let log: String =
        days.iter().enumerate().flat_map(|(k, d)| text(d).lines().skip(k.min(1)).map(|l| format!("{l}\n")).collect::<Vec<_>>()).collect();
    let file = std::env::temp_dir().join(format!("modena_three_days_{}.csv", std::process::id()));
    std::fs::write(&file, log).expect("a temporary file");
    let flight = csv::flight(&file).expect("three days");
    std::fs::remove_file(&file).expect("removed");
    let d = diagnosis::diagnose(&flight, &vehicle, Depth::Pairs, &|_, _| {}).expect("diagnosis");
    for c in &d.candidates[..5] {
        assert!(c.effects.contains(&"hull_compressibility") || c.effects.contains(&"thermal_expansion"), "{:?}", c.effects);
        // Nothing else comes near; how far depends on what the calibration alone can strain to (600 to 1,600 between models of ours).
        assert!(c.log_odds > 300.0, "{:?} {}", c.effects, c.log_odds);
    }
    // What a flight with no effect leaves is above that limit.
    let (recalibrated, best) = (d.block_error_m_s[1], d.candidates[0].error_check_m_s);
    assert!(recalibrated > 0.0070 && best <= 0.0070, "{recalibrated} m/s without, {best} m/s with it, held out");
}

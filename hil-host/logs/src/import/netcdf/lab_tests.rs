//! What labs write into their files besides, each once: flags of many schemes, units, clocks, vehicles, fills of their own.

use super::tests::{Attribute, Column, ROWS, change, has_note, imported, sawtooth, written};
use crate::import::Imported;

/// Rows with a pressure 30 dbar too high and a salinity of 20, flagged.
const BAD: std::ops::Range<usize> = 120..135;

/// Saw-teeth with bad rows whose pressure's flag, called `name`, is `bad` there and `good` elsewhere, with the attributes of the flag.
fn flagged(name: &'static str, good: f64, bad: f64, attributes: &[Attribute]) -> Imported {
    let mut columns = sawtooth();
    change(&mut columns, "PRES", "dbar", |i, v| if BAD.contains(&i) { v + 30.0 } else { v });
    columns.push((name, "1", (0..ROWS).map(|i| if BAD.contains(&i) { bad } else { good }).collect()));
    written(&columns, None, attributes).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[test]
fn regress_flags_of_every_usual_scheme_leave_out_what_they_call_bad() {
    const QARTOD: &str = "PASS NOT_EVALUATED SUSPECT FAIL MISSING";
    let named = |name: &'static str, meanings: &'static str, values: &'static str| {
        vec![(name, "flag_meanings", meanings), (name, "flag_values", values)]
    };
    let cases: [(&'static str, f64, f64, Vec<Attribute>); 7] = [
        ("PRES_qartod_summary_flag", 1.0, 4.0, named("PRES_qartod_summary_flag", QARTOD, "1, 2, 3, 4, 9")),
        ("qartod_PRES_primary_flag", 1.0, 4.0, named("qartod_PRES_primary_flag", QARTOD, "1, 2, 3, 4, 9")),
        ("PRES_flag", 0.0, 1.0, named("PRES_flag", "good bad", "0, 1")),
        ("PRES_qc", 1.0, 0.0, named("PRES_qc", "bad good", "0, 1")),
        (
            "PRES_QC",
            49.0,
            52.0,
            named("PRES_QC", "no_quality_control good_value probably_good probably_bad bad_value", "48, 49, 50, 51, 52"),
        ),
        ("PRES_QC", 1.0, 4.0, Vec::new()),
        ("quality_flag", 1.0, 4.0, vec![("PRES", "ancillary_variables", "quality_flag")]),
    ];
    for (name, good, bad, attributes) in cases {
        let read = flagged(name, good, bad, &attributes);
        assert_eq!(read.flight.len(), ROWS - BAD.len(), "{name} {attributes:?}: {:?}", read.report.notes);
        assert!(has_note(&read, &format!("15 of 400 values of PRES left out: {name}")), "{:?}", read.report.notes);
    }
    // An adjusted value without a flag of its own has that of the raw one.
    let mut columns = sawtooth();
    columns.push(("PRES_ADJUSTED", "dbar", columns[1].2.iter().map(|p| p - 0.1).collect()));
    columns.push(("PRES_QC", "1", (0..ROWS).map(|i| if BAD.contains(&i) { 4.0 } else { 1.0 }).collect()));
    let read = imported(&columns, None).expect("reads");
    assert_eq!((read.flight.len(), has_note(&read, "15 of 400 values of PRES_ADJUSTED left out: PRES_QC")), (ROWS - BAD.len(), true));
    // Four is good where the file says so.
    let read = flagged("PRES_QC", 4.0, 4.0, &named("PRES_QC", "missing bad suspect good", "1, 2, 3, 4"));
    assert_eq!(read.flight.len(), ROWS);
}

#[test]
fn regress_two_vehicles_or_deployments_in_a_file_are_refused() {
    let mut columns = sawtooth();
    columns.push(("trajectory", "1", (0..ROWS).map(|i| if i < 200 { 1.0 } else { 2.0 }).collect()));
    let error = imported(&columns, None).expect_err("two");
    assert!(error.contains("2 deployments (trajectory: 1, 2): import one at a time"), "{error}");
    columns.last_mut().expect("a column").2.fill(1.0);
    assert_eq!(imported(&columns, None).expect("one").flight.len(), ROWS);
}

#[test]
fn regress_units_of_other_files_are_read() {
    let want = imported(&sawtooth(), None).expect("plain");
    let close = |a: &[f64], b: &[f64], share: f64| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= share * b.abs());
    let cases: [(&str, &'static str, f64, f64); 9] = [
        ("PRES", "psi", 1.450_377, 0.0),
        ("PRES", "MPa", 0.01, 0.0),
        ("PRES", "mbar", 100.0, 0.0),
        ("PRES", "hPa", 100.0, 0.0),
        ("TEMP", "K", 1.0, 273.15),
        ("TEMP", "kelvin", 1.0, 273.15),
        ("TEMP", "degF", 1.8, 32.0),
        ("TEMP", "degrees Celsius", 1.0, 0.0),
        ("PITCH", "radians", 1f64.to_radians(), 0.0),
    ];
    for (name, unit, factor, offset) in cases {
        let mut columns = sawtooth();
        change(&mut columns, name, unit, |_, v| v * factor + offset);
        let read = imported(&columns, None).unwrap_or_else(|e| panic!("{name} in {unit}: {e}"));
        assert!(close(&read.flight.pressure_pa, &want.flight.pressure_pa, 1e-6), "{name} in {unit}");
        assert!(close(&read.flight.temperature_degc, &want.flight.temperature_degc, 1e-9), "{name} in {unit}");
        assert!(close(&read.flight.density_kg_m3, &want.flight.density_kg_m3, 1e-9), "{name} in {unit}");
        assert!(close(&read.flight.pitch_rad, &want.flight.pitch_rad, 1e-9), "{name} in {unit}");
    }
    // A unit that is not known loses the channel.
    let mut columns = sawtooth();
    change(&mut columns, "TEMP", "furlongs", |_, v| v);
    let read = imported(&columns, None).expect("reads");
    assert!(read.report.left_out.iter().any(|l| l.contains("TEMP is in \"furlongs\"")), "{:?}", read.report);
}

#[test]
fn regress_values_that_cannot_be_are_left_out_and_counted() {
    let cases: [(&str, f64); 5] = [("TEMP", -99.0), ("TEMP", 99.0), ("PSAL", -99.0), ("PSAL", 99.0), ("PSAL", 0.0)];
    for (name, fill) in cases {
        let mut columns = sawtooth();
        let unit = columns.iter().find(|c| c.0 == name).map_or("1", |c| c.1);
        change(&mut columns, name, unit, |i, v| if i % 27 == 3 { fill } else { v });
        let read = imported(&columns, None).expect("reads");
        assert!(read.flight.density_kg_m3.iter().all(|d| d.is_nan() || (1020.0..1030.0).contains(d)), "{name} {fill}");
        assert!(has_note(&read, &format!("values of {name}")), "{name} {fill}: {:?}", read.report.notes);
    }
    let declared = [("TEMP", "missing_value", "9.5")];
    let mut columns = sawtooth();
    change(&mut columns, "TEMP", "degree_C", |i, v| if i == 7 { 9.5 } else { v });
    assert!(written(&columns, None, &declared).expect("reads").flight.temperature_degc[7].is_nan());
}

#[test]
fn regress_a_fuller_channel_serves_for_one_with_few_values() {
    let mut columns = sawtooth();
    let full = columns[1].2.clone();
    columns.push(("DEPTH", "m", full.iter().map(|p| 0.99 * p).collect()));
    change(&mut columns, "PRES", "dbar", |i, v| if i < 60 { v } else { f64::NAN });
    let read = imported(&columns, None).expect("reads");
    assert_eq!(read.flight.len(), ROWS);
    assert!(has_note(&read, "PRES has 60 values: DEPTH is taken, which has 400"), "{:?}", read.report.notes);
    let mut columns: Vec<Column> = sawtooth();
    columns.push(("m_ballast_pumped", "cc", vec![0.0; ROWS]));
    columns.push(("m_de_oil_vol", "cc", (0..ROWS).map(|i| if i % 100 < 50 { -250.0 } else { 250.0 }).collect()));
    let read = imported(&columns, None).expect("reads");
    assert!((read.flight.ballast_m3[10] + 250e-6).abs() < 1e-12, "{:?}", read.report.notes);
}

#[test]
fn regress_clocks_that_cannot_be_right_say_why() {
    let start = 1_577_836_800.0;
    let mut columns = sawtooth();
    change(&mut columns, "TIME", "seconds since 1970-01-01 00:00:00 -6:00", |_, v| v);
    let read = imported(&columns, None).expect("reads");
    assert_eq!(read.report.start_unix_s, Some(6.0 * 3600.0));
    change(&mut columns, "TIME", "s", |_, v| v + start);
    let read = imported(&columns, None).expect("Unix time");
    assert!(read.report.start_unix_s == Some(start) && has_note(&read, "taken as seconds since 1970"));
    change(&mut columns, "TIME", "s", |_, v| v - start);
    let error = imported(&columns, None).expect_err("no origin");
    assert!(error.contains("`seconds since DATE` is needed"), "{error}");
    let mut columns = sawtooth();
    let error = written(&columns, None, &[("TIME", "calendar", "noleap")]).expect_err("no calendar of a clock");
    assert!(error.contains("calendar \"noleap\""), "{error}");
    // The attitude an hour after the pressure.
    columns.push(("TIME_NAV", "seconds since 2020-01-01T00:00:00Z", (0..ROWS).map(|i| 36_000.0 + 4.0 * i as f64).collect()));
    let read = written(&columns, None, &[("PITCH", "coordinates", "TIME_NAV")]).expect("reads");
    assert!(
        read.report.left_out.iter().any(|l| l.contains("pitch runs on another clock than PRES: +36000 s")),
        "{:?}",
        read.report.left_out
    );
}

#[test]
fn regress_angles_are_judged_one_by_one() {
    let mut columns = sawtooth();
    change(&mut columns, "PITCH", "degrees", |_, v| v.to_radians());
    columns.push(("ROLL", "degrees", (0..ROWS).map(|i| 1.0 + 0.4 * (0.3 * i as f64).sin()).collect()));
    let read = imported(&columns, None).expect("reads");
    assert!((read.flight.pitch_rad[10].abs() - 25f64.to_radians()).abs() < 1e-9);
    assert!(read.flight.roll_rad.iter().all(|r| r.abs() < 2f64.to_radians()), "{:?}", read.report.notes);
    let mut level = sawtooth();
    change(&mut level, "PITCH", "degrees", |_, _| 0.0);
    level.push(("ROLL", "degrees", vec![0.8; ROWS]));
    assert!((imported(&level, None).expect("reads").flight.roll_rad[3] - 0.8f64.to_radians()).abs() < 1e-9);
}

#[test]
fn regress_an_absolute_pressure_gives_the_same_flight() {
    let mut columns = sawtooth();
    // Two minutes afloat before each dive.
    let depth = |i: usize| if i % 100 < 30 { 0.05 } else { 35.0 - ((i % 100) as f64 - 65.0).abs() };
    change(&mut columns, "PRES", "dbar", |i, _| depth(i));
    let want = imported(&columns, None).expect("gauge");
    change(&mut columns, "PRES", "dbar", |i, _| depth(i) + 10.13);
    let got = imported(&columns, None).expect("absolute");
    assert!(has_note(&got, "absolute pressure?") && got.flight.segment == want.flight.segment);
    let off = got.flight.density_kg_m3.iter().zip(&want.flight.density_kg_m3).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-3, "{off}");
    // Depth is right, pressure has a zero: no unit is wrong.
    columns.push(("DEPTH", "m", (0..ROWS).map(|i| 0.992 * depth(i)).collect()));
    assert!(!has_note(&imported(&columns, None).expect("both"), "do not agree"));
}

#[test]
fn regress_flags_that_name_tests_are_bad_where_set_unless_1_is_passed() {
    const TESTS: &str = "gross_range_test local_range_test spike_test stuck_value_test gradient_test propagate_flags";
    const MASKS: &str = "1, 2, 4, 8, 16, 32";
    let bits = |name: &'static str| vec![(name, "flag_meanings", TESTS), (name, "flag_masks", MASKS)];
    let values =
        |name: &'static str, meanings: &'static str, of: &'static str| vec![(name, "flag_meanings", meanings), (name, "flag_values", of)];
    let both = |meanings: &'static str| {
        let mut all = values("PRES_qc", meanings, "0, 1, 2, 3");
        all.push(("PRES_qc", "flag_masks", "3, 3, 3, 3"));
        all
    };
    let declared = |name: &'static str| [bits(name), vec![("PRES", "ancillary_variables", name)]].concat();
    const MIXED: &str = "no_bad_data interpolated spike suspect_gradient";
    let cases: [(&'static str, f64, f64, Vec<Attribute>, bool); 12] = [
        ("PRES_qc", 0.0, 4.0, bits("PRES_qc"), true),
        ("PRES_qc", 0.0, 17.0, bits("PRES_qc"), true),
        ("PRES_qc", 0.0, 49.0, bits("PRES_qc"), true),
        // What another variable's flag says is not what this one's test does.
        ("PRES_qc", 0.0, 32.0, bits("PRES_qc"), false),
        ("PRES_flag", 0.0, 2.0, values("PRES_flag", MIXED, "0, 1, 2, 3"), true),
        ("PRES_flag", 0.0, 1.0, values("PRES_flag", MIXED, "0, 1, 2, 3"), false),
        ("PRES_flag", 0.0, 3.0, values("PRES_flag", MIXED, "0, 1, 2, 3"), false),
        ("PRES_flag", 1.0, 1.0, values("PRES_flag", "no_bad_data spike_corrected range_test_passed", "1, 2, 3"), false),
        // Values under a mask (CF conventions 3.5): two bits hold one number.
        ("PRES_qc", 1.0, 2.0, both("unknown good bad missing"), true),
        ("PRES_qc", 0.0, 1.0, both("unknown good bad missing"), false),
        // Which tests were made; and results in which 1 says that it was passed (OOI).
        ("PRES_qc_executed", 29.0, 29.0, declared("PRES_qc_executed"), false),
        ("PRES_qc_results", 29.0, 25.0, declared("PRES_qc_results"), false),
    ];
    for (name, good, set, attributes, bad) in cases {
        let read = flagged(name, good, set, &attributes);
        let left = if bad { BAD.len() } else { 0 };
        assert_eq!(read.flight.len(), ROWS - left, "{name} {set} {attributes:?}: {:?}", read.report.notes);
    }
}

/// A folder of files with an `id` each, one after another.
fn with_ids(name: &str, ids: &[&str]) -> Result<Imported, String> {
    let folder = std::env::temp_dir().join(format!("glider-ids-{}-{name}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    for (file, id) in ids.iter().enumerate() {
        let mut set = netcdf3::DataSet::new();
        set.add_fixed_dim("time", ROWS).expect("a dimension");
        set.add_global_attr_string("id", id).expect("an attribute");
        let mut columns = sawtooth();
        change(&mut columns, "TIME", "seconds since 2020-01-01", |_, v| v + 3600.0 * file as f64);
        for (name, unit, _) in &columns {
            set.add_var_f64(name, &["time"]).expect("a variable");
            set.add_var_attr_string(name, "units", unit).expect("a unit");
        }
        let mut writer = netcdf3::FileWriter::open(folder.join(format!("{file}.nc"))).expect("a file");
        writer.set_def(&set, netcdf3::Version::Classic, 0).expect("a definition");
        columns.iter().for_each(|(name, _, values)| writer.write_var_f64(name, values).expect("values"));
        writer.close().expect("closed");
    }
    let got = crate::import::import(&folder, &[]).map_err(|e| e.to_string());
    std::fs::remove_dir_all(&folder).expect("removed");
    got
}

#[test]
fn regress_files_whose_ids_name_two_gliders_are_refused() {
    let error = with_ids("two", &["unit_777-20200101T0000", "unit_888-20200101T0100"]).expect_err("two gliders");
    assert!(error.contains("of 2 gliders (id: unit_777, unit_888)"), "{error}");
    for (name, ids) in [
        ("profiles", ["unit_777-20200101T0000", "unit_777-20200101T0100"]),
        ("counted", ["ru29_0001-20200101T0000", "ru29_0002-20200101T0100"]),
        ("of files", ["a1b2c3", "d4e5f6"]),
    ] {
        assert_eq!(with_ids(name, &ids).unwrap_or_else(|e| panic!("{name}: {e}")).flight.len(), 2 * ROWS);
    }
}

#[test]
fn regress_a_last_time_days_off_and_whole_minutes_of_a_clock() {
    let mut columns = sawtooth();
    change(&mut columns, "TIME", "seconds since 2020-01-01", |i, v| if i + 1 == ROWS { v + 1e6 } else { v });
    let read = imported(&columns, None).expect("reads");
    assert_eq!((read.flight.len(), read.flight.time_s[ROWS - 2]), (ROWS - 1, 4.0 * (ROWS - 2) as f64));
    assert!(has_note(&read, "1 of 400 values of PRES stand alone days off the others"), "{:?}", read.report.left_out);
    // Begun 40 s after a minute: the first minute has five rows.
    change(&mut columns, "TIME", "minutes since 2020-01-01", |i, _| ((4 * i + 40) / 60) as f64);
    let read = imported(&columns, None).expect("reads");
    let off = |i: usize| (read.flight.time_s[i] - 4.0 * i as f64).abs();
    assert!((0..ROWS).all(|i| off(i) < 4.0), "{:?}", &read.flight.time_s[..30]);
}

#[test]
fn regress_a_pitch_with_the_nose_down_positive_is_questioned() {
    let turned = |sign: f64| {
        let mut columns = sawtooth();
        change(&mut columns, "PITCH", "degrees", |_, v| sign * v);
        has_note(&imported(&columns, None).expect("reads"), "the nose is up in 100 % of the rows that sink")
    };
    assert!(turned(-1.0) && !turned(1.0));
}

#[test]
fn regress_a_sparse_speed_or_density_on_the_rows_own_clock_stays_sparse() {
    let sparse = |v: f64| (0..ROWS).map(|i| if i % 10 == 0 { v } else { f64::NAN }).collect::<Vec<f64>>();
    let mut columns = sawtooth();
    columns.push(("SPEED_WATER", "m s-1", sparse(0.3)));
    let read = imported(&columns, None).expect("reads");
    let known = |values: &[f64]| values.iter().filter(|v| v.is_finite()).count();
    assert_eq!(read.flight.speed_m_s.as_deref().map(known), Some(ROWS / 10));
    columns.retain(|c| c.0 != "PSAL" && c.0 != "CNDC");
    columns.push(("DENSITY", "kg m-3", sparse(1025.0)));
    assert_eq!(known(&imported(&columns, None).expect("reads").flight.density_kg_m3), ROWS / 10);
}

#[test]
fn regress_rows_of_one_time_are_one_row_unless_the_clock_is_coarse() {
    let want = imported(&sawtooth(), None).expect("plain");
    let close = |read: &Imported, name: &str| {
        let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert_eq!(read.flight.len(), ROWS / 2, "{name}");
        let (f, every) = (&read.flight, |v: &[f64]| v.iter().step_by(2).copied().collect::<Vec<f64>>());
        assert!(off(&f.time_s, &every(&want.flight.time_s)) < 1e-6, "{name}");
        assert!(off(&f.pressure_pa, &every(&want.flight.pressure_pa)) < 1e-6 && off(&f.pitch_rad, &every(&want.flight.pitch_rad)) < 1e-9);
        assert!(has_note(read, "the values of one time are one row"), "{name}: {:?}", read.report.notes);
    };
    // A row of the vehicle and one of the CTD at each time; then each row twice.
    let mut pairs = sawtooth();
    let mut twice = sawtooth();
    for (name, _, values) in &mut pairs {
        let all = values.clone();
        *values = (0..ROWS).map(|i| all[i - i % 2]).collect();
        let of_vehicle = ["PITCH", "HEADING"].contains(name);
        let others = |i: usize| *name != "TIME" && i.is_multiple_of(2) != of_vehicle;
        values.iter_mut().enumerate().filter(|(i, _)| others(*i)).for_each(|(_, v)| *v = f64::NAN);
    }
    for (_, _, values) in &mut twice {
        let all = values.clone();
        *values = (0..ROWS).map(|i| all[i - i % 2]).collect();
    }
    close(&imported(&pairs, None).expect("pairs"), "pairs");
    close(&imported(&twice, None).expect("twice"), "twice");
    // Of a clock of 8 s the rows differ.
    let mut coarse = sawtooth();
    change(&mut coarse, "TIME", "seconds since 2020-01-01T00:00:00Z", |i, v| v - 4.0 * (i % 2) as f64);
    let read = imported(&coarse, None).expect("coarse");
    assert!(read.flight.len() == ROWS && has_note(&read, "spread evenly"), "{:?}", read.report.notes);
}

#[test]
fn regress_dives_whose_numbers_go_back_stay_apart() {
    for numbers in [[5.0, 1.0, 2.0, 3.0], [1.0, 2.0, 1.0, 2.0], [4.0, 3.0, 2.0, 1.0]] {
        let mut columns = sawtooth();
        columns.push(("SEGMENT_NUMBER", "1", (0..ROWS).map(|i| numbers[i / 100]).collect()));
        let read = imported(&columns, None).expect("reads");
        assert_eq!((read.report.segments.len(), read.flight.segment[ROWS - 1]), (4, 3), "{numbers:?}");
    }
}

#[test]
fn regress_flags_of_other_names_and_meanings_are_read() {
    let meanings = |bad: &'static str| vec![("PRES_QC", "flag_meanings", bad), ("PRES_QC", "flag_values", "1, 2")];
    for (name, attributes) in [
        ("PRES_QC", meanings("usable unusable")),
        ("PRES_QC", meanings("accepted rejected")),
        ("PRES_QC", meanings("good not_good")),
        ("QC_PRES", vec![("QC_PRES", "flag_meanings", "good bad"), ("QC_PRES", "flag_values", "1, 2")]),
        (
            "flag_of_p",
            vec![
                ("PRES", "ancillary_variables", "other,flag_of_p"),
                ("flag_of_p", "flag_meanings", "good bad"),
                ("flag_of_p", "flag_values", "1, 2"),
            ],
        ),
    ] {
        let read = flagged(name, 1.0, 2.0, &attributes);
        assert_eq!(read.flight.len(), ROWS - BAD.len(), "{name} {attributes:?}: {:?}", read.report.notes);
    }
    let mut columns = sawtooth();
    columns.push(("TIME_QC", "1", (0..ROWS).map(|i| if BAD.contains(&i) { 4.0 } else { 1.0 }).collect()));
    change(&mut columns, "TIME", "seconds since 2020-01-01T00:00:00Z", |i, v| if BAD.contains(&i) { v + 2.0 } else { v });
    let read = imported(&columns, None).expect("reads");
    assert!(read.flight.len() == ROWS - BAD.len() && has_note(&read, "of TIME left out: TIME_QC"), "{:?}", read.report.notes);
}

#[test]
fn regress_what_a_netcdf_lacks_or_contradicts_is_named() {
    // A pressure in bar under the unit dbar, with the depth in the file.
    let mut columns = sawtooth();
    let depth = columns[1].2.iter().map(|p| p * 0.99).collect();
    columns.push(("DEPTH", "m", depth));
    assert!(!has_note(&imported(&columns, None).expect("sound"), "do not agree"));
    change(&mut columns, "PRES", "dbar", |_, v| v * 0.1);
    assert!(has_note(&imported(&columns, None).expect("bar"), "PRES and DEPTH do not agree"));
    let mut columns = sawtooth();
    change(&mut columns, "PRES", "dbar", |i, v| if i % 10 == 3 { f64::NAN } else { v });
    assert!(has_note(&imported(&columns, None).expect("gaps"), "40 of 400 rows have no PRES: no rows of the flight"));
    // A value every two minutes is bridged, and said.
    let mut columns = sawtooth();
    change(&mut columns, "PITCH", "degrees", |i, v| if i % 30 == 0 { v } else { f64::NAN });
    assert!(has_note(&imported(&columns, None).expect("seldom"), "pitch comes every 120 s only: interpolated"));
    let mut columns = sawtooth();
    change(&mut columns, "TIME", "seconds since 2020-01-01 00:00:00 PST", |_, v| v);
    assert!(imported(&columns, None).is_err());
}

#[test]
fn regress_the_science_computers_values_stand_on_its_clock() {
    let mut columns: Vec<Column> = sawtooth();
    columns[0].0 = "m_present_time";
    let late = columns[0].2.iter().map(|t| t + 20.0).collect();
    for (from, to) in [("PRES", "sci_water_pressure"), ("TEMP", "sci_water_temp"), ("PITCH", "m_pitch")] {
        columns.iter_mut().filter(|c| c.0 == from).for_each(|c| c.0 = to);
    }
    columns.push(("sci_m_present_time", "seconds since 2020-01-01T00:00:00Z", late));
    let read = imported(&columns, None).expect("reads");
    assert_eq!(read.report.start_unix_s, Some(1_577_836_820.0));
    // The pitch of the sixth row is that of the vehicle's clock then.
    assert!(
        (read.flight.pitch_rad[45] - 25.0_f64.to_radians()).abs() < 1e-9 && read.flight.pitch_rad[44] < 0.0,
        "{:?}",
        &read.flight.pitch_rad[40..48]
    );
}

#[test]
fn regress_fixes_of_another_gps_era_and_a_dead_pressure_are_mended() {
    let with = |weeks: f64| {
        let mut columns = sawtooth();
        let surfaced = |deg: f64| (0..ROWS).map(|i| if i < 3 || i + 3 > ROWS { deg } else { f64::NAN }).collect::<Vec<f64>>();
        columns.push(("gps_time", "seconds since 2020-01-01T00:00:00Z", (0..ROWS).map(|i| 4.0 * i as f64 - weeks * 604_800.0).collect()));
        columns.push(("LATITUDE_GPS", "degrees_north", surfaced(54.0)));
        columns.push(("LONGITUDE_GPS", "degrees_east", surfaced(15.0)));
        let clock = ["LATITUDE_GPS", "LONGITUDE_GPS"].map(|name| (name, "coordinates", "gps_time"));
        written(&columns, None, &clock).expect("reads")
    };
    let (want, got) = (with(0.0), with(1024.0));
    assert!(has_note(&got, "5 GPS fixes are 1024 weeks off") && got.report.origins == want.report.origins, "{:?}", got.report);
    let placed = |read: &Imported| read.flight.gps_north_m.iter().filter(|v| v.is_finite()).count();
    assert!(placed(&got) == placed(&want) && placed(&want) > 0, "{} and {}", placed(&got), placed(&want));
    let mut columns = sawtooth();
    columns.push(("eng_depth", "cm", columns[1].2.iter().map(|p| p * 99.0).collect()));
    change(&mut columns, "PRES", "dbar", |_, _| 0.0);
    let got = imported(&columns, None).expect("the vehicle's depth");
    assert!(has_note(&got, "PRES is 0 throughout: eng_depth is taken") && got.flight.pressure_pa[50] > 5e5, "{:?}", got.report.notes);
}

//! Mistakes and habits of those who write NetCDF files, each once: second flags, ranges in the wrong unit, times as texts.

use super::tests::{Attribute, ROWS, change, has_note, imported, sawtooth, with_more, written};
use crate::import::Imported;

#[test]
fn regress_any_of_several_flags_of_a_variable_leaves_a_value_out() {
    const QARTOD: &str = "pass not_evaluated suspect fail missing";
    const NUMBERS: &str = "1, 2, 3, 4, 9";
    let by_name: Vec<Attribute> = Vec::new();
    let declared = vec![("PRES", "ancillary_variables", "PRES_qc PRES_gross"), ("PRES_gross", "flag_meanings", QARTOD)];
    let turned = vec![("PRES", "ancillary_variables", "PRES_gross PRES_qc"), ("PRES_gross", "flag_meanings", QARTOD)];
    for (second, mut attributes) in [("PRES_flag", by_name), ("PRES_gross", declared), ("PRES_gross", turned)] {
        if second == "PRES_gross" {
            attributes.push((second, "flag_values", NUMBERS));
        }
        let flags = |bad: std::ops::Range<usize>| (0..ROWS).map(|i| if bad.contains(&i) { 4.0 } else { 1.0 }).collect();
        let mut columns = sawtooth();
        change(&mut columns, "PRES", "dbar", |i, v| if (120..135).contains(&i) { v + 30.0 } else { v });
        columns.push(("PRES_qc", "1", flags(120..128)));
        columns.push((second, "1", flags(125..135)));
        let read = written(&columns, None, &attributes).expect("reads");
        assert_eq!(read.flight.len(), ROWS - 15, "{second} {attributes:?}: {:?}", read.report.notes);
        for said in ["8 of 400 values of PRES left out: PRES_qc", &format!("7 of 400 values of PRES left out: {second}")] {
            assert!(has_note(&read, said), "{said}: {:?}", read.report.notes);
        }
    }
}

/// Saw-teeth whose temperature is packed in hundredths of a degree, with a range as the file writes it; `fills` rows are 30000, undeclared.
fn packed(range: impl Fn(&mut netcdf3::DataSet), fills: usize) -> Imported {
    let mut columns = sawtooth();
    let degrees = columns.iter().find(|c| c.0 == "TEMP").map(|c| c.2.clone()).expect("a temperature");
    columns.retain(|c| c.0 != "TEMP");
    let stored: Vec<i16> = degrees.iter().enumerate().map(|(i, v)| if i < fills { 30_000 } else { (v * 100.0).round() as i16 }).collect();
    let define = |set: &mut netcdf3::DataSet| {
        set.add_var_i16("TEMP", &["N_MEASUREMENTS"]).expect("a variable");
        set.add_var_attr_string("TEMP", "units", "degree_C").expect("a unit");
        set.add_var_attr_f64("TEMP", "scale_factor", vec![0.01]).expect("a factor");
        range(set);
    };
    with_more(&columns, define, |file| file.write_var_i16("TEMP", &stored).expect("values")).expect("reads")
}

#[test]
fn regress_a_valid_range_in_unpacked_numbers_is_taken_as_such() {
    let known = |read: &Imported| read.flight.temperature_degc.iter().filter(|v| v.is_finite()).count();
    let said = "is written in unpacked numbers";
    type Write<'a> = &'a dyn Fn(&mut netcdf3::DataSet);
    let range = |low: i16, high: i16| {
        move |set: &mut netcdf3::DataSet| {
            set.add_var_attr_i16("TEMP", "valid_range", vec![low, high]).map(|_| ()).expect("a range");
        }
    };
    let bounds = |set: &mut netcdf3::DataSet| {
        set.add_var_attr_f32("TEMP", "valid_min", vec![-2.0]).expect("a bound");
        set.add_var_attr_f32("TEMP", "valid_max", vec![40.0]).expect("a bound");
    };
    let cases: [(&str, Write, usize, usize, bool); 4] = [
        ("unpacked", &range(-2, 40), 0, ROWS, true),
        ("unpacked bounds", &bounds, 0, ROWS, true),
        ("packed", &range(-200, 4000), 0, ROWS, false),
        // Most rows hold one value beyond the range, which as an unpacked one would lie within it.
        ("packed with fills", &range(-200, 4000), 300, 100, false),
    ];
    for (name, range, fills, left, unpacked) in cases {
        let read = packed(range, fills);
        assert_eq!((known(&read), has_note(&read, said)), (left, unpacked), "{name}: {:?}", read.report.notes);
        assert!(read.flight.temperature_degc.iter().all(|v| v.is_nan() || (8.0..12.0).contains(v)), "{name}");
    }
}

/// Saw-teeth whose time is written in texts of `width` characters.
fn with_texts(width: usize, unit: &str, time: impl Fn(u32) -> String) -> Result<Imported, String> {
    let mut columns = sawtooth();
    columns.retain(|c| c.0 != "TIME");
    let texts: String = (0..ROWS as u32).map(|i| format!("{:\0<width$}", time(4 * i))).collect();
    let define = |set: &mut netcdf3::DataSet| {
        set.add_fixed_dim("STRING", width).expect("a dimension");
        set.add_var_u8("TIME", &["N_MEASUREMENTS", "STRING"]).expect("a variable");
        set.add_var_attr_string("TIME", "units", unit).expect("a unit");
    };
    with_more(&columns, define, |file| file.write_var_u8("TIME", texts.as_bytes()).expect("texts"))
}

#[test]
fn regress_times_that_are_texts_are_read_as_dates() {
    let clock = |s: u32| format!("{:02}:{:02}:{:02}", 8 + s / 3600, s / 60 % 60, s % 60);
    let want = Some(1_364_889_600.0);
    for (width, unit, end) in [(20, "", "Z"), (24, "ISO8601", "Z"), (32, "UTC", " UTC"), (27, "1", "+00:00"), (19, "", "")] {
        let read = with_texts(width, unit, |s| format!("2013-04-02T{}{end}", clock(s))).unwrap_or_else(|e| panic!("{unit} {end}: {e}"));
        assert_eq!((read.report.start_unix_s, read.flight.len()), (want, ROWS), "{unit} {end}");
        assert!((0..ROWS).all(|i| (read.flight.time_s[i] - 4.0 * i as f64).abs() < 1e-6), "{unit} {end}");
        assert!(has_note(&read, "TIME is written in texts: read as dates") && read.report.is_whole(), "{:?}", read.report);
    }
    let read = with_texts(24, "", |s| format!("2013-04-02 {} CEST", clock(s))).expect("a zone");
    assert_eq!(read.report.start_unix_s, want.map(|t| t - 7200.0));
    // A single one that is missing is a row without a time.
    let read = with_texts(20, "", |s| if s == 40 { String::new() } else { format!("2013-04-02T{}Z", clock(s)) }).expect("reads");
    assert!(read.flight.len() == ROWS - 1 && !read.report.is_whole(), "{:?}", read.report.left_out);
    for (time, said) in [("2013-04-02 08:00:00 CST", "the zone CST stands for several"), ("02/04/2013 08:00", "dd/mm/yyyy or mm/dd/yyyy")] {
        let error = with_texts(24, "", |_| time.into()).expect_err("refused");
        assert!(error.contains("TIME") && error.contains(said), "{error}");
    }
}

#[test]
fn accuracy_julian_days_of_a_clock_give_its_start() {
    // 2000-01-01T12:00 is 2451545.0 (Meeus, Astronomical Algorithms, chapter 7), here a day and a half later.
    for (unit, first) in [
        ("days since -4713-01-01T12:00:00", 2_451_546.5),
        ("days since -4713-11-24 12:00:00", 2_451_546.5),
        ("days since -4713-01-01T00:00:00Z", 2_451_547.0),
        ("days since -4712-01-01 12:00:00 UTC", 2_451_546.5),
    ] {
        let mut columns = sawtooth();
        change(&mut columns, "TIME", unit, |_, v| first + v / 86_400.0);
        let read = imported(&columns, None).unwrap_or_else(|e| panic!("{unit}: {e}"));
        let off = read.report.start_unix_s.map_or(f64::NAN, |t| t - 946_857_600.0);
        assert!(off.abs() < 1e-3 && has_note(&read, "read as Julian days"), "{unit}: {off} {:?}", read.report.notes);
        let proleptic = written(&columns, None, &[("TIME", "calendar", "proleptic_gregorian")]);
        assert_eq!(proleptic.is_ok(), unit.contains("11-24"), "{unit}");
        assert!(proleptic.map_or_else(|e| e.contains("-4713-11-24"), |read| has_note(&read, "read as Julian days")), "{unit}");
    }
}

#[test]
fn regress_zones_of_the_origin_of_a_clock_are_read_or_named() {
    let mut columns = sawtooth();
    change(&mut columns, "TIME", "seconds since 2020-01-01 00:00:00 CEST", |_, v| v);
    assert_eq!(imported(&columns, None).expect("reads").report.start_unix_s, Some(1_577_836_800.0 - 7200.0));
    change(&mut columns, "TIME", "seconds since 2020-01-01 00:00:00 CST", |_, v| v);
    let error = imported(&columns, None).expect_err("several");
    assert!(error.contains("TIME counts") && error.contains("the zone CST stands for several"), "{error}");
}

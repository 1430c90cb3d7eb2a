//! Mistakes and habits of those who write NetCDF files, each once: second flags, ranges in the wrong unit, times as texts.

use super::tests::{Attribute, ROWS, change, has_note, sawtooth, with_more, written};
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

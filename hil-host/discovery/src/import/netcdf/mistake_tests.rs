//! Mistakes and habits of those who write NetCDF files, each once: second flags, ranges in the wrong unit, times as texts.

use super::tests::{Attribute, ROWS, change, has_note, sawtooth, written};

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

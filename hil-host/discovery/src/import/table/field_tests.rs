//! Fields of tables that are no plain numbers: flags in words, thousands separators, names of zones.

use super::tests::{HEADER, read, rows, says, with_units};

#[test]
fn regress_flags_in_words_leave_bad_values_out() {
    for (k, (flag, words)) in [
        ("pressure_qc", ["good", "bad", "missing", "suspect"]),
        ("pressure_flag", ["PASS", "Fail", "Do not use", "NOT_EVALUATED"]),
        ("pressure_quality_flag", ["ok", "not good", "gross-range", "probably bad"]),
        ("QC_pressure", ["1", "4", "invalid", ""]),
    ]
    .into_iter()
    .enumerate()
    {
        let got = with_units(&format!("words{k}"), flag, "", |i| words[i % 4].to_owned()).expect("reads");
        assert_eq!(got.flight.len(), 30, "{flag}: {:?}", got.report.notes);
        let said = format!("30 of 60 values of pressure left out: {flag} says \"");
        assert!(says(&got, &said) && says(&got, words[2]) && !says(&got, "not read"), "{:?}", got.report.notes);
    }
    let text = HEADER.replace('\n', ",m_pitch_rad_flag\n")
        + &rows(|t| t.to_string()).replace("1025.1\n", "1025.1,bad\n").replacen(",bad\n", ",good\n", 50);
    let got = read("own-words", text.as_bytes()).expect("reads");
    assert_eq!(got.flight.pitch_rad.iter().filter(|v| v.is_nan()).count(), 10);
    assert!(!says(&got, "no numbers") && !says(&got, "not read"), "{:?}", got.report.notes);
    // Two flags of a column: either leaves a value out.
    let got = with_units("two", "pressure_qc,pressure_flag", "1,", |i| ["1,good", "4,good", "1,bad"][i % 3].to_owned()).expect("reads");
    assert_eq!(got.flight.len(), 20, "{:?}", got.report.notes);
}

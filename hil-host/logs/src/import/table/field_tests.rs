//! Fields of tables that are no plain numbers: flags in words, thousands separators, names of zones.

use super::tests::{HEADER, clock, read, rows, says, timed, with_units};

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

#[test]
fn regress_zones_behind_times_of_a_table_are_read_or_refused() {
    let local = |t: f64, hour: &str| format!("2020-09-13 {}", clock(t).replacen("12:", hour, 1));
    for (k, (hour, header, end)) in [
        ("14:", "time", " CEST"),
        ("08:", "Time", " EDT"),
        ("22:", "time", "AEST"),
        ("14:", "Time (CEST)", ""),
        ("12:", "Time (CEST)", "Z"),
    ]
    .into_iter()
    .enumerate()
    {
        let got = timed(&format!("zone{k}"), header, |t| local(t, hour) + end).unwrap_or_else(|e| panic!("{header}{end}: {e}"));
        assert_eq!((got.report.start_unix_s, got.flight.len()), (Some(1.6e9), 60), "{header}{end}");
    }
    for (k, (header, end, zone)) in
        [("time", " CST", "CST"), ("time", " IST", "IST"), ("Time (BST)", "", "BST"), ("time", " XYZ", "XYZ")].into_iter().enumerate()
    {
        let e = timed(&format!("none{k}"), header, |t| local(t, "12:") + end).map(|_| ()).expect_err(zone);
        assert!(e.contains("column ") && e.contains(&format!("the zone {zone} ")) && e.contains("write UTC"), "{e}");
    }
}

#[test]
fn regress_thousands_separators_are_read_or_named() {
    let table = |number: &dyn Fn(i32) -> String| {
        let row = |i: i32| format!("{},{},12.5,-20\n", 4 * i, number(3500 * (30 - (i - 30).abs())));
        "time,pressure,temperature,m_pitch\ns,Pa,Celsius,degrees\n".to_owned() + &(0..60).map(row).collect::<String>()
    };
    let want = read("thousands", table(&|p| format!("{p}.5")).as_bytes()).expect("plain").flight;
    let grouped = |p: i32, by: &str| if p < 1000 { format!("{p}") } else { format!("{}{by}{:03}", p / 1000, p % 1000) };
    for by in ["'", "\u{2019}", " ", "\u{a0}", "\u{202f}"] {
        let got = read("thousands", table(&|p| grouped(p, by) + ".5").as_bytes()).unwrap_or_else(|e| panic!("{by:?}: {e}"));
        assert_eq!(got.flight.pressure_pa, want.pressure_pa, "{by:?}");
        assert!(says(&got, "59 numbers have apostrophes or blanks between thousands") && got.report.is_whole(), "{:?}", got.report);
    }
    // Semicolons and decimal commas, with points between thousands.
    let german = |by: &str| {
        let rows = table(&|p| grouped(p, by) + "#5");
        rows.replace("12.5", "12#5").replace(',', ";").replace('#', ",")
    };
    assert_eq!(read("thousands", german("'").as_bytes()).expect("apostrophes").flight.pressure_pa, want.pressure_pa);
    for (text, example) in [
        (table(&|p| format!("\"{}.5\"", grouped(p, ","))), "`3,500.5`"),
        (table(&|p| format!("\"{}\"", grouped(p, ","))), "(or decimal commas), such as `3,500`"),
        (german("."), "`3.500.5`"),
    ] {
        let e = read("thousands", text.as_bytes()).map(|_| ()).expect_err(example);
        assert!(e.contains("column pressure") && e.contains("thousands separators") && e.contains(example), "{e}");
        assert!(e.contains("save the file again without them"), "{e}");
    }
    let own = HEADER.to_owned() + &rows(|t| t.to_string()).replace("-200", "\"-1,200.5\"");
    let e = read("own-thousands", own.as_bytes()).map(|_| ()).expect_err("named");
    assert!(e.contains("m_ballast_pumped_cc") && e.contains("thousands separators"), "{e}");
}

#[test]
fn regress_decimal_commas_in_quotes_are_read() {
    let table = |row: &dyn Fn(f64, f64) -> String| {
        let rows: String = (0..60_i32).map(|i| row(4.0 * f64::from(i), 1.25 * f64::from(30 - (i - 30).abs()))).collect();
        "time,pressure,temperature\ns,dbar,Celsius\n".to_owned() + &rows
    };
    let comma = |v: f64| format!("\"{v}\"").replace('.', ",");
    let want = read("points", table(&|t, p| format!("{t},{p},12.375\n")).as_bytes()).expect("reads").flight;
    let got = read("quoted", table(&|t, p| format!("{t},{},{}\n", comma(p), comma(12.375))).as_bytes()).expect("reads");
    assert!(got.flight.pressure_pa == want.pressure_pa && got.flight.temperature_degc == want.temperature_degc, "{:?}", got.report.notes);
    assert!(says(&got, "decimal commas, in quotes"), "{:?}", got.report.notes);
    // All with three digits: these may be thousands, and are refused.
    let e = read("doubt", table(&|t, p| format!("{t},\"{},500\",12\n", p.trunc())).as_bytes()).map(|_| ()).expect_err("two meanings");
    assert!(e.contains("thousands separators (or decimal commas)"), "{e}");
}

//! Tables of other programs, as they are read.

use super::super::calendar;
use super::*;

/// 60 rows of a dive, 4 s apart: time, dbar, pitch, ballast, density.
pub(super) fn rows(time: impl Fn(f64) -> String) -> String {
    (0..60)
        .map(|i| {
            let i = f64::from(i);
            format!("{},{:.2},-0.45,-200,1025.1\n", time(4.0 * i), 40.0 - (i - 30.0).abs())
        })
        .collect()
}

pub(super) fn read(name: &str, bytes: &[u8]) -> Result<Imported, String> {
    let path = std::env::temp_dir().join(format!("glider-table-{}-{name}.csv", std::process::id()));
    std::fs::write(&path, bytes).expect("written");
    let got = import(&path).map_err(|e| e.to_string());
    std::fs::remove_file(&path).expect("removed");
    got
}

pub(super) const HEADER: &str = "time_s,pressure_dbar,m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3\n";

#[test]
fn regress_tables_that_spreadsheets_write_are_read() {
    let plain = HEADER.to_owned() + &rows(|t| t.to_string());
    let want = read("plain", plain.as_bytes()).expect("plain").flight;
    let same = |name: &str, bytes: &[u8]| {
        let got = read(name, bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(got.flight.pressure_pa, want.pressure_pa, "{name}");
        assert!(got.flight.time_s.iter().zip(&want.time_s).all(|(a, b)| (a - b).abs() < 1e-3), "{name}");
        got.report
    };
    let iso = HEADER.to_owned() + &rows(|t| format!("2020-09-13T12:{:02}:{:02}Z", 26 + (t / 60.0) as u32, t as u32 % 60));
    same("iso", iso.as_bytes());
    let commas: String = plain.lines().enumerate().map(|(k, l)| format!("{l}{}\n", if k > 0 { "," } else { "" })).collect();
    same("commas at row ends", commas.as_bytes());
    same("semicolons", plain.replace(',', ";").as_bytes());
    same("a header behind #", format!("# made by hand\n# {plain}").as_bytes());
    let latin: Vec<u8> = plain
        .replace("sci_density_kg_m3", "sci_density_kg_m3,temp (\u{b0}C)")
        .lines()
        .enumerate()
        .flat_map(|(k, l)| {
            let line = if k > 0 { format!("{l},12.0\n") } else { format!("{l}\n") };
            line.chars().map(|c| c as u8).collect::<Vec<u8>>()
        })
        .collect();
    let report = same("Latin-1", &latin);
    assert!(report.notes.iter().any(|n| n.contains("0xB0 in line 1")), "{:?}", report.notes);
    let wide: Vec<u8> = [0xFF, 0xFE].into_iter().chain(plain.encode_utf16().flat_map(u16::to_le_bytes)).collect();
    same("UTF-16", &wide);
    let e = read("binary", &[&plain.as_bytes()[..50], &[0, 1, 2]].concat()).expect_err("refused");
    assert!(e.contains("zero bytes"), "{e}");
}

#[test]
fn a_line_of_units_under_the_formats_own_names_is_left_out() {
    let table = HEADER.to_owned() + "s,dbar,rad,cm3,kg m-3\n" + &rows(|t| t.to_string());
    let got = read("own-units", table.as_bytes()).expect("reads");
    assert_eq!((got.flight.len(), got.flight.pressure_pa[30]), (60, 40e4));
}

#[test]
fn a_line_of_units_makes_the_columns() {
    let table = "time,depth,pressure,temperature,salinity,m_pitch\nUTC,m,dbar,Celsius,1,degrees\n".to_owned()
        + &(0..60)
            .map(|i| format!("2026-05-02T09:15:{i:02}Z,{i},{i}.1,12.5,35.0,{}\n", if i == 7 { "NaN" } else { "-20" }))
            .collect::<String>();
    let got = read("units", table.as_bytes()).expect("reads");
    assert_eq!(got.flight.len(), 60);
    assert!((got.flight.pitch_rad[3] + 20f64.to_radians()).abs() < 1e-12 && (got.flight.density_kg_m3[0] - 1026.5).abs() < 0.1);
    assert_eq!(got.report.start_unix_s, calendar::iso_8601("2026-05-02T09:15:00Z"));
}

/// Whether something is said of an import in so many words.
pub(super) fn says(got: &Imported, what: &str) -> bool {
    got.report.notes.iter().chain(&got.report.left_out).any(|n| n.contains(what))
}

/// The plain table with its times written otherwise, under a header for them.
pub(super) fn timed(name: &str, header: &str, time: impl Fn(f64) -> String) -> Result<Imported, String> {
    read(name, (HEADER.replace("time_s", header) + &rows(time)).as_bytes())
}

/// "12:26:40" of 1600000000 on.
pub(super) fn clock(t: f64) -> String {
    format!("12:{:02}:{:02}", 26 + ((t + 40.0) / 60.0) as u32, (t + 40.0) as u32 % 60)
}

#[test]
fn regress_dates_of_other_programs_give_the_times_and_the_start() {
    type Written = fn(f64) -> String;
    let cases: [(&str, Written); 12] = [
        ("time", |t| format!("2020-09-13T{}Z", clock(t))),
        ("time_s", |t| (1.6e9 + t).to_string()),
        ("timestamp", |t| format!("13/09/2020 {}", clock(t))),
        ("Time", |t| format!("09/13/2020 {} PM", clock(t))),
        ("datetime", |t| format!("13.09.2020 {}", clock(t))),
        ("date_time", |t| format!("13-Sep-2020 {}", clock(t))),
        ("time", |t| format!("2020/09/13 {} GMT", clock(t))),
        ("time", |t| format!("20200913{}", clock(t).replace(':', ""))),
        ("time", |t| format!("\"2020-09-13T{},00\"", clock(t))),
        ("Date (UTC),Time (UTC)", |t| format!("2020-09-13,{}", clock(t))),
        ("time_ms", |t| (1.6e12 + 1e3 * t).to_string()),
        ("Time (UTC-2)", |t| format!("2020-09-13T{}", clock(t).replacen("12:", "10:", 1))),
    ];
    for (k, (header, time)) in cases.into_iter().enumerate() {
        let got = timed(&format!("date{k}"), header, time).unwrap_or_else(|e| panic!("{k} {header}: {e}"));
        assert_eq!((got.report.start_unix_s, got.flight.len()), (Some(1.6e9), 60), "{k} {header}");
        assert!(got.flight.time_s.iter().enumerate().all(|(i, t)| (t - 4.0 * i as f64).abs() < 1e-3), "{k} {header}");
        assert!(got.report.is_whole() && got.report.mapped[0].from == header.rsplit(',').next().expect("a name"), "{k} {header}");
    }
    assert_eq!(timed("relative", "time", |t| t.to_string()).expect("reads").report.start_unix_s, None);
}

#[test]
fn regress_times_that_are_read_in_two_ways_or_none_are_refused() {
    let refused = |name: &str, time: &dyn Fn(f64) -> String, said: &[&str]| {
        let e = timed(name, "time", time).map(|_| ()).expect_err(name);
        assert!(said.iter().all(|s| e.contains(s)) && !e.contains("leave the field empty"), "{name}: {e}");
    };
    let iso = "time as ISO 8601 (2026-05-02T09:15:31Z) or as seconds";
    refused("either", &|t| format!("02/05/2026 {}", clock(t)), &["dd/mm/yyyy or mm/dd/yyyy", iso]);
    refused("neither", &clock, &["`12:26:40` is no time", iso]);
    refused("ms", &|t| (1.6e12 + 1e3 * t).to_string(), &["counts milliseconds?"]);
    refused("ns", &|t| format!("{:.0}", 1.6e18 + 1e9 * t), &["counts nanoseconds?"]);
    let got = timed("feb31", "time", |t| if t > 0.0 { format!("2020-09-13T{}Z", clock(t)) } else { "2020-02-31".into() });
    let got = got.expect("reads");
    assert!(got.flight.len() == 59 && !got.report.is_whole() && says(&got, "such as `2020-02-31`"), "{:?}", got.report);
}

#[test]
fn regress_words_for_no_value_are_emptied_and_counted() {
    for word in ["NA", "null", "#N/A", "--", "inf", "1e35", "9.96921e+36"] {
        let text = HEADER.to_owned() + &rows(|t| t.to_string()).replace("36.00,-0.45", &format!("36.00,{word}"));
        let got = read("words", text.as_bytes()).unwrap_or_else(|e| panic!("{word}: {e}"));
        assert_eq!(got.flight.pitch_rad.iter().filter(|v| v.is_nan()).count(), 2, "{word}");
        assert!(says(&got, &format!("2 fields hold {word}: no value")) && got.report.is_whole(), "{word}: {:?}", got.report.notes);
    }
}

/// Rows with units in a second line, of the columns behind time, pressure, temperature and m_pitch.
pub(super) fn with_units(name: &str, header: &str, units: &str, more: impl Fn(usize) -> String) -> Result<Imported, String> {
    let table = format!("time,pressure,temperature,m_pitch,{header}\ns,dbar,Celsius,degrees,{units}\n")
        + &(0..60).map(|i| format!("{i},{i}.1,12.5,-20,{}\n", more(i))).collect::<String>();
    read(name, table.as_bytes())
}

#[test]
fn regress_rows_of_two_vehicles_are_refused_with_their_names() {
    for (k, column) in ["trajectory", "Platform_Code", "GLIDER_ID", "deployment_id", "wmo_id"].into_iter().enumerate() {
        let e = with_units(&format!("two{k}"), column, "", |i| format!("unit_{}", i % 2)).map(|_| ()).expect_err(column);
        assert!(e.contains("unit_0, unit_1") && e.contains("import one glider's rows at a time"), "{e}");
        let text = HEADER.replace("time_s", &format!("{column},time_s")) + &rows(|t| format!("unit_{},{t}", u8::from(t > 99.0)));
        assert!(read(&format!("own-two{k}"), text.as_bytes()).is_err_and(|e| e.contains("unit_0, unit_1")));
    }
    assert!(with_units("one", "trajectory", "", |i| if i % 2 > 0 { "unit_0".into() } else { String::new() }).is_ok());
}

#[test]
fn regress_flags_of_tables_leave_bad_values_out() {
    for flag in ["pressure_QC", "pressure_qartod_summary_flag", "PRESSURE_flag"] {
        let got = with_units("flags", flag, "1", |i| [1, 4, 9, 3][i % 4].to_string()).expect("reads");
        assert_eq!(got.flight.len(), 30, "{flag}");
        assert!(says(&got, &format!("30 of 60 values of pressure left out: {flag} says bad (4) or missing (9)")), "{:?}", got.report.notes);
    }
    let text =
        HEADER.replace('\n', ",m_pitch_rad_qc\n") + &rows(|t| t.to_string()).replace("1025.1\n", "1025.1,4\n").replacen(",4\n", ",1\n", 50);
    let got = read("own-flags", text.as_bytes()).expect("reads");
    assert_eq!(got.flight.pitch_rad.iter().filter(|v| v.is_nan()).count(), 10);
}

#[test]
fn regress_impossible_repeats_of_a_table_are_fills() {
    let got = with_units("nines", "salinity", "1", |i| if (20..30).contains(&i) { "-99".into() } else { "35".into() }).expect("reads");
    assert!(says(&got, "10 of 60 values of salinity are -99: a fill"), "{:?}", got.report.notes);
    assert_eq!(got.flight.density_kg_m3.iter().filter(|v| v.is_nan()).count(), 10);
    let text = HEADER.replace('\n', ",sci_water_temp\n")
        + &rows(|t| t.to_string()).replace("1025.1\n", "1025.1,12\n").replacen(",12\n", ",99\n", 7);
    let got = read("own-nines", text.as_bytes()).expect("reads");
    assert!(says(&got, "7 of 60 values of sci_water_temp are 99: a fill"), "{:?}", got.report.notes);
}

#[test]
fn regress_names_of_any_case_and_conductivity_give_a_density() {
    for (k, (salinity, value)) in
        [("SALINITY", "35"), ("PRACTICAL_SALINITY", "35"), ("sci_water_cond", "4.0"), ("Conductivity_mS_cm", "40")].into_iter().enumerate()
    {
        let header = format!("TIME,PRESSURE_DBAR,PITCH_DEG,ROLL_DEG,HEADING_DEG,SCI_WATER_TEMP,{salinity},crew\n");
        let text = header + &(0..60).map(|i| format!("{i},{i}.1,-20,5,90,12.5,{value},Ann\n")).collect::<String>();
        let got = read(&format!("case{k}"), text.as_bytes()).unwrap_or_else(|e| panic!("{salinity}: {e}"));
        assert!(
            (got.flight.roll_rad[3] - 5f64.to_radians()).abs() < 1e-12 && (got.flight.heading_rad[3] - 90f64.to_radians()).abs() < 1e-12
        );
        assert!((1024.0..1030.0).contains(&got.flight.density_kg_m3[9]), "{salinity}: {:?}", got.flight.density_kg_m3);
        assert!(got.report.density.starts_with("recomputed") && says(&got, "not read: crew"), "{:?}", got.report);
        assert!(
            got.flight.extra.contains_key(salinity)
                && got.flight.extra.keys().any(|k| k.eq_ignore_ascii_case(crate::import::assembly::SALINITY_COLUMN) || k == "SALINITY")
        );
    }
    let got = with_units("unread", "latitude,oxygen", "degrees_north,umol", |_| "54,200".into()).expect("reads");
    assert!(says(&got, "not read: oxygen"), "{:?}", got.report.notes);
    let got = with_units("stated", "density", "kg m-3", |_| "1025".into()).expect("reads");
    assert!(got.flight.density_kg_m3.iter().all(|d| *d == 1025.0) && got.report.density.starts_with("as the file"), "{:?}", got.report);
}

#[test]
fn regress_a_full_column_of_a_table_is_read_before_an_empty_one() {
    let got = with_units("oil", "m_ballast_pumped,m_de_oil_vol,depth", "cc,cc,m", |i| format!("0,{},9", 100 + i)).expect("reads");
    assert!((got.flight.ballast_m3[5] - 105e-6).abs() < 1e-12);
    assert!(says(&got, "m_ballast_pumped is 0 throughout: m_de_oil_vol is taken"), "{:?}", got.report.notes);
    let text = HEADER.replace("m_ballast_pumped_cc", "m_ballast_pumped,m_de_oil_vol") + &rows(|t| t.to_string()).replace("-200", "0,-200");
    let got = read("own-oil", text.as_bytes()).expect("reads");
    assert!(
        got.flight.ballast_m3.iter().all(|v| (*v + 200e-6).abs() < 1e-12) && says(&got, "m_de_oil_vol is taken"),
        "{:?}",
        got.report.notes
    );
    let header = "time,pressure,depth,temperature\ns,dbar,m,Celsius\n".to_owned();
    let text = header + &(0..60).map(|i| format!("{i},{},{i},12\n", if i % 9 > 0 { "" } else { "4" })).collect::<String>();
    let got = read("depth", text.as_bytes()).expect("reads");
    assert!(got.flight.len() == 60 && says(&got, "pressure has 7 values: depth is taken"), "{:?}", got.report.notes);
}

#[test]
fn regress_blocks_out_of_order_or_repeated_are_put_right() {
    let plain = HEADER.to_owned() + &rows(|t| t.to_string());
    let want = read("in-order", plain.as_bytes()).expect("plain").flight;
    let lines: Vec<&str> = plain.lines().collect();
    let table = |parts: &[std::ops::Range<usize>]| {
        let rows: Vec<&str> = parts.iter().flat_map(|p| lines[p.clone()].iter().copied()).collect();
        lines[0].to_owned() + "\n" + &rows.join("\n") + "\n"
    };
    for (name, parts, said) in [
        ("moved", [1..21, 41..61, 21..41], "rows stand in 3 blocks out of the order of time: sorted"),
        ("repeated", [1..61, 21..31, 0..0], "10 of 70 rows stand there a second time"),
    ] {
        let got = read(name, table(&parts).as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!((&got.flight.time_s, &got.flight.pressure_pa), (&want.time_s, &want.pressure_pa), "{name}");
        assert!(says(&got, said) && got.report.is_whole(), "{name}: {:?}", got.report);
    }
    // Other values at the same times are of another log: refused.
    let other = plain.clone() + &lines[21..31].join("\n").replace("-0.45", "-0.40") + "\n";
    let e = read("other", other.as_bytes()).map(|_| ()).expect_err("two logs");
    assert!(e.contains("must increase"), "{e}");
}

#[test]
fn regress_times_of_whole_seconds_are_spread_and_doubles_are_not() {
    let text = HEADER.to_owned() + &(0..60).map(|i| format!("{},{i}.5,-0.45,-200,1025.1\n", i / 2)).collect::<String>();
    let got = read("halves", text.as_bytes()).expect("reads");
    assert!((0..60).all(|i| (got.flight.time_s[i] - 0.5 * i as f64).abs() < 1e-9), "{:?}", got.flight.time_s);
    assert!(says(&got, "spread evenly up to the next") && got.report.is_whole(), "{:?}", got.report);
}

#[test]
fn regress_headers_behind_percent_in_brackets_and_again() {
    let plain = HEADER.to_owned() + &rows(|t| t.to_string());
    let want = read("headers", plain.as_bytes()).expect("plain").flight;
    let lines: Vec<&str> = plain.lines().collect();
    let again = format!("{}\n{}\n{}\n", lines[..31].join("\n"), lines[0], lines[31..].join("\n"));
    for (name, text, said) in [
        ("percent", format!("% {plain}"), "behind a %"),
        ("comment", format!("% from Matlab\n% x\n{plain}"), ""),
        ("again", again, "1 lines repeat the header"),
    ] {
        let got = read(name, text.as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!((&got.flight.time_s, &got.flight.pressure_pa), (&want.time_s, &want.pressure_pa), "{name}");
        assert!((said.is_empty() || says(&got, said)) && got.report.is_whole(), "{name}: {:?}", got.report);
    }
    let header = "Time [s],Segment,Pressure [dbar],Pitch[deg],Temperature [\u{b0}C],Salinity [PSU]\n".to_owned();
    let text = header + &(0..60).map(|i| format!("{i},{},{i}.1,-20,12.5,35\n", u8::from(i > 29))).collect::<String>();
    let got = read("brackets", text.as_bytes()).expect("reads");
    assert_eq!((got.flight.len(), got.flight.segment[59], got.report.start_unix_s), (60, 1, None));
    assert!((got.flight.pitch_rad[3] + 20f64.to_radians()).abs() < 1e-12 && got.flight.density_kg_m3[3] > 1000.0);
}

#[test]
fn regress_a_single_time_days_off_all_others_is_left_out() {
    let plain = HEADER.to_owned() + &rows(|t| t.to_string());
    let want = read("near", plain.as_bytes()).expect("plain").flight;
    let dated = |t: f64| (1.6e9 + t).to_string();
    for (name, text) in [
        ("last", plain.clone() + "1000000,0.3,-0.45,-200,1025.1\n"),
        ("middle", plain.replace("\n120,", "\n1000000,0.3,-0.45,-200,1025.1\n120,")),
        ("first", plain.replace("\n0,", "\n-1000000,0.3,-0.45,-200,1025.1\n0,")),
        ("dated", HEADER.to_owned() + &rows(dated) + "1601000000,0.3,-0.45,-200,1025.1\n"),
    ] {
        let got = read(name, text.as_bytes()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!((&got.flight.time_s, &got.flight.pressure_pa), (&want.time_s, &want.pressure_pa), "{name}");
        assert!(says(&got, "1 of 61 rows have no time, or one days or years off the others"), "{name}: {:?}", got.report.left_out);
    }
    // Two parts of a flight ten days apart, and a log that is sparse throughout, are flights.
    let later = rows(|t| (1e6 + t).to_string());
    let got = read("parts", (plain.clone() + &later).as_bytes()).expect("reads");
    assert!(got.flight.len() == 120 && got.report.is_whole(), "{:?}", got.report.left_out);
}

#[test]
fn regress_a_clock_that_was_set_back_is_no_blocks_out_of_order() {
    let units = "time,pressure,temperature,salinity\nUTC,dbar,Celsius,1\n";
    let table = |back_s: f64| -> String {
        let row = |i: u32| {
            let t = 1.6e9 + 4.0 * f64::from(i) - if i < 100 { 0.0 } else { back_s };
            format!("{t},{:.2},12,35\n", 40.0 - (f64::from(i % 60) - 30.0).abs())
        };
        units.to_owned() + &(0..200).map(row).collect::<String>()
    };
    // Into the log's own time, and by an hour.
    for (name, back_s) in [("among", 201.5), ("before", 3600.0)] {
        let e = read(name, table(back_s).as_bytes()).map(|_| ()).expect_err("set back");
        assert!(e.contains(&format!("{name}.csv: time goes back by")) && e.contains("after row 100") && e.contains("write UTC"), "{e}");
    }
    let plain = HEADER.to_owned() + &rows(|t| (t - if t < 120.0 { 0.0 } else { 3600.0 }).to_string());
    let e = read("own-hour", plain.as_bytes()).map(|_| ()).expect_err("set back");
    assert!(e.contains("after row 30") && e.contains("summer time"), "{e}");
    // Channels in blocks of rows of their own are one log.
    let channel = |f: &dyn Fn(u32) -> String| (0..60).map(f).collect::<String>();
    let text = units.to_owned() + &channel(&|i| format!("{},{i},,\n", 4 * i)) + &channel(&|i| format!("{},,12,35\n", 4 * i));
    let got = read("channels", text.as_bytes()).expect("reads");
    assert!(got.flight.len() == 60 && got.flight.density_kg_m3.iter().all(|d| d.is_finite()), "{:?}", got.report);
}

#[test]
fn regress_fields_that_are_no_numbers_are_counted_and_minus_signs_read() {
    let with = |name: &str, pitch: &dyn Fn(usize) -> String| {
        let head = "Time [s],Pressure [dbar],Pitch [rad],ballast_pumped [cm³]\n".to_owned();
        let row = |i: usize| format!("{},{:.2},{},-200\n", 4 * i, 40.0 - (i as f64 - 30.0).abs(), pitch(i));
        read(name, (head + &(0..60).map(row).collect::<String>()).as_bytes()).expect("reads")
    };
    let plain = with("minus plain", &|_| "-0.45".into());
    assert!(plain.report.is_whole() && (plain.flight.ballast_m3[3] + 2e-4).abs() < 1e-12, "{:?}", plain.report.left_out);
    let typeset = with("minus typeset", &|_| "\u{2212}0.45".into());
    assert!(typeset.flight.pitch_rad == plain.flight.pitch_rad && typeset.report.notes.iter().any(|n| n.contains("U+2212")));
    for bad in ["#REF!", "(0.45)", ">0.4"] {
        let got = with("minus bad", &|i| if i % 3 == 0 { bad.into() } else { "-0.45".into() });
        assert_eq!(got.report.left_out, [format!("20 of 60 fields of Pitch are no numbers, first \"{bad}\"")]);
    }
    let degrees = "Time [s],Pressure [dbar],Pitch [°]\n".to_owned() + &(0..60).map(|i| format!("{},{i},-26\n", 4 * i)).collect::<String>();
    let got = read("degree sign", degrees.as_bytes()).expect("reads");
    assert!((got.flight.pitch_rad[5] + 26f64.to_radians()).abs() < 1e-9, "{:?}", got.report.left_out);
}

#[test]
fn regress_fixes_of_each_dive_of_a_table_count_from_its_own_first_one() {
    let mut text = "time (UTC),pressure (dbar),pitch (rad),gps_lat (degrees_north),gps_lon (degrees_east)\n".to_owned();
    // Two dives of 8 minutes with 4 minutes at the surface between them, and a drift of 100 m.
    for i in 0..300 {
        let dbar = if i < 120 {
            30.0 - (i as f64 - 60.0).abs() / 2.0
        } else if i < 180 {
            0.1
        } else {
            30.0 - (i as f64 - 240.0).abs() / 2.0
        };
        let fix =
            |deg: f64| if (120..180).contains(&i) && i % 10 == 0 { format!("{:.5}", deg + 1e-5 * f64::from(i)) } else { String::new() };
        text += &format!(
            "2026-05-02T{:02}:{:02}:{:02}Z,{dbar},-0.4,{},{}\n",
            9 + i * 4 / 3600,
            i * 4 / 60 % 60,
            i * 4 % 60,
            fix(54.0),
            fix(7.0)
        );
    }
    let got = read("origins", text.as_bytes()).expect("reads");
    let f = &got.flight;
    assert_eq!((got.report.segments.len(), got.report.origins.len()), (2, 2), "{:?}", got.report);
    for segment in 0..2 {
        let first = (0..f.len()).find(|k| f.segment[*k] == segment && f.gps_north_m[*k].is_finite()).expect("a fix");
        assert!(f.gps_north_m[first] == 0.0 && f.gps_east_m[first] == 0.0, "segment {segment}: {}", f.gps_north_m[first]);
    }
}

#[test]
fn regress_dates_that_no_flight_has_are_refused_with_the_way_out() {
    let days = |first: f64, name: &str| {
        let head = "time (days since 1970-01-01),pressure (dbar),pitch (rad)\n".to_owned();
        read(
            name,
            (head + &(0..60).map(|i| format!("{:.8},{i},-0.4\n", first + f64::from(i) * 4.0 / 86_400.0)).collect::<String>()).as_bytes(),
        )
    };
    assert_eq!(days(20_575.0, "days").expect("reads").report.start_unix_s, Some(20_575.0 * 86_400.0));
    for (first, year) in [(740_107.4, "3996"), (2_461_162.9, "8708")] {
        let e = days(first, "matlab").expect_err("refused");
        assert!(e.contains(&format!("reaches the year {year}")) && e.contains("state it as"), "{e}");
    }
}

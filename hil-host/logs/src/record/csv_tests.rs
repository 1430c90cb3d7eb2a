//! What a csv of the flight format may and may not hold.

use super::*;

fn rows(n: usize) -> String {
    let mut s = String::from("time_s,segment,pressure_dbar,m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3,note,oxygen\n");
    for i in 0..n {
        s += &format!("{},0,{:.2},-0.45,-200,1025.1,x,{i}\n", i as f64 * 4.0, i as f64 * 0.8);
    }
    s
}

fn error_of(text: &str) -> String {
    parse(text, Path::new("f.csv"), "f").expect_err("must be refused").to_string()
}

#[test]
fn a_flight_is_read_by_column_name_into_si_and_extra_numbers_are_kept() {
    let f = parse(&rows(20), Path::new("f.csv"), "f").expect("reads");
    assert_eq!(f.len(), 20);
    assert!((f.pressure_pa[10] - 8e4).abs() < 1e-6 && (f.ballast_m3[3] + 2e-4).abs() < 1e-12);
    assert_eq!(f.extra.keys().collect::<Vec<_>>(), ["oxygen"]);
    assert!(f.speed_m_s.is_none() && f.roll_rad[0].is_nan());
}

#[test]
fn a_flight_is_sampled_as_often_as_every_message_says() {
    let every = |step_s: f64| {
        let head = "time_s,segment,pressure_dbar,m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3\n".to_owned();
        let row = |i: u32| format!("{},0,{:.4},-0.45,-200,1025.1\n", f64::from(i) * step_s, f64::from(i) * step_s * 0.2);
        head + &(0..20).map(row).collect::<String>()
    };
    for step_s in [0.1, 1.0, 60.0] {
        assert_eq!(parse(&every(step_s), Path::new("f.csv"), "f").expect("reads").len(), 20, "{step_s}");
    }
    for step_s in [0.05, 90.0] {
        let e = error_of(&every(step_s));
        assert!(e.contains(&format!("the usual step is {step_s} s")) && e.contains(SAMPLED_EVERY), "{e}");
    }
}

#[test]
fn errors_name_file_line_column_and_a_fix() {
    let swapped = rows(20).replace("\n8,", "\n2,");
    let e = error_of(&swapped);
    assert!(e.contains("f.csv, line 4, column time_s") && e.contains("increase"), "{e}");
    let e = error_of(&rows(20).replace("-200", "x-200"));
    assert!(e.contains("line 2, column m_ballast_pumped_cc") && e.contains("not a number"), "{e}");
    let e = error_of(&rows(20).replace("m_pitch_rad", "nick"));
    assert!(e.contains("m_pitch_rad") && e.contains("missing") && e.contains("pitch_rad"), "{e}");
    assert!(error_of("").contains("empty"));
    assert!(error_of("time_s,pressure_dbar\n").contains("missing"));
    let e = error_of(&rows(20).replacen("1.60", "1e308", 1));
    assert!(e.contains("column pressure_dbar") && e.contains("not a number"), "{e}");
    let e = error_of(&(rows(20) + "80,0,1\n"));
    assert!(e.contains("line 22") && e.contains("cut off"), "{e}");
}

#[test]
fn regress_the_time_to_read_segment_labels_grows_with_their_number() {
    let seconds = |labels: u32| {
        let mut text = String::from("time_s,segment,pressure_dbar,m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3\n");
        for i in 0..labels {
            text += &format!("{},dive {i},{:.2},-0.45,-200,1025.1\n", 4 * i, f64::from(i % 40));
        }
        let started = std::time::Instant::now();
        let flight = parse(&text, Path::new("f.csv"), "f").expect("reads");
        assert_eq!(flight.segment.last(), Some(&(labels - 1)));
        started.elapsed().as_secs_f64()
    };
    // Best of three, against a busy machine. Sixteen times as many; a search through all labels for each takes 256 times as long.
    let best = |labels: u32| (0..3).map(|_| seconds(labels)).fold(f64::INFINITY, f64::min);
    let ratio = best(100_000) / best(6_250);
    assert!(ratio < 60.0, "{ratio}");
}

#[test]
fn every_channel_off_by_a_thousand_is_refused_by_its_name() {
    let sound = parse(&rows(40), Path::new("f.csv"), "f").expect("reads");
    let names = ["pressure", "pitch", "ballast", "density"];
    assert_eq!(implausible(&sound, names), None);
    type Pick = fn(&mut Flight) -> &mut Vec<f64>;
    let channels: [(&str, Pick, f64, &[f64]); 7] = [
        // Divided by a thousand it is a log from the surface, which may be read, but not imported or diagnosed.
        ("pressure", |f| &mut f.pressure_pa, 50e4, &[1e3]),
        ("pitch", |f| &mut f.pitch_rad, 0.4, &[1e3, 1e-3]),
        ("ballast", |f| &mut f.ballast_m3, 2e-4, &[1e3, 1e-3]),
        ("density", |f| &mut f.density_kg_m3, 1025.0, &[1e3, 1e-3]),
        ("temperature", |f| &mut f.temperature_degc, 10.0, &[1e3, 1e-3]),
        // Divided by a thousand they are a straight course and no list, which a flight may have.
        ("heading", |f| &mut f.heading_rad, 3.0, &[1e3]),
        ("roll", |f| &mut f.roll_rad, 0.1, &[1e3]),
    ];
    for (name, column, size, factors) in channels {
        for factor in factors {
            let mut flight = sound.clone();
            for (i, v) in column(&mut flight).iter_mut().enumerate() {
                *v = size * factor * (1.0 + 0.1 * (i as f64).sin());
            }
            let found = implausible(&flight, names).unwrap_or_else(|| panic!("{name} x {factor} passes"));
            assert_eq!(found.0, name, "{found:?}");
        }
    }
    for speed in [300.0, 3e-4] {
        let flight = Flight { speed_m_s: Some(vec![speed; 40]), ..sound.clone() };
        assert_eq!(implausible(&flight, names).expect("refused").0, "speed");
    }
}

#[test]
fn a_glider_that_sinks_at_two_metres_a_second_is_refused() {
    let mut text = String::from("time_s,pressure_dbar,m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3\n");
    for i in 0..400 {
        // 0.2 m/s between 3 and 43 dbar, times ten.
        let dbar = 3.0 + 40.0 * (1.0 - (f64::from(i % 100) / 50.0 - 1.0).abs());
        text += &format!("{},{:.2},-0.4,-200,1025.1\n", 4 * i, 10.0 * dbar);
    }
    let e = error_of(&text);
    assert!(e.contains("pressure_dbar") && e.contains("no glider sinks"), "{e}");
}

#[test]
fn units_off_by_a_thousand_are_refused_with_the_likely_cause() {
    assert!(error_of(&rows(20).replace("1025.1", "1.0251")).contains("g/cm3"));
    assert!(error_of(&rows(20).replace("1025.1", "25.1")).contains("sigma"));
    assert!(error_of(&rows(20).replace(",-200,", ",-0.0002,")).contains("m3"));
    assert!(error_of(&rows(20).replace("-0.45", "-26")).contains("degrees"));
    let e = error_of(&rows(20).replace("1025.1", ""));
    assert!(e.contains("only 0 values"), "{e}");
}

#[test]
fn regress_words_and_numbers_that_stand_for_no_value() {
    for word in ["NA", "N/A", "#N/A", "NULL", "null", "none", "NaN", "-", "--", ""] {
        let f = parse(&rows(20).replacen("1.60", word, 1), Path::new("f.csv"), "f").unwrap_or_else(|e| panic!("{word}: {e}"));
        assert!(f.pressure_pa[2].is_nan() && f.pressure_pa[3].is_finite(), "{word}");
        assert!(no_value(word), "{word}");
    }
    // Numbers that nothing measures are none for an import, which says so; a flight that holds them is refused.
    for number in ["inf", "-inf", "1e35", "-9.96921e+36", "1e308"] {
        assert!(no_value(number) && error_of(&rows(20).replacen("1.60", number, 1)).contains("not a number"), "{number}");
    }
    assert!(!no_value("-0.5") && !no_value("nine"));
    let e = error_of(&rows(20).replace("\n8,", "\n09:15:31,"));
    assert!(e.contains("column time_s") && e.contains(TIME_AS) && !e.contains("leave the field empty"), "{e}");
}

#[test]
fn regress_roll_and_heading_in_degrees_are_read_as_pitch_is() {
    let text = rows(20).replace("note,oxygen", "ROLL_DEG,heading_deg").replace(",x,", ",90,");
    let f = parse(&text, Path::new("f.csv"), "f").expect("reads");
    assert!((f.roll_rad[1] - 90f64.to_radians()).abs() < 1e-12 && (f.heading_rad[10] - 10f64.to_radians()).abs() < 1e-12);
}

#[test]
fn regress_a_column_that_stands_twice_is_refused_with_both_places() {
    let twice = [("oxygen", "oxygen", "7 and 8"), ("note", "m_pitch_rad", "4 and 8"), ("note", "M_Pitch_rad", "4 and 8")];
    for (name, other, places) in twice {
        let text = rows(20).replacen("note,oxygen", &format!("{name},{other}"), 1).replace(",x,", ",0.1,");
        let e = error_of(&text);
        assert!(e.contains("f.csv, line 1") && e.contains("stands twice in the header") && e.contains(places), "{e}");
    }
    // Other columns are told apart by their case, and a comma at the end of a row names nothing.
    let f = parse(&rows(20).replacen("note,oxygen", "Oxygen,oxygen", 1).replace(",x,", ",1,"), Path::new("f.csv"), "f").expect("reads");
    assert_eq!(f.extra.keys().collect::<Vec<_>>(), ["Oxygen", "oxygen"]);
    let f = parse(&rows(20).replace('\n', ",,\n"), Path::new("f.csv"), "f").expect("reads");
    assert_eq!(f.extra.keys().collect::<Vec<_>>(), ["oxygen"]);
}

#[test]
fn regress_a_bad_field_of_an_extra_column_costs_that_field_and_is_named() {
    let f = parse(&rows(20).replace("x,7\n", "x,7 ml\n"), Path::new("f.csv"), "f").expect("reads");
    assert!(f.extra["oxygen"][7].is_nan() && f.extra["oxygen"][8] == 8.0);
    assert_eq!(
        f.unread,
        [
            "column note: 20 of 20 fields are no numbers, the first is `x` in line 2",
            "column oxygen: 1 of 20 fields are no numbers, the first is `7 ml` in line 9",
        ]
    );
    assert!(parse(&rows(20).replace(",x,", ",,"), Path::new("f.csv"), "f").expect("reads").unread.is_empty());
}

#[test]
fn regress_a_segment_is_a_number_or_a_label_and_never_both() {
    let with = |labels: [&str; 3]| {
        let mut at = 0;
        rows(18).replace(",0,", ",SEGMENT,").split("SEGMENT").fold(String::new(), |text, part| {
            at += 1;
            if at == 1 { part.into() } else { text + labels[(at - 2) / 6] + part }
        })
    };
    let segments = |labels| parse(&with(labels), Path::new("f.csv"), "f").expect("reads").segment;
    assert_eq!(segments(["0", "3", "4"])[5..7], [0, 3]);
    assert_eq!(segments(["1.0", "2.0", "3.0"])[5..7], [1, 2]);
    // Labels were numbered from 0 among numbers that were stated: two segments became one.
    assert_eq!(segments(["1", "0", "transit"])[5..13], [0, 1, 1, 1, 1, 1, 1, 2]);
    for bad in ["", "nan", "0.5", "-1", "1e20"] {
        let e = error_of(&with(["0", bad, "1"]));
        assert!(e.contains("f.csv, line 8, column segment") && e.contains("segment"), "{bad}: {e}");
    }
}

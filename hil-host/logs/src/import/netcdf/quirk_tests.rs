//! Further quirks: flags, values that cannot be, depth, dives, and a lab's own names.

use netcdf3::DataSet;

use super::Imported;
use super::tests::{BAD, Made, ROWS, SINCE, START, any, close, hold, known, whole};

const QARTOD: &str = "PASS NOT_EVALUATED SUSPECT FAIL MISSING";
const CODES: &str = "no_quality_control good_value probably_good probably_bad bad_value";
const TESTS: &str = "gross_range_test local_range_test spike_test stuck_value_test gradient_test propagate_flags";
const MIXED: &str = "no_bad_data interpolated spike suspect_gradient";
/// Name of a flag; good and bad value; meanings with their values or, behind a |, masks; whether another attribute declares it.
type Flagged = (&'static str, [f64; 2], &'static str, &'static str, bool);
const CALLED_BAD: [Flagged; 19] = [
    ("PRES_qartod_summary_flag", [1.0, 4.0], QARTOD, "1, 2, 3, 4, 9", false),
    ("qartod_PRES_primary_flag", [1.0, 4.0], QARTOD, "1, 2, 3, 4, 9", false),
    ("PRES_flag", [0.0, 1.0], "good bad", "0, 1", false),
    ("PRES_qc", [1.0, 0.0], "bad good", "0, 1", false),
    ("PRES_QC", [49.0, 52.0], CODES, "48, 49, 50, 51, 52", false),
    ("PRES_QC", [1.0, 4.0], "", "", false),
    ("quality_flag", [1.0, 4.0], "", "", true),
    ("PRES_qc", [0.0, 4.0], TESTS, "|1, 2, 4, 8, 16, 32", false),
    ("PRES_qc", [0.0, 17.0], TESTS, "|1, 2, 4, 8, 16, 32", false),
    ("PRES_qc", [0.0, 49.0], TESTS, "|1, 2, 4, 8, 16, 32", false),
    ("PRES_flag", [0.0, 2.0], MIXED, "0, 1, 2, 3", false),
    // Values under a mask (CF conventions 3.5): two bits hold one number.
    ("PRES_qc", [1.0, 2.0], "unknown good bad missing", "0, 1, 2, 3|3, 3, 3, 3", false),
    ("PRES_QC", [1.0, 2.0], "usable unusable", "1, 2", false),
    ("PRES_QC", [1.0, 2.0], "accepted rejected", "1, 2", false),
    ("PRES_QC", [1.0, 2.0], "good not_good", "1, 2", false),
    ("QC_PRES", [1.0, 2.0], "good bad", "1, 2", false),
    ("flag_of_p", [1.0, 2.0], "good bad", "1, 2", true),
    ("PRES_gross", [1.0, 4.0], QARTOD, "1, 2, 3, 4, 9", true),
    ("PRES_qc", [0.0, 1.0], "good bad", "0, 1", true),
];
const CALLED_GOOD: [Flagged; 8] = [
    // Four is good where the file says so; what another variable's flag says is not what this one's test does.
    ("PRES_QC", [4.0, 4.0], "missing bad suspect good", "1, 2, 3, 4", false),
    ("PRES_qc", [0.0, 32.0], TESTS, "|1, 2, 4, 8, 16, 32", false),
    ("PRES_flag", [0.0, 1.0], MIXED, "0, 1, 2, 3", false),
    ("PRES_flag", [0.0, 3.0], MIXED, "0, 1, 2, 3", false),
    ("PRES_flag", [1.0, 1.0], "no_bad_data spike_corrected range_test_passed", "1, 2, 3", false),
    ("PRES_qc", [0.0, 1.0], "unknown good bad missing", "0, 1, 2, 3|3, 3, 3, 3", false),
    // Which tests were made; and results in which 1 says that it was passed (OOI).
    ("PRES_qc_executed", [29.0, 29.0], TESTS, "|1, 2, 4, 8, 16, 32", true),
    ("PRES_qc_results", [29.0, 25.0], TESTS, "|1, 2, 4, 8, 16, 32", true),
];

#[test]
fn regress_flags_of_every_usual_scheme_leave_out_what_they_call_bad() {
    for (k, (flag, [fine, wrong], meanings, numbers, declared)) in CALLED_BAD.iter().chain(&CALLED_GOOD).enumerate() {
        let change = |m: &mut Made| {
            m.flagged(flag, *fine, *wrong);
            let (values, masks) = numbers.split_once('|').unwrap_or((numbers, ""));
            for (attribute, text) in [("flag_meanings", *meanings), ("flag_values", values), ("flag_masks", masks)] {
                if !text.is_empty() {
                    m.says(flag, attribute, text);
                }
            }
            if *declared {
                m.says("PRES", "ancillary_variables", &format!("other,{flag}"));
            }
        };
        let (said, out) =
            if k < CALLED_BAD.len() { (format!("15 of 400 values of PRES left out: {flag}"), BAD.len()) } else { (String::new(), 0) };
        hold(&[(flag, &change, &said, &|got| got.flight.len() == ROWS - out)]);
    }
    let second = |m: &mut Made| {
        m.flagged("PRES_qc", 1.0, 1.0);
        m.set("PRES_qc", "1", |i, v| if (120..128).contains(&i) { 4.0 } else { v });
        m.add("PRES_flag", "1", |i| if (125..135).contains(&i) { 4.0 } else { 1.0 });
    };
    hold(&[
        ("either of two", &second, "8 of 400 values of PRES left out: PRES_qc & 7 of 400 values of PRES left out: PRES_flag", &|got| {
            got.flight.len() == ROWS - 15
        }),
        // An adjusted value without a flag of its own has that of the raw one.
        (
            "adjusted",
            &|m| {
                let raw = m.of("PRES");
                m.add("PRES_ADJUSTED", "dbar", |i| raw[i] - 0.1);
                m.flagged("PRES_QC", 1.0, 4.0);
            },
            "15 of 400 values of PRES_ADJUSTED left out: PRES_QC",
            &|got| got.flight.len() == ROWS - BAD.len(),
        ),
        (
            "of the time",
            &|m| {
                m.add("TIME_QC", "1", |i| if BAD.contains(&i) { 4.0 } else { 1.0 });
                m.set("TIME", SINCE, |i, v| if BAD.contains(&i) { v + 2.0 } else { v });
            },
            "of TIME left out: TIME_QC",
            &|got| got.flight.len() == ROWS - BAD.len(),
        ),
        // What is flagged is not made up from its neighbours; flags may be characters.
        (
            "characters",
            &|m| {
                m.set("TEMP", "degree_C", |i, v| if i == 20 { 99.0 } else { v });
                m.define.push(Box::new(|set| set.add_var_u8("TEMP_QC", &["N_MEASUREMENTS"]).map(|_| ()).expect("a variable")));
                let flags: Vec<u8> = (0..ROWS).map(|i| if i == 20 { b'4' } else { b'1' }).collect();
                m.fill.push(Box::new(move |file| file.write_var_u8("TEMP_QC", &flags).expect("flags")));
            },
            "1 of 400 values of TEMP left out: TEMP_QC",
            &|got| known(&got.flight.temperature_degc) == ROWS - 1,
        ),
    ]);
}

#[test]
fn regress_values_that_cannot_be_are_left_out_and_counted() {
    let water = |got: &Imported| got.flight.density_kg_m3.iter().all(|d| d.is_nan() || (1020.0..1030.0).contains(d));
    for (name, fill) in [("TEMP", -99.0), ("TEMP", 99.0), ("PSAL", -99.0), ("PSAL", 99.0), ("PSAL", 0.0)] {
        let unit = if name == "TEMP" { "degree_C" } else { "1" };
        hold(&[(name, &|m| m.set(name, unit, |i, v| if i % 27 == 3 { fill } else { v }), &format!("values of {name}"), &water)]);
    }
    let packed = |m: &mut Made, fills: usize, range: fn(&mut DataSet)| {
        let stored: Vec<i16> =
            m.of("TEMP").iter().enumerate().map(|(i, v)| if i < fills { 30_000 } else { (v * 100.0).round() as i16 }).collect();
        m.drop("TEMP");
        m.define.push(Box::new(move |set| {
            set.add_var_i16("TEMP", &["N_MEASUREMENTS"]).expect("a variable");
            set.add_var_attr_string("TEMP", "units", "degree_C").expect("a unit");
            set.add_var_attr_f64("TEMP", "scale_factor", vec![0.01]).expect("a factor");
            range(set);
        }));
        m.fill.push(Box::new(move |file| file.write_var_i16("TEMP", &stored).expect("values")));
    };
    let unpacked: fn(&mut DataSet) = |set| set.add_var_attr_i16("TEMP", "valid_range", vec![-2, 40]).map(|_| ()).expect("a range");
    let in_packed: fn(&mut DataSet) = |set| set.add_var_attr_i16("TEMP", "valid_range", vec![-200, 4000]).map(|_| ()).expect("a range");
    let bounds: fn(&mut DataSet) = |set| {
        set.add_var_attr_f32("TEMP", "valid_min", vec![-2.0]).expect("a bound");
        set.add_var_attr_f32("TEMP", "valid_max", vec![40.0]).expect("a bound");
    };
    let said = "is written in unpacked numbers";
    let degrees = |left: usize, as_such: bool| {
        move |got: &Imported| {
            let t = &got.flight.temperature_degc;
            let noted = got.report.notes.iter().any(|n| n.contains("is written in unpacked numbers"));
            known(t) == left && t.iter().all(|v| v.is_nan() || (8.0..12.0).contains(v)) && noted == as_such
        }
    };
    hold(&[
        ("unpacked", &|m| packed(m, 0, unpacked), said, &degrees(ROWS, true)),
        ("unpacked bounds", &|m| packed(m, 0, bounds), said, &degrees(ROWS, true)),
        ("packed", &|m| packed(m, 0, in_packed), "", &degrees(ROWS, false)),
        // Most rows hold one value beyond the range, which as an unpacked one would lie within it.
        ("packed with fills", &|m| packed(m, 300, in_packed), "", &degrees(100, false)),
        // NetCDF's own fill, which nothing declares; one that a text declares.
        ("own", &|m| m.set("PITCH", "degrees", |i, v| if i == 30 { 9.969_209_968_386_869e36 } else { v }), "", &|got| {
            got.flight.pitch_rad.iter().all(|v| v.abs() < 1.0)
        }),
        (
            "text",
            &|m| {
                m.set("TEMP", "degree_C", |i, v| if i == 7 { 9.5 } else { v });
                m.says("TEMP", "missing_value", "9.5");
            },
            "",
            &|got| got.flight.temperature_degc[7].is_nan(),
        ),
    ]);
}

#[test]
fn regress_depth_serves_for_pressure_and_is_compared_with_it() {
    let depth = |m: &mut Made, sign: f64| {
        m.name("PRES", "DEPTH");
        m.set("DEPTH", "m", |_, v| sign * v);
    };
    // 52 m are 52.4 dbar.
    let deep = |got: &Imported| (got.flight.pressure_pa[50] - 52.4e4).abs() < 1e3 && got.flight.pressure_pa.iter().all(|p| *p > 0.0);
    let with = |m: &mut Made, name: &str, unit: &str, factor: f64| {
        let dbar = m.of("PRES");
        m.add(name, unit, |i| factor * dbar[i]);
    };
    let quiet = |got: &Imported| !got.report.notes.iter().any(|n| n.contains("do not agree"));
    // Two minutes afloat before each dive.
    let afloat = |i: usize| if i % 100 < 30 { 0.05 } else { 35.0 - ((i % 100) as f64 - 65.0).abs() };
    let gauge = {
        let mut m = Made::sound();
        m.set("PRES", "dbar", |i, _| afloat(i));
        m.import().expect("gauge").flight
    };
    hold(&[
        ("down", &|m| depth(m, 1.0), "no pressure: computed from DEPTH", &deep),
        ("up", &|m| depth(m, -1.0), "no pressure: computed from DEPTH", &deep),
        ("both", &|m| with(m, "DEPTH", "m", 0.99), "", &quiet),
        ("cm", &|m| with(m, "DEPTH", "m", 99.0), "PRES and DEPTH do not agree", &any),
        (
            "bar",
            &|m| {
                with(m, "DEPTH", "m", 0.99);
                m.set("PRES", "dbar", |_, v| v * 0.1);
            },
            "PRES and DEPTH do not agree",
            &any,
        ),
        (
            "few",
            &|m| {
                with(m, "DEPTH", "m", 0.99);
                m.set("PRES", "dbar", |i, v| if i < 60 { v } else { f64::NAN });
            },
            "PRES has 60 values: DEPTH is taken, which has 400",
            &|got| got.flight.len() == ROWS,
        ),
        (
            "dead",
            &|m| {
                with(m, "eng_depth", "cm", 99.0);
                m.set("PRES", "dbar", |_, _| 0.0);
            },
            "PRES is 0 throughout: eng_depth is taken",
            &|got| got.flight.pressure_pa[50] > 5e5,
        ),
        // Depth is right, pressure has a zero: no unit is wrong.
        (
            "absolute",
            &|m| {
                m.set("PRES", "dbar", |i, _| afloat(i) + 10.13);
                m.add("DEPTH", "m", |i| 0.992 * afloat(i));
            },
            "absolute pressure?",
            &|got| got.flight.segment == gauge.segment && close(&got.flight.density_kg_m3, &gauge.density_kg_m3, 1e-3) && quiet(got),
        ),
        (
            "gaps",
            &|m| m.set("PRES", "dbar", |i, v| if i % 10 == 3 { f64::NAN } else { v }),
            "40 of 400 rows have no PRES: no rows of the flight",
            &|got| got.flight.len() == 360,
        ),
    ]);
}

#[test]
fn regress_channels_that_come_seldom_twice_or_numbered_are_read() {
    let every = |step: usize, v: f64| move |i: usize| if i.is_multiple_of(step) { v } else { f64::NAN };
    let numbered = |numbers: [f64; 4]| move |m: &mut Made| m.add("SEGMENT_NUMBER", "1", |i| numbers[i / 100]);
    let dives = |count: usize| move |got: &Imported| (got.report.segments.len(), got.flight.segment[ROWS - 1]) == (count, count as u32 - 1);
    let eras = |weeks: f64| {
        move |m: &mut Made| {
            m.add("gps_time", SINCE, |i| 4.0 * i as f64 - weeks * 604_800.0);
            for (name, unit, deg) in [("LATITUDE_GPS", "degrees_north", 54.0), ("LONGITUDE_GPS", "degrees_east", 15.0)] {
                m.add(name, unit, |i| if i < 3 || i + 3 > ROWS { deg } else { f64::NAN });
                m.says(name, "coordinates", "gps_time");
            }
        }
    };
    let origin = |got: &Imported| got.report.origins.first().is_some_and(|o| (o.unix_s - START).abs() < 1e-6 && o.lat_deg == 54.0);
    hold(&[
        (
            "seldom",
            &|m| m.set("PITCH", "degrees", |i, v| if i % 30 == 0 { v } else { f64::NAN }),
            "pitch comes every 120 s only: interpolated",
            &any,
        ),
        // On the rows' own clock what was left out stays out.
        ("speed", &|m| m.add("SPEED_WATER", "m s-1", every(10, 0.3)), "", &|got| got.flight.speed_m_s.as_deref().map(known) == Some(40)),
        (
            "density",
            &|m| {
                m.drop("PSAL");
                m.add("DENSITY", "kg m-3", every(10, 1025.0));
            },
            "",
            &|got| known(&got.flight.density_kg_m3) == 40,
        ),
        (
            "pump",
            &|m| {
                m.add("m_ballast_pumped", "cc", |_| 0.0);
                m.add("m_de_oil_vol", "cc", |i| if i % 100 < 50 { -250.0 } else { 250.0 });
            },
            "m_ballast_pumped is 0 throughout: m_de_oil_vol is taken",
            &|got| (got.flight.ballast_m3[10] + 250e-6).abs() < 1e-12,
        ),
        // Numbers of dives that go back stay apart; halves of a dive are one.
        ("back", &numbered([5.0, 1.0, 2.0, 3.0]), "segments are what SEGMENT_NUMBER numbers", &dives(4)),
        ("again", &numbered([1.0, 2.0, 1.0, 2.0]), "", &dives(4)),
        ("halves", &numbered([1.0, 1.5, 2.0, 2.5]), "", &dives(2)),
        ("fixes", &eras(0.0), "4 of 5 GPS fixes lie below 3 dbar", &origin),
        ("weeks", &eras(1024.0), "5 GPS fixes are 1024 weeks off", &origin),
        (
            "two",
            &|m| m.add("trajectory", "1", |i| if i < 200 { 1.0 } else { 2.0 }),
            "!2 deployments (trajectory: 1, 2): import one at a time",
            &any,
        ),
        ("one", &|m| m.add("trajectory", "1", |_| 1.0), "", &whole),
    ]);
}

#[test]
fn regress_files_whose_ids_name_two_gliders_are_refused() {
    let with_ids = |name: &str, ids: [&'static str; 2]| {
        let folder = std::env::temp_dir().join(format!("glider-ids-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        for (file, id) in ids.into_iter().enumerate() {
            let mut m = Made::sound();
            m.set("TIME", SINCE, |_, v| v + 3600.0 * file as f64);
            m.define.push(Box::new(move |set| set.add_global_attr_string("id", id).map(|_| ()).expect("an attribute")));
            m.write(&folder.join(format!("{file}.nc")));
        }
        let got = crate::import::import(&folder, &[]).map_err(|e| e.to_string());
        std::fs::remove_dir_all(&folder).expect("removed");
        got
    };
    let error = with_ids("two", ["unit_777-20200101T0000", "unit_888-20200101T0100"]).expect_err("two gliders");
    assert!(error.contains("of 2 gliders (id: unit_777, unit_888)"), "{error}");
    for (name, ids) in [
        ("profiles", ["unit_777-20200101T0000", "unit_777-20200101T0100"]),
        ("counted", ["ru29_0001-20200101T0000", "ru29_0002-20200101T0100"]),
        ("of files", ["a1b2c3", "d4e5f6"]),
    ] {
        assert_eq!(with_ids(name, ids).unwrap_or_else(|e| panic!("{name}: {e}")).flight.len(), 2 * ROWS);
    }
}

#[test]
fn the_own_table_of_channels_of_a_lab_is_read() {
    let folder = std::env::temp_dir().join(format!("glider-lab-table-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let mut m = Made::sound();
    m.add("pump", "strokes", |i| if i % 100 < 50 { -100.0 } else { 100.0 });
    m.write(&folder.join("log.nc"));
    let lab = "[units]\nvolume = [[2e-6, 0, [\"strokes\"]]]\n[ballast]\nnames = [\"pump\"]\n";
    std::fs::write(folder.join("channels.toml"), lab).expect("written");
    let got = crate::import::import(&folder, &[]).expect("reads");
    std::fs::write(folder.join("channels.toml"), "[balast]\n").expect("written");
    let refused = crate::import::import(&folder, &[]).expect_err("no channel").to_string();
    std::fs::remove_dir_all(&folder).expect("removed");
    assert!((got.flight.ballast_m3[10] + 2e-4).abs() < 1e-12, "{:?}", got.report);
    assert!(refused.contains("channels.toml") && !refused.contains('\n'), "{refused}");
}

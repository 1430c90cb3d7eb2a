//! Quirks of other people's files: each a row with its change to a sound file, what is said of it, and what its flight is like then.

use netcdf3::{DataSet, FileWriter, Version};

use super::Imported;
use crate::record::flight::Flight;

const ROWS: usize = 400;
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// The date from which the sound file counts, Unix s.
const START: f64 = 1_577_836_800.0;
const SINCE: &str = "seconds since 2020-01-01T00:00:00Z";
/// Rows that flags call bad.
const BAD: std::ops::Range<usize> = 120..135;

/// A file in the making: name, unit, values of its variables; text attributes; and what else is defined and written.
struct Made {
    columns: Vec<(String, String, Vec<f64>)>,
    attributes: Vec<(String, String, String)>,
    define: Vec<Box<dyn Fn(&mut DataSet)>>,
    fill: Vec<Box<dyn Fn(&mut FileWriter)>>,
}

impl Made {
    /// Saw-teeth between 2 and 52 dbar, 4 s apart.
    fn sound() -> Self {
        let mut m = Self { columns: Vec::new(), attributes: Vec::new(), define: Vec::new(), fill: Vec::new() };
        let down = |i: usize| if i % 100 < 50 { 1.0 } else { -1.0 };
        m.add("TIME", SINCE, |i| 4.0 * i as f64);
        m.add("PRES", "dbar", |i| 2.0 + 50.0 * (1.0 - ((i % 100) as f64 / 50.0 - 1.0).abs()));
        m.add("PITCH", "degrees", |i| -25.0 * down(i));
        m.add("HEADING", "degrees", |i| 40.0 + (0.1 * i as f64).sin());
        m.add("TEMP", "degree_C", |i| 10.0 + (0.01 * i as f64).sin());
        m.add("PSAL", "1", |_| 35.0);
        m
    }

    fn add(&mut self, name: &str, unit: &str, f: impl Fn(usize) -> f64) {
        self.columns.push((name.into(), unit.into(), (0..ROWS).map(f).collect()));
    }

    /// Other values and another unit of a variable.
    fn set(&mut self, name: &str, unit: &str, f: impl Fn(usize, f64) -> f64) {
        for (_, u, values) in self.columns.iter_mut().filter(|c| c.0 == name) {
            *u = unit.into();
            *values = values.iter().enumerate().map(|(i, v)| f(i, *v)).collect();
        }
    }

    fn name(&mut self, from: &str, to: &str) {
        self.columns.iter_mut().filter(|c| c.0 == from).for_each(|c| c.0 = to.into());
    }

    fn drop(&mut self, name: &str) {
        self.columns.retain(|c| c.0 != name);
    }

    fn of(&self, name: &str) -> Vec<f64> {
        self.columns.iter().find(|c| c.0 == name).map_or_else(Vec::new, |c| c.2.clone())
    }

    fn says(&mut self, variable: &str, attribute: &str, text: &str) {
        self.attributes.push((variable.into(), attribute.into(), text.into()));
    }

    /// A pressure 30 dbar too high in the bad rows, which a flag calls `bad` and the others `good`.
    fn flagged(&mut self, name: &str, good: f64, bad: f64) {
        self.set("PRES", "dbar", |i, v| if BAD.contains(&i) { v + 30.0 } else { v });
        self.add(name, "1", |i| if BAD.contains(&i) { bad } else { good });
    }

    fn import(&self) -> Result<Imported, String> {
        let unique = std::thread::current().name().unwrap_or("one").replace("::", "-");
        let path = std::env::temp_dir().join(format!("glider-quirk-{}-{unique}.nc", std::process::id()));
        self.write(&path);
        let imported = crate::import::import(&path, &[]).map_err(|e| e.to_string());
        std::fs::remove_file(&path).expect("removed");
        imported
    }

    fn write(&self, path: &std::path::Path) {
        let mut set = DataSet::new();
        set.add_fixed_dim("N_MEASUREMENTS", ROWS).expect("a dimension");
        for (name, unit, _) in &self.columns {
            set.add_var_f64(name, &["N_MEASUREMENTS"]).expect("a variable");
            set.add_var_attr_string(name, "units", unit).expect("a unit");
        }
        self.define.iter().for_each(|define| define(&mut set));
        for (variable, name, text) in &self.attributes {
            set.add_var_attr_string(variable, name, text).expect("an attribute");
        }
        let mut file = FileWriter::open(path).expect("a file");
        file.set_def(&set, Version::Classic, 0).expect("a definition");
        self.columns.iter().for_each(|(name, _, values)| file.write_var_f64(name, values).expect("values"));
        self.fill.iter().for_each(|fill| fill(&mut file));
        file.close().expect("closed");
    }
}

/// Name, change to the sound file, what is said of it (with a ! it is refused; parted by &), and what its flight is like.
type Quirk<'a> = (&'a str, &'a dyn Fn(&mut Made), &'a str, &'a dyn Fn(&Imported) -> bool);

fn hold(quirks: &[Quirk]) {
    for (name, change, said, flight) in quirks {
        let mut made = Made::sound();
        change(&mut made);
        match (made.import(), said.strip_prefix('!')) {
            (Err(e), Some(why)) => assert!(e.contains(why) && !e.contains('\n'), "{name}: {e}"),
            (Ok(got), None) => {
                let all = got.report.notes.iter().chain(&got.report.left_out).cloned().collect::<Vec<_>>().join("\n");
                assert!(said.split(" & ").all(|what| all.contains(what)), "{name}: not said: {said}\n{all}");
                assert!(flight(&got), "{name}: {all}");
            }
            (got, _) => panic!("{name}: {:?}", got.map(|g| g.report)),
        }
    }
}

fn sound() -> Flight {
    Made::sound().import().expect("reads").flight
}

fn close(a: &[f64], b: &[f64], by: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= by || (a.is_nan() && b.is_nan()))
}

fn known(values: &[f64]) -> usize {
    values.iter().filter(|v| v.is_finite()).count()
}

fn any(_: &Imported) -> bool {
    true
}

fn whole(got: &Imported) -> bool {
    got.flight.len() == ROWS && got.report.is_whole()
}

#[test]
fn regress_clocks_of_other_files_are_read_or_named() {
    let start = |unix: f64| move |got: &Imported| got.report.start_unix_s == Some(unix) && got.flight.len() == ROWS;
    let pst = "seconds since 2020-01-01 00:00:00 PST";
    let pairs = |m: &mut Made, of_two: bool| {
        for (name, _, values) in &mut m.columns {
            let of_vehicle = ["PITCH", "HEADING"].contains(&name.as_str());
            let lacks = |i: usize| of_two && name != "TIME" && i.is_multiple_of(2) != of_vehicle;
            let all = values.clone();
            *values = (0..ROWS).map(|i| if lacks(i) { f64::NAN } else { all[i - i % 2] }).collect();
        }
    };
    let want = sound();
    let halved = |got: &Imported| {
        let every = |v: &[f64]| v.iter().step_by(2).copied().collect::<Vec<f64>>();
        let f = &got.flight;
        let alike = [(&f.time_s, &want.time_s), (&f.pressure_pa, &want.pressure_pa), (&f.pitch_rad, &want.pitch_rad)];
        alike.iter().all(|(a, b)| close(a, &every(b), 1e-6))
    };
    hold(&[
        ("ns", &|m| m.set("TIME", "nanoseconds since 2020-01-01 00:00:00", |_, v| v * 1e9), "", &start(START)),
        ("unit", &|m| m.set("TIME", "fortnights since 2020-01-01", |_, v| v), "!TIME counts \"fortnights since 2020-01-01\"", &any),
        ("zone", &|m| m.set("TIME", "seconds since 1970-01-01 00:00:00 -6:00", |_, v| v), "", &start(21_600.0)),
        ("named zone", &|m| m.set("TIME", "seconds since 2020-01-01 00:00:00 CEST", |_, v| v), "", &start(START - 7200.0)),
        ("CST", &|m| m.set("TIME", "seconds since 2020-01-01 00:00:00 CST", |_, v| v), "!the zone CST stands for several", &any),
        ("PST", &|m| m.set("TIME", pst, |_, v| v), "!TIME counts", &any),
        ("no origin", &|m| m.set("TIME", "s", |_, v| v), "!`seconds since DATE` is needed", &any),
        ("Unix", &|m| m.set("TIME", "s", |_, v| v + START), "taken as seconds since 1970", &start(START)),
        ("calendar", &|m| m.says("TIME", "calendar", "noleap"), "!calendar \"noleap\"", &any),
        ("no time", &|m| m.set("TIME", SINCE, |i, v| if i == 40 { -9.223_372e9 } else { v }), "", &|got| got.flight.len() == ROWS - 1),
        ("none", &|m| m.set("TIME", "seconds since 1970-01-01", |_, _| f64::NAN), "!TIME has no time between", &any),
        ("ms", &|m| m.set("TIME", "seconds since 1970-01-01", |_, v| v * 1e-3), "!usual step of time", &any),
        ("one back", &|m| m.set("TIME", SINCE, |i, v| if i == 100 { v + 900.0 } else { v }), "1 of 400 samples are out of order", &|got| {
            got.flight.len() == ROWS - 1
        }),
        (
            "set back",
            &|m| m.set("TIME", SINCE, |i, v| if i > 300 { v - 500.0 } else { v }),
            "!time goes backwards, 99 of 400 samples are out of order, first from 1577838000.000 to 1577837504.000 s at sample 302",
            &any,
        ),
        (
            "last",
            &|m| m.set("TIME", SINCE, |i, v| if i + 1 == ROWS { v + 1e6 } else { v }),
            "1 of 400 values of PRES stand alone days off the others",
            &|got| got.flight.len() == ROWS - 1,
        ),
        // Begun 40 s after a minute: the first minute has five rows.
        ("minutes", &|m| m.set("TIME", "minutes since 2020-01-01", |i, _| ((4 * i + 40) / 60) as f64), "", &|got| {
            close(&got.flight.time_s, &(0..ROWS).map(|i| 4.0 * i as f64).collect::<Vec<_>>(), 4.0)
        }),
        // The attitude an hour after the pressure.
        (
            "apart",
            &|m| {
                m.add("TIME_NAV", SINCE, |i| 36_000.0 + 4.0 * i as f64);
                m.says("PITCH", "coordinates", "TIME_NAV");
            },
            "pitch runs on another clock than PRES: +36000 s",
            &|got| !got.report.is_whole(),
        ),
        // A row of the vehicle and one of the CTD at each time; each row twice; of a clock of 8 s the rows differ.
        ("pairs", &|m| pairs(m, true), "the values of one time are one row", &halved),
        ("twice", &|m| pairs(m, false), "the values of one time are one row", &halved),
        ("coarse", &|m| m.set("TIME", SINCE, |i, v| v - 4.0 * (i % 2) as f64), "spread evenly", &|got| got.flight.len() == ROWS),
        // The pitch of the sixth row is that of the vehicle's clock then.
        (
            "science",
            &|m| {
                let late = m.of("TIME");
                for (from, to) in
                    [("TIME", "m_present_time"), ("PRES", "sci_water_pressure"), ("TEMP", "sci_water_temp"), ("PITCH", "m_pitch")]
                {
                    m.name(from, to);
                }
                m.add("sci_m_present_time", SINCE, |i| late[i] + 20.0);
            },
            "",
            &|got| {
                let pitch = &got.flight.pitch_rad;
                got.report.start_unix_s == Some(START + 20.0) && (pitch[45] - 25.0 * DEGREE).abs() < 1e-9 && pitch[44] < 0.0
            },
        ),
    ]);
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
        let days = |m: &mut Made| m.set("TIME", unit, |_, v| first + v / 86_400.0);
        let right = |got: &Imported| got.report.start_unix_s.is_some_and(|t| (t - 946_857_600.0).abs() < 1e-3);
        let proleptic = |m: &mut Made| {
            days(m);
            m.says("TIME", "calendar", "proleptic_gregorian");
        };
        let of_proleptic = if unit.contains("11-24") { "read as Julian days" } else { "!-4713-11-24" };
        hold(&[(unit, &days, "read as Julian days", &right), (unit, &proleptic, of_proleptic, &right)]);
    }
}

#[test]
fn regress_times_that_are_texts_are_read_as_dates() {
    let texts = |m: &mut Made, width: usize, unit: &'static str, time: &dyn Fn(u32) -> String| {
        m.drop("TIME");
        let texts: String = (0..ROWS as u32).map(|i| format!("{:\0<width$}", time(4 * i))).collect();
        m.define.push(Box::new(move |set| {
            set.add_fixed_dim("STRING", width).expect("a dimension");
            set.add_var_u8("TIME", &["N_MEASUREMENTS", "STRING"]).expect("a variable");
            set.add_var_attr_string("TIME", "units", unit).expect("a unit");
        }));
        m.fill.push(Box::new(move |file| file.write_var_u8("TIME", texts.as_bytes()).expect("texts")));
    };
    let clock = |s: u32| format!("{:02}:{:02}:{:02}", 8 + s / 3600, s / 60 % 60, s % 60);
    let iso = |end: &'static str| move |s: u32| format!("2013-04-02T{}{end}", clock(s));
    let at = |unix: f64| move |got: &Imported| got.report.start_unix_s == Some(unix) && whole(got) && got.flight.time_s[399] == 1596.0;
    let said = "TIME is written in texts: read as dates";
    hold(&[
        ("Z", &|m| texts(m, 20, "", &iso("Z")), said, &at(1_364_889_600.0)),
        ("ISO", &|m| texts(m, 24, "ISO8601", &iso("Z")), said, &at(1_364_889_600.0)),
        ("UTC", &|m| texts(m, 32, "UTC", &iso(" UTC")), said, &at(1_364_889_600.0)),
        ("+00", &|m| texts(m, 27, "1", &iso("+00:00")), said, &at(1_364_889_600.0)),
        ("bare", &|m| texts(m, 19, "", &iso("")), said, &at(1_364_889_600.0)),
        ("CEST", &|m| texts(m, 24, "", &|s| format!("2013-04-02 {} CEST", clock(s))), said, &at(1_364_882_400.0)),
        ("one missing", &|m| texts(m, 20, "", &|s| if s == 40 { String::new() } else { iso("Z")(s) }), said, &|got| {
            got.flight.len() == ROWS - 1 && !got.report.is_whole()
        }),
        ("CST", &|m| texts(m, 24, "", &|_| "2013-04-02 08:00:00 CST".into()), "!the zone CST stands for several", &any),
        ("either", &|m| texts(m, 24, "", &|_| "02/04/2013 08:00".into()), "!dd/mm/yyyy or mm/dd/yyyy", &any),
    ]);
}

#[test]
fn regress_flags_of_every_usual_scheme_leave_out_what_they_call_bad() {
    const QARTOD: &str = "PASS NOT_EVALUATED SUSPECT FAIL MISSING";
    const CODES: &str = "no_quality_control good_value probably_good probably_bad bad_value";
    const TESTS: &str = "gross_range_test local_range_test spike_test stuck_value_test gradient_test propagate_flags";
    const MIXED: &str = "no_bad_data interpolated spike suspect_gradient";
    /// Name of the flag; good and bad value; meanings with their values or, behind a |, masks; whether another attribute declares it.
    type Flagged = (&'static str, [f64; 2], &'static str, &'static str, bool);
    let bad: [Flagged; 19] = [
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
    let good: [Flagged; 8] = [
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
    for (k, (flag, [fine, wrong], meanings, numbers, declared)) in bad.iter().chain(&good).enumerate() {
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
            if k < bad.len() { (format!("15 of 400 values of PRES left out: {flag}"), BAD.len()) } else { (String::new(), 0) };
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
                m.define.push(Box::new(|set| _ = set.add_var_u8("TEMP_QC", &["N_MEASUREMENTS"]).expect("a variable")));
                let flags: Vec<u8> = (0..ROWS).map(|i| if i == 20 { b'4' } else { b'1' }).collect();
                m.fill.push(Box::new(move |file| file.write_var_u8("TEMP_QC", &flags).expect("flags")));
            },
            "1 of 400 values of TEMP left out: TEMP_QC",
            &|got| known(&got.flight.temperature_degc) == ROWS - 1,
        ),
    ]);
}

#[test]
fn regress_units_of_other_files_are_read() {
    let want = sound();
    let same = |got: &Imported| {
        let f = &got.flight;
        let columns = f.columns().into_iter().zip(want.columns());
        columns.into_iter().all(|(a, b)| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-6 * b.abs() || b.is_nan()))
    };
    for (name, unit, factor, offset, said) in [
        ("PRES", "psi", 1.450_377, 0.0, ""),
        ("PRES", "MPa", 0.01, 0.0, ""),
        ("PRES", "mbar", 100.0, 0.0, ""),
        ("PRES", "hPa", 100.0, 0.0, ""),
        ("TEMP", "K", 1.0, 273.15, ""),
        ("TEMP", "kelvin", 1.0, 273.15, ""),
        ("TEMP", "degF", 1.8, 32.0, ""),
        ("TEMP", "degrees Celsius", 1.0, 0.0, ""),
        ("PITCH", "radians", DEGREE, 0.0, ""),
        ("PITCH", "degrees", DEGREE, 0.0, "PITCH states degrees but its values are radians"),
        ("PITCH", "", DEGREE, 0.0, "PITCH states no unit"),
        ("PITCH", "", 1.0, 0.0, "taken as degrees by the size of the pitch"),
    ] {
        hold(&[(unit, &|m| m.set(name, unit, |_, v| v * factor + offset), said, &same)]);
    }
    let heading = |got: &Imported| close(&got.flight.heading_rad, &want.heading_rad, 1e-9);
    let roll = |m: &mut Made, f: &dyn Fn(usize) -> f64| m.add("ROLL", "degrees", f);
    hold(&[
        (
            "both",
            &|m| ["PITCH", "HEADING"].iter().for_each(|name| m.set(name, "degrees", |_, v| v * DEGREE)),
            "HEADING states degrees",
            &|got| heading(got) && got.report.mapped.iter().any(|m| m.from == "PITCH" && m.factor == 1.0),
        ),
        // A roll of a degree is no radian; nor is one beside a pitch that was not measured.
        (
            "roll",
            &|m| {
                m.set("PITCH", "degrees", |_, v| v * DEGREE);
                roll(m, &|i| 1.0 + 0.4 * (0.3 * i as f64).sin());
            },
            "",
            &|got| got.flight.roll_rad.iter().all(|r| r.abs() < 2.0 * DEGREE),
        ),
        (
            "level",
            &|m| {
                m.set("PITCH", "degrees", |_, _| 0.0);
                roll(m, &|_| 0.8);
            },
            "",
            &|got| (got.flight.roll_rad[3] - 0.8 * DEGREE).abs() < 1e-9,
        ),
        ("unknown", &|m| m.set("TEMP", "furlongs", |_, v| v), "TEMP is in \"furlongs\"", &|got| !got.report.is_whole()),
        ("PRES x 1000", &|m| m.set("PRES", "dbar", |_, v| v * 1e3), "!pressure reaches", &any),
        ("PRES / 1000", &|m| m.set("PRES", "dbar", |_, v| v * 1e-3), "!pressure never exceeds", &any),
        ("PITCH x 1000", &|m| m.set("PITCH", "degrees", |_, v| v * 1e3), "!pitch reaches", &any),
        ("TEMP x 1000", &|m| m.set("TEMP", "degree_C", |_, v| v * 1e3), "!temperature is", &any),
        ("no PRES", &|m| m.set("PRES", "dbar", |_, _| f64::NAN), "!PRES has no value", &any),
        ("HEADING x 1000", &|m| m.set("HEADING", "degrees", |_, v| v * 1e3), "HEADING reaches", &|got| known(&got.flight.heading_rad) == 0),
        ("no PITCH", &|m| m.set("PITCH", "degrees", |_, _| f64::NAN), "a comparison needs m_pitch_rad and m_ballast_pumped_cc", &any),
        ("nose", &|m| m.set("PITCH", "degrees", |_, v| -v), "the nose is up in 100 % of the rows that sink", &any),
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
    let unpacked: fn(&mut DataSet) = |set| _ = set.add_var_attr_i16("TEMP", "valid_range", vec![-2, 40]).expect("a range");
    let in_packed: fn(&mut DataSet) = |set| _ = set.add_var_attr_i16("TEMP", "valid_range", vec![-200, 4000]).expect("a range");
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
fn regress_channels_that_are_seldom_twice_or_numbered_are_taken_as_they_are() {
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
            m.define.push(Box::new(move |set| _ = set.add_global_attr_string("id", id).expect("an attribute")));
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
fn a_labs_own_table_of_channels_is_read_beside_its_log() {
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

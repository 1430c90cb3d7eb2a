//! Quirks of other people's files: each a row with its change to a sound file, what is said of it, and what its flight is like then.

use netcdf3::{DataSet, FileWriter, Version};

use super::Imported;
use crate::record::flight::Flight;

pub(super) const ROWS: usize = 400;
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// The date from which the sound file counts, Unix s.
pub(super) const START: f64 = 1_577_836_800.0;
pub(super) const SINCE: &str = "seconds since 2020-01-01T00:00:00Z";
/// Rows that flags call bad.
pub(super) const BAD: std::ops::Range<usize> = 120..135;

type Define = Box<dyn Fn(&mut DataSet)>;
type Fill = Box<dyn Fn(&mut FileWriter)>;

/// A file in the making: name, unit, values of its variables; text attributes; and what else is defined and written.
pub(super) struct Made {
    pub columns: Vec<(String, String, Vec<f64>)>,
    pub attributes: Vec<(String, String, String)>,
    pub define: Vec<Define>,
    pub fill: Vec<Fill>,
}

impl Made {
    /// Saw-teeth between 2 and 52 dbar, 4 s apart.
    pub fn sound() -> Self {
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

    pub fn add(&mut self, name: &str, unit: &str, f: impl Fn(usize) -> f64) {
        self.columns.push((name.into(), unit.into(), (0..ROWS).map(f).collect()));
    }

    /// Other values and another unit of a variable.
    pub fn set(&mut self, name: &str, unit: &str, f: impl Fn(usize, f64) -> f64) {
        for (_, u, values) in self.columns.iter_mut().filter(|c| c.0 == name) {
            *u = unit.into();
            *values = values.iter().enumerate().map(|(i, v)| f(i, *v)).collect();
        }
    }

    pub fn name(&mut self, from: &str, to: &str) {
        self.columns.iter_mut().filter(|c| c.0 == from).for_each(|c| c.0 = to.into());
    }

    pub fn drop(&mut self, name: &str) {
        self.columns.retain(|c| c.0 != name);
    }

    pub fn of(&self, name: &str) -> Vec<f64> {
        self.columns.iter().find(|c| c.0 == name).map_or_else(Vec::new, |c| c.2.clone())
    }

    pub fn says(&mut self, variable: &str, attribute: &str, text: &str) {
        self.attributes.push((variable.into(), attribute.into(), text.into()));
    }

    /// A pressure 30 dbar too high in the bad rows, which a flag calls `bad` and the others `good`.
    pub fn flagged(&mut self, name: &str, good: f64, bad: f64) {
        self.set("PRES", "dbar", |i, v| if BAD.contains(&i) { v + 30.0 } else { v });
        self.add(name, "1", |i| if BAD.contains(&i) { bad } else { good });
    }

    pub fn import(&self) -> Result<Imported, String> {
        let unique = std::thread::current().name().unwrap_or("one").replace("::", "-");
        let path = std::env::temp_dir().join(format!("glider-quirk-{}-{unique}.nc", std::process::id()));
        self.write(&path);
        let imported = crate::import::import(&path, &[]).map_err(|e| e.to_string());
        std::fs::remove_file(&path).expect("removed");
        imported
    }

    pub fn write(&self, path: &std::path::Path) {
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

pub(super) fn hold(quirks: &[Quirk]) {
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

pub(super) fn close(a: &[f64], b: &[f64], by: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= by || (a.is_nan() && b.is_nan()))
}

pub(super) fn known(values: &[f64]) -> usize {
    values.iter().filter(|v| v.is_finite()).count()
}

pub(super) fn any(_: &Imported) -> bool {
    true
}

pub(super) fn whole(got: &Imported) -> bool {
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

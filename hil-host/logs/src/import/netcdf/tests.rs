//! Small files written here, each with a quirk that files of real gliders have.

const DEGREE: f64 = std::f64::consts::PI / 180.0;
use super::*;
use netcdf3::{DataSet, FileWriter, Version};

pub(super) const ROWS: usize = 400;

/// A variable: name, unit, values.
pub(super) type Column = (&'static str, &'static str, Vec<f64>);

/// Saw-teeth between 2 and 52 dbar, 4 s apart.
pub(super) fn sawtooth() -> Vec<Column> {
    let column = |f: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
        (0..ROWS)
            .map(|i| {
                let x = (i % 100) as f64 / 50.0;
                f(i as f64, if x < 1.0 { 1.0 } else { -1.0 }) + 0.0 * x
            })
            .collect()
    };
    let depth = (0..ROWS).map(|i| 2.0 + 50.0 * (1.0 - ((i % 100) as f64 / 50.0 - 1.0).abs())).collect();
    vec![
        ("TIME", "seconds since 2020-01-01T00:00:00Z", column(&|i, _| 4.0 * i)),
        ("PRES", "dbar", depth),
        ("PITCH", "degrees", column(&|_, down| -25.0 * down)),
        ("HEADING", "degrees", column(&|i, _| 40.0 + (0.1 * i).sin())),
        ("TEMP", "degree_C", column(&|i, _| 10.0 + (0.01 * i).sin())),
        ("PSAL", "1", column(&|_, _| 35.0)),
    ]
}

pub(super) fn change(columns: &mut [Column], name: &str, unit: &'static str, f: impl Fn(usize, f64) -> f64) {
    for (_, u, values) in columns.iter_mut().filter(|c| c.0 == name) {
        *u = unit;
        *values = values.iter().enumerate().map(|(i, v)| f(i, *v)).collect();
    }
}

/// A text attribute: variable, name, text.
pub(super) type Attribute = (&'static str, &'static str, &'static str);

/// Writes and imports; `flags` are characters beside the temperature.
pub(super) fn imported(columns: &[Column], flags: Option<&str>) -> Result<Imported, String> {
    written(columns, flags, &[])
}

/// The same with further attributes.
pub(super) fn written(columns: &[Column], flags: Option<&str>, attributes: &[Attribute]) -> Result<Imported, String> {
    let define = |set: &mut DataSet| {
        for (variable, name, text) in attributes {
            set.add_var_attr_string(variable, name, text).expect("an attribute");
        }
        if flags.is_some() {
            set.add_var_u8("TEMP_QC", &["N_MEASUREMENTS"]).expect("a variable");
        }
    };
    with_more(columns, define, |file| {
        if let Some(flags) = flags {
            file.write_var_u8("TEMP_QC", flags.as_bytes()).expect("flags");
        }
    })
}

/// Columns, and what `define` and `fill` add to them.
pub(super) fn with_more(
    columns: &[Column],
    define: impl FnOnce(&mut DataSet),
    fill: impl FnOnce(&mut FileWriter),
) -> Result<Imported, String> {
    let mut set = DataSet::new();
    set.add_fixed_dim("N_MEASUREMENTS", ROWS).expect("a dimension");
    for (name, unit, _) in columns {
        set.add_var_f64(name, &["N_MEASUREMENTS"]).expect("a variable");
        set.add_var_attr_string(name, "units", unit).expect("a unit");
    }
    define(&mut set);
    let unique = std::thread::current().name().unwrap_or("one").replace("::", "-");
    let path = std::env::temp_dir().join(format!("glider-quirk-{}-{unique}.nc", std::process::id()));
    let mut file = FileWriter::open(&path).expect("a file");
    file.set_def(&set, Version::Classic, 0).expect("a definition");
    for (name, _, values) in columns {
        file.write_var_f64(name, values).expect("values");
    }
    fill(&mut file);
    file.close().expect("closed");
    let imported = crate::import::import(&path, &[]).map_err(|e| e.to_string());
    std::fs::remove_file(&path).expect("removed");
    imported
}

pub(super) fn has_note(imported: &Imported, what: &str) -> bool {
    imported.report.notes.iter().chain(&imported.report.left_out).any(|n| n.contains(what))
}

#[test]
fn degrees_that_are_radians_are_taken_as_radians_and_degrees_as_degrees() {
    let sound = imported(&sawtooth(), None).expect("an import");
    assert!((sound.flight.pitch_rad[10] + 25.0 * DEGREE).abs() < 1e-12 && (sound.flight.heading_rad[0] - 40.0 * DEGREE).abs() < 1e-9);
    assert!(!has_note(&sound, "radians"));
    let mut columns = sawtooth();
    change(&mut columns, "PITCH", "degrees", |_, v| v * DEGREE);
    change(&mut columns, "HEADING", "degrees", |_, v| v * DEGREE);
    let mended = imported(&columns, None).expect("an import");
    assert!(has_note(&mended, "PITCH states degrees but its values are radians") && has_note(&mended, "HEADING states degrees"));
    for (a, b) in sound.flight.pitch_rad.iter().zip(&mended.flight.pitch_rad) {
        assert!((a - b).abs() < 1e-12);
    }
    assert!((mended.flight.heading_rad[7] - sound.flight.heading_rad[7]).abs() < 1e-9);
    assert_eq!(mended.report.mapped.iter().find(|m| m.from == "PITCH").map(|m| m.factor), Some(1.0));
}

#[test]
fn depth_serves_for_pressure_up_or_down_positive() {
    let mut down = sawtooth();
    down[1].0 = "DEPTH";
    down[1].1 = "m";
    let mut up = down.clone();
    change(&mut up, "DEPTH", "m", |_, v| -v);
    let (down, up) = (imported(&down, None).expect("an import"), imported(&up, None).expect("an import"));
    assert_eq!(down.flight.pressure_pa, up.flight.pressure_pa);
    // 52 m are 52.4 dbar.
    assert!((down.flight.pressure_pa[50] - 52.4e4).abs() < 0.1e4, "{}", down.flight.pressure_pa[50]);
    assert!(has_note(&down, "no pressure: computed from DEPTH"));
}

#[test]
fn a_depth_that_contradicts_the_pressure_is_reported() {
    let mut columns = sawtooth();
    let depth = columns[1].2.iter().map(|p| p * 100.0).collect();
    columns.push(("DEPTH", "m", depth));
    assert!(has_note(&imported(&columns, None).expect("an import"), "PRES and DEPTH do not agree"));
}

#[test]
fn flagged_values_fills_and_times_without_date_are_left_out() {
    let flags: String = (0..ROWS).map(|i| if i == 20 { '4' } else { '1' }).collect();
    let mut columns = sawtooth();
    change(&mut columns, "TEMP", "degree_C", |i, v| if i == 20 { 99.0 } else { v });
    // Never written: NetCDF's own fill, which nothing declares.
    change(&mut columns, "PITCH", "degrees", |i, v| if i == 30 { 9.969_209_968_386_869e36 } else { v });
    // pandas' "not a time" in seconds.
    change(&mut columns, "TIME", "seconds since 2020-01-01T00:00:00Z", |i, v| if i == 40 { -9.223_372e9 } else { v });
    let read = imported(&columns, Some(&flags)).expect("an import");
    assert_eq!(read.flight.len(), ROWS - 1);
    assert!(read.flight.temperature_degc.iter().chain(&read.flight.pitch_rad).all(|v| v.is_nan() || v.abs() < 50.0));
    // What is flagged is not made up from its neighbours.
    assert_eq!(read.flight.temperature_degc.iter().filter(|v| v.is_nan()).count(), 1);
    assert!(has_note(&read, "1 of 400 values of TEMP left out: TEMP_QC"), "{:?}", read.report.notes);
}

#[test]
fn nanoseconds_are_time_and_unknown_clocks_are_named() {
    let mut columns = sawtooth();
    change(&mut columns, "TIME", "nanoseconds since 2020-01-01 00:00:00", |_, v| v * 1e9);
    let read = imported(&columns, None).expect("an import");
    assert!((read.flight.time_s[399] - 1596.0).abs() < 1e-3 && read.report.start_unix_s == Some(1_577_836_800.0));
    change(&mut columns, "TIME", "fortnights since 2020-01-01", |_, v| v);
    let error = imported(&columns, None).expect_err("no clock");
    assert!(error.contains("TIME counts \"fortnights since 2020-01-01\""), "{error}");
}

#[test]
fn time_that_goes_backwards_loses_a_sample_or_the_file() {
    let mut columns = sawtooth();
    change(&mut columns, "TIME", "seconds since 2020-01-01", |i, v| if i == 100 { v + 900.0 } else { v });
    let read = imported(&columns, None).expect("one sample out of order");
    assert_eq!(read.flight.len(), ROWS - 1);
    assert!(has_note(&read, "1 of 400 samples are out of order") && read.flight.time_s.windows(2).all(|w| w[1] > w[0]));
    let mut columns = sawtooth();
    change(&mut columns, "TIME", "seconds since 2020-01-01", |i, v| if i > 300 { v - 500.0 } else { v });
    let error = imported(&columns, None).expect_err("a clock that was set back");
    assert!(error.contains("time goes backwards, 99 of 400 samples") && error.contains("at sample 302"), "{error}");
}

#[test]
fn units_off_by_a_thousand_and_empty_columns_are_reported() {
    type Case = (&'static str, &'static str, f64, &'static str);
    let cases: [Case; 7] = [
        ("PRES", "dbar", 1e3, "pressure reaches"),
        ("PRES", "dbar", 1e-3, "pressure never exceeds"),
        ("PITCH", "degrees", 1e3, "pitch reaches"),
        ("TEMP", "degree_C", 1e3, "temperature is"),
        ("TIME", "seconds since 1970-01-01", 1e-3, "usual step of time"),
        ("PRES", "dbar", f64::NAN, "PRES has no value"),
        ("TIME", "seconds since 1970-01-01", f64::NAN, "TIME has no time between"),
    ];
    for (name, unit, factor, said) in cases {
        let mut columns = sawtooth();
        change(&mut columns, name, unit, |_, v| v * factor);
        let error = imported(&columns, None).expect_err(name);
        assert!(error.contains(said) && !error.contains('\n'), "{name} x {factor}: {error}");
    }
    let mut columns = sawtooth();
    change(&mut columns, "HEADING", "degrees", |_, v| 1000.0 * v);
    let read = imported(&columns, None).expect("an import");
    assert!(has_note(&read, "HEADING reaches") && read.flight.heading_rad.iter().all(|v| v.is_nan()));
    let mut columns = sawtooth();
    change(&mut columns, "PITCH", "degrees", |_, _| f64::NAN);
    assert!(has_note(&imported(&columns, None).expect("an import"), "a comparison needs m_pitch_rad and m_ballast_pumped_cc"));
}

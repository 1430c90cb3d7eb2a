//! Raw files of Seagliders and SeaExplorers as they come from labs: cut, of another glider, saved again by a program, a CTD that is off.
//! The samples of `tests/formats` are changed, and what an import says of them is compared with what was changed.

use std::path::{Path, PathBuf};

use super::{ImportError, Imported, import};

/// A copy of a sample whose files went through `edit(name, text)`; packed ones are unpacked.
fn edited(sample: &str, name: &str, edit: impl Fn(&str, String) -> Option<String>) -> PathBuf {
    let to = std::env::temp_dir().join(format!("glider-raw-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&to);
    std::fs::create_dir_all(&to).expect("a folder");
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats").join(sample);
    for path in super::kind::files_of(&from).expect("the sample") {
        let mut name = path.file_name().expect("a name").to_string_lossy().into_owned();
        let mut text = String::new();
        let file = std::fs::File::open(&path).expect("a file");
        let mut bytes: Box<dyn std::io::Read> = Box::new(file);
        if let Some(plain) = name.strip_suffix(".gz") {
            bytes = Box::new(flate2::read::MultiGzDecoder::new(bytes));
            name = plain.to_owned();
        }
        bytes.read_to_string(&mut text).expect("text");
        if let Some(text) = edit(&name, text) {
            std::fs::write(to.join(name), text).expect("written");
        }
    }
    to
}

fn read(folder: PathBuf) -> Result<Imported, ImportError> {
    let got = import(&folder, &[]);
    std::fs::remove_dir_all(folder).ok();
    got
}

fn left_out(got: &Imported) -> String {
    got.report.left_out.join("\n")
}

#[test]
fn regress_a_seaglider_log_that_is_cut_is_named() {
    let want = read(edited("seaglider_raw", "whole", |_, text| Some(text))).expect("reads");
    assert!(want.report.is_whole(), "{}", left_out(&want));
    for (dive, at, loses) in [("11", "$GPS,", "no $GPS line"), ("11", "$GPS1", "no $GPS line"), ("13", "$GCHEAD", "no ballast")] {
        let name = format!("p09900{dive}.log");
        let cut = |n: &str, text: String| Some(if n == name { text.split(at).next().unwrap_or_default().to_owned() } else { text });
        let got = read(edited("seaglider_raw", "cut", cut)).expect("reads");
        let said = left_out(&got);
        assert!(said.contains(&format!("dive {dive}: ")) && said.contains(loses), "{dive} {at}: {said}");
        assert_eq!(got.flight.len(), want.flight.len());
    }
    let no_variation = |n: &str, text: String| Some(if n == "p0990011.log" { text.replace("$GPS", "$XGPS") } else { text });
    let got = read(edited("seaglider_raw", "magnetic", no_variation)).expect("reads");
    assert!(got.report.notes.iter().any(|n| n.contains("magnetic and stays so")), "{:?}", got.report.notes);
}

#[test]
fn regress_constants_of_another_seaglider_or_unreadable_are_named() {
    let constants = |name: &str, from: &'static str, to: &'static str| {
        read(edited("seaglider_raw", name, |n, text| Some(if n.ends_with(".m") { text.replace(from, to) } else { text }))).expect("reads")
    };
    let key = |got: &Imported, key: &str| got.vehicle.as_ref().and_then(|v| v.get(key)).unwrap_or(f64::NAN);
    let text = |got: &Imported| got.vehicle.as_ref().map(super::draft::Draft::toml).unwrap_or_default();
    let want = constants("same", "no such text", "");
    assert!(want.report.is_whole() && text(&want).contains("volmax + "));
    let got = constants("other", "id_str = '099'", "id_str = '098'");
    assert!(left_out(&got).contains("is of SG098, the dives of SG099"), "{}", left_out(&got));
    assert!(text(&got).contains("log_HD_a") && !text(&got).contains("sg_cal"), "{}", text(&got));
    let got = constants("comma", "mass = 54.12", "mass = 54,12");
    assert!(left_out(&got).contains("mass = 54,12 is no number"), "{}", left_out(&got));
    assert!((key(&got, "mass_kg") - 54.12).abs() < 1e-9, "of the log: {}", key(&got, "mass_kg"));
    // A volume that is not stated comes from the log, and says so.
    let got = constants("nan", "volmax = 53285.5", "volmax = NaN");
    assert!(got.report.is_whole() && text(&got).contains("MASS / RHO"), "{}", text(&got));
    let got = constants("zero", "volmax = 53285.5", "volmax = 0");
    assert!(left_out(&got).contains("is no volume of this glider"), "{}", left_out(&got));
    let got = constants("on board", "hd_a = 3.8e-3", "hd_a = NaN");
    assert!(text(&got).contains("log_HD_a = 0.003") && !text(&got).contains("sg_cal_hd_a"), "{}", text(&got));
}

#[test]
fn regress_seaexplorer_text_that_a_program_saved_again_is_read() {
    let whole = |_: &str, text: String| Some(text);
    let want = read(edited("seaexplorer_sub", "whole", whole)).expect("reads");
    let same = |got: &Imported| {
        let close = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()));
        close(&got.flight.time_s, &want.flight.time_s)
            && close(&got.flight.pressure_pa, &want.flight.pressure_pa)
            && close(&got.flight.density_kg_m3, &want.flight.density_kg_m3)
            && close(&got.flight.pitch_rad, &want.flight.pitch_rad)
            && got.report.start_unix_s == want.report.start_unix_s
    };
    let got = read(edited("seaexplorer_sub", "commas", |_, text| Some(text.replace('.', ",")))).expect("reads");
    assert!(same(&got) && got.report.notes.iter().any(|n| n.contains("decimal commas")), "{:?}", got.report);
    // dd/mm/yyyy at the begin of a field, as mm/dd/yyyy.
    let turned = |field: &str| match field.split_once('/').and_then(|(d, rest)| Some((d, rest.split_once('/')?))) {
        Some((day, (month, rest))) => format!("{month}/{day}/{rest}"),
        None => field.to_owned(),
    };
    let us = |_: &str, text: String| {
        Some(text.split(';').map(|f| f.split('\n').map(turned).collect::<Vec<_>>().join("\n")).collect::<Vec<_>>().join(";"))
    };
    let got = read(edited("seaexplorer_sub", "us", us)).expect("reads");
    assert!(same(&got) && got.report.notes.iter().any(|n| n.contains("month first")), "{:?}", got.report);
    let iso = |n: &str, text: String| Some(if n.contains("pld1.sub.10") { text.replace('/', "-") } else { text });
    let got = read(edited("seaexplorer_sub", "iso", iso)).expect("reads");
    let said = left_out(&got);
    assert!(said.contains("sea099.7.pld1.sub.10: ") && said.contains("dd/mm/yyyy HH:MM:SS is expected, first: \""), "{said}");
}

#[test]
fn regress_a_seaexplorer_whose_ctd_was_off_keeps_its_depth() {
    // The payload's pressure, temperature and conductivity read zero.
    let off = |text: String| {
        let place = |name: &str| text.lines().next().unwrap_or_default().split(';').position(|h| h.contains(name));
        let places = ["_PRESSURE", "_TEMPERATURE", "_CONDUCTIVITY"].map(|name| place(name).expect("a column"));
        let zeroed = |line: &str| {
            line.split(';').enumerate().map(|(k, f)| if places.contains(&k) { "0.0" } else { f }).collect::<Vec<_>>().join(";")
        };
        let lines: Vec<String> = text.lines().enumerate().map(|(k, l)| if k == 0 { l.to_owned() } else { zeroed(l) }).collect();
        lines.join("\n")
    };
    let got = read(edited("seaexplorer_sub", "one off", |n, text| Some(if n.contains("pld1.sub.10") { off(text) } else { text })))
        .expect("reads");
    assert!(left_out(&got).contains("cycle 10: the CTD was off"), "{}", left_out(&got));
    assert!(got.flight.pressure_pa.len() > 100 && got.report.missing.iter().all(|m| m != "sci_density_kg_m3"), "{:?}", got.report);
    let all = |n: &str, text: String| Some(if n.contains("pld1") { off(text) } else { text });
    let none = |n: &str, text: String| (!n.contains("pld1")).then_some(text);
    for got in [read(edited("seaexplorer_sub", "all off", all)), read(edited("seaexplorer_sub", "no payload", none))] {
        let got = got.expect("reads");
        assert!(left_out(&got).contains("rows are the vehicle's own depth"), "{}", left_out(&got));
        let deepest = got.flight.pressure_pa.iter().copied().fold(0.0, f64::max);
        assert!((5e5..7e5).contains(&deepest) && got.flight.pitch_rad.iter().all(|p| p.is_finite()), "{deepest}");
        assert_eq!(got.report.segments.len(), 3);
    }
}

#[test]
fn regress_parts_of_a_seaglider_that_do_not_fit_together_are_named() {
    let with = |name: &str, file: &'static str, edit: fn(String) -> String| {
        read(edited("seaglider_raw", name, |n, text| if n == file { Some(edit(text)).filter(|t| !t.is_empty()) } else { Some(text) }))
            .expect("reads")
    };
    let whole = with("sound", "none", |t| t);
    // Fixes without a date, as the oldest firmware writes them, are of the dive's day.
    let undated = |t: String| {
        let line = |l: &str| match l.split(',').collect::<Vec<_>>()[..] {
            [name, _, ref rest @ ..] if name.starts_with("$GPS") => format!("{name},{}", rest.join(",")),
            _ => l.to_owned(),
        };
        t.lines().map(line).collect::<Vec<_>>().join("\n")
    };
    let got = with("undated", "p0990011.log", undated);
    assert!(got.report.is_whole(), "{}", left_out(&got));
    let east = |got: &Imported| got.flight.gps_east_m.iter().copied().filter(|e| e.is_finite()).collect::<Vec<_>>();
    assert_eq!((east(&got), &got.flight.heading_rad), (east(&whole), &whole.flight.heading_rad));
    for (name, file, edit, said) in [
        (
            "no fix",
            "p0990012.log",
            (|t| t.replacen("$GPS2,", "$GPS2,x", 1)) as fn(String) -> String,
            "1 lines of fixes that cannot be read",
        ),
        ("cut eng", "p0990012.eng", |t| t.lines().take(30).collect::<Vec<_>>().join("\n"), "dive 12: its .eng ends"),
        ("no data", "p0990011.eng", |t| t.replace("%data:", "data"), "dive 11: its .eng has no line %data:"),
        ("month", "p0990011.log", |t| t.replace("start: 7 8 126", "start: 8 7 126"), "dive 12 begins 2"),
    ] {
        let got = with(name, file, edit);
        assert!(left_out(&got).contains(said), "{name}: {}", left_out(&got));
    }
    let got = read(edited("seaglider_raw", "gap", |n, text| (!n.starts_with("p0990012")).then_some(text))).expect("reads");
    assert!(got.report.is_whole() && got.report.notes.iter().any(|n| n == "no file of dive 12"), "{:?}", got.report.notes);
}

#[test]
fn regress_a_seaexplorer_file_without_rows_is_no_file() {
    let none = |n: &str, text: String| Some(if n.contains("pld1.sub.9") { text.lines().take(1).collect() } else { text });
    let got = read(edited("seaexplorer_sub", "no rows", none)).expect("reads");
    assert!(left_out(&got).contains("cycle 9: no payload file"), "{}", left_out(&got));
    let got = read(edited("seaexplorer_sub", "gap", |n, text| (!n.ends_with(".10")).then_some(text))).expect("reads");
    assert!(got.report.notes.iter().any(|n| n == "no file of cycle 10"), "{:?}", got.report.notes);
    assert!(got.report.notes.iter().any(|n| n.contains("rows of the payload have no pressure")), "{:?}", got.report.notes);
}

#[test]
fn regress_a_ballast_that_counts_what_weighs_is_questioned() {
    let questioned = |got: &Imported| got.report.notes.iter().any(|n| n.contains("cc more where the vehicle sinks"));
    let turned = |n: &str, text: String| {
        let place = text.lines().next().unwrap_or_default().split(';').position(|h| h == "BallastPos");
        let turn = |line: &str| {
            let field = |(k, f): (usize, &str)| match f.parse::<f64>() {
                Ok(v) if Some(k) == place => format!("{}", -v),
                _ => f.to_owned(),
            };
            line.split(';').enumerate().map(field).collect::<Vec<_>>().join(";")
        };
        Some(if n.contains("gli") { text.lines().map(turn).collect::<Vec<_>>().join("\n") } else { text })
    };
    assert!(!questioned(&read(edited("seaexplorer_sub", "buoyant", |_, text| Some(text))).expect("reads")));
    assert!(questioned(&read(edited("seaexplorer_sub", "weighs", turned)).expect("reads")));
}

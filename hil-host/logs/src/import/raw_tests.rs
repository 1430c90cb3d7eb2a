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
    for path in super::folder::files_of(&from).expect("the sample") {
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

/// A text whose fields between semicolons in columns whose names end so are changed in some of its lines; the first line is 0, the header.
fn cells(text: &str, names: &[&str], lines: std::ops::Range<usize>, of: impl Fn(&str) -> String) -> String {
    let header: Vec<&str> = text.lines().next().unwrap_or_default().split(';').collect();
    let field =
        |(k, f): (usize, &str)| if header.get(k).is_some_and(|h| names.iter().any(|n| h.ends_with(n))) { of(f) } else { f.to_owned() };
    let line = |(k, l): (usize, &str)| {
        if k > 0 && lines.contains(&k) { l.split(';').enumerate().map(field).collect::<Vec<_>>().join(";") } else { l.to_owned() }
    };
    text.lines().enumerate().map(line).collect::<Vec<_>>().join("\n")
}

/// The number of a field times a factor; a field that is none stays.
fn times(factor: f64) -> impl Fn(&str) -> String {
    move |f| f.parse::<f64>().map_or_else(|_| f.to_owned(), |v| (factor * v).to_string())
}

/// The same of the values of an `.eng` file, in one column by its place.
fn eng_cells(text: &str, column: usize, lines: std::ops::Range<usize>, of: impl Fn(&str) -> String) -> String {
    let field = |(k, f): (usize, &str)| if k == column { of(f) } else { f.to_owned() };
    let row = |l: &str| l.split_whitespace().enumerate().map(field).collect::<Vec<_>>().join(" ");
    let line = |(k, l): (usize, &str)| if l.starts_with('%') || !lines.contains(&k) { l.to_owned() } else { row(l) };
    text.lines().enumerate().map(line).collect::<Vec<_>>().join("\n")
}

const ALL: std::ops::Range<usize> = 0..usize::MAX;

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
    let off = |text: String| cells(&text, &["_PRESSURE", "_TEMPERATURE", "_CONDUCTIVITY"], ALL, |_| "0.0".into());
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
    let turned = |n: &str, text: String| Some(if n.contains("gli") { cells(&text, &["BallastPos"], ALL, times(-1.0)) } else { text });
    assert!(!questioned(&read(edited("seaexplorer_sub", "buoyant", |_, text| Some(text))).expect("reads")));
    assert!(questioned(&read(edited("seaexplorer_sub", "weighs", turned)).expect("reads")));
}

#[test]
fn regress_the_ballast_of_a_seaglider_follows_its_log() {
    let with = |name: &str, file: &'static str, edit: fn(String) -> String| {
        read(edited("seaglider_raw", name, |n, text| Some(if n == file { edit(text) } else { text }))).expect("reads")
    };
    let of_dive = |got: &Imported, dive: u32| -> Vec<f64> {
        let f = &got.flight;
        (0..f.len()).filter(|i| f.segment[*i] == dive).map(|i| f.ballast_m3[i] * 1e6).collect()
    };
    let whole = with("start", "none", |t| t);
    // From vbd_ad_start 1370.34 to -150 cm3 in 297.6 s, of which 2 are over.
    let start = (1370.34 - 2700.0) * -0.245_296;
    let want = start - (start + 150.0) * 2.0 / 297.6;
    assert!((of_dive(&whole, 2)[0] - want).abs() < 0.1, "{} instead of {want}", of_dive(&whole, 2)[0]);
    let middle = with("middle", "p0990012.log", |t| t.replace("$C_VBD,2700", "$C_VBD,2800"));
    let off = of_dive(&middle, 1).iter().zip(of_dive(&whole, 1)).map(|(a, b)| a - b + 24.5296).fold(0.0, |m: f64, d| m.max(d.abs()));
    assert!(off < 1e-6 && of_dive(&middle, 2) == of_dive(&whole, 2), "{off}");
    assert!(middle.report.notes.iter().any(|n| n.contains("C_VBD is another")), "{:?}", middle.report.notes);
    let lost = |t: String| t.lines().filter(|l| !l.starts_with("$GC,667") && !l.starts_with("$GC,1196")).collect::<Vec<_>>().join("\n");
    assert!(left_out(&with("lost", "p0990013.log", lost)).contains("dive 13: the .log's last move of the pump is at 20 s"));
    let zeros = |t: String| {
        let place = t.lines().find_map(|l| l.strip_prefix("%columns:")?.split(',').position(|c| c.trim() == "vbdCC")).expect("a column");
        eng_cells(&t, place, ALL, |_| "0.0".into())
    };
    let got = with("zeros", "p0990011.eng", zeros);
    let off = of_dive(&got, 0).iter().zip(of_dive(&whole, 0)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(
        got.report.notes.iter().any(|n| n.contains("dive 11: ballast from the pump's moves") || n.contains("likewise")) && off < 60.0,
        "{off}"
    );
}

#[test]
fn regress_fixes_and_depths_of_a_seaglider_that_cannot_be_are_left_out() {
    let with = |name: &str, file: &'static str, edit: fn(String) -> String| {
        read(edited("seaglider_raw", name, |n, text| Some(if n == file { edit(text) } else { text }))).expect("reads")
    };
    let known = |got: &Imported| got.flight.gps_north_m.iter().copied().filter(|v| v.is_finite()).collect::<Vec<_>>();
    let whole = with("all", "none", |t| t);
    let weeks = with("weeks", "p0990012.log", |t| t.replace("$GPS2,080726", "$GPS2,221106").replace("$GPS,080726", "$GPS,221106"));
    assert!(known(&weeks) == known(&whole) && weeks.report.notes.iter().any(|n| n.contains("dates of 2 fixes are days off")));
    let far = with("far", "p0990012.log", |t| {
        let line = |l: &str| if l.starts_with("$GPS,") { l.replacen(",47", ",48", 1) } else { l.to_owned() };
        t.lines().map(line).collect::<Vec<_>>().join("\n")
    });
    assert_eq!(known(&far).len() + 1, known(&whole).len(), "{:?}", far.report.notes);
    let no_depth = with("no depth", "p0990012.eng", |t| eng_cells(&t, 2, 60..80, |_| "NaN".into()));
    assert!(left_out(&no_depth).contains("20 rows of the .eng have no depth"), "{}", left_out(&no_depth));
    assert_eq!(no_depth.flight.len() + 20, whole.flight.len());
}

#[test]
fn regress_rows_of_a_seaexplorer_that_cannot_be_are_left_out() {
    let whole = read(edited("seaexplorer_sub", "sound rows", |_, text| Some(text))).expect("reads");
    let field = |name: &'static str, value: &'static str| {
        move |n: &str, text: String| Some(if n.contains("pld1.sub.10") { cells(&text, &[name], 60..63, |_| value.into()) } else { text })
    };
    let hot = read(edited("seaexplorer_sub", "hot", field("LEGATO_TEMPERATURE", "99.9"))).expect("reads");
    assert!(hot.report.notes.iter().any(|n| n.starts_with("3 of 372 temperatures are none of water")), "{:?}", hot.report.notes);
    assert!(hot.flight.density_kg_m3.iter().all(|d| d.is_nan() || *d > 1000.0));
    let zero = read(edited("seaexplorer_sub", "zero", field("LEGATO_PRESSURE", "0.0"))).expect("reads");
    assert!(zero.flight.len() + 3 == whole.flight.len() && zero.report.notes.iter().any(|n| n.contains("are 0 in the middle of a dive")));
    let salty = read(edited("seaexplorer_sub", "salty", field("LEGATO_CONDUCTIVITY", "96.0"))).expect("reads");
    assert!(left_out(&salty).contains("3 of 372 salinities are above 45"), "{}", left_out(&salty));
    let cut = |n: &str, text: String| {
        if !n.contains("pld1.sub.10") {
            return Some(text);
        }
        let mut lines: Vec<&str> = text.lines().collect();
        let joined = format!("{}{}", &lines[40][..60], lines[41]);
        lines[40] = &joined;
        lines.remove(41);
        Some(lines.join("\n"))
    };
    let got = read(edited("seaexplorer_sub", "cut rows", cut)).expect("reads");
    assert!(left_out(&got).contains("1 rows have another number of values"), "{}", left_out(&got));
}

#[test]
fn regress_a_seaglider_file_of_another_name_year_or_fix_is_named() {
    let with = |name: &str, edit: fn(String) -> String| {
        read(edited("seaglider_raw", name, |n, text| Some(if n == "p0990012.log" { edit(text) } else { text }))).expect("reads")
    };
    let whole = with("right", |t| t);
    for (name, edit, said) in [
        ("dive", (|t| t.replace("\ndive: 12", "\ndive: 14")) as fn(String) -> String, "its .log says that it is dive 14 of SG099"),
        ("glider", |t| t.replace("\nglider: 99", "\nglider: 98"), "its .log says that it is dive 12 of SG098"),
    ] {
        let got = with(name, edit);
        assert!(left_out(&got).contains(said), "{name}: {}", left_out(&got));
    }
    let year = with("year", |t| t.replace("start: 7 8 126", "start: 7 8 26"));
    assert!(year.report.is_whole() && year.flight.time_s == whole.flight.time_s, "{}", left_out(&year));
    let north = |got: &Imported| got.flight.gps_north_m.iter().filter(|v| v.is_finite()).count();
    let none = with("no fix", |t| t.replace("-12524.155,12,0.9,14", "-12524.155,99,99.0,99"));
    assert!(none.report.notes.iter().any(|n| n.contains("have a dilution (HDOP) of 99: no fixes")), "{:?}", none.report.notes);
    assert!(north(&none) < north(&whole), "{} of {}", north(&none), north(&whole));
    let e = read(edited("seaglider_raw", "constants alone", |n, text| n.ends_with(".m").then_some(text))).expect_err("no dive").to_string();
    assert!(e.contains("has no dive: .log and .eng named pGGGDDDD"), "{e}");
    let sign = |n: &str, text: String| Some(if n.ends_with(".log") { text.replace("$VBD_CNV,-", "$VBD_CNV,") } else { text });
    let sign = read(edited("seaglider_raw", "sign", sign)).expect("reads");
    assert!(sign.report.notes.iter().any(|n| n.contains("is its sign lost?")), "{:?}", sign.report.notes);
}

#[test]
fn regress_a_seaexplorer_column_twice_or_a_depth_upward_is_named() {
    let twice = |n: &str, text: String| {
        let add = |(k, l): (usize, &str)| format!("{}{l}", if k == 0 { "Pitch;" } else { ";" });
        Some(if n.contains("gli.sub.10") { text.lines().enumerate().map(add).collect::<Vec<_>>().join("\n") } else { text })
    };
    let got = read(edited("seaexplorer_sub", "twice", twice)).expect("reads");
    let problems: Vec<String> = got.report.files.iter().flat_map(|f| f.problems.clone()).collect();
    assert!(!got.report.is_whole() && problems == ["column Pitch stands twice: the first one is read"], "{problems:?}");
    let turned = |n: &str, text: String| Some(if n.contains("gli") { cells(&text, &["Depth"], ALL, times(-1.0)) } else { text });
    let whole = read(edited("seaexplorer_sub", "downward", |_, text| Some(text))).expect("reads");
    let got = read(edited("seaexplorer_sub", "upward", turned)).expect("reads");
    assert!(got.report.notes.iter().any(|n| n == "Depth grows upward: turned round"), "{:?}", got.report.notes);
    let column = crate::record::clock_offset::ENGINEERING_PRESSURE;
    let same = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-9 || (a.is_nan() && b.is_nan());
    assert!(got.flight.extra[column].iter().zip(&whole.flight.extra[column]).all(same));
}

#[test]
fn regress_the_fullest_file_of_a_seaexplorers_cycle_is_taken() {
    let whole = read(edited("seaexplorer_sub", "fullest whole", |_, text| Some(text))).expect("reads");
    let folder = edited("seaexplorer_sub", "fullest", |_, text| Some(text));
    let text = std::fs::read_to_string(folder.join("sea099.7.pld1.sub.10")).expect("the payload of cycle 10");
    let cut: String = text.lines().take(40).map(|l| l.to_owned() + "\n").collect();
    // The raw file is cut, and a copy that a browser made as well.
    std::fs::write(folder.join("sea099.7.pld1.raw.10"), &cut).expect("written");
    std::fs::write(folder.join("sea099.7.pld1.sub (1).10"), &cut).expect("written");
    let got = read(folder).expect("reads");
    assert_eq!(got.flight.pressure_pa, whole.flight.pressure_pa, "{:?}", got.report.notes);
    assert!(
        got.report.notes.iter().any(|n| n.starts_with("sea099.7.pld1.raw.10 passed over for sea099.7.pld1.sub.10")),
        "{:?}",
        got.report.notes
    );
}

#[test]
fn regress_headers_that_change_within_a_raw_file_are_named() {
    let eng = |name: &str, edit: fn(String) -> String| {
        read(edited("seaglider_raw", name, |n, text| Some(if n == "p0990012.eng" { edit(text) } else { text }))).expect("reads")
    };
    let whole = eng("header whole", |t| t);
    let case = eng("header case", |t| t.replace(",depth,", ",Depth,"));
    assert!(case.flight.pressure_pa == whole.flight.pressure_pa, "{}", left_out(&case));
    let none = eng("header none", |t| t.replace(",elaps_t,", ",elapsed,"));
    assert!(left_out(&none).contains("dive 12: its .eng has no column elaps_t (it has: elaps_t_0000"), "{}", left_out(&none));
    let twice = eng("header twice", |t| t + "%columns: elaps_t_0000,elaps_t,head,depth\n");
    assert!(left_out(&twice).contains("another line %columns:"), "{}", left_out(&twice));
    let again = |n: &str, text: String| {
        if !n.contains("pld1.sub.10") {
            return Some(text);
        }
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        let mut turned: Vec<&str> = text.lines().next().unwrap_or_default().trim_end_matches(';').split(';').collect();
        turned[1..].rotate_left(1);
        lines.insert(60, turned.join(";"));
        lines.insert(30, lines[0].clone());
        Some(lines.join("\n"))
    };
    let got = read(edited("seaexplorer_sub", "header again", again)).expect("reads");
    let problems: Vec<String> = got.report.files.iter().flat_map(|f| f.problems.clone()).collect();
    assert_eq!(problems, ["has another header after row 59: the rest is left out"]);
}

#[test]
fn regress_depths_of_one_seaglider_dive_upward_or_in_metres_are_named() {
    let depth =
        |factor: f64| move |n: &str, text: String| Some(if n == "p0990012.eng" { eng_cells(&text, 2, ALL, times(factor)) } else { text });
    let whole = read(edited("seaglider_raw", "depth whole", depth(1.0))).expect("reads");
    let up = read(edited("seaglider_raw", "depth up", depth(-1.0))).expect("reads");
    assert!(up.flight.pressure_pa == whole.flight.pressure_pa, "{:?}", up.report.notes);
    assert!(up.report.notes.iter().any(|n| n.contains("depth grows upward: turned round")), "{:?}", up.report.notes);
    let metres = read(edited("seaglider_raw", "depth metres", depth(0.01))).expect("reads");
    assert!(metres.report.notes.iter().any(|n| n.contains("is it in m, not in cm, in this .eng?")), "{:?}", metres.report.notes);
}

#[test]
fn regress_minutes_that_a_seaexplorers_payload_lacks_are_named() {
    let kept = |rows: std::ops::Range<usize>| {
        move |n: &str, text: String| {
            let lines = text.lines().enumerate().filter(|(k, _)| *k == 0 || !rows.contains(k) || !n.contains("pld1.sub.10"));
            Some(lines.map(|(_, l)| l).collect::<Vec<_>>().join("\n"))
        }
    };
    for (name, without) in [("payload cut", 80..999), ("payload gap", 40..100), ("payload late", 1..70)] {
        let got = read(edited("seaexplorer_sub", name, kept(without))).expect("reads");
        let notes = got.report.notes.join("\n");
        assert!(notes.contains("cycles 10: the CTD has no samples in"), "{name}: {notes}");
    }
    let got = read(edited("seaexplorer_sub", "payload whole", kept(0..0))).expect("reads");
    assert!(got.report.is_whole() && !got.report.notes.join("\n").contains("no samples"), "{:?}", got.report.notes);
}

#[test]
fn regress_a_conductivity_in_other_units_in_one_cycle_is_named() {
    let divided = |n: &str, text: String| {
        Some(if n.contains("pld1.sub.10") { cells(&text, &["LEGATO_CONDUCTIVITY"], ALL, times(0.1)) } else { text })
    };
    let got = read(edited("seaexplorer_sub", "siemens", divided)).expect("reads");
    assert!(left_out(&got).contains("segment 1: density comes from a salinity of"), "{}", left_out(&got));
    let f = &got.flight;
    assert!((0..f.len()).all(|i| (f.segment[i] == 1) == f.density_kg_m3[i].is_nan() || f.density_kg_m3[i].is_nan()), "one segment alone");
}

#[test]
fn regress_one_seaglider_dive_that_cannot_be_does_not_refuse_the_others() {
    // Its time counts twenty times too slowly.
    let slow = |n: &str, text: String| Some(if n == "p0990012.eng" { eng_cells(&text, 1, ALL, times(0.05)) } else { text });
    let got = read(edited("seaglider_raw", "slow clock", slow)).expect("reads");
    assert!(left_out(&got).contains("segment 1: pressure changes by"), "{}", left_out(&got));
    assert!(got.flight.segment.iter().all(|s| *s != 1) && got.flight.segment.contains(&2));
}

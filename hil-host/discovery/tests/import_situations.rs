//! What people hand over: clocks that were not set, two gliders in a folder, files that are empty beside ones that are not, names of
//! another case. Each input is made here, and the import says what is the matter or reads it.

use std::path::{Path, PathBuf};

use discovery::import::{Imported, import};
use netcdf3::{DataSet, FileWriter, Version};

/// 13 Sep 2020, 12:26:40 UTC.
const START: f64 = 1.6e9;
const CYCLES: usize = 260;

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("glider-situation-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// Depth (dbar), nose and pump of two dives, a cycle every 4 s.
fn at(k: usize) -> (f64, f64, f64) {
    let x = (k % 130) as f64 / 65.0;
    let down = x < 1.0;
    (0.1 + 25.0 * (1.0 - (x - 1.0).abs()), if down { -0.4 } else { 0.4 }, if down { -200.0 } else { 200.0 })
}

/// A Slocum file as the vehicle writes it: sensors (name, unit), and their values cycle by cycle.
fn slocum(path: &Path, glider: &str, sensors: &[(&str, &str)], cycle: impl Fn(usize) -> Vec<f64>) {
    let n = sensors.len();
    let ending = path.extension().expect("an ending").to_string_lossy().into_owned();
    let mut bytes = format!(
        "dbd_label:    DBD(dinkum_binary_data)file\nencoding_ver:    5\nnum_ascii_tags:    14\nall_sensors:    T\nthe8x3_filename:    \
         00010001\nfull_filename:    {glider}-2020-257-0-0\nfilename_extension:    {ending}\nmission_name:    OURS.MI\nfileopen_time:    Sun_Sep_13_12:26:40_2020\ntotal_num_sensors:    {n}\nsensors_per_cycle:    {n}\n\
         state_bytes_per_cycle:    {}\nsensor_list_crc:    00000000\nsensor_list_factored:    0\n",
        n.div_ceil(4)
    )
    .into_bytes();
    for (k, (name, unit)) in sensors.iter().enumerate() {
        bytes.extend(format!("s: T {k:4} {k:4} 8 {name} {unit}\n").bytes());
    }
    bytes.extend(b"sa");
    bytes.extend(0x1234_i16.to_le_bytes());
    bytes.extend(123.456_f32.to_le_bytes());
    bytes.extend(123_456_789.123_45_f64.to_le_bytes());
    // The first cycle repeats old values and is no sample.
    for k in std::iter::once(0).chain(0..CYCLES) {
        let values = cycle(k);
        let mut state = vec![0_u8; n.div_ceil(4)];
        values.iter().enumerate().filter(|(_, v)| v.is_finite()).for_each(|(i, _)| state[i / 4] |= 2 << (6 - 2 * (i % 4)));
        bytes.push(b'd');
        bytes.extend(state);
        values.iter().filter(|v| v.is_finite()).for_each(|v| bytes.extend(v.to_le_bytes()));
    }
    bytes.push(b'X');
    std::fs::write(path, bytes).expect("written");
}

/// Engineering and science file of a stem; `clock` is their start, `stamp` the CTD's own time of a cycle.
fn pair(folder: &Path, stem: &str, glider: &str, clock: f64, stamp: impl Fn(f64) -> f64) {
    engineering(&folder.join(format!("{stem}.dbd")), glider, clock);
    let sensors = [
        ("sci_m_present_time", "timestamp"),
        ("sci_ctd41cp_timestamp", "timestamp"),
        ("sci_water_pressure", "bar"),
        ("sci_water_temp", "degc"),
        ("sci_water_cond", "s/m"),
    ];
    slocum(&folder.join(format!("{stem}.ebd")), glider, &sensors, |k| {
        let t = clock + 4.0 * k as f64;
        vec![t, stamp(t), at(k).0 / 10.0, 12.0 - 0.05 * at(k).0, 3.9]
    });
}

fn engineering(path: &Path, glider: &str, clock: f64) {
    let sensors = [("m_present_time", "timestamp"), ("m_pitch", "rad"), ("m_ballast_pumped", "cc"), ("m_pressure", "bar")];
    slocum(path, glider, &sensors, |k| vec![clock + 4.0 * k as f64, at(k).1, at(k).2, at(k).0 / 10.0]);
}

fn said(imported: &Imported) -> String {
    imported.report.notes.iter().chain(&imported.report.left_out).cloned().collect::<Vec<_>>().join("\n")
}

fn whole(imported: &Imported) {
    let f = &imported.flight;
    for (name, column) in [("pitch", &f.pitch_rad), ("ballast", &f.ballast_m3), ("density", &f.density_kg_m3)] {
        let known = column.iter().filter(|v| v.is_finite()).count();
        assert!(known > 200, "{name}: {known} of {}\n{}", f.len(), said(imported));
    }
}

#[test]
fn regress_sound_slocum_files_are_read_without_a_word_of_loss() {
    let folder = folder("sound");
    pair(&folder, "a", "alpha", START, |t| t);
    let got = import(&folder, &[]).expect("an import");
    assert!(got.report.is_whole(), "{:?}", got.report.left_out);
    whole(&got);
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_files_of_a_clock_in_1970_are_named_beside_good_ones_and_alone() {
    let folder = folder("1970");
    pair(&folder, "a", "alpha", START, |t| t);
    pair(&folder, "b", "alpha", 100.0, |t| t);
    let got = import(&folder, &[]).expect("an import");
    let left_out = got.report.left_out.join("\n");
    assert!(!got.report.is_whole(), "exit code 1");
    assert!(left_out.contains("b.dbd") && left_out.contains("b.ebd") && left_out.contains("1970"), "{left_out}");
    assert!(got.flight.time_s.last().is_some_and(|t| *t < 2000.0));
    for name in ["a.dbd", "a.ebd"] {
        std::fs::remove_file(folder.join(name)).expect("removed");
    }
    // Alone the cause is the clock, not a pressure that is there.
    match import(&folder, &[]) {
        Ok(got) => assert!(said(&got).contains("1970"), "{}", said(&got)),
        Err(e) => assert!(e.to_string().contains("1970"), "{e}"),
    }
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_two_gliders_in_a_folder_are_refused_with_both_names() {
    let folder = folder("two");
    pair(&folder, "alpha-2020-257-0-0", "alpha", START, |t| t);
    pair(&folder, "beta-2020-257-0-0", "beta", START + 300.0, |t| t);
    let e = import(&folder, &[]).expect_err("refused").to_string();
    assert!(e.contains("alpha") && e.contains("beta"), "{e}");
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_an_empty_file_does_not_hide_the_good_one_beside_it() {
    let folder = folder("empty");
    pair(&folder, "a", "alpha", START, |t| t);
    std::fs::rename(folder.join("a.dbd"), folder.join("a.sbd")).expect("renamed");
    std::fs::write(folder.join("a.dbd"), b"").expect("written");
    let got = import(&folder, &[]).expect("an import");
    whole(&got);
    assert!(said(&got).contains("a.sbd is used in the place of a.dbd"), "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_a_ctd_whose_own_clock_was_never_set_stands_on_the_computers() {
    for (name, stamp) in [("absent", f64::NAN), ("zero", 0.0)] {
        let folder = folder(name);
        pair(&folder, "a", "alpha", START, |_| stamp);
        let got = import(&folder, &[]).expect("an import");
        whole(&got);
        assert!(said(&got).contains("clock was not set"), "{name}: {}", said(&got));
        std::fs::remove_dir_all(folder).ok();
    }
}

#[test]
fn regress_a_named_file_is_the_one_that_is_read() {
    let folder = folder("named");
    pair(&folder, "a", "alpha", START, |t| t);
    engineering(&folder.join("a.sbd"), "alpha", START);
    let got = import(&folder.join("a.sbd"), &[]).expect("an import");
    let read: Vec<&str> = got.report.files.iter().map(|f| f.file.as_str()).collect();
    assert!(read.contains(&"a.sbd") && !read.contains(&"a.dbd"), "{read:?}");
    std::fs::remove_dir_all(folder).ok();
}

/// A NetCDF of these variables (name, unit, standard name, values) on `dimensions`, the last of which is the rows.
fn netcdf(path: &Path, dimensions: &[&str], variables: &[(&str, &str, &str, Vec<f64>)]) {
    let mut set = DataSet::new();
    for (k, d) in dimensions.iter().enumerate() {
        set.add_fixed_dim(d, if k + 1 == dimensions.len() { CYCLES } else { 1 }).expect("a dimension");
    }
    for (name, unit, standard, _) in variables {
        set.add_var_f64(name, dimensions).expect("a variable");
        set.add_var_attr_string(name, "units", unit).expect("a unit");
        if !standard.is_empty() {
            set.add_var_attr_string(name, "standard_name", standard).expect("a name");
        }
    }
    let mut file = FileWriter::open(path).expect("a file");
    file.set_def(&set, Version::Classic, 0).expect("a definition");
    for (name, _, _, values) in variables {
        file.write_var_f64(name, values).expect("values");
    }
    file.close().expect("closed");
}

type Variable = (&'static str, &'static str, &'static str, Vec<f64>);

fn variables(names: [&'static str; 6]) -> Vec<Variable> {
    let column = |f: &dyn Fn(usize) -> f64| (0..CYCLES).map(f).collect::<Vec<f64>>();
    vec![
        (names[0], "seconds since 1970-01-01T00:00:00Z", "time", column(&|k| START + 4.0 * k as f64)),
        (names[1], "dbar", "sea_water_pressure", column(&|k| at(k).0)),
        (names[2], "degree_C", "sea_water_temperature", column(&|k| 12.0 - 0.05 * at(k).0)),
        (names[3], "1", "sea_water_practical_salinity", column(&|_| 35.0)),
        (names[4], "rad", "", column(&|k| at(k).1)),
        (names[5], "cm3", "", column(&|k| at(k).2)),
    ]
}

const USUAL: [&str; 6] = ["time", "pressure", "temperature", "salinity", "pitch", "ballast_pumped"];

fn read_netcdf(name: &str, dimensions: &[&str], variables: &[Variable]) -> Result<Imported, String> {
    let folder = folder(name);
    let path = folder.join("mission.nc");
    netcdf(&path, dimensions, variables);
    let got = import(&path, &[]).map_err(|e| e.to_string());
    std::fs::remove_dir_all(folder).ok();
    got
}

#[test]
fn regress_rows_from_before_the_clock_was_set_make_no_flight_of_fifty_years() {
    let mut columns = variables(USUAL);
    columns[0].3[..130].iter_mut().enumerate().for_each(|(k, t)| *t = 4.0 * k as f64);
    let got = read_netcdf("half-1970", &["time"], &columns).expect("an import");
    assert!(got.flight.time_s.last().is_some_and(|t| *t < 2000.0), "{:?} s long", got.flight.time_s.last());
    assert!(!got.report.is_whole() && said(&got).contains("130"), "{}", said(&got));
}

#[test]
fn regress_a_dimension_of_one_is_none() {
    let got = read_netcdf("trajectory", &["trajectory", "obs"], &variables(USUAL)).expect("an import");
    assert_eq!(got.flight.len(), CYCLES);
    whole(&got);
}

#[test]
fn regress_channels_are_found_whatever_the_case_and_by_standard_name() {
    let upper = ["TIME", "PRESSURE", "TEMPERATURE", "SALINITY", "PITCH", "BALLAST_PUMPED"];
    let mixed = ["Time", "Pressure", "Temperature", "Salinity", "Pitch", "Ballast_Pumped"];
    let other = ["juld", "ctd_press", "ctd_t", "ctd_s", "pitch", "ballast_pumped"];
    for names in [upper, mixed, other] {
        let dimension = names[0];
        let got = read_netcdf(names[1], &[dimension], &variables(names)).unwrap_or_else(|e| panic!("{names:?}: {e}"));
        assert_eq!(got.flight.len(), CYCLES, "{names:?}");
        whole(&got);
    }
}

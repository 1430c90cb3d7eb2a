//! Small logs of two dives, made here as vehicles and programs write them.

use std::path::Path;

use netcdf3::{DataSet, FileWriter, Version};

/// 13 Sep 2020, 12:26:40 UTC.
pub const START: f64 = 1.6e9;
pub const CYCLES: usize = 260;

/// Depth (dbar), nose and pump of two dives, a cycle every 4 s.
pub fn at(k: usize) -> (f64, f64, f64) {
    let x = (k % 130) as f64 / 65.0;
    let down = x < 1.0;
    (0.1 + 25.0 * (1.0 - (x - 1.0).abs()), if down { -0.4 } else { 0.4 }, if down { -200.0 } else { 200.0 })
}

/// A Slocum file as the vehicle writes it: sensors (name, unit), and their values cycle by cycle.
pub fn slocum(path: &Path, glider: &str, sensors: &[(&str, &str)], cycle: impl Fn(usize) -> Vec<f64>) {
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
pub fn pair(folder: &Path, stem: &str, glider: &str, clock: f64, stamp: impl Fn(f64) -> f64) {
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

pub fn engineering(path: &Path, glider: &str, clock: f64) {
    let sensors = [("m_present_time", "timestamp"), ("m_pitch", "rad"), ("m_ballast_pumped", "cc"), ("m_pressure", "bar")];
    slocum(path, glider, &sensors, |k| vec![clock + 4.0 * k as f64, at(k).1, at(k).2, at(k).0 / 10.0]);
}

/// A NetCDF of these variables (name, unit, standard name, values) on `dimensions`, the last of which is the rows.
pub fn netcdf(path: &Path, dimensions: &[&str], variables: &[(&str, &str, &str, Vec<f64>)]) {
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

pub type Variable = (&'static str, &'static str, &'static str, Vec<f64>);

pub fn variables(names: [&'static str; 6]) -> Vec<Variable> {
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

pub const USUAL: [&str; 6] = ["time", "pressure", "temperature", "salinity", "pitch", "ballast_pumped"];

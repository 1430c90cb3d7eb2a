//! Reads a flight from csv: by column name, in the units the name states, into SI.
//!
//! Accepts the columns of `glider-trial/1` (FORMAT section 1) and the usual names of Slocum csv exports. Empty fields and `nan`
//! become NaN. Text in the `segment` column becomes numbers in order of appearance. Columns it does not know are kept in
//! [`Flight::extra`] where they are numbers. What is refused, is refused with file, line, column and a fix.

use crate::record::flight::Flight;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Why a file cannot be used.
#[derive(Debug)]
#[non_exhaustive]
pub enum ReadError {
    /// The file cannot be opened or is not text.
    File {
        /// Which file.
        path: PathBuf,
        /// What the system said.
        why: String,
    },
    /// Something in the file is wrong.
    Content {
        /// Which file.
        path: PathBuf,
        /// Line, 1 = header; 0 if it concerns the whole file.
        line: u64,
        /// Column or key name.
        column: String,
        /// What is wrong and what to do.
        why: String,
    },
}

impl std::fmt::Display for ReadError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File { path, why } => write!(f, "{}: {why}", path.display()),
            Self::Content { path, line: 0, column, why } => write!(f, "{}: {column}: {why}", path.display()),
            Self::Content { path, line, column, why } => write!(f, "{}, line {line}, column {column}: {why}", path.display()),
        }
    }
}

impl std::error::Error for ReadError {}

/// Where a column of a csv goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Channel {
    /// Time, s.
    Time,
    /// Segment.
    Segment,
    /// Gauge pressure, Pa.
    Pressure,
    /// Pitch, rad.
    Pitch,
    /// Roll, rad.
    Roll,
    /// Heading, rad.
    Heading,
    /// Ballast, m³.
    Ballast,
    /// Battery position, m.
    Battery,
    /// Temperature, °C.
    Temperature,
    /// In-situ density, kg/m³.
    Density,
    /// East of a fix, m.
    GpsEast,
    /// North of a fix, m.
    GpsNorth,
    /// Speed through the water, m/s.
    Speed,
}

/// Names that a column may carry, and the factor that brings it to the unit of its channel. First match wins.
pub const NAMES: &[(&str, Channel, f64)] = &[
    ("time_s", Channel::Time, 1.0),
    ("time", Channel::Time, 1.0),
    ("m_present_time", Channel::Time, 1.0),
    ("segment", Channel::Segment, 1.0),
    ("pressure_dbar", Channel::Pressure, 1e4),
    ("ctd_pressure_dbar", Channel::Pressure, 1e4),
    ("sci_water_pressure_dbar", Channel::Pressure, 1e4),
    ("sci_water_pressure_bar", Channel::Pressure, 1e5),
    ("sci_water_pressure", Channel::Pressure, 1e5),
    ("m_pressure_bar", Channel::Pressure, 1e5),
    ("eng_pressure_bar", Channel::Pressure, 1e5),
    ("m_pitch_rad", Channel::Pitch, 1.0),
    ("pitch_rad", Channel::Pitch, 1.0),
    ("m_pitch", Channel::Pitch, 1.0),
    ("pitch_deg", Channel::Pitch, std::f64::consts::PI / 180.0),
    ("m_roll_rad", Channel::Roll, 1.0),
    ("roll_rad", Channel::Roll, 1.0),
    ("m_roll", Channel::Roll, 1.0),
    ("m_heading_rad", Channel::Heading, 1.0),
    ("heading_rad", Channel::Heading, 1.0),
    ("m_heading", Channel::Heading, 1.0),
    ("m_ballast_pumped_cc", Channel::Ballast, 1e-6),
    ("ballast_cc", Channel::Ballast, 1e-6),
    ("m_ballast_pumped", Channel::Ballast, 1e-6),
    ("m_de_oil_vol", Channel::Ballast, 1e-6),
    ("m_battpos_m", Channel::Battery, 1.0),
    ("battpos_in", Channel::Battery, 0.0254),
    ("m_battpos", Channel::Battery, 0.0254),
    ("sci_water_temp_degC", Channel::Temperature, 1.0),
    ("temp_C", Channel::Temperature, 1.0),
    ("sci_water_temp", Channel::Temperature, 1.0),
    ("temperature_degC", Channel::Temperature, 1.0),
    ("sci_density_kg_m3", Channel::Density, 1.0),
    ("rho_kg_m3", Channel::Density, 1.0),
    ("density_kg_m3", Channel::Density, 1.0),
    ("gps_east_m", Channel::GpsEast, 1.0),
    ("gps_north_m", Channel::GpsNorth, 1.0),
    ("speed_water_m_s", Channel::Speed, 1.0),
    ("U_dvl_m_s", Channel::Speed, 1.0),
];

/// The csv file of `path`: itself, or `flight.csv` (else the only csv) of a directory.
///
/// # Errors
/// Nothing there, or more than one candidate.
pub fn csv_of(path: &Path) -> Result<PathBuf, ReadError> {
    if !path.is_dir() {
        return Ok(path.to_path_buf());
    }
    let named = path.join("flight.csv");
    if named.is_file() {
        return Ok(named);
    }
    let file_error = |why: String| ReadError::File { path: path.to_path_buf(), why };
    let mut found: Vec<PathBuf> = std::fs::read_dir(path)
        .map_err(|e| file_error(e.to_string()))?
        .filter_map(|e| e.ok().map(|e| e.path()))
        .filter(|p| p.extension().is_some_and(|x| x == "csv"))
        .collect();
    found.sort();
    match found.as_slice() {
        [one] => Ok(one.clone()),
        [] => Err(file_error("no flight.csv in this directory; name a csv file, or make one with `glider import`".into())),
        many => Err(file_error(format!("{} csv files here; name one of them with --flight", many.len()))),
    }
}

/// Reads a flight from a csv file or a flight directory.
///
/// # Errors
/// What is wrong, where, and what to do.
pub fn flight(path: &Path) -> Result<Flight, ReadError> {
    let file = csv_of(path)?;
    let text = std::fs::read_to_string(&file).map_err(|e| {
        let binary = e.kind() == std::io::ErrorKind::InvalidData;
        let why = if binary { "is not text; a glider's binary or NetCDF file is read by `glider import`".into() } else { e.to_string() };
        ReadError::File { path: file.clone(), why }
    })?;
    let name = if path.is_dir() { path.file_name() } else { path.file_stem() }.map_or_else(String::new, |n| n.to_string_lossy().into());
    parse(&text, &file, &name)
}

/// Reads a flight from csv text; `file` is only for messages.
///
/// # Errors
/// What is wrong, where, and what to do.
pub fn parse(text: &str, file: &Path, name: &str) -> Result<Flight, ReadError> {
    let bad = |line: u64, column: &str, why: String| ReadError::Content { path: file.to_path_buf(), line, column: column.into(), why };
    if text.trim().is_empty() {
        return Err(bad(0, "file", "is empty; a flight needs a header line and rows".into()));
    }
    let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| bad(1, "header", e.to_string()))?.clone();
    let mut channels: BTreeMap<Channel, (usize, f64)> = BTreeMap::new();
    for (alias, channel, factor) in NAMES {
        if let Some(i) = header.iter().position(|h| h.trim_start_matches('\u{feff}').eq_ignore_ascii_case(alias)) {
            channels.entry(*channel).or_insert((i, *factor));
        }
    }
    let needs: &[(Channel, &str)] = &[
        (Channel::Time, "time_s"),
        (Channel::Pressure, "pressure_dbar"),
        (Channel::Pitch, "m_pitch_rad"),
        (Channel::Ballast, "m_ballast_pumped_cc"),
        (Channel::Density, "sci_density_kg_m3"),
    ];
    for (channel, column) in needs {
        if !channels.contains_key(channel) {
            let accepted: Vec<&str> = NAMES.iter().filter(|(_, c, _)| c == channel).map(|(n, _, _)| *n).collect();
            return Err(bad(
                1,
                column,
                format!(
                    "is missing; accepted names: {} (the file has: {}{})",
                    accepted.join(", "),
                    header.iter().collect::<Vec<_>>().join(", "),
                    if header.len() == 1 { "; columns must be separated by commas" } else { "" }
                ),
            ));
        }
    }
    let mut columns: Vec<Vec<f64>> = vec![Vec::new(); header.len()];
    let mut numeric = vec![true; header.len()];
    let mut lines = Vec::new();
    let mut labels: Vec<String> = Vec::new();
    let known: Vec<usize> = channels.values().map(|v| v.0).collect();
    let segment_column = channels.get(&Channel::Segment).map(|v| v.0);
    for record in reader.records() {
        let record = record.map_err(|e| bad(e.position().map_or(0, csv::Position::line), "row", e.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        if record.len() != header.len() {
            let why = format!("has {} fields, the header {}; the file may have been cut off here", record.len(), header.len());
            return Err(bad(line, "row", why));
        }
        lines.push(line);
        for (i, field) in record.iter().enumerate() {
            let value = if Some(i) == segment_column && field.parse::<u32>().is_err() {
                let k = labels.iter().position(|l| l == field).unwrap_or_else(|| {
                    labels.push(field.to_string());
                    labels.len() - 1
                });
                k as f64
            } else if field.is_empty() || field.eq_ignore_ascii_case("nan") {
                f64::NAN
            } else {
                match field.parse::<f64>() {
                    Ok(v) if v.is_finite() => v,
                    _ if known.contains(&i) => {
                        return Err(bad(
                            line,
                            &header[i],
                            format!("`{field}` is not a number; leave the field empty where there is no value"),
                        ));
                    }
                    _ => {
                        numeric[i] = false;
                        f64::NAN
                    }
                }
            };
            columns[i].push(value);
        }
    }
    let n = lines.len();
    if n == 0 {
        return Err(bad(0, "file", "has a header and no rows".into()));
    }
    let take = |channel: Channel| -> Option<Vec<f64>> { channels.get(&channel).map(|(i, f)| columns[*i].iter().map(|v| v * f).collect()) };
    let or_nan = |channel| take(channel).unwrap_or_else(|| vec![f64::NAN; n]);
    let time_column = header[channels[&Channel::Time].0].to_string();
    let mut time_s = or_nan(Channel::Time);
    for (i, t) in time_s.iter().enumerate() {
        if !t.is_finite() {
            return Err(bad(lines[i], &time_column, "time is empty; delete the row or give it a time".into()));
        }
        if i > 0 && *t <= time_s[i - 1] {
            let why =
                format!("time goes from {} to {t} s; it must increase from row to row (sort the rows, remove doubles)", time_s[i - 1]);
            return Err(bad(lines[i], &time_column, why));
        }
    }
    if n > 2 {
        let mut steps: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
        steps.sort_by(f64::total_cmp);
        let median = steps[steps.len() / 2];
        if !(0.01..=120.0).contains(&median) {
            let why =
                format!("the usual step is {median} s; a flight is sampled every 0.1 to 60 s (milliseconds or days instead of seconds?)");
            return Err(bad(0, &time_column, why));
        }
    }
    // Unix time would make "days since the start" meaningless.
    if time_s[0] > 1e8 {
        let start = time_s[0];
        time_s.iter_mut().for_each(|t| *t -= start);
    }
    let segment = match take(Channel::Segment) {
        None => vec![0; n],
        Some(s) => {
            let mut out = Vec::with_capacity(n);
            for (i, v) in s.iter().enumerate() {
                if !v.is_finite() || *v < 0.0 || v.fract() != 0.0 {
                    return Err(bad(lines[i], "segment", format!("`{v}` is not a segment number (0, 1, 2 …)")));
                }
                out.push(*v as u32);
            }
            out
        }
    };
    let flight = Flight {
        name: name.to_string(),
        time_s,
        segment,
        pressure_pa: or_nan(Channel::Pressure),
        pitch_rad: or_nan(Channel::Pitch),
        roll_rad: or_nan(Channel::Roll),
        heading_rad: or_nan(Channel::Heading),
        ballast_m3: or_nan(Channel::Ballast),
        battery_mass_m: or_nan(Channel::Battery),
        temperature_degc: or_nan(Channel::Temperature),
        density_kg_m3: or_nan(Channel::Density),
        gps_east_m: or_nan(Channel::GpsEast),
        gps_north_m: or_nan(Channel::GpsNorth),
        speed_m_s: take(Channel::Speed).filter(|s| s.iter().any(|v| v.is_finite())),
        extra: header
            .iter()
            .enumerate()
            .filter(|(i, _)| !known.contains(i) && numeric[*i])
            .map(|(i, h)| (h.to_string(), columns[i].clone()))
            .collect(),
    };
    let column_of = |c: Channel| header[channels[&c].0].to_string();
    plausible(
        &flight,
        file,
        column_of(Channel::Pressure),
        column_of(Channel::Pitch),
        column_of(Channel::Ballast),
        column_of(Channel::Density),
    )?;
    Ok(flight)
}

/// The value below which a share `q` of the finite values lies; NaN if there are none.
#[must_use]
pub fn quantile(values: &[f64], q: f64) -> f64 {
    let mut v: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    if v.is_empty() {
        return f64::NAN;
    }
    v.sort_by(f64::total_cmp);
    v[((v.len() - 1) as f64 * q).round() as usize]
}

/// Refuses columns that are empty or whose bulk cannot be in the unit they claim.
fn plausible(f: &Flight, file: &Path, pressure: String, pitch: String, ballast: String, density: String) -> Result<(), ReadError> {
    let bad = |column: String, why: String| ReadError::Content { path: file.to_path_buf(), line: 0, column, why };
    for (values, column) in [(&f.pressure_pa, &pressure), (&f.pitch_rad, &pitch), (&f.ballast_m3, &ballast), (&f.density_kg_m3, &density)] {
        let filled = values.iter().filter(|v| v.is_finite()).count();
        if filled < 10 {
            return Err(bad(column.clone(), format!("has only {filled} values; at least 10 are needed")));
        }
    }
    implausible(f, [&pressure, &pitch, &ballast, &density]).map_or(Ok(()), |(column, why)| Err(bad(column, why)))
}

/// The first column whose bulk cannot be in the unit it claims, and why; `names` are those of pressure, pitch, ballast and density.
/// Quantiles, so that single spikes pass; a column without values passes.
#[must_use]
pub fn implausible(f: &Flight, names: [&str; 4]) -> Option<(String, String)> {
    let [pressure, pitch, ballast, density] = names;
    let size = |values: &[f64], q: f64| quantile(&values.iter().map(|v| v.abs()).collect::<Vec<_>>(), q);
    let found = |column: &str, why: String| Some((column.to_string(), why));
    let deep = quantile(&f.pressure_pa, 0.99);
    if deep.is_finite() && !(-5e4..1.2e8).contains(&deep) {
        let why = format!("reaches {:.0} dbar, more than the ocean is deep; is it in Pa, kPa or mbar instead of dbar?", deep * 1e-4);
        return found(pressure, why);
    }
    let steep = size(&f.pitch_rad, 0.9);
    if steep > 1.571 {
        return found(pitch, format!("reaches {steep:.1} rad; is it in degrees or mrad?"));
    }
    if deep > 2e4 && steep > 0.0 && steep < 2e-3 {
        return found(pitch, format!("stays within {steep:.5} rad in a flight that dives; is it divided by 1000, or the wrong column?"));
    }
    let volume = size(&f.ballast_m3, 0.9);
    if volume > 5e-3 || (volume > 0.0 && volume < 1e-6) {
        let why = format!("reaches {:.3} cm3; a buoyancy engine moves 100 to 1000 cm3 (litres, m3 or mm3 instead of cm3?)", volume * 1e6);
        return found(ballast, why);
    }
    let turns = quantile(&f.heading_rad, 0.9).abs().max(quantile(&f.heading_rad, 0.1).abs());
    if turns > 6.4 {
        return found("heading", format!("reaches {turns:.1} rad; is it in degrees?"));
    }
    let list = size(&f.roll_rad, 0.9);
    if list > 1.571 {
        return found("roll", format!("reaches {list:.1} rad; is it in degrees?"));
    }
    let warmth = quantile(&f.temperature_degc, 0.5);
    if warmth.is_finite() && !(-3.0..45.0).contains(&warmth) {
        return found("temperature", format!("is {warmth:.1} degC in the middle; water is -2 to 40 degC (kelvin?)"));
    }
    // All of it within 0.05 K of 0 degC, and not one repeated number: no water a glider dives in.
    if size(&f.temperature_degc, 0.95) < 0.05 && quantile(&f.temperature_degc, 0.95) > quantile(&f.temperature_degc, 0.05) {
        let why = format!("stays within {:.4} K of 0 degC; is it divided by 1000?", size(&f.temperature_degc, 0.95));
        return found("temperature", why);
    }
    let rho = quantile(&f.density_kg_m3, 0.5);
    if rho.is_finite() && !(950.0..1150.0).contains(&rho) {
        let why = format!("is {rho:.3} in the middle; in-situ density of water is 990 to 1080 kg/m3 (g/cm3, or sigma = density - 1000?)");
        return found(density, why);
    }
    let fast = f.speed_m_s.as_deref().map_or(f64::NAN, |speed| size(speed, 0.9));
    if fast > 5.0 || (fast > 0.0 && fast < 5e-3) {
        return found("speed", format!("reaches {fast:.4} m/s; gliders do 0.2 to 1 m/s (mm/s, cm/s or km/s instead of m/s?)"));
    }
    let shift = size(&f.battery_mass_m, 0.9);
    if shift > 2.0 {
        return found("battery position", format!("reaches {shift:.1} m, longer than the glider (inches, cm or mm instead of m?)"));
    }
    None
}

#[cfg(test)]
mod tests {
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
        let e = error_of(&(rows(20) + "80,0,1\n"));
        assert!(e.contains("line 22") && e.contains("cut off"), "{e}");
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
    fn units_off_by_a_thousand_are_refused_with_the_likely_cause() {
        assert!(error_of(&rows(20).replace("1025.1", "1.0251")).contains("g/cm3"));
        assert!(error_of(&rows(20).replace("1025.1", "25.1")).contains("sigma"));
        assert!(error_of(&rows(20).replace(",-200,", ",-0.0002,")).contains("m3"));
        assert!(error_of(&rows(20).replace("-0.45", "-26")).contains("degrees"));
        let e = error_of(&rows(20).replace("1025.1", ""));
        assert!(e.contains("only 0 values"), "{e}");
    }
}

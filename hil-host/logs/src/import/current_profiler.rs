//! Speed through the water from a current profiler's own file (Nortek AD2CP, NetCDF of its MIDAS software).
//!
//! Beams 1 (fore) and 3 (aft) stand 47.5°, 2 and 4 (sides) 25° from the instrument's axis; velocity along a beam counts away from
//! it, and water at rest moves past a glider as the glider moves through it. For an instrument that looks down, u along the hull and n
//! across it, upward:
//! ```text
//! n = (V2 + V4) / (2 cos 25°)      V1 = −u sin 47.5° + n cos 47.5°      V3 = u sin 47.5° + n cos 47.5°
//! ```
//! (one that looks up: n of the other sign). Where both echoes of beams 1 and 3 are good u is their mean, else what the good one says.
//! A value is the median over the cells within 10 m. Pitched, the two beams look into depths up to 5 m apart there, and shear of the
//! water over the cells is in the value, so the speed is good to 1 or 2 cm/s at best (gliderad2cp).

use std::path::Path;

use netcdf_reader::NcFile;

use super::{ImportError, Imported};
use crate::record::plausible::quantile;
use crate::record::resample::Series;
use crate::record::seawater;

/// Angles of the fore and aft beams and of the side beams from the axis, rad (Nortek's head of a glider).
const FORE_AFT_RAD: f64 = 47.5 * DEGREE;
const SIDE_RAD: f64 = 25.0 * DEGREE;
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Echoes that are believed: correlation at least, %, amplitude at most, dB, speed at most, m/s (gliderad2cp).
const LEAST_CORRELATION: f64 = 80.0;
const MOST_AMPLITUDE: f64 = 80.0;
const FASTEST_ECHO_M_S: f64 = 0.8;
/// Cells that begin within this distance of the instrument, m; the first one rings.
const NEAR_M: f64 = 10.0;
/// Bubbles and the surface's echo, Pa.
const SHALLOW_PA: f64 = 2e4;
/// 1 sigma of a speed, and of its scale (speed of sound, mounting): guesses after gliderad2cp's 1 to 2 cm/s.
const SIGMA_M_S: f64 = 0.02;
const SIGMA_SCALE: f64 = 0.03;
/// How far the two clocks may be apart, s, and the pressures once they agree, Pa.
const CLOCKS_S: i32 = 180;
const PRESSURES_PA: f64 = 3e4;

/// Groups that hold the profiles.
const PROFILE_GROUPS: [&str; 2] = ["Data/Average", "Data/Burst"];

/// Whether a file is such a profiler's.
#[must_use]
pub fn is_midas(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("nc")) && super::netcdf::open(path).is_ok_and(|f| group(&f).is_some())
}

fn group(file: &NcFile) -> Option<&'static str> {
    PROFILE_GROUPS.into_iter().find(|g| file.variable(&format!("{g}/VelocityBeam1")).is_ok())
}

/// One ping: Unix time, pressure, speed along the hull and across it, upward, through the water.
struct Ping {
    unix_s: f64,
    pressure_pa: f64,
    along_m_s: f64,
    across_m_s: f64,
    sound_m_s: f64,
}

/// The variables of a profile.
struct Profiles {
    time: Vec<f64>,
    pressure_dbar: Vec<f64>,
    sound_m_s: Vec<f64>,
    upright: Vec<f64>,
    range_m: Vec<f64>,
    cell_m: f64,
    /// Velocity, correlation, amplitude of each beam, ping by ping.
    beams: [[Vec<f64>; 3]; 4],
}

impl Profiles {
    fn read(path: &Path) -> Result<Self, String> {
        let file = super::netcdf::open(path).map_err(|e| e.to_string())?;
        let group = group(&file).ok_or("has no profiles of a current profiler")?;
        let most = super::netcdf::budget(path);
        let column = |name: &str| -> Result<Vec<f64>, String> {
            let path = format!("{group}/{name}");
            let declared = file.variable(&path).and_then(|v| Ok(v.num_elements()?)).map_err(|e| e.to_string())?;
            if declared.saturating_mul(8) > most {
                return Err(format!("{name} declares {declared} values, more than a file of this size holds"));
            }
            Ok(file.read_variable_unpacked_masked(&path).map_err(|e| format!("{name}: {e}"))?.iter().copied().collect())
        };
        // MatlabTimeStamp: days since the year 0.
        let time =
            column("time").or_else(|_| Ok::<_, String>(column("MatlabTimeStamp")?.iter().map(|d| (d - 719_529.0) * 86_400.0).collect()))?;
        let beam = |k: usize| -> Result<[Vec<f64>; 3], String> {
            Ok([column(&format!("VelocityBeam{k}"))?, column(&format!("CorrelationBeam{k}"))?, column(&format!("AmplitudeBeam{k}"))?])
        };
        let attribute = |name: &str| {
            let value = file.group("Config").ok()?.attribute(name)?.value.as_f64();
            value.filter(|v| *v > 0.0 && *v < 100.0)
        };
        let range_m = column("Velocity Range")?;
        let coordinates = file.group("Config").ok().and_then(|g| g.attribute("avg_coordSystem")?.value.as_string());
        if let Some(other) = coordinates.filter(|c| !c.eq_ignore_ascii_case("BEAM")) {
            return Err(format!("velocities are in coordinates {other}; export those along the beams (BEAM)"));
        }
        let cell_m = attribute("avg_cellSize").unwrap_or_else(|| range_m.windows(2).next().map_or(1.0, |w| w[1] - w[0]));
        let out = Self {
            pressure_dbar: column("Pressure")?,
            sound_m_s: column("SpeedOfSound").unwrap_or_else(|_| vec![f64::NAN; time.len()]),
            upright: column("AccelerometerZ").unwrap_or_else(|_| vec![-1.0; time.len()]),
            beams: [beam(1)?, beam(2)?, beam(3)?, beam(4)?],
            time,
            range_m,
            cell_m,
        };
        let n = out.time.len();
        let pings = [&out.pressure_dbar, &out.sound_m_s, &out.upright].iter().all(|c| c.len() == n);
        if !pings || out.beams.iter().flatten().any(|c| c.len() != n * out.range_m.len()) {
            return Err("its variables are of different lengths".into());
        }
        Ok(out)
    }

    /// Velocity along a beam in a cell of a ping, where its echo is believed.
    fn along_beam(&self, beam: usize, ping: usize, cell: usize) -> Option<f64> {
        let [velocity, correlation, amplitude] = &self.beams[beam];
        let at = ping * self.range_m.len() + cell;
        let good = correlation[at] >= LEAST_CORRELATION && amplitude[at] <= MOST_AMPLITUDE && velocity[at].abs() <= FASTEST_ECHO_M_S;
        good.then_some(velocity[at])
    }

    fn ping(&self, k: usize) -> Option<Ping> {
        let up = if self.upright[k] < 0.0 { 1.0 } else { -1.0 };
        let (sin, cos) = FORE_AFT_RAD.sin_cos();
        let (mut along, mut across) = (Vec::new(), Vec::new());
        for cell in (1..self.range_m.len()).filter(|c| self.range_m[*c] - 0.5 * self.cell_m < NEAR_M) {
            let beam = |b: usize| self.along_beam(b, k, cell);
            let (Some(left), Some(right)) = (beam(1), beam(3)) else { continue };
            // Toward the side the instrument looks to.
            let away = (left + right) / (2.0 * SIDE_RAD.cos());
            let [fore, aft] = [beam(0).map(|v| (away * cos - v) / sin), beam(2).map(|v| (v - away * cos) / sin)];
            let u = fore.zip(aft).map(|(a, b)| 0.5 * (a + b)).or(fore).or(aft);
            along.extend(u);
            across.extend(u.map(|_| up * away));
        }
        let (unix_s, pressure_pa) = (self.time[k], self.pressure_dbar[k] * 1e4);
        let ping = Ping {
            unix_s,
            pressure_pa,
            along_m_s: quantile(&along, 0.5),
            across_m_s: quantile(&across, 0.5),
            sound_m_s: self.sound_m_s[k],
        };
        (ping.along_m_s.is_finite() && ping.unix_s.is_finite() && pressure_pa > SHALLOW_PA).then_some(ping)
    }
}

/// Gives `imported` the speed that the profiler in `path` measured, at the rows nearest in time. How many values there are.
///
/// # Errors
/// The file cannot be read, or is not of this flight.
pub fn witness(path: &Path, imported: &mut Imported) -> Result<usize, ImportError> {
    let error = |what: String| ImportError::new(path, what);
    let pings: Vec<Ping> = {
        let profiles = Profiles::read(path).map_err(error)?;
        (0..profiles.time.len()).filter_map(|k| profiles.ping(k)).collect()
    };
    let start = imported.report.start_unix_s.ok_or_else(|| error("the flight has no date to bring the profiler's pings to".into()))?;
    let flight = &mut imported.flight;
    let lag_s = clock_apart_s(&pings, start, &Series::new(&flight.time_s, &flight.pressure_pa)).map_err(error)?;
    if lag_s != 0.0 {
        imported.report.note(format!("the current profiler's clock is {lag_s:+.0} s off by its pressure: brought to the flight's"));
    }
    let salinity = flight.extra.get(super::assembly::SALINITY_COLUMN);
    let mut column = flight.speed_m_s.take().unwrap_or_else(|| vec![f64::NAN; flight.len()]);
    let mut used = 0;
    for ping in &pings {
        let t = ping.unix_s - lag_s - start;
        let row = flight.time_s.partition_point(|s| *s < t).min(flight.len() - 1);
        let row = if row > 0 && t - flight.time_s[row - 1] < flight.time_s[row] - t { row - 1 } else { row };
        if (flight.time_s[row] - t).abs() > 30.0 {
            continue;
        }
        // The instrument measures times of travel with a speed of sound that knows no salt.
        let true_m_s =
            seawater::sound_speed_m_s(salinity.map_or(f64::NAN, |s| s[row]), flight.temperature_degc[row], ping.pressure_pa * 1e-4);
        let scale = Some(true_m_s / ping.sound_m_s).filter(|s| (0.9..1.1).contains(s)).unwrap_or(1.0);
        column[row] = scale * ping.along_m_s.hypot(ping.across_m_s);
        used += 1;
    }
    flight.speed_m_s = Some(column);
    let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    imported.report.note(format!("{used} values of speed through the water from the current profiler in {file}"));
    imported.report.files.push(super::FileNote { file, rows: used, problems: Vec::new() });
    if let Some(draft) = &mut imported.vehicle {
        let why = "guess: AD2CP, median over cells within 10 m";
        draft.set("sensors.speed_noise_m_s", SIGMA_M_S, why);
        draft.set("sensors.speed_scale_1sigma", SIGMA_SCALE, why);
    }
    Ok(used)
}

/// By how much the profiler's clock is ahead of the flight's, s, by their pressures; 0 where the clocks agree as well as any shift does.
fn clock_apart_s(pings: &[Ping], start: f64, pressure: &Series) -> Result<f64, String> {
    let off = |lag: f64| -> f64 {
        let apart: Vec<f64> = pings
            .iter()
            .map(|p| (pressure.at_within(p.unix_s - lag - start, 60.0) - p.pressure_pa).abs())
            .filter(|d| d.is_finite())
            .collect();
        if 2 * apart.len() < pings.len() || apart.is_empty() { f64::INFINITY } else { quantile(&apart, 0.5) }
    };
    let best = (-CLOCKS_S..=CLOCKS_S).map(f64::from).min_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap_or(0.0);
    if !(off(best) < PRESSURES_PA) {
        return Err("its pressures are not those of this flight (another deployment, or clocks more than three minutes apart)".into());
    }
    // A shift of a second or two is within the noise of the two sensors.
    Ok(if off(0.0) < off(best) + 1e3 { 0.0 } else { best })
}

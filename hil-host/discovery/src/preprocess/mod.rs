//! Turns a raw flight into what a forward model can be run on: spikes and gaps removed, inputs on a fixed grid, depth to compare with.
//!
//! Method. Spikes go first ([`crate::preprocess::spikes`]). Pitch on the grid is a local quadratic fit over ±[`PITCH_WINDOW_S`]
//! with weights, which also gives the pitch rate; everything else is interpolated linearly. Depth is ∫ dp/(ρ g).
//!
//! A run is a stretch that starts from a known state: a segment of the trial format (floating at the surface), or a cut at a gap.

pub mod clock_offset;
pub(crate) mod ctd_gaps;
pub mod dives;
pub(crate) mod gaps;
pub mod sanity;
pub mod spikes;
pub(crate) mod stuck_sensors;

use crate::ablation::is_on;
use crate::likelihood::displacement::{Fix, Way, fixes, ways};
use crate::preprocess::ctd_gaps::fill_by_depth;
use crate::preprocess::gaps::{changed_unseen, far_from_known, long_gaps};
use crate::preprocess::spikes::{FASTEST, TURN_STROKE_M3, despike, despike_by, turn_allowance};
use crate::preprocess::stuck_sensors::{Removed, TURNED_RAD, unstuck};
use crate::record::flight::Flight;
use crate::vehicle::Vehicle;
use hydro::effects::{Constants, HULL_LAG_S, Sensed};

/// Half width of the local fit of pitch, s (shorter than the pitch mode of 16 s, longer than two samples).
pub const PITCH_WINDOW_S: f64 = 9.0;
/// Longest grid step of the simulation, s.
pub const STEP_S: f64 = 2.0;
/// Steps per decay time of the heave mode, 1: RK4 is stable to 2.78.
const STEP_PER_DECAY: f64 = 2.5;
/// Speed at which that decay is taken, m/s: faster than any glide of a Slocum, guess.
pub(crate) const FAST_M_S: f64 = 0.5;
/// A gap longer than this starts a new run, s.
pub const GAP_S: f64 = 120.0;
/// Depth above which a row is not compared: surface, waves, launch; m (FORMAT section 6.1).
pub const SURFACE_M: f64 = 2.0;
/// Time after the last row above [`SURFACE_M`] before rows are compared, s (FORMAT section 6.1).
pub const SETTLE_S: f64 = 60.0;
/// Observed depth above which the vehicle may be held floating, m: above the zero error of the sensor, below any dive.
pub const FLOAT_M: f64 = 0.5;

/// Inputs at one half step of the grid.
#[derive(Clone, Copy, Debug)]
pub struct Input {
    /// What the sensors said (cleaned).
    pub sensed: Sensed,
    /// Pitch rate, rad/s.
    pub pitch_rate_rad_s: f64,
    /// sin of the measured pitch.
    pub sin_pitch: f64,
    /// cos of the measured pitch.
    pub cos_pitch: f64,
    /// Roll, rad.
    pub roll_rad: f64,
    /// Its cosine.
    pub cos_roll: f64,
    /// sin of the heading.
    pub sin_heading: f64,
    /// cos of the heading.
    pub cos_heading: f64,
    /// Observed depth less what the sensor shows afloat, m.
    pub depth_m: f64,
    /// CD0 at this instant, relative to the law's (1: the law's own).
    pub cd0_relative: f64,
}

/// One stretch of a flight on which the model is run from rest.
#[derive(Clone, Debug)]
pub struct Run {
    /// Segment number in the flight.
    pub segment: u32,
    /// Row of the flight at which the run starts.
    pub first_row: usize,
    /// Time of each row, s.
    pub time_s: Vec<f64>,
    /// Observed depth of each row, m; NaN where the pressure is missing or a spike.
    pub depth_m: Vec<f64>,
    /// Cleaned measured pressure of each row without a gap, Pa.
    pub pressure_pa: Vec<f64>,
    /// Whether the row takes part in fits: submerged, settled, with a depth.
    pub used: Vec<bool>,
    /// Speed through the water of each row, m/s; NaN where there is none.
    pub speed_m_s: Vec<f64>,
    /// Position of the battery at each row, m; NaN where there is none.
    pub battery_m: Vec<f64>,
    /// Reading of the buoyancy engine at each row, gaps filled, m³.
    pub ballast_m3: Vec<f64>,
    /// Inputs at half steps: 0, ½, 1, 1½ … steps from the first row.
    pub inputs: Vec<Input>,
    /// Grid step, s.
    pub step_s: f64,
    /// Mean GPS displacement from start to end (east, north), m, and its 1-sigma error in each direction, m.
    pub displacement_m: Option<(f64, f64, f64)>,
    /// Time between the fixes at the start and those at the end, s; of a way over several runs this run's part of it.
    pub displacement_s: f64,
    /// Mean fixes before the dive and after it.
    pub(crate) fixes: [Option<Fix>; 2],
    /// Whether inputs had to be made up over a stretch.
    pub(crate) blind: bool,
    /// Mean time and mean pressure (Pa) of rows floating at the surface, and how many rows, at the start and at the end.
    pub surface: [Option<(f64, f64, usize)>; 2],
    /// Whether the vehicle floats at the surface at the start.
    pub starts_afloat: bool,
    /// Speed along the hull at the start, m/s: zero afloat; under way what the first depths and pitches say.
    pub start_speed_m_s: f64,
    /// Speed along the hull that the run hardly ever exceeds, from depth and pitch, m/s.
    pub fastest_m_s: f64,
    /// How far beyond the angle of a stall flow that comes from below stays attached, rad; 0 for a stall without a memory.
    pub stalls_late_rad: f64,
}

/// A flight ready for the model.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// Runs in order of time.
    pub runs: Vec<Run>,
    /// Ways over more than one run.
    pub ways: Vec<Way>,
    /// What had to be repaired or left out, for the report.
    pub notes: Vec<String>,
}

/// Linear interpolation in time over missing values; ends are held. All-NaN input gives `fallback`.
pub(crate) fn fill(time: &[f64], value: &[f64], fallback: f64) -> Vec<f64> {
    let known: Vec<usize> = (0..value.len()).filter(|&i| value[i].is_finite()).collect();
    let (Some(&first), Some(&last)) = (known.first(), known.last()) else { return vec![fallback; value.len()] };
    let mut out = value.to_vec();
    out[..first].fill(value[first]);
    out[last..].fill(value[last]);
    for pair in known.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        for i in a + 1..b {
            out[i] = value[a] + (value[b] - value[a]) * (time[i] - time[a]) / (time[b] - time[a]);
        }
    }
    out
}

/// Mean over up to five rows where the ballast engine rests (spread below 4 cc): takes the resolution out, keeps strokes.
fn quiet_ballast(value: &[f64]) -> Vec<f64> {
    (0..value.len())
        .map(|i| {
            let window = &value[i.saturating_sub(4)..(i + 5).min(value.len())];
            let (lo, hi) = window.iter().fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
            if hi - lo < 4.5e-6 { window.iter().sum::<f64>() / window.len() as f64 } else { value[i] }
        })
        .collect()
}

/// Value and slope at `t` of a weighted local quadratic fit to the finite samples within ±`half` (widened until four are found).
fn local_quadratic(time: &[f64], value: &[f64], t: f64, half: f64, from: &mut usize) -> (f64, f64) {
    let mut width = half;
    for _ in 0..6 {
        while *from > 0 && time[*from] > t - width {
            *from -= 1;
        }
        while *from + 1 < time.len() && time[*from] < t - width {
            *from += 1;
        }
        let (mut s, mut b, mut count) = ([0.0_f64; 5], [0.0_f64; 3], 0);
        for i in *from..time.len() {
            let x = (time[i] - t) / width;
            if x >= 1.0 {
                break;
            }
            if x <= -1.0 || !value[i].is_finite() {
                continue;
            }
            let k = 1.0 - x * x;
            let w = k * k;
            let (x2, y) = (x * x, value[i]);
            count += 1;
            s[0] += w;
            s[1] += w * x;
            s[2] += w * x2;
            s[3] += w * x2 * x;
            s[4] += w * x2 * x2;
            b[0] += w * y;
            b[1] += w * x * y;
            b[2] += w * x2 * y;
        }
        if count >= 4 {
            let m = nalgebra::Matrix3::new(s[0], s[1], s[2], s[1], s[2], s[3], s[2], s[3], s[4]);
            if let Some(c) = m.lu().solve(&nalgebra::Vector3::new(b[0], b[1], b[2]))
                && c.iter().all(|v| v.is_finite())
            {
                return (c[0], c[1] / width);
            }
        }
        width *= 1.6;
    }
    // Nothing to fit on: the nearest value, no rate.
    let nearest = (0..time.len()).filter(|&i| value[i].is_finite()).min_by(|&a, &b| (time[a] - t).abs().total_cmp(&(time[b] - t).abs()));
    (nearest.map_or(0.0, |i| value[i]), 0.0)
}

/// Value and slope at `t`, between samples `at` and `at` + 1, of the cubic with the slopes of its neighbours there: what swings within
/// a few samples must not be smoothed away.
fn hermite(time: &[f64], value: &[f64], at: usize, t: f64) -> (f64, f64) {
    let slope = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(time.len() - 1));
        (value[b] - value[a]) / (time[b] - time[a])
    };
    let h = time[at + 1] - time[at];
    let x = ((t - time[at]) / h).clamp(0.0, 1.0);
    let (m0, m1, rise) = (h * slope(at), h * slope(at + 1), value[at + 1] - value[at]);
    // v0 + m0 x + (3 rise − 2 m0 − m1) x² + (m0 + m1 − 2 rise) x³
    let (c2, c3) = (3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise);
    (value[at] + x * (m0 + x * (c2 + x * c3)), (m0 + x * (2.0 * c2 + 3.0 * x * c3)) / h)
}

/// Slope at `t` of the local quadratic fit within ±`half`.
#[must_use]
pub fn local_slope(time: &[f64], value: &[f64], t: f64, half: f64, from: &mut usize) -> f64 {
    local_quadratic(time, value, t, half, from).1
}

/// Decay time of the heave mode of a vehicle with this lift slope (1/rad on S) at a speed, s.
#[must_use]
pub fn heave_decay_s(c: &Constants, slope: f64, speed_m_s: f64) -> f64 {
    c.mass_kg * (1.0 + c.added_mass_heave) / (0.5 * 1025.0 * speed_m_s * slope * c.reference_area_m2)
}

/// Grid step on which the heave mode of a vehicle stays stable within three tolerances of its lift, s. The mode decays with
/// m (1 + k2) / (½ ρ U a S): 1.1 to 4 s for light loads, half of that for large wings.
#[must_use]
pub fn step_s(vehicle: &Vehicle) -> f64 {
    let c = &vehicle.constants;
    let slope = c.lift_slope_per_rad * (1.0 + 3.0 * vehicle.tolerance.lift_slope_relative);
    (STEP_PER_DECAY * heave_decay_s(c, slope, FAST_M_S)).clamp(0.25, STEP_S)
}

/// Cleans a flight and lays its inputs on the grid.
#[must_use]
pub fn prepare(flight: &Flight, vehicle: &Vehicle) -> Prepared {
    let mut runs = Vec::new();
    let mut notes = Vec::new();
    let mut removed = Removed::default();
    let flight = &unstuck(flight, &mut removed);
    let aligned = is_on("clock_from_pressures").then(|| crate::preprocess::clock_offset::aligned(flight)).flatten();
    if let Some((_, tau)) = &aligned {
        notes.push(format!(
            "pitch, roll and ballast were {:.1} s {} of the CTD (two pressure sensors compared) and were shifted to its clock",
            tau.abs(),
            if *tau < 0.0 { "ahead" } else { "behind" }
        ));
    }
    let flight = aligned.as_ref().map_or(flight, |a| &a.0);
    let dives = crate::preprocess::dives::cut(flight, vehicle);
    if dives.is_some() {
        notes.push("the flight is one long segment: it was cut into its dives, and segments here are dives".into());
    }
    let segment = dives.as_ref().unwrap_or(&flight.segment);
    let n = flight.len();
    let mut start = 0;
    while start < n {
        let mut end = start + 1;
        while end < n && segment[end] == segment[start] && flight.time_s[end] - flight.time_s[end - 1] < GAP_S {
            end += 1;
        }
        if end - start >= 12 && flight.pressure_pa[start..end].iter().filter(|v| v.is_finite()).count() >= 8 {
            let mut one = run(flight, vehicle, start, end, &mut removed);
            one.segment = segment[start];
            // A dive that was cut out starts and ends under way, not afloat.
            if start > 0 && flight.segment[start] == flight.segment[start - 1] && dives.is_some() {
                one.surface[0] = None;
                one.starts_afloat = false;
            }
            if end < n && flight.segment[end] == flight.segment[end - 1] && dives.is_some() {
                one.surface[1] = None;
            }
            if one.depth_m.iter().filter(|z| z.is_nan()).count() * 2 > one.depth_m.len() {
                notes.push(format!("segment {}: more than half of it has no pitch, ballast, density or pressure; left out", one.segment));
            } else {
                runs.push(one);
            }
        } else {
            notes.push(format!("rows {start} to {end} (segment {}) are too few to run a model on; left out", segment[start]));
        }
        start = end;
    }
    removed.note(&mut notes);
    if !flight.temperature_degc.iter().any(|t| t.is_finite()) {
        notes.push("there is no temperature: the hull's thermal expansion is left out, and nothing is learned about it".into());
    }
    let ways = ways(&mut runs, vehicle.sensors.gps_noise_m);
    Prepared { runs, ways, notes }
}

/// Spread of readings afloat, Pa: sensor noise and ripples; and the highest zero error that is believed, Pa.
const AFLOAT_PA: f64 = 1200.0;
const MOST_ZERO_PA: f64 = 5e4;

/// Mean time and median pressure of the readings afloat at the start and at the end of a run: buoyant, and not changing.
fn surface_readings(time: &[f64], pressure: &[f64], ballast: &[f64]) -> [Option<(f64, f64, usize)>; 2] {
    let n = time.len();
    [false, true].map(|late| {
        let order: Vec<usize> = if late { (0..n).rev().collect() } else { (0..n).collect() };
        let mut rows: Vec<usize> = Vec::new();
        for i in order.into_iter().filter(|&i| pressure[i].is_finite()) {
            let mut seen: Vec<f64> = rows.iter().map(|&r| pressure[r]).collect();
            seen.sort_by(f64::total_cmp);
            let off = seen.get(seen.len() / 2).is_some_and(|m| (pressure[i] - m).abs() > AFLOAT_PA);
            if ballast[i] <= 0.0 || off || pressure[i].abs() > MOST_ZERO_PA {
                break;
            }
            rows.push(i);
        }
        // The last rows before the dive (after the surfacing) are already (still) under way.
        let edge = rows.last().map(|&r| time[r]);
        rows.retain(|&r| edge.is_some_and(|e| (time[r] - e).abs() > 8.5));
        if rows.len() < 2 {
            return None;
        }
        let k = rows.len() as f64;
        let mut seen: Vec<f64> = rows.iter().map(|&r| pressure[r]).collect();
        seen.sort_by(f64::total_cmp);
        let median = 0.5 * (seen[(seen.len() - 1) / 2] + seen[seen.len() / 2]);
        Some((rows.iter().map(|&r| time[r]).sum::<f64>() / k, median, rows.len()))
    })
}

/// Most that a pump or a valve moves in a second, m³: several times what gliders have.
const FASTEST_BALLAST_M3_S: f64 = 1e-3;
fn run(flight: &Flight, vehicle: &Vehicle, start: usize, end: usize, removed: &mut Removed) -> Run {
    let rows = start..end;
    let time = &flight.time_s[rows.clone()];
    let sensors = &vehicle.sensors;
    let mut pressure = flight.pressure_pa[rows.clone()].to_vec();
    let mut pitch = flight.pitch_rad[rows.clone()].to_vec();
    let mut speed = flight.speed_m_s.as_ref().map_or_else(|| vec![f64::NAN; time.len()], |s| s[rows.clone()].to_vec());
    let mut density = flight.density_kg_m3[rows.clone()].to_vec();
    let heading = &flight.heading_rad[rows.clone()];
    let spikes = &mut removed.spikes;
    spikes[0] += despike(time, &mut pressure, 1500.0 + 6.0 * sensors.pressure_noise_pa, FASTEST.pressure_pa_s);
    let mut seen_ballast = flight.ballast_m3[rows.clone()].to_vec();
    spikes[4] += despike(time, &mut seen_ballast, TURN_STROKE_M3, FASTEST_BALLAST_M3_S);
    let raw_ballast = fill(time, &seen_ballast, 0.0);
    let turning = turn_allowance(time, &raw_ballast);
    spikes[1] += despike_by(time, &mut pitch, &|i| 0.035 + 6.0 * sensors.pitch_noise_rad + turning[i], FASTEST.angle_rad_s);
    spikes[2] += despike(time, &mut density, 0.25, FASTEST.density_kg_m3_s);
    let mut temperature = flight.temperature_degc[rows.clone()].to_vec();
    despike(time, &mut temperature, 1.0, FASTEST.temperature_k_s);
    spikes[3] += despike(time, &mut speed, 8.0 * sensors.speed_noise_m_s, FASTEST.speed_m_s2);
    let mut roll = flight.roll_rad[rows.clone()].to_vec();
    despike(time, &mut roll, 0.3, FASTEST.angle_rad_s);

    let whole_pressure = fill(time, &pressure, 0.0);
    let raw_density = density;
    let density = fill_by_depth(time, &whole_pressure, &raw_density, 1025.0);
    let temperature = fill_by_depth(time, &whole_pressure, &temperature, vehicle.constants.reference_temperature_degc);
    let ballast = quiet_ballast(&raw_ballast);
    let roll = fill(time, &roll, 0.0);
    let ahead: [Vec<f64>; 2] = [heading.iter().map(|h| h.sin()).collect(), heading.iter().map(|h| h.cos()).collect()];
    let [sin_heading, cos_heading] = [0, 1].map(|k| fill(time, &ahead[k], 0.0));

    let g = vehicle.constants.gravity_m_s2;
    let mut whole_depth = Vec::with_capacity(time.len());
    let mut z = whole_pressure[0] / (density[0] * g);
    for i in 0..time.len() {
        if i > 0 {
            z += (whole_pressure[i] - whole_pressure[i - 1]) * 2.0 / ((density[i] + density[i - 1]) * g);
        }
        whole_depth.push(z);
    }
    // What the sensor shows afloat: its zero error, drifted or not.
    let afloat: Vec<f64> = surface_readings(time, &pressure, &ballast).iter().flatten().map(|r| r.1 / (density[0] * g)).collect();
    let zero = if afloat.is_empty() { 0.0 } else { afloat.iter().sum::<f64>() / afloat.len() as f64 };
    // Where an input was made up over a long silence, the model cannot be held to account.
    let mut silent = vec![false; time.len()];
    for input in [&pitch, &seen_ballast, &raw_density] {
        silent.iter_mut().zip(far_from_known(time, input)).for_each(|(s, lonely)| *s |= lonely);
    }
    removed.silent_rows += silent.iter().filter(|s| **s).count();
    for (input, much) in [(&pitch, TURNED_RAD), (&seen_ballast, TURN_STROKE_M3)] {
        // A vehicle that comes up bobs: what its pitch did there is of no account.
        let submerged = whole_depth.iter().map(|z| *z >= SURFACE_M);
        for ((s, unseen), submerged) in silent.iter_mut().zip(changed_unseen(time, input, much)).zip(submerged) {
            let unseen = unseen && submerged;
            removed.unseen_rows += usize::from(unseen && !*s);
            *s |= unseen;
        }
    }
    let depth: Vec<f64> = (0..time.len()).map(|i| if pressure[i].is_finite() && !silent[i] { whole_depth[i] } else { f64::NAN }).collect();
    let mut last_shallow = f64::NEG_INFINITY;
    let starts_afloat = whole_depth[0] < SURFACE_M;
    if !starts_afloat {
        last_shallow = time[0];
    }
    let used = (0..time.len())
        .map(|i| {
            if whole_depth[i] < SURFACE_M {
                last_shallow = time[i];
            }
            time[i] - last_shallow > SETTLE_S && depth[i].is_finite()
        })
        .collect();

    let whole_pitch = fill(time, &pitch, 0.0);
    // A local fit would reach over a gap with samples of one side.
    let mut in_gap = vec![false; time.len()];
    for (a, b) in long_gaps(time, &pitch) {
        in_gap[a..b].fill(true);
    }
    let first_pitch = pitch.iter().copied().find(|p| p.is_finite()).unwrap_or(0.0);
    let start_speed_m_s = if starts_afloat { 0.0 } else { start_speed_m_s(time, &whole_depth, first_pitch.sin()) };

    // Half-step grid.
    let step = step_s(vehicle);
    let count = ((time[time.len() - 1] - time[0]) / (0.5 * step)).ceil() as usize + 3;
    let mut inputs = Vec::with_capacity(count);
    let follows = 1.0 - (-0.5 * step / HULL_LAG_S).exp();
    let mut hull_degc = temperature[0];
    let (mut at, mut from) = (0usize, 0usize);
    for j in 0..count {
        let t = time[0] + j as f64 * 0.5 * step;
        while at + 2 < time.len() && time[at + 1] <= t {
            at += 1;
        }
        let f = ((t - time[at]) / (time[at + 1] - time[at])).clamp(0.0, 1.0);
        let mix = |v: &[f64]| v[at] + (v[at + 1] - v[at]) * f;
        let within = t.min(time[time.len() - 1]);
        let (theta, q) = if in_gap[at] {
            (mix(&whole_pitch), (whole_pitch[at + 1] - whole_pitch[at]) / (time[at + 1] - time[at]))
        } else if turning[at].max(turning[at + 1]) > 0.0 {
            hermite(time, &whole_pitch, at, within)
        } else {
            local_quadratic(time, &pitch, within, PITCH_WINDOW_S, &mut from)
        };
        let (temperature_degc, roll_rad) = (mix(&temperature), mix(&roll));
        hull_degc += follows * (temperature_degc - hull_degc);
        let (sh, ch) = (mix(&sin_heading), mix(&cos_heading));
        let norm = sh.hypot(ch).max(1e-9);
        inputs.push(Input {
            sensed: Sensed {
                time_s: t,
                pitch_rad: theta,
                ballast_m3: mix(&ballast),
                density_kg_m3: mix(&density),
                temperature_degc,
                hull_degc,
                pressure_pa: mix(&whole_pressure),
            },
            pitch_rate_rad_s: q,
            sin_pitch: theta.sin(),
            cos_pitch: theta.cos(),
            roll_rad,
            cos_roll: roll_rad.cos(),
            sin_heading: sh / norm,
            cos_heading: ch / norm,
            depth_m: mix(&whole_depth) - zero,
            cd0_relative: 1.0,
        });
    }

    let fixes = fixes(flight, rows.clone());
    // A way through the water on inputs that were made up is none.
    let unsteered = |part: &Vec<f64>| far_from_known(time, part).contains(&true) || changed_unseen(time, part, TURNED_RAD).contains(&true);
    let blind = silent.contains(&true) || ahead.iter().any(unsteered);
    let (displacement_m, displacement_s) = match fixes {
        [Some(a), Some(b)] if !blind => (Some(a.to(&b, sensors.gps_noise_m)), b.time_s - a.time_s),
        _ => (None, f64::NAN),
    };
    let surface = surface_readings(time, &pressure, &ballast);
    let fastest_m_s = fastest_m_s(&inputs, step);
    Run {
        segment: flight.segment[start],
        first_row: start,
        time_s: time.to_vec(),
        depth_m: depth,
        pressure_pa: whole_pressure,
        used,
        speed_m_s: speed,
        battery_m: flight.battery_mass_m[rows].to_vec(),
        ballast_m3: ballast,
        inputs,
        step_s: step,
        displacement_m,
        displacement_s,
        fixes,
        blind,
        surface,
        starts_afloat,
        start_speed_m_s,
        fastest_m_s,
        stalls_late_rad: 0.0,
    }
}

/// Time over which the speed at the start of a run is taken, s: short against the 10 s in which speed changes.
const START_S: f64 = 9.0;
/// Speed along the hull where depth and pitch say nothing (at a turning point the depth stands still, the vehicle does not), m/s.
const TURNING_SPEED_M_S: f64 = 0.2;
/// Speeds that depth and pitch are believed, m/s, and the least sine of the pitch that says anything.
const START_SPEEDS_M_S: std::ops::RangeInclusive<f64> = 0.1..=0.6;
const LEAST_SIN_PITCH: f64 = 0.1;

/// Speed along the hull of a vehicle under way, m/s: a model that starts from rest there falls flat, and may stay stalled for the
/// whole glide.
fn start_speed_m_s(time_s: &[f64], depth_m: &[f64], sin_pitch: f64) -> f64 {
    let last = time_s.iter().take_while(|t| **t - time_s[0] <= START_S).count().max(2) - 1;
    let speed = (depth_m[0] - depth_m[last]) / (time_s[last] - time_s[0]) / sin_pitch;
    if sin_pitch.abs() > LEAST_SIN_PITCH && START_SPEEDS_M_S.contains(&speed) { speed } else { TURNING_SPEED_M_S }
}

/// Time over which the speed under way is taken, s.
const WAY_S: f64 = 20.0;
/// Share of the run that may be faster: turns, and depths that jump.
const FASTER: f64 = 0.02;
/// Least sine of the pitch of a glide.
const GLIDE_SIN_PITCH: f64 = 0.2;
/// Speeds that are believed of a whole run, m/s.
const RUN_SPEEDS_M_S: (f64, f64) = (0.25, 1.0);

/// Speed along the hull that a run hardly ever exceeds, m/s. The path is steeper than the pitch, so this errs on the fast side.
fn fastest_m_s(inputs: &[Input], step_s: f64) -> f64 {
    let apart = ((2.0 * WAY_S / step_s) as usize).max(1);
    let speed = |pair: (&Input, &Input)| {
        let sin_pitch = 0.5 * (pair.0.sin_pitch + pair.1.sin_pitch);
        let sink = (pair.1.depth_m - pair.0.depth_m) / (pair.1.sensed.time_s - pair.0.sensed.time_s);
        (sin_pitch.abs() > GLIDE_SIN_PITCH).then(|| -sink / sin_pitch).filter(|u| u.is_finite())
    };
    let mut speeds: Vec<f64> = inputs.iter().zip(inputs.iter().skip(apart)).filter_map(speed).collect();
    speeds.sort_by(f64::total_cmp);
    let at = (speeds.len() as f64 * (1.0 - FASTER)) as usize;
    speeds.get(at).map_or(FAST_M_S, |u| u.clamp(RUN_SPEEDS_M_S.0, RUN_SPEEDS_M_S.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_under_way_starts_at_the_speed_its_depth_and_pitch_say_and_in_a_turn_at_a_usual_one() {
        let time: Vec<f64> = (0..9).map(|i| 2.0 * f64::from(i)).collect();
        let sinking = |rate: f64| time.iter().map(|t| 20.0 + rate * t).collect::<Vec<_>>();
        // 0.12 m/s down at 24 degrees nose down: 0.295 m/s along the hull.
        assert!((start_speed_m_s(&time, &sinking(0.12), -0.407) - 0.12 / 0.407).abs() < 1e-12);
        for (rate, sin_pitch) in [(0.0, -0.4), (0.12, 0.4), (0.12, -0.05), (-0.9, 0.4), (0.12, 0.0)] {
            assert_eq!(start_speed_m_s(&time, &sinking(rate), sin_pitch), TURNING_SPEED_M_S, "{rate} {sin_pitch}");
        }
    }

    #[test]
    fn a_run_is_as_fast_as_its_glides_whatever_its_turns_and_jumps_say() {
        let step_s = 1.0;
        // Ten minutes down at 0.2 m/s and 24 degrees (0.49 m/s along the hull), a slower climb, and a jump of the pressure of 40 m.
        let input = |j: usize| {
            let time_s = 0.5 * j as f64;
            let down = time_s < 600.0;
            let depth_m = if down { 0.2 * time_s } else { 120.0 - 0.1 * (time_s - 600.0) } + if j == 900 { 40.0 } else { 0.0 };
            let pitch_rad: f64 = if down { -0.42 } else { 0.42 };
            let sensed = Sensed {
                time_s,
                pitch_rad,
                ballast_m3: 0.0,
                density_kg_m3: 1000.0,
                temperature_degc: 10.0,
                hull_degc: 10.0,
                pressure_pa: depth_m * 1e4,
            };
            let (sin_pitch, cos_pitch) = pitch_rad.sin_cos();
            Input {
                sensed,
                pitch_rate_rad_s: 0.0,
                sin_pitch,
                cos_pitch,
                roll_rad: 0.0,
                cos_roll: 1.0,
                sin_heading: 0.0,
                cos_heading: 1.0,
                depth_m,
                cd0_relative: 1.0,
            }
        };
        let inputs: Vec<Input> = (0..3600).map(input).collect();
        let fastest = fastest_m_s(&inputs, step_s);
        assert!((fastest - 0.2 / 0.42_f64.sin()).abs() < 1e-6, "{fastest} m/s");
        assert_eq!(fastest_m_s(&inputs[..10], step_s), FAST_M_S);
    }

    #[test]
    fn accuracy_a_cubic_between_samples_meets_a_swing_of_16_s_where_the_local_fit_flattens_it() {
        let time: Vec<f64> = (0..20).map(|i| 4.0 * f64::from(i)).collect();
        let omega = std::f64::consts::TAU / 16.0;
        let pitch: Vec<f64> = time.iter().map(|t| 0.3 * (omega * t).sin()).collect();
        let (mut worst, mut of_rate, mut flattened) = (0.0_f64, 0.0_f64, 0.0_f64);
        for i in 0..160 {
            let t = 20.0 + 0.1 * f64::from(i);
            let (exact, rate) = (0.3 * (omega * t).sin(), 0.3 * omega * (omega * t).cos());
            let (v, q) = hermite(&time, &pitch, (t / 4.0) as usize, t);
            worst = worst.max((v - exact).abs());
            of_rate = of_rate.max((q - rate).abs());
            flattened = flattened.max((local_quadratic(&time, &pitch, t, PITCH_WINDOW_S, &mut 0).0 - exact).abs());
        }
        // Four samples a period: slopes by central differences are 2/pi of the true 0.118 rad/s. By hand 0.0279 rad and 0.0428 rad/s,
        // where the local fit is off by 0.0549 rad.
        assert!(worst < 0.028 && of_rate < 0.043 && flattened > 0.0549, "{worst} rad, {of_rate} rad/s, {flattened} rad");
    }

    #[test]
    fn accuracy_local_fit_gives_value_and_rate_of_a_parabola() {
        let time: Vec<f64> = (0..30).map(|i| f64::from(i) * 3.7).collect();
        let value: Vec<f64> = time.iter().map(|t| 0.3 - 0.01 * t + 1e-4 * t * t).collect();
        let mut from = 0;
        let (v, q) = local_quadratic(&time, &value, 41.3, 9.0, &mut from);
        assert!((v - (0.3 - 0.413 + 1e-4 * 41.3 * 41.3)).abs() < 1e-9 && (q - (-0.01 + 2e-4 * 41.3)).abs() < 1e-9, "{v} {q}");
    }
}

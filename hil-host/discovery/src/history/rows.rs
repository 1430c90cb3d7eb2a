//! Steady rows of a dive: means of 40 s in which pitch, roll and ballast stand still, with the slope of pressure as the vertical velocity.
//!
//! The covariance of a vehicle's numbers is learnt from hundreds of linearisations, which a dynamic model would take hours for; rows
//! far from a turn need no inertia, and forty seconds average sensor noise and most water motion.

use super::numbers::Numbers;
use logs::record::flight::Flight;

const GRAVITY_M_S2: f64 = 9.81;
/// Length of a row, s; where samples are rarer, 3.2 of them.
const ROW_S: f64 = 40.0;
/// Parts that the time between two samples is cut in: where a segment has too few rows, a row is the rate between two samples.
const PARTS_OF_A_PERIOD: [usize; 2] = [1, 3];
/// A leg without rows for so long is another one, s; blocks of rows are about so long.
const LONGEST_PIECE_S: f64 = 1500.0;
/// Fewest rows of a unit that can be judged, and of them on each leg.
pub const FEWEST_STEADY_ROWS: usize = 14;
/// See above.
pub const FEWEST_OF_A_LEG: usize = 4;

/// One steady row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Time, s.
    pub time_s: f64,
    /// Gauge pressure, Pa.
    pub pressure_pa: f64,
    /// Vertical velocity, m/s, up.
    pub rise_m_s: f64,
    /// Density, kg/m³.
    pub density_kg_m3: f64,
    /// Temperature, °C.
    pub temperature_degc: f64,
    /// Measured pitch, rad.
    pub pitch_rad: f64,
    /// Roll, rad; 0 where it is not measured.
    pub roll_rad: f64,
    /// Heading, rad; 0 where it is not measured.
    pub heading_rad: f64,
    /// Measured ballast, m³.
    pub ballast_m3: f64,
    /// 1 in a climb, -1 in a dive.
    pub way: f64,
    /// Number of its block: a leg or a piece of about 25 minutes of it.
    pub block: usize,
}

/// Steady rows of one dive or segment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unit {
    /// Name: of the flight, and its segment.
    pub id: String,
    /// Segment of its flight.
    pub segment: u32,
    /// Rows in the order of time.
    pub rows: Vec<Row>,
    /// Pressure that was read afloat, Pa; NaN where none was.
    pub afloat_pa: f64,
    /// What is known already of the vehicle in this unit beyond its other units, in sizes of the numbers: a change that was found.
    pub beyond: Numbers,
}

impl Unit {
    /// Time of its first row, s.
    #[must_use]
    pub fn start_s(&self) -> f64 {
        self.rows.first().map_or(f64::NAN, |r| r.time_s)
    }

    /// Time between its first and last row, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.rows.last().map_or(f64::NAN, |r| r.time_s) - self.start_s()
    }

    /// Number of blocks.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.rows.iter().map(|r| r.block + 1).max().unwrap_or(0)
    }
}

/// Whether both legs have rows enough to judge.
fn is_whole(rows: &[Row]) -> bool {
    let climbing = rows.iter().filter(|r| r.way > 0.0).count();
    rows.len() >= FEWEST_STEADY_ROWS && climbing.min(rows.len() - climbing) >= FEWEST_OF_A_LEG
}

/// Median of finite values; NaN without any.
#[must_use]
pub fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut v: Vec<f64> = values.filter(|x| x.is_finite()).collect();
    let middle = v.len() / 2;
    if v.is_empty() {
        return f64::NAN;
    }
    let upper = *v.select_nth_unstable_by(middle, f64::total_cmp).1;
    if v.len() % 2 == 1 { upper } else { 0.5 * (upper + v[..middle].iter().copied().fold(f64::NEG_INFINITY, f64::max)) }
}

/// How far the buoyancy engine moves to either side, median over the rows of all units, m³.
#[must_use]
pub fn drive_m3(units: &[Unit]) -> f64 {
    let of_unit = |u: &Unit| {
        let leg = |way: f64| median(u.rows.iter().filter(|r| r.way == way).map(|r| r.ballast_m3));
        let middle = 0.5 * (leg(1.0) + leg(-1.0));
        u.rows.iter().map(|r| (r.ballast_m3 - middle).abs()).collect::<Vec<_>>()
    };
    median(units.iter().flat_map(of_unit))
}

/// Mean temperature of all rows, °C: about it an error of the thermal expansion is no error of trim.
#[must_use]
pub fn mean_temperature_degc(units: &[Unit]) -> f64 {
    let rows = units.iter().flat_map(|u| &u.rows);
    let (sum, n) = rows.fold((0.0, 0.0), |(s, n), r| (s + r.temperature_degc, n + 1.0));
    sum / n
}

/// Units of a flight: the steady rows of every segment that has enough of them, stubs left out.
#[must_use]
pub fn units(flight: &Flight) -> Vec<Unit> {
    let mut out = Vec::new();
    let mut first = 0;
    for end in 1..=flight.len() {
        if end < flight.len() && flight.segment[end] == flight.segment[first] {
            continue;
        }
        let of = |finer: &usize| samples(flight, first..end, *finer).map(|s| steady_rows(&s)).filter(|rows| is_whole(rows));
        let rows = PARTS_OF_A_PERIOD.iter().find_map(of).unwrap_or_default();
        let afloat_pa = afloat_pa(&flight.pressure_pa[first..end]);
        let segment = flight.segment[first];
        out.push(Unit { id: format!("{} {segment}", flight.name), segment, rows, afloat_pa, beyond: Numbers::zeros() });
        first = end;
    }
    without_stubs(out)
}

/// Pressure of a segment's readings afloat: the median of those within 0.3 dbar of the least, where there are three that shallow.
fn afloat_pa(pressure_pa: &[f64]) -> f64 {
    const NEAR_PA: f64 = 3e3;
    const SHALLOW_PA: f64 = 2e4;
    let least = pressure_pa.iter().copied().filter(|p| p.is_finite()).fold(f64::INFINITY, f64::min);
    let near = || pressure_pa.iter().copied().filter(|p| *p <= least + NEAR_PA);
    if least.abs() < SHALLOW_PA && near().count() >= 3 { median(near()) } else { f64::NAN }
}

/// Units that can be judged and are no stubs: at least a fifth of the usual number of rows.
#[must_use]
pub fn without_stubs(mut units: Vec<Unit>) -> Vec<Unit> {
    units.retain(|u| is_whole(&u.rows));
    let usual = median(units.iter().map(|u| u.rows.len() as f64));
    units.retain(|u| u.rows.len() as f64 >= 0.2 * usual);
    units
}

/// A channel at other instants: linear between its samples, NaN in gaps.
fn channel(time_s: &[f64], values: &[f64], at_s: &[f64], longest_gap_s: f64, period_s: f64) -> Vec<f64> {
    let samples: Vec<(f64, f64)> =
        time_s.iter().zip(values).filter(|(t, v)| t.is_finite() && v.is_finite()).map(|(t, v)| (*t, *v)).collect();
    if samples.len() < 5 {
        return vec![f64::NAN; at_s.len()];
    }
    let longest = longest_gap_s.max(4.0 * period_s);
    let one = |t: f64| {
        let i = samples.partition_point(|s| s.0 < t).clamp(1, samples.len() - 1);
        let ((t0, v0), (t1, v1)) = (samples[i - 1], samples[i]);
        let nearest = (t - t1).abs().min((t0 - t).abs());
        if t1 - t0 > longest && nearest > 2.0 * period_s {
            return f64::NAN;
        }
        let share = ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
        v0 + share * (v1 - v0)
    };
    at_s.iter().map(|t| one(*t)).collect()
}

/// Headings without jumps of a full turn.
fn unwrapped(heading_rad: &[f64]) -> Vec<f64> {
    let mut last = f64::NAN;
    let one = |&h: &f64| {
        if h.is_finite() && last.is_finite() {
            let turns = ((h - last) / std::f64::consts::TAU).round();
            last = h - turns * std::f64::consts::TAU;
        } else if h.is_finite() {
            last = h;
        }
        if h.is_finite() { last } else { f64::NAN }
    };
    heading_rad.iter().map(one).collect()
}

/// -1, 0, 1.
fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// What is known of the samples of one stretch of 40 s.
#[derive(Clone, Copy, Debug)]
struct Cell {
    n: f64,
    sum: Row,
    /// Spans: lowest and highest.
    ballast: [f64; 2],
    pitch: [f64; 2],
    roll: [f64; 2],
    /// Σ (t - mean)², and of it with pressure.
    tt: f64,
    tp: f64,
}

const EMPTY: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// A span that holds a further value; of a missing one it is missing.
fn with(span: [f64; 2], x: f64) -> [f64; 2] {
    if x.is_nan() || span[0].is_nan() { [f64::NAN; 2] } else { [span[0].min(x), span[1].max(x)] }
}

/// Samples of a segment at which pressure is measured, other channels interpolated there.
struct Samples {
    rows: Vec<Row>,
    period_s: f64,
}

fn samples(flight: &Flight, range: std::ops::Range<usize>, finer: usize) -> Option<Samples> {
    let time = &flight.time_s[range.clone()];
    let (mut at, mut pressure) = (Vec::new(), Vec::new());
    for (t, p) in time.iter().zip(&flight.pressure_pa[range.clone()]) {
        if t.is_finite() && p.is_finite() && at.last().is_none_or(|last| t - last > 0.2) {
            at.push(*t);
            pressure.push(*p);
        }
    }
    if at.len() < 20 {
        return None;
    }
    let period_s = median(at.windows(2).map(|w| w[1] - w[0]));
    if finer > 1 {
        let between = |a: f64, b: f64| move |k: usize| a + (b - a) * k as f64 / finer as f64;
        let parts: Vec<f64> = at.windows(2).flat_map(|w| (0..finer).map(between(w[0], w[1]))).chain(at.last().copied()).collect();
        pressure = channel(&at, &pressure, &parts, 60.0, period_s);
        at = parts;
    }
    let of = |column: &[f64], gap_s: f64| channel(time, column, &at, gap_s, period_s);
    let pitch = of(&flight.pitch_rad[range.clone()], 60.0);
    let roll = of(&flight.roll_rad[range.clone()], 60.0);
    let heading = of(&unwrapped(&flight.heading_rad[range.clone()]), 60.0);
    let ballast = of(&flight.ballast_m3[range.clone()], 60.0);
    let temperature = of(&flight.temperature_degc[range.clone()], 300.0);
    let density = of(&flight.density_kg_m3[range], 300.0);
    let row = |i: usize| Row {
        time_s: at[i],
        pressure_pa: pressure[i],
        rise_m_s: 0.0,
        density_kg_m3: density[i],
        temperature_degc: temperature[i],
        pitch_rad: pitch[i],
        roll_rad: roll[i],
        heading_rad: heading[i],
        ballast_m3: ballast[i],
        way: 0.0,
        block: 0,
    };
    Some(Samples { rows: (0..at.len()).map(row).collect(), period_s: period_s / finer as f64 })
}

fn cells(samples: &Samples, length_s: f64) -> Vec<Cell> {
    let start = samples.rows[0].time_s;
    let of = |r: &Row| ((r.time_s - start) / length_s) as usize;
    let blank = Cell { n: 0.0, sum: Row::default(), ballast: EMPTY, pitch: EMPTY, roll: EMPTY, tt: 0.0, tp: 0.0 };
    let mut cells = vec![blank; of(&samples.rows[samples.rows.len() - 1]) + 1];
    for r in &samples.rows {
        let c = &mut cells[of(r)];
        c.n += 1.0;
        c.sum.time_s += r.time_s - start;
        c.sum.pressure_pa += r.pressure_pa;
        c.sum.density_kg_m3 += r.density_kg_m3;
        c.sum.temperature_degc += r.temperature_degc;
        c.sum.pitch_rad += r.pitch_rad;
        c.sum.roll_rad += r.roll_rad;
        c.sum.heading_rad += r.heading_rad;
        c.sum.ballast_m3 += r.ballast_m3;
        c.ballast = with(c.ballast, r.ballast_m3);
        c.pitch = with(c.pitch, r.pitch_rad);
        c.roll = with(c.roll, r.roll_rad);
    }
    for c in &mut cells {
        let n = c.n.max(1.0);
        let s = c.sum;
        c.sum = Row {
            time_s: start + s.time_s / n,
            pressure_pa: s.pressure_pa / n,
            density_kg_m3: s.density_kg_m3 / n,
            temperature_degc: s.temperature_degc / n,
            pitch_rad: s.pitch_rad / n,
            roll_rad: s.roll_rad / n,
            heading_rad: s.heading_rad / n,
            ballast_m3: s.ballast_m3 / n,
            ..s
        };
    }
    for r in &samples.rows {
        let c = &mut cells[of(r)];
        let late = r.time_s - c.sum.time_s;
        c.tt += late * late;
        c.tp += late * (r.pressure_pa - c.sum.pressure_pa);
    }
    cells
}

/// Deepest mean pressure of the leg that each cell is in and of its neighbours: turns are near it.
fn turns_pa(slope_pa_s: &[f64], cells: &[Cell]) -> Vec<f64> {
    let mut leg = vec![0; cells.len()];
    for i in 1..cells.len() {
        leg[i] = leg[i - 1] + usize::from(sign(slope_pa_s[i]) != sign(slope_pa_s[i - 1]));
    }
    let mut deepest = vec![0.0_f64; leg.last().map_or(0, |l| l + 1)];
    leg.iter().zip(cells).for_each(|(l, c)| deepest[*l] = deepest[*l].max(c.sum.pressure_pa));
    let about = |l: usize| (l.saturating_sub(1)..=(l + 1).min(deepest.len() - 1)).map(|k| deepest[k]).fold(0.0, f64::max);
    leg.into_iter().map(about).collect()
}

/// Steady rows of a segment's samples; none where pitch, ballast or density are missing.
fn steady_rows(samples: &Samples) -> Vec<Row> {
    const DBAR_PA: f64 = 1e4;
    let length_s = ROW_S.max(3.2 * samples.period_s);
    let cells = cells(samples, length_s);
    let slope: Vec<f64> = cells.iter().map(|c| -c.tp / c.tt.max(1e-9)).collect();
    let turns = turns_pa(&slope, &cells);
    let deepest = samples.rows.iter().map(|r| r.pressure_pa).fold(f64::NEG_INFINITY, f64::max);
    let [low, high] = samples.rows.iter().filter(|r| r.ballast_m3.is_finite()).fold(EMPTY, |s, r| with(s, r.ballast_m3));
    let still_m3 = (0.02 * (high - low)).max(4e-6);
    let steady = |i: usize| {
        let (c, before, m) = (&cells[i], &cells[i - 1], &cells[i].sum);
        let ballast = [before.ballast[0], before.ballast[1]].into_iter().filter(|b| !b.is_infinite()).fold(c.ballast, with);
        c.n >= 3.0
            && c.tt / c.n > (0.2 * length_s).powi(2)
            && ballast[1] - ballast[0] < still_m3
            && c.pitch[1] - c.pitch[0] < 0.14
            && (m.pitch_rad - before.sum.pitch_rad).abs() < 0.09
            && (c.roll[1] - c.roll[0] <= 0.26 || c.roll[0].is_nan())
            && m.pitch_rad.abs() > 0.14
            && sign(m.pitch_rad) == sign(slope[i])
            && slope[i].abs() > 200.0
            && m.pressure_pa > (20.0 * DBAR_PA).min(0.15 * deepest)
            && m.pressure_pa <= turns[i] - (10.0 * DBAR_PA).min(0.1 * deepest)
            && (m.density_kg_m3 + m.ballast_m3 + m.temperature_degc).is_finite()
    };
    let row = |i: usize| Row {
        rise_m_s: slope[i] / (cells[i].sum.density_kg_m3 * GRAVITY_M_S2),
        way: sign(slope[i]),
        roll_rad: if cells[i].sum.roll_rad.is_nan() { 0.0 } else { cells[i].sum.roll_rad },
        heading_rad: if cells[i].sum.heading_rad.is_nan() { 0.0 } else { cells[i].sum.heading_rad },
        ..cells[i].sum
    };
    let mut rows: Vec<Row> = (1..cells.len()).filter(|i| steady(*i)).map(row).collect();
    number_blocks(&mut rows);
    rows
}

/// Numbers the blocks: legs, each cut into pieces of about [`LONGEST_PIECE_S`].
fn number_blocks(rows: &mut [Row]) {
    let same_leg = |a: &Row, b: &Row| a.way == b.way && b.time_s - a.time_s <= LONGEST_PIECE_S;
    let mut next = 0;
    for leg in rows.chunk_by_mut(same_leg) {
        let (first, last) = (leg[0].time_s, leg[leg.len() - 1].time_s);
        let pieces = ((last - first) / LONGEST_PIECE_S).round().max(1.0);
        let mut now = None;
        for r in leg {
            let piece = ((r.time_s - first) / (last - first).max(1.0) * pieces).min(pieces - 1.0) as usize;
            if now.is_some_and(|n| n != piece) {
                next += 1;
            }
            now = Some(piece);
            r.block = next;
        }
        next += 1;
    }
}

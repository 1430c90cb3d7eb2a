//! Cycles in, steady rows out: means of 40 s in which pitch, roll and ballast stand still, with the slope of pressure as the vertical
//! velocity. The same rows as the workbench makes of a log, but for what a log knows of later.
//!
//! Left out: rows near a turn (until the vehicle is 10 dbar beyond them, or a tenth of the depth), near the surface, on the sea bed
//! (nothing moves), with a moving pump, and all with a sensor that is old or not finite.

/// What is measured in one cycle. NaN: not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// Time at which the pressure was sampled, µs.
    pub time_us: u64,
    /// Gauge pressure, Pa.
    pub pressure_pa: f32,
    /// Pitch as measured, rad, nose up.
    pub pitch_rad: f32,
    /// Roll, rad; may be unknown.
    pub roll_rad: f32,
    /// Ballast as measured, m³.
    pub ballast_m3: f32,
    /// Density in situ, kg/m³.
    pub density_kg_m3: f32,
    /// Temperature of the water, °C; may be unknown: then the thermal expansion is.
    pub temperature_degc: f32,
}

/// Length of a row, µs.
pub const ROW_US: u64 = 40_000_000;
const DBAR_PA: f32 = 1e4;
/// Rows that wait for the vehicle to leave a turn: 40 s each at the slowest descent of 200 Pa/s are 12 for 10 dbar; a slower one's are left out.
const WAITING: usize = 12;
/// Ballast that stands still, m³, or this share of its range.
const STILL: (f32, f32) = (4e-6, 0.02);

/// One steady row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Time, s since the first cycle of all.
    pub time_s: f32,
    /// Gauge pressure, Pa.
    pub pressure_pa: f32,
    /// Vertical velocity, m/s, up.
    pub rise_m_s: f32,
    /// Density, kg/m³.
    pub density_kg_m3: f32,
    /// Temperature, °C; NaN where it is not known.
    pub temperature_degc: f32,
    /// Measured pitch, rad.
    pub pitch_rad: f32,
    /// |roll|, rad; 0 where it is not known.
    pub roll_rad: f32,
    /// Measured ballast, m³.
    pub ballast_m3: f32,
}

impl Row {
    /// 1 in a climb, -1 in a dive.
    #[must_use]
    pub fn way(&self) -> f32 {
        if self.rise_m_s > 0.0 { 1.0 } else { -1.0 }
    }
}

/// Lowest and highest value.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Span(f32, f32);

impl Span {
    const EMPTY: Self = Self(f32::MAX, f32::MIN);

    fn with(self, x: f32) -> Self {
        Self(if x < self.0 { x } else { self.0 }, if x > self.1 { x } else { self.1 })
    }

    fn width(self) -> f32 {
        self.1 - self.0
    }
}

/// Sums of the cycles of one stretch of 40 s, pressure and time relative to its first.
#[derive(Clone, Copy, Debug)]
struct Cell {
    number: u64,
    begin_us: u64,
    first_pa: f32,
    n: f32,
    t: f32,
    p: f32,
    tt: f32,
    tp: f32,
    density: f32,
    temperature: f32,
    pitch: f32,
    roll: f32,
    ballast: f32,
    ballast_span: Span,
    pitch_span: Span,
    roll_span: Span,
}

impl Cell {
    const fn new(number: u64, begin_us: u64) -> Self {
        Self {
            number,
            begin_us,
            first_pa: 0.0,
            n: 0.0,
            t: 0.0,
            p: 0.0,
            tt: 0.0,
            tp: 0.0,
            density: 0.0,
            temperature: 0.0,
            pitch: 0.0,
            roll: 0.0,
            ballast: 0.0,
            ballast_span: Span::EMPTY,
            pitch_span: Span::EMPTY,
            roll_span: Span::EMPTY,
        }
    }

    fn take(&mut self, c: &Cycle, late_s: f32) {
        if self.n == 0.0 {
            self.first_pa = c.pressure_pa;
        }
        let p = c.pressure_pa - self.first_pa;
        self.n += 1.0;
        self.t += late_s;
        self.p += p;
        self.tt += late_s * late_s;
        self.tp += late_s * p;
        self.density += c.density_kg_m3;
        self.temperature += c.temperature_degc;
        self.pitch += c.pitch_rad;
        self.ballast += c.ballast_m3;
        self.ballast_span = self.ballast_span.with(c.ballast_m3);
        self.pitch_span = self.pitch_span.with(c.pitch_rad);
        if c.roll_rad.is_finite() {
            self.roll += c.roll_rad;
            self.roll_span = self.roll_span.with(c.roll_rad);
        }
    }
}

/// Of the last cell: its number, its mean pitch and the span of its ballast.
#[derive(Clone, Copy, Debug)]
struct Before(u64, f32, Span);

/// Makes the rows.
#[derive(Clone, Copy, Debug)]
pub struct Rows {
    start_us: Option<u64>,
    last_us: u64,
    cell: Option<Cell>,
    before: Option<Before>,
    ballast: Span,
    /// Deepest of all legs, of the last one and of this one, Pa; which way this one goes.
    deepest_pa: f32,
    deepest_of_leg_pa: [f32; 2],
    way: f32,
    turned: bool,
    waiting: [Row; WAITING],
    waits: usize,
}

impl Rows {
    /// Before the first cycle.
    #[must_use]
    pub const fn new() -> Self {
        const NONE: Row = Row {
            time_s: 0.0,
            pressure_pa: 0.0,
            rise_m_s: 0.0,
            density_kg_m3: 0.0,
            temperature_degc: 0.0,
            pitch_rad: 0.0,
            roll_rad: 0.0,
            ballast_m3: 0.0,
        };
        Self {
            start_us: None,
            last_us: 0,
            cell: None,
            before: None,
            ballast: Span::EMPTY,
            deepest_pa: 0.0,
            deepest_of_leg_pa: [0.0; 2],
            way: 0.0,
            turned: false,
            waiting: [NONE; WAITING],
            waits: 0,
        }
    }

    /// Takes a cycle; hands over each row that is known to be steady now.
    pub fn take(&mut self, cycle: &Cycle, give: impl FnMut(&Row)) {
        let known = [cycle.pressure_pa, cycle.pitch_rad, cycle.ballast_m3, cycle.density_kg_m3];
        let sound = known.iter().all(|x| x.is_finite())
            && (-2e5..1e8).contains(&cycle.pressure_pa)
            && cycle.pitch_rad.abs() < 1.6
            && cycle.ballast_m3.abs() < 0.01
            && (900.0..1200.0).contains(&cycle.density_kg_m3)
            && !(cycle.temperature_degc.abs() > 60.0)
            && !(cycle.roll_rad.abs() > 4.0);
        let start_us = *self.start_us.get_or_insert(cycle.time_us);
        if !sound || cycle.time_us < self.last_us {
            return;
        }
        self.last_us = cycle.time_us;
        let begin_us = self.cell.get_or_insert_with(|| Cell::new(0, start_us)).begin_us;
        let mut late_us = cycle.time_us.saturating_sub(begin_us);
        if late_us >= ROW_US {
            let passed = late_us / ROW_US;
            let begin_us = begin_us.saturating_add(passed.saturating_mul(ROW_US));
            late_us = cycle.time_us.saturating_sub(begin_us);
            if let Some(done) = self.cell {
                self.close(&done, give);
                self.cell = Some(Cell::new(done.number.saturating_add(passed), begin_us));
            }
        }
        self.ballast = self.ballast.with(cycle.ballast_m3);
        if let Some(cell) = &mut self.cell {
            // Within a row: at most 40 s.
            cell.take(cycle, late_us as u32 as f32 * 1e-6);
        }
    }

    /// Ends the rows before a gap: what waits is left out, and what is next is not compared with what was.
    pub fn interrupt(&mut self) {
        // The grid of 40 s goes on.
        self.cell = self.cell.map(|c| Cell::new(c.number, c.begin_us));
        (self.before, self.waits) = (None, 0);
    }

    /// Time of the first cycle of all, s: rows count from there.
    #[must_use]
    pub fn start_s(&self) -> u32 {
        self.start_us.map_or(0, |us| u32::try_from(us / 1_000_000).unwrap_or(u32::MAX))
    }

    fn close(&mut self, c: &Cell, give: impl FnMut(&Row)) {
        let n = c.n;
        if !(n >= 1.0) {
            self.before = None;
            return;
        }
        let (t, p) = (c.t / n, c.p / n);
        let (tt, tp) = (c.tt - n * t * t, c.tp - n * t * p);
        let pitch_rad = c.pitch / n;
        let before = self.before.replace(Before(c.number, pitch_rad, c.ballast_span));
        let rise_pa_s = if tt > 1e-6 { -tp / tt } else { 0.0 };
        let pressure_pa = c.first_pa + p;
        self.follow_leg(rise_pa_s, pressure_pa);
        let density_kg_m3 = c.density / n;
        let row = Row {
            time_s: c.number as f32 * (ROW_US as f32 * 1e-6) + t,
            pressure_pa,
            rise_m_s: rise_pa_s / (density_kg_m3 * 9.81),
            density_kg_m3,
            temperature_degc: c.temperature / n,
            pitch_rad,
            roll_rad: (c.roll / n).abs(),
            ballast_m3: c.ballast / n,
        };
        if let Some(Before(number, before_rad, ballast)) = before
            && number.wrapping_add(1) == c.number
        {
            let still = {
                let of_range = STILL.1 * self.ballast.width();
                if of_range > STILL.0 { of_range } else { STILL.0 }
            };
            let moved = ballast.with(c.ballast_span.0).with(c.ballast_span.1).width();
            let steady = n >= 3.0
                && tt / n > 64.0
                && moved < still
                && c.pitch_span.width() < 0.14
                && (pitch_rad - before_rad).abs() < 0.09
                && !(c.roll_span.width() > 0.26)
                && pitch_rad.abs() > 0.14
                && pitch_rad * rise_pa_s > 0.0
                && rise_pa_s.abs() > 200.0
                && pressure_pa > self.surface_pa();
            if steady {
                self.hold(row);
            }
        }
        self.release(give);
    }

    /// Rows above this are near the surface; before the first turn nobody knows how deep it goes.
    fn surface_pa(&self) -> f32 {
        let share = 0.15 * self.deepest_pa;
        if self.turned && share < 20.0 * DBAR_PA { share } else { 20.0 * DBAR_PA }
    }

    fn follow_leg(&mut self, rise_pa_s: f32, pressure_pa: f32) {
        let way = if rise_pa_s > 0.0 { 1.0 } else { -1.0 };
        if way != self.way {
            self.turned |= self.way < 0.0 && self.deepest_pa > 0.0;
            self.deepest_of_leg_pa = [self.deepest_of_leg_pa[1], 0.0];
            // What waits was near the turn.
            (self.way, self.waits) = (way, 0);
        }
        let [_, now] = &mut self.deepest_of_leg_pa;
        for deepest in [now, &mut self.deepest_pa] {
            if pressure_pa > *deepest {
                *deepest = pressure_pa;
            }
        }
    }

    fn hold(&mut self, row: Row) {
        if self.waits == WAITING {
            // Too slow: the oldest is left out.
            self.waiting.rotate_left(1);
            self.waits = WAITING - 1;
        }
        if let Some(place) = self.waiting.get_mut(self.waits) {
            *place = row;
            self.waits = self.waits.saturating_add(1);
        }
    }

    /// Hands over what is far enough above the deepest place of this leg and the last.
    fn release(&mut self, mut give: impl FnMut(&Row)) {
        let [last, now] = self.deepest_of_leg_pa;
        let deepest = if last > now { last } else { now };
        let tenth = 0.1 * self.deepest_pa;
        let above_pa = deepest - if tenth < 10.0 * DBAR_PA { tenth } else { 10.0 * DBAR_PA };
        let mut kept: usize = 0;
        for i in 0..self.waits.min(WAITING) {
            let Some(row) = self.waiting.get(i).copied() else { break };
            if row.pressure_pa <= above_pa {
                give(&row);
            } else if let Some(place) = self.waiting.get_mut(kept) {
                *place = row;
                kept = kept.saturating_add(1);
            }
        }
        self.waits = if self.way > 0.0 { 0 } else { kept };
    }
}

impl Default for Rows {
    fn default() -> Self {
        Self::new()
    }
}

//! What the flight says of the table.
//!
//! ```text
//! C_L = λ C_L,table(α)        C_D = c [ C_D0 + κ (C_D,table(α) − C_D0) ]        C_D0 = C_D,table(0)
//! w²  = 2 V g sin²γ cos γ / (S C_L)        tan γ = C_D/C_L        γ = |θ| + α
//! ```
//! c drag level, κ drag due to lift, λ lift (1: as in the table), V ballast, w
//! depth rate, θ pitch. Three numbers, started at the table with the spread a
//! table may be wrong by, are corrected by what steady glides measure (Kalman
//! filter, one scalar: measured over expected w). The covariance is carried as
//! its square root S, P = S Sᵀ, which no rounding makes asymmetric or negative
//! (Potter; Bierman, Factorization Methods for Discrete Sequential Estimation, 1977):
//! ```text
//! φ = Sᵀh      b = φᵀφ + R      x ← x + Sφ · surprise / b      S ← S − Sφ φᵀ / (b + √(R b))
//! ```
//!
//! A measurement is a pair: a piece of a dive and the piece of the climb through
//! the same water. Buoyancy that is not as planned, stratified water and a
//! steady vertical current make the one faster and the other slower and cancel
//! in their mean. Pieces of the way to a turn wait on a stack for their
//! counterpart on the way back.
//!
//! dγ = dα at a given pitch, so with ι = share of C_D due to lift, sc = sin γ cos γ:
//! ```text
//! dα    = G (dc + ι dκ − dλ)           G = sc / (1 − sc (2ι − 1)/α)
//! d ln w = M dα − ½ dλ                 M = cot γ − ½ tan γ − 1/(2α)
//! ```
//! Where [`crate::Settings::learns_levels`] asks for it, c is the level of the drag without lift alone, `C_D = c C_D0 + κ (C_D,table − C_D0)`,
//! so dα = G ((1 − ι) dc + ι dκ − dλ), and a pair counts for more ([`APART`]).
//!
//! What it cannot do: near the best glide a wrong lift slope alone hardly shows
//! in w (10 % of it are 0.1 mm/s); it shows once the pitch is too flat for it,
//! as a vehicle that sinks faster than expected, and is then corrected towards
//! a steeper pitch. Internal waves are taken for a wrong table as far as their
//! change within a piece does not give them away ([`Prior`]); the numbers
//! stay within [`BOUND`] whatever happens.

use crate::angle::{atan, inverse_sqrt, sqrt};
use crate::bound::{Bound, all_finite};
use polar::Table;

/// What is taken for granted of c, κ and λ.
#[derive(Debug)]
struct Prior {
    /// Spread (1 σ) before any flight.
    spread: [f32; 3],
    /// Farthest they are ever believed to be from the table.
    bound: [f32; 3],
    /// Variance of a piece's mean over the square of the difference of its halves.
    scatter_gain: f32,
}

/// Usual: the project plans for tables wrong by 20 %; fits of one vehicle on several missions differ by 10–20 % in drag, 30 % in drag
/// due to lift, 10 % in lift. A scatter gain of 20 is that of a wave of a quarter of an hour.
const TOGETHER: Prior = Prior { spread: [0.15, 0.3, 0.1], bound: [0.35, 0.6, 0.3], scatter_gain: 20.0 };
/// Drag without lift on its own: half of all drag, so twice as far. The scatter gain was chosen by flights in calm water, where pairs
/// differ by 1 % and 20 would count them as 6 %; in moving water it learns from the water too.
const APART: Prior = Prior { spread: [0.3, 0.3, 0.1], bound: [0.6, 0.6, 0.3], scatter_gain: 3.0 };
/// Growth of the spread per measurement, 1: some hours of glide are remembered, so that fouling is followed.
const FORGET: f32 = 1.005;
/// Least answer of pitch to α that is divided by: nearer to the pitch below which no steady glide exists the line is no guide.
const ANSWER_MIN: f32 = 0.25;
/// Cycles of steady glide before the first is counted: speed and path settle in 10 to 20 s, the depth filter in 5 s.
const SETTLE: u8 = 6;
/// Cycles of one half of a piece.
const HALF: u8 = 6;
/// Pieces that wait for their counterpart; a power of two.
const WAITING: u8 = 8;
/// Variance of one measurement of w, relative, in water at rest: 1.5 % (form of the polar, pitch not quite held).
const NOISE: f32 = 2e-4;
/// A pair that sinks faster than expected by more than this has let go: no drag level within the bounds does that.
const LET_GO: f32 = 0.2;
/// Halves farther apart than this were no steady glide in water at rest; nothing is learned from them.
const APART_MAX: f32 = 0.05;

/// Lift and drag as believed at one angle of attack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Polar {
    pub(crate) cl: f32,
    pub(crate) cd: f32,
    /// ι, share of the drag that is due to lift.
    pub(crate) induced: f32,
}

/// Steady glide at one angle of attack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Steady {
    pub(crate) alpha_rad: f32,
    /// γ: below (dive) or above (climb) the horizon.
    pub(crate) tan_gamma: f32,
    pub(crate) sin_gamma: f32,
    pub(crate) cos_gamma: f32,
    /// Of the speed through the water, m²/s².
    speed_squared: f32,
    /// ι, share of the drag that is due to lift.
    induced: f32,
}

impl Steady {
    /// γ, rad. Its pitch is this less α.
    pub(crate) fn gamma_rad(&self) -> f32 {
        atan(self.tan_gamma)
    }

    /// Speed through the water, m/s.
    pub(crate) fn speed_m_s(&self) -> f32 {
        sqrt(self.speed_squared)
    }

    /// 1 − dγ/dα: change of pitch per change of α, with the sign that is positive where a steady glide is stable.
    pub(crate) fn answer(&self) -> f32 {
        1.0 - self.sin_gamma * self.cos_gamma * (2.0 * self.induced - 1.0) / self.alpha_rad
    }

    /// Change of ln w with c, κ, λ at the pitch flown; `level` is the share of the drag that c scales.
    fn slope(&self, level: f32) -> [f32; 3] {
        let g = self.sin_gamma * self.cos_gamma / self.answer().at_least(ANSWER_MIN);
        let m = 1.0 / self.tan_gamma - 0.5 * self.tan_gamma - 0.5 / self.alpha_rad;
        [m * g * level, m * g * self.induced, -m * g - 0.5]
    }
}

/// A piece of steady glide: what it says, whatever is believed later.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Piece {
    /// Change of ln w with c, κ, λ.
    h: [f32; 3],
    /// Measured over expected w less 1, for a table that is right.
    z: f32,
}

/// What a cycle brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum News {
    /// Nothing yet.
    None,
    /// A piece is complete.
    Piece,
    /// The vehicle sinks much faster than any believable table says: the flow has left the wings.
    LetGo,
}

/// The correction of the table, and the measurement under way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Belief {
    /// c, κ, λ less 1.
    x: [f32; 3],
    /// Square root of the covariance P of `x`: P = S Sᵀ, symmetric and not negative whatever is rounded.
    s: [[f32; 3]; 3],
    /// Pairs learned from.
    pairs: u8,
    /// Mean square of the difference between the halves of a piece.
    scatter: f32,
    /// C_D0 of the table.
    drag0: f32,
    /// c is the level of the drag without lift alone.
    apart: bool,
    /// Pieces on the way to the turn, all going the same way; a ring of which `height` up to `top` are in use.
    stack: [Piece; WAITING as usize],
    top: u8,
    height: u8,
    downward: bool,
    cycles: u8,
    sums: [f32; 2],
}

impl Default for Belief {
    fn default() -> Self {
        Self {
            x: [0.0; 3],
            s: TOGETHER.root(),
            pairs: 0,
            scatter: 0.0,
            drag0: 0.0,
            apart: false,
            stack: [Piece::default(); WAITING as usize],
            top: 0,
            height: 0,
            downward: false,
            cycles: 0,
            sums: [0.0; 2],
        }
    }
}

fn dot(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

impl Prior {
    /// Square root of the covariance that belongs to it.
    const fn root(&self) -> [[f32; 3]; 3] {
        let [c, k, l] = self.spread;
        [[c, 0.0, 0.0], [0.0, k, 0.0], [0.0, 0.0, l]]
    }
}

impl Belief {
    /// Nothing learned yet of this table; `apart`: c will be the level of the drag without lift alone.
    #[cold]
    #[inline(never)]
    pub(crate) fn reset(&mut self, table: Option<&Table<'_>>, apart: bool) {
        self.apart = apart;
        self.forget();
        self.drag0 = table.map_or(0.0, |t| t.at(0.0).cd);
    }

    /// The table as it is.
    pub(crate) fn of(table: &Table<'_>) -> Self {
        Self { drag0: table.at(0.0).cd, ..Self::default() }
    }

    /// Back to the table as it is. The stack stays as it was, with nothing of it in use: clearing it costs more than a cycle has.
    fn forget(&mut self) {
        (self.x, self.s) = ([0.0; 3], self.prior().root());
        (self.pairs, self.scatter) = (0, 0.0);
        (self.top, self.height) = (0, 0);
        self.interrupt();
    }

    const fn prior(&self) -> &'static Prior {
        if self.apart { &APART } else { &TOGETHER }
    }

    /// c, κ, λ.
    pub(crate) fn factors(&self) -> [f32; 3] {
        self.x.map(|x| 1.0 + x)
    }

    /// Pairs learned from so far.
    pub(crate) fn pairs(&self) -> u8 {
        self.pairs
    }

    /// Lift and drag at an angle of attack.
    pub(crate) fn polar(&self, table: &Table<'_>, alpha_rad: f32) -> Polar {
        let [c, k, l] = self.x;
        let at = table.at(alpha_rad);
        let induced = (1.0 + k) * (at.cd - self.drag0);
        let cl = (1.0 + l) * at.cl;
        if self.apart {
            let cd = (1.0 + c) * self.drag0 + induced;
            return Polar { cl, cd, induced: induced / cd };
        }
        let drag = self.drag0 + induced;
        Polar { cl, cd: (1.0 + c) * drag, induced: induced / drag }
    }

    /// The steady glide at an angle of attack with a ballast volume, m³.
    #[inline(never)]
    pub(crate) fn steady(&self, table: &Table<'_>, alpha_rad: f32, ballast_m3: f32) -> Option<Steady> {
        let p = self.polar(table, alpha_rad);
        if !(p.cl > 1e-5 && p.cd > 1e-6) {
            return None;
        }
        let tan_gamma = p.cd / p.cl;
        let per_force = inverse_sqrt(p.cl * p.cl + p.cd * p.cd);
        // Density cancels between buoyancy and dynamic pressure.
        let speed_squared = 2.0 * 9.81 * ballast_m3 / table.area_m2() * per_force;
        let (sin_gamma, cos_gamma) = (p.cd * per_force, p.cl * per_force);
        let s = Steady { alpha_rad, tan_gamma, sin_gamma, cos_gamma, speed_squared, induced: p.induced };
        all_finite([tan_gamma, speed_squared, s.induced]).then_some(s)
    }

    /// Takes one cycle of steady glide, `now` as believed; `measured_m_s` is the depth rate, down positive.
    pub(crate) fn take(&mut self, now: &Steady, measured_m_s: f32) -> News {
        self.heal();
        let ratio = measured_m_s.abs() / (now.speed_m_s() * now.sin_gamma).at_least(0.01);
        self.cycles = self.cycles.saturating_add(1);
        let [first, second] = &mut self.sums;
        if self.cycles > SETTLE + HALF {
            *second += ratio;
        } else if self.cycles > SETTLE {
            *first += ratio;
        }
        if self.cycles < SETTLE + 2 * HALF {
            return News::None;
        }
        let n = f32::from(HALF);
        let (mean, apart) = ((*first + *second) / (2.0 * n), (*second - *first) / n);
        self.interrupt();
        if !all_finite([mean, apart]) {
            return News::None;
        }
        self.scatter += 0.2 * ((apart * apart).at_most(0.1) - self.scatter);
        if apart.abs() < APART_MAX { self.file(now, measured_m_s > 0.0, (mean - 1.0).at_least(-0.5).at_most(0.5)) } else { News::Piece }
    }

    /// φ = Sᵀh: |φ|² is the variance of h·x.
    fn across(&self, h: &[f32; 3]) -> [f32; 3] {
        let mut phi = [0.0; 3];
        for (row, h) in self.s.iter().zip(h) {
            for (phi, s) in phi.iter_mut().zip(row) {
                *phi += s * h;
            }
        }
        phi
    }

    /// One measurement into S, with φ and the variance R of its noise; answers what the factors move by per surprise.
    fn absorb(&mut self, phi: &[f32; 3], noise: f32) -> [f32; 3] {
        let per = 1.0 / (dot(phi, phi) + noise);
        let share = 1.0 / (1.0 + sqrt(noise * per));
        let mut gains = [0.0; 3];
        for (row, gain) in self.s.iter_mut().zip(&mut gains) {
            *gain = dot(row, phi) * per;
            for (s, phi) in row.iter_mut().zip(phi) {
                *s -= *gain * share * phi;
            }
        }
        gains
    }

    /// The glide is not steady: the piece under way is dropped.
    pub(crate) fn interrupt(&mut self) {
        self.cycles = 0;
        self.sums = [0.0; 2];
    }

    /// Puts a piece on the stack, or learns from it and its counterpart there.
    #[cold]
    #[inline(never)]
    fn file(&mut self, now: &Steady, downward: bool, surprise: f32) -> News {
        let h = now.slope(if self.apart { 1.0 - now.induced } else { 1.0 });
        let piece = Piece { h, z: surprise + dot(&h, &self.x) };
        if self.height == 0 || self.downward == downward {
            self.downward = downward;
            self.top = self.top.wrapping_add(1) % WAITING;
            self.height = self.height.saturating_add(1).min(WAITING);
            if let Some(place) = self.stack.get_mut(usize::from(self.top)) {
                *place = piece;
            }
        } else if let Some(&other) = self.stack.get(usize::from(self.top)) {
            self.top = self.top.wrapping_sub(1) % WAITING;
            self.height = self.height.saturating_sub(1);
            return self.learn(&piece, &other);
        }
        News::Piece
    }

    #[cold]
    #[inline(never)]
    fn learn(&mut self, one: &Piece, other: &Piece) -> News {
        let [a, b, c] = one.h;
        let [d, e, f] = other.h;
        let h = [0.5 * (a + d), 0.5 * (b + e), 0.5 * (c + f)];
        let surprise = 0.5 * (one.z + other.z) - dot(&h, &self.x);
        let phi = self.across(&h);
        let noise = (NOISE + self.prior().scatter_gain * self.scatter).at_least(NOISE);
        if !all_finite([surprise, dot(&phi, &phi) + noise]) {
            return News::Piece;
        }
        if surprise > LET_GO {
            self.height = 0;
            return News::LetGo;
        }
        // What no glide tells must not grow without end: forgotten is only what is known better than before any flight.
        let mut grow = [1.0; 3];
        for ((grow, row), spread) in grow.iter_mut().zip(&self.s).zip(&self.prior().spread) {
            if dot(row, row) < spread * spread {
                *grow = FORGET;
            }
        }
        let gain = self.absorb(&phi, noise);
        let bounds = self.prior().bound;
        for ((x, gain), bound) in self.x.iter_mut().zip(gain).zip(bounds) {
            *x = (*x + gain * surprise).at_least(-bound).at_most(bound);
        }
        for (row, grow) in self.s.iter_mut().zip(grow) {
            for s in row {
                *s *= grow;
            }
        }
        self.pairs = self.pairs.saturating_add(1);
        News::Piece
    }

    /// Numbers no flight can have written give way to the table as it is.
    #[cold]
    #[inline(never)]
    fn heal(&mut self) {
        let known = self.s.iter().map(|row| dot(row, row)).all(|variance| variance > 0.0 && variance <= 0.1);
        let [c, k, l] = self.x;
        if !(known && self.top < WAITING && self.height <= WAITING && all_finite([c, k, l, self.scatter, self.drag0])) {
            self.forget();
        }
    }
}

#[cfg(test)]
#[path = "tests/consistency.rs"]
mod consistency;

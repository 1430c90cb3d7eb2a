//! The current of the mission: a bank of Kalman filters on the ways from fix to fix.
//!
//! Currents, ways and their errors are complex numbers, east + i north. Each filter takes the current as a sum of independent parts
//! that are alike in form: an oscillation of frequency ω that loses its memory in a time τ and has a standard deviation σ,
//!
//! ```text
//! dc = -λ c dt + noise,   λ = 1/τ - iω        mean current and red noise ω = 0; inertial ω = -f; tide ω = ± that of K1, M2
//! ```
//!
//! and the flight model's error as one complex factor g: the way is (1 + g) · through water + ∫c dt, where Re g is a relative error of
//! speed (drag) and Im g one of heading, rad. A way of any length is one exact step, as the
//! integral of each part has a closed form; g is that of its start.
//!
//! How strong the parts are differs from sea to sea: every filter of the bank has its own strengths, and counts by how well it predicted
//! the ways so far. Where the latitude is unknown, the bank holds inertial oscillations of many.

use nalgebra::{Complex, SMatrix, SVector};

/// East + i north.
pub type Vector = Complex<f64>;

/// Parts of the current, and the flight model's factor behind them.
const CURRENT_PARTS: usize = 7;
const STATES: usize = CURRENT_PARTS + 1;
type State = SVector<Vector, STATES>;
type Covariance = SMatrix<Vector, STATES, STATES>;

const HOUR_S: f64 = 3600.0;
const DAY_S: f64 = 24.0 * HOUR_S;
/// Rotation of the earth, rad/s (IERS).
const EARTH_RAD_S: f64 = 7.292_115e-5;
/// Periods of the strongest diurnal and semidiurnal tide, K1 and M2, s (Doodson).
const TIDES_S: [f64; 2] = [23.934_47 * HOUR_S, 12.420_60 * HOUR_S];
/// Memory of the mean current, s: an eddy of a hundred kilometres passes within ten days or so (Stammer 1997: 5 to 20 days).
const MEAN_S: f64 = 10.0 * DAY_S;
/// Memory of inertial oscillations, s (Park et al. 2009, drifters: 2 to 10 days).
const INERTIAL_S: f64 = 4.0 * DAY_S;
/// Memory of tides, s: two springs; internal tides lose it sooner than the barotropic one (guess).
const TIDE_MEMORY_S: f64 = 30.0 * DAY_S;
/// Standard deviation of the flight model's speed (relative) and heading (rad) errors (guess: 10 %, a compass good to 6°), and how long
/// they stay, s (guess: growth and retrimming take weeks).
const FLIGHT_ERROR: f64 = 0.1;
const FLIGHT_MEMORY_S: f64 = 30.0 * DAY_S;
/// Error of a way by its two fixes, m: a fix is put to a row of the log up to minutes away, the vehicle drifts meanwhile (guess).
const FIX_ERROR_M: f64 = 100.0;
/// Strengths in the bank, m/s, of mean current, tide, inertial oscillation: what open ocean and shelf seas have (guess), two to three times apart;
/// and memory (s) with strength of the red noise.
const MEANS_M_S: [f64; 4] = [0.05, 0.1, 0.2, 0.4];
const TIDES_M_S: [f64; 3] = [0.003, 0.01, 0.03];
const INERTIAL_M_S: [f64; 3] = [0.02, 0.05, 0.1];
const RED: [(f64, &[f64]); 2] = [(2.0 * HOUR_S, &[0.01, 0.02, 0.04]), (12.0 * HOUR_S, &[0.01, 0.02, 0.04, 0.08])];
/// Latitudes of the bank where none is known, deg: from the first to the last of either hemisphere, so far apart.
const LATITUDES_DEG: [usize; 3] = [10, 65, 5];

fn real(x: f64) -> Vector {
    Vector::new(x, 0.0)
}

/// A part of the current.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    lambda: Vector,
    variance: f64,
}

/// What a part does in a time: factor of its state, way for its state, and covariance of what is new of state and way.
struct Step {
    factor: Vector,
    way: Vector,
    state: f64,
    both: Vector,
    ways: f64,
}

impl Part {
    fn new(sigma: f64, memory_s: f64, rad_s: f64) -> Self {
        Self { lambda: Vector::new(1.0 / memory_s, -rad_s), variance: sigma * sigma }
    }

    fn step(&self, time_s: f64) -> Step {
        let factor = (-self.lambda * time_s).exp();
        let way = (real(1.0) - factor) / self.lambda;
        // Variance of the way of a part that has always been there, less what its state at the start explains.
        let whole = 2.0 * self.variance * ((real(time_s) - way) / self.lambda).re;
        Step {
            factor,
            way,
            state: self.variance * (1.0 - factor.norm_sqr()),
            both: (way - factor * way.conj()) * self.variance,
            ways: (whole - way.norm_sqr() * self.variance).max(0.0),
        }
    }
}

/// One filter: the state at a time, and the way since that is asked.
#[derive(Clone, Debug)]
struct Filter {
    parts: [Part; STATES],
    state: State,
    covariance: Covariance,
    /// Way through no water, m, its variance, m², and its covariance with the state.
    way: Vector,
    variance: f64,
    with_state: State,
    log_weight: f64,
}

impl Filter {
    fn new(parts: [Part; STATES]) -> Self {
        let covariance = Covariance::from_diagonal(&State::from_fn(|k, _| real(parts[k].variance)));
        Self { parts, state: State::zeros(), covariance, way: real(0.0), variance: 0.0, with_state: State::zeros(), log_weight: 0.0 }
    }

    /// Goes on by a time in which the vehicle moves so far through the water; adds to the way.
    fn pass(&mut self, time_s: f64, through_water: Vector) {
        let steps: [Step; STATES] = std::array::from_fn(|k| self.parts[k].step(time_s));
        let ways = State::from_fn(|k, _| if k < CURRENT_PARTS { steps[k].way } else { through_water });
        let factors = State::from_fn(|k, _| steps[k].factor);
        let both = State::from_fn(|k, _| if k < CURRENT_PARTS { steps[k].both } else { real(0.0) });
        let of_way = self.covariance * ways.conjugate();
        self.way += through_water + ways.dot(&self.state);
        self.variance +=
            2.0 * ways.dot(&self.with_state).re + ways.dot(&of_way).re + steps[..CURRENT_PARTS].iter().map(|s| s.ways).sum::<f64>();
        self.with_state = factors.component_mul(&(self.with_state + of_way)) + both;
        self.state.component_mul_assign(&factors);
        self.covariance.component_mul_assign(&(factors * factors.adjoint()));
        steps.iter().enumerate().for_each(|(k, s)| self.covariance[(k, k)] += real(s.state));
    }

    /// Forgets the way so far.
    fn begin(&mut self) {
        (self.way, self.variance, self.with_state) = (real(0.0), 0.0, State::zeros());
    }

    /// Learns that the way was this.
    fn learn(&mut self, way: Vector) {
        let variance = self.variance + FIX_ERROR_M * FIX_ERROR_M;
        let off = way - self.way;
        self.log_weight -= variance.ln() + off.norm_sqr() / variance;
        self.state += self.with_state * (off / variance);
        self.covariance -= self.with_state * self.with_state.adjoint() / real(variance);
    }
}

/// A way that is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Way, m.
    pub way: Vector,
    /// Mean square of its error, m²: east and north together.
    pub variance: f64,
}

/// The bank.
#[derive(Clone, Debug)]
pub struct Current {
    filters: Vec<Filter>,
}

impl Current {
    /// Before anything is known; `latitude_deg` of the mission, where that is known.
    #[must_use]
    pub fn new(latitude_deg: Option<f64>) -> Self {
        let [from, to, apart] = LATITUDES_DEG;
        let many = || (from..=to).step_by(apart).flat_map(|l| [l as f64, -(l as f64)]).collect();
        let latitudes: Vec<f64> = latitude_deg.map_or_else(many, |l| vec![l]);
        let inertial = |strength: f64| {
            latitudes.iter().map(move |l| Part::new(strength, INERTIAL_S, -2.0 * EARTH_RAD_S * l.to_radians().sin())).collect::<Vec<_>>()
        };
        let all: Vec<Part> = INERTIAL_M_S.into_iter().flat_map(inertial).chain([Part::new(1e-4, INERTIAL_S, 0.0)]).collect();
        let mut filters = Vec::new();
        for mean in MEANS_M_S {
            for (memory_s, red) in RED.iter().flat_map(|(memory_s, all)| all.iter().map(|red| (*memory_s, *red))) {
                for tide in TIDES_M_S {
                    let wave = |k: usize, sign: f64| Part::new(tide, TIDE_MEMORY_S, sign * std::f64::consts::TAU / TIDES_S[k]);
                    filters.extend(all.iter().map(|inertial| {
                        Filter::new([
                            Part::new(mean, MEAN_S, 0.0),
                            Part::new(red, memory_s, 0.0),
                            *inertial,
                            wave(0, 1.0),
                            wave(0, -1.0),
                            wave(1, 1.0),
                            wave(1, -1.0),
                            Part::new(FLIGHT_ERROR, FLIGHT_MEMORY_S, 0.0),
                        ])
                    }));
                }
            }
        }
        // Prior: none of the inertial oscillations is as likely as all of one strength together.
        let share = 1.0 / latitudes.len() as f64;
        for f in &mut filters {
            f.log_weight = if f.parts[2].variance > 1e-6 { share.ln() } else { 0.0 };
        }
        Self { filters }
    }

    /// Goes on by a time in which the vehicle moves so far through the water, m; adds to the way since [`Self::begin`].
    pub fn pass(&mut self, time_s: f64, through_water: Vector) {
        self.filters.iter_mut().for_each(|f| f.pass(time_s, through_water));
    }

    /// The way asked for begins here.
    pub fn begin(&mut self) {
        self.filters.iter_mut().for_each(Filter::begin);
    }

    /// Learns that the way since [`Self::begin`] was this, m.
    pub fn learn(&mut self, way: Vector) {
        self.filters.iter_mut().for_each(|f| f.learn(way));
    }

    /// The way since [`Self::begin`] as the filters expect it, each by its weight.
    #[must_use]
    pub fn expected(&self) -> Expected {
        let best = self.filters.iter().map(|f| f.log_weight).fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = self.filters.iter().map(|f| (f.log_weight - best).exp()).collect();
        let sum: f64 = weights.iter().sum();
        let all = || self.filters.iter().zip(weights.iter().map(|w| w / sum));
        let way: Vector = all().map(|(f, w)| f.way * w).sum();
        let variance = all().map(|(f, w)| w * (f.variance + (f.way - way).norm_sqr())).sum::<f64>() + FIX_ERROR_M * FIX_ERROR_M;
        Expected { way, variance }
    }

    /// Mean current over the next so many seconds, m/s, and its mean square error.
    #[must_use]
    pub fn mean_over(&self, time_s: f64) -> Expected {
        let mut ahead = self.clone();
        ahead.begin();
        ahead.pass(time_s, real(0.0));
        let Expected { way, variance } = ahead.expected();
        Expected { way: way / time_s, variance: variance / (time_s * time_s) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A part that oscillates and is damped: its way over a time in one step is that of a thousand small ones, and so is every covariance.
    #[test]
    fn accuracy_one_long_step_is_a_thousand_short_ones() {
        let filter = &Current::new(Some(40.0)).filters[7];
        let (mut one, mut many) = (filter.clone(), filter.clone());
        // Still water for the factor g, which is held over a way.
        one.pass(20_000.0, real(0.0));
        (0..1000).for_each(|_| many.pass(20.0, real(0.0)));
        assert!((one.variance / many.variance - 1.0).abs() < 1e-6, "{} {}", one.variance, many.variance);
        assert!((one.with_state - many.with_state).norm() < 1e-6 * one.with_state.norm());
        assert!((one.covariance - many.covariance).norm() < 1e-9 * one.covariance.norm());
    }

    /// A steady current and a compass that is off by 5°: after ways on several headings the next is known to within the fixes' errors.
    #[test]
    fn a_steady_current_and_a_compass_error_are_learnt() {
        let mut bank = Current::new(None);
        let (current, g) = (Vector::new(0.12, -0.05), Vector::new(0.06, 5f64.to_radians()));
        let water = |k: usize| Vector::from_polar(4000.0, 0.7 * k as f64);
        let mut off = f64::NAN;
        for k in 0..12 {
            bank.begin();
            bank.pass(18_000.0, water(k));
            let way = water(k) * (real(1.0) + g) + current * 18_000.0;
            off = (bank.expected().way - way).norm();
            bank.learn(way);
            bank.pass(1800.0, real(0.0));
        }
        assert!(off < 150.0, "{off} m");
        assert!((bank.mean_over(18_000.0).way - current).norm() < 0.01);
    }
}

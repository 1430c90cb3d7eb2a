//! Where the vehicle will be with a stated probability: an ellipse whose size and shape are learnt from the mission's own misses.
//!
//! Size: conformal quantile tracking (Gibbs & Candes 2021; Angelopoulos, Candes & Tibshirani 2023). After every surfacing the logarithm
//! of the radius moves by a rate times (missed - allowed share of misses): over n surfacings the share inside is off by no more than the
//! range of that logarithm over rate · n, whatever the sea does and however wrong the filters are.

use super::current::{Expected, Vector};

/// Share of surfacings that are to lie inside.
pub const COVERAGE: f64 = 0.9;
/// Learning rate of the logarithm of the radius. Of 0.1 to 0.5 (a tenth of the largest score by the second source is 0.15 to 0.2 here)
/// the rate at which 40 simulated missions of 60 surfacings were covered most evenly at less than 5 % larger ellipses.
const RATE: f64 = 0.3;
/// Circular misses that the shape begins with (guess); and its least ratio of axes.
const CIRCULAR_MISSES: f64 = 10.0;
const MOST_ELONGATED: f64 = 0.6;

/// An ellipse about a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Its middle, m.
    pub place: Vector,
    /// Mean square distance of a normal distribution with this shape that puts [`COVERAGE`] into the ellipse, m².
    variance: f64,
    /// Elongation: |e| = (a² - b²)/(a² + b²), half its argument is the direction of the long axis from east.
    elongation: Vector,
}

/// Squared radius of 90 % of a circular normal distribution, in its mean squares.
fn squared_radius() -> f64 {
    -(1.0 - COVERAGE).ln()
}

impl Region {
    /// Half axes, m, and direction of the longer one, rad clockwise from north, 0 to π.
    #[must_use]
    pub fn axes(&self) -> (f64, f64, f64) {
        let of = |sign: f64| (squared_radius() * self.variance * (1.0 + sign * self.elongation.norm())).sqrt();
        let azimuth = std::f64::consts::FRAC_PI_2 - 0.5 * self.elongation.arg();
        (of(1.0), of(-1.0), azimuth.rem_euclid(std::f64::consts::PI))
    }

    /// A place so many times as far from the middle as the ellipse in some direction of its own axes, rad.
    #[must_use]
    pub fn place_at(&self, times: f64, direction: f64) -> Vector {
        let (long, short, azimuth) = self.axes();
        let axis = Vector::from_polar(1.0, std::f64::consts::FRAC_PI_2 - azimuth);
        self.place + axis * Vector::new(long * direction.cos(), short * direction.sin()) * times
    }

    /// The ellipse's edge.
    #[must_use]
    pub fn edge(&self, corners: usize) -> Vec<Vector> {
        (0..corners).map(|k| self.place_at(1.0, std::f64::consts::TAU * k as f64 / corners as f64)).collect()
    }

    /// Whether a place is inside.
    #[must_use]
    pub fn holds(&self, place: Vector) -> bool {
        self.score(place) <= squared_radius()
    }

    /// Squared distance by the covariance of the normal distribution, half of Mahalanobis's.
    fn score(&self, place: Vector) -> f64 {
        let (off, e) = (place - self.place, self.elongation);
        (off.norm_sqr() - (e.conj() * off * off).re) / (self.variance * (1.0 - e.norm_sqr()))
    }

    /// Probability that the vehicle is where `inside` says, by a normal distribution of this ellipse: the share of 10,000 places that
    /// are spread evenly in probability, good to about 0.003.
    #[must_use]
    pub fn probability(&self, inside: impl Fn(Vector) -> bool) -> f64 {
        const PLACES: usize = 10_000;
        /// Golden angle, rad: no two places in line (Vogel 1979).
        const GOLDEN_RAD: f64 = 2.399_963_229_728_653;
        let place = |k: usize| {
            let share = (k as f64 + 0.5) / PLACES as f64;
            self.place_at((-(1.0 - share).ln() / squared_radius()).sqrt(), GOLDEN_RAD * k as f64)
        };
        (0..PLACES).filter(|k| inside(place(*k))).count() as f64 / PLACES as f64
    }
}

/// What the misses of a mission have taught.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Misses {
    /// Logarithm of the radius against that of the filters.
    log_scale: f64,
    /// Sums of squares of whitened misses, with and without their direction.
    directed: Vector,
    squares: f64,
    /// Surfacings judged, and how many of them lay inside.
    pub surfacings: usize,
    /// See above.
    pub inside: usize,
}

impl Misses {
    /// The ellipse about what the filters expect.
    #[must_use]
    pub fn region(&self, expected: &Expected) -> Region {
        let elongation = self.directed / (self.squares + CIRCULAR_MISSES);
        let elongation = elongation * (MOST_ELONGATED / elongation.norm().max(MOST_ELONGATED));
        Region { place: expected.way, variance: expected.variance * (2.0 * self.log_scale).exp(), elongation }
    }

    /// Learns from where the vehicle came up.
    pub fn learn(&mut self, expected: &Expected, way: Vector) {
        let held = self.region(expected).holds(way);
        let missed = if held { 0.0 } else { 1.0 };
        self.log_scale += RATE * (missed - (1.0 - COVERAGE));
        let off = (way - expected.way) / expected.variance.sqrt();
        self.directed += off * off;
        self.squares += off.norm_sqr();
        self.surfacings += 1;
        self.inside += usize::from(held);
    }
}

/// Whether a place is inside a polygon, by crossings of its edges to the east.
#[must_use]
pub fn inside_polygon(corners: &[Vector], place: Vector) -> bool {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let crossed = |(a, b): (&Vector, &Vector)| {
        (a.im > place.im) != (b.im > place.im) && place.re < a.re + (b.re - a.re) * (place.im - a.im) / (b.im - a.im)
    };
    edges.filter(|e| crossed(*e)).count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXPECTED: Expected = Expected { way: Vector::new(1000.0, -500.0), variance: 500.0 * 500.0 };

    #[test]
    fn accuracy_probability_of_circle_and_polygon() {
        let region = Misses::default().region(&EXPECTED);
        let within = |m: f64| region.probability(|p| (p - EXPECTED.way).norm() < m);
        assert!((within(500.0) - (1.0 - (-1f64).exp())).abs() < 0.003, "{}", within(500.0));
        assert!((region.probability(|p| region.holds(p)) - COVERAGE).abs() < 1e-3);
        // Half a plane, as a polygon.
        let corner = |e: f64, n: f64| EXPECTED.way + Vector::new(e, n);
        let half = [corner(0.0, -1e4), corner(1e4, -1e4), corner(1e4, 1e4), corner(0.0, 1e4)];
        let share = region.probability(|p| inside_polygon(&half, p));
        assert!((share - 0.5).abs() < 0.005, "{share}");
    }

    /// Misses along north-east, half as wide across: the ellipse turns there, and its axes are those of the misses.
    #[test]
    fn the_ellipse_takes_the_shape_of_the_misses() {
        let mut misses = Misses::default();
        for k in 0..400 {
            let (size, turn) = (0.9 * ((f64::from(k) * 0.7548).fract() + 0.2), f64::from(k) * 2.4);
            let off = Vector::from_polar(1.0, 0.785) * Vector::new(turn.cos(), 0.5 * turn.sin()) * size;
            misses.learn(&EXPECTED, EXPECTED.way + off * 500.0);
        }
        let region = misses.region(&EXPECTED);
        let (long, short, azimuth) = region.axes();
        assert!((azimuth.to_degrees() - 45.0).abs() < 5.0 && (long / short - 2.0).abs() < 0.2, "{long} {short} {azimuth}");
        assert!(region.edge(32).iter().all(|p| (region.score(*p) / squared_radius() - 1.0).abs() < 1e-6));
        let share = misses.inside as f64 / 400.0;
        assert!((share - COVERAGE).abs() < 0.02, "{share}");
    }
}

//! A mission as it goes: every passage is forecast before it is learnt from.
//!
//! What the filters expect is averaged with the simplest forecast, the current of the passage before, each by its probability by the
//! misses so far: where the filters do not know the sea yet, or never will, little is lost.

use super::current::{Current, Expected, Vector};
use super::passages::{Fix, Passage};
use super::region::{Misses, Region};
use logs::record::plausible::quantile;

/// What is known of a passage's flight before it is flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plan {
    /// Headings, pitch and duration are ordered and kept. In judging, the passage's own way through the water stands in for the order.
    Known,
    /// Nothing: the passage before is flown again.
    Repeated,
}

/// A passage that was forecast; pairs are of the plan known and of the passage before repeated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// Time from fix to fix, s.
    pub time_s: f64,
    /// Distance of the forecast from where the vehicle came up, m, by plan.
    pub miss_m: [f64; 2],
    /// Whether the learnt ellipse held it, by plan.
    pub held: [bool; 2],
    /// Whether the ellipse of the filters alone held it, plan known.
    pub held_unlearnt: bool,
    /// Half axes of the learnt ellipse, their geometric mean, m, by plan.
    pub radius_m: [f64; 2],
    /// Miss of persistence: the velocity over ground of the passage before, m.
    pub persistence_m: f64,
    /// Miss of the passage's own flight with the current of the passage before, m.
    pub last_current_m: f64,
}

/// A dive that is to come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dive {
    /// Time under way, s.
    pub time_s: f64,
    /// Way through the water, m.
    pub through_water: Vector,
}

/// Where and when it comes up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surfacing {
    /// Time, s.
    pub time_s: f64,
    /// 90 % ellipse.
    pub region: Region,
}

/// A surfacing that was forecast over several known dives, and how far off that was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Later {
    /// From the fix before the first of the dives, s.
    pub time_s: f64,
    /// Distance of the forecast from where the vehicle came up, m.
    pub miss_m: f64,
    /// Whether the ellipse held it.
    pub held: bool,
    /// Miss of the velocity over ground of the passage before, m.
    pub persistence_m: f64,
}

/// Variance of the change of through-water velocity from one passage to the next before any was seen, (m/s)²: a quarter of a glider's speed.
const CHANGE_M2_S2: f64 = 0.06 * 0.06;
/// Fewest durations that a scatter is read from.
const FEWEST_DURATIONS: usize = 6;

/// Mean current of a passage, m/s.
fn current_of(passage: &Passage) -> Vector {
    (passage.way() - passage.through_water) / passage.time_s()
}

/// A mission so far.
#[derive(Clone, Debug)]
pub struct Mission {
    current: Current,
    /// By plan.
    pub misses: [Misses; 2],
    last: Option<Passage>,
    /// Sums of squares of the misses of the filters alone and of the current of the passage before, by plan.
    squares: [[f64; 2]; 2],
    /// Squares of changes of through-water velocity, and their number.
    changes: (f64, f64),
    durations_s: Vec<f64>,
    stays_s: Vec<f64>,
}

impl Mission {
    /// Before its first surfacing.
    #[must_use]
    pub fn new(latitude_deg: Option<f64>) -> Self {
        let current = Current::new(latitude_deg);
        let (durations_s, stays_s) = (Vec::new(), Vec::new());
        Self {
            current,
            misses: [Misses::default(); 2],
            last: None,
            squares: Default::default(),
            changes: (CHANGE_M2_S2, 1.0),
            durations_s,
            stays_s,
        }
    }

    /// A mission of these passages, and how each was forecast.
    #[must_use]
    pub fn of(latitude_deg: Option<f64>, passages: &[Passage]) -> (Self, Vec<Judged>) {
        let mut mission = Self::new(latitude_deg);
        let judged = passages.iter().filter_map(|p| mission.learn(p)).collect();
        (mission, judged)
    }

    /// From every surfacing but the first the next one that is so much later or more, s, the dives to it known. Passages of one frame.
    #[must_use]
    pub fn later(latitude_deg: Option<f64>, passages: &[Passage], after_s: f64) -> Vec<Later> {
        let (mut mission, mut out) = (Self::new(latitude_deg), Vec::new());
        for (i, passage) in passages.iter().enumerate() {
            mission.learn(passage);
            let next = &passages[i + 1..];
            let Some(from) = next.first().map(|p| p.from).filter(|_| i > 0) else { continue };
            let Some(n) = next.iter().position(|p| p.to.time_s - from.time_s >= after_s) else { break };
            let dives: Vec<Dive> = next[..=n].iter().map(|p| Dive { time_s: p.time_s(), through_water: p.through_water }).collect();
            let Some(last) = mission.ahead(&from, &dives, Plan::Known).pop() else { continue };
            let (to, time_s) = (next[n].to.place, next[n].to.time_s - from.time_s);
            let persistence_m = (from.place + passage.way() / passage.time_s() * time_s - to).norm();
            out.push(Later { time_s, miss_m: (last.region.place - to).norm(), held: last.region.holds(to), persistence_m });
        }
        out
    }

    /// Forecasts a passage and learns from it; nothing is judged of the first.
    pub fn learn(&mut self, passage: &Passage) -> Option<Judged> {
        let (time_s, way) = (passage.time_s(), passage.way());
        if let Some(last) = self.last {
            let stay_s = (passage.from.time_s - last.to.time_s).max(0.0);
            self.current.pass(stay_s, Vector::default());
            self.stays_s.push(stay_s);
        }
        self.current.begin();
        let before = self.last.map(|last| {
            let mut again = self.current.clone();
            again.pass(time_s, last.through_water * (time_s / last.time_s()));
            (last, again.expected())
        });
        self.current.pass(time_s, passage.through_water);
        let judged = before.map(|(last, repeated)| {
            let change = self.changes.0 / self.changes.1 * time_s * time_s;
            let again = last.through_water * (time_s / last.time_s());
            let filters = [self.current.expected(), Expected { variance: repeated.variance + change, ..repeated }];
            let simple = [passage.through_water, again].map(|w| w + current_of(&last) * time_s);
            let expected = [0, 1].map(|k| self.averaged(k, filters[k], simple[k]));
            let regions = [0, 1].map(|k| self.misses[k].region(&expected[k]));
            let change = passage.through_water / time_s - last.through_water / last.time_s();
            self.changes = (self.changes.0 + change.norm_sqr(), self.changes.1 + 1.0);
            let judged = Judged {
                time_s,
                miss_m: expected.map(|e| (e.way - way).norm()),
                held: regions.map(|r| r.holds(way)),
                held_unlearnt: Misses::default().region(&expected[0]).holds(way),
                radius_m: regions.map(|r| (r.axes().0 * r.axes().1).sqrt()),
                persistence_m: (simple[1] - way).norm(),
                last_current_m: (simple[0] - way).norm(),
            };
            for (k, squares) in self.squares.iter_mut().enumerate() {
                squares[0] += (filters[k].way - way).norm_sqr();
                squares[1] += (simple[k] - way).norm_sqr();
            }
            self.misses.iter_mut().zip(&expected).for_each(|(m, e)| m.learn(e, way));
            judged
        });
        self.current.learn(way);
        self.durations_s.push(time_s);
        self.last = Some(*passage);
        judged
    }

    /// What is expected by filters and by the simplest forecast together.
    fn averaged(&self, plan: usize, filters: Expected, simple: Vector) -> Expected {
        let [of_filters, of_simple] = self.squares[plan];
        // Probability of two forecasts with normal misses of unknown size, in two dimensions: sums of squares to the power of -n.
        let n = self.misses[plan].surfacings as f64;
        let share = if of_simple > 0.0 { 1.0 / (1.0 + (of_filters / of_simple).powf(n)) } else { 0.5 };
        Expected { way: filters.way * share + simple * (1.0 - share), ..filters }
    }

    /// The passage before, flown again: turned to another heading (rad clockwise from north), or made as long as asked (s).
    #[must_use]
    pub fn again(&self, heading_rad: Option<f64>, time_s: Option<f64>) -> Option<Dive> {
        let last = self.last?;
        let time_s = time_s.unwrap_or(last.time_s());
        let turned = |h: f64| Vector::from_polar(last.through_water.norm(), std::f64::consts::FRAC_PI_2 - h);
        let through_water = heading_rad.map_or(last.through_water, turned) * (time_s / last.time_s());
        Some(Dive { time_s, through_water })
    }

    /// The usual stay at the surface, s.
    #[must_use]
    pub fn stay_s(&self) -> f64 {
        if self.stays_s.is_empty() { 0.0 } else { quantile(&self.stays_s, 0.5) }
    }

    /// By how much 90 % of durations differ from the one before, s; none where too few were seen.
    #[must_use]
    pub fn duration_scatter_s(&self) -> Option<f64> {
        let changes: Vec<f64> = self.durations_s.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
        (changes.len() >= FEWEST_DURATIONS).then(|| quantile(&changes, 0.9))
    }

    /// The filters at the last fix.
    fn at(&self, last: &Fix) -> Current {
        let mut ahead = self.current.clone();
        let since_s = self.last.map_or(0.0, |p| (last.time_s - p.to.time_s).max(0.0));
        ahead.pass(since_s, Vector::default());
        ahead.begin();
        ahead
    }

    /// Surfacings of dives that follow one another, from the last fix on, where the first begins.
    #[must_use]
    pub fn ahead(&self, last: &Fix, dives: &[Dive], plan: Plan) -> Vec<Surfacing> {
        let (mut current, mut time_s, mut changed) = (self.at(last), last.time_s, 0.0);
        let (plan_place, mut through_water) = (usize::from(plan == Plan::Repeated), Vector::default());
        let learnt = &self.misses[plan_place];
        let drift = self.last.map_or(Vector::default(), |l| current_of(&l));
        let mut out = Vec::with_capacity(dives.len());
        for (k, dive) in dives.iter().enumerate() {
            if k > 0 {
                current.pass(self.stay_s(), Vector::default());
                time_s += self.stay_s();
            }
            current.pass(dive.time_s, dive.through_water);
            time_s += dive.time_s;
            if plan == Plan::Repeated {
                changed += self.changes.0 / self.changes.1 * dive.time_s * dive.time_s;
            }
            through_water += dive.through_water;
            let simple = through_water + drift * (time_s - last.time_s);
            let Expected { way, variance } = self.averaged(plan_place, current.expected(), simple);
            let region = learnt.region(&Expected { way: last.place + way, variance: variance + changed });
            out.push(Surfacing { time_s, region });
        }
        out
    }

    /// Mean current over the next seconds from the last fix, m/s, and its mean square error.
    #[must_use]
    pub fn current_over(&self, last: &Fix, time_s: f64) -> Expected {
        self.at(last).mean_over(time_s)
    }

    /// Seconds until a place is reached from the last fix with this speed through the water, heading into the current: expected, and the
    /// shorter and longer one of 90 %; none where the current is too strong.
    #[must_use]
    pub fn time_to(&self, last: &Fix, place: Vector, dive: &Dive) -> [Option<f64>; 3] {
        let to = place - last.place;
        // The vehicle makes no way while it stays at the surface.
        let speed = dive.through_water.norm() / (dive.time_s + self.stay_s());
        let with = |sigmas: f64| {
            let mut time_s = to.norm() / speed;
            for _ in 0..20 {
                let current = self.current_over(last, time_s);
                let c = current.way * to.conj() / to.norm();
                let along = (speed * speed - c.im * c.im).max(0.0).sqrt() + c.re + sigmas * (0.5 * current.variance).sqrt();
                let next = to.norm() / along;
                // A memory of months has no place in a forecast.
                if !(along > 0.0 && next < 90.0 * 86_400.0) {
                    return None;
                }
                let settled = (next - time_s).abs() < 60.0;
                time_s = next;
                if settled {
                    break;
                }
            }
            Some(time_s)
        };
        [0.0, 1.645, -1.645].map(with)
    }
}

//! Several simulations side by side: the integration of [`crate::dynamics`], [`LANES`] jobs at a time.
//!
//! One step of one simulation waits for its own square root and divisions most of the time. Independent simulations (the dives of a
//! flight, the columns of a Jacobian) fill that time, two to a register where the nominal law of forces is all there is. Each lane does
//! the same operations in the same order as if it were alone: the result does not depend on what is beside it.

use crate::dynamics::{Job, Point, Track, add_water, angle_of_attack, points};
use crate::prepare::FLOAT_M;
use hydro::effects::{ALPHA_VALID_RAD, Continuation, Flow, ForceModel};
use std::rc::Rc;
use wide::f64x4;

/// Simulations side by side.
const LANES: usize = 4;
type Lanes = f64x4;
/// Speed below which no force of the water is asked for, m/s.
const LEAST_SPEED_M_S: f64 = 1e-6;

/// One simulation under way.
struct Lane<'a> {
    job: usize,
    of: &'a Job<'a>,
    model: ForceModel<'a>,
    points: Rc<Vec<Point>>,
    /// Step that comes next, and how many there are.
    step: usize,
    steps: usize,
    row: usize,
    u: f64,
    n: f64,
    z: f64,
    surge_kg: f64,
    heave_kg: f64,
    out: Track,
}

impl<'a> Lane<'a> {
    fn new(job: usize, of: &'a Job<'a>, model: ForceModel<'a>, points: Rc<Vec<Point>>) -> Self {
        let rows = of.run.time_s.len();
        let mass = of.constants.mass_kg;
        Self {
            job,
            of,
            steps: points.len().saturating_sub(1) / 2,
            points,
            step: 0,
            row: 0,
            u: of.run.start_speed_m_s,
            n: 0.0,
            z: 0.0,
            surge_kg: mass * (1.0 + model.constants.added_mass_surge).max(0.02),
            heave_kg: mass * (1.0 + model.constants.added_mass_heave).max(0.02),
            out: Track {
                depth_m: Vec::with_capacity(rows),
                sink_m_s: Vec::with_capacity(rows),
                speed_m_s: Vec::with_capacity(rows),
                alpha_rad: Vec::with_capacity(rows),
                displacement_m: (0.0, 0.0),
            },
            model,
        }
    }

    fn done(&self) -> bool {
        self.step >= self.steps || self.row >= self.of.run.time_s.len()
    }

    /// Points at the start, the middle and the end of the step that comes next (of the last one, when done).
    fn now(&self) -> [&Point; 3] {
        let k = 2 * self.step.min(self.steps.saturating_sub(1));
        [&self.points[k], &self.points[k + 1], &self.points[k + 2]]
    }

    fn is_afloat(&self) -> bool {
        self.now()[0].buoyancy_n >= 0.0 && self.of.run.inputs[2 * self.step].depth_m < FLOAT_M
    }

    /// Takes the step: new velocities and the depth gained, and the rows on the way.
    fn take(&mut self, afloat: bool, new: [f64; 3], sink_at_start: f64) {
        let run = self.of.run;
        let h = run.step_s;
        let [p0, p1, p2] = self.now();
        let (t0, sin2, cos2) = (p0.time, p2.sin_pitch, p2.cos_pitch);
        let (u0, n0, z0) = (self.u, self.n, self.z);
        let mut sink0 = 0.0;
        if afloat {
            (self.u, self.n) = (0.0, 0.0);
        } else {
            let (sin1, cos1) = (p1.sin_pitch, p1.cos_pitch);
            sink0 = sink_at_start;
            [self.u, self.n, self.z] = new;
            let i = &run.inputs[2 * self.step + 1];
            let horizontal = 0.5 * (u0 + self.u) * cos1 - 0.5 * (n0 + self.n) * sin1;
            self.out.displacement_m.0 += h * horizontal * i.sin_heading;
            self.out.displacement_m.1 += h * horizontal * i.cos_heading;
        }
        let (u, n, z) = (self.u, self.n, self.z);
        let sink1 = if afloat { 0.0 } else { -(u * sin2 + n * cos2) };
        while self.row < run.time_s.len() && run.time_s[self.row] < t0 + h {
            let x = ((run.time_s[self.row] - t0) / h).clamp(0.0, 1.0);
            let (x2, x3) = (x * x, x * x * x);
            // Cubic Hermite between grid points.
            self.out.depth_m.push(
                z0 * (2.0 * x3 - 3.0 * x2 + 1.0) + h * sink0 * (x3 - 2.0 * x2 + x) + z * (3.0 * x2 - 2.0 * x3) + h * sink1 * (x3 - x2),
            );
            self.out.sink_m_s.push(sink0 + (sink1 - sink0) * x);
            let (ur, nr) = (u0 + (u - u0) * x, n0 + (n - n0) * x);
            let speed = (ur * ur + nr * nr).sqrt();
            self.out.speed_m_s.push(speed);
            self.out.alpha_rad.push(if speed > LEAST_SPEED_M_S { angle_of_attack(ur, nr) } else { 0.0 });
            self.row += 1;
        }
        self.step += 1;
    }

    fn finish(mut self, water_depth_m: f64) -> (usize, Track) {
        if !self.of.effects.is_empty() {
            add_water(&mut self.out, self.of.run, &self.model, self.of.constants.gravity_m_s2, water_depth_m);
        }
        (self.job, self.out)
    }
}

/// What the lanes share out: constants of each, one beside the other.
struct Beside {
    surge_kg: Lanes,
    heave_kg: Lanes,
    slope: Lanes,
    quadratic: Lanes,
    cd0: Lanes,
    induced: Lanes,
    hull: Lanes,
    /// Whether the nominal law is all there is in every lane.
    plain: bool,
}

fn beside(of: impl Fn(usize) -> f64) -> Lanes {
    Lanes::from(std::array::from_fn::<f64, LANES, _>(of))
}

impl Beside {
    fn of(lanes: &[Lane; LANES]) -> Self {
        let constant = |pick: &dyn Fn(&Lane) -> f64| beside(|i| pick(&lanes[i]));
        Self {
            surge_kg: constant(&|l| l.surge_kg),
            heave_kg: constant(&|l| l.heave_kg),
            slope: constant(&|l| l.model.constants.lift_slope_per_rad),
            quadratic: constant(&|l| l.model.constants.lift_quadratic_per_rad2),
            cd0: constant(&|l| l.model.constants.cd0),
            induced: constant(&|l| l.model.constants.induced_k),
            hull: constant(&|l| l.model.constants.hull_drag_per_rad2),
            plain: lanes.iter().all(|l| l.model.is_plain()),
        }
    }
}

/// Points of all lanes at one time.
struct Now<'a> {
    at: [&'a Point; LANES],
    /// Lanes whose rates nobody asks for: afloat, or without a job.
    resting: [bool; LANES],
    buoyancy: Lanes,
    dynamic: Lanes,
    sin_pitch: Lanes,
    cos_pitch: Lanes,
    rate: Lanes,
}

impl<'a> Now<'a> {
    fn of(at: [&'a Point; LANES], resting: [bool; LANES]) -> Self {
        let value = |pick: &dyn Fn(&Point) -> f64| beside(|i| pick(at[i]));
        Self {
            buoyancy: value(&|p| p.buoyancy_n),
            dynamic: value(&|p| p.dynamic),
            sin_pitch: value(&|p| p.sin_pitch),
            cos_pitch: value(&|p| p.cos_pitch),
            rate: value(&|p| p.rate),
            at,
            resting,
        }
    }
}

/// The polynomial of [`angle_of_attack`], good where u > 0 and |n| ≤ 0.4 u.
fn small_angle(u: Lanes, n: Lanes) -> Lanes {
    let c = Lanes::splat;
    let x = -n / u;
    let s = x * x;
    let low = (c(0.999_999_999_999_566_6) - c(0.333_333_332_983_024) * s) + s * s * (c(0.199_999_953_476_835) - c(0.142_854_779_522_801_7) * s);
    let high =
        (c(0.111_051_768_035_459_4) - c(0.090_090_542_909_586_4) * s) + s * s * (c(0.070_522_572_057_953_97) - c(0.039_098_735_521_716_9) * s);
    x * (low + s * s * s * s * high)
}

/// Accelerations along and across the hull, and the sink rate.
fn rates(lanes: &[Lane; LANES], b: &Beside, p: &Now, u: Lanes, n: Lanes) -> [Lanes; 3] {
    let speed = (u * u + n * n).sqrt();
    let sink = -(u * p.sin_pitch + n * p.cos_pitch);
    let (mut along, mut across) = (p.buoyancy * p.sin_pitch, p.buoyancy * p.cos_pitch);
    let (us, ns, speeds) = (u.to_array(), n.to_array(), speed.to_array());
    let mut alpha = small_angle(u, n);
    let near = |i: usize| p.resting[i] || us[i] > 0.0 && ns[i].abs() <= 0.4 * us[i];
    if !(0..LANES).all(near) {
        let mut each = alpha.to_array();
        for i in (0..LANES).filter(|i| !near(*i)) {
            each[i] = if speeds[i] > LEAST_SPEED_M_S { angle_of_attack(us[i], ns[i]) } else { 0.0 };
        }
        alpha = Lanes::from(each);
    }
    let angles = alpha.to_array();
    let attached = |i: usize| p.resting[i] || b.plain && angles[i].abs() <= ALPHA_VALID_RAD;
    let size = alpha.abs();
    let mut cl = b.slope * alpha + b.quadratic * alpha * size;
    let mut cd = b.cd0 + b.induced * cl * cl + b.hull * alpha * alpha;
    if !(0..LANES).all(attached) {
        let (mut cls, mut cds) = (cl.to_array(), cd.to_array());
        let sinks = sink.to_array();
        for i in (0..LANES).filter(|i| !attached(*i)) {
            let at = p.at[i];
            let f = lanes[i].model.coefficients(&Flow {
                alpha_rad: angles[i],
                speed_m_s: speeds[i],
                roll_rad: at.roll,
                climb_m_s: -sinks[i],
                time_s: at.time,
                temperature_degc: at.temperature,
            });
            (cls[i], cds[i]) = (f.cl, f.cd);
        }
        (cl, cd) = (Lanes::from(cls), Lanes::from(cds));
    }
    let pressure = p.dynamic * speed;
    let (lift, drag) = (pressure * cl, pressure * cd);
    // With cos α = u/U and sin α = −n/U. At rest both are nothing.
    along += -drag * u - lift * n;
    across += lift * u - drag * n;
    [(along + p.rate * b.heave_kg * n) / b.surge_kg, (across - p.rate * b.surge_kg * u) / b.heave_kg, sink]
}

/// Runs the model over all jobs, results in their order. `beyond` is how lift goes on beyond the valid angle of attack.
#[must_use]
pub fn tracks(jobs: &[Job], water_depth_m: f64, beyond: Continuation) -> Vec<Track> {
    let mut out: Vec<Track> = Vec::new();
    out.resize_with(jobs.len(), Track::default);
    let mut kept: Option<(usize, Rc<Vec<Point>>)> = None;
    let mut start = |k: usize| -> Lane {
        let job = &jobs[k];
        let model = ForceModel::new(job.constants, &job.effects).continued(beyond);
        let points = match &kept {
            Some((of, points)) if jobs[*of].shares_points(job) => points.clone(),
            _ => Rc::new(points(job.run, &model)),
        };
        kept = Some((k, points.clone()));
        Lane::new(k, job, model, points)
    };
    let mut next = LANES.min(jobs.len());
    if next == 0 {
        return out;
    }
    // Lanes without a job repeat the first one and are not kept.
    let mut idle = [false; LANES];
    let mut lanes: [Lane; LANES] = std::array::from_fn(|i| {
        idle[i] = i >= jobs.len();
        start(if i < jobs.len() { i } else { 0 })
    });
    let mut constants = Beside::of(&lanes);
    loop {
        let mut changed = false;
        for i in 0..LANES {
            while !idle[i] && lanes[i].done() {
                let finished = if next < jobs.len() {
                    changed = true;
                    next += 1;
                    std::mem::replace(&mut lanes[i], start(next - 1))
                } else {
                    idle[i] = true;
                    let (job, of, model, points) = (lanes[i].job, lanes[i].of, lanes[i].model, lanes[i].points.clone());
                    std::mem::replace(&mut lanes[i], Lane::new(job, of, model, points))
                };
                let (job, track) = finished.finish(water_depth_m);
                out[job] = track;
            }
        }
        if idle.iter().all(|i| *i) {
            return out;
        }
        if changed {
            constants = Beside::of(&lanes);
        }
        let afloat: [bool; LANES] = std::array::from_fn(|i| !idle[i] && lanes[i].is_afloat());
        let resting = std::array::from_fn(|i| idle[i] || afloat[i]);
        let at = |k: usize| Now::of(std::array::from_fn(|i| lanes[i].now()[k]), resting);
        let (p0, p1, p2) = (at(0), at(1), at(2));
        let h = beside(|i| lanes[i].of.run.step_s);
        let (u, n, z) = (beside(|i| lanes[i].u), beside(|i| lanes[i].n), beside(|i| lanes[i].z));
        let (half, two, sixth) = (Lanes::splat(0.5), Lanes::splat(2.0), h / Lanes::splat(6.0));
        let rates = |p: &Now, u: Lanes, n: Lanes| rates(&lanes, &constants, p, u, n);
        let [a1, b1, c1] = rates(&p0, u, n);
        let [a2, b2, c2] = rates(&p1, u + half * h * a1, n + half * h * b1);
        let [a3, b3, c3] = rates(&p1, u + half * h * a2, n + half * h * b2);
        let [a4, b4, c4] = rates(&p2, u + h * a3, n + h * b3);
        let sum = |a: Lanes, b: Lanes, c: Lanes, d: Lanes| a + two * b + two * c + d;
        let u = (u + sixth * sum(a1, a2, a3, a4)).to_array();
        let n = (n + sixth * sum(b1, b2, b3, b4)).to_array();
        let z = (z + sixth * sum(c1, c2, c3, c4)).to_array();
        let sink = c1.to_array();
        for i in (0..LANES).filter(|i| !idle[*i]) {
            lanes[i].take(afloat[i], [u[i], n[i], z[i]], sink[i]);
        }
    }
}

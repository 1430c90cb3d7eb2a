//! Several simulations side by side: the integration of [`crate::model::dynamics`], four jobs at a time.
//!
//! One step of one simulation waits for its own square root and divisions most of the time. Independent simulations (the dives of a
//! flight, the columns of a Jacobian) fill that time, two to a register; only what effects add in the flow is asked lane by lane. Each
//! lane does the same operations in the same order as if it were alone: the result does not depend on the other lanes.

use crate::model::dynamics::{Job, Point, Track, add_water, angle_of_attack, points, small_angle};
use crate::preprocess::{FLOAT_M, Input, Run};
use hydro::effects::{ALPHA_VALID_RAD, Active, Constants, Continuation, Flow, ForceModel, InFlow};
use std::borrow::Cow;
use std::rc::Rc;
use wide::f64x4;

/// Velocity across the hull per velocity along it at [`ALPHA_VALID_RAD`]: tan 0.35.
const TAN_VALID: f64 = 0.365_028_494_830_424_54;
/// Simulations side by side.
const LANES: usize = 4;
type Lanes = f64x4;
/// A bit for each.
const ALL_LANES: u32 = (1 << LANES) - 1;
/// Speed below which no force of the water is asked for, m/s.
const LEAST_SPEED_M_S: f64 = 1e-6;

/// Least decay of the motion across the hull within a step that the exponential step is made for: below it the factors of
/// [`Decay`] lose digits, and any decay may be assumed, since what differs from it is integrated as the rest is.
const LEAST_DECAY: f64 = 0.1;

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
            steps: of.run.inputs.len().saturating_sub(1) / 2,
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
                half_steps: of.run.inputs.len() as u64,
            },
            model,
        }
    }

    fn done(&self) -> bool {
        self.step >= self.steps || self.row >= self.of.run.time_s.len()
    }

    /// Index of the point at the start of the step that comes next (of the last one, when done); the next two are at its middle and
    /// its end.
    fn first(&self) -> usize {
        2 * self.step.min(self.steps.saturating_sub(1))
    }

    /// What was measured at a point of the step that comes next.
    fn input(&self, ahead: usize) -> &'a Input {
        &self.of.run.inputs[2 * self.step + ahead]
    }

    fn is_afloat(&self) -> bool {
        self.points[self.first()].buoyancy_n >= 0.0 && self.input(0).depth_m < FLOAT_M
    }

    /// Takes the step: new velocities and the depth gained, and the rows on the way.
    fn take(&mut self, afloat: bool, new: [f64; 3], sink_at_start: f64) {
        let run = self.of.run;
        let h = run.step_s;
        let k = self.first();
        let (p1, p2) = (self.points[k + 1], self.points[k + 2]);
        let (t0, sin2, cos2) = (run.inputs[k].sensed.time_s, p2.sin_pitch, p2.cos_pitch);
        let (u0, n0, z0) = (self.u, self.n, self.z);
        let mut sink0 = 0.0;
        if afloat {
            (self.u, self.n) = (0.0, 0.0);
        } else {
            let (sin1, cos1) = (p1.sin_pitch, p1.cos_pitch);
            sink0 = sink_at_start;
            [self.u, self.n, self.z] = new;
            if self.of.attached.iter().any(|(from, to)| (*from..*to).contains(&t0)) {
                let most = TAN_VALID * self.u.max(0.0);
                self.n = self.n.clamp(-most, most);
            }
            let i = self.input(1);
            let horizontal = 0.5 * (u0 + self.u) * cos1 - 0.5 * (n0 + self.n) * sin1;
            self.out.displacement_m.0 += h * horizontal * i.sin_heading;
            self.out.displacement_m.1 += h * horizontal * i.cos_heading;
        }
        let (u, n, z) = (self.u, self.n, self.z);
        let sink1 = if afloat { 0.0 } else { -(u * sin2 + n * cos2 * p2.level) };
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

    /// The track, the water's own motion in it.
    fn finish(&mut self, water_depth_m: f64) -> Track {
        let mut out = std::mem::take(&mut self.out);
        if !self.of.effects.is_empty() {
            add_water(&mut out, self.of.run, &self.model, self.of.constants.gravity_m_s2, water_depth_m);
        }
        out
    }
}

/// What the lanes share out: constants of each, lane by lane.
struct Vehicles {
    surge_kg: Lanes,
    heave_kg: Lanes,
    /// What a force gives along and across, 1/kg.
    per_surge: Lanes,
    per_heave: Lanes,
    slope: Lanes,
    slope_loss: Lanes,
    quadratic: Lanes,
    cd0: Lanes,
    induced: Lanes,
    hull: Lanes,
    hull_cubic: Lanes,
    step_s: Lanes,
    /// Mass carried across the hull over that carried along it, and whether any lane turns as it banks.
    across_per_along: Lanes,
    turns: bool,
    /// Hooks in the flow that an effect of any lane has.
    hooks: InFlow,
}

fn lanes_of(of: impl Fn(usize) -> f64) -> Lanes {
    Lanes::from(std::array::from_fn::<f64, LANES, _>(of))
}

impl Vehicles {
    /// The nominal law: lift at an angle of lift, so much added to it, and its drag.
    fn nominal(&self, p: &Now, alpha: Lanes, lift_angle: Lanes, added_lift: Lanes) -> (Lanes, Lanes) {
        let slope = self.slope * (Lanes::ONE - self.slope_loss * lift_angle * lift_angle);
        let cl = slope * lift_angle + self.quadratic * lift_angle * lift_angle.abs() + added_lift;
        let hull = self.hull + self.hull_cubic * alpha.abs();
        (cl, self.cd0 * p.cd0_relative + self.induced * cl * cl + hull * alpha * alpha)
    }

    fn of(lanes: &[Lane; LANES]) -> Self {
        let constant = |pick: &dyn Fn(&Lane) -> f64| lanes_of(|i| pick(&lanes[i]));
        Self {
            surge_kg: constant(&|l| l.surge_kg),
            heave_kg: constant(&|l| l.heave_kg),
            per_surge: constant(&|l| 1.0 / l.surge_kg),
            per_heave: constant(&|l| 1.0 / l.heave_kg),
            slope: constant(&|l| l.model.constants.lift_slope_per_rad),
            slope_loss: constant(&|l| l.model.constants.slope_loss_per_rad2),
            quadratic: constant(&|l| l.model.constants.lift_quadratic_per_rad2),
            cd0: constant(&|l| l.model.constants.cd0),
            induced: constant(&|l| l.model.constants.induced_k),
            hull: constant(&|l| l.model.constants.hull_drag_per_rad2),
            hull_cubic: constant(&|l| l.model.constants.hull_drag_per_rad3),
            step_s: constant(&|l| l.of.run.step_s),
            across_per_along: constant(&|l| l.heave_kg / l.surge_kg),
            turns: lanes.iter().any(|l| l.model.constants.banked_turn != 0.0),
            hooks: lanes.iter().fold(InFlow::NOTHING, |hooks, l| hooks.or(l.model.in_flow())),
        }
    }
}

/// Points of all lanes at one time.
struct Now {
    /// Index of each.
    at: [usize; LANES],
    buoyancy: Lanes,
    dynamic: Lanes,
    sin_pitch: Lanes,
    cos_pitch: Lanes,
    rate: Lanes,
    cd0_relative: Lanes,
    upright: Lanes,
    level: Lanes,
}

impl Now {
    /// `ahead` points from the start of the step that comes next.
    fn of(lanes: &[Lane; LANES], ahead: usize) -> Self {
        let at: [usize; LANES] = std::array::from_fn(|i| lanes[i].first() + ahead);
        let point: [Point; LANES] = std::array::from_fn(|i| lanes[i].points[at[i]]);
        let value = |pick: fn(&Point) -> f64| lanes_of(|i| pick(&point[i]));
        Self {
            at,
            buoyancy: value(|p| p.buoyancy_n),
            dynamic: value(|p| p.dynamic),
            sin_pitch: value(|p| p.sin_pitch),
            cos_pitch: value(|p| p.cos_pitch),
            rate: value(|p| p.rate),
            cd0_relative: lanes_of(|i| lanes[i].of.run.inputs[at[i]].cd0_relative),
            upright: value(|p| p.upright),
            level: value(|p| p.level),
        }
    }
}

/// How all lanes move.
struct Motion {
    u: Lanes,
    n: Lanes,
    speed: Lanes,
    alpha: Lanes,
    sink: Lanes,
    /// Lanes within the valid angle of attack whose rates are wanted, and those beyond it.
    asked: u32,
    beyond: u32,
}

/// Coefficients of lift and drag where effects act in the flow, or where a lane is beyond the valid angle of attack.
fn under_effects(lanes: &[Lane; LANES], b: &Vehicles, p: &Now, m: &Motion) -> (Lanes, Lanes) {
    let (alphas, speeds, sinks) = (m.alpha.to_array(), m.speed.to_array(), m.sink.to_array());
    let flow = |i: usize| {
        let at = lanes[i].points[p.at[i]];
        Flow {
            alpha_rad: alphas[i],
            speed_m_s: speeds[i],
            roll_rad: at.roll,
            climb_m_s: -sinks[i],
            time_s: lanes[i].of.run.inputs[p.at[i]].sensed.time_s,
            temperature_degc: at.temperature,
            attached: false,
        }
    };
    let each = |of: &dyn Fn(&ForceModel, usize) -> f64| lanes_of(|i| if m.asked & (1 << i) == 0 { 0.0 } else { of(&lanes[i].model, i) });
    let angle = if b.hooks.lift_angle { each(&|model, i| model.lift_angle_rad(alphas[i])) } else { m.alpha };
    let angles = angle.to_array();
    let added = if b.hooks.lift { each(&|model, i| model.added_lift(&flow(i), angles[i])) } else { Lanes::ZERO };
    let (mut cl, mut cd) = b.nominal(p, m.alpha, angle, added);
    if b.hooks.drag {
        let lift = cl.to_array();
        cd += each(&|model, i| model.added_drag(&flow(i), lift[i]));
    }
    if b.hooks.normal_force {
        // With cos α = u/U and sin α = −n/U.
        let force = each(&|model, i| model.normal_force(&flow(i))) / m.speed.max(Lanes::splat(LEAST_SPEED_M_S));
        cd -= force * m.n;
        cl += force * m.u;
    }
    if m.beyond != 0 {
        let (mut cls, mut cds) = (cl.to_array(), cd.to_array());
        for i in (0..LANES).filter(|i| m.beyond & (1 << i) != 0) {
            let f = lanes[i].model.coefficients(&flow(i));
            (cls[i], cds[i]) = (f.cl, f.cd);
        }
        (cl, cd) = (Lanes::from(cls), Lanes::from(cds));
    }
    (cl, cd)
}

/// Accelerations along and across the hull, and the sink rate. Nobody asks for those of `resting` lanes (a bit for each): afloat, or
/// without a job.
fn rates(lanes: &[Lane; LANES], b: &Vehicles, resting: u32, p: &Now, u: Lanes, n: Lanes) -> [Lanes; 3] {
    let speed = (u * u + n * n).sqrt();
    let sink = -(u * p.sin_pitch + n * p.cos_pitch * p.level);
    let (mut along, mut across) = (p.buoyancy * p.sin_pitch, p.buoyancy * p.cos_pitch);
    if b.turns {
        // Without sideslip the net buoyancy across the wings turns the vehicle: m1 r u = −B cos θ sin φ, and with it goes a rate of pitch
        // in the body's own axes, q = r tan φ.
        let aside = across * (Lanes::ONE / p.level - p.level);
        along -= aside * b.across_per_along * n / speed.max(Lanes::splat(LEAST_SPEED_M_S));
        across = across * p.level + aside;
    }
    let mut alpha = small_angle(u, n);
    let near = resting | (u.simd_gt(Lanes::ZERO) & n.abs().simd_le(Lanes::splat(0.4) * u)).to_bitmask();
    if near != ALL_LANES {
        let (mut each, us, ns, speeds) = (alpha.to_array(), u.to_array(), n.to_array(), speed.to_array());
        for i in (0..LANES).filter(|i| near & (1 << i) == 0) {
            each[i] = if speeds[i] > LEAST_SPEED_M_S { angle_of_attack(us[i], ns[i]) } else { 0.0 };
        }
        alpha = Lanes::from(each);
    }
    let within = resting | alpha.abs().simd_le(Lanes::splat(ALPHA_VALID_RAD)).to_bitmask();
    let (cl, cd) = if b.hooks == InFlow::NOTHING && within == ALL_LANES {
        b.nominal(p, alpha, alpha, Lanes::ZERO)
    } else {
        under_effects(lanes, b, p, &Motion { u, n, speed, alpha, sink, asked: within & !resting, beyond: !within & ALL_LANES })
    };
    let pressure = p.dynamic * speed;
    let (lift, drag) = (pressure * cl * p.upright, pressure * cd);
    // With cos α = u/U and sin α = −n/U. At rest both are nothing.
    along += -drag * u - lift * n;
    across += lift * u - drag * n;
    [(along + p.rate * b.heave_kg * n) * b.per_surge, (across - p.rate * b.surge_kg * u) * b.per_heave, sink]
}

/// One step of the motion across the hull by exponential time differencing of fourth order (Cox and Matthews 2002, eq. 26 to 29). Lift
/// decays it within seconds, at a glide as well as at several times the file's lift: a decay that is assumed through the step is integrated
/// exactly, and a steady glide stays one, however long the step.
struct Decay {
    /// Assumed decay, 1/s.
    per_s: Lanes,
    /// What half a step leaves of a velocity, and what it makes of a rate, s.
    by_half: Lanes,
    half: Lanes,
    /// What a whole step makes of the rates at its start, twice in its middle and at its end, s.
    first: Lanes,
    middle: Lanes,
    last: Lanes,
}

impl Decay {
    /// Decay by lift at the angle of attack where the step begins, at the faster of the speeds where it begins and where it ends.
    fn of(b: &Vehicles, p: &Now, [u, n]: [Lanes; 2], u_at_end: Lanes) -> Self {
        let speed = (u * u + n * n).sqrt();
        let angle = n.abs() / speed.max(Lanes::splat(LEAST_SPEED_M_S));
        let slope = (b.slope + Lanes::splat(2.0) * b.quadratic * angle) * p.upright + b.cd0;
        let x = (b.per_heave * p.dynamic * speed.max(u_at_end.abs()) * slope * b.step_s).max(Lanes::splat(LEAST_DECAY));
        // phi functions at -x.
        let by_half = (Lanes::splat(-0.5) * x).exp();
        let phi1 = (Lanes::ONE - by_half * by_half) / x;
        let phi2 = (Lanes::ONE - phi1) / x;
        let phi3 = (Lanes::splat(0.5) - phi2) / x;
        let c = Lanes::splat;
        Self {
            per_s: x / b.step_s,
            by_half,
            half: b.step_s * (Lanes::ONE - by_half) / x,
            first: b.step_s * (phi1 - c(3.0) * phi2 + c(4.0) * phi3),
            middle: b.step_s * (c(2.0) * phi2 - c(4.0) * phi3),
            last: b.step_s * (c(4.0) * phi3 - phi2),
        }
    }
}

/// Runs the model over one run of a flight. `beyond` is how lift goes on beyond the valid angle of attack.
#[must_use]
pub fn track(run: &Run, nominal: Constants, effects: &[Active], water_depth_m: f64, beyond: Continuation) -> Track {
    tracks_of(&[run], nominal, effects, water_depth_m, beyond, &[]).pop().unwrap_or_default()
}

/// The same over several runs side by side, results in their order, held attached in these stretches.
#[must_use]
pub(crate) fn tracks_of(
    runs: &[&Run],
    nominal: Constants,
    effects: &[Active],
    water_depth_m: f64,
    beyond: Continuation,
    attached: &[(f64, f64)],
) -> Vec<Track> {
    let jobs: Vec<Job> =
        runs.iter().map(|run| Job { run, constants: nominal, effects: Cow::Borrowed(effects), attached, clock_s: 0.0 }).collect();
    tracks(&jobs, water_depth_m, beyond)
}

/// Runs the model over all jobs, results in their order. `beyond` is how lift goes on beyond the valid angle of attack.
#[must_use]
pub fn tracks(jobs: &[Job], water_depth_m: f64, beyond: Continuation) -> Vec<Track> {
    let mut out: Vec<Track> = Vec::new();
    out.resize_with(jobs.len(), Track::default);
    // Points of the run that is under way, and of whom.
    let mut kept: Vec<(usize, Rc<Vec<Point>>)> = Vec::new();
    let mut start = |k: usize| -> Lane {
        logs::stop::here();
        let job = &jobs[k];
        let model = ForceModel::new(job.constants, &job.effects).continued(beyond);
        // Those of a long run are most of what a diagnosis holds.
        let later = |of: usize| jobs[k..].iter().any(|j| jobs[of].shares_points(j));
        kept.retain(|(of, points)| std::ptr::eq(jobs[*of].run, job.run) && (Rc::strong_count(points) > 1 || later(*of)));
        let known = kept.iter().find(|(of, _)| jobs[*of].shares_points(job)).map(|(_, points)| points.clone());
        let points = known.unwrap_or_else(|| {
            let points = Rc::new(points(job.run, &model, job.clock_s));
            kept.push((k, points.clone()));
            points
        });
        Lane::new(k, job, model, points)
    };
    let mut next = LANES.min(jobs.len());
    if next == 0 {
        return out;
    }
    // Lanes without a job repeat the last one and are not kept.
    let mut idle: [bool; LANES] = std::array::from_fn(|i| i >= jobs.len());
    let mut lanes: [Lane; LANES] = std::array::from_fn(|i| start(i.min(jobs.len() - 1)));
    let mut constants = Vehicles::of(&lanes);
    let mut start_of_step = None;
    loop {
        let mut changed = false;
        for i in 0..LANES {
            while !idle[i] && lanes[i].done() {
                out[lanes[i].job] = lanes[i].finish(water_depth_m);
                if next < jobs.len() {
                    lanes[i].points = Rc::default();
                    lanes[i] = start(next);
                    (next, changed) = (next + 1, true);
                } else {
                    idle[i] = true;
                }
            }
        }
        if idle.iter().all(|i| *i) {
            return out;
        }
        if changed {
            constants = Vehicles::of(&lanes);
            start_of_step = None;
        }
        let afloat: [bool; LANES] = std::array::from_fn(|i| !idle[i] && lanes[i].is_afloat());
        let resting = (0..LANES).fold(0, |bits, i| bits | u32::from(idle[i] || afloat[i]) << i);
        let p0 = start_of_step.take().unwrap_or_else(|| Now::of(&lanes, 0));
        let (p1, p2) = (Now::of(&lanes, 1), Now::of(&lanes, 2));
        let h = constants.step_s;
        let (u, n, z) = (lanes_of(|i| lanes[i].u), lanes_of(|i| lanes[i].n), lanes_of(|i| lanes[i].z));
        let (half, two, sixth) = (Lanes::splat(0.5), Lanes::splat(2.0), h / Lanes::splat(6.0));
        let [a1, b1, c1] = rates(&lanes, &constants, resting, &p0, u, n);
        let decay = Decay::of(&constants, &p0, [u, n], u + h * a1);
        // Along the hull and down: Runge-Kutta. Across it: what the assumed decay leaves of the rate.
        let rates = |p: &Now, u: Lanes, n: Lanes| {
            let [along, across, sink] = rates(&lanes, &constants, resting, p, u, n);
            [along, across + decay.per_s * n, sink]
        };
        let b1 = b1 + decay.per_s * n;
        let n2 = decay.by_half * n + decay.half * b1;
        let [a2, b2, c2] = rates(&p1, u + half * h * a1, n2);
        let [a3, b3, c3] = rates(&p1, u + half * h * a2, decay.by_half * n + decay.half * b2);
        let [a4, b4, c4] = rates(&p2, u + h * a3, decay.by_half * n2 + decay.half * (two * b3 - b1));
        let sum = |a: Lanes, b: Lanes, c: Lanes, d: Lanes| a + two * b + two * c + d;
        let u = (u + sixth * sum(a1, a2, a3, a4)).to_array();
        let n = (decay.by_half * decay.by_half * n + decay.first * b1 + decay.middle * (b2 + b3) + decay.last * b4).to_array();
        let z = (z + sixth * sum(c1, c2, c3, c4)).to_array();
        let sink = c1.to_array();
        for i in (0..LANES).filter(|i| !idle[*i]) {
            lanes[i].take(afloat[i], [u[i], n[i], z[i]], sink[i]);
        }
        // One step ends where the next begins. (A lane without a job stays where it was: nobody asks for its rates.)
        start_of_step = Some(p2);
    }
}

#[cfg(test)]
pub(crate) mod tests;

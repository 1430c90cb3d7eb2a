//! The eight segments as they really happened: dynamics, on-board pitch control, pump, battery, turns.
//!
//! State: depth, velocity along and across the body relative to the water,
//! pitch and pitch rate; fourth-order Runge–Kutta, fixed step ([`STEP_S`]).
//! The force from accelerating water (pressure gradient) and the inertia of the
//! moving frame cancel for a neutrally buoyant body, so water motion enters
//! through kinematics only. Controls are held over a step.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::nature::{ALPHA_END_RAD, Banking, Instant, Nature, Stall};
use super::ocean::Ocean;
use super::small_structure::Here;
use super::vehicle::{Nominal, PITCH};
use super::{SEGMENTS, Site};

/// Integration step, s: a quarter of the fastest time constant that moves depth (heave, about 2 s); halving it
/// changes depth by less than 1 mm (tested).
pub const STEP_S: f64 = 0.5;
/// Floating at the surface before and after, s (format, section 3).
const FLOAT_S: [f64; 2] = [20.0, 40.0];
/// A segment that has not come back by then is broken off, s.
const LONGEST_S: f64 = 12_000.0;
/// Water that a leak can take in before the compartment is full, m³ (guess; below the smallest stroke, so the vehicle comes back).
const BILGE_M3: f64 = 45e-6;

/// What was commanded in one segment.
#[derive(Clone, Debug)]
pub struct Orders {
    /// Pause before it, s.
    pub gap_s: f64,
    /// Start, s since the start of the trial: the end of the segment before plus the pause.
    pub start_s: f64,
    /// Pitch of dive and climb, rad, both positive.
    pub pitch: [f64; 2],
    /// Ballast stroke, m³.
    pub ballast: f64,
    /// Number of yos, upper and lower turning depth, m.
    pub yos: usize,
    /// Upper and lower turning depth, m.
    pub depths: [f64; 2],
    /// First heading, rad.
    pub heading: f64,
    /// Pump rate when diving and when climbing, m³/s.
    pub pump: [f64; 2],
    /// Roll used for turning, rad.
    pub bank: f64,
    /// Course changes: depth m, on the dive (true) or climb, change rad.
    pub turns: Vec<(f64, bool, f64)>,
}

impl Orders {
    /// Draws the eight segments: distinct pitches over the range the wing can fly, distinct strokes.
    pub fn draw(site: Site, wing_lowest_pitch_deg: f64, days: f64, rng: &mut ChaCha8Rng) -> Vec<Self> {
        let lowest = wing_lowest_pitch_deg + rng.random_range(0.0..2.0);
        let highest = rng.random_range(36.0..44.0);
        let mut levels: Vec<usize> = (0..SEGMENTS).collect();
        let mut strokes: Vec<usize> = (0..SEGMENTS).collect();
        for i in (1..SEGMENTS).rev() {
            levels.swap(i, rng.random_range(0..=i));
            strokes.swap(i, rng.random_range(0..=i));
        }
        // Sea: enough to climb out through the light surface layer.
        let weakest = if site == Site::Lake { rng.random_range(145.0..185.0) } else { rng.random_range(182.0..205.0) };
        let fastest = rng.random_range(13.0..21.0) * 1e-6;
        let slowest = fastest * if site == Site::Lake { rng.random_range(0.55..0.8) } else { rng.random_range(0.35..0.6) };
        let bank = rng.random_range(0.2..0.32);
        // Gaps: one or two long pauses, the rest short.
        let mut gaps: Vec<f64> = (0..SEGMENTS).map(|_| libm::exp(rng.random_range(-1.2..1.2))).collect();
        if site == Site::Lake {
            let pause = rng.random_range(2..SEGMENTS - 1);
            gaps.iter_mut().enumerate().for_each(|(i, g)| *g = if i == pause { 0.0 } else { rng.random_range(1900.0..3100.0) });
            let rest: f64 = gaps.iter().sum();
            gaps[pause] = (days * 86_400.0 - rest).max(3000.0);
        } else {
            let sum: f64 = gaps.iter().sum();
            gaps.iter_mut().for_each(|g| *g = *g / sum * days * 86_400.0);
        }
        gaps[0] = rng.random_range(60.0..3000.0);
        let mut orders = Vec::with_capacity(SEGMENTS);
        for i in 0..SEGMENTS {
            let share = (levels[i] as f64 + rng.random_range(-0.25..0.25)) / (SEGMENTS - 1) as f64;
            let pitch = (lowest + (highest - lowest) * share.clamp(0.0, 1.0)).to_radians();
            let stroke = weakest + (255.0 - weakest) * (strokes[i] as f64 + rng.random_range(0.0..1.0)) / SEGMENTS as f64;
            let (yos, depths) = match site {
                Site::Lake => (2, [rng.random_range(2.8..3.8), rng.random_range(25.5..27.0)]),
                Site::Sea => (1, [0.0, rng.random_range(199.0..201.5)]),
            };
            let mut turns = Vec::new();
            for dive in [true, false] {
                let count = if site == Site::Lake { 1 } else { rng.random_range(1..4) };
                for _ in 0..count {
                    let depth = rng.random_range(0.12..0.92) * depths[1];
                    let change = rng.random_range(0.6..1.7) * if rng.random_bool(0.5) { 1.0 } else { -1.0 };
                    turns.push((depth, dive, change));
                }
            }
            orders.push(Self {
                gap_s: gaps[i].max(if i == 0 { 60.0 } else { 400.0 }),
                start_s: 0.0,
                pitch: [pitch, pitch],
                ballast: stroke * 1e-6,
                yos,
                depths,
                heading: rng.random_range(0.0..core::f64::consts::TAU),
                pump: [fastest, slowest],
                bank,
                turns,
            });
        }
        orders
    }

    /// Turns to and fro by a radian and a half at six depths of every dive and climb, banked by so much, rad.
    pub(crate) fn turn_often(&mut self, bank: f64) {
        self.bank = bank;
        let depth = |k: i32| f64::from(k) / 7.0 * self.depths[1];
        let change = |k: i32| if k % 2 == 0 { 1.5 } else { -1.5 };
        self.turns = [true, false]
            .into_iter()
            .flat_map(|dive| (1..=6).map(move |k| (k, dive)))
            .map(|(k, dive)| (depth(k), dive, change(k)))
            .collect();
    }
}

/// One instant of what really happened, on the step grid.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// Time since the start of the segment, s.
    pub t: f64,
    /// Depth, m.
    pub depth: f64,
    /// Depth the vehicle would have without the background motion, from the same relative velocity, m.
    pub known_depth: f64,
    /// The part of it that water motion of a missing effect gives, m.
    pub stirred_depth: f64,
    /// Velocity along and across (up) the body relative to the water, m/s.
    pub velocity: [f64; 2],
    /// True pitch, rad.
    pub pitch: f64,
    /// True roll, rad.
    pub roll: f64,
    /// True heading, rad, not wrapped.
    pub heading: f64,
    /// Ballast reading, m³.
    pub ballast: f64,
    /// Battery position reading, m.
    pub battery: f64,
    /// Gauge pressure, Pa.
    pub pressure: f64,
    /// Water temperature at the vehicle, °C.
    pub temperature: f64,
    /// Temperature of the conductivity cell's water as density sees it, °C.
    pub cell_temperature: f64,
    /// True density at the vehicle, kg/m³.
    pub density: f64,
    /// East and north, m.
    pub position: [f64; 2],
    /// Floating at the surface.
    pub floating: bool,
}

/// Sizes of the angle of attack at the instants under water, rad.
fn angles_under_water(moments: &[Moment]) -> impl Iterator<Item = f64> + '_ {
    let under = moments.iter().filter(|m| !m.floating && m.depth > 2.0);
    under.map(|m| libm::atan2(-m.velocity[1], m.velocity[0]).abs())
}

/// Share of the time under water that was flown beyond the angle of attack where the given law ends.
#[must_use]
pub fn stalled_share(moments: &[Moment]) -> f64 {
    let (mut stalled, mut under) = (0_u32, 0_u32);
    for size in angles_under_water(moments) {
        under += 1;
        stalled += u32::from(size > ALPHA_END_RAD);
    }
    f64::from(stalled) / f64::from(under.max(1))
}

/// Shares of the time under water that were flown where flow may be attached or separated: those of either.
#[must_use]
pub fn branches(moments: &[Moment], stall: &Stall) -> [f64; 2] {
    let (mut flown, mut under, mut separated) = ([0_u32; 2], 0_u32, false);
    for size in angles_under_water(moments) {
        separated = stall.separates(size, separated);
        under += 1;
        if (stall.angle - stall.hysteresis..stall.angle).contains(&size) {
            flown[usize::from(separated)] += 1;
        }
    }
    flown.map(|n| f64::from(n) / f64::from(under.max(1)))
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Leg {
    Wait,
    Dive,
    Climb,
    Float,
}

/// Pitch controller and actuators of the vehicle (not the project's controller): feed-forward from the trim, proportional
/// and slow integral on measured pitch, rate-limited battery (rates as in the format's examples).
struct Autopilot {
    integral: f64,
}

const BATTERY_RATE: f64 = 0.003;
const BATTERY_GAIN: f64 = 0.010;
const BATTERY_INTEGRAL: f64 = 6e-5;
/// Turn rate per speed and roll, 1/m (format's examples: 0.035 rad/s at 0.3 m/s and 0.25 rad).
const TURN_PER_METRE: f64 = 0.47;
/// Side force of hull and fin, 1/rad on the reference area (guess: a fin of 0.03 m² and a hull in cross flow).
const SIDE_SLOPE: f64 = 3.0;
/// Speed that a turn is reckoned at, at least, m/s, and the fastest turn, rad/s.
const LEAST_TURNING_M_S: f64 = 0.12;
const FASTEST_TURN: f64 = 0.08;

impl Autopilot {
    fn battery(&mut self, order: f64, measured: f64, ballast: f64, dt: f64, mass: f64) -> f64 {
        let p = &PITCH;
        let forward = p.ballast_arm * 1000.0 * ballast / p.battery_mass - mass * p.metacentric_height / p.battery_mass * libm::tan(order);
        let error = measured - order;
        if error.abs() < 0.15 {
            self.integral = (self.integral + BATTERY_INTEGRAL * error * dt).clamp(-0.01, 0.01);
        }
        (forward + BATTERY_GAIN * error.clamp(-0.3, 0.3) + self.integral).clamp(-0.035, 0.035)
    }
}

/// The segment that is being flown.
pub struct Voyage<'a> {
    /// File numbers (the autopilot and the pump know only these).
    pub nominal: &'a Nominal,
    /// The real vehicle.
    pub nature: &'a Nature,
    /// The real water.
    pub ocean: &'a Ocean,
    /// Constant list, rad.
    pub list: f64,
}

impl Voyage<'_> {
    /// Flies segment `index`; the water's background motion and the pitch noise come from `rng`.
    pub fn fly(&self, index: usize, orders: &Orders, step: f64, rng: &mut ChaCha8Rng) -> Vec<Moment> {
        let (nature, ocean, column) = (self.nature, self.ocean, &self.ocean.column);
        let seconds = (2.0 * orders.depths[1] * orders.yos as f64 / 0.035).min(LONGEST_S) as usize + 200;
        let background = ocean.colour.realise(ocean.rms, ocean.time_s, seconds, rng);
        let up = |t: f64, z: f64| {
            let x = t.clamp(0.0, (seconds - 2) as f64);
            let i = x as usize;
            let w = background[i] + (background[i + 1] - background[i]) * (x - i as f64);
            w * libm::tanh(z.max(0.0) / 1.5)
        };
        let effect_up = |t: f64, z: f64| {
            let wave = ocean.wave.as_ref().map_or(0.0, |w| w.motion(index, t).0 * column.mode(z, w.mode));
            wave + ocean.steady_up(z)
        };
        let water_depth = |t: f64, z: f64| z + ocean.wave.as_ref().map_or(0.0, |w| w.motion(index, t).1 * column.mode(z, w.mode));

        let off = &nature.off;
        let mut pilot = Autopilot { integral: 0.0 };
        let (mut z, mut u, mut n, mut theta, mut q, mut v) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
        let mut ballast = orders.ballast;
        let mut actual_ballast = ballast;
        let mut battery = 0.0_f64;
        let mut roll_true = 0.0;
        let list = self.list;
        let mut heading = orders.heading;
        let mut course = orders.heading;
        let mut leg = Leg::Wait;
        // Legs of the whole trial are numbered through: a segment has fewer than eight.
        let (mut leg_number, mut turned_at) = (8 * index, 0.0);
        let mut yos_left = orders.yos;
        let mut turns = orders.turns.clone();
        let mut hull_temperature = column.temperature(0.0);
        let mut cell_temperature = hull_temperature;
        let mut flood_density = column.density(0.0);
        let (mut known, mut stirred) = (0.0, 0.0);
        let mut position = [0.0, 0.0];
        let mut separated = false;
        let mut float_from = f64::NAN;
        let mut moments = Vec::with_capacity(4000);
        let control_every = (2.0 / step).round() as usize;
        let mut battery_order = 0.0;
        let mass = self.nominal.mass_kg;
        let mut tick = 0_usize;
        loop {
            let t = tick as f64 * step;
            let zw = water_depth(t, z);
            let temperature = column.temperature(zw);
            let density = column.density(zw);
            let pressure = column.pressure(z.max(0.0));
            let day = (orders.start_s + t) / 86_400.0;
            let floating = matches!(leg, Leg::Wait | Leg::Float) && z <= 0.0;
            moments.push(Moment {
                t,
                depth: z,
                known_depth: known,
                stirred_depth: stirred,
                velocity: [u, n],
                pitch: theta,
                roll: roll_true + list,
                heading,
                ballast,
                battery,
                pressure,
                temperature,
                cell_temperature,
                density,
                position,
                floating,
            });
            // Decide.
            let before_turn = leg;
            match leg {
                Leg::Wait if t >= FLOAT_S[0] => leg = Leg::Dive,
                Leg::Dive if z >= orders.depths[1] => leg = Leg::Climb,
                Leg::Climb if yos_left > 1 && z <= orders.depths[0] => {
                    yos_left -= 1;
                    leg = Leg::Dive;
                    turns = orders.turns.iter().map(|&(d, dive, c)| (d * 0.93, dive, -c)).collect();
                }
                Leg::Climb if z <= 0.0 => {
                    leg = Leg::Float;
                    float_from = t;
                }
                Leg::Float if t - float_from >= FLOAT_S[1] => break,
                _ => {}
            }
            if leg != before_turn {
                (leg_number, turned_at) = (leg_number + 1, t);
            }
            if t > LONGEST_S || tick / 2 > seconds * 2 {
                break;
            }
            let diving = leg == Leg::Dive;
            let (order, stroke, rate) = match leg {
                Leg::Wait => (0.0, orders.ballast, orders.pump[0]),
                Leg::Dive => (-orders.pitch[0], -orders.ballast, orders.pump[0]),
                Leg::Climb => (orders.pitch[1], orders.ballast, orders.pump[1]),
                Leg::Float => (0.0, orders.ballast, orders.pump[1]),
            };
            if tick.is_multiple_of(control_every) {
                let noise = self.nominal.sensors.pitch_rad[0] * rng.sample::<f64, _>(StandardNormal);
                let measured = self.measured_pitch(theta, heading, pressure) + noise;
                battery_order = pilot.battery(order, measured, ballast, 2.0, mass);
                if let Some(i) = turns
                    .iter()
                    .position(|&(depth, dive, _)| dive == diving && matches!(leg, Leg::Dive | Leg::Climb) && ((z >= depth) == diving))
                {
                    course += turns.remove(i).2;
                }
            }
            // Actuators.
            let before = (battery, actual_ballast);
            ballast += (stroke - ballast).clamp(-rate * step, rate * step);
            battery += (battery_order - battery).clamp(-BATTERY_RATE * step, BATTERY_RATE * step);
            actual_ballast = if off.ballast_lag_s > 0.0 {
                actual_ballast + (ballast - actual_ballast) * (1.0 - libm::exp(-step / off.ballast_lag_s))
            } else {
                ballast
            };
            let turn_error = course - heading;
            let turning = nature.banking == Some(Banking::Turns);
            // What floats up turns away from the side it leans to.
            let lean = if turning && matches!(leg, Leg::Climb) { -1.3 } else { 1.3 };
            let bank = if floating { 0.0 } else { (lean * turn_error).clamp(-orders.bank, orders.bank) };
            roll_true += (bank - roll_true) * (1.0 - libm::exp(-step / 5.0));
            let speed = libm::hypot(u, n);
            let turn_rate = if turning && !floating {
                let net = self.nominal.gravity * (density * nature.displaced(pressure, temperature, ballast) - nature.mass);
                let carried = nature.mass * (1.0 + nature.added_mass[0]) * speed.max(LEAST_TURNING_M_S);
                (-net * libm::sin(roll_true) / carried).clamp(-FASTEST_TURN, FASTEST_TURN)
            } else {
                TURN_PER_METRE * speed * roll_true
            };
            heading += turn_rate * step;
            // Slow reservoirs.
            let follow = |from: f64, to: f64, tau: f64| if tau > 0.0 { from + (to - from) * (1.0 - libm::exp(-step / tau)) } else { to };
            hull_temperature = follow(hull_temperature, temperature, off.hull_thermal_lag_s);
            cell_temperature = follow(cell_temperature, temperature, off.cell_lag_s);
            flood_density = follow(flood_density, density, off.flood_lag_s);
            let alpha = libm::atan2(-n, u);
            if let Some(s) = &nature.stall
                && s.hysteresis > 0.0
            {
                separated = s.separates(alpha.abs(), separated);
            }
            let extra_mass = off.flood_volume_m3 * (flood_density - density) + (off.leak * t).min(BILGE_M3) * density
                - (off.segment_trim[index] + off.breath(t)) * density;
            let off_drag = off.drag(index, heading);
            let roll = roll_true + list;
            let g = self.nominal.gravity;
            let swell_temperature = temperature + off.hull_thermal_gain * (hull_temperature - temperature);
            // One step of the dynamics, density taken at the actual depth within the step.
            let [k1, k2] = nature.added_mass;
            let (mu, mn) = (nature.mass * (1.0 + k1), nature.mass * (1.0 + k2));
            let rho_slope = (column.density(zw + 0.5) - column.density(zw - 0.5)).clamp(-1.0, 1.0);
            let p = &PITCH;
            let small_up = nature.small.as_ref().filter(|_| !floating).map_or(0.0, |small| {
                small.up_m_s(&Here {
                    time_s: orders.start_s + t,
                    depth_m: z,
                    diving,
                    leg: leg_number,
                    since_turn_s: t - turned_at,
                    roll,
                    heading,
                })
            });
            let rate_of = |dt: f64, s: &[f64; 8]| -> [f64; 8] {
                let [sz, su, sn, sth, sq, _, _, sv] = *s;
                let share = dt / step;
                let within = |from: f64, to: f64| from + (to - from) * share;
                let (battery, actual_ballast) = (within(before.0, battery), within(before.1, actual_ballast));
                let rho = density + rho_slope * (sz - z);
                let speed = libm::hypot(su, sn);
                let alpha = libm::atan2(-sn, su);
                let (sin_t, cos_t) = (libm::sin(sth), libm::cos(sth));
                let leaning = if turning { roll } else { 0.0 };
                let (level, aside) = (libm::cos(leaning), libm::sin(leaning));
                let sink = -(su * sin_t + sn * cos_t * level) + sv * aside * cos_t;
                let at = Instant { rho, temperature, day, roll, separated, drag: off_drag };
                let (lift, drag) = nature.lift_and_drag(alpha, speed, -sink, &at);
                let volume = nature.displaced(pressure + rho * g * (sz - z), swell_temperature, actual_ballast);
                let buoyancy = g * (rho * volume - nature.mass - extra_mass);
                let (sin_a, cos_a) = (libm::sin(alpha), libm::cos(alpha));
                // Rates about the body's own axes: of roll, of pitch, of yaw.
                let spin = if turning { turn_rate } else { 0.0 };
                let (rp, rq, rr) = (-spin * sin_t, sq * level + spin * cos_t * aside, spin * cos_t * level - sq * aside);
                let fu = -drag * cos_a + lift * sin_a + buoyancy * sin_t + rq * mn * sn + rr * mn * sv;
                let fn_ = lift * cos_a + drag * sin_a + buoyancy * cos_t * level - rq * mu * su + rp * mn * sv;
                let slip = 0.5 * rho * speed * nature.area * SIDE_SLOPE * sv;
                let fv = -slip - buoyancy * aside * cos_t - rr * mu * su - rp * mn * sn;
                let moment = -p.battery_mass * g * (battery + nature.battery_zero) * cos_t - nature.mass * g * p.metacentric_height * sin_t
                    + rho * g * actual_ballast * (1.0 + nature.ballast_gain) * p.ballast_arm * cos_t
                    + 0.5 * rho * speed * speed * nature.area * p.length * p.cm_alpha * alpha.clamp(-0.35, 0.35)
                    + 0.5 * rho * nature.area * p.length * p.length * p.cm_q * (speed + 0.35) * sq;
                let stir = effect_up(t + dt, sz);
                let across = if turning { fv / mn } else { 0.0 };
                [sink - stir - up(t + dt, sz) - small_up, fu / mu, fn_ / mn, sq, moment / p.inertia, sink - stir, -stir, across]
            };
            let s0 = [z, u, n, theta, q, known, stirred, v];
            let add = |a: &[f64; 8], b: &[f64; 8], h: f64| -> [f64; 8] { core::array::from_fn(|i| a[i] + h * b[i]) };
            let a1 = rate_of(0.0, &s0);
            let a2 = rate_of(0.5 * step, &add(&s0, &a1, 0.5 * step));
            let a3 = rate_of(0.5 * step, &add(&s0, &a2, 0.5 * step));
            let a4 = rate_of(step, &add(&s0, &a3, step));
            let s: [f64; 8] = core::array::from_fn(|i| s0[i] + step / 6.0 * (a1[i] + 2.0 * a2[i] + 2.0 * a3[i] + a4[i]));
            [z, u, n, theta, q, known, stirred, v] = s;
            // Floating: the surface carries the vehicle, which cannot rise out of it.
            let rising = u * libm::sin(theta) + n * libm::cos(theta) >= 0.0;
            if (z <= 0.0 && rising) || matches!(leg, Leg::Wait | Leg::Float) {
                (z, u, n, v) = (0.0, 0.0, 0.0, 0.0);
            }
            let forward = u * libm::cos(theta) - n * libm::sin(theta);
            let drift = ocean.current_at(index, z.max(0.0));
            position[0] += (forward * libm::sin(heading) + drift[0]) * step;
            position[1] += (forward * libm::cos(heading) + drift[1]) * step;
            tick += 1;
        }
        moments
    }

    /// The pitch sensor without its noise.
    #[must_use]
    pub fn measured_pitch(&self, pitch: f64, heading: f64, pressure: f64) -> f64 {
        let off = &self.nature.off;
        pitch * (1.0 + self.nature.pitch_scale)
            + self.nature.pitch_zero
            + off.pitch_by_heading * libm::sin(heading)
            + off.pitch_by_depth * libm::tanh(pressure * 1e-6 * 0.5) * 2.0
    }
}

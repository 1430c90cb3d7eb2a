//! The vehicle in one segment: what it intends, where its actuators stand, what lags the water, and one step of its motion.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::nature::{Banking, Instant};
use super::ocean::Ocean;
use super::orders::Orders;
use super::small_structure::Here;
use super::vehicle::PITCH;
use super::voyage::{Moment, Voyage};

/// Floating at the surface before and after, s (format, section 3).
const FLOAT_S: [f64; 2] = [20.0, 40.0];
/// A segment that has not come back by then is broken off, s.
const LONGEST_S: f64 = 12_000.0;
/// Water that a leak can take in before the compartment is full, m³ (guess; below the smallest stroke, so the vehicle comes back).
const BILGE_M3: f64 = 45e-6;

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

/// How the water of one segment moves: the background as drawn, and what missing effects add.
struct WaterMotion<'a> {
    ocean: &'a Ocean,
    index: usize,
    /// m/s up, every second.
    background: Vec<f64>,
}

impl WaterMotion<'_> {
    /// Background motion, m/s up; the surface stops it.
    fn background_up(&self, t: f64, z: f64) -> f64 {
        let x = t.clamp(0.0, (self.background.len() - 2) as f64);
        let i = x as usize;
        let w = self.background[i] + (self.background[i + 1] - self.background[i]) * (x - i as f64);
        w * libm::tanh(z.max(0.0) / 1.5)
    }

    /// Motion of missing effects, m/s up.
    fn effect_up(&self, t: f64, z: f64) -> f64 {
        let wave = self.ocean.wave.as_ref().map_or(0.0, |w| w.motion(self.index, t).0 * self.ocean.column.mode(z, w.mode));
        wave + self.ocean.steady_up(z)
    }

    /// Depth at which the water found at depth z is at rest, m.
    fn depth_at_rest(&self, t: f64, z: f64) -> f64 {
        z + self.ocean.wave.as_ref().map_or(0.0, |w| w.motion(self.index, t).1 * self.ocean.column.mode(z, w.mode))
    }
}

/// The water at the vehicle, at the start of a step.
pub(super) struct Surroundings {
    t: f64,
    /// Depth at which this water is at rest, m.
    rest_depth: f64,
    temperature: f64,
    density: f64,
    pressure: f64,
    floating: bool,
}

/// What the vehicle is to do during a step.
pub(super) struct Order {
    /// Ballast, m³.
    stroke: f64,
    /// Pump rate, m³/s.
    rate: f64,
}

/// What moves evenly during a step: battery and ballast before it, and the turn rate, rad/s.
pub(super) struct Moved {
    battery: f64,
    ballast: f64,
    turn_rate: f64,
}

/// What acts on the body during a step and does not change with its motion within it.
struct Held<'a> {
    here: &'a Surroundings,
    moved: &'a Moved,
    at: Instant,
    /// Density gradient, kg/m⁴, and depth at the start of the step, m.
    density_slope: f64,
    depth: f64,
    /// Temperature that the hull's volume follows, °C.
    swell_temperature: f64,
    /// Mass of flooded and leaked water beyond the stated, kg.
    extra_mass: f64,
    /// Small structure of the water, m/s up.
    small_up: f64,
}

/// The vehicle in one segment: what it intends, where its actuators stand, what lags the water, how it moves.
pub(super) struct Flown<'a> {
    voyage: &'a Voyage<'a>,
    index: usize,
    orders: &'a Orders,
    water: WaterMotion<'a>,
    step: f64,
    tick: usize,
    // Intent.
    leg: Leg,
    leg_number: usize,
    turned_at: f64,
    float_from: f64,
    yos_left: usize,
    turns: Vec<(f64, bool, f64)>,
    course: f64,
    pilot: Autopilot,
    battery_order: f64,
    // Actuators and attitude about the vertical.
    ballast: f64,
    actual_ballast: f64,
    battery: f64,
    roll: f64,
    heading: f64,
    // What lags the water, and the flow over the wing.
    hull_temperature: f64,
    cell_temperature: f64,
    flood_density: f64,
    separated: bool,
    /// Depth; velocity along and across (up); pitch and its rate; depths known and stirred ([`Moment`]); velocity sideways.
    state: [f64; 8],
    position: [f64; 2],
}

impl<'a> Flown<'a> {
    pub(super) fn new(voyage: &'a Voyage<'a>, index: usize, orders: &'a Orders, step: f64, rng: &mut ChaCha8Rng) -> Self {
        let ocean = voyage.ocean;
        let seconds = (2.0 * orders.depths[1] * orders.yos as f64 / 0.035).min(LONGEST_S) as usize + 200;
        let background = ocean.colour.realise(ocean.rms, ocean.time_s, seconds, rng);
        let surface_temperature = ocean.column.temperature(0.0);
        Self {
            voyage,
            index,
            orders,
            water: WaterMotion { ocean, index, background },
            step,
            tick: 0,
            leg: Leg::Wait,
            // Legs of the whole trial are numbered through: a segment has fewer than eight.
            leg_number: 8 * index,
            turned_at: 0.0,
            float_from: f64::NAN,
            yos_left: orders.yos,
            turns: orders.turns.clone(),
            course: orders.heading,
            pilot: Autopilot { integral: 0.0 },
            battery_order: 0.0,
            ballast: orders.ballast,
            actual_ballast: orders.ballast,
            battery: 0.0,
            roll: 0.0,
            heading: orders.heading,
            hull_temperature: surface_temperature,
            cell_temperature: surface_temperature,
            flood_density: ocean.column.density(0.0),
            separated: false,
            state: [0.0; 8],
            position: [0.0, 0.0],
        }
    }

    pub(super) fn surroundings(&self) -> Surroundings {
        let column = &self.voyage.ocean.column;
        let (t, z) = (self.tick as f64 * self.step, self.state[0]);
        let rest_depth = self.water.depth_at_rest(t, z);
        Surroundings {
            t,
            rest_depth,
            temperature: column.temperature(rest_depth),
            density: column.density(rest_depth),
            pressure: column.pressure(z.max(0.0)),
            floating: self.at_surface() && z <= 0.0,
        }
    }

    const fn at_surface(&self) -> bool {
        matches!(self.leg, Leg::Wait | Leg::Float)
    }

    /// Whether it banks and turns, and turns by its bank.
    fn turns_by_bank(&self) -> bool {
        self.voyage.nature.banking == Some(Banking::Turns)
    }

    pub(super) fn moment(&self, here: &Surroundings) -> Moment {
        let [depth, u, n, pitch, _, known_depth, stirred_depth, _] = self.state;
        Moment {
            t: here.t,
            depth,
            known_depth,
            stirred_depth,
            velocity: [u, n],
            pitch,
            roll: self.roll + self.voyage.list,
            heading: self.heading,
            ballast: self.ballast,
            battery: self.battery,
            pressure: here.pressure,
            temperature: here.temperature,
            cell_temperature: self.cell_temperature,
            density: here.density,
            position: self.position,
            floating: here.floating,
        }
    }

    /// Which leg is flown next; whether the segment has ended.
    pub(super) fn decide(&mut self) -> bool {
        let (t, z, before) = (self.tick as f64 * self.step, self.state[0], self.leg);
        match self.leg {
            Leg::Wait if t >= FLOAT_S[0] => self.leg = Leg::Dive,
            Leg::Dive if z >= self.orders.depths[1] => self.leg = Leg::Climb,
            Leg::Climb if self.yos_left > 1 && z <= self.orders.depths[0] => {
                self.yos_left -= 1;
                self.leg = Leg::Dive;
                self.turns = self.orders.turns.iter().map(|&(d, dive, c)| (d * 0.93, dive, -c)).collect();
            }
            Leg::Climb if z <= 0.0 => {
                self.leg = Leg::Float;
                self.float_from = t;
            }
            Leg::Float if t - self.float_from >= FLOAT_S[1] => return true,
            _ => {}
        }
        if self.leg != before {
            (self.leg_number, self.turned_at) = (self.leg_number + 1, t);
        }
        t > LONGEST_S || self.tick / 2 > self.water.background.len() * 2
    }

    /// What the leg asks for; every two seconds the pitch controller and the course are renewed.
    pub(super) fn command(&mut self, here: &Surroundings, rng: &mut ChaCha8Rng) -> Order {
        let orders = self.orders;
        let (pitch, stroke, rate) = match self.leg {
            Leg::Wait => (0.0, orders.ballast, orders.pump[0]),
            Leg::Dive => (-orders.pitch[0], -orders.ballast, orders.pump[0]),
            Leg::Climb => (orders.pitch[1], orders.ballast, orders.pump[1]),
            Leg::Float => (0.0, orders.ballast, orders.pump[1]),
        };
        let every = (2.0 / self.step).round() as usize;
        if self.tick.is_multiple_of(every) {
            let nominal = self.voyage.nominal;
            let noise = nominal.sensors.pitch_rad[0] * rng.sample::<f64, _>(StandardNormal);
            let measured = self.voyage.measured_pitch(self.state[3], self.heading, here.pressure) + noise;
            self.battery_order = self.pilot.battery(pitch, measured, self.ballast, 2.0, nominal.mass_kg);
            let (z, diving, under_way) = (self.state[0], self.leg == Leg::Dive, matches!(self.leg, Leg::Dive | Leg::Climb));
            let due = self.turns.iter().position(|&(depth, dive, _)| dive == diving && under_way && ((z >= depth) == diving));
            if let Some(i) = due {
                self.course += self.turns.remove(i).2;
            }
        }
        Order { stroke, rate }
    }

    /// Pump, battery, roll and heading move for a step.
    pub(super) fn actuate(&mut self, here: &Surroundings, order: &Order) -> Moved {
        let (nature, step) = (self.voyage.nature, self.step);
        let before = (self.battery, self.actual_ballast);
        self.ballast += (order.stroke - self.ballast).clamp(-order.rate * step, order.rate * step);
        self.battery += (self.battery_order - self.battery).clamp(-BATTERY_RATE * step, BATTERY_RATE * step);
        self.actual_ballast = if nature.off.ballast_lag_s > 0.0 {
            self.actual_ballast + (self.ballast - self.actual_ballast) * (1.0 - libm::exp(-step / nature.off.ballast_lag_s))
        } else {
            self.ballast
        };
        let turn_error = self.course - self.heading;
        let turning = self.turns_by_bank();
        // What floats up turns away from the side it leans to.
        let lean = if turning && matches!(self.leg, Leg::Climb) { -1.3 } else { 1.3 };
        let bank = if here.floating { 0.0 } else { (lean * turn_error).clamp(-self.orders.bank, self.orders.bank) };
        self.roll += (bank - self.roll) * (1.0 - libm::exp(-step / 5.0));
        let speed = libm::hypot(self.state[1], self.state[2]);
        let turn_rate = if turning && !here.floating {
            let displaced = nature.displaced(here.pressure, here.temperature, self.ballast);
            let net = self.voyage.nominal.gravity * (here.density * displaced - nature.mass);
            let carried = nature.mass * (1.0 + nature.added_mass[0]) * speed.max(LEAST_TURNING_M_S);
            (-net * libm::sin(self.roll) / carried).clamp(-FASTEST_TURN, FASTEST_TURN)
        } else {
            TURN_PER_METRE * speed * self.roll
        };
        self.heading += turn_rate * step;
        Moved { battery: before.0, ballast: before.1, turn_rate }
    }

    /// Hull, conductivity cell and flooded spaces follow the water; the flow over the wing separates or attaches.
    pub(super) fn follow_water(&mut self, here: &Surroundings) {
        let (off, step) = (&self.voyage.nature.off, self.step);
        let follow = |from: f64, to: f64, tau: f64| if tau > 0.0 { from + (to - from) * (1.0 - libm::exp(-step / tau)) } else { to };
        self.hull_temperature = follow(self.hull_temperature, here.temperature, off.hull_thermal_lag_s);
        self.cell_temperature = follow(self.cell_temperature, here.temperature, off.cell_lag_s);
        self.flood_density = follow(self.flood_density, here.density, off.flood_lag_s);
        let alpha = libm::atan2(-self.state[2], self.state[1]);
        if let Some(s) = &self.voyage.nature.stall
            && s.hysteresis > 0.0
        {
            self.separated = s.separates(alpha.abs(), self.separated);
        }
    }

    fn held<'b>(&self, here: &'b Surroundings, moved: &'b Moved) -> Held<'b> {
        let (nature, column) = (self.voyage.nature, &self.voyage.ocean.column);
        let (off, t, density) = (&nature.off, here.t, here.density);
        let depth = self.state[0];
        let roll = self.roll + self.voyage.list;
        let small_up = nature.small.as_ref().filter(|_| !here.floating).map_or(0.0, |small| {
            small.up_m_s(&Here {
                time_s: self.orders.start_s + t,
                depth_m: depth,
                diving: self.leg == Leg::Dive,
                leg: self.leg_number,
                since_turn_s: t - self.turned_at,
                roll,
                heading: self.heading,
            })
        });
        Held {
            here,
            moved,
            at: Instant {
                rho: density,
                temperature: here.temperature,
                day: (self.orders.start_s + t) / 86_400.0,
                roll,
                separated: self.separated,
                drag: off.drag(self.index, self.heading),
            },
            density_slope: (column.density(here.rest_depth + 0.5) - column.density(here.rest_depth - 0.5)).clamp(-1.0, 1.0),
            depth,
            swell_temperature: here.temperature + off.hull_thermal_gain * (self.hull_temperature - here.temperature),
            extra_mass: off.flood_volume_m3 * (self.flood_density - density) + (off.leak * t).min(BILGE_M3) * density
                - (off.segment_trim[self.index] + off.breath(t)) * density,
            small_up,
        }
    }

    /// Rates of the state `dt` into the step; density is taken at the actual depth.
    fn rates(&self, held: &Held<'_>, dt: f64, s: &[f64; 8]) -> [f64; 8] {
        let [sz, su, sn, sth, sq, _, _, sv] = *s;
        let (nature, p, g) = (self.voyage.nature, &PITCH, self.voyage.nominal.gravity);
        let [k1, k2] = nature.added_mass;
        let (mu, mn) = (nature.mass * (1.0 + k1), nature.mass * (1.0 + k2));
        let turning = self.turns_by_bank();
        let share = dt / self.step;
        let within = |from: f64, to: f64| from + (to - from) * share;
        let (battery, actual_ballast) = (within(held.moved.battery, self.battery), within(held.moved.ballast, self.actual_ballast));
        let rho = held.here.density + held.density_slope * (sz - held.depth);
        let speed = libm::hypot(su, sn);
        let alpha = libm::atan2(-sn, su);
        let (sin_t, cos_t) = (libm::sin(sth), libm::cos(sth));
        let leaning = if turning { held.at.roll } else { 0.0 };
        let (level, aside) = (libm::cos(leaning), libm::sin(leaning));
        let sink = -(su * sin_t + sn * cos_t * level) + sv * aside * cos_t;
        let (lift, drag) = nature.lift_and_drag(alpha, speed, -sink, &Instant { rho, ..held.at });
        let volume = nature.displaced(held.here.pressure + rho * g * (sz - held.depth), held.swell_temperature, actual_ballast);
        let buoyancy = g * (rho * volume - nature.mass - held.extra_mass);
        let (sin_a, cos_a) = (libm::sin(alpha), libm::cos(alpha));
        // Rates about the body's own axes: of roll, of pitch, of yaw.
        let spin = if turning { held.moved.turn_rate } else { 0.0 };
        let (rp, rq, rr) = (-spin * sin_t, sq * level + spin * cos_t * aside, spin * cos_t * level - sq * aside);
        let fu = -drag * cos_a + lift * sin_a + buoyancy * sin_t + rq * mn * sn + rr * mn * sv;
        let fn_ = lift * cos_a + drag * sin_a + buoyancy * cos_t * level - rq * mu * su + rp * mn * sv;
        let slip = 0.5 * rho * speed * nature.area * SIDE_SLOPE * sv;
        let fv = -slip - buoyancy * aside * cos_t - rr * mu * su - rp * mn * sn;
        let moment = -p.battery_mass * g * (battery + nature.battery_zero) * cos_t - nature.mass * g * p.metacentric_height * sin_t
            + rho * g * actual_ballast * (1.0 + nature.ballast_gain) * p.ballast_arm * cos_t
            + 0.5 * rho * speed * speed * nature.area * p.length * p.cm_alpha * alpha.clamp(-0.35, 0.35)
            + 0.5 * rho * nature.area * p.length * p.length * p.cm_q * (speed + 0.35) * sq;
        let t = held.here.t;
        let stir = self.water.effect_up(t + dt, sz);
        let across = if turning { fv / mn } else { 0.0 };
        let up = self.water.background_up(t + dt, sz);
        [sink - stir - up - held.small_up, fu / mu, fn_ / mn, sq, moment / p.inertia, sink - stir, -stir, across]
    }

    /// One step of the dynamics, fourth-order Runge-Kutta.
    pub(super) fn advance(&mut self, here: &Surroundings, moved: &Moved) {
        let (held, step, s0) = (self.held(here, moved), self.step, self.state);
        let add = |a: &[f64; 8], b: &[f64; 8], h: f64| -> [f64; 8] { core::array::from_fn(|i| a[i] + h * b[i]) };
        let a1 = self.rates(&held, 0.0, &s0);
        let a2 = self.rates(&held, 0.5 * step, &add(&s0, &a1, 0.5 * step));
        let a3 = self.rates(&held, 0.5 * step, &add(&s0, &a2, 0.5 * step));
        let a4 = self.rates(&held, step, &add(&s0, &a3, step));
        let [mut z, mut u, mut n, theta, q, known, stirred, mut v]: [f64; 8] =
            core::array::from_fn(|i| s0[i] + step / 6.0 * (a1[i] + 2.0 * a2[i] + 2.0 * a3[i] + a4[i]));
        // Floating: the surface carries the vehicle, which cannot rise out of it.
        let rising = u * libm::sin(theta) + n * libm::cos(theta) >= 0.0;
        if (z <= 0.0 && rising) || self.at_surface() {
            (z, u, n, v) = (0.0, 0.0, 0.0, 0.0);
        }
        let forward = u * libm::cos(theta) - n * libm::sin(theta);
        let drift = self.voyage.ocean.current_at(self.index, z.max(0.0));
        self.position[0] += (forward * libm::sin(self.heading) + drift[0]) * step;
        self.position[1] += (forward * libm::cos(self.heading) + drift[1]) * step;
        self.state = [z, u, n, theta, q, known, stirred, v];
        self.tick += 1;
    }
}

impl Voyage<'_> {
    /// Flies segment `index`; the water's background motion and the pitch noise come from `rng`.
    pub fn fly(&self, index: usize, orders: &Orders, step: f64, rng: &mut ChaCha8Rng) -> Vec<Moment> {
        let mut flown = Flown::new(self, index, orders, step, rng);
        let mut moments = Vec::with_capacity(4000);
        loop {
            let here = flown.surroundings();
            moments.push(flown.moment(&here));
            if flown.decide() {
                return moments;
            }
            let order = flown.command(&here, rng);
            let moved = flown.actuate(&here, &order);
            flown.follow_water(&here);
            flown.advance(&here, &moved);
        }
    }
}

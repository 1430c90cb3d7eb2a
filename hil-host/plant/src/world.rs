//! The running world: advances, is sensed, tells the truth.

mod after;
mod best;
mod gas;
mod measure;
mod polar;
#[cfg(test)]
mod tests;

pub use best::BestGlide;

use crate::actuators::{Drive, Pump, Servo};
use crate::dynamics::{Body, Inputs, Ramp, State};
use crate::effects::{Effect, EffectKind as E};
use crate::faults::{Fault, Kind, Schedule, Target};
use crate::ocean::Column;
use crate::scenario::Scenario;
use crate::sensors::Suite;
use crate::truth::Energy;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use signals::{ActuatorCommand, Phase};
use std::f64::consts::TAU;

/// Longest integration step, s. Halving it changes the depth of a 3 h flight by less than 1 cm (tested).
const STEP_S: f64 = 0.5;
/// Depth above which the float's spring is near, m; steps are shorter there.
const CONTACT_ZONE_M: f64 = 0.3;
/// Speed above which steps shorten in proportion, m/s: faster than any glide.
const FAST_M_S: f64 = 0.5;
/// Longest time after which effects and faults are looked at again, s.
const INPUTS_S: f64 = 4.0;
/// Share of the step there.
const CONTACT_STEP: f64 = 0.25;
/// Length of the piece-wise linear stretches of the background water motion, s.
const BACKGROUND_GRID_S: f64 = 12.0;
/// Commands missed before the actuators go to the surface by themselves.
const MISSED_LIMIT: u32 = 3;

/// A world under way.
#[derive(Clone, Debug)]
pub struct World {
    scenario: Scenario,
    pump: Pump,
    body: Body,
    column: Column,
    y: State,
    t: f64,
    step_s: f64,
    ballast: Servo,
    battery: Servo,
    fin: Servo,
    command: ActuatorCommand,
    missed: u32,
    effective_ballast: f64,
    hull_temperature: Option<f64>,
    flooded: Option<f64>,
    background: (u64, f64, f64),
    suite: Suite,
    schedule: Schedule,
    sensor_rng: ChaCha8Rng,
    thermometer_rng: ChaCha8Rng,
    water_rng: ChaCha8Rng,
    fault_rng: ChaCha8Rng,
    energy: Energy,
    seq: u32,
    mass: f64,
    water_in_kg: f64,
    gas: gas::Gas,
    firing_s: Option<f64>,
    weight_dropped: bool,
    surfaced_s: f64,
    max_depth_m: f64,
    crushed: bool,
    held_at: Option<f64>,
    pump_power_w: f64,
    brown_out: bool,
    browned: bool,
}

impl World {
    /// Builds a world.
    ///
    /// # Errors
    /// What in the scenario cannot be.
    pub fn new(scenario: Scenario) -> Result<Self, String> {
        scenario.validate()?;
        let effects = &scenario.effects;
        let sum = |k| Effect::sum(effects, k);
        let shear_m = Effect::second(effects, E::HorizontalShear, 15.0);
        let (drift, shear) = (sum(E::HorizontalCurrent), sum(E::HorizontalShear));
        let direction = Effect::second(effects, E::HorizontalCurrent, 0.0);
        let column = Column::new(&scenario.ocean, |z| (drift * direction.cos() + shear * (-z / shear_m).exp(), drift * direction.sin()))?;
        let v = &scenario.vehicle;
        let trim = column.at(0.5 * column.depth_m.min(v.crush_depth_m * 0.8), 0.0);
        // Ballasted by the nominal hull: a wrong compressibility shows at sea, not on the bench.
        let trim_rho = v.ballasted_density_kg_m3.unwrap_or(trim.rho);
        let body = Body::ballasted(&scenario, &trim, trim_rho);
        let a = scenario.actuators;
        let start = scenario.start;
        let ballast = start.ballast_m3.unwrap_or(a.pump.volume_m3).clamp(-a.pump.volume_m3, a.pump.volume_m3);
        let balance = trim_rho * ballast * v.ballast_arm_m / v.battery_mass_kg;
        let battery = start.battery_mass_m.unwrap_or(balance).clamp(-a.battery_travel_m, a.battery_travel_m);
        let rng = |stream| {
            let mut r = ChaCha8Rng::seed_from_u64(scenario.seed);
            r.set_stream(stream);
            r
        };
        let surface = column.at(start.depth_m, 0.0);
        let has = |k| effects.iter().any(|e| e.kind == k);
        let mut world = Self {
            pump: a.pump,
            y: [0.0, 0.0, if start.depth_m > 0.0 { start.depth_m } else { -0.005 }, start.pitch_rad, 0.0, 0.0, 0.0, start.heading_rad, 0.0],
            t: 0.0,
            step_s: STEP_S,
            ballast: Servo::new(ballast, a.pump.volume_m3, a.pump.rate_m3_s, a.pump.dead_band_m3),
            battery: Servo::new(battery, a.battery_travel_m, a.battery_rate_m_s, a.battery_dead_band_m),
            fin: Servo::new(0.0, a.fin_limit_rad, a.fin_rate_rad_s, a.fin_dead_band_rad),
            command: ActuatorCommand::default(),
            missed: 0,
            effective_ballast: ballast,
            hull_temperature: has(E::HullThermalLag).then_some(surface.temperature),
            flooded: has(E::FloodedVolumeLag).then_some(surface.rho),
            background: (0, 0.0, 0.0),
            suite: Suite::new(&scenario.sensors),
            schedule: Schedule::new(&scenario.faults),
            sensor_rng: rng(1),
            thermometer_rng: rng(4),
            water_rng: rng(2),
            fault_rng: rng(3),
            energy: Energy::default(),
            seq: 0,
            mass: v.mass_kg,
            water_in_kg: 0.0,
            gas: gas::Gas::default(),
            firing_s: None,
            weight_dropped: false,
            surfaced_s: 0.0,
            max_depth_m: start.depth_m,
            crushed: false,
            held_at: None,
            pump_power_w: 0.0,
            brown_out: false,
            browned: false,
            body,
            column,
            scenario,
        };
        world.background.1 = world.draw_background(0.0, 1.0);
        world.background.2 = world.next_background(world.background.1);
        Ok(world)
    }

    /// The scenario this world was built from.
    #[must_use]
    pub const fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Time since the start, s.
    #[must_use]
    pub const fn time_s(&self) -> f64 {
        self.t
    }

    /// Tells the world the controller's phase, for faults that wait for one.
    pub fn observe_phase(&mut self, phase: Phase) {
        self.schedule.observe(phase, self.t);
    }

    /// Adds a fault; its delay counts from now (or from its phase).
    pub fn inject(&mut self, fault: Fault) {
        self.schedule.add(fault, self.t);
    }

    /// Whether the supply was interrupted since the last call: the caller resets its controller.
    pub fn take_brown_out(&mut self) -> bool {
        std::mem::take(&mut self.brown_out)
    }

    /// Halves, doubles … the integration step: for tests of its error.
    #[must_use]
    pub fn with_step(mut self, step_s: f64) -> Self {
        self.step_s = step_s.clamp(1e-3, STEP_S);
        self
    }

    /// Commands the actuators and lets `seconds` pass.
    pub fn advance(&mut self, command: &ActuatorCommand, seconds: f64) {
        if !(seconds > 0.0 && seconds.is_finite()) {
            return;
        }
        self.receive(command);
        self.pass(seconds);
    }

    /// Lets `seconds` pass with the motors as they were last driven or commanded.
    pub fn pass(&mut self, seconds: f64) {
        if !(seconds > 0.0 && seconds.is_finite()) {
            return;
        }
        let brown = self.schedule.find(self.t, Target::Power, Kind::BrownOut).is_some();
        self.brown_out |= brown && !self.browned;
        self.browned = brown;
        self.fire(self.schedule.find(self.t, Target::Release, Kind::Spurious).is_some());
        let pieces = (seconds / INPUTS_S - 1e-9).ceil().max(1.0);
        let start = self.t;
        for piece in 1..=pieces as u64 {
            self.pass_until(start + seconds * piece as f64 / pieces);
        }
    }

    /// Lets time pass under inputs that are renewed once.
    fn pass_until(&mut self, end: f64) {
        let inputs = self.inputs();
        self.held_at = inputs.held;
        while end - self.t > 1e-9 {
            let node = (self.background.0 + 1) as f64 * BACKGROUND_GRID_S;
            if self.t >= node - 1e-9 {
                let next = self.next_background(self.background.2);
                self.background = (self.background.0 + 1, self.background.2, next);
                continue;
            }
            self.obey_faults();
            let remaining = end - self.t;
            let longest = if self.y[2] < CONTACT_ZONE_M || self.held_at.is_some() { self.step_s * CONTACT_STEP } else { self.step_s };
            // The stiffest rate grows with speed (normal force over mass in heave): 4/s at 1 m/s.
            let speed = (self.y[4] * self.y[4] + self.y[5] * self.y[5]).sqrt();
            let longest = if speed > FAST_M_S { longest * FAST_M_S / speed } else { longest };
            let mut h = remaining / (remaining / longest - 1e-9).ceil().max(1.0);
            let pump_stalled = self.ballast.target > self.ballast.position && self.pressure() > self.pump.stall_pa;
            let (ballast_rate, ballast_end) = if pump_stalled { (0.0, f64::INFINITY) } else { self.ballast.plan() };
            let (battery_rate, battery_end) = self.battery.plan();
            let (fin_rate, fin_end) = self.fin.plan();
            for stop in [ballast_end, battery_end, fin_end, node - self.t] {
                h = h.min(stop);
            }
            // An actuator that arrives within a nanosecond has arrived.
            let h = h.max(1e-9);
            self.integrate(&inputs, h, [ballast_rate, battery_rate, fin_rate]);
        }
    }

    /// Drives the motors as a board's pins do, from now on.
    pub fn drive(&mut self, drive: &Drive) {
        self.ballast.run(drive.pump);
        self.battery.run(drive.battery);
        self.fin.command(drive.fin_rad);
        self.fire(drive.fire);
    }

    /// Takes the command, or what is left of it on the way.
    fn receive(&mut self, command: &ActuatorCommand) {
        let lost = self.schedule.find(self.t, Target::Command, Kind::Lost).is_some()
            || self.schedule.find(self.t, Target::Command, Kind::Intermittent).is_some_and(|f| self.fault_rng.random::<f64>() < f.0);
        if lost {
            self.missed = self.missed.saturating_add(1);
        } else {
            self.missed = 0;
            self.command = *command;
        }
        if self.missed >= MISSED_LIMIT {
            // The actuator side goes up by itself: pump out, fin straight, battery at rest.
            self.command = ActuatorCommand {
                ballast_m3: self.pump.volume_m3 as f32,
                battery_mass_m: self.battery.position as f32,
                fin_rad: 0.0,
                ..self.command
            };
        }
        let c = self.command;
        self.ballast.command(f64::from(c.ballast_m3));
        self.battery.command(f64::from(c.battery_mass_m));
        self.fin.command(f64::from(c.fin_rad));
        self.fire(c.drop_weight);
    }

    /// Heats the burn wire; once begun it goes on.
    fn fire(&mut self, wanted: bool) {
        if wanted && self.firing_s.is_none() {
            self.firing_s = Some(self.t);
        }
    }

    /// Actuator faults bend what the command asked for.
    fn obey_faults(&mut self) {
        if self.schedule.is_empty() {
            return;
        }
        let a = self.scenario.actuators;
        let rates = [a.pump.rate_m3_s, a.battery_rate_m_s, a.fin_rate_rad_s];
        for (servo, target, rate) in [
            (&mut self.ballast, Target::Pump, rates[0]),
            (&mut self.battery, Target::MassMotor, rates[1]),
            (&mut self.fin, Target::FinMotor, rates[2]),
        ] {
            servo.rate = rate;
            let find = |k| self.schedule.find(self.t, target, k);
            if find(Kind::Stuck).is_some() {
                servo.halt();
            }
            if let Some((share, _)) = find(Kind::Slow) {
                servo.rate = rate * share.clamp(0.0, 1.0);
            }
            if let Some((share, since)) = find(Kind::Intermittent)
                && (since / 10.0).fract() < share
            {
                servo.rate = 0.0;
            }
            if let Some((end, _)) = find(Kind::Runaway) {
                servo.command(end * servo.limit);
            }
            servo.creep = find(Kind::LeakBack).map_or(0.0, |(creep, _)| -creep.abs());
        }
    }

    /// What acts over the coming control cycle, from effects and faults.
    fn inputs(&self) -> Inputs {
        let v = &self.scenario.vehicle;
        let effects = &self.scenario.effects;
        let mut i = Inputs::still(self.mass);
        i.list = v.list_rad;
        if !effects.is_empty() {
            let sum = |k| Effect::sum(effects, k);
            let days = (self.scenario.start.in_water_s + self.t) / 86_400.0;
            i.drag_factor += sum(E::BiofoulingDrag) * days;
            let kelp = Effect::second(effects, E::SnaggedKelp, 5400.0);
            if (self.t / kelp) as u64 % 2 == 1 {
                i.drag_factor += sum(E::SnaggedKelp);
            }
            i.extra_volume += sum(E::BallastOffset) * 1e-6;
            i.air = sum(E::TrappedAir) * 1e-6;
            i.sink = -sum(E::VerticalCurrent);
            let omega = TAU / Effect::second(effects, E::InternalWave, 1800.0);
            // Phase at t = 0 by the golden angle: seeds spread it.
            i.wave = (sum(E::InternalWave), omega, (self.scenario.seed % 1_000_000) as f64 * 2.399_963);
            i.mass += sum(E::SlowLeak) * 1e-3 * self.t / 3600.0;
        }
        if self.schedule.is_empty() {
            return i;
        }
        for (fault, _) in self.schedule.active(self.t) {
            match (fault.target, fault.kind) {
                (Target::Vehicle, Kind::Fouling) => i.drag_factor += fault.size,
                (Target::Vehicle, Kind::Trim) => i.mass += fault.size * 1e-3,
                (Target::Vehicle, Kind::WingLoss) => {
                    i.wing_share = 0.5;
                    i.list -= 0.2 * fault.size.signum();
                    i.curvature_bias += 0.03 * fault.size.signum();
                    i.mass -= 0.05;
                }
                (Target::Vehicle, Kind::Net) => i.held = Some(self.held_at.unwrap_or(self.y[2].max(0.0))),
                (Target::Vehicle, Kind::Dragged) => i.pull += fault.size,
                (Target::Sea, Kind::Ice) => i.ceiling = fault.size,
                (Target::Sea, Kind::Lens) => i.lens = Some((8.0, fault.size)),
                (Target::Sea, Kind::Current) => i.current.1 += fault.size,
                (Target::Sea, Kind::Upwelling) => i.sink -= fault.size,
                _ => {}
            }
        }
        i
    }

    /// Water motion at this instant, as ramps from here on.
    fn with_water(&self, mut i: Inputs) -> Inputs {
        let slope = (self.background.2 - self.background.1) / BACKGROUND_GRID_S;
        i.background = Ramp { start: self.background.1 + slope * (self.t - self.background.0 as f64 * BACKGROUND_GRID_S), rate: slope };
        i.wave.2 += i.wave.1 * self.t;
        i
    }

    /// One step of length `h` with the actuators moving at `rates`.
    fn integrate(&mut self, base: &Inputs, h: f64, rates: [f64; 3]) {
        let mut i = self.with_water(*base);
        let effects = &self.scenario.effects;
        let (gain, pump_lag) =
            if effects.is_empty() { (1.0, 0.0) } else { (1.0 + Effect::sum(effects, E::BallastScale), Effect::sum(effects, E::PumpLag)) };
        let ballast_before = self.ballast.position;
        let pressure = self.pressure();
        let effective_before = self.effective_ballast;
        self.ballast.pass(rates[0], h);
        let piston = self.ballast.position * gain;
        self.effective_ballast = if pump_lag > 0.0 { piston + (effective_before - piston) * (-h / pump_lag).exp() } else { piston };
        let effective_before = if pump_lag > 0.0 { effective_before } else { ballast_before * gain };
        i.ballast = Ramp { start: effective_before, rate: (self.effective_ballast - effective_before) / h };
        i.battery = Ramp { start: self.battery.position, rate: rates[1] };
        i.fin = Ramp { start: self.fin.position, rate: rates[2] };
        i.hull_temperature = self.hull_temperature;
        i.flooded = self.flooded.map(|rho| (Effect::sum(effects, E::FloodedVolumeLag), rho));
        self.y = self.body.step(&self.column, &i, h, &self.y);
        self.battery.pass(rates[1], h);
        self.fin.pass(rates[2], h);
        self.t += h;
        self.account(h, rates, pressure, self.ballast.position - ballast_before);
        self.watch(h);
    }
}

//! The board's own loop with its own drivers, on models of the fitted parts, in a world.
//!
//! ```text
//! world ─► registers, voltages, sentences ─► drivers ─► loop ─► law ─► motor bridges ─► world
//! ```
//! Everything from the wires inward is what the image flies ([`bay`], `devices`, `helm`, the flash's `store`); the chip's own
//! blocks (timer, USART, SPI) are not here. Time is that of the board: the world is as far as the last part that looked.

mod chip;

use super::link::Wire;
pub use super::own_flash::OwnFlash;
use bay::radio::Tally;
use bay::run::Outside as _;
use bay::{Fitted, KeptUtc, Parts, Run, SupplyPins, Wiring};
use chip::{Block, Chip, FlashBlock};
use control::Config;
use devices::chip_flash::{Journal, Memory, Slots};
use devices::flash::Flash;
use devices::options;
use devices::soft_i2c::SoftI2c;
use devices::stop::Stops;
use helm::{Boot, Helm, Mark, Vault, WithImages};
use parts::chip_flash::ChipFlash;
use parts::iridium::{Fault, ModemPort, ModemPower};
use parts::ms5837::Model;
use parts::outputs::{Name, Pin, Sense, Servo};
use parts::talker::Port;
use parts::wires::WirePin;
use parts::{Bench, Clock, Drive, Sample, Surroundings, Work, gps, os5000, w25q128};
use plant::{Truth, World};
use signals::{Answer, Reading, SensorFrame, Strap, Switch, Timebase, Weight};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;
use std::time::Duration;
use store::image::{FACTS, Facts, RUNS_AT};

/// Air pressure over the water, Pa.
const AIR_PA: f64 = 101_325.0;
/// What a part shows does not change within this time, ns: noise of a reading is not that of a moment.
const SAMPLE_NS: u64 = 2_000_000;
/// Nor does the pressure in this time: waves are slower.
const PRESSURE_NS: u64 = 100_000_000;
/// The watchdog resets the board after this time without a feed, ns.
const WATCHDOG_NS: u64 = 12_000_000_000;
/// Samples kept for whoever judges the drivers: more than ten seconds of a motor that is looked at.
const SEEN: usize = 4_096;
/// Virtual time that the host waits for an answer, ns.
const ANSWER_NS: u64 = 3_000_000_000;

/// The world around the parts.
pub struct InTheWorld {
    /// The world.
    pub world: World,
    start_s: f64,
    sampled: Option<(u64, Sample)>,
    pressure: Option<(u64, Option<f64>)>,
    energy: (f64, f64),
    amps: f64,
    /// What there was to measure of late, oldest first.
    seen: VecDeque<Seen>,
    /// Beacon on.
    pub beacon: bool,
}

/// What there was to measure at a moment, for whoever judges the drivers.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// When, s since the bench was switched on.
    pub time_s: f64,
    /// What.
    pub sample: Sample,
    /// Range of pump and battery mass either side of the middle: 1 in the sample, m³ and m.
    pub pump_m3: f64,
    /// See above.
    pub mass_m: f64,
}

impl InTheWorld {
    fn pass_to(&mut self, now_ns: u64) {
        let seconds = self.start_s + now_ns as f64 * 1e-9 - self.world.time_s();
        if seconds > 0.0 {
            self.world.pass(seconds);
        }
    }
}

impl Surroundings for InTheWorld {
    fn sample(&mut self, now_ns: u64) -> Sample {
        if let Some((_, sample)) = self.sampled.filter(|(at, _)| now_ns < at + SAMPLE_NS) {
            return sample;
        }
        self.pass_to(now_ns);
        let frame = self.world.sense();
        let s = self.world.scenario();
        let (mass_kg, a) = (s.vehicle.mass_kg, s.actuators);
        let density = s.sensors.depth_density_kg_m3.unwrap_or(mass_kg / self.world.hull_volume_m3());
        let pressure = |depth_m: f64| AIR_PA + depth_m * density * plant::ocean::GRAVITY_M_S2;
        let value = |r: Reading| match r {
            Reading::Sampled { value, .. } => Some(f64::from(value)),
            Reading::Missing => None,
        };
        let volts = value(frame.battery_v);
        let (total_j, time_s) = (self.world.energy().total_j(), self.world.time_s());
        if time_s - self.energy.1 > 1e-4 {
            self.amps = (total_j - self.energy.0) / (time_s - self.energy.1) / volts.filter(|v| *v > 1.0).unwrap_or(12.0);
            self.energy = (total_j, time_s);
        }
        let held = self.pressure.filter(|(at, _)| now_ns < at + PRESSURE_NS);
        let (at, pressure_pa) = held.unwrap_or((now_ns, value(frame.depth_m).map(pressure)));
        self.pressure = Some((at, pressure_pa));
        let sample = Sample {
            pressure_pa,
            temperature_c: self.world.truth().temperature_degc,
            attitude_rad: [frame.pitch_rad, frame.roll_rad, frame.heading_rad].map(value),
            pump: value(frame.ballast_m3).map(|x| x / a.pump.volume_m3),
            mass: value(frame.battery_mass_m).map(|x| x / a.battery_travel_m),
            vacuum_pa: value(frame.vacuum_pa),
            wet: match frame.leak {
                Switch::Alarm => Some(true),
                Switch::Clear => Some(false),
                Switch::Unknown => None,
            },
            volts,
            amps: self.amps,
            wire: frame.weight != Weight::Released,
            fix: frame.surface.gps_fix,
        };
        self.sampled = Some((now_ns, sample));
        let (pump_m3, mass_m) = (a.pump.volume_m3, a.battery_travel_m);
        self.seen.push_back(Seen { time_s: now_ns as f64 * 1e-9, sample, pump_m3, mass_m });
        if self.seen.len() > SEEN {
            self.seen.pop_front();
        }
        sample
    }

    fn sky(&self) -> bool {
        self.world.shore_in_reach()
    }

    fn drive(&mut self, now_ns: u64, drive: Drive) {
        self.pass_to(now_ns);
        self.sampled = None;
        self.beacon = drive.beacon;
        // Without supply or pulses the servo's gear holds the fin where it is.
        let fin_rad = drive.fin_rad.unwrap_or_else(|| self.world.truth().fin_rad);
        self.world.drive(&plant::actuators::Drive { pump: drive.pump, battery: drive.mass, fin_rad, fire: drive.fire });
    }
}

/// Which type is what on the bench.
pub struct OnTheBench;

impl Fitted for OnTheBench {
    type Bus = SoftI2c<WirePin, WirePin, Clock>;
    type Delay = Clock;
    type Motor = Pin;
    type Out = Pin;
    type In = Sense;
    type Servo = Servo;
    type Compass = Port<os5000::Os5000>;
    type Gps = Port<gps::Gps>;
    type Modem = ModemPort;
    type ModemPower = ModemPower;
}

/// The line, from both sides.
#[derive(Clone, Default)]
struct Line(Rc<RefCell<(VecDeque<u8>, VecDeque<u8>)>>);

impl embedded_io::ErrorType for Line {
    type Error = Infallible;
}

impl embedded_io::Read for Line {
    fn read(&mut self, out: &mut [u8]) -> Result<usize, Infallible> {
        // A queue in memory does not fail.
        Ok(std::io::Read::read(&mut self.0.borrow_mut().0, out).unwrap_or(0))
    }
}

impl embedded_io::ReadReady for Line {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.0.borrow().0.is_empty())
    }
}

impl embedded_io::Write for Line {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.0.borrow_mut().1.extend(bytes);
        Ok(bytes.len())
    }
    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

type Storage = WithImages<Vault<Flash<w25q128::Bus, Clock>>, Journal<OwnFlash>, Slots<OwnFlash>>;

/// A cycle as the board made it.
pub struct Made {
    /// What its drivers measured.
    pub frame: SensorFrame,
    /// What its law answered.
    pub answer: Answer,
    /// What was true then.
    pub truth: Truth,
}

/// A board on the bench, behind its line.
pub struct OwnParts {
    /// The parts.
    pub bench: Bench,
    /// The world around them.
    pub around: Rc<RefCell<InTheWorld>>,
    line: Line,
    chip: Chip,
    built_in: Config,
    helm: Helm<Storage>,
    run: Run<OnTheBench, Line>,
    /// Resets so far.
    pub resets: u32,
    /// Resets by the watchdog among them: the loop hung.
    pub hangs: u32,
    /// When the last pass began, ns.
    passed_ns: u64,
}

impl OwnParts {
    /// A board for the vehicle with this built-in configuration, switched on in a world.
    #[must_use]
    pub fn new(world: World, built_in: Config) -> Self {
        Self::with(world, built_in, Model::Bar30)
    }

    /// The same with another pressure transducer soldered on.
    #[must_use]
    pub fn with(world: World, built_in: Config, model: Model) -> Self {
        let start_s = world.time_s();
        let around = InTheWorld {
            world,
            start_s,
            sampled: None,
            pressure: None,
            energy: (0.0, start_s),
            amps: 0.0,
            seen: VecDeque::new(),
            beacon: false,
        };
        let around = Rc::new(RefCell::new(around));
        let bench = Bench::new(around.clone(), model);
        let mut chip = Chip {
            clock: bench.clock.clone(),
            counted: (0, 0),
            stops: Stops::new(),
            stopped: false,
            fed_ns: 0,
            ram: None,
            answer: None,
            strap: Strap::Deployment,
            kept_utc: None,
            flash: OwnFlash(Rc::new(RefCell::new(ChipFlash::default()))),
            wants_restart: false,
            options: FlashBlock(bench.options.clone()),
        };
        let line = Line::default();
        let (helm, run) = switched_on(&bench, &mut chip, &line, &built_in, 0);
        Self { bench, around, line, chip, built_in, helm, run, resets: 0, hangs: 0, passed_ns: 0 }
    }

    /// The controller.
    pub fn helm(&mut self) -> &mut Helm<Storage> {
        &mut self.helm
    }

    /// Sentences of the compass: said by it, read whole, refused.
    #[must_use]
    pub fn sentences(&self) -> (u64, u32, u32) {
        let compass = &self.run.parts.compass;
        (self.bench.compass.borrow().said, compass.whole, compass.refused)
    }

    /// When the last pass began, ns since the bench was switched on.
    #[must_use]
    pub const fn passed_at_ns(&self) -> u64 {
        self.passed_ns
    }

    /// Fits a modem with this wrong with it.
    pub fn fit_modem(&self, fault: Fault) {
        self.bench.modem.borrow_mut().fault = fault;
    }

    /// What came of the messages since the last reset.
    #[must_use]
    pub const fn radio(&self) -> &Tally {
        &self.run.parts.radio.tally
    }

    /// What reached the shore: seconds since the bench was switched on, and bytes.
    #[must_use]
    pub fn shore(&self) -> Vec<(f64, Vec<u8>)> {
        self.bench.modem.borrow().shore.iter().map(|(at, bytes)| (*at as f64 * 1e-9, bytes.clone())).collect()
    }

    /// Afloat after a flight: goes on until the last message is told or given up, or `limit_s` have passed.
    pub fn tell(&mut self, limit_s: f64) {
        let limit_ns = self.bench.clock.now_ns() + (limit_s * 1e9) as u64;
        while self.bench.clock.now_ns() < limit_ns && self.run.parts.radio.has_to_tell() {
            self.pass();
        }
    }

    /// The chip's own flash.
    #[must_use]
    pub fn own_flash(&self) -> OwnFlash {
        self.chip.flash.clone()
    }

    /// Fits the strap, or takes it out.
    pub fn strap(&mut self, strap: Strap) {
        self.chip.strap = strap;
    }

    /// The frame of the last step.
    #[must_use]
    pub fn last_frame(&self) -> Option<SensorFrame> {
        self.helm.last().map(|(frame, _)| *frame)
    }

    /// What there was to measure of late.
    #[must_use]
    pub fn seen(&self) -> Vec<Seen> {
        self.around.borrow().seen.iter().copied().collect()
    }

    /// Air pressure that depth is reckoned from, Pa.
    #[must_use]
    pub const fn air_pa(&self) -> f32 {
        self.run.parts.air_pa()
    }

    /// A reset in the middle of whatever is going on; with the supply of the whole board, or that of the processor alone.
    pub fn restart(&mut self, whole_board: bool) {
        self.boot(whole_board, false);
    }

    /// The boot loader first; the loop after it is this program's, whichever image is in its place.
    fn boot(&mut self, whole_board: bool, watchdog: bool) {
        self.resets += 1;
        self.chip.flash.0.borrow_mut().power_up(None);
        let mut images = self.chip.flash.images();
        images.open();
        images.boot(watchdog);
        if whole_board {
            self.chip.ram = None;
        }
        self.bench.brown_out(whole_board);
        (self.helm, self.run) = switched_on(&self.bench, &mut self.chip, &self.line, &self.built_in, self.resets);
    }

    /// One pass of the loop, and the sleep after it.
    pub fn pass(&mut self) {
        let woken = self.bench.clock.now_ns();
        self.passed_ns = woken;
        let due_ms = self.run.pass(&mut self.helm, &mut self.chip);
        let now = self.bench.clock.now_ns();
        // Computing takes time as well: 36,000 instructions a cycle, 2 ms, are counted with the step (docs/performance.md).
        self.bench.clock.work(Work::Processor, now - woken);
        if now.saturating_sub(self.chip.fed_ns) > WATCHDOG_NS {
            self.hangs += 1;
            self.chip.fed_ns = now;
            return self.boot(false, true);
        }
        if std::mem::take(&mut self.chip.wants_restart) {
            return self.restart(false);
        }
        self.run.rest(&mut self.helm, &mut self.chip, due_ms);
    }

    /// Goes on until the board has made a step, or `limit_s` have passed.
    pub fn cycle(&mut self, limit_s: f64) -> Option<Made> {
        let limit_ns = self.bench.clock.now_ns() + (limit_s * 1e9) as u64;
        self.chip.answer = None;
        while self.bench.clock.now_ns() < limit_ns {
            self.pass();
            let brown = self.around.borrow_mut().world.take_brown_out();
            if brown {
                self.restart(self.resets.is_multiple_of(2));
            }
            if let Some(answer) = self.chip.answer.take() {
                let frame = self.helm.last().map(|(frame, _)| *frame)?;
                let truth = self.around.borrow().world.truth();
                return Some(Made { frame, answer, truth });
            }
        }
        None
    }
}

/// What the image does from reset to its loop.
fn switched_on(bench: &Bench, chip: &mut Chip, line: &Line, built_in: &Config, resets: u32) -> (Helm<Storage>, Run<OnTheBench, Line>) {
    let mut storage = WithImages::new(Vault::new(), chip.flash.images());
    let mut facts = [0; FACTS];
    chip.flash.copy(RUNS_AT, &mut facts);
    storage.open(Facts::read(&facts).map_or(0, |facts| facts.id));
    let mark = Flash::start(w25q128::Bus(bench.flash.clone()), bench.clock.clone()).ok().map(|part| storage.rest.attach(part));
    let found = Mark::after_reset(chip.ram.map_or(Mark::NONE, |(mark, _)| mark), mark);
    let boot = Boot { mark: found, boots: resets, firmware: [0; 3], salt: resets << 8 };
    let mut helm = Helm::new(built_in.clone(), boot, storage);
    helm.booted(boot);
    helm.utc.runs_on(Timebase::Crystal);
    let option_bytes = options::read(&mut chip.options);
    helm.deck.options_are(option_bytes);
    chip.kept_utc = Some(KeptUtc::open(Block(bench.rtc.clone()), &mut helm.utc, chip.now_ms()));
    (chip.stops, chip.stopped) = (Stops::of(option_bytes), false);
    let (clock_pin, data_pin) = WirePin::pair(&bench.wires);
    let pin = |name| Pin::new(&bench.outputs, name);
    let wiring = Wiring {
        bus: SoftI2c::new(clock_pin, data_pin, bench.clock.clone()),
        delay: bench.clock.clone(),
        pump: (pin(Name::PumpOut), pin(Name::PumpIn)),
        mass: (pin(Name::MassForward), pin(Name::MassAft)),
        release: (pin(Name::Arm), pin(Name::Fire)),
        beacon: pin(Name::Beacon),
        wire: Sense::Wire(bench.clock.clone(), bench.around.clone()),
        bridge_fault: Sense::BridgeFault(bench.outputs.clone()),
        fin: Servo(bench.outputs.clone()),
        compass: Port(bench.compass.clone()),
        gps: Port(bench.gps.clone()),
        supplies: SupplyPins {
            compass: pin(Name::Compass),
            gps: pin(Name::Gps),
            analog: pin(Name::Analog),
            bridges: pin(Name::Bridges),
            servo: pin(Name::Servo),
        },
        modem: (ModemPort(bench.modem.clone()), ModemPower(bench.modem.clone())),
    };
    let mut parts = Parts::new(wiring, built_in);
    if let Some((_, air_pa)) = chip.ram {
        parts.remember_air(air_pa);
    }
    chip.fed_ns = bench.clock.now_ns();
    let run = Run::new(line.clone(), parts, chip);
    (helm, run)
}

impl Wire for OwnParts {
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        // The byte that ends a stop is lost.
        let lost = usize::from(std::mem::take(&mut self.chip.stopped));
        self.line.0.borrow_mut().0.extend(bytes.iter().skip(lost));
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], _wait: Duration) -> std::io::Result<usize> {
        let limit_ns = self.bench.clock.now_ns() + ANSWER_NS;
        while self.line.0.borrow().1.is_empty() && self.bench.clock.now_ns() < limit_ns {
            self.pass();
        }
        std::io::Read::read(&mut self.line.0.borrow_mut().1, into)
    }

    fn reset(&mut self) -> bool {
        self.restart(false);
        true
    }

    fn describe(&self) -> String {
        "the board's loop and drivers on models of its parts".to_owned()
    }
}

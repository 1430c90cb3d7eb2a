//! What goes wrong, when, and for how long?
//!
//! A fault is written `target:kind[=size][@phase][+delay][,duration]`:
//!
//! | text | meaning |
//! |---|---|
//! | `depth:stuck` | from the start, for good |
//! | `depth:stuck@dive+120s,300s` | 120 s after the first dive began, for 300 s |
//! | `pitch:bias=0.1+60s` | 0.1 rad too much from 60 s on |
//! | `pump:runaway=-1@climb` | runs to full sink when the first climb begins |
//!
//! Phases are those of the controller (`surface`, `dive`, `inflect_low`,
//! `climb`, `inflect_high`, `comms`); the world hears of them by
//! [`crate::World::observe_phase`]. Times are seconds with or without `s`, or
//! minutes with `m`. [`catalogue`] lists all there is.

use std::ops::RangeInclusive;

mod fault;
mod schedule;

pub use fault::Fault;
pub(crate) use schedule::Schedule;

macro_rules! names {
    ($(#[$doc:meta])* $type:ident { $($(#[$vdoc:meta])* $variant:ident = $name:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        #[non_exhaustive]
        pub enum $type { $($(#[$vdoc])* $variant,)* }
        impl $type {
            /// Name in the text form.
            #[must_use]
            pub const fn name(self) -> &'static str { match self { $(Self::$variant => $name,)* } }
            fn from_name(name: &str) -> Option<Self> { match name { $($name => Some(Self::$variant),)* _ => None } }
        }
    };
}

names! {
    /// What fails.
    Target {
        /// Main pressure sensor.
        Depth = "depth",
        /// Second pressure sensor.
        Depth2 = "depth2",
        /// Pitch.
        Pitch = "pitch",
        /// Roll.
        Roll = "roll",
        /// Compass.
        Heading = "heading",
        /// Pump position feedback.
        BallastFeedback = "ballast",
        /// Battery position feedback.
        MassFeedback = "battery_mass",
        /// Fin position feedback.
        FinFeedback = "fin",
        /// CTD density.
        Density = "density",
        /// Altimeter.
        Altitude = "altitude",
        /// Battery voltage.
        Voltage = "voltage",
        /// Charge gauge.
        Charge = "charge",
        /// Internal pressure sensor.
        VacuumGauge = "vacuum",
        /// Leak detector.
        LeakDetector = "leak",
        /// Drop weight monitor.
        WeightMonitor = "weight",
        /// GPS receiver.
        Gps = "gps",
        /// Radio.
        Comms = "comms",
        /// Buoyancy pump.
        Pump = "pump",
        /// Battery motor.
        MassMotor = "mass_motor",
        /// Fin motor.
        FinMotor = "fin_motor",
        /// Release of the drop weight.
        Release = "release",
        /// Commands on their way to the actuators.
        Command = "command",
        /// Pressure hull.
        Hull = "hull",
        /// Vehicle as a whole.
        Vehicle = "vehicle",
        /// Water around it.
        Sea = "sea",
        /// Power supply.
        Power = "power",
    }
}

names! {
    /// How it fails.
    Kind {
        /// Gives nothing.
        Off = "off",
        /// Keeps its value (sensor) or position (actuator).
        Stuck = "stuck",
        /// Gives a new value rarely (sensor), moves slowly (actuator).
        Slow = "slow",
        /// Gives old values, honestly stamped.
        Delayed = "delayed",
        /// Drops out again and again.
        Intermittent = "intermittent",
        /// Gives random numbers.
        Garbage = "garbage",
        /// Off by a constant.
        Bias = "bias",
        /// Off by a growing amount.
        Drift = "drift",
        /// Single wild values.
        Spike = "spike",
        /// Not a number.
        Nan = "nan",
        /// Infinity.
        Inf = "inf",
        /// The sentinel 9999.
        Sentinel = "sentinel",
        /// Sign flipped.
        Flip = "flip",
        /// False alarm.
        Alarm = "alarm",
        /// Alarm and all-clear at random.
        Chatter = "chatter",
        /// Runs to an end by itself.
        Runaway = "runaway",
        /// Creeps back when not driven.
        LeakBack = "leak_back",
        /// Acts without command.
        Spurious = "spurious",
        /// Is lost on the way.
        Lost = "lost",
        /// Water comes in.
        Leak = "leak",
        /// Vacuum is lost.
        VacuumLoss = "vacuum_loss",
        /// More drag.
        Fouling = "fouling",
        /// Heavier or lighter.
        Trim = "trim",
        /// One wing gone.
        WingLoss = "wing_loss",
        /// Held where it is.
        Net = "net",
        /// Pulled down.
        Dragged = "dragged",
        /// Ice closes the surface.
        Ice = "ice",
        /// Lens of light water at the surface.
        Lens = "lens",
        /// Strong horizontal current.
        Current = "current",
        /// Rising (or sinking) water.
        Upwelling = "upwelling",
        /// Supply interrupted: the controller resets.
        BrownOut = "brown_out",
        /// Voltage low.
        Undervoltage = "undervoltage",
        /// Charge low.
        LowCharge = "low_charge",
    }
}

/// One kind of fault that can be injected: target, kind, default size, what the size means.
pub type Entry = (Target, Kind, f64, &'static str);

/// Faults every analogue sensor can have, with the meaning of their size; the default sizes of bias, drift and spike depend on the sensor.
const SENSOR_KINDS: [(Kind, f64, &str); 13] = [
    (Kind::Off, 0.0, ""),
    (Kind::Stuck, 0.0, ""),
    (Kind::Slow, 30.0, "sample period, s"),
    (Kind::Delayed, 20.0, "delay, s"),
    (Kind::Intermittent, 0.5, "share missing"),
    (Kind::Garbage, 0.0, ""),
    (Kind::Bias, f64::NAN, "offset, unit of the sensor"),
    (Kind::Drift, f64::NAN, "offset per hour, unit of the sensor"),
    (Kind::Spike, f64::NAN, "height, unit of the sensor; one reading in twenty"),
    (Kind::Nan, 0.0, ""),
    (Kind::Inf, 0.0, ""),
    (Kind::Sentinel, 0.0, ""),
    (Kind::Flip, 0.0, ""),
];

/// Analogue sensors with the default size of a bias, of a drift per hour, and of a spike, SI units.
pub(crate) const ANALOGUE: [(Target, [f64; 3]); 13] = [
    (Target::Depth, [3.0, 10.0, 60.0]),
    (Target::Depth2, [3.0, 10.0, 60.0]),
    (Target::Pitch, [0.15, 0.3, 1.0]),
    (Target::Roll, [0.15, 0.3, 1.0]),
    (Target::Heading, [0.8, 1.0, 2.0]),
    (Target::BallastFeedback, [50e-6, 100e-6, 400e-6]),
    (Target::MassFeedback, [0.005, 0.01, 0.05]),
    (Target::FinFeedback, [0.1, 0.2, 0.8]),
    (Target::Density, [3.0, 10.0, 200.0]),
    (Target::Altitude, [-10.0, -10.0, -30.0]),
    (Target::Voltage, [-2.0, -2.0, -8.0]),
    (Target::Charge, [-0.3, -0.3, -0.9]),
    (Target::VacuumGauge, [2e4, 2e4, 6e4]),
];

const OTHERS: [Entry; 41] = [
    (Target::LeakDetector, Kind::Off, 0.0, ""),
    (Target::LeakDetector, Kind::Alarm, 0.0, ""),
    (Target::LeakDetector, Kind::Chatter, 0.2, "share of alarms"),
    (Target::WeightMonitor, Kind::Off, 0.0, ""),
    (Target::Gps, Kind::Off, 0.0, ""),
    (Target::Comms, Kind::Off, 0.0, ""),
    (Target::Pump, Kind::Stuck, 0.0, ""),
    (Target::Pump, Kind::Runaway, -1.0, "end it runs to, -1 sink to 1 buoyant"),
    (Target::Pump, Kind::Slow, 0.1, "share of its rate"),
    (Target::Pump, Kind::LeakBack, 0.5e-6, "creep to the sink side when not driven, m3/s"),
    (Target::MassMotor, Kind::Stuck, 0.0, ""),
    (Target::MassMotor, Kind::Runaway, 1.0, "end it runs to, -1 aft to 1 forward"),
    (Target::MassMotor, Kind::Slow, 0.1, "share of its rate"),
    (Target::FinMotor, Kind::Stuck, 0.0, ""),
    (Target::FinMotor, Kind::Runaway, 1.0, "end it runs to, -1 port to 1 starboard"),
    (Target::FinMotor, Kind::Slow, 0.1, "share of its rate"),
    (Target::Release, Kind::Stuck, 0.0, ""),
    (Target::Release, Kind::Spurious, 0.0, ""),
    (Target::Command, Kind::Lost, 0.0, ""),
    (Target::Command, Kind::Intermittent, 0.3, "share lost"),
    (Target::Hull, Kind::Leak, 20.0, "water coming in, g/min"),
    (Target::Hull, Kind::VacuumLoss, 600.0, "time constant, s"),
    (Target::Vehicle, Kind::Fouling, 1.0, "relative increase of the drag area"),
    (Target::Vehicle, Kind::Trim, 200.0, "weight added, g"),
    (Target::Vehicle, Kind::WingLoss, 1.0, "side lost, 1 starboard, -1 port"),
    (Target::Vehicle, Kind::Net, 0.0, ""),
    (Target::Vehicle, Kind::Dragged, 8.0, "force down, N"),
    (Target::Sea, Kind::Ice, 1.5, "thickness, m"),
    (Target::Sea, Kind::Lens, -2.5, "density change above 8 m, kg/m3"),
    (Target::Sea, Kind::Current, 0.6, "eastward, m/s"),
    (Target::Sea, Kind::Upwelling, 0.06, "upward, m/s"),
    (Target::Power, Kind::BrownOut, 0.0, ""),
    (Target::Power, Kind::Undervoltage, 9.5, "voltage, V"),
    (Target::Power, Kind::LowCharge, 0.05, "charge, 0..1"),
    (Target::WeightMonitor, Kind::Alarm, 0.0, ""),
    (Target::Gps, Kind::Intermittent, 0.7, "share missing"),
    (Target::Comms, Kind::Intermittent, 0.7, "share missing"),
    (Target::Pump, Kind::Intermittent, 0.5, "share of the time stopped"),
    (Target::MassMotor, Kind::Intermittent, 0.5, "share of the time stopped"),
    (Target::FinMotor, Kind::Intermittent, 0.5, "share of the time stopped"),
    (Target::LeakDetector, Kind::Stuck, 0.0, ""),
];

/// Everything that can be injected, in a fixed order.
pub fn catalogue() -> impl Iterator<Item = Entry> {
    let sensors = ANALOGUE.iter().flat_map(|(target, sizes)| {
        SENSOR_KINDS.iter().map(move |(kind, size, meaning)| {
            let size = match kind {
                Kind::Bias => sizes[0],
                Kind::Drift => sizes[1],
                Kind::Spike => sizes[2],
                _ => *size,
            };
            (*target, *kind, size, *meaning)
        })
    });
    sensors.chain(OTHERS)
}

/// Sizes that a fault of this kind may have. Where zero lies between them the sign is a kind of its own: a depth that reads too
/// little is not the same danger as one that reads too much.
#[must_use]
pub fn sizes(target: Target, kind: Kind) -> RangeInclusive<f64> {
    use Kind as K;
    match (target, kind) {
        (_, K::Bias | K::Drift | K::Spike) => {
            let most = 10.0 * Fault::new(target, kind).map_or(0.0, |f| f.size.abs());
            -most..=most
        }
        (Target::Pump | Target::MassMotor | Target::FinMotor, K::Slow) => 0.0..=1.0,
        (_, K::Slow) => 1.0..=3600.0,
        (_, K::Delayed) => 0.0..=3600.0,
        (_, K::Intermittent | K::Chatter | K::LowCharge) => 0.0..=1.0,
        (_, K::Runaway | K::WingLoss) => -1.0..=1.0,
        (_, K::LeakBack) => 0.0..=50e-6,
        (_, K::Leak) => 0.0..=100_000.0,
        (_, K::VacuumLoss) => 1.0..=1e6,
        (_, K::Fouling) => 0.0..=20.0,
        (_, K::Trim) => -5000.0..=5000.0,
        (_, K::Dragged) => 0.0..=100.0,
        (_, K::Ice) => 0.0..=20.0,
        (_, K::Lens) => -20.0..=20.0,
        (_, K::Current) => -3.0..=3.0,
        (_, K::Upwelling) => -0.5..=0.5,
        (_, K::Undervoltage) => 0.0..=30.0,
        _ => 0.0..=0.0,
    }
}

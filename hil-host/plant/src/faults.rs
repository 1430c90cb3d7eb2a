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

use serde::{Deserialize, Serialize};
use signals::Phase;
use std::ops::RangeInclusive;

macro_rules! names {
    ($(#[$doc:meta])* $type:ident { $($(#[$vdoc:meta])* $variant:ident = $name:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
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

/// One fault to come.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Fault {
    /// What fails.
    pub target: Target,
    /// How.
    pub kind: Kind,
    /// Size, meaning by entry of [`catalogue`].
    pub size: f64,
    /// Begins when the controller first enters this phase; none: at the start.
    pub phase: Option<Phase>,
    /// Delay after that, s.
    pub delay_s: f64,
    /// Duration, s; none: for good.
    pub duration_s: Option<f64>,
}

impl Fault {
    /// A fault of default size from the start, for good; none when there is no such fault.
    #[must_use]
    pub fn new(target: Target, kind: Kind) -> Option<Self> {
        let (_, _, size, _) = catalogue().find(|e| e.0 == target && e.1 == kind)?;
        Some(Self { target, kind, size, phase: None, delay_s: 0.0, duration_s: None })
    }

    /// The same fault with the other sign; none: its size has no sign.
    #[must_use]
    pub fn mirrored(self) -> Option<Self> {
        sizes(self.target, self.kind).contains(&-self.size).then_some(Self { size: -self.size, ..self }).filter(|f| f.size != 0.0)
    }

    /// The same fault when a phase begins, `delay_s` later.
    #[must_use]
    pub const fn at(self, phase: Phase, delay_s: f64) -> Self {
        Self { phase: Some(phase), delay_s, ..self }
    }

    /// The same fault for a limited time.
    #[must_use]
    pub const fn lasting(self, duration_s: f64) -> Self {
        Self { duration_s: Some(duration_s), ..self }
    }
}

const PHASES: [(&str, Phase); 8] = [
    ("surface", Phase::Surface),
    ("dive", Phase::Dive),
    ("inflect_low", Phase::InflectLow),
    ("climb", Phase::Climb),
    ("inflect_high", Phase::InflectHigh),
    ("comms", Phase::Comms),
    ("done", Phase::Done),
    ("safe", Phase::Safe),
];

fn seconds(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let (digits, factor) = match text.strip_suffix('s') {
        Some(d) => (d, 1.0),
        None => text.strip_suffix('m').map_or((text, 1.0), |d| (d, 60.0)),
    };
    digits
        .trim()
        .parse::<f64>()
        .ok()
        .filter(|v| v.is_finite() && *v >= 0.0)
        .map(|v| v * factor)
        .ok_or_else(|| format!("'{text}' is not a time such as 120s or 5m"))
}

/// Whether a '+' after this is one of the size (`=+5`, `=1e+3`), not the one before the delay (`garbage+109s`).
fn belongs_to_the_size(before: &str) -> bool {
    before.split_once('=').is_some_and(|(_, size)| size.is_empty() || size.ends_with(['e', 'E']))
}

impl std::str::FromStr for Fault {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let fail = |why: String| format!("fault '{text}': {why}");
        let (head, duration) = text.split_once(',').map_or((text, None), |(h, d)| (h, Some(d)));
        let (target, rest) = head.split_once(':').ok_or_else(|| fail("expected target:kind, such as depth:stuck".into()))?;
        // A '+' may also stand in the size (1e+3, =+5): the delay's one follows the phase, or is the last one.
        let (kind, mut phase, mut delay) = (rest, None, None);
        let mut body = kind;
        if let Some((before, after)) = body.split_once('@') {
            body = before;
            let (p, d) = after.split_once('+').map_or((after, None), |(p, d)| (p, Some(d)));
            phase = Some(p);
            delay = d;
        } else if let Some(at) = body.rfind('+').filter(|at| !belongs_to_the_size(&body[..*at])) {
            delay = Some(&body[at + 1..]);
            body = &body[..at];
        }
        let (kind, size) = body.split_once('=').map_or((body, None), |(k, s)| (k, Some(s)));
        let target = target.trim();
        let target = Target::from_name(target).ok_or_else(|| {
            let mut names: Vec<_> = catalogue().map(|e| e.0.name()).collect();
            names.dedup();
            names.sort_unstable();
            names.dedup();
            fail(format!("nothing is called '{target}'; there are {}", names.join(", ")))
        })?;
        let kinds = || catalogue().filter(|e| e.0 == target);
        let mut fault = Kind::from_name(kind.trim()).and_then(|k| Self::new(target, k)).ok_or_else(|| {
            fail(format!(
                "{} cannot fail by '{}'; it can by {}",
                target.name(),
                kind.trim(),
                kinds().map(|e| e.1.name()).collect::<Vec<_>>().join(", ")
            ))
        })?;
        if let Some(size) = size {
            fault.size = size
                .trim()
                .parse::<f64>()
                .ok()
                .filter(|v| v.is_finite())
                .ok_or_else(|| fail(format!("'{size}' is not a finite number")))?;
            let range = sizes(fault.target, fault.kind);
            if !range.contains(&fault.size) {
                let (low, high) = (range.start(), range.end());
                let meaning = kinds().find(|e| e.1 == fault.kind).map_or("", |e| e.3);
                return Err(fail(match meaning {
                    "" => format!("{} takes no size", fault.kind.name()),
                    meaning => format!("size {} ({meaning}) is outside {low} to {high}", fault.size),
                }));
            }
        }
        if let Some(phase) = phase {
            let name = phase.trim();
            fault.phase = Some(
                PHASES
                    .iter()
                    .find(|p| p.0 == name)
                    .map(|p| p.1)
                    .ok_or_else(|| fail(format!("no phase is called '{name}'; there are {}", PHASES.map(|p| p.0).join(", "))))?,
            );
        }
        if let Some(delay) = delay {
            fault.delay_s = seconds(delay).map_err(&fail)?;
        }
        if let Some(duration) = duration {
            fault.duration_s = Some(seconds(duration).map_err(&fail)?);
        }
        Ok(fault)
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}", self.target.name(), self.kind.name())?;
        if Self::new(self.target, self.kind).is_none_or(|d| d.size != self.size) {
            write!(f, "={}", self.size)?;
        }
        if let Some(name) = self.phase.and_then(|phase| PHASES.iter().find(|p| p.1 == phase)).map(|p| p.0) {
            write!(f, "@{name}")?;
        }
        if self.delay_s != 0.0 {
            write!(f, "+{}s", self.delay_s)?;
        }
        if let Some(d) = self.duration_s {
            write!(f, ",{d}s")?;
        }
        Ok(())
    }
}

impl TryFrom<String> for Fault {
    type Error = String;
    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Fault> for String {
    fn from(fault: Fault) -> Self {
        fault.to_string()
    }
}

/// Faults and when they began.
#[derive(Clone, Debug, Default)]
pub(crate) struct Schedule {
    entries: Vec<(Fault, Option<f64>)>,
}

impl Schedule {
    pub(crate) fn new(faults: &[Fault]) -> Self {
        Self { entries: faults.iter().map(|f| (*f, f.phase.is_none().then_some(f.delay_s))).collect() }
    }

    pub(crate) fn add(&mut self, fault: Fault, now: f64) {
        self.entries.push((fault, fault.phase.is_none().then_some(now + fault.delay_s)));
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The controller is in `phase` at `now`.
    pub(crate) fn observe(&mut self, phase: Phase, now: f64) {
        for (fault, onset) in &mut self.entries {
            if onset.is_none() && fault.phase == Some(phase) {
                *onset = Some(now + fault.delay_s);
            }
        }
    }

    /// Active faults, each with the time since it began, s.
    pub(crate) fn active(&self, now: f64) -> impl Iterator<Item = (Fault, f64)> + '_ {
        self.entries.iter().filter_map(move |(fault, onset)| {
            let since = now - (*onset)?;
            (since >= 0.0 && fault.duration_s.is_none_or(|d| since < d)).then_some((*fault, since))
        })
    }

    /// Size of an active fault and the time since it began.
    pub(crate) fn find(&self, now: f64, target: Target, kind: Kind) -> Option<(f64, f64)> {
        self.active(now).find(|(f, _)| f.target == target && f.kind == kind).map(|(f, since)| (f.size, since))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prop_every_fault_is_written_and_read_back() {
        let mut n = 0;
        for (target, kind, _, _) in catalogue() {
            let plain = Fault::new(target, kind).unwrap();
            assert!(plain.size.is_finite(), "{plain}");
            let range = sizes(target, kind);
            assert!(range.contains(&plain.size), "{plain}");
            let ends = [*range.start(), *range.end()].map(|size| Fault { size, delay_s: 60.0, ..plain });
            for f in [plain, plain.at(Phase::Climb, 12.5).lasting(300.0), Fault { delay_s: 109.0, ..plain }].into_iter().chain(ends) {
                assert_eq!(f.to_string().parse::<Fault>(), Ok(f), "{f}");
            }
            for beyond in [range.start() - 0.5 * range.start().abs() - 1e-9, range.end() + 0.5 * range.end().abs() + 1e-9] {
                let text = Fault { size: beyond, ..plain }.to_string();
                assert!(text.parse::<Fault>().is_err_and(|e| e.contains("size")), "{text}");
            }
            n += 1;
        }
        assert_eq!(n, 13 * 13 + 41);
    }

    #[test]
    fn the_documented_texts_mean_what_is_said() {
        let f: Fault = "depth:stuck@dive+120s,300s".parse().unwrap();
        assert_eq!(f, Fault::new(Target::Depth, Kind::Stuck).unwrap().at(Phase::Dive, 120.0).lasting(300.0));
        let f: Fault = "pitch:bias=0.1+60s".parse().unwrap();
        assert_eq!((f.size, f.delay_s, f.phase, f.duration_s), (0.1, 60.0, None, None));
        let f: Fault = "pump:runaway=-1@climb".parse().unwrap();
        assert_eq!((f.size, f.phase), (-1.0, Some(Phase::Climb)));
        for (text, size, delay_s) in [
            ("depth:bias=1e+1+5s", 10.0, 5.0),
            ("depth:bias=+5", 5.0, 0.0),
            ("depth:bias=+5+7", 5.0, 7.0),
            ("pitch:garbage+109s", 0.0, 109.0),
        ] {
            let f: Fault = text.parse().unwrap();
            assert_eq!((f.size, f.delay_s), (size, delay_s), "{text}");
        }
        assert_eq!("depth:off,5m".parse::<Fault>().unwrap().duration_s, Some(300.0));
        for (bad, named) in [
            ("dept:off", "depth2"),
            ("depth:offf", "sentinel"),
            ("depth:bias=x", "finite"),
            ("depth:off@div", "inflect_low"),
            ("depth:off,1h", "time"),
            ("depth", "target:kind"),
            ("vehicle:fouling=-1", "0 to 20"),
            ("depth:intermittent=7", "share missing"),
            ("depth:off=3", "no size"),
        ] {
            let e = bad.parse::<Fault>().unwrap_err();
            assert!(e.contains(named), "{bad}: {e}");
        }
    }

    #[test]
    fn a_fault_waits_for_its_phase_and_ends() {
        let mut s = Schedule::new(&["depth:off@climb+10s,20s".parse().unwrap()]);
        assert!(s.find(1e6, Target::Depth, Kind::Off).is_none());
        s.observe(Phase::Climb, 100.0);
        s.observe(Phase::Climb, 115.0);
        let at = |t| s.find(t, Target::Depth, Kind::Off).is_some();
        assert!(!at(109.9) && at(110.0) && at(129.9) && !at(130.0));
    }
}

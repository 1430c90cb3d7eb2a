//! What of two answers differs, in words.

use crate::flight::log::degraded;
use control::mutant::Mutant;
use signals::{Abort, Answer, Flags, Trace};

/// One signal of an answer.
struct Signal {
    name: &'static str,
    /// Unit of the number shown, and its size in SI.
    unit: (&'static str, f64),
    value: Value,
}

enum Value {
    Number(fn(&Answer) -> f32),
    Word(fn(&Answer) -> String),
}

/// Signals from cause to effect: the first that differs is the one to look at.
const SIGNALS: [Signal; 15] = {
    const fn number(name: &'static str, unit: &'static str, size: f64, of: fn(&Answer) -> f32) -> Signal {
        Signal { name, unit: (unit, size), value: Value::Number(of) }
    }
    const fn word(name: &'static str, of: fn(&Answer) -> String) -> Signal {
        Signal { name, unit: ("", 1.0), value: Value::Word(of) }
    }
    const DEGREE: f64 = std::f64::consts::PI / 180.0;
    [
        word("table in use", |a| format!("{:08x}", a.trace.table_id)),
        number("depth believed", "m", 1.0, |a| a.trace.depth_m),
        word("abort", |a| a.trace.abort.map_or_else(|| "none".to_owned(), |abort| format!("{abort:?}"))),
        word("degradations", |a| degraded(flags(&a.trace)).join(", ")),
        word("phase", |a| format!("{:?}", a.trace.phase)),
        word("dives completed", |a| a.trace.dives.to_string()),
        number("angle of attack estimated", "°", DEGREE, |a| a.trace.alpha_rad),
        number("speed estimated", "m/s", 1.0, |a| a.trace.speed_m_s),
        number("glide angle estimated", "°", DEGREE, |a| a.trace.glide_angle_rad),
        number("pitch aimed at", "°", DEGREE, |a| a.trace.pitch_setpoint_rad),
        number("ballast ordered", "cm³", 1e-6, |a| a.command.ballast_m3),
        number("battery position ordered", "mm", 1e-3, |a| a.command.battery_mass_m),
        number("fin ordered", "°", DEGREE, |a| a.command.fin_rad),
        word("drop weight", |a| if a.command.drop_weight { "fired" } else { "held" }.to_owned()),
        word("beacon", |a| if a.command.beacon { "on" } else { "off" }.to_owned()),
    ]
};

/// Degradations that the law finds. That a log is full is not its doing.
const fn flags(trace: &Trace) -> Flags {
    Flags(trace.flags.0 & !Flags::LOG_FULL.0)
}

/// A signal that differs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Its name.
    pub signal: &'static str,
    /// As recorded.
    pub recorded: String,
    /// As this law says.
    pub replayed: String,
}

impl Difference {
    /// One clause.
    #[must_use]
    pub fn words(&self) -> String {
        let Self { signal, recorded, replayed } = self;
        let shown = |s: &String| if s.is_empty() { "none".to_owned() } else { s.clone() };
        format!("{signal}: {} recorded, {} with this law", shown(recorded), shown(replayed))
    }
}

/// Signals that differ by a bit, from cause to effect.
#[must_use]
pub fn differences(recorded: &Answer, replayed: &Answer) -> Vec<Difference> {
    let all = SIGNALS.iter().filter_map(|signal| {
        let (recorded, replayed) = match signal.value {
            Value::Number(of) => {
                let (a, b) = (of(recorded), of(replayed));
                (a.to_bits() != b.to_bits()).then(|| (number(a, b, signal.unit), number(b, a, signal.unit)))?
            }
            Value::Word(of) => Some((of(recorded), of(replayed))).filter(|(a, b)| a != b)?,
        };
        Some(Difference { signal: signal.name, recorded, replayed })
    });
    all.collect()
}

/// A number with as many digits as it takes to see that it is not the other.
fn number(value: f32, other: f32, (unit, size): (&str, f64)) -> String {
    let shown = |x: f32, digits: usize| format!("{:.digits$} {unit}", f64::from(x) / size);
    let digits = (3..12).find(|d| shown(value, *d) != shown(other, *d)).unwrap_or(12);
    shown(value, digits)
}

/// Whether all orders to actuators are the same, bit for bit.
#[must_use]
pub fn same_orders(a: &Answer, b: &Answer) -> bool {
    let bits = |x: &Answer| [x.command.ballast_m3, x.command.battery_mass_m, x.command.fin_rad].map(f32::to_bits);
    bits(a) == bits(b) && (a.command.drop_weight, a.command.beacon) == (b.command.drop_weight, b.command.beacon)
}

/// What an abort says.
#[must_use]
pub const fn cause(abort: Abort) -> &'static str {
    match abort {
        Abort::OverDepth => "deeper than the working depth allows",
        Abort::Leak => "the leak detector",
        Abort::Vacuum => "the hull's vacuum was lost",
        Abort::Undervoltage => "the battery's voltage was below its limit",
        Abort::LowCharge => "the charge was below its reserve",
        Abort::OverTime => "the mission took longer than allowed",
        Abort::NoComms => "no word from shore for too long",
        Abort::StuckDepth => "the depth did not change though it must",
        Abort::Stalled => "ordered to rise, it did not rise",
        Abort::SensorDepth => "no believable depth",
        Abort::SensorPitch => "no believable pitch for too long",
        Abort::NoHeading => "no believable heading",
        Abort::BallastFeedback => "no believable pump position",
        Abort::PumpStuck => "the pump did not follow",
        Abort::MassStuck => "the battery mass did not follow",
        Abort::FinStuck => "the fin did not follow, or the vehicle spiralled",
        Abort::Reset => "started after a reset during a mission",
        Abort::LinkLost => "the line, or the sensors as a whole, went silent",
        Abort::BadMission => "the mission or the configuration is not usable",
        Abort::Internal => "a number of the law was not finite or not consistent",
        Abort::Operator => "ordered by the operator",
        Abort::Overrun => "control cycles overran again and again",
        Abort::Degraded => "the vehicle flew worse than its table",
        Abort::Bottom => "the bottom was nearer than allowed again and again",
        _ => "an abort of a later release",
    }
}

/// What a watch of the law that is broken like this is there for.
#[must_use]
pub fn watch(mutant: Mutant) -> String {
    let (Mutant::Blind(watch) | Mutant::Slow(watch)) = mutant;
    let name = format!("{watch:?}");
    let how = if matches!(mutant, Mutant::Blind(_)) { "does not act" } else { "waits longer" };
    format!("{name} ({}) {how}", watch.words().trim_end_matches('.'))
}

//! What a board says on deck, held against what a launch needs.

use control::Config;
use signals::{Preflight, Reading, Strap, Stroke, Switch, Weight};

/// Air pressures on deck or afloat, Pa: from a lake at 5,500 m to the highest ever measured at sea.
const DECK_AIR_PA: std::ops::RangeInclusive<f32> = 50_000.0..=109_000.0;
/// Oldest sentence of a compass that speaks, ms.
const FRESH_MS: u32 = 1_500;
/// Steepest attitude on deck or afloat, rad: a glider afloat hangs nose down.
const STEEP_RAD: f32 = 1.2;
/// Voltage above the undervoltage limit with which a mission may begin, V: what a pump takes away under load.
const SPARE_V: f32 = 0.5;
/// Charge above the reserve with which a mission may begin.
const SPARE_CHARGE: f32 = 0.1;
/// Shares of the time that a stroke should take within which it is sound.
const STROKE: std::ops::RangeInclusive<f32> = 0.6..=1.4;
/// Share of sentences that may be damaged.
const DAMAGED: f32 = 0.05;
/// Difference of two clocks, of the time passed.
const CLOCK: f64 = 0.02;

/// One line of the check.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Item {
    /// What is looked at.
    pub what: &'static str,
    /// As it should be.
    pub good: bool,
    /// What was found, and what is wrong with it.
    pub found: String,
}

fn item(what: &'static str, good: bool, found: String) -> Item {
    Item { what, good, found }
}

fn value(reading: Reading) -> Option<f32> {
    match reading {
        Reading::Sampled { value, .. } if value.is_finite() => Some(value),
        _ => None,
    }
}

/// A reading within a range, in words.
fn within(what: &'static str, reading: Reading, range: std::ops::RangeInclusive<f32>, show: impl Fn(f32) -> String) -> Item {
    match value(reading) {
        None => item(what, false, "no reading: look at its cable and supply".to_owned()),
        Some(v) if range.contains(&v) => item(what, true, show(v)),
        Some(v) => item(what, false, format!("{}, not within {} to {}", show(v), show(*range.start()), show(*range.end()))),
    }
}

fn stroke(what: &'static str, stroke: Stroke, rate: f32, show: impl Fn(f32) -> String) -> Item {
    match stroke {
        Stroke::Never => item(what, false, "not moved yet".to_owned()),
        Stroke::UnderWay => item(what, false, "still moving".to_owned()),
        Stroke::Failed => {
            item(what, false, "did not come to its end: is it plugged, and the configuration that of this vehicle?".to_owned())
        }
        Stroke::Done { seconds, way } => {
            let due_s = way / rate;
            let good = STROKE.contains(&(seconds / due_s));
            item(what, good, format!("{} in {seconds:.1} s, {due_s:.1} s due by the configuration", show(way)))
        }
    }
}

/// All lines. `clock`: seconds by the board and by this computer between two checks; none: not compared.
#[must_use]
pub fn judge(p: &Preflight, config: &Config, clock: Option<(f64, f64)>) -> Vec<Item> {
    let f = &p.frame;
    let age_ms = match f.pitch_rad {
        Reading::Sampled { age_ms, .. } => Some(age_ms),
        Reading::Missing => None,
    };
    let degrees = |rad: f32| format!("{:.1}°", rad.to_degrees());
    let (whole, refused) = p.sentences;
    let mut items = vec![
        match p.strap {
            Strap::Deployment => item("strap", true, "taken out: own sensors".to_owned()),
            Strap::None => item("strap", true, "none on this board".to_owned()),
            Strap::Bench => item("strap", false, "fitted: this board is on a bench; take it out for a deployment".to_owned()),
            Strap::Backseat => item("strap", false, "a Slocum's backseat: the glider begins its mission; see docs/backseat.md".to_owned()),
        },
        within("air pressure", p.pressure_pa, DECK_AIR_PA, |pa| format!("{:.1} hPa", pa / 100.0)),
        match age_ms {
            Some(age) if age <= FRESH_MS => item("compass", true, format!("{whole} sentences, the last {age} ms ago, {refused} damaged")),
            Some(age) => item("compass", false, format!("silent for {:.1} s", f64::from(age) * 1e-3)),
            None => item("compass", false, "silent: look at its cable and that it speaks at 19,200 baud".to_owned()),
        },
        within("pitch", f.pitch_rad, -STEEP_RAD..=STEEP_RAD, degrees),
        within("roll", f.roll_rad, -STEEP_RAD..=STEEP_RAD, degrees),
        within("heading", f.heading_rad, 0.0..=std::f32::consts::TAU, degrees),
        within("battery", f.battery_v, config.undervoltage_v + SPARE_V..=36.0, |v| format!("{v:.2} V")),
        within("charge", f.charge, config.reserve_charge + SPARE_CHARGE..=1.0, |c| format!("{:.0} %", 100.0 * c)),
        within("hull vacuum", f.vacuum_pa, 15e3..=config.vacuum_max_pa, |pa| format!("{:.1} kPa", pa / 1000.0)),
        match f.leak {
            Switch::Clear => item("leak loop", true, "dry".to_owned()),
            Switch::Alarm => item("leak loop", false, "WET".to_owned()),
            Switch::Unknown => item("leak loop", false, "broken: no resistor at its end is seen".to_owned()),
        },
        match f.weight {
            Weight::Held => item("drop weight", true, "its wire is whole".to_owned()),
            Weight::Released => item("drop weight", false, "its wire is broken: fit a new one".to_owned()),
            Weight::Unknown => item("drop weight", false, "not monitored".to_owned()),
        },
        stroke("pump", p.pump, config.pump_rate_m3_s, |m3| format!("{:.0} cc", m3 * 1e6)),
        stroke("battery mass", p.mass, config.battery_rate_m_s, |m| format!("{:.1} mm", m * 1e3)),
        match p.log_bytes {
            0 => item("log", false, "no flash: nothing is kept over a power cut".to_owned()),
            n => item("log", true, format!("{} KiB on flash, the oldest overwritten", n / 1024)),
        },
    ];
    if whole > 0
        && refused as f32 > DAMAGED * whole as f32
        && let Some(line) = items.iter_mut().find(|i| i.what == "compass")
    {
        (line.good, line.found) = (false, format!("{refused} of {} sentences damaged: a noisy line", whole + refused));
    }
    if let Some((board_s, here_s)) = clock {
        let off = board_s / here_s - 1.0;
        let good = off.abs() <= CLOCK;
        items.push(item("clock", good, format!("{:+.2} % against this computer in {here_s:.0} s", 100.0 * off)));
    }
    items
}

#[cfg(test)]
mod tests {
    use super::*;
    use signals::{Micros, SensorFrame};

    fn sound() -> Preflight {
        Preflight {
            number: 3,
            frame: SensorFrame {
                time: Micros::from_secs(100),
                pitch_rad: Reading::Sampled { value: 0.02, age_ms: 150 },
                roll_rad: Reading::now(0.0),
                heading_rad: Reading::now(1.0),
                battery_v: Reading::now(15.1),
                charge: Reading::now(1.0),
                vacuum_pa: Reading::now(77_600.0),
                leak: Switch::Clear,
                weight: Weight::Held,
                ..SensorFrame::default()
            },
            pressure_pa: Reading::now(101_300.0),
            pump: Stroke::Done { seconds: 16.0, way: 208e-6 },
            mass: Stroke::Done { seconds: 16.0, way: 0.0406 },
            strap: Strap::Deployment,
            log_bytes: 1 << 24,
            sentences: (500, 1),
        }
    }

    #[test]
    fn a_sound_vehicle_passes_and_each_thing_wrong_is_named() {
        let config = Config::default();
        let bad =
            |p: Preflight| judge(&p, &config, Some((10.0, 10.05))).into_iter().filter(|i| !i.good).map(|i| i.what).collect::<Vec<_>>();
        assert_eq!(bad(sound()), [""; 0]);
        let frame = sound().frame;
        let nan = Reading::now(f32::NAN);
        for (p, what) in [
            (Preflight { strap: Strap::Bench, ..sound() }, "strap"),
            (Preflight { pressure_pa: Reading::now(2e6), ..sound() }, "air pressure"),
            (Preflight { pressure_pa: nan, ..sound() }, "air pressure"),
            (Preflight { sentences: (50, 30), ..sound() }, "compass"),
            (Preflight { pump: Stroke::Failed, ..sound() }, "pump"),
            // The pump of another vehicle: 100 m, 32 cc/s.
            (Preflight { pump: Stroke::Done { seconds: 6.5, way: 208e-6 }, ..sound() }, "pump"),
            (Preflight { mass: Stroke::Never, ..sound() }, "battery mass"),
            (Preflight { log_bytes: 0, ..sound() }, "log"),
            (Preflight { frame: SensorFrame { leak: Switch::Unknown, ..frame }, ..sound() }, "leak loop"),
            (Preflight { frame: SensorFrame { weight: Weight::Released, ..frame }, ..sound() }, "drop weight"),
            (Preflight { frame: SensorFrame { battery_v: Reading::now(10.2), ..frame }, ..sound() }, "battery"),
            (Preflight { frame: SensorFrame { charge: Reading::Missing, ..frame }, ..sound() }, "charge"),
            (Preflight { frame: SensorFrame { vacuum_pa: Reading::now(101_000.0), ..frame }, ..sound() }, "hull vacuum"),
            (Preflight { frame: SensorFrame { heading_rad: nan, ..frame }, ..sound() }, "heading"),
        ] {
            assert_eq!(bad(p), [what]);
        }
        let slow = judge(&sound(), &config, Some((10.5, 10.0)));
        assert_eq!(slow.iter().filter(|i| !i.good).map(|i| i.what).collect::<Vec<_>>(), ["clock"]);
        assert_eq!(judge(&sound(), &config, Some((10.0, 0.0))).iter().filter(|i| !i.good).count(), 1, "no time is no comparison");
    }
}

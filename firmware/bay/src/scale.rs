//! What the configuration means at pots and motors: ranges, rates, times.
//!
//! Pump and battery mass are those of the mission's configuration, so that an
//! uploaded one reaches every pin; only the electronics are the board's own.

use control::config::Settings;
use devices::motor::Limits;
use signals::Switch;

/// Voltage of a pot over the whole stroke, V: 3.3 V through end resistors (guess until there is a board).
const POT_V: (f32, f32) = (0.2, 3.1);
/// Share of the stroke that a pot may show beyond either end.
const BEYOND: f32 = 0.05;
/// Leak loop, V: dry at 2.5 with its resistor at the end, pulled down by water, up to the supply where it is broken (guesses).
const LEAK_WET_V: f32 = 2.0;
const LEAK_BROKEN_V: f32 = 2.9;
/// Pump: dead band and least motion, m³: five times the noise of its pot. A law that waits for 12 cc is content with 2.
const PUMP_DEAD_M3: f32 = 2e-6;
const PUMP_MOTION_M3: f32 = 1.5e-6;
/// Battery mass: least motion, m.
const MASS_MOTION_M: f32 = 0.3e-3;
/// Least time without motion after which a motor is given up, s: two cycles, the time after which the law looks for another way. A
/// motor that stops for a few seconds and goes on is no lost one.
const STALL_S: f32 = 8.0;

/// Ranges and limits of what is fitted.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// Pump range either side of the middle, m³.
    pub pump_m3: f32,
    /// Battery mass range either side of the middle, m.
    pub mass_m: f32,
    /// Pump motor.
    pub pump: Limits,
    /// Battery mass motor.
    pub mass: Limits,
}

impl Scale {
    /// Of a configuration.
    #[must_use]
    pub fn of(settings: &Settings) -> Self {
        let motor =
            |dead_band, least_motion, rate, range: f32| Limits { dead_band, least_motion, rate, stroke: 2.0 * range, stall_s: STALL_S };
        Self {
            pump_m3: settings.pump_m3,
            mass_m: settings.battery_m,
            pump: motor(PUMP_DEAD_M3, PUMP_MOTION_M3, settings.pump_rate_m3_s, settings.pump_m3),
            mass: motor(settings.battery_deadband_m, MASS_MOTION_M, settings.battery_rate_m_s, settings.battery_m),
        }
    }
}

/// Position of a pot over a stroke of `range` either side of the middle; none: beyond its ends, a broken wire.
#[must_use]
pub fn position(volts: f32, range: f32) -> Option<f32> {
    let share = (volts - POT_V.0) / (POT_V.1 - POT_V.0);
    (-BEYOND..=1.0 + BEYOND).contains(&share).then_some((2.0 * share - 1.0) * range)
}

/// What the leak loop says.
#[must_use]
pub fn leak(volts: Option<f32>) -> Switch {
    match volts {
        Some(v) if v < LEAK_WET_V => Switch::Alarm,
        Some(v) if v < LEAK_BROKEN_V => Switch::Clear,
        _ => Switch::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::{Scale, leak, position};
    use control::Settings;
    use signals::Switch;

    #[test]
    fn a_leak_loop_that_is_broken_is_not_dry() {
        assert_eq!([Some(0.6), Some(2.5), Some(3.3), None].map(leak), [Switch::Alarm, Switch::Clear, Switch::Unknown, Switch::Unknown]);
    }

    #[test]
    fn every_pump_has_its_own_stroke_and_time() {
        for settings in [Settings::slocum_100(), Settings::slocum_200(), Settings::slocum_1000()] {
            let scale = Scale::of(&settings);
            assert_eq!(position(3.1, scale.pump_m3).map(|p| (p * 1e9).round()), Some((settings.pump_m3 * 1e9).round()));
            let stroke_s = scale.pump.stroke / scale.pump.rate;
            let expected_s = 2.0 * settings.pump_m3 / settings.pump_rate_m3_s;
            assert!((stroke_s - expected_s).abs() < 0.01, "{stroke_s} s: the deep pump takes 131 s");
            assert_eq!((position(0.0, scale.pump_m3), position(3.3, scale.pump_m3)), (None, None), "a broken wire");
            assert_eq!(position(f32::NAN, 1.0), None);
        }
    }
}

//! What no uploaded configuration may cross: limits of each class of vehicle.
//!
//! [`control::Config::new`] says which settings the law can fly with; this says which ones the vehicle survives. A class is told by
//! its pump, the one part that differs between them. In hardware in the loop every class may be flown; on the vehicle's own sensors
//! only the one whose vehicle the board is built into ([`check_own`]).

use control::Settings;
use core::ops::RangeInclusive;
use signals::messages::Limit;

/// A class of vehicle.
struct Class {
    built: Settings,
    /// Rate of its pump, m³/s: 32, 13 and 4 cc/s, and what lies nearest.
    pump_rate_m3_s: RangeInclusive<f32>,
}

const CLASSES: [Class; 3] = [
    Class { built: Settings::slocum_100(), pump_rate_m3_s: 20e-6..=64e-6 },
    Class { built: Settings::slocum_200(), pump_rate_m3_s: 8e-6..=19.999e-6 },
    Class { built: Settings::slocum_1000(), pump_rate_m3_s: 2e-6..=7.999e-6 },
];

/// A setting beyond its limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Excess {
    /// Which limit.
    pub limit: Limit,
    /// The setting's name.
    pub key: &'static str,
    /// What its class allows.
    pub allowed: RangeInclusive<f32>,
}

fn class_of(settings: &Settings) -> Result<&'static Class, Excess> {
    let rate = settings.pump_rate_m3_s;
    let found = CLASSES.iter().find(|class| class.pump_rate_m3_s.contains(&rate));
    found.ok_or(Excess { limit: Limit::Class, key: "pump_rate_m3_s", allowed: 2e-6..=64e-6 })
}

/// Refuses what no vehicle of its class may be told.
///
/// # Errors
/// The first setting beyond its limit.
pub fn check(settings: &Settings) -> Result<(), Excess> {
    let s = settings;
    let built = &class_of(s)?.built;
    // Limits without a source are guesses, made so that every watch still acts before the vehicle is lost.
    let limits: [(Limit, &'static str, f32, RangeInclusive<f32>); 11] = [
        (Limit::WorkingDepth, "working_depth_m", s.working_depth_m, 10.0..=built.working_depth_m),
        (Limit::CrushDepth, "crush_depth_m", s.crush_depth_m, 20.0..=built.crush_depth_m),
        (Limit::Pump, "pump_m3", s.pump_m3, 20e-6..=1.1 * built.pump_m3),
        (Limit::ReleaseTime, "release_time_s", s.release_time_s, 0.5 * built.release_time_s..=1200.0),
        (Limit::Burn, "min_burn_s", s.min_burn_s, 60.0..=2.0 * built.min_burn_s),
        (Limit::Burn, "max_burn_s", s.max_burn_s, 60.0..=2.0 * built.max_burn_s),
        // 15 V of alkaline cells are empty at 9 V.
        (Limit::Undervoltage, "undervoltage_v", s.undervoltage_v, 9.0..=60.0),
        (Limit::Reserve, "reserve_charge", s.reserve_charge, 0.05..=0.9),
        // 1 atm less 2 inHg: half of the stock vacuum.
        (Limit::Vacuum, "vacuum_max_pa", s.vacuum_max_pa, 10e3..=94.6e3),
        // In whole numbers below; here for its message.
        (Limit::NoComms, "no_comms_s", s.no_comms_s as f32, 600.0..=7.0 * 86_400.0),
        (Limit::CommsPatience, "comms_patience_s", s.comms_patience_s, 10.0..=4.0 * built.comms_patience_s),
    ];
    for (limit, key, value, allowed) in limits {
        // NaN is within nothing.
        if !allowed.contains(&value) {
            return Err(Excess { limit, key, allowed });
        }
    }
    Ok(())
}

/// The same for a mission on the vehicle's own sensors: of the class that is built in.
///
/// # Errors
/// The first setting beyond its limit.
pub fn check_own(settings: &Settings, built_in: &Settings) -> Result<(), Excess> {
    check(settings)?;
    let (asked, own) = (class_of(settings)?, class_of(built_in)?);
    if asked.pump_rate_m3_s == own.pump_rate_m3_s {
        return Ok(());
    }
    Err(Excess { limit: Limit::Class, key: "pump_rate_m3_s", allowed: own.pump_rate_m3_s.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_vehicles_are_within_and_a_removed_interlock_is_refused() {
        let d = Settings::slocum_200();
        for built in [Settings::slocum_100(), d, Settings::slocum_1000()] {
            assert_eq!(check(&built), Ok(()));
        }
        for (bad, limit) in [
            (Settings { pump_rate_m3_s: 1e-6, ..d }, Limit::Class),
            (Settings { working_depth_m: 1000.0, ..d }, Limit::WorkingDepth),
            (Settings { crush_depth_m: 9000.0, ..d }, Limit::CrushDepth),
            (Settings { pump_m3: 300e-6, ..d }, Limit::Pump),
            (Settings { release_time_s: 0.1, ..d }, Limit::ReleaseTime),
            (Settings { max_burn_s: 86_400.0, ..d }, Limit::Burn),
            (Settings { undervoltage_v: 0.0, ..d }, Limit::Undervoltage),
            (Settings { reserve_charge: 0.0, ..d }, Limit::Reserve),
            (Settings { vacuum_max_pa: 101.3e3, ..d }, Limit::Vacuum),
            (Settings { no_comms_s: u32::MAX, ..d }, Limit::NoComms),
            (Settings { comms_patience_s: 86_400.0, ..d }, Limit::CommsPatience),
            (Settings { crush_depth_m: f32::NAN, ..d }, Limit::CrushDepth),
        ] {
            assert_eq!(check(&bad).map_err(|e| e.limit), Err(limit));
        }
    }

    #[test]
    fn on_its_own_sensors_a_vehicle_keeps_its_class() {
        let (own, deep) = (Settings::slocum_200(), Settings::slocum_1000());
        assert_eq!(check(&deep), Ok(()));
        assert_eq!(check_own(&deep, &own).map_err(|e| e.limit), Err(Limit::Class));
        assert_eq!(check_own(&own, &own), Ok(()));
    }
}

//! What does not change in flight: vehicle, actuators, limits, gains.
//!
//! [`Settings`] is the plain data (what a file or an upload holds);
//! [`Config`] is the same data after [`Config::new`] has checked it, and the
//! only form the law accepts.

use crate::bound::Bound;
use serde::{Deserialize, Serialize};

/// Trim law of the vehicle: tan(pitch) = `per_ballast_m3` V_b + `per_battery_m` x_b + `offset`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrimLaw {
    /// T1, 1/m³: 1235..2013 in four published trim fits, 1785 the one in the middle.
    pub per_ballast_m3: f32,
    /// T2, 1/m, negative (mass forward, nose down): −28.8..−23.9 in the same fits.
    pub per_battery_m: f32,
    /// T3, 1: 0.09..0.25 in fits of vehicles as found; 0 for one trimmed level at neutral. Learned in flight.
    pub offset: f32,
}

/// What a pitch reading means: true pitch = `per_reading` × (reading − `zero_rad`). Found by a tilt table or by the workbench.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PitchSensor {
    /// Reading on the level, rad.
    pub zero_rad: f32,
    /// True pitch per reading, 1: 0.87 in a public flight of a Slocum.
    pub per_reading: f32,
}

impl PitchSensor {
    /// True pitch of a reading, rad, within a quarter turn.
    pub(crate) fn true_rad(self, reading: f32) -> f32 {
        (self.per_reading * (reading - self.zero_rad)).at_least(-1.6).at_most(1.6)
    }
}

/// What the hull displaces and weighs: the law does not fly by it, its report to the shore judges the glides by it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hull {
    /// Mass, kg.
    pub mass_kg: f32,
    /// Volume at the surface and the reference temperature with the pump in its middle, m³.
    pub volume_m3: f32,
    /// Compressibility, 1/Pa.
    pub compressibility_per_pa: f32,
    /// Thermal expansion of the volume, 1/K.
    pub expansion_per_k: f32,
    /// Temperature of that volume, °C.
    pub reference_degc: f32,
}

/// Vehicle, limits and gains, unchecked.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Deepest depth a mission may ask for, m.
    pub working_depth_m: f32,
    /// Depth at which the hull fails, m. 1.25 × working depth: a guess standing for the proof test.
    pub crush_depth_m: f32,
    /// Pump range either side of neutral, m³.
    pub pump_m3: f32,
    /// Pump rate, m³/s: 32e-6 (100 m), 13e-6 (200 m), 4e-6 (deep); public Slocum model files.
    pub pump_rate_m3_s: f32,
    /// Battery mass range either side of the middle, m: ±1.0 in (100 m), ±1.4 in (deep), ±1.65 in (extended).
    pub battery_m: f32,
    /// Battery mass rate, m/s: 0.1 in/s.
    pub battery_rate_m_s: f32,
    /// Battery mass is not moved for less than this, m: spares the motor; 0.5 mm is 0.7° of pitch.
    pub battery_deadband_m: f32,
    /// Fin range either side, rad: 0.45 in public Slocum model files.
    pub fin_rad: f32,
    /// Nominal control cycle, s: 4 (4.3 observed in real logs).
    pub cycle_s: f32,
    /// Trim law.
    pub trim: TrimLaw,
    /// |pitch| flown without a usable table, rad: 26°, the stock mission default.
    pub preset_pitch_rad: f32,
    /// Angle of attack aimed at over that of the best glide. Below 1 is the side away from the stall; at 0.92 the loss of L/D is
    /// 0.35 %. A vehicle with a pitch below which no steady glide exists has that pitch 1° to 2° below the best one.
    pub alpha_share: f32,
    /// C_D/C_L of the vehicle over that of the table for which the first pitch is chosen, 1; flight takes it from there. With 1.05
    /// (and `alpha_share` 0.92) a vehicle with 15 % more drag than its table still glides at the first pitch.
    pub table_uncertainty: f32,
    /// Learn drag without lift and drag due to lift apart, from the second and third dive of a mission flown 8° steeper, and choose the
    /// pitch without the margin of `alpha_share` after the first (best-glide alone). Off in every built-in vehicle: the two dives fall
    /// short of the others, and water that moves by 4 mm/s costs most of what is gained.
    pub learns_levels: bool,
    /// Fin per heading error, rad/rad.
    pub heading_gain: f32,
    /// Turn when the bottom is nearer than this, m.
    pub min_altitude_m: f32,
    /// Time from firing the release to the weight being gone, s: burn wire, 120 s (public pilot guide's example).
    pub release_time_s: f32,
    /// Below working depth, or with a failed pump: weight dropped after this time without rising, s.
    pub min_burn_s: f32,
    /// Above working depth: weight dropped after this time without rising, s (same-depth limit of stock missions, 1800 s).
    pub max_burn_s: f32,
    /// Battery voltage below which the vehicle comes home, V: 10 (stock default).
    pub undervoltage_v: f32,
    /// Charge below which the vehicle comes home, 0..1: 0.10 (stock default).
    pub reserve_charge: f32,
    /// Internal pressure above which the hull vacuum counts as lost, Pa: 1 atm less 4 inHg (stock default).
    pub vacuum_max_pa: f32,
    /// Longest time without word from shore, s: 72 h (stock default).
    pub no_comms_s: u32,
    /// Longest wait on the surface for fix and shore, s.
    pub comms_patience_s: f32,
    /// Pitch sensor.
    pub pitch_sensor: PitchSensor,
    /// Hull: of `vehicles/modena.toml`, guesses there; each vehicle has its own.
    pub hull: Hull,
}

impl Settings {
    /// Slocum with the 200 m pump: ±236 cc, 13 cc/s. Battery ±1.65 in is the extended unit's; ±1.0 in is assumed here.
    #[must_use]
    pub const fn slocum_200() -> Self {
        Self {
            working_depth_m: 200.0,
            crush_depth_m: 250.0,
            pump_m3: 236e-6,
            pump_rate_m3_s: 13e-6,
            battery_m: 0.0254,
            battery_rate_m_s: 2.54e-3,
            battery_deadband_m: 0.4e-3,
            fin_rad: 0.45,
            cycle_s: 4.0,
            trim: TrimLaw { per_ballast_m3: 1785.0, per_battery_m: -24.0, offset: 0.0 },
            preset_pitch_rad: 0.4538,
            alpha_share: 0.92,
            table_uncertainty: 1.05,
            learns_levels: false,
            heading_gain: 0.3,
            min_altitude_m: 3.0,
            release_time_s: 120.0,
            min_burn_s: 600.0,
            max_burn_s: 1800.0,
            undervoltage_v: 10.0,
            reserve_charge: 0.10,
            vacuum_max_pa: 87.8e3,
            no_comms_s: 72 * 3600,
            comms_patience_s: 900.0,
            pitch_sensor: PitchSensor { zero_rad: 0.0, per_reading: 1.0 },
            hull: Hull {
                mass_kg: 70.0,
                volume_m3: 0.068_222_5,
                compressibility_per_pa: 5e-10,
                expansion_per_k: 5e-5,
                reference_degc: 20.4,
            },
        }
    }

    /// Slocum with the 100 m pump: ±230 cc, 32 cc/s, battery ±1.0 in.
    #[must_use]
    pub const fn slocum_100() -> Self {
        Self { working_depth_m: 100.0, crush_depth_m: 125.0, pump_m3: 230e-6, pump_rate_m3_s: 32e-6, ..Self::slocum_200() }
    }

    /// Deep Slocum: ±263 cc, 4 cc/s, battery ±1.4 in.
    #[must_use]
    pub const fn slocum_1000() -> Self {
        Self {
            working_depth_m: 1000.0,
            crush_depth_m: 1250.0,
            pump_m3: 263e-6,
            pump_rate_m3_s: 4e-6,
            battery_m: 0.03556,
            ..Self::slocum_200()
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self::slocum_200()
    }
}

/// Which setting is outside what the law was written for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ConfigError {
    /// This setting is not finite or not in its range.
    Setting(&'static str),
}

/// Checked settings; reads like [`Settings`].
#[derive(Clone, Debug, PartialEq)]
pub struct Config(Settings);

impl Config {
    /// Checks every setting.
    ///
    /// # Errors
    /// Names the first setting that is refused.
    pub fn new(settings: Settings) -> Result<Self, ConfigError> {
        let s = &settings;
        let checks: [(&'static str, f32, core::ops::RangeInclusive<f32>); 31] = [
            ("working_depth_m", s.working_depth_m, 10.0..=6000.0),
            ("crush_depth_m", s.crush_depth_m, s.working_depth_m + 10.0..=9000.0),
            ("pump_m3", s.pump_m3, 20e-6..=2000e-6),
            ("pump_rate_m3_s", s.pump_rate_m3_s, 0.5e-6..=200e-6),
            ("battery_m", s.battery_m, 1e-3..=0.2),
            ("battery_rate_m_s", s.battery_rate_m_s, 0.1e-3..=50e-3),
            ("battery_deadband_m", s.battery_deadband_m, 0.0..=s.battery_m),
            ("fin_rad", s.fin_rad, 0.01..=0.8),
            ("cycle_s", s.cycle_s, 0.05..=20.0),
            ("trim.per_ballast_m3", s.trim.per_ballast_m3, 100.0..=10_000.0),
            ("trim.per_battery_m", s.trim.per_battery_m, -200.0..=-2.0),
            ("trim.offset", s.trim.offset, -0.5..=0.5),
            ("preset_pitch_rad", s.preset_pitch_rad, 0.1..=0.8),
            ("alpha_share", s.alpha_share, 0.5..=1.0),
            ("table_uncertainty", s.table_uncertainty, 1.0..=2.0),
            ("heading_gain", s.heading_gain, 0.0..=3.0),
            ("min_altitude_m", s.min_altitude_m, 0.0..=100.0),
            ("release_time_s", s.release_time_s, 0.1..=1200.0),
            ("min_burn_s", s.min_burn_s, 10.0..=7200.0),
            ("max_burn_s", s.max_burn_s, s.min_burn_s..=86_400.0),
            ("undervoltage_v", s.undervoltage_v, 0.0..=60.0),
            ("reserve_charge", s.reserve_charge, 0.0..=0.9),
            ("vacuum_max_pa", s.vacuum_max_pa, 10e3..=101.3e3),
            ("comms_patience_s", s.comms_patience_s, 10.0..=86_400.0),
            ("pitch_sensor.zero_rad", s.pitch_sensor.zero_rad, -0.25..=0.25),
            ("pitch_sensor.per_reading", s.pitch_sensor.per_reading, 0.5..=2.0),
            ("hull.mass_kg", s.hull.mass_kg, 5.0..=500.0),
            ("hull.volume_m3", s.hull.volume_m3, 0.005..=0.5),
            ("hull.compressibility_per_pa", s.hull.compressibility_per_pa, 0.0..=5e-9),
            ("hull.expansion_per_k", s.hull.expansion_per_k, -1e-3..=1e-3),
            ("hull.reference_degc", s.hull.reference_degc, -5.0..=40.0),
        ];
        for (name, value, range) in checks {
            if !value.is_finite() || !range.contains(&value) {
                return Err(ConfigError::Setting(name));
            }
        }
        if s.no_comms_s < 600 {
            return Err(ConfigError::Setting("no_comms_s"));
        }
        Ok(Self(settings))
    }

    /// The vehicle whose working depth covers `depth_m`: 200 m Slocum, else deep Slocum.
    #[must_use]
    pub const fn for_depth(depth_m: f32) -> Self {
        if depth_m > 200.0 { Self(Settings::slocum_1000()) } else { Self(Settings::slocum_200()) }
    }

    /// Half way from working to crush depth, m: no farther down may a depth be that is not known.
    pub(crate) fn deepest_m(&self) -> f32 {
        0.5 * (self.0.working_depth_m + self.0.crush_depth_m)
    }

    /// The settings as plain data.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.0
    }
}

impl Default for Config {
    /// The 200 m Slocum; a test holds it against [`Config::new`].
    fn default() -> Self {
        Self(Settings::slocum_200())
    }
}

impl core::ops::Deref for Config {
    type Target = Settings;

    fn deref(&self) -> &Settings {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::{Config, ConfigError, Settings};

    #[test]
    fn built_in_vehicles_are_valid_absurd_settings_are_refused_by_name() {
        for s in [Settings::slocum_200(), Settings::slocum_100(), Settings::slocum_1000()] {
            assert_eq!(Config::new(s), Ok(Config(s)));
        }
        let d = Settings::default();
        for (bad, name) in [
            (Settings { cycle_s: 0.0, ..d }, "cycle_s"),
            (Settings { pump_rate_m3_s: f32::NAN, ..d }, "pump_rate_m3_s"),
            (Settings { crush_depth_m: 150.0, ..d }, "crush_depth_m"),
            (Settings { heading_gain: f32::INFINITY, ..d }, "heading_gain"),
            (Settings { no_comms_s: 0, ..d }, "no_comms_s"),
        ] {
            assert_eq!(Config::new(bad), Err(ConfigError::Setting(name)));
        }
    }
}

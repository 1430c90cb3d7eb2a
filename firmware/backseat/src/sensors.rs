//! The list of sensors we expect: what each index means, its unit, and which values are believed.
//!
//! The same list makes the glider's `extctl.ini` and judges the one that is read from it.

use crate::ini::Section;

/// Which software the glider runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Generation {
    /// Parameters stand among the outputs; file blocks come unasked; 32 sensors.
    Older,
    /// Parameters have a section of their own; the next block comes after `GO`; 64 sensors.
    #[default]
    Newer,
}

/// Which buoyancy engine the glider has: it decides which sensor tells the volume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pump {
    /// Piston of the shallow vehicles.
    #[default]
    Shallow,
    /// Oil pump of the deep ones.
    Deep,
}

/// Sensors of the list, in its order: the discriminant is the index.
#[allow(missing_docs)] // each is named as in the list below
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Sensor {
    Ballast = 14,
    Time = 8,
    Depth = 9,
    Pressure = 10,
    Pitch = 11,
    Roll = 12,
    Heading = 13,
    BatteryMass = 15,
    Fin = 16,
    Temperature = 17,
    Conductivity = 18,
    Altitude = 19,
    AltimeterStatus = 20,
    Voltage = 21,
    Charge = 22,
    Vacuum = 23,
    Leak = 24,
    LeakForward = 25,
    LeakScience = 26,
    WeightDrop = 27,
    GpsStatus = 28,
    Console = 29,
    Iridium = 30,
    GliderDos = 31,
    EchoBallast = 32,
    EchoMass = 33,
    EchoFin = 34,
    EchoDive = 35,
    EchoClimb = 36,
    BallastMax = 37,
    MassMax = 38,
    FinMax = 39,
}

impl Sensor {
    /// Its index on the line.
    #[must_use]
    pub const fn index(self) -> u16 {
        self as u16
    }
}

/// Which values of a sensor are believed, in the glider's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gate {
    /// Least.
    pub low: f32,
    /// Largest.
    pub high: f32,
    /// Largest change per second.
    pub rate_per_s: f32,
    /// Step believed on top of it: noise, resolution, two seconds of jitter on the way.
    pub slack: f32,
}

/// One line of the list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Name on the glider.
    pub name: &'static str,
    /// Unit on the glider.
    pub unit: &'static str,
    /// Section in the newer generation.
    section: Section,
    /// Believed values; outputs have none.
    pub gate: Gate,
}

/// Indices of the parameters, and of what is written for the glider's log.
pub const PARAMETERS: [u16; 5] = [0, 1, 2, 3, 4];
/// Sequence, phase and abort of the law, for the glider's log.
pub const LOGGED: [u16; 3] = [5, 6, 7];
/// Sensors without echoes and limits: all that the older generation can hold.
pub const PLAIN: u16 = 32;
/// Sensors with them.
pub const MOST: usize = 40;

const fn entry(section: Section, name: &'static str, unit: &'static str, low: f32, high: f32, rate_per_s: f32, slack: f32) -> Entry {
    Entry { name, unit, section, gate: Gate { low, high, rate_per_s, slack } }
}

const fn input(name: &'static str, unit: &'static str, low: f32, high: f32, rate_per_s: f32, slack: f32) -> Entry {
    entry(Section::Input, name, unit, low, high, rate_per_s, slack)
}

/// A state: any step within its range.
const fn state(name: &'static str, unit: &'static str, high: f32) -> Entry {
    input(name, unit, 0.0, high, 0.0, high)
}

/// A constant of the vehicle: another value is believed when three in a row agree.
const fn constant(name: &'static str, unit: &'static str, high: f32) -> Entry {
    input(name, unit, 0.0, high, 0.0, 1e-3)
}

const fn parameter(name: &'static str, unit: &'static str) -> Entry {
    entry(Section::Mission, name, unit, 0.0, 0.0, 0.0, 0.0)
}

const fn output(name: &'static str) -> Entry {
    entry(Section::Output, name, "nodim", 0.0, 0.0, 0.0, 0.0)
}

/// Ranges are what the sensor of a healthy vehicle can say, rates what vehicle and water can do (2 m/s of depth as in the law's own
/// gate; motors 1.5 times their fastest); guesses where no source is named. An echo may be any parameter.
static LIST: [Entry; MOST] = [
    parameter("u_mission_param_a", "X"),
    parameter("u_mission_param_b", "X"),
    parameter("u_mission_param_c", "X"),
    parameter("u_mission_param_d", "X"),
    parameter("u_mission_param_e", "X"),
    output("sci_generic_a"),
    output("sci_generic_b"),
    output("sci_generic_c"),
    input("m_present_time", "timestamp", 0.0, 4.3e9, 1.0, 4.3e9),
    input("m_depth", "m", -10.0, 1200.0, 2.0, 2.0),
    input("sci_water_pressure", "bar", -1.0, 125.0, 0.2, 0.2),
    input("m_pitch", "rad", -1.6, 1.6, 0.3, 0.1),
    input("m_roll", "rad", -3.2, 3.2, 0.5, 0.3),
    input("m_heading", "rad", -0.01, 6.3, 0.5, 0.3),
    input("m_ballast_pumped", "cc", -320.0, 320.0, 50.0, 10.0),
    input("m_battpos", "in", -1.7, 1.7, 0.25, 0.1),
    input("m_fin", "rad", -0.6, 0.6, 0.5, 0.1),
    input("sci_water_temp", "degC", -5.0, 45.0, 2.0, 2.0),
    input("sci_water_cond", "S/m", -0.1, 10.0, 2.0, 7.0),
    input("m_altitude", "m", 0.0, 200.0, 4.0, 200.0),
    state("m_altimeter_status", "enum", 255.0),
    input("m_battery", "volts", 0.0, 60.0, 2.0, 4.0),
    input("m_lithium_battery_relative_charge", "%", 0.0, 101.0, 1.0, 5.0),
    input("m_vacuum", "inHg", -5.0, 29.9, 0.5, 1.0),
    state("m_leak", "bool", 1.0),
    state("m_leak_forward", "bool", 1.0),
    state("m_leak_science", "bool", 1.0),
    state("m_weight_drop", "bool", 2.0),
    state("m_gps_status", "enum", 255.0),
    state("m_console_cd", "bool", 1.0),
    state("m_iridium_connected", "bool", 1.0),
    state("x_in_gliderdos", "bool", 1.0),
    input("u_mission_param_a", "X", -1e6, 1e6, 0.0, 2e6),
    input("u_mission_param_b", "X", -1e6, 1e6, 0.0, 2e6),
    input("u_mission_param_c", "X", -1e6, 1e6, 0.0, 2e6),
    input("u_mission_param_d", "X", -1e6, 1e6, 0.0, 2e6),
    input("u_mission_param_e", "X", -1e6, 1e6, 0.0, 2e6),
    constant("x_ballast_pumped_max", "cc", 320.0),
    constant("x_battpos_max", "in", 1.7),
    constant("x_fin_max", "rad", 0.6),
];

static DEEP_BALLAST: Entry = input("m_de_oil_vol", "cc", -320.0, 320.0, 10.0, 10.0);
static DEEP_BALLAST_MAX: Entry = constant("x_de_oil_vol_max", "cc", 320.0);

/// Which list is expected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct List {
    /// Generation.
    pub generation: Generation,
    /// Pump.
    pub pump: Pump,
    /// With echoes of the parameters and the vehicle's limits; the newer generation only.
    pub echo: bool,
}

impl List {
    /// Number of sensors.
    #[must_use]
    pub fn count(self) -> u16 {
        if self.echo && self.generation == Generation::Newer { MOST as u16 } else { PLAIN }
    }

    /// The sensor of an index.
    #[must_use]
    pub fn get(self, index: u16) -> Option<&'static Entry> {
        if index >= self.count() {
            return None;
        }
        if self.pump == Pump::Deep {
            if index == Sensor::Ballast.index() {
                return Some(&DEEP_BALLAST);
            }
            if index == Sensor::BallastMax.index() {
                return Some(&DEEP_BALLAST_MAX);
            }
        }
        LIST.get(usize::from(index))
    }

    /// Section of an index in this generation.
    #[must_use]
    pub fn section(self, index: u16) -> Option<Section> {
        self.get(index).map(|entry| match (entry.section, self.generation) {
            (Section::Mission, Generation::Older) => Section::Output,
            (section, _) => section,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{Generation, List, Sensor};

    #[test]
    fn every_sensor_stands_at_its_index() {
        let list = List { echo: true, ..List::default() };
        for (sensor, name) in [
            (Sensor::Time, "m_present_time"),
            (Sensor::Depth, "m_depth"),
            (Sensor::Pitch, "m_pitch"),
            (Sensor::Ballast, "m_ballast_pumped"),
            (Sensor::BatteryMass, "m_battpos"),
            (Sensor::Conductivity, "sci_water_cond"),
            (Sensor::Vacuum, "m_vacuum"),
            (Sensor::WeightDrop, "m_weight_drop"),
            (Sensor::GliderDos, "x_in_gliderdos"),
            (Sensor::EchoBallast, "u_mission_param_a"),
            (Sensor::FinMax, "x_fin_max"),
        ] {
            assert_eq!(list.get(sensor.index()).map(|e| e.name), Some(name));
        }
        assert_eq!((list.count(), List { generation: Generation::Older, ..list }.count()), (40, 32));
        assert!(list.get(40).is_none());
    }
}

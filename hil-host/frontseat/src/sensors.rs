//! A frame of the plant in the glider's sensors and units.

use crate::behaviours::FlightComputer;
use crate::measured::{inhg, value};
use backseat::Sensor;
use plant::Truth;
use signals::{SensorFrame, Switch, Weight};

/// Conductivity of water of this density, S/m: bisection of TEOS-10, independent of the board's equation of state.
#[must_use]
pub fn conductivity_s_m(density_kg_m3: f64, temperature_degc: f64, pressure_dbar: f64) -> f64 {
    // Practical to absolute salinity without a place, g/kg.
    const PER_PRACTICAL: f64 = 35.165_04 / 35.0;
    let density = |conductivity: f64| -> Option<f64> {
        let sp = gsw::practical_salinity::sp_from_c(conductivity * 10.0, temperature_degc, pressure_dbar).ok()?;
        let sa = sp.max(0.0) * PER_PRACTICAL;
        // The plant's temperatures are conservative ones, and taken for those measured (0.1 K at most above 1000 m).
        gsw::volume::rho(sa, temperature_degc, pressure_dbar).ok()
    };
    let (mut low, mut high) = (0.0, 8.0);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if density(middle).is_some_and(|rho| rho < density_kg_m3) { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Sensors updated in this cycle, as index and value, the time first.
#[must_use]
pub fn updated(f: &SensorFrame, truth: &Truth, time_s: f64, computer: &FlightComputer, limits: [f64; 3]) -> Vec<(u16, f64)> {
    let mut out = vec![(Sensor::Time.index(), time_s)];
    let mut put = |sensor: Sensor, value: Option<f64>| out.extend(value.map(|v| (sensor.index(), v)));
    put(Sensor::Depth, value(f.depth_m));
    // The second depth's own error, in bar.
    let dbar = truth.pressure_pa.max(0.0) * 1e-4;
    put(Sensor::Pressure, value(f.depth2_m).map(|_| dbar * 0.1));
    put(Sensor::Pitch, value(f.pitch_rad));
    put(Sensor::Roll, value(f.roll_rad));
    put(Sensor::Heading, value(f.heading_rad));
    put(Sensor::Ballast, value(f.ballast_m3).map(|v| v * 1e6));
    put(Sensor::BatteryMass, value(f.battery_mass_m).map(|v| v / 0.0254));
    put(Sensor::Fin, value(f.fin_rad));
    put(Sensor::Temperature, value(f.temperature_degc));
    let conductivity =
        if truth.at_surface { Some(1e-5) } else { value(f.density_kg_m3).map(|rho| conductivity_s_m(rho, truth.temperature_degc, dbar)) };
    put(Sensor::Conductivity, conductivity);
    let altitude = value(f.altitude_m);
    put(Sensor::AltimeterStatus, Some(if altitude.is_some() { 0.0 } else { 1.0 }));
    put(Sensor::Altitude, altitude);
    put(Sensor::Voltage, value(f.battery_v));
    put(Sensor::Charge, value(f.charge).map(|v| v * 100.0));
    put(Sensor::Vacuum, value(f.vacuum_pa).map(inhg));
    let leak = match f.leak {
        Switch::Clear => Some(0.0),
        Switch::Alarm => Some(1.0),
        Switch::Unknown => None,
    };
    put(Sensor::Leak, leak);
    put(
        Sensor::WeightDrop,
        match f.weight {
            Weight::Held => Some(0.0),
            Weight::Released => Some(1.0),
            Weight::Unknown => None,
        },
    );
    put(Sensor::GpsStatus, truth.at_surface.then_some(if f.surface.gps_fix { 0.0 } else { 1.0 }));
    put(Sensor::Console, Some(f64::from(u8::from(f.surface.comms))));
    put(Sensor::Iridium, Some(0.0));
    put(Sensor::GliderDos, Some(f64::from(u8::from(computer.is_over()))));
    let echoes = [Sensor::EchoBallast, Sensor::EchoMass, Sensor::EchoFin, Sensor::EchoDive, Sensor::EchoClimb];
    for (sensor, parameter) in echoes.into_iter().zip(computer.parameters) {
        put(sensor, Some(f64::from(parameter)));
    }
    for (sensor, limit) in [Sensor::BallastMax, Sensor::MassMax, Sensor::FinMax].into_iter().zip(limits) {
        put(sensor, Some(limit));
    }
    out
}

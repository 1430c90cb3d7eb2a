//! Which column of a flight cannot be in the unit it claims.

use crate::record::flight::Flight;

/// The value below which a share `q` of the finite values lies; NaN if there are none.
#[must_use]
pub fn quantile(values: &[f64], q: f64) -> f64 {
    let mut v: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    if v.is_empty() {
        return f64::NAN;
    }
    let at = ((v.len() - 1) as f64 * q).round() as usize;
    *v.select_nth_unstable_by(at, f64::total_cmp).1
}

/// What a message says of how a flight is sampled.
pub const SAMPLED_EVERY: &str = "a flight is sampled every 0.1 to 60 s";

/// How a usual step of time relates to what a comparison can use; a clock's jitter of a tenth is granted, and that a log thinned to a
/// row a minute has the next one there was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Of another unit, or of a log that no glider writes.
    TooShort,
    /// A comparison can use it.
    Usable,
    /// Dives cannot be followed.
    TooLong,
}

/// See [`Step`]; a step that is not a number is too long.
#[must_use]
pub fn usual_step(step_s: f64) -> Step {
    if step_s < 0.09 {
        Step::TooShort
    } else if step_s < 90.0 {
        Step::Usable
    } else {
        Step::TooLong
    }
}

/// Vertical speeds of buoyancy gliders are 0.05 to 0.5 m/s, Pa/s.
const FASTEST_PA_S: f64 = 1e4;

/// Rate of pressure over 20 s and more, under way.
fn rates(f: &Flight) -> Vec<f64> {
    let mut out = Vec::new();
    let mut start = 0;
    for i in 1..f.len() {
        let step_s = f.time_s[i] - f.time_s[start];
        if f.segment[i] != f.segment[start] || step_s > 300.0 {
            start = i;
        } else if step_s >= 20.0 {
            if f.pressure_pa[start] > 2e4 && f.pressure_pa[i] > 2e4 {
                out.push((f.pressure_pa[i] - f.pressure_pa[start]) / step_s);
            }
            start = i;
        }
    }
    out
}

/// The first column whose bulk cannot be in the unit it claims, and why; `names` are those of pressure, pitch, ballast and density.
/// Quantiles, so that single spikes pass; a column without values passes.
#[must_use]
pub fn implausible(f: &Flight, names: [&str; 4]) -> Option<(String, String)> {
    let [pressure, pitch, ballast, density] = names;
    let size = |values: &[f64], q: f64| quantile(&values.iter().map(|v| v.abs()).collect::<Vec<_>>(), q);
    let found = |column: &str, why: String| Some((column.to_string(), why));
    let deep = quantile(&f.pressure_pa, 0.99);
    if deep.is_finite() && !(-5e4..1.2e8).contains(&deep) {
        let why = format!("reaches {:.0} dbar, more than the ocean is deep; is it in Pa, kPa or mbar instead of dbar?", deep * 1e-4);
        return found(pressure, why);
    }
    let fast = size(&rates(f), 0.9);
    if fast > FASTEST_PA_S {
        let why = format!(
            "changes by {:.2} dbar/s under way: no glider sinks at {:.1} m/s (bar or psi named dbar, or a clock in another unit?)",
            fast * 1e-4,
            fast * 1e-4
        );
        return found(pressure, why);
    }
    let steep = size(&f.pitch_rad, 0.9);
    if steep > 1.571 {
        return found(pitch, format!("reaches {steep:.1} rad; is it in degrees or mrad?"));
    }
    if deep > 2e4 && steep > 0.0 && steep < 2e-3 {
        return found(pitch, format!("stays within {steep:.5} rad in a flight that dives; is it divided by 1000, or the wrong column?"));
    }
    let volume = size(&f.ballast_m3, 0.9);
    if volume > 5e-3 || (volume > 0.0 && volume < 1e-6) {
        let why = format!("reaches {:.3} cm3; a buoyancy engine moves 100 to 1000 cm3 (litres, m3 or mm3 instead of cm3?)", volume * 1e6);
        return found(ballast, why);
    }
    let turns = quantile(&f.heading_rad, 0.9).abs().max(quantile(&f.heading_rad, 0.1).abs());
    if turns > 6.4 {
        return found("heading", format!("reaches {turns:.1} rad; is it in degrees?"));
    }
    let list = size(&f.roll_rad, 0.9);
    if list > 1.571 {
        return found("roll", format!("reaches {list:.1} rad; is it in degrees?"));
    }
    let warmth = quantile(&f.temperature_degc, 0.5);
    if warmth.is_finite() && !(-3.0..45.0).contains(&warmth) {
        return found("temperature", format!("is {warmth:.1} degC in the middle; water is -2 to 40 degC (kelvin?)"));
    }
    // All of it within 0.05 K of 0 degC, and not one repeated number: no water a glider dives in.
    if size(&f.temperature_degc, 0.95) < 0.05 && quantile(&f.temperature_degc, 0.95) > quantile(&f.temperature_degc, 0.05) {
        let why = format!("stays within {:.4} K of 0 degC; is it divided by 1000?", size(&f.temperature_degc, 0.95));
        return found("temperature", why);
    }
    let rho = quantile(&f.density_kg_m3, 0.5);
    if rho.is_finite() && !(950.0..1150.0).contains(&rho) {
        let why = format!("is {rho:.3} in the middle; in-situ density of water is 990 to 1080 kg/m3 (g/cm3, or sigma = density - 1000?)");
        return found(density, why);
    }
    let fast = f.speed_m_s.as_deref().map_or(f64::NAN, |speed| size(speed, 0.9));
    if fast > 5.0 || (fast > 0.0 && fast < 5e-3) {
        return found("speed", format!("reaches {fast:.4} m/s; gliders do 0.2 to 1 m/s (mm/s, cm/s or km/s instead of m/s?)"));
    }
    let shift = size(&f.battery_mass_m, 0.9);
    if shift > 2.0 {
        return found("battery position", format!("reaches {shift:.1} m, longer than the glider (inches, cm or mm instead of m?)"));
    }
    None
}

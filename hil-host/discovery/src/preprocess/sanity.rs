//! Can these inputs drive a model at all? Columns that contradict each other are refused with the likely cause, before a fit makes
//! physics of them.

use crate::preprocess::{Prepared, pressure_unit};
use hydro::effects::{BALLAST_OFFSET, ForceModel};
use logs::record::plausible::quantile;
use logs::vehicle::Vehicle;

/// Vertical velocity from which a row counts as diving or climbing, m/s, and the time over which it is formed, s.
const MOVING_M_S: f64 = 0.03;
const RATE_S: f64 = 20.0;
/// Fewest rows of each kind.
const FEWEST_OF_A_KIND: usize = 15;
/// A pitch or a ballast that varies less than this between dives and climbs does not steer, rad and m³.
const STILL_PITCH_RAD: f64 = 0.03;
const STILL_BALLAST_M3: f64 = 1e-5;
/// Share of rows with the wrong sign from which the column counts as reversed.
const REVERSED: f64 = 0.75;
/// Range of depth below which nothing dives, m.
const FLAT_M: f64 = 1.5;

/// Trim tolerances within which a vehicle file may be off before it is of another water.
const OTHER_WATER_TOLERANCES: f64 = 3.0;

/// Why the vehicle as its file gives it cannot have flown this log: it cannot both dive and climb in this water (the volume that the water
/// asks for is beyond its pump's strokes by more than the trim may be off and `ballast_offset` reaches), or depth changes ten times as
/// fast or as slow as it glides. None if it can.
#[must_use]
pub fn cannot_dive(prepared: &Prepared, vehicle: &Vehicle) -> Option<String> {
    if let Some(why) = pressure_unit::impossible(&prepared.runs, vehicle) {
        return Some(why);
    }
    let c = ForceModel::new(vehicle.constants, &vehicle.effects).constants;
    let (mut short_m3, mut ballast_m3, mut density, mut volume_m3) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for run in &prepared.runs {
        for row in (0..run.time_s.len()).filter(|&i| run.used[i]) {
            let s = run.input_at_row(row, 0.0).sensed;
            let warmer = if s.temperature_degc.is_finite() { s.temperature_degc - c.reference_temperature_degc } else { 0.0 };
            let hull = c.hull_volume_m3 * (1.0 - c.compressibility_per_pa * s.pressure_pa + c.thermal_expansion_per_k * warmer);
            short_m3.push(c.mass_kg / s.density_kg_m3 - hull);
            ballast_m3.push(s.ballast_m3);
            density.push(s.density_kg_m3);
            volume_m3.push(hull);
        }
    }
    let (asked, [most_in, most_out]) = (quantile(&short_m3, 0.5), [0.01, 0.99].map(|q| quantile(&ballast_m3, q)));
    let beyond = (asked - most_out).max(most_in - asked);
    // A trim that has an effect of its own is to be named, not refused. Not a number where there are no rows.
    let named_m3 = BALLAST_OFFSET.parameters[0].high * 1e-6;
    if !(beyond > named_m3 + OTHER_WATER_TOLERANCES * vehicle.tolerance.trim_volume_m3) {
        return None;
    }
    let (water, floats) = (quantile(&density, 0.5), c.mass_kg / quantile(&volume_m3, 0.5));
    Some(format!(
        "hull_volume_m3: this vehicle floats at {floats:.1} kg/m3 with its pump at mid-stroke, the water is {water:.1}: {:.0} cm3 of trim, more than its pump moves ({:.0} to {:.0} cm3); set hull_volume_m3 to {:.6}, or name the vehicle file of this water",
        asked * 1e6,
        most_in * 1e6,
        most_out * 1e6,
        vehicle.constants.hull_volume_m3 + asked
    ))
}

/// What of the inputs contradicts a dive, with the column and what to do; none if they fit together.
#[must_use]
pub fn contradiction(prepared: &Prepared) -> Option<String> {
    // Downward or not, pitch, ballast of each row under way.
    let mut moving: Vec<(bool, f64, f64)> = Vec::new();
    let mut depths = Vec::new();
    for run in &prepared.runs {
        let at = |t: f64| &run.inputs[(((t - run.time_s[0]).max(0.0) / (0.5 * run.step_s)) as usize).min(run.inputs.len() - 1)];
        for (i, t) in run.time_s.iter().enumerate().filter(|(i, _)| run.used[*i]) {
            depths.push(run.depth_m[i]);
            let (before, now, after) = (at(t - 0.5 * RATE_S), at(*t), at(t + 0.5 * RATE_S));
            let rate = (after.depth_m - before.depth_m) / RATE_S;
            if rate.abs() > MOVING_M_S {
                moving.push((rate > 0.0, now.sensed.pitch_rad, now.sensed.ballast_m3));
            }
        }
    }
    let spread = |v: &[f64]| quantile(v, 0.95) - quantile(v, 0.05);
    if !depths.is_empty() && spread(&depths) < FLAT_M {
        return Some(format!(
            "pressure_dbar: depth stays within {:.1} m of {:.0} m; there is no dive in it (a stuck sensor, or the wrong column?)",
            spread(&depths),
            quantile(&depths, 0.5)
        ));
    }
    let down = moving.iter().filter(|m| m.0).count();
    if down < FEWEST_OF_A_KIND || moving.len() - down < FEWEST_OF_A_KIND {
        return None;
    }
    let pitch: Vec<f64> = moving.iter().map(|m| m.1).collect();
    let ballast: Vec<f64> = moving.iter().map(|m| m.2).collect();
    if spread(&pitch) < STILL_PITCH_RAD {
        return Some(format!(
            "m_pitch_rad: stays within {:.4} rad of {:.4} rad while the vehicle dives and climbs (a stuck sensor, a commanded value, or not in rad?)",
            spread(&pitch),
            quantile(&pitch, 0.5)
        ));
    }
    if spread(&ballast) < STILL_BALLAST_M3 {
        return Some(format!(
            "m_ballast_pumped_cc: stays within {:.1} cm3 of {:.0} cm3 while the vehicle dives and climbs (a stuck sensor, or the other pump's column?)",
            spread(&ballast) * 1e6,
            quantile(&ballast, 0.5) * 1e6
        ));
    }
    let share = |wrong: &dyn Fn(&(bool, f64, f64)) -> bool| moving.iter().filter(|m| wrong(m)).count() as f64 / moving.len() as f64;
    let nose_up = share(&|m| (m.1 > 0.0) == m.0);
    if nose_up > REVERSED {
        return Some(format!(
            "m_pitch_rad: nose up on the way down and nose down on the way up in {:.0} % of the rows; pitch is positive nose up: multiply it by -1",
            nose_up * 100.0
        ));
    }
    let middle = 0.5 * (quantile(&ballast, 0.05) + quantile(&ballast, 0.95));
    let light = share(&|m| (m.2 > middle) == m.0);
    if light > REVERSED {
        return Some(format!(
            "m_ballast_pumped_cc: largest on the way down in {:.0} % of the rows; positive is buoyant: multiply it by -1",
            light * 100.0
        ));
    }
    None
}

/// What of flight and vehicle cannot be, with the column or key and what to do: asked before any of a comparison, a figure, a page.
///
/// # Errors
/// [`contradiction`] or [`cannot_dive`].
pub fn check(prepared: &Prepared, vehicle: &Vehicle) -> Result<(), String> {
    contradiction(prepared).or_else(|| cannot_dive(prepared, vehicle)).map_or(Ok(()), Err)
}

#[cfg(test)]
mod tests {
    use crate::diagnosis;
    use logs::record::csv;
    use logs::vehicle;
    use std::path::Path;

    const VEHICLE: &str = r#"{"mass_kg":68,"hull_volume_m3":0.0663,"hull_compressibility_per_pa":5e-10,"hull_thermal_expansion_per_k":5e-5,
        "wing":{"area_m2":0.11},"hydro":{"reference_area_m2":0.11,"wing_lift_slope_per_rad":3.45,"hull_lift_slope_per_rad":1.2,
        "hull_area_m2":0.0356,"cd0":0.15}}"#;

    /// What a diagnosis says of four saw-teeth whose columns went through `edit(time, depth going down, pitch, ballast)`.
    fn refusal(edit: &dyn Fn(f64, f64, f64, f64) -> (f64, f64, f64)) -> String {
        let mut text = String::from("time_s,segment,pressure_dbar,m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3\n");
        for i in 0..600 {
            let x = f64::from(i % 150) / 75.0;
            let (depth, sign) = (5.0 + 40.0 * (1.0 - (x - 1.0).abs()), if x < 1.0 { -1.0 } else { 1.0 });
            let (p, pitch, ballast) = edit(f64::from(i) * 4.0, depth, 0.45 * sign, 220.0 * sign);
            text += &format!("{},0,{p:.2},{pitch:.4},{ballast:.1},1025.0\n", i * 4);
        }
        let flight = csv::parse(&text, Path::new("f.csv"), "f").expect("reads");
        let vehicle = vehicle::parse_text(VEHICLE, Path::new("v.json")).expect("vehicle");
        diagnosis::diagnose(&flight, &vehicle, crate::hypotheses::search::Depth::Pairs, &|_, _| {})
            .map_or_else(|e| e.to_string(), |d| d.verdict.name().to_string())
    }

    /// Changes time, pressure, pitch and ballast of a sound log into what it shall say: pressure, pitch, ballast.
    type Edit = &'static dyn Fn(f64, f64, f64, f64) -> (f64, f64, f64);

    #[test]
    fn columns_that_contradict_a_dive_are_refused_with_the_likely_cause() {
        let cases: [(Edit, &str); 5] = [
            (&|_, p, _, b| (p, -0.4, b), "m_pitch_rad: stays"),
            (&|_, p, t, _| (p, t, 100.0), "m_ballast_pumped_cc: stays"),
            (&|_, _, t, b| (10.0, t, b), "no dive in it"),
            (&|_, p, t, b| (p, -t, b), "multiply it by -1"),
            (&|_, p, t, b| (p, t, -b), "positive is buoyant"),
        ];
        for (edit, want) in cases {
            let why = refusal(edit);
            assert!(why.contains(want), "{want}: {why}");
        }
        let fine = refusal(&|_, p, t, b| (p, t, b));
        assert!(["adequate", "explained", "ambiguous", "unexplained"].contains(&fine.as_str()), "{fine}");
    }
}

//! `flight.csv` as text, and the truth as a document.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::sensors::Row;
use super::{Case, Truth};

fn field(out: &mut String, x: f64, decimals: usize) {
    out.push(',');
    if x.is_finite() {
        let _ = write!(out, "{x:.decimals$}");
    }
}

/// The log in the column order of the format; the speed column only where the vehicle has the sensor.
#[must_use]
pub fn csv(rows: &[Row], with_speed: bool) -> String {
    let mut out = String::with_capacity(rows.len() * 96 + 200);
    out.push_str("time_s,segment,pressure_dbar,m_pitch_rad,m_roll_rad,m_heading_rad,m_ballast_pumped_cc,m_battpos_m,");
    out.push_str("sci_water_temp_degC,sci_density_kg_m3,gps_east_m,gps_north_m");
    out.push_str(if with_speed { ",speed_water_m_s\n" } else { "\n" });
    for r in rows {
        let _ = write!(out, "{:.2},{}", r.time_s, r.segment);
        field(&mut out, r.pressure_dbar, 2);
        field(&mut out, r.pitch_rad, 4);
        field(&mut out, r.roll_rad, 4);
        field(&mut out, r.heading_rad, 3);
        field(&mut out, r.ballast_cc, 0);
        field(&mut out, r.battery_m, 4);
        field(&mut out, r.temperature_degc, 3);
        field(&mut out, r.density_kg_m3, 3);
        field(&mut out, r.gps_m[0], 1);
        field(&mut out, r.gps_m[1], 1);
        if with_speed {
            field(&mut out, r.speed_m_s, 3);
        }
        out.push('\n');
    }
    out
}

/// `truth.json`: what is hidden, how large, nature's form, scatter and background.
#[must_use]
pub fn truth_document(case: &Case) -> Value {
    let t: &Truth = &case.truth;
    let effects: Vec<Value> =
        t.hidden.iter().map(|h| json!({ "name": h.name, "parameter": h.parameter, "value": h.value, "form": h.form })).collect();
    let scatter: serde_json::Map<String, Value> =
        super::vehicle::TOLERANCE.iter().zip(t.scatter.values).map(|((k, _), v)| ((*k).to_owned(), json!(v))).collect();
    json!({
        "case": case.name,
        "kind": t.kind.id(),
        "strength": t.strength.map(super::catalogue::Strength::id),
        "effects": effects,
        "site": case.vehicle.site.id(),
        "wing": case.vehicle.wing.id(),
        "small_structure": t.nature.small.as_ref().map(|s| json!({ "rms_m_s": s.rms_m_s, "clock_lag_s": s.clock_lag_s })),
        "scatter": scatter,
        "speed_scale_error": t.scatter.speed_scale,
        "heading_bias_rad": t.scatter.heading_bias_rad,
        "background": { "colour": t.colour.id(), "rms_m_s": t.background_rms_m_s, "correlation_time_s": t.background_time_s },
        "pressure_zero_dbar": t.pressure_zero_dbar,
        "list_rad": t.list_rad,
        "duration_days": t.days,
        "stalled_share": t.stalled_share,
    })
}

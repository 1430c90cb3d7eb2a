//! What the rows of an imported flight cannot be: refused, left out or noted, whatever its source.

use std::ops::Range;

use super::report::list_of;
use super::{Imported, Report, assembly, position};
use crate::channels::Channel;
use crate::record::csv;
use crate::record::flight::Flight;
use crate::record::plausible::{SAMPLED_EVERY, Step, implausible, quantile, usual_step};

/// Refuses what cannot be in the unit it claims; notes what the flight cannot be used for.
pub(super) fn sound(imported: &mut Imported) -> Result<(), String> {
    let flight = &imported.flight;
    if let Some((column, why)) = implausible(flight, ["pressure", "pitch", "ballast", "density"]) {
        return Err(format!("{column} {why}"));
    }
    let mut falling: Vec<f64> = flight.pressure_pa.iter().copied().filter(|p| p.is_finite()).collect();
    falling.sort_by(|a, b| b.total_cmp(a));
    // A few wrong rows make no dive, days at the surface do not hide one.
    let deep = falling.get(STRAY_ROWS.min(falling.len() / 100)).copied().unwrap_or(f64::NAN);
    if !(deep >= SHALLOW_PA) {
        return Err(format!("pressure never exceeds {:.4} dbar: no dive to compare with, or kbar or MPa instead of dbar?", deep * 1e-4));
    }
    let under_water = || (0..flight.len()).filter(|i| flight.pressure_pa[*i] > SHALLOW_PA);
    let without = under_water().filter(|i| flight.density_kg_m3[*i].is_nan()).count();
    if without * 100 > under_water().count() && flight.density_kg_m3.iter().any(|d| d.is_finite()) {
        imported.report.note(format!(
            "{without} of {} rows under water have no density: salinity, conductivity or temperature is missing there, or cannot be",
            under_water().count()
        ));
    }
    lacking_in_segments(flight, &mut imported.report);
    if let Some((of, share)) = nose_up_in_descent(flight) {
        let of = of.map_or_else(String::new, |list| format!(" of segments {list}"));
        imported.report.note(format!(
            "pitch: the nose is up in {:.0} % of the rows{of} that sink, or down where they rise: is nose down positive there? Turn its sign",
            100.0 * share
        ));
    }
    if let Some((of, off)) = heavy_in_ascent(flight) {
        let of = of.map_or_else(String::new, |list| format!(" in segments {list}"));
        imported.report.note(format!(
            "ballast: it reads {:.0} cc more where the vehicle sinks than where it rises{of}: does it count what weighs? Turn its sign",
            off * 1e6
        ));
    }
    steps(flight, &mut imported.report)?;
    for k in (1..flight.len()).filter(|k| flight.time_s[*k] - flight.time_s[k - 1] > TWO_MISSIONS_S) {
        let days = (flight.time_s[k] - flight.time_s[k - 1]) / 86_400.0;
        imported
            .report
            .note(format!("no row for {days:.0} days after segment {}: two missions? Import one at a time", flight.segment[k - 1]));
    }
    let needed = ["m_pitch_rad", "m_ballast_pumped_cc", "sci_density_kg_m3"];
    let lacking: Vec<&str> = needed.into_iter().filter(|n| imported.report.missing.iter().any(|m| m == n)).collect();
    if !lacking.is_empty() {
        imported.report.note(format!("a comparison needs {}, which this file does not have", lacking.join(" and ")));
        for column in lacking {
            let cannot = csv::cannot_be_asked(column).unwrap_or_default();
            imported.report.note(format!("without {column} {cannot}"));
        }
    }
    Ok(())
}

/// Refuses samples in another unit of time, notes sparse ones.
fn steps(flight: &Flight, report: &mut Report) -> Result<(), String> {
    // On deck and between dives other steps are usual.
    let deep = |i: usize| flight.pressure_pa[i] > SHALLOW_PA;
    let under_water = (1..flight.len()).filter(|i| deep(i - 1) && deep(*i));
    let mut steps: Vec<f64> = under_water.map(|i| flight.time_s[i] - flight.time_s[i - 1]).collect();
    steps.sort_by(f64::total_cmp);
    match steps.get(steps.len() / 2) {
        Some(step) if usual_step(*step) == Step::TooShort => {
            return Err(format!(
                "the usual step of time is {step} s; {SAMPLED_EVERY} (a clock that counts in another unit than it states?)"
            ));
        }
        Some(step) if usual_step(*step) == Step::TooLong => {
            report.note(format!("samples are {step:.0} s apart: too sparse for a comparison: {SAMPLED_EVERY}"));
        }
        Some(step) if *step > BLOCK_STEP_S => {
            report.note(format!("samples are {step:.0} s apart: blocks of 20 s, as the flight format has them, hold fewer than three"));
        }
        _ => {}
    }
    Ok(())
}

/// Temperatures and salinities that no water has become none, with the density that was computed from them.
pub(super) fn impossible_water(imported: &mut Imported) -> Result<(), String> {
    let flight = &mut imported.flight;
    let (degc, practical) = (Channel::Temperature.usual().possible(), Channel::Salinity.usual().possible());
    let is_wrong = |t: f64| t.is_finite() && !degc.contains(&t);
    // Where most are it is the unit, which is refused with its name.
    let most = 2 * flight.temperature_degc.iter().filter(|t| is_wrong(**t)).count() > flight.len();
    let (mut hot, mut salty) = (0, 0);
    let mut salinity = flight.extra.get_mut(assembly::SALINITY_COLUMN);
    for i in 0..flight.temperature_degc.len() {
        let wrong = !most && is_wrong(flight.temperature_degc[i]);
        let salinity = salinity.as_mut().and_then(|s| s.get_mut(i));
        let too_salty = !wrong && salinity.as_ref().is_some_and(|s| **s > *practical.end());
        if wrong {
            flight.temperature_degc[i] = f64::NAN;
        }
        if let Some(salinity) = salinity.filter(|_| wrong || too_salty) {
            *salinity = f64::NAN;
            flight.density_kg_m3[i] = f64::NAN;
        }
        hot += usize::from(wrong);
        salty += usize::from(too_salty);
    }
    let rows = flight.len();
    if hot > 0 {
        imported.report.note(format!("{hot} of {rows} temperatures are none of water (-3 to 45 degC): left out"));
    }
    if salty > 0 {
        let what = "salinities are above 45, from this conductivity: another unit than it states? They and their density are";
        imported.report.leave_out(format!("{salty} of {rows} {what} left out"));
    }
    Ok(())
}

/// Names segments in which a channel has values in less than half the share of rows that it has in the others.
fn lacking_in_segments(flight: &Flight, report: &mut Report) {
    let columns: [(&str, &[f64]); 4] = [
        ("m_pitch_rad", &flight.pitch_rad),
        ("m_heading_rad", &flight.heading_rad),
        ("m_ballast_pumped_cc", &flight.ballast_m3),
        ("sci_density_kg_m3", &flight.density_kg_m3),
    ];
    let segments = position::segments(flight);
    for (name, values) in columns {
        let share = |rows: &Range<usize>| {
            let deep = || rows.clone().filter(|i| flight.pressure_pa[*i] > SHALLOW_PA);
            deep().filter(|i| values[*i].is_finite()).count() as f64 / deep().count() as f64
        };
        let shares: Vec<(u32, f64)> = segments.iter().map(|rows| (flight.segment[rows.start], share(rows))).collect();
        let usual = quantile(&shares.iter().map(|s| s.1).collect::<Vec<_>>(), 0.5);
        let lacking: Vec<String> = shares.iter().filter(|(_, share)| *share < 0.5 * usual).map(|(s, _)| s.to_string()).collect();
        if !lacking.is_empty() {
            report.note(format!("{name} has no values, or few, in segments {} (others have them)", list_of(&lacking)));
        }
    }
}

/// What `of` finds in the rows of the whole flight, else in those of single segments: then their numbers and what it finds in the first.
fn in_all_or_some(flight: &Flight, of: impl Fn(Range<usize>) -> Option<f64>) -> Option<(Option<String>, f64)> {
    if let Some(found) = of(0..flight.len()) {
        return Some((None, found));
    }
    let segments = position::segments(flight).into_iter();
    let found: Vec<(u32, f64)> = segments.filter_map(|rows| Some((flight.segment[rows.start], of(rows)?))).collect();
    let names: Vec<String> = found.iter().map(|f| f.0.to_string()).collect();
    found.first().map(|(_, first)| (Some(list_of(&names)), *first))
}

/// Share of the rows under way whose nose points up where they sink or down where they rise, where these are nearly all; and of which
/// segments, if not of all.
fn nose_up_in_descent(flight: &Flight) -> Option<(Option<String>, f64)> {
    in_all_or_some(flight, |rows| {
        let steep: Vec<(usize, f64)> = under_way(flight, rows).filter(|(i, _)| flight.pitch_rad[*i].abs() > UNDER_WAY_RAD).collect();
        let against = steep.iter().filter(|(i, rate)| (*rate > 0.0) == (flight.pitch_rad[*i] > 0.0)).count();
        let share = against as f64 / steep.len() as f64;
        (steep.len() >= 50 && share > 0.9).then_some(share)
    })
}

/// By how much the ballast reads more where the vehicle sinks than where it rises, m³, where that is more than hulls and water make; and
/// in which segments, if not in all.
fn heavy_in_ascent(flight: &Flight) -> Option<(Option<String>, f64)> {
    in_all_or_some(flight, |rows| {
        let of = |sinks: bool| {
            let known =
                under_way(flight, rows.clone()).filter(move |(i, rate)| (*rate > 0.0) == sinks && flight.ballast_m3[*i].is_finite());
            known.map(|(i, _)| flight.ballast_m3[i]).collect::<Vec<f64>>()
        };
        let (sinking, rising) = (of(true), of(false));
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let off = mean(&sinking) - mean(&rising);
        (sinking.len().min(rising.len()) >= 25 && off > BALLAST_M3).then_some(off)
    })
}

/// Rows that sink or rise, and how fast, Pa/s.
fn under_way(flight: &Flight, rows: Range<usize>) -> impl Iterator<Item = (usize, f64)> + '_ {
    let rate = |i: usize| (flight.pressure_pa[i + 1] - flight.pressure_pa[i]) / (flight.time_s[i + 1] - flight.time_s[i]);
    (rows.start..rows.end.saturating_sub(1)).map(move |i| (i, rate(i))).filter(|(_, rate)| rate.abs() > UNDER_WAY_PA_S)
}

/// No row for so long is between two missions, s (guess).
const TWO_MISSIONS_S: f64 = 30.0 * 86_400.0;
/// So many rows too deep may be wrong ones (guess).
const STRAY_ROWS: usize = 20;
/// Half of what a pump moves at the least, m³ (guess).
const BALLAST_M3: f64 = 20e-6;
/// A glider under way sinks or rises faster than 3 cm/s, Pa/s, with its nose more than 5 deg off the horizontal, rad.
const UNDER_WAY_PA_S: f64 = 300.0;
const UNDER_WAY_RAD: f64 = 0.087;
/// The comparison leaves out what is shallower than 2 m.
const SHALLOW_PA: f64 = 2e4;
/// Three samples in a block of 20 s.
const BLOCK_STEP_S: f64 = 9.0;

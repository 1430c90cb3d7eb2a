//! Any cycle of a recorded flight: what was measured, what this law answers, and expressions of both.

use crate::cli::{Output, Verdict};
use crate::terminal::{row, say};
use logs::vehicle::expression::Formula;
use rig::flight::log::{degraded, value};
use rig::replay::difference::differences;
use rig::replay::record::Record;
use rig::replay::stepper::Stepper;
use serde_json::json;
use signals::{Answer, SensorFrame};
use std::io::BufRead as _;

/// One cycle of the law: what it got, what it answered, what it had learned of its table by then.
struct Cycle {
    frame: SensorFrame,
    answer: Answer,
    learned: Option<[f32; 3]>,
}

/// A signal by the name that it has in flight.csv, as far as it is a number; what the law has learned is in no log.
type Signal = (&'static str, fn(&Cycle) -> f64);

const SIGNALS: [Signal; 31] = [
    ("time_s", |c| c.frame.time.0 as f64 * 1e-6),
    ("m_depth_m", |c| value(c.frame.depth_m)),
    ("m_depth2_m", |c| value(c.frame.depth2_m)),
    ("m_pitch_rad", |c| value(c.frame.pitch_rad)),
    ("m_roll_rad", |c| value(c.frame.roll_rad)),
    ("m_heading_rad", |c| value(c.frame.heading_rad)),
    ("m_ballast_pumped_cc", |c| 1e6 * value(c.frame.ballast_m3)),
    ("m_battpos_m", |c| value(c.frame.battery_mass_m)),
    ("m_fin_rad", |c| value(c.frame.fin_rad)),
    ("sci_density_kg_m3", |c| value(c.frame.density_kg_m3)),
    ("m_altitude_m", |c| value(c.frame.altitude_m)),
    ("m_battery_v", |c| value(c.frame.battery_v)),
    ("m_charge", |c| value(c.frame.charge)),
    ("m_vacuum_pa", |c| value(c.frame.vacuum_pa)),
    ("gps_fix", |c| f64::from(u8::from(c.frame.surface.gps_fix))),
    ("comms", |c| f64::from(u8::from(c.frame.surface.comms))),
    ("phase", |c| f64::from(c.answer.trace.phase as u8)),
    ("dives", |c| c.answer.trace.dives.into()),
    ("flags", |c| c.answer.trace.flags.0.into()),
    ("c_ballast_cc", |c| 1e6 * f64::from(c.answer.command.ballast_m3)),
    ("c_battpos_m", |c| c.answer.command.battery_mass_m.into()),
    ("c_fin_rad", |c| c.answer.command.fin_rad.into()),
    ("c_drop_weight", |c| f64::from(u8::from(c.answer.command.drop_weight))),
    ("c_pitch_rad", |c| c.answer.trace.pitch_setpoint_rad.into()),
    ("est_alpha_rad", |c| c.answer.trace.alpha_rad.into()),
    ("est_speed_m_s", |c| c.answer.trace.speed_m_s.into()),
    ("est_glide_angle_rad", |c| c.answer.trace.glide_angle_rad.into()),
    ("est_depth_m", |c| c.answer.trace.depth_m.into()),
    ("learned_drag", |c| c.learned.map_or(f64::NAN, |l| l[0].into())),
    ("learned_drag_of_lift", |c| c.learned.map_or(f64::NAN, |l| l[1].into())),
    ("learned_lift", |c| c.learned.map_or(f64::NAN, |l| l[2].into())),
];

/// Expressions that are watched, with their text.
type Watched = Vec<(String, Formula)>;

fn formula(text: &str) -> anyhow::Result<Formula> {
    let names = || SIGNALS.map(|s| s.0).join(", ");
    Formula::parse(text, |name| SIGNALS.iter().any(|s| s.0 == name)).map_err(|e| anyhow::anyhow!("{e}\nsignals: {}", names()))
}

fn watched(texts: &[String]) -> anyhow::Result<Watched> {
    texts.iter().map(|text| Ok((text.clone(), formula(text)?))).collect()
}

fn value_of(formula: &Formula, cycle: &Cycle) -> f64 {
    formula.value(|name| SIGNALS.iter().find(|s| s.0 == name).map_or(f64::NAN, |s| s.1(cycle)))
}

/// The next cycle, and its place; none at the end of the record.
fn next(record: &Record, stepper: &mut Stepper<'_>) -> Option<(usize, Cycle)> {
    let index = stepper.at();
    let answer = stepper.step()?;
    let frame = record.steps.get(index).map(|s| s.frame).unwrap_or_default();
    Some((index, Cycle { frame, answer, learned: stepper.learned() }))
}

const HEAD: &str = "  cycle   time s phase       abort           depth m pitch° aimed° ballast ordered";

/// One cycle on one line, what is watched and what differs from the record below it.
fn lines(record: &Record, index: usize, cycle: &Cycle, watched: &Watched) -> Vec<String> {
    let Some(step) = record.steps.get(index) else { return Vec::new() };
    let Cycle { frame: f, answer, .. } = cycle;
    let t = &answer.trace;
    let mut out = vec![format!(
        "{index:>7} {:>8.0} {:<11} {:<15} {:>7.1} {:>6.1} {:>6.1} {:>7.1} {:>7.1}",
        record.time_s(index),
        format!("{:?}", t.phase),
        t.abort.map_or_else(|| "-".to_owned(), |a| format!("{a:?}")),
        t.depth_m,
        value(f.pitch_rad).to_degrees(),
        t.pitch_setpoint_rad.to_degrees(),
        1e6 * value(f.ballast_m3),
        1e6 * answer.command.ballast_m3,
    )];
    let flags = degraded(t.flags);
    if !flags.is_empty() {
        out.push(format!("        degraded: {}", flags.join(", ")));
    }
    out.extend(watched.iter().map(|(text, formula)| format!("        {text} = {:.6}", value_of(formula, cycle))));
    out.extend(differences(&step.answer, answer).iter().map(|d| format!("        differs: {}", d.words())));
    out
}

/// Shows some cycles from a time on.
///
/// # Errors
/// An expression that cannot be read, or the law refuses what it is given.
pub fn shown(
    record: &Record,
    table: Option<&[u8]>,
    at_s: f64,
    cycles: usize,
    watch: &[String],
    output: &Output,
) -> anyhow::Result<Verdict> {
    let watched = watched(watch)?;
    let end_s = record.steps.len().checked_sub(1).map_or(0.0, |last| record.time_s(last));
    anyhow::ensure!((0.0..=end_s).contains(&at_s), "--at {at_s}: from 0 to {end_s}, the last cycle of the record, s");
    let mut stepper = Stepper::new(record, table)?;
    stepper.seek(record.index(at_s));
    let mut rows = Vec::new();
    while rows.len() < cycles {
        let Some(cycle) = next(record, &mut stepper) else { break };
        rows.push(cycle);
    }
    let document = rows.iter().map(|(i, cycle)| {
        let answer = &cycle.answer;
        let signals: serde_json::Map<_, _> = SIGNALS.iter().map(|s| (s.0.to_owned(), json!(s.1(cycle)))).collect();
        let values: serde_json::Map<_, _> = watched.iter().map(|(t, f)| (t.clone(), json!(value_of(f, cycle)))).collect();
        json!({ "cycle": i, "time_s": record.time_s(*i), "abort": answer.trace.abort.map(|a| format!("{a:?}")), "signals": signals, "watched": values,
            "differs": record.steps.get(*i).map_or(Vec::new(), |s| differences(&s.answer, answer)).iter().map(|d| d.signal).collect::<Vec<_>>() })
    });
    output.emit(&json!({ "cycles": document.collect::<Vec<_>>() }), || {
        println!("{HEAD}");
        rows.iter().flat_map(|(i, cycle)| lines(record, *i, cycle, &watched)).for_each(|line| println!("{line}"));
    });
    Ok(Verdict::Ok)
}

const ORDERS: &str = "go S: to the cycle at S seconds; next [N], back [N]: cycles; watch EXPRESSION; until EXPRESSION: to the first cycle where it is above zero; quit";

/// Goes through a flight by orders on standard input.
///
/// # Errors
/// An expression of the command line that cannot be read, or the law refuses what it is given.
pub fn at_a_prompt(record: &Record, table: Option<&[u8]>, watch: &[String]) -> anyhow::Result<Verdict> {
    let mut watched = watched(watch)?;
    let mut stepper = Stepper::new(record, table)?;
    row("record", &format!("{} cycles in {:.1} h", record.steps.len(), record.time_s(record.steps.len() - 1) / 3600.0));
    row("orders", ORDERS);
    println!("{HEAD}");
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let (order, rest) = line.trim().split_once(' ').unwrap_or((line.trim(), ""));
        let count = rest.trim().parse::<usize>().unwrap_or(1);
        match order {
            "quit" | "q" => break,
            "go" | "g" => match rest.trim().parse::<f64>() {
                Ok(at_s) => stepper.seek(record.index(at_s)),
                Err(_) => {
                    say(&format!("go {rest}: a time in seconds since the start, such as go 3600"));
                    continue;
                }
            },
            "back" | "b" => stepper.seek(stepper.at().saturating_sub(count + 1)),
            "watch" | "w" => {
                match formula(rest) {
                    Ok(formula) => watched.push((rest.to_owned(), formula)),
                    Err(e) => println!("{e}"),
                }
                continue;
            }
            "until" | "u" => match formula(rest) {
                Ok(formula) => until(record, &mut stepper, &formula),
                Err(e) => {
                    println!("{e}");
                    continue;
                }
            },
            "next" | "n" | "" => {}
            _ => {
                row("orders", ORDERS);
                continue;
            }
        }
        for _ in 0..if matches!(order, "next" | "n") { count } else { 1 } {
            match next(record, &mut stepper) {
                Some((index, cycle)) => lines(record, index, &cycle, &watched).iter().for_each(|line| println!("{line}")),
                None => say("the record ends here"),
            }
        }
    }
    Ok(Verdict::Ok)
}

/// To the first cycle from here on where a formula is above zero, to show it next.
fn until(record: &Record, stepper: &mut Stepper<'_>, formula: &Formula) {
    while let Some((index, cycle)) = next(record, stepper) {
        if value_of(formula, &cycle) > 0.0 {
            return stepper.seek(index);
        }
    }
}

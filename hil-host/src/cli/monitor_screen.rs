//! What `glider monitor` draws: at most 24 lines of 80 characters.

use crate::terminal::COLUMNS;
use rig::flight::under_way::Moment;
use signals::{Counters, Manifest};
use std::collections::VecDeque;
use std::time::Duration;

/// Screen that is always enough.
pub const LINES: usize = 24;

/// Characters of a sparkline.
const SPARK: usize = 34;

/// Cuts rows to the screen.
#[must_use]
pub fn fitted(rows: &[String]) -> String {
    rows.iter().take(LINES).map(|r| r.chars().take(COLUMNS).chain(['\n']).collect::<String>()).collect()
}

/// The vehicle in one line.
#[must_use]
pub fn line(now: &Moment) -> String {
    let number = |v: f64, places: usize| if v.is_finite() { format!("{:.places$}", whole(v, places)) } else { "–".to_owned() };
    format!(
        "{:.0} s {}, {} m, pitch {}°, ballast {} cc, battery {} V{}",
        now.time_s,
        now.phase,
        number(now.depth_m, 1),
        number(now.pitch_rad[0].to_degrees(), 1),
        number(now.ballast_cc, 0),
        number(now.battery_v, 2),
        now.abort.as_ref().map_or(String::new(), |why| format!(", abort {why}"))
    )
}

/// A board and its line.
#[must_use]
pub fn board(name: &str, m: &Manifest, c: &Counters, rate: f64, up: Duration) -> Vec<String> {
    let [major, minor, patch] = m.firmware;
    let seat = match (m.under_way, m.hil) {
        (false, _) => "on deck".to_owned(),
        (true, true) => format!("{:?}, frames of a host", m.phase),
        (true, false) => format!("{:?}, own sensors or a glider's", m.phase),
    };
    let boots = if m.boots == 0 { "not counted".to_owned() } else { m.boots.to_string() };
    vec![
        format!("{name}    watched {:.0} s", up.as_secs_f64()),
        format!("firmware {major}.{minor}.{patch}   cycle {} ms   boots {boots}   {seat}", m.cycle_ms),
        format!("tables  standard {:08x}   low-ar {:08x}   config {:08x}", m.table_standard, m.table_low_ar, m.config),
        String::new(),
        format!("link    accepted {:>9}   {rate:>7.1}/s     damaged  {:>9}", c.accepted, c.damaged),
        format!("        repeated {:>9}   stale {:>9}   overflow {:>9}", c.repeated, c.stale, c.overflow),
        format!("        other version {:>4}   unknown {:>7}", c.version, c.unknown),
    ]
}

/// Values over time as blocks: the newest at the right; the least is the lowest block, and what is not known a blank.
#[must_use]
pub fn sparkline(values: &[f64], wide: usize) -> String {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    let shown = wide.min(values.len());
    (0..shown)
        .map(|i| {
            // Means of equal stretches.
            let stretch = &values[i * values.len() / shown..(i + 1) * values.len() / shown];
            let known: Vec<f64> = stretch.iter().copied().filter(|v| v.is_finite()).collect();
            let mean = known.iter().sum::<f64>() / known.len() as f64;
            let step = if high > low { ((mean - low) / (high - low) * 7.0).round() } else { 3.0 };
            if mean.is_finite() { ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'][step as usize] } else { ' ' }
        })
        .collect()
}

/// Without the sign of a zero.
fn whole(v: f64, places: usize) -> f64 {
    let p = 10f64.powi(places as i32);
    (v * p).round() / p + 0.0
}

/// The vehicle: what it does and how it got there.
#[must_use]
pub fn flight(moments: &VecDeque<Moment>) -> Vec<String> {
    let Some(now) = moments.back() else { return vec!["flight  no control cycle yet".to_owned()] };
    let row = |name: &str, unit: &str, places: usize, of: &dyn Fn(&Moment) -> f64, sign: f64, more: String| {
        let values: Vec<f64> = moments.iter().map(of).collect();
        let seen = || values.iter().copied().filter(|v| v.is_finite());
        let number = |v: f64| if v.is_finite() { format!("{:.places$}", whole(v, places)) } else { "–".to_owned() };
        let (low, high) = (seen().fold(f64::INFINITY, f64::min), seen().fold(f64::NEG_INFINITY, f64::max));
        let drawn: Vec<f64> = values.iter().map(|v| sign * v).collect();
        let range =
            if low.is_finite() { format!("{:.places$} to {:.places$}", whole(low, places), whole(high, places)) } else { String::new() };
        let spark = sparkline(&drawn, SPARK);
        let pad = SPARK - spark.chars().count();
        format!("{name:<8}{:>7} {unit:<3} {:pad$}{spark}  {range}{more}", number(of(now)), "")
    };
    let degrees = |name: &str, of: &dyn Fn(&Moment) -> f64, more: String| row(name, "°", 1, &|m| of(m).to_degrees(), 1.0, more);
    let aimed = now.pitch_rad[1].to_degrees();
    let span = moments.front().map_or(0.0, |first| now.time_s - first.time_s);
    let aimed = if aimed.is_finite() { format!(", aimed {aimed:.1}") } else { String::new() };
    vec![
        format!("{:<8}{:<12} dives {:<5} time {:.0} s", "phase", now.phase, now.dives, now.time_s),
        format!(
            "{:<8}{:<12} degraded {}",
            "abort",
            now.abort.as_deref().unwrap_or("none"),
            if now.degraded.is_empty() { "no".to_owned() } else { now.degraded.join(", ") }
        ),
        row("depth", "m", 1, &|m| m.depth_m, -1.0, String::new()),
        degrees("pitch", &|m| m.pitch_rad[0], aimed),
        degrees("α", &|m| m.alpha_rad, String::new()),
        row("ballast", "cc", 0, &|m| m.ballast_cc, 1.0, String::new()),
        row("battery", "V", 2, &|m| m.battery_v, 1.0, String::new()),
        format!("{:<8}over the last {span:.0} s; depth grows downwards", ""),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(n: u32) -> VecDeque<Moment> {
        let at = |i: u32| Moment {
            time_s: 1e6 + f64::from(4 * i),
            phase: "InflectHigh".into(),
            dives: u32::MAX,
            abort: Some("BallastFeedback".into()),
            degraded: vec!["flies worse than the table"; 11],
            depth_m: f64::from(i % 200) * 5.0,
            pitch_rad: [-0.7, 0.7],
            alpha_rad: if i.is_multiple_of(7) { f64::NAN } else { 0.2 },
            ballast_cc: -230.0,
            battery_v: f64::NAN,
        };
        (0..n).map(at).collect()
    }

    #[test]
    fn the_screen_fits_80_by_24_whatever_comes() {
        let most = u32::MAX;
        let worst = Counters { accepted: most, damaged: most, version: most, unknown: most, overflow: most, repeated: most, stale: most };
        let m = Manifest {
            boots: most,
            cycle_ms: most,
            firmware: [255; 3],
            table_standard: most,
            table_low_ar: most,
            config: most,
            hil: true,
            under_way: true,
            phase: signals::Phase::InflectHigh,
            last_seq: Some(most),
            image: Some(signals::Image { id: most, standing: signals::Standing::RolledBack }),
        };
        let mut rows = board(&"b".repeat(200), &m, &worst, 1e9, Duration::from_secs(1_000_000));
        rows.extend(flight(&moments(1350)));
        rows.extend((0..100).map(|i| format!("{i} {}", "x".repeat(200))));
        let text = fitted(&rows);
        assert!(text.lines().count() <= LINES, "{text}");
        assert!(text.lines().all(|l| l.chars().count() <= COLUMNS));
        for word in ["repeated", "overflow", "unknown", "depth", "pitch", "α", "battery", "abort", "BallastFeedback", "▄"] {
            assert!(text.contains(word), "{word}: {text}");
        }
        assert!(!text.contains("NaN"), "{text}");
        assert_eq!(flight(&VecDeque::new()).len(), 1);
    }

    #[test]
    fn a_sparkline_shows_the_shape() {
        assert_eq!(sparkline(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], 8), "▁▂▃▄▅▆▇█");
        assert_eq!(sparkline(&[1.0, f64::NAN, 1.0], 8), "▄ ▄");
        assert_eq!(sparkline(&(0..1000).map(f64::from).collect::<Vec<_>>(), 4), "▂▄▅▇");
        assert_eq!(sparkline(&[], 8), "");
    }
}

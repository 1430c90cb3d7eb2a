//! `glider margins`: how far the pitch loop is from instability, over the glides that are flown.

use super::{Output, Verdict};
use crate::pages::chart::{Chart, Mark};
use crate::pages::figure::Figure;
use crate::score::margins::{Glide, Margins, Response, all, envelope, respond};
use crate::terminal::{say, table};
use anyhow::bail;
use rig::flight::mission_file::wings_name;
use serde_json::json;
use signals::Wings;
use std::f64::consts::PI;
use std::path::PathBuf;

/// Least gain margin, dB.
pub const GAIN_DB: f64 = 6.0;
/// Least phase margin, degrees.
pub const PHASE_DEG: f64 = 45.0;
/// Least delay margin, control cycles.
pub const DELAY_CYCLES: f64 = 2.0;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider margins                      the table of both wings, pitches, drives and metacentric heights\n  \
glider margins --out out/margins    and the figure (svg, png, csv, json)\n  glider margins --json"
)]
pub struct Args {
    /// Folder for the figure: open loops in the plane of phase and gain.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Whether a glide keeps the margins asked for.
#[must_use]
pub fn keeps(m: &Margins) -> bool {
    m.gain_db >= GAIN_DB && m.phase_deg >= PHASE_DEG && m.delay_cycles >= DELAY_CYCLES
}

/// Runs the command.
///
/// # Errors
/// A glide that does not exist, or a folder that cannot be written.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    if let Some(folder) = args.out.as_ref().filter(|folder| folder.exists() && !folder.is_dir()) {
        bail!("--out {}: is a file; name a folder", folder.display());
    }
    let rows = all(&envelope())?;
    if let Some(folder) = &args.out {
        Figure::from(figure()?).write(folder, "margins")?;
    }
    let fine = rows.iter().all(|(_, m)| keeps(m));
    let least = |of: fn(&Margins) -> f64| rows.iter().map(|(_, m)| of(m)).fold(f64::INFINITY, f64::min);
    let (gain, phase, delay) = (least(|m| m.gain_db), least(|m| m.phase_deg), least(|m| m.delay_cycles));
    let round = |x: f64| (x * 100.0).round() / 100.0;
    let document = json!({
        "asked": {"gain_db": GAIN_DB, "phase_deg": PHASE_DEG, "delay_cycles": DELAY_CYCLES},
        "least": {"gain_db": round(gain), "phase_deg": round(phase), "delay_cycles": round(delay)}, "kept": fine,
        "glides": rows.iter().map(|(g, m)| json!({
            "wings": wings_name(g.wings), "pitch_deg": round(g.pitch_rad.to_degrees()), "ballast_cc": round(g.ballast_m3 * 1e6),
            "metacentric_height_mm": round(g.height_m * 1e3), "speed_m_s": round(m.speed_m_s), "gain_db": round(m.gain_db),
            "phase_deg": round(m.phase_deg), "delay_cycles": round(m.delay_cycles),
        })).collect::<Vec<_>>(),
    });
    output.emit(&document, || {
        let mut t = table(["wings", "pitch", "drive", "height", "speed", "gain", "phase", "delay"]);
        for (g, m) in &rows {
            t.add_row([
                wings_name(g.wings).to_owned(),
                format!("{:.0} deg", g.pitch_rad.to_degrees()),
                format!("{:.0} cc", g.ballast_m3 * 1e6),
                format!("{:.1} mm", g.height_m * 1e3),
                format!("{:.2} m/s", m.speed_m_s),
                format!("{:.1} dB", m.gain_db),
                format!("{:.0} deg", m.phase_deg),
                format!("{:.1} cycles", m.delay_cycles),
            ]);
        }
        println!("{t}");
        say(&format!("least {gain:.1} dB, {phase:.0} deg, {delay:.1} cycles; asked {GAIN_DB} dB, {PHASE_DEG} deg, {DELAY_CYCLES} cycles"));
    });
    Ok(if fine { Verdict::Ok } else { Verdict::Negative })
}

/// An open loop in the plane of phase (degrees) and gain (dB).
fn curve(response: &Response) -> Vec<(f64, f64)> {
    let (mut points, mut turned, mut before) = (Vec::new(), 0.0, None::<f64>);
    for i in 1..=600 {
        let (re, im) = response.open_loop(PI * f64::from(i) / 600.0);
        let angle = im.atan2(re);
        if let Some(before) = before {
            turned -= 2.0 * PI * ((angle - before) / (2.0 * PI)).round();
        }
        before = Some(angle);
        points.push(((angle + turned).to_degrees(), 20.0 * re.hypot(im).log10()));
    }
    points
}

/// The figure.
///
/// # Errors
/// A glide that does not exist.
pub fn figure() -> anyhow::Result<Chart> {
    let mut chart = Chart::lines("Open pitch loop at 26 deg, full drive", "phase, deg", "gain, dB");
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        for share in [0.7, 1.0, 1.3] {
            let nominal = Glide::nominal(wings);
            let response = respond(&Glide { height_m: nominal.height_m * share, ..nominal })?;
            let name = format!("{} wings, height {:.1} mm", wings_name(wings), 1e3 * nominal.height_m * share);
            chart = chart.plus(&name, Mark::Line, curve(&response));
        }
    }
    let (p, g) = (PHASE_DEG, GAIN_DB);
    let corners = [(-180.0 - p, -g), (-180.0 + p, -g), (-180.0 + p, g), (-180.0 - p, g), (-180.0 - p, -g)];
    Ok(chart.plus("asked: 6 dB, 45 deg", Mark::Dashed, corners).within(Some((-360.0, -60.0)), Some((-60.0, 30.0))))
}

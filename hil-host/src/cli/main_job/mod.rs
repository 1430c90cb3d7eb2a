//! `glider` with no arguments: the main job.

mod flights;
mod picture;

use super::{Output, Verdict};
use crate::terminal::{say, table};
use flights::{Findings, best_seat, compare, fly_wings};
use indicatif::{ProgressBar, ProgressStyle};
use rig::flight::closed_loop::End;
use rig::flight::mission_file::wings_name;
use signals::Wings;
use std::path::Path;

/// Runs the main job.
///
/// # Errors
/// What could not be done, and the fix.
pub fn run(output: &Output) -> anyhow::Result<Verdict> {
    let out = Path::new("out");
    let (seat, why) = best_seat(&mut |what| eprintln!("{what} …"));
    if !output.json {
        say(&format!("seat: {seat}, because {why}"));
    }
    let mut flights = Vec::new();
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        let bar = ProgressBar::new(4)
            .with_style(ProgressStyle::with_template("{msg} {bar:30} {pos}/{len} dives {elapsed}").unwrap_or(ProgressStyle::default_bar()))
            .with_message(format!("{} wings, 3–27 m", wings_name(wings)));
        flights.push(fly_wings(wings, &seat, out, &mut |dives| bar.set_position(u64::from(dives)))?);
        bar.finish_and_clear();
    }
    let spinner = ProgressBar::new_spinner().with_message("a real flight against the steady model");
    spinner.enable_steady_tick(std::time::Duration::from_millis(200));
    let fallback = flights.first().map(|f| f.log.clone()).unwrap_or_default();
    let comparison = compare(Path::new("data-cache"), &fallback);
    spinner.finish_and_clear();
    let findings = Findings { seat, why, flights, comparison: comparison? };
    let page = out.join("report.html");
    picture::page(&findings).write(&page)?;
    output.emit(&findings.document(&page), || print(&findings, &page));
    let all_done = findings.flights.iter().all(|f| f.outcome.end == End::Done && f.outcome.dives >= 4);
    Ok(if all_done { Verdict::Ok } else { Verdict::Negative })
}

fn print(f: &Findings, page: &Path) {
    let mut t = table(["wings", "dives", "way, m", "L/D", "(L/D)max", "share, %", "time, s", "pump, J", "end"]);
    for x in &f.flights {
        let o = &x.outcome;
        let l_over_d = o.achieved_l_over_d();
        t.add_row([
            wings_name(x.wings).to_owned(),
            o.dives.to_string(),
            format!("{:.0}", o.distance_m),
            format!("{l_over_d:.3}"),
            format!("{:.3}", x.best.l_over_d),
            format!("{:.1}", 100.0 * l_over_d / x.best.l_over_d),
            format!("{:.0}", o.duration_s),
            format!("{:.0}", o.energy_j.0),
            o.end.to_string(),
        ]);
    }
    println!("{t}");
    if let Some(x) = f.flights.first() {
        say(&format!("flown by the {}", x.seat));
    }
    let c = &f.comparison;
    match &c.why_not {
        None => {
            say(&format!("real flight {} (Slocum Comet, Baltic, 2016), steady model, {} samples:", c.flight.display(), c.report.samples))
        }
        Some(why) => {
            say(&format!("no real flight ({why}); SIMULATED flight {}, steady model, {} samples:", c.flight.display(), c.report.samples))
        }
    }
    say(&format!("  {:.2} cm/s  nominal, before trim", c.report.before_cm_s));
    say(&format!("  {:.2} cm/s  drag and trim fitted, measured in-situ density", c.report.after_cm_s));
    say(&format!("  {}", c.report.identified));
    for x in &f.flights {
        say(&format!("log    {}", x.log.display()));
    }
    say(&format!("report {}", page.display()));
    let shares: Vec<String> = f
        .flights
        .iter()
        .map(|x| {
            format!("{} wings {}, {:.1} %", wings_name(x.wings), x.outcome.end, 100.0 * x.outcome.achieved_l_over_d() / x.best.l_over_d)
        })
        .collect();
    say(&format!("Flown: {} of (L/D)max", shares.join("; ")));
}

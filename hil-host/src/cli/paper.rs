//! `glider paper`: every claim of the source paper beside our number.

use std::path::PathBuf;

use serde_json::json;

use super::{Output, Verdict};
use crate::pages::figure::Figure;
use crate::paper::claims::{self, Evidence};
use crate::paper::{Finding, figures, plates, trials};
use crate::terminal::{say, table};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider paper                       25 claims: the paper's number, ours, reproduced / calibrated / contradicted, why;
                                     every wing law against measured rectangular plates
  glider paper --out out/paper       and figures 3 to 11, the plates as svg, png, csv, json, and one HTML page
  glider paper --json | jq '.claims[] | select(.verdict==\"contradicted\")'")]
pub struct Args {
    /// Folder for the redrawn figures.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// A trial flight failed, or the folder cannot be written.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let evidence = Evidence { trials: trials::all()? };
    let claims = claims::all(&evidence)?;
    let mut files = Vec::new();
    if let Some(out) = &args.out {
        for (stem, chart) in figures::all(&evidence.trials)?.into_iter().chain(plates::charts()) {
            Figure::from(chart).write(out, stem)?;
            files.push(format!("{}.svg", out.join(stem).display()));
        }
        let page = crate::paper::page(&claims, &evidence.trials)?;
        page.write(&out.join("paper.html"))?;
        files.push(out.join("paper.html").display().to_string());
    }
    let count = |f: Finding| claims.iter().filter(|c| c.verdict == f).count();
    let document = json!({
        "tool": env!("CARGO_PKG_VERSION"),
        "reproduced": count(Finding::Reproduced), "calibrated": count(Finding::Calibrated), "contradicted": count(Finding::Contradicted),
        "claims": claims.iter().map(crate::paper::Claim::json).collect::<Vec<_>>(),
        "plates": plates::scores().iter().map(plates::Score::json).collect::<Vec<_>>(),
        "figures": files,
    });
    output.emit(&document, || {
        for c in &claims {
            say(&format!("{:>2}  {}: {}", c.id, c.verdict.word(), c.claim));
            say(&format!("    paper: {}; ours: {}", c.paper, c.ours));
            say(&format!("    {}\n", c.why));
        }
        let mut p = table(plates::head());
        plates::scores().iter().for_each(|s| {
            p.add_row(s.row());
        });
        say(&format!("Wing laws on measured rectangular plates: rms error over 3-20 deg; slope error by plate over 3-8 deg\n{p}"));
        say(&format!(
            "{} reproduced, {} calibrated, {} contradicted",
            count(Finding::Reproduced),
            count(Finding::Calibrated),
            count(Finding::Contradicted)
        ));
        for f in &files {
            say(&format!("wrote {f}"));
        }
    });
    Ok(Verdict::Ok)
}

//! `glider serve`: the workbench as a page on this machine.

use super::diagnose::load;
use super::{Output, Verdict};
use crate::serve::{Workbench, run as serve};
use std::path::PathBuf;

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:\n  glider serve\n  glider serve --flight out/standard --flight out/low-ar --open\n\n\
The page answers only on this machine (127.0.0.1) and only with the token in the printed address.\n\
Stop it with Ctrl-C; logs of flights flown on the page stay in --logs.")]
pub struct Args {
    /// Flight directory or csv offered on the page; again for more.
    #[arg(long = "flight", value_name = "PATH")]
    pub flights: Vec<PathBuf>,
    /// Port; 0 takes a free one.
    #[arg(long, default_value_t = 8140)]
    pub port: u16,
    /// Where logs of flights flown on the page go.
    #[arg(long, default_value = "out/workbench", value_name = "DIR")]
    pub logs: PathBuf,
    /// Open the page in the default browser.
    #[arg(long)]
    pub open: bool,
}

/// Runs the command.
///
/// # Errors
/// A flight that is not there, or a port that is taken.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    for path in &args.flights {
        // Read once here: what the page could not open is said before there is a page.
        load(path, None)?;
    }
    let bench = Workbench { offered: args.flights.clone(), logs: args.logs.clone(), ..Workbench::default() };
    serve(args.port, bench, |address| {
        output.emit(&serde_json::json!({"address": address}), || {
            println!("Workbench: {address}\nStop it with Ctrl-C.");
        });
        if args.open && std::process::Command::new("xdg-open").arg(address).spawn().is_err() {
            eprintln!("glider: no xdg-open here; open the address yourself");
        }
    })?;
    Ok(Verdict::Ok)
}

//! `glider polar`.

use super::{Output, Verdict};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
pub struct Args {}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(_args: &Args, _output: &Output) -> anyhow::Result<Verdict> {
    anyhow::bail!("not there yet")
}

//! `glider upload`.

use super::{Output, Verdict};
use crate::mission_file;
use crate::seats::port::Port;
use crate::seats::upload::upload;
use crate::seats::{Link, Seat};
use anyhow::{Context, bail};
use control::Config;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use signals::link::CRC32;
use signals::{Object, Wings};
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider upload /dev/ttyACM0 table-low-ar new_table.bin\n  glider upload /dev/ttyACM0 mission mission.toml\n\n\
The board checks CRC and content, keeps the version before, and is read back and compared."
)]
pub struct Args {
    /// Serial port of the board.
    port: String,
    /// What the file is.
    #[arg(value_parser = ["table-standard", "table-low-ar", "mission"])]
    object: String,
    /// Table (.bin, as `glider table` writes it) or mission (.toml).
    file: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let (object, bytes) = prepare(&args.object, &args.file)?;
    let mut link = Link::new(Port::open(&args.port)?);
    link.hello()?;
    let bar = ProgressBar::new(2 * bytes.len() as u64)
        .with_style(ProgressStyle::with_template("{msg} {bar:40} {bytes}/{total_bytes}").unwrap_or(ProgressStyle::default_bar()))
        .with_message(format!("{} → {}", args.object, args.port));
    let stored = upload(&mut link, object, &bytes, |done, _| bar.set_position(done as u64))?;
    bar.finish_and_clear();
    let document = json!({ "object": args.object, "file": args.file, "bytes": bytes.len(), "crc": format!("{:08x}", CRC32.checksum(&bytes)),
        "board": link.describe(), "in_use_crc": format!("{:08x}", stored.crc), "kept_on_flash": stored.for_good });
    output.emit(&document, || {
        let kept = if stored.for_good { "kept on flash" } else { "in use until the next reset (this board's flash does not keep it)" };
        println!("{}: {} bytes, CRC {:08x}, stored, read back and equal; {kept}", args.object, bytes.len(), CRC32.checksum(&bytes));
    });
    Ok(Verdict::Ok)
}

/// Reads and checks a file before the board sees it.
fn prepare(object: &str, file: &Path) -> anyhow::Result<(Object, Vec<u8>)> {
    let name = file.display();
    let table = |wings| -> anyhow::Result<(Object, Vec<u8>)> {
        let bytes = std::fs::read(file).with_context(|| format!("{name}: cannot read this file"))?;
        polar::Table::parse(&bytes, wings)
            .map_err(|e| anyhow::anyhow!("{name}: not a table for these wings: {e:?}; make one with glider table"))?;
        Ok((Object::Table(wings), bytes))
    };
    match object {
        "table-standard" => table(Wings::Standard),
        "table-low-ar" => table(Wings::LowAspectRatio),
        "mission" => {
            let mission = mission_file::load(&file.to_string_lossy(), |_| {
                let c = Config::default();
                mission_file::Limits { working_depth_m: c.working_depth_m, pump_m3: c.pump_m3 }
            })?;
            let mut buffer = [0u8; 512];
            let used = postcard::to_slice(&mission, &mut buffer).map_err(|e| anyhow::anyhow!("{name}: mission does not fit: {e}"))?;
            Ok((Object::Mission, used.to_vec()))
        }
        other => bail!("{other} is not table-standard, table-low-ar or mission"),
    }
}

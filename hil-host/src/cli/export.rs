//! `glider export`: a flight in the formats others read.

use super::{Output, Verdict};
use anyhow::Context;
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider export data-cache/comet2016 --to parquet
  glider export out/flight --to netcdf --out flight.nc
  glider export tidy.csv --to csv --out flight.csv")]
pub struct Args {
    /// Flight directory, or a csv.
    flight: PathBuf,
    /// Format.
    #[arg(long, value_enum)]
    to: Format,
    /// File to write [default: the flight's name with the format's ending, in the current folder].
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Format to write.
#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Format {
    /// The project's own flight.csv.
    Csv,
    /// Parquet, for pandas, polars, DuckDB.
    Parquet,
    /// NetCDF classic with OG1-like names.
    Netcdf,
}

impl Format {
    fn ending(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
            Self::Netcdf => "nc",
        }
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let flight = discovery::record::csv::flight(&args.flight)?;
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("{}.{}", flight.name, args.to.ending())));
    crate::whole_file::may_write(&out, &[&args.flight], &[args.to.ending()], output.force)?;
    let context = || format!("cannot write {}", out.display());
    let start_unix_s = start_unix_s(&args.flight);
    crate::whole_file::at(&out, |part| -> anyhow::Result<()> {
        match args.to {
            Format::Csv => discovery::export::csv::write(&flight, std::fs::File::create(part)?)?,
            Format::Parquet => discovery::export::parquet::write(&flight, std::fs::File::create(part)?)?,
            Format::Netcdf => discovery::export::netcdf::write(&flight, part, start_unix_s)?,
        }
        Ok(())
    })
    .with_context(context)?;
    let bytes = std::fs::metadata(&out).with_context(context)?.len();
    let document = serde_json::json!({ "flight": args.flight, "out": out, "rows": flight.len(), "bytes": bytes });
    output.emit(&document, || println!("wrote {} ({} rows, {bytes} bytes)", out.display(), flight.len()));
    Ok(Verdict::Ok)
}

/// Date of the flight, if an import left it beside the flight.
fn start_unix_s(flight: &Path) -> Option<f64> {
    let text = std::fs::read_to_string(flight.join("import.json")).ok()?;
    let said: serde_json::Value = serde_json::from_str(&text).ok()?;
    said.pointer("/report/start_unix_s")?.as_f64()
}

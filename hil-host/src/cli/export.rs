//! `glider export`: a flight in the formats others read.

use super::compare::not_diverged;
use super::{Output, Verdict};
use crate::fleet::archive::{import_json, origins, start_unix_s};
use crate::terminal::wrapped;
use anyhow::Context;
use discovery::workbench::compare::{Comparison, compare};
use logs::export::mcap::Stream;
use logs::export::netcdf::{About, Number, Series};
use logs::import::calendar::{compact_date, iso_8601};
use logs::record::bounded;
use logs::{Flight, Vehicle, vehicle};
use rig::flight::file_kinds::{Kind, expect};
use rig::flight::vehicles;
use rig::spelling::meant_path;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider export data-cache/comet2016 --to parquet
  glider export out/flight --to netcdf --start 2026-05-02T09:15:00Z --meta people.toml
  glider export out/flight --to mcap --out flight.mcap      for Foxglove, Lichtblick, PlotJuggler, rerun
  glider export tidy.csv --to csv --out flight.csv

netcdf is OceanGliders OG1.0. With a vehicle, beside the flight or by --vehicle, netcdf and mcap hold its model too: vertical
velocity, speed and angle of attack, and the vertical water velocity that remains.
--meta: a TOML of texts such as contributor_name, contributor_email, contributing_institutions, PLATFORM_MODEL,
PLATFORM_SERIAL_NUMBER, WMO_IDENTIFIER.")]
pub struct Args {
    /// Flight directory, or a csv.
    flight: PathBuf,
    /// Format.
    #[arg(long, value_enum)]
    to: Format,
    /// File to write [default: the flight's name with the format's ending, in the current folder].
    #[arg(long)]
    out: Option<PathBuf>,
    /// Vehicle file whose model goes along, or a built-in one by name; default: the one beside the flight.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// Date of the first row, ISO 8601, where the import left none.
    #[arg(long)]
    start: Option<String>,
    /// TOML of what people know of the flight.
    #[arg(long)]
    meta: Option<PathBuf>,
}

/// Format to write.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    /// The project's own flight.csv.
    Csv,
    /// Parquet, for pandas, polars, DuckDB.
    Parquet,
    /// NetCDF-4, OceanGliders OG1.0.
    Netcdf,
    /// MCAP, for viewers of robot logs.
    Mcap,
}

impl Format {
    fn ending(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
            Self::Netcdf => "nc",
            Self::Mcap => "mcap",
        }
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    anyhow::ensure!(args.flight.exists(), "{}: no such flight{}", args.flight.display(), meant_path(&args.flight));
    expect(&args.flight, Kind::Flight)?;
    let flight = logs::record::csv::log(&args.flight)?;
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("{}.{}", flight.name, args.to.ending())));
    let inputs: Vec<&Path> = [Some(args.flight.as_path()), args.vehicle.as_deref(), args.meta.as_deref()].into_iter().flatten().collect();
    rig::whole_file::may_write(&out, &inputs, &[args.to.ending()], output.force)?;
    let vehicle = if matches!(args.to, Format::Netcdf | Format::Mcap) { vehicle_of(args)? } else { None };
    let model = match &vehicle {
        Some(vehicle) => modelled(args, &flight, vehicle)?.map(|compared| (vehicle, compared)),
        None => None,
    };
    let span = [flight.time_s.first(), flight.time_s.last()].map(|t| t.copied().unwrap_or(0.0));
    let (about, mut notes) = about(args, span)?;
    notes.extend(flight.unread.iter().map(|what| format!("left out: {what}")));
    notes.extend(undated(args, &about));
    rig::whole_file::at(&out, |part| -> anyhow::Result<()> {
        match args.to {
            Format::Csv => logs::export::csv::write(&flight, std::fs::File::create(part)?)?,
            Format::Parquet => logs::export::parquet::write(&flight, std::fs::File::create(part)?, about.start_unix_s, &about.origins)?,
            Format::Netcdf => {
                let mut about = about;
                about.series = model.as_ref().map_or_else(Vec::new, |(_, compared)| series(&flight, compared));
                about.vehicle = vehicle.as_ref().map_or_else(Vec::new, numbers);
                about.vehicle_file = vehicle.as_ref().map(|v| v.document.to_string());
                logs::export::netcdf::write(&flight, part, &about)?;
            }
            Format::Mcap => mcap(&flight, &about, model.as_ref(), part)?,
        }
        Ok(())
    })
    .with_context(|| format!("cannot write {}", out.display()))?;
    let bytes = std::fs::metadata(&out).with_context(|| out.display().to_string())?.len();
    let document = serde_json::json!({ "flight": args.flight, "out": out, "rows": flight.len(), "bytes": bytes, "notes": notes });
    output.emit(&document, || {
        notes.iter().for_each(|note| println!("{}", wrapped(&format!("note: {note}"), 6)));
        println!("wrote {} ({} rows, {bytes} bytes)", out.display(), flight.len());
    });
    Ok(Verdict::Ok)
}

/// The vehicle named or beside the flight.
fn vehicle_of(args: &Args) -> anyhow::Result<Option<Vehicle>> {
    let own_file = || vehicle::file_next_to(&args.flight);
    let path = args.vehicle.clone().map_or_else(own_file, |named| Ok(Some(named)))?;
    path.map(|path| vehicles::read(&path)).transpose()
}

/// Its model against the flight; without pitch, ballast or density there is none, unless the vehicle is named.
fn modelled(args: &Args, flight: &Flight, vehicle: &Vehicle) -> anyhow::Result<Option<Comparison>> {
    let known = |column: &[f64]| column.iter().any(|v| v.is_finite());
    let all = [&flight.pitch_rad, &flight.ballast_m3, &flight.density_kg_m3].iter().all(|c| known(c));
    (all || args.vehicle.is_some()).then(|| not_diverged(compare(flight, vehicle), vehicle)).transpose()
}

/// What the format or the flight leaves out of the date and the places.
fn undated(args: &Args, about: &About) -> Option<String> {
    match (args.to, about.start_unix_s) {
        (Format::Csv, start) if start.is_some() || !about.origins.is_empty() => Some(format!(
            "a csv holds neither the date of its first row{} nor where on the globe its fixes lie: keep the flight's import.json",
            start.map_or_else(String::new, |s| format!(" ({})", compact_date(s)))
        )),
        (Format::Netcdf | Format::Mcap, None) => {
            Some("the flight has no date: its times count from its start; --start DATE dates it".into())
        }
        _ => None,
    }
}

/// Date of `--start`, in the time of gliders; no time of the log, which has this span.
fn start_of(text: &str, [first_s, last_s]: [f64; 2]) -> anyhow::Result<f64> {
    anyhow::ensure!(
        text.parse::<f64>().is_err(),
        "--start {text}: expected the date of the first row, such as 2026-05-02T09:15:00Z; the log spans {first_s:.0} to {last_s:.0} s, \
         and all of it is written"
    );
    let unix_s = iso_8601(text).with_context(|| format!("--start {text}: expected a date such as 2026-05-02T09:15:00Z"))?;
    let possible = ["1990-01-01T00:00:00Z", "2100-01-01T00:00:00Z"].map(|date| iso_8601(date).unwrap_or(f64::NAN));
    anyhow::ensure!(
        unix_s >= possible[0] && unix_s < possible[1],
        "--start {text}: expected a date between 1990, before any glider, and 2100"
    );
    Ok(unix_s)
}

/// Date, places and people: of the import, and of the arguments; `span` has the times of first and last row. With notes.
fn about(args: &Args, span: [f64; 2]) -> anyhow::Result<(About, Vec<String>)> {
    let import = import_json(&args.flight);
    let imported = start_unix_s(&import);
    let stated = args.start.as_deref().map(|text| start_of(text, span)).transpose()?.map(|date| date - span[0]);
    let replaced = imported.zip(stated).filter(|(was, is)| (was - is).abs() > 1.0);
    let notes = replaced.map(|(was, is)| {
        format!("--start {} takes the place of the date of import.json, {}: {:+.0} s", compact_date(is), compact_date(was), is - was)
    });
    let start = stated.or(imported);
    let mut stated = BTreeMap::new();
    if let Some(path) = &args.meta {
        let text = bounded::text(path, bounded::DOCUMENT).with_context(|| format!("cannot read {}", path.display()))?;
        let table: toml::Table = toml::from_str(&text).with_context(|| path.display().to_string())?;
        for (key, value) in table {
            let text = value.as_str().with_context(|| format!("{}: {key} is no text", path.display()))?;
            stated.insert(key, text.to_owned());
        }
    }
    let written = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64());
    let about = About { start_unix_s: start, origins: origins(&import), stated, written_unix_s: written, ..About::default() };
    Ok((about, notes.into_iter().collect()))
}

/// The model on the rows of the flight: name, unit, what it is, values.
fn series(flight: &Flight, compared: &Comparison) -> Vec<Series> {
    let column = |value: &dyn Fn(&discovery::workbench::compare::Sample) -> f64| {
        let mut values = vec![f64::NAN; flight.len()];
        for s in &compared.samples {
            let row = flight.time_s.partition_point(|t| *t < s.time_s - 1e-6);
            if flight.time_s.get(row).is_some_and(|t| (t - s.time_s).abs() < 1e-3) {
                values[row] = value(s);
            }
        }
        values
    };
    let one = |name, unit, what, values| Series { name, unit, what, values };
    vec![
        one("GLIDER_VERT_VELO_DZDT", "m s-1", "vertical velocity of the glider from pressure, up positive", column(&|s| -s.observed_m_s)),
        one(
            "GLIDER_VERT_VELO_MODEL",
            "m s-1",
            "vertical velocity of the glider by the flight model, up positive",
            column(&|s| -s.modelled_m_s),
        ),
        one(
            "VERT_CURR_MODEL",
            "m s-1",
            "vertical water velocity: from pressure less by model, up positive",
            column(&|s| s.modelled_m_s - s.observed_m_s),
        ),
        one(
            "GLIDER_HORZ_VELO_MODEL",
            "m s-1",
            "horizontal speed through the water by the flight model",
            column(&|s| (s.speed_m_s.powi(2) - s.modelled_m_s.powi(2)).max(0.0).sqrt()),
        ),
        one("GLIDER_ALPHA_MODEL", "degree", "angle of attack by the flight model", column(&|s| s.alpha_rad.to_degrees())),
    ]
}

/// The numbers of the vehicle as scalars.
fn numbers(vehicle: &Vehicle) -> Vec<Number> {
    let (c, t) = (&vehicle.constants, &vehicle.tolerance);
    let one = |name, unit, what, value, sigma| Number { name, unit, what, value, sigma };
    vec![
        one("GLIDER_MASS", "kg", "mass in air", c.mass_kg, f64::NAN),
        one(
            "GLIDER_VOLUME",
            "m3",
            "displaced volume at zero gauge pressure, reference temperature and ballast reading 0",
            c.hull_volume_m3,
            t.trim_volume_m3,
        ),
        one(
            "GLIDER_COMPRESSIBILITY",
            "Pa-1",
            "relative loss of volume per pressure",
            c.compressibility_per_pa,
            t.hull_compressibility_relative * c.compressibility_per_pa,
        ),
        one(
            "GLIDER_THERMAL_EXPANSION",
            "K-1",
            "relative gain of volume per temperature",
            c.thermal_expansion_per_k,
            t.hull_thermal_expansion_relative * c.thermal_expansion_per_k.abs(),
        ),
        one(
            "GLIDER_REFERENCE_TEMPERATURE",
            "degree_Celsius",
            "temperature at which the volume holds",
            c.reference_temperature_degc,
            f64::NAN,
        ),
        one("GLIDER_REFERENCE_AREA", "m2", "area of the coefficients of lift and drag", c.reference_area_m2, f64::NAN),
        one(
            "GLIDER_LIFT_SLOPE",
            "rad-1",
            "lift coefficient per angle of attack",
            c.lift_slope_per_rad,
            t.lift_slope_relative * c.lift_slope_per_rad,
        ),
        one("GLIDER_DRAG_ZERO_LIFT", "1", "drag coefficient at zero lift", c.cd0, t.cd0_relative * c.cd0),
        one("GLIDER_DRAG_QUADRATIC", "rad-2", "drag coefficient per angle of attack squared", c.hull_drag_per_rad2, f64::NAN),
        one("GLIDER_ADDED_MASS_SURGE", "1", "added mass along the hull, share of the mass", c.added_mass_surge, t.added_mass_surge),
        one("GLIDER_ADDED_MASS_HEAVE", "1", "added mass across the hull, share of the mass", c.added_mass_heave, t.added_mass_heave),
    ]
}

fn mcap(flight: &Flight, about: &About, model: Option<&(&Vehicle, Comparison)>, part: &Path) -> anyhow::Result<()> {
    let mut streams = logs::export::mcap::streams(flight);
    let mut attached = Vec::new();
    if let Some((vehicle, compared)) = model {
        let of = |names: &[&str]| {
            let chosen = series(flight, compared).into_iter().filter(|s| names.contains(&s.name));
            chosen
                .map(|s| (format!("{}_{}", s.name.to_lowercase(), s.unit.replace(' ', "_").replace("-1", "_1")), s.values))
                .collect::<Vec<_>>()
        };
        streams.push(Stream {
            topic: "/glider/model".into(),
            fields: of(&["GLIDER_VERT_VELO_MODEL", "GLIDER_HORZ_VELO_MODEL", "GLIDER_ALPHA_MODEL"]),
        });
        streams.push(Stream { topic: "/glider/residual".into(), fields: of(&["GLIDER_VERT_VELO_DZDT", "VERT_CURR_MODEL"]) });
        attached.push(("vehicle.json", "application/json", format!("{:#}\n", vehicle.document).into_bytes()));
    }
    let file = std::io::BufWriter::new(std::fs::File::create(part)?);
    logs::export::mcap::write(flight, &streams, about.start_unix_s, &about.origins, &attached, file)?;
    Ok(())
}

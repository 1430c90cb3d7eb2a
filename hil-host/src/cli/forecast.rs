//! `glider forecast`.

use super::calibrate::named_once;
use super::{Output, Verdict};
use crate::calls::{self, Call};
use crate::fleet::archive::{Placed, read_placed};
use crate::fleet::joined::joined;
use crate::pages::forecast_map::{in_kilometres, over_ground, round, with_forecast};
use crate::pages::places::{LatLon, Place, geojson, kml, polygon};
use crate::pages::{Mark, Page, Provenance, Section, Table};
use crate::terminal::{say, table, wrapped};
use anyhow::{Context as _, bail, ensure};
use discovery::diagnosis::report::number;
use discovery::forecast::current::Vector;
use discovery::forecast::mission::{Dive, Mission, Plan, Surfacing};
use discovery::forecast::passages::{Fix, Frame, Passages, passages};
use discovery::forecast::planned::{Glides, Order};
use discovery::forecast::region::{COVERAGE, Misses, inside_polygon};
use logs::import::position;
use logs::record::bounded;
use logs::{Vehicle, vehicle};
use rig::flight::file_kinds::is_surfacings;
use rig::flight::{mission_file, vehicles, worlds};
use rig::whole_file;
use serde_json::{Value, json};
use signals::Goal;
use std::path::{Path, PathBuf};

/// Arguments of the command.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  glider forecast --flight mission_dir --vehicle calibrated.json
  glider forecast --flight d1 --flight d2 --mission next.toml --kml next.kml
  glider forecast --flight mission_dir --heading 135 --hours 6 --surfacings 2
  glider forecast --flight mission_dir --circle 27.45,-90.61,2000 --json
  glider forecast --flight mission_dir --to 27.62,-90.61 --geojson next.geojson
  glider forecast --flight call1.log --flight call2.log --flight call3.log

Logs of one mission, with GPS fixes at the surface. Without --mission the next dives are as the last one was; a mission's dives are flown
with drag and trim as the log has them. An ellipse holds the surfacing with 90 %: its size is learnt from the misses of this mission, and
the answer says on how many surfacings it rests. Figures: docs/forecast.md; glider scorecard forecast.

Exit code: 0 done, 2 bad input, such as a log without fixes before and after a dive.")]
pub struct Args {
    /// Flight directory, csv or a glider's own file, or the log of a call with a message of a surfacing in it; several of one mission may be named.
    #[arg(long, value_name = "LOG", required = true)]
    flight: Vec<PathBuf>,
    /// Vehicle file, or a built-in one by name; default: the one beside the first flight.
    #[arg(long, value_name = "FILE|NAME")]
    vehicle: Option<PathBuf>,
    /// Mission that is flown next, a built-in one or a TOML file.
    #[arg(long, value_name = "NAME|FILE.toml", conflicts_with_all = ["heading", "hours"])]
    mission: Option<String>,
    /// How many surfacings.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..=50))]
    surfacings: u16,
    /// Heading of the next dives, deg clockwise from north; default: the last one's.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    heading: Option<f64>,
    /// Duration of the next dives, h; default: the last one's.
    #[arg(long, value_name = "H")]
    hours: Option<f64>,
    /// Launch point of the last segment with fixes, where no import.json says it, deg.
    #[arg(long, value_name = "LAT,LON", allow_hyphen_values = true)]
    origin: Option<String>,
    /// Probability of coming up inside a circle, deg and m.
    #[arg(long, value_name = "LAT,LON,RADIUS_M", allow_hyphen_values = true, conflicts_with = "polygon")]
    circle: Option<String>,
    /// Probability of coming up inside the polygon of a GeoJSON file.
    #[arg(long, value_name = "FILE.geojson")]
    polygon: Option<PathBuf>,
    /// Time until a recovery point, deg.
    #[arg(long, value_name = "LAT,LON", allow_hyphen_values = true)]
    to: Option<String>,
    /// Write a page with a map and a table.
    #[arg(long, value_name = "FILE.html")]
    out: Option<PathBuf>,
    /// Write places and ellipses as GeoJSON.
    #[arg(long, value_name = "FILE.geojson")]
    geojson: Option<PathBuf>,
    /// Write places and ellipses as KML.
    #[arg(long, value_name = "FILE.kml")]
    kml: Option<PathBuf>,
}

/// Numbers of an option that are parted by commas, the first two a place on the globe.
fn numbers<const N: usize>(option: &str, text: &str) -> anyhow::Result<[f64; N]> {
    let all: Result<Vec<f64>, _> = text.split(',').map(|x| x.trim().parse::<f64>()).collect();
    let numbers = all.ok().and_then(|v| <[f64; N]>::try_from(v).ok());
    let numbers = numbers.with_context(|| format!("{option} {text}: expected {N} numbers parted by commas, such as 27.45,-90.61"))?;
    let sound = numbers[0].abs() <= 89.0 && numbers[1].abs() <= 360.0 && numbers.iter().all(|x| x.is_finite());
    ensure!(sound, "{option} {text}: latitude -89 to 89 deg, longitude -180 to 360 deg");
    Ok(numbers)
}

/// Where the vehicle is asked to be, m from the origin.
enum Area {
    Circle(Vector, f64),
    Polygon(Vec<Vector>),
}

impl Area {
    fn holds(&self, place: Vector) -> bool {
        match self {
            Self::Circle(middle, radius_m) => (place - middle).norm() <= *radius_m,
            Self::Polygon(corners) => inside_polygon(corners, place),
        }
    }

    /// Its edge, closed.
    fn edge(&self) -> Vec<(f64, f64)> {
        match self {
            Self::Circle(middle, radius_m) => round([*radius_m; 2], 0.0).map(|(e, n)| (middle.re + e, middle.im + n)).collect(),
            Self::Polygon(corners) => corners.iter().chain(corners.first()).map(|c| (c.re, c.im)).collect(),
        }
    }
}

/// A plan of dives, and where it is from.
struct Planned {
    dives: Vec<Dive>,
    plan: Plan,
    source: Value,
}

/// Runs the command.
///
/// # Errors
/// Bad input, with the file and the fix.
pub fn run(args: &Args, output: &Output) -> anyhow::Result<Verdict> {
    let inputs: Vec<&Path> = args.flight.iter().chain(&args.vehicle).chain(&args.polygon).map(PathBuf::as_path).collect();
    for (out, ending) in [(&args.out, &["html"][..]), (&args.geojson, &["geojson", "json"][..]), (&args.kml, &["kml"][..])] {
        out.as_ref().map_or(Ok(()), |out| whole_file::may_write(out, &inputs, ending, output.force))?;
    }
    ensure!(args.hours.is_none_or(|h| (0.1..=240.0).contains(&h)), "--hours: expected 0.1 to 240");
    ensure!(args.heading.is_none_or(|h| h.abs() <= 360.0), "--heading: expected -360 to 360 deg");
    let Read { log, found, zero_unix_s, mut notes } =
        if args.flight.iter().any(|f| is_surfacings(f)) { of_calls(args)? } else { read(args)? };
    let given = args.origin.as_deref().map(|o| numbers::<2>("--origin", o)).transpose()?;
    let (found, origin) = with_origin(found, given);
    let (Some((last, frame)), false) = (found.last, found.all.is_empty()) else {
        let lack = match log {
            Some(_) => "no dive with GPS fixes before and after it in one segment, or in segments with places in import.json",
            None => "no two calls with a dive between them, a waypoint in the first and a message in the second",
        };
        bail!("{}: {lack}", args.flight[0].display());
    };
    let (mission, _) = Mission::of(found.latitude_deg, &found.all);
    if found.latitude_deg.is_none() {
        notes.push("the latitude is not known: inertial oscillations of all latitudes are weighed; --origin names it".to_owned());
    }
    let planned = plan(args, log.as_ref(), &mission)?;
    let ahead = mission.ahead(&last, &planned.dives, planned.plan);
    let places = Places { origin, frame };
    let area = area(args, &places)?;
    let inside = |s: &Surfacing| area.as_ref().map(|a| s.region.probability(|p| a.holds(p)));
    let inside: Vec<Option<f64>> = ahead.iter().map(inside).collect();
    let to = args.to.as_deref().map(|to| numbers::<2>("--to", to)).transpose()?;
    let to = to.map(|[lat, lon]| places.local("--to", (lat, lon))).transpose()?;
    let to = to.map(|to| mission.time_to(&last, to, &planned.dives[0]).map(|t| t.map(|s| s / 3600.0)));
    let forecast = Forecast { last, ahead, inside, to, planned, notes, zero_unix_s };
    let document = forecast.document(&mission, &places);
    write(args, &forecast, &places)?;
    if let Some(out) = &args.out {
        let so_far: Vec<Vector> = found.all[found.same_frame_from..].iter().flat_map(|p| [p.from.place, p.to.place]).collect();
        forecast.page(&mission, &places, &document, &so_far, area.as_ref())?.write(out)?;
    }
    output.emit(&document, || forecast.said(&mission, &places, args));
    Ok(Verdict::Ok)
}

/// A mission so far.
struct Read {
    /// The logs as one, and the vehicle; none of a mission by its calls.
    log: Option<(Placed, Vehicle)>,
    found: Passages,
    zero_unix_s: Option<f64>,
    notes: Vec<String>,
}

/// A mission by the logs of its calls.
fn of_calls(args: &Args) -> anyhow::Result<Read> {
    let one = |path: &PathBuf| {
        bounded::bytes(path, bounded::LOG).map(|b| Call::of(&b)).with_context(|| format!("{}: cannot read", path.display()))
    };
    let calls = args.flight.iter().map(one).collect::<anyhow::Result<Vec<_>>>()?;
    let (found, zero_s, left_out) = calls::passages(calls).with_context(|| {
        let name = args.flight[0].display();
        format!("{name}: a message of a surfacing has no position: name the logs of the calls, in which the glider's own lines `Curr Time`, `GPS Location` and `sensor:c_wpt_lat` stand with it, or the flight logs")
    })?;
    let mut notes =
        vec!["messages have no heading: each dive is taken to have been steered for the waypoint that the call before it names".to_owned()];
    if left_out > 0 {
        notes.push(format!("dives left out, without a message or a waypoint: {left_out}"));
    }
    Ok(Read { log: None, found, zero_unix_s: Some(zero_s), notes })
}

/// A mission by its flight logs.
fn read(args: &Args) -> anyhow::Result<Read> {
    let mut logs: Vec<Placed> = Vec::new();
    for path in &args.flight {
        ensure!(path.exists(), "{}: no such flight{}", path.display(), rig::spelling::meant_path(path));
        let log = read_placed(std::slice::from_ref(path))?;
        named_once(path, &log.flight, args.flight.iter().zip(logs.iter().map(|l| &l.flight)))?;
        logs.push(log);
    }
    let own_file = || vehicle::file_next_to(&args.flight[0]);
    let file = args.vehicle.clone().map_or_else(own_file, |named| Ok(Some(named)))?;
    let file = file.with_context(|| format!("{}: no vehicle file beside it; name one with --vehicle", args.flight[0].display()))?;
    let vehicle = vehicles::read(&file)?;
    let (log, notes) = joined(logs)?;
    let (found, zero_unix_s) = (passages(&log.flight, &vehicle, &log.origins), log.zero_unix_s);
    Ok(Read { log: Some((log, vehicle)), found, zero_unix_s, notes })
}

/// Passages with the origin of their last frame, by the log or as it is given.
fn with_origin(mut found: Passages, given: Option<[f64; 2]>) -> (Passages, Option<LatLon>) {
    let origin = match (found.last, given) {
        (Some((_, Frame::Globe(lat, lon))), _) => Some((lat, lon)),
        (_, Some([lat, lon])) => Some((lat, lon)),
        _ => None,
    };
    found.latitude_deg = found.latitude_deg.or(origin.map(|o| o.0));
    (found, origin)
}

/// Places on the globe and in the frame of the last fix.
struct Places {
    origin: Option<LatLon>,
    frame: Frame,
}

impl Places {
    fn globe(&self, place: Vector) -> Option<LatLon> {
        self.origin.map(|o| position::globe(o, place.re, place.im))
    }

    fn local(&self, option: &str, (lat_deg, lon_deg): LatLon) -> anyhow::Result<Vector> {
        let remedy = "the flight does not say where on the globe it was: name the launch point of its last segment with --origin LAT,LON";
        let origin = self.origin.with_context(|| format!("{option}: {remedy}"))?;
        let fix = |(lat_deg, lon_deg)| position::Fix { time_s: 0.0, lat_deg, lon_deg };
        let (east_m, north_m) = position::local(fix(origin), fix((lat_deg, lon_deg)));
        Ok(Vector::new(east_m, north_m))
    }

    fn document(&self, place: Vector) -> Value {
        let globe = self.globe(place);
        json!({"east_m": number(place.re), "north_m": number(place.im), "lat_deg": globe.map(|g| g.0), "lon_deg": globe.map(|g| g.1)})
    }
}

fn area(args: &Args, places: &Places) -> anyhow::Result<Option<Area>> {
    if let Some(circle) = &args.circle {
        let [lat, lon, radius_m] = numbers::<3>("--circle", circle)?;
        ensure!(radius_m > 0.0, "--circle {circle}: the radius is in metres and positive");
        return Ok(Some(Area::Circle(places.local("--circle", (lat, lon))?, radius_m)));
    }
    let Some(file) = &args.polygon else { return Ok(None) };
    let name = file.display();
    let text = bounded::text(file, bounded::DOCUMENT).with_context(|| format!("{name}: cannot read"))?;
    let document: Value = serde_json::from_str(&text).with_context(|| format!("{name}: not JSON"))?;
    let corners = polygon(&document).with_context(|| format!("{name}: no Polygon with at least three corners in it"))?;
    Ok(Some(Area::Polygon(corners.into_iter().map(|c| places.local("--polygon", c)).collect::<anyhow::Result<_>>()?)))
}

/// Dives to come: of a mission, or the last one again.
fn plan(args: &Args, log: Option<&(Placed, Vehicle)>, mission: &Mission) -> anyhow::Result<Planned> {
    let Some(name) = &args.mission else {
        let dive = mission.again(args.heading.map(f64::to_radians), args.hours.map(|h| h * 3600.0)).context("no passage")?;
        // A heading that is ordered is known; without one the last dive stands in for the next.
        let plan = if args.heading.is_some() { Plan::Known } else { Plan::Repeated };
        let source = json!({"from": "the last dive", "known": plan == Plan::Known});
        return Ok(Planned { dives: vec![dive; usize::from(args.surfacings)], plan, source });
    };
    let (log, vehicle) = log.context("--mission: drag and trim are learnt from flight logs; of calls name --heading and --hours")?;
    let asked = mission_file::load(name, worlds::limits)?;
    let glides = Glides::of(&log.flight, vehicle).map_err(anyhow::Error::msg)?;
    let usual_pitch_rad = glides.usual_pitch_rad();
    let (mut dives, mut without_fix) = (Vec::new(), 0);
    let mut now: Option<Dive> = None;
    for leg in &asked.legs {
        let pitch_rad = match leg.goal {
            Goal::FixedPitch { pitch_rad } => f64::from(pitch_rad),
            _ => usual_pitch_rad,
        };
        for k in 0..leg.dives {
            let top_m = if now.is_none() && k == 0 { 0.0 } else { f64::from(leg.depth_min_m) };
            let depth_m = [top_m, f64::from(leg.depth_max_m)];
            let order = Order { pitch_rad, ballast_m3: f64::from(leg.ballast_m3), depth_m, heading_rad: f64::from(leg.heading_rad) };
            let dive = glides.dive(&order).map_err(|e| anyhow::anyhow!("{name}: {e}"))?;
            let sum = now.map_or(dive, |n| Dive { time_s: n.time_s + dive.time_s, through_water: n.through_water + dive.through_water });
            now = Some(sum);
            without_fix += 1;
            if asked.surface_every > 0 && without_fix >= asked.surface_every {
                dives.extend(now.take());
                without_fix = 0;
            }
        }
    }
    dives.extend(now);
    dives.truncate(usize::from(args.surfacings));
    let with_error = |(value, sigma): (f64, f64), unit: f64| json!({"value": number(value * unit), "sigma": number(sigma * unit)});
    let (drag, trim) = (with_error(glides.drag_relative, 100.0), with_error(glides.trim_kg, 1.0));
    let source = json!({"from": name, "known": true, "drag_percent": drag, "trim_kg": trim});
    Ok(Planned { dives, plan: Plan::Known, source })
}

/// All that is answered.
struct Forecast {
    last: Fix,
    ahead: Vec<Surfacing>,
    inside: Vec<Option<f64>>,
    to: Option<[Option<f64>; 3]>,
    planned: Planned,
    notes: Vec<String>,
    zero_unix_s: Option<f64>,
}

impl Forecast {
    fn misses<'a>(&self, mission: &'a Mission) -> &'a Misses {
        &mission.misses[usize::from(self.planned.plan == Plan::Repeated)]
    }

    fn rests_on(&self, mission: &Mission) -> String {
        let Misses { surfacings, inside, .. } = self.misses(mission);
        let word = if *surfacings < 10 { ": too few to be sure of its size" } else { "" };
        format!("its size rests on {surfacings} earlier surfacings of this mission, {inside} of which lay in their ellipse{word}")
    }

    fn document(&self, mission: &Mission, places: &Places) -> Value {
        let zero = self.zero_unix_s;
        let surfacing = |(k, s): (usize, &Surfacing)| {
            let (long, short, azimuth) = s.region.axes();
            let mut v = places.document(s.region.place);
            v["surfacing"] = (k + 1).into();
            v["time_s"] = number(s.time_s);
            v["unix_s"] = zero.map(|z| z + s.time_s).into();
            v["hours_ahead"] = number((s.time_s - self.last.time_s) / 3600.0);
            v["ellipse"] = json!({"probability": COVERAGE, "semi_major_m": number(long), "semi_minor_m": number(short),
                "azimuth_deg": number(azimuth.to_degrees())});
            v["inside"] = self.inside[k].into();
            v
        };
        let first = &self.planned.dives[0];
        let current = mission.current_over(&self.last, first.time_s);
        let mut plan = self.planned.source.clone();
        plan["hours"] = number(first.time_s / 3600.0);
        let w = first.through_water / first.time_s;
        plan["through_water_m_s"] = json!({"east": number(w.re), "north": number(w.im)});
        let misses = self.misses(mission);
        json!({
            "last_fix": places.document(self.last.place), "last_fix_time_s": number(self.last.time_s), "plan": plan,
            "positions_count_from": match places.frame {
                Frame::Globe(..) => "first fix".to_owned(),
                Frame::Segment(segment) => format!("launch point of segment {segment}"),
            },
            "surfacings": self.ahead.iter().enumerate().map(surfacing).collect::<Vec<_>>(),
            "time_scatter_s": mission.duration_scatter_s().map(number),
            "current_m_s": {"east": number(current.way.re), "north": number(current.way.im), "sigma": number((0.5 * current.variance).sqrt())},
            "coverage": {"asked": COVERAGE, "surfacings": misses.surfacings, "inside": misses.inside, "says": self.rests_on(mission)},
            "to": self.to.map(|[hours, least, most]| json!({"hours": hours, "low": least, "high": most})),
            "notes": self.notes,
        })
    }

    /// One row a surfacing.
    fn table(&self, places: &Places) -> Table {
        let at = |p: Vector| match places.globe(p) {
            Some((lat, lon)) => [format!("{lat:.4}"), format!("{lon:.4}")],
            None => [format!("{:.0}", p.re), format!("{:.0}", p.im)],
        };
        let heads = if places.origin.is_some() { ["lat, °", "lon, °"] } else { ["east, m", "north, m"] };
        let area = self.inside.iter().any(Option::is_some);
        let heads = ["surfacing", "in, h"].into_iter().chain(heads).chain(["90 % ellipse, m", "axis, °"]).chain(area.then_some("inside"));
        let row = |(k, s): (usize, &Surfacing)| {
            let (long, short, azimuth) = s.region.axes();
            let [a, b] = at(s.region.place);
            let hours = (s.time_s - self.last.time_s) / 3600.0;
            let mut row = vec![(k + 1).to_string(), format!("{hours:.1}"), a, b];
            row.extend([format!("{long:.0} × {short:.0}"), format!("{:.0}", azimuth.to_degrees())]);
            row.extend(self.inside[k].map(|p| format!("{:.1} %", 100.0 * p)));
            row
        };
        Table {
            caption: "Surfacings to come".into(),
            head: heads.map(str::to_owned).collect(),
            rows: self.ahead.iter().enumerate().map(row).collect(),
        }
    }

    /// Map and table; `so_far`: ends of the passages that count from where the last fix does.
    fn page(&self, mission: &Mission, places: &Places, document: &Value, so_far: &[Vector], area: Option<&Area>) -> anyhow::Result<Page> {
        let last = (self.last.place.re, self.last.place.im);
        let so_far: Vec<(f64, f64)> = so_far.iter().map(|p| (p.re, p.im)).chain([last]).collect();
        let chart = over_ground().plus("way so far", Mark::Line, so_far.iter().copied()).plus("fixes", Mark::Point, so_far);
        let mut chart = with_forecast(chart, document, last).context("no place")?;
        chart = area.into_iter().fold(chart, |chart, area| chart.plus("area asked for", Mark::Line, area.edge()));
        in_kilometres(&mut chart);
        let mut page = Page { title: "Where it comes up next".into(), provenance: Provenance::of_this_run(), ..Page::default() };
        page.answer.push(("How far it is to be trusted".into(), self.rests_on(mission)));
        let lead = "Each ellipse holds its surfacing with 90 %. Straight lines join the fixes.".into();
        page.sections.push(Section { title: "Map".into(), lead, items: vec![chart.into(), self.table(places).into()] });
        Ok(page)
    }

    fn said(&self, mission: &Mission, places: &Places, args: &Args) {
        self.notes.iter().for_each(|note| say(&wrapped(&format!("Note: {note}"), 6)));
        let Table { head, rows, .. } = self.table(places);
        let mut t = table(head.iter().map(String::as_str));
        t.add_rows(rows);
        say(&format!("{t}"));
        if let (Frame::Segment(segment), None) = (places.frame, places.origin) {
            say(&format!("east, north: from the launch point of segment {segment}"));
        }
        say(&wrapped(&format!("ellipse: half axes, the longer one from north clockwise; {}.", self.rests_on(mission)), 2));
        if let Some(scatter_s) = mission.duration_scatter_s() {
            say(&format!("times: 90 % of dives were within {:.0} min of the one before", scatter_s / 60.0));
        }
        let current = mission.current_over(&self.last, self.planned.dives[0].time_s);
        let sigma = (0.5 * current.variance).sqrt();
        say(&format!("current: {:+.3} m/s east, {:+.3} north (1 sigma {sigma:.3})", current.way.re, current.way.im));
        if let Some(to) = self.to {
            let [hours, least, most] = to.map(|h| h.map_or_else(|| "never".to_owned(), |h| format!("{h:.1} h")));
            say(&format!("until the recovery point: {hours} (90 %: {least} to {most})"));
        }
        [&args.out, &args.geojson, &args.kml].into_iter().flatten().for_each(|f| say(&f.display().to_string()));
    }
}

fn write(args: &Args, forecast: &Forecast, places: &Places) -> anyhow::Result<()> {
    if args.geojson.is_none() && args.kml.is_none() {
        return Ok(());
    }
    let globe = |p: Vector| {
        places.globe(p).context("no map without a place on the globe: name the launch point of the last segment with --origin LAT,LON")
    };
    let mut all = vec![Place { name: "last fix".to_owned(), corners: vec![globe(forecast.last.place)?], properties: json!({}) }];
    for (k, s) in forecast.ahead.iter().enumerate() {
        let hours = (s.time_s - forecast.last.time_s) / 3600.0;
        let properties =
            json!({"hours_ahead": number(hours), "unix_s": forecast.zero_unix_s.map(|z| z + s.time_s), "inside": forecast.inside[k]});
        let edge = s.region.edge(48).into_iter().map(globe).collect::<anyhow::Result<_>>()?;
        let place = |name: String, corners| Place { name, corners, properties: properties.clone() };
        all.push(place(format!("surfacing {}", k + 1), vec![globe(s.region.place)?]));
        all.push(place(format!("90 % of surfacing {}", k + 1), edge));
    }
    let written = |file: &Option<PathBuf>, text: String| match file {
        Some(file) => whole_file::write(file, text).with_context(|| format!("cannot write {}", file.display())),
        None => Ok(()),
    };
    written(&args.geojson, format!("{:#}\n", geojson(&all)))?;
    written(&args.kml, kml(&all))
}

//! The one assembly of a flight: rows, and channels in SI each on its own clock, brought to the rows.

use std::collections::BTreeMap;

use super::clocks::{LONGEST_MISSION_S, stray_times};
use super::position::{self, Fix};
use super::report::{DensityIs, Report};
use super::two_computers::agree;
use super::variation::variation_deg;
use super::{pressure_zero, surface};
use crate::record::clock_offset::ENGINEERING_PRESSURE;
use crate::record::flight::Flight;
use crate::record::plausible::quantile;
use crate::record::resample::Series;
use crate::record::seawater::{self, Place};
use crate::record::situations::FIX_DEPTH_PA;

/// One row of the flight to be; NaN where there is no value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    /// Unix time, s.
    pub unix_s: f64,
    /// Number of its segment.
    pub segment: u32,
    /// Pressure, Pa.
    pub pressure_pa: f64,
    /// °C.
    pub temperature_degc: f64,
    /// Practical salinity; where there is none it is that of the conductivity.
    pub salinity: f64,
    /// S/m.
    pub conductivity_s_m: f64,
}

impl Row {
    /// A row with a pressure alone.
    pub fn at(unix_s: f64, segment: u32, pressure_pa: f64) -> Self {
        Self { unix_s, segment, pressure_pa, temperature_degc: f64::NAN, salinity: f64::NAN, conductivity_s_m: f64::NAN }
    }
}

/// A channel.
#[derive(Clone, Debug)]
pub(super) enum Column {
    /// Interpolated to the rows.
    Between(Series),
    /// Of each row.
    AtRows(Vec<f64>),
}

impl Default for Column {
    fn default() -> Self {
        Self::Between(Series::default())
    }
}

impl From<Series> for Column {
    fn from(series: Series) -> Self {
        Self::Between(series)
    }
}

impl Column {
    fn on(self, unix: &[f64]) -> Vec<f64> {
        match self {
            Self::Between(series) if series.is_empty() => vec![f64::NAN; unix.len()],
            Self::Between(series) => series.on(unix),
            Self::AtRows(values) => values,
        }
    }
}

/// Channels in SI on Unix time.
#[derive(Default)]
pub(super) struct Log {
    pub rows: Vec<Row>,
    /// The rows are those of the flight, whatever they hold.
    pub exact: bool,
    /// Unix time of the instant from which times count; none: the first row.
    pub zero_s: Option<f64>,
    pub pitch: Column,
    pub roll: Column,
    pub heading: Column,
    pub ballast: Column,
    pub battery: Column,
    pub speed: Option<Column>,
    pub gps_plane: Option<[Vec<f64>; 2]>,
    /// Pressure by the steering computer's own sensor, Pa.
    pub steering_pressure: Series,
    pub fixes: Vec<Fix>,
    /// Latitude and longitude by the vehicle's own dead reckoning, deg.
    pub reckoned: [Series; 2],
    /// Where it is where there is no fix.
    pub about: Option<Place>,
    /// The salinity of the rows is absolute, g/kg.
    pub absolute: bool,
    /// The density that the source states, and whether the rows have anything to compute it from.
    pub density: Option<Column>,
    pub without_salinity: bool,
    /// To be cut at the surface.
    pub cut: bool,
    /// Whether the heading was magnetic and is true now; else the source does not say which it is.
    pub true_heading: bool,
    /// Further columns.
    pub extra: BTreeMap<String, Column>,
}

impl Log {
    /// The flight; none without rows.
    pub fn flight(mut self, name: &str, report: &mut Report) -> Option<Flight> {
        self.fixes = position::sound(std::mem::take(&mut self.fixes), report);
        if !self.exact {
            self.in_order(report);
        }
        pressure_zero::take_out(&mut self.rows, |r| (r.unix_s, &mut r.pressure_pa), |r| r.segment, report);
        let zero_s = self.zero_s.or(self.rows.first().map(|r| r.unix_s))?;
        let unix: Vec<f64> = self.rows.iter().map(|r| r.unix_s).collect();
        let column = |f: &dyn Fn(&Row) -> f64| self.rows.iter().map(f).collect::<Vec<f64>>();
        let mut flight = Flight {
            name: name.to_owned(),
            time_s: column(&|r| r.unix_s - zero_s),
            segment: self.rows.iter().map(|r| r.segment).collect(),
            pressure_pa: column(&|r| r.pressure_pa),
            temperature_degc: column(&|r| r.temperature_degc),
            ..Flight::blank(unix.len())
        };
        if self.cut {
            let count = surface::cut(&mut flight);
            report.segments = (1..=count).map(|k| format!("dive {k}")).collect();
        }
        self.afloat(report);
        self.question_heading(zero_s, report);
        self.water(&mut flight, &unix, report);
        let [seldom_pitch, seldom_ballast] =
            [&self.pitch, &self.ballast].map(|c| if let Column::Between(s) = c { s.clone() } else { Series::default() });
        flight.pitch_rad = self.pitch.on(&unix);
        flight.roll_rad = self.roll.on(&unix);
        flight.heading_rad = match self.heading {
            Column::Between(series) => series.angle_on(&unix),
            at_rows => at_rows.on(&unix),
        };
        flight.ballast_m3 = self.ballast.on(&unix);
        flight.battery_mass_m = self.battery.on(&unix);
        flight.speed_m_s = self.speed.map(|c| c.on(&unix)).filter(|s| s.iter().any(|v| v.is_finite()));
        if let Some([east, north]) = self.gps_plane {
            (flight.gps_east_m, flight.gps_north_m) = (east, north);
        }
        flight.extra.extend(self.extra.into_iter().map(|(name, column)| (name, column.on(&unix))));
        for (name, series, values) in [("pitch", &seldom_pitch, &flight.pitch_rad), ("ballast", &seldom_ballast, &flight.ballast_m3)] {
            report_seldom(name, series, values, report);
        }
        if !self.steering_pressure.is_empty() {
            let values = self.steering_pressure.on(&unix);
            agree(&flight, &unix, &self.steering_pressure, report);
            if let Some((first, _)) = self.steering_pressure.pairs().next().filter(|_| values.iter().all(|v| v.is_nan())) {
                let apart_s = first - unix[0];
                report.leave_out(format!("the vehicle's computer has no value while the CTD has: their clocks are {apart_s:+.0} s apart"));
            }
            flight.extra.insert(ENGINEERING_PRESSURE.into(), values.iter().map(|p| p * 1e-4).collect());
        }
        report.start_unix_s = Some(zero_s);
        position::place(&mut flight, &unix, &self.fixes, report);
        position::dead_reckoning(&mut flight, &unix, &self.reckoned, &self.fixes);
        Some(flight)
    }

    /// Rows with a time and a pressure, in the order of time.
    fn in_order(&mut self, report: &mut Report) {
        let mut times: Vec<f64> = self.rows.iter().map(|r| r.unix_s).collect();
        let stray = stray_times(&mut times, LONGEST_MISSION_S);
        if stray > 0 {
            report.leave_out(format!("{stray} rows further than 400 days from the others: a clock that was not set, or damage"));
        }
        self.rows.iter_mut().zip(times).for_each(|(r, t)| r.unix_s = t);
        self.rows.retain(|r| r.unix_s.is_finite() && r.pressure_pa.is_finite());
        self.rows.sort_by(|a, b| a.unix_s.total_cmp(&b.unix_s));
        pressure_zero::drop_zeros(&mut self.rows, |r| (r.unix_s, r.pressure_pa), "the pressure", report);
        let all = self.rows.len();
        self.rows.dedup_by(|b, a| a.unix_s == b.unix_s);
        if self.rows.len() < all {
            report.leave_out(format!("{} of {all} rows repeat a time: the first of each stays", all - self.rows.len()));
        }
    }

    /// The fixes at the surface, by the vehicle's own pressure above its least, else by that of the rows.
    fn afloat(&mut self, report: &mut Report) {
        let all = self.fixes.len();
        if self.steering_pressure.is_empty() {
            let pairs = self.rows.iter().map(|r| (r.unix_s, r.pressure_pa));
            let (time, value): (Vec<f64>, Vec<f64>) = pairs.unzip();
            let pressure = if all > 0 { Series::new(&time, &value) } else { Series::default() };
            self.fixes.retain(|f| !(pressure.at(f.time_s) > FIX_DEPTH_PA));
        } else {
            let least = quantile(&self.steering_pressure.pairs().map(|(_, p)| p).collect::<Vec<_>>(), 0.02);
            self.fixes.retain(|f| !(self.steering_pressure.at(f.time_s) - least > FIX_DEPTH_PA));
        }
        if self.fixes.len() < all {
            report.note(format!("{} of {all} GPS fixes lie below 3 dbar: repeated or reckoned there, no fixes", all - self.fixes.len()));
        }
    }

    /// Says how far a heading is off that may be magnetic, where that is more than a compass errs.
    fn question_heading(&self, unix_s: f64, report: &mut Report) {
        let known = !matches!(&self.heading, Column::Between(s) if s.is_empty());
        let Some(fix) = self.fixes.first().filter(|_| known && !self.true_heading) else { return };
        let place = Place { lon_deg: fix.lon_deg, lat_deg: fix.lat_deg };
        if let Some(off) = variation_deg(place, unix_s).filter(|off| off.abs() > COMPASS_DEG) {
            report.note(format!(
                "heading: whether it is true or magnetic is not stated; the variation there is {off:+.0} deg: if it is magnetic, drift and \
                 current are turned by it"
            ));
        }
    }

    /// Salinity and density of the rows: computed from what the CTD measured unless the source states twice as many.
    fn water(&mut self, flight: &mut Flight, unix: &[f64], report: &mut Report) {
        let place = self.fixes.first().map(|f| Place { lon_deg: f.lon_deg, lat_deg: f.lat_deg }).or(self.about);
        for r in self.rows.iter_mut().filter(|r| r.salinity.is_nan() && r.conductivity_s_m.is_finite()) {
            r.salinity = seawater::practical_salinity(r.conductivity_s_m, r.temperature_degc, r.pressure_pa * 1e-4);
        }
        let density = |r: &Row| match (r.pressure_pa * 1e-4, self.absolute) {
            (dbar, _) if dbar.is_nan() => f64::NAN,
            (dbar, true) => seawater::density(r.salinity, r.temperature_degc, dbar),
            (dbar, false) => seawater::density_of_water(r.salinity, place, r.temperature_degc, dbar),
        };
        flight.density_kg_m3 = self.rows.iter().map(density).collect();
        if !self.without_salinity && !self.absolute {
            flight.extra.insert(SALINITY_COLUMN.into(), self.rows.iter().map(|r| r.salinity).collect());
        }
        let Some(stated) = self.density.take().map(|c| c.on(unix)) else { return };
        let count = |values: &[f64]| values.iter().filter(|v| v.is_finite()).count();
        let (new, known) = (count(&flight.density_kg_m3), count(&stated));
        if 2 * new < known {
            let why = if self.without_salinity {
                "there is no salinity to recompute it from".into()
            } else {
                format!("{new} values of it can be recomputed, the file has {known}")
            };
            report.density = format!("as the file states it: {why}");
            report.density_is = DensityIs::Stated;
            flight.density_kg_m3 = stated;
        } else if known > 0 {
            let largest = flight.density_kg_m3.iter().zip(&stated).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            report.note(format!("density changed by at most {largest:.4} kg/m3 against the file's own"));
        }
    }
}

/// A glider's compass is good to this, deg (guess).
const COMPASS_DEG: f64 = 3.0;

/// A channel that comes less often than this does not show a turn, which takes about a minute, s.
const SELDOM_S: f64 = 30.0;

/// Where a channel is known in a smaller share of the rows, it is lost (guess).
const SELDOM_KNOWN: f64 = 0.2;

/// Names a channel that comes seldom: what lies between its values is lost, or nothing can lie between them.
fn report_seldom(name: &str, series: &Series, on_rows: &[f64], report: &mut Report) {
    let (count, step_s) = (series.len(), series.step_s());
    let known = on_rows.iter().filter(|v| v.is_finite()).count();
    if count > 0 && (known as f64) < SELDOM_KNOWN * on_rows.len() as f64 {
        let rows = on_rows.len();
        report.leave_out(format!(
            "{name} has {count} values {step_s:.0} s apart, and {known} of {rows} rows one: too far apart to lie between, or of another time"
        ));
    } else if step_s > SELDOM_S {
        report.note(format!("{name} comes every {step_s:.0} s only: interpolated, what happens in between, such as a turn, is lost"));
    }
}

/// Practical salinity of the source, kept beside the density that is computed from it.
pub const SALINITY_COLUMN: &str = "practical_salinity";

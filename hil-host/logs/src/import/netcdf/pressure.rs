//! Pressure of a NetCDF file, or what its depth says about it.

use super::super::pressure_zero::UNDER_WATER_PA;
use super::super::{MappedName, pressure_zero};
use super::names::{DEPTH, PRESSURE};
use super::variables::{Channel, Reader};
use crate::record::plausible::quantile;
use crate::record::resample::Series;
use crate::record::seawater;

/// Depth and pressure of one file grow alike within this share (1 dbar is 0.97 to 1.02 m), 10 dbar and more below the top.
const DEPTH_SHARE: f64 = 0.1;

impl Reader<'_> {
    /// Pressure, or what depth says about it.
    pub(super) fn pressure(&mut self) -> Option<Channel> {
        let pressure = self.channel(&PRESSURE).map(|p| self.upright(p));
        let mapped = self.report.mapped.len();
        let depth = if pressure.is_some() { self.aside(&DEPTH) } else { self.channel(&DEPTH) };
        self.report.mapped.truncate(mapped);
        match (pressure, depth) {
            (Some(pressure), Some(depth)) if depth.coverage > 2.0 * pressure.coverage || (pressure.is_zero() && !depth.is_zero()) => {
                let why = if pressure.is_zero() { "is 0 throughout".into() } else { format!("has {} values", pressure.series.len()) };
                self.report.note(format!("{} {why}: {} is taken, which has {}", pressure.name, depth.name, depth.series.len()));
                self.report.mapped.retain(|m| m.from != pressure.name);
                Some(self.of_depth(depth))
            }
            (Some(pressure), Some(depth)) => {
                self.compare_depth(&pressure, &depth);
                Some(pressure)
            }
            (Some(pressure), None) => Some(pressure),
            (None, Some(depth)) => Some(self.of_depth(depth)),
            (None, None) => None,
        }
    }

    /// The pressure that a depth says.
    fn of_depth(&mut self, mut depth: Channel) -> Channel {
        let place = self.about();
        let lat_deg = place.map_or(45.0, |p| p.lat_deg);
        let (time, z): (Vec<f64>, Vec<f64>) = depth.series.pairs().unzip();
        // Positive where the middle of the samples is, whatever the attribute says: nobody measures in the air.
        let sign = if quantile(&z, 0.5) < 0.0 { -1.0 } else { 1.0 };
        let pa: Vec<f64> = z.iter().map(|z| seawater::pressure_pa(sign * z, lat_deg)).collect();
        depth.series = Series::new(&time, &pa);
        depth.backwards = None;
        let about = if place.is_some() { "" } else { " (latitude unknown, 45 deg taken)" };
        self.report.note(format!("no pressure: computed from {} by TEOS-10 at {lat_deg:.1} deg{about}", depth.name));
        self.report.map(MappedName {
            from: depth.name.clone(),
            unit: self.text(&depth.name, "units").unwrap_or_default(),
            to: DEPTH.column.into(),
            factor: 1e4,
        });
        depth
    }

    /// A pressure the right way round, and without zeros of a sensor that was off for an instant.
    fn upright(&mut self, mut pressure: Channel) -> Channel {
        let (time, mut values): (Vec<f64>, Vec<f64>) = pressure.series.pairs().unzip();
        if pressure_zero::turn_upright(&mut values, &pressure.name, UNDER_WATER_PA, &mut self.report) {
            pressure.series = Series::new(&time, &values);
            pressure.backwards = None;
        }
        let mut pairs: Vec<(f64, f64)> = pressure.series.pairs().collect();
        pressure_zero::drop_zeros(&mut pairs, |pair| *pair, &pressure.name, &mut self.report);
        if pairs.len() < pressure.series.len() {
            let (time, value): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
            pressure.series = Series::new(&time, &value);
        }
        pressure
    }

    /// Says where depth and pressure do not grow alike; a zero of one of them is none of its unit.
    fn compare_depth(&mut self, pressure: &Channel, depth: &Channel) {
        let top = pressure.series.pairs().filter(|(t, _)| depth.series.at(*t).is_finite()).min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((top_s, top_pa)) = top else { return };
        let top_m = depth.series.at(top_s);
        let shares: Vec<f64> = pressure
            .series
            .pairs()
            .filter(|(t, p)| p - top_pa > 1e5 || depth.series.at(*t) - top_m > 10.0)
            .map(|(t, p)| ((depth.series.at(t) - top_m) / ((p - top_pa) * 1e-4)).abs())
            .filter(|s| s.is_finite())
            .collect();
        let share = quantile(&shares, 0.5);
        if (share - 1.0).abs() > DEPTH_SHARE {
            self.report.note(format!(
                "{} and {} do not agree: 1 dbar is {share:.4} m there; one of them states a wrong unit",
                pressure.name, depth.name
            ));
        }
    }

    /// Why there is no pressure.
    pub(super) fn without_pressure(&self) -> String {
        let names = PRESSURE.names.iter().chain(DEPTH.names).copied().collect::<Vec<_>>().join(", ");
        let said: Vec<&str> = self.report.left_out.iter().chain(&self.report.notes).map(String::as_str).collect();
        let why = if said.is_empty() { String::new() } else { format!(" ({})", said.join("; ")) };
        let variables = self.file.variables().unwrap_or_default();
        let is_wanted = |n: &str| PRESSURE.names.iter().chain(DEPTH.names).any(|w| w.eq_ignore_ascii_case(n));
        if let Some(short) = variables.iter().find(|v| is_wanted(v.name()) && v.num_elements().is_ok_and(|n| n < 2)) {
            return format!("{} has {} values: no dive", short.name(), short.num_elements().unwrap_or(0));
        }
        let groups = self.file.root_group().map(|g| g.groups.iter().map(|g| g.name.as_str()).collect::<Vec<_>>()).unwrap_or_default();
        if !groups.is_empty() && variables.is_empty() {
            return format!("has its variables in groups ({}), which are not read: copy them to the root of the file", groups.join(", "));
        }
        format!("has no pressure or depth with a time: looked for {names}{why}")
    }
}

//! Density of the water of a NetCDF file, from what its CTD measured.

use super::names::{CONDUCTIVITY, DENSITY, SALINITY};
use super::variables::{Channel, Reader};
use crate::record::plausible::quantile;
use crate::record::resample::Series;
use crate::record::seawater::{self, Place};

/// Sea water conducts 7 S/m at most; a median above this is in mS/cm, S/m.
const CONDUCTS_S_M: f64 = 8.0;
/// Salinity of the sea as a share of one.
const SHARE: std::ops::Range<f64> = 0.030..0.042;
/// Further than this a file's own density and the recomputed one are of different water, kg/m³: a density that leaves out pressure is
/// 2 off at 500 m and 4.5 at 1000.
const OTHER_DENSITY_KG_M3: f64 = 6.0;

impl Reader<'_> {
    /// Values at the rows: as they are where the channel stands on the rows' own clock, as in our own export, so that what was left out
    /// stays out; else between its values.
    pub(super) fn on_rows(&self, series: &Series, unix: &[f64]) -> Vec<f64> {
        let exact = at_rows(series, unix);
        let own_clock = self.is_own() || 10 * exact.iter().filter(|v| v.is_finite()).count() >= 9 * series.len();
        if own_clock { exact } else { series.on(unix) }
    }

    /// Density at the rows; it is recomputed where there is a salinity or a conductivity.
    pub(super) fn density(&mut self, unix: &[f64], rows: &[(f64, f64)], temperature: &[f64], place: Option<Place>) -> Vec<f64> {
        let dbar = |i: usize| rows[i].1 * 1e-4;
        let salinity = self.channel(&SALINITY);
        let conductivity = match &salinity {
            Some(s) if s.coverage >= 0.5 => None,
            // Kept as the second choice: its own loss is not one where salinity serves.
            Some(_) => self.aside(&CONDUCTIVITY),
            None => self.channel(&CONDUCTIVITY),
        };
        let fuller = |s: &Channel, c: &Channel| c.coverage > 2.0 * s.coverage;
        let practical: Option<(String, Vec<f64>)> = match (salinity, conductivity) {
            (Some(s), Some(c)) if fuller(&s, &c) => {
                self.report.note(format!("{} has {} values: {} is taken, which has {}", s.name, s.series.len(), c.name, c.series.len()));
                Some(self.salinity_of(c, unix, rows, temperature))
            }
            (Some(s), _) => Some((s.name, self.on_rows(&s.series, unix))),
            (None, Some(c)) => Some(self.salinity_of(c, unix, rows, temperature)),
            (None, None) => None,
        };
        if let Some((name, practical)) = practical {
            self.report.density_from(&format!("{name}, temperature, pressure"), place, true);
            self.salinity = Some(practical.clone());
            let density: Vec<f64> =
                (0..unix.len()).map(|i| seawater::density_of_water(practical[i], place, temperature[i], dbar(i))).collect();
            self.check_water(&name, &practical, &density, unix);
            return density;
        }
        match self.channel(&DENSITY) {
            Some(c) => {
                self.report.density = format!("as the file states it ({}): there is no salinity to recompute it from", c.name);
                self.on_rows(&c.series, unix)
            }
            None => {
                self.report.density_from("salinity or conductivity, temperature, pressure", place, false);
                vec![f64::NAN; unix.len()]
            }
        }
    }

    /// Practical salinity at the rows from a conductivity.
    fn salinity_of(&mut self, mut c: Channel, unix: &[f64], rows: &[(f64, f64)], temperature: &[f64]) -> (String, Vec<f64>) {
        if quantile(&c.series.pairs().map(|(_, v)| v).collect::<Vec<_>>(), 0.5) > CONDUCTS_S_M {
            self.report.note(format!("{} is more than sea water conducts in the unit it states: taken as mS/cm", c.name));
            c.series = scaled(&c.series, |v| 0.1 * v);
        }
        let values = self.on_rows(&c.series, unix);
        let practical = (0..unix.len()).map(|i| seawater::practical_salinity(values[i], temperature[i], rows[i].1 * 1e-4)).collect();
        (c.name, practical)
    }

    /// Says where the water is fresh by its salinity, or another one than the file's own density.
    fn check_water(&mut self, name: &str, practical: &[f64], density: &[f64], unix: &[f64]) {
        let known = practical.iter().filter(|s| s.is_finite()).count();
        let zero = practical.iter().filter(|s| **s == 0.0).count();
        if zero > 0 && 2 * zero > known {
            self.report.leave_out(format!("density: {name} is 0 in {zero} of {known} rows: fresh water, or a cell in air?"));
        }
        let middle = quantile(practical, 0.5);
        if SHARE.contains(&middle) {
            self.report.note(format!("{name} is {middle:.4} in the middle: nearly fresh water, or sea water's as a share of one?"));
        }
        let Some(own) = self.aside(&DENSITY) else { return };
        // Files also store the density less 1000.
        let stated = own.series.on(unix);
        let off = quantile(&stated.iter().zip(density).map(|(a, b)| a - b).collect::<Vec<_>>(), 0.5);
        let off = if (-1100.0..-900.0).contains(&off) { off + 1000.0 } else { off };
        if off.abs() > OTHER_DENSITY_KG_M3 {
            self.report
                .note(format!("{} is {off:+.1} kg/m3 off the density recomputed from {name}: is {name} in the unit it states?", own.name));
        }
    }
}

/// Values at the instants of the rows only.
pub(super) fn at_rows(series: &Series, unix: &[f64]) -> Vec<f64> {
    unix.iter().map(|t| series.at_within(*t, 0.0)).collect()
}

pub(super) fn scaled(series: &Series, f: impl Fn(f64) -> f64) -> Series {
    let (time, value): (Vec<f64>, Vec<f64>) = series.pairs().map(|(t, v)| (t, f(v))).unzip();
    Series::new(&time, &value)
}

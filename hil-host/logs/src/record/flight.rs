//! One flight as read from disk: columns in SI units, NaN where there is no value.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;

/// A flight: equal-length columns. NaN means "no value at this instant".
#[derive(Clone, Debug, Default)]
pub struct Flight {
    /// Name for messages (directory or file).
    pub name: String,
    /// Time since the start of the trial, s, strictly increasing.
    pub time_s: Vec<f64>,
    /// Segment number of each row; the vehicle's state does not carry over between segments.
    pub segment: Vec<u32>,
    /// Gauge pressure, Pa.
    pub pressure_pa: Vec<f64>,
    /// Measured pitch, rad, nose up positive.
    pub pitch_rad: Vec<f64>,
    /// Measured roll, rad, starboard down positive.
    pub roll_rad: Vec<f64>,
    /// Measured heading, rad, clockwise from true north.
    pub heading_rad: Vec<f64>,
    /// Measured ballast volume, m³, positive buoyant.
    pub ballast_m3: Vec<f64>,
    /// Battery position, m, positive forward.
    pub battery_mass_m: Vec<f64>,
    /// Water temperature, °C (the one non-SI unit kept: every source and every effect states it so).
    pub temperature_degc: Vec<f64>,
    /// In-situ water density, kg/m³.
    pub density_kg_m3: Vec<f64>,
    /// Local east of the GPS fixes, m.
    pub gps_east_m: Vec<f64>,
    /// Local north of the GPS fixes, m.
    pub gps_north_m: Vec<f64>,
    /// Speed through the water, m/s, where the vehicle measures it.
    pub speed_m_s: Option<Vec<f64>>,
    /// Columns that the format does not name, as they are.
    pub extra: BTreeMap<String, Vec<f64>>,
    /// What of its csv is neither a channel nor a number, and what was left out of it, in words.
    pub unread: Vec<String>,
}

/// What a log is known by: its rows, its ends, and pressures spread evenly over it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LogMark {
    rows: usize,
    ends_s: [f64; 2],
    time_s: Vec<f64>,
    pressure_pa: Vec<f64>,
}

impl LogMark {
    /// As [`Flight::is_same_log`] of the flights.
    #[must_use]
    pub fn is_same_log(&self, other: &Self) -> bool {
        let rows = self.rows == other.rows && self.time_s.len() == other.time_s.len();
        rows && near(&self.ends_s, &other.ends_s, 1e-3)
            && near(&self.time_s, &other.time_s, 1e-3)
            && near(&self.pressure_pa, &other.pressure_pa, 10.0)
    }
}

fn near(a: &[f64], b: &[f64], by: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= by || (a.is_nan() && b.is_nan()))
}

impl Flight {
    /// A flight of `rows` rows without any value.
    #[must_use]
    pub fn blank(rows: usize) -> Self {
        let none = || vec![f64::NAN; rows];
        Self {
            time_s: none(),
            segment: vec![0; rows],
            pressure_pa: none(),
            pitch_rad: none(),
            roll_rad: none(),
            heading_rad: none(),
            ballast_m3: none(),
            battery_mass_m: none(),
            temperature_degc: none(),
            density_kg_m3: none(),
            gps_east_m: none(),
            gps_north_m: none(),
            ..Self::default()
        }
    }

    /// The columns that every flight has besides time and segment.
    #[must_use]
    pub fn columns(&self) -> [&Vec<f64>; 10] {
        [
            &self.pressure_pa,
            &self.pitch_rad,
            &self.roll_rad,
            &self.heading_rad,
            &self.ballast_m3,
            &self.battery_mass_m,
            &self.temperature_degc,
            &self.density_kg_m3,
            &self.gps_east_m,
            &self.gps_north_m,
        ]
    }

    /// The same, to be changed.
    pub fn columns_mut(&mut self) -> [&mut Vec<f64>; 10] {
        [
            &mut self.pressure_pa,
            &mut self.pitch_rad,
            &mut self.roll_rad,
            &mut self.heading_rad,
            &mut self.ballast_m3,
            &mut self.battery_mass_m,
            &mut self.temperature_degc,
            &mut self.density_kg_m3,
            &mut self.gps_east_m,
            &mut self.gps_north_m,
        ]
    }

    /// Some of its rows, as a flight of the same name.
    #[must_use]
    pub fn part(&self, rows: Range<usize>) -> Self {
        let of = |column: &Vec<f64>| column[rows.clone()].to_vec();
        let mut out =
            Self { name: self.name.clone(), time_s: of(&self.time_s), segment: self.segment[rows.clone()].to_vec(), ..Self::default() };
        out.columns_mut().into_iter().zip(self.columns()).for_each(|(new, column)| *new = of(column));
        out.speed_m_s = self.speed_m_s.as_ref().map(of);
        out.extra = self.extra.iter().map(|(name, column)| (name.clone(), of(column))).collect();
        out
    }

    /// Takes rows out.
    pub fn remove(&mut self, rows: Range<usize>) {
        self.time_s.drain(rows.clone());
        self.segment.drain(rows.clone());
        self.columns_mut().into_iter().for_each(|column| drop(column.drain(rows.clone())));
        self.speed_m_s.iter_mut().chain(self.extra.values_mut()).for_each(|column| drop(column.drain(rows.clone())));
    }

    /// Whether it holds the same rows as another one, by time and pressure as far as a csv writes them.
    #[must_use]
    pub fn is_same_log(&self, other: &Self) -> bool {
        self.len() == other.len() && near(&self.time_s, &other.time_s, 1e-3) && near(&self.pressure_pa, &other.pressure_pa, 10.0)
    }

    /// What its log is known by without keeping all of it.
    #[must_use]
    pub fn mark(&self) -> LogMark {
        /// Of so many pressures no two logs have the same by chance.
        const PRESSURES: usize = 64;
        let measured: Vec<usize> = (0..self.len()).filter(|i| self.pressure_pa[*i].is_finite()).collect();
        let chosen = measured.iter().step_by(measured.len().div_ceil(PRESSURES).max(1));
        let (time_s, pressure_pa) = chosen.map(|i| (self.time_s[*i], self.pressure_pa[*i])).unzip();
        let ends_s = [self.time_s.first(), self.time_s.last()].map(|t| t.copied().unwrap_or(f64::NAN));
        LogMark { rows: self.len(), ends_s, time_s, pressure_pa }
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }
}

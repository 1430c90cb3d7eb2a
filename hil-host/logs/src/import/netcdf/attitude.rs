//! Pitch, roll and heading of a NetCDF file.

use super::super::Report;
use super::names::{DEGREE, HEADING, PITCH, ROLL};
use super::variables::{Channel, Reader};
use super::water::scaled;
use crate::record::plausible::quantile;
use crate::record::resample::Series;

/// Gliders that dive pitch by 15 to 40 degrees; nine tenths of a file within this many "degrees" are radians.
const FLATTEST: f64 = 2.0;
/// Less than this many "degrees" in nine tenths of a file is a pitch that was not measured.
const LEVEL: f64 = 0.05;
/// Gliders roll by up to 40 degrees in a spiral; nine tenths of a file within this many "degrees" may be radians.
const STEEPEST_ROLL: f64 = 0.9;

impl Reader<'_> {
    /// Pitch, roll and true heading, rad.
    pub(super) fn attitude(&mut self, pressure: &Series) -> [Series; 3] {
        let mut channels = [&PITCH, &ROLL, &HEADING].map(|wanted| self.channel(wanted));
        let moves = pressure.pairs().map(|(_, p)| p).fold(0.0, f64::max) > 1e5;
        let sizes = |c: &Channel, q: f64| quantile(&c.series.pairs().map(|(_, v)| (v / DEGREE).abs()).collect::<Vec<_>>(), q);
        let stated_degrees = |report: &Report, name: &str| report.mapped.iter().any(|m| m.from == name && m.factor == DEGREE);
        let radians = channels[0]
            .as_ref()
            .is_some_and(|c| moves && (LEVEL..FLATTEST).contains(&sizes(c, 0.9)) && stated_degrees(&self.report, &c.name));
        if radians {
            // What a channel can be in radians: a roll is no more than a tight spiral's, a heading no more than a turn.
            let limits = [FLATTEST, STEEPEST_ROLL, std::f64::consts::TAU + 0.01];
            for (k, channel) in channels.iter_mut().enumerate().filter_map(|(k, c)| Some((k, c.as_mut()?))) {
                let share = if k == 2 { 1.0 } else { 0.9 };
                if stated_degrees(&self.report, &channel.name) && sizes(channel, share) < limits[k] {
                    self.report.note(format!("{} states degrees but its values are radians: taken as radians", channel.name));
                    for m in self.report.mapped.iter_mut().filter(|m| m.from == channel.name) {
                        m.factor = 1.0;
                    }
                    channel.series = scaled(&channel.series, |v| v / DEGREE);
                }
            }
        }
        // Further than a turn and its rounding in nine tenths of the rows is no heading; it would be wrapped into one.
        if let Some(heading) = channels[2].take_if(|c| quantile(&c.series.pairs().map(|(_, v)| v.abs()).collect::<Vec<_>>(), 0.9) > 7.0) {
            let reach = quantile(&heading.series.pairs().map(|(_, v)| v.abs()).collect::<Vec<_>>(), 0.9);
            self.report.note(format!("{} reaches {reach:.1} rad by its unit, more than a turn: left out", heading.name));
        }
        if let Some(heading) = &mut channels[2] {
            let magnetic = self.text(&heading.name, "comment").is_some_and(|c| c.to_ascii_lowercase().contains("magnetic"));
            if let Some(variation) = self.scalar("magnetic_variation").filter(|_| magnetic || heading.name == "eng_head") {
                self.report.note(format!("{} is magnetic: variation of {variation} deg added", heading.name));
                heading.series = scaled(&heading.series, |v| v + variation * DEGREE);
            } else if magnetic || heading.name == "eng_head" {
                self.report.note(format!("{} is magnetic and the file gives no variation: left as it is", heading.name));
            }
        }
        channels.map(|c| c.map_or_else(Series::default, |c| c.series))
    }
}

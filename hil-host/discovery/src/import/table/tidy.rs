//! What programs that write csv do to a log, undone before it is read: decimal commas, rows that run backwards or come twice, times of
//! a clock that was not set, values that stand for none.

use std::borrow::Cow;

use super::super::channels::{LONGEST_MISSION_S, stray_times};
use super::super::netcdf::variables::undeclared_fill;
use super::super::{Report, calendar};
use super::{ABSOLUTE, PRACTICAL, Table, is_number};
use crate::record::csv::{Channel, NAMES};

/// The text with decimal points where its numbers have commas: fields are cut by semicolons or tabs then.
pub(super) fn decimal_points<'a>(text: &'a str, report: &mut Report) -> Cow<'a, str> {
    let mut lines = text.lines().filter(|l| !l.trim().is_empty() && !l.starts_with('#'));
    let header = lines.next().unwrap_or_default();
    let cuts = |line: &str| line.matches([';', '\t']).count();
    if cuts(header) == 0 || header.contains(',') {
        return Cow::Borrowed(text);
    }
    let (mut commas, mut points) = (0, 0);
    for field in lines.take(20).flat_map(|l| l.split([';', '\t'])) {
        commas += usize::from(field.matches(',').count() == 1 && is_number(&field.replace(',', ".")));
        points += usize::from(field.contains('.'));
    }
    if commas < 20 || points > 0 {
        return Cow::Borrowed(text);
    }
    report.note("numbers have decimal commas: read as such".into());
    Cow::Owned(text.replace(',', "."))
}

impl Table<'_> {
    /// The same as csv of one header line: numbers for ISO times, rows in the order of time, no value where one stands for none.
    pub(super) fn plain(&self, report: &mut Report) -> String {
        let time = self.time_column();
        let fills: Vec<Vec<f64>> = (0..self.names.len()).map(|k| self.fills(k, report)).collect();
        let mut out = self.names.join(",");
        for row in self.order(report) {
            out.push('\n');
            for (k, field) in self.rows[row].iter().enumerate() {
                if k > 0 {
                    out.push(',');
                }
                match calendar::iso_8601(field).filter(|_| Some(k) == time && !is_number(field)) {
                    Some(unix) => out.push_str(&format!("{unix:.4}")),
                    None if fills.get(k).is_some_and(|f| field.parse().is_ok_and(|v: f64| f.contains(&v))) => {}
                    None => out.push_str(field),
                }
            }
        }
        out.push('\n');
        out
    }

    /// Values of a channel that stand for none, though nothing says so.
    fn fills(&self, column: usize, report: &mut Report) -> Vec<f64> {
        let channel = NAMES.iter().find(|n| n.0.eq_ignore_ascii_case(&self.names[column])).map(|n| n.1);
        let salinity = PRACTICAL.iter().chain(&ABSOLUTE).any(|n| n.eq_ignore_ascii_case(&self.names[column]));
        let mut fills = Vec::new();
        // A fix at the origin, a first segment, are values.
        if !salinity && channel.is_none_or(|c| matches!(c, Channel::Time | Channel::Segment | Channel::GpsEast | Channel::GpsNorth)) {
            return fills;
        }
        let mut values = self.numbers(column);
        while let Some((fill, count)) = undeclared_fill(&values) {
            report.note(format!("{count} of {} values of {} are {fill}: a fill, left out", values.len(), self.names[column]));
            values.iter_mut().filter(|v| **v == fill).for_each(|v| *v = f64::NAN);
            fills.push(fill);
        }
        fills
    }

    /// Rows in the order of time, without those of a clock that was not set and without repeats: of a table that runs forward or
    /// backward but for these. Any other stays as it is, and is refused where its times fall.
    fn order(&self, report: &mut Report) -> Vec<usize> {
        let all: Vec<usize> = (0..self.rows.len()).collect();
        let Some(column) = self.time_column() else { return all };
        let number = |text: &str| text.parse::<f64>().ok().or_else(|| calendar::iso_8601(text)).unwrap_or(f64::NAN);
        let mut times: Vec<f64> = self.rows.iter().map(|r| r.get(column).map_or(f64::NAN, |t| number(t))).collect();
        if let Some((fill, _)) = undeclared_fill(&times) {
            times.iter_mut().filter(|t| **t == fill).for_each(|t| *t = f64::NAN);
        }
        stray_times(&mut times, LONGEST_MISSION_S);
        let mut rows: Vec<usize> = all.iter().copied().filter(|i| times[*i].is_finite()).collect();
        let undated = all.len() - rows.len();
        let back = rows.windows(2).filter(|w| times[w[1]] < times[w[0]]).count();
        let on = rows.windows(2).filter(|w| times[w[1]] > times[w[0]]).count();
        if rows.is_empty() || (back > 0 && on > 0) {
            return all;
        }
        if back > 0 {
            rows.reverse();
            report.note("rows run backward in time: turned round".into());
        }
        let dated = rows.len();
        rows.dedup_by(|b, a| times[*a] == times[*b]);
        if rows.len() < dated {
            report.leave_out(format!("{} of {dated} rows repeat a time: the first of each stays", dated - rows.len()));
        }
        if undated > 0 {
            report.leave_out(format!("{undated} of {} rows have no time, or one years off the others", all.len()));
        }
        rows
    }
}

//! What programs that write csv do to a log, undone before it is read: decimal commas, rows that run backwards, in blocks out of order or
//! twice, times of a clock that was not set or counts whole seconds.

use std::borrow::Cow;
use std::collections::HashMap;

use super::super::Report;
use super::super::clocks::{LONGEST_MISSION_S, lonely_times, spread_evenly, stray_times};
use super::super::fills::undeclared_fill;
use super::times::Clock;
use super::{Table, is_number};
use crate::channels::{Channel, Channels};
use crate::record::plausible::quantile;

/// The text with decimal points where its numbers have commas: fields are cut by semicolons or tabs then.
pub(super) fn decimal_points<'a>(text: &'a str, report: &mut Report) -> Cow<'a, str> {
    let mut lines = text.lines().filter(|l| !l.trim().is_empty() && !l.starts_with(['#', '%']));
    let header = lines.next().unwrap_or_default();
    let cuts = |line: &str| line.matches([';', '\t']).count();
    if cuts(header) == 0 || header.contains(',') {
        return quoted_decimal_points(text, report);
    }
    let (mut commas, mut points) = (0, 0);
    for field in lines.take(20).flat_map(|l| l.split([';', '\t'])) {
        commas += usize::from(field.matches(',').count() == 1 && is_number(&field.replace(',', ".")));
        // The points of a date are none of a number.
        points += usize::from(field.contains('.') && is_number(field));
    }
    if commas < 20 || points > 0 {
        return Cow::Borrowed(text);
    }
    report.note("numbers have decimal commas: read as such".into());
    Cow::Owned(text.replace(',', "."))
}

/// What a field may stand in.
const QUOTE: char = '\u{22}';

/// The same where commas cut fields: a number with a comma stands in quotes then. Where all have three digits behind it they may be
/// thousands.
fn quoted_decimal_points<'a>(text: &'a str, report: &mut Report) -> Cow<'a, str> {
    let quoted = |of: &'a str| of.split(QUOTE).skip(1).step_by(2);
    let is_decimal = |field: &str| field.matches(',').count() == 1 && is_number(&field.replace(',', "."));
    let head = text.char_indices().filter(|(_, c)| *c == '\n').nth(20).map_or(text, |(end, _)| &text[..end]);
    let decimals = || quoted(head).filter(|f| is_decimal(f));
    let points = head.split([',', '\n', QUOTE]).any(|f| f.contains('.') && is_number(f.trim()));
    let may_be_thousands = decimals().all(|f| f.rsplit(',').next().is_some_and(|fraction| fraction.len() == 3));
    if decimals().count() < 20 || points || may_be_thousands {
        return Cow::Borrowed(text);
    }
    report.note("numbers have decimal commas, in quotes: read as such".into());
    let of_numbers = |field: &str| field.chars().all(|c| c.is_ascii_digit() || "+-:TZ., ".contains(c));
    let piece = |(k, piece): (usize, &str)| if k % 2 == 1 && of_numbers(piece) { piece.replace(',', ".") } else { piece.to_owned() };
    Cow::Owned(text.split(QUOTE).enumerate().map(piece).collect::<Vec<_>>().join(&QUOTE.to_string()))
}

/// Rows that go back in time so often at most are blocks put together in another order; any more are of two logs.
const MOST_BLOCKS: usize = 10;
/// A block of rows has so many at least.
const LEAST_ROWS_OF_A_BLOCK: usize = 10;
/// A clock of local time is set back by so much in autumn, s.
const SUMMER_TIME_S: f64 = 3600.0;

impl Table<'_> {
    /// Rows in the order of time, without those that have none, of a clock that was not set, and without repeats. Of the flight format
    /// (`own`) a row has all channels, and no two of them one time; rows of two logs stay as they are, and are refused where times fall.
    ///
    /// # Errors
    /// Rows of two logs, or of a clock that was set back.
    pub(super) fn arrange(&mut self, clock: &mut Clock, own: bool, channels: &Channels, report: &mut Report) -> Result<(), String> {
        let times = &mut clock.seconds;
        if let Some((fill, _)) = undeclared_fill(times) {
            times.iter_mut().filter(|t| **t == fill).for_each(|t| *t = f64::NAN);
        }
        stray_times(times, LONGEST_MISSION_S);
        lonely_times(times);
        let all = self.rows;
        let mut rows: Vec<usize> = (0..all).filter(|i| times[*i].is_finite()).collect();
        if rows.len() < all {
            report.leave_out(format!("{} of {all} rows have no time, or one days or years off the others", all - rows.len()));
        }
        let (back, on) = steps(&rows, times);
        if back > 0 && on == 0 {
            rows.reverse();
            report.note("rows run backward in time: turned round".into());
        }
        self.drop_repeated_blocks(&mut rows, times, report);
        self.spread(&rows, clock.column, times, report);
        if steps(&rows, times).0 > 0 {
            self.of_one_log(&rows, times, own, channels)?;
            sort_blocks(&mut rows, times, own, report);
        }
        if own {
            let dated = rows.len();
            let first = rows.windows(2).find(|w| times[w[0]] == times[w[1]]).map_or(0, |w| w[1] + 1);
            rows.dedup_by(|b, a| times[*a] == times[*b]);
            if rows.len() < dated {
                let out = dated - rows.len();
                report
                    .leave_out(format!("{out} of {dated} rows repeat a time: the first of each stays (from row {first} of the table on)"));
            }
        }
        if rows.len() < all || rows.windows(2).any(|w| w[1] < w[0]) {
            self.columns.iter_mut().for_each(|column| column.take(&rows));
            self.rows = rows.len();
        }
        clock.seconds = rows.iter().map(|i| times[*i]).collect();
        Ok(())
    }

    /// Refuses rows with a pressure that go back in time a few times and lie among those before them then, or that go back by an hour.
    fn of_one_log(&self, rows: &[usize], times: &[f64], own: bool, channels: &Channels) -> Result<(), String> {
        let named = |k: &usize| [Channel::Pressure, Channel::Depth].into_iter().any(|c| channels.of(c).is_called(&self.names[*k]));
        let columns: Vec<usize> = (0..self.names.len()).filter(named).collect();
        let has = |i: &&usize| columns.iter().any(|k| self.columns[*k].has(**i));
        let rows: Vec<usize> = rows.iter().filter(has).copied().collect();
        let falls: Vec<[usize; 2]> = rows.windows(2).filter(|w| times[w[1]] < times[w[0]]).map(|w| [w[0], w[1]]).collect();
        let usual_s = quantile(&rows.windows(2).map(|w| times[w[1]] - times[w[0]]).collect::<Vec<_>>(), 0.5);
        // Set back by an hour, its first row stands a step after what the last one read an hour before.
        let an_hour = |f: &&[usize; 2]| (times[f[0]] - times[f[1]] - SUMMER_TIME_S + usual_s).abs() <= 2.0 * usual_s;
        let mixed = !own && falls.len() <= MOST_BLOCKS && blocks(&rows, times).1.len() > falls.len() + 1 + MOST_BLOCKS;
        let Some([last, next]) = falls.iter().find(an_hour).or(if mixed { falls.first() } else { None }) else { return Ok(()) };
        Err(format!(
            "time goes back by {:.0} s after row {} of the table{}: a clock that was set back (summer time?), or two logs; write UTC, or import one log at a time",
            times[*last] - times[*next],
            last + 1,
            if mixed { ", and the rows after it lie among those before" } else { "" }
        ))
    }

    /// Times of a clock of whole seconds or minutes, set evenly apart up to the next one.
    fn spread(&self, rows: &[usize], column: usize, times: &mut [f64], report: &mut Report) {
        let of: Vec<f64> = rows.iter().map(|i| times[*i]).collect();
        let others = || self.columns.iter().enumerate().filter(|(k, _)| *k != column).map(|(_, c)| c);
        let differ = |a: usize, b: usize| others().any(|c| !c.same(a, b) && c.has(a) && c.has(b));
        let pairs: Vec<bool> = rows.windows(2).filter(|w| times[w[0]] == times[w[1]]).map(|w| differ(w[0], w[1])).collect();
        if 2 * pairs.iter().filter(|d| **d).count() <= pairs.len() {
            return;
        }
        let Some(even) = spread_evenly(&of) else { return };
        rows.iter().zip(even).for_each(|(i, t)| times[*i] = t);
        report.note(format!(
            "{} of {} times repeat the one before (a clock of whole seconds or minutes?): spread evenly up to the next",
            pairs.len(),
            rows.len()
        ));
    }

    /// Leaves out rows that stand a second time further on, as those of a block that was added twice.
    fn drop_repeated_blocks(&self, rows: &mut Vec<usize>, times: &[f64], report: &mut Report) {
        // Where time always goes on no row stands there twice.
        if rows.windows(2).all(|w| times[w[1]] > times[w[0]]) {
            return;
        }
        let all = rows.len();
        // Rows of one time, of which some may be the same.
        let mut seen: HashMap<u64, Vec<usize>> = HashMap::new();
        let mut before = f64::NAN;
        rows.retain(|i| {
            let alike = seen.entry(times[*i].to_bits()).or_default();
            let stands = alike.iter().any(|k| self.columns.iter().all(|c| c.same(*k, *i)));
            if !stands {
                alike.push(*i);
            }
            let first = !stands || times[*i] == before;
            before = if first { times[*i] } else { before };
            first
        });
        if rows.len() < all {
            report.note(format!("{} of {all} rows stand there a second time, with the same values: taken once", all - rows.len()));
        }
    }
}

/// How often time goes back, and on, from row to row.
fn steps(rows: &[usize], times: &[f64]) -> (usize, usize) {
    let count = |falls: bool| rows.windows(2).filter(|w| times[w[0]] != times[w[1]] && (times[w[1]] < times[w[0]]) == falls).count();
    (count(true), count(false))
}

/// The rows' places in the order of time, and the lengths of the runs of rows that stay together in it.
fn blocks(rows: &[usize], times: &[f64]) -> (Vec<usize>, Vec<usize>) {
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by(|a, b| times[rows[*a]].total_cmp(&times[rows[*b]]));
    let lengths = order.chunk_by(|a, b| *b == a + 1).map(<[usize]>::len).collect();
    (order, lengths)
}

/// Puts blocks of rows in the order of time: a few that do not mix, or, where channels may stand in rows of their own, any.
fn sort_blocks(rows: &mut [usize], times: &[f64], own: bool, report: &mut Report) {
    let time = |k: usize| times[rows[k]];
    let (order, blocks) = blocks(rows, times);
    let twice = order.windows(2).any(|w| time(w[0]) == time(w[1]));
    // Single rows out of order are of two logs, or of damage.
    if own && (twice || blocks.len() > MOST_BLOCKS || blocks.iter().any(|rows| *rows < LEAST_ROWS_OF_A_BLOCK)) {
        return;
    }
    let sorted: Vec<usize> = order.iter().map(|k| rows[*k]).collect();
    rows.copy_from_slice(&sorted);
    report.note(format!("rows stand in {} blocks out of the order of time: sorted", blocks.len()));
}

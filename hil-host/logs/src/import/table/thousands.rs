//! Numbers whose digits stand in groups of three: 3'570.0, 3 570.0, 3,570.0.

use std::borrow::Cow;

use super::super::Report;
use super::Table;
use crate::channels::Channels;
use crate::record::csv::no_value;

/// What stands between the groups and is nothing else in a number: apostrophes and blanks, also of a typesetter.
const GROUPING: [char; 6] = ['\'', '\u{2019}', ' ', '\u{a0}', '\u{2009}', '\u{202f}'];

/// What ends a field, or its quotes.
const ENDS: [char; 6] = [',', ';', '\t', '\n', '\r', '"'];

/// Whether a number has groups of three digits behind its first one to three, between `separators`; and whether there is no doubt of it:
/// the groups are two and more, or a decimal sign follows them.
fn grouped(field: &str, separators: &[char]) -> Option<bool> {
    let digits = field.strip_prefix(['-', '+']).unwrap_or(field);
    let separator = digits.chars().find(|c| !c.is_ascii_digit()).filter(|c| separators.contains(c))?;
    // The last sign, unless it may be one more separator.
    let decimal = digits.rfind(['.', ',']).filter(|at| !digits[*at..].starts_with(separator) || digits.len() - at != 4);
    let (whole, fraction) = decimal.map_or((digits, ""), |at| (&digits[..at], &digits[at + 1..]));
    let mut groups = whole.split(separator);
    let is_digits = |t: &str| t.bytes().all(|b| b.is_ascii_digit());
    let first = groups.next().is_some_and(|g| (1..=3).contains(&g.len()) && is_digits(g));
    let count = groups.clone().count();
    let sound = first && count > 0 && groups.all(|g| g.len() == 3 && is_digits(g)) && is_digits(fraction);
    sound.then_some(count > 1 || decimal.is_some())
}

/// The text without the apostrophes and blanks in its numbers.
pub(super) fn without_grouping<'a>(text: &'a str, report: &mut Report) -> Cow<'a, str> {
    let is_grouped = |field: &&str| field.contains(GROUPING) && grouped(field.trim_end_matches(ENDS).trim(), &GROUPING).is_some();
    // Most lines have none of these signs.
    let may = |line: &&str| line.bytes().any(|b| matches!(b, b'\'' | b' ' | 0x80..));
    let count = text.split_inclusive('\n').filter(may).flat_map(|line| line.split_inclusive(ENDS)).filter(is_grouped).count();
    if count == 0 {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for field in text.split_inclusive(ENDS) {
        if is_grouped(&field) {
            out.extend(field.chars().filter(|c| !GROUPING.contains(c)));
        } else {
            out.push_str(field);
        }
    }
    report.note(format!("{count} numbers have apostrophes or blanks between thousands: read without them"));
    Cow::Owned(out)
}

impl Table<'_> {
    /// Refuses channels whose numbers have commas or points between thousands.
    ///
    /// # Errors
    /// The column and such a number.
    pub(super) fn no_grouping(&self, channels: &Channels) -> Result<(), String> {
        for (column, name) in self.columns.iter().zip(&self.names).filter(|(_, name)| channels.knows(name, "", "")) {
            let all = column.texts();
            let texts = || all.iter().map(|t| t.1).filter(|f| !no_value(f));
            let kinds: Vec<Option<bool>> = texts().map(|f| grouped(f, &[',', '.'])).collect();
            if kinds.iter().any(Option::is_none) {
                continue;
            }
            let sure = texts().zip(&kinds).find(|(_, kind)| **kind == Some(true)).map(|(f, _)| f);
            let Some(example) = sure.or_else(|| texts().next()) else { continue };
            let or = if sure.is_some() { "" } else { " (or decimal commas)" };
            return Err(format!(
                "column {name}: {} of {} numbers have thousands separators{or}, such as `{example}`: save the file again without them",
                kinds.len(),
                self.rows
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regress_thousands_are_known_from_other_fields() {
        for (field, sure) in
            [("3'570.0", true), ("-156'100", false), ("1'234'567", true), ("3 570.25", true), ("3\u{202f}570", false), ("3'570,5", true)]
        {
            assert_eq!(grouped(field, &GROUPING), Some(sure), "{field}");
        }
        for (field, sure) in [("3,570.0", true), ("3.570,0", true), ("13,971", false), ("1,234,567", true), ("156.100.0", true)] {
            assert_eq!(grouped(field, &[',', '.']), Some(sure), "{field}");
        }
        for field in
            ["", "-", "'", "3570", "1234'570", "3'57", "3'5700", "a'570", "2020 123", "54 12.345", "3 570 N", "13.09.2020", "33,0066"]
        {
            assert_eq!((grouped(field, &GROUPING), grouped(field, &[',', '.'])), (None, None), "{field}");
        }
        let mut report = Report::new("csv");
        let text = "t,p\n2020-09-13 12:26:40,\"3'570.0\"\n2020-09-13 12:26:44, -1 234.5 \nO'Brien,x";
        let want = "t,p\n2020-09-13 12:26:40,\"3570.0\"\n2020-09-13 12:26:44,-1234.5\nO'Brien,x";
        assert_eq!(without_grouping(text, &mut report), want);
        assert!(report.notes[0].starts_with("2 numbers have apostrophes"));
    }
}

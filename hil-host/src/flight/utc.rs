//! UTC for a person: ISO 8601, to and from milliseconds since 1970.

use anyhow::{Context, ensure};
use discovery::export::netcdf::compact_date;

/// 2026-11-27T10:40:00Z of milliseconds since 1970.
#[must_use]
pub fn iso(ms: u64) -> String {
    let compact = compact_date(ms as f64 * 1e-3);
    let part = |from: usize, to: usize| compact.get(from..to).unwrap_or_default();
    format!("{}-{}-{}T{}:{}:{}Z", part(0, 4), part(4, 6), part(6, 8), part(9, 11), part(11, 13), part(13, 15))
}

/// Milliseconds since 1970 of `2026-11-27`, `2026-11-27T10:40` or `2026-11-27T10:40:05Z`, UTC.
///
/// # Errors
/// Something else, with what it should be.
pub fn parse(text: &str) -> anyhow::Result<u64> {
    moment(text).with_context(|| format!("{text:?} is no UTC: write 2026-11-27T10:40:00Z, or 2026-11-27 for its beginning"))
}

fn moment(text: &str) -> anyhow::Result<u64> {
    let (date, time) = text.trim().trim_end_matches(['Z', 'z']).split_once(['T', 't', ' ']).unwrap_or((text.trim(), "00:00"));
    let numbers =
        |text: &str, by: char| text.split(by).map(|n| n.parse::<u64>().map_err(anyhow::Error::from)).collect::<anyhow::Result<Vec<_>>>();
    let (date, mut time) = (numbers(date, '-')?, numbers(time, ':')?);
    if time.len() == 2 {
        time.push(0);
    }
    let (&[year, month, day], &[h, m, s]) = (&date[..], &time[..]) else { anyhow::bail!("a date has three numbers, a time two or three") };
    let leap = year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let days = [31, 28 + u64::from(leap), 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];
    ensure!((1970..2100).contains(&year) && (1..=12).contains(&month) && h < 24 && m < 60 && s < 60, "no such date or time");
    ensure!((1..=days[month as usize - 1]).contains(&day), "no such day");
    let leaps = |year: u64| year / 4 - year / 100 + year / 400;
    let before = 365 * (year - 1970) + leaps(year - 1) - leaps(1969) + days.iter().take(month as usize - 1).sum::<u64>();
    Ok(1000 * (86_400 * (before + day - 1) + 3600 * h + 60 * m + s))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_is_read_as_it_is_written() {
        // date -u -d TEXT +%s
        for (text, s) in [("2026-11-27T10:40:05Z", 1_795_776_005), ("2000-02-29 23:59", 951_868_740), ("2027-01-01", 1_798_761_600)] {
            assert_eq!(parse(text).unwrap(), 1000 * s, "{text}");
        }
        for ms in [0, 951_868_740_000, 1_795_776_005_000, 4_102_444_799_000] {
            assert_eq!(parse(&iso(ms)).unwrap(), ms);
        }
        for bad in ["", "now", "2026-13-01", "2026-02-29", "2026-11-27T25:00", "27.11.2026", "2026-11-27T10", "2026-11-27T10:40:05+01:00"] {
            let e = format!("{:#}", parse(bad).unwrap_err());
            assert!(e.contains("write 2026-11-27T10:40:00Z"), "{e}");
        }
    }
}

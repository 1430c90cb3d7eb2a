//! Dates as logs write them, in Unix time.

/// Days from 1970-01-01 of the Gregorian calendar (Fliegel and Van Flandern 1968, Comm. ACM 11, 657); none of a day that no month has.
#[must_use]
pub fn days_from_1970(year: i64, month: i64, day: i64) -> Option<i64> {
    let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    let last = match month {
        1 | 3 | 5 | 7 | 8 | 10 | 12 => 31,
        4 | 6 | 9 | 11 => 30,
        2 => 28 + i64::from(leap),
        _ => return None,
    };
    if !((1..=last).contains(&day) && (1..4000).contains(&year)) {
        return None;
    }
    let m = (month - 14) / 12;
    let julian = (1461 * (year + 4800 + m)) / 4 + (367 * (month - 2 - 12 * m)) / 12 - (3 * ((year + 4900 + m) / 100)) / 4 + day - 32_075;
    Some(julian - 2_440_588)
}

/// No flight is later than the year 2100, Unix time, s.
pub const LATEST_S: f64 = 4.103e9;

/// Seconds in a unit of time; case does not matter.
#[must_use]
pub fn seconds_in(unit: &str) -> Option<f64> {
    Some(match unit.trim().to_ascii_lowercase().as_str() {
        "ns" | "nanoseconds" | "nanosecond" => 1e-9,
        "us" | "microseconds" | "microsecond" => 1e-6,
        "ms" | "msec" | "milliseconds" | "millisecond" => 1e-3,
        "s" | "sec" | "secs" | "seconds" | "second" => 1.0,
        "min" | "mins" | "minutes" | "minute" => 60.0,
        "h" | "hr" | "hours" | "hour" => 3600.0,
        "d" | "days" | "day" => 86400.0,
        _ => return None,
    })
}

/// Unix time of "2020-09-13T12:26:40.5Z", also with a blank for the T, a zone (+02:00, CEST), UTC or GMT for the Z, or neither (UTC).
#[must_use]
pub fn iso_8601(text: &str) -> Option<f64> {
    let (date, rest) = text.trim().split_at_checked(10)?;
    let mut parts = date.split('-').map(str::parse::<i64>);
    let days = days_from_1970(parts.next()?.ok()?, parts.next()?.ok()?, parts.next()?.ok()?)?;
    if parts.next().is_some() {
        return None;
    }
    Some(days as f64 * 86400.0 + clock_s(rest.strip_prefix(['T', 't', ' ']).unwrap_or(rest))?)
}

/// `text` without `end`, whatever its case.
fn without_end<'a>(text: &'a str, end: &str) -> Option<&'a str> {
    let at = text.len().checked_sub(end.len())?;
    text.get(at..)?.eq_ignore_ascii_case(end).then(|| text[..at].trim_end())
}

/// Seconds from midnight UTC of "12:26:40.5", "12:26", "10:26:40 PM", with or without a zone; 0 of an empty text.
fn clock_s(text: &str) -> Option<f64> {
    let text = text.trim();
    let utc = |t| ["Z", "UTC", "GMT"].iter().find_map(|end| without_end(t, end));
    let (clock, zone) = match (utc(text), text.rfind(['+', '-'])) {
        (Some(clock), _) => (clock, 0.0),
        (None, Some(at)) => (text[..at].trim_end(), zone_s(&text[at..])?),
        (None, None) => match zone_name(text) {
            Some(name) => (text[..text.len() - name.len()].trim_end(), zone_s(name)?),
            None => (text, 0.0),
        },
    };
    let clock = utc(clock).unwrap_or(clock);
    let half = [("AM", 0.0), ("PM", 43_200.0)].iter().find_map(|(end, after_s)| Some((without_end(clock, end)?, *after_s)));
    let (clock, noon_s) = half.map_or((clock, None), |(clock, after_s)| (clock, Some(after_s)));
    if clock.is_empty() {
        return noon_s.is_none().then_some(-zone);
    }
    let mut seconds = 0.0;
    // Hours, minutes and seconds, a leap second among them.
    let sizes: [(f64, std::ops::RangeInclusive<f64>); 3] = [(3600.0, 0.0..=24.0), (60.0, 0.0..=59.99), (1.0, 0.0..=60.99)];
    let mut parts = clock.split(':');
    for ((size, possible), part) in sizes.iter().zip(parts.by_ref()) {
        let digits = !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'.' | b','));
        let value: f64 = digits.then(|| part.replace(',', ".").parse().ok()).flatten().filter(|v| possible.contains(v))?;
        seconds += size * value;
    }
    if parts.next().is_some() {
        return None;
    }
    if let Some(after_s) = noon_s {
        let hour = (seconds / 3600.0_f64).floor();
        if !(1.0..=12.0).contains(&hour) {
            return None;
        }
        seconds = seconds % 43_200.0 + after_s;
    }
    Some(seconds - zone)
}

/// Names that stand for one zone, with its hours east of UTC; case does not matter.
const ZONES: [(&str, f64); 23] = [
    ("Z", 0.0),
    ("UTC", 0.0),
    ("GMT", 0.0),
    ("WET", 0.0),
    ("WEST", 1.0),
    ("CET", 1.0),
    ("CEST", 2.0),
    ("EET", 2.0),
    ("EEST", 3.0),
    ("NDT", -2.5),
    ("EDT", -4.0),
    ("CDT", -5.0),
    ("MDT", -6.0),
    ("PDT", -7.0),
    ("AKDT", -8.0),
    ("AKST", -9.0),
    ("JST", 9.0),
    ("AWST", 8.0),
    ("ACST", 9.5),
    ("AEST", 10.0),
    ("AEDT", 11.0),
    ("NZST", 12.0),
    ("NZDT", 13.0),
];
/// Names that stand for several zones, whose hours differ.
const SEVERAL_ZONES: [&str; 9] = ["AST", "BST", "CST", "EST", "IST", "MST", "NST", "PST", "SST"];

/// The letters behind the clock of "2026-05-02 09:15 CEST", "9:15 PM CEST": not AM or PM.
#[must_use]
pub fn zone_name(text: &str) -> Option<&str> {
    let text = text.trim_end();
    let is_half = |t: &str| without_end(t, "AM").or_else(|| without_end(t, "PM")).map(str::len);
    if is_half(text).is_some() {
        return None;
    }
    let before = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let clock = before.trim_end();
    let clock = &clock[..is_half(clock).unwrap_or(clock.len())];
    (before.len() < text.len() && clock.ends_with(|c: char| c.is_ascii_digit())).then(|| &text[before.len()..])
}

/// Whether a name stands for several zones.
#[must_use]
pub fn is_of_several_zones(name: &str) -> bool {
    SEVERAL_ZONES.iter().any(|s| s.eq_ignore_ascii_case(name))
}

/// Why the zone at the end of a time, or of that name, is not read, and the way out; none where it is read or there is none.
#[must_use]
pub fn why_no_zone(text: &str) -> Option<String> {
    let text = text.trim();
    let name = zone_name(text).or(Some(text).filter(|t| is_of_several_zones(t))).filter(|name| zone_s(name).is_none())?;
    let why = if is_of_several_zones(name) { "stands for several" } else { "is not known" };
    Some(format!("the zone {name} {why}: write UTC, or the hours from it as in +02:00"))
}

/// Seconds east of UTC of "+02:00", "-0330", "+530", "-6:00", "-6", "CEST"; none of what no place on Earth has, or several have.
#[must_use]
pub fn zone_s(zone: &str) -> Option<f64> {
    let zone = zone.trim();
    if let Some((_, hours)) = ZONES.iter().find(|z| z.0.eq_ignore_ascii_case(zone)) {
        return Some(hours * 3600.0);
    }
    let rest = zone.strip_prefix(['+', '-'])?;
    let (hours, minutes) = match rest.split_once(':') {
        Some(parts) => parts,
        None if rest.len() <= 2 => (rest, "0"),
        None => rest.split_at_checked(rest.len() - 2)?,
    };
    let whole = |t: &str| (matches!(t.len(), 1 | 2) && t.bytes().all(|b| b.is_ascii_digit())).then(|| t.parse::<u16>().ok()).flatten();
    let (hours, minutes) = (whole(hours)?, whole(minutes)?);
    let east = f64::from(60 * hours + minutes) * 60.0;
    (minutes < 60 && east <= FURTHEST_ZONE_S).then_some(if zone.starts_with('-') { -east } else { east })
}

/// Unix time of a date and clock whose date is the one that Julian days count from: 1 January 4713 BC of the Julian calendar, also with a
/// year 0 before the first one, and as 24 November of the Gregorian one (Meeus, Astronomical Algorithms, chapter 7).
#[must_use]
pub fn julian_origin_s(text: &str) -> Option<f64> {
    /// 1970-01-01T00:00 is 2440587.5, and the days begin at noon.
    const TO_1970: f64 = 2_440_588.0;
    let (date, clock) = parts(text.trim());
    if !["-4713-01-01", "-4713-1-1", "-4712-01-01", "-4713-11-24"].contains(&date) {
        return None;
    }
    Some(clock_s(clock)? - TO_1970 * 86_400.0)
}

/// UTC+14 is the easternmost, s.
const FURTHEST_ZONE_S: f64 = 14.0 * 3600.0;

/// Which number of "02/05/2026" is the day.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DayMonth {
    /// dd/mm/yyyy.
    DayFirst,
    /// mm/dd/yyyy.
    MonthFirst,
}

/// A date and what stands behind it.
fn parts(text: &str) -> (&str, &str) {
    let digit_before = |at: usize| text[..at].ends_with(|c: char| c.is_ascii_digit());
    let letter = text.match_indices(['T', 't']).map(|m| m.0).find(|at| digit_before(*at));
    let at = text.find(' ').into_iter().chain(letter).min();
    at.map_or((text, ""), |at| (&text[..at], &text[at + 1..]))
}

/// The first two numbers of "02/05/2026 …" or "02-05-2026 …", either of which may be the day.
#[must_use]
pub fn day_and_month(text: &str) -> Option<(i64, i64)> {
    let (date, _) = parts(text.trim());
    let fields: Vec<&str> = date.split(['/', '-']).collect();
    let [first, second, year] = fields[..] else { return None };
    let number = |t: &str| t.parse::<i64>().ok().filter(|v| (1..=31).contains(v));
    (year.len() == 4 && number(first).is_some() && year.parse::<u16>().is_ok()).then_some((number(first)?, number(second)?))
}

/// Unix time of a date as programs write it: ISO 8601, with or without its dashes and colons, yyyy/mm/dd, dd.mm.yyyy, 02-May-2026; and
/// with slashes in `order`.
#[must_use]
pub fn date_time(text: &str, order: Option<DayMonth>) -> Option<f64> {
    let text = text.trim();
    if let Some(unix_s) = iso_8601(text) {
        return Some(unix_s);
    }
    let (date, clock) = parts(text);
    let fields: Vec<&str> = date.split(['/', '.', '-']).collect();
    let number = |t: &str| t.bytes().all(|b| b.is_ascii_digit()).then(|| t.parse::<i64>().ok()).flatten();
    let (year, month, day) = match fields[..] {
        [all] if all.len() == 8 => (number(all.get(..4)?)?, number(all.get(4..6)?)?, number(all.get(6..)?)?),
        [year, month, day] if year.len() == 4 => (number(year)?, number(month)?, number(day)?),
        [day, month, year] if year.len() == 4 && month_named(month).is_some() => (number(year)?, month_named(month)?, number(day)?),
        [day, month, year] if year.len() == 4 && date.contains('.') => (number(year)?, number(month)?, number(day)?),
        [first, second, year] if year.len() == 4 => match order? {
            DayMonth::DayFirst => (number(year)?, number(second)?, number(first)?),
            DayMonth::MonthFirst => (number(year)?, number(first)?, number(second)?),
        },
        _ => return None,
    };
    let dense = clock.len() >= 6 && !clock.contains(':') && clock.bytes().take(6).all(|b| b.is_ascii_digit());
    let spelt = dense.then(|| format!("{}:{}:{}", &clock[..2], &clock[2..4], &clock[4..]));
    Some(days_from_1970(year, month, day)? as f64 * 86400.0 + clock_s(spelt.as_deref().unwrap_or(clock))?)
}

/// 1 to 12 of an English name of a month or its first three letters.
fn month_named(name: &str) -> Option<i64> {
    const MONTHS: [&str; 12] = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"];
    let three = name.get(..3).filter(|_| name.bytes().all(|b| b.is_ascii_alphabetic()))?;
    (1..).zip(MONTHS).find(|(_, m)| m.eq_ignore_ascii_case(three)).map(|(k, _)| k)
}

/// Unix time of the digits YYYYMMDDhhmmss, of 1980 to 2099.
#[must_use]
pub fn digits(text: &str) -> Option<f64> {
    if text.len() != 14 || !text.bytes().all(|b| b.is_ascii_digit()) || !(1980..2100).contains(&text[..4].parse::<u16>().ok()?) {
        return None;
    }
    date_time(&format!("{}T{}", &text[..8], &text[8..]), None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn iso_times_are_read() {
        assert_eq!(iso_8601("2020-09-13T12:26:40Z"), Some(1.6e9));
        assert_eq!(iso_8601("2020-09-13 12:26:40.500"), Some(1_600_000_000.5));
        assert_eq!(iso_8601("2020-09-13T14:26:40+02:00"), Some(1.6e9));
        assert_eq!(iso_8601("2020-09-13"), Some(1_599_955_200.0));
        for wrong in ["", "12", "2020-13-01", "2020-09-13T99:00", "x020-09-13", "UTC", "2020-09-1é"] {
            assert_eq!(iso_8601(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn regress_zones_of_one_digit_and_days_that_do_not_exist() {
        for (zone, hours) in [("-6:00", -6.0), ("+2:00", 2.0), ("-6", -6.0), ("+0530", 5.5), ("-0330", -3.5), ("+02", 2.0), ("+530", 5.5)] {
            assert_eq!(zone_s(zone), Some(hours * 3600.0), "{zone}");
        }
        for wrong in ["", "+", "02", "+15:00", "+02:60", "+14:01", "+1234567", "-a", "+2:", "+\u{e9}1"] {
            assert_eq!(zone_s(wrong), None, "{wrong}");
        }
        assert_eq!(iso_8601("2020-09-13T06:26:40-6:00"), Some(1.6e9));
        for wrong in
            ["2026-02-31T00:00Z", "2026-02-29", "2026-04-31", "2100-02-29", "2026-05-02T25:00", "2026-05-02T10:60", "2026-05-02T1:2:3:4"]
        {
            assert_eq!(iso_8601(wrong), None, "{wrong}");
        }
        assert!(iso_8601("2024-02-29").is_some() && iso_8601("2000-02-29").is_some());
    }

    #[test]
    fn accuracy_julian_days_count_from_noon_of_their_origin() {
        // 2451545.0 is 2000-01-01T12:00 (Meeus, Astronomical Algorithms, chapter 7).
        let noon = iso_8601("2000-01-01T12:00:00Z").expect("a time");
        for origin in ["-4713-01-01T12:00:00Z", "-4713-1-1 12:00", "-4712-01-01 12:00:00", "-4713-11-24T12:00:00"] {
            assert_eq!(julian_origin_s(origin), Some(noon - 2_451_545.0 * 86_400.0), "{origin}");
        }
        // A day that begins at midnight (SeaDataNet).
        assert_eq!(julian_origin_s("-4713-01-01"), Some(noon - 2_451_545.5 * 86_400.0));
        assert_eq!((julian_origin_s("4713-01-01"), julian_origin_s("-4713-1-10"), julian_origin_s("")), (None, None, None));
    }

    #[test]
    fn regress_names_of_zones_are_read_or_named() {
        for (text, hours) in [
            ("2020-09-13 14:26:40 CEST", 2.0),
            ("2020-09-13T14:26:40CEST", 2.0),
            ("13-Sep-2020 13:26:40 cet", 1.0),
            ("13/09/2020 02:26:40 PM CEST", 2.0),
            ("20200913T142640 CEST", 2.0),
            ("2020-09-13 08:26:40 EDT", -4.0),
            ("2020-09-13 22:26:40 AEST", 10.0),
            ("2020-09-13 12:26:40 WET", 0.0),
        ] {
            assert_eq!(date_time(text, Some(DayMonth::DayFirst)), Some(1.6e9), "{text}");
            assert_eq!((zone_name(text).and_then(zone_s), why_no_zone(text)), (Some(hours * 3600.0), None), "{text}");
        }
        for name in ["CST", "IST", "BST", "EST", "MST", "PST", "XYZ"] {
            let text = format!("2020-09-13 12:26:40 {name}");
            assert_eq!((date_time(&text, None), zone_s(name)), (None, None), "{name}");
            assert!(why_no_zone(&text).is_some_and(|w| w.contains(&format!("the zone {name} "))), "{name}");
        }
        assert!(why_no_zone("CST").is_some() && why_no_zone("ms").is_none() && why_no_zone("UTC").is_none());
        for none in ["13-Sep-2020", "2020-09-13 12:26 PM", "2020-09-13", "May", "", "\u{e9}"] {
            assert_eq!(zone_name(none), None, "{none}");
        }
    }

    #[test]
    fn regress_dates_as_programs_write_them() {
        for text in [
            "2020-09-13T12:26:40 GMT",
            "2020-09-13 12:26:40,0 UTC",
            "20200913T122640Z",
            "2020/09/13 12:26:40",
            "2020/9/13 12:26:40",
            "13.09.2020 12:26:40",
            "13-Sep-2020 12:26:40",
            "13-SEPT-2020 12:26:40",
            "13-sep-2020T12:26:40",
            "13/09/2020 12:26:40 PM",
            "13-09-2020 14:26:40+2:00",
            "13/09/2020 12:26:40 UTC",
        ] {
            assert_eq!(date_time(text, Some(DayMonth::DayFirst)), Some(1.6e9), "{text}");
        }
        assert_eq!(date_time("09/13/2020 12:26:40", Some(DayMonth::MonthFirst)), Some(1.6e9));
        assert_eq!(date_time("09/13/2020 12:26:40 AM", Some(DayMonth::MonthFirst)), Some(1.6e9 - 43_200.0));
        assert_eq!(digits("20200913122640"), Some(1.6e9));
        for wrong in [
            "12:26:40",
            "13/09/20 12:26",
            "13/13/2020",
            "1e9",
            "",
            "a/b/2020",
            "\u{e9}\u{e9}/\u{e9}/2020",
            "13 PM",
            "May",
            "9/13/2020 13:00 PM",
        ] {
            assert_eq!(date_time(wrong, Some(DayMonth::DayFirst)), None, "{wrong}");
        }
        assert_eq!(date_time("02/05/2026", None), None);
        assert_eq!((day_and_month("02/05/2026 09:15"), day_and_month("2026/05/02")), (Some((2, 5)), None));
        assert_eq!((digits("20261313000000"), digits("17777133312500"), digits("202009131226")), (None, None, None));
    }
}

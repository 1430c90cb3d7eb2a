//! Dates as logs write them, in Unix time.

/// Days from 1970-01-01 of the Gregorian calendar (Fliegel and Van Flandern 1968, Comm. ACM 11, 657).
#[must_use]
pub fn days_from_1970(year: i64, month: i64, day: i64) -> Option<i64> {
    if !((1..=12).contains(&month) && (1..=31).contains(&day) && (1..4000).contains(&year)) {
        return None;
    }
    let m = (month - 14) / 12;
    let julian = (1461 * (year + 4800 + m)) / 4 + (367 * (month - 2 - 12 * m)) / 12 - (3 * ((year + 4900 + m) / 100)) / 4 + day - 32_075;
    Some(julian - 2_440_588)
}

/// Unix time of "2020-09-13T12:26:40.5Z", also with a blank for the T, a zone for the Z, or neither (UTC).
#[must_use]
pub fn iso_8601(text: &str) -> Option<f64> {
    let text = text.trim();
    let (date, rest) = text.split_at_checked(10)?;
    let mut parts = date.split('-').map(str::parse::<i64>);
    let days = days_from_1970(parts.next()?.ok()?, parts.next()?.ok()?, parts.next()?.ok()?)?;
    if parts.next().is_some() {
        return None;
    }
    let rest = rest.strip_prefix(['T', 't', ' ']).unwrap_or(rest);
    let rest = rest.strip_suffix(['Z', 'z']).or_else(|| rest.strip_suffix(" UTC")).unwrap_or(rest);
    let (clock, zone_s) = match rest.rfind(['+', '-']) {
        Some(at) => (&rest[..at], zone_s(&rest[at..])?),
        None => (rest, 0.0),
    };
    let mut seconds = 0.0;
    if !clock.is_empty() {
        let mut size = 3600.0;
        for part in clock.split(':') {
            let value: f64 = part.parse().ok().filter(|v| (0.0..=60.0).contains(v))?;
            seconds += size * value;
            size /= 60.0;
        }
    }
    Some(days as f64 * 86400.0 + seconds - zone_s)
}

/// Seconds east of UTC of "+02:00", "-0330".
#[must_use]
pub fn zone_s(zone: &str) -> Option<f64> {
    let digits: String = zone.get(1..)?.chars().filter(char::is_ascii_digit).collect();
    let (hours, minutes) = digits.split_at_checked(2)?;
    let minutes = if minutes.is_empty() { 0.0 } else { minutes.parse::<f64>().ok()? };
    let east = hours.parse::<f64>().ok()? * 3600.0 + minutes * 60.0;
    Some(if zone.starts_with('-') { -east } else { east })
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
}

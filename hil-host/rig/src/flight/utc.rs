//! UTC for a person: ISO 8601, to and from milliseconds since 1970.

use anyhow::Context;
use logs::export::netcdf::compact_date;
use logs::import::calendar::iso_8601;

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
    let plain = text.trim().trim_end_matches(['Z', 'z']).replace(['t', ' '], "T");
    let ms = iso_8601(&plain).filter(|s| *s >= 0.0).map(|s| (s * 1e3) as u64);
    // That reader takes days and hours that are not; a moment is written as it was read.
    ms.filter(|ms| matches!(plain.len(), 10 | 16 | 19) && iso(*ms).starts_with(&plain))
        .with_context(|| format!("{text:?} is no UTC: write 2026-11-27T10:40:00Z, or 2026-11-27 for its beginning"))
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

//! Decimal text to number and back, without a heap and without a panic.

use crate::Unfit;

/// Most digits that are taken; 15 were seen on the line.
const MOST_DIGITS: u32 = 18;
/// Largest power of ten that is believed, either way.
const LARGEST_EXPONENT: i32 = 30;

/// A number such as `-0.3491`, `42` or `4.2e1`. Words (`nan`, `inf`), nothing at all and rests are refused. Exact to one rounding up
/// to 15 digits.
#[must_use]
pub fn parse(text: &[u8]) -> Option<f64> {
    let (negative, text) = match text.split_first()? {
        (b'-', rest) => (true, rest),
        (b'+', rest) => (false, rest),
        _ => (false, text),
    };
    let (mut mantissa, mut digits, mut seen, mut exponent, mut point) = (0u64, 0u32, false, 0i32, false);
    let mut bytes = text.iter();
    for byte in bytes.by_ref() {
        match byte {
            b'0'..=b'9' => {
                seen = true;
                // Digits beyond the last that counts only move the point.
                if digits < MOST_DIGITS {
                    mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte.wrapping_sub(b'0')));
                    digits = if mantissa == 0 { 0 } else { digits.saturating_add(1) };
                    exponent = exponent.saturating_sub(i32::from(point));
                } else {
                    exponent = exponent.saturating_add(i32::from(!point));
                }
            }
            b'.' if !point => point = true,
            b'e' | b'E' if seen => {
                exponent = exponent.saturating_add(integer(bytes.as_slice())?);
                break;
            }
            _ => return None,
        }
    }
    if !seen {
        return None;
    }
    if mantissa == 0 {
        return Some(0.0);
    }
    if !(-LARGEST_EXPONENT..=LARGEST_EXPONENT).contains(&exponent) {
        return None;
    }
    let scale = (0..exponent.unsigned_abs()).fold(1.0f64, |p, _| p * 10.0);
    let value = if exponent < 0 { mantissa as f64 / scale } else { mantissa as f64 * scale };
    Some(if negative { -value } else { value })
}

/// A whole number with a sign, small enough for an exponent.
fn integer(text: &[u8]) -> Option<i32> {
    let (negative, digits) = match text.split_first()? {
        (b'-', rest) => (true, rest),
        (b'+', rest) => (false, rest),
        _ => (false, text),
    };
    let value = i32::from(index(digits)?);
    Some(if negative { -value } else { value })
}

/// A whole number from 0 to 999 without a sign: the index of a sensor.
#[must_use]
pub fn index(text: &[u8]) -> Option<u16> {
    if text.is_empty() || text.len() > 3 {
        return None;
    }
    text.iter().try_fold(0u16, |n, b| match b {
        b'0'..=b'9' => Some(n.wrapping_mul(10).wrapping_add(u16::from(b.wrapping_sub(b'0')))),
        _ => None,
    })
}

/// Largest number that is written: one that the glider takes for a link to a parameter is none of ours.
pub const LARGEST: f64 = 1e6;

/// Writes `value` with six decimals as C's `%f` does; nothing for what is not finite or not below [`LARGEST`].
///
/// # Errors
/// Not a number to be written, or no room.
pub fn write<const N: usize>(value: f64, out: &mut heapless::Vec<u8, N>) -> Result<(), Unfit> {
    if !(value > -LARGEST && value < LARGEST) {
        return Err(Unfit);
    }
    let rounded = libm::round(value * 1e6);
    if rounded < 0.0 {
        out.push(b'-').map_err(|_| Unfit)?;
    }
    // Below 1e12: the cast is exact.
    let micro = libm::fabs(rounded) as u64;
    whole(micro / 1_000_000, 1, out)?;
    out.push(b'.').map_err(|_| Unfit)?;
    whole(micro % 1_000_000, 6, out)
}

/// Writes a whole number with at least `least` digits.
///
/// # Errors
/// No room.
pub fn whole<const N: usize>(mut value: u64, least: usize, out: &mut heapless::Vec<u8, N>) -> Result<(), Unfit> {
    let mut digits: heapless::Vec<u8, 20> = heapless::Vec::new();
    while value > 0 || digits.len() < least {
        digits.push(b'0'.wrapping_add((value % 10) as u8)).map_err(|_| Unfit)?;
        value /= 10;
    }
    digits.iter().rev().try_for_each(|d| out.push(*d)).map_err(|_| Unfit)
}

#[cfg(test)]
mod tests {
    use super::{index, parse, write};
    use proptest::prelude::*;

    fn text(value: f64) -> Option<String> {
        let mut out = heapless::Vec::<u8, 32>::new();
        write(value, &mut out).ok()?;
        String::from_utf8(out.to_vec()).ok()
    }

    #[test]
    fn numbers_of_the_line_are_read_and_words_refused() {
        for (said, value) in [("42.75", 42.75), ("-0.3491", -0.3491), ("0", 0.0), ("4.2e1", 42.0), ("1767225604.01", 1_767_225_604.01)] {
            assert_eq!(parse(said.as_bytes()), Some(value), "{said}");
        }
        for bad in ["", "-", ".", "nan", "-inf", "1e", "e5", "1e999", "0x10", "1.2.3", "4 2", "1e31"] {
            assert_eq!(parse(bad.as_bytes()), None, "{bad}");
        }
        assert_eq!((index(b"31"), index(b"5:"), index(b""), index(b"-1")), (Some(31), None, None, None));
    }

    #[test]
    fn what_no_parameter_may_be_is_not_written() {
        assert_eq!(text(236.0).as_deref(), Some("236.000000"));
        assert_eq!(text(-0.45).as_deref(), Some("-0.450000"));
        assert_eq!(text(-1e-9).as_deref(), Some("0.000000"));
        for bad in [1e6, -1e6, f64::NAN, f64::INFINITY] {
            assert_eq!(text(bad), None, "{bad}");
        }
    }

    proptest! {
        #[test]
        fn prop_a_number_is_read_as_the_standard_library_reads_it(value in -1e9f64..1e9, decimals in 0usize..7) {
            let said = format!("{value:.decimals$}");
            let ours = parse(said.as_bytes()).expect("a number");
            let theirs: f64 = said.parse().expect("a number");
            prop_assert!((ours - theirs).abs() <= 4.0 * f64::EPSILON * theirs.abs(), "{said}: {ours} {theirs}");
        }

        #[test]
        fn prop_what_is_written_is_read_back_within_half_a_step(value in -999_999.0f64..999_999.0) {
            let back = parse(text(value).expect("written").as_bytes()).expect("read");
            prop_assert!((back - value).abs() < 0.51e-6, "{value} {back}");
        }

        #[test]
        fn prop_noise_is_refused_or_a_finite_number(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
            prop_assert!(parse(&bytes).is_none_or(f64::is_finite));
        }
    }
}

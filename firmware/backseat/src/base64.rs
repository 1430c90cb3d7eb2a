//! Bytes of a file in a sentence: every block is base64 on its own, some without their padding.

use crate::Unfit;

const fn digit(byte: u8) -> Option<u32> {
    Some(match byte {
        b'A'..=b'Z' => byte.wrapping_sub(b'A') as u32,
        b'a'..=b'z' => byte.wrapping_sub(b'a') as u32 + 26,
        b'0'..=b'9' => byte.wrapping_sub(b'0') as u32 + 52,
        b'+' => 62,
        b'/' => 63,
        _ => return None,
    })
}

/// Hands the bytes of a block to `take`, all or (where the block is damaged) none.
///
/// # Errors
/// The block is no base64.
pub fn decode(block: &[u8], mut take: impl FnMut(u8)) -> Result<(), Unfit> {
    let digits = block.split(|b| *b == b'=').next().unwrap_or_default();
    let padding = block.get(digits.len()..).unwrap_or_default();
    if padding.len() > 2 || padding.iter().any(|b| *b != b'=') || digits.len() % 4 == 1 || digits.iter().any(|b| digit(*b).is_none()) {
        return Err(Unfit);
    }
    for group in digits.chunks(4) {
        let bits = group.iter().fold(0u32, |bits, b| bits << 6 | digit(*b).unwrap_or(0));
        let missing = 4usize.saturating_sub(group.len()) as u32;
        let bits = bits.wrapping_shl(missing.wrapping_mul(6));
        for i in 0..3u32.saturating_sub(missing) {
            take((bits >> 16u32.saturating_sub(i.wrapping_mul(8))) as u8);
        }
    }
    Ok(())
}

/// Writes bytes as one padded block.
///
/// # Errors
/// No room.
pub fn encode<const N: usize>(bytes: &[u8], out: &mut heapless::Vec<u8, N>) -> Result<(), Unfit> {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for group in bytes.chunks(3) {
        let bits = group.iter().fold(0u32, |bits, b| bits << 8 | u32::from(*b));
        let bits = bits.wrapping_shl((3usize.saturating_sub(group.len()) as u32).wrapping_mul(8));
        for i in 0..4usize {
            let at = (bits >> 18usize.saturating_sub(i.wrapping_mul(6))) & 63;
            let letter = if i <= group.len() { ALPHABET.get(at as usize).copied().unwrap_or(b'=') } else { b'=' };
            out.push(letter).map_err(|_| Unfit)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{decode, encode};
    use proptest::prelude::*;

    fn decoded(block: &[u8]) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        decode(block, |b| bytes.push(b)).ok().map(|()| bytes)
    }

    #[test]
    fn validate_blocks_with_and_without_padding() {
        assert_eq!(decoded(b"b2sK").as_deref(), Some(b"ok\n".as_slice()));
        assert_eq!(decoded(b"b2s=").as_deref(), Some(b"ok".as_slice()));
        assert_eq!(decoded(b"b2s").as_deref(), Some(b"ok".as_slice()));
        assert_eq!(decoded(b"bXAKdV9taXNzaW9uX3BhcmFtX2EK").as_deref(), Some(b"mp\nu_mission_param_a\n".as_slice()));
        for bad in ["b", "b2s$", "b=s=", "===", "b2sKb"] {
            assert_eq!(decoded(bad.as_bytes()), None, "{bad}");
        }
    }

    proptest! {
        #[test]
        fn prop_decode_takes_back_encode(bytes in prop::collection::vec(any::<u8>(), 0..64)) {
            let mut block = heapless::Vec::<u8, 96>::new();
            encode(&bytes, &mut block).expect("room");
            prop_assert_eq!(decoded(&block), Some(bytes));
        }
    }
}

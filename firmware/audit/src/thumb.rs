//! What one function's machine code does to the stack, and whom it calls.
//!
//! Thumb-2 encodings from the Armv7-M Architecture Reference Manual (DDI 0403E),
//! section A7.7; only those that move SP down, branch, or load an address.

use crate::image::Function;
use anyhow::{Result, bail};
use std::collections::BTreeMap;

/// What was read of a function.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Reading {
    /// Sum of all moves of SP downwards, bytes: an upper bound of its frame.
    pub frame: u32,
    /// Branch-and-link targets, and jumps that leave the function.
    pub calls: Vec<u32>,
    /// Calls or jumps through a register.
    pub indirect: u32,
    /// Addresses put together by MOVW and MOVT.
    pub addresses: Vec<u32>,
}

/// Reads a function; refuses code that moves SP by what cannot be known.
pub fn read(function: &Function) -> Result<Reading> {
    let mut out = Reading::default();
    let mut low: BTreeMap<u32, u32> = BTreeMap::new();
    let leave = |out: &mut Reading, target: u32| {
        if target < function.start || target >= function.end {
            out.calls.push(target);
        }
    };
    let mut i = 0;
    while let Some(&(at, first)) = function.code.get(i) {
        let h = u32::from(first);
        if h >> 11 < 0b11101 {
            i += 1;
            match h {
                _ if h & 0xfe00 == 0xb400 => out.frame += 4 * (h & 0x1ff).count_ones(), // PUSH
                _ if h & 0xff80 == 0xb080 => out.frame += 4 * (h & 0x7f),               // SUB SP
                _ if h & 0xff87 == 0x4780 => out.indirect += 1,                         // BLX reg
                _ if h & 0xff87 == 0x4700 && h != 0x4770 => out.indirect += 1,          // BX reg but LR
                // MOV SP, reg or ADD SP, reg: only epilogues and over-aligned frames; counted as unknown.
                _ if h & 0xff87 == 0x4685 || h & 0xff87 == 0x4485 => {
                    bail!("{}: SP set from a register at {at:#x}", function.name)
                }
                _ if h & 0xf000 == 0xd000 && h & 0x0e00 != 0x0e00 => {
                    leave(&mut out, at.wrapping_add(4).wrapping_add(signed(h & 0xff, 8) << 1)); // B cond
                }
                _ if h & 0xf800 == 0xe000 => leave(&mut out, at.wrapping_add(4).wrapping_add(signed(h & 0x7ff, 11) << 1)), // B
                _ => {}
            }
            continue;
        }
        let Some(&(_, second)) = function.code.get(i + 1) else { break };
        i += 2;
        let k = u32::from(second);
        let destination = k >> 8 & 0xf;
        match h {
            0xe92d => out.frame += 4 * k.count_ones(),               // STMDB SP! (PUSH.W)
            0xe96d => out.frame += 4 * (k & 0xff),                   // STRD pre-indexed on SP
            0xf84d if k & 0x0f00 == 0x0d00 => out.frame += k & 0xff, // STR pre-indexed on SP
            _ if h & 0xffbf == 0xed2d && k & 0x0e00 == 0x0a00 => out.frame += 4 * (k & 0xff), // VPUSH
            _ if h & 0xfbef == 0xf1ad && destination == 13 => {
                out.frame += expand(h >> 10 & 1, k >> 12 & 7, k & 0xff); // SUB.W SP, SP, #const
            }
            _ if h & 0xfbff == 0xf2ad && destination == 13 => {
                out.frame += (h >> 10 & 1) << 11 | (k >> 12 & 7) << 8 | k & 0xff; // SUBW SP, SP, #imm12
            }
            _ if h & 0xffef == 0xebad && destination == 13 => bail!("{}: SP moved by a register at {at:#x}", function.name),
            _ if h & 0xfbf0 == 0xf240 => {
                low.insert(destination, wide(h, k)); // MOVW
            }
            _ if h & 0xfbf0 == 0xf2c0 => {
                if let Some(low) = low.get(&destination) {
                    out.addresses.push(wide(h, k) << 16 | low); // MOVT
                }
            }
            _ if h & 0xf800 == 0xf000 && k & 0x8000 != 0 => {
                let target = at.wrapping_add(4).wrapping_add(branch(h, k));
                if k & 0xd000 == 0xd000 {
                    out.calls.push(target); // BL
                } else if k & 0xd000 == 0x9000 {
                    leave(&mut out, target); // B.W
                } else if k & 0xd000 == 0x8000 && h >> 7 & 0x7 != 0x7 {
                    leave(&mut out, at.wrapping_add(4).wrapping_add(conditional(h, k))); // B.W cond
                }
            }
            _ => {}
        }
    }
    Ok(out)
}

/// Sign-extends `bits` bits.
fn signed(value: u32, bits: u32) -> u32 {
    let shift = 32 - bits;
    (((value << shift) as i32) >> shift) as u32
}

/// 16-bit immediate of MOVW and MOVT.
fn wide(h: u32, k: u32) -> u32 {
    (h & 0xf) << 12 | (h >> 10 & 1) << 11 | (k >> 12 & 7) << 8 | k & 0xff
}

/// Offset of BL and B.W (T4).
fn branch(h: u32, k: u32) -> u32 {
    let (s, j1, j2) = (h >> 10 & 1, k >> 13 & 1, k >> 11 & 1);
    let (i1, i2) = (1 ^ j1 ^ s, 1 ^ j2 ^ s);
    signed(s << 24 | i1 << 23 | i2 << 22 | (h & 0x3ff) << 12 | (k & 0x7ff) << 1, 25)
}

/// Offset of B.W cond (T3).
fn conditional(h: u32, k: u32) -> u32 {
    let (s, j1, j2) = (h >> 10 & 1, k >> 13 & 1, k >> 11 & 1);
    signed(s << 20 | j2 << 19 | j1 << 18 | (h & 0x3f) << 12 | (k & 0x7ff) << 1, 21)
}

/// `ThumbExpandImm` (A5.3.2).
fn expand(i: u32, imm3: u32, imm8: u32) -> u32 {
    let code = i << 3 | imm3;
    match code {
        0 => imm8,
        1 => imm8 << 16 | imm8,
        2 => imm8 << 24 | imm8 << 8,
        3 => imm8 * 0x0101_0101,
        _ => (0x80 | imm8 & 0x7f).rotate_right(code << 1 | imm8 >> 7),
    }
}

#[cfg(test)]
mod tests {
    use super::{Reading, read};
    use crate::image::Function;

    /// `halves` as a function at 0x0800_1000. Encodings by GNU as.
    fn reading(halves: &[u16]) -> Reading {
        let start = 0x0800_1000;
        let code: Vec<_> = halves.iter().enumerate().map(|(i, h)| (start + 2 * i as u32, *h)).collect();
        let end = start + 2 * code.len() as u32;
        read(&Function { name: "f".into(), start, end, code }).unwrap()
    }

    #[test]
    fn every_way_down_is_counted() {
        assert_eq!(reading(&[0xb5f0]).frame, 20, "push {{r4-r7, lr}}");
        assert_eq!(reading(&[0xb082]).frame, 8, "sub sp, #8");
        assert_eq!(reading(&[0xe92d, 0x4ff0]).frame, 36, "push.w {{r4-r11, lr}}");
        assert_eq!(reading(&[0xf84d, 0x8d04]).frame, 4, "str r8, [sp, #-4]!");
        assert_eq!(reading(&[0xed2d, 0x8b04]).frame, 16, "vpush {{d8, d9}}");
        assert_eq!(reading(&[0xf5ad, 0x6d80]).frame, 1024, "sub.w sp, sp, #1024");
        assert_eq!(reading(&[0xf2ad, 0x4d04]).frame, 1028, "subw sp, sp, #1028");
    }

    #[test]
    fn calls_and_jumps_out_are_seen() {
        assert_eq!(reading(&[0xf000, 0xf87e]).calls, [0x0800_1100], "bl +0x100");
        assert_eq!(reading(&[0xf7ff, 0xfffe]).calls, [0x0800_1000], "bl to itself is recursion");
        assert_eq!(reading(&[0xf000, 0xb87e]).calls, [0x0800_1100], "b.w +0x100");
        assert_eq!(reading(&[0xe7fe]).calls, [] as [u32; 0], "b . stays inside");
        assert_eq!(reading(&[0x4788]).indirect, 1, "blx r1");
        assert_eq!(reading(&[0x4770]).indirect, 0, "bx lr");
        assert_eq!(reading(&[0xf241, 0x2034, 0xf6c0, 0x0000]).addresses, [0x0800_1234], "movw, movt r0");
    }
}

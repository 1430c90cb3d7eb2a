//! Lift and drag between the grid points of a checked table.
//!
//! Four-point Lagrange interpolation on the uniform grid. C_L is continued odd
//! and C_D even across α = 0, so the first interval is as exact as the others;
//! the last interval leans on the three points before its end. A straight line
//! would need 3–4 times the points for the same error.

use signals::Wings;

use crate::format::{ALPHA_CEILING_RAD, FORMAT, HEADER, MAX_POINTS, MAX_TABLE, MIN_POINTS, POINT, Sample, TableError, crc32, wings_code};

/// A table whose header, CRC and values were checked.
#[derive(Clone, Copy, Debug)]
pub struct Table<'a> {
    bytes: &'a [u8],
    last: u16,
    wings: Wings,
    area_m2: f32,
    alpha_max_rad: f32,
    per_rad: f32,
    best_alpha_rad: f32,
    best_l_over_d: f32,
}

/// Force coefficients on the table's reference area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coefficients {
    /// Lift coefficient, odd in α.
    pub cl: f32,
    /// Drag coefficient, even in α.
    pub cd: f32,
}

fn word(bytes: &[u8], at: usize) -> Option<[u8; 4]> {
    bytes.get(at..)?.first_chunk().copied()
}

fn float(bytes: &[u8], at: usize) -> Option<f32> {
    word(bytes, at).map(f32::from_le_bytes)
}

fn whole(bytes: &[u8], at: usize) -> Option<u32> {
    word(bytes, at).map(u32::from_le_bytes)
}

impl<'a> Table<'a> {
    /// Checks bytes once; afterwards every look-up is total.
    ///
    /// Checked: length, format, CRC, wing set; area 1 cm²..10 m²; α range
    /// ≤ 60°; every coefficient finite, C_D > 0, |C_L| < 100; C_L(0) = 0; the
    /// stated (L/D)max agrees with the table's own points to 1 %.
    ///
    /// # Errors
    /// The first thing wrong.
    pub fn parse(bytes: &'a [u8], wings: Wings) -> Result<Self, TableError> {
        let &[format, code, n, reserved, ..] = bytes else { return Err(TableError::Length) };
        if format != FORMAT {
            return Err(TableError::Format(format));
        }
        let n = usize::from(n);
        if !(MIN_POINTS..=MAX_POINTS).contains(&n) || bytes.len() > MAX_TABLE || bytes.len() != HEADER + POINT * n + 4 {
            return Err(TableError::Length);
        }
        let end = HEADER + POINT * n;
        let covered = bytes.get(..end).ok_or(TableError::Length)?;
        if whole(bytes, end) != Some(crc32(covered)) {
            return Err(TableError::Crc);
        }
        if code != wings_code(wings) {
            return Err(TableError::Wings);
        }
        let table = Self::header(bytes, n, wings)?;
        let Self { area_m2, alpha_max_rad, best_alpha_rad, best_l_over_d, .. } = table;
        let header_ok = reserved == 0
            && (1e-4..=10.0).contains(&area_m2)
            && (0.01..=ALPHA_CEILING_RAD).contains(&alpha_max_rad)
            && best_alpha_rad > 0.0
            && best_alpha_rad <= alpha_max_rad
            && (0.1..=100.0).contains(&best_l_over_d);
        if !header_ok {
            return Err(TableError::Value);
        }
        for i in 0..n {
            let s = table.sample(i as i32);
            let ok = s.cl.is_finite() && s.cl.abs() < 100.0 && s.cd > 0.0 && s.cd < 1000.0 && (i > 0 || s.cl == 0.0);
            if !ok {
                return Err(TableError::Value);
            }
        }
        let own = table.at(best_alpha_rad);
        let agrees = (own.cl / own.cd - best_l_over_d).abs() <= 0.01 * best_l_over_d;
        if agrees { Ok(table) } else { Err(TableError::Value) }
    }

    /// The same table again from bytes that [`Table::parse`] took before and that somebody has guarded since: without its CRC and
    /// without a look at every value. `None` if they cannot be its bytes.
    #[must_use]
    pub fn checked_before(bytes: &'a [u8], wings: Wings) -> Option<Self> {
        let &[_, code, n, ..] = bytes else { return None };
        let n = usize::from(n);
        let whole = (MIN_POINTS..=MAX_POINTS).contains(&n) && bytes.len() == HEADER + POINT * n + 4 && code == wings_code(wings);
        if whole { Self::header(bytes, n, wings).ok() } else { None }
    }

    fn header(bytes: &'a [u8], n: usize, wings: Wings) -> Result<Self, TableError> {
        let value = |at| float(bytes, at).filter(|v| v.is_finite()).ok_or(TableError::Value);
        let (area_m2, alpha_max_rad, best_alpha_rad, best_l_over_d) = (value(12)?, value(16)?, value(20)?, value(24)?);
        let last = n.saturating_sub(1);
        let per_rad = last as f32 / alpha_max_rad;
        Ok(Self { bytes, last: last as u16, wings, area_m2, alpha_max_rad, per_rad, best_alpha_rad, best_l_over_d })
    }

    /// CRC-32 of the table: its identity in every log.
    #[must_use]
    pub fn id(&self) -> u32 {
        whole(self.bytes, HEADER + POINT * (usize::from(self.last) + 1)).unwrap_or(0)
    }

    /// Lift and drag at an angle of attack, rad; clamped to the valid range.
    ///
    /// Total: a NaN angle gives zero lift and the drag at the end of the
    /// range, so that nothing good is ever expected of it.
    #[must_use]
    pub fn at(&self, alpha_rad: f32) -> Coefficients {
        let size = alpha_rad.abs();
        let (size, sign) = if size.is_nan() {
            (self.alpha_max_rad, 0.0)
        } else {
            (if size < self.alpha_max_rad { size } else { self.alpha_max_rad }, if alpha_rad < 0.0 { -1.0 } else { 1.0 })
        };
        let position = size * self.per_rad;
        // Saturating: position is finite and within 0..=last.
        let left = (position as i32).min(i32::from(self.last) - 2).max(0);
        let t = position - left as f32;
        let [a, b, c, d] = self.four(left);
        let (wa, wb) = (-t * (t - 1.0) * (t - 2.0) * (1.0 / 6.0), 0.5 * (t + 1.0) * (t - 1.0) * (t - 2.0));
        let (wc, wd) = (-0.5 * (t + 1.0) * t * (t - 2.0), (t + 1.0) * t * (t - 1.0) * (1.0 / 6.0));
        let cl = wa * a.cl + wb * b.cl + wc * c.cl + wd * d.cl;
        let cd = wa * a.cd + wb * b.cd + wc * c.cd + wd * d.cd;
        Coefficients { cl: sign * cl, cd }
    }

    /// Grid points `left` − 1 .. `left` + 2: in one piece but at the mirror.
    fn four(&self, left: i32) -> [Sample; 4] {
        let first = (left.unsigned_abs() as usize).saturating_sub(1);
        let piece = self.bytes.get(HEADER + POINT * first..).and_then(|b| b.first_chunk::<{ 4 * POINT }>());
        if let (Some(piece), true) = (piece, left > 0) {
            let (words, _) = piece.as_chunks::<4>();
            if let &[a, b, c, d, e, f, g, h] = words {
                let point = |cl, cd| Sample { cl: f32::from_le_bytes(cl), cd: f32::from_le_bytes(cd) };
                return [point(a, b), point(c, d), point(e, f), point(g, h)];
            }
        }
        [self.sample(left - 1), self.sample(left), self.sample(left + 1), self.sample(left + 2)]
    }

    /// Grid point `i`; negative `i` mirrors (C_L odd, C_D even).
    fn sample(&self, i: i32) -> Sample {
        let at = HEADER + POINT * (i.unsigned_abs() as usize).min(usize::from(self.last));
        // Present after parse; the fallback is a brick: all drag, no lift.
        let cl = float(self.bytes, at).unwrap_or(0.0);
        let cd = float(self.bytes, at + 4).unwrap_or(1.0);
        Sample { cl: if i < 0 { -cl } else { cl }, cd }
    }

    /// Wing set the table is for.
    #[must_use]
    pub fn wings(&self) -> Wings {
        self.wings
    }

    /// CRC-32 of the vehicle file the table was made from.
    #[must_use]
    pub fn vehicle_id(&self) -> u32 {
        whole(self.bytes, 4).unwrap_or(0)
    }

    /// CRC-32 of the flight the fit used, 0 when nothing was fitted.
    #[must_use]
    pub fn fit_id(&self) -> u32 {
        whole(self.bytes, 8).unwrap_or(0)
    }

    /// Number of grid points.
    #[must_use]
    pub fn points(&self) -> usize {
        usize::from(self.last) + 1
    }

    /// The table as it is stored and sent.
    #[must_use]
    pub fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// Angle of attack of (L/D)max, rad.
    #[must_use]
    pub fn best_alpha_rad(&self) -> f32 {
        self.best_alpha_rad
    }

    /// (L/D)max.
    #[must_use]
    pub fn best_l_over_d(&self) -> f32 {
        self.best_l_over_d
    }

    /// Largest |α| the table is valid for, rad.
    #[must_use]
    pub fn alpha_max_rad(&self) -> f32 {
        self.alpha_max_rad
    }

    /// Reference area of the coefficients, m².
    #[must_use]
    pub fn area_m2(&self) -> f32 {
        self.area_m2
    }
}

#[cfg(test)]
mod tests {
    use signals::Wings;

    use super::{Coefficients, Table};
    use crate::encode::{EncodeError, Spec, encode};
    use crate::format::{HEADER, MAX_POINTS, MAX_TABLE, Sample, TableError, crc32};

    /// A parabolic vehicle on 0.1 m²: C_L = 6.75 α, C_D = 0.15 + 10.5 α².
    fn parabola(alpha: f32) -> Coefficients {
        Coefficients { cl: 6.75 * alpha, cd: 0.15 + 10.5 * alpha * alpha }
    }

    fn spec() -> Spec {
        // α* = sqrt(0.15/10.5), (L/D)max = 6.75/(2 sqrt(0.15·10.5))
        Spec {
            wings: Wings::Standard,
            vehicle_id: 0x1234_5678,
            fit_id: 9,
            area_m2: 0.1,
            alpha_max_rad: 0.4,
            best_alpha_rad: 0.119_522_86,
            best_l_over_d: 2.689_264_4,
        }
    }

    fn samples(n: usize) -> std::vec::Vec<Sample> {
        (0..n).map(|i| parabola(0.4 * i as f32 / (n - 1) as f32)).map(|c| Sample { cl: c.cl, cd: c.cd }).collect()
    }

    fn sealed(change: impl FnOnce(&mut [u8])) -> std::vec::Vec<u8> {
        let mut bytes = encode(&spec(), &samples(21)).unwrap().to_vec();
        let end = bytes.len() - 4;
        change(&mut bytes[..end]);
        let crc = crc32(&bytes[..end]);
        bytes[end..].copy_from_slice(&crc.to_le_bytes());
        bytes
    }

    #[test]
    fn a_table_says_what_was_written_into_it() {
        let bytes = encode(&spec(), &samples(21)).unwrap();
        let t = Table::parse(&bytes, Wings::Standard).unwrap();
        assert_eq!(bytes.len(), HEADER + 21 * 8 + 4);
        assert_eq!((t.vehicle_id(), t.fit_id(), t.points(), t.wings()), (0x1234_5678, 9, 21, Wings::Standard));
        assert_eq!((t.best_alpha_rad(), t.best_l_over_d(), t.alpha_max_rad(), t.area_m2()), (0.119_522_86, 2.689_264_4, 0.4, 0.1));
        assert_eq!(t.id(), crc32(&bytes[..bytes.len() - 4]));
        assert_eq!(t.bytes(), &bytes[..]);
    }

    #[test]
    fn accuracy_a_cubic_is_interpolated_exactly() {
        let bytes = encode(&spec(), &samples(21)).unwrap();
        let t = Table::parse(&bytes, Wings::Standard).unwrap();
        for i in -4000..=4000 {
            let a = i as f32 * 1e-4;
            let (got, want) = (t.at(a), parabola(a));
            // f32 rounding of weights and sums, no unit.
            assert!((got.cl - want.cl).abs() < 2e-6 && (got.cd - want.cd).abs() < 2e-6, "{a}: {got:?} {want:?}");
        }
    }

    #[test]
    fn prop_lift_is_odd_drag_is_even_and_the_range_is_clamped() {
        let bytes = encode(&spec(), &samples(58)).unwrap();
        assert!(bytes.len() <= MAX_TABLE);
        let t = Table::parse(&bytes, Wings::Standard).unwrap();
        for i in 0..1000 {
            let a = i as f32 * 1e-3;
            let (p, n) = (t.at(a), t.at(-a));
            assert_eq!((p.cl, p.cd), (-n.cl, n.cd));
        }
        assert_eq!(t.at(0.4), t.at(9.0));
        assert_eq!(t.at(f32::INFINITY), t.at(0.4));
        assert_eq!(t.at(f32::NAN), Coefficients { cl: 0.0, cd: t.at(0.4).cd });
        assert_eq!(t.at(0.0).cl, 0.0);
    }

    #[test]
    fn every_single_flipped_bit_is_refused() {
        let good = encode(&spec(), &samples(9)).unwrap();
        for bit in 0..good.len() * 8 {
            let mut bad = good.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            assert!(Table::parse(&bad, Wings::Standard).is_err(), "bit {bit}");
        }
        for cut in 0..good.len() {
            assert!(Table::parse(&good[..cut], Wings::Standard).is_err(), "cut {cut}");
        }
    }

    #[test]
    fn unphysical_values_are_refused_even_with_a_right_crc() {
        let refused = |at: usize, v: f32| {
            let bytes = sealed(|b| b[at..at + 4].copy_from_slice(&v.to_le_bytes()));
            Table::parse(&bytes, Wings::Standard).err()
        };
        assert!(Table::parse(&sealed(|_| ()), Wings::Standard).is_ok());
        for (at, v) in [
            (12, 0.0),
            (12, f32::NAN),
            (16, 2.0),
            (20, 0.41),
            (20, 0.0),
            (24, f32::INFINITY),
            (24, 2.75),
            (HEADER, 0.1),
            (HEADER + 4, 0.0),
            (HEADER + 4, f32::NAN),
            (HEADER + 8, f32::NEG_INFINITY),
        ] {
            assert_eq!(refused(at, v), Some(TableError::Value), "{v} at {at}");
        }
        assert_eq!(Table::parse(&sealed(|b| b[0] = 2), Wings::Standard).err(), Some(TableError::Format(2)));
        assert_eq!(Table::parse(&sealed(|b| b[1] = 1), Wings::Standard).err(), Some(TableError::Wings));
        assert_eq!(Table::parse(&sealed(|_| ()), Wings::LowAspectRatio).err(), Some(TableError::Wings));
        assert_eq!(Table::parse(&[], Wings::Standard).err(), Some(TableError::Length));
    }

    #[test]
    fn what_would_be_refused_is_not_written() {
        assert_eq!(encode(&spec(), &samples(4)).err(), Some(EncodeError::Points(4)));
        assert_eq!(encode(&spec(), &samples(MAX_POINTS + 1)).err(), Some(EncodeError::Points(MAX_POINTS + 1)));
        let mut s = samples(21);
        s[3].cd = f32::NAN;
        assert_eq!(encode(&spec(), &s).err(), Some(EncodeError::Refused(TableError::Value)));
        assert_eq!(encode(&Spec { best_l_over_d: 3.0, ..spec() }, &samples(21)).err(), Some(EncodeError::Refused(TableError::Value)));
    }

    #[test]
    fn built_in_tables_parse() {
        for wings in [Wings::Standard, Wings::LowAspectRatio] {
            let t = crate::builtin(wings).unwrap();
            assert!(t.bytes().len() <= MAX_TABLE);
            assert!((0.03..0.5).contains(&t.best_alpha_rad()) && (1.0..10.0).contains(&t.best_l_over_d()), "{t:?}");
        }
    }
}

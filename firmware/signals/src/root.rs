//! The square root, where no maths library is: the same bits on every computer.

/// Square root, relative error ≤ 3e-7; 0 of what is below 1e-30 or no number.
#[must_use]
pub fn sqrt(x: f32) -> f32 {
    if !(1e-30..1e30).contains(&x) {
        return 0.0;
    }
    // Half the exponent, mirrored, as the first guess of 1 / √x (3.5 % off); each Newton step squares the error.
    let mut y = f32::from_bits(0x5f37_59df_u32.wrapping_sub(x.to_bits() >> 1));
    for _ in 0..3 {
        y *= 1.5 - 0.5 * x * y * y;
    }
    x * y
}

#[cfg(test)]
mod tests {
    use super::sqrt;

    #[test]
    fn accuracy_a_root_is_right_to_rounding() {
        let worst = (0..2_000_000_u32).map(|i| f32::from_bits(0x2000_0000 + 500 * i)).filter(|x| (1e-30..1e30).contains(x));
        let worst = worst.map(|x| (f64::from(sqrt(x)) / f64::from(x).sqrt() - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < 3e-7, "{worst}");
        assert_eq!([0.0, -1.0, f32::NAN, f32::INFINITY].map(sqrt), [0.0; 4]);
    }
}

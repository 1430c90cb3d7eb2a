//! Roots and angles in f32, the same bits on every computer: additions and products of IEEE 754, nothing from a library.

/// Square root, relative error ≤ 3e-7; 0 of what is below 1e-30 or no number.
pub(crate) fn sqrt(x: f32) -> f32 {
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

/// Sine and cosine of an angle within ±1.5 rad, error ≤ 2e-6: Taylor's series.
pub(crate) fn sin_cos(x: f32) -> (f32, f32) {
    let q = x * x;
    let sin = x * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0)))));
    let cos = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0 * (1.0 - q / 132.0)))));
    (sin, cos)
}

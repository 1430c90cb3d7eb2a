//! Cuts a flight that is one long segment into its dives, so that some of them can be kept out of a fit.
//!
//! A cut is made at the shallow turning point between a climb and the next dive. A turning point counts when the pressure has
//! moved by a third of the flight's range since the one before: noise and small steps at an apogee do not cut.

use logs::record::flight::Flight;
use logs::vehicle::Vehicle;

/// Share of the pressure range that makes a climb or a dive.
const SWING: f64 = 0.33;
/// Least swing, Pa: ordinary heave near the surface is no dive.
const LEAST_SWING_PA: f64 = 3e4;
/// Fewest dives worth cutting: with fewer none could be spared for checking.
pub const FEWEST_DIVES_CUT: usize = 4;

/// Most dives that a fit takes: what hundreds more of one mission add is less than the model's form is off by.
pub const MOST_FITTED: usize = 60;

/// At most `most` of `n` things, spread evenly from first to last.
#[must_use]
pub fn evenly(n: usize, most: usize) -> Vec<usize> {
    if n <= most { (0..n).collect() } else { (0..most).map(|i| (i * (n - 1) + (most - 1) / 2) / (most - 1).max(1)).collect() }
}

/// Rows at which a dive begins after a climb, within each segment.
#[must_use]
pub fn shallow_turns(flight: &Flight) -> Vec<usize> {
    let p = &flight.pressure_pa;
    let swing = (SWING * (logs::record::plausible::quantile(p, 0.98) - logs::record::plausible::quantile(p, 0.02))).max(LEAST_SWING_PA);
    let mut turns = Vec::new();
    // Lowest and highest pressure since the last turning point, and whether the vehicle is on its way down.
    let (mut least, mut most, mut down) = (None::<usize>, None::<usize>, None::<bool>);
    for i in 0..p.len() {
        if i > 0 && flight.segment[i] != flight.segment[i - 1] {
            (least, most, down) = (None, None, None);
        }
        if !p[i].is_finite() {
            continue;
        }
        if least.is_none_or(|k| p[i] <= p[k]) {
            least = Some(i);
        }
        if most.is_none_or(|k| p[i] >= p[k]) {
            most = Some(i);
        }
        let (Some(low), Some(high)) = (least, most) else { continue };
        if down != Some(true) && p[i] - p[low] > swing {
            if down == Some(false) {
                turns.push(low);
            }
            (down, most) = (Some(true), Some(i));
        } else if down != Some(false) && p[high] - p[i] > swing {
            (down, least) = (Some(false), Some(i));
        }
    }
    turns
}

/// Segment numbers with every dive a segment of its own: only where the file has too few segments with a dive to keep some out,
/// the vehicle file names none, and there are dives enough.
#[must_use]
pub fn cut(flight: &Flight, vehicle: &Vehicle) -> Option<Vec<u32>> {
    if !vehicle.check_segments.is_empty() || !vehicle.fit_segments.is_empty() {
        return None;
    }
    let mut diving: Vec<u32> = (0..flight.len()).filter(|&i| flight.pressure_pa[i] > LEAST_SWING_PA).map(|i| flight.segment[i]).collect();
    diving.dedup();
    let turns = shallow_turns(flight);
    if diving.len() >= FEWEST_DIVES_CUT || diving.len() + turns.len() < FEWEST_DIVES_CUT {
        return None;
    }
    let (mut number, mut next) = (0, turns.iter().peekable());
    Some(
        (0..flight.len())
            .map(|i| {
                let turned = next.next_if_eq(&&i).is_some();
                if i > 0 && (turned || flight.segment[i] != flight.segment[i - 1]) {
                    number += 1;
                }
                number
            })
            .collect(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saw(dives: usize) -> Flight {
        let n = 200 * dives;
        let depth = |i: usize| {
            let x = (i % 200) as f64 / 100.0;
            // Ripples at the apogee and at the apex, and a step half way.
            5.0 + 40.0 * (1.0 - (x - 1.0).abs()) + 0.4 * (i as f64 * 0.9).sin()
        };
        Flight {
            time_s: (0..n).map(|i| i as f64 * 4.0).collect(),
            segment: vec![0; n],
            pressure_pa: (0..n).map(|i| depth(i) * 1e4).collect(),
            ..Flight::default()
        }
    }

    #[test]
    fn a_long_segment_is_cut_at_its_shallow_turns_and_nowhere_else() {
        let f = saw(6);
        let turns = shallow_turns(&f);
        assert_eq!(turns.len(), 5);
        for (k, t) in turns.iter().enumerate() {
            assert!(t.abs_diff(200 * (k + 1)) < 6, "{turns:?}");
        }
    }

    #[test]
    fn of_many_dives_the_fitted_ones_are_spread_from_the_first_to_the_last() {
        assert_eq!(evenly(4, 60), [0, 1, 2, 3]);
        let some = evenly(3000, 60);
        assert_eq!((some.len(), some[0], some[59]), (60, 0, 2999));
        assert!(some.windows(2).all(|w| (50..=51).contains(&(w[1] - w[0]))), "{some:?}");
    }

    #[test]
    fn few_dives_and_named_segments_stay_as_they_are() {
        let text = r#"{"mass_kg":68,"hull_volume_m3":0.068,"hull_compressibility_per_pa":5e-10,"hull_thermal_expansion_per_k":5e-5,
            "wing":{"area_m2":0.11},"hydro":{"reference_area_m2":0.11,"wing_lift_slope_per_rad":3.45,"hull_lift_slope_per_rad":1.2,
            "hull_area_m2":0.0356,"cd0":0.15}}"#;
        let mut vehicle = logs::vehicle::parse_text(text, std::path::Path::new("v.json")).expect("reads");
        let cut_of = |f: &Flight, v: &Vehicle| cut(f, v).map(|s| s.last().copied().unwrap_or(0) + 1);
        assert_eq!(cut_of(&saw(6), &vehicle), Some(6));
        assert_eq!(cut_of(&saw(3), &vehicle), None);
        vehicle.check_segments = vec![0];
        assert_eq!(cut_of(&saw(6), &vehicle), None);
    }
}

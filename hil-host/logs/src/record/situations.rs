//! What happens at sea that no glide explains: rows on the sea bed and under a thruster, fixes that are none. They are left out, and said.

use std::ops::Range;

use super::clock_offset;
use super::flight::Flight;
use super::plausible::quantile;

/// Columns that show a thruster at work, from which value on: W, A, and its command, % (guesses: sensors at rest show less).
const THRUSTER: [(&str, f64); 3] = [("m_thruster_power", 0.5), ("m_thruster_current", 0.05), ("c_thruster_on", 0.5)];

/// So still lies what is on the sea bed, Pa: a sensor's noise and a hull that rocks. So long at the least, s: a turn at depth takes a
/// minute, and two of a deep glider with a slow pump.
const STILL_PA: f64 = 5e3;
const LYING_S: f64 = 150.0;
/// Rows further apart say nothing of what stands between them, s; and so many show that it does.
const JOINED_S: f64 = 60.0;
const LEAST_ROWS: usize = 6;
/// So much deeper it may come before it leaves the ground, Pa (guess: on a slope, 5 m).
const SLIDES_PA: f64 = 5e4;
/// Afloat or in a turn near the surface, Pa.
const SUNK_PA: f64 = 5e4;
/// Of the pump's way from sinking to rising: below it the vehicle is heavy, above it may hover (guess).
const HEAVY_SHARE: f64 = 0.35;
/// A fix needs the aerial in air; so deep it is repeated or reckoned, Pa (3 dbar: pressure zero and the vehicle's length).
pub const FIX_DEPTH_PA: f64 = 3e4;
/// So many positions apart from reckoned ones are fixes (guess).
const LEAST_FIXES: usize = 4;
/// Afloat, above the least of the pressures, where a log has positions under water too, Pa (guess).
const AFLOAT_PA: f64 = 5e3;

/// Leaves them out; what was.
///
/// # Errors
/// Nothing is left.
pub fn leave_out(flight: &mut Flight) -> Result<Vec<String>, String> {
    let mut said = Vec::new();
    let all = flight.len();
    if let Some((name, rows)) = thruster(flight) {
        if 10 * rows.iter().map(Range::len).sum::<usize>() > 9 * all {
            return Err(format!("flies on its thruster throughout ({name}): there is no glide to compare"));
        }
        let count = remove(flight, rows);
        said.push(format!("the thruster ran in {count} of {all} rows ({name}): they are no glide, left out"));
    }
    let lying = on_the_sea_bed(flight);
    if !lying.is_empty() {
        let mut segments: Vec<String> = lying.iter().map(|rows| flight.segment[rows.start].to_string()).collect();
        segments.dedup();
        let deep = lying.iter().map(|rows| flight.pressure_pa[rows.start]).fold(0.0, f64::max) * 1e-4;
        let count = remove(flight, lying);
        let (of, more) = (segments.len(), if segments.len() > 6 { ", …" } else { "" });
        let list = segments.into_iter().take(6).collect::<Vec<_>>().join(", ");
        said.push(format!(
            "on the sea bed in {count} of {all} rows of {of} segments ({list}{more}), down to {deep:.0} dbar: still and heavy, left out"
        ));
    }
    said.extend(fixes_under_water(flight));
    said.extend(two_pressures(flight));
    Ok(said)
}

/// By which share of depth the pressures of CTD and flight computer differ, where that is more than sensors do.
fn two_pressures(flight: &Flight) -> Option<String> {
    let (name, own) = clock_offset::engineering(flight)?;
    let factor = if name.contains("dbar") { 1e4 } else { 1e5 };
    let pairs: Vec<(f64, f64)> = flight.pressure_pa.iter().zip(own).map(|(p, own)| (*p, own * factor)).collect();
    let known: Vec<(f64, f64)> = pairs.into_iter().filter(|(p, own)| *p > SUNK_PA && own.is_finite()).collect();
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| known.iter().map(f).sum::<f64>() / known.len() as f64;
    let (p, own) = (mean(&|r| r.0), mean(&|r| r.1));
    let (pp, po, oo) = (mean(&|r| (r.0 - p).powi(2)), mean(&|r| (r.0 - p) * (r.1 - own)), mean(&|r| (r.1 - own).powi(2)));
    let (scale, alike) = (po / pp, po * po / (pp * oo));
    // Of another depth altogether they are of two clocks or dives, which is said elsewhere.
    let differs = known.len() >= 200 && alike > ALIKE && (scale - 1.0).abs() > SCALE;
    differs.then(|| {
        let percent = 100.0 * (scale - 1.0);
        format!(
            "the two pressures differ by {:.1} % of depth: {name} grows by {percent:+.1} % against the CTD's; one is scaled wrongly",
            percent.abs()
        )
    })
}

/// Scales of two sensors agree to this share (guess: five real gliders differ by 0.9 to 1.4 %), and what they read is a straight line of one another where so much of it is explained.
const SCALE: f64 = 0.02;
const ALIKE: f64 = 0.995;

/// Takes rows out; how many.
fn remove(flight: &mut Flight, rows: Vec<Range<usize>>) -> usize {
    let count = rows.iter().map(Range::len).sum();
    rows.into_iter().rev().for_each(|rows| flight.remove(rows));
    count
}

/// Runs of neighbouring rows of which something holds.
fn runs(rows: Range<usize>, holds: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut out: Vec<Range<usize>> = Vec::new();
    for i in rows.filter(|i| holds(*i)) {
        match out.last_mut().filter(|r| r.end == i) {
            Some(run) => run.end = i + 1,
            None => out.push(i..i + 1),
        }
    }
    out
}

/// Rows in which a thruster runs, with the column that shows it.
fn thruster(flight: &Flight) -> Option<(&'static str, Vec<Range<usize>>)> {
    THRUSTER.into_iter().find_map(|(name, idle)| {
        let values = flight.extra.get(name)?;
        let rows = runs(0..flight.len(), |i| values[i] > idle);
        (!rows.is_empty()).then_some((name, rows))
    })
}

/// Rows under water in which a heavy vehicle stays where it is.
fn on_the_sea_bed(flight: &Flight) -> Vec<Range<usize>> {
    let (sinks, rises) = (quantile(&flight.ballast_m3, 0.1), quantile(&flight.ballast_m3, 0.9));
    let heavy_m3 = sinks + HEAVY_SHARE * (rises - sinks);
    let (p, t) = (&flight.pressure_pa, &flight.time_s);
    let mut out: Vec<Range<usize>> = Vec::new();
    let mut start = 0;
    while start < flight.len() {
        if !(p[start] > SUNK_PA) {
            start += 1;
            continue;
        }
        let (mut low, mut high, mut end) = (p[start], p[start], start + 1);
        while end < flight.len() && flight.segment[end] == flight.segment[start] && t[end] - t[end - 1] < JOINED_S {
            (low, high) = (low.min(p[end]), high.max(p[end]));
            if !(high - low < STILL_PA) {
                break;
            }
            end += 1;
        }
        let rests = low > SUNK_PA && t[end - 1] - t[start] > LYING_S && end - start >= LEAST_ROWS;
        let ballast = flight.ballast_m3[start..end].iter().filter(|v| v.is_finite());
        let heavy = rests && rises > sinks && ballast.clone().sum::<f64>() / (ballast.count() as f64) < heavy_m3;
        if heavy {
            // As it comes down and lifts off, and behind a wrong pressure now and then; while its pump works it turns and slides deeper.
            let rests = |i: usize, deeper_pa: f64| {
                flight.segment[i] == flight.segment[start] && (low - STILL_PA..=high + deeper_pa).contains(&p[i])
            };
            let leaves = |i: usize| rests(i, SLIDES_PA) || rests((i + 1).min(flight.len() - 1), SLIDES_PA);
            end = (end..flight.len()).take_while(|i| leaves(*i)).last().map_or(end, |last| last + 1);
            let before = out.last().map_or(0, |r| r.end);
            let first = (before..start).rev().take_while(|i| rests(*i, STILL_PA)).last().unwrap_or(start);
            out.push(first..end);
        }
        start = if rests { end } else { start + 1 };
    }
    out
}

/// Fixes of rows under water become none.
fn fixes_under_water(flight: &mut Flight) -> Option<String> {
    let fixes: Vec<usize> = (0..flight.len()).filter(|i| flight.gps_east_m[*i].is_finite()).collect();
    // Of a sensor with a zero the surface is where it reads least.
    let least = quantile(&flight.pressure_pa, 0.01);
    let under: Vec<usize> = fixes.iter().copied().filter(|i| flight.pressure_pa[*i] - least.max(0.0) > FIX_DEPTH_PA).collect();
    // A few are true fixes, written to the nearest row of a CTD that was off at the surface.
    if 10 * under.len() < fixes.len() {
        return None;
    }
    let all = fixes.len();
    // Reckoning begins before a dive and goes on after it: rows with positions without a break from there to under water are its, where
    // there are others.
    let runs = runs(0..flight.len(), |i| flight.gps_east_m[i].is_finite());
    let (sunk, others): (Vec<Range<usize>>, Vec<Range<usize>>) =
        runs.into_iter().partition(|run| run.clone().any(|i| flight.pressure_pa[i] - least.max(0.0) > FIX_DEPTH_PA));
    let reckoned: Vec<usize> = if others.iter().map(Range::len).sum::<usize>() < LEAST_FIXES {
        fixes.into_iter().filter(|i| flight.pressure_pa[*i] - least.max(0.0) > AFLOAT_PA).collect()
    } else {
        sunk.into_iter().flatten().collect()
    };
    for i in &reckoned {
        (flight.gps_east_m[*i], flight.gps_north_m[*i]) = (f64::NAN, f64::NAN);
    }
    let count = reckoned.len();
    (count > 0).then(|| format!("{count} of {all} positions are of a vehicle under water: reckoned or repeated, no fixes"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Dives to 60 dbar, a row every 4 s.
    fn made() -> Flight {
        let mut f = Flight::blank(1000);
        for i in 0..1000 {
            let x = (i % 200) as f64 / 100.0;
            (f.time_s[i], f.segment[i], f.pressure_pa[i]) = (4.0 * i as f64, (i / 200) as u32, 6e5 * (1.0 - (x - 1.0).abs()));
            f.ballast_m3[i] = if x < 1.0 { -2e-4 } else { 2e-4 };
        }
        f
    }

    #[test]
    fn regress_rows_on_the_sea_bed_are_left_out_and_a_hover_is_not() {
        let lying = |volume: f64, rows: Range<usize>| {
            let mut f = made();
            for i in rows {
                (f.pressure_pa[i], f.ballast_m3[i]) = (6e5 + 2e3 * (i as f64).sin(), volume);
            }
            let said = leave_out(&mut f).expect("rows");
            (f.len(), said.join("; "))
        };
        let (left, said) = lying(-2e-4, 500..600);
        assert!((895..=900).contains(&left) && said.contains("on the sea bed in 10") && said.contains("segments (2)"), "{left}: {said}");
        // It slides three metres down a slope while it pumps: not before it rises is it a glide.
        let mut f = made();
        for i in 500..600 {
            (f.pressure_pa[i], f.ballast_m3[i]) = (if i < 580 { 6e5 } else { 6e5 + 3e4 }, if i < 580 { -2e-4 } else { 2e-4 });
        }
        leave_out(&mut f).expect("rows");
        assert!((895..=900).contains(&f.len()), "{}", f.len());
        assert_eq!(lying(0.0, 500..600), (1000, String::new()), "it hovers");
        assert_eq!(lying(-2e-4, 500..520), (1000, String::new()), "a slow turn");
    }

    #[test]
    fn regress_two_pressures_of_another_scale_are_named() {
        let said = |scale: f64| {
            let mut f = made();
            let own = f.pressure_pa.iter().map(|p| 0.3 + scale * p * 1e-4).collect();
            f.extra.insert(clock_offset::ENGINEERING_PRESSURE.into(), own);
            leave_out(&mut f).expect("rows").join("; ")
        };
        assert_eq!((said(1.0), said(1.012)), (String::new(), String::new()));
        assert!(said(0.96).contains("the two pressures differ by 4.0 % of depth"), "{}", said(0.96));
    }

    #[test]
    fn regress_reckoned_positions_go_with_what_joins_them_afloat() {
        let mut f = made();
        // Afloat for 10 rows at both ends of each dive, of which every other one has a fix; reckoned from the last of them on.
        let afloat = |i: usize| !(10..190).contains(&(i % 200));
        for i in 0..1000 {
            f.pressure_pa[i] = if afloat(i) { 1e3 } else { f.pressure_pa[i] };
            let at = if (8..195).contains(&(i % 200)) {
                100.0
            } else if i % 2 == 0 {
                1.0
            } else {
                f64::NAN
            };
            (f.gps_east_m[i], f.gps_north_m[i]) = (at, at);
        }
        let said = leave_out(&mut f).expect("rows").join("; ");
        let left: Vec<f64> = f.gps_east_m.iter().copied().filter(|v| v.is_finite()).collect();
        assert!(left.len() > 20 && left.iter().all(|v| *v == 1.0) && said.contains("under water"), "{said}: {left:?}");
    }

    #[test]
    fn regress_rows_under_a_thruster_and_fixes_under_water_are_left_out() {
        let mut f = made();
        f.extra.insert("m_thruster_power".into(), (0..1000).map(|i| if i % 200 >= 100 { 4.8 } else { 0.0 }).collect());
        (f.gps_east_m, f.gps_north_m) = (vec![1.0; 1000], vec![2.0; 1000]);
        let said = leave_out(&mut f).expect("rows").join("; ");
        assert!(f.len() == 500 && said.contains("the thruster ran in 500 of 1000 rows"), "{said}");
        let right = |i: usize| f.gps_east_m[i].is_nan() || f.pressure_pa[i] < 4e4;
        assert!((0..500).all(right) && f.gps_east_m[0] == 1.0 && said.contains("under water"), "{said}");
        f.extra.insert("c_thruster_on".into(), vec![100.0; 500]);
        f.extra.remove("m_thruster_power");
        assert!(leave_out(&mut f).expect_err("all of it").contains("on its thruster throughout"));
    }
}

//! Does what remains have a period of its own, of about a minute or two?
//!
//! The sea's ordinary motion has no period that it keeps for a whole segment; what a vehicle does to itself has (a controller that
//! hunts, a pump that breathes). Sines of one period, each run with a phase and an amplitude of its own, are offered to the whitened
//! residual, period by period. Water that rings in a layer has a period too, but forgets its phase within a few of them: it is asked
//! for, too, as sines that begin anew all along the run, and a period is the vehicle's own only as far as it does better.

use crate::inference::posterior::Linearisation;
use crate::inference::projected_columns::ProjectedColumns;
use crate::likelihood::{Column, Problem};
use std::f64::consts::TAU;

/// Log odds against: water that happens to keep a period for a whole segment (a guess; of 160 flights with nothing hidden, 26 of them
/// with water motion in a narrow band, the most that was seen is 5.6).
const KEPT_BY_THE_SEA: f64 = 6.0;
/// Periods that are asked, s: what is faster is hardly seen in samples some seconds apart, what is slower is the sea's.
const SHORTEST_S: f64 = 45.0;
const LONGEST_S: f64 = 230.0;
/// Periods for which water that rings keeps its phase and its strength (guess).
const KEPT_BY_WATER: f64 = 2.0;
/// Frequencies per resolution of the longest run.
const FINER: f64 = 2.0;
/// Most frequencies that are asked, and rows that each is looked for in: of a long flight the first dives, what is found counts in all.
const MOST_FREQUENCIES: usize = 400;
const SCANNED_ROWS: usize = 10_000;

/// A period that the residual wants.
#[derive(Clone, Copy, Debug)]
pub struct Period {
    /// Log Bayes factor, less what so many periods and amplitudes to choose from cost.
    pub log_bayes: f64,
    /// The period, s.
    pub period_s: f64,
    /// Amplitude of the vertical velocity, m/s.
    pub amplitude_m_s: f64,
}

/// The best period given each fit, with the best of these amplitudes.
#[must_use]
pub fn periods(problem: &Problem, linearisations: &[Option<Linearisation>], amplitudes_m_s: &[f64]) -> Vec<Option<Period>> {
    let rows_up_to = |k: &usize| problem.runs[..=*k].iter().map(|r| r.time_s.len()).sum::<usize>();
    let scanned = (0..problem.runs.len()).take_while(|k| *k == 0 || rows_up_to(k) <= SCANNED_ROWS).count();
    let longest = problem.runs[..scanned].iter().map(|r| r.time_s[r.time_s.len() - 1] - r.time_s[0]).fold(0.0, f64::max);
    let (low, high) = (1.0 / LONGEST_S, 1.0 / SHORTEST_S);
    let asked = ((FINER * longest * (high - low)).ceil() as usize).clamp(2, MOST_FREQUENCIES);
    let frequency = |i: usize| low + (high - low) * i as f64 / (asked - 1) as f64;
    // The gain over each fit, and where it is largest.
    let mut best = vec![(f64::NEG_INFINITY, 0); linearisations.len()];
    for i in 0..asked {
        let mut gain = vec![0.0; linearisations.len()];
        for k in 0..scanned {
            let columns = sines(problem, k, frequency(i));
            for (gain, linearisation) in gain.iter_mut().zip(linearisations) {
                *gain += linearisation.as_ref().map_or(0.0, |g| alone(&columns, g));
            }
        }
        for (best, gain) in best.iter_mut().zip(gain) {
            if gain >= best.0 {
                *best = (gain, i);
            }
        }
    }
    let scored = |(linearisation, best): (&Option<Linearisation>, &(f64, usize))| -> Option<Period> {
        let frequency = frequency(best.1);
        let (linearisation, runs) = (linearisation.as_ref()?, 0..problem.runs.len());
        let most = |columns: &[Column]| {
            let projected = ProjectedColumns::new(columns, linearisation);
            let scored = amplitudes_m_s.iter().map(|s| (projected.log_bayes(*s), *s));
            scored.max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let (kept, amplitude_m_s) = most(&runs.clone().flat_map(|k| sines(problem, k, frequency)).collect::<Vec<_>>())?;
        let choices = asked as f64 * amplitudes_m_s.len() as f64;
        let mut log_bayes = kept - choices.ln() - KEPT_BY_THE_SEA;
        if log_bayes > 0.0 {
            let (forgotten, _) = most(&runs.flat_map(|k| ringing(problem, k, frequency)).collect::<Vec<_>>())?;
            log_bayes = log_bayes.min(kept - forgotten - KEPT_BY_THE_SEA);
        }
        Some(Period { log_bayes, period_s: 1.0 / frequency, amplitude_m_s })
    };
    linearisations.iter().zip(&best).map(scored).collect()
}

/// What a vertical velocity of 1 m/s with this frequency, Hz, leaves in one run: sine and cosine.
fn sines(problem: &Problem, k: usize, frequency: f64) -> [Column; 2] {
    let omega = TAU * frequency;
    let run = problem.runs[k];
    let angle = |row: usize| omega * (run.time_s[row] - run.time_s[0]);
    [problem.depth_column(k, &|row| angle(row).sin() / omega), problem.depth_column(k, &|row| angle(row).cos() / omega)]
}

/// The same of water that rings: sines and cosines that swell and fade, one pair after the other.
fn ringing(problem: &Problem, k: usize, frequency: f64) -> Vec<Column> {
    let run = problem.runs[k];
    let (first, last) = (run.time_s[0], run.time_s[run.time_s.len() - 1]);
    let apart = KEPT_BY_WATER / frequency;
    let pairs = ((last - first) / apart).round() as usize + 1;
    let column = |number: usize| {
        let (pair, phase) = (number / 2, 0.25 * (number % 2) as f64);
        let depth = problem.integrated(k, &|_, row| {
            let time = run.time_s[row] - first;
            (TAU * (frequency * time + phase)).sin() * (1.0 - (time / apart - pair as f64).abs()).max(0.0)
        });
        problem.depth_column(k, &|row| depth[row])
    };
    (0..2 * pairs).map(column).collect()
}

/// By how much chi² falls where two columns are fitted to the residual alone.
fn alone(columns: &[Column; 2], linearisation: &Linearisation) -> f64 {
    let [s, c] = columns;
    let (ss, cc, sc) = (s.dot(s), c.dot(c), s.dot(c));
    let (rs, rc) = (s.dot(linearisation.residual), c.dot(linearisation.residual));
    let det = ss * cc - sc * sc;
    if det > 1e-9 * ss * cc { (cc * rs * rs - 2.0 * sc * rs * rc + ss * rc * rc) / det } else { 0.0 }
}

//! How does a state do on the dives that were kept out of the fit?
//!
//! Errors of their blocks, apart where the model flies near the stall: there it may be on another branch, which is no fault of what is
//! named.

use crate::likelihood::Problem;
use crate::likelihood::block_error::{Block, block_errors, rms};
use crate::model::parameters::State;
use crate::preprocess::Prepared;

/// Fewest blocks that a typical error is taken of.
const FEWEST_BLOCKS: usize = 20;
/// How many times the error elsewhere the error near the stall is when it is to be spoken of.
const MUCH_MORE: f64 = 2.0;

/// A share of blocks as a fraction, and what the same share of a normal variable stays within, sigma.
type Share = ((usize, usize), f64);
const HALF: Share = ((1, 2), 0.6745);
const FOUR_FIFTHS: Share = ((4, 5), 1.2816);

/// Error of the typical block, m/s: half of the blocks are worse.
pub(crate) fn typical_error(errors: &[Vec<f64>; 2]) -> f64 {
    error_within(HALF, errors)
}

/// Error that four blocks of five stay within, m/s: a turn or two does not count, a fault of some minutes does.
pub(crate) fn error_of_four_fifths(errors: &[Vec<f64>; 2]) -> f64 {
    error_within(FOUR_FIFTHS, errors)
}

/// Error that a share of the blocks stays within, m/s (scaled to the rms of a normal variable). Those near the stall do not count: there
/// a model may be on another branch. NaN where fewer than [`FEWEST_BLOCKS`] are left.
fn error_within(((of, in_all), sigma): Share, [_, elsewhere]: &[Vec<f64>; 2]) -> f64 {
    let mut errors: Vec<f64> = elsewhere.iter().map(|e| e.abs()).collect();
    errors.sort_by(f64::total_cmp);
    if errors.len() < FEWEST_BLOCKS { f64::NAN } else { errors[errors.len() * of / in_all] / sigma }
}

/// Where, of these blocks, a state misses most, to be said after how much it misses in all; nothing if they are of one segment.
pub(crate) fn worst_segment(problem: &Problem, prepared: &Prepared, state: &State, blocks: &[(usize, Vec<Block>)]) -> String {
    let error = |of: &(usize, Vec<Block>)| {
        let missed = block_errors(problem, prepared, &[state], std::slice::from_ref(of), false)[0];
        (prepared.runs[of.0].segment, missed)
    };
    let errors: Vec<(u32, f64)> = blocks.iter().map(error).filter(|e| e.1.is_finite()).collect();
    let Some((segment, most)) = errors.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)) else { return String::new() };
    let others = errors.iter().filter(|e| e.0 != segment).map(|e| e.1).fold(f64::NAN, f64::max);
    let [most, others] = [most, others].map(|e| 100.0 * e);
    // Not a number where there is no other.
    if others.is_finite() { format!(": {most:.2} cm/s in segment {segment}, at most {others:.2} in the others") } else { String::new() }
}

/// What is to be said where the model misses near the stall by much more than elsewhere: rows there are left out of fits.
pub(crate) fn missed_near_stall([near, elsewhere]: &[Vec<f64>; 2], floor_m_s: f64) -> Option<String> {
    let [there, here] = [near, elsewhere].map(|e| rms(e.iter().copied()));
    (near.len() >= FEWEST_BLOCKS && there > MUCH_MORE * here.max(floor_m_s)).then(|| {
        let (blocks, there) = (near.len(), 100.0 * there);
        let than = if elsewhere.is_empty() { String::new() } else { format!(", elsewhere by {:.2}", 100.0 * here) };
        format!("in {blocks} blocks near the stall the model misses by {there:.2} cm/s{than}: what lift does there is not judged")
    })
}

#[cfg(test)]
mod tests {
    use super::{FEWEST_BLOCKS, missed_near_stall};

    #[test]
    fn regress_error_near_the_stall_is_compared_only_where_others_exist() {
        let near = vec![0.02; FEWEST_BLOCKS];
        let note = missed_near_stall(&[near.clone(), vec![0.003; 5]], 0.002).expect("said");
        assert!(note.contains("by 2.00 cm/s, elsewhere by 0.30: "), "{note}");
        let alone = missed_near_stall(&[near, Vec::new()], 0.002).expect("said");
        assert!(alone.contains("by 2.00 cm/s: ") && !alone.contains("NaN"), "{alone}");
    }
}

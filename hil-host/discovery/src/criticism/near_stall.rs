//! Where the model flies near the stall it may be on another branch, which is no fault of what is named: what it misses there is said apart.

use crate::likelihood::block_error::rms;

/// Fewest blocks near the stall that are spoken of.
const FEWEST_BLOCKS: usize = 20;
/// How many times the error elsewhere the error near the stall is when it is to be spoken of.
const MUCH_MORE: f64 = 2.0;

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

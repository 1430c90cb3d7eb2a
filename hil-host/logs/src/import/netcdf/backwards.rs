//! Times that run backwards.

use crate::record::resample::{Series, longest_in_order};

/// Samples out of the order of time.
pub(super) struct Backwards {
    /// Fewest samples without which time only increases, of how many.
    pub samples: (usize, usize),
    /// The first step back, as "from .. to .. at ..".
    pub first: String,
    /// The series without them.
    pub without: Series,
}

/// The samples of a series that are out of order; none where time only increases.
pub(super) fn backwards(time: &[f64], values: &[f64]) -> Option<Backwards> {
    let finite: Vec<(usize, f64, f64)> =
        time.iter().zip(values).enumerate().filter(|(_, (t, v))| t.is_finite() && v.is_finite()).map(|(i, (t, v))| (i, *t, *v)).collect();
    let first = finite.windows(2).find(|w| w[1].1 < w[0].1)?;
    let first = format!("from {:.3} to {:.3} s at sample {}", first[0].1, first[1].1, first[1].0 + 1);
    let times: Vec<f64> = finite.iter().map(|f| f.1).collect();
    let kept = longest_in_order(&times);
    let samples = (finite.len() - kept.len(), finite.len());
    let (time, value): (Vec<f64>, Vec<f64>) = kept.into_iter().map(|k| (finite[k].1, finite[k].2)).unzip();
    Some(Backwards { samples, first, without: Series::new(&time, &value) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fewest_samples_are_called_out_of_order() {
        assert!(backwards(&[0.0, 1.0, f64::NAN, 2.0], &[0.0; 4]).is_none());
        let found = backwards(&[0.0, 1.0, 9.0, 2.0, 3.0], &[0.0; 5]).expect("one step back");
        assert_eq!((found.samples, found.first.as_str()), ((1, 5), "from 9.000 to 2.000 s at sample 4"));
    }
}

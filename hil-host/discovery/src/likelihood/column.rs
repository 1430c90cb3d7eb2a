//! A stretch of a whitened vector and its inner product, in which the model discrepancy is marginalised.

use std::sync::Arc;

/// A stretch of a whitened vector, and what it has in the directions of the model discrepancy. A copy shares both: every fit keeps
/// the columns it was made with.
#[derive(Clone, Debug)]
pub struct Column {
    /// Index of its first element.
    pub from: usize,
    /// Values.
    pub values: Arc<Vec<f64>>,
    shadow: Arc<Vec<f64>>,
}

impl Column {
    /// A column of which a model discrepancy has this in its directions; nothing without one.
    #[must_use]
    pub(crate) fn with_shadow(from: usize, values: Vec<f64>, shadow: Vec<f64>) -> Self {
        Self { from, values: Arc::new(values), shadow: Arc::new(shadow) }
    }

    /// Inner product with another column: that of the inverse covariance of water, sensors and discrepancy.
    #[must_use]
    pub fn dot(&self, other: &Self) -> f64 {
        self.plain_dot(other) - self.shadow.iter().zip(other.shadow.iter()).map(|(a, b)| a * b).sum::<f64>()
    }

    /// What it has in the directions of the model discrepancy: `dot` is `plain_dot` less the product of these.
    pub(crate) fn shadow(&self) -> &[f64] {
        &self.shadow
    }

    /// Inner product without the discrepancy.
    pub(crate) fn plain_dot(&self, other: &Self) -> f64 {
        let from = self.from.max(other.from);
        let to = (self.from + self.values.len()).min(other.from + other.values.len());
        if from >= to {
            return 0.0;
        }
        self.values[from - self.from..to - self.from]
            .iter()
            .zip(&other.values[from - other.from..to - other.from])
            .map(|(a, b)| a * b)
            .sum()
    }
}

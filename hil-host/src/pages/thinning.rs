//! Fewer points, same picture.

/// Thins `(x, y)` to about `most` points: in each bucket of neighbours the
/// first, the lowest and the highest stay, in order. A gap (non-finite y)
/// stays as one point. Shorter series are returned as they are.
#[must_use]
pub fn thin(x: &[f64], y: &[f64], most: usize) -> (Vec<f64>, Vec<f64>) {
    let n = x.len().min(y.len());
    if n <= most || most < 6 {
        return (x[..n].to_vec(), y[..n].to_vec());
    }
    let per_bucket = n.div_ceil(most / 3);
    let mut keep = Vec::with_capacity(most + 3);
    for start in (0..n).step_by(per_bucket) {
        let bucket = start..(start + per_bucket).min(n);
        let low = bucket.clone().filter(|i| y[*i].is_finite()).min_by(|a, b| y[*a].total_cmp(&y[*b]));
        let high = bucket.clone().filter(|i| y[*i].is_finite()).max_by(|a, b| y[*a].total_cmp(&y[*b]));
        let gap = bucket.clone().find(|i| !y[*i].is_finite());
        let mut chosen: Vec<usize> = [Some(start), low, high, gap].into_iter().flatten().collect();
        chosen.sort_unstable();
        chosen.dedup();
        keep.extend(chosen);
    }
    if keep.last() != Some(&(n - 1)) {
        keep.push(n - 1);
    }
    (keep.iter().map(|i| x[*i]).collect(), keep.iter().map(|i| y[*i]).collect())
}

#[cfg(test)]
mod tests {
    use super::thin;

    #[test]
    fn spikes_ends_and_gaps_survive() {
        let x: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut y = vec![1.0; 100_000];
        y[51_234] = 99.0;
        y[70_001] = -99.0;
        y[80_000] = f64::NAN;
        let (tx, ty) = thin(&x, &y, 2_000);
        assert!(tx.len() <= 2_700, "{}", tx.len());
        assert!(ty.contains(&99.0) && ty.contains(&-99.0) && ty.iter().any(|v| v.is_nan()));
        assert_eq!((tx[0], *tx.last().unwrap()), (0.0, 99_999.0));
        assert!(tx.windows(2).all(|w| w[0] < w[1]), "order is kept");
    }
}

//! Two flights in one chart, each over its own time under way, and their difference.

/// Moments and values of a trace; a gap is a moment without a value.
pub type Trace<'a> = (&'a [Option<f64>], &'a [Option<f64>]);

/// The other flight's value minus this one's at this one's moments, linear between the other's; none across a gap of either and where
/// the other is over.
#[must_use]
pub fn difference(this: Trace, other: Trace) -> Vec<Option<f64>> {
    let mut k = 0;
    let at = |t: f64, k: &mut usize| {
        while other.0.get(*k + 1).copied().flatten().is_some_and(|next| next <= t) {
            *k += 1;
        }
        let (t0, v0) = (other.0.get(*k).copied().flatten()?, other.1.get(*k).copied().flatten()?);
        if t == t0 {
            return Some(v0);
        }
        let (t1, v1) = (other.0.get(*k + 1).copied().flatten()?, other.1.get(*k + 1).copied().flatten()?);
        (t0 < t && t < t1).then(|| v0 + (v1 - v0) * (t - t0) / (t1 - t0))
    };
    this.0.iter().zip(this.1).map(|(t, v)| Some(at((*t)?, &mut k)? - (*v)?)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some(values: &[f64]) -> Vec<Option<f64>> {
        values.iter().map(|v| v.is_finite().then_some(*v)).collect()
    }

    fn of(this: (&[f64], &[f64]), other: (&[f64], &[f64])) -> Vec<Option<f64>> {
        let [a, b, c, d] = [this.0, this.1, other.0, other.1].map(some);
        difference((&a, &b), (&c, &d))
    }

    #[test]
    fn a_flight_does_not_differ_from_itself() {
        let (t, v) = ([0.0, 20.0, 40.0, 41.0, 60.0], [1.0, 2.0, 3.0, f64::NAN, 5.0]);
        assert_eq!(of((&t, &v), (&t, &v)), some(&[0.0, 0.0, 0.0, f64::NAN, 0.0]));
    }

    #[test]
    fn it_is_the_other_minus_this_at_the_moments_of_this() {
        // The other rises by 0.1 a second from 3; this one is 1 throughout.
        let d = of((&[0.0, 15.0, 30.0], &[1.0, 1.0, 1.0]), (&[0.0, 20.0, 40.0], &[3.0, 5.0, 7.0]));
        assert_eq!(d, some(&[2.0, 3.5, 5.0]));
    }

    #[test]
    fn nothing_is_said_across_a_gap_or_beyond_the_end() {
        let nan = f64::NAN;
        let other: (&[f64], &[f64]) = (&[0.0, 20.0, 21.0, 100.0, 120.0], &[1.0, 1.0, nan, 1.0, 1.0]);
        let d = of((&[10.0, 20.5, 60.0, 110.0, 130.0], &[0.0; 5]), other);
        assert_eq!(d, some(&[1.0, nan, nan, 1.0, nan]));
        // Blocks of two minutes, as sparse logs have them, are no gap.
        assert_eq!(of((&[60.0], &[0.0]), (&[0.0, 120.0], &[2.0, 2.0])), some(&[2.0]));
        // Before the other begins, and beside an empty one.
        assert_eq!(of((&[5.0], &[0.0]), (&[10.0, 20.0], &[1.0, 1.0])), some(&[nan]));
        assert_eq!(of((&[5.0], &[0.0]), (&[], &[])), some(&[nan]));
    }
}

//! Which of a row of changes turned a flight.

/// The change that was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found<T> {
    /// The first of the row that does as its last.
    pub index: usize,
    /// What its predecessor and it do.
    pub does: [T; 2],
    /// Laws that were asked.
    pub asked: usize,
}

/// The first of `count` laws that does as the last of them and not as the first; none: the ends do the same.
///
/// # Errors
/// A law cannot be asked.
pub fn bisect<T: PartialEq>(count: usize, mut ask: impl FnMut(usize) -> anyhow::Result<T>) -> anyhow::Result<Option<Found<T>>> {
    if count < 2 {
        return Ok(None);
    }
    let (mut low, mut high) = (0, count - 1);
    let (mut before, mut after, mut asked) = (ask(low)?, ask(high)?, 2);
    if before == after {
        return Ok(None);
    }
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        let does = ask(middle)?;
        asked += 1;
        // What is neither as the one end nor as the other has changed since the first.
        if does == before { (low, before) = (middle, does) } else { (high, after) = (middle, does) }
    }
    Ok(Some(Found { index: high, does: [before, after], asked }))
}

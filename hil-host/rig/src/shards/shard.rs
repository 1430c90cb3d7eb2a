//! Which part of the work is done here.

/// Every n-th item of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    pub number: usize,
    /// Of so many.
    pub of: usize,
}

impl Shard {
    /// All of it.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Whether the item at this place of the plan is its own.
    const fn has(self, place: usize) -> bool {
        place % self.of == self.number - 1
    }

    /// Its own items of a plan, each with its place.
    pub fn items<I>(self, plan: &[I]) -> impl Iterator<Item = (usize, &I)> {
        plan.iter().enumerate().filter(move |(place, _)| self.has(*place))
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let pair = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        pair.filter(|(i, n)| (1..=*n).contains(i))
            .map(|(number, of)| Self { number, of })
            .ok_or_else(|| format!("`{text}`: expected I/N with I from 1 to N, as 2/8"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shard_is_a_number_of_so_many_and_each_item_is_in_one() {
        assert_eq!("2/8".parse(), Ok(Shard { number: 2, of: 8 }));
        for wrong in ["0/8", "9/8", "2", "a/b", "1/0"] {
            assert!(wrong.parse::<Shard>().is_err_and(|e| e.contains("2/8")), "{wrong}");
        }
        let plan = ["a", "b", "c", "d", "e"];
        let mut all: Vec<_> = (1..=3).flat_map(|number| Shard { number, of: 3 }.items(&plan)).collect();
        all.sort_unstable();
        assert_eq!(all, Shard::WHOLE.items(&plan).collect::<Vec<_>>());
        assert_eq!(all, plan.iter().enumerate().collect::<Vec<_>>());
    }
}

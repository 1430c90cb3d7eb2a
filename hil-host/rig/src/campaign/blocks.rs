//! The plan of a campaign: its missions in blocks, each flown, kept and dealt to a shard as one item.

use super::expect::{Duty, Expect};
use super::lattice::{Case, SETS, Water, broken, drawn, twins};
use super::{Verdict, run};
use crate::shards::interned::{All, interned};
use serde::{Deserialize, Serialize};
use signals::{Abort, Wings};
use std::ops::Range;
use std::sync::{LazyLock, Mutex};

/// Fewest and most missions of a block: two seconds of a core at most, so that little is lost by a break.
const BLOCK_MISSIONS: (usize, usize) = (4, 32);
/// About so many blocks in a plan.
const BLOCKS: usize = 2000;

/// Missions that are flown one after the other.
#[derive(Clone, Debug)]
pub enum Block {
    /// Healthy twins.
    Twins(Vec<Case>),
    /// Missions with faults.
    Faulty(Vec<Case>),
    /// Random missions of these numbers, each healthy and with every set of faults.
    Drawn(Range<u64>),
}

/// So many in a block, of so many in all.
fn size(missions: usize) -> usize {
    (missions / BLOCKS).clamp(BLOCK_MISSIONS.0, BLOCK_MISSIONS.1)
}

/// Numbers in blocks.
#[must_use]
pub fn ranges(numbers: Range<u64>, flights_each: u64) -> Vec<Range<u64>> {
    let count = (numbers.end - numbers.start) * flights_each;
    let step = (size(count as usize) as u64).div_ceil(flights_each);
    numbers.clone().step_by(step as usize).map(|from| from..(from + step).min(numbers.end)).collect()
}

/// The plan: the twins of `chosen`, these, and random missions.
#[must_use]
pub fn plan(chosen: &[Case], random: Range<u64>) -> Vec<Block> {
    let in_blocks =
        |cases: &[Case], of: fn(Vec<Case>) -> Block| -> Vec<Block> { cases.chunks(size(cases.len())).map(|c| of(c.to_vec())).collect() };
    let mut out = in_blocks(&twins(chosen), Block::Twins);
    out.extend(in_blocks(chosen, Block::Faulty));
    out.extend(ranges(random, 1 + SETS).into_iter().map(Block::Drawn));
    out
}

impl Block {
    /// Missions in it.
    #[must_use]
    pub fn missions(&self) -> u64 {
        match self {
            Self::Twins(cases) | Self::Faulty(cases) => cases.len() as u64,
            Self::Drawn(numbers) => (numbers.end - numbers.start) * (1 + SETS),
        }
    }

    /// Flies it: of random missions the healthy ones first.
    ///
    /// # Errors
    /// The world cannot be, or the controller does not answer.
    pub fn fly(&self) -> anyhow::Result<Vec<Verdict>> {
        let fly = |cases: &[Case]| cases.iter().map(run).collect::<anyhow::Result<Vec<Verdict>>>();
        match self {
            Self::Twins(cases) | Self::Faulty(cases) => fly(cases),
            Self::Drawn(numbers) => {
                let mut all = fly(&drawn(numbers.start, numbers.end - numbers.start))?;
                for k in 0..all.len() {
                    let cases: Vec<Case> = broken(&all[k].case, all[k].duration_s).collect();
                    all.extend(fly(&cases)?);
                }
                Ok(all)
            }
        }
    }

    /// Verdicts that were kept, with their missions; healthy ones, and those with faults.
    fn with_cases(&self, mut kept: Vec<Verdict>) -> [Vec<Verdict>; 2] {
        let with = |verdicts: &mut [Verdict], cases: &[Case]| verdicts.iter_mut().zip(cases).for_each(|(v, c)| v.case = c.clone());
        match self {
            Self::Twins(cases) => {
                with(&mut kept, cases);
                [kept, Vec::new()]
            }
            Self::Faulty(cases) => {
                with(&mut kept, cases);
                [Vec::new(), kept]
            }
            Self::Drawn(numbers) => {
                let calm = drawn(numbers.start, numbers.end - numbers.start);
                let mut faulty = kept.split_off(calm.len().min(kept.len()));
                with(&mut kept, &calm);
                let cases: Vec<Case> = kept.iter().flat_map(|v| broken(&v.case, v.duration_s).collect::<Vec<_>>()).collect();
                with(&mut faulty, &cases);
                [kept, faulty]
            }
        }
    }
}

/// Verdicts of blocks in the order of their plan: healthy missions, and those with faults.
pub fn verdicts<'a>(blocks: impl Iterator<Item = (&'a Block, Vec<Verdict>)>) -> [Vec<Verdict>; 2] {
    let [mut healthy, mut faulty] = [Vec::new(), Vec::new()];
    for (block, kept) in blocks {
        let [calm, struck] = block.with_cases(kept);
        healthy.extend(calm);
        faulty.extend(struck);
    }
    [healthy, faulty]
}

/// What stands for the mission of a verdict that was kept, until its block puts it back.
pub(super) fn no_case() -> Case {
    Case { water: Water::Drawn, wings: Wings::Standard, seed: 0, faults: Vec::new(), line: None }
}

/// [`Expect`] as it is kept.
#[derive(Serialize, Deserialize)]
pub(super) enum Owed {
    Abort(Vec<Abort>, f64),
    Home(Vec<Abort>, f64),
    Mission,
    Tolerated(Vec<Abort>, Vec<Duty>),
}

impl From<Expect> for Owed {
    fn from(of: Expect) -> Self {
        match of {
            Expect::Abort(causes, bound) => Self::Abort(causes.to_vec(), bound),
            Expect::Home(causes, bound) => Self::Home(causes.to_vec(), bound),
            Expect::Mission => Self::Mission,
            Expect::Tolerated(causes, duties) => Self::Tolerated(causes.to_vec(), duties),
        }
    }
}

impl From<Owed> for Expect {
    fn from(of: Owed) -> Self {
        static ALL: All<[Abort]> = LazyLock::new(Mutex::default);
        let causes = |causes: Vec<Abort>| interned(&ALL, causes.into_boxed_slice());
        match of {
            Owed::Abort(of, bound) => Self::Abort(causes(of), bound),
            Owed::Home(of, bound) => Self::Home(causes(of), bound),
            Owed::Mission => Self::Mission,
            Owed::Tolerated(of, duties) => Self::Tolerated(causes(of), duties),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::lattice::{cases, spread};
    use crate::shards::kept::Kept;
    use std::collections::HashMap;

    #[test]
    fn verdicts_that_were_kept_are_those_that_were_flown() {
        let blocks = plan(&spread(cases(), 24), 3..5);
        let kept = Kept::Merged(HashMap::new());
        let back = |block: &Block| -> Vec<Verdict> {
            let flown = block.fly().expect("flies");
            let bytes = kept.store("", &flown).expect("bytes");
            let merged = Kept::Merged(HashMap::from([(String::new(), bytes)]));
            merged.load("").expect("there").1
        };
        let texts = |all: &[Vec<Verdict>; 2]| all.iter().flatten().map(|v| format!("{v:?}")).collect::<Vec<_>>();
        let flown = verdicts(blocks.iter().map(|b| (b, b.fly().expect("flies"))));
        let again = verdicts(blocks.iter().map(|b| (b, back(b))));
        assert_eq!(texts(&flown), texts(&again));
        let missions: u64 = blocks.iter().map(Block::missions).sum();
        assert_eq!((flown[0].len() + flown[1].len()) as u64, missions);
        assert_eq!(flown[1].len(), 24 + 2 * SETS as usize);
    }

    #[test]
    fn a_plan_has_each_random_mission_once() {
        for (numbers, each) in [(0..7_500, 7), (10..11, 7), (5..5, 7), (0..20_000, 1)] {
            let all: Vec<u64> = ranges(numbers.clone(), each).into_iter().flatten().collect();
            assert_eq!(all, numbers.collect::<Vec<_>>());
        }
        assert!(ranges(0..7_500, 7).len() < 2 * BLOCKS);
    }
}

//! Does the items of a plan, or a shard of them, several at a time.

use anyhow::{Context as _, bail};
use logs::stop;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::shards::kept::Kept;
use crate::shards::shard::Shard;

/// How the items of a plan are done.
#[derive(Debug)]
pub struct Work {
    /// Which.
    pub shard: Shard,
    /// So many at a time; 0: as many as there are cores.
    pub jobs: usize,
    /// Where results are taken from and put.
    pub kept: Kept,
}

/// An item that was done.
#[derive(Clone, Debug)]
pub struct Done<T> {
    /// Its place in the plan.
    pub place: usize,
    /// Its key.
    pub key: String,
    /// Its result, and the bytes that this is kept as.
    pub value: T,
    /// See [`Self::value`].
    pub bytes: Vec<u8>,
    /// Whether it had been done before.
    pub was_kept: bool,
}

impl Work {
    /// Does the items of its shard, in the order of the plan; `tick` is called after each.
    ///
    /// # Errors
    /// Those of `key` and `make`; a folder that cannot be written; in a merge, that a part is missing.
    pub fn run<I: Sync, T: Serialize + DeserializeOwned + Send>(
        &self,
        items: &[I],
        key: &(dyn Fn(&I) -> anyhow::Result<String> + Sync),
        make: &(dyn Fn(&I) -> anyhow::Result<T> + Sync),
        tick: &(dyn Fn(&I, bool) + Sync),
    ) -> anyhow::Result<Vec<Done<T>>> {
        if let Kept::Folder(folder) = &self.kept {
            std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        }
        let mine: Vec<(usize, &I)> = self.shard.items(items).collect();
        let one = |(place, item): &(usize, &I)| -> anyhow::Result<Done<T>> {
            let key = key(item)?;
            let (bytes, value, was_kept) = match (self.kept.load(&key), &self.kept) {
                (Some((bytes, value)), _) => (bytes, value, true),
                (None, Kept::Merged(_)) => bail!(Missing { place: *place }),
                (None, Kept::Folder(_)) => {
                    let value = make(item)?;
                    (self.kept.store(&key, &value)?, value, false)
                }
            };
            tick(item, was_kept);
            Ok(Done { place: *place, key, value, bytes, was_kept })
        };
        on_threads(self.jobs, &mine, &one)
    }
}

/// Does all items in order, `jobs` at a time (0: as many as there are cores); after an error none is begun. Threads of their own: a worker
/// of a pool begins another item whenever the one it does waits for a pool within.
fn on_threads<I: Sync, T: Send>(jobs: usize, items: &[I], one: &(dyn Fn(&I) -> anyhow::Result<T> + Sync)) -> anyhow::Result<Vec<T>> {
    let jobs = if jobs == 0 { std::thread::available_parallelism().map_or(1, NonZero::get) } else { jobs };
    let next = AtomicUsize::new(0);
    let flag = stop::flag();
    let worker = || -> anyhow::Result<Vec<(usize, T)>> {
        stop::heed(flag.clone());
        let mut done = Vec::new();
        loop {
            stop::here();
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(at) else { return Ok(done) };
            done.push((at, one(item).inspect_err(|_| next.store(items.len(), Ordering::Relaxed))?));
        }
    };
    let mut done = std::thread::scope(|scope| -> anyhow::Result<Vec<(usize, T)>> {
        let workers: Vec<_> = (0..jobs.min(items.len())).map(|_| scope.spawn(worker)).collect();
        let parts = workers.into_iter().map(|w| w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        Ok(parts.collect::<anyhow::Result<Vec<_>>>()?.into_iter().flatten().collect())
    })?;
    done.sort_by_key(|(at, _)| *at);
    Ok(done.into_iter().map(|(_, value)| value).collect())
}

/// A result that no part has.
#[derive(Clone, Copy, Debug)]
pub struct Missing {
    /// Place of its item in the plan.
    pub place: usize,
}

impl std::fmt::Display for Missing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the result of item {} is in none of these parts", self.place + 1)
    }
}

impl std::error::Error for Missing {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn regress_no_more_items_than_jobs_are_under_way() {
        let (under_way, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let inner = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        let one = |i: &usize| {
            most.fetch_max(under_way.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
            inner.install(|| std::thread::sleep(std::time::Duration::from_millis(5)));
            under_way.fetch_sub(1, Ordering::SeqCst);
            Ok(2 * i)
        };
        let items: Vec<usize> = (0..20).collect();
        assert_eq!(on_threads(2, &items, &one).expect("done"), items.iter().map(|i| 2 * i).collect::<Vec<_>>());
        assert_eq!(most.into_inner(), 2);
    }

    #[test]
    fn after_an_error_no_item_is_begun() {
        let begun = AtomicUsize::new(0);
        let one = |i: &usize| {
            begun.fetch_add(1, Ordering::SeqCst);
            if *i == 3 { bail!("item 3") } else { Ok(()) }
        };
        let items: Vec<usize> = (0..100).collect();
        assert_eq!(on_threads(1, &items, &one).expect_err("item 3 fails").to_string(), "item 3");
        assert_eq!(begun.into_inner(), 4);
    }

    /// Squares of numbers.
    fn squares(work: &Work, made: &AtomicUsize) -> anyhow::Result<Vec<Done<u64>>> {
        let items: Vec<u64> = (0..20).collect();
        let make = |i: &u64| {
            made.fetch_add(1, Ordering::Relaxed);
            Ok(i * i)
        };
        work.run(&items, &|i| crate::shards::kept::key(&[&i.to_string()]), &make, &|_, _| ())
    }

    #[test]
    fn items_are_done_once_whoever_asks_and_merge_to_the_same_list() {
        let folder = std::env::temp_dir().join(format!("glider-work-{}", std::process::id()));
        let made = AtomicUsize::new(0);
        let of = |shard| Work { shard, jobs: 2, kept: Kept::Folder(folder.clone()) };
        let parts: Vec<Vec<Done<u64>>> = (1..=3).map(|number| squares(&of(Shard { number, of: 3 }), &made).expect("done")).collect();
        assert_eq!(parts.iter().map(Vec::len).collect::<Vec<_>>(), [7, 7, 6]);
        let whole = squares(&of(Shard::WHOLE), &made).expect("done");
        assert!(whole.iter().all(|d| d.was_kept) && made.load(Ordering::Relaxed) == 20);
        assert_eq!(whole.iter().map(|d| d.value).collect::<Vec<_>>(), (0..20).map(|i| i * i).collect::<Vec<u64>>());
        let merged = |parts: &[Vec<Done<u64>>]| {
            let all: HashMap<String, Vec<u8>> = parts.iter().flatten().map(|d| (d.key.clone(), d.bytes.clone())).collect();
            squares(&Work { shard: Shard::WHOLE, jobs: 1, kept: Kept::Merged(all) }, &made)
        };
        assert_eq!(
            merged(&parts).expect("merged").iter().map(|d| d.value).collect::<Vec<_>>(),
            whole.iter().map(|d| d.value).collect::<Vec<_>>()
        );
        let missing = merged(&parts[..2]).expect_err("refused");
        assert_eq!(missing.downcast_ref::<Missing>().map(|m| m.place % 3), Some(2));
        std::fs::remove_dir_all(&folder).expect("removed");
    }
}

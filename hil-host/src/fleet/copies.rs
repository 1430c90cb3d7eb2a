//! Flights that an archive holds more than once: as exports of one log, as a glider's own files next to their import, in a backup.
//!
//! Of every flight a mark of its log is made first, and kept as its dives are, so that every shard finds the same copies.

use logs::record::flight::LogMark;

use crate::fleet::archive::{Item, read};
use crate::fleet::cache;
use rig::shards::kept::Kept;
use rig::shards::shard::Shard;
use rig::shards::work::Work;

/// For each flight the place of the earlier one that holds the same log, if one does. A flight that cannot be read is no copy.
///
/// # Errors
/// A file that cannot be hashed, or a cache that cannot be written.
pub fn copies(items: &[Item], program: &str, work: &Work) -> anyhow::Result<Vec<Option<usize>>> {
    let Kept::Folder(folder) = &work.kept else { return Ok(vec![None; items.len()]) };
    let all = Work { shard: Shard::WHOLE, jobs: work.jobs, kept: Kept::Folder(folder.join("marks")) };
    let marks = all.run(
        items,
        // By name too: copies of equal bytes are done at the same time, and must not write the same file.
        &|item| cache::key(&format!("mark of {}/{} {program}", item.deployment, item.flight), &[], &item.files, &item.vehicle),
        &|item| Ok(read(&item.files).ok().map(|flight| flight.mark())),
        &|_, _| (),
    )?;
    let marks: Vec<&Option<LogMark>> = marks.iter().map(|m| &m.value).collect();
    let same = |a: &Option<LogMark>, b: &Option<LogMark>| a.as_ref().zip(b.as_ref()).is_some_and(|(a, b)| a.is_same_log(b));
    Ok((0..marks.len()).map(|k| (0..k).find(|earlier| same(marks[*earlier], marks[k]))).collect())
}

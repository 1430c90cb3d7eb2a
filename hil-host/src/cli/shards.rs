//! Options of campaigns that may be dealt to machines, stopped and taken up again.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail, ensure};
use indicatif::ProgressBar;
use logs::digest::sha256;
use serde_json::{Value, json};

use super::{Output, Verdict};
use crate::terminal::say;
use rig::shards::kept::{Kept, key};
use rig::shards::part::{self, Merged, Part};
use rig::shards::shard::Shard;
use rig::shards::work::{Done, Missing, Work};
use rig::spelling::meant_path;
use rig::whole_file;

/// Which part of a campaign, and what is taken from an earlier run.
#[derive(clap::Args, Clone, Debug)]
pub struct ShardArgs {
    /// Do only this part of the work, as 2/8; its results go to the file of --out, and merge puts all parts together.
    #[arg(long, value_name = "I/N", alias = "part")]
    pub shard: Option<Shard>,
    /// Go on with a run that was stopped or killed.
    #[arg(long)]
    pub resume: bool,
    /// Folder where what is done is kept; default: beside the report until that is written. A folder named here is always used, and may be
    /// shared by machines.
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

/// Arguments of a merge.
#[derive(clap::Args, Clone, Debug)]
pub struct MergeArgs {
    /// Parts that runs with --shard left.
    #[arg(value_name = "PART", required = true)]
    pub parts: Vec<PathBuf>,
    /// Write the whole report as JSON.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// List every case, not only the tables.
    #[arg(long)]
    pub list: bool,
}

/// Where a report goes.
#[derive(Debug)]
pub struct To<'a> {
    /// All of it, as JSON.
    pub out: Option<&'a Path>,
    /// Whether every case is printed.
    pub list: bool,
}

/// A run of a campaign.
#[derive(Debug)]
pub struct Session {
    /// How its items are done.
    pub work: Work,
    command: &'static str,
    plan: Value,
    /// Of a merge: how many shards its parts are of.
    merges: Option<usize>,
    /// Folder that goes when the report is written.
    own: Option<PathBuf>,
}

impl Session {
    /// A run with these options; `report` is the file that the cache is beside.
    ///
    /// # Errors
    /// A shard without a file for its results, a file that may not be written, or results of a run that nobody asked to go on with.
    pub fn open(
        args: &ShardArgs,
        (command, plan): (&'static str, &Value),
        (out, report): (Option<&Path>, &Path),
        jobs: usize,
        output: &Output,
    ) -> anyhow::Result<Self> {
        if let Some(out) = out {
            whole_file::may_write(out, &[], &["json"], output.force || args.resume)?;
        }
        if let (Some(shard), None) = (args.shard, out) {
            bail!("--shard {shard}: name the file for the results of this part, as --out part{}.json", shard.number);
        }
        let shard = args.shard.unwrap_or(Shard::WHOLE);
        let (folder, own) = match &args.cache {
            Some(cache) => {
                ensure!(!cache.is_file(), "--cache {}: is a file; name a folder", cache.display());
                (cache.clone(), None)
            }
            None => {
                let name = key(&[command, &plan.to_string(), &shard.to_string()])?;
                let folder = report.with_extension("cache").join(&name[..16]);
                let is_used = std::fs::read_dir(&folder).is_ok_and(|mut d| d.next().is_some());
                if is_used && !args.resume {
                    let what = folder.display();
                    ensure!(output.force, "{what}: has what an earlier run did; go on from it with --resume, or start anew with --force");
                    std::fs::remove_dir_all(&folder).with_context(|| what.to_string())?;
                }
                (folder.clone(), Some(folder))
            }
        };
        let work = Work { shard, jobs, kept: Kept::Folder(folder) };
        Ok(Self { work, command, plan: plan.clone(), merges: None, own })
    }

    /// One that takes all results from parts.
    #[must_use]
    pub fn merging(command: &'static str, merged: Merged) -> Self {
        let work = Work { shard: Shard::WHOLE, jobs: 0, kept: merged.kept };
        Self { work, command, plan: merged.plan, merges: Some(merged.of), own: None }
    }

    /// Whether this does the whole plan, and says so in a report.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.work.shard == Shard::WHOLE
    }

    /// How many shards the parts of a merge are of.
    #[must_use]
    pub fn merges(&self) -> Option<usize> {
        self.merges
    }

    /// Says above the progress how to stop.
    pub fn announce(&self, bar: &ProgressBar) {
        if let (Kept::Folder(folder), false) = (&self.work.kept, bar.is_hidden()) {
            bar.println(format!("What is done is kept in {}: stop with Ctrl-C, go on with --resume", folder.display()));
        }
    }

    /// Names the shard that makes a missing result.
    #[must_use]
    pub fn explained(&self, error: anyhow::Error) -> anyhow::Error {
        match (error.downcast_ref::<Missing>(), self.merges) {
            (Some(missing), Some(of)) => {
                let shard = Shard { number: missing.place % of + 1, of };
                anyhow::anyhow!(
                    "the part of shard {shard} is missing; make it with glider {} … --shard {shard} --out part{}.json, and name all {of} parts",
                    self.command,
                    shard.number
                )
            }
            _ => error,
        }
    }

    /// Leaves the results of a shard: the document that says so.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn leave_part<'a, T: 'a>(
        &self,
        out: &Path,
        done: impl Iterator<Item = &'a Done<T>> + Clone,
        mut about: Value,
    ) -> anyhow::Result<Value> {
        let from_cache = done.clone().filter(|d| d.was_kept).count();
        let part = Part::new(self.command, &self.plan, self.work.shard, done)?;
        let text = part.text(&about);
        whole_file::write(out, &text).with_context(|| format!("{}: cannot write", out.display()))?;
        self.close();
        about["shard"] = json!(self.work.shard.to_string());
        about["out"] = json!(out);
        about["items"] = json!(part.results.len());
        about["items_from_cache"] = json!(from_cache);
        Ok(about)
    }

    /// Removes what was kept for this run alone; for when its report is written.
    pub fn close(&self) {
        if let Some(own) = &self.own {
            std::fs::remove_dir_all(own).ok();
            // Stays where another run has something in it.
            let _ = own.parent().map(std::fs::remove_dir);
        }
    }
}

/// Reads the parts of a merge.
///
/// # Errors
/// As [`part::merged`], or a file that may not be written.
pub fn parts(args: &MergeArgs, commands: &[&str], output: &Output) -> anyhow::Result<Merged> {
    for path in &args.parts {
        ensure!(path.is_file(), "{}: no such file{}", path.display(), meant_path(path));
    }
    if let Some(out) = &args.out {
        let inputs: Vec<&Path> = args.parts.iter().map(PathBuf::as_path).collect();
        whole_file::may_write(out, &inputs, &["json"], output.force)?;
    }
    part::merged(&args.parts, commands)
}

/// Files the text of a report, if there is a file for it; its SHA-256.
///
/// # Errors
/// The file cannot be written.
pub fn file_report(out: Option<&Path>, text: &[u8]) -> anyhow::Result<String> {
    if let Some(out) = out {
        whole_file::write(out, text).with_context(|| format!("{}: cannot write", out.display()))?;
    }
    Ok(sha256(text))
}

/// Says that a shard is done.
pub fn said_of_shard(about: &Value, what: &str, merge: &str, output: &Output, wrong: bool) -> Verdict {
    output.emit(about, || {
        let word = |key: &str| about[key].as_str().unwrap_or_default().to_owned();
        let of = word("shard").split_once('/').map_or_else(String::new, |s| s.1.to_owned());
        say(&format!(
            "Shard {}: {what}, {} of {} items done before. Put all {of} together with {merge}",
            word("shard"),
            about["items_from_cache"],
            about["items"]
        ));
    });
    if wrong { Verdict::Negative } else { Verdict::Ok }
}

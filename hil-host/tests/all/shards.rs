//! Campaigns in shards, killed and taken up again: one report, whoever did the work and when. Small samples; the whole ones are
//! `glider faults` and `glider scorecard`.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use logs::digest::sha256;
use serde_json::Value;

struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("glider-shards-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        Self(folder)
    }

    fn command(&self, words: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_glider"));
        command.current_dir(&self.0).arg("--json").args(words);
        command
    }

    fn glider(&self, words: &[&str]) -> Output {
        self.command(words).output().expect("the program starts")
    }

    /// The document of a run that is no bad input.
    fn done(&self, words: &[&str]) -> Value {
        let out = self.glider(words);
        let said = || format!("{words:?}: {}{}", String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
        assert!(out.status.code().is_some_and(|c| c < 2), "{}", said());
        serde_json::from_slice(&out.stdout).unwrap_or_else(|e| panic!("{e}: {}", said()))
    }

    fn refused(&self, words: &[&str]) -> String {
        let out = self.glider(words);
        assert_eq!(out.status.code(), Some(2), "{words:?}");
        String::from_utf8_lossy(&out.stdout).into_owned()
    }

    fn text(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.0.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Results that are kept below a folder.
    fn kept(&self, cache: &str) -> usize {
        fn below(folder: &Path) -> usize {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path());
            entries.map(|p| if p.is_dir() { below(&p) } else { usize::from(p.extension().is_some_and(|x| x == "kept")) }).sum()
        }
        below(&self.0.join(cache))
    }

    /// Does a campaign in so many shards, the last first, and merges them.
    fn in_shards(&self, words: &[&str], merge: &[&str], n: usize) -> Value {
        let parts: Vec<String> = (1..=n).rev().map(|i| format!("part{i}of{n}.json")).collect();
        for (i, part) in (1..=n).rev().zip(&parts) {
            let shard = format!("{i}/{n}");
            let left = self.done(&[words, &["--shard", &shard, "--out", part]].concat());
            assert_eq!((left["shard"].as_str(), left["out"].as_str()), (Some(shard.as_str()), Some(part.as_str())), "{left}");
        }
        let all: Vec<&str> = parts.iter().map(String::as_str).collect();
        let out = format!("merged{n}.json");
        let merged = self.done(&[merge, &["--out", &out], &all].concat());
        let short = self.glider(&[merge, &all[1..]].concat());
        let said = String::from_utf8_lossy(&short.stdout).into_owned();
        assert!(short.status.code() == Some(2) && said.contains(&format!("--shard {n}/{n}")), "{said}");
        merged
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn digest(document: &Value) -> &str {
    document["sha256"].as_str().expect("a digest")
}

fn signal(child: &Child, which: &str) {
    let done = Command::new("kill").arg(which).arg(child.id().to_string()).status().expect("kill starts");
    assert!(done.success());
}

const FAULTS: [&str; 7] = ["faults", "--sample", "72", "--random", "18", "--seed", "5"];

#[test]
fn regress_a_fault_campaign_has_one_report_in_1_3_and_17_shards() {
    let here = Scratch::new("faults");
    let whole = here.done(&[&FAULTS[..], &["--out", "whole.json"]].concat());
    assert_eq!(sha256(&here.text("whole.json")), digest(&whole), "the digest is the file's");
    assert!(whole["summary"]["missions"].as_u64().is_some_and(|n| n >= 70), "{}", whole["summary"]);
    let without_time = |d: &Value| {
        let mut s = d["summary"].clone();
        s.as_object_mut().map(|s| s.remove("wall_s"));
        (s, d["by_fault"].clone(), d["not_as_expected"].clone())
    };
    for n in [1, 3, 17] {
        if n == 1 {
            let alone = here.done(&[&FAULTS[..], &["--shard", "1/1", "--out", "one.json", "--jobs", "1"]].concat());
            assert_eq!(digest(&alone), digest(&whole));
            continue;
        }
        let merged = here.in_shards(&FAULTS, &["faults", "merge"], n);
        assert_eq!(digest(&merged), digest(&whole), "{n} shards");
        assert_eq!(here.text(&format!("merged{n}.json")), here.text("whole.json"));
        assert_eq!(without_time(&merged), without_time(&whole), "{n} shards");
    }
    assert_eq!(here.kept("out/faults.cache"), 0, "nothing is left once a report or a part is written");
    // Shards of two campaigns, and a part where another is due.
    let other = ["faults", "--sample", "72", "--random", "18", "--seed", "6", "--shard", "2/3", "--out", "other.json"];
    here.done(&other);
    let mixed = here.refused(&["faults", "merge", "part1of3.json", "other.json", "part3of3.json"]);
    assert!(mixed.contains("other.json: is a part of another campaign"), "{mixed}");
    assert!(here.refused(&["scorecard", "merge", "part1of3.json"]).contains("part of glider faults"));
    assert!(here.refused(&["faults", "--sample", "9", "--shard", "1/2"]).contains("--out part1.json"));
    // Shards of different numbers that have everything together.
    let all: Vec<String> =
        (1..=17).filter(|i| *i != 5).map(|i| format!("part{i}of17.json")).chain((1..=3).map(|i| format!("part{i}of3.json"))).collect();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    assert_eq!(digest(&here.done(&[&["faults", "merge"], &all[..]].concat())), digest(&whole));
}

/// Killed at moments all over a run, and once stopped by Ctrl-C, each time taken up again.
#[test]
fn regress_a_killed_or_stopped_fault_campaign_goes_on() {
    let here = Scratch::new("killed");
    let owed = digest(&here.done(&[&FAULTS[..], &["--jobs", "1"]].concat())).to_owned();
    let line = [&FAULTS[..], &["--jobs", "1", "--resume", "--out", "report.json"]].concat();
    let mut between = Vec::new();
    for stop in 0..6_u32 {
        let mut child = here.command(&line).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program starts");
        // Within a block, after none to two of them: by what is kept, not by the clock of a busy machine.
        let due = here.kept("out/faults.cache") + stop as usize % 3;
        while here.kept("out/faults.cache") < due && child.try_wait().expect("asked").is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(20));
        // Ctrl-C ends a program as TERM does; a job in the background of a shell has INT ignored.
        signal(&child, if stop == 3 { "-TERM" } else { "-KILL" });
        assert!(child.wait().expect("ends").code().is_none(), "ended by itself before the signal");
        between.push(here.kept("out/faults.cache"));
        assert!(!here.0.join("report.json").exists());
    }
    assert!(between.is_sorted() && between.last() > between.first(), "what was done is not done again: {between:?}");
    let refused = here.refused(&[&FAULTS[..], &["--jobs", "1"]].concat());
    assert!(refused.contains("--resume") && refused.contains("--force"), "{refused}");
    // Another campaign beside it is not in its way.
    here.done(&["faults", "--only", "roll:off@dive", "--html", "out/faults.html"]);
    let resumed = here.done(&line);
    assert_eq!(digest(&resumed), owed);
    assert_eq!(sha256(&here.text("report.json")), owed);
    assert_eq!(here.kept("out/faults.cache"), 0);
    // A cache that is named is kept, and all is in it the next time.
    let kept = ["--cache", "mine", "--force", "--out", "report.json"];
    let first = Instant::now();
    here.done(&[&FAULTS[..], &kept[..]].concat());
    let (first, again) = (first.elapsed(), Instant::now());
    assert_eq!(digest(&here.done(&[&FAULTS[..], &kept[..]].concat())), owed);
    assert!(again.elapsed() < first / 2, "{first:?}, then {:?}", again.elapsed());
}

#[test]
fn regress_healthy_missions_merge_too() {
    let here = Scratch::new("healthy");
    let words = ["faults", "--healthy", "40", "--seed", "3"];
    let whole = here.done(&words);
    let merged = here.in_shards(&words, &["faults", "merge"], 3);
    assert_eq!((digest(&merged), &merged["missions"]), (digest(&whole), &40.into()));
}

/// What a scorecard is done again as, to be held against the whole one.
#[derive(PartialEq)]
enum Again {
    Shards,
    Kills,
}

/// A scorecard whole, and in three shards, or killed and taken up again, or both.
fn scorecard(name: &str, words: &[&str], again: &[Again]) {
    let here = Scratch::new(name);
    let clock = Instant::now();
    let whole = here.done(&[words, &["--out", "whole.json"]].concat());
    let took = clock.elapsed();
    assert_eq!(sha256(&here.text("whole.json")), digest(&whole));
    if again.contains(&Again::Shards) {
        assert_eq!(digest(&here.in_shards(words, &["scorecard", "merge"], 3)), digest(&whole), "3 shards");
    }
    if again.contains(&Again::Kills) {
        killed(&here, words, took, &whole);
    }
}

/// Killed at moments all over a run, each time taken up again.
fn killed(here: &Scratch, words: &[&str], took: Duration, whole: &Value) {
    let line = [words, &["--resume", "--cache", "mine"]].concat();
    let mut kept = 0;
    for stop in 1..=3_u32 {
        let mut child = here.command(&line).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program starts");
        std::thread::sleep(took.mul_f64(0.2 * f64::from(stop)));
        child.kill().expect("killed");
        child.wait().expect("ends");
        assert!(here.kept("mine") >= kept, "nothing that was done is lost");
        kept = here.kept("mine");
    }
    assert_eq!(digest(&here.done(&line)), digest(whole), "killed with {kept} done");
}

#[test]
fn regress_discovery_has_one_scorecard_in_shards_and_after_kills() {
    scorecard("discovery", &["scorecard", "discovery", "--cases", "4", "--seed", "4"], &[Again::Shards, Again::Kills]);
}

const TIMELINE: [&str; 10] = ["scorecard", "timeline", "--cases", "2", "--unchanged", "1", "--alarm-dives", "600", "--seed", "4"];

#[test]
fn regress_timeline_has_one_scorecard_in_shards() {
    scorecard("timeline-shards", &TIMELINE, &[Again::Shards]);
}

#[test]
fn regress_timeline_has_one_scorecard_after_kills() {
    scorecard("timeline-kills", &TIMELINE, &[Again::Kills]);
}

#[test]
#[ignore = "two minutes of diagnoses through the room that the others go through"]
fn regress_real_flights_have_one_scorecard_in_shards_and_after_kills() {
    if std::env::var_os("GLIDER_FLIGHTS").is_none() {
        println!("skipped: no flights (GLIDER_FLIGHTS names their folder)");
        return;
    }
    let words = ["scorecard", "real", "--flight", "modena-191", "--error", "nothing", "--error", "cd0 /1.5", "--error", "pitch +3"];
    scorecard("real", &words, &[Again::Shards, Again::Kills]);
}

//! What a flight is doing now: read from the log that `glider fly --log` writes while it flies, or from the log on a board's flash.

use super::log::{ABORTS, EVENTS, PHASES_LOGGED, ROWS, degraded, unfinished};
use super::onboard_log::Logged;
use anyhow::{Context, anyhow, ensure};
use logs::record::bounded;
use serde_json::{Value, json};
use signals::{Flags, Reading};
use std::collections::VecDeque;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Cycles that are kept for a picture of the time just gone: an hour and a half of 4 s.
const KEPT: usize = 1350;

/// One control cycle; what is not known is NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// Since the start of the flight or of the board, s.
    pub time_s: f64,
    /// Phase of the dive cycle.
    pub phase: String,
    /// Dives completed.
    pub dives: u32,
    /// First cause of an abort.
    pub abort: Option<String>,
    /// What is degraded.
    pub degraded: Vec<&'static str>,
    /// Depth believed on board, m.
    pub depth_m: f64,
    /// Measured pitch, and the one aimed at, rad.
    pub pitch_rad: [f64; 2],
    /// Angle of attack estimated on board, rad.
    pub alpha_rad: f64,
    /// Measured ballast, cm³.
    pub ballast_cc: f64,
    /// Battery, V.
    pub battery_v: f64,
}

impl From<&Logged> for Moment {
    fn from((_, frame, answer): &Logged) -> Self {
        let value = |r: Reading| match r {
            Reading::Sampled { value, .. } => f64::from(value),
            Reading::Missing => f64::NAN,
        };
        let trace = &answer.trace;
        Self {
            time_s: frame.time.0 as f64 * 1e-6,
            phase: format!("{:?}", trace.phase),
            dives: trace.dives.into(),
            abort: trace.abort.map(|a| format!("{a:?}")),
            degraded: degraded(trace.flags),
            depth_m: trace.depth_m.into(),
            pitch_rad: [value(frame.pitch_rad), trace.pitch_setpoint_rad.into()],
            alpha_rad: trace.alpha_rad.into(),
            ballast_cc: 1e6 * value(frame.ballast_m3),
            battery_v: value(frame.battery_v),
        }
    }
}

impl Moment {
    /// A row of a log whose columns have these names.
    fn of_row(names: &[String], row: &str) -> Option<Self> {
        let cells: Vec<&str> = row.split(',').collect();
        let number = |name: &str| {
            let at = names.iter().position(|n| n == name);
            at.and_then(|i| cells.get(i)?.parse::<f64>().ok()).unwrap_or(f64::NAN)
        };
        let whole = |name: &str| Some(number(name)).filter(|v| *v >= 0.0).map(|v| v as usize);
        Some(Self {
            time_s: Some(number("time_s")).filter(|t| t.is_finite())?,
            phase: PHASES_LOGGED.get(whole("phase")?).map(|p| format!("{p:?}"))?,
            dives: whole("dives").unwrap_or(0) as u32,
            abort: whole("abort")
                .map(|n| ABORTS.iter().find(|a| **a as usize == n).map_or_else(|| format!("cause {n}"), |a| format!("{a:?}"))),
            degraded: degraded(Flags(whole("flags").unwrap_or(0) as u32)),
            depth_m: number("est_depth_m"),
            pitch_rad: [number("m_pitch_rad"), number("c_pitch_rad")],
            alpha_rad: number("est_alpha_rad"),
            ballast_cc: number("m_ballast_pumped_cc"),
            battery_v: number("m_battery_v"),
        })
    }

    /// For a program; angles in degrees.
    #[must_use]
    pub fn document(&self) -> Value {
        let n = |v: f64, places: i32| {
            let p = 10f64.powi(places);
            v.is_finite().then(|| (v * p).round() / p)
        };
        json!({
            "time_s": n(self.time_s, 2), "phase": self.phase, "dives": self.dives, "abort": self.abort, "degraded": self.degraded,
            "depth_m": n(self.depth_m, 3), "pitch_deg": n(self.pitch_rad[0].to_degrees(), 3),
            "pitch_aimed_deg": n(self.pitch_rad[1].to_degrees(), 3), "alpha_deg": n(self.alpha_rad.to_degrees(), 3),
            "ballast_cc": n(self.ballast_cc, 2), "battery_v": n(self.battery_v, 3),
        })
    }
}

/// The newest cycles of a flight, oldest first.
#[derive(Clone, Debug, Default)]
pub struct Recent {
    /// The cycles.
    pub moments: VecDeque<Moment>,
}

impl Recent {
    /// One cycle more; one that is known already changes nothing, one of another flight begins anew.
    pub fn push(&mut self, moment: Moment) {
        if let Some(last) = self.moments.back() {
            if moment.time_s == last.time_s {
                return;
            }
            if moment.time_s < last.time_s {
                self.moments.clear();
            }
        }
        if self.moments.len() == KEPT {
            self.moments.pop_front();
        }
        self.moments.push_back(moment);
    }

    /// Takes what a board's log holds, oldest first.
    pub fn take(&mut self, logged: &[Logged]) {
        let known = self.moments.back().map(|m| m.time_s);
        let same = |m: &Moment| known.is_some_and(|t| m.time_s == t);
        let moments: Vec<Moment> = logged.iter().map(Moment::from).collect();
        let fresh = moments.iter().rposition(same).map_or(0, |i| i + 1);
        moments.into_iter().skip(fresh).for_each(|m| self.push(m));
    }
}

/// Bytes of a log that are looked at together, and longer than any row: a log may be of a year.
const AT_ONCE: u64 = 1 << 20;

/// Reads a flight's log as it grows.
#[derive(Debug)]
pub struct Follower {
    directory: PathBuf,
    file: File,
    names: Vec<String>,
    rest: Vec<u8>,
    /// The newest cycles.
    pub recent: Recent,
}

impl Follower {
    /// Opens the log of a flight that is under way, or over.
    ///
    /// # Errors
    /// There is none in this folder.
    pub fn open(directory: &Path) -> anyhow::Result<Self> {
        let of = |name: &str| bounded::file(&directory.join(name), u64::MAX).ok();
        let file = of(&unfinished(ROWS)).or_else(|| of(ROWS)).ok_or_else(|| {
            anyhow!(
                "{0}: no flight is logged in this folder; start one beside this: glider fly --realtime 50 --log {0}",
                directory.display()
            )
        })?;
        let mut out = Self { directory: directory.to_owned(), file, names: Vec::new(), rest: Vec::new(), recent: Recent::default() };
        out.read()?;
        Ok(out)
    }

    /// Takes what was written since the last look; returns how the flight ended once it is over.
    ///
    /// # Errors
    /// The log cannot be read any more.
    pub fn read(&mut self) -> anyhow::Result<Option<String>> {
        // Before the rows: what is over now has all of them.
        let end = self.end();
        let name = self.directory.display();
        while self.file.by_ref().take(AT_ONCE).read_to_end(&mut self.rest).with_context(|| format!("{name}: cannot read its flight log"))?
            > 0
        {
            // The last line may be half written.
            let Some(last) = self.rest.iter().rposition(|b| *b == b'\n') else {
                ensure!((self.rest.len() as u64) < AT_ONCE, "{name}: a line of its flight log is longer than any row");
                continue;
            };
            let whole: Vec<u8> = self.rest.drain(..=last).collect();
            for line in String::from_utf8_lossy(&whole).lines() {
                if self.names.is_empty() {
                    self.names = line.split(',').map(str::to_owned).collect();
                } else if let Some(moment) = Moment::of_row(&self.names, line) {
                    self.recent.push(moment);
                }
            }
        }
        Ok(end)
    }

    fn end(&self) -> Option<String> {
        let under_way = [ROWS, EVENTS].iter().any(|name| self.directory.join(unfinished(name)).exists());
        if under_way || !self.directory.join(ROWS).exists() {
            return None;
        }
        let vehicle = bounded::text(&self.directory.join("vehicle.json"), bounded::DOCUMENT).unwrap_or_default();
        let said: Option<Value> = serde_json::from_str(&vehicle).ok();
        Some(said.and_then(|v| v["flight"]["end"].as_str().map(str::to_owned)).unwrap_or_else(|| "over".to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(time_s: f64, depth_m: f64) -> Moment {
        let names = ["time_s", "phase", "est_depth_m"].map(str::to_owned);
        Moment::of_row(&names, &format!("{time_s},1,{depth_m}")).unwrap()
    }

    #[test]
    fn a_growing_log_is_read_once_and_only_in_whole_lines() {
        let folder = std::env::temp_dir().join(format!("glider-under-way-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        assert!(Follower::open(&folder).unwrap_err().to_string().contains("glider fly"));
        let journal = folder.join(unfinished(ROWS));
        std::fs::write(&journal, "time_s,phase,dives,abort,flags,est_depth_m,m_battery_v\n0,1,0,,0,1.5,15.2\n4,1,0,,0,").unwrap();
        let mut follower = Follower::open(&folder).unwrap();
        assert_eq!(follower.recent.moments.len(), 1);
        let mut file = std::fs::OpenOptions::new().append(true).open(&journal).unwrap();
        std::io::Write::write_all(&mut file, b"2.5,15.1\n8,7,0,1,1024,3.5,15\n").unwrap();
        assert_eq!(follower.read().unwrap(), None);
        let last = follower.recent.moments.back().unwrap().clone();
        assert_eq!(follower.recent.moments[1].depth_m, 2.5);
        assert_eq!((last.phase.as_str(), last.abort.as_deref(), last.degraded.as_slice()), ("Safe", Some("Leak"), &["weight fired"][..]));
        assert!(last.document()["alpha_deg"].is_null() && last.document()["battery_v"] == 15.0);
        std::fs::rename(&journal, folder.join(ROWS)).unwrap();
        std::fs::write(folder.join("vehicle.json"), r#"{"flight": {"end": "done"}}"#).unwrap();
        assert_eq!(follower.read().unwrap().as_deref(), Some("done"));
        std::fs::write(folder.join(ROWS), "time_s,".repeat(AT_ONCE as usize / 7 + 1)).unwrap();
        assert!(Follower::open(&folder).unwrap_err().to_string().contains("longer than any row"));
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn time_that_jumps_back_begins_another_flight() {
        let mut recent = Recent::default();
        for (t, d) in [(0.0, 1.0), (4.0, 2.0), (4.0, 2.0), (8.0, 3.0)] {
            recent.push(at(t, d));
        }
        assert_eq!(recent.moments.len(), 3);
        recent.push(at(0.0, 0.0));
        assert_eq!(recent.moments.len(), 1);
        (1..2 * KEPT).for_each(|i| recent.push(at(i as f64, 0.0)));
        assert_eq!(recent.moments.len(), KEPT);
    }
}

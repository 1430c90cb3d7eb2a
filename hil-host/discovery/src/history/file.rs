//! A vehicle's history as a file beside its vehicle file: `NAME.history`, JSON lines, schema `glider-history/1`.
//!
//! The first line says whose it is and where its numbers count from; every further line is the summary of one dive, so that a
//! history is learnt again, and extended, without the logs.

use super::glide::Glider;
use super::learn::{Forward, GATE, Learnt, WINDOW, forward, learn, linear_about, of_summaries, start_of_first, wide_about};
use super::numbers::{NUMBERS, Numbers};
use super::rows::{Unit, drive_m3, median};
use super::structure::COLUMNS;
use super::summary::Summary;
use logs::vehicle::Vehicle;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Schema of the file.
pub const SCHEMA: &str = "glider-history/1";
/// Version of the model that summaries are made with: rows, glide, noise. Another one asks for the logs again.
const MODEL: u32 = 1;
/// Ending of the file's name.
pub const ENDING: &str = "history";

/// First line: whose history it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// Schema.
    pub schema: String,
    /// Version of the model of the summaries.
    pub model: u32,
    /// Program that wrote it.
    pub tool: String,
    /// Vehicle file that it was learnt with.
    pub vehicle: String,
    /// SHA-256 of that file.
    pub vehicle_sha256: String,
    /// Temperature about which an error of the expansion is no error of trim, °C.
    pub reference_degc: f64,
    /// Stroke of the buoyancy engine to either side, m³.
    pub drive_m3: f64,
    /// What the vehicle file claims of the numbers, in their units: an edited file shows.
    pub claims: [f64; NUMBERS],
    /// Where summaries count from: numbers beyond the vehicle file, in sizes.
    pub at: [f64; NUMBERS],
    /// Where calibration began, beyond `at`: the mean is tied to it.
    pub anchor: [f64; NUMBERS],
    /// Usual level of the noise of a row, (m/s)².
    pub usual_level: f64,
}

/// In which way a unit was flown.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Regime {
    /// Mean of |pitch|, rad.
    pub pitch_rad: f64,
    /// Stroke of the engine to either side, m³.
    pub drive_m3: f64,
    /// Deepest row, Pa.
    pub pressure_pa: f64,
    /// Mean of |roll|, rad.
    pub roll_rad: f64,
    /// Mean rate of turn inside legs, rad/s.
    pub turn_rad_s: f64,
}

impl Regime {
    /// Of a unit.
    #[must_use]
    pub fn of(unit: &Unit) -> Self {
        let n = unit.rows.len() as f64;
        let mean = |f: &dyn Fn(&super::rows::Row) -> f64| unit.rows.iter().map(f).sum::<f64>() / n;
        let turns = unit.rows.windows(2).filter(|w| w[0].block == w[1].block);
        let (turned, time) = turns.fold((0.0, 0.0), |(h, t), w| (h + w[1].heading_rad - w[0].heading_rad, t + w[1].time_s - w[0].time_s));
        Self {
            pitch_rad: mean(&|r| r.pitch_rad.abs()),
            drive_m3: drive_m3(std::slice::from_ref(unit)),
            pressure_pa: unit.rows.iter().map(|r| r.pressure_pa).fold(0.0, f64::max),
            roll_rad: mean(&|r| r.roll_rad.abs()),
            turn_rad_s: if time > 0.0 { turned / time } else { 0.0 },
        }
    }
}

/// A further line: one dive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stored {
    /// Flight and segment.
    pub id: String,
    /// Start, s.
    pub start_s: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// How it was flown.
    pub regime: Regime,
    /// Rows and blocks.
    pub rows: usize,
    /// Blocks of rows.
    pub blocks: usize,
    /// Level of the noise of a row, (m/s)²: where structures are noise, and where they are columns.
    pub level: [f64; 2],
    /// chi² per number against the quiet units before it; none of the first ones.
    pub chi2: Option<f64>,
    /// Whether it may be a control.
    pub quiet: bool,
    /// SHA-256 of its log.
    pub log_sha256: String,
    /// Upper triangle of R by rows, N = R'R over the noise: its first eight rows and columns are of the numbers, structures follow.
    pub r: Vec<f64>,
    /// y, u = R'y.
    pub y: Vec<f64>,
}

impl Stored {
    /// A unit linearised at `at` (beyond the vehicle of `glider`) and counted from there.
    #[must_use]
    pub fn of(unit: &Unit, glider: &Glider, at: &Numbers, usual_level: Option<f64>, forward: Forward, log_sha256: &str) -> Self {
        let linear = wide_about(unit, glider, at, &Numbers::zeros());
        let level = [linear_about(unit, glider, at, &Numbers::zeros()).own_level(usual_level), linear.own_level(usual_level)];
        let (r, y) = linear.root();
        let scale = level[0].sqrt();
        Self {
            id: unit.id.clone(),
            start_s: unit.start_s(),
            duration_s: unit.duration_s(),
            regime: Regime::of(unit),
            rows: unit.rows.len(),
            blocks: unit.blocks(),
            level,
            chi2: forward.chi2.is_finite().then_some(forward.chi2),
            quiet: forward.quiet,
            log_sha256: log_sha256.to_owned(),
            r: (0..COLUMNS).flat_map(|i| (i..COLUMNS).map(move |k| (i, k))).map(|(i, k)| r[(i, k)] / scale).collect(),
            y: y.iter().map(|y| y / scale).collect(),
        }
    }

    /// N and u of the numbers.
    #[must_use]
    pub fn summary(&self) -> Summary {
        self.root().of_numbers()
    }

    /// N and u of all columns.
    #[must_use]
    pub fn wide_summary(&self) -> Summary {
        let Summary { n, u } = self.root();
        let by = self.level[0] / self.level[1];
        Summary { n: n * by, u: u * by }
    }

    fn root(&self) -> Summary {
        let mut r = DMatrix::zeros(COLUMNS, COLUMNS);
        let places = (0..COLUMNS).flat_map(|i| (i..COLUMNS).map(move |k| (i, k)));
        places.zip(&self.r).for_each(|(place, value)| r[place] = *value);
        Summary::of_root(&r, &DVector::from_column_slice(&self.y))
    }

    fn is_sound(&self) -> bool {
        let finite = self.r.iter().chain(&self.y).all(|x| x.is_finite()) && self.level.iter().all(|l| *l > 0.0);
        finite && self.r.len() == COLUMNS * (COLUMNS + 1) / 2 && self.y.len() == COLUMNS
    }
}

/// A history as its file holds it.
#[derive(Clone, Debug, PartialEq)]
pub struct History {
    /// Whose.
    pub head: Head,
    /// Its dives, in the order of time.
    pub units: Vec<Stored>,
}

/// By how many sizes the numbers of two vehicle files differ.
pub type Edited = Numbers;

/// Units of one log, and the log's SHA-256.
#[derive(Clone, Debug)]
pub struct Logged {
    /// In the order of time.
    pub units: Vec<Unit>,
    /// Of the log.
    pub sha256: String,
}

impl History {
    /// Learns the history of a vehicle from its logs, in the order of time; none from fewer than three steady dives.
    #[must_use]
    pub fn learnt_from(logs: &[Logged], vehicle: &Vehicle, vehicle_sha256: &str) -> Option<Self> {
        let units: Vec<Unit> = logs.iter().flat_map(|l| l.units.iter().cloned()).collect();
        if units.len() < super::learn::FEWEST_CONTROLS {
            return None;
        }
        let glider = Glider::of_units(vehicle, &units);
        let from = start_of_first(&units, &glider);
        let compared = forward(&units, &glider, &from, WINDOW);
        let quiet: Vec<&Unit> = units.iter().zip(&compared).filter(|(_, f)| f.quiet).map(|(u, _)| u).collect();
        let learnt = learn(&quiet[quiet.len().saturating_sub(WINDOW)..], &glider, &from);
        let hashes = logs.iter().flat_map(|l| l.units.iter().map(|_| l.sha256.as_str()));
        let stored = units.iter().zip(&compared).zip(hashes);
        let head = Head {
            schema: SCHEMA.into(),
            model: MODEL,
            tool: concat!("glider ", env!("CARGO_PKG_VERSION")).into(),
            vehicle: vehicle.path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default(),
            vehicle_sha256: vehicle_sha256.into(),
            reference_degc: glider.reference_degc,
            drive_m3: glider.drive_m3,
            claims: glider.claims(),
            at: learnt.at.into(),
            anchor: (from - learnt.at).into(),
            usual_level: learnt.usual_level,
        };
        let units = stored.map(|((u, f), hash)| Stored::of(u, &glider, &learnt.at, Some(learnt.usual_level), *f, hash)).collect();
        Some(Self { head, units })
    }

    /// The vehicle of a file as this history measures it. What the file claims otherwise than the history's is a claim that a
    /// judgement may contradict.
    #[must_use]
    pub fn glider(&self, vehicle: &Vehicle) -> Glider {
        Glider::new(vehicle, self.head.reference_degc, self.head.drive_m3)
    }

    /// By how many sizes a vehicle file claims other numbers than the one that the history was learnt with.
    #[must_use]
    pub fn edited(&self, vehicle: &Vehicle) -> Edited {
        let glider = self.glider(vehicle);
        let now = glider.claims();
        Numbers::from_fn(|i, _| (now[i] - self.head.claims[i]) / glider.sizes[i])
    }

    /// The quiet units that it judges by: the most recent ones.
    #[must_use]
    pub fn controls(&self) -> Vec<&Stored> {
        let quiet: Vec<&Stored> = self.units.iter().filter(|u| u.quiet).collect();
        quiet[quiet.len().saturating_sub(WINDOW)..].to_vec()
    }

    /// chi² of quiet units against those before them: what a further one is ranked among.
    #[must_use]
    pub fn earlier_chi2(&self) -> Vec<f64> {
        self.units.iter().filter(|u| u.quiet).filter_map(|u| u.chi2).collect()
    }

    /// Mean and covariance, from the summaries alone.
    #[must_use]
    pub fn learnt(&self) -> Learnt {
        let controls = self.controls();
        let wide: Vec<Summary> = controls.iter().map(|c| c.wide_summary()).collect();
        let units = controls.iter().map(|c| c.summary()).collect();
        let anchor = DVector::from_column_slice(&self.head.anchor);
        of_summaries(units, &wide, Numbers::from(self.head.at), &anchor, median(controls.iter().map(|c| c.level[0])))
    }

    /// As the file has it.
    #[must_use]
    pub fn text(&self) -> String {
        let lines = std::iter::once(serde_json::to_string(&self.head)).chain(self.units.iter().map(serde_json::to_string));
        lines.map(|l| l.unwrap_or_default() + "\n").collect()
    }

    /// Reads it.
    ///
    /// # Errors
    /// What is wrong, in which line, and what to do.
    pub fn parse(text: &str, path: &Path) -> Result<Self, String> {
        let bad = |line: usize, why: String| format!("{}, line {line}: {why}", path.display());
        let mut lines = text.lines().enumerate().map(|(i, l)| (i + 1, l)).filter(|(_, l)| !l.trim().is_empty());
        let (number, first) = lines.next().ok_or_else(|| bad(1, "is empty; glider calibrate writes a history".into()))?;
        let head: Head = serde_json::from_str(first)
            .map_err(|e| bad(number, format!("is no head of a history, which `glider calibrate` writes ({e})")))?;
        if head.schema != SCHEMA || head.model != MODEL {
            let why =
                format!("is `{}`, model {}; expected `{SCHEMA}`, model {MODEL}: calibrate again from the logs", head.schema, head.model);
            return Err(bad(number, why));
        }
        let numbers =
            head.at.iter().chain(&head.anchor).chain(&head.claims).chain([&head.reference_degc, &head.drive_m3, &head.usual_level]);
        if !numbers.into_iter().all(|x| x.is_finite()) || !(head.drive_m3 > 0.0) {
            return Err(bad(number, "has a number that no vehicle has".into()));
        }
        let mut units: Vec<Stored> = Vec::new();
        for (number, line) in lines {
            let unit: Stored = serde_json::from_str(line).map_err(|e| bad(number, format!("is no summary of a dive ({e})")))?;
            if !unit.is_sound() {
                return Err(bad(number, "has a summary that is none: 325 numbers of r and 25 of y, all finite".into()));
            }
            units.push(unit);
        }
        Ok(Self { head, units })
    }

    /// The history beside a vehicle file, if there is one.
    #[must_use]
    pub fn next_to(vehicle: &Path) -> Option<PathBuf> {
        Some(vehicle.with_extension(ENDING)).filter(|p| p.is_file())
    }

    /// Whether its units are alike, in words, where they are not.
    #[must_use]
    pub fn gate(learnt: &Learnt) -> Option<String> {
        (!learnt.predicts_itself()).then(|| {
            format!(
                "this history does not predict itself: its units are not alike (chi2 {:.1} per number, at most {GATE}); nothing is named",
                learnt.chi2
            )
        })
    }
}

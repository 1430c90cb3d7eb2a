//! Flight logs: what a HIL flight leaves on disk, in the project's one flight
//! format, so that a simulated flight is read by the same tools as a real one.
//!
//! A flight is a directory:
//!
//! | file | content |
//! |---|---|
//! | `flight.csv` | one row per control cycle: the format's columns, then what the controller did and thought, then `truth_*` (what really happened; no tool may fit on it) |
//! | `vehicle.json` | the nominal vehicle, sensors, tolerances, segments, provenance and the meaning of every extra column |
//! | `events.csv` | phase changes, aborts, faults, degradations, with their time |
//! | `frames.bin` | what the controller was given and what it answered, bit for bit ([`super::frames`]) |
//! | `mission.toml` | the mission as flown |
//!
//! Every row goes to disk at once: a flight that is cut keeps all it had. While
//! it flies, rows, events and frames stand in `flight.csv.unfinished`,
//! `events.csv.unfinished` and `frames.bin.unfinished`; the end of the flight gives them their names. A
//! killed program leaves these journals, which no tool takes for a flight
//! unless they are named.
//!
//! Segments: the format's segment starts and ends floating at the surface. A
//! mission that turns at depth without surfacing has its dive cycles as
//! segments instead (`segment_start` in the vehicle file says which); positions
//! then count from the launch point of the last dive from the surface.

use super::frames::{self, Entry, FRAMES};
use anyhow::Context;
use logs::record::csv::UNFINISHED;
use serde_json::{Value, json};
use signals::{Abort, Answer, Flags, Phase, Reading, SensorFrame, Utc};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The format's columns, in the format's order.
pub const FORMAT_COLUMNS: [&str; 13] = [
    "time_s",
    "segment",
    "pressure_dbar",
    "m_pitch_rad",
    "m_roll_rad",
    "m_heading_rad",
    "m_ballast_pumped_cc",
    "m_battpos_m",
    "sci_water_temp_degC",
    "sci_density_kg_m3",
    "gps_east_m",
    "gps_north_m",
    "speed_water_m_s",
];

/// Extra columns: name, unit, meaning.
pub const EXTRA_COLUMNS: [(&str, &str, &str); 28] = [
    ("phase", "-", "0 surface, 1 dive, 2 inflect low, 3 climb, 4 inflect high, 5 comms, 6 done, 7 safe"),
    ("dives", "-", "dives completed"),
    ("abort", "-", "first cause of an abort (number in `aborts` of vehicle.json); empty: none"),
    ("flags", "-", "degradations, bits of signals::Flags"),
    ("c_ballast_cc", "cm3", "commanded ballast volume, positive buoyant"),
    ("c_battpos_m", "m", "commanded battery position, forward positive"),
    ("c_fin_rad", "rad", "commanded fin angle"),
    ("c_drop_weight", "-", "1: release of the drop weight fired"),
    ("c_pitch_rad", "rad", "pitch aimed at"),
    ("est_alpha_rad", "rad", "angle of attack estimated on board"),
    ("est_speed_m_s", "m/s", "speed through the water estimated on board"),
    ("est_glide_angle_rad", "rad", "path angle estimated on board, up positive"),
    ("est_depth_m", "m", "depth believed on board"),
    ("table_id", "-", "identity (CRC-32) of the polar table in use"),
    ("m_fin_rad", "rad", "measured fin angle"),
    ("m_battery_v", "V", "measured battery voltage"),
    ("utc_s", "s", "UTC by the board's clock, since 1970-01-01; empty: unknown"),
    ("utc_within_s", "s", "true UTC is at most so far from it"),
    ("truth_depth_m", "m", "true depth"),
    ("truth_east_m", "m", "true position over ground"),
    ("truth_north_m", "m", "true position over ground"),
    ("truth_pitch_rad", "rad", "true pitch"),
    ("truth_alpha_rad", "rad", "true angle of attack"),
    ("truth_speed_m_s", "m/s", "true speed through the water"),
    ("truth_glide_angle_rad", "rad", "true path angle through the water, up positive"),
    ("truth_ballast_cc", "cm3", "true ballast volume"),
    ("truth_battpos_m", "m", "true battery position"),
    ("truth_energy_j", "J", "electrical energy used since the start"),
];

/// What is measured in one cycle, as far as the format names it; NaN: no value.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Time since the start, s.
    pub time_s: f64,
    /// Gauge pressure, Pa.
    pub pressure_pa: f64,
    /// Pitch, rad.
    pub pitch_rad: f64,
    /// Roll, rad.
    pub roll_rad: f64,
    /// Heading, rad.
    pub heading_rad: f64,
    /// Ballast volume, m³.
    pub ballast_m3: f64,
    /// Battery position, m.
    pub battery_mass_m: f64,
    /// Fin, rad.
    pub fin_rad: f64,
    /// Water temperature, °C.
    pub temperature_degc: f64,
    /// Water density, kg/m³.
    pub density_kg_m3: f64,
    /// GPS fix east, m.
    pub gps_east_m: f64,
    /// GPS fix north, m.
    pub gps_north_m: f64,
    /// Speed through the water, m/s.
    pub speed_m_s: f64,
    /// Battery, V.
    pub battery_v: f64,
    /// UTC; none: unknown.
    pub utc: Option<Utc>,
}

/// A reading as a number; NaN: none, or one that is not finite.
#[must_use]
pub fn value(r: Reading) -> f64 {
    match r {
        Reading::Sampled { value, .. } if value.is_finite() => f64::from(value),
        _ => f64::NAN,
    }
}

impl Measured {
    /// What a frame says at a time; a depth is a pressure over `depth_to_pa`.
    #[must_use]
    pub fn of(time_s: f64, f: &SensorFrame, depth_to_pa: f64) -> Self {
        Self {
            time_s,
            pressure_pa: value(f.depth_m) * depth_to_pa,
            pitch_rad: value(f.pitch_rad),
            roll_rad: value(f.roll_rad),
            heading_rad: value(f.heading_rad),
            ballast_m3: value(f.ballast_m3),
            battery_mass_m: value(f.battery_mass_m),
            fin_rad: value(f.fin_rad),
            temperature_degc: value(f.temperature_degc),
            density_kg_m3: value(f.density_kg_m3),
            gps_east_m: f64::NAN,
            gps_north_m: f64::NAN,
            speed_m_s: f64::NAN,
            battery_v: value(f.battery_v),
            utc: None,
        }
    }
}

/// What really happened in one cycle.
#[derive(Clone, Copy, Debug, Default)]
pub struct Truth {
    /// Depth, m.
    pub depth_m: f64,
    /// East over ground, m.
    pub east_m: f64,
    /// North over ground, m.
    pub north_m: f64,
    /// Pitch, rad.
    pub pitch_rad: f64,
    /// Angle of attack, rad.
    pub alpha_rad: f64,
    /// Speed through the water, m/s.
    pub speed_m_s: f64,
    /// Path angle through the water, rad, up positive.
    pub glide_angle_rad: f64,
    /// Ballast, m³.
    pub ballast_m3: f64,
    /// Battery position, m.
    pub battery_mass_m: f64,
    /// Energy used, J.
    pub energy_j: f64,
}

/// Where a segment starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SegmentStart {
    /// Floating, a dive from the surface.
    Surface,
    /// At depth, where the vehicle turns down without having surfaced.
    Moving,
}

/// Rows of a finished flight.
pub const ROWS: &str = "flight.csv";
/// Events of a finished flight.
pub const EVENTS: &str = "events.csv";

/// The name of a file of a flight that is not over.
#[must_use]
pub fn unfinished(name: &str) -> String {
    format!("{name}{UNFINISHED}")
}

/// A flight log being written.
pub struct Writer {
    directory: PathBuf,
    csv: File,
    events: File,
    frames: File,
    vehicle: Value,
    segment: u32,
    /// Segments that started at the surface.
    from_surface: Vec<u32>,
    last: Option<Answer>,
    rows: u64,
}

impl Writer {
    /// Starts a log. `vehicle` holds the nominal vehicle in the format's keys.
    ///
    /// # Errors
    /// The directory holds a flight already, or cannot be written.
    pub fn create(directory: &Path, vehicle: Value, mission_toml: &str) -> anyhow::Result<Self> {
        let at = |name: &str| directory.join(name);
        anyhow::ensure!(
            !(at(ROWS).exists() || at(&unfinished(ROWS)).exists()),
            "{}: a flight is there already; name another --log directory (a flight is never overwritten)",
            directory.display()
        );
        std::fs::create_dir_all(directory).with_context(|| format!("{}: cannot create this log directory", directory.display()))?;
        let create = |name: &str| {
            let path = at(&unfinished(name));
            File::create(&path).with_context(|| format!("{}: cannot write", path.display()))
        };
        let mut csv = create(ROWS)?;
        let header: Vec<&str> = FORMAT_COLUMNS.iter().copied().chain(EXTRA_COLUMNS.iter().map(|c| c.0)).collect();
        writeln!(csv, "{}", header.join(","))?;
        let mut events = create(EVENTS)?;
        writeln!(events, "time_s,event,detail")?;
        let mut frames = create(FRAMES)?;
        frames.write_all(&frames::head())?;
        crate::whole_file::write(at("mission.toml"), mission_toml)
            .with_context(|| format!("{}: cannot write", at("mission.toml").display()))?;
        let mut log =
            Self { directory: directory.to_owned(), csv, events, frames, vehicle, segment: 0, from_surface: vec![0], last: None, rows: 0 };
        log.write_vehicle()?;
        Ok(log)
    }

    /// Where the log is.
    #[must_use]
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Rows written.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// How the segment starts that a cycle with this answer begins; none where it goes on with the one being written.
    #[must_use]
    pub fn new_segment(&self, answer: &Answer) -> Option<SegmentStart> {
        let last = self.last.filter(|last| answer.trace.dives > 0 && answer.trace.phase != last.trace.phase)?;
        match answer.trace.phase {
            Phase::Dive if matches!(last.trace.phase, Phase::Comms | Phase::Surface) => Some(SegmentStart::Surface),
            Phase::InflectHigh => Some(SegmentStart::Moving),
            _ => None,
        }
    }

    /// Writes one cycle.
    ///
    /// # Errors
    /// Disk full or gone.
    pub fn push(&mut self, m: &Measured, frame: &SensorFrame, answer: &Answer, truth: &Truth) -> anyhow::Result<()> {
        // After its mission a controller that was reset is asked no more; its last command stays.
        if answer.command.seq == frame.seq {
            self.note(&Entry::Cycle(*frame, *answer))?;
        }
        let phase = answer.trace.phase;
        let before = self.last.map_or(Phase::Surface, |a| a.trace.phase);
        if phase != before || self.last.is_none() {
            self.event(m.time_s, "phase", &format!("{phase:?}"))?;
        }
        if let Some(cause) = answer.trace.abort
            && self.last.is_none_or(|a| a.trace.abort.is_none())
        {
            self.event(m.time_s, "abort", &format!("{cause:?}"))?;
        }
        let flags = self.last.map_or(0, |a| a.trace.flags.0);
        if answer.trace.flags.0 & !flags != 0 {
            self.event(m.time_s, "degraded", &format!("{:#x}", answer.trace.flags.0 & !flags))?;
        }
        if let Some(start) = self.new_segment(answer) {
            self.segment += 1;
            if start == SegmentStart::Surface {
                self.from_surface.push(self.segment);
            }
            self.write_vehicle()?;
        }
        self.last = Some(*answer);
        let line = self.line(m, answer, truth);
        self.csv.write_all(line.as_bytes()).with_context(|| format!("{}: cannot write the flight log", self.directory.display()))?;
        self.rows += 1;
        Ok(())
    }

    /// Notes what the controller was given besides its frames, or that it was reset.
    ///
    /// # Errors
    /// Disk full or gone.
    pub fn note(&mut self, entry: &Entry) -> anyhow::Result<()> {
        frames::append(&mut self.frames, entry).with_context(|| format!("{}: cannot write the frames", self.directory.display()))
    }

    fn line(&self, m: &Measured, answer: &Answer, truth: &Truth) -> String {
        use std::fmt::Write as _;
        let mut s = String::with_capacity(320);
        let mut put = |x: f64, decimals: usize| {
            if x.is_finite() {
                let _ = write!(s, "{x:.decimals$}");
            }
            s.push(',');
        };
        put(m.time_s, 2);
        put(f64::from(self.segment), 0);
        put(m.pressure_pa * 1e-4, 3);
        put(m.pitch_rad, 5);
        put(m.roll_rad, 5);
        put(m.heading_rad, 5);
        put(m.ballast_m3 * 1e6, 2);
        put(m.battery_mass_m, 5);
        put(m.temperature_degc, 3);
        put(m.density_kg_m3, 4);
        put(m.gps_east_m, 1);
        put(m.gps_north_m, 1);
        put(m.speed_m_s, 4);
        let (c, t) = (&answer.command, &answer.trace);
        put(f64::from(t.phase as u8), 0);
        put(f64::from(t.dives), 0);
        put(t.abort.map_or(f64::NAN, |a| f64::from(a as u8)), 0);
        put(f64::from(t.flags.0), 0);
        put(f64::from(c.ballast_m3) * 1e6, 2);
        put(f64::from(c.battery_mass_m), 5);
        put(f64::from(c.fin_rad), 5);
        put(f64::from(u8::from(c.drop_weight)), 0);
        put(f64::from(t.pitch_setpoint_rad), 5);
        put(f64::from(t.alpha_rad), 5);
        put(f64::from(t.speed_m_s), 4);
        put(f64::from(t.glide_angle_rad), 5);
        put(f64::from(t.depth_m), 3);
        put(f64::from(t.table_id), 0);
        put(m.fin_rad, 5);
        put(m.battery_v, 2);
        put(m.utc.map_or(f64::NAN, |utc| utc.ms as f64 * 1e-3), 3);
        put(m.utc.map_or(f64::NAN, |utc| f64::from(utc.within_ms) * 1e-3), 3);
        put(truth.depth_m, 3);
        put(truth.east_m, 2);
        put(truth.north_m, 2);
        put(truth.pitch_rad, 5);
        put(truth.alpha_rad, 5);
        put(truth.speed_m_s, 4);
        put(truth.glide_angle_rad, 5);
        put(truth.ballast_m3 * 1e6, 2);
        put(truth.battery_mass_m, 5);
        put(truth.energy_j, 1);
        s.pop();
        s.push('\n');
        s
    }

    /// Notes an event.
    ///
    /// # Errors
    /// Disk full or gone.
    pub fn event(&mut self, time_s: f64, event: &str, detail: &str) -> anyhow::Result<()> {
        writeln!(self.events, "{time_s:.2},{event},{}", detail.replace(',', ";"))?;
        Ok(())
    }

    /// Adds what is known at the end and closes the log.
    ///
    /// # Errors
    /// Disk full or gone.
    pub fn finish(mut self, summary: Value) -> anyhow::Result<PathBuf> {
        if let Some(v) = self.vehicle.as_object_mut() {
            v.insert("flight".to_owned(), summary);
        }
        self.write_vehicle()?;
        // The rows last: what has the name of a flight is a finished one.
        for (file, name) in [(&self.frames, FRAMES), (&self.events, EVENTS), (&self.csv, ROWS)] {
            let (from, to) = (self.directory.join(unfinished(name)), self.directory.join(name));
            file.sync_all()
                .and_then(|()| std::fs::rename(from, &to))
                .with_context(|| format!("{}: cannot finish the flight log", to.display()))?;
        }
        Ok(self.directory)
    }

    fn write_vehicle(&mut self) -> anyhow::Result<()> {
        // Every fourth segment from the third on judges, the others may be fitted; of fewer, the last one judges. Dives without a
        // surfacing between them stay together where there are enough of such groups: the fixes tell of a whole group only.
        let all: Vec<u32> = (0..=self.segment).collect();
        let group = |s: u32| self.from_surface.partition_point(|first| *first <= s) - 1;
        let is_check = |s: u32| match (self.segment, self.from_surface.len()) {
            (0, _) => false,
            (1, _) => s == 1,
            (_, 0..3) => s % 4 == 2,
            _ => group(s) % 4 == 2,
        };
        let start = if self.from_surface.len() == all.len() { "surface" } else { "moving" };
        let (check, fit): (Vec<u32>, Vec<u32>) = all.into_iter().partition(|s| is_check(*s));
        if let Some(v) = self.vehicle.as_object_mut() {
            v.insert("segments".to_owned(), json!({ "fit": fit, "check": check }));
            v.insert("segment_start".to_owned(), json!(start));
            let columns: serde_json::Map<String, Value> =
                EXTRA_COLUMNS.iter().map(|(n, u, m)| ((*n).to_owned(), json!({ "unit": u, "meaning": m }))).collect();
            v.insert("columns".to_owned(), Value::Object(columns));
            v.insert("aborts".to_owned(), aborts());
        }
        let path = self.directory.join("vehicle.json");
        crate::whole_file::write(&path, format!("{:#}\n", self.vehicle)).with_context(|| format!("{}: cannot write", path.display()))
    }
}

/// Phases by their number.
pub const PHASES_LOGGED: [Phase; 8] =
    [Phase::Surface, Phase::Dive, Phase::InflectLow, Phase::Climb, Phase::InflectHigh, Phase::Comms, Phase::Done, Phase::Safe];

/// Degradations, for a person.
pub const DEGRADATIONS: [(Flags, &str); 13] = [
    (Flags::PITCH_PRESET, "pitch preset"),
    (Flags::NO_HEADING, "no heading"),
    (Flags::DEPTH_PROJECTED, "depth projected"),
    (Flags::DENSITY_DEFAULT, "density default"),
    (Flags::PUMP_OPEN_LOOP, "pump open loop"),
    (Flags::MASS_STOPPED, "mass stopped"),
    (Flags::FIELD_REFUSED, "field refused"),
    (Flags::LOG_FULL, "log full"),
    (Flags::TABLE_REFUSED, "table refused"),
    (Flags::DEGRADED, "flies worse than the table"),
    (Flags::WEIGHT_FIRED, "weight fired"),
    (Flags::RESUMED, "resumed"),
    (Flags::DEPARTS, "glides depart from the history"),
];

/// Names of the degradations whose flags are up.
#[must_use]
pub fn degraded(flags: Flags) -> Vec<&'static str> {
    DEGRADATIONS.into_iter().filter(|(flag, _)| flags.contains(*flag)).map(|(_, name)| name).collect()
}

/// The causes of an abort.
pub const ABORTS: [Abort; 24] = {
    use Abort::*;
    [
        OverDepth,
        Leak,
        Vacuum,
        Undervoltage,
        LowCharge,
        OverTime,
        NoComms,
        StuckDepth,
        Stalled,
        SensorDepth,
        SensorPitch,
        NoHeading,
        BallastFeedback,
        PumpStuck,
        MassStuck,
        FinStuck,
        Reset,
        LinkLost,
        BadMission,
        Internal,
        Operator,
        Overrun,
        Degraded,
        Bottom,
    ]
};

/// Number → name of the abort causes.
fn aborts() -> Value {
    Value::Object(ABORTS.iter().map(|a| ((*a as u8).to_string(), json!(format!("{a:?}")))).collect())
}

//! From a cycle of the closed loop to a row of the log.

use super::frames::{Entry, Start};
use super::log::{Measured, SegmentStart, Truth, Writer};
use crate::flight::closed_loop::Setup;
use crate::flight::cycle::Cycle;
use crate::flight::{mission_file, worlds};
use anyhow::anyhow;
use plant::World;
use plant::ocean::GRAVITY_M_S2;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, Normal};
use serde_json::{Value, json};
use std::path::Path;

/// Writes a closed-loop flight.
pub struct Recorder {
    writer: Writer,
    depth_to_pa: f64,
    rng: ChaCha8Rng,
    gps: Normal<f64>,
    origin: Option<(f64, f64)>,
    resets: u32,
}

impl Recorder {
    /// Starts the log of a flight.
    ///
    /// # Errors
    /// There is a flight already, or the directory cannot be written.
    pub fn create(directory: &Path, world: &World, setup: &Setup) -> anyhow::Result<Self> {
        let case = directory.file_name().map_or_else(|| "flight".to_owned(), |n| n.to_string_lossy().into_owned());
        let mut writer = Writer::create(directory, worlds::nominal(world, &case)?, &mission_file::write(&setup.mission))?;
        let (settings, mission) = (*setup.config.settings(), setup.mission.clone());
        writer.note(&Entry::Start(Start { settings, mission, table: setup.table.clone().unwrap_or_default() }))?;
        let s = world.scenario();
        Ok(Self {
            writer,
            // The frame's depth is pressure over this; its inverse gives the pressure that was measured.
            depth_to_pa: world.depth_density_kg_m3() * GRAVITY_M_S2,
            rng: ChaCha8Rng::seed_from_u64(s.seed ^ 0x9b5),
            gps: Normal::new(0.0, worlds::GPS_NOISE_M)?,
            origin: None,
            resets: 0,
        })
    }

    /// Writes one cycle.
    ///
    /// # Errors
    /// Disk full or gone.
    pub fn push(&mut self, cycle: &Cycle<'_>) -> anyhow::Result<()> {
        let (f, t) = (cycle.frame, cycle.truth);
        if cycle.resets != self.resets {
            self.resets = cycle.resets;
            self.writer.note(&Entry::Reset)?;
        }
        // Positions count from the launch point: of the segment, or of the first of those without a surfacing between them.
        if self.writer.new_segment(cycle.answer) == Some(SegmentStart::Surface) {
            self.origin = None;
        }
        let origin = *self.origin.get_or_insert((t.east_m, t.north_m));
        let (mut east, mut north) = (f64::NAN, f64::NAN);
        if f.surface.gps_fix {
            east = t.east_m - origin.0 + self.gps.sample(&mut self.rng);
            north = t.north_m - origin.1 + self.gps.sample(&mut self.rng);
        }
        let measured = Measured { gps_east_m: east, gps_north_m: north, ..Measured::of(cycle.time_s, f, self.depth_to_pa) };
        let truth = Truth {
            depth_m: t.depth_m,
            east_m: t.east_m,
            north_m: t.north_m,
            pitch_rad: t.pitch_rad,
            alpha_rad: t.alpha_rad,
            speed_m_s: t.speed_m_s,
            glide_angle_rad: t.glide_angle_rad,
            ballast_m3: t.ballast_m3,
            battery_mass_m: t.battery_mass_m,
            energy_j: t.energy.total_j(),
        };
        self.writer.push(&measured, f, cycle.answer, &truth)
    }

    /// Closes the log of a flight that `error` cut short, and says so with the error and in the vehicle file.
    #[must_use]
    pub fn cut_short(self, error: anyhow::Error) -> anyhow::Error {
        let (rows, folder) = (self.writer.rows(), self.writer.directory().display().to_string());
        match self.writer.finish(json!({ "end": format!("cut short: {error:#}") })) {
            Ok(_) => anyhow!("{error:#}; the {rows} cycles flown so far are kept in {folder}"),
            Err(unwritten) => anyhow!("{error:#}; {unwritten:#}"),
        }
    }

    /// Closes the log with the flight's summary.
    ///
    /// # Errors
    /// Disk full or gone.
    pub fn finish(self, summary: Value) -> anyhow::Result<()> {
        self.writer.finish(summary).map(drop)
    }
}

//! What the law is shown when no frame comes: the last one, grown old.
//!
//! The board waits for its host up to [`PATIENCE_MS`] without a step, so that
//! a stalled host changes nothing. After that it steps by itself once per
//! control cycle, with every reading aged by the silence and the antenna
//! quiet, and tells the law that the line is lost.

use signals::{Micros, Reading, SensorFrame, Surface};

/// Longest silence of the line without a step, ms (15 cycles of 4 s, guess:
/// a laptop's stall of 2 s was measured, a dead host is not alive after 60 s).
pub const PATIENCE_MS: u64 = 60_000;

/// `frame` as it looks `silence` later.
#[must_use]
pub fn aged(frame: &SensorFrame, silence: Micros) -> SensorFrame {
    let ms = u32::try_from(silence.0 / 1000).unwrap_or(u32::MAX);
    let old = |reading: Reading| match reading {
        Reading::Sampled { value, age_ms } => Reading::Sampled { value, age_ms: age_ms.saturating_add(ms) },
        Reading::Missing => Reading::Missing,
    };
    SensorFrame {
        seq: frame.seq,
        time: frame.time.plus(silence),
        depth_m: old(frame.depth_m),
        depth2_m: old(frame.depth2_m),
        pitch_rad: old(frame.pitch_rad),
        roll_rad: old(frame.roll_rad),
        heading_rad: old(frame.heading_rad),
        ballast_m3: old(frame.ballast_m3),
        battery_mass_m: old(frame.battery_mass_m),
        fin_rad: old(frame.fin_rad),
        density_kg_m3: old(frame.density_kg_m3),
        temperature_degc: old(frame.temperature_degc),
        altitude_m: old(frame.altitude_m),
        battery_v: old(frame.battery_v),
        charge: old(frame.charge),
        vacuum_pa: old(frame.vacuum_pa),
        leak: frame.leak,
        weight: frame.weight,
        surface: Surface::default(),
    }
}

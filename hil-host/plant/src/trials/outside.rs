//! Effects outside the vocabulary: what a tool must admit that it has no name for.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde_json::json;

use super::catalogue::size_of_stall;
use super::hidden::Hidden;
use super::nature::{Nature, Stall};
use super::vehicle::normal_within_2_sigma;
use super::{Site, Wing};

/// How far below the angle of stall flow reattaches, rad: five degrees, as the widest loops of sections at chord Reynolds numbers of
/// 1e5 (Mueller, J. Aircraft 22(9), 1985). Half of it leaves nothing beside a plain stall at these noises: 1 of 8 flights told it.
const LATE_RAD: f64 = 0.09;

/// An effect outside the vocabulary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Outside {
    /// Hull temperature lags the water.
    HullThermalLag,
    /// Water in free-flooding spaces is exchanged slowly.
    FloodedVolumeLag,
    /// Air in the hull's free-flooding spaces.
    TrappedAir,
    /// The engine's volume lags its reading.
    BallastLag,
    /// Thermal lag of the conductivity cell.
    CellThermalLag,
    /// Stall that reattaches late.
    HystereticStall,
    /// Lift and drag differ between port and starboard turns.
    RollBias,
    /// Pitch error by heading.
    PitchByHeading,
    /// Pitch error by depth.
    PitchByDepth,
    /// Trim differs between segments without reason.
    UnrepeatableTrim,
    /// Water taken in during each segment.
    Leak,
    /// Drag that depends on heading.
    DragByHeading,
    /// Something caught half way through the flight.
    LineCaught,
    /// Displaced volume that comes and goes within a minute or two.
    Breathing,
}

impl Outside {
    /// Those that a plan deals. The others are asked for by name, so that cases of a seed stay what they were.
    pub const DEALT: [Self; 11] = [
        Self::HullThermalLag,
        Self::FloodedVolumeLag,
        Self::TrappedAir,
        Self::BallastLag,
        Self::CellThermalLag,
        Self::HystereticStall,
        Self::RollBias,
        Self::PitchByHeading,
        Self::PitchByDepth,
        Self::UnrepeatableTrim,
        Self::Leak,
    ];

    /// Adds it; `scale` relative to medium.
    pub fn apply(self, scale: f64, site: Site, wing: Wing, nature: &mut Nature, rng: &mut ChaCha8Rng) -> Hidden {
        let lake = site == Site::Lake;
        let size = scale * rng.random_range(0.85..1.18);
        let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let off = &mut nature.off;
        let (name, parameter, value, form) = match self {
            Self::HullThermalLag => {
                off.hull_thermal_lag_s = if lake { rng.random_range(120.0..400.0) } else { rng.random_range(300.0..900.0) };
                off.hull_thermal_gain = 1.2 * size;
                ("hull_thermal_lag", "gain", off.hull_thermal_gain, json!({ "lag_s": off.hull_thermal_lag_s }))
            }
            Self::FloodedVolumeLag => {
                off.flood_lag_s = if lake { rng.random_range(60.0..240.0) } else { rng.random_range(200.0..600.0) };
                off.flood_volume_m3 = if lake { 0.030 } else { 0.015 } * size;
                ("flooded_volume_lag", "volume_m3", off.flood_volume_m3, json!({ "lag_s": off.flood_lag_s }))
            }
            Self::TrappedAir => {
                off.trapped_air_m3 = if lake { 70e-6 } else { 100e-6 } * size;
                ("trapped_air", "volume_m3", off.trapped_air_m3, json!({}))
            }
            Self::BallastLag => {
                off.ballast_lag_s = if lake { 5.0 } else { 14.0 } * size;
                ("ballast_lag", "lag_s", off.ballast_lag_s, json!({}))
            }
            Self::CellThermalLag => {
                off.cell_lag_s = rng.random_range(20.0..70.0);
                off.cell_gain = if lake { 0.14 } else { 0.2 } * size * sign;
                ("cell_thermal_lag", "kg_m3_per_k", off.cell_gain, json!({ "lag_s": off.cell_lag_s }))
            }
            Self::HystereticStall => {
                let angle = size_of_stall(site, wing, 0.8) * rng.random_range(0.95..1.05);
                let loss = (0.3 * size).min(0.6);
                nature.stall = Some(Stall { angle, loss, width: 0.006, hysteresis: LATE_RAD });
                ("hysteretic_stall", "loss", loss, json!({ "angle_rad": angle, "hysteresis_rad": LATE_RAD }))
            }
            Self::RollBias => {
                off.roll_bias = (0.22 * size).min(0.8) * sign;
                ("roll_biased_drag", "rel", off.roll_bias, json!({}))
            }
            Self::PitchByHeading => {
                off.pitch_by_heading = 0.02 * size * sign;
                ("pitch_error_by_heading", "amplitude_rad", off.pitch_by_heading, json!({}))
            }
            Self::PitchByDepth => {
                off.pitch_by_depth = if lake { 0.16 } else { 0.038 } * size * sign;
                ("pitch_error_by_depth", "rad_per_mpa", off.pitch_by_depth, json!({}))
            }
            Self::UnrepeatableTrim => {
                let width = if lake { 20e-6 } else { 9e-6 } * size;
                off.segment_trim = core::array::from_fn(|_| width * normal_within_2_sigma(rng));
                ("unrepeatable_trim", "rms_m3", width, json!({ "per_segment_m3": off.segment_trim }))
            }
            Self::Leak => {
                off.leak = if lake { 45e-6 / 800.0 } else { 32e-6 / 3000.0 } * size;
                ("leak", "m3_per_s", off.leak, json!({}))
            }
            Self::DragByHeading => {
                off.drag_by_heading = 0.08 * size * sign;
                ("drag_by_heading", "rel", off.drag_by_heading, json!({}))
            }
            Self::LineCaught => {
                off.caught = (rng.random_range(3..6), 0.15 * size);
                ("line_caught", "rel", off.caught.1, json!({ "segment": off.caught.0 }))
            }
            Self::Breathing => {
                off.breathing = (5e-6 * size, rng.random_range(65.0..140.0));
                ("breathing", "volume_m3", off.breathing.0, json!({ "period_s": off.breathing.1 }))
            }
        };
        Hidden { name, parameter, value, form }
    }
}

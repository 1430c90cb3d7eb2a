//! The hidden truths: the 24 names of the format's vocabulary and ten effects outside it, with sizes.
//!
//! Size "medium" is a table per site and wing ([`medium`]), set so that the block
//! error after refitting the calibration quantities inside their tolerances is
//! about three times the noise floor where the effect can reach that with a
//! physically possible parameter; weak is 0.4 and strong 2.1 times medium (about
//! 1.2 to 1.6 and 5 to 7 times the floor), 0.6 and 1.6 for effects that the
//! calibration quantities imitate. Measured with [`super::reference`] over three
//! cases per cell; per-cell medians lie between 1.1 (side edges of the standard
//! wing, sea inertia: hardly visible at any possible size) and 4.3.
//! Deviations of calibrated quantities are never below 3.5 sigma. Effects that do
//! not show in depth rate (pressure drift, horizontal current) or only in
//! turns (added masses) have sizes by the channel that shows them.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::nature::{Fouling, Nature, NormalForce, ReynoldsDrag, Stall};
use super::ocean::{InternalWave, Ocean};
use super::vehicle::{Scatter, TOLERANCE, normal_within_2_sigma};
use super::{Site, Wing};

/// How large a hidden effect is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Strength {
    /// About 1.5 times the noise floor.
    Weak,
    /// About 3 times.
    Medium,
    /// About 6 times.
    Strong,
}

impl Strength {
    /// All, weakest first.
    pub const ALL: [Self; 3] = [Self::Weak, Self::Medium, Self::Strong];

    /// Name in the truth file.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Weak => "weak",
            Self::Medium => "medium",
            Self::Strong => "strong",
        }
    }

    /// Size relative to medium of an effect that shows directly in depth rate.
    #[must_use]
    pub fn factor(self) -> f64 {
        match self {
            Self::Weak => 0.4,
            Self::Medium => 1.0,
            Self::Strong => 2.1,
        }
    }

    /// The same for effects that calibration scatter can imitate: what is left after recalibration grows faster than in
    /// proportion, because the tolerances run out.
    #[must_use]
    pub fn factor_imitated(self) -> f64 {
        match self {
            Self::Weak => 0.6,
            Self::Medium => 1.0,
            Self::Strong => 1.6,
        }
    }
}

/// An effect of the vocabulary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)] // The names are those of the format, explained there.
pub enum Effect {
    VortexLiftBodywing,
    SideEdgeLift,
    ReynoldsDrag,
    Stall,
    HullCompressibility,
    ThermalExpansion,
    BiofoulingDrag,
    PitchOffset,
    BallastOffset,
    BallastScale,
    InternalWave,
    VerticalCurrent,
    RollTurnDrag,
    ClimbDrag,
    AddedMass,
    HeaveAddedMass,
    DragLevelError,
    LiftSlopeError,
    InducedDragError,
    ZeroLiftAngle,
    DensityBias,
    PressureDrift,
    PitchScale,
    HorizontalCurrent,
}

impl Effect {
    /// All names.
    pub const ALL: [Self; 24] = [
        Self::VortexLiftBodywing,
        Self::SideEdgeLift,
        Self::ReynoldsDrag,
        Self::Stall,
        Self::HullCompressibility,
        Self::ThermalExpansion,
        Self::BiofoulingDrag,
        Self::PitchOffset,
        Self::BallastOffset,
        Self::BallastScale,
        Self::InternalWave,
        Self::VerticalCurrent,
        Self::RollTurnDrag,
        Self::ClimbDrag,
        Self::AddedMass,
        Self::HeaveAddedMass,
        Self::DragLevelError,
        Self::LiftSlopeError,
        Self::InducedDragError,
        Self::ZeroLiftAngle,
        Self::DensityBias,
        Self::PressureDrift,
        Self::PitchScale,
        Self::HorizontalCurrent,
    ];

    /// Name and parameter of the vocabulary.
    #[must_use]
    pub fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::VortexLiftBodywing => ("vortex_lift_bodywing", "k"),
            Self::SideEdgeLift => ("side_edge_lift", "k"),
            Self::ReynoldsDrag => ("reynolds_drag", "exponent"),
            Self::Stall => ("stall", "alpha_stall_rad"),
            Self::HullCompressibility => ("hull_compressibility", "rel_error"),
            Self::ThermalExpansion => ("thermal_expansion", "rel_error"),
            Self::BiofoulingDrag => ("biofouling_drag", "rate_per_day"),
            Self::PitchOffset => ("pitch_offset", "offset_rad"),
            Self::BallastOffset => ("ballast_offset", "volume_cc"),
            Self::BallastScale => ("ballast_scale", "gain_error"),
            Self::InternalWave => ("internal_wave", "amplitude_m_s"),
            Self::VerticalCurrent => ("vertical_current", "velocity_m_s"),
            Self::RollTurnDrag => ("roll_turn_drag", "k"),
            Self::ClimbDrag => ("climb_drag", "rel_increase"),
            Self::AddedMass => ("added_mass", "delta_k1"),
            Self::HeaveAddedMass => ("heave_added_mass", "delta_k2"),
            Self::DragLevelError => ("drag_level_error", "rel_error"),
            Self::LiftSlopeError => ("lift_slope_error", "rel_error"),
            Self::InducedDragError => ("induced_drag_error", "rel_error"),
            Self::ZeroLiftAngle => ("zero_lift_angle", "angle_rad"),
            Self::DensityBias => ("density_bias", "bias_kg_m3"),
            Self::PressureDrift => ("pressure_drift", "rate_dbar_per_day"),
            Self::PitchScale => ("pitch_scale", "gain_error"),
            Self::HorizontalCurrent => ("horizontal_current", "speed_m_s"),
        }
    }

    /// Size relative to medium for a strength.
    #[must_use]
    pub fn factor(self, strength: Strength) -> f64 {
        match self {
            Self::HullCompressibility
            | Self::ThermalExpansion
            | Self::ReynoldsDrag
            | Self::PitchOffset
            | Self::BallastOffset
            | Self::BallastScale
            | Self::VerticalCurrent
            | Self::ClimbDrag
            | Self::DragLevelError
            | Self::ZeroLiftAngle
            | Self::DensityBias
            | Self::PitchScale => strength.factor_imitated(),
            _ => strength.factor(),
        }
    }

    /// Where the effect can be told at all with a possible parameter (measured: elsewhere less than a tenth of the floor): a
    /// horizontal current is expected at sea, the hull is hardly squeezed in a lake, the high-aspect-ratio wing stays below the
    /// onset of body–wing vortices, and heave inertia shows only in the lake's many turns at large angle of attack.
    #[must_use]
    pub fn makes_sense(self, site: Site, wing: Wing) -> bool {
        match self {
            Self::HorizontalCurrent => site == Site::Lake,
            Self::HullCompressibility => site == Site::Sea,
            Self::VortexLiftBodywing => wing == Wing::LowAspectRatio,
            Self::HeaveAddedMass => site == Site::Lake && wing == Wing::LowAspectRatio,
            _ => true,
        }
    }
}

/// Medium size in the parameter's unit and the largest physically possible size.
///
/// Columns: lake standard, lake low aspect ratio, sea standard, sea low aspect ratio.
#[must_use]
pub fn medium(effect: Effect, site: Site, wing: Wing) -> (f64, f64) {
    use Effect as E;
    let (sizes, cap) = match effect {
        E::VortexLiftBodywing => ([40.0, 16.0, 40.0, 18.0], 40.0),
        E::SideEdgeLift => ([12.0, 7.0, 12.0, 7.0], 20.0),
        E::ReynoldsDrag => ([0.4, 0.4, 0.28, 0.25], 0.9),
        E::Stall => ([0.085, 0.17, 0.065, 0.15], 1.0),
        E::HullCompressibility => ([0.6, 0.6, 0.6, 0.55], 0.9),
        E::ThermalExpansion => ([1.2, 1.2, 1.2, 1.2], 2.5),
        E::BiofoulingDrag => ([0.021, 0.020, 0.020, 0.019], 0.08),
        E::PitchOffset => ([0.035, 0.035, 0.045, 0.045], 0.09),
        E::BallastOffset => ([26.0, 20.0, 24.0, 21.0], 70.0),
        E::BallastScale => ([0.17, 0.15, 0.16, 0.16], 0.35),
        E::InternalWave => ([0.018, 0.018, 0.016, 0.016], 0.04),
        E::VerticalCurrent => ([0.014, 0.014, 0.018, 0.018], 0.04),
        E::RollTurnDrag => ([0.85, 0.75, 0.95, 0.85], 3.0),
        E::ClimbDrag => ([0.27, 0.25, 0.28, 0.27], 0.8),
        E::AddedMass => ([0.6, 0.6, 0.8, 0.8], 1.4),
        E::HeaveAddedMass => ([1.5, 1.2, 1.5, 1.5], 2.5),
        E::DragLevelError => ([0.18, 0.18, 0.16, 0.16], 0.8),
        E::LiftSlopeError => ([0.4, 0.5, 0.5, 0.55], 0.8),
        E::InducedDragError => ([2.0, 1.4, 2.0, 1.2], 4.0),
        E::ZeroLiftAngle => ([0.035, 0.035, 0.045, 0.045], 0.08),
        E::DensityBias => ([0.38, 0.32, 0.45, 0.42], 1.2),
        E::PressureDrift => ([0.5, 0.5, 0.5, 0.5], 2.0),
        E::PitchScale => ([0.07, 0.08, 0.07, 0.07], 0.25),
        E::HorizontalCurrent => ([0.05, 0.05, 0.05, 0.05], 0.2),
    };
    let column = match (site, wing) {
        (Site::Lake, Wing::Standard) => 0,
        (Site::Lake, Wing::LowAspectRatio) => 1,
        (Site::Sea, Wing::Standard) => 2,
        (Site::Sea, Wing::LowAspectRatio) => 3,
    };
    (sizes[column], cap)
}

/// One hidden effect as applied.
#[derive(Clone, Debug)]
pub struct Hidden {
    /// Vocabulary or off-catalogue name.
    pub name: &'static str,
    /// Parameter's name.
    pub parameter: &'static str,
    /// Value.
    pub value: f64,
    /// Details of nature's form.
    pub form: Value,
}

/// Adds a catalogue effect. `scale` is the size relative to medium; `days` the duration of the trial.
pub fn apply(
    effect: Effect,
    scale: f64,
    site: Site,
    wing: Wing,
    days: f64,
    scatter: &Scatter,
    nature: &mut Nature,
    ocean: &mut Ocean,
    rng: &mut ChaCha8Rng,
) -> Hidden {
    use Effect as E;
    let (size, cap) = medium(effect, site, wing);
    let size = (size * scale * rng.random_range(0.85..1.18)).min(cap);
    let signed = if rng.random_bool(0.5) { size } else { -size };
    // Deviations of calibrated quantities replace the scatter drawn for them.
    let at_least = |x: f64, index: usize| {
        let least = 3.5 * TOLERANCE[index].1;
        if x.abs() < least { least.copysign(x) } else { x }
    };
    let mut form = json!({});
    let value = match effect {
        E::VortexLiftBodywing => {
            let (onset, power, width) = (rng.random_range(0.07..0.12), rng.random_range(1.6..2.3), rng.random_range(0.004..0.012));
            nature.vortex = Some(NormalForce { k: size, onset, power, width });
            form = json!({ "onset_rad": onset, "power": power, "width_rad": width });
            size
        }
        E::SideEdgeLift => {
            let power = rng.random_range(1.85..2.15);
            nature.side_edge = Some(NormalForce { k: size, onset: 0.0, power, width: 0.0 });
            form = json!({ "power": power });
            size
        }
        E::ReynoldsDrag => {
            let reference_speed = rng.random_range(0.27..0.33);
            let viscous = rng.random_bool(0.4);
            nature.reynolds = Some(ReynoldsDrag { exponent: size, reference_speed, viscous });
            form = json!({ "reference_speed_m_s": reference_speed, "viscous": viscous });
            size
        }
        E::Stall => {
            // A lower angle is a stronger stall.
            let angle = (size_of_stall(site, wing, scale) * rng.random_range(0.95..1.05)).max(0.03);
            let (loss, width) = (rng.random_range(0.42..0.58), rng.random_range(0.006..0.02));
            nature.stall = Some(Stall { angle, loss, width, hysteresis: 0.0 });
            form = json!({ "loss": loss, "width_rad": width });
            angle
        }
        E::HullCompressibility => {
            let v = at_least(signed, 6);
            nature.compressibility *= (1.0 + v) / (1.0 + scatter.values[6]);
            nature.compressibility_slope = rng.random_range(-0.04..0.04);
            form = json!({ "slope_per_mpa": nature.compressibility_slope });
            v
        }
        E::ThermalExpansion => {
            let v = at_least(if size > 0.9 { size } else { signed }, 7);
            nature.thermal_expansion *= (1.0 + v) / (1.0 + scatter.values[7]);
            nature.thermal_slope = rng.random_range(-0.01..0.02);
            form = json!({ "slope_per_k": nature.thermal_slope });
            v
        }
        E::BiofoulingDrag => {
            let power = rng.random_range(0.85..1.25);
            nature.fouling = Some(Fouling { rate_per_day: size, power, duration_day: days });
            form = json!({ "power": power, "duration_day": days });
            size
        }
        E::PitchOffset => {
            let v = at_least(signed, 5);
            nature.pitch_zero = v;
            v
        }
        E::BallastOffset => {
            let v = at_least(signed, 3);
            nature.volume += (v - scatter.values[3]) * 1e-6;
            v
        }
        E::BallastScale => {
            let v = at_least(signed, 4);
            nature.ballast_gain = v;
            v
        }
        E::InternalWave => {
            let wave = InternalWave::draw(size, rng);
            form = json!({ "period_s": wave.period, "mode": wave.mode, "second_harmonic": wave.harmonic, "phase_rad": wave.phase });
            ocean.wave = Some(wave);
            size
        }
        E::VerticalCurrent => {
            ocean.upwelling = [signed, rng.random_range(0.75..1.35)];
            form = json!({ "skew": ocean.upwelling[1] });
            signed
        }
        E::RollTurnDrag => {
            nature.roll_drag = [size, rng.random_range(1.7..2.3)];
            form = json!({ "power": nature.roll_drag[1] });
            size
        }
        E::ClimbDrag => {
            let v = if rng.random_bool(0.3) { -size.min(0.5) } else { size };
            nature.climb_drag = v;
            v
        }
        E::AddedMass => {
            let v = at_least(size, 8);
            nature.added_mass[0] += v - scatter.values[8];
            v
        }
        E::HeaveAddedMass => {
            let v = at_least(size, 9);
            nature.added_mass[1] += v - scatter.values[9];
            v
        }
        E::DragLevelError => {
            let v = at_least(if signed < 0.0 { signed.max(-0.6) } else { signed }, 0);
            nature.cd0 *= (1.0 + v) / (1.0 + scatter.values[0]);
            v
        }
        E::LiftSlopeError => {
            let v = at_least(if signed < 0.0 { signed.max(-0.6) } else { signed }, 1);
            nature.lift_slope *= (1.0 + v) / (1.0 + scatter.values[1]);
            v
        }
        E::InducedDragError => {
            let v = if rng.random_bool(0.25) { -size.min(0.7) } else { size };
            let lift_part = rng.random_bool(0.5);
            if lift_part {
                nature.induced_k *= 1.0 + v;
            } else {
                nature.hull_drag *= 1.0 + v;
            }
            form = json!({ "of": if lift_part { "induced_k" } else { "hull_drag_per_rad2" } });
            v
        }
        E::ZeroLiftAngle => {
            nature.zero_lift = signed;
            nature.zero_lift_hull = rng.random_range(0.0..1.0);
            form = json!({ "hull_share": nature.zero_lift_hull });
            signed
        }
        E::DensityBias => {
            nature.density_bias = signed;
            signed
        }
        E::PressureDrift => {
            // `size` is the drift over the whole trial, dbar.
            nature.pressure_drift = signed / days;
            nature.pressure_drift
        }
        E::PitchScale => {
            nature.pitch_scale = signed;
            signed
        }
        E::HorizontalCurrent => {
            let toward = rng.random_range(0.0..core::f64::consts::TAU);
            ocean.current = [[size * libm::sin(toward), size * libm::cos(toward)]; super::SEGMENTS];
            ocean.current_profile = [rng.random_range(8.0..30.0), rng.random_range(0.6..1.0)];
            form = json!({ "toward_rad": toward, "barotropic_share": ocean.current_profile[1] });
            size
        }
    };
    let (name, parameter) = effect.names();
    Hidden { name, parameter, value, form }
}

/// Stall angle, rad, by scale relative to medium: a third of the way from never (the largest angle flown) per unit.
fn size_of_stall(site: Site, wing: Wing, scale: f64) -> f64 {
    let never = match wing {
        Wing::Standard => 0.135,
        Wing::LowAspectRatio => 0.27,
    };
    let (medium, _) = medium(Effect::Stall, site, wing);
    never - (never - medium) * libm::sqrt(scale)
}

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

//! The 24 effects of the format's vocabulary by name, with sizes.
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

use super::{Site, Wing};

/// How large a hidden effect is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
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

/// Effects of which nature's form has other onsets and powers than the vocabulary's: their parameter is not the same number, and an
/// interval of it cannot be judged.
pub const OF_ANOTHER_FORM: [&str; 4] = ["vortex_lift_bodywing", "stall", "internal_wave", "vertical_current"];

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

/// Stall angle, rad, by scale relative to medium: a third of the way from never (the largest angle flown) per unit.
pub(super) fn size_of_stall(site: Site, wing: Wing, scale: f64) -> f64 {
    let never = match wing {
        Wing::Standard => 0.135,
        Wing::LowAspectRatio => 0.27,
    };
    let (medium, _) = medium(Effect::Stall, site, wing);
    never - (never - medium) * libm::sqrt(scale)
}

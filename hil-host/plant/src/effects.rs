//! What does the true vehicle or sea do that a nominal model lacks?
//!
//! Each effect is one kind with one main size (unit and meaning by kind) and,
//! for some, a second number. Names are those of the flight format; the forms
//! are the plant's own and need not be those a model assumes. The last group
//! is off the catalogue: nothing a model may search for by name.

use serde::{Deserialize, Serialize};

/// A hidden truth: what, and how large.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Effect {
    /// Which effect.
    pub kind: EffectKind,
    /// Its size, unit by kind ([`EffectKind::parameter`]).
    pub value: f64,
    /// Second number, meaning by kind ([`EffectKind::second`]); none: the default given there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aux: Option<f64>,
}

macro_rules! effects {
    ($($(#[$doc:meta])* $variant:ident = $name:literal, $parameter:literal, $unit:literal, $typical:literal, $second:literal;)*) => {
        /// Kinds of effects.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        #[non_exhaustive]
        pub enum EffectKind { $($(#[$doc])* $variant,)* }

        impl EffectKind {
            /// Every kind there is.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];
            /// Name, as in files and on the command line.
            #[must_use]
            pub const fn name(self) -> &'static str { match self { $(Self::$variant => $name,)* } }
            /// Name and unit of the size.
            #[must_use]
            pub const fn parameter(self) -> (&'static str, &'static str) { match self { $(Self::$variant => ($parameter, $unit),)* } }
            /// A medium size: large enough to matter in a flight of hours, small enough to be believed.
            #[must_use]
            pub const fn typical(self) -> f64 { match self { $(Self::$variant => $typical,)* } }
            /// Meaning, unit and default of the second number; empty when there is none.
            #[must_use]
            pub const fn second(self) -> &'static str { match self { $(Self::$variant => $second,)* } }
        }
    };
}

effects! {
    /// Vortex normal force of hull and wing beyond an onset angle.
    VortexLiftBodywing = "vortex_lift_bodywing", "k", "1/rad2", 40.0, "onset angle, rad, 0.1";
    /// Normal force of the wing's side edges from zero angle.
    SideEdgeLift = "side_edge_lift", "k", "1/rad2", 4.0, "";
    /// Axial drag ∝ (V/0.30 m/s)^-n.
    ReynoldsDrag = "reynolds_drag", "exponent", "-", 0.5, "";
    /// Half of the normal-force slope is lost beyond an angle.
    Stall = "stall", "alpha_stall_rad", "rad", 0.08, "";
    /// Compressibility wrong by a factor.
    HullCompressibility = "hull_compressibility", "rel_error", "-", 0.5, "";
    /// Thermal expansion wrong by a factor.
    ThermalExpansion = "thermal_expansion", "rel_error", "-", 1.0, "";
    /// Axial drag grows with time in the water.
    BiofoulingDrag = "biofouling_drag", "rate_per_day", "1/day", 0.03, "";
    /// Pitch sensor misaligned: measured = true + offset.
    PitchOffset = "pitch_offset", "offset_rad", "rad", 0.02, "";
    /// Constant extra displaced volume.
    BallastOffset = "ballast_offset", "volume_cc", "cm3", 25.0, "";
    /// True ballast = reading × (1 + gain).
    BallastScale = "ballast_scale", "gain_error", "-", 0.06, "";
    /// Standing internal wave of the lowest vertical mode.
    InternalWave = "internal_wave", "amplitude_m_s", "m/s", 0.015, "period, s, 1800";
    /// Steady vertical water motion, up positive, zero at surface and bottom.
    VerticalCurrent = "vertical_current", "velocity_m_s", "m/s", 0.01, "";
    /// Axial drag ∝ roll².
    RollTurnDrag = "roll_turn_drag", "k", "1/rad2", 1.5, "";
    /// Axial drag larger when climbing.
    ClimbDrag = "climb_drag", "rel_increase", "-", 0.2, "";
    /// More added mass in surge, as a share of the mass.
    AddedMass = "added_mass", "delta_k1", "-", 0.4, "";
    /// More added mass in heave, as a share of the mass.
    HeaveAddedMass = "heave_added_mass", "delta_k2", "-", 0.8, "";
    /// Axial drag wrong by a factor.
    DragLevelError = "drag_level_error", "rel_error", "-", 0.2, "";
    /// Linear lift wrong by a factor.
    LiftSlopeError = "lift_slope_error", "rel_error", "-", -0.2, "";
    /// Drag due to lift wrong by a factor.
    InducedDragError = "induced_drag_error", "rel_error", "-", 0.4, "";
    /// Lift is zero at a non-zero angle.
    ZeroLiftAngle = "zero_lift_angle", "angle_rad", "rad", 0.015, "";
    /// CTD density reads high by a constant.
    DensityBias = "density_bias", "bias_kg_m3", "kg/m3", 0.3, "";
    /// Pressure reading drifts.
    PressureDrift = "pressure_drift", "rate_dbar_per_day", "dbar/day", 0.5, "";
    /// Pitch reading = true × (1 + gain).
    PitchScale = "pitch_scale", "gain_error", "-", 0.1, "";
    /// Steady horizontal current.
    HorizontalCurrent = "horizontal_current", "speed_m_s", "m/s", 0.15, "direction it flows to, rad from north, 0";
    /// Off catalogue: flooded parts keep old water.
    FloodedVolumeLag = "flooded_volume_lag", "volume_m3", "m3", 0.010, "exchange time, s, 60";
    /// Off catalogue: an air bubble that pressure compresses.
    TrappedAir = "trapped_air", "volume_cc", "cm3", 30.0, "";
    /// Off catalogue: the water in the pump line lags the piston that is read.
    PumpLag = "pump_lag", "time_s", "s", 12.0, "";
    /// Off catalogue: the hull takes the water's temperature slowly.
    HullThermalLag = "hull_thermal_lag", "time_s", "s", 600.0, "";
    /// Off catalogue: wings bend with load, slope / (1 + k V²).
    WingBend = "wing_bend", "per_speed2", "s2/m2", 3.0, "";
    /// Off catalogue: shear of the horizontal current.
    HorizontalShear = "horizontal_shear", "surface_speed_m_s", "m/s", 0.3, "depth at which it is down to 1/e, m, 15";
    /// Off catalogue: something hangs on the vehicle for part of the time (kelp), axial area × (1 + v).
    SnaggedKelp = "snagged_kelp", "rel_increase", "-", 0.6, "period with and without, s, 5400";
    /// Off catalogue: slow leak into a flooded part, mass grows.
    SlowLeak = "slow_leak", "rate_g_per_h", "g/h", 10.0, "";
}

impl EffectKind {
    /// Whether a model may look for it by name.
    #[must_use]
    pub fn is_catalogued(self) -> bool {
        !matches!(
            self,
            Self::FloodedVolumeLag
                | Self::TrappedAir
                | Self::PumpLag
                | Self::HullThermalLag
                | Self::WingBend
                | Self::HorizontalShear
                | Self::SnaggedKelp
                | Self::SlowLeak
        )
    }

    /// Kind of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|k| k.name() == name)
    }
}

impl Effect {
    /// An effect of its medium size.
    #[must_use]
    pub const fn typical(kind: EffectKind) -> Self {
        Self { kind, value: kind.typical(), aux: None }
    }

    /// An effect of a given size.
    #[must_use]
    pub const fn sized(kind: EffectKind, value: f64) -> Self {
        Self { kind, value, aux: None }
    }

    /// Size of `kind` in a list; 0 when it is not there.
    pub(crate) fn sum(list: &[Self], kind: EffectKind) -> f64 {
        list.iter().filter(|e| e.kind == kind).map(|e| e.value).sum()
    }

    /// Second number of `kind` in a list.
    pub(crate) fn second(list: &[Self], kind: EffectKind, default: f64) -> f64 {
        list.iter().find(|e| e.kind == kind).and_then(|e| e.aux).unwrap_or(default)
    }
}

impl std::str::FromStr for Effect {
    type Err = String;

    /// `name`, `name=value` or `name=value,second`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, sizes) = text.split_once('=').map_or((text, None), |(n, s)| (n, Some(s)));
        let kind = EffectKind::from_name(name.trim()).ok_or_else(|| {
            let names: Vec<_> = EffectKind::ALL.iter().map(|k| k.name()).collect();
            format!("no effect is called '{}'; there are {}", name.trim(), names.join(", "))
        })?;
        let number = |s: &str| {
            s.trim()
                .parse::<f64>()
                .ok()
                .filter(|v| v.is_finite())
                .ok_or_else(|| format!("'{}' is not a finite number in '{text}'", s.trim()))
        };
        let Some(sizes) = sizes else { return Ok(Self::typical(kind)) };
        let (value, aux) = match sizes.split_once(',') {
            Some((v, a)) => (number(v)?, Some(number(a)?)),
            None => (number(sizes)?, None),
        };
        Ok(Self { kind, value, aux })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_found_by_its_name_and_in_a_file() {
        for kind in EffectKind::ALL {
            assert_eq!(EffectKind::from_name(kind.name()), Some(*kind));
            assert_eq!(kind.name().parse::<Effect>(), Ok(Effect::typical(*kind)));
            let text = toml::to_string(&Effect::typical(*kind)).unwrap();
            assert!(text.contains(&format!("kind = \"{}\"", kind.name())), "{text}");
        }
        assert_eq!(
            "internal_wave=0.02,900".parse::<Effect>(),
            Ok(Effect { kind: EffectKind::InternalWave, value: 0.02, aux: Some(900.0) })
        );
        assert!("internal_wav".parse::<Effect>().unwrap_err().contains("internal_wave"));
        assert!("stall=nan".parse::<Effect>().is_err());
    }
}

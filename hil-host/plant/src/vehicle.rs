//! What is the vehicle made of?
//!
//! Masses, volumes, arms and the areas of the force law of `forces.rs`,
//! for a Slocum-type glider with one of two wing sets.

use serde::{Deserialize, Serialize};
use signals::Wings;

/// Areas of the force law. Forces are `½ρ · area · velocity²`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aero {
    /// Reference area S of the effect sizes, m² (the at-sea fits' value).
    pub reference_area_m2: f64,
    /// Axial (friction and appendage) drag area, m².
    pub axial_m2: f64,
    /// Normal-force slope of hull and tail, m²/rad.
    pub hull_slope_m2: f64,
    /// Normal-force slope of the wings with their carry-over on the hull, m²/rad.
    pub wing_slope_m2: f64,
    /// Leading-edge suction regained by the wings, m²/rad² (0: the force is normal to the chord).
    pub suction_m2: f64,
    /// Extra axial drag of separated flow on the lee side, m²/rad².
    pub separation_m2: f64,
    /// Cross-flow drag area of the hull, η·C_dc·planform, m².
    pub hull_crossflow_m2: f64,
    /// Cross-flow (side-edge vortex) area of the wings, C_dc·S_w, m².
    pub wing_crossflow_m2: f64,
    /// sin of the angle at which half of the wing's loss of attached flow has happened.
    pub wing_stall_sin: f64,
    /// Share of the wing slope that is left far beyond the stall, 0..1.
    pub wing_stalled_share: f64,
    /// Net pitch moment slope (with the Munk moment), N m per (m/s)² per rad.
    pub moment_slope: f64,
    /// Pitch moment at zero angle, N m per (m/s)².
    pub moment_zero: f64,
    /// Pitch damping, N m per (m/s) per (rad/s).
    pub moment_rate: f64,
}

impl Aero {
    /// The wing sets as the plant believes they are.
    ///
    /// Hull: slope 0.31 m²/rad (at-sea fits of Slocums 0.30–0.38, tail
    /// included), cross-flow 0.65 × 1.1 × 0.32 m². Standard wings: 0.0880 m²,
    /// slope 3.30/rad (vortex lattice, A 5.536, sweep 45°), carry-over 1.386.
    /// Rail wings: 0.1202 m², slope 0.495/rad (vortex lattice, A 0.3155),
    /// carry-over 2.058; side edges 2.3 per wing area from the first angle (square
    /// plates: 2.3 above 15° at Re 1.4e5, 2.8 sharp-edged), without carry-over, which
    /// is potential theory; half separated at 48° (plates of A 0.33: 36° to 60°). Axial area and separation are
    /// fitted to the measured steady glide of *Comet* 2016 (U 0.307 m/s at
    /// −21.9° and −2.12 N); the standard wing regains a third of the ideal
    /// suction (guess: 6 % section at Re 2e4), the rail wing none.
    #[must_use]
    pub fn of(wings: Wings) -> Self {
        let standard = Self {
            reference_area_m2: 0.1,
            axial_m2: 0.0159,
            hull_slope_m2: 0.31,
            wing_slope_m2: 3.30 * 0.0880 * 1.386,
            suction_m2: 0.07,
            separation_m2: 0.40,
            hull_crossflow_m2: 0.65 * 1.1 * 0.32,
            wing_crossflow_m2: 1.2 * 0.0880,
            wing_stall_sin: 0.30,
            wing_stalled_share: 0.35,
            moment_slope: -20.0,
            moment_zero: 0.0,
            moment_rate: -20.0,
        };
        match wings {
            Wings::Standard => standard,
            Wings::LowAspectRatio => Self {
                wing_slope_m2: 0.495 * 0.1202 * 2.058,
                suction_m2: 0.0,
                wing_crossflow_m2: 2.3 * 0.1202,
                wing_stall_sin: 0.74,
                moment_slope: -10.0,
                ..standard
            },
        }
    }
}

/// Masses, volumes and arms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Vehicle {
    /// Mass in air with flooded fixed parts, kg. Slocum G1 52.
    pub mass_kg: f64,
    /// Water density for which the vehicle was ballasted, kg/m³; none: half way down to the rated or the water depth.
    pub ballasted_density_kg_m3: Option<f64>,
    /// Hull compressibility, 1/Pa. Slocum 5e-10.
    pub compressibility_per_pa: f64,
    /// Hull volume expansion, 1/K. Guess near Seaglider's 7e-5.
    pub thermal_expansion_per_k: f64,
    /// Temperature of the nominal hull volume, °C.
    pub reference_temperature_degc: f64,
    /// Added mass in surge, kg.
    pub added_mass_surge_kg: f64,
    /// Added mass in heave, kg.
    pub added_mass_heave_kg: f64,
    /// Pitch inertia with added inertia, kg m².
    pub inertia_kg_m2: f64,
    /// Centre of gravity below centre of buoyancy, m.
    pub metacentric_height_m: f64,
    /// Moving battery, kg.
    pub battery_mass_kg: f64,
    /// Ballast tank ahead of the centre of buoyancy, m.
    pub ballast_arm_m: f64,
    /// Tightest turn radius at full fin, m.
    pub turn_radius_m: f64,
    /// Length over which the turn rate follows the fin, m.
    pub yaw_length_m: f64,
    /// Roll at a turn curvature of 1/m, rad·m (negative: rolls into the turn to port for starboard turns).
    pub roll_per_curvature_rad_m: f64,
    /// Constant list, rad, starboard down.
    pub list_rad: f64,
    /// Drag area of the fin per angle², m²/rad² (guess: full fin and turn cost 12 % together; public spiral figures 2–15 %).
    pub fin_area_m2: f64,
    /// Drag area of sideslip in a turn at a curvature of 1/m, m²·m².
    pub turn_drag_m4: f64,
    /// Weight in water of the emergency drop weight, kg.
    pub drop_weight_kg: f64,
    /// Time from firing to release, s.
    pub release_time_s: f64,
    /// Depth at which the hull fails, m.
    pub crush_depth_m: f64,
    /// Gas in the hull, m³. Slocum 0.029 and 0.035, SeaExplorer 0.051 (real logs).
    pub gas_m3: f64,
    /// Lag of its temperature behind the water's, s (guess: a Slocum's thermometer inside lags by an hour or two).
    pub gas_lag_s: f64,
    /// Battery energy when full, J.
    pub battery_j: f64,
    /// Hotel load, W.
    pub hotel_w: f64,
    /// Force law; none: that of the scenario's wings.
    pub aero: Option<Aero>,
}

impl Default for Vehicle {
    /// A shallow Slocum of the first generation (Graver/Leonard parameter set, rounded; see each field).
    fn default() -> Self {
        Self {
            mass_kg: 52.0,
            ballasted_density_kg_m3: None,
            compressibility_per_pa: 5e-10,
            thermal_expansion_per_k: 5e-5,
            reference_temperature_degc: 10.0,
            added_mass_surge_kg: 3.0,
            added_mass_heave_kg: 55.0,
            inertia_kg_m2: 17.3,
            metacentric_height_m: 0.005,
            battery_mass_kg: 9.0,
            ballast_arm_m: 0.65,
            turn_radius_m: 8.0,
            yaw_length_m: 1.5,
            roll_per_curvature_rad_m: 1.2,
            list_rad: 0.0,
            fin_area_m2: 0.006,
            turn_drag_m4: 0.05,
            drop_weight_kg: 0.45,
            release_time_s: 120.0,
            crush_depth_m: 250.0,
            gas_m3: 0.030,
            gas_lag_s: 5400.0,
            battery_j: 7.8e6,
            hotel_w: 1.2,
            aero: None,
        }
    }
}

impl Vehicle {
    /// *Comet* 2016 as its owner's model has it: 70 kg, added mass 0.2 and 0.92 of it.
    #[must_use]
    pub fn comet_2016() -> Self {
        Self {
            mass_kg: 70.0,
            added_mass_surge_kg: 0.2 * 70.0,
            added_mass_heave_kg: 0.92 * 70.0,
            metacentric_height_m: 0.0046,
            ..Self::default()
        }
    }

    /// A deep Slocum (0–1000 m).
    #[must_use]
    pub fn deep() -> Self {
        Self { crush_depth_m: 1250.0, ..Self::default() }
    }
}

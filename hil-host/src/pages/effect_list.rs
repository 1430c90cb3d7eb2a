//! Effects of the catalogue as a person reads them: a name in words, and the part of the physics each belongs to, told by what it acts on.

use hydro::effects::{Active, CATALOGUE, Constants, Effect, ForceModel, Parameter};
use rig::flight::vehicles::Model;
use serde_json::{Value, json};
use signals::Wings;

/// The parts of the physics, in the order they are shown.
pub const KINDS: [&str; 6] = ["Lift", "Drag", "Buoyancy", "Inertia", "Water", "Sensors"];

/// The name in words: `climb_drag` is "Climb drag".
#[must_use]
pub fn in_words(name: &str) -> String {
    let words = name.replace("bodywing", "of body and wing").replace('_', " ");
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// The kind of what somebody wrote.
pub const OWN: &str = "Your own";

/// Its parameters as documents list them.
#[must_use]
pub fn parameters(effect: &Effect) -> Vec<Value> {
    let one = |p: &Parameter| json!({"name": p.name, "unit": p.unit, "off": p.off, "low": p.low, "high": p.high, "typical": p.typical});
    effect.parameters.iter().map(one).collect()
}

/// Which part of the physics an effect changes: the first of these that it acts on.
#[must_use]
pub fn kind(effect: &'static Effect) -> &'static str {
    if effect.sensed.is_some() || effect.pressure_error_pa.is_some() {
        return "Sensors";
    }
    if effect.water_up_m_s.is_some() || effect.current_m_s.is_some() {
        return "Water";
    }
    // Half way to the end that is farther from being off: some are off at their largest. Of any vehicle: only what changes matters.
    let size = &effect.parameters[0];
    let end = if size.high - size.off > size.off - size.low { size.high } else { size.low };
    let Ok(model) = Model::sea(Wings::Standard) else { return "Drag" };
    let plain = *model.constants();
    let c = ForceModel::new(plain, &[Active::sized(effect, 0.5 * (size.off + end))]).constants;
    let buoyant = |c: &Constants| [c.hull_volume_m3, c.compressibility_per_pa, c.thermal_expansion_per_k];
    if effect.volume_m3.is_some() || buoyant(&c) != buoyant(&plain) {
        return "Buoyancy";
    }
    if [c.added_mass_surge, c.added_mass_heave] != [plain.added_mass_surge, plain.added_mass_heave] {
        return "Inertia";
    }
    let acts = effect.in_flow();
    let lifts = acts.lift_angle || acts.lift || acts.normal_force || c.lift_slope_per_rad != plain.lift_slope_per_rad;
    if lifts { "Lift" } else { "Drag" }
}

/// The catalogue by kind.
pub fn by_kind() -> impl Iterator<Item = (&'static str, Vec<&'static Effect>)> {
    KINDS.into_iter().map(|k| (k, CATALOGUE.iter().copied().filter(|e| kind(e) == k).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_stands_with_its_like() {
        let of = |name: &str| kind(hydro::effects::by_name(name).expect("in the catalogue"));
        for (name, owed) in [
            ("vortex_lift_bodywing", "Lift"),
            ("stall", "Lift"),
            ("zero_lift_angle", "Lift"),
            ("lift_slope_error", "Lift"),
            ("climb_drag", "Drag"),
            ("induced_drag_error", "Drag"),
            ("drag_level_error", "Drag"),
            ("ballast_offset", "Buoyancy"),
            ("thermal_expansion", "Buoyancy"),
            ("hull_compressibility", "Buoyancy"),
            ("added_mass", "Inertia"),
            ("internal_wave", "Water"),
            ("vertical_current", "Water"),
            ("horizontal_current", "Water"),
            ("pitch_offset", "Sensors"),
            ("pressure_drift", "Sensors"),
            ("density_bias", "Sensors"),
        ] {
            assert_eq!(of(name), owed, "{name}");
        }
        assert_eq!(by_kind().map(|(_, e)| e.len()).sum::<usize>(), CATALOGUE.len());
        assert_eq!(in_words("vortex_lift_bodywing"), "Vortex lift of body and wing");
    }
}

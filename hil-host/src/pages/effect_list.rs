//! Effects of the catalogue as a person reads them: a name in words, and the part of the physics each belongs to, told by what it acts on.

use hydro::effects::{Active, CATALOGUE, Constants, Effect, Flow, Place};
use rig::flight::vehicles::Model;
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

/// Which part of the physics an effect changes: the first of these that it acts on.
#[must_use]
pub fn kind(effect: &'static dyn Effect) -> &'static str {
    // Half way to the end that is farther from being off: some are off at their largest.
    let size = &effect.parameters()[0];
    let end = if size.high - size.off > size.off - size.low { size.high } else { size.low };
    let on = Active::sized(effect, 0.5 * (size.off + end));
    let values = &on.values;
    let place = Place { time_s: 5000.0, depth_m: 30.0, water_depth_m: 100.0, phase_rad: 1.0 };
    if effect.acts_on_sensors() || effect.pressure_error_pa(values, place.time_s) != 0.0 {
        return "Sensors";
    }
    if effect.water_up_m_s(values, &place) != 0.0 || effect.current_m_s(values, &place) != (0.0, 0.0) {
        return "Water";
    }
    // Of any vehicle: only what changes matters.
    let Ok(model) = Model::sea(Wings::Standard) else { return "Drag" };
    let (plain, mut c) = (*model.constants(), *model.constants());
    effect.constants(values, &mut c);
    let buoyant = |c: &Constants| [c.hull_volume_m3, c.compressibility_per_pa, c.thermal_expansion_per_k];
    if effect.acts_on_volume() || buoyant(&c) != buoyant(&plain) {
        return "Buoyancy";
    }
    if [c.added_mass_surge, c.added_mass_heave] != [plain.added_mass_surge, plain.added_mass_heave] {
        return "Inertia";
    }
    let flow = Flow { roll_rad: 0.2, climb_m_s: 0.1, time_s: place.time_s, ..Flow::steady(0.34, 0.2) };
    let lifts = effect.lift_angle_rad(values, 0.34) != 0.34 || effect.lift(values, &flow, 0.34, &plain) != 0.0;
    if lifts || effect.normal_force(values, &flow) != 0.0 || c.lift_slope_per_rad != plain.lift_slope_per_rad { "Lift" } else { "Drag" }
}

/// The catalogue by kind.
pub fn by_kind() -> impl Iterator<Item = (&'static str, Vec<&'static dyn Effect>)> {
    KINDS.into_iter().map(|k| (k, CATALOGUE.iter().copied().filter(|e| kind(*e) == k).collect()))
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

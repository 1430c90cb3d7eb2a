//! Effects that change the inertia of the water carried along.

use super::{Calibrated, Effect, Parameter};

/// Surge added mass larger by delta_k1 times the mass.
pub static ADDED_MASS: Effect = Effect {
    name: "added_mass",
    physics: "more water is accelerated with the vehicle along its axis: it lags after every change of buoyancy or pitch",
    separated_by: "many turning points at different speeds",
    parameters: &[Parameter::new("delta_k1", "1", 0.0, (-0.9, 4.0), 0.2, "0.06 (spheroid) to 0.2-0.4 with flooded tail and wings")],
    error_of: Some(Calibrated::SurgeAddedMass),
    usual_sign: 1.0,
    constants: Some(&|p, c| c.added_mass_surge += p[0]),
    ..Effect::NONE
};

/// Heave added mass larger by delta_k2 times the mass.
pub static HEAVE_ADDED_MASS: Effect = Effect {
    name: "heave_added_mass",
    physics: "more water is accelerated across the vehicle: turning points are rounded differently",
    separated_by: "many sharp turning points",
    parameters: &[Parameter::new("delta_k2", "1", 0.0, (-1.5, 8.0), 0.5, "0.9 (spheroid) and more with wings")],
    error_of: Some(Calibrated::HeaveAddedMass),
    usual_sign: 1.0,
    constants: Some(&|p, c| c.added_mass_heave += p[0]),
    ..Effect::NONE
};

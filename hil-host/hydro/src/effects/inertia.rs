//! Effects that change the inertia of the water carried along.

use super::{Calibrated, Constants, Effect, InFlow, Parameter};

/// Surge added mass larger by delta_k1 times the mass.
#[derive(Clone, Copy, Debug)]
pub struct AddedMass;

impl Effect for AddedMass {
    fn name(&self) -> &'static str {
        "added_mass"
    }
    fn physics(&self) -> &'static str {
        "more water is accelerated with the vehicle along its axis: it lags after every change of buoyancy or pitch"
    }
    fn separated_by(&self) -> &'static str {
        "many turning points at different speeds"
    }
    fn error_of(&self) -> Option<Calibrated> {
        Some(Calibrated::SurgeAddedMass)
    }
    fn usual_sign(&self) -> f64 {
        1.0
    }
    fn in_flow(&self) -> InFlow {
        InFlow::NOTHING
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter {
            name: "delta_k1",
            unit: "1",
            off: 0.0,
            low: -0.9,
            high: 4.0,
            typical: 0.2,
            source: "0.06 (spheroid) to 0.2-0.4 with flooded tail and wings",
        }]
    }
    fn constants(&self, p: &[f64], c: &mut Constants) {
        c.added_mass_surge += p[0];
    }
}

/// Heave added mass larger by delta_k2 times the mass.
#[derive(Clone, Copy, Debug)]
pub struct HeaveAddedMass;

impl Effect for HeaveAddedMass {
    fn name(&self) -> &'static str {
        "heave_added_mass"
    }
    fn physics(&self) -> &'static str {
        "more water is accelerated across the vehicle: turning points are rounded differently"
    }
    fn separated_by(&self) -> &'static str {
        "many sharp turning points"
    }
    fn error_of(&self) -> Option<Calibrated> {
        Some(Calibrated::HeaveAddedMass)
    }
    fn usual_sign(&self) -> f64 {
        1.0
    }
    fn in_flow(&self) -> InFlow {
        InFlow::NOTHING
    }

    fn parameters(&self) -> &'static [Parameter] {
        &[Parameter {
            name: "delta_k2",
            unit: "1",
            off: 0.0,
            low: -1.5,
            high: 8.0,
            typical: 0.5,
            source: "0.9 (spheroid) and more with wings",
        }]
    }
    fn constants(&self, p: &[f64], c: &mut Constants) {
        c.added_mass_heave += p[0];
    }
}

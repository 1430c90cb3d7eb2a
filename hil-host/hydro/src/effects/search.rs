//! What a search for missing effects must know of an effect beside its physics.

/// A number of the vehicle that scatters in every vehicle; an effect may be its error, beyond the tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calibrated {
    /// Drag at zero lift.
    Drag,
    /// Slope of the lift.
    LiftSlope,
    /// Displaced volume at trim.
    TrimVolume,
    /// Gain of the buoyancy engine.
    BallastGain,
    /// Zero of the pitch sensor.
    PitchZero,
    /// Compressibility of the hull.
    HullCompressibility,
    /// Thermal expansion of the hull.
    ThermalExpansion,
    /// Added mass along the axis.
    SurgeAddedMass,
    /// Added mass across it.
    HeaveAddedMass,
}

/// The size of an effect that is an angle beyond which it acts: the model is not linear in it, and a flight that never comes so far
/// says nothing of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Onset {
    /// Where its prior is uniform, rad.
    pub range_rad: (f64, f64),
    /// Angles that fits start from, rad.
    pub starts_rad: [f64; 3],
    /// Angles at which the model with it is set against the model without it, rad.
    pub tried_rad: [f64; 3],
    /// An angle that is hardly reached, rad: where it is fitted from if it promises nothing.
    pub unfelt_rad: f64,
}

/// What the measurements know of an effect apart from the vertical motion, which is the rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum SeenIn {
    /// The vertical motion, simulated at a given size.
    #[default]
    VerticalMotion,
    /// The way between GPS fixes alone: size and direction of a current.
    Displacement,
    /// The vertical motion, with amplitudes and phases that are free in every dive.
    Waves,
}

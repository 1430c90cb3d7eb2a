//! Force coefficients.

/// Lift and drag coefficients on S.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiftDrag {
    /// CL, perpendicular to the path, positive for α > 0.
    pub cl: f64,
    /// CD, against the motion.
    pub cd: f64,
}

//! How the flow leaves a wing: gradually around one angle of attack, then broadside on.

/// How the flow leaves a wing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Separation {
    /// α at which half the lift-carrying flow has separated, rad.
    pub alpha_rad: f64,
    /// Width of the transition (logistic), rad.
    pub width_rad: f64,
    /// Normal-force coefficient of the separated wing broadside on, 1 (plates: 1.2 at A ≈ 5; Hoerner).
    pub broadside_cn: f64,
}

impl Separation {
    /// From the angle where the attached regime ends (a tenth of the flow has separated) to the one of full separation (nine tenths), rad.
    #[must_use]
    pub fn between(begins_rad: f64, complete_rad: f64, broadside_cn: f64) -> Self {
        // The logistic passes 0.1 and 0.9 at ± ln 9 widths.
        const LN_9: f64 = 2.197_224_577_336_219_4;
        Self { alpha_rad: 0.5 * (begins_rad + complete_rad), width_rad: (complete_rad - begins_rad) / (2.0 * LN_9), broadside_cn }
    }

    /// Share of attached flow, 1..0. (1 + e^-α_s/w)/(1 + e^((|α|−α_s)/w)): exactly 1 at α = 0.
    #[must_use]
    pub fn attached(&self, alpha_rad: f64) -> f64 {
        let at_zero = 1.0 + libm::exp(-self.alpha_rad / self.width_rad);
        at_zero / (1.0 + libm::exp((alpha_rad.abs() - self.alpha_rad) / self.width_rad))
    }

    /// C_N of the separated wing: C_N90 sin α / (0.56 + 0.44 |sin α|) (plates between 20° and 90°, Lindenburg's fit to
    /// Hoerner's data, from memory).
    #[must_use]
    pub fn normal(&self, alpha_rad: f64) -> f64 {
        self.normal_of(libm::sin(alpha_rad))
    }

    /// [`Self::normal`] from sin α.
    pub(crate) fn normal_of(&self, s: f64) -> f64 {
        self.broadside_cn * s / (0.56 + 0.44 * s.abs())
    }
}

//! The source paper, claim by claim and figure by figure.
//!
//! "Hydrodynamic Implications for Submarine Launched Underwater Gliders". Every claim that can be put to a test gets the
//! paper's number, ours and a verdict that is computed from them:
//!
//! * **reproduced**: follows from literature constants, nothing tuned to it;
//! * **calibrated**: holds, but constants the paper does not give were tuned to it or taken over from it;
//! * **contradicted**: does not hold in our model, our plant, or the sea data.
//!
//! | file | answers |
//! |---|---|
//! | [`variants`] | which vehicles are compared |
//! | [`trials`] | the lake trial, flown through the plant with the real controller |
//! | [`claims`] | the 25 claims |
//! | [`figures`] | figures 3 to 11, redrawn |

pub mod claims;
pub mod figures;
pub mod trials;
pub mod variants;

use serde_json::{Value, json};

/// What we say about a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// Follows from literature constants.
    Reproduced,
    /// Holds after tuning.
    Calibrated,
    /// Does not hold.
    Contradicted,
}

impl Finding {
    /// The word for it.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Finding::Reproduced => "reproduced",
            Finding::Calibrated => "calibrated",
            Finding::Contradicted => "contradicted",
        }
    }

    /// Reproduced if `holds`, else contradicted.
    #[must_use]
    pub fn reproduced_if(holds: bool) -> Self {
        if holds { Finding::Reproduced } else { Finding::Contradicted }
    }

    /// Calibrated if `holds`, else contradicted.
    #[must_use]
    pub fn calibrated_if(holds: bool) -> Self {
        if holds { Finding::Calibrated } else { Finding::Contradicted }
    }
}

/// One claim of the paper.
#[derive(Clone, Debug)]
pub struct Claim {
    /// Number, 1 to 25.
    pub id: u32,
    /// The claim in a sentence, with its place.
    pub claim: &'static str,
    /// The paper's number.
    pub paper: &'static str,
    /// Ours.
    pub ours: String,
    /// Verdict.
    pub verdict: Finding,
    /// Why, in one sentence.
    pub why: String,
}

impl Claim {
    /// As JSON.
    #[must_use]
    pub fn json(&self) -> Value {
        json!({"id": self.id, "claim": self.claim, "paper": self.paper, "ours": self.ours, "verdict": self.verdict.word(), "why": self.why})
    }
}

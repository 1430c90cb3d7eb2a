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
//! | [`plates`] | every wing law against measured rectangular plates |
//! | [`figures`] | figures 3 to 11, redrawn |

pub mod claims;
pub mod figures;
pub mod plates;
pub mod trials;
pub mod variants;

use serde_json::{Value, json};

use crate::pages::{self, Page, Provenance, Section, Table};

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

/// Claims and figures as one offline page.
///
/// # Errors
/// Never for the committed vehicle files.
pub fn page(claims: &[Claim], trials: &trials::Trials) -> anyhow::Result<Page> {
    let count = |f: Finding| claims.iter().filter(|c| c.verdict == f).count();
    let head = ["#", "claim", "paper", "ours", "verdict", "why"].map(String::from).to_vec();
    let rows = claims
        .iter()
        .map(|c| vec![c.id.to_string(), c.claim.into(), c.paper.into(), c.ours.clone(), c.verdict.word().into(), c.why.clone()])
        .collect();
    let table = Table { caption: "The paper's claims beside our numbers".into(), head, rows };
    let plates = Table {
        caption:
            "Root mean square error of C_L and C_D over 3-20 deg, and the slope's error over 3-8 deg by plate, with literature constants"
                .into(),
        head: plates::head(),
        rows: plates::scores().iter().map(plates::Score::row).collect(),
    };
    let plate_items =
        std::iter::once(plates.into()).chain(plates::charts().iter().map(|(_, chart)| chart.clone().thinned().into())).collect();
    let figures: Vec<pages::Item> = figures::all(trials)?.into_iter().map(|(_, chart)| chart.thinned().into()).collect();
    Ok(Page {
        title: "The source paper, claim by claim".into(),
        answer: vec![
            (
                "Reproduced".into(),
                format!("{} of {} claims follow from literature constants, untuned", count(Finding::Reproduced), claims.len()),
            ),
            ("Calibrated".into(), format!("{} hold after tuning constants the paper does not give", count(Finding::Calibrated))),
            ("Contradicted".into(), format!("{} do not hold in our model, our plant or the sea data", count(Finding::Contradicted))),
        ],
        sections: vec![
            Section {
                title: "Claims".into(),
                lead: "Each verdict is computed from the numbers beside it.".into(),
                items: vec![table.into()],
            },
            Section {
                title: "Wing laws on rectangular plates".into(),
                lead: "The paper's wings are rectangular, and so are these plates. At aspect ratio 0.3155 nobody measured: the last chart is an extrapolation with its interval.".into(),
                items: plate_items,
            },
            Section {
                title: "Figures".into(),
                lead: "Figures 3 to 11 of the paper, redrawn; figure 11 by each meaning of \"angle of attack\".".into(),
                items: figures,
            },
        ],
        provenance: Provenance::of_this_run(),
    })
}

//! The verdict: one function of what was found, that gives its reasons.
//!
//! | verdict | when |
//! |---|---|
//! | adequate | nothing missing leads, or a name that does not lower the error by [`PRACTICAL`] where the model has a discrepancy |
//! | explained, ambiguous | a named set leads (ambiguous where an unknown effect leads given it, or the interval of a size holds none of it); its error is finite, and on dives kept out of the fit no worse than recalibration or near the floor |
//! | unexplained | an unknown effect leads (where the model has a discrepancy: and the error is beyond [`SMALL`] floors), or the best leaves far more than water, sensors and discrepancy do |
//!
//! What remains with the answer is said with its size; it is no veto by itself.

/// What the flight says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Nothing but scatter.
    Adequate,
    /// The first candidate is what is missing.
    Explained,
    /// One of the tied candidates is.
    Ambiguous,
    /// Something is missing that no candidate explains.
    Unexplained,
}

impl Verdict {
    /// Name in the report.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Adequate => "adequate",
            Self::Explained => "explained",
            Self::Ambiguous => "ambiguous",
            Self::Unexplained => "unexplained",
        }
    }
}

/// Share by which a name must lower the error of all blocks, fitted and kept out, where the model has a discrepancy of its own: less is
/// of no use to a pilot, however many rows vouch for it.
pub const PRACTICAL: f64 = 0.05;
/// Errors, in floors of water, sensors and discrepancy, up to which what remains is of no practical size.
pub const SMALL: f64 = 1.3;
/// Largest discrepancy that widens the floor, m/s: of one that is larger a pilot wants to know.
pub const MOST_DISCREPANCY_M_S: f64 = 0.0015;
/// Error in floors on the check segments, typical of all or within four fifths of one, from which an answer has failed: where one was
/// right it was below 2.7 in 227 flights of others, and below 2.2 in 51 clean ones.
const FAILS: f64 = 3.0;
/// The same where it is also so many times that of nothing missing.
const FAILS_IF_WORSE: f64 = 2.0;
const WORSE: f64 = 1.3;
/// How much worse than recalibration an answer may be on dives kept out by chance: check sets are one or two dives.
const CHANCE: f64 = 1.02;
/// Mean square of innovations beyond which no verdict but unexplained is honest.
const FAR_FROM_NOISE: f64 = 2.5;

/// What an unknown effect that leads is added to.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// The variable it follows.
    pub variable: &'static str,
    /// Log odds by which it is ahead.
    pub ahead: f64,
}

/// One reason for a verdict.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// No effect is likelier than nothing missing.
    NothingLeads,
    /// A name leads and lowers the error by this share only.
    TooSmall {
        /// Share of the error of all blocks.
        share: f64,
    },
    /// A named set leads by these log odds.
    Leads {
        /// Log odds against nothing missing.
        log_odds: f64,
    },
    /// So many sets are equivalent.
    Equivalent {
        /// How many.
        sets: usize,
    },
    /// The interval of a size holds none of the effect.
    SizeMayBeNone {
        /// Effect.
        effect: &'static str,
    },
    /// Without temperature what is named may be thermal expansion.
    NoTemperature,
    /// An effect outside the catalogue leads.
    UnknownLeads(Unknown),
    /// The error on dives kept out of the fit, in floors.
    HeldOutTooLarge {
        /// Times what water, sensors and discrepancy leave.
        floors: f64,
    },
    /// The answer is worse than recalibration on dives kept out of the fit, m/s each.
    WorseThanRecalibration {
        /// Error of the answer.
        answer_m_s: f64,
        /// Error of the recalibrated model.
        recalibrated_m_s: f64,
    },
    /// The error of the answer is not a number.
    NotFinite,
    /// A size is at the end of what is possible and wants to go further.
    AtBound {
        /// Effect.
        effect: &'static str,
    },
    /// Innovations are far larger than noise: mean square.
    FarFromNoise {
        /// Mean square, 1 for noise.
        mean_square: f64,
    },
    /// The work that a search may take was used up; the answer is the best so far.
    WorkUsedUp,
}

impl Reason {
    /// Name in JSON.
    #[must_use]
    pub fn code(&self) -> &'static str {
        match self {
            Self::NothingLeads => "nothing_leads",
            Self::TooSmall { .. } => "too_small",
            Self::Leads { .. } => "leads",
            Self::Equivalent { .. } => "equivalent",
            Self::SizeMayBeNone { .. } => "size_may_be_none",
            Self::NoTemperature => "no_temperature",
            Self::UnknownLeads(_) => "unknown_leads",
            Self::HeldOutTooLarge { .. } => "held_out_too_large",
            Self::WorseThanRecalibration { .. } => "worse_than_recalibration",
            Self::NotFinite => "not_finite",
            Self::AtBound { .. } => "at_bound",
            Self::FarFromNoise { .. } => "far_from_noise",
            Self::WorkUsedUp => "work_used_up",
        }
    }

    /// In words.
    #[must_use]
    pub fn text(&self) -> String {
        match self {
            Self::NothingLeads => "no effect is likelier than nothing missing".into(),
            Self::TooSmall { share } if *share < 0.0 => "the effect that leads does not lower the error of all dives".into(),
            Self::TooSmall { share } => format!("the effect that leads lowers the error by {:.0} % only", 100.0 * share),
            Self::Leads { log_odds } => format!("the answer is ahead of nothing missing by {log_odds:.1} log units"),
            Self::Equivalent { sets } => format!("{sets} sets of effects do equally well"),
            Self::SizeMayBeNone { effect } => format!("the 90 % interval of the size of {effect} includes none at all"),
            Self::NoTemperature => {
                "without temperature the hull's thermal expansion was not modelled: what is named may be that instead".into()
            }
            Self::UnknownLeads(u) => format!(
                "something unknown that follows the {} is likelier than any known effect, by {:.1} log units",
                unknown_in_words(u.variable),
                u.ahead
            ),
            Self::HeldOutTooLarge { floors } => {
                format!(
                    "on dives kept out of the fit the best hypothesis leaves {floors:.1} times what water, sensors and the model's own discrepancy do"
                )
            }
            Self::WorseThanRecalibration { answer_m_s, recalibrated_m_s } => format!(
                "on dives kept out of the fit the best hypothesis leaves {:.2} cm/s, recalibration alone {:.2}",
                100.0 * answer_m_s,
                100.0 * recalibrated_m_s
            ),
            Self::NotFinite => "with the nearest known effects the model no longer flies".into(),
            Self::AtBound { effect } => format!("{effect} is at the end of what is possible and would have to be larger"),
            Self::FarFromNoise { mean_square } => format!("what is left is {mean_square:.1} times as large as noise, in mean square"),
            Self::WorkUsedUp => "the work that a search may take was used up: the answer is the best so far".into(),
        }
    }
}

/// What an effect outside the catalogue follows, `heading (pitch)`, in words.
#[must_use]
pub fn unknown_in_words(variable: &str) -> String {
    let Some((follows, through)) = variable.split_once(" (") else { return variable.to_owned() };
    let like = match through.trim_end_matches(')') {
        "pitch" => "a wrong pitch",
        "drag" => "a change of drag",
        "trim" => "a change of weight",
        other => other,
    };
    format!("{follows} and acts like {like}")
}

/// Errors of the best hypothesis and of nothing missing, m/s; NaN where there are no blocks.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    /// Rms over the blocks of the check segments: the best, and nothing missing.
    pub check_m_s: [f64; 2],
    /// Rms over the fitted blocks.
    pub fitted_m_s: [f64; 2],
    /// Error of the typical check block; NaN where check blocks cannot judge (the phase of a wave, the branch of a stall).
    pub typical_m_s: [f64; 2],
    /// Error that four blocks of five of the worst check segment stay within, of the best.
    pub worst_segment_m_s: f64,
    /// What water, sensors and discrepancy would leave.
    pub floor_m_s: f64,
}

/// Whether an answer is no worse than nothing missing on dives kept out of the fit, or near the floor there; errors in m/s.
#[must_use]
pub(crate) fn holds_elsewhere([answer, nothing]: [f64; 2], floor_m_s: f64) -> bool {
    answer < CHANCE * nothing || answer < SMALL * floor_m_s
}

/// What a verdict is made of.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// Log odds of the named set that leads, if one does.
    pub named: Option<f64>,
    /// Where none is named: the share of the error that the best lowers it by, which is too little.
    pub too_small: Option<f64>,
    /// An effect of it that is pressed against a bound.
    pub at_bound: Option<&'static str>,
    /// Sets that are equivalent, itself counted.
    pub equivalent: usize,
    /// An effect of it of which the interval of the size holds none.
    pub may_be_none: Option<&'static str>,
    /// An unknown effect that is likelier than the named set, or than nothing missing.
    pub unknown_leads: Option<Unknown>,
    /// Errors.
    pub errors: Errors,
    /// Whether a wave is named: its phase on check segments is not known.
    pub wave: bool,
    /// Mean square of innovations at the best.
    pub mean_square: f64,
    /// Whether the log has temperatures.
    pub has_temperature: bool,
    /// Whether the search used its work up.
    pub used_up: bool,
}

/// The verdict and its reasons.
#[must_use]
pub fn judge(e: &Evidence) -> (Verdict, Vec<Reason>) {
    let x = &e.errors;
    let has_check = x.check_m_s[1].is_finite() || x.check_m_s[0].is_finite();
    let mut reasons = Vec::new();
    // A misfit counts where it is of practical size: by the dives kept out of the fit and by the fitted ones.
    let judged = if has_check && !e.wave { x.check_m_s[0] } else { x.fitted_m_s[0] };
    let practical = e.wave || !(judged.max(x.fitted_m_s[0]) < SMALL * x.floor_m_s);
    // An unknown effect that leads is a veto if the error has room for it, else a remark.
    let unknown = || e.unknown_leads.clone().map(Reason::UnknownLeads);
    if practical {
        reasons.extend(unknown());
    }
    if practical && !(e.mean_square < FAR_FROM_NOISE) {
        reasons.push(Reason::FarFromNoise { mean_square: e.mean_square });
    }
    let [typical, of_nothing] = x.typical_m_s;
    let fails = x.worst_segment_m_s > FAILS * x.floor_m_s
        || typical > FAILS * x.floor_m_s
        || (typical > FAILS_IF_WORSE * x.floor_m_s && typical > WORSE * of_nothing);
    if fails {
        reasons.push(Reason::HeldOutTooLarge { floors: typical.max(x.worst_segment_m_s) / x.floor_m_s });
    }
    if e.named.is_some() {
        if !x.fitted_m_s[0].is_finite() || (has_check && !e.wave && !x.check_m_s[0].is_finite()) {
            reasons.push(Reason::NotFinite);
        } else if has_check && !e.wave && !holds_elsewhere(x.check_m_s, x.floor_m_s) {
            reasons.push(Reason::WorseThanRecalibration { answer_m_s: x.check_m_s[0], recalibrated_m_s: x.check_m_s[1] });
        }
        reasons.extend(e.at_bound.map(|effect| Reason::AtBound { effect }));
    }
    let verdict = match e.named {
        _ if !reasons.is_empty() => Verdict::Unexplained,
        None => {
            reasons.push(e.too_small.map_or(Reason::NothingLeads, |share| Reason::TooSmall { share }));
            Verdict::Adequate
        }
        Some(log_odds) => {
            reasons.push(Reason::Leads { log_odds });
            if !e.has_temperature {
                reasons.push(Reason::NoTemperature);
            }
            if e.equivalent > 1 {
                reasons.push(Reason::Equivalent { sets: e.equivalent });
            }
            let remarks = [unknown(), e.may_be_none.map(|effect| Reason::SizeMayBeNone { effect })];
            let sure = e.equivalent <= 1 && e.has_temperature && remarks.iter().all(Option::is_none);
            reasons.extend(remarks.into_iter().flatten());
            if sure { Verdict::Explained } else { Verdict::Ambiguous }
        }
    };
    if e.used_up {
        reasons.push(Reason::WorkUsedUp);
    }
    (verdict, reasons)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain() -> Evidence {
        let errors = Errors {
            check_m_s: [0.004, 0.009],
            fitted_m_s: [0.004, 0.009],
            typical_m_s: [0.004, 0.009],
            worst_segment_m_s: 0.005,
            floor_m_s: 0.004,
        };
        Evidence {
            named: Some(40.0),
            too_small: None,
            at_bound: None,
            equivalent: 1,
            may_be_none: None,
            unknown_leads: None,
            errors,
            wave: false,
            mean_square: 1.0,
            has_temperature: true,
            used_up: false,
        }
    }

    fn verdict(e: &Evidence) -> Verdict {
        judge(e).0
    }

    #[test]
    fn prop_an_answer_that_is_nan_worse_or_at_a_bound_is_never_explained() {
        assert_eq!(verdict(&plain()), Verdict::Explained);
        let with = |change: &dyn Fn(&mut Evidence)| {
            let mut e = plain();
            change(&mut e);
            judge(&e)
        };
        let codes = |(v, r): (Verdict, Vec<Reason>)| (v, r.iter().map(Reason::code).collect::<Vec<_>>());
        assert_eq!(codes(with(&|e| e.errors.check_m_s[0] = f64::NAN)), (Verdict::Unexplained, vec!["not_finite"]));
        assert_eq!(codes(with(&|e| e.errors.fitted_m_s[0] = f64::NAN)).0, Verdict::Unexplained);
        assert_eq!(codes(with(&|e| e.errors.check_m_s = [0.012, 0.010])), (Verdict::Unexplained, vec!["worse_than_recalibration"]));
        assert_eq!(codes(with(&|e| e.at_bound = Some("added_mass"))), (Verdict::Unexplained, vec!["at_bound"]));
        assert_eq!(codes(with(&|e| e.equivalent = 2)).0, Verdict::Ambiguous);
        assert_eq!(codes(with(&|e| e.has_temperature = false)).0, Verdict::Ambiguous);
        assert_eq!(codes(with(&|e| e.may_be_none = Some("trapped_air"))), (Verdict::Ambiguous, vec!["leads", "size_may_be_none"]));
    }

    #[test]
    fn prop_a_leading_unknown_effect_is_never_explained() {
        let unknown = Some(Unknown { variable: "depth", ahead: 300.0 });
        let small = Evidence { unknown_leads: unknown, ..plain() };
        // Where the error has no room for it: a remark with a name, none where nothing is named.
        let (said, reasons) = judge(&small);
        assert_eq!((said, reasons.iter().any(|r| r.code() == "unknown_leads")), (Verdict::Ambiguous, true));
        assert_eq!(verdict(&Evidence { named: None, ..small.clone() }), Verdict::Adequate);
        let large = Errors { fitted_m_s: [0.007, 0.009], ..plain().errors };
        assert_eq!(verdict(&Evidence { errors: large, ..small.clone() }), Verdict::Unexplained);
        assert_eq!(verdict(&Evidence { errors: large, named: None, ..small }), Verdict::Unexplained);
        let mut e = Evidence { mean_square: 3.0, ..plain() };
        assert_eq!(verdict(&e), Verdict::Explained);
        // A snag in the fitted dives only.
        e.errors = Errors { fitted_m_s: [0.007, 0.009], ..plain().errors };
        assert_eq!(verdict(&e), Verdict::Unexplained);
    }
}

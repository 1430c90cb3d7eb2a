//! A law for what has no name: which product of powers of what is measured, acting through drag, lift, weight or pitch, describes what a
//! fit leaves.
//!
//! ```text
//! change of the channel = k · g₁^a · g₂^b,   g: speed, angle of attack, pressure, temperature, roll, ballast, time …,  a, b: ½, 1, 2
//! ```
//! on both legs, on dives or on climbs alone. The vertical velocity it makes is quasi-steady: the sensitivity of the depth rate to the
//! channel at each row (four model passes), times the product. All columns are ranked by the fall of chi² that linear theory promises, the
//! first of them by the same evidence as every unknown effect (`against_usual.rs`); laws within ten to one of the best are one class.

use crate::criticism::against_usual::{Form, unknown_against_usual};
use crate::criticism::residual_tests::whitened_m_s;
use crate::inference::posterior::Fit;
use crate::likelihood::covariates::{Traits, traits};
use crate::likelihood::{Column, Problem};
use crate::model::dynamics::Track;
use crate::model::parameters::{DRAG, LIFT_SLOPE, NINETY, PITCH_ZERO, TRIM_VOLUME, tolerance_of};
use crate::preprocess::Input;
use serde_json::{Value, json};

/// What a law acts through.
struct Channel {
    name: &'static str,
    calibration: usize,
    /// Of the number's own unit, for a reader: factor and unit.
    shown: (f64, &'static str),
    /// What `glider add` adds to, and by how much of that the channel's own unit is.
    target: (&'static str, &'static str),
}

const CHANNELS: [Channel; 4] = [
    Channel { name: "drag", calibration: DRAG, shown: (100.0, "% of CD0"), target: ("cd", "") },
    Channel { name: "lift", calibration: LIFT_SLOPE, shown: (100.0, "% of the lift slope"), target: ("cl", "*alpha") },
    Channel { name: "weight", calibration: TRIM_VOLUME, shown: (1.0, "cm3 of volume"), target: ("volume_cc", "") },
    Channel { name: "pitch", calibration: PITCH_ZERO, shown: (57.295_779_513, "deg"), target: ("pitch_rad", "") },
];

/// What is known at a row.
struct Row<'a> {
    input: Input,
    track: &'a Track,
    row: usize,
    since_turn_s: f64,
    since_start_s: f64,
    warmth_degc: f64,
}

/// What a law may follow.
struct Group {
    name: &'static str,
    /// Value of one, for a reader.
    one: &'static str,
    /// Name in an expression, and that value there; none where expressions do not know it.
    variable: Option<(&'static str, f64)>,
    /// Whether its sign matters: powers of it keep the sign.
    signed: bool,
    value: fn(&Row) -> f64,
}

const FOLLOWED_GROUPS: [Group; 10] = [
    Group { name: "speed", one: "0.3 m/s", variable: Some(("U", 0.3)), signed: false, value: |r| r.track.speed_m_s[r.row] / 0.3 },
    Group {
        name: "angle of attack",
        one: "0.1 rad",
        variable: Some(("abs(alpha)", 0.1)),
        signed: false,
        value: |r| r.track.alpha_rad[r.row].abs() / 0.1,
    },
    Group {
        name: "pressure",
        one: "100 dbar",
        variable: Some(("p", 1e6)),
        signed: false,
        value: |r| r.input.sensed.pressure_pa.max(0.0) / 1e6,
    },
    Group {
        name: "temperature",
        one: "10 K",
        variable: None,
        signed: true,
        value: |r| (r.input.sensed.temperature_degc - r.warmth_degc) / 10.0,
    },
    Group { name: "roll", one: "0.5 rad", variable: Some(("abs(roll)", 0.5)), signed: false, value: |r| r.input.roll_rad.abs() / 0.5 },
    Group { name: "side of the turn", one: "0.5 rad", variable: Some(("roll", 0.5)), signed: true, value: |r| r.input.roll_rad / 0.5 },
    Group { name: "heading, north", one: "north", variable: None, signed: true, value: |r| r.input.cos_heading },
    Group { name: "heading, east", one: "east", variable: None, signed: true, value: |r| r.input.sin_heading },
    Group { name: "time since the turn", one: "60 s", variable: None, signed: false, value: |r| r.since_turn_s / 60.0 },
    Group {
        name: "time since the start of the segment",
        one: "1000 s",
        variable: None,
        signed: false,
        value: |r| r.since_start_s / 1000.0,
    },
];

/// Powers of one group, and of each of two.
const ALONE: [f64; 3] = [0.5, 1.0, 2.0];
const OF_TWO: [f64; 2] = [1.0, 2.0];
/// Laws of which the evidence is taken.
const RANKED: usize = 40;
/// Log odds of a class.
const ONE_CLASS: f64 = std::f64::consts::LN_10;

/// On which legs a law acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Legs {
    /// Both.
    Both,
    /// Dives alone.
    Dives,
    /// Climbs alone.
    Climbs,
}

/// A law.
#[derive(Clone, Debug)]
pub struct Law {
    channel: usize,
    legs: Legs,
    factors: Vec<(usize, f64)>,
    /// Log Bayes factor against what models are usually wrong by, averaged over sizes; two groups pay for their number.
    pub log_bayes: f64,
    /// Its coefficient, where every group is one, in the channel's unit for a reader, and 1 sigma.
    pub size: (f64, f64),
}

impl Law {
    /// What it acts through.
    #[must_use]
    pub fn channel(&self) -> &'static str {
        CHANNELS[self.channel].name
    }

    /// What it follows, with its powers.
    #[must_use]
    pub fn groups(&self) -> Vec<(&'static str, f64)> {
        self.factors.iter().map(|(g, e)| (FOLLOWED_GROUPS[*g].name, *e)).collect()
    }

    /// Whether another differs in its powers alone.
    fn has_the_same_form(&self, other: &Self) -> bool {
        let same = self.factors.iter().map(|f| f.0).eq(other.factors.iter().map(|f| f.0));
        same && self.channel == other.channel && self.legs == other.legs
    }

    /// What `glider add` fits; none where expressions do not know what it follows.
    #[must_use]
    pub fn expression(&self) -> Option<String> {
        let (target, times) = CHANNELS[self.channel].target;
        let flow = matches!(target, "cd" | "cl");
        let mut out = format!("{target} += k{times}");
        for (g, e) in &self.factors {
            let (name, one) = FOLLOWED_GROUPS[*g].variable.filter(|(name, _)| flow != (*name == "p"))?;
            out += &if *e == 1.0 { format!("*({name}/{one})") } else { format!("*({name}/{one})^{e}") };
        }
        match self.legs {
            Legs::Both => Some(out),
            _ if !flow => None,
            Legs::Dives => Some(out + "*(1-phase)/2"),
            Legs::Climbs => Some(out + "*(1+phase)/2"),
        }
    }

    /// As JSON.
    #[must_use]
    pub fn document(&self) -> Value {
        let legs = match self.legs {
            Legs::Both => "both",
            Legs::Dives => "dives",
            Legs::Climbs => "climbs",
        };
        let follows = |(name, exponent): &(&str, f64)| json!({"variable": name, "exponent": exponent});
        json!({"channel": self.channel(), "legs": legs, "follows": self.groups().iter().map(follows).collect::<Vec<_>>(), "size": self.size.0,
            "low": self.size.0 - NINETY * self.size.1, "high": self.size.0 + NINETY * self.size.1, "unit": CHANNELS[self.channel].shown.1,
            "log_bayes": self.log_bayes, "expression": self.expression()})
    }

    /// In words, with the powers of those of the same form.
    fn text(&self, alike: &[&Self]) -> String {
        let power = |i: usize| {
            let all = || alike.iter().map(|l| l.factors[i].1).chain([self.factors[i].1]);
            let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max));
            if low < high {
                format!("^{low} to {high}")
            } else if low == 1.0 {
                String::new()
            } else {
                format!("^{low}")
            }
        };
        let follows: Vec<String> =
            self.factors.iter().enumerate().map(|(i, (g, _))| format!("{}{}", FOLLOWED_GROUPS[*g].name, power(i))).collect();
        let ones: Vec<&str> = self.factors.iter().map(|(g, _)| FOLLOWED_GROUPS[*g].one).collect();
        let legs = match self.legs {
            Legs::Both => "",
            Legs::Dives => " on dives",
            Legs::Climbs => " on climbs",
        };
        let (size, off) = (self.size.0, NINETY * self.size.1);
        let unit = CHANNELS[self.channel].shown.1;
        format!(
            "{}{legs} follows {}: {size:+.2} ({:+.2} to {:+.2}) {unit} at {}",
            self.channel(),
            follows.join(" × "),
            size - off,
            size + off,
            ones.join(" and ")
        )
    }
}

/// The class of laws that a flight does not tell apart, best first, in words; at most three that differ in more than their powers.
#[must_use]
pub fn in_words(class: &[Law]) -> String {
    let mut said: Vec<String> = Vec::new();
    let mut rest: Vec<&Law> = class.iter().collect();
    while let Some(first) = rest.first().copied().filter(|_| said.len() < 3) {
        let (alike, others): (Vec<&Law>, Vec<&Law>) = rest.into_iter().partition(|l| l.has_the_same_form(first));
        said.push(first.text(&alike));
        rest = others;
    }
    let more = if rest.is_empty() { String::new() } else { format!(" (and {} more)", rest.len()) };
    let add = class.iter().find_map(Law::expression).map_or_else(String::new, |e| format!("; `glider add '{e}'` fits it"));
    format!("{}{more}{add}", said.join(", or "))
}

/// All products that are asked for: their groups and powers, and by how much two groups pay for being many.
fn products() -> Vec<(Vec<(usize, f64)>, f64)> {
    let single = |g: usize| ALONE.iter().filter(move |e| !FOLLOWED_GROUPS[g].signed || **e == 1.0).map(move |e| vec![(g, *e)]);
    let mut out: Vec<Vec<(usize, f64)>> = (0..FOLLOWED_GROUPS.len()).flat_map(single).collect();
    let singles = out.len();
    let powers = |group: &Group| if group.signed { &OF_TWO[..1] } else { &OF_TWO[..] };
    for (g, one) in FOLLOWED_GROUPS.iter().enumerate() {
        for (h, other) in FOLLOWED_GROUPS.iter().enumerate().skip(g + 1) {
            out.extend(powers(one).iter().flat_map(|a| powers(other).iter().map(move |b| vec![(g, *a), (h, *b)])));
        }
    }
    let pays = -((out.len() - singles) as f64 / singles as f64).ln();
    out.into_iter().enumerate().map(|(i, factors)| (factors, if i < singles { 0.0 } else { pays })).collect()
}

/// Values of the groups and sensitivities of the channels at each row of each run.
struct Rows {
    groups: Vec<[Vec<f64>; FOLLOWED_GROUPS.len()]>,
    /// m/s per unit of the calibration number.
    rates: Vec<[Vec<f64>; CHANNELS.len()]>,
    traits: Vec<Traits>,
}

impl Rows {
    fn of(problem: &Problem, fit: &Fit) -> Self {
        /// Step of the difference, in tolerances.
        const STEP: f64 = 0.3;
        let base = problem.fitted_tracks(&fit.state);
        let moved = CHANNELS.each_ref().map(|c| {
            let mut state = fit.state.clone();
            state.calibration[c.calibration] += STEP;
            problem.fitted_tracks(&state)
        });
        let unit = CHANNELS.each_ref().map(|c| STEP * tolerance_of(problem.vehicle, c.calibration));
        let all: Vec<Traits> = problem.runs.iter().map(|run| traits(run)).collect();
        let warmth_degc = problem.vehicle.constants.reference_temperature_degc;
        let mut rows = Self { groups: Vec::new(), rates: Vec::new(), traits: Vec::new() };
        for (k, run) in problem.runs.iter().enumerate() {
            let at = |row: usize| Row {
                input: *run.input_at_row(row, 0.0),
                track: &base[k],
                row,
                since_turn_s: all[k].since_turn_s[row],
                since_start_s: run.time_s[row] - run.time_s[0],
                warmth_degc,
            };
            let here: Vec<Row> = (0..run.time_s.len()).map(at).collect();
            rows.groups.push(std::array::from_fn(|g| here.iter().map(FOLLOWED_GROUPS[g].value).collect()));
            let rate = |c: usize| (0..here.len()).map(|r| (moved[c][k].sink_m_s[r] - base[k].sink_m_s[r]) / unit[c]).collect();
            rows.rates.push(std::array::from_fn(rate));
        }
        rows.traits = all;
        rows
    }

    /// Whitened depth that a law makes per unit of its channel.
    fn column(&self, problem: &Problem, law: &Law) -> Column {
        let acts = |down: bool| match law.legs {
            Legs::Both => true,
            Legs::Dives => down,
            Legs::Climbs => !down,
        };
        problem.rate_column(&|k, row| {
            if !acts(self.traits[k].down[row]) {
                return 0.0;
            }
            law.factors.iter().fold(self.rates[k][law.channel][row], |v, (g, e)| {
                let x = self.groups[k][*g][row];
                v * x.abs().powf(*e) * if FOLLOWED_GROUPS[*g].signed { x.signum() } else { 1.0 }
            })
        })
    }
}

/// Laws that a fit's residual does not tell from the best, best first; none where none is likelier than what models are usually wrong by.
#[must_use]
pub fn laws(problem: &Problem, fit: &Fit) -> Vec<Law> {
    let Some(linearisation) = fit.linearisation() else { return Vec::new() };
    let rows = Rows::of(problem, fit);
    let whitened_m_s = whitened_m_s(problem, &rows.traits);
    let mut all: Vec<(f64, f64, Law)> = Vec::new();
    for (channel, acts) in CHANNELS.iter().enumerate() {
        for legs in [Legs::Both, Legs::Dives, Legs::Climbs] {
            for (factors, pays) in products() {
                let mut law = Law { channel, legs, factors, log_bayes: f64::NAN, size: (0.0, 0.0) };
                let form = Form::new(&[&rows.column(problem, &law)], &linearisation, whitened_m_s);
                let (gram, with) = (form.projected.gram()[(0, 0)], form.projected.match_[0]);
                if gram > 0.0 && with.is_finite() {
                    let shown = acts.shown.0;
                    law.size = (shown * with / gram, shown / gram.sqrt());
                    all.push((0.5 * with * with / gram + pays, pays, law));
                }
            }
        }
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.truncate(RANKED);
    let weigh = |(_, pays, law): (f64, f64, Law)| {
        let form = Form::new(&[&rows.column(problem, &law)], &linearisation, whitened_m_s);
        Law { log_bayes: unknown_against_usual(&[form]).0 + pays, ..law }
    };
    let mut ranked: Vec<Law> = all.into_iter().map(weigh).collect();
    ranked.sort_by(|a, b| b.log_bayes.total_cmp(&a.log_bayes));
    let best = ranked.first().map_or(f64::NEG_INFINITY, |l| l.log_bayes);
    ranked.retain(|l| l.log_bayes > 0.0 && l.log_bayes > best - ONE_CLASS);
    ranked
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(channel: usize, legs: Legs, factors: &[(usize, f64)]) -> Law {
        Law { channel, legs, factors: factors.to_vec(), log_bayes: 9.0, size: (30.0, 5.0) }
    }

    #[test]
    fn a_class_is_said_with_its_powers_and_an_expression_that_add_takes() {
        let class = [law(0, Legs::Both, &[(4, 1.0)]), law(0, Legs::Both, &[(4, 2.0)]), law(2, Legs::Both, &[(3, 1.0)])];
        assert_eq!(
            in_words(&class),
            "drag follows roll^1 to 2: +30.00 (+21.77 to +38.23) % of CD0 at 0.5 rad, or weight follows temperature: +30.00 (+21.77 to +38.23) cm3 of volume at 10 K; `glider add 'cd += k*(abs(roll)/0.5)'` fits it"
        );
    }

    #[test]
    fn validate_every_expression_is_one() {
        let mut known = 0;
        for channel in 0..CHANNELS.len() {
            for legs in [Legs::Both, Legs::Dives, Legs::Climbs] {
                for (factors, _) in products() {
                    let Some(text) = law(channel, legs, &factors).expression() else { continue };
                    assert!(logs::vehicle::expression::parse(&text).is_ok(), "{text}");
                    known += 1;
                }
            }
        }
        assert!(known > 50, "{known}");
    }
}

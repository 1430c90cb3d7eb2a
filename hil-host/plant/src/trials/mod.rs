//! Sealed test cases: flights with something hidden in them, in the format `glider-trial/1`.
//!
//! Which question this answers: would a tool that compares a nominal model with a
//! flight name the effect that nature added, stay silent when nothing was added,
//! and admit it when the effect is in no catalogue? A case is a vehicle file, a
//! log, and a truth that the tool must not see. Everything follows from
//! `(seed, index)`: the same numbers give the same bytes.
//!
//! The force law, integrator, ocean and sensors here are written apart from the
//! models that are judged with them, and nature's forms differ from the usual
//! ones on purpose (no inverse crime). [`mod@reference`] is a plain reading of the
//! format's nominal model and error metric, used to size the effects and to
//! check the generator, not by it.
//!
//! Not covered: leaks that end a mission, actuator faults, surface waves,
//! currents that change within a segment.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

mod between_dives;
pub mod catalogue;
pub mod files;
mod generate;
pub mod hidden;
pub mod mission;
mod motion;
pub mod nature;
pub mod ocean;
pub mod orders;
pub mod outside;
pub mod reference;
pub mod sensors;
pub mod small_structure;
pub mod twin;
pub mod vehicle;
pub mod voyage;

use catalogue::{Effect, Strength};
pub use generate::{generate, generate_flown, generate_natural, generate_scattered, generate_sized};
use hidden::Hidden;
pub use nature::Banking;
use nature::Nature;
use ocean::Colour;
use outside::Outside;
pub use sensors::Row;
use vehicle::{Nominal, Scatter};

/// Segments per trial (format, section 1).
pub const SEGMENTS: usize = 8;

/// Where the trial was flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Site {
    /// 3 to 27 m, two yos per segment.
    Lake,
    /// Surface to 200 m, one yo per segment.
    Sea,
}

impl Site {
    /// Name in the vehicle file.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Lake => "lake",
            Self::Sea => "sea",
        }
    }
}

/// Wing set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Wing {
    /// Aspect ratio 5.536.
    Standard,
    /// Aspect ratio 0.3155.
    LowAspectRatio,
}

impl Wing {
    /// Name in the vehicle file.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Standard => "standard",
            Self::LowAspectRatio => "low_ar",
        }
    }

    /// Shallowest pitch the wing can hold in steady flight with some margin, degrees (below it the nominal polar has no
    /// steady glide at small angle of attack; format's examples fly from 13 and 16.5 degrees).
    fn lowest_pitch_deg(self) -> f64 {
        match self {
            Self::Standard => 12.0,
            Self::LowAspectRatio => 15.5,
        }
    }
}

/// What kind of truth a case hides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Kind {
    /// Nothing but calibration scatter.
    Clean,
    /// One effect of the vocabulary.
    Single,
    /// Two of them.
    Pair,
    /// One effect outside the vocabulary.
    Off,
}

impl Kind {
    /// Name in the truth file and on the command line.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::Clean => "clean",
            Self::Single => "single",
            Self::Pair => "pair",
            Self::Off => "off",
        }
    }
}

/// What to hide in one case.
#[derive(Clone, Debug)]
pub struct Spec {
    /// Site.
    pub site: Site,
    /// Wing set.
    pub wing: Wing,
    /// Kind; decides which of the two lists is used.
    pub kind: Kind,
    /// Vocabulary effects (none, one or two).
    pub effects: Vec<Effect>,
    /// Effect outside the vocabulary.
    pub outside: Option<Outside>,
    /// Size.
    pub strength: Option<Strength>,
    /// Whether the body does what real ones do and the format's nominal model leaves out, and is seen at it: it banks so, its hull
    /// follows the water's temperature half a minute late, and it turns twelve times in a yo banked by 20 degrees.
    pub lifelike: Option<Banking>,
}

impl Spec {
    /// Nothing hidden but calibration scatter.
    #[must_use]
    pub fn clean(site: Site, wing: Wing) -> Self {
        Self { site, wing, kind: Kind::Clean, effects: Vec::new(), outside: None, strength: None, lifelike: None }
    }

    /// One effect of the vocabulary hidden.
    #[must_use]
    pub fn single(site: Site, wing: Wing, effect: Effect, strength: Strength) -> Self {
        Self { kind: Kind::Single, effects: vec![effect], strength: Some(strength), ..Self::clean(site, wing) }
    }
}

/// The truth of a case.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Kind.
    pub kind: Kind,
    /// Size class.
    pub strength: Option<Strength>,
    /// Effects with values.
    pub hidden: Vec<Hidden>,
    /// Calibration scatter.
    pub scatter: Scatter,
    /// The vehicle that flew.
    pub nature: Nature,
    /// Background.
    pub colour: Colour,
    /// True rms of the background, m/s.
    pub background_rms_m_s: f64,
    /// True correlation time, s.
    pub background_time_s: f64,
    /// Zero error of the pressure sensor, dbar.
    pub pressure_zero_dbar: f64,
    /// List, rad.
    pub list_rad: f64,
    /// Duration of the trial, days.
    pub days: f64,
    /// Share of the time under water that each segment flew beyond the angle of attack where the given law ends.
    pub stalled_share: [f64; SEGMENTS],
}

/// A sealed case.
#[derive(Clone, Debug)]
pub struct Case {
    /// Name, without a hint of the truth.
    pub name: String,
    /// The vehicle file.
    pub vehicle: Nominal,
    /// The log.
    pub rows: Vec<Row>,
    /// What is hidden.
    pub truth: Truth,
}

/// A stream of random numbers for one part of one case.
fn stream(seed: u64, index: u64, part: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ index.wrapping_mul(0xD1B5_4A32_D192_ED03));
    rng.set_stream(part);
    rng
}

/// The plan for `cases` cases: per twenty, four clean, nine singles, four pairs, three outside the vocabulary;
/// sites and wings alternate, names and strengths are dealt from shuffled decks so that all come up.
#[must_use]
pub fn plan(cases: usize, seed: u64, only: Option<Kind>) -> Vec<Spec> {
    let mut rng = stream(seed, u64::MAX, 0);
    let mut deck: Vec<(Effect, Strength)> = Vec::new();
    let mut outside_deck: Vec<(Outside, Strength)> = Vec::new();
    let mut specs = Vec::with_capacity(cases);
    const PATTERN: [Kind; 20] = {
        use Kind::{Clean as C, Off as O, Pair as P, Single as S};
        [S, C, P, S, O, S, C, S, P, S, S, O, C, P, S, S, C, O, P, S]
    };
    for i in 0..cases {
        let kind = only.unwrap_or(PATTERN[i % PATTERN.len()]);
        let wing = if (i / 2 + i / 20) % 2 == 0 { Wing::Standard } else { Wing::LowAspectRatio };
        let site = if (i + i / 20) % 2 == 0 { Site::Lake } else { Site::Sea };
        let mut spec = Spec { kind, ..Spec::clean(site, wing) };
        match kind {
            Kind::Clean => {}
            Kind::Single => {
                let (effect, strength) = draw_effect(&mut deck, site, wing, None, None, &mut rng);
                spec.effects.push(effect);
                spec.strength = Some(strength);
            }
            Kind::Pair => {
                let (first, strength) = draw_effect(&mut deck, site, wing, None, None, &mut rng);
                let (second, _) = draw_effect(&mut deck, site, wing, Some(first), Some(strength), &mut rng);
                spec.effects.extend([first, second]);
                spec.strength = Some(strength);
            }
            Kind::Off => {
                if outside_deck.is_empty() {
                    outside_deck = Outside::DEALT.iter().flat_map(|&o| [(o, Strength::Medium), (o, Strength::Strong)]).collect();
                    shuffle(&mut outside_deck, &mut rng);
                }
                if let Some((o, s)) = outside_deck.pop() {
                    spec.outside = Some(o);
                    spec.strength = Some(s);
                }
            }
        }
        specs.push(spec);
    }
    specs
}

fn shuffle<T>(items: &mut [T], rng: &mut ChaCha8Rng) {
    for i in (1..items.len()).rev() {
        items.swap(i, rng.random_range(0..=i));
    }
}

fn draw_effect(
    deck: &mut Vec<(Effect, Strength)>,
    site: Site,
    wing: Wing,
    not: Option<Effect>,
    strength: Option<Strength>,
    rng: &mut ChaCha8Rng,
) -> (Effect, Strength) {
    let fits = |&(e, s): &(Effect, Strength)| e.makes_sense(site, wing) && Some(e) != not && strength.is_none_or(|want| want == s);
    loop {
        if let Some(i) = deck.iter().rposition(fits) {
            return deck.remove(i);
        }
        let mut fresh: Vec<_> = Effect::ALL.iter().flat_map(|&e| Strength::ALL.map(|s| (e, s))).collect();
        shuffle(&mut fresh, rng);
        fresh.append(deck);
        *deck = fresh;
    }
}

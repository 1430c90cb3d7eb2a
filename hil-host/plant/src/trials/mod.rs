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

pub mod catalogue;
pub mod files;
pub mod nature;
pub mod ocean;
pub mod reference;
pub mod sensors;
pub mod small_structure;
pub mod twin;
pub mod vehicle;
pub mod voyage;

use catalogue::{Effect, Hidden, Outside, Strength};
pub use nature::Banking;
use nature::{Nature, Stall};
use ocean::{Colour, Column, Ocean};
use sensors::{Row, Zero};
use small_structure::SmallStructure;
use vehicle::{Nominal, Scatter};
use voyage::{Moment, Orders, Voyage};

/// Segments per trial (format, section 1).
pub const SEGMENTS: usize = 8;

/// Share of the time that a stall with hysteresis is to be flown on either branch where both are possible.
const ON_EITHER_BRANCH: f64 = 0.1;

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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
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

/// Lag of a lifelike hull's temperature, s (6 mm of aluminium), and its bank, rad.
const HULL_LAG_S: f64 = 30.0;
const BANK_RAD: f64 = 0.35;

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
        let mut spec = Spec { site, wing, kind, effects: Vec::new(), outside: None, strength: None, lifelike: None };
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

/// Makes case `index` of a seed.
#[must_use]
pub fn generate(spec: &Spec, seed: u64, index: usize) -> Case {
    generate_sized(spec, seed, index, None)
}

/// The same case with the small structure that every real flight has ([`small_structure`]).
#[must_use]
pub fn generate_natural(spec: &Spec, seed: u64, index: usize) -> Case {
    generate_all(spec, seed, index, None, None, true)
}

/// Flies the segments one after the other, and shows each.
fn fly_each(voyage: &Voyage, orders: &mut [Orders], seed: u64, i: u64, mut show: impl FnMut(usize, &Orders, &[Moment])) {
    let mut end_s = 0.0;
    for (k, order) in orders.iter_mut().enumerate() {
        order.start_s = ((end_s + order.gap_s) / 0.05).round() * 0.05;
        let moments = voyage.fly(k, order, voyage::STEP_S, &mut stream(seed, i, 100 + k as u64));
        end_s = order.start_s + moments.last().map_or(0.0, |m| m.t);
        show(k, order, &moments);
    }
}

/// A stall with hysteresis that is flown on one branch only is a plain stall, and one that never ends a smaller lift slope: both are in
/// the vocabulary. So its angle is raised until the flight has both branches, or is as near to that as these orders come. Returns the
/// shares of the time on either branch too.
fn flown_on_both_branches(first: Stall, mut shares: impl FnMut(Stall) -> [f64; 2]) -> (Stall, [f64; 2]) {
    let mut best = (first, [0.0; 2]);
    for factor in [1.0, 1.15, 1.3, 1.45, 1.6, 1.8, 2.0] {
        let stall = Stall { angle: factor * first.angle, ..first };
        let flown = shares(stall);
        let less = |s: [f64; 2]| s[0].min(s[1]);
        if less(flown) > less(best.1) {
            best = (stall, flown);
        }
        if less(best.1) >= ON_EITHER_BRANCH {
            break;
        }
    }
    best
}

/// Makes a case with a size of its own instead of the strength's (relative to medium): for sizing.
#[must_use]
pub fn generate_sized(spec: &Spec, seed: u64, index: usize, size: Option<f64>) -> Case {
    generate_flown(spec, seed, index, size, None)
}

/// The same vehicle and water on a flight of one's own: one yo per leg of (pitch rad, ballast stroke m³), at most [`SEGMENTS`] legs.
#[must_use]
pub fn generate_flown(spec: &Spec, seed: u64, index: usize, size: Option<f64>, legs: Option<&[[f64; 2]]>) -> Case {
    generate_all(spec, seed, index, size, legs, false)
}

fn generate_all(spec: &Spec, seed: u64, index: usize, size: Option<f64>, legs: Option<&[[f64; 2]]>, natural: bool) -> Case {
    let i = index as u64;
    let mut rng = stream(seed, i, 1);
    let has_speed = rng.random_bool(0.4);
    let depth_guess = if spec.site == Site::Lake { 39.0 } else { 262.0 };
    let column = Column::draw(spec.site, depth_guess, 9.81, &mut rng);
    let middle = column.density(if spec.site == Site::Lake { 15.0 } else { 100.0 });
    // Trim: neutral at mid-depth with the ballast at mid position, as trimmed in the tank.
    let mut nominal = Nominal::draw(spec.site, spec.wing, middle, has_speed, &mut rng);
    let (p, t) = (column.pressure(nominal.water_depth_m * 0.45), column.temperature(nominal.water_depth_m * 0.45));
    let shrink = 1.0 - nominal.compressibility * p + nominal.thermal_expansion * (t - nominal.reference_temperature_degc);
    nominal.hull_volume_m3 = (nominal.hull_volume_m3 / shrink * 1e8).round() / 1e8;
    let scatter = Scatter::draw(&mut rng);
    let slow = spec.effects.iter().any(|e| matches!(e, Effect::BiofoulingDrag | Effect::PressureDrift));
    let days = match (spec.site, slow) {
        (Site::Lake, false) => libm::exp(rng.random_range(libm::log(0.8)..libm::log(12.0))),
        (Site::Lake, true) => rng.random_range(6.0..15.0),
        (Site::Sea, _) => rng.random_range(12.0..30.0),
    };
    let mut nature = Nature { banking: spec.lifelike, ..Nature::new(&nominal, &scatter) };
    if spec.lifelike.is_some() {
        (nature.off.hull_thermal_lag_s, nature.off.hull_thermal_gain) = (HULL_LAG_S, 1.0);
    }
    let mut fine_rng = stream(seed, i, 4);
    if natural {
        nature.small = Some(SmallStructure::draw(spec.site, &mut fine_rng));
        nominal.sensors.period_s = SmallStructure::period_s(spec.site, nominal.sensors.period_s, &mut fine_rng);
    }
    let colour =
        [Colour::Markov, Colour::Markov, Colour::Markov, Colour::WaveLike, Colour::OneOverF, Colour::PerDive][rng.random_range(0..6)];
    let background_rms = nominal.background_rms_m_s * rng.random_range(0.8..1.2);
    let background_time = nominal.background_time_s * rng.random_range(0.75..1.3);
    let current = if spec.site == Site::Lake {
        [[0.0; 2]; SEGMENTS]
    } else {
        let mean = [0.07 * vehicle::normal_within_2_sigma(&mut rng), 0.07 * vehicle::normal_within_2_sigma(&mut rng)];
        core::array::from_fn(|_| core::array::from_fn(|k| mean[k] + 0.06 * vehicle::normal_within_2_sigma(&mut rng)))
    };
    let mut ocean = Ocean {
        column,
        depth_m: nominal.water_depth_m,
        colour,
        rms: background_rms,
        time_s: background_time,
        wave: None,
        upwelling: [0.0, 1.0],
        current,
        current_profile: [rng.random_range(40.0..120.0), rng.random_range(0.3..0.9)],
    };
    let mut effect_rng = stream(seed, i, 2);
    // Each partner of a pair is a little smaller, so that the pair as a whole has the stated size.
    let share = if spec.effects.len() > 1 { 0.85 } else { 1.0 };
    let mut hidden = Vec::new();
    for &effect in &spec.effects {
        let scale = share * size.or(spec.strength.map(|s| effect.factor(s))).unwrap_or(0.0);
        hidden.push(catalogue::apply(effect, scale, spec.site, spec.wing, days, &scatter, &mut nature, &mut ocean, &mut effect_rng));
    }
    if let Some(outside) = spec.outside {
        let scale = size.or(spec.strength.map(Strength::factor)).unwrap_or(0.0);
        hidden.push(outside.apply(scale, spec.site, spec.wing, &mut nature, &mut effect_rng));
    }
    let list = 0.0175 * vehicle::normal_within_2_sigma(&mut rng) * 0.7;
    let mut zero = Zero { pressure_dbar: rng.random_range(-0.18..0.18) };
    if natural {
        zero.pressure_dbar = SmallStructure::pressure_zero_dbar(&mut fine_rng);
    }
    let mut orders = Orders::draw(spec.site, spec.wing.lowest_pitch_deg(), days, &mut stream(seed, i, 3));
    if spec.lifelike.is_some() {
        orders.iter_mut().for_each(|o| o.turn_often(BANK_RAD));
    }
    if let Some(legs) = legs {
        orders.truncate(legs.len());
        for (order, [pitch, stroke]) in orders.iter_mut().zip(legs) {
            (order.pitch, order.ballast, order.yos) = ([*pitch; 2], *stroke, 1);
        }
    }
    if let Some(first) = nature.stall.filter(|s| s.hysteresis > 0.0) {
        let (stall, branches) = flown_on_both_branches(first, |stall| {
            nature.stall = Some(stall);
            let voyage = Voyage { nominal: &nominal, nature: &nature, ocean: &ocean, list };
            let mut shares = [0.0; 2];
            fly_each(&voyage, &mut orders, seed, i, |_, _, moments| {
                let flown = voyage::branches(moments, &stall);
                shares = [0, 1].map(|k| shares[k] + flown[k] / SEGMENTS as f64);
            });
            shares
        });
        nature.stall = Some(stall);
        if let Some(h) = hidden.last_mut() {
            h.form["angle_rad"] = stall.angle.into();
            h.form["share_attached_and_separated"] = branches.as_slice().into();
        }
    }
    let voyage = Voyage { nominal: &nominal, nature: &nature, ocean: &ocean, list };
    let mut rows = Vec::new();
    let mut stalled_share = [0.0; SEGMENTS];
    fly_each(&voyage, &mut orders, seed, i, |k, order, moments| {
        stalled_share[k] = voyage::stalled_share(moments);
        rows.extend(sensors::sample(&voyage, &scatter, zero, k, order, moments, &mut stream(seed, i, 200 + k as u64)));
    });
    Case {
        name: format!("case_{seed}_{index:04}"),
        rows,
        truth: Truth {
            kind: spec.kind,
            strength: spec.strength,
            hidden,
            scatter,
            nature,
            colour,
            background_rms_m_s: background_rms,
            background_time_s: background_time,
            pressure_zero_dbar: zero.pressure_dbar,
            list_rad: list,
            days,
            stalled_share,
        },
        vehicle: nominal,
    }
}

//! Makes a case: draws vehicle, water and orders, hides what is to be hidden, flies and samples.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::between_dives::Scatter as BetweenDives;
use super::catalogue::{Effect, Strength};
use super::hidden::{Hidden, Reality};
use super::nature::{Nature, Stall};
use super::ocean::{Colour, Column, Ocean};
use super::orders::Orders;
use super::sensors::Zero;
use super::small_structure::SmallStructure;
use super::vehicle::{Nominal, Scatter, normal_within_2_sigma};
use super::voyage::{self, Moment, Voyage};
use super::{Case, SEGMENTS, Site, Spec, Truth, sensors, stream};

/// Lag of a lifelike hull's temperature, s (6 mm of aluminium), and its bank, rad.
const HULL_LAG_S: f64 = 30.0;
const BANK_RAD: f64 = 0.35;

/// Share of the time that a stall with hysteresis is to be flown on either branch where both are possible.
const ON_EITHER_BRANCH: f64 = 0.1;

/// Makes case `index` of a seed.
#[must_use]
pub fn generate(spec: &Spec, seed: u64, index: usize) -> Case {
    generate_sized(spec, seed, index, None)
}

/// The same case with the small structure that every real flight has ([`super::small_structure`]).
#[must_use]
pub fn generate_natural(spec: &Spec, seed: u64, index: usize) -> Case {
    generate_all(spec, seed, index, None, None, World::Natural)
}

/// The same on one of the vehicle's days: its numbers scatter about those of the dives before it ([`super::mission::before`]).
#[must_use]
pub fn generate_scattered(spec: &Spec, seed: u64, index: usize) -> Case {
    generate_all(spec, seed, index, None, None, World::Scattered)
}

/// How much of what real flights have is in a trial.
#[derive(Clone, Copy, PartialEq)]
enum World {
    /// Water motion and noise.
    Plain,
    /// And small structure, clock lags, sensor zeros.
    Natural,
    /// And what a vehicle differs by from day to day.
    Scattered,
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
    generate_all(spec, seed, index, size, legs, World::Plain)
}

/// A vehicle as its file has it, trimmed at mid-depth in this column: neutral with the ballast at mid position, as in the tank.
fn draw_vehicle(spec: &Spec, column: &Column, has_speed: bool, rng: &mut ChaCha8Rng) -> Nominal {
    let middle = column.density(if spec.site == Site::Lake { 15.0 } else { 100.0 });
    let mut nominal = Nominal::draw(spec.site, spec.wing, middle, has_speed, rng);
    let (p, t) = (column.pressure(nominal.water_depth_m * 0.45), column.temperature(nominal.water_depth_m * 0.45));
    let shrink = 1.0 - nominal.compressibility * p + nominal.thermal_expansion * (t - nominal.reference_temperature_degc);
    nominal.hull_volume_m3 = (nominal.hull_volume_m3 / shrink * 1e8).round() / 1e8;
    nominal
}

/// Duration, day: longer where something slow is hidden.
fn draw_days(spec: &Spec, rng: &mut ChaCha8Rng) -> f64 {
    let slow = spec.effects.iter().any(|e| matches!(e, Effect::BiofoulingDrag | Effect::PressureDrift));
    match (spec.site, slow) {
        (Site::Lake, false) => libm::exp(rng.random_range(libm::log(0.8)..libm::log(12.0))),
        (Site::Lake, true) => rng.random_range(6.0..15.0),
        (Site::Sea, _) => rng.random_range(12.0..30.0),
    }
}

/// The water with its background motion and current, nothing hidden in it yet.
fn draw_ocean(site: Site, column: Column, nominal: &Nominal, rng: &mut ChaCha8Rng) -> Ocean {
    let colour =
        [Colour::Markov, Colour::Markov, Colour::Markov, Colour::WaveLike, Colour::OneOverF, Colour::PerDive][rng.random_range(0..6)];
    let rms = nominal.background_rms_m_s * rng.random_range(0.8..1.2);
    let time_s = nominal.background_time_s * rng.random_range(0.75..1.3);
    let current = if site == Site::Lake {
        [[0.0; 2]; SEGMENTS]
    } else {
        let mean = [0.07 * normal_within_2_sigma(rng), 0.07 * normal_within_2_sigma(rng)];
        core::array::from_fn(|_| core::array::from_fn(|k| mean[k] + 0.06 * normal_within_2_sigma(rng)))
    };
    Ocean {
        column,
        depth_m: nominal.water_depth_m,
        colour,
        rms,
        time_s,
        wave: None,
        upwelling: [0.0, 1.0],
        current,
        current_profile: [rng.random_range(40.0..120.0), rng.random_range(0.3..0.9)],
    }
}

/// Puts into vehicle and water what the case hides.
fn hide(spec: &Spec, size: Option<f64>, reality: &mut Reality<'_>, rng: &mut ChaCha8Rng) -> Vec<Hidden> {
    // Each partner of a pair is a little smaller, so that the pair as a whole has the stated size.
    let share = if spec.effects.len() > 1 { 0.85 } else { 1.0 };
    let mut hidden = Vec::new();
    for &effect in &spec.effects {
        let scale = share * size.or(spec.strength.map(|s| effect.factor(s))).unwrap_or(0.0);
        hidden.push(reality.hide(effect, scale, rng));
    }
    if let Some(outside) = spec.outside {
        let scale = size.or(spec.strength.map(Strength::factor)).unwrap_or(0.0);
        hidden.push(outside.apply(scale, spec.site, spec.wing, reality.nature, rng));
    }
    hidden
}

/// The eight segments as commanded, or one's own legs in their place.
fn draw_orders(spec: &Spec, days: f64, legs: Option<&[[f64; 2]]>, rng: &mut ChaCha8Rng) -> Vec<Orders> {
    let mut orders = Orders::draw(spec.site, spec.wing.lowest_pitch_deg(), days, rng);
    if spec.lifelike.is_some() {
        orders.iter_mut().for_each(|o| o.turn_often(BANK_RAD));
    }
    if let Some(legs) = legs {
        orders.truncate(legs.len());
        for (order, [pitch, stroke]) in orders.iter_mut().zip(legs) {
            (order.pitch, order.ballast, order.yos) = ([*pitch; 2], *stroke, 1);
        }
    }
    orders
}

/// Raises the angle of a stall with hysteresis until the flight has both branches, and says so in the truth.
fn fly_both_branches(
    (seed, i): (u64, u64),
    nominal: &Nominal,
    ocean: &Ocean,
    list: f64,
    nature: &mut Nature,
    orders: &mut [Orders],
    hidden: &mut [Hidden],
) {
    let Some(first) = nature.stall.filter(|s| s.hysteresis > 0.0) else { return };
    let (stall, branches) = flown_on_both_branches(first, |stall| {
        nature.stall = Some(stall);
        let voyage = Voyage { nominal, nature: &*nature, ocean, list };
        let mut shares = [0.0; 2];
        fly_each(&voyage, orders, seed, i, |_, _, moments| {
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

/// A vehicle and its water as drawn, nothing hidden in them yet, and the streams that go on.
pub(super) struct Drawn {
    rng: ChaCha8Rng,
    pub(super) fine_rng: ChaCha8Rng,
    pub(super) nominal: Nominal,
    pub(super) scatter: Scatter,
    pub(super) nature: Nature,
    pub(super) ocean: Ocean,
    days: f64,
}

/// Draws case `index` of a seed; `natural` with the small structure that every real flight has.
pub(super) fn draw(spec: &Spec, seed: u64, index: usize, natural: bool) -> Drawn {
    let i = index as u64;
    let mut rng = stream(seed, i, 1);
    let mut fine_rng = stream(seed, i, 4);
    let has_speed = rng.random_bool(0.4);
    let depth_guess = if spec.site == Site::Lake { 39.0 } else { 262.0 };
    let column = Column::draw(spec.site, depth_guess, 9.81, &mut rng);
    let mut nominal = draw_vehicle(spec, &column, has_speed, &mut rng);
    let scatter = Scatter::draw(&mut rng);
    let days = draw_days(spec, &mut rng);
    let mut nature = Nature { banking: spec.lifelike, ..Nature::new(&nominal, &scatter) };
    if spec.lifelike.is_some() {
        (nature.off.hull_thermal_lag_s, nature.off.hull_thermal_gain) = (HULL_LAG_S, 1.0);
    }
    if natural {
        nature.small = Some(SmallStructure::draw(spec.site, &mut fine_rng));
        nominal.sensors.period_s = SmallStructure::period_s(spec.site, nominal.sensors.period_s, &mut fine_rng);
    }
    let ocean = draw_ocean(spec.site, column, &nominal, &mut rng);
    Drawn { rng, fine_rng, nominal, scatter, nature, ocean, days }
}

fn generate_all(spec: &Spec, seed: u64, index: usize, size: Option<f64>, legs: Option<&[[f64; 2]]>, world: World) -> Case {
    let i = index as u64;
    let natural = world != World::Plain;
    let Drawn { mut rng, mut fine_rng, nominal, scatter, mut nature, mut ocean, days } = draw(spec, seed, index, natural);
    let rng = &mut rng;
    if world == World::Scattered {
        BetweenDives::of(seed, i).0.apply(&mut nature, &mut stream(seed, i, 7));
    }
    let mut reality = Reality { site: spec.site, wing: spec.wing, days, scatter: &scatter, nature: &mut nature, ocean: &mut ocean };
    let mut hidden = hide(spec, size, &mut reality, &mut stream(seed, i, 2));
    let list = 0.0175 * normal_within_2_sigma(rng) * 0.7;
    let mut zero = Zero { pressure_dbar: rng.random_range(-0.18..0.18) };
    if natural {
        zero.pressure_dbar = SmallStructure::pressure_zero_dbar(&mut fine_rng);
    }
    let mut orders = draw_orders(spec, days, legs, &mut stream(seed, i, 3));
    fly_both_branches((seed, i), &nominal, &ocean, list, &mut nature, &mut orders, &mut hidden);
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
            colour: ocean.colour,
            background_rms_m_s: ocean.rms,
            background_time_s: ocean.time_s,
            pressure_zero_dbar: zero.pressure_dbar,
            list_rad: list,
            days,
            stalled_share,
        },
        vehicle: nominal,
    }
}

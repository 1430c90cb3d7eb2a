//! A mission of many dives by one vehicle in which something changes at a dive that nobody is told of.
//!
//! The vehicle, its water, its small structure, clock lag and sensor zeros are those of the natural trial of the same seed and index
//! ([`super::generate_natural`]), which is the flight that the vehicle is calibrated on. The mission is another deployment: trimmed anew.
//! Most dives are flown at one pitch and stroke, one in `SECOND_EVERY` at a second, as a pilot who compares does.
//!
//! No two dives of a vehicle are quite alike: drag, lift, trim, pitch zero and compressibility scatter together from dive to dive, with
//! sizes and correlations of their own for each vehicle.
//!
//! Not covered: settings that drift over a mission, seasons, more than one change.

use rand::RngExt as _;
use rand_distr::StandardNormal;

use super::between_dives::Scatter;
use super::generate::{Drawn, draw};
use super::nature::Nature;
use super::orders::Orders;
use super::sensors::{self, Zero};
use super::small_structure::SmallStructure;
use super::vehicle::Nominal;
use super::vehicle::normal_within_2_sigma;
use super::voyage::{self, Voyage};
use super::{Row, SEGMENTS, Site, Spec, stream};

/// One dive in so many is flown at the second setting.
const SECOND_EVERY: usize = 3;
/// Time at the surface between dives, s.
const PAUSE_S: [f64; 2] = [600.0, 5400.0];
/// How well a new trim meets that of the deployment before, 1 sigma, cm³ (guess: a tank and a scale).
const RETRIMMED_CC: f64 = 10.0;
/// Pitch of the first setting, and what the second is steeper by, degrees: as Slocums are flown.
const PITCH_DEG: [f64; 2] = [19.0, 27.0];
const STEEPER_DEG: [f64; 2] = [5.0, 10.0];
/// Ballast strokes, cm³: enough to climb out of a light surface layer with some trim lost.
const STROKE_CC: [f64; 2] = [215.0, 255.0];

/// What changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// Nothing.
    Nothing,
    /// CD0 at once, relative.
    Drag(f64),
    /// CD0 by a share that grows from nothing to this at the last dive.
    Fouling(f64),
    /// Displaced volume at once, cm³.
    Trim(f64),
    /// Displaced volume lost, growing from nothing to this at the last dive, cm³.
    Leak(f64),
    /// Linear lift at once, relative.
    Lift(f64),
    /// Zero of the pitch sensor at once, rad.
    PitchZero(f64),
    /// Zero of the pressure sensor at once, dbar.
    PressureZero(f64),
}

/// A mission.
#[derive(Clone, Debug)]
pub struct Mission {
    /// The vehicle file.
    pub vehicle: Nominal,
    /// The log: one segment a dive.
    pub rows: Vec<Row>,
    /// The vehicle before anything changed.
    pub nature: Nature,
    /// Start of each dive, days.
    pub days: Vec<f64>,
}

/// The vehicle at a dive that is this share of the way from the onset to the end.
fn changed(nature: &Nature, change: Change, share: f64) -> Nature {
    let mut out = nature.clone();
    match change {
        Change::Nothing | Change::PressureZero(_) => {}
        Change::Drag(by) => out.cd0 *= 1.0 + by,
        Change::Fouling(by) => out.cd0 *= 1.0 + by * share,
        Change::Trim(cc) => out.volume += cc * 1e-6,
        Change::Leak(cc) => out.volume -= cc * share * 1e-6,
        Change::Lift(by) => out.lift_slope *= 1.0 + by,
        Change::PitchZero(by) => out.pitch_zero += by,
    }
    out
}

/// Flies `dives` dives; the change is there from dive `onset` on (counted from 0).
#[must_use]
pub fn fly(spec: &Spec, seed: u64, index: usize, dives: usize, change: Change, onset: usize) -> Mission {
    fly_trimmed(spec, seed, index, dives, change, onset, RETRIMMED_CC)
}

/// Healthy dives of the deployment before its [`super::generate_scattered`] trial of the same seed and index.
#[must_use]
pub fn before(spec: &Spec, seed: u64, index: usize, dives: usize) -> Mission {
    fly_trimmed(spec, seed, index, dives, Change::Nothing, 0, 0.0)
}

fn fly_trimmed(spec: &Spec, seed: u64, index: usize, dives: usize, change: Change, onset: usize, retrimmed_cc: f64) -> Mission {
    let i = index as u64;
    let Drawn { nominal, scatter, mut nature, ocean, mut fine_rng, .. } = draw(spec, seed, index, true);
    let pressure_zero_dbar = SmallStructure::pressure_zero_dbar(&mut fine_rng);
    let mut rng = stream(seed, i, 5);
    nature.volume += retrimmed_cc * 1e-6 * normal_within_2_sigma(&mut rng);
    let list = 0.012 * rng.sample::<f64, _>(StandardNormal).clamp(-2.0, 2.0);
    let first = rng.random_range(PITCH_DEG[0]..PITCH_DEG[1]);
    let steeper = first + rng.random_range(STEEPER_DEG[0]..STEEPER_DEG[1]);
    let settings = [first, steeper].map(|deg| (deg.to_radians(), rng.random_range(STROKE_CC[0]..STROKE_CC[1]) * 1e-6));
    let pauses: Vec<f64> = (0..dives).map(|_| rng.random_range(PAUSE_S[0]..PAUSE_S[1])).collect();
    let (between, mut between_rng) = Scatter::of(seed, i);
    let mut orders: Vec<Orders> = Vec::new();
    let (mut rows, mut days, mut end_s) = (Vec::new(), Vec::new(), 0.0);
    for (dive, pause_s) in pauses.into_iter().enumerate() {
        if dive % SEGMENTS == 0 {
            orders = Orders::draw(spec.site, spec.wing.lowest_pitch_deg(), 1.0, &mut stream(seed, i, 1000 + dive as u64));
        }
        let mut order = orders[dive % SEGMENTS].clone();
        let (pitch, stroke) = settings[usize::from(dive % SECOND_EVERY == SECOND_EVERY - 1)];
        (order.pitch, order.ballast) = ([pitch; 2], stroke);
        if spec.site == Site::Sea {
            order.pump = orders[0].pump;
        }
        order.start_s = ((end_s + pause_s) / 0.05).round() * 0.05;
        // Of the way from the dive before the onset to the last: growth is there from its first dive on.
        let share = (dive + 1).saturating_sub(onset) as f64 / (dives - onset.min(dives - 1)) as f64;
        let mut now = if dive >= onset { changed(&nature, change, share) } else { nature.clone() };
        between.apply(&mut now, &mut between_rng);
        let zero = match change {
            Change::PressureZero(by) if dive >= onset => Zero { pressure_dbar: pressure_zero_dbar + by },
            _ => Zero { pressure_dbar: pressure_zero_dbar },
        };
        let voyage = Voyage { nominal: &nominal, nature: &now, ocean: &ocean, list };
        let place = dive % SEGMENTS;
        let moments = voyage.fly(place, &order, voyage::STEP_S, &mut stream(seed, i, 10_000 + dive as u64));
        days.push(order.start_s / 86_400.0);
        end_s = order.start_s + moments.last().map_or(0.0, |m| m.t);
        rows.extend(sensors::sample(&voyage, &scatter, zero, dive, &order, &moments, &mut stream(seed, i, 20_000 + dive as u64)));
    }
    Mission { vehicle: nominal, rows, nature, days }
}

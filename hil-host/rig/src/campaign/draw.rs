//! Random valid missions, and the vehicle and water they are flown with: everything from one number.
//!
//! | drawn | range |
//! |---|---|
//! | vehicle | the 100 m, 200 m or 1000 m pump with its working and crush depth; either wings |
//! | legs | one to five of one to three dives (deep water: five dives in all) |
//! | band | the vehicle's whole band (3–27, 5–190, 0–1000 m) or any that `Mission::validate` accepts |
//! | goal, pitch, ballast, heading | all that `Mission::validate` accepts, its edges in one leg of eight |
//! | time | from the least that `Mission::validate` accepts to three times that |
//! | gas in the hull | 20 to 50 litres, a quarter of an hour to two hours behind the water's temperature |
//! | water | calm, or rough: internal wave, background motion, current, surface waves; bottom far below or in the altimeter's range |
//! | fitted | second depth sensor, altimeter, GPS, weight monitor: each or not |

use crate::flight::worlds;
use plant::effects::{Effect, EffectKind};
use plant::faults::{Kind, Target};
use plant::{Fault, Scenario};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use signals::{Goal, Leg, Mission, Wings};

/// Least band of a leg, m: what `Mission::validate` asks for, and what f32 may take away.
const LEAST_BAND_M: f64 = Mission::LEAST_BAND_M as f64 + 0.001;

/// Which vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Class {
    /// 100 m pump.
    Shallow,
    /// 200 m pump.
    Shelf,
    /// 1000 m pump.
    Deep,
}

/// What is fitted besides what every vehicle has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fitted {
    /// A second depth sensor.
    pub depth2: bool,
    /// An altimeter.
    pub altimeter: bool,
    /// A GPS receiver; the shore is heard without.
    pub gps: bool,
    /// A contact that says whether the drop weight is there.
    pub weight_monitor: bool,
}

/// A mission with its world.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    /// Vehicle.
    pub class: Class,
    /// Mission; valid.
    pub mission: Mission,
    /// What is fitted.
    pub fitted: Fitted,
    /// Waves, internal wave, current.
    pub rough: bool,
    /// Depth of the bottom, m.
    pub bottom_m: f64,
    seed: u64,
}

/// Random numbers of one draw.
pub(super) struct Dice(ChaCha8Rng);

impl Dice {
    pub(super) fn new(seed: u64, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Self(rng)
    }

    /// Uniform in 0..1.
    pub(super) fn unit(&mut self) -> f64 {
        f64::from(self.0.next_u32()) / 4_294_967_296.0
    }

    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(super) fn chance(&mut self, share: f64) -> bool {
        self.unit() < share
    }

    /// One of `n`, from 0.
    pub(super) fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n.saturating_sub(1))
    }

    /// Anywhere in a range, or now and then at one of its ends.
    fn within(&mut self, low: f64, high: f64, edge: bool) -> f32 {
        let value = self.between(low, high);
        let value = match (edge, self.chance(0.5)) {
            (true, true) => low,
            (true, false) => high,
            _ => value,
        };
        // Of the two neighbours the one inside.
        (value as f32).clamp(low as f32, high as f32)
    }
}

impl Class {
    const ALL: [Self; 3] = [Self::Shallow, Self::Shelf, Self::Deep];

    /// Deepest depth of a leg, the band most flown, m.
    const fn depths_m(self) -> (f64, (f64, f64)) {
        match self {
            Self::Shallow => (100.0, (3.0, 27.0)),
            Self::Shelf => (200.0, (5.0, 190.0)),
            Self::Deep => (1000.0, (0.0, 1000.0)),
        }
    }

    /// Shallowest depth of a mission's deepest leg, m: a mission less deep is another vehicle's.
    const fn deeper_than_m(self) -> f64 {
        match self {
            Self::Shallow => 0.0,
            Self::Shelf => 100.0,
            Self::Deep => 200.0,
        }
    }
}

fn leg(dice: &mut Dice, class: Class, pump_m3: f64) -> Leg {
    let (deepest, usual) = class.depths_m();
    let edge = dice.chance(0.125);
    let (low, high) = if dice.chance(0.35) {
        usual
    } else {
        let a = dice.between(0.0, deepest - LEAST_BAND_M);
        // Short bands as often as wide ones.
        let width = LEAST_BAND_M * ((deepest - a) / LEAST_BAND_M).powf(dice.unit());
        (a, (a + width).min(deepest))
    };
    let goal = match dice.below(5) {
        0 => Goal::BestGlide,
        1 => Goal::BestSpeed,
        2 => Goal::BestRange { hotel_w: dice.within(0.0, 100.0, edge) },
        3 => Goal::Current { along_track_m_s: dice.within(-1.0, 1.0, edge) },
        _ => Goal::FixedPitch {
            pitch_rad: dice.within(f64::from(*Mission::PITCHES_RAD.start()), f64::from(*Mission::PITCHES_RAD.end()), edge),
        },
    };
    let dives = if class == Class::Deep { 1 } else { 1 + dice.below(3) as u16 };
    Leg {
        dives,
        depth_min_m: low as f32,
        depth_max_m: high as f32,
        goal,
        ballast_m3: dice.within(f64::from(Mission::LEAST_BALLAST_SHARE) * pump_m3 * 1.000_001, pump_m3, edge),
        heading_rad: dice.within(-7.0, 7.0, edge),
    }
}

impl Draw {
    /// The mission of this number.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let mut dice = Dice::new(seed, 11);
        let class = Class::ALL[dice.below(Class::ALL.len())];
        let wings = if dice.chance(0.5) { Wings::Standard } else { Wings::LowAspectRatio };
        let (deepest, _) = class.depths_m();
        // The vehicle by a leg as deep as it goes; its pump bounds the ballast.
        let by_depth = Leg { depth_max_m: deepest as f32, ..Leg::default() };
        let vehicle = worlds::config(&Mission { legs: [by_depth].into_iter().collect(), ..Mission::default() });
        let pump_m3 = f64::from(vehicle.pump_m3);
        let mut legs: heapless::Vec<Leg, { signals::MAX_LEGS }> = (0..1 + dice.below(5)).map(|_| leg(&mut dice, class, pump_m3)).collect();
        let reached = legs.iter().any(|l| f64::from(l.depth_max_m) > class.deeper_than_m());
        if let (false, Some(first)) = (reached, legs.first_mut()) {
            first.depth_max_m = dice.between(class.deeper_than_m() + 5.0, deepest) as f32;
        }
        let surface_every = dice.below(4) as u16;
        let mut mission = Mission { wings, legs, max_duration_s: u32::MAX, surface_every };
        mission.max_duration_s = (f64::from(mission.least_duration_s()) * dice.between(1.0, 3.0)).ceil() as u32 + 1;
        let rough = dice.chance(0.5);
        let deepest_m = f64::from(mission.deepest_m());
        let bottom_m = if dice.chance(0.25) { deepest_m + dice.between(12.0, 60.0) } else { f64::from(vehicle.crush_depth_m) * 1.2 + 50.0 };
        let fitted =
            Fitted { depth2: dice.chance(0.5), altimeter: dice.chance(0.5), gps: dice.chance(0.5), weight_monitor: dice.chance(0.5) };
        Self { class, mission, fitted, rough, bottom_m, seed }
    }

    /// The world it is flown in, nothing broken.
    #[must_use]
    pub fn scenario(&self) -> Scenario {
        let mut s = worlds::for_mission(&self.mission);
        s.seed = self.seed;
        let mut hull = Dice::new(self.seed, 13);
        (s.vehicle.gas_m3, s.vehicle.gas_lag_s) = (hull.between(0.02, 0.05), hull.between(900.0, 7200.0));
        s.ocean.water_depth_m = self.bottom_m;
        s.sensors.depth2.absent = !self.fitted.depth2;
        s.sensors.altitude.absent = !self.fitted.altimeter;
        // Nothing there to answer is what a receiver that is off looks like.
        let missing = [(self.fitted.gps, Target::Gps), (self.fitted.weight_monitor, Target::WeightMonitor)];
        s.faults = missing.iter().filter(|m| !m.0).filter_map(|m| Fault::new(m.1, Kind::Off)).collect();
        if self.rough {
            s.ocean.background_rms_m_s = 0.008;
            s.ocean.wave_height_m = 0.25;
            s.effects.push(Effect { kind: EffectKind::InternalWave, value: 0.02, aux: Some(1200.0) });
            s.effects.push(Effect { kind: EffectKind::HorizontalCurrent, value: 0.2, aux: Some(1.0) });
        }
        s
    }
}

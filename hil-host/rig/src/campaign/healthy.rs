//! Healthy vehicles on random missions: each has to fly its mission to the end.
//!
//! What a sound vehicle may differ by, and what the sea does to it, beyond what [`Draw`] makes of water and mission:
//!
//! | drawn | range |
//! |---|---|
//! | metacentric height | 3.5 to 6.5 mm; the law knows the nominal one alone |
//! | samples lost, of each sensor | to 1 % |
//! | surface waves, in rough water | significant height 1 to 4 m |

use super::draw::{Dice, Draw};
use crate::flight::closed_loop::{End, Outcome, Setup, fly};
use crate::seats::Link;
use crate::seats::in_process::InProcess;
use anyhow::anyhow;
use plant::{Scenario, World};
use serde_json::{Value, json};

/// What came of one of them.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Flight {
    /// The mission and its world; made again from its number when it was kept.
    #[serde(skip, default = "no_draw")]
    pub draw: Draw,
    /// Number it was drawn from.
    pub seed: u64,
    /// How it ended.
    pub end: End,
    /// Dives flown.
    pub dives: u16,
    /// Deepest, m.
    pub max_depth_m: f64,
    /// Time flown, s.
    pub duration_s: f64,
}

fn no_draw() -> Draw {
    Draw::new(0)
}

impl Flight {
    /// As it was before it was kept.
    #[must_use]
    pub fn drawn_again(self) -> Self {
        Self { draw: Draw::new(self.seed), ..self }
    }

    /// Flown to the end, without an abort.
    #[must_use]
    pub fn done(&self) -> bool {
        self.end == End::Done && u32::from(self.dives) == self.draw.mission.dives()
    }

    /// One entry of the JSON list.
    #[must_use]
    pub fn document(&self) -> Value {
        json!({ "seed": self.seed, "end": self.end.to_string(), "dives": self.dives, "of": self.draw.mission.dives(),
            "max_depth_m": (self.max_depth_m * 10.0).round() / 10.0, "duration_s": self.duration_s, "rough": self.draw.rough,
            "fitted": format!("{:?}", self.draw.fitted), "mission": crate::flight::mission_file::write(&self.draw.mission) })
    }
}

/// The world of this number.
#[must_use]
pub fn scenario(draw: &Draw, seed: u64) -> Scenario {
    let (mut s, mut dice) = (draw.scenario(), Dice::new(seed, 12));
    s.vehicle.metacentric_height_m = dice.between(3.5e-3, 6.5e-3);
    let lost = dice.between(0.0, 0.01);
    for channel in s.sensors.channels_mut() {
        channel.dropout = lost;
    }
    if draw.rough {
        // Its standard deviation is a quarter of it.
        s.ocean.wave_height_m = dice.between(1.0, 4.0) / 4.0;
    }
    s
}

/// Flies the mission of this number with a healthy vehicle.
///
/// # Errors
/// The world cannot be, or the controller does not answer or refuses the mission.
pub fn run(seed: u64) -> anyhow::Result<Flight> {
    let draw = Draw::new(seed);
    let mut world = World::new(scenario(&draw, seed)).map_err(|e| anyhow!("mission {seed}: {e}"))?;
    let setup = Setup::new(draw.mission.clone());
    let out: Outcome = fly(&mut world, &mut Link::new(InProcess::default()), &setup, &mut |_| Ok(()))
        .map_err(|e| anyhow!("mission {seed}: {e}\n{}", crate::flight::mission_file::write(&draw.mission)))?;
    Ok(Flight { draw, seed, end: out.end, dives: out.dives, max_depth_m: out.max_depth_m, duration_s: out.duration_s })
}

//! Could anyone have brought it home? The same mission with a controller that
//! cannot be: it knows of a fault in the very cycle in which it begins, and
//! from then on pumps out, fires the weight and lets nothing else matter.
//!
//! A mission that ends badly under our controller *and* under this one was
//! lost by physics: pump and drop weight together cannot carry what was done
//! to the vehicle. Everything else counts against us.
//!
//! Two kinds of fault even this controller does not know at once, because
//! nothing on board can show them: a stuck release shows only when the weight
//! is needed, and what pulls on the vehicle (weight added, something dragging,
//! a net, a lens of light water) shows only in its motion, `MOTION_S` later.

use super::lattice::Case;
use crate::closed_loop::{CYCLE_S, End, SURFACED_M, Setup, fly};
use crate::seats::in_process::InProcess;
use crate::seats::{Link, Seat, SeatError};
use anyhow::anyhow;
use control::Config;
use plant::faults::{Kind, Target};
use plant::{Fault, Scenario, World};
use signals::{Abort, ActuatorCommand, Answer, Manifest, Mission, Phase, SensorFrame};

/// Our controller until the first fault that can be known begins, then the best there is.
struct Omniscient {
    inner: Link<InProcess>,
    config: Config,
    /// When the first such fault begins, s.
    from_s: f64,
    knows: bool,
    last: ActuatorCommand,
}

impl Seat for Omniscient {
    fn hello(&mut self) -> Result<Manifest, SeatError> {
        self.inner.hello()
    }
    fn configure(&mut self, manifest: &Manifest, config: &Config) -> Result<(), SeatError> {
        self.inner.configure(manifest, config)
    }
    fn recover(&mut self) -> Result<(), SeatError> {
        self.inner.recover()
    }
    fn begin(&mut self, mission: &Mission) -> Result<u32, SeatError> {
        self.inner.begin(mission)
    }
    fn exchange(&mut self, frame: &SensorFrame) -> Result<Answer, SeatError> {
        let mut answer = self.inner.exchange(frame)?;
        if !self.knows && frame.time.0 as f64 * 1e-6 >= self.from_s {
            self.knows = true;
            self.inner.recall()?;
        }
        if self.knows {
            answer.command.ballast_m3 = self.config.pump_m3;
            answer.command.fin_rad = 0.0;
            answer.command.drop_weight = true;
            answer.trace.phase = Phase::Safe;
            answer.trace.abort = answer.trace.abort.or(Some(Abort::Operator));
        }
        self.last = answer.command;
        Ok(answer)
    }
    fn recall(&mut self) -> Result<(), SeatError> {
        self.inner.recall()
    }
    fn reset(&mut self) -> Result<(), SeatError> {
        self.inner.reset()
    }
    fn describe(&self) -> String {
        "a controller that knows every fault in the cycle in which it begins".to_owned()
    }
}

/// From a pull on the vehicle to a depth rate that shows it, s: the rate approaches its new value with m U / 2 D = 8 s, and
/// three readings tell it from noise.
const MOTION_S: f64 = 20.0;

/// Control cycles that it must then stay at the surface: half an hour.
const STAY_CYCLES: u32 = 450;

/// When a fault that begins at its `delay_s` can be known, s.
fn known_s(fault: &Fault) -> f64 {
    fault.delay_s
        + match (fault.target, fault.kind) {
            (Target::Release, Kind::Stuck) => f64::INFINITY,
            (Target::Vehicle, _) | (Target::Sea, Kind::Lens) => MOTION_S,
            _ => 0.0,
        }
}

/// Whether the ideal reaction brings the vehicle of this case to the surface, above crush depth all the way. The faults
/// begin at `onsets` (s; none: never), as they did under our controller, whatever phase the ideal one is in.
///
/// # Errors
/// The world cannot be.
pub fn survives(case: &Case, onsets: &[Option<f64>]) -> anyhow::Result<bool> {
    let mission = case.mission();
    let begun = case.faults.iter().zip(onsets).filter_map(|(f, onset)| onset.map(|delay_s| Fault { phase: None, delay_s, ..*f }));
    let faults: Vec<Fault> = begun.collect();
    let from_s = faults.iter().map(known_s).fold(f64::INFINITY, f64::min);
    let mut world = World::new(Scenario { faults, ..case.scenario() }).map_err(|e| anyhow!("{e}"))?;
    let setup = Setup::new(mission);
    let mut seat = Omniscient {
        inner: Link::new(InProcess::default()),
        config: setup.config.clone(),
        from_s,
        knows: false,
        last: ActuatorCommand::default(),
    };
    let out = fly(&mut world, &mut seat, &setup, &mut |_| Ok(()))?;
    if matches!(out.end, End::Crushed | End::TimeUp) {
        return Ok(false);
    }
    // Up is up to stay: what swings up to the surface and settles below it is not home.
    for _ in 0..STAY_CYCLES {
        world.advance(&seat.last, CYCLE_S);
    }
    Ok(world.truth().depth_m < SURFACED_M)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::lattice::Water;
    use signals::Wings;

    #[test]
    fn physics_alone_decides_what_no_controller_could_have_saved() {
        let case = |faults: &[&str]| Case {
            water: Water::Shallow,
            wings: Wings::Standard,
            seed: 0,
            faults: faults.iter().map(|f| f.parse().expect("a fault")).collect(),
            line: None,
        };
        // 200 s into the first dive, in 25 m of depth.
        for (saved, faults) in [
            (true, &["hull:leak=20"][..]),
            (true, &["pump:runaway=-1"]),
            // 0.23 l of pump and 0.45 kg of weight against a litre of water in each minute.
            (false, &["hull:leak=1000"]),
            (false, &["pump:runaway=-1", "release:stuck"]),
        ] {
            let case = case(faults);
            assert_eq!(survives(&case, &vec![Some(200.0); case.faults.len()]).expect("flies"), saved, "{faults:?}");
        }
    }
}

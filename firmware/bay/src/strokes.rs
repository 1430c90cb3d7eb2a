//! Whether pump and battery mass move, on deck or afloat: out, in, and out again.
//!
//! The pump stays on the buoyant side, so that a vehicle in the water keeps
//! floating: from all out to a tenth above the middle, and back.

use crate::scale::Scale;
use devices::motor::Limits;
use signals::{ActuatorCommand, Stroke};

/// Ends of the way, shares of the range: pump, and battery mass.
const PUMP: [f32; 2] = [0.1, 0.98];
const MASS: [f32; 2] = [-0.8, 0.8];
/// Where the battery is left.
const REST: f32 = 0.0;
/// Share of the range within which an end counts as reached.
const NEAR: f32 = 0.03;
/// A way may take so many times what it should.
const PATIENCE: f32 = 1.5;
/// And this long in any case, s.
const LEAST_S: f32 = 10.0;

/// Where the check is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Stage {
    #[default]
    Idle,
    /// On the way to the first end, then to the second, since, ms.
    To(usize, u64),
}

/// The check.
#[derive(Clone, Copy, Debug, Default)]
pub struct Strokes {
    stage: Stage,
    told: bool,
    /// What came of the pump.
    pub pump: Stroke,
    /// And of the battery mass.
    pub mass: Stroke,
}

impl Strokes {
    /// Begins.
    #[must_use]
    pub fn begin(now_ms: u64) -> Self {
        Self { stage: Stage::To(0, now_ms), told: false, pump: Stroke::UnderWay, mass: Stroke::UnderWay }
    }

    /// Whether motors are to move.
    #[must_use]
    pub fn under_way(&self) -> bool {
        self.stage != Stage::Idle
    }

    /// A new command, when there is one.
    pub fn next(&mut self, scale: &Scale, now_ms: u64) -> Option<ActuatorCommand> {
        let Stage::To(end, _) = self.stage else { return None };
        if core::mem::replace(&mut self.told, true) {
            return None;
        }
        self.stage = Stage::To(end, now_ms);
        Some(ActuatorCommand {
            ballast_m3: at(&PUMP, end, 1.0) * scale.pump_m3,
            battery_mass_m: at(&MASS, end, REST) * scale.mass_m,
            ..ActuatorCommand::default()
        })
    }

    /// Where both are.
    pub fn see(&mut self, scale: &Scale, pump: Option<f32>, mass: Option<f32>, now_ms: u64) {
        let Stage::To(end, since_ms) = self.stage else { return };
        let took_s = now_ms.saturating_sub(since_ms) as f32 * 1e-3;
        let pump_there = watch(&mut self.pump, &scale.pump, (end, took_s), pump, scale.pump_m3, PUMP);
        let mass_there = watch(&mut self.mass, &scale.mass, (end, took_s), mass, scale.mass_m, MASS);
        if pump_there && mass_there {
            (self.stage, self.told) = if end == 0 { (Stage::To(1, now_ms), false) } else { (Stage::Idle, true) };
        }
    }
}

/// End number `end`, or where to stay.
fn at(ends: &[f32; 2], end: usize, rest: f32) -> f32 {
    ends.get(end).copied().unwrap_or(rest)
}

/// Whether this motor needs no more waiting; notes the way to the second end, or the failure.
fn watch(stroke: &mut Stroke, limits: &Limits, (end, took_s): (usize, f32), position: Option<f32>, range: f32, ends: [f32; 2]) -> bool {
    if *stroke != Stroke::UnderWay {
        return true;
    }
    let [first, second] = ends;
    let target = range * if end == 0 { first } else { second };
    let way = range * (second - first);
    if position.is_some_and(|p| (p - target).abs() <= NEAR * range) {
        if end == 1 {
            *stroke = Stroke::Done { seconds: took_s, way };
        }
        return true;
    }
    let patience_s = PATIENCE * limits.stroke / limits.rate;
    if took_s > if patience_s > LEAST_S { patience_s } else { LEAST_S } {
        *stroke = Stroke::Failed;
        return true;
    }
    false
}

#[cfg(test)]
mod tests {
    use super::Strokes;
    use crate::scale::Scale;
    use control::Settings;
    use signals::Stroke;

    /// Both motors as they should be but for the share of its rate at which the pump runs.
    fn check(share: f32) -> Strokes {
        let scale = Scale::of(&Settings::slocum_200());
        let mut strokes = Strokes::begin(0);
        let (mut pump, mut mass, mut wanted) = (0.0f32, 0.0f32, None);
        for n in 1..3_000u64 {
            wanted = strokes.next(&scale, n * 100).or(wanted);
            let Some(to) = wanted else { continue };
            pump += (to.ballast_m3 - pump).clamp(-scale.pump.rate * 0.1 * share, scale.pump.rate * 0.1 * share);
            mass += (to.battery_mass_m - mass).clamp(-scale.mass.rate * 0.1, scale.mass.rate * 0.1);
            assert!(pump >= 0.0, "never heavier than it floats");
            strokes.see(&scale, Some(pump), Some(mass), n * 100);
        }
        assert!(!strokes.under_way());
        strokes
    }

    #[test]
    fn a_sound_pump_is_timed_and_a_stuck_one_fails() {
        let sound = check(1.0);
        let Stroke::Done { seconds, way } = sound.pump else { panic!("{sound:?}") };
        assert!((seconds - way / 13e-6).abs() < 1.5, "{seconds} s for {way} m³");
        assert!(matches!(sound.mass, Stroke::Done { seconds, .. } if (14.0..18.0).contains(&seconds)));
        let stuck = check(0.0);
        assert!(stuck.pump == Stroke::Failed && matches!(stuck.mass, Stroke::Done { .. }));
    }
}

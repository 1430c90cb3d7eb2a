//! Pitch by moving the battery mass.
//!
//! ```text
//! tan θ = T1 V_b + T2 x_b + T3 + learned(direction)
//! x_b   = (tan θ_wanted − T1 V_b − T3 − learned) / T2
//! ```
//! The ballast alone would pitch the vehicle ±22°; the mass takes back what is
//! too much, continuously, from the pump position expected half a cycle ahead:
//! so pitch is right *during* the turn, not some cycles after it. What the law
//! does not know (zero of the mass, hydrodynamic moment, payload) is learned
//! as one slow integral per direction, frozen while the mass is saturated or
//! the pitch is not believed, and bounded. The zero is the same at every pitch;
//! the moment is not: where another pitch is flown than the one it was learned
//! at, the mean of both directions stays (in which the moment cancels) and the
//! rest is learned anew.

use crate::angle::tan;
use crate::bound::Bound;
use crate::config::Config;

/// Time constant of the learning, s: twice the pitch mode's period (16 s), so that the two do not couple.
const LEARN_S: f32 = 35.0;
/// Largest correction of tan(pitch): 0.3 covers T3 0.25 of the worst published trim fit.
const LEARN_MAX: f32 = 0.3;

/// Change of tan(pitch) beyond which the moment is another, 1 (9°): more than a glide's entry or a lesson is steeper by.
const SAME_PITCH: f32 = 0.16;

/// Correction of tan(pitch) in one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Learned {
    tan: f32,
    /// tan(pitch) wanted when it was last learned; 0: nothing learned yet.
    at: f32,
}

/// What was learned.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Trim {
    dive: Learned,
    climb: Learned,
    /// Battery position last commanded, m.
    battery_m: f32,
}

/// One cycle's wish.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wish {
    /// Pitch wanted, rad.
    pub(crate) pitch_rad: f32,
    /// Pump position expected half a cycle ahead, m³.
    pub(crate) ballast_m3: f32,
    /// Where between dive (−1) and climb (+1) the vehicle is, −1..1.
    pub(crate) side: f32,
    /// Steady glide: learning allowed.
    pub(crate) steady: bool,
}

impl Trim {
    /// Battery position to command, m.
    pub(crate) fn advance(&mut self, config: &Config, dt_s: f32, wish: Wish, pitch_rad: Option<f32>, battery_m: Option<f32>) -> f32 {
        if !self.sane(config) {
            *self = Self::default();
        }
        let wanted = tan(wish.pitch_rad);
        let t = &config.trim;
        let mean = 0.5 * (self.dive.tan + self.climb.tan);
        let learned = if wish.side < 0.0 { &mut self.dive } else { &mut self.climb };
        let elsewhere = learned.at != 0.0 && (wanted - learned.at).abs() > SAME_PITCH;
        if elsewhere && wish.side.abs() >= 1.0 {
            *learned = Learned { tan: mean, at: wanted };
        }
        if let (true, Some(pitch), Some(at)) = (wish.steady, pitch_rad, battery_m) {
            // Only when the mass is where it was sent: else the error is on its way out already.
            if (at - self.battery_m).abs() <= 2.0 * config.battery_deadband_m + 1e-4 {
                let error = (tan(pitch) - wanted).at_least(-0.3).at_most(0.3);
                let gain = dt_s / (dt_s + LEARN_S);
                // Saturated: learn only what leads out of it.
                let saturated = self.battery_m.abs() >= config.battery_m * 0.999;
                let outward = (self.battery_m > 0.0) == (error > 0.0);
                if !(saturated && outward) {
                    learned.tan = (learned.tan + gain * error).at_least(-LEARN_MAX).at_most(LEARN_MAX);
                    learned.at = wanted;
                }
            }
        }
        let mix = 0.5 + 0.5 * wish.side;
        let learned = self.dive.tan + (self.climb.tan - self.dive.tan) * mix;
        let x = (wanted - t.per_ballast_m3 * wish.ballast_m3 - t.offset - learned) / t.per_battery_m;
        // What is no number would pitch the vehicle up.
        let x = x.at_least(-config.battery_m).at_most(config.battery_m);
        if (x - self.battery_m).abs() > config.battery_deadband_m {
            self.battery_m = x;
        }
        self.battery_m
    }

    /// The mass is to stay where it is.
    pub(crate) fn hold(&mut self, config: &Config, battery_m: Option<f32>) -> f32 {
        if let Some(at) = battery_m {
            self.battery_m = at.at_least(-config.battery_m).at_most(config.battery_m);
        }
        self.battery_m
    }

    fn sane(&self, config: &Config) -> bool {
        let sane = |l: &Learned| l.tan.abs() <= LEARN_MAX && l.at.is_finite();
        sane(&self.dive) && sane(&self.climb) && self.battery_m.abs() <= config.battery_m
    }
}

#[cfg(test)]
mod tests {
    use super::{LEARN_MAX, LEARN_S, Learned, SAME_PITCH, Trim, Wish};
    use crate::angle::{atan, tan};
    use crate::config::Config;

    /// A vehicle in steady glides whose zero of the mass is off and whose hydrodynamic moment falls with the pitch; answers the error
    /// of tan(pitch) at the start and at the end of each glide.
    fn glides(pitches: &[f32]) -> Vec<(f32, f32)> {
        let config = Config::default();
        let t = &config.trim;
        let mut trim = Trim::default();
        let (mut battery, mut all) = (0.0, Vec::new());
        for pitch in pitches {
            for side in [-1.0f32, 1.0] {
                let ballast_m3 = side * 200e-6;
                let moment = -side * 0.08 * (0.6 - pitch.abs());
                let at = |x: f32| t.per_ballast_m3 * ballast_m3 + t.per_battery_m * x + t.offset + 0.05 + moment;
                let wish = Wish { pitch_rad: side * pitch, ballast_m3, side, steady: false };
                battery = trim.advance(&config, 4.0, wish, None, Some(battery));
                let first = (at(battery) - tan(side * pitch)).abs();
                for _ in 0..(8.0 * LEARN_S / 4.0) as u32 {
                    let measured = atan(at(battery));
                    battery = trim.advance(&config, 4.0, Wish { steady: true, ..wish }, Some(measured), Some(battery));
                }
                all.push((first, (at(battery) - tan(side * pitch)).abs()));
            }
        }
        all
    }

    #[test]
    fn what_no_glide_can_have_taught_gives_way_to_nothing_learned() {
        let (c, wish) = (Config::default(), Wish { pitch_rad: 0.4, ballast_m3: 2e-4, side: 1.0, steady: false });
        let new = Trim::default().advance(&c, 4.0, wish, None, None);
        let learned = |tan, at| Learned { tan, at };
        for (dive, climb, battery_m) in [
            (learned(LEARN_MAX * 1.01, 0.4), learned(0.1, 0.4), 0.0),
            (learned(0.1, f32::NAN), learned(0.1, 0.4), 0.0),
            (learned(0.1, 0.4), learned(f32::NAN, 0.4), 0.0),
            (learned(0.1, 0.4), learned(0.1, 0.4), c.battery_m * 1.01),
        ] {
            assert_eq!(Trim { dive, climb, battery_m }.advance(&c, 4.0, wish, None, None), new);
        }
        let sound = Trim { dive: learned(0.1, 0.4), climb: learned(0.1, 0.4), battery_m: 0.0 }.advance(&c, 4.0, wish, None, None);
        assert!((sound - new).abs() > 1e-3);
    }

    /// The schedule: the moment is learned for each pitch, the zero of the mass once for all.
    #[test]
    fn accuracy_the_integral_meets_two_pitches_one_after_the_other() {
        let (flat, steep) = (0.3f32, 0.52f32);
        assert!(tan(steep) - tan(flat) > SAME_PITCH);
        let dead_band = Config::default().battery_deadband_m * Config::default().trim.per_battery_m.abs();
        let all = glides(&[flat, steep, flat]);
        for (first, last) in &all {
            assert!(*last < dead_band, "{last} after a glide, from {first}");
        }
        // At another pitch no more is wrong at first than its moment is: the zero (0.05) is known.
        for (first, _) in &all[2..] {
            assert!(*first < 0.03 + dead_band, "{first}");
        }
    }
}

//! Effects of the vocabulary put into the true vehicle and water, each in a form of nature's own.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

use super::catalogue::{Effect, medium, size_of_stall};
use super::nature::{Fouling, Nature, NormalForce, ReynoldsDrag, Stall};
use super::ocean::{InternalWave, Ocean};
use super::vehicle::{Scatter, TOLERANCE};
use super::{Site, Wing};

/// One hidden effect as applied.
#[derive(Clone, Debug)]
pub struct Hidden {
    /// Vocabulary or off-catalogue name.
    pub name: &'static str,
    /// Parameter's name.
    pub parameter: &'static str,
    /// Value.
    pub value: f64,
    /// Details of nature's form.
    pub form: Value,
}

/// The true vehicle and water of a trial, into which effects are put.
pub struct Reality<'a> {
    /// Where it was flown.
    pub site: Site,
    /// Wing set.
    pub wing: Wing,
    /// Duration, day.
    pub days: f64,
    /// Deviations drawn for the calibrated quantities.
    pub scatter: &'a Scatter,
    /// The vehicle.
    pub nature: &'a mut Nature,
    /// The water.
    pub ocean: &'a mut Ocean,
}

/// Deviations of calibrated quantities replace the scatter drawn for them, and stand out of it.
fn at_least(x: f64, index: usize) -> f64 {
    let least = 3.5 * TOLERANCE[index].1;
    if x.abs() < least { least.copysign(x) } else { x }
}

/// An effect whose size says all of it.
fn plain(value: f64) -> (f64, Value) {
    (value, json!({}))
}

impl Reality<'_> {
    /// Adds a catalogue effect. `scale` is the size relative to medium.
    pub fn hide(&mut self, effect: Effect, scale: f64, rng: &mut ChaCha8Rng) -> Hidden {
        use Effect as E;
        let (size, cap) = medium(effect, self.site, self.wing);
        let size = (size * scale * rng.random_range(0.85..1.18)).min(cap);
        let signed = if rng.random_bool(0.5) { size } else { -size };
        // A factor cannot fall far below one.
        let factor = if signed < 0.0 { signed.max(-0.6) } else { signed };
        let (value, form) = match effect {
            E::VortexLiftBodywing => self.vortex_lift(size, rng),
            E::SideEdgeLift => self.side_edge_lift(size, rng),
            E::ReynoldsDrag => self.reynolds_drag(size, rng),
            E::Stall => self.stall(scale, rng),
            E::HullCompressibility => self.hull_compressibility(at_least(signed, 6), rng),
            E::ThermalExpansion => self.thermal_expansion(at_least(if size > 0.9 { size } else { signed }, 7), rng),
            E::BiofoulingDrag => self.biofouling_drag(size, rng),
            E::PitchOffset => {
                self.nature.pitch_zero = at_least(signed, 5);
                plain(self.nature.pitch_zero)
            }
            E::BallastOffset => self.ballast_offset(at_least(signed, 3)),
            E::BallastScale => {
                self.nature.ballast_gain = at_least(signed, 4);
                plain(self.nature.ballast_gain)
            }
            E::InternalWave => self.internal_wave(size, rng),
            E::VerticalCurrent => self.vertical_current(signed, rng),
            E::RollTurnDrag => self.roll_turn_drag(size, rng),
            E::ClimbDrag => {
                self.nature.climb_drag = if rng.random_bool(0.3) { -size.min(0.5) } else { size };
                plain(self.nature.climb_drag)
            }
            E::AddedMass => self.added_mass(0, at_least(size, 8), 8),
            E::HeaveAddedMass => self.added_mass(1, at_least(size, 9), 9),
            E::DragLevelError => {
                let v = at_least(factor, 0);
                self.nature.cd0 *= (1.0 + v) / (1.0 + self.scatter.values[0]);
                plain(v)
            }
            E::LiftSlopeError => {
                let v = at_least(factor, 1);
                self.nature.lift_slope *= (1.0 + v) / (1.0 + self.scatter.values[1]);
                plain(v)
            }
            E::InducedDragError => self.induced_drag_error(size, rng),
            E::ZeroLiftAngle => self.zero_lift_angle(signed, rng),
            E::DensityBias => {
                self.nature.density_bias = signed;
                plain(signed)
            }
            E::PressureDrift => {
                // `size` is the drift over the whole trial, dbar.
                self.nature.pressure_drift = signed / self.days;
                plain(self.nature.pressure_drift)
            }
            E::PitchScale => {
                self.nature.pitch_scale = signed;
                plain(signed)
            }
            E::HorizontalCurrent => self.horizontal_current(size, rng),
        };
        let (name, parameter) = effect.names();
        Hidden { name, parameter, value, form }
    }

    fn vortex_lift(&mut self, k: f64, rng: &mut ChaCha8Rng) -> (f64, Value) {
        let (onset, power, width) = (rng.random_range(0.07..0.12), rng.random_range(1.6..2.3), rng.random_range(0.004..0.012));
        self.nature.vortex = Some(NormalForce { k, onset, power, width });
        (k, json!({ "onset_rad": onset, "power": power, "width_rad": width }))
    }

    fn side_edge_lift(&mut self, k: f64, rng: &mut ChaCha8Rng) -> (f64, Value) {
        let power = rng.random_range(1.85..2.15);
        self.nature.side_edge = Some(NormalForce { k, onset: 0.0, power, width: 0.0 });
        (k, json!({ "power": power }))
    }

    fn reynolds_drag(&mut self, exponent: f64, rng: &mut ChaCha8Rng) -> (f64, Value) {
        let reference_speed = rng.random_range(0.27..0.33);
        let viscous = rng.random_bool(0.4);
        self.nature.reynolds = Some(ReynoldsDrag { exponent, reference_speed, viscous });
        (exponent, json!({ "reference_speed_m_s": reference_speed, "viscous": viscous }))
    }

    fn stall(&mut self, scale: f64, rng: &mut ChaCha8Rng) -> (f64, Value) {
        // A lower angle is a stronger stall.
        let angle = (size_of_stall(self.site, self.wing, scale) * rng.random_range(0.95..1.05)).max(0.03);
        let (loss, width) = (rng.random_range(0.42..0.58), rng.random_range(0.006..0.02));
        self.nature.stall = Some(Stall { angle, loss, width, hysteresis: 0.0 });
        (angle, json!({ "loss": loss, "width_rad": width }))
    }

    fn hull_compressibility(&mut self, v: f64, rng: &mut ChaCha8Rng) -> (f64, Value) {
        self.nature.compressibility *= (1.0 + v) / (1.0 + self.scatter.values[6]);
        self.nature.compressibility_slope = rng.random_range(-0.04..0.04);
        (v, json!({ "slope_per_mpa": self.nature.compressibility_slope }))
    }

    fn thermal_expansion(&mut self, v: f64, rng: &mut ChaCha8Rng) -> (f64, Value) {
        self.nature.thermal_expansion *= (1.0 + v) / (1.0 + self.scatter.values[7]);
        self.nature.thermal_slope = rng.random_range(-0.01..0.02);
        (v, json!({ "slope_per_k": self.nature.thermal_slope }))
    }

    fn biofouling_drag(&mut self, rate_per_day: f64, rng: &mut ChaCha8Rng) -> (f64, Value) {
        let power = rng.random_range(0.85..1.25);
        self.nature.fouling = Some(Fouling { rate_per_day, power, duration_day: self.days });
        (rate_per_day, json!({ "power": power, "duration_day": self.days }))
    }

    fn ballast_offset(&mut self, cc: f64) -> (f64, Value) {
        self.nature.volume += (cc - self.scatter.values[3]) * 1e-6;
        plain(cc)
    }

    fn internal_wave(&mut self, size: f64, rng: &mut ChaCha8Rng) -> (f64, Value) {
        let wave = InternalWave::draw(size, rng);
        let form = json!({ "period_s": wave.period, "mode": wave.mode, "second_harmonic": wave.harmonic, "phase_rad": wave.phase });
        self.ocean.wave = Some(wave);
        (size, form)
    }

    fn vertical_current(&mut self, up_m_s: f64, rng: &mut ChaCha8Rng) -> (f64, Value) {
        self.ocean.upwelling = [up_m_s, rng.random_range(0.75..1.35)];
        (up_m_s, json!({ "skew": self.ocean.upwelling[1] }))
    }

    fn roll_turn_drag(&mut self, k: f64, rng: &mut ChaCha8Rng) -> (f64, Value) {
        self.nature.roll_drag = [k, rng.random_range(1.7..2.3)];
        (k, json!({ "power": self.nature.roll_drag[1] }))
    }

    /// Along an axis (0 surge, 1 heave), in place of the scatter of this index.
    fn added_mass(&mut self, axis: usize, v: f64, index: usize) -> (f64, Value) {
        self.nature.added_mass[axis] += v - self.scatter.values[index];
        plain(v)
    }

    fn induced_drag_error(&mut self, size: f64, rng: &mut ChaCha8Rng) -> (f64, Value) {
        let v = if rng.random_bool(0.25) { -size.min(0.7) } else { size };
        let lift_part = rng.random_bool(0.5);
        if lift_part {
            self.nature.induced_k *= 1.0 + v;
        } else {
            self.nature.hull_drag *= 1.0 + v;
        }
        (v, json!({ "of": if lift_part { "induced_k" } else { "hull_drag_per_rad2" } }))
    }

    fn zero_lift_angle(&mut self, angle: f64, rng: &mut ChaCha8Rng) -> (f64, Value) {
        self.nature.zero_lift = angle;
        self.nature.zero_lift_hull = rng.random_range(0.0..1.0);
        (angle, json!({ "hull_share": self.nature.zero_lift_hull }))
    }

    fn horizontal_current(&mut self, size: f64, rng: &mut ChaCha8Rng) -> (f64, Value) {
        let toward = rng.random_range(0.0..core::f64::consts::TAU);
        self.ocean.current = [[size * libm::sin(toward), size * libm::cos(toward)]; super::SEGMENTS];
        self.ocean.current_profile = [rng.random_range(8.0..30.0), rng.random_range(0.6..1.0)];
        (size, json!({ "toward_rad": toward, "barotropic_share": self.ocean.current_profile[1] }))
    }
}

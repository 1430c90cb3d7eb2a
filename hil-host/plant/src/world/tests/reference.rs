//! The fixed step against a reference integrator.

use super::{command, uniform};
use crate::dynamics::{Body, Inputs, Ramp};
use crate::ocean::{Column, CurrentLevel, Ocean};
use crate::{Effect, EffectKind, Start, Vehicle, World};
use ode_solvers::{Dopri5, OutputType, SVector, System};
use signals::Wings;

type Vector = SVector<f64, 9>;

struct Motion<'a> {
    body: &'a Body,
    column: &'a Column,
    inputs: Inputs,
}

impl System<f64, Vector> for Motion<'_> {
    fn system(&self, t: f64, y: &Vector, dy: &mut Vector) {
        let state = std::array::from_fn(|i| y[i]);
        *dy = Vector::from(self.body.derivative(self.column, &self.inputs, t, &state));
    }
}

fn integrate(body: &Body, column: &Column, inputs: Inputs, seconds: f64, y: Vector) -> Vector {
    // Sparse output: the last point is the last step's own, not an interpolation. Controller settings are the crate's defaults.
    let motion = Motion { body, column, inputs };
    let mut solver = Dopri5::from_param(
        motion,
        0.0,
        seconds,
        seconds,
        y,
        1e-10,
        1e-12,
        0.9,
        0.04,
        0.2,
        10.0,
        seconds,
        0.0,
        100_000,
        1000,
        OutputType::Sparse,
    );
    solver.integrate().unwrap();
    *solver.y_out().last().unwrap()
}

#[test]
fn validate_fixed_step_against_dormand_prince() {
    for (wings, effect) in [
        (Wings::Standard, None),
        (Wings::LowAspectRatio, Some(EffectKind::InternalWave)),
        (Wings::Standard, Some(EffectKind::ReynoldsDrag)),
    ] {
        let mut s = uniform(wings, Vehicle::default());
        s.ocean = Ocean { background_rms_m_s: 0.0, wave_height_m: 0.0, ..Ocean::sea() };
        s.ocean.current = vec![
            CurrentLevel { depth_m: 0.0, north_m_s: 0.3, east_m_s: 0.0 },
            CurrentLevel { depth_m: 240.0, north_m_s: 0.0, east_m_s: 0.2 },
        ];
        s.start = Start { depth_m: 120.0, ballast_m3: Some(-230e-6), battery_mass_m: Some(0.004), pitch_rad: -0.6, ..Start::default() };
        s.effects = effect.map(Effect::typical).into_iter().collect();
        let mut world = World::new(s).unwrap();
        world.y[4] = 0.3;
        // Down with the pump at rest, then the pump turns it round, then up.
        let mut inputs = world.with_water(world.inputs());
        let y0 = Vector::from(world.y);
        let rate = world.pump.rate_m3_s;
        let pumping = 460e-6 / rate;
        inputs.battery = Ramp { start: f64::from(0.004f32), rate: 0.0 };
        inputs.ballast = Ramp { start: -230e-6, rate: 0.0 };
        let y1 = integrate(&world.body, &world.column, inputs, 300.0, y0);
        inputs.wave.2 += inputs.wave.1 * 300.0;
        inputs.ballast.rate = rate;
        let y2 = integrate(&world.body, &world.column, inputs, pumping, y1);
        inputs.wave.2 += inputs.wave.1 * pumping;
        inputs.ballast = Ramp { start: 230e-6, rate: 0.0 };
        let y3 = integrate(&world.body, &world.column, inputs, 600.0 - pumping, y2);

        world.advance(&command(-230e-6, 0.004, 0.0), 300.0);
        world.advance(&command(230e-6, 0.004, 0.0), 600.0);
        let off: Vec<f64> = (0..9).map(|i| (world.y[i] - y3[i]).abs()).collect();
        println!(
            "{wings:?} {effect:?}: depth off by {:.2e} m, place {:.2e} m, pitch {:.2e} rad, speed {:.2e} m/s",
            off[2],
            off[0].max(off[1]),
            off[3],
            off[4]
        );
        // A centimetre in 3 h is the requirement; a quarter of an hour may cost a millimetre.
        assert!(off[2] < 1e-3, "{wings:?} {effect:?}: depth off by {} m", off[2]);
        assert!(off[0].max(off[1]) < 1e-2 && off[3] < 1e-4 && off[4] < 1e-4, "{off:?}");
    }
}

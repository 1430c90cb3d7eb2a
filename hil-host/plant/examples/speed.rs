//! How fast is the world? Flies a day of 3–27 m saw-teeth at a 4 s control
//! cycle and prints simulated seconds per second, for plain and busy worlds.
//!
//! `cargo run --release -p plant --example speed`

use plant::{Effect, EffectKind, Scenario, World};
use signals::{ActuatorCommand, Wings};
use std::time::Instant;

fn main() {
    let calm = Scenario::shallow(Wings::Standard);
    let mut rough = calm.clone();
    rough.ocean.background_rms_m_s = 0.005;
    rough.ocean.current = vec![plant::ocean::CurrentLevel { depth_m: 0.0, north_m_s: 0.2, east_m_s: 0.0 }, Default::default()];
    rough.ocean.current[1].depth_m = 20.0;
    rough.effects = [EffectKind::InternalWave, EffectKind::ReynoldsDrag, EffectKind::SideEdgeLift].map(Effect::typical).to_vec();
    for (name, scenario) in [("calm", calm), ("rough", rough)] {
        let mut world = World::new(scenario).expect("a default scenario");
        let mut diving = true;
        let begin = Instant::now();
        while world.time_s() < 86_400.0 {
            let frame = world.sense();
            let depth = frame.depth_m.accept(-10.0..=200.0, 60_000).unwrap_or(0.0);
            if depth > 24.0 {
                diving = false;
            } else if depth < 5.0 {
                diving = true;
            }
            let sign = if diving { -1.0 } else { 1.0 };
            world.advance(&ActuatorCommand { ballast_m3: sign * 230e-6, battery_mass_m: sign * 0.008, ..Default::default() }, 4.0);
        }
        let wall = begin.elapsed().as_secs_f64();
        println!("{name:>6}: {:.0} x real time, {:.2} us per simulated second", world.time_s() / wall, 1e6 * wall / world.time_s());
    }
}

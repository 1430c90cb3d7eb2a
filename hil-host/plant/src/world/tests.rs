use super::World;
use crate::ocean::{Ocean, Profile};
use crate::sensors::Sensors;
use crate::{Scenario, Start, Vehicle};
use signals::{ActuatorCommand, Wings};

/// Uniform water, incompressible vehicle, deep enough to settle.
fn uniform(wings: Wings, rho: f64, vehicle: Vehicle) -> Scenario {
    Scenario {
        wings,
        vehicle: Vehicle { compressibility_per_pa: 0.0, thermal_expansion_per_k: 0.0, ..vehicle },
        ocean: Ocean { profile: Profile::Uniform(rho), water_depth_m: 2000.0, wave_height_m: 0.0, ..Ocean::default() },
        sensors: Sensors::perfect(),
        start: Start { depth_m: 300.0, ballast_m3: Some(0.0), ..Start::default() },
        ..Scenario::default()
    }
}

/// Flies with ballast and battery until steady at a pitch found by bisection on the battery.
fn steady(mut scenario: Scenario, ballast_m3: f64, pitch_rad: f64) -> crate::Truth {
    let (mut low, mut high) = (-0.06, 0.06);
    scenario.actuators.battery_travel_m = 0.06;
    scenario.actuators.battery_dead_band_m = 0.0;
    let fly = |battery: f64| {
        let mut s = scenario.clone();
        s.start.ballast_m3 = Some(ballast_m3);
        s.start.battery_mass_m = Some(battery);
        s.start.pitch_rad = pitch_rad;
        let mut world = World::new(s).unwrap();
        let c = ActuatorCommand { ballast_m3: ballast_m3 as f32, battery_mass_m: battery as f32, ..Default::default() };
        world.advance(&c, 600.0);
        world.truth()
    };
    for _ in 0..40 {
        let mid = 0.5 * (low + high);
        if fly(mid).pitch_rad > pitch_rad { low = mid } else { high = mid }
    }
    fly(0.5 * (low + high))
}

#[test]
#[ignore = "prints"]
fn show() {
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        for p in [9.0f64, 12.0, 15.0, 18.0, 21.9, 26.0] {
            let rho = 1005.8;
            let s = uniform(wings, rho, Vehicle::default());
            let v = 2.12 / (rho * 9.81);
            let t = steady(s, -v, -p.to_radians());
            println!(
                "{wings:?} pitch {:.2} U {:.4} gamma {:.2} alpha {:.2} L/D {:.3}",
                t.pitch_rad.to_degrees(),
                t.speed_m_s,
                t.glide_angle_rad.to_degrees(),
                t.alpha_rad.to_degrees(),
                1.0 / t.glide_angle_rad.tan().abs()
            );
        }
    }
}

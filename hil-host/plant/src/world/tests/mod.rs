//! The world in still and moving water.

mod effects;
mod faults;
mod reference;
mod sensors;

use super::World;
use crate::ocean::{CurrentLevel, Ocean, Profile};
use crate::sensors::Sensors;
use crate::{Effect, EffectKind, Scenario, Start, Truth, Vehicle};
use signals::{ActuatorCommand, Wings};

/// Density of the Comet flight, kg/m³.
const BALTIC_KG_M3: f64 = 1005.8;

/// Uniform water, incompressible vehicle, deep enough to settle.
fn uniform(wings: Wings, vehicle: Vehicle) -> Scenario {
    Scenario {
        wings,
        vehicle: Vehicle { compressibility_per_pa: 0.0, thermal_expansion_per_k: 0.0, crush_depth_m: 1e4, ..vehicle },
        ocean: Ocean { profile: Profile::Uniform(BALTIC_KG_M3), water_depth_m: 4000.0, wave_height_m: 0.0, ..Ocean::default() },
        sensors: Sensors::perfect(),
        start: Start { depth_m: 1000.0, ballast_m3: Some(0.0), ..Start::default() },
        ..Scenario::default()
    }
}

fn command(ballast_m3: f64, battery_m: f64, fin_rad: f64) -> ActuatorCommand {
    ActuatorCommand { ballast_m3: ballast_m3 as f32, battery_mass_m: battery_m as f32, fin_rad: fin_rad as f32, ..Default::default() }
}

/// Steady glide at a net weight (N) and pitch; the battery is found by bisection.
fn steady(mut scenario: Scenario, net_n: f64, pitch_rad: f64) -> Truth {
    scenario.actuators.battery_travel_m = 0.06;
    scenario.actuators.battery_dead_band_m = 0.0;
    scenario.actuators.pump.volume_m3 = 400e-6;
    let ballast = -net_n / (BALTIC_KG_M3 * crate::ocean::GRAVITY_M_S2);
    let fly = |battery: f64| {
        let mut s = scenario.clone();
        s.start = Start { ballast_m3: Some(ballast), battery_mass_m: Some(battery), pitch_rad, ..s.start };
        let mut world = World::new(s).unwrap();
        world.advance(&command(ballast, battery, 0.0), 900.0);
        world.truth()
    };
    let (mut low, mut high) = (-0.06, 0.06);
    for _ in 0..40 {
        let mid = 0.5 * (low + high);
        if fly(mid).pitch_rad > pitch_rad { low = mid } else { high = mid }
    }
    let t = fly(0.5 * (low + high));
    assert!((t.pitch_rad - pitch_rad).abs() < 1e-4, "pitch {} wanted {pitch_rad}", t.pitch_rad);
    t
}

fn l_over_d(t: &Truth) -> f64 {
    1.0 / t.glide_angle_rad.tan().abs()
}

#[test]
fn validate_steady_glide_of_comet_2016() {
    // DVL medians of the flight (physics notes, sec. 4): net -2.12 N, pitch -21.9°.
    for vehicle in [Vehicle::default(), Vehicle::comet_2016()] {
        let t = steady(uniform(Wings::Standard, vehicle), 2.12, -21.9f64.to_radians());
        let gamma = t.glide_angle_rad.to_degrees();
        println!("U {:.4} m/s, γ {gamma:.2}°, L/D {:.3}", t.speed_m_s, l_over_d(&t));
        assert!((t.speed_m_s - 0.307).abs() < 0.01, "U {}", t.speed_m_s);
        assert!((gamma + 25.0).abs() < 0.5, "γ {gamma}");
        assert!((l_over_d(&t) - 2.14).abs() < 0.05, "L/D {}", l_over_d(&t));
        // Symmetric vehicle: the climb is the mirror image.
        let up = steady(uniform(Wings::Standard, Vehicle::default()), -2.12, 21.9f64.to_radians());
        assert!((up.sink_rate_m_s + t.sink_rate_m_s).abs() < 1e-3 && (up.alpha_rad + t.alpha_rad).abs() < 1e-3);
    }
}

#[test]
fn validate_steady_table_of_230_and_250_cc() {
    // Physics notes, sec. 4: 250 cc at 26°: α 2.37°, U 0.373; 230 cc at 26°: U 0.357 (model of the owner). A different law: 5 %.
    for (cc, u, alpha_deg) in [(250.0, 0.373, 2.37), (230.0, 0.357, 2.37)] {
        let net = cc * 1e-6 * 1025.0 * crate::ocean::GRAVITY_M_S2;
        let t = steady(uniform(Wings::Standard, Vehicle::default()), net, -26f64.to_radians());
        // Speed scales with 1/sqrt(density).
        let speed = t.speed_m_s * (BALTIC_KG_M3 / 1025.0f64).sqrt();
        assert!((speed / u - 1.0).abs() < 0.05, "{cc} cc: {speed}");
        assert!((t.alpha_rad.to_degrees() - alpha_deg).abs() < 0.5, "{cc} cc: α {}", t.alpha_rad.to_degrees());
    }
}

#[test]
fn rail_wings_glide_worse_and_peak_later() {
    let glide = |wings, pitch: f64| steady(uniform(wings, Vehicle::default()), 2.12, -pitch.to_radians());
    // Physics notes: plant runs gave low/std 0.84-0.90 at 18° and 0.87-0.90 at 26°; ±0.05 for another body lift.
    for (pitch, low, high) in [(18.0, 0.80, 0.95), (26.0, 0.82, 0.96)] {
        let ratio = l_over_d(&glide(Wings::LowAspectRatio, pitch)) / l_over_d(&glide(Wings::Standard, pitch));
        println!("low/std L/D at {pitch}°: {ratio:.3}");
        assert!((low..high).contains(&ratio), "{pitch}°: {ratio}");
    }
    let best = |wings| {
        (16..=44)
            .map(|p| glide(wings, 0.5 * f64::from(p)))
            .map(|t| (l_over_d(&t), t.alpha_rad.to_degrees()))
            .fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a })
    };
    let (std, low) = (best(Wings::Standard), best(Wings::LowAspectRatio));
    println!("(L/D)max {:.2} at α {:.1}°, rail {:.2} at α {:.1}°", std.0, std.1, low.0, low.1);
    // Fits at sea: 2.69 at 7.8° to 3.00 at 6.8°; ours is in between.
    assert!((2.6..3.1).contains(&std.0) && (6.0..8.5).contains(&std.1), "{std:?}");
    // Claims 12 and 13 of the paper's checklist, wider for the larger hull lift: ratio 0.5-0.85, later by 1.05-1.5.
    assert!((0.5..0.85).contains(&(low.0 / std.0)) && (1.05..1.5).contains(&(low.1 / std.1)), "{std:?} {low:?}");
}

#[test]
fn an_inflection_takes_15_to_40_s() {
    let mut s = uniform(Wings::Standard, Vehicle::comet_2016());
    s.start.depth_m = 50.0; // a shallow pump does not push out at 1000 m
    let mut world = World::new(s).unwrap();
    world.advance(&command(-215e-6, -0.004, 0.0), 300.0);
    let before = world.truth().sink_rate_m_s;
    assert!(before > 0.1);
    let climb = command(215e-6, 0.004, 0.0);
    let (mut turned, mut settled) = (None, 0.0);
    let start = world.time_s();
    let mut rates = Vec::new();
    for _ in 0..240 {
        world.advance(&climb, 1.0);
        let t = world.truth();
        if t.sink_rate_m_s < 0.0 && turned.is_none() {
            turned = Some(t.time_s - start);
        }
        rates.push((t.time_s - start, t.sink_rate_m_s));
    }
    let last = rates.last().unwrap().1;
    for (t, w) in rates {
        if (w - last).abs() > 0.1 * (before - last) {
            settled = t;
        }
    }
    println!("sink rate crosses zero after {turned:?} s, within 10 % of the change after {settled} s");
    assert!(turned.is_some_and(|t| (5.0..30.0).contains(&t)), "{turned:?}");
    assert!((15.0..=40.0).contains(&settled), "{settled} s");
}

/// A 3 h flight by the clock: no feedback, so that only the integrator differs.
fn by_the_clock(step_s: f64) -> World {
    let mut s = Scenario::shallow(Wings::Standard);
    s.ocean.current =
        vec![CurrentLevel { depth_m: 0.0, north_m_s: 0.2, east_m_s: 0.1 }, CurrentLevel { depth_m: 25.0, north_m_s: 0.0, east_m_s: 0.0 }];
    s.ocean.background_rms_m_s = 0.004;
    s.effects = vec![Effect::typical(EffectKind::InternalWave)];
    s.seed = 3;
    let mut world = World::new(s).unwrap().with_step(step_s);
    let mut diving = true;
    while world.time_s() < 3.0 * 3600.0 {
        // The turn keeps it between surface and bottom; the fin turns now and then.
        let cycle = world.time_s() % 300.0;
        diving = if cycle < 140.0 { true } else { cycle < 0.0 && diving };
        let sign = if diving { -1.0 } else { 1.0 };
        world.advance(&command(sign * 200e-6, sign * 0.003, if cycle < 40.0 { 0.1 } else { 0.0 }), 4.0);
    }
    world
}

#[test]
fn prop_half_the_step_moves_a_three_hour_flight_by_less_than_1_cm() {
    let (coarse, fine, finest) = (by_the_clock(0.5).truth(), by_the_clock(0.25).truth(), by_the_clock(0.05).truth());
    let d = |a: &Truth, b: &Truth| ((a.depth_m - b.depth_m).abs(), (a.north_m - b.north_m).hypot(a.east_m - b.east_m));
    println!(
        "depth and place moved by {:?} m on halving, {:?} m on a tenth; ended at {:.1} m",
        d(&coarse, &fine),
        d(&coarse, &finest),
        fine.depth_m
    );
    assert!(coarse.max_depth_m > 10.0);
    for other in [&fine, &finest] {
        let (depth, place) = d(&coarse, other);
        assert!(depth < 0.01, "depth moved by {depth} m");
        assert!(place < 0.5, "place moved by {place} m in 3 h");
    }
}

#[test]
fn prop_mechanical_energy_never_grows_without_the_pump() {
    // Nothing moves but the water and the vehicle: every start, both wing sets.
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        for n in 0..40 {
            let angle = |k: f64| (f64::from(n) * k).sin();
            let mut s = uniform(wings, Vehicle::default());
            s.start = Start {
                depth_m: 2000.0,
                pitch_rad: 1.4 * angle(1.7),
                ballast_m3: Some(230e-6 * angle(2.9)),
                battery_mass_m: Some(0.025 * angle(0.7)),
                ..Start::default()
            };
            s.effects = match n % 4 {
                0 => Vec::new(),
                1 => vec![Effect::typical(EffectKind::VortexLiftBodywing), Effect::typical(EffectKind::Stall)],
                2 => vec![Effect::typical(EffectKind::ReynoldsDrag), Effect::typical(EffectKind::AddedMass)],
                _ => vec![Effect::typical(EffectKind::SideEdgeLift), Effect::typical(EffectKind::WingBend)],
            };
            let mut world = World::new(s).unwrap();
            world.y[4] = 1.5 * angle(3.1);
            world.y[5] = 0.8 * angle(4.3);
            world.y[6] = 0.2 * angle(5.9);
            let hold = command(world.ballast.position, world.battery.position, 0.0);
            let mut last = world.mechanical_energy();
            for k in 0..2000 {
                world.advance(&hold, 0.5);
                let now = world.mechanical_energy();
                // Energies are some 1e3 J; the step's own error stays below a millijoule once the start has died down.
                let slack = if k < 40 { 2e-2 } else { 1e-3 };
                assert!(now - last < slack, "{wings:?} start {n}, step {k}: grows by {} J", now - last);
                last = now;
            }
        }
    }
}

#[test]
fn equal_seeds_give_equal_worlds_and_others_do_not() {
    let fly = |seed| {
        let mut s = Scenario::shallow(Wings::Standard);
        s.seed = seed;
        s.ocean.background_rms_m_s = 0.005;
        let mut world = World::new(s).unwrap();
        let mut frames = Vec::new();
        for _ in 0..100 {
            frames.push(world.sense());
            world.advance(&command(-230e-6, -0.008, 0.0), 4.0);
        }
        (frames, world.truth())
    };
    assert_eq!(fly(1), fly(1));
    let ((a, ta), (b, tb)) = (fly(1), fly(2));
    assert!(a != b && ta != tb);
}

#[test]
fn it_floats_rests_on_the_bottom_and_turns() {
    let mut world = World::new(Scenario::shallow(Wings::Standard)).unwrap();
    world.advance(&command(230e-6, 0.01, 0.0), 600.0);
    let t = world.truth();
    assert!(t.at_surface && t.depth_m.abs() < 0.1 && t.sink_rate_m_s.abs() < 0.01, "{t:?}");
    assert!(world.sense().surface.gps_fix);
    world.advance(&command(-230e-6, -0.008, 0.0), 3600.0);
    let t = world.truth();
    assert!(t.on_bottom && (t.depth_m - 60.0).abs() < 0.2 && t.speed_m_s < 0.05, "{t:?}");
    let mut world = World::new(uniform(Wings::Standard, Vehicle::default())).unwrap();
    world.advance(&command(-230e-6, -0.002, 0.45), 600.0);
    let t = world.truth();
    let radius = t.speed_m_s / t.turn_rate_rad_s;
    assert!((6.0..11.0).contains(&radius) && t.roll_rad.abs() > 0.02, "radius {radius} m, {t:?}");
    let mut straight = World::new(uniform(Wings::Standard, Vehicle::default())).unwrap();
    straight.advance(&command(-230e-6, -0.002, 0.0), 600.0);
    let slower = 1.0 - t.speed_m_s / straight.truth().speed_m_s;
    // Public spiral figures: 2-15 % more drag, half of it in speed.
    assert!((0.005..0.12).contains(&slower), "{slower}");
}

#[test]
fn the_pump_pays_for_pressure() {
    let spend = |depth_m| {
        let mut s = uniform(Wings::Standard, Vehicle::default());
        s.actuators.pump = crate::actuators::Pump::shallow_200();
        s.start = Start { depth_m, ballast_m3: Some(-236e-6), ..Start::default() };
        let mut world = World::new(s).unwrap();
        let before = world.truth();
        world.advance(&command(236e-6, 0.0, 0.0), 60.0);
        let after = world.truth();
        assert!((after.ballast_m3 - 236e-6).abs() < 1e-10); // f32 border
        (after.energy.pump_j - before.energy.pump_j, after.energy.hotel_j)
    };
    let ((shallow, hotel), (deep, _)) = (spend(10.0), spend(200.0));
    // 472 cc against 190 m of water at an efficiency of 0.5: 1.77 kJ; it rises a few metres meanwhile.
    assert!((1500.0..1800.0).contains(&(deep - shallow)), "{shallow} {deep}");
    assert!((hotel - 72.0).abs() < 1e-6);
}

#[test]
fn a_truth_file_is_read_back() {
    let mut s = Scenario::sea(Wings::LowAspectRatio);
    s.effects = vec!["internal_wave=0.02,900".parse().unwrap()];
    s.faults = vec!["depth:stuck@dive+120s,300s".parse().unwrap()];
    s.ocean.current = vec![CurrentLevel { depth_m: 3.0, north_m_s: 0.1, east_m_s: 0.0 }];
    s.vehicle.aero = Some(crate::vehicle::Aero::of(Wings::LowAspectRatio));
    let text = s.to_toml().unwrap();
    assert_eq!(Scenario::from_toml(&text).unwrap(), s, "{text}");
    assert_eq!(Scenario::from_toml("seed = 4").unwrap(), Scenario { seed: 4, ..Scenario::default() });
    assert!(Scenario::from_toml("sed = 4").unwrap_err().contains("sed"));
    assert!(Scenario::from_toml("[vehicle]\nmass_kg = -1.0").unwrap_err().contains("vehicle.mass_kg"));
    assert!(Scenario::from_toml("faults = [\"depth:stick\"]").unwrap_err().contains("stuck"));
}

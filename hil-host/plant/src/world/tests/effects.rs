//! Every hidden effect does what its name says.

use super::{command, l_over_d, steady, uniform};
use crate::effects::{Effect, EffectKind as E};
use crate::sensors::Sensors;
use crate::{Scenario, Start, Truth, Vehicle, World};
use signals::{Reading, Wings};

const NET_N: f64 = 2.12;

fn held(effects: &[Effect], net_n: f64, pitch_deg: f64) -> Truth {
    let mut s = uniform(Wings::Standard, Vehicle::default());
    s.effects = effects.to_vec();
    steady(s, net_n, pitch_deg.to_radians())
}

#[test]
fn effects_on_the_force_law_show_in_the_steady_glide() {
    let with = |kind| [Effect::typical(kind)];
    let (plain, shallow) = (held(&[], NET_N, -21.9), held(&[], NET_N, -13.0));
    // More lift at the angles of a shallow pitch, so less angle; nothing at a steep one below the onset.
    let v = held(&with(E::VortexLiftBodywing), NET_N, -10.0);
    assert!(v.alpha_rad < held(&[], NET_N, -10.0).alpha_rad - 1e-3);
    assert!((held(&with(E::VortexLiftBodywing), NET_N, -21.9).alpha_rad - plain.alpha_rad).abs() < 1e-6, "3° is below the onset");
    let side = held(&with(E::SideEdgeLift), NET_N, -13.0);
    assert!(side.alpha_rad < shallow.alpha_rad - 1e-3 && l_over_d(&side) > l_over_d(&shallow));
    assert!(held(&with(E::Stall), NET_N, -13.0).alpha_rad > shallow.alpha_rad + 1e-3);
    assert!((held(&with(E::Stall), NET_N, -26.0).alpha_rad - held(&[], NET_N, -26.0).alpha_rad).abs() < 1e-6);
    // Drag ∝ V^-0.5 about 0.30 m/s: slow is slower, fast is faster.
    assert!(held(&with(E::ReynoldsDrag), 0.6, -21.9).speed_m_s < held(&[], 0.6, -21.9).speed_m_s - 2e-3);
    assert!(held(&with(E::ReynoldsDrag), 3.8, -21.9).speed_m_s > held(&[], 3.8, -21.9).speed_m_s + 2e-3);
    let drag = held(&with(E::DragLevelError), NET_N, -21.9);
    assert!((plain.speed_m_s / drag.speed_m_s - 1.2f64.sqrt()).abs() < 0.03, "a fifth more drag: {}", plain.speed_m_s / drag.speed_m_s);
    let lift = held(&with(E::LiftSlopeError), NET_N, -21.9);
    assert!((1.15..1.4).contains(&(lift.alpha_rad / plain.alpha_rad)), "a fifth less lift: {}", lift.alpha_rad / plain.alpha_rad);
    assert!(l_over_d(&held(&with(E::InducedDragError), NET_N, -13.0)) < 0.97 * l_over_d(&shallow));
    assert!(held(&with(E::WingBend), NET_N, -21.9).alpha_rad > plain.alpha_rad);
    // Dive and climb differ, each in its way.
    let up = held(&with(E::ClimbDrag), -NET_N, 21.9);
    assert!((plain.speed_m_s / up.speed_m_s - 1.2f64.sqrt()).abs() < 0.03);
    assert!((held(&with(E::ClimbDrag), NET_N, -21.9).speed_m_s - plain.speed_m_s).abs() < 1e-6);
    let (down, up) = (held(&with(E::ZeroLiftAngle), NET_N, -21.9), held(&with(E::ZeroLiftAngle), -NET_N, 21.9));
    assert!((down.alpha_rad + up.alpha_rad - 0.03).abs() < 0.006, "twice the angle: {} {}", down.alpha_rad, up.alpha_rad);
}

#[test]
fn fouling_grows_and_turning_costs() {
    let mut s = uniform(Wings::Standard, Vehicle::default());
    s.effects = vec![Effect::sized(E::BiofoulingDrag, 0.03)];
    s.start.in_water_s = 10.0 * 86_400.0;
    let fouled = steady(s, NET_N, -21.9f64.to_radians());
    let clean = held(&[], NET_N, -21.9);
    assert!((clean.speed_m_s / fouled.speed_m_s - 1.3f64.sqrt()).abs() < 0.03, "30 % after 10 days");
    let turning = |effects: Vec<Effect>| {
        let mut s = uniform(Wings::Standard, Vehicle::default());
        s.effects = effects;
        let mut world = World::new(s).unwrap();
        world.advance(&command(-200e-6, -0.002, 0.3), 600.0);
        world.truth()
    };
    let (a, b) = (turning(vec![]), turning(vec![Effect::typical(E::RollTurnDrag)]));
    assert!(b.speed_m_s < a.speed_m_s - 1e-3, "{} {}", a.speed_m_s, b.speed_m_s);
}

/// 10 min of diving in the shelf sea from rest at 20 m.
fn dive(effects: Vec<Effect>) -> (Truth, World) {
    let mut s = Scenario::sea(Wings::Standard);
    s.vehicle.ballasted_density_kg_m3 = Some(1025.5);
    s.sensors = Sensors::perfect();
    s.start = Start { depth_m: 20.0, ballast_m3: Some(-150e-6), ..Start::default() };
    s.effects = effects;
    let mut world = World::new(s).unwrap();
    world.advance(&command(-150e-6, -0.002, 0.0), 600.0);
    (world.truth(), world)
}

#[test]
fn effects_on_buoyancy_and_water_show_in_the_dive() {
    let (plain, _) = dive(vec![]);
    let depth = |kind, size: f64| dive(vec![Effect::sized(kind, size)]).0.depth_m - plain.depth_m;
    assert!(plain.depth_m > 60.0, "{plain:?}");
    // Deeper where it is heavier, shallower where it is lighter.
    for (kind, size, deeper) in [
        (E::HullCompressibility, 0.5, true),
        (E::ThermalExpansion, 1.0, false), // the water is warmer than 10 °C
        (E::BallastOffset, 25.0, false),
        (E::BallastScale, 0.06, true),
        (E::TrappedAir, 30.0, false),
        (E::SlowLeak, 600.0, true),
        (E::VerticalCurrent, 0.01, false),
        (E::FloodedVolumeLag, 0.02, false), // light water from above is carried down
        (E::HullThermalLag, 600.0, false),  // a warm hull sinks into cold water
        (E::SnaggedKelp, 0.6, false),
    ] {
        let aux = (kind == E::SnaggedKelp).then_some(60.0);
        let by = dive(vec![Effect { kind, value: size, aux }]).0.depth_m - plain.depth_m;
        assert_eq!(by > 0.0, deeper, "{}: {by} m", kind.name());
        assert!(by.abs() > 0.05, "{}: only {by} m", kind.name());
    }
    // Only readings change.
    for kind in [E::PitchOffset, E::PitchScale, E::DensityBias, E::PressureDrift] {
        assert_eq!(depth(kind, kind.typical()), 0.0, "{}", kind.name());
    }
    let (t, _) = dive(vec![Effect::sized(E::HorizontalCurrent, 0.2)]);
    assert!((t.north_m - plain.north_m - 120.0).abs() < 0.1);
    let (t, _) = dive(vec![Effect::sized(E::HorizontalShear, 0.3)]);
    assert!(t.north_m - plain.north_m > 1.0 && t.depth_m != plain.depth_m);
    let moved = |kind| (depth(kind, Effect::typical(kind).value)).abs();
    assert!(moved(E::InternalWave) > 0.3);
    assert!(moved(E::AddedMass) > 0.005 && moved(E::HeaveAddedMass) > 0.005, "{} {}", moved(E::AddedMass), moved(E::HeaveAddedMass));
    // The vertical current and the wave vanish at surface and bottom and have their size half way.
    let (_, world) = dive(vec![Effect::sized(E::VerticalCurrent, 0.01)]);
    let i = world.with_water(world.inputs());
    for (z, w) in [(0.0, 0.0), (125.0, -0.01), (250.0, 0.0)] {
        assert!((i.vertical_water(z, 0.0, 250.0).0 - w).abs() < 1e-9, "{z}");
    }
}

#[test]
fn a_lagging_pump_turns_later() {
    let turn = |effects| {
        let (_, mut world) = dive(effects);
        for n in 0..400 {
            world.advance(&command(150e-6, 0.002, 0.0), 1.0);
            if world.truth().sink_rate_m_s < 0.0 {
                return n;
            }
        }
        unreachable!("never turned");
    };
    let (a, b) = (turn(vec![]), turn(vec![Effect::sized(E::PumpLag, 12.0)]));
    assert!((5..20).contains(&(b - a)), "12 s of lag: {a} {b}");
}

#[test]
fn wrong_readings_are_wrong_by_what_is_said() {
    let read = |kind, size: f64| {
        let (t, mut world) = dive(vec![Effect::sized(kind, size)]);
        (t, world.sense())
    };
    let value = |r: Reading| match r {
        Reading::Sampled { value, .. } => f64::from(value),
        Reading::Missing => f64::NAN,
    };
    // f32 keeps 7 digits.
    let (t, f) = read(E::PitchOffset, 0.02);
    assert!((value(f.pitch_rad) - t.pitch_rad - 0.02).abs() < 1e-6);
    let (t, f) = read(E::PitchScale, 0.1);
    assert!((value(f.pitch_rad) - 1.1 * t.pitch_rad).abs() < 1e-6);
    let (t, f) = read(E::DensityBias, 0.3);
    assert!((value(f.density_kg_m3) - t.density_kg_m3 - 0.3).abs() < 1e-4);
    let (_, f) = read(E::PressureDrift, 0.0);
    let (_, g) = read(E::PressureDrift, 144.0);
    assert!((value(g.depth_m) - value(f.depth_m) - 144.0 * 600.0 / 86_400.0 * 1e4 / (1025.5 * 9.81)).abs() < 1e-3, "1 dbar in 10 min");
}

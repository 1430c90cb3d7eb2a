//! The pitch loop as a control engineer asks for it: margins over the envelope, random vehicles, and the model against the law itself.

use control::{Config, Settings};
use hil_host::cli::margins::{DELAY_CYCLES, GAIN_DB, PHASE_DEG, keeps};
use hil_host::score::margins::{Glide, LEARN_S, all, envelope};
use plant::sensors::Sensors;
use plant::{Scenario, World};
use signals::{Goal, Leg, Micros, Mission, Phase, Reading, Wings};

/// Measured when written: at least 14.0 dB, 75.9 degrees, 6.3 cycles (300 s and more of glide at 0.21 to 0.43 m/s).
#[test]
fn validate_the_pitch_loop_keeps_its_margins_over_the_envelope() {
    for (glide, m) in all(&envelope()).expect("glides") {
        assert!(keeps(&m), "{glide:?}: {m:?}; asked {GAIN_DB} dB, {PHASE_DEG} deg, {DELAY_CYCLES} cycles");
        assert!((0.15..0.5).contains(&m.speed_m_s) && m.left < 0.05, "{glide:?}: {m:?}");
    }
}

/// A law that is five times too eager is not stable: the test above can fail.
#[test]
fn an_eager_law_has_no_margin() {
    let glide = Glide { t2_factor: 0.1, ..Glide::nominal(Wings::Standard) };
    let (_, m) = all(&[glide]).expect("a glide")[0];
    assert!(!keeps(&m), "{m:?}");
}

/// A number from −1 to 1 from a seed: splitmix64.
fn spread(seed: u64) -> f64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Trim law, metacentric height and control cycle, each within 30 %, drives and pitches of the envelope.
#[test]
fn prop_random_vehicles_are_stable() {
    let vehicles: Vec<Glide> = (0..100u64)
        .map(|i| {
            let draw = |n: u64| spread(i * 16 + n);
            let nominal = Glide::nominal(if i % 2 == 0 { Wings::Standard } else { Wings::LowAspectRatio });
            Glide {
                pitch_rad: 0.48 + 0.13 * draw(1),
                ballast_m3: 196e-6 + 66e-6 * draw(2),
                height_m: nominal.height_m * (1.0 + 0.3 * draw(3)),
                cycle_s: 4.0 * (1.0 + 0.3 * draw(4)),
                t2_factor: 1.0 + 0.3 * draw(5),
                ..nominal
            }
        })
        .collect();
    for (glide, m) in all(&vehicles).expect("glides") {
        assert!(m.left < 0.05 && m.gain_db > 0.0 && m.phase_deg > 0.0, "{glide:?}: {m:?}");
    }
}

/// The model's integral is the law's: in steady glides of a whole flight the battery moves as the model says.
#[test]
fn accuracy_the_laws_battery_moves_as_the_model_says() {
    let settings = Settings { battery_deadband_m: 0.0, ..Settings::slocum_200() };
    let config = Config::new(settings).expect("valid");
    let mut mission = Mission { max_duration_s: 12 * 3600, ..Mission::default() };
    mission.legs[0] = Leg { dives: 1, depth_min_m: 0.0, depth_max_m: 200.0, goal: Goal::FixedPitch { pitch_rad: 0.45 }, ..Leg::default() };
    let mut scenario = Scenario { sensors: Sensors::perfect(), ..Scenario::sea(Wings::Standard) };
    // Water that moves leaves errors to act on.
    scenario.ocean.background_rms_m_s = 0.01;
    // The law waits for a mass that is not where it was sent.
    scenario.actuators.battery_dead_band_m = 0.0;
    let mut world = World::new(scenario).expect("a world");
    let mut state = control::State::new(&config, mission, Micros(0));
    let table = polar::builtin(Wings::Standard).ok();
    let mut before: Option<(f64, f64, f64, Phase)> = None;
    let (mut moved, mut wrong) = (0u32, 0u32);
    for _ in 0..1500 {
        let frame = world.sense();
        let answer = control::step(&config, table.as_ref(), &mut state, frame.time, &frame);
        let Reading::Sampled { value: pitch, .. } = frame.pitch_rad else { panic!("a pitch") };
        let Reading::Sampled { value: ballast, .. } = frame.ballast_m3 else { panic!("a volume") };
        let wanted = f64::from(answer.trace.pitch_setpoint_rad);
        let x = f64::from(answer.command.battery_mass_m);
        let error = f64::from(pitch).tan() - wanted.tan();
        let ballast = f64::from(ballast);
        if let Some((x_before, wanted_before, ballast_before, phase)) = before
            && phase == Phase::Dive
            && answer.trace.phase == Phase::Dive
            && wanted == wanted_before
            && (ballast - ballast_before).abs() < 1e-9
            && error.abs() > 2e-4
        {
            let step = 4.0 / (4.0 + LEARN_S) * error / f64::from(-settings.trim.per_battery_m);
            // A law that waits (mass under way, pump just stopped) does not move at all.
            if (x - x_before).abs() > 1e-9 {
                moved += 1;
                wrong += u32::from((x - x_before - step).abs() > 0.02 * step.abs() + 2e-8);
            }
        }
        before = Some((x, wanted, ballast, answer.trace.phase));
        world.advance(&answer.command, 4.0);
    }
    assert!(moved > 20 && wrong * 20 <= moved, "{wrong} of {moved} steps are not the model's");
}

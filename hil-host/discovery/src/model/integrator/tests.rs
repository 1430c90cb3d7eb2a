use super::*;
use crate::preprocess::{Run, STEPS_S};
use hydro::effects::{Active, Beyond, Constants, Flow, ForceModel, Sensed, by_name};
use std::borrow::Cow;

const SLOCUM: Constants = Constants {
    gravity_m_s2: 9.81,
    mass_kg: 52.0,
    hull_volume_m3: 0.0519,
    compressibility_per_pa: 5e-10,
    thermal_expansion_per_k: 5e-5,
    reference_temperature_degc: 10.0,
    reference_area_m2: 0.1,
    lift_slope_per_rad: 8.0,
    lift_quadratic_per_rad2: 2.0,
    cd0: 0.15,
    induced_k: 0.1,
    hull_drag_per_rad2: 8.0,
    slope_loss_per_rad2: 2.0,
    hull_drag_per_rad3: -6.0,
    added_mass_surge: 0.06,
    added_mass_heave: 1.05,
    bank_tilt: 0.0,
    banked_turn: 0.0,
    hull_lag_share: 0.0,
    beyond: Beyond { lift_fading: 0.0, cd_broadside: 3.5 },
};

/// A dive and a climb of `half_s` each at this pitch, from afloat or from under way.
pub(crate) fn run(half_s: f64, pitch: f64, afloat: bool) -> Run {
    run_of_step(half_s, pitch, afloat, 1.0)
}

/// The same on another grid.
fn run_of_step(half_s: f64, pitch: f64, afloat: bool, step_s: f64) -> Run {
    let time_s: Vec<f64> = (0..(half_s / 2.0) as usize).map(|i| 4.0 * i as f64).collect();
    let input = |j: usize| {
        let t = 0.5 * step_s * j as f64;
        let x = (t - half_s) / 12.0;
        let floats = afloat && t < 20.0;
        let pitch_rad = if floats { 0.0 } else { pitch * x.tanh() };
        let depth_m = if floats { 0.0 } else { 3.0 + 0.1 * t.min(2.0 * half_s - t) };
        Input {
            sensed: Sensed {
                time_s: t,
                pitch_rad,
                ballast_m3: if floats { 230e-6 } else { 230e-6 * (x / 2.0).clamp(-1.0, 1.0) },
                density_kg_m3: 1001.0 + 0.01 * depth_m,
                temperature_degc: 15.0 - 0.1 * depth_m,
                hull_degc: 15.0 - 0.1 * depth_m,
                pressure_pa: 1e4 * depth_m,
            },
            pitch_rate_rad_s: pitch / 12.0 * (1.0 - x.tanh().powi(2)),
            sin_pitch: pitch_rad.sin(),
            cos_pitch: pitch_rad.cos(),
            roll_rad: 0.1,
            cos_roll: 0.1_f64.cos(),
            sin_heading: 0.6,
            cos_heading: 0.8,
            depth_m,
            cd0_relative: 1.0,
        }
    };
    let n = time_s.len();
    Run {
        segment: 0,
        first_row: 0,
        depth_m: time_s.iter().map(|t| input((t / step_s * 2.0) as usize).depth_m).collect(),
        pressure_pa: vec![1e5; n],
        used: vec![true; n],
        unseen: vec![false; n],
        speed_m_s: vec![f64::NAN; n],
        battery_m: vec![f64::NAN; n],
        ballast_m3: vec![0.0; n],
        inputs: (0..(2.0 * half_s / step_s * 2.0) as usize + 3).map(input).collect(),
        step_s,
        displacement_m: None,
        displacement_s: 100.0,
        fixes: [None; 2],
        blind: false,
        surface: [None, None],
        starts_afloat: afloat,
        start_speed_m_s: if afloat { 0.0 } else { 0.25 },
        time_s,
    }
}

fn bits(t: &Track) -> Vec<u64> {
    let ends = [t.displacement_m.0, t.displacement_m.1];
    t.depth_m.iter().chain(&t.sink_m_s).chain(&t.speed_m_s).chain(&t.alpha_rad).chain(&ends).map(|x| x.to_bits()).collect()
}

#[test]
fn prop_a_flow_known_to_attach_stays_within_the_valid_angle_of_attack() {
    let run = run(200.0, 0.45, true);
    let steepest = |attached: &[(f64, f64)]| {
        let job = Job { run: &run, constants: SLOCUM, effects: Cow::Borrowed(&[]), attached, clock_s: 0.0 };
        let t = &tracks(&[job], 60.0, Continuation::Fading)[0];
        // The launch, and the glide half a minute later.
        let largest = |from: usize, to: usize| t.alpha_rad[from..to].iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        [largest(6, 20), largest(30, 40)]
    };
    let (free, held) = (steepest(&[]), steepest(&[(0.0, 100.0)]));
    assert!(free[0] > 0.5, "the launch of this run is a stall: {free:?}");
    assert!(held[0] <= ALPHA_VALID_RAD + 1e-9, "{held:?}");
    // 1e-3 rad: both have come to the same glide.
    assert!((free[1] - held[1]).abs() < 1e-3, "{free:?} {held:?}");
}

#[test]
fn accuracy_long_steps_find_the_depth_of_short_ones() {
    let flown = |step_s: f64, pitch: f64, slope: f64| {
        let run = run_of_step(200.0, pitch, false, step_s);
        let constants = Constants { lift_slope_per_rad: slope, ..SLOCUM };
        let job = Job { run: &run, constants, effects: Cow::Borrowed(&[]), attached: &[], clock_s: 0.0 };
        tracks(&[job], 60.0, Continuation::Rising).remove(0)
    };
    for (pitch, slope) in [(0.3, 8.0), (0.45, 8.0), (0.45, 2.0), (0.45, 24.0), (0.6, 8.0)] {
        let exact = flown(0.125, pitch, slope);
        let t = flown(STEPS_S.1, pitch, slope);
        let square: f64 = t.sink_m_s.iter().zip(&exact.sink_m_s).map(|(a, b)| (a - b).powi(2)).sum();
        // 5e-5 m/s: a hundredth of what models of gliders are wrong by. Steps of 8 s: 2e-3.
        assert!((square / t.sink_m_s.len() as f64).sqrt() < 5e-5, "{pitch} rad, slope {slope}: {square}");
        let apart = t.depth_m.iter().zip(&exact.depth_m).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < 5e-3, "{pitch} rad, slope {slope}: {apart} m");
    }
}

#[test]
fn regress_several_times_the_lift_is_a_glide_and_no_instability() {
    let run = run(200.0, 0.45, true);
    let sink = |lift: f64| {
        let job = Job {
            run: &run,
            constants: Constants { lift_slope_per_rad: lift * 8.0, ..SLOCUM },
            effects: Cow::Borrowed(&[]),
            attached: &[],
            clock_s: 0.0,
        };
        let t = tracks(&[job], 60.0, Continuation::Rising).pop().expect("one");
        assert!(t.depth_m.iter().all(|z| z.is_finite()), "lift x {lift}");
        // Half way down, in the glide.
        t.sink_m_s[35]
    };
    let (nominal, much) = (sink(1.0), sink(3.0));
    // Three times the lift at a third of the angle of attack: less induced drag, so a little faster down the path.
    assert!(nominal > 0.1 && (much / nominal - 1.0).abs() < 0.5, "{nominal} {much}");
}

#[test]
fn regress_twice_the_lift_on_a_fast_run_is_a_glide_and_no_instability() {
    // Heavy and steep: 0.6 m/s, at which twice the lift decays within a third of a second; one step is too long.
    let mut fast = run(200.0, 0.6, true);
    for i in &mut fast.inputs {
        i.sensed.ballast_m3 *= 3.5;
    }
    let job = Job {
        run: &fast,
        constants: Constants { lift_slope_per_rad: 20.0, ..SLOCUM },
        effects: Cow::Borrowed(&[]),
        attached: &[],
        clock_s: 0.0,
    };
    assert!(tracks(&[job], 60.0, Continuation::Rising)[0].depth_m.iter().all(|z| z.is_finite()));
}

#[test]
fn prop_a_simulation_does_not_depend_on_the_other_lanes() {
    // Unequal lengths; pitches from steep to flatter than any glide, where the model stalls deeply.
    let runs = [run(200.0, 0.45, true), run(150.0, 0.25, false), run(340.0, 0.06, true), run(100.0, 0.35, false), run(260.0, 0.15, true)];
    let sized = |name: &str, size: f64| Active::sized(by_name(name).expect("known"), size);
    let laws: [Vec<Active>; 5] = [
        vec![],
        vec![sized("stall", 0.1), sized("pitch_offset", 0.02)],
        vec![sized("vertical_current", 0.01), sized("pressure_drift", 1.0), sized("horizontal_current", 0.1)],
        vec![sized("vortex_lift_bodywing", 20.0), sized("reynolds_drag", 0.3), sized("hull_compressibility", 0.5)],
        vec![sized("added_mass", 0.4), sized("ballast_scale", 0.05)],
    ];
    let mut jobs: Vec<Job> = Vec::new();
    for run in &runs {
        for (effects, cd0) in laws.iter().zip([0.15, 0.15, 0.3, 0.1, 0.2]) {
            jobs.push(Job { run, constants: Constants { cd0, ..SLOCUM }, effects: Cow::Borrowed(effects), attached: &[], clock_s: 0.0 });
        }
    }
    for beyond in [Continuation::Rising, Continuation::Fading] {
        let together = tracks(&jobs, 60.0, beyond);
        let backwards = tracks(&jobs.iter().rev().cloned().collect::<Vec<_>>(), 60.0, beyond);
        let mut moved = 0;
        for (k, job) in jobs.iter().enumerate() {
            let alone = crate::model::integrator::track(job.run, job.constants, &job.effects, 60.0, beyond);
            assert_eq!(alone.depth_m.len(), job.run.time_s.len());
            assert!(alone.depth_m.iter().all(|z| z.is_finite()), "job {k}");
            assert_eq!(bits(&alone), bits(&together[k]), "job {k}");
            assert_eq!(bits(&alone), bits(&backwards[jobs.len() - 1 - k]), "job {k} backwards");
            moved += usize::from(alone.depth_m.last().is_some_and(|z| z.abs() > 0.1));
        }
        assert!(moved > 20, "{moved}");
    }
    assert!(tracks(&[], 60.0, Continuation::Rising).is_empty());
}

/// Steady flight is where tan|γ| is C_D over C_L (flight format, section 3), by the coefficients of the force law itself.
#[test]
fn validate_a_steady_glide_has_drag_over_lift_as_tangent_of_its_path() {
    for pitch in [0.3, 0.37, 0.45] {
        let run = run(200.0, pitch, false);
        let job = Job { run: &run, constants: SLOCUM, effects: Cow::Borrowed(&[]), attached: &[], clock_s: 0.0 };
        let alpha = tracks(&[job], 60.0, Continuation::Rising)[0].alpha_rad[35];
        let f = ForceModel::new(SLOCUM, &[]).coefficients(&Flow::steady(alpha, 0.3));
        let path = (pitch + alpha.abs()).tan() * f.cl.abs();
        // 1e-4 of the drag: the water gets denser on the way, and the glide follows by its inertia.
        assert!(alpha.abs() > 0.02 && (path / f.cd - 1.0).abs() < 1e-4, "{pitch}: {alpha} rad, {path} and {}", f.cd);
    }
}

/// Rigid body and added mass in six degrees of freedom (Fossen 2011, chapters 3 and 6), steady in a turn without sideslip: found by bisection
/// of the equations themselves, no step of time in it.
#[test]
fn validate_a_banked_turn_is_that_of_a_body_in_six_degrees_of_freedom() {
    let (c, roll, pitch) = (Constants { banked_turn: 1.0, ..SLOCUM }, 0.3_f64, -0.45_f64);
    let mut run = run(200.0, 0.45, false);
    for i in &mut run.inputs {
        (i.roll_rad, i.cos_roll) = (roll, roll.cos());
        i.sensed = Sensed { density_kg_m3: 1002.0, temperature_degc: 10.0, hull_degc: 10.0, pressure_pa: 0.0, ..i.sensed };
    }
    let net = |ballast: f64| c.gravity_m_s2 * (1002.0 * (c.hull_volume_m3 + ballast) - c.mass_kg);
    let job = Job { run: &run, constants: c, effects: Cow::Borrowed(&[]), attached: &[], clock_s: 0.0 };
    let flown = &tracks(&[job], 60.0, Continuation::Rising)[0];
    // In the middle of the dive all is steady.
    let row = 30;
    let b = net(run.inputs[(8.0 * row as f64) as usize].sensed.ballast_m3);
    let (surge, heave) = (c.mass_kg * (1.0 + c.added_mass_surge), c.mass_kg * (1.0 + c.added_mass_heave));
    let (sin, cos) = pitch.sin_cos();
    // x forward, z down the body's own axes, v = 0; yaw rate r from the balance across, q = r tan φ for a steady pitch.
    let along = |alpha: f64| -> (f64, f64) {
        let cl = c.lift_slope_per_rad * (alpha - c.slope_loss_per_rad2 * alpha.powi(3)) + c.lift_quadratic_per_rad2 * alpha * alpha.abs();
        let cd = c.cd0 + c.induced_k * cl * cl + c.hull_drag_per_rad2 * alpha * alpha + c.hull_drag_per_rad3 * alpha.abs().powi(3);
        let (normal, axial) = (cl * alpha.cos() + cd * alpha.sin(), cd * alpha.cos() - cl * alpha.sin());
        // The balance down the body's z gives the speed: −q∞ S C_N − B cos φ cos θ + m1 q u = 0 with m1 q u = −B cos θ sin φ tan φ.
        let pressure = -b * cos * (roll.cos() + roll.sin() * roll.tan()) / normal;
        let speed = (pressure / (0.5 * 1002.0 * c.reference_area_m2)).sqrt();
        let (u, w) = (speed * alpha.cos(), speed * alpha.sin());
        let q = -b * cos * roll.sin() * roll.tan() / (surge * u);
        (-pressure * axial + b * sin - heave * q * w, -u * sin + w * roll.cos() * cos)
    };
    let (mut low, mut high) = (0.01, 0.3);
    for _ in 0..60 {
        let mid = 0.5 * (low + high);
        if along(mid).0.signum() == along(low).0.signum() { low = mid } else { high = mid }
    }
    let sink = along(low).1;
    // 1e-5 m/s: a sine for a tangent of the angle of attack in the pull of the added mass; level flight sinks 4 mm/s faster.
    assert!((flown.sink_m_s[row] - sink).abs() < 1e-5, "{} and {sink} m/s", flown.sink_m_s[row]);
    let job = Job { run: &run, constants: SLOCUM, effects: Cow::Borrowed(&[]), attached: &[], clock_s: 0.0 };
    let level = tracks(&[job], 60.0, Continuation::Rising)[0].sink_m_s[row];
    assert!(level - sink > 1e-3, "{level} and {sink} m/s");
}

#[test]
fn accuracy_lift_in_a_bank_is_smaller_by_the_cosine_of_the_roll() {
    let run = run(200.0, 0.45, true);
    let flat = Constants { induced_k: 0.0, ..SLOCUM };
    let cos = 0.1_f64.cos();
    let smaller = Constants {
        lift_slope_per_rad: cos * flat.lift_slope_per_rad,
        lift_quadratic_per_rad2: cos * flat.lift_quadratic_per_rad2,
        ..flat
    };
    let jobs = [smaller, Constants { bank_tilt: 1.0, ..flat }, flat].map(|constants| Job {
        run: &run,
        constants,
        effects: Cow::Borrowed(&[]),
        attached: &[],
        clock_s: 0.0,
    });
    let flown = tracks(&jobs, 60.0, Continuation::Rising);
    let apart = |a: &Track, b: &Track| a.depth_m.iter().zip(&b.depth_m).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    // 1e-9 m: the same simulation but for rounding.
    assert!(apart(&flown[0], &flown[1]) < 1e-9, "{} m", apart(&flown[0], &flown[1]));
    // Half a per cent of the lift over two legs of 200 s.
    assert!(apart(&flown[0], &flown[2]) > 1e-3, "{} m", apart(&flown[0], &flown[2]));
}

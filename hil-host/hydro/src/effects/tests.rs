//! What every effect of the catalogue must do.

use super::*;

pub(in crate::effects) fn nominal() -> Constants {
    Constants {
        gravity_m_s2: 9.81,
        mass_kg: 68.0,
        hull_volume_m3: 0.068,
        compressibility_per_pa: 5e-10,
        thermal_expansion_per_k: 5e-5,
        reference_temperature_degc: 10.0,
        reference_area_m2: 0.11,
        lift_slope_per_rad: 0.9,
        lift_quadratic_per_rad2: 4.5,
        cd0: 0.15,
        induced_k: 0.35,
        hull_drag_per_rad2: 1.0,
        slope_loss_per_rad2: 0.0,
        hull_drag_per_rad3: 0.0,
        added_mass_surge: 0.2,
        added_mass_heave: 0.92,
        bank_tilt: 0.0,
        banked_turn: 0.0,
        hull_lag_share: 0.0,
        beyond: Beyond::default(),
    }
}

/// Level flow of 0.3 m/s.
pub(in crate::effects) fn at(alpha_rad: f64) -> Flow {
    Flow { alpha_rad, speed_m_s: 0.3, roll_rad: 0.0, climb_m_s: 0.0, time_s: 0.0, temperature_degc: 10.0, attached: false }
}

/// What the sensors say at 100 m under way, the hull warmer than the water.
fn sensed() -> Sensed {
    Sensed {
        time_s: 1e5,
        pitch_rad: -0.4,
        ballast_m3: 2e-4,
        density_kg_m3: 1020.0,
        temperature_degc: 15.0,
        hull_degc: 15.5,
        pressure_pa: 1e6,
    }
}

#[test]
fn every_effect_is_off_by_default_and_its_range_holds_its_off_value() {
    let flows = [(-0.2, 0.25, -0.1), (0.05, 0.4, 0.2), (0.3, 0.3, 0.0), (0.9, 0.1, 0.0)];
    for e in CATALOGUE.iter().copied() {
        let active = [Active::off(e)];
        let (with, without) = (ForceModel::new(nominal(), &active), ForceModel::new(nominal(), &[]));
        assert_eq!(with.constants, without.constants, "{}", e.name);
        let s = sensed();
        assert_eq!(with.truth(s), s, "{}", e.name);
        assert_eq!(with.volume_m3(&s), without.volume_m3(&s), "{}", e.name);
        for (alpha_rad, speed_m_s, roll_rad) in flows {
            let at = Flow { alpha_rad, speed_m_s, roll_rad, climb_m_s: 0.1, time_s: 1e5, temperature_degc: 10.0, attached: false };
            let (a, b) = (with.coefficients(&at), without.coefficients(&at));
            assert!((a.cl - b.cl).abs() < 1e-12 && (a.cd - b.cd).abs() < 1e-12, "{} at {alpha_rad}", e.name);
        }
        assert_eq!(with.water_up_m_s(&Place { time_s: 9.0, depth_m: 40.0, water_depth_m: 100.0, phase_rad: 1.0 }), 0.0);
        assert_eq!(with.pressure_error_pa(1e5), 0.0);
        for (i, p) in e.parameters.iter().enumerate() {
            // Only what is stated beside the size may have no spread.
            let spread = p.typical > 0.0 || (i > 0 && p.is_stated());
            assert!(p.low <= p.off && p.off <= p.high && spread, "{}.{}", e.name, p.name);
        }
        assert!(e.parameters.len() <= MAX_PARAMETERS);
        assert_eq!(by_name(e.name).map(|e| e.name), Some(e.name));
    }
}

#[test]
fn every_effect_changes_something_at_its_typical_size() {
    for e in CATALOGUE.iter().copied() {
        let p = e.parameters[0];
        let size = if p.off + p.typical <= p.high { p.off + p.typical } else { p.off - p.typical };
        let active = [Active::sized(e, size)];
        let (with, without) = (ForceModel::new(nominal(), &active), ForceModel::new(nominal(), &[]));
        let s = sensed();
        let at =
            Flow { alpha_rad: 0.25, speed_m_s: 0.4, roll_rad: 0.2, climb_m_s: 0.1, time_s: 1e5, temperature_degc: 10.0, attached: false };
        let place = Place { time_s: 9.0, depth_m: 40.0, water_depth_m: 100.0, phase_rad: 1.0 };
        let changed = with.constants != without.constants
            || with.volume_m3(&s) != without.volume_m3(&s)
            || with.truth(s) != s
            || with.coefficients(&at) != without.coefficients(&at)
            || with.water_up_m_s(&place) != 0.0
            || with.pressure_error_pa(1e5) != 0.0
            || with.current_m_s() != (0.0, 0.0);
        assert!(changed, "{}", e.name);
    }
}

#[test]
fn prop_lift_is_odd_and_drag_even_and_both_are_continuous() {
    let model = ForceModel::new(nominal(), &[]);
    for i in 0..150 {
        let a = f64::from(i) * 0.01;
        let (p, m) = (model.coefficients(&at(a)), model.coefficients(&at(-a)));
        assert!((p.cl + m.cl).abs() < 1e-12 && (p.cd - m.cd).abs() < 1e-12, "{a}");
    }
    let (below, above) = (model.coefficients(&at(0.349_999_99)), model.coefficients(&at(0.350_000_01)));
    assert!((below.cl - above.cl).abs() < 1e-6 && (below.cd - above.cd).abs() < 1e-6);
}

#[test]
fn accuracy_growth_keeps_its_mean_rate_over_the_trial_whatever_its_power() {
    let day = |days: f64| Flow { time_s: days * DAY_S, ..at(0.05) };
    for power in [0.5, 1.0, 2.2] {
        let effects = [Active { effect: &drag::BIOFOULING_DRAG, values: [0.1, power, 8.0, 0.0] }];
        let model = ForceModel::new(nominal(), &effects);
        let grown = |days: f64| model.added_drag(&day(days), 0.0) / nominal().cd0;
        assert!((grown(8.0) - 0.8).abs() < 1e-12, "power {power}: {} after 8 days", grown(8.0));
        assert!((grown(2.0) - 0.8 * 0.25_f64.powf(power)).abs() < 1e-12, "power {power}: {} after 2 days", grown(2.0));
        assert_eq!(grown(0.0), 0.0);
    }
}

#[test]
fn prop_a_wing_set_at_an_angle_stalls_as_far_above_zero_lift_as_below() {
    let effects = [Active::sized(&lift::STALL, 0.06), Active::sized(&lift::ZERO_LIFT_ANGLE, 0.03)];
    let model = ForceModel::new(nominal(), &effects);
    for i in 0..30 {
        let a = f64::from(i) * 0.01;
        let (above, below) = (model.coefficients(&at(0.03 + a)).cl, model.coefficients(&at(0.03 - a)).cl);
        assert!((above + below).abs() < 1e-12, "{a}: {above} {below}");
    }
}

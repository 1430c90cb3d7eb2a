//! Own effects: what is parsed, and what is refused where.

use super::*;
use hydro::effects::Beyond;

#[test]
fn an_expression_does_what_the_built_in_effect_of_the_same_form_does() {
    let own = parse("cd += k*roll^2").expect("parses");
    let at = Flow { alpha_rad: 0.1, speed_m_s: 0.3, roll_rad: 0.4, climb_m_s: 0.1, time_s: 9.0, temperature_degc: 10.0, attached: false };
    let c = Constants {
        gravity_m_s2: 9.81,
        mass_kg: 68.0,
        hull_volume_m3: 0.068,
        compressibility_per_pa: 0.0,
        thermal_expansion_per_k: 0.0,
        reference_temperature_degc: 0.0,
        reference_area_m2: 0.1,
        lift_slope_per_rad: 1.0,
        lift_quadratic_per_rad2: 0.0,
        cd0: 0.1,
        induced_k: 0.0,
        hull_drag_per_rad2: 0.0,
        slope_loss_per_rad2: 0.0,
        hull_drag_per_rad3: 0.0,
        added_mass_surge: 0.0,
        added_mass_heave: 0.0,
        bank_tilt: 0.0,
        banked_turn: 0.0,
        hull_lag_share: 0.0,
        beyond: Beyond::default(),
    };
    let [own_drag, built_in] = [own, &hydro::effects::ROLL_TURN_DRAG].map(|e| e.drag.expect("it adds drag"));
    assert!((own_drag(&[2.5], &at, 0.0, &c) - built_in(&[2.5, 0.0], &at, 0.0, &c)).abs() < 1e-12);
    assert_eq!(own.parameters[0].name, "k");
}

#[test]
fn syntax_errors_point_at_the_character() {
    let place = |text: &str| parse(text).expect_err("refused").to_string();
    assert!(place("cd += k*roll^").contains("character 14"), "{}", place("cd += k*roll^"));
    assert!(place("cd += k*(roll").contains("character 9"), "{}", place("cd += k*(roll"));
    assert!(place("cd += k*p").contains("character 9"), "{}", place("cd += k*p"));
    assert!(place("mass += k").contains("cannot be added to"));
    assert!(place("cd += roll").contains("no parameter"));
    assert!(place("cd += k ? roll").contains("character 9"), "{}", place("cd += k ? roll"));
    for (text, at) in [("cd += -alpha^2*k", 7), ("cd += k*(-sin(alpha)^2)", 10), ("cd += k*2^alpha^2", 10), ("cd += k*-roll ^2", 9)] {
        let e = place(text);
        assert!(e.contains(&format!("character {at}: is it (")), "{text}: {e}");
    }
    for text in ["cd += -(alpha^2)*k", "cd += k*(-alpha)^2", "cd += k*alpha^2 - 2*roll^2*k", "cd += k*exp(-roll/1e-3)*alpha^2"] {
        assert!(parse(text).is_ok(), "{text}");
    }
    let e = place("cd += k*foo(roll)");
    assert!(e.contains("character 9: `foo` is no function; there are sin, cos"), "{e}");
    // Of a sound call the next fault is named, and a bracket after another one is a missing operator.
    assert!(place("cd += k*sin(roll").contains("never closed"), "{}", place("cd += k*sin(roll"));
    assert!(place("cd += (k)(roll)").contains("character 10: an operator is missing"), "{}", place("cd += (k)(roll)"));
}

#[test]
fn regress_endless_and_deep_expressions_are_refused_quickly() {
    let began = std::time::Instant::now();
    for (text, why) in [
        (format!("cd += {}k*roll", "-".repeat(100_000)), "longer than"),
        (format!("cd += k*{}roll{}", "(".repeat(900), ")".repeat(900)), "longer than"),
        (format!("cd += k*{}roll{}", "(".repeat(400), ")".repeat(400)), "brackets are more than"),
        (format!("cd += k*{}roll{}", "sin(".repeat(150), ")".repeat(150)), "brackets are more than"),
        ("é".repeat(50_000) + "+=k", "longer than"),
    ] {
        let e = parse(&text).expect_err("refused").to_string();
        assert!(e.contains(why) && e.len() < 2000, "{} bytes: {e:.200}", e.len());
    }
    // The longest that is read, of signs alone.
    let _ = parse(&format!("cd += {}k*roll", "-".repeat(900)));
    assert!(began.elapsed().as_secs_f64() < 2.0, "{:?}", began.elapsed());
    assert!(parse(&format!("cd += k*{}roll{}", "(".repeat(20), ")".repeat(20))).is_ok());
}

#[test]
fn regress_a_slip_in_a_variable_is_no_parameter() {
    let why = |text: &str| parse(text).expect_err("refused").to_string();
    let slips = [("cd += k*rol", "roll"), ("cd += k*alpa^2", "alpha"), ("cd += k*alfa", "alpha"), ("volume_cc += k*Ballast", "ballast")];
    assert!(why(slips[2].0).contains("There are alpha, U, roll, climb, phase, t;"), "{}", why(slips[2].0));
    for (text, meant) in slips {
        assert!(why(text).contains(&format!("did you mean `{meant}`?")), "{}", why(text));
    }
    assert!(why("cd += k*rol").contains("character 9"), "{}", why("cd += k*rol"));
    // A number of its own beside a variable, and short names, are parameters.
    for text in
        ["cd += k*(alpha - alpha0)^2", "cd += k*(alpha - aero)^2", "density_kg_m3 += a*(T - b)", "cd += k*ab*roll", "volume_cc += k*rho_0"]
    {
        assert!(parse(text).is_ok(), "{text}: {}", why(text));
    }
}

//! What is taken out of a log, or asked about it, before a model is run: air in the CTD's cell, pressures held from a slower channel,
//! pressures in another unit; and expressions that do nothing.

use std::path::Path;

use discovery::Flight;
use discovery::preprocess::{prepare, sanity};
use discovery::vehicle::{self, Vehicle, expression};
use hydro::ForceModel;
use hydro::glide::{Trim, steady};

const VEHICLE: &str = r#"{"mass_kg":68,"hull_volume_m3":0.0663415,"hull_compressibility_per_pa":5e-10,"hull_thermal_expansion_per_k":5e-5,
    "wing":{"area_m2":0.1},"hydro":{"reference_area_m2":0.1,"wing_lift_slope_per_rad":7.5,"hull_lift_slope_per_rad":0,
    "hull_area_m2":0.1,"cd0":0.15,"hull_drag_per_rad2":10.5},"tolerance_1sigma":{"cd0_relative":0.1}}"#;

fn vehicle() -> Vehicle {
    vehicle::parse_text(VEHICLE, Path::new("v.json")).expect("a vehicle")
}

#[test]
fn regress_a_byte_order_mark_is_no_part_of_a_vehicle_file() {
    let with = vehicle::parse_text(&format!("\u{feff}{VEHICLE}"), Path::new("v.json")).expect("a vehicle");
    assert_eq!(with.constants, vehicle().constants);
}

/// Rate of depth of this vehicle with 200 cm³ at 0.4 rad, m/s.
fn rate_m_s() -> f64 {
    let trim = Trim { pitch_rad: -0.4, net_buoyancy_n: -9.81 * 1025.0 * 2e-4, rho_kg_m3: 1025.0 };
    let glide = steady(&ForceModel::new(vehicle().constants, &[]), &trim).expect("glides").lowest;
    assert!((0.1..0.3).contains(&glide.sink_m_s), "{glide:?}");
    glide.sink_m_s
}

/// Saw-teeth to 60 m from `top_m` at a rate, pressures times `factor`.
fn flight(factor: f64, rate_m_s: f64, top_m: f64) -> Flight {
    let n = 900;
    let mut f = Flight::blank(n);
    let (mut depth, mut down) = (top_m, true);
    for i in 0..n {
        down = if depth > 60.0 { false } else { down || depth <= top_m };
        depth += if down { 4.0 } else { -4.0 } * rate_m_s;
        f.time_s[i] = 4.0 * i as f64;
        f.pressure_pa[i] = factor * 1025.0 * 9.81 * depth;
        f.pitch_rad[i] = if down { -0.4 } else { 0.4 };
        f.ballast_m3[i] = if down { -2e-4 } else { 2e-4 };
        f.density_kg_m3[i] = 1025.0;
        f.temperature_degc[i] = 15.0;
    }
    f
}

fn note(flight: &Flight, about: &str) -> Option<String> {
    prepare(flight, &vehicle()).notes.into_iter().find(|n| n.contains(about))
}

#[test]
fn regress_psi_and_tens_are_suspected_and_a_dragging_vehicle_is_not() {
    let about = "as fast as this vehicle glides";
    let rate = rate_m_s();
    let sound = flight(1.0, rate, 5.0);
    assert_eq!(note(&sound, about), None);
    assert_eq!(sanity::check(&prepare(&sound, &vehicle()), &vehicle()), Ok(()));
    for (factor, said) in [(1.450_38, "psi named dbar"), (0.689_476, "taken for psi"), (0.1, "bar named dbar")] {
        let note_found = note(&flight(factor, rate, 25.0), about).unwrap_or_else(|| panic!("{factor} passes"));
        assert!(note_found.contains(said), "{factor}: {note_found}");
    }
    // Ten times as fast, or as slow, is no vehicle: refused, where psi may be a vehicle that drags.
    // With a sixth of the drive, so that ten times the rate is none that a log is refused for.
    for (factor, refused) in [(10.0, true), (0.1, true), (1.450_38, false), (1.0, false)] {
        let mut slow = flight(factor, rate / 6.0_f64.sqrt(), 25.0);
        slow.ballast_m3.iter_mut().for_each(|v| *v /= 6.0);
        let prepared = prepare(&slow, &vehicle());
        let said = sanity::check(&prepared, &vehicle());
        assert_eq!(said.is_err_and(|why| why.starts_with("pressure_dbar: depth changes")), refused, "{factor}");
    }
    // A quarter more drag, a tenth less.
    for drag in [1.25_f64, 0.9] {
        assert_eq!(note(&flight(1.0, rate / drag.sqrt(), 5.0), about), None, "{drag}");
    }
}

#[test]
fn regress_air_in_the_cell_is_left_out_and_a_halocline_stays() {
    let about = "air in the CTD";
    for (water, lost) in [(999.0, 20.0), (1025.0, 20.0), (1025.0, 6.0)] {
        let mut f = flight(1.0, 0.13, 0.2);
        for (rho, p) in f.density_kg_m3.iter_mut().zip(&f.pressure_pa) {
            *rho = water + 2.0 / (1.0 + (4.0 - p / 1e4).exp()) + 4.5e-7 * p;
        }
        assert_eq!(note(&f, about), None, "water of {water} as it is");
        let in_air = f.pressure_pa.iter().filter(|p| **p < 2e4).count();
        for (rho, p) in f.density_kg_m3.iter_mut().zip(&f.pressure_pa) {
            *rho -= if *p < 2e4 { lost } else { 0.0 };
        }
        let note_found = note(&f, about).unwrap_or_else(|| panic!("{water} less {lost}"));
        assert!(in_air > 20 && note_found.starts_with(&format!("{in_air} densities")), "{water} less {lost}, {in_air}: {note_found}");
    }
}

#[test]
fn regress_held_pressures_are_thinned_and_coarse_ones_stay() {
    let about = "holds each value";
    let mut f = flight(1.0, 0.14, 5.0);
    f.pressure_pa.iter_mut().enumerate().for_each(|(i, p)| *p = (*p + 30.0 * (i % 7) as f64).round());
    assert_eq!(note(&f, about), None);
    for times in [2, 3] {
        let mut held = f.clone();
        held.pressure_pa.iter_mut().enumerate().for_each(|(i, p)| *p = f.pressure_pa[i - i % times]);
        let repeats = (0..held.len()).filter(|i| i % times > 0).count();
        let note_found = note(&held, about).unwrap_or_else(|| panic!("{times} times"));
        assert!(note_found.contains(&format!("{repeats} repeats")), "{repeats}: {note_found}");
        // The samples that are left are a flight.
        let used = prepare(&held, &vehicle()).runs.iter().flat_map(|r| &r.used).filter(|u| **u).count();
        assert!(used * times > f.len() / 2, "{times} times: {used} rows of {}", f.len());
    }
    let mut coarse = flight(1.0, 0.03, 5.0);
    coarse.pressure_pa.iter_mut().for_each(|p| *p = (*p / 5e3).round() * 5e3);
    assert_eq!(note(&coarse, about), None);
}

#[test]
fn regress_exponents_are_read_and_a_parameter_without_effect_is_refused() {
    for text in ["volume_cc += a*exp(-p/1e5)", "volume_cc += a*exp(-p/1.0E+5)", "cd += k*alpha^2*1e-1", "density_kg_m3 += e5*T"] {
        expression::parse(text).unwrap_or_else(|e| panic!("{e}"));
    }
    for (text, said) in [
        ("cd += k/0", "no number"),
        ("cd += k*ln(-1)", "no number"),
        ("cd += 0*k", "`k` changes nothing"),
        ("cd += k-k", "`k` changes nothing"),
        ("cd += k*roll^2 + 0*m", "`m` changes nothing"),
    ] {
        let e = expression::parse(text).expect_err(text).to_string();
        assert!(e.contains(said), "{text}: {e}");
    }
}

//! Which of two sets of lift and drag a flight was flown with.

use super::classes::REFERENCE_AREA_M2;
use super::draft::Draft;
use super::trim::{Hull, off_m_s};
use crate::record::flight::Flight;

/// The other set is taken where it leaves less than this share of what the first one leaves (guess).
const CLEARLY_LESS: f64 = 0.9;
/// Steepest angle of attack of a steady glide that is looked for, rad, and the step of the search.
const STEEPEST_RAD: f64 = 0.3;
const STEP_RAD: f64 = 0.002;
/// Speed at which the coefficient of drag is stated, m/s.
const STATED_AT_M_S: f64 = 0.3;

/// The draft with the set of its two that leaves less of the vertical velocity in steady glides, and what is to be said of it.
pub(super) fn decided(mut draft: Draft, flight: &Flight, hull: Hull, volume_m3: Option<f64>) -> (Draft, Option<String>) {
    let Some((other, [name, other_name])) = draft.other.take() else { return (draft, None) };
    let left = |of: &Draft| volume_m3.and_then(|v| off_m_s(flight, hull, v, |pitch, kg, rho| rising_m_s(of, pitch, kg, rho)));
    let (own, others) = (left(&draft), left(&other));
    let said = match (own, others) {
        (Some(own), Some(others)) => {
            let other_is_better = others < CLEARLY_LESS * own;
            let (taken, least, most) = if other_is_better { (other_name, others, own) } else { (name, own, others) };
            if other_is_better {
                draft = *other;
            }
            let [least, most] = [least, most].map(|v| 100.0 * v);
            format!("{taken} is taken, which leaves {least:.1} cm/s of the vertical velocity in steady glides, the other {most:.1} cm/s")
        }
        _ => format!("{name} is taken, as the flight has no steady glides that decide"),
    };
    draft.about.push(format!("Of the two sets of lift and drag {said}."));
    (draft, Some(format!("of the two sets of lift and drag {said}")))
}

/// Vertical velocity of the steady glide at a pitch, rad, under a net buoyancy, kg; upward positive, m/s. Lift a·α, drag
/// cd0·(U / 0.3 m/s)^−e + c·α², of the reference area of the classes.
fn rising_m_s(draft: &Draft, pitch_rad: f64, net_kg: f64, rho_kg_m3: f64) -> Option<f64> {
    let number = |key: &str| draft.get(key);
    let (lift, cd0) = (number("hydro.hull_lift_slope_per_rad")?, number("hydro.cd0")?);
    let (induced, exponent) = (number("hydro.hull_drag_per_rad2")?, number("effects.reynolds_drag.exponent").unwrap_or(0.0));
    let force_n = net_kg.abs() * 9.81;
    let mut speed_m_s = STATED_AT_M_S;
    let mut rate = None;
    for _ in 0..20 {
        let drag = cd0 * (speed_m_s / STATED_AT_M_S).powf(-exponent);
        // Lift and drag as the path asks; the smallest such angle is the fast glide.
        let over = |alpha: f64| lift * alpha * (pitch_rad.abs() + alpha).tan() - drag - induced * alpha * alpha;
        let steps = (1..).map(|k| STEP_RAD * f64::from(k)).take_while(|a| *a < STEEPEST_RAD);
        let alpha = steps.into_iter().find(|a| over(*a) > 0.0)?;
        let (low, high) = (over(alpha - STEP_RAD), over(alpha));
        let alpha = alpha - STEP_RAD * high / (high - low);
        let path_rad = pitch_rad.abs() + alpha;
        let new = (2.0 * force_n * path_rad.cos() / (rho_kg_m3 * REFERENCE_AREA_M2 * lift * alpha)).sqrt();
        speed_m_s = 0.5 * (speed_m_s + new);
        rate = Some(speed_m_s * path_rad.sin() * net_kg.signum());
    }
    rate.filter(|w| w.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::classes::Class;

    /// A flight of the one set of numbers, distinguished from a set with twice the drag, whichever stands first.
    #[test]
    fn accuracy_the_set_that_a_flight_was_flown_with_is_found() {
        let set = |draft: &Draft, cd0: f64| {
            let mut draft = draft.clone();
            draft.set("hydro.cd0", cd0, "");
            draft
        };
        let truth = set(&Class::Seaglider.draft(), 0.14);
        let hull = Hull { mass_kg: 54.0, compressibility_per_pa: 4e-10, expansion_per_k: 5e-5, reference_degc: 10.0 };
        let (volume, rho) = (54.0 / 1026.0, 1026.0);
        let mut flight = Flight::blank(3000);
        let (mut p, mut down) = (1e5, true);
        for i in 0..3000 {
            down = if p > 4e6 { false } else { down || p < 8e4 };
            let (ballast, pitch) = if down { (-2e-4, -0.35) } else { (2e-4, 0.35) };
            let net = rho * (volume * (1.0 - 4e-10 * p) + ballast) - 54.0;
            (flight.time_s[i], flight.pressure_pa[i], flight.pitch_rad[i], flight.ballast_m3[i]) = (10.0 * i as f64, p, pitch, ballast);
            (flight.density_kg_m3[i], flight.temperature_degc[i]) = (rho, 10.0);
            p -= 10.0 * rising_m_s(&truth, pitch, net, rho).expect("a glide") * rho * 9.81;
        }
        let wrong = set(&truth, 0.3);
        let both = |first: &Draft, second: &Draft| {
            let mut draft = first.clone();
            draft.other = Some((Box::new(second.clone()), ["a", "b"]));
            draft
        };
        for (first, second) in [(&truth, &wrong), (&wrong, &truth)] {
            let (got, said) = decided(both(first, second), &flight, hull, Some(volume));
            assert_eq!(got.get("hydro.cd0"), Some(0.14), "{said:?}");
        }
        let (got, said) = decided(both(&wrong, &truth), &flight, hull, None);
        assert!(got.get("hydro.cd0") == Some(0.3) && said.is_some_and(|s| s.contains("no steady glides")));
    }
}

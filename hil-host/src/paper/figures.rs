//! Figures 3 to 11 of the paper, redrawn from our models and flights.

use hydro::lift_slope::{HOERNER_ASPECT_RATIO_MAX, TAU, hoerner_borst, lowry_polhamus, prandtl, slender};
use hydro::section::NACA0006_LIFT_SLOPE_PER_RAD as CLA;
use hydro::{Flow, Geometry, Polar};
use signals::Wings;

use super::trials::Trials;
use super::variants::{curve, geometry, paper, plain};
use crate::pages::chart::{Chart, Mark, histogram};

/// Angles in degrees for smooth curves.
fn degrees(to: f64) -> impl Iterator<Item = f64> {
    (0..=(to * 4.0) as u32).map(|i| f64::from(i) / 4.0)
}

/// All figures with the stem of their files.
///
/// # Errors
/// Never for the committed vehicle files.
pub fn all(trials: &Trials) -> anyhow::Result<Vec<(&'static str, Chart)>> {
    let (std, low) = (plain(Wings::Standard)?, plain(Wings::LowAspectRatio)?);
    let (std_c, low_c) = (paper(Wings::Standard)?, paper(Wings::LowAspectRatio)?);
    let (std_s, low_s) = (geometry("slocum-standard-sea")?, geometry("slocum-low-ar-sea")?);
    Ok(vec![
        ("fig03", fig3()),
        ("fig04", fig4(&std)),
        ("fig05", fig5(&std, &low)?),
        ("fig06", shares("Fig. 6: lift by part, standard wings (tuned to the paper)", &std_c)),
        ("fig07", shares("Fig. 7: lift by part, low aspect ratio wings (tuned to the paper)", &low_c)),
        ("fig08", flown("Fig. 8: L/D of the standard glider, model and flight", &std, &std_s, &trials.stock[0])),
        ("fig09", flown("Fig. 9: L/D of the low aspect ratio glider, model and flight", &low, &low_s, &trials.stock[1])),
        ("fig10", fig10(&std_s, &low_s)),
        ("fig11a", fig11(trials, "a: true angle of attack", |t| &t.alpha_deg)),
        ("fig11b", fig11(trials, "b: pitch", |t| &t.pitch_deg)),
        ("fig11c", fig11(trials, "c: path angle", |t| &t.glide_deg)),
    ])
}

fn fig3() -> Chart {
    let grid: Vec<f64> = (1..=200).map(|i| 0.02 * f64::from(i)).collect();
    let of = |f: &dyn Fn(f64) -> f64| grid.iter().map(|a| (*a, f(*a))).collect::<Vec<_>>();
    let hoerner = grid.iter().filter(|a| **a <= HOERNER_ASPECT_RATIO_MAX).map(|a| (*a, hoerner_borst(*a))).collect::<Vec<_>>();
    Chart::lines("Fig. 3: lift-curve slope against aspect ratio", "aspect ratio, 1", "lift-curve slope, 1/rad")
        .plus("Prandtl (4)", Mark::Line, of(&|a| prandtl(CLA, a, TAU)))
        .plus("Lowry-Polhamus (5) = Roskam (6)", Mark::Line, of(&|a| lowry_polhamus(CLA, a, 0.0)))
        .plus("Hoerner-Borst (9)", Mark::Line, hoerner)
        .plus("slender wing", Mark::Dashed, of(&slender))
        .within(None, Some((0.0, 4.5)))
}

fn fig4(g: &Geometry) -> Chart {
    let polar = g.polar();
    let part = |f: &dyn Fn(f64) -> f64| degrees(25.0).map(|d| (d, f(d.to_radians()) / g.reference_area_m2)).collect::<Vec<_>>();
    Chart::lines("Fig. 4: hull alone", "angle of attack, deg", "coefficient on 0.1 m2, 1")
        .plus("C_L", Mark::Line, part(&|a| polar.breakdown(a).body.cl))
        .plus("C_D", Mark::Line, part(&|a| polar.breakdown(a).body.cd))
}

fn fig5(std: &Geometry, low: &Geometry) -> anyhow::Result<Chart> {
    let models = rig::flight::vehicles::built_in("slocum-low-ar")?.models;
    let chart = Chart::lines("Fig. 5: L/D of the models, literature constants", "angle of attack, deg", "L/D, 1").plus(
        "standard wings (surrogate of Shortal)",
        Mark::Line,
        curve(std, 0.0, 40.0, 0.25),
    );
    Ok(models.iter().fold(chart, |c, m| {
        c.plus(m.name(), Mark::Line, degrees(40.0).map(|d| (d, super::claims::with_model(low, *m, d))).collect::<Vec<_>>())
    }))
}

fn shares(title: &str, g: &Geometry) -> Chart {
    let polar = g.polar();
    let of = |f: &dyn Fn(&hydro::Breakdown) -> f64| {
        degrees(40.0).skip(1).map(|d| (d, 100.0 * f(&polar.breakdown(d.to_radians())))).collect::<Vec<_>>()
    };
    Chart::lines(title, "angle of attack, deg", "share of the vehicle, %")
        .plus("lift of the wings", Mark::Line, of(&|b| b.wing_lift_share()))
        .plus("lift of the hull", Mark::Line, of(&|b| b.body.cl / b.total().cl))
        .plus("drag of the wings", Mark::Dashed, of(&|b| (b.wing.cd + b.carry_over.cd) / b.total().cd))
        .plus("drag of the hull", Mark::Dashed, of(&|b| b.body.cd / b.total().cd))
        .within(None, Some((0.0, 100.0)))
}

fn flown(title: &str, plain: &Geometry, sea: &Geometry, trial: &super::trials::Trial) -> Chart {
    let samples = trial.alpha_deg.iter().copied().zip(trial.sample_l_over_d.iter().copied()).collect::<Vec<_>>();
    Chart::lines(title, "true angle of attack, deg", "L/D, 1")
        .plus("paper's model structure", Mark::Line, curve(plain, 0.0, 40.0, 0.25))
        .plus("sea-calibrated model", Mark::Line, curve(sea, 0.0, 40.0, 0.25))
        .plus("plant, 26 deg pitch, each cycle", Mark::Point, samples)
        .within(Some((0.0, 40.0)), Some((0.0, 7.5)))
}

fn fig10(std: &Geometry, low: &Geometry) -> Chart {
    let line = |g: &Geometry| {
        let polar = g.polar();
        degrees(40.0).map(|d| (d, polar.force(&Flow::steady(d.to_radians(), 0.3)).l_over_d())).collect::<Vec<_>>()
    };
    Chart::lines("Fig. 10: both gliders, sea-calibrated models", "angle of attack, deg", "L/D, 1")
        .plus("standard", Mark::Line, line(std))
        .plus("low aspect ratio", Mark::Line, line(low))
}

fn fig11(trials: &Trials, what: &str, of: impl Fn(&super::trials::Trial) -> &Vec<f64>) -> Chart {
    let bars = |t: &super::trials::Trial| histogram(of(t), 0.0, 90.0, 45).into_iter().map(|(x, y)| (x, 100.0 * y)).collect::<Vec<_>>();
    Chart::lines(&format!("Fig. 11{what}, plant at 26 deg pitch, 3-27 m"), "angle, deg", "share of gliding time, %")
        .plus("standard", Mark::Bar, bars(&trials.stock[0]))
        .plus("low aspect ratio", Mark::Bar, bars(&trials.stock[1]))
}

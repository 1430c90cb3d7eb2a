//! The 25 claims.

use hydro::lift_slope::{TAU, hoerner_borst, lowry_polhamus, prandtl, roskam, slender};
use hydro::rectangular::side_edge_kv;
use hydro::section::{NACA0006_ALPHA_CL_MAX_RAD, NACA0006_CL_MAX, NACA0006_LIFT_SLOPE_PER_RAD as CLA, SOUND_SPEED_WATER_M_S, eta};
use hydro::wing::{VORTEX_LIFT_KV, WingModel, fidler_a1, polhamus_lamar};
use hydro::{Flow, Geometry, Polar};
use signals::Wings;

use super::trials::{Trials, share_within};
use super::variants::{at_sea, best, carry_over, curve, fuller, l_over_d, no_suction, pair_aspect_ratio, paper, plain, wing_share};
use super::{Claim, Finding};

/// Aspect ratio of the rail wing, paper sec. III.
const A_LOW: f64 = 0.3155;
/// Sweeps, rad, and aspect ratios the limits are tested over.
const SWEEPS_RAD: [f64; 3] = [0.0, 0.5, std::f64::consts::FRAC_PI_4];
/// Tube diameter, m (21 in), and case plus clearance a side, m (guess: thinnest case that is still a case).
const TUBE_M: (f64, f64) = (0.533, 0.017);

/// Everything a claim may look at.
pub struct Evidence {
    /// The flights.
    pub trials: Trials,
}

/// Range of angles where one curve lies above another, deg: (from, to, largest gain as a fraction, at deg).
#[must_use]
pub fn advantage(low: &Geometry, standard: &Geometry) -> Option<(f64, f64, f64, f64)> {
    let gains: Vec<(f64, f64)> =
        curve(low, 5.0, 45.0, 0.25).iter().zip(curve(standard, 5.0, 45.0, 0.25)).map(|(l, s)| (l.0, l.1 / s.1 - 1.0)).collect();
    let (at, gain) = gains.iter().copied().fold((0.0, 0.0), |top, g| if g.1 > top.1 { g } else { top });
    let above: Vec<f64> = gains.iter().filter(|g| g.1 > 0.0).map(|g| g.0).collect();
    Some((*above.first()?, *above.last()?, gain, at))
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let (ma, mb) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let cov: f64 = a.iter().zip(b).map(|(x, y)| (x - ma) * (y - mb)).sum();
    let (va, vb): (f64, f64) = (a.iter().map(|x| (x - ma).powi(2)).sum(), b.iter().map(|y| (y - mb).powi(2)).sum());
    cov / (va * vb).sqrt()
}

/// Lowest pairwise correlation of the three low-aspect-ratio models' L/D over 1–25°, and their largest relative difference.
///
/// # Errors
/// Never for the committed files.
pub fn model_agreement(change: impl Fn(Geometry) -> Geometry) -> anyhow::Result<(f64, f64)> {
    let file = crate::flight::vehicles::built_in("slocum-low-ar")?;
    let curves: Vec<Vec<f64>> = file
        .models
        .iter()
        // The paper's three.
        .filter(|model| !matches!(model, WingModel::SideEdge(_)))
        .map(|model| {
            let mut g = change(file.geometry);
            g.wing.model = *model;
            curve(&g, 1.0, 25.0, 0.5).into_iter().map(|p| p.1).collect()
        })
        .collect();
    let (mut least, mut differ) = (1.0f64, 0.0f64);
    for (i, a) in curves.iter().enumerate() {
        for b in &curves[i + 1..] {
            least = least.min(correlation(a, b));
            differ = a.iter().zip(b).fold(differ, |d, (x, y)| d.max((x / y - 1.0).abs()));
        }
    }
    Ok((least, differ))
}

/// Rms error of C_L of eq. 11 with K_v = π against Polhamus' wind-tunnel data, and without the vortex term, for A 0.5, 1, 1.5.
#[must_use]
pub fn delta_wing_rms() -> [(f64, f64); 3] {
    // Lift slopes by a vortex lattice of 20 x 20 panels a side, 1/rad.
    [(0.5, 0.7096), (1.0, 1.2947), (1.5, 1.7853)].map(|(a, kp)| {
        let rows: Vec<(f64, f64)> = include_str!("../../hydro/tests/data/polhamus-1966/lift.csv")
            .lines()
            .skip(1)
            .filter_map(|l| {
                let mut v = l.split(',').filter_map(|x| x.parse::<f64>().ok());
                let (of, alpha, cl) = (v.next()?, v.next()?, v.next()?);
                ((of - a).abs() < 1e-9).then_some((alpha.to_radians(), cl))
            })
            .collect();
        let rms = |kv: f64| (rows.iter().map(|(x, cl)| (polhamus_lamar(kp, kv, *x) - cl).powi(2)).sum::<f64>() / rows.len() as f64).sqrt();
        (rms(VORTEX_LIFT_KV), rms(0.0))
    })
}

fn percent(x: f64) -> String {
    format!("{:+.1} %", 100.0 * x)
}

/// All claims, in order.
///
/// # Errors
/// Never for the committed vehicle files.
pub fn all(evidence: &Evidence) -> anyhow::Result<Vec<Claim>> {
    let mut claims = theory();
    claims.extend(model()?);
    claims.extend(trial(&evidence.trials)?);
    Ok(claims)
}

/// Claims 1 to 10: sections, slopes, hull, vortex lift.
fn theory() -> Vec<Claim> {
    use Finding as F;
    let mach = 0.3 / SOUND_SPEED_WATER_M_S;
    let mut apart = 0.0f64;
    let (mut slender_error, mut two_d_error) = (0.0f64, 0.0f64);
    for sweep in SWEEPS_RAD {
        for i in 1..=200 {
            let a = 0.05 * f64::from(i);
            apart = apart.max((roskam(CLA, a, sweep, mach) / lowry_polhamus(CLA, a, sweep) - 1.0).abs());
        }
        slender_error = slender_error.max((lowry_polhamus(CLA, 0.05, sweep) / slender(0.05) - 1.0).abs());
        two_d_error = two_d_error.max((lowry_polhamus(CLA, 1e4, sweep) / (CLA * sweep.cos()) - 1.0).abs());
    }
    slender_error = slender_error.max((hoerner_borst(0.05) / slender(0.05) - 1.0).abs()).max((fidler_a1(0.05) / slender(0.05) - 1.0).abs());
    let slopes: [fn(f64) -> f64; 3] = [|a| prandtl(CLA, a, TAU), |a| lowry_polhamus(CLA, a, 0.0), hoerner_borst];
    let ratios = slopes.map(|f| f(0.5) / f(2.0));
    let over = prandtl(CLA, A_LOW, TAU) / hoerner_borst(A_LOW) - 1.0;
    let rms = delta_wing_rms();
    let plates = super::plates::scores();
    let on_plates = |equation: &str| {
        plates.iter().find(|s| s.equation == equation).map_or((f64::NAN, f64::NAN), |s| {
            let worst = |v: &[f64]| v.iter().fold(0.0f64, |w, x| if x.abs() <= w { w } else { x.abs() });
            (worst(&s.slope), worst(&s.cl))
        })
    };
    vec![
        Claim {
            id: 1,
            claim: "NACA 0006: section slope, largest lift coefficient and its angle (eqs. 1-3)",
            paper: "6.188/rad, 0.92, 9.0 deg",
            ours: format!("{CLA}/rad, {NACA0006_CL_MAX}, {:.1} deg; eta {:.5}", NACA0006_ALPHA_CL_MAX_RAD.to_degrees(), eta(CLA)),
            verdict: F::reproduced_if((CLA - 0.108 * 180.0 / std::f64::consts::PI).abs() < 1e-3),
            why: "6.188 is the handbook's 0.108 per degree; eqs. 2 and 3 hold at Re 9e6, not at a glider's chord Re of 2e4 to 1e5, and never enter L/D.".into(),
        },
        Claim {
            id: 2,
            claim: "Lowry-Polhamus (5) and Roskam (6) are of similar form (eqs. 5-8)",
            paper: "two separate curves in fig. 3",
            ours: format!("largest difference in water {apart:.1e}"),
            verdict: F::reproduced_if(apart < 1e-6),
            why: "With both misprints corrected (4 inside the root, beta for kappa) they are one formula in an incompressible fluid.".into(),
        },
        Claim {
            id: 3,
            claim: "Low aspect ratio limit of the slopes (eqs. 5, 9, 13)",
            paper: "pi/2 A per rad",
            ours: format!("within {:.2} % at A = 0.05", 100.0 * slender_error),
            verdict: F::reproduced_if(slender_error < 0.01),
            why: "Holds for the corrected forms; as printed, eq. 5 tends to pi/3 A, eq. 9 is per degree and eq. 13 lacks A.".into(),
        },
        Claim {
            id: 4,
            claim: "High aspect ratio limit of eq. 5",
            paper: "section slope x cos(sweep)",
            ours: format!("within {:.3} % at A = 1e4", 100.0 * two_d_error),
            verdict: F::reproduced_if(two_d_error < 1e-3),
            why: "Holds for the corrected eq. 5.".into(),
        },
        Claim {
            id: 5,
            claim: "The slope at A = 0.5 is significantly less than at A = 2 (fig. 3)",
            paper: "much less",
            ours: format!("slope ratio {:.2} (eq. 9), {:.2} (eq. 5), {:.2} (eq. 4)", ratios[2], ratios[1], ratios[0]),
            verdict: F::reproduced_if(ratios.iter().all(|r| *r < 0.5)),
            why: "All formulas agree on it, whichever of them fits best.".into(),
        },
        Claim {
            id: 6,
            claim: "Eqs. 4 and 9 approximate low aspect ratio data best (sec. III)",
            paper: "both best, A = 0.3155 included in fig. 3",
            ours: format!(
                "at A = 0.3155 eq. 4 is {} from eq. 9; slopes of plates measured at A 1 to 3 within {:.0} % (eq. 4), {:.0} % (eq. 9), {:.0} % (eq. 5)",
                percent(over),
                100.0 * on_plates("4").0,
                100.0 * on_plates("9").0,
                100.0 * on_plates("5").0
            ),
            verdict: F::reproduced_if(over.abs() < 0.1),
            why: "Eq. 4 tends to 2.24 A, lifting surfaces to 1.57 A; the cited tests end at A = 0.5, so both cannot be best at 0.3155.".into(),
        },
        body_is_linear(),
        Claim {
            id: 8,
            claim: "Hull lift and drag are accurate to about 25 deg (sec. IV-A)",
            paper: "25 deg",
            ours: format!("valid range of every geometry model: {:.1} deg", hydro::ALPHA_BODY_VALID_RAD.to_degrees()),
            verdict: F::Calibrated,
            why: "Taken over as the range of the model and not tested: no measured hull polar was at hand. Commands mark what lies beyond.".into(),
        },
        drag_share(),
        Claim {
            id: 10,
            claim: "The vortex lift coefficient is about pi (sec. IV-B)",
            paper: "K_v = pi",
            ours: format!(
                "rms error of C_L {:.3}, {:.3}, {:.3} for delta wings of A 0.5, 1, 1.5 (without vortex lift {:.2}, {:.2}, {:.2}); up to {:.2} for rectangular plates of A 1 to 3, whose side edges have K_v {:.1}, {:.1}, {:.1} at A 1, 2, 3",
                rms[0].0, rms[1].0, rms[2].0, rms[0].1, rms[1].1, rms[2].1, on_plates("11").1,
                side_edge_kv(1.0), side_edge_kv(2.0), side_edge_kv(3.0)
            ),
            verdict: F::reproduced_if(rms.iter().all(|r| r.0 < 0.03 && r.1 > 3.0 * r.0) && on_plates("11").1 < 0.05),
            why: "Sharp delta wings follow eq. 11 with K_v = pi and a vortex-lattice K_p, nothing fitted; the paper puts it to a rectangular wing, whose unswept leading edge has no vortex: its side edges alone carry less, and less the wider the wing.".into(),
        },
    ]
}

fn body_is_linear() -> Claim {
    let body = match plain(Wings::Standard) {
        Ok(g) => g.body,
        Err(e) => return failed(7, "The hull is linear below 6 deg and non-linear above (sec. IV-A)", &e),
    };
    let (potential, crossflow) = body.normal_area_m2(6f64.to_radians());
    let normal = |deg: f64| {
        let (p, c) = body.normal_area_m2(deg.to_radians());
        p + c
    };
    let convex = (7..25).all(|d| normal(f64::from(d) + 1.0) - 2.0 * normal(f64::from(d)) + normal(f64::from(d) - 1.0) > 0.0);
    let share = crossflow / (potential + crossflow);
    Claim {
        id: 7,
        claim: "The hull is linear below 6 deg and non-linear above (sec. IV-A)",
        paper: "onset at 6 deg",
        ours: format!("cross-flow share of the normal force at 6 deg {:.0} %, growing; convex above", 100.0 * share),
        verdict: Finding::reproduced_if(share < 0.45 && convex),
        why: "The Allen-Perkins form has no onset angle; cross-flow simply passes a third of the force near there.".into(),
    }
}

fn failed(id: u32, claim: &'static str, e: &anyhow::Error) -> Claim {
    Claim { id, claim, paper: "", ours: format!("{e:#}"), verdict: Finding::Contradicted, why: "could not be computed".into() }
}

fn drag_share() -> Claim {
    const CLAIM: &str = "Hull and wings are about 80 % of the drag (sec. II)";
    let g = match plain(Wings::Standard) {
        Ok(g) => at_sea(g),
        Err(e) => return failed(9, CLAIM, &e),
    };
    let b = g.polar().breakdown(0.0);
    let share = (b.wing.cd + b.body.cd) / b.total().cd;
    Claim {
        id: 9,
        claim: CLAIM,
        paper: "80 %",
        ours: format!("{:.0} % of the drag area {:.4} m2 that a Slocum has at sea", 100.0 * share, b.total().cd),
        verdict: Finding::reproduced_if((share - 0.8).abs() < 0.1),
        why: "Smooth laminar hull and wings make 0.004 m2; at sea 0.015 m2 are measured: appendages, gaps and roughness are most of it."
            .into(),
    }
}

/// Claims 11 to 16: what the paper's model says.
fn model() -> anyhow::Result<Vec<Claim>> {
    use Finding as F;
    let (std, low) = (plain(Wings::Standard)?, plain(Wings::LowAspectRatio)?);
    let (std_c, low_c) = (paper(Wings::Standard)?, paper(Wings::LowAspectRatio)?);
    let (s, l, sc, lc) = (best(&std), best(&low), best(&std_c), best(&low_c));
    let (corr, differ) = model_agreement(|g| g)?;
    let (corr_z, differ_z) = model_agreement(no_suction)?;
    let attenuation = |g: &Geometry, b: (f64, f64)| l_over_d(g, 40.0) / b.1;
    let (fall_s, fall_l) = (attenuation(&std, s), attenuation(&low, l));
    let shares = |g: &Geometry| [wing_share(g, 1.0), wing_share(g, 25.0), wing_share(g, 40.0)];
    let (ps, pl, cs, cl) = (shares(&std), shares(&low), shares(&std_c), shares(&low_c));
    let near = |x: f64, want: f64| (x - want).abs() <= 0.02;
    Ok(vec![
        Claim {
            id: 11,
            claim: "The three low aspect ratio models are highly correlated (sec. IV-C, fig. 5)",
            paper: "highly correlated",
            ours: format!(
                "least correlation of L/D over 1-25 deg {corr:.3}, largest difference {:.0} % (without suction {corr_z:.3}, {:.0} %)",
                100.0 * differ,
                100.0 * differ_z
            ),
            verdict: F::reproduced_if(corr > 0.97 && differ < 0.25),
            why: "Only with a1 = (pi/2) A in eq. 13; the printed pi/2 would make Fidler's slope 3.2 times the others'.".into(),
        },
        Claim {
            id: 12,
            claim: "The standard glider has the larger (L/D)max in the model (fig. 5)",
            paper: "larger",
            ours: format!("{:.2} against {:.2}: ratio {:.2}", s.1, l.1, l.1 / s.1),
            verdict: F::reproduced_if((0.4..0.8).contains(&(l.1 / s.1))),
            why: "Follows from the slopes alone; holds for every plausible set of constants.".into(),
        },
        Claim {
            id: 13,
            claim: "The low aspect ratio glider reaches (L/D)max at a larger angle (sec. III)",
            paper: "about 25 % larger",
            ours: format!(
                "{:.2} against {:.2} deg: {} untuned; {} in the vehicles tuned to the paper",
                l.0,
                s.0,
                percent(l.0 / s.0 - 1.0),
                percent(lc.0 / sc.0 - 1.0)
            ),
            verdict: F::reproduced_if((1.15..=1.35).contains(&(l.0 / s.0))),
            why: "Untuned literature constants give it within a third; the exact 25 % is reached by tuning only.".into(),
        },
        Claim {
            id: 14,
            claim: "L/D falls more slowly beyond (L/D)max with low aspect ratio wings (sec. IV-C)",
            paper: "less attenuation",
            ours: format!("at 40 deg {:.0} % of (L/D)max is left against {:.0} %", 100.0 * fall_l, 100.0 * fall_s),
            verdict: F::reproduced_if(fall_l > fall_s),
            why: "Vortex lift keeps growing where the standard wing has separated.".into(),
        },
        Claim {
            id: 15,
            claim: "Share of lift from the standard wings (sec. IV-C, fig. 6)",
            paper: "89 % to 47 %",
            ours: format!("{:.3} to {:.3} (1 to 25 deg) tuned; {:.3} to {:.3} (1 to 40 deg) untuned", cs[0], cs[1], ps[0], ps[2]),
            verdict: F::calibrated_if(near(cs[0], 0.89) && near(cs[1], 0.47)),
            why: "The paper gives neither areas nor hull constants nor the range of angles; literature values come within 0.03 over 1-40 deg, exact only by tuning.".into(),
        },
        Claim {
            id: 16,
            claim: "Share of lift from the low aspect ratio wings (sec. IV-C, fig. 7)",
            paper: "63 % to 52 %",
            ours: format!("{:.3} to {:.3} (1 to 25 deg) tuned; {:.3} to {:.3} untuned", cl[0], cl[1], pl[0], pl[1]),
            verdict: F::calibrated_if(near(cl[0], 0.63) && near(cl[1], 0.52)),
            why: "Needs C_Dc 1.6 and a draggier hull cross-flow than the literature's; untuned the share hardly falls.".into(),
        },
    ])
}

/// Claims 17 to 25: the trial.
fn trial(t: &Trials) -> anyhow::Result<Vec<Claim>> {
    use Finding as F;
    let (std, low) = (plain(Wings::Standard)?, plain(Wings::LowAspectRatio)?);
    let ratio = |pair: &[super::trials::Trial; 2]| pair[1].l_over_d / pair[0].l_over_d;
    let (stock, stock_deep, good, good_deep) = (ratio(&t.stock), ratio(&t.stock_deep), ratio(&t.best), ratio(&t.best_deep));
    // 5.3 % of L/D = cot γ at the flown glide, as an angle: d ln cot γ / dγ = −2/sin 2γ.
    let glide = t.stock[0].glide_deg.iter().sum::<f64>() / t.stock[0].glide_deg.len() as f64;
    let equivalent_deg = (0.053 * (2.0 * glide.to_radians()).sin() / 2.0).to_degrees();
    let under: Vec<f64> = [5.0, 10.0, 20.0, 30.0].iter().map(|a| l_over_d(&fuller(low), *a) / l_over_d(&at_sea(low), *a)).collect();
    let sea = (crate::paper::variants::geometry("slocum-standard-sea")?, crate::paper::variants::geometry("slocum-low-ar-sea")?);
    let (bs, bl) = (best(&sea.0), best(&sea.1));
    let pair = |g: Geometry| at_sea(pair_aspect_ratio(g));
    let gain_pair = advantage(&pair(low), &pair(std));
    let gain_full = advantage(&fuller(low), &fuller(std));
    let said = |g: &Option<(f64, f64, f64, f64)>| {
        g.map_or("never better".to_string(), |(a, b, gain, at)| {
            format!("better {a:.0}-{b:.0} deg, at most {} at {at:.0} deg", percent(gain))
        })
    };
    let within = |trial: &super::trials::Trial, low: f64, high: f64| {
        [&trial.alpha_deg, &trial.pitch_deg, &trial.glide_deg].map(|v| 100.0 * share_within(v, low, high))
    };
    let (h_std, h_low) = (within(&t.stock[0], 20.0, 50.0), within(&t.stock[1], 20.0, 50.0));
    let (high_std, high_low) = (within(&t.stock[0], 50.0, 70.0), within(&t.stock[1], 50.0, 70.0));
    let span_m = 2.0 * (low.wing.panel_span_m + low.carry_over.body_radius_m);
    let share_of_max = |trial: &super::trials::Trial, b: (f64, f64)| trial.l_over_d / b.1;
    let carry_alone = l_over_d(&carry_over(at_sea(low)), 5.0) / l_over_d(&at_sea(low), 5.0);
    Ok(vec![
        Claim {
            id: 17,
            claim: "Overall L/D of the low aspect ratio glider in the lake (secs. V, VI)",
            paper: "+5.3 %",
            ours: format!("{} at the same 26 deg pitch in 3-27 m", percent(stock - 1.0)),
            verdict: F::reproduced_if((stock - 1.053).abs() < 0.03),
            why: format!(
                "Not with one steady model at equal pitch; 5.3 % is {equivalent_deg:.2} deg of glide angle or about 1.6 cm/s of current along the track, inside ordinary pitch and current error, and the paper has no error bars."
            ),
        },
        Claim {
            id: 18,
            claim: "The measured low aspect ratio glider beats its model at every angle (sec. V, fig. 9)",
            paper: "significantly, all angles",
            ours: format!(
                "carry-over and suction-free drag raise L/D by {} at 5, 10, 20, 30 deg (carry-over alone {} at 5)",
                under.iter().map(|r| percent(r - 1.0)).collect::<Vec<_>>().join(", "),
                percent(carry_alone - 1.0)
            ),
            verdict: F::reproduced_if(under.iter().all(|r| *r > 1.0)),
            why: "Sign and size follow from two things the paper's model lacks: lift carried over onto the hull, and eq. 14 charging more drag than zero suction allows; rail wings by the law of measured plates.".into(),
        },
        Claim {
            id: 19,
            claim: "Measured (L/D)max of the low aspect ratio glider is lower and later (sec. V, fig. 10)",
            paper: "lower, at a 15 % larger angle",
            ours: format!("{:.2} against {:.2}, at a {} larger angle (sea vehicles)", bl.1, bs.1, percent(bl.0 / bs.0 - 1.0)),
            verdict: F::calibrated_if(bl.1 < bs.1 && (1.05..=1.25).contains(&(bl.0 / bs.0))),
            why: "Drag and hull lift of these vehicles were fitted to a real glide (not to this claim); near-equal maxima are not obtained with any constants tried.".into(),
        },
        Claim {
            id: 20,
            claim: "The low aspect ratio glider is better between 15 and 34 deg (sec. V, fig. 10)",
            paper: "15-34 deg, at most +4 % at 24 deg, worse above",
            ours: format!("pair aspect ratio, eq. 14, drag at sea: {}; carry-over and no suction: {}", said(&gain_pair), said(&gain_full)),
            verdict: F::calibrated_if(
                gain_pair.is_some_and(|(_, to, gain, at)| to < 40.0 && (0.01..0.07).contains(&gain) && (at - 24.0).abs() <= 5.0),
            ),
            why: "A low aspect ratio advantage near 20-30 deg follows, because every normal-force body nears L/D = cot(alpha), and with eq. 14 it ends near 32 deg; but untuned it is about twice as large, and without eq. 14's excess drag it has no upper end.".into(),
        },
        Claim {
            id: 21,
            claim: "Most common angle of attack in the trial (fig. 11)",
            paper: "20-50 deg",
            ours: format!(
                "within 20-50 deg: true angle of attack {:.0} %, pitch {:.0} %, path {:.0} % of the time (standard; rails {:.0}, {:.0}, {:.0} %)",
                h_std[0], h_std[1], h_std[2], h_low[0], h_low[1], h_low[2]
            ),
            verdict: F::reproduced_if(h_std[0] > 50.0 && h_low[0] > 50.0),
            why: "No steady glide has such an angle of attack; pitch and path do lie there. The paper's alpha most likely is one of them. A DVL-equipped Slocum at 22 deg pitch had a median of 3.4 deg.".into(),
        },
        Claim {
            id: 22,
            claim: "50-70 deg is more frequent with low aspect ratio wings (fig. 11)",
            paper: "more frequent",
            ours: format!(
                "within 50-70 deg: path {:.1} % against {:.1} %, pitch {:.1} % against {:.1} % (rails against standard)",
                high_low[2], high_std[2], high_low[1], high_std[1]
            ),
            verdict: F::reproduced_if(high_low.iter().zip(&high_std).any(|(l, s)| *l > 5.0 && *l > 1.5 * *s)),
            why: "With equal trim and control nothing in wing physics does it; it asks for a difference in trim or control.".into(),
        },
        Claim {
            id: 23,
            claim: "Similar in shallow water, more apart in deep water where control settles (sec. VI)",
            paper: "separation grows with depth",
            ours: format!(
                "L/D ratio rails/standard 3-27 m to 5-195 m: {good:.3} to {good_deep:.3} flown at (L/D)max, {:.3} to {:.3} at 18 deg pitch, {stock:.3} to {stock_deep:.3} at 26 deg",
                ratio(&t.shallow_pitch),
                ratio(&t.shallow_pitch_deep)
            ),
            verdict: F::reproduced_if(good_deep < good - 0.005),
            why: format!(
                "The paper's case is control that settles near (L/D)max; there the separation {}. At a steep fixed pitch both fly at small angles and depth {}.",
                if good_deep < good - 0.005 { "grows" } else { "does not grow" },
                if stock_deep < stock - 0.005 { "separates them too" } else { "does not separate them" }
            ),
        },
        Claim {
            id: 24,
            claim: "Both gliders fly at angles far above that of (L/D)max (secs. V, VI)",
            paper: "20-50 deg, above the best angle",
            ours: format!(
                "mean angle of attack {:.1} and {:.1} deg against {:.1} and {:.1} deg for (L/D)max; {:.0} % and {:.0} % of (L/D)max reached",
                t.stock[0].mean_alpha_deg,
                t.stock[1].mean_alpha_deg,
                bs.0,
                bl.0,
                100.0 * share_of_max(&t.stock[0], bs),
                100.0 * share_of_max(&t.stock[1], bl)
            ),
            verdict: F::reproduced_if(t.stock[0].mean_alpha_deg > bs.0 && t.stock[1].mean_alpha_deg > bl.0),
            why: "They do fly far from (L/D)max, but on the other side: pitch is too steep and the angle of attack too small.".into(),
        },
        Claim {
            id: 25,
            claim: "The low aspect ratio span fits a 21 inch tube (sec. I)",
            paper: "fits",
            ours: format!("span {span_m:.3} m + 2 x {:.0} mm of case and clearance in {:.3} m", 1000.0 * TUBE_M.1, TUBE_M.0),
            verdict: F::reproduced_if(span_m + 2.0 * TUBE_M.1 <= TUBE_M.0),
            why: "Panel aspect ratio 0.3155 with the area the lift shares ask for gives this span without being told of the tube.".into(),
        },
    ])
}

/// L/D of one lift model of the rail wings at an angle, for the figures.
#[must_use]
pub fn with_model(g: &Geometry, model: WingModel, alpha_deg: f64) -> f64 {
    let mut g = *g;
    g.wing.model = model;
    g.polar().force(&Flow::steady(alpha_deg.to_radians(), 0.3)).l_over_d()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::trials;

    #[test]
    fn validate_five_model_claims_hold_at_once_in_the_paper_vehicles() {
        let (s, l) = (paper(Wings::Standard).unwrap(), paper(Wings::LowAspectRatio).unwrap());
        // Shares of lift within 0.02 (the paper prints two digits), angle ratio within 0.03.
        assert!((wing_share(&s, 1.0) - 0.89).abs() <= 0.02);
        assert!((wing_share(&s, 25.0) - 0.47).abs() <= 0.02);
        assert!((wing_share(&l, 1.0) - 0.63).abs() <= 0.02);
        assert!((wing_share(&l, 25.0) - 0.52).abs() <= 0.02);
        let lowest = curve(&l, 1.0, 25.0, 0.25).iter().map(|p| wing_share(&l, p.0)).fold(1.0, f64::min);
        assert!((lowest - 0.52).abs() <= 0.02, "{lowest}");
        assert!((best(&l).0 / best(&s).0 - 1.25).abs() <= 0.03);
    }

    #[test]
    fn validate_literature_constants_give_the_reference_reading_of_the_paper() {
        // Independently calculated: (L/D)max 6.91 at 7.62 deg and 3.57 at 8.84 deg; 3 % for constants read differently.
        let (s, l) = (best(&plain(Wings::Standard).unwrap()), best(&plain(Wings::LowAspectRatio).unwrap()));
        for (got, want) in [(s.0, 7.62), (s.1, 6.91), (l.0, 8.84), (l.1, 3.57)] {
            assert!((got / want - 1.0).abs() < 0.03, "{got} against {want}");
        }
    }

    #[test]
    fn scorecard_paper_lists_25_claims_and_calls_nothing_tuned_reproduced() {
        let claims = all(&Evidence { trials: trials::all().unwrap() }).unwrap();
        assert_eq!(claims.iter().map(|c| c.id).collect::<Vec<_>>(), (1..=25).collect::<Vec<_>>());
        assert!(claims.iter().all(|c| !c.claim.is_empty() && !c.paper.is_empty() && !c.ours.is_empty() && c.why.len() > 20));
        assert!(claims.iter().all(|c| !c.ours.contains("NaN")));
        let verdict = |id: u32| claims.iter().find(|c| c.id == id).map(|c| c.verdict).unwrap();
        for tuned in [8, 15, 16, 19] {
            assert_ne!(verdict(tuned), Finding::Reproduced, "claim {tuned}");
        }
        for robust in [1, 2, 3, 4, 5, 7, 11, 12, 13, 14, 18, 25] {
            assert_eq!(verdict(robust), Finding::Reproduced, "claim {robust}");
        }
        // K_v = pi is a delta wing's; the paper's wings are rectangular.
        assert_eq!(verdict(10), Finding::Contradicted);
        // The angle the paper calls alpha is not one.
        assert_eq!(verdict(21), Finding::Contradicted);
        assert_eq!(verdict(17), Finding::Contradicted);
    }

    #[test]
    fn every_figure_draws() {
        let trials = trials::all().unwrap();
        let figures = crate::paper::figures::all(&trials).unwrap();
        for n in 3..=11 {
            assert!(figures.iter().any(|f| f.0.starts_with(&format!("fig{n:02}"))), "figure {n}");
        }
        for (stem, chart) in &figures {
            assert!(chart.svg().unwrap().len() > 3000, "{stem}");
            assert!(chart.series.iter().all(|s| s.points.iter().any(|p| p.1.is_finite())), "{stem}");
        }
    }
}

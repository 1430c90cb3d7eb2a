//! Claims 11 to 16: what the paper's model says.

use hydro::Geometry;
use hydro::wing::WingModel;
use signals::Wings;

use super::super::variants::{best, curve, l_over_d, no_suction, paper, plain, wing_share};
use super::{Claim, Finding as F, percent};

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
    let file = rig::flight::vehicles::built_in("slocum-low-ar")?;
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

/// Claims 11 to 16, in order.
pub(super) fn claims() -> anyhow::Result<Vec<Claim>> {
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

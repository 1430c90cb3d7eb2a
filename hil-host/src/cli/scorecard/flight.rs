//! `glider scorecard flight`: our controller beside the ordinary one.

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use signals::Wings;

use super::super::{Output, Verdict};
use crate::score::control_law::{BIN_DEG, Band, Disturbance, Pilot, Score, cases, fly_all};
use crate::terminal::{say, table};

/// Arguments of `scorecard flight`.
#[derive(clap::Args, Debug)]
#[command(
    after_help = "Examples:\n  glider scorecard flight\n  glider scorecard flight --band shallow --effects --json\n\nShare: achieved L/D through the water over (L/D)max of the true vehicle. Exit code 1 when ours loses to stock, aborts,\nor leaves the depth band by more than 1 m anywhere (the hidden effects included)."
)]
pub struct FlightArgs {
    /// Only one depth band.
    #[arg(long, value_enum)]
    band: Option<BandArg>,
    /// Every hidden effect of the plant too.
    #[arg(long)]
    effects: bool,
    /// Seed of the worlds.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum BandArg {
    /// 3–27 m.
    Shallow,
    /// 0–200 m.
    Sea,
    /// 0–1000 m.
    Deep,
}

/// Runs the command.
///
/// # Errors
/// A case the plant refuses.
pub fn run(args: &FlightArgs, output: &Output) -> anyhow::Result<Verdict> {
    let bands = match args.band {
        Some(BandArg::Shallow) => vec![Band::Shallow],
        Some(BandArg::Sea) => vec![Band::Sea],
        Some(BandArg::Deep) => vec![Band::Deep],
        None => vec![Band::Shallow, Band::Sea, Band::Deep],
    };
    let mut disturbances = Disturbance::FIXED.to_vec();
    if args.effects {
        disturbances.extend(Disturbance::hidden());
    }
    let all = cases(&[Wings::Standard, Wings::LowAspectRatio], &bands, &disturbances, args.seed);
    let bar = ProgressBar::new(all.len() as u64);
    bar.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} flights {eta}")?);
    let scores = fly_all(&all, || bar.inc(1))?;
    bar.finish_and_clear();

    // `cases` puts stock right behind ours.
    let pairs: Vec<(&Score, &Score)> = scores.iter().zip(scores.iter().skip(1)).step_by(2).collect();
    let lost = pairs.iter().filter(|(o, s)| o.share_of_max < s.share_of_max).count();
    let aborted = pairs.iter().filter(|(o, _)| !o.done).count();
    let worst = pairs.iter().map(|(o, _)| o.overshoot_m).fold(0.0, f64::max);
    let good = lost == 0 && aborted == 0 && worst <= 1.0;
    let document = json!({
        "seed": args.seed,
        "summary": {"pairs": pairs.len(), "lost_to_stock": lost, "not_flown": aborted, "worst_overshoot_m": worst},
        "alpha_bin_deg": BIN_DEG,
        "flights": scores,
    });
    output.emit(&document, || {
        println!("{}", scores_table(&pairs));
        say(&format!("(stock in brackets; over: beyond the band)  lost to stock: {lost}  not flown: {aborted}  farthest beyond the band: {worst:.2} m"));
    });
    Ok(if good { Verdict::Ok } else { Verdict::Negative })
}

fn scores_table(pairs: &[(&Score, &Score)]) -> comfy_table::Table {
    let mut t = table(["band", "disturbance", "wings", "L/D", "share", "J/m", "over, m", "turn, s"]);
    for (ours, stock) in pairs {
        debug_assert_eq!((ours.case.pilot, stock.case.pilot), (Pilot::Ours, Pilot::Stock));
        let two = |a: f64, b: f64, digits: usize| format!("{a:.digits$}\n({b:.digits$})");
        t.add_row([
            format!("{:?}", ours.case.band).to_lowercase(),
            ours.case.disturbance.name().replace('_', " "),
            rig::flight::mission_file::wings_name(ours.case.wings).to_owned(),
            two(ours.achieved_l_over_d, stock.achieved_l_over_d, 2),
            two(ours.share_of_max, stock.share_of_max, 2),
            two(ours.transport_j_m, stock.transport_j_m, 1),
            two(ours.overshoot_m.max(0.0), stock.overshoot_m.max(0.0), 2),
            two(ours.inflection_s, stock.inflection_s, 0),
        ]);
    }
    t
}

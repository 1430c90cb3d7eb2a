//! Two tables in the same worlds: the one that is asked for, and those that the tolerances of its vehicle file leave open.

use super::{round, table_of};
use crate::score::story::{drawn_world, fly_table};
use crate::terminal::{say, wrapped_from};
use anyhow::Context as _;
use logs::Vehicle;
use plant::Scenario;
use rayon::prelude::*;
use rig::flight::closed_loop::{Outcome, Setup};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Worlds that are drawn: with the one that is asked for 21, of which all but the least and the largest gain are 90 %.
const WORLDS: u64 = 20;

/// The old table, and what the new one gains in worlds that are drawn, the least first.
pub(super) struct Both {
    path: PathBuf,
    before: Outcome,
    gains: Vec<f64>,
    within: Option<PathBuf>,
}

/// Flies the old table in a world, and both in worlds that are drawn: within the tolerances of a vehicle, where there is one, each with
/// its own noise.
///
/// # Errors
/// A table that is none or that the controller refuses.
pub(super) fn fly(path: &Path, setup: &Setup, scenario: &Scenario, vehicle: Option<&Vehicle>) -> anyhow::Result<Both> {
    let old = table_of(path, setup.mission.wings)?;
    let new = setup.table.clone().context("--beside asks for --table")?;
    let before = fly_table(&old, setup, scenario).with_context(|| format!("with the table of {}", path.display()))?;
    let gain = |k: u64| {
        let world = drawn_world(scenario, vehicle, scenario.seed.wrapping_add(k));
        let [old, new] = [&old, &new].map(|table| fly_table(table, setup, &world).map(|out| out.achieved_l_over_d()));
        // Such a vehicle may be none that flies.
        old.ok().zip(new.ok()).map(|(old, new)| new / old - 1.0).filter(|gain| gain.is_finite())
    };
    let mut gains: Vec<f64> = (1..=WORLDS).into_par_iter().filter_map(gain).collect();
    gains.sort_by(f64::total_cmp);
    Ok(Both { path: path.to_path_buf(), before, gains, within: vehicle.map(|v| v.path.clone()) })
}

impl Both {
    /// Adds to the document of the new table's flight, which had this L/D.
    pub(super) fn add_to(&self, document: &mut Value, l_over_d: f64) {
        let old = self.before.achieved_l_over_d();
        let gain = l_over_d / old - 1.0;
        document["beside"] = json!({
            "table": self.path, "table_id": format!("{:08x}", self.before.table_id), "achieved_l_over_d": round(old, 4),
            "distance_m": round(self.before.distance_m, 2), "end": self.before.end.to_string(),
            "worlds": self.gains.len(), "within": self.within,
        });
        document["range_gain"] = json!(round(gain, 4));
        let least_and_largest = self.gains.get(1).zip(self.gains.get(self.gains.len().wrapping_sub(2)));
        let all_flew = self.gains.len() as u64 == WORLDS;
        let interval = least_and_largest.filter(|_| all_flew).map(|(low, high)| [low.min(gain), high.max(gain)].map(|g| round(g, 4)));
        document["range_gain_90"] = json!(interval);
    }
}

/// Prints what the new table gains.
pub(super) fn print(d: &Value) {
    let Some((old, gain)) = d["beside"]["achieved_l_over_d"].as_f64().zip(d["range_gain"].as_f64()) else { return };
    let worlds = &d["beside"]["worlds"];
    let of = d["beside"]["within"].as_str().map_or_else(
        || format!("{worlds} seeds of noise in this world"),
        |file| format!("{worlds} worlds within the tolerances of {file}"),
    );
    let interval = match (d["range_gain_90"][0].as_f64(), d["range_gain_90"][1].as_f64()) {
        (Some(low), Some(high)) => format!("90 %: {:+.1} to {:+.1}, over {of}", 100.0 * low, 100.0 * high),
        _ => format!("no interval: only {of} let both tables fly"),
    };
    let text = format!("{old:.3} with the other table: {:+.1} % range on this mission ({interval})", 100.0 * gain);
    say(&format!("beside         {}", wrapped_from(15, &text, 15)));
}

//! What a table of dives says of the fleet: every number pooled over dives, deployments and vehicles, and which of them are named.

use discovery::diagnosis::report::number;
use discovery::model::parameters::NINETY;
use discovery::workbench::dive_estimates::{Asked, asked};
use discovery::workbench::meta_analysis::{LEVEL_NAMES, Observation, Pooled, benjamini_hochberg, pool};
use serde_json::{Map, Value, json};

use crate::fleet::part::Part;

/// One number of the fleet.
#[derive(Clone, Debug)]
pub struct FleetNumber {
    /// Which.
    pub asked: Asked,
    /// What all dives say.
    pub pooled: Pooled,
    /// Least share of false names at which it is among the names (q-value of Benjamini and Hochberg).
    pub q: f64,
}

impl FleetNumber {
    /// 90 % interval.
    #[must_use]
    pub fn interval(&self) -> (f64, f64) {
        (self.pooled.value - NINETY * self.pooled.sigma, self.pooled.value + NINETY * self.pooled.sigma)
    }

    /// As a document.
    #[must_use]
    pub fn document(&self, share: f64) -> Value {
        let (low, high) = self.interval();
        let p = &self.pooled;
        let scatter: Map<String, Value> = LEVEL_NAMES.iter().zip(p.scatter).map(|(name, s)| ((*name).to_owned(), number(s))).collect();
        json!({
            "name": self.asked.name, "unit": self.asked.unit, "value": number(p.value), "low": number(low), "high": number(high),
            "sigma": number(p.sigma), "p": number(p.p), "q": number(self.q), "named": self.q < share,
            "best_dive_p": number(p.best_dive_p), "scatter_1sigma": scatter,
            "dives": p.counts[0], "deployments": p.counts[1], "vehicles": p.counts[2],
        })
    }
}

/// Pools every number that a dive says something of; the likeliest to be real first.
#[must_use]
pub fn pooled(part: &Part) -> Vec<FleetNumber> {
    let (mut vehicle, mut deployment) = (0, 0);
    let mut places = Vec::with_capacity(part.rows.len());
    for (k, row) in part.rows.iter().enumerate() {
        if let Some(before) = k.checked_sub(1).map(|b| &part.rows[b]) {
            let same = before.vehicle == row.vehicle;
            vehicle += usize::from(!same);
            deployment += usize::from(!same || before.deployment != row.deployment);
        }
        places.push((vehicle, deployment));
    }
    let of = |asked: &Asked| -> Option<Pooled> {
        let columns = ["", "_noise", "_calibration"].map(|c| part.place_of(&format!("{}{c}", asked.name)));
        let [Some(value), Some(noise), Some(calibration)] = columns else { return None };
        let observations: Vec<Observation> = part
            .rows
            .iter()
            .zip(&places)
            .map(|(row, (vehicle, deployment))| {
                let n = |k: usize| row.dive.numbers.get(k).copied().unwrap_or(f64::NAN);
                Observation { vehicle: *vehicle, deployment: *deployment, value: n(value), noise: n(noise), calibration: n(calibration) }
            })
            .collect();
        pool(&observations)
    };
    let found: Vec<(Asked, Pooled)> = asked().into_iter().filter_map(|a| Some((a.clone(), of(&a)?))).collect();
    let q = benjamini_hochberg(&found.iter().map(|f| f.1.p).collect::<Vec<_>>());
    let mut out: Vec<FleetNumber> = found.into_iter().zip(q).map(|((asked, pooled), q)| FleetNumber { asked, pooled, q }).collect();
    out.sort_by(|a, b| a.pooled.p.total_cmp(&b.pooled.p));
    out
}

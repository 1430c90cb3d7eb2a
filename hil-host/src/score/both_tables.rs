//! Two tables in the same worlds: the one that is asked for, and those that the tolerances of its vehicle file leave open.

use super::story::{drawn_world, fly_table};
use logs::Vehicle;
use plant::Scenario;
use rayon::prelude::*;
use rig::flight::closed_loop::{Orders, Setup};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

/// Worlds that are drawn: with the one that is asked for 21, of which all but the least and the largest gain are 90 %.
pub const WORLDS: u64 = 20;

/// What the new table gains in worlds that are drawn, the least first.
#[derive(Debug)]
pub struct Drawn {
    gains: Vec<f64>,
    within: Option<PathBuf>,
}

/// Flies the old table and the new one in worlds that are drawn: within the tolerances of a vehicle, where there is one, each with its own
/// noise; nobody waits for a clock or gives orders there. `flown` gets the number of worlds that are done.
#[must_use]
pub fn in_drawn_worlds(
    tables: [&[u8]; 2],
    setup: &Setup,
    scenario: &Scenario,
    vehicle: Option<&Vehicle>,
    flown: &(dyn Fn(u64) + Sync),
) -> Drawn {
    let setup = Setup { realtime: None, orders: Orders::default(), ..setup.clone() };
    let done = AtomicU64::new(0);
    let gain = |k: u64| {
        let world = drawn_world(scenario, vehicle, scenario.seed.wrapping_add(k));
        let [old, new] = tables.map(|table| fly_table(table, &setup, &world).map(|out| out.achieved_l_over_d()));
        flown(1 + done.fetch_add(1, Ordering::Relaxed));
        // Such a vehicle may be none that flies.
        old.ok().zip(new.ok()).map(|(old, new)| new / old - 1.0).filter(|gain| gain.is_finite())
    };
    let mut gains: Vec<f64> = (1..=WORLDS).into_par_iter().filter_map(gain).collect();
    gains.sort_by(f64::total_cmp);
    Drawn { gains, within: vehicle.map(|v| v.path.clone()) }
}

/// Adds to the document of the new table's flight what it gains over the old one's, `other_flight`, with its interval where worlds were drawn.
pub fn add_to(document: &mut Value, other_flight: Value, [old, new]: [f64; 2], drawn: Option<&Drawn>) {
    let round = |x: f64| (x * 1e4).round() / 1e4;
    let gain = new / old - 1.0;
    document["beside"] = other_flight;
    document["range_gain"] = json!(round(gain));
    document["range_gain_90"] = Value::Null;
    if let Some(Drawn { gains, within }) = drawn {
        document["beside"]["worlds"] = json!(gains.len());
        document["beside"]["within"] = json!(within);
        let least_and_largest = gains.get(1).zip(gains.get(gains.len().wrapping_sub(2)));
        let all_flew = gains.len() as u64 == WORLDS;
        let interval = least_and_largest.filter(|_| all_flew).map(|(low, high)| [low.min(gain), high.max(gain)].map(round));
        document["range_gain_90"] = json!(interval);
    }
    document["range_gain_in_words"] = json!(in_words(document));
}

/// What the new table gains, in words.
fn in_words(d: &Value) -> String {
    let of = || {
        let worlds = &d["beside"]["worlds"];
        d["beside"]["within"].as_str().map_or_else(
            || format!("{worlds} seeds of noise in this world"),
            |file| format!("{worlds} worlds within the tolerances of {file}"),
        )
    };
    let interval = match (d["range_gain_90"][0].as_f64(), d["range_gain_90"][1].as_f64()) {
        (Some(low), Some(high)) => format!("90 %: {:+.1} to {:+.1}, over {}", 100.0 * low, 100.0 * high, of()),
        _ if d["beside"]["worlds"].is_null() => "no interval: this flight was given orders".into(),
        _ => format!("no interval: only {} let both tables fly", of()),
    };
    format!("{:+.1} % range on this mission ({interval})", 100.0 * d["range_gain"].as_f64().unwrap_or(f64::NAN))
}

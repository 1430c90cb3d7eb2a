//! Damaged mission, configuration, truth and vehicle files: read, or refused; never a panic. Seeded; GLIDER_MUTATIONS says how many
//! (default 3 000 of each).

use std::path::Path;

use rig::flight::{config_file, mission_file, worlds};

#[path = "../../logs/src/tests/mutations.rs"]
mod mutations;
use mutations::{Random, mutate};

#[test]
fn prop_damaged_orders_are_read_or_refused() {
    let count: usize = std::env::var("GLIDER_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(3000);
    let missions = ["shallow", "sea", "deep", "sweep"].map(|n| mission_file::built_in(n).expect("a mission"));
    let vehicles = ["comet", "slocum-standard-sea", "paper-low-ar"].map(|n| {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../vehicles/{n}.toml"));
        std::fs::read_to_string(path).expect("a vehicle")
    });
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let (mut read, mut refused) = ([0_usize; 4], [0_usize; 4]);
    for n in 0..count {
        let mission = &missions[n % missions.len()];
        let texts = [
            mission_file::write(mission),
            config_file::write(&worlds::config(mission)).expect("written"),
            worlds::for_mission(mission).to_toml().expect("written"),
            vehicles[n % vehicles.len()].clone(),
        ];
        for (kind, text) in texts.into_iter().enumerate() {
            let mut bytes = text.into_bytes();
            mutate(&mut bytes, &mut random);
            let text = String::from_utf8_lossy(&bytes);
            let said = match kind {
                0 => mission_file::parse(&text, "m.toml", worlds::limits).err().map(|e| e.to_string()),
                1 => config_file::parse(&text, "c.toml").err().map(|e| e.to_string()),
                2 => plant::Scenario::from_toml(&text).err(),
                _ => logs::vehicle::parse_text(&text, Path::new("v.toml")).err().map(|e| e.to_string()),
            };
            match said {
                None => read[kind] += 1,
                Some(why) => {
                    assert!(!why.trim().is_empty(), "input {n}: no word why {text}");
                    refused[kind] += 1;
                }
            }
        }
    }
    eprintln!("missions, configurations, truths, vehicles: {read:?} read, {refused:?} refused");
    assert!(read.iter().chain(&refused).all(|k| *k > 0), "{read:?} {refused:?}");
}

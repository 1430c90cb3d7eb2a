//! The sealed cases: reproducible, quick, like the format's examples, clean where they say clean.

use crate::trials::catalogue::Strength;
use crate::trials::nature::Nature;
use crate::trials::outside::Outside;
use crate::trials::reference::{Log, block_error, floor, recalibrated};
use crate::trials::sensors::Row;
use crate::trials::vehicle::{Nominal, Scatter};
use crate::trials::{Case, Kind, SEGMENTS, Site, Spec, Wing, files, generate, plan};

fn errors(case: &Case) -> (f64, f64, f64) {
    let log = Log::new(&case.rows, case.vehicle.gravity);
    let check = |s: usize| case.vehicle.check.contains(&s);
    let build = |s: &Scatter| Nature::new(&case.vehicle, s);
    let nominal = log.blocks(&build(&Scatter::none()), case.vehicle.gravity, check);
    let fitted = recalibrated(&log, &case.vehicle, build);
    let after = log.blocks(&build(&fitted), case.vehicle.gravity, check);
    (block_error(&nominal), block_error(&after), floor(&nominal))
}

/// Equal as numbers: `5e-5` and `0.00005` are one value, however a JSON library keeps them.
fn same(a: &serde_json::Value, b: &serde_json::Value) -> bool {
    match (a.as_object(), b.as_object()) {
        (Some(a), Some(b)) => a.len() == b.len() && a.iter().all(|(k, v)| b.get(k).is_some_and(|w| same(v, w))),
        _ => a == b || a.as_f64().is_some_and(|x| b.as_f64() == Some(x)),
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    let spec = Spec::clean(Site::Lake, Wing::Standard);
    let text = |seed, i| files::csv(&generate(&spec, seed, i).rows, false);
    assert_eq!(text(7, 3), text(7, 3));
    assert_ne!(text(7, 3), text(7, 4));
    assert_ne!(text(7, 3), text(8, 3));
}

/// A published example trial: folder `example_trials` under the folder that GLIDER_FLIGHTS names.
fn example(name: &str) -> Option<(Nominal, Vec<Row>)> {
    let Some(folder) = std::env::var_os("GLIDER_FLIGHTS") else {
        println!("skipped: no flights (GLIDER_FLIGHTS is not set)");
        return None;
    };
    let folder = std::path::Path::new(&folder).join("example_trials").join(name);
    let text = std::fs::read_to_string(folder.join("flight.csv")).expect("flight.csv");
    let v: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("vehicle.json")).expect("vehicle.json")).expect("JSON");
    let site = if v["site"] == "lake" { Site::Lake } else { Site::Sea };
    let wing = if v["wing"]["name"] == "standard" { Wing::Standard } else { Wing::LowAspectRatio };
    let mut nominal = generate(&Spec::clean(site, wing), 1, 0).vehicle;
    let f = |x: &serde_json::Value| x.as_f64().expect("number");
    nominal.mass_kg = f(&v["mass_kg"]);
    nominal.hull_volume_m3 = f(&v["hull_volume_m3"]);
    let document = nominal.document("example");
    for key in [
        "gravity_m_s2",
        "hull_compressibility_per_pa",
        "hull_thermal_expansion_per_k",
        "reference_temperature_degc",
        "wing",
        "hydro",
        "tolerance_1sigma",
        "pitch",
    ] {
        assert!(same(&document[key], &v[key]), "{name} {key}: {} is not {}", document[key], v[key]);
    }
    nominal.check = [2, 6];
    let header: Vec<&str> = text.lines().next().expect("header").split(',').collect();
    let column = |n: &str| header.iter().position(|h| *h == n);
    let rows = text
        .lines()
        .skip(1)
        .map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            let get = |n: &str| column(n).and_then(|i| fields[i].parse().ok()).unwrap_or(f64::NAN);
            Row {
                time_s: get("time_s"),
                segment: get("segment") as usize,
                pressure_dbar: get("pressure_dbar"),
                pitch_rad: get("m_pitch_rad"),
                roll_rad: get("m_roll_rad"),
                heading_rad: get("m_heading_rad"),
                ballast_cc: get("m_ballast_pumped_cc"),
                battery_m: get("m_battpos_m"),
                temperature_degc: get("sci_water_temp_degC"),
                density_kg_m3: get("sci_density_kg_m3"),
                gps_m: [get("gps_east_m"), get("gps_north_m")],
                speed_m_s: get("speed_water_m_s"),
                known_depth_m: f64::NAN,
                stirred_depth_m: f64::NAN,
            }
        })
        .collect();
    Some((nominal, rows))
}

/// The format publishes the nominal error of its example trials (0.0022 m/s over 37 blocks, 0.0047 m/s over 288) and asks for 5 %;
/// half a unit of the last printed digit is added.
#[test]
fn validate_the_error_metric_on_the_published_examples() {
    for (name, error, count) in [("example_lake", 0.0022, 37), ("example_sea", 0.0047, 288)] {
        let Some((nominal, rows)) = example(name) else { return };
        let log = Log::new(&rows, nominal.gravity);
        let blocks = log.blocks(&Nature::new(&nominal, &Scatter::none()), nominal.gravity, |s| nominal.check.contains(&s));
        let got = block_error(&blocks);
        println!("{name}: {got:.5} m/s over {} blocks", blocks.len());
        assert_eq!(blocks.len(), count, "{name}");
        assert!((got - error).abs() <= 0.05 * error + 0.00005, "{name}: {got} m/s, published {error}");
    }
}

/// The format's own model with the vehicle's true scatter explains a clean flight down to background and sensor noise: no bug of the
/// generator looks like an effect. 6 % is left to pitch noise and interpolation between samples (largest seen 4 %). Refitted instead of
/// told, the model loses what ten numbers from six segments cost (mean seen 1.09, worst 1.39 in the lake's 40 to 60 check blocks).
#[test]
fn clean_cases_fall_to_their_noise_floor() {
    let mut sum = 0.0;
    let mut count = 0.0;
    for site in [Site::Lake, Site::Sea] {
        for (k, wing) in [Wing::Standard, Wing::LowAspectRatio].into_iter().enumerate() {
            for i in 0..2 {
                let case = generate(&Spec::clean(site, wing), 11, 2 * k + i);
                let log = Log::new(&case.rows, case.vehicle.gravity);
                let all = log.blocks(&Nature::new(&case.vehicle, &case.truth.scatter), case.vehicle.gravity, |_| true);
                let ratio = block_error(&all) / floor(&all);
                let (before, after, floor) = errors(&case);
                println!(
                    "{site:?} {wing:?}: true vehicle {ratio:.3} of the floor; check segments nominal {before:.5}, recalibrated {after:.5}, floor {floor:.5} m/s"
                );
                assert!(ratio < 1.06, "{site:?} {wing:?} {i}: {ratio}");
                sum += after / floor;
                count += 1.0;
            }
        }
    }
    let mean: f64 = sum / count;
    assert!(mean < 1.2, "{mean}");
}

/// Whatever is hidden, the flight stays a flight: eight segments, each from the surface to its turning depth and back, above the
/// bottom, times increasing, the example's frequency of missing values.
#[test]
fn every_planned_case_flies_and_comes_back() {
    for (i, spec) in plan(120, 5, None).iter().enumerate() {
        let case = generate(spec, 5, i);
        let what = format!("{i} {spec:?}");
        assert!(case.rows.windows(2).all(|w| w[1].time_s > w[0].time_s), "{what}: time");
        let deepest = if spec.site == Site::Lake { 25.0 } else { 198.0 };
        for k in 0..SEGMENTS {
            let p: Vec<f64> = case.rows.iter().filter(|r| r.segment == k && r.pressure_dbar.is_finite()).map(|r| r.pressure_dbar).collect();
            let mut by_depth = p.clone();
            by_depth.sort_by(f64::total_cmp);
            // The deepest few may be spikes.
            let max = by_depth[by_depth.len() - 4];
            assert!(max > deepest && max < case.vehicle.water_depth_m, "{what}: segment {k} deepest {max} dbar");
            // Pressure drift moves the surface by up to 2 dbar.
            assert!(
                p[p.len() - 1].abs() < 2.5 && p[0].abs() < 2.5,
                "{what}: segment {k} begins at {} and ends at {} dbar",
                p[0],
                p[p.len() - 1]
            );
        }
        let missing = case.rows.iter().filter(|r| r.pressure_dbar.is_nan()).count() as f64 / case.rows.len() as f64;
        assert!(missing < 0.01, "{what}: {missing}");
    }
}

/// A stall that reattaches late shows only where flow was attached on some legs and separated on others: flown on one branch it is a
/// plain stall, or less lift slope, and those are in the vocabulary.
#[test]
fn prop_a_stall_with_hysteresis_is_flown_on_both_branches() {
    for (index, (site, wing)) in [(Site::Lake, Wing::Standard), (Site::Sea, Wing::LowAspectRatio)].into_iter().enumerate() {
        let outside = Some(Outside::HystereticStall);
        let spec = Spec { site, wing, kind: Kind::Off, effects: Vec::new(), outside, strength: Some(Strength::Strong), lifelike: None };
        let case = generate(&spec, 11, index);
        let shares = case.truth.hidden[0].form["share_attached_and_separated"].as_array().expect("two shares");
        // A twentieth of a lake flight is eight minutes.
        assert!(shares.len() == 2 && shares.iter().all(|s| s.as_f64().is_some_and(|s| s > 0.05)), "{:?} {shares:?}", case.name);
    }
}

//! Small synthetic logs in the formats that gliders and their operators write (`formats/`), each with the numbers that an import
//! must give. A simulated glider in still water made them, apart from this project's models.

use std::path::{Path, PathBuf};

use logs::Flight;
use logs::import::{Imported, import, import_all};
use serde_json::Value;

/// Numbers of the samples and ours differ by rounding of their text only.
const RELATIVE: f64 = 1e-6;

fn folder(sample: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../logs/tests/formats").join(sample)
}

fn expected(sample: &str) -> Value {
    serde_json::from_slice(&std::fs::read(folder(sample).join("expected.json")).expect("numbers")).expect("JSON")
}

fn number(expected: &Value, pointer: &str) -> f64 {
    expected.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {pointer}"))
}

#[track_caller]
fn near(what: &str, ours: f64, theirs: f64) {
    assert!((ours - theirs).abs() <= RELATIVE * theirs.abs().max(1e-3), "{what}: {ours}, expected {theirs}");
}

/// Count, least, largest and mean of the finite values of a column, in the unit of `key`.
#[track_caller]
fn column(expected: &Value, key: &str, values: &[f64], factor: f64) {
    let finite: Vec<f64> = values.iter().filter(|v| v.is_finite()).map(|v| v * factor).collect();
    assert_eq!(finite.len() as u64, expected[key]["count"].as_u64().expect("a count"), "{key}: how many");
    near(&format!("{key} min"), finite.iter().copied().fold(f64::INFINITY, f64::min), number(expected, &format!("/{key}/min")));
    near(&format!("{key} max"), finite.iter().copied().fold(f64::NEG_INFINITY, f64::max), number(expected, &format!("/{key}/max")));
    near(&format!("{key} mean"), finite.iter().sum::<f64>() / finite.len() as f64, number(expected, &format!("/{key}/mean")));
}

fn segments(flight: &Flight) -> usize {
    flight.segment.iter().collect::<std::collections::BTreeSet<_>>().len()
}

/// The block error that the imported flight has against the vehicle that made it, m/s.
fn block_error(sample: &str, imported: &Imported) -> f64 {
    let mut document: Value =
        serde_json::from_slice(&std::fs::read(folder(sample).join("vehicle.json")).expect("a vehicle")).expect("JSON");
    let expected = expected(sample);
    document["segments"] = serde_json::json!({
        "fit": expected["model_comparison_with_vehicle_json"]["fit_segments"],
        "check": expected["model_comparison_with_vehicle_json"]["check_segments"]
    });
    let vehicle = logs::vehicle::parse(document, Path::new("vehicle.json")).expect("a vehicle");
    let comparison = crate::workbench::compare::compare(&imported.flight, &vehicle);
    comparison.block_error_m_s
}

#[test]
fn validate_a_folder_of_seaglider_dives_is_one_flight_with_its_vehicle() {
    let sample = "seaglider_nc";
    let (want, got) = (expected(sample), import(&folder(sample), &[]).expect("an import"));
    let f = &got.flight;
    eprintln!("{:#?}", got.report.notes);
    assert_eq!((segments(f), f.len()), (3, 735));
    near("start", got.report.start_unix_s.expect("a date"), number(&want, "/first_ctd_unix_s"));
    column(&want, "pressure_dbar", &f.pressure_pa, 1e-4);
    column(&want, "temperature_degC", &f.temperature_degc, 1.0);
    // Two salinities are flagged bad in each dive.
    assert_eq!(f.density_kg_m3.iter().filter(|v| v.is_finite()).count() as f64, number(&want, "/rows_ctd_salinity_good"));
    let vehicle = got.vehicle.as_ref().expect("a vehicle");
    for (key, of) in [
        ("mass_kg", "mass_kg"),
        ("hull_volume_m3", "hull_volume_m3"),
        ("hull_compressibility_per_pa", "hull_compressibility_per_pa"),
        ("hull_thermal_expansion_per_k", "hull_thermal_expansion_per_k"),
        ("reference_temperature_degc", "reference_temperature_degc"),
        ("hydro.hull_lift_slope_per_rad", "lift_slope_per_rad_on_reference_area"),
        ("hydro.cd0", "cd0_at_0_30_m_s"),
        ("effects.reynolds_drag.exponent", "drag_exponent_of_speed"),
        ("hydro.hull_drag_per_rad2", "drag_per_rad2"),
    ] {
        let theirs = number(&want, &format!("/vehicle/{of}"));
        let ours = vehicle.get(key).unwrap_or(f64::NAN);
        assert!((ours / theirs - 1.0).abs() < RELATIVE, "{key}: {ours}, expected {theirs}");
    }
    let speeds: Vec<f64> = f.speed_m_s.iter().flatten().copied().filter(|v| v.is_finite()).collect();
    // 63 in the files; some lie at the surface, where the rate of depth says nothing on them.
    assert!((50..=63).contains(&speeds.len()), "{}", speeds.len());
    // Under way the simulated glider makes 27 to 39 cm/s, less in its turns.
    assert!((0.25..0.35).contains(&logs::record::plausible::quantile(&speeds, 0.5)), "{speeds:?}");
    let error = block_error(sample, &got);
    assert!(error < number(&want, "/model_comparison_with_vehicle_json/pass_if_below_m_s"), "{error} m/s");
    // The vehicle that the import makes is as good as the one that made the sample.
    let made = logs::vehicle::parse_text(&vehicle.toml(), Path::new("vehicle.toml")).expect("a vehicle");
    assert!((made.constants.hull_volume_m3 - 0.052_757_878_4).abs() < 1e-9);
}

#[test]
fn validate_seaexplorer_files_sent_ashore() {
    let sample = "seaexplorer_sub";
    let (want, got) = (expected(sample), import(&folder(sample), &[]).expect("an import"));
    let f = &got.flight;
    eprintln!("{:#?} {:#?}", got.report.notes, got.report.left_out);
    assert_eq!((segments(f), f.len()), (3, 372));
    assert_eq!(got.report.segments, ["cycle 9", "cycle 10", "cycle 11"]);
    near("start", got.report.start_unix_s.expect("a date"), number(&want, "/first_payload_unix_s"));
    column(&want, "pressure_dbar", &f.pressure_pa, 1e-4);
    column(&want, "temperature_degC", &f.temperature_degc, 1.0);
    near("mean salinity", mean(&f.extra["practical_salinity"]), number(&want, "/practical_salinity/mean"));
    assert!(got.report.notes.iter().any(|n| n.starts_with("32 GPS fixes")), "{:?}", got.report.notes);
    // Nose down going down, and buoyant at the surface.
    let deepest = (0..f.len()).max_by(|a, b| f.pressure_pa[*a].total_cmp(&f.pressure_pa[*b])).expect("rows");
    assert!(f.pitch_rad[deepest - 10] < -0.1 && f.ballast_m3[0] > 3e-4);
    let error = block_error(sample, &got);
    assert!(error < number(&want, "/model_comparison_with_vehicle_json/pass_if_below_m_s"), "{error} m/s");
}

#[test]
fn validate_seaexplorer_files_of_full_rate() {
    let sample = "seaexplorer_raw";
    let (want, got) = (expected(sample), import(&folder(sample), &[]).expect("an import"));
    let f = &got.flight;
    eprintln!("{:#?} {:#?}", got.report.notes, got.report.left_out);
    assert_eq!((segments(f), f.len()), (3, 577));
    near("start", got.report.start_unix_s.expect("a date"), number(&want, "/first_ctd_unix_s"));
    column(&want, "pressure_dbar", &f.pressure_pa, 1e-4);
    column(&want, "temperature_degC", &f.temperature_degc, 1.0);
    let salinity = mean(&f.extra["practical_salinity"]);
    near("mean salinity", salinity, number(&want, "/practical_salinity_from_conductivity/mean"));
    assert!(got.report.left_out.iter().any(|n| n.contains("before the clock was set")), "{:?}", got.report.left_out);
    assert!(got.report.notes.iter().any(|n| n.starts_with("25 GPS fixes")), "{:?}", got.report.notes);
    let error = block_error(sample, &got);
    assert!(error < number(&want, "/model_comparison_with_vehicle_json/pass_if_below_m_s"), "{error} m/s");
}

fn mean(values: &[f64]) -> f64 {
    let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    finite.iter().sum::<f64>() / finite.len() as f64
}

#[test]
fn validate_slocum_text_sent_ashore() {
    let sample = "slocum_sbd_ascii";
    let (want, got) = (expected(sample), import(&folder(sample), &[]).expect("an import"));
    let f = &got.flight;
    eprintln!("{:#?} {:#?}", got.report.notes, got.report.left_out);
    assert_eq!((segments(f), f.len()), (3, 300));
    near("start", got.report.start_unix_s.expect("a date"), number(&want, "/first_ctd_unix_s"));
    column(&want, "ctd_pressure_dbar", &f.pressure_pa, 1e-4);
    column(&want, "temperature_degC", &f.temperature_degc, 1.0);
    near("mean salinity", mean(&f.extra["practical_salinity"]), number(&want, "/practical_salinity/mean"));
    assert!(got.report.notes.iter().any(|n| n.contains("of 22 GPS fixes")), "{:?}", got.report.notes);
    assert!(f.battery_mass_m.iter().any(|b| b.abs() > 1e-3) && f.battery_mass_m.iter().all(|b| !(b.abs() > 0.1)), "inches");
    let error = block_error(sample, &got);
    assert!(error < number(&want, "/model_comparison_with_vehicle_json/pass_if_below_m_s"), "{error} m/s");
}

#[test]
fn validate_merged_slocum_text_of_a_deep_glider() {
    let sample = "slocum_merged_ascii_rbr";
    let (want, got) = (expected(sample), import(&folder(sample).join("unit_778-2026-121-0-0.dba"), &[]).expect("an import"));
    let f = &got.flight;
    eprintln!("{:#?} {:#?}", got.report.notes, got.report.left_out);
    assert_eq!((segments(f), f.len()), (3, 286));
    near("start", got.report.start_unix_s.expect("a date"), number(&want, "/first_unix_s"));
    column(&want, "ctd_pressure_dbar", &f.pressure_pa, 1e-4);
    column(&want, "pitch_rad", &f.pitch_rad, 1.0);
    column(&want, "ballast_cc", &f.ballast_m3, 1e6);
    column(&want, "temperature_degC", &f.temperature_degc, 1.0);
    near("mean salinity", mean(&f.extra["practical_salinity"]), number(&want, "/practical_salinity/mean"));
    let error = block_error(sample, &got);
    assert!(error < number(&want, "/model_comparison_with_vehicle_json/pass_if_below_m_s"), "{error} m/s");
}

#[test]
fn validate_tables_of_erddap() {
    let sample = "erddap";
    let want = expected(sample);
    for (file, key) in [("unit_777-20260502T0915.csv", "csv"), ("unit_777-20260502T0915_short.csvp", "csvp")] {
        let got = import(&folder(sample).join(file), &[]).expect("an import");
        let (f, want) = (&got.flight, &want[key]);
        eprintln!("{:#?} {:#?}", got.report.notes, got.report.left_out);
        assert_eq!(f.len() as u64, want["rows"].as_u64().expect("rows"));
        near("start", got.report.start_unix_s.expect("a date"), number(want, "/first_unix_s"));
        column(want, "pressure_dbar", &f.pressure_pa, 1e-4);
        column(want, "temperature_degC", &f.temperature_degc, 1.0);
        column(want, "pitch_rad", &f.pitch_rad, 1.0);
        column(want, "ballast_cc", &f.ballast_m3, 1e6);
        near("mean salinity", mean(&f.extra["practical_salinity"]), number(want, "/practical_salinity/mean"));
        assert!(f.gps_east_m.iter().all(|v| v.is_nan()), "a place is no fix");
        if key == "csv" {
            assert_eq!(segments(f), 3);
            let error = block_error(sample, &got);
            assert!(error < 0.005, "{error} m/s");
        }
    }
}

#[test]
fn validate_netcdf_of_profiles_and_of_a_whole_deployment() {
    for (sample, path, rows) in
        [("ngdac_profiles", folder("ngdac_profiles"), 317), ("trajectory_nc", folder("trajectory_nc"), 316), ("og1", folder("og1"), 316)]
    {
        let want = expected(sample);
        let got = import(&path, &[]).unwrap_or_else(|e| panic!("{sample}: {e}"));
        let f = &got.flight;
        eprintln!("{sample}: {:#?} {:#?}", got.report.notes, got.report.left_out);
        assert_eq!((segments(f), f.len()), (3, rows), "{sample}");
        near("start", got.report.start_unix_s.expect("a date"), number(&want, "/first_unix_s"));
        for (key, values, factor) in [
            ("pressure_dbar", &f.pressure_pa, 1e-4),
            ("temperature_degC", &f.temperature_degc, 1.0),
            ("pitch_rad", &f.pitch_rad, 1.0),
            ("ballast_cc", &f.ballast_m3, 1e6),
        ] {
            column(&want, key, values, factor);
        }
        if sample == "og1" {
            let vehicle = got.vehicle.as_ref().expect("a vehicle");
            let stated = ["mass_kg", "hull_compressibility_per_pa", "hull_thermal_expansion_per_k", "reference_temperature_degc"];
            assert_eq!(stated.map(|key| vehicle.get(key)), [68.0, 5e-10, 5e-5, 10.0].map(Some), "of its scalars");
            near("volume", vehicle.get("hull_volume_m3").expect("a volume"), 0.066_315_498_671_195_17);
        }
        let error = block_error(sample, &got);
        assert!(error < number(&want, "/model_comparison_with_vehicle_json/pass_if_below_m_s"), "{sample}: {error} m/s");
    }
}

#[test]
fn validate_a_seagliders_own_text_files() {
    let sample = "seaglider_raw";
    let (want, got) = (expected(sample), import(&folder(sample), &[]).expect("an import"));
    let f = &got.flight;
    eprintln!("{:#?} {:#?}", got.report.notes, got.report.left_out);
    assert_eq!((segments(f), f.len()), (3, 553));
    near("start", got.report.start_unix_s.expect("a date"), number(&want, "/first_unix_s"));
    near("end", f.time_s[552], number(&want, "/last_unix_s") - number(&want, "/first_unix_s"));
    column(&want, "pitch_rad", &f.pitch_rad, 1.0);
    for (segment, key) in [(0, "dive_11"), (2, "dive_13")] {
        let rows: Vec<usize> = (0..f.len()).filter(|i| f.segment[*i] == segment).collect();
        let deepest = rows.iter().copied().max_by(|a, b| f.pressure_pa[*a].total_cmp(&f.pressure_pa[*b])).expect("rows");
        let least = rows.iter().filter(|i| **i < deepest).map(|i| f.ballast_m3[*i] * 1e6).fold(f64::INFINITY, f64::min);
        let stated = number(&want, &format!("/ballast_cc_from_log/{key}"));
        assert!((least - stated).abs() < 0.5, "dive {segment}: {least}, log {stated}");
    }
    let vehicle = got.vehicle.as_ref().expect("a vehicle");
    for (key, of) in [
        ("mass_kg", "mass_kg"),
        ("hull_volume_m3", "hull_volume_m3"),
        ("hydro.cd0", "cd0_at_0_30_m_s"),
        ("hydro.hull_drag_per_rad2", "drag_per_rad2"),
    ] {
        near(key, vehicle.get(key).unwrap_or(f64::NAN), number(&want, &format!("/vehicle/{of}")));
    }
    assert!(f.density_kg_m3.iter().all(|v| v.is_nan()) && got.report.density.starts_with("missing"));
}

#[test]
fn validate_real_flights_go_to_a_plausible_vehicle_in_one_step() {
    let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) else {
        eprintln!("skipped: no flights (GLIDER_FLIGHTS is not set)");
        return;
    };
    for (folder, least_segments, class) in [
        ("seaglider_sg561", 8, "sg561"),
        ("seaglider_sg171", 1, "sg171"),
        ("seaexplorer_sea035", 13, "sea035"),
        ("slocum_comet2016/raw", 10, "slocum-200"),
        ("slocum_comet2019/raw", 1, "slocum-200"),
    ] {
        let got = import(&root.join(folder), &[]).unwrap_or_else(|e| panic!("{folder}: {e}"));
        let vehicle = logs::vehicle::parse_text(&got.vehicle.as_ref().expect("a vehicle").toml(), Path::new("vehicle.toml"));
        let vehicle = vehicle.unwrap_or_else(|e| panic!("{folder}: {e}"));
        assert_eq!(vehicle.name, class);
        assert!(segments(&got.flight) >= least_segments, "{folder}: {} segments", segments(&got.flight));
        let c = crate::workbench::compare::compare(&got.flight, &vehicle);
        eprintln!(
            "{folder}: {} rows, {} segments, floats at {:.1}; rms {:.2} cm/s, steady {:.2}, block {:.2} over {:?}\n  left out {:?}\n  {}",
            got.flight.len(),
            segments(&got.flight),
            vehicle.constants.mass_kg / vehicle.constants.hull_volume_m3,
            100.0 * c.rms_m_s,
            100.0 * c.steady_rms_m_s,
            100.0 * c.block_error_m_s,
            c.blocks,
            got.report.left_out,
            got.report.notes.join("\n  ")
        );
        // A first vehicle file gets the sense and the size of the motion right: gliders move at 10 to 30 cm/s.
        assert!(c.steady_rms_m_s < 0.08, "{folder}: {} m/s", c.steady_rms_m_s);
    }
}

/// The flight of the ERDDAP sample with something wrong in it, as a csv.
fn wrong(name: &str, line: impl Fn(usize, &str) -> String) -> Result<Imported, String> {
    let path = folder("erddap").join("unit_777-20260502T0915.csv");
    let text = std::fs::read_to_string(path).expect("a sample");
    let text: String = text.lines().enumerate().map(|(k, l)| line(k, l) + "\n").collect();
    let file = std::env::temp_dir().join(format!("glider-wrong-{}-{name}.csv", std::process::id()));
    std::fs::write(&file, text).expect("written");
    let got = import(&file, &[]).map_err(|e| e.to_string());
    std::fs::remove_file(&file).expect("removed");
    got
}

/// `line` with the pressure (column 7) changed.
fn pressure(k: usize, line: &str, f: impl Fn(f64) -> f64) -> String {
    let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
    if k > 1 {
        fields[6] = format!("{:.3}", f(fields[6].parse().expect("dbar")));
    }
    fields.join(",")
}

#[test]
fn regress_a_pressure_zero_is_removed_and_absolute_pressure_is_named() {
    let deepest = |got: &Imported| got.flight.pressure_pa.iter().copied().fold(0.0, f64::max) * 1e-4;
    for (name, zero, said) in
        [("minus", -1.5, "-1.50 dbar afloat"), ("plus", 1.5, "1.50 dbar afloat"), ("absolute", 10.13, "absolute pressure?")]
    {
        let got = wrong(name, |k, l| pressure(k, l, |p| p + zero)).expect("an import");
        assert!(got.report.notes.iter().any(|n| n.contains(said)), "{name}: {:?}", got.report.notes);
        assert!((deepest(&got) - 41.27).abs() < 0.1, "{name}: {}", deepest(&got));
    }
    let sound = wrong("sound", |_, l| l.to_owned()).expect("an import");
    assert!(!sound.report.notes.iter().any(|n| n.contains("afloat")), "{:?}", sound.report.notes);
    let e = wrong("bar", |k, l| pressure(k, l, |p| 10.0 * p)).expect_err("refused");
    assert!(e.contains("no glider sinks"), "{e}");
}

#[test]
fn validate_the_speed_of_a_current_profiler_on_its_flight() {
    let want = expected("ad2cp_midas");
    let profiler = folder("ad2cp_midas").join("sea099_M7.ad2cp.00000.nc");
    let alone = import(&profiler, &[]).map(|_| ()).expect_err("no flight in it").to_string();
    assert!(alone.contains("current profiler alone"), "{alone}");
    let got = import_all(&[folder("seaexplorer_sub"), profiler.clone()], &[], None).expect("an import");
    eprintln!("{:#?}", got.report.notes);
    let speeds: Vec<f64> = got.flight.speed_m_s.iter().flatten().copied().filter(|v| v.is_finite()).collect();
    assert_eq!(speeds.len() as f64, number(&want, "/speed_through_water_m_s/count"));
    let within = number(&want, "/tolerance_m_s");
    let least = speeds.iter().copied().fold(f64::INFINITY, f64::min);
    let most = speeds.iter().copied().fold(0.0, f64::max);
    for (what, ours) in [("min", least), ("max", most), ("mean", mean(&speeds))] {
        let theirs = number(&want, &format!("/speed_through_water_m_s/{what}"));
        assert!((ours - theirs).abs() < within, "{what}: {ours} m/s, expected {theirs}");
    }
    // It is of this flight only.
    let other = import_all(&[folder("seaglider_nc"), profiler], &[], None).map(|_| ()).expect_err("another flight").to_string();
    assert!(other.contains("not those of this flight"), "{other}");
}

/// A sample's folder with one of its files put through `edit`.
fn edited(sample: &str, file: &str, edit: impl Fn(Vec<u8>) -> Vec<u8>) -> Result<Imported, String> {
    let to = std::env::temp_dir().join(format!("glider-edited-{}-{file}", std::process::id()));
    let _ = std::fs::remove_dir_all(&to);
    std::fs::create_dir_all(&to).expect("a folder");
    for entry in std::fs::read_dir(folder(sample)).expect("a sample").flatten() {
        let name = entry.file_name();
        let bytes = std::fs::read(entry.path()).expect("a file");
        std::fs::write(to.join(&name), if name.to_string_lossy() == file { edit(bytes) } else { bytes }).expect("written");
    }
    let got = import(&to, &[]).map_err(|e| e.to_string());
    std::fs::remove_dir_all(&to).expect("removed");
    got
}

/// Speeds of a current profiler go to the dive of their own file, though a dive before it cannot be read.
#[test]
fn regress_a_dive_that_cannot_be_read_leaves_the_others_their_speeds() {
    let speeds = |got: &Imported| got.flight.speed_m_s.iter().flatten().filter(|v| v.is_finite()).count();
    let whole = import(&folder("seaglider_nc"), &[]).expect("an import");
    let dives: Vec<Imported> = ["p0990012.nc", "p0990013.nc"]
        .into_iter()
        .map(|file| import_all(&[folder("seaglider_nc").join(file)], &[], None).expect("one dive"))
        .collect();
    let others: usize = dives.iter().map(&speeds).sum();
    let got = edited("seaglider_nc", "p0990011.nc", |bytes| bytes[..300].to_vec()).expect("two dives");
    assert_eq!(segments(&got.flight), 2);
    assert!(others > 20 && speeds(&whole) > others, "{others} of {}", speeds(&whole));
    assert_eq!(speeds(&got), others);
}

/// One damaged time, and doubles that far from zero do not tell a second from the next.
#[test]
fn regress_a_time_of_damage_is_left_out_and_the_others_stay() {
    let sound = import(&folder("seaglider_raw"), &[]).expect("an import").flight.len();
    let got = edited("seaglider_raw", "p0990011.eng", |bytes| {
        let text = String::from_utf8(bytes).expect("text");
        text.replacen(" 414.100 ", " -9999999999999414.100 ", 1).into_bytes()
    })
    .expect("an import");
    assert_eq!(got.flight.len(), sound - 1);
    assert!(got.report.left_out.iter().any(|l| l.contains("1 rows further than 400 days")), "{:?}", got.report.left_out);
    assert!(got.flight.time_s.windows(2).all(|w| w[1] > w[0]));
}

//! What is taken out of a log, or asked about it, before a model is run: air in the CTD's cell, pressures held from a slower channel,
//! pressures in another unit; expressions that do nothing; slips in vehicle files; and files that
//! are no flight as they are.

use std::path::Path;

use crate::preprocess::{prepare, sanity};
use hydro::ForceModel;
use hydro::glide::{Trim, steady};
use logs::Flight;
use logs::import::{import, import_all};
use logs::vehicle::{self, Vehicle, expression};

const VEHICLE: &str = r#"{"mass_kg":68,"hull_volume_m3":0.0663415,"hull_compressibility_per_pa":5e-10,"hull_thermal_expansion_per_k":5e-5,
    "wing":{"area_m2":0.1},"hydro":{"reference_area_m2":0.1,"wing_lift_slope_per_rad":7.5,"hull_lift_slope_per_rad":0,
    "hull_area_m2":0.1,"cd0":0.15,"hull_drag_per_rad2":10.5},"tolerance_1sigma":{"cd0_relative":0.1}}"#;

fn vehicle() -> Vehicle {
    vehicle::parse_text(VEHICLE, Path::new("v.json")).expect("a vehicle")
}

#[test]
fn regress_a_byte_order_mark_is_no_part_of_a_vehicle_file() {
    let with = vehicle::parse_text(&format!("\u{feff}{VEHICLE}"), Path::new("v.json")).expect("a vehicle");
    assert_eq!(with.constants, vehicle().constants);
}

/// What is said of the vehicle file with other text in it.
fn refused(from: &str, to: &str) -> String {
    assert!(VEHICLE.contains(from), "{from}");
    let text = VEHICLE.replacen(from, to, 1);
    vehicle::parse_text(&text, Path::new("v.json")).map(|_| text).expect_err("refused").to_string()
}

#[test]
fn regress_a_key_given_twice_in_a_vehicle_file_is_refused() {
    let e = refused("\"cd0\":0.15", "\"cd0\":0.15,\n\"cd0\":0.3");
    assert!(e.starts_with("v.json, line 4, column hydro.cd0: stands here a second time"), "{e}");
    let e = refused("\"wing\":", "\n\n\"mass_kg\":68,\"wing\":");
    assert!(e.starts_with("v.json, line 4, column mass_kg: "), "{e}");
    // In two tables it is two keys.
    let both = VEHICLE.replacen("\"cd0_relative\":0.1", "\"cd0_relative\":0.1,\"own\":[{\"cd0\":1},{\"cd0\":2}],\"mass_kg\":1", 1);
    assert_eq!(vehicle::parse_text(&both, Path::new("v.json")).expect("a vehicle").constants, vehicle().constants);
}

#[test]
fn regress_misspelt_keys_of_a_vehicle_file_are_refused_at_every_level() {
    for (from, to, key, meant) in [
        ("\"wing\":", "\"gravity\":9.78,\"wing\":", "gravity", "gravity_m_s2"),
        ("\"cd0_relative\"", "\"cdo_relative\"", "tolerance_1sigma.cdo_relative", "cd0_relative"),
        ("\"tolerance_1sigma\"", "\"tolerance\"", "tolerance", "tolerance_1sigma"),
        ("\"cd0_relative\":0.1", "\"pitch_zero_deg\":0.5", "tolerance_1sigma.pitch_zero_deg", "pitch_zero_rad"),
        ("\"wing\":", "\"sensors\":{\"pitch_nois_rad\":0.1},\"wing\":", "sensors.pitch_nois_rad", "pitch_noise_rad"),
        ("\"wing\":", "\"sensor\":{\"pitch_noise_rad\":0.1},\"wing\":", "sensor", "sensors"),
        ("\"wing\":", "\"segments\":{\"chek\":[1]},\"wing\":", "segments.chek", "check"),
        ("\"wing\":", "\"efects\":{\"stall\":{\"alpha_stall_rad\":0.1}},\"wing\":", "efects", "effects"),
        ("\"hull_drag_per_rad2\"", "\"hull_drag_per_rd2\"", "hydro.hull_drag_per_rd2", "hull_drag_per_rad2"),
        ("\"mass_kg\"", "\"mas_kg\"", "mas_kg", "mass_kg"),
    ] {
        let e = refused(from, to);
        assert!(e.contains(&format!("column {key}: unknown key; did you mean `{meant}`?")), "{to}: {e}");
    }
    let toml = "mass_kg = 68\nhull_volume_m3 = 0.0663415\nhull_compressibility_per_pa = 5e-10\nhull_thermal_expansion_per_k = 5e-5\n\
        wing.area_m2 = 0.1\n[hydro]\nreference_area_m2 = 0.1\nwing_lift_slope_per_rad = 7.5\nhull_lift_slope_per_rad = 0\nhull_area_m2 = 0.1\n\
        cd0 = 0.15\n[sensor]\npitch_noise_rad = 0.1\n";
    let e = vehicle::parse_text(toml, Path::new("v.toml")).map(|_| ()).expect_err("refused").to_string();
    assert!(e.starts_with("v.toml, line 12, column sensor: unknown key; did you mean `sensors`?"), "{e}");
}

#[test]
fn regress_a_segment_for_fitting_and_checking_is_refused() {
    let e = refused("\"wing\":", "\"segments\":{\"fit\":[0,1,3],\"check\":[2,3]},\"wing\":");
    assert!(e.contains("column segments.check: is [2, 3] and segments.fit [0, 1, 3]") && e.contains("take 3 out"), "{e}");
}

#[test]
fn regress_numbers_that_are_not_finite_are_named_as_such() {
    for (number, key, line) in
        [("nan", "mass_kg", 1), ("inf", "sensors.pitch_noise_rad", 4), ("-inf", "segments.fit", 5), ("1e400", "mass_kg", 1)]
    {
        let of = |k: &str, else_: &'static str| if k == key { number.to_owned() } else { else_.to_owned() };
        let text = format!(
            "mass_kg = {}\n\n[sensors]\npitch_noise_rad = {}\nsegments.fit = [1, {}]\n",
            of("mass_kg", "68"),
            of("sensors.pitch_noise_rad", "0.1"),
            of("segments.fit", "2")
        );
        let key = if key == "segments.fit" { "sensors.segments.fit" } else { key };
        let e = vehicle::parse_text(&text, Path::new("v.toml")).map(|_| ()).expect_err("refused").to_string();
        assert!(e.starts_with(&format!("v.toml, line {line}, column {key}: is {number}, which is not finite")), "{number}: {e}");
    }
}

#[test]
fn regress_a_vehicle_file_in_utf_16_is_named_as_such() {
    let path = std::env::temp_dir().join(format!("glider-utf16-{}.json", std::process::id()));
    let units: Vec<u16> = VEHICLE.encode_utf16().collect();
    for (mark, order) in [(true, u16::to_le_bytes as fn(u16) -> [u8; 2]), (true, u16::to_be_bytes), (false, u16::to_le_bytes)] {
        let marked = mark.then_some(0xfeff).into_iter().chain(units.iter().copied());
        std::fs::write(&path, marked.flat_map(order).collect::<Vec<u8>>()).expect("written");
        let e = vehicle::read(&path).map(|_| ()).expect_err("refused").to_string();
        assert!(e.ends_with(".json: is UTF-16: save it as UTF-8"), "{e}");
    }
    std::fs::write(&path, b"{\n\"case\": \"K\xf6ln\"}").expect("written");
    let e = vehicle::read(&path).map(|_| ()).expect_err("refused").to_string();
    assert!(e.ends_with(".json: line 2 is not UTF-8: save it as UTF-8"), "{e}");
    std::fs::remove_file(&path).expect("removed");
}

/// Rate of depth of this vehicle with 200 cm³ at 0.4 rad, m/s.
fn rate_m_s() -> f64 {
    let trim = Trim { pitch_rad: -0.4, net_buoyancy_n: -9.81 * 1025.0 * 2e-4, rho_kg_m3: 1025.0 };
    let glide = steady(&ForceModel::new(vehicle().constants, &[]), &trim).expect("glides").lowest;
    assert!((0.1..0.3).contains(&glide.sink_m_s), "{glide:?}");
    glide.sink_m_s
}

/// Saw-teeth to 60 m from `top_m` at a rate, pressures times `factor`.
fn flight(factor: f64, rate_m_s: f64, top_m: f64) -> Flight {
    let n = 900;
    let mut f = Flight::blank(n);
    let (mut depth, mut down) = (top_m, true);
    for i in 0..n {
        down = if depth > 60.0 { false } else { down || depth <= top_m };
        depth += if down { 4.0 } else { -4.0 } * rate_m_s;
        f.time_s[i] = 4.0 * i as f64;
        f.pressure_pa[i] = factor * 1025.0 * 9.81 * depth;
        f.pitch_rad[i] = if down { -0.4 } else { 0.4 };
        f.ballast_m3[i] = if down { -2e-4 } else { 2e-4 };
        f.density_kg_m3[i] = 1025.0;
        f.temperature_degc[i] = 15.0;
    }
    f
}

fn note(flight: &Flight, about: &str) -> Option<String> {
    prepare(flight, &vehicle()).notes.into_iter().find(|n| n.contains(about))
}

#[test]
fn regress_psi_and_tens_are_suspected_and_a_dragging_vehicle_is_not() {
    let about = "as fast as this vehicle glides";
    let rate = rate_m_s();
    let sound = flight(1.0, rate, 5.0);
    assert_eq!(note(&sound, about), None);
    assert_eq!(sanity::check(&prepare(&sound, &vehicle()), &vehicle()), Ok(()));
    for (factor, said) in [(1.450_38, "psi named dbar"), (0.689_476, "taken for psi"), (0.1, "bar named dbar")] {
        let note_found = note(&flight(factor, rate, 25.0), about).unwrap_or_else(|| panic!("{factor} passes"));
        assert!(note_found.contains(said), "{factor}: {note_found}");
    }
    // Ten times as fast, or as slow, is no vehicle: refused, where psi may be a vehicle that drags.
    // With a sixth of the drive, so that ten times the rate is none that a log is refused for.
    for (factor, refused) in [(10.0, true), (0.1, true), (1.450_38, false), (1.0, false)] {
        let mut slow = flight(factor, rate / 6.0_f64.sqrt(), 25.0);
        slow.ballast_m3.iter_mut().for_each(|v| *v /= 6.0);
        let prepared = prepare(&slow, &vehicle());
        let said = sanity::check(&prepared, &vehicle());
        assert_eq!(said.is_err_and(|why| why.starts_with("pressure_dbar: depth changes")), refused, "{factor}");
    }
    // A quarter more drag, a tenth less.
    for drag in [1.25_f64, 0.9] {
        assert_eq!(note(&flight(1.0, rate / drag.sqrt(), 5.0), about), None, "{drag}");
    }
}

#[test]
fn regress_air_in_the_cell_is_left_out_and_a_halocline_stays() {
    let about = "air in the CTD";
    for (water, lost) in [(999.0, 20.0), (1025.0, 20.0), (1025.0, 6.0)] {
        let mut f = flight(1.0, 0.13, 0.2);
        for (rho, p) in f.density_kg_m3.iter_mut().zip(&f.pressure_pa) {
            *rho = water + 2.0 / (1.0 + (4.0 - p / 1e4).exp()) + 4.5e-7 * p;
        }
        assert_eq!(note(&f, about), None, "water of {water} as it is");
        let in_air = f.pressure_pa.iter().filter(|p| **p < 2e4).count();
        for (rho, p) in f.density_kg_m3.iter_mut().zip(&f.pressure_pa) {
            *rho -= if *p < 2e4 { lost } else { 0.0 };
        }
        let note_found = note(&f, about).unwrap_or_else(|| panic!("{water} less {lost}"));
        assert!(in_air > 20 && note_found.starts_with(&format!("{in_air} densities")), "{water} less {lost}, {in_air}: {note_found}");
    }
}

#[test]
fn regress_held_pressures_are_thinned_and_coarse_ones_stay() {
    let about = "holds each value";
    let mut f = flight(1.0, 0.14, 5.0);
    f.pressure_pa.iter_mut().enumerate().for_each(|(i, p)| *p = (*p + 30.0 * (i % 7) as f64).round());
    assert_eq!(note(&f, about), None);
    for times in [2, 3] {
        let mut held = f.clone();
        held.pressure_pa.iter_mut().enumerate().for_each(|(i, p)| *p = f.pressure_pa[i - i % times]);
        let repeats = (0..held.len()).filter(|i| i % times > 0).count();
        let note_found = note(&held, about).unwrap_or_else(|| panic!("{times} times"));
        assert!(note_found.contains(&format!("{repeats} repeats")), "{repeats}: {note_found}");
        // The samples that are left are a flight.
        let used = prepare(&held, &vehicle()).runs.iter().flat_map(|r| &r.used).filter(|u| **u).count();
        assert!(used * times > f.len() / 2, "{times} times: {used} rows of {}", f.len());
    }
    let mut coarse = flight(1.0, 0.03, 5.0);
    coarse.pressure_pa.iter_mut().for_each(|p| *p = (*p / 5e3).round() * 5e3);
    assert_eq!(note(&coarse, about), None);
}

#[test]
fn regress_exponents_are_read_and_a_parameter_without_effect_is_refused() {
    for text in ["volume_cc += a*exp(-p/1e5)", "volume_cc += a*exp(-p/1.0E+5)", "cd += k*alpha^2*1e-1", "density_kg_m3 += e5*T"] {
        expression::parse(text).unwrap_or_else(|e| panic!("{e}"));
    }
    for (text, said) in [
        ("cd += k/0", "no number"),
        ("cd += k*ln(-1)", "no number"),
        ("cd += 0*k", "`k` changes nothing"),
        ("cd += k-k", "`k` changes nothing"),
        ("cd += k*roll^2 + 0*m", "`m` changes nothing"),
    ] {
        let e = expression::parse(text).expect_err(text).to_string();
        assert!(e.contains(said), "{text}: {e}");
    }
}

/// A folder of a flight as a table: saw-teeth to 60 m, separated by this.
fn table(name: &str, separator: &str) -> (std::path::PathBuf, String) {
    let folder = std::env::temp_dir().join(format!("glider-doubtful-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let f = flight(1.0, 0.15, 5.0);
    let columns = ["time_s", "pressure_dbar", "m_pitch_rad", "m_ballast_pumped_cc", "sci_density_kg_m3"];
    let rows = (0..f.len()).map(|i| {
        [f.time_s[i], f.pressure_pa[i] * 1e-4, f.pitch_rad[i], f.ballast_m3[i] * 1e6, f.density_kg_m3[i]]
            .map(|v| v.to_string())
            .join(separator)
    });
    let text = std::iter::once(columns.join(separator)).chain(rows).collect::<Vec<_>>().join("\n");
    (folder, text)
}

#[test]
fn regress_a_table_with_tabs_is_known_by_its_ending() {
    let (folder, text) = table("tabs", "\t");
    std::fs::write(folder.join("flight.tsv"), text).expect("written");
    assert_eq!(import(&folder.join("flight.tsv"), &[]).expect("an import").flight.len(), 900);
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_two_tables_packed_files_and_devices_are_answered_with_a_way() {
    let (folder, text) = table("two", ",");
    let named = |names: &[&str]| names.iter().map(|n| folder.join(n)).collect::<Vec<_>>();
    let said = |paths: &[std::path::PathBuf]| import_all(paths, &[], None).map(|_| ()).expect_err("refused").to_string();
    std::fs::write(folder.join("a.csv.gz"), [0x1f, 0x8b]).expect("written");
    for paths in [named(&["a.csv.gz"]), named(&["."])] {
        let e = said(&paths);
        assert!(e.contains("a.csv.gz") && e.contains("is compressed: gunzip it first"), "{e}");
    }
    ["a.csv", "b.csv"].iter().for_each(|n| std::fs::write(folder.join(n), &text).expect("written"));
    for paths in [named(&["a.csv", "b.csv"]), named(&["."])] {
        let e = said(&paths);
        assert!(e.contains("one csv is one flight: import one at a time (a.csv, b.csv), or concatenate them"), "{e}");
    }
    let socket = folder.join("socket");
    let _held = std::os::unix::net::UnixListener::bind(&socket).expect("a socket");
    for path in [socket, "/dev/zero".into()] {
        let e = said(&[path]);
        assert!(e.contains("is no regular file"), "{e}");
    }
    assert!(said(&named(&["nowhere.csv"])).contains("there is no such file"));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_a_seaexplorer_without_navigation_is_called_so() {
    let (folder, _) = table("payload", ",");
    let row = |i: u32| {
        let depth = 30.0 - (f64::from(i % 400) - 200.0).abs() * 0.14;
        let clock = format!("01/06/2020 {:02}:{:02}:{:02}.000", i / 900, i / 15 % 60, i * 4 % 60);
        format!("{clock};5400.0;1000.0;{:.3};10.0;3.5;\n", depth + 1.0)
    };
    let head = "PLD_REALTIMECLOCK;NAV_LATITUDE;NAV_LONGITUDE;GPCTD_PRESSURE;GPCTD_TEMPERATURE;GPCTD_CONDUCTIVITY;\n";
    let text = head.to_owned() + &(0..800).map(row).collect::<String>();
    std::fs::write(folder.join("sea035.12.pld1.sub.36"), text).expect("written");
    let got = import(&folder, &[]).expect("an import");
    let note = got.report.notes.iter().find(|n| n.contains("payload every")).expect("a note");
    assert!(note.ends_with("payload every 4.0 s, no navigation"), "{note}");
    std::fs::remove_dir_all(folder).ok();
}

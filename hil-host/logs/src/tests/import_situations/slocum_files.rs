//! Files of Slocums: copies, two gliders, units, halves that are missing, clocks, a CTD that is off or of another maker.

use crate::import::import;

use super::super::made_logs::{CYCLES, START, at, engineering, pair, slocum};
use super::{folder, said};

/// Sensors of a science file (name, unit).
const CTD: [(&str, &str); 4] =
    [("sci_m_present_time", "timestamp"), ("sci_water_pressure", "bar"), ("sci_water_temp", "degc"), ("sci_water_cond", "s/m")];

#[test]
fn regress_a_copy_of_a_file_under_another_name_is_read_once() {
    let folder = folder("copy");
    pair(&folder, "a", "alpha", START, |t| t);
    let want = import(&folder, &[]).expect("an import").flight;
    for (name, copies) in [("one", &["a.dbd"][..]), ("other", &["a.ebd"]), ("both", &["a.dbd", "a.ebd"])] {
        for file in copies {
            std::fs::copy(folder.join(file), folder.join(format!("Copy of {file}"))).expect("copied");
        }
        let got = import(&folder, &[]).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!((&got.flight.time_s, &got.flight.segment), (&want.time_s, &want.segment), "{name}");
        assert!(said(&got).contains("holds the same bytes as") && got.report.is_whole(), "{name}: {}", said(&got));
    }
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_two_gliders_that_do_not_overlap_are_refused_too() {
    let folder = folder("apart");
    pair(&folder, "a", "alpha", START, |t| t);
    pair(&folder, "b", "alpha", START + 7200.0, |t| t);
    assert_eq!(import(&folder, &[]).expect("one glider").report.segments.len(), 2);
    pair(&folder, "c", "beta", START + 90_000.0, |t| t);
    let e = import(&folder, &[]).expect_err("refused").to_string();
    assert!(e.contains("files of 2 gliders by their headers (alpha, beta)"), "{e}");
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_science_units_of_a_file_are_used_or_its_channel_is_not() {
    let read = |name: &str, unit: &str, of: fn(f64) -> f64| {
        let folder = folder(name);
        engineering(&folder.join("a.dbd"), "alpha", START);
        let sensors =
            [("sci_m_present_time", "timestamp"), ("sci_water_pressure", "bar"), ("sci_water_temp", unit), ("sci_water_cond", "s/m")];
        slocum(&folder.join("a.ebd"), "alpha", &sensors, |k| vec![START + 4.0 * k as f64, at(k).0 / 10.0, of(12.0), 4.0]);
        let got = import(&folder, &[]).expect("an import");
        std::fs::remove_dir_all(folder).ok();
        got
    };
    for (name, unit, of) in [("c", "degc", (|t| t) as fn(f64) -> f64), ("k", "K", |t| t + 273.15), ("f", "degF", |t| 1.8 * t + 32.0)] {
        let got = read(name, unit, of);
        assert_eq!(got.flight.len(), CYCLES, "{unit}");
        assert!(got.flight.temperature_degc.iter().all(|t| (t - 12.0).abs() < 1e-4), "{unit}: {:?}", got.flight.temperature_degc[3]);
    }
    let got = read("unknown", "furlongs", |t| t);
    assert!(got.flight.temperature_degc.iter().all(|t| t.is_nan()) && !got.report.is_whole(), "{}", said(&got));
}

#[test]
fn regress_a_segment_without_one_of_its_files_is_named() {
    let folder = folder("half");
    pair(&folder, "a", "alpha", START, |t| t);
    pair(&folder, "b", "alpha", START + 7200.0, |t| t);
    std::fs::remove_file(folder.join("b.ebd")).expect("removed");
    let got = import(&folder, &[]).expect("an import");
    assert!(said(&got).contains("b has no science file"), "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_cycles_without_a_time_and_a_ctd_that_is_off_are_counted() {
    let folder = folder("holes");
    let own = [("m_present_time", "timestamp"), ("m_pitch", "rad"), ("m_ballast_pumped", "cc"), ("m_pressure", "bar")];
    let write = |untimed: std::ops::Range<usize>, off: std::ops::Range<usize>| {
        let time = |k: usize| START + 4.0 * k as f64;
        let own_time = |k: usize| if untimed.contains(&k) { f64::NAN } else { time(k) };
        slocum(&folder.join("a.dbd"), "alpha", &own, |k| vec![own_time(k), at(k).1, at(k).2, at(k).0 / 10.0]);
        let on = |k: usize, v: f64| if off.contains(&k) { f64::NAN } else { v };
        slocum(&folder.join("a.ebd"), "alpha", &CTD, |k| vec![time(k), on(k, at(k).0 / 10.0), on(k, 12.0), on(k, 3.9)]);
        import(&folder, &[]).expect("an import")
    };
    assert!(write(0..0, 0..0).report.is_whole());
    let got = write(50..90, 0..0).report.left_out.join("\n");
    assert!(got.contains("a.dbd: 40 of ") && got.contains("have no time"), "{got}");
    let got = write(0..0, 75..170).report.left_out.join("\n");
    assert!(got.contains("the CTD was off in") && got.contains("minutes under water"), "{got}");
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_a_clock_set_forward_in_a_segment_is_named_for_what_it_is() {
    let folder = folder("jump");
    pair(&folder, "a", "alpha", START, |t| t);
    let jumping = |ending: &str, clock: &'static str, until: usize, sensors: &[(&str, &str)], rest: fn(usize) -> Vec<f64>| {
        let sensors = [&[(clock, "timestamp")][..], sensors].concat();
        slocum(&folder.join(format!("a.{ending}")), "alpha", &sensors, |k| {
            let time = START + 4.0 * k as f64 + if (140..until).contains(&k) { 3600.0 } else { 0.0 };
            [vec![time], rest(k)].concat()
        });
        import(&folder, &[]).expect("an import").report.left_out.join("\n")
    };
    let own = [("m_pitch", "rad"), ("m_ballast_pumped", "cc"), ("m_pressure", "bar")];
    let said = jumping("dbd", "m_present_time", CYCLES, &own, |k| vec![at(k).1, at(k).2, at(k).0 / 10.0]);
    assert!(said.contains("a.dbd: its clock jumps by +3604 s, 556 s after its begin"), "{said}");
    // For ten cycles only: these are left out, the rest fits.
    let said = jumping("dbd", "m_present_time", 150, &own, |k| vec![at(k).1, at(k).2, at(k).0 / 10.0]);
    assert!(said.contains("10 of 260 cycles are out of order") && !said.contains("jumps"), "{said}");
    engineering(&folder.join("a.dbd"), "alpha", START);
    let said = jumping("ebd", "sci_m_present_time", CYCLES, &CTD[1..], |k| vec![at(k).0 / 10.0, 12.0, 3.9]);
    assert!(said.contains("a.ebd: its clock jumps by +3604 s"), "{said}");
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_the_own_names_of_an_rbr_ctd_are_read() {
    let folder = folder("rbr");
    engineering(&folder.join("a.dbd"), "alpha", START);
    let ctd = |sensors: [(&str, &str); 3], offset: f64, factor: f64| {
        let sensors = [&[("sci_m_present_time", "timestamp"), ("sci_rbrctd_timestamp", "timestamp")][..], &sensors].concat();
        slocum(&folder.join("a.ebd"), "alpha", &sensors, |k| {
            let time = START + 4.0 * k as f64;
            vec![time, time, (at(k).0 + offset) * factor, 12.0, 39.0 * if factor == 1.0 { 1.0 } else { 0.1 }]
        });
        import(&folder, &[]).expect("an import")
    };
    let usual = ctd([("sci_water_pressure", "bar"), ("sci_water_temp", "degc"), ("sci_water_cond", "s/m")], 0.0, 0.1);
    let rest = [("sci_rbrctd_temperature_00", "degc"), ("sci_rbrctd_conductivity_00", "mS/cm")];
    let got = ctd([("sci_rbrctd_seapressure_00", "dbar"), rest[0], rest[1]], 0.0, 1.0);
    let off = got.flight.density_kg_m3.iter().zip(&usual.flight.density_kg_m3).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(got.flight.len() == CYCLES && off < 1e-6, "{off}: {}", said(&got));
    assert!(said(&got).contains("sci_rbrctd_seapressure_00, sci_rbrctd_temperature_00, sci_rbrctd_conductivity_00 are taken"));
    assert_eq!(ctd([("sci_rbrctd_pressure_00", "dbar"), rest[0], rest[1]], 0.0, 1.0).flight.len(), CYCLES);
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_what_was_lost_before_is_named_with_the_refusal_and_the_density() {
    let folder = folder("lost");
    let sensors = [("m_present_time", "timestamp"), ("m_pressure", "bar")];
    let write = |cond: fn(usize) -> f64, time: fn(usize) -> usize| {
        let time = |k: usize| START + 4.0 * time(k) as f64;
        slocum(&folder.join("a.dbd"), "alpha", &sensors, |k| vec![time(k), at(k).0 / 10.0]);
        slocum(&folder.join("a.ebd"), "alpha", &CTD, |k| vec![time(k), at(k).0 / 10.0, 12.0, cond(k)]);
        import(&folder, &[])
    };
    let got = write(|k| if k > 100 { 0.0 } else { 3.9 }, |k| k).expect("an import");
    assert!(said(&got).contains("rows under water have no density: salinity, conductivity or temperature"), "{}", said(&got));
    assert!(!said(&write(|_| 3.9, |k| k).expect("an import")).contains("have no density"));
    let e = write(|_| 3.9, |k| 2 * CYCLES - k).expect_err("one cycle in order").to_string();
    assert!(e.contains("left out before: ") && e.contains("goes backwards"), "{e}");
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_values_of_a_slocum_that_cannot_be_are_left_out_by_name() {
    let folder = folder("cannot");
    let own = [("m_present_time", "timestamp"), ("m_pressure", "bar"), ("m_heading", "rad"), ("m_gps_lat", "lat"), ("m_gps_lon", "lon")];
    let write = |heading: f64, place: (f64, f64), degc: fn(usize) -> f64, zero: std::ops::Range<usize>| {
        let time = |k: usize| START + 4.0 * k as f64;
        let surfaced = |k: usize, v: f64| if k < 4 { v } else { f64::NAN };
        slocum(&folder.join("a.dbd"), "alpha", &own, |k| {
            vec![time(k), at(k).0 / 10.0, heading, surfaced(k, place.0), surfaced(k, place.1)]
        });
        let dbar = |k: usize| if zero.contains(&k) { 0.0 } else { at(k).0 / 10.0 };
        slocum(&folder.join("a.ebd"), "alpha", &CTD, |k| vec![time(k), dbar(k), degc(k), 3.9]);
        import(&folder, &[]).expect("an import")
    };
    let sound = write(1.0, (5412.0, 724.0), |_| 12.0, 0..0);
    assert!(sound.report.is_whole(), "{}", said(&sound));
    let fills = write(1.0, (5412.0, 724.0), |k| if k % 5 == 0 { -999.0 } else { 12.0 }, 0..0);
    assert!(said(&fills).contains("52 of 260 temperatures are none of water"), "{}", said(&fills));
    assert!(fills.flight.temperature_degc.iter().all(|t| t.is_nan() || *t == 12.0));
    assert!(said(&write(60.0, (5412.0, 724.0), |_| 12.0, 0..0)).contains("m_heading is in rad and goes beyond a full turn"));
    let degrees = write(1.0, (54.2, 7.4), |_| 12.0, 0..0);
    assert!(said(&degrees).contains("look like degrees") && degrees.flight.gps_east_m.iter().all(|v| v.is_nan()), "{}", said(&degrees));
    let off = write(1.0, (5412.0, 724.0), |_| 12.0, 60..64);
    assert!(said(&off).contains("4 of 260 values of the pressure are 0 in the middle of a dive"), "{}", said(&off));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_two_files_that_overlap_a_little_do_not_come_by_turns() {
    let folder = folder("turns");
    pair(&folder, "a", "alpha", START, |t| t);
    pair(&folder, "b", "alpha", START + 4.0 * CYCLES as f64 - 30.0, |t| t);
    let got = import(&folder, &[]).expect("an import");
    assert!(got.flight.segment.windows(2).all(|w| w[1] >= w[0]), "by turns");
    assert!(said(&got).contains("rows of one segment lie in the time of the next"), "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_halves_of_a_segment_that_were_renamed_apart_are_one_again() {
    let folder = folder("renamed");
    pair(&folder, "a", "alpha", START, |t| t);
    let want = import(&folder, &[]).expect("an import").flight;
    std::fs::rename(folder.join("a.ebd"), folder.join("00010001.ebd")).expect("renamed");
    let got = import(&folder, &[]).expect("an import");
    assert!(said(&got).contains("00010001.ebd and a.dbd are of one segment by their headers"), "{}", said(&got));
    assert!(got.report.is_whole() && got.flight.pitch_rad == want.pitch_rad && got.flight.segment == want.segment, "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_a_depth_that_grows_upward_and_a_fix_on_the_meridian_are_read() {
    let folder = folder("upward");
    let own = [("m_present_time", "timestamp"), ("m_depth", "m"), ("m_pitch", "rad"), ("m_gps_lat", "lat"), ("m_gps_lon", "lon")];
    let write = |sign: f64, lon: f64| {
        slocum(&folder.join("a.dbd"), "alpha", &own, |k| {
            let fix = |v: f64| if k < 4 { v } else { f64::NAN };
            vec![START + 4.0 * k as f64, sign * at(k).0, at(k).1, fix(5130.0), fix(lon)]
        });
        import(&folder, &[]).expect("an import")
    };
    let (down, up) = (write(1.0, 100.0), write(-1.0, 0.0));
    assert!(!said(&down).contains("turned round") && said(&up).contains("m_depth grows upward: turned round"), "{}", said(&up));
    assert!(up.flight.pressure_pa == down.flight.pressure_pa && up.flight.len() > 250, "{}", up.flight.len());
    let fixes = |got: &crate::import::Imported| got.flight.gps_east_m.iter().filter(|v| v.is_finite()).count();
    assert!(fixes(&up) == fixes(&down) && up.report.origins[0].lon_deg == 0.0, "{:?}", up.report.origins);
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_an_absolute_pressure_does_not_disagree_with_the_vehicle() {
    let folder = folder("absolute");
    // A minute at the surface between dives, as a zero of the sensor is seen there.
    let dbar = |k: usize| if k % 130 < 20 { 0.05 } else { at(k).0 };
    let own = [("m_present_time", "timestamp"), ("m_pitch", "rad"), ("m_ballast_pumped", "cc"), ("m_pressure", "bar")];
    slocum(&folder.join("a.dbd"), "alpha", &own, |k| vec![START + 4.0 * k as f64, at(k).1, at(k).2, dbar(k) / 10.0]);
    let write = |zero: f64| {
        slocum(&folder.join("a.ebd"), "alpha", &CTD, |k| vec![START + 4.0 * k as f64, (dbar(k) + zero) / 10.0, 12.0, 3.9]);
        import(&folder, &[]).expect("an import")
    };
    let (gauge, absolute) = (write(0.0), write(10.13));
    assert!(absolute.report.is_whole() && said(&absolute).contains("zero taken out"), "{}", said(&absolute));
    let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off(&absolute.flight.pressure_pa, &gauge.flight.pressure_pa) < 1e3);
    assert!(off(&absolute.flight.density_kg_m3, &gauge.flight.density_kg_m3) < 1e-3, "of the pressure without its zero");
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_samples_of_a_ctd_that_is_off_or_without_a_clock_are_counted() {
    let folder = folder("off");
    engineering(&folder.join("a.dbd"), "alpha", START);
    let sensors = [CTD[0], ("sci_ctd41cp_timestamp", "timestamp"), CTD[1], CTD[2], CTD[3]];
    let write = |stamp: fn(usize, f64) -> f64, on: fn(usize) -> f64| {
        slocum(&folder.join("a.ebd"), "alpha", &sensors, |k| {
            let t = START + 4.0 * k as f64;
            vec![t, stamp(k, t), on(k) * at(k).0 / 10.0, on(k) * 12.0, on(k) * 3.9]
        });
        import(&folder, &[]).expect("an import")
    };
    assert!(write(|_, t| t, |_| 1.0).report.is_whole());
    let got = write(|k, t| if k % 3 == 0 { 0.0 } else { t }, |_| 1.0);
    assert!(
        got.report.left_out.iter().any(|l| l.contains("samples of the CTD whose clock sci_ctd41cp_timestamp was not set")),
        "{}",
        said(&got)
    );
    let got = write(|_, t| t, |k| if (40..80).contains(&k) { 0.0 } else { 1.0 });
    assert!(said(&got).contains("a.ebd: 40 CTD samples between others are zero throughout"), "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_a_ctd_without_its_pressure_is_named() {
    let folder = folder("no pressure");
    pair(&folder, "a", "alpha", START, |t| t);
    let sensors = [CTD[0], CTD[2], CTD[3]];
    slocum(&folder.join("a.ebd"), "alpha", &sensors, |k| vec![START + 4.0 * k as f64, 12.0, 3.9]);
    let got = import(&folder, &[]).expect("an import");
    assert!(said(&got).contains("a.ebd: sci_water_temp has values, the CTD's pressure none") && !got.report.is_whole(), "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_a_pitch_that_comes_too_seldom_and_two_missions_are_named() {
    let folder = folder("seldom");
    pair(&folder, "a", "alpha", START, |t| t);
    let own = [("m_present_time", "timestamp"), ("m_pitch", "rad"), ("m_ballast_pumped", "cc"), ("m_pressure", "bar")];
    slocum(&folder.join("a.dbd"), "alpha", &own, |k| {
        let pitch = if k == 3 || k == 250 { 0.4 } else { f64::NAN };
        vec![START + 4.0 * k as f64, pitch, at(k).2, at(k).0 / 10.0]
    });
    let got = import(&folder, &[]).expect("an import");
    assert!(got.report.left_out.iter().any(|l| l.starts_with("pitch has 2 values 988 s apart, and 2 of 260 rows one")), "{}", said(&got));
    pair(&folder, "a", "alpha", START, |t| t);
    pair(&folder, "b", "alpha", START + 100.0 * 86_400.0, |t| t);
    let got = import(&folder, &[]).expect("an import");
    assert!(said(&got).contains("no row for 100 days after segment 0: two missions?"), "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

/// Three segments of two dives an hour apart, of these engineering sensors; `own` gives the values of (segment, cycle), `zero` what the
/// CTD's pressure reads too high in a segment, dbar.
fn three(folder: &std::path::Path, sensors: &[(&str, &str)], own: impl Fn(usize, usize) -> Vec<f64>, zero: impl Fn(usize) -> f64) {
    for segment in 0..3 {
        let time = |k: usize| START + 3600.0 * segment as f64 + 4.0 * k as f64;
        let all = [&[("m_present_time", "timestamp")][..], sensors].concat();
        slocum(&folder.join(format!("{segment}.dbd")), "alpha", &all, |k| [vec![time(k)], own(segment, k)].concat());
        // A minute and more afloat before each dive.
        let dbar = |k: usize| if k % 130 < 20 { 0.05 } else { at(k).0 };
        slocum(&folder.join(format!("{segment}.ebd")), "alpha", &CTD, |k| vec![time(k), (dbar(k) + zero(segment)) / 10.0, 12.0, 3.9]);
    }
}

const OWN: [(&str, &str); 4] = [("m_pitch", "rad"), ("m_ballast_pumped", "cc"), ("m_de_oil_vol", "cc"), ("m_pressure", "bar")];

#[test]
fn regress_pump_bladder_and_depth_are_chosen_in_each_segment() {
    let folder = folder("by segment");
    let sound = |_: usize, k: usize| vec![at(k).1, at(k).2, 0.0, at(k).0 / 10.0];
    three(&folder, &OWN, sound, |_| 0.0);
    let want = import(&folder, &[]).expect("an import");
    assert!(want.report.is_whole(), "{}", said(&want));
    let other = |s: usize, k: usize| if s == 1 { vec![at(k).1, 0.0, at(k).2, at(k).0 / 10.0] } else { sound(s, k) };
    three(&folder, &OWN, other, |_| 0.0);
    let got = import(&folder, &[]).expect("an import");
    assert!(said(&got).contains("ballast: in 1 segments m_de_oil_vol moves and m_ballast_pumped does not"), "{}", said(&got));
    assert_eq!(got.flight.ballast_m3, want.flight.ballast_m3);
    // Without a CTD and with a depth alone in one segment.
    let sensors = [OWN[0], OWN[1], ("m_depth", "m"), OWN[3]];
    let depth = |s: usize, k: usize| {
        let [m, bar] = if s == 1 { [at(k).0, f64::NAN] } else { [f64::NAN, at(k).0 / 10.0] };
        vec![at(k).1, at(k).2, m, bar]
    };
    three(&folder, &sensors, depth, |_| 0.0);
    std::fs::remove_file(folder.join("1.ebd")).expect("removed");
    let got = import(&folder, &[]).expect("an import");
    assert!(said(&got).contains("1 segments have no m_pressure: it is computed from m_depth there"), "{}", said(&got));
    assert_eq!((got.report.segments.len(), got.flight.len()), (3, 3 * CYCLES), "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_what_one_segment_alone_has_wrong_is_named_or_mended_there() {
    let folder = folder("one segment");
    let sound = |_: usize, k: usize| vec![at(k).1, at(k).2, 0.0, if k % 130 < 20 { 0.005 } else { at(k).0 / 10.0 }];
    three(&folder, &OWN, sound, |_| 0.0);
    let want = import(&folder, &[]).expect("an import");
    let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    three(&folder, &OWN, sound, |s| if s == 1 { -2.0 } else { 0.0 });
    let got = import(&folder, &[]).expect("an import");
    assert!(said(&got).contains("afloat in segments 1: zero taken out") && got.report.is_whole(), "{}", said(&got));
    assert!(off(&got.flight.pressure_pa, &want.flight.pressure_pa) < 1e3);
    // Where it may be a turn below the surface it stays, and the vehicle's own pressure says so.
    three(&folder, &OWN, sound, |s| if s == 1 { 10.13 } else { 0.0 });
    let got = import(&folder, &[]).expect("an import");
    assert!(got.report.left_out.iter().any(|l| l.contains("do not agree in segments 1:")), "{}", said(&got));
    // The vehicle's pressure of the second segment is that of two minutes before.
    let late = |s: usize, k: usize| sound(s, if s == 1 { k.saturating_sub(30) } else { k });
    three(&folder, &OWN, late, |_| 0.0);
    let got = import(&folder, &[]).expect("an import");
    assert!(got.report.left_out.iter().any(|l| l.contains("do not agree in segments 1:")), "{}", said(&got));
    let bare = |s: usize, k: usize| [vec![if s == 2 { f64::NAN } else { at(k).1 }], sound(s, k)[1..].to_vec()].concat();
    three(&folder, &OWN, bare, |_| 0.0);
    let got = import(&folder, &[]).expect("an import");
    assert!(said(&got).contains("m_pitch_rad has no values, or few, in segments 2"), "{}", said(&got));
    let turned = |s: usize, k: usize| [vec![if s == 2 { -at(k).1 } else { at(k).1 }], sound(s, k)[1..].to_vec()].concat();
    three(&folder, &OWN, turned, |_| 0.0);
    let got = import(&folder, &[]).expect("an import");
    assert!(said(&got).contains("of the rows of segments 2 that sink"), "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_texts_with_one_name_in_their_headers_are_all_read() {
    let folder = folder("one header");
    for part in 0..3 {
        let mut text = "dbd_label: DBD_ASC(dinkum_binary_data_ascii)file\nencoding_ver: 2\nnum_ascii_tags: 14\nall_sensors: 0\n\
             filename: alpha-2020-257-0-0\nthe8x3_filename: 00010001\nfilename_extension: dbd\nfilename_label: alpha-2020-257-0-0-dbd(00010001)\n\
             mission_name: OURS.MI\nfileopen_time: Sun_Sep_13_12:26:40_2020\nsensors_per_cycle: 4\nnum_label_lines: 3\nnum_segments: 1\n\
             segment_filename_0: alpha-2020-257-0-0\nm_present_time m_pitch m_ballast_pumped m_pressure\ntimestamp rad cc bar\n8 4 4 4\n"
            .to_owned();
        for k in 0..CYCLES {
            text += &format!("{} {} {} {}\n", START + 1200.0 * f64::from(part) + 4.0 * k as f64, at(k).1, at(k).2, at(k).0 / 10.0);
        }
        std::fs::write(folder.join(format!("part_{part}.dba")), text).expect("written");
    }
    let got = import(&folder, &[]).expect("an import");
    // The first cycle of a file repeats old values and is no sample.
    assert_eq!((got.flight.len(), got.report.segments.len()), (3 * (CYCLES - 1), 3), "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_the_rest_of_a_cut_file_comes_from_the_file_sent_ashore() {
    let folder = folder("cut and sent");
    pair(&folder, "a", "alpha", START, |t| t);
    let want = import(&folder, &[]).expect("an import").flight;
    let bytes = std::fs::read(folder.join("a.dbd")).expect("read");
    std::fs::write(folder.join("a.sbd"), &bytes).expect("written");
    std::fs::write(folder.join("a.dbd"), &bytes[..bytes.len() / 2]).expect("written");
    let got = import(&folder, &[]).expect("an import");
    assert!(said(&got).contains("a.dbd is damaged: after its end") && said(&got).contains("cycles of a.sbd are taken"), "{}", said(&got));
    assert!(!got.report.is_whole() && got.flight.pitch_rad == want.pitch_rad, "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_a_cut_copy_of_a_segment_does_not_refuse_the_folder() {
    let folder = folder("cut copy");
    pair(&folder, "a", "alpha", START, |t| t);
    pair(&folder, "b", "alpha", START + 7200.0, |t| t);
    let want = import(&folder, &[]).expect("an import").flight;
    // Under another name that comes before, and with the name of the segment in its header.
    let bytes = std::fs::read(folder.join("a.dbd")).expect("read");
    std::fs::write(folder.join("0.dbd"), &bytes[..bytes.len() / 2]).expect("written");
    let got = import(&folder, &[]).expect("an import");
    assert!(said(&got).contains("a.dbd and 0.dbd are copies of one segment by their headers"), "{}", said(&got));
    assert_eq!((&got.flight.pitch_rad, &got.flight.segment), (&want.pitch_rad, &want.segment), "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_fixes_that_the_receiver_calls_bad_are_left_out() {
    let folder = folder("gps status");
    let own = [("m_present_time", "timestamp"), ("m_depth", "m"), ("m_gps_lat", "lat"), ("m_gps_lon", "lon"), ("m_gps_status", "enum")];
    // Of eight fixes the first three are two miles off.
    let write = |status: f64| {
        slocum(&folder.join("a.dbd"), "alpha", &own, |k| {
            let fix = |v: f64| if k < 8 { v } else { f64::NAN };
            let bad = k < 3;
            vec![
                START + 4.0 * k as f64,
                at(k).0.max(0.0),
                fix(if bad { 5132.0 } else { 5130.0 }),
                fix(700.0),
                fix(if bad { status } else { 0.0 }),
            ]
        });
        import(&folder, &[]).expect("an import")
    };
    let (named, silent) = (write(2.0), write(0.0));
    assert!(said(&named).contains("3 of 8 GPS fixes have another m_gps_status than 0"), "{}", said(&named));
    assert!((named.report.origins[0].lat_deg - 51.5).abs() < 1e-9, "{:?}", named.report.origins);
    assert!(!said(&silent).contains("m_gps_status"), "{}", said(&silent));
    std::fs::remove_dir_all(folder).ok();
}

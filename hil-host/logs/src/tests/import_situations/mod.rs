//! What people hand over: clocks that were not set, two gliders in a folder, files that are empty beside ones that are not, names of
//! another case. Each input is made here, and the import says what is the matter or reads it.

use std::path::{Path, PathBuf};

use crate::import::{Imported, import};

mod lab_folders;
mod slocum_files;

use super::made_logs::{CYCLES, START, USUAL, Variable, at, engineering, netcdf, pair, variables};

fn folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("glider-situation-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

fn said(imported: &Imported) -> String {
    imported.report.notes.iter().chain(&imported.report.left_out).cloned().collect::<Vec<_>>().join("\n")
}

fn whole(imported: &Imported) {
    let f = &imported.flight;
    for (name, column) in [("pitch", &f.pitch_rad), ("ballast", &f.ballast_m3), ("density", &f.density_kg_m3)] {
        let known = column.iter().filter(|v| v.is_finite()).count();
        assert!(known > 200, "{name}: {known} of {}\n{}", f.len(), said(imported));
    }
}

#[test]
fn regress_sound_slocum_files_are_read_without_a_word_of_loss() {
    let folder = folder("sound");
    pair(&folder, "a", "alpha", START, |t| t);
    let got = import(&folder, &[]).expect("an import");
    assert!(got.report.is_whole(), "{:?}", got.report.left_out);
    whole(&got);
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_files_of_a_clock_in_1970_are_named_with_good_ones_and_alone() {
    let folder = folder("1970");
    pair(&folder, "a", "alpha", START, |t| t);
    pair(&folder, "b", "alpha", 100.0, |t| t);
    let got = import(&folder, &[]).expect("an import");
    let left_out = got.report.left_out.join("\n");
    assert!(!got.report.is_whole(), "exit code 1");
    assert!(left_out.contains("b.dbd") && left_out.contains("b.ebd") && left_out.contains("1970"), "{left_out}");
    assert!(got.flight.time_s.last().is_some_and(|t| *t < 2000.0));
    for name in ["a.dbd", "a.ebd"] {
        std::fs::remove_file(folder.join(name)).expect("removed");
    }
    // Alone the cause is the clock, not a pressure that is there.
    match import(&folder, &[]) {
        Ok(got) => assert!(said(&got).contains("1970"), "{}", said(&got)),
        Err(e) => assert!(e.to_string().contains("1970"), "{e}"),
    }
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_two_gliders_in_a_folder_are_refused_with_both_names() {
    let folder = folder("two");
    pair(&folder, "alpha-2020-257-0-0", "alpha", START, |t| t);
    pair(&folder, "beta-2020-257-0-0", "beta", START + 300.0, |t| t);
    let e = import(&folder, &[]).expect_err("refused").to_string();
    assert!(e.contains("alpha") && e.contains("beta"), "{e}");
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_an_empty_file_does_not_hide_the_good_one_next_to_it() {
    let folder = folder("empty");
    pair(&folder, "a", "alpha", START, |t| t);
    std::fs::rename(folder.join("a.dbd"), folder.join("a.sbd")).expect("renamed");
    std::fs::write(folder.join("a.dbd"), b"").expect("written");
    let got = import(&folder, &[]).expect("an import");
    whole(&got);
    assert!(said(&got).contains("a.sbd is used in the place of a.dbd"), "{}", said(&got));
    std::fs::remove_dir_all(folder).ok();
}

#[test]
fn regress_a_ctd_whose_own_clock_was_never_set_stands_on_the_computers() {
    for (name, stamp) in [("absent", f64::NAN), ("zero", 0.0)] {
        let folder = folder(name);
        pair(&folder, "a", "alpha", START, |_| stamp);
        let got = import(&folder, &[]).expect("an import");
        whole(&got);
        assert!(said(&got).contains("clock was not set"), "{name}: {}", said(&got));
        std::fs::remove_dir_all(folder).ok();
    }
}

#[test]
fn regress_a_named_file_is_the_one_that_is_read() {
    let folder = folder("named");
    pair(&folder, "a", "alpha", START, |t| t);
    engineering(&folder.join("a.sbd"), "alpha", START);
    let got = import(&folder.join("a.sbd"), &[]).expect("an import");
    let read: Vec<&str> = got.report.files.iter().map(|f| f.file.as_str()).collect();
    assert!(read.contains(&"a.sbd") && !read.contains(&"a.dbd"), "{read:?}");
    std::fs::remove_dir_all(folder).ok();
}

fn read_netcdf(name: &str, dimensions: &[&str], variables: &[Variable]) -> Result<Imported, String> {
    let folder = folder(name);
    let path = folder.join("mission.nc");
    netcdf(&path, dimensions, variables);
    let got = import(&path, &[]).map_err(|e| e.to_string());
    std::fs::remove_dir_all(folder).ok();
    got
}

#[test]
fn regress_rows_before_the_clock_was_set_are_no_flight_of_fifty_years() {
    let mut columns = variables(USUAL);
    columns[0].3[..130].iter_mut().enumerate().for_each(|(k, t)| *t = 4.0 * k as f64);
    let got = read_netcdf("half-1970", &["time"], &columns).expect("an import");
    assert!(got.flight.time_s.last().is_some_and(|t| *t < 2000.0), "{:?} s long", got.flight.time_s.last());
    assert!(!got.report.is_whole() && said(&got).contains("130"), "{}", said(&got));
}

#[test]
fn regress_a_dimension_of_one_is_none() {
    let got = read_netcdf("trajectory", &["trajectory", "obs"], &variables(USUAL)).expect("an import");
    assert_eq!(got.flight.len(), CYCLES);
    whole(&got);
}

#[test]
fn regress_channels_are_found_whatever_the_case_and_by_standard_name() {
    let upper = ["TIME", "PRESSURE", "TEMPERATURE", "SALINITY", "PITCH", "BALLAST_PUMPED"];
    let mixed = ["Time", "Pressure", "Temperature", "Salinity", "Pitch", "Ballast_Pumped"];
    let other = ["juld", "ctd_press", "ctd_t", "ctd_s", "pitch", "ballast_pumped"];
    for names in [upper, mixed, other] {
        let dimension = names[0];
        let got = read_netcdf(names[1], &[dimension], &variables(names)).unwrap_or_else(|e| panic!("{names:?}: {e}"));
        assert_eq!(got.flight.len(), CYCLES, "{names:?}");
        whole(&got);
    }
}

#[test]
fn regress_what_a_file_calls_its_units_stays_in_one_line_of_a_message() {
    let mut columns = variables(USUAL);
    columns[1].1 = "dbar\n\u{1b}[31m";
    let e = read_netcdf("control", &["time"], &columns).map(|_| ()).expect_err("of no known unit");
    assert!(!e.contains(char::is_control) && e.contains("pressure"), "{e:?}");
}

/// Saw-teeth as csv; the columns of `at` besides time and pressure are those named here.
fn csv(name: &str, header: &str, row: impl Fn(usize) -> String) -> Result<Imported, String> {
    let folder = folder(name);
    let path = folder.join("glider.csv");
    let rows: String = (0..CYCLES).map(|k| format!("{},{:.3},{}\n", 4 * k, at(k).0, row(k))).collect();
    std::fs::write(&path, format!("time_s,pressure_dbar,{header}\n{rows}")).expect("written");
    let got = import(&path, &[]).map_err(|e| e.to_string());
    std::fs::remove_dir_all(folder).ok();
    got
}

/// A vehicle too small for a sensor of its ballast; one without a CTD; one without either.
#[test]
fn regress_a_log_without_ballast_is_read_and_says_what_it_cannot_show() {
    let (ballast, density) = ("m_ballast_pumped_cc", "sci_density_kg_m3");
    let cases: [(&str, &[&str]); 4] = [
        ("m_pitch_rad,sci_density_kg_m3", &[ballast]),
        ("pitch_deg,sci_water_temp", &[ballast, density]),
        ("m_pitch_rad,m_ballast_pumped_cc", &[density]),
        ("sci_water_temp_degC,oxygen", &["m_pitch_rad", ballast, density]),
    ];
    for (header, lacking) in cases {
        let field = |name: &str, k: usize| match name {
            "m_pitch_rad" => at(k).1,
            "pitch_deg" => at(k).1.to_degrees(),
            "m_ballast_pumped_cc" => at(k).2,
            "sci_density_kg_m3" => 1025.1,
            _ => 12.0 - 0.05 * at(k).0,
        };
        let row = |k: usize| header.split(',').map(|name| field(name, k).to_string()).collect::<Vec<_>>().join(",");
        let got = csv(&format!("micro-{}", header.len()), header, row).unwrap_or_else(|e| panic!("{header}: {e}"));
        assert_eq!(got.flight.len(), CYCLES);
        for column in lacking {
            assert!(got.report.notes.iter().any(|n| n.starts_with(&format!("without {column} "))), "{header}: {}", said(&got));
        }
        assert_eq!(got.report.notes.iter().filter(|n| n.starts_with("without ")).count(), lacking.len(), "{header}: {}", said(&got));
    }
    // A comparison refuses it with the same words.
    let text = "time_s,pressure_dbar,m_pitch_rad,sci_density_kg_m3\n0,5,0.1,1025\n";
    let e = crate::record::csv::parse(text, Path::new("f.csv"), "f").expect_err("no ballast").to_string();
    assert!(e.contains("m_ballast_pumped_cc: is missing; without it the force that drives it is unknown"), "{e}");
}

#[test]
fn regress_a_csv_with_the_columns_of_a_slocum_is_of_its_class() {
    for (column, class) in [("battpos_in", "slocum-200"), ("m_battpos", "slocum-200"), ("battpos_m", "unknown")] {
        let header = format!("m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3,{column}");
        let got = csv(column, &header, |k| format!("{},{},1025.1,0.3", at(k).1, at(k).2)).expect("an import");
        assert!(said(&got).contains(&format!("class {class}")), "{column}: {}", said(&got));
    }
}

#[test]
fn regress_a_folder_of_folders_and_one_of_several_tables_say_what_to_name() {
    let folder = folder("folders");
    let inner = folder.join("raw");
    std::fs::create_dir_all(&inner).expect("a folder");
    pair(&inner, "a", "alpha", START, |t| t);
    let e = import(&folder, &[]).map(|_| ()).expect_err("nothing in it").to_string();
    assert!(e.contains("name a folder in it") && e.contains(&inner.display().to_string()), "{e}");
    std::fs::remove_dir_all(&inner).ok();
    for name in ["day1.csv", "day2.csv"] {
        std::fs::write(folder.join(name), "time_s,pressure_dbar\n0,1\n").expect("written");
    }
    let e = import(&folder, &[]).map(|_| ()).expect_err("two").to_string();
    assert!(e.contains("day1.csv, day2.csv"), "{e}");
    std::fs::remove_dir_all(folder).ok();
}

/// The sound table of these tests with its lines changed, and what is said of it.
fn tidied(name: &str, edit: impl Fn(Vec<String>) -> Vec<String>) -> Result<Imported, String> {
    let folder = folder(name);
    let mut lines = vec!["time_s,pressure_dbar,m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3,sci_water_temp_degC".to_owned()];
    // The pump is out at one volume, and in at a few.
    let cc = |k: usize| if at(k).2 > 0.0 { 200.0 } else { -200.0 - (k % 3) as f64 };
    lines.extend((0..CYCLES).map(|k| {
        let (dbar, pitch, _) = at(k);
        format!("{},{dbar:.3},{pitch},{:.1},{:.3},{:.3}", 4 * k, cc(k), 1025.0 + 0.005 * dbar, 12.5 - 0.05 * dbar)
    }));
    let path = folder.join("glider.csv");
    std::fs::write(&path, edit(lines).join("\n") + "\n").expect("written");
    let got = import(&path, &[]).map_err(|e| e.to_string());
    std::fs::remove_dir_all(folder).ok();
    got
}

#[test]
fn regress_what_programs_do_to_a_table_is_undone_and_reported() {
    let sound = tidied("sound-csv", |l| l).expect("an import").flight;
    assert_eq!(
        (sound.len(), sound.ballast_m3.iter().filter(|v| **v > 1e-4).count()),
        (CYCLES, CYCLES / 2),
        "a pump's two volumes are values"
    );
    let same = |name: &str, said_of_it: &str, whole: bool, edit: &dyn Fn(Vec<String>) -> Vec<String>| {
        let got = tidied(name, edit).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!((&got.flight.time_s, &got.flight.pressure_pa), (&sound.time_s, &sound.pressure_pa), "{name}");
        assert!(said(&got).contains(said_of_it), "{name}: {}", said(&got));
        assert_eq!(got.report.is_whole(), whole, "{name}");
    };
    same("backward", "run backward in time", true, &|mut l| {
        l[1..].reverse();
        l
    });
    same("doubled", "260 of 520 rows repeat a time", false, &|l| {
        l[..1].iter().cloned().chain(l[1..].iter().flat_map(|r| [r.clone(), r.clone()])).collect()
    });
    same("commas", "decimal commas", true, &|l| l.iter().map(|r| r.replace(',', ";").replace('.', ",")).collect());
    same("no-time", "3 of 263 rows have no time", false, &|mut l| {
        let undated: Vec<String> = l[5..8].iter().map(|r| format!("-9999,{}", r.split_once(',').expect("a comma").1)).collect();
        l.splice(9..9, undated);
        l
    });
    same("unset", "7 of 267 rows have no time", false, &|l| {
        let dated = l[1..].iter().map(|r| {
            let (t, rest) = r.split_once(',').expect("a comma");
            format!("{},{rest}", t.parse::<f64>().expect("a number") + START)
        });
        l[..8].iter().cloned().chain(dated).collect()
    });
    // Times that go back and on are of two logs: refused.
    let e = tidied("shuffled", |mut l| {
        l.swap(20, 60);
        l
    });
    assert!(e.is_err_and(|e| e.contains("must increase")));
}

#[test]
fn regress_values_of_a_table_that_stand_for_none_are_found() {
    for (column, name, fill) in [
        (1, "pressure_dbar", "9999"),
        (2, "m_pitch_rad", "-9999"),
        (3, "m_ballast_pumped_cc", "69696969"),
        (4, "sci_density_kg_m3", "-999"),
    ]
    .into_iter()
    .chain([(4, "sci_density_kg_m3", "0"), (5, "sci_water_temp_degC", "1e20"), (5, "sci_water_temp_degC", "-32768")])
    {
        let got = tidied(&format!("fill{column}"), |l| {
            let changed = |(k, row): (usize, String)| {
                let mut fields: Vec<&str> = row.split(',').collect();
                if k > 0 && k % 5 == 0 {
                    fields[column] = fill;
                }
                fields.join(",")
            };
            l.into_iter().enumerate().map(changed).collect()
        })
        .unwrap_or_else(|e| panic!("{name} {fill}: {e}"));
        assert!(said(&got).contains(&format!("52 of 260 values of {name} are")), "{name} {fill}: {}", said(&got));
        let f = &got.flight;
        let known = [&f.time_s, &f.pressure_pa, &f.pitch_rad, &f.ballast_m3, &f.density_kg_m3, &f.temperature_degc][column];
        assert_eq!(known.iter().filter(|v| v.is_finite()).count(), 208, "{name} {fill}");
    }
}

/// Files of `CYCLES` rows of one dive after another, each begun at its row of the whole; `of` changes a pressure of (file, row).
fn parts(name: &str, begin: &[usize], of: impl Fn(usize, usize, f64) -> f64) -> Imported {
    let folder = folder(name);
    for (file, first) in begin.iter().enumerate() {
        let mut columns = variables(USUAL);
        let row = |k: usize| first + k;
        columns[0].3 = (0..CYCLES).map(|k| START + 4.0 * row(k) as f64).collect();
        columns[1].3 = (0..CYCLES).map(|k| of(file, row(k), at(row(k)).0)).collect();
        columns[2].3 = (0..CYCLES).map(|k| 12.0 - 0.05 * at(row(k)).0).collect();
        columns[4].3 = (0..CYCLES).map(|k| at(row(k)).1).collect();
        columns[5].3 = (0..CYCLES).map(|k| at(row(k)).2).collect();
        netcdf(&folder.join(format!("part{file}.nc")), &["time"], &columns);
    }
    let got = import(&folder, &[]).expect("an import");
    std::fs::remove_dir_all(folder).ok();
    got
}

#[test]
fn regress_only_the_rows_that_two_files_share_are_left_out() {
    let truth = |rows: usize| (0..rows).map(|k| at(k).0 * 1e4).collect::<Vec<f64>>();
    let close = |got: &Imported, rows: usize| {
        assert_eq!(got.flight.len(), rows, "{}", said(got));
        let off = got.flight.pressure_pa.iter().zip(truth(rows)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1.0 && got.flight.time_s.iter().enumerate().all(|(k, t)| (t - 4.0 * k as f64).abs() < 1e-3), "{off}");
    };
    let sound = |_: usize, _: usize, dbar: f64| dbar;
    let got = parts("shared", &[0, CYCLES - 20, 2 * CYCLES - 21], sound);
    close(&got, 3 * CYCLES - 21);
    assert!(got.report.is_whole() && said(&got).contains("20 of 260 rows are held already"), "{}", said(&got));
    // A file that grows, sent twice.
    let got = parts("grown", &[0, 60], sound);
    close(&got, CYCLES + 60);
    assert!(got.report.is_whole(), "{}", said(&got));
    // Other values in the time of both: the first file's stay, and it is said.
    let got = parts("other", &[0, CYCLES - 20], |file, row, dbar| if file == 1 && row < CYCLES { dbar + 4.0 } else { dbar });
    close(&got, 2 * CYCLES - 20);
    assert!(got.report.left_out.iter().any(|l| l.contains("20 of 260 rows") && l.contains("4.0 dbar")), "{}", said(&got));
    // Mostly in the time of another file, with other values: of another glider.
    let got = parts("within", &[0, 60], |file, _, dbar| dbar + 4.0 * file as f64);
    assert_eq!(got.flight.len(), CYCLES);
    assert!(got.report.left_out.iter().any(|l| l.contains("part1.nc") && l.contains("left out")), "{}", said(&got));
}

#[test]
fn regress_fixes_of_a_second_file_count_from_its_own() {
    let folder = folder("origins");
    for file in 0..2 {
        let mut columns = variables(USUAL);
        columns[0].3.iter_mut().for_each(|t| *t += 3600.0 * f64::from(file));
        let fix = |k: usize, deg: f64| if k < 3 || k + 3 > CYCLES { deg + 0.001 * k as f64 } else { f64::NAN };
        for (name, unit, deg) in [("LATITUDE_GPS", "degrees_north", 54.0), ("LONGITUDE_GPS", "degrees_east", 15.0)] {
            columns.push((name, unit, "", (0..CYCLES).map(|k| fix(k, deg + 0.004 * f64::from(file))).collect()));
        }
        netcdf(&folder.join(format!("part{file}.nc")), &["time"], &columns);
    }
    let got = import(&folder, &[]).expect("an import");
    std::fs::remove_dir_all(folder).ok();
    let origins = &got.report.origins;
    assert_eq!(origins.len(), 2, "{origins:?}");
    assert!((origins[0].lat_deg - 54.0).abs() < 1e-9 && (origins[1].lat_deg - 54.004).abs() < 1e-9, "{origins:?}");
    let north = got.flight.gps_north_m[CYCLES + 2];
    assert!((north - 0.002 * 111_195.0).abs() < 1.0, "{north} m");
}

/// A file of the vehicle and one of the CTD with the same times and pressures were read once, and one half was gone.
#[test]
fn regress_files_with_the_same_rows_and_other_channels_fill_each_other() {
    let folder = folder("halves");
    let columns = variables(USUAL);
    let write = |name: &str, of: &[usize], edit: fn(&mut Vec<Variable>)| {
        let mut part: Vec<Variable> = of.iter().map(|k| columns[*k].clone()).collect();
        edit(&mut part);
        netcdf(&folder.join(name), &["time"], &part);
    };
    write("a_flight.nc", &[0, 1, 4, 5], |_| ());
    write("b_science.nc", &[0, 1, 2, 3], |_| ());
    let got = import(&folder, &[]).expect("an import");
    whole(&got);
    assert!(got.report.is_whole() && got.flight.len() == CYCLES, "{}", said(&got));
    assert!(
        said(&got).contains("read once; its temperature, density, practical_salinity are taken where there were none"),
        "{}",
        said(&got)
    );
    assert!(said(&got).contains("without m_pitch_rad, which the others have: b_science.nc"), "{}", said(&got));
    // Another salinity of the same rows is not read, and said.
    write("c_delayed.nc", &[0, 1, 2, 3], |part| part[3].3.iter_mut().for_each(|s| *s += 0.3));
    let got = import(&folder, &[]).expect("an import");
    assert!(
        got.report.left_out.iter().any(|l| l.contains("c_delayed.nc: its density, practical_salinity are others than")),
        "{}",
        said(&got)
    );
    std::fs::remove_dir_all(folder).ok();
}

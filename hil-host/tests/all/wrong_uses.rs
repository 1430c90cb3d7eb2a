//! What a person does wrong, and what the program says: exit code 2, the remedy in words, nothing written, no panic.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

struct Folder(PathBuf);

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Worlds and vehicles that a simulation cannot follow, and vehicle files of segments that the flight has not.
fn impossible(put: &dyn Fn(&str, &str), csv: &str, vehicle: &str) {
    put("ball.toml", "[vehicle]\ninertia_kg_m2 = 1.0\n");
    let aero = "reference_area_m2 = 0.1\naxial_m2 = 0.016\nhull_slope_m2 = 0.3\nwing_slope_m2 = 0.4\n\
        suction_m2 = 0.1\nseparation_m2 = 0.1\nhull_crossflow_m2 = 0.3\nwing_crossflow_m2 = 0.1\n\
        wing_stall_sin = 0.2\nwing_stalled_share = 0.3\nmoment_slope = 10\nmoment_zero = 0\n";
    put("damped.toml", &format!("[vehicle.aero]\n{aero}moment_rate = -1000.0\n"));
    let mut other: serde_json::Value = serde_json::from_str(vehicle).expect("a document");
    other["hydro"]["hull_lift_slope_per_rad"] = 50.into();
    other["hydro"]["hull_area_m2"] = 10.into();
    if let Some(hydro) = other["hydro"].as_object_mut() {
        hydro.remove("wide");
    }
    put("lifted/flight.csv", csv);
    put("lifted/vehicle.json", &other.to_string());
    for (name, key) in [("fitted", "fit"), ("checked", "check")] {
        let mut other: serde_json::Value = serde_json::from_str(vehicle).expect("a document");
        other["segments"] = serde_json::json!({key: [99]});
        put(&format!("{name}/flight.csv"), csv);
        put(&format!("{name}/vehicle.json"), &other.to_string());
    }
}

/// A folder with a flight of our own, and files that are wrong in one way each.
fn folder() -> Folder {
    let folder = Folder(std::env::temp_dir().join(format!("glider-wrong-{}", std::process::id())));
    let work = &folder.0;
    std::fs::create_dir_all(work).expect("a temporary folder");
    let out = glider(&["fly", "--mission", "shallow", "--log", "flight"], work);
    assert_eq!(out.0, 0, "{}", out.1);
    let put = |name: &str, text: &str| {
        let path = work.join(name);
        std::fs::create_dir_all(path.parent().expect("inside the folder")).expect("a folder");
        std::fs::write(path, text).expect(name);
    };
    let csv = std::fs::read_to_string(work.join("flight/flight.csv")).expect("flown above");
    let vehicle = std::fs::read_to_string(work.join("flight/vehicle.json")).expect("flown above");
    put("alone/flight.csv", &csv);
    put("empty/flight.csv", "");
    put("empty/vehicle.json", &vehicle);
    put("letters/flight.csv", &csv.replacen("0.0", "abc", 3));
    put("letters/vehicle.json", &vehicle);
    put("columns/flight.csv", "time_s,depth\n1,2\n");
    put("columns/vehicle.json", &vehicle);
    put("broken/flight.csv", &csv);
    put("broken/vehicle.json", "{\"mass_kg\": 60,");
    put("typo.toml", "[[leg]]\ndepht_max_m = 20\n");
    put("deep.toml", "[[leg]]\ndepth_max_m = 5000\n");
    put("strong.toml", "[[leg]]\nballast_cc = 900\n");
    put("truth.toml", "[ocean]\nbackground_rms = 1\n");
    put("effect.toml", "[[effects]]\nkind = \"climb_darg\"\nvalue = 1\n");
    put("config.toml", "crush_depht_m = 10\n");
    put("table.bin", "not a table");
    put("notes.txt", "nothing to fly");
    put("unit.toml", "[[leg]]\ndepth_max_m = \"20 m\"\n");
    put("percent.toml", "[[effects]]\nkind = \"stall\"\nvalue = \"40 %\"\n");
    put("kilograms/flight.csv", &csv);
    let first = vehicle.find("\"mass_kg\":").expect("a mass") + "\"mass_kg\":".len();
    let rest = vehicle[first..].trim_start_matches([' ', '.', '0', '1', '2', '3', '4', '5', '6', '7', '8', '9']);
    put("kilograms/vehicle.json", &format!("{} \"60 kg\"{rest}", &vehicle[..first]));
    impossible(&put, &csv, &vehicle);
    // Cut in the middle, as by a full disk or a lost line.
    put("cut/flight.csv", &csv[..csv.len() / 2]);
    put("cut/vehicle.json", &vehicle[..vehicle.len() / 2]);
    put("header/flight.csv", &csv[..40]);
    put("header/vehicle.json", &vehicle);
    assert_eq!(glider(&["export", "flight", "--to", "netcdf", "--out", "whole.nc"], work).0, 0);
    let whole = std::fs::read(work.join("whole.nc")).expect("written above");
    std::fs::write(work.join("cut.nc"), &whole[..whole.len() / 3]).expect("a cut file");
    // A file of one kind named in place of another.
    put("row/flight.csv", &csv.lines().take(2).collect::<Vec<_>>().join("\n"));
    put("row/vehicle.json", &vehicle);
    put("both/flight.csv", &csv);
    put("both/vehicle.json", &vehicle);
    put("both/vehicle.toml", include_str!("../../../vehicles/comet.toml"));
    put("again/flight.csv", &format!("# the same rows once more\n{csv}"));
    put("again/vehicle.json", &vehicle);
    put("twice/flight.csv", &csv.replacen("m_roll_rad", "m_pitch_rad", 1));
    put("twice/vehicle.json", &vehicle);
    let mut heavy: serde_json::Value = serde_json::from_str(&vehicle).expect("JSON");
    heavy["mass_kg"] = (1.1 * heavy["mass_kg"].as_f64().expect("a mass")).into();
    let mut dry: serde_json::Value = serde_json::from_str(&vehicle).expect("JSON");
    dry["water_depth_m"] = serde_json::Value::Null;
    put("dry/flight.csv", &csv);
    put("dry/vehicle.json", &dry.to_string());
    put("heavy/flight.csv", &csv.lines().take(csv.lines().count() / 2).collect::<Vec<_>>().join("\n"));
    put("heavy/vehicle.json", &heavy.to_string());
    put("rail/flight.csv", &csv.lines().take(99).collect::<Vec<_>>().join("\n"));
    put("rail/vehicle.json", &vehicle.replace("\"standard\"", "\"low_ar\""));
    put("slip.json", &vehicle.replace("\"sensors\":", "\"sensor\":"));
    std::fs::write(work.join("wide.json"), vehicle.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>()).expect("a file");
    put("packed.csv.gz", "");
    put("mission.json", "{\"leg\": [{\"depth_max_m\": 20}]}");
    put("vehicle.toml", &vehicle);
    put("hidden.toml", "[[effects]]\nkind = \"stall\"\nvalue = 0.2\n");
    put("no_size.toml", "[[effects]]\nkind = \"stall\"\n");
    put("negative.toml", "[[leg]]\ndepth_max_m = -20\n");
    put("legs.toml", "[[legs]]\ndepth_max_m = 20\n");
    put("no_legs.toml", "wings = \"standard\"\n");
    put("huge.toml", "[[effects]]\nkind = \"stall\"\nvalue = 40\n");
    assert_eq!(glider(&["table", "--out", "table"], work).0, 0);
    let table = std::fs::read(work.join("table/standard.bin")).expect("written above");
    std::fs::write(work.join("cut.bin"), &table[..table.len() / 2]).expect("a cut file");
    folder
}

/// Exit code, and all that was printed.
fn glider(args: &[&str], work: &Path) -> (i32, String) {
    let out = Command::new(env!("CARGO_BIN_EXE_glider")).args(args).current_dir(work).stdin(Stdio::null()).output().expect("it starts");
    let text = String::from_utf8_lossy(&out.stdout).into_owned() + &String::from_utf8_lossy(&out.stderr);
    (out.status.code().unwrap_or(-1), text)
}

/// The command line, and what the answer must say.
const WRONG: &[(&str, &[&str])] = &[
    // names
    ("daignose --flight flight", &["diagnose"]),
    ("nextflight --flight flight", &["next-flight"]),
    ("list efects", &["effects"]),
    ("list effects climb_darg", &["climb_drag"]),
    ("list faults depth", &["list effects NAME"]),
    ("add climb_darg --flight flight", &["climb_drag", "glider list effects"]),
    ("add stall,stall --flight flight", &["twice"]),
    ("add --flight flight", &["EFFECT"]),
    ("add cd+=k*alfa --flight flight", &["did you mean `alpha`?", "There are alpha, U, roll"]),
    ("add vertical_current --flight dry", &["dry/vehicle.json: water_depth_m", "vertical_current moves the water"]),
    ("fly --wings low", &["standard or low-ar"]),
    ("fly --mission shalow", &["shallow"]),
    ("fly --mission notes.txt", &["notes.txt:1"]),
    ("fly --seat qmeu", &["qemu"]),
    ("fly --seat in_process", &["in-process"]),
    ("fly --controller their", &["ours", "stock"]),
    ("fly --controller stock --seat pty", &["in-process only"]),
    ("fly --fault depht:stuck", &["depth"]),
    ("fly --fault depth:broken", &["stuck"]),
    ("fly --fault depth", &["target:kind"]),
    ("fly --fault depth:stuck@diving", &["inflect_low"]),
    ("fly --fault depth:bias=nan", &["finite"]),
    ("polar --wings big", &["standard", "low-ar"]),
    ("plot residul --flight flight --out r.svg", &["residual"]),
    ("scorecard discvery", &["discovery"]),
    // paths
    ("compare --flight fligth", &["no such flight", "did you mean `flight`"]),
    ("diagnose --flight nowhere/at/all", &["no such flight"]),
    ("compare --flight flight --vehicle flight/vehicel.json", &["did you mean `vehicle.json`"]),
    ("compare --flight alone", &["--vehicle"]),
    ("compare --flight notes.txt --vehicle flight/vehicle.json", &["notes.txt"]),
    ("fly --mission mising.toml", &["no such mission file", "shallow, sea, deep, sweep"]),
    ("fly --truth missing.toml", &["missing.toml"]),
    ("fly --table missing.bin", &["missing.bin"]),
    ("fly --config missing.toml", &["missing.toml"]),
    ("fly --world nowhere.json", &["nowhere.json"]),
    ("import nowhere.dbd --out x", &["nowhere.dbd"]),
    ("import notes.txt --out x", &["notes.txt"]),
    ("export flight --to xls --out flight.xls", &["parquet"]),
    ("polar --vehicle slocum-low", &["slocum-low-ar"]),
    ("table --vehicle nothing.toml", &["nothing.toml"]),
    ("serve --flight nowhere --port 0", &["nowhere"]),
    ("monitor /dev/no-such-port", &["/dev/no-such-port"]),
    ("upload /dev/no-such-port table table.bin", &["table"]),
    // what files say
    ("fly --truth ball.toml", &["ball.toml", "vehicle.inertia_kg_m2 is 1, less than a ball"]),
    ("fly --truth damped.toml", &["diverged at", "aero.moment_rate = -1000"]),
    ("compare --flight lifted", &["lifted/vehicle.json: no vehicle has", "hydro.hull_lift_slope_per_rad"]),
    ("plot residual --flight lifted --out r.svg", &["no vehicle has"]),
    ("export lifted --to netcdf --out lifted.nc", &["no vehicle has"]),
    ("diagnose --flight fitted", &["fitted/vehicle.json: segments.fit is [99]", "fitted, which has 0"]),
    ("compare --flight checked", &["checked/vehicle.json: segments.check is [99]", "checked, which has 0"]),
    ("compare --flight empty", &["flight.csv"]),
    ("compare --flight letters", &["flight.csv", "abc"]),
    ("compare --flight columns", &["pressure"]),
    ("compare --flight broken", &["vehicle.json", "line"]),
    ("fly --mission typo.toml", &["typo.toml:2:1", "depth_max_m"]),
    ("fly --mission deep.toml", &["working depth"]),
    ("fly --mission strong.toml", &["pump"]),
    ("fly --truth truth.toml", &["background_rms_m_s"]),
    ("fly --truth effect.toml", &["climb_drag"]),
    ("fly --config config.toml", &["crush_depth_m"]),
    ("fly --table table.bin", &["table"]),
    // numbers and combinations
    ("fly --realtime 0", &["a number from 0.001"]),
    ("fly --seed=-1", &["seed"]),
    ("fly --beside table.bin", &["--table"]),
    ("fly --world flight --truth truth.toml", &["cannot be used with"]),
    ("fly --log flight", &["flight"]),
    ("diagnose --flight flight --depth 4", &["2..=3"]),
    ("serve --port 99999", &["port"]),
    ("plot polar --out polar.eps", &[".svg", ".pdf"]),
    ("plot polar --out polar", &["ending"]),
    ("plot residual --out r.svg", &["--flight"]),
    ("plot flight --flight flight --before flight/vehicle.json --out r.svg", &["--before belongs to a residual"]),
    ("plot polar --flight flight --out p.svg", &["leave out --flight"]),
    ("next-flight --flight flight --out", &["--out"]),
    ("calibrate --out v2.json", &["--flight"]),
    ("calibrate --flight flight", &["--out"]),
    ("calibrate --flight flight --free drag --out v2.json", &["no such number", "cd0"]),
    ("calibrate --flight flight --flight flight --out v2.json", &["the same log", "once"]),
    ("calibrate --flight flight --flight again --out v2.json", &["the same log", "once"]),
    ("calibrate --flight flight --flight heavy --out v2.json", &["weighs", "name it with --vehicle"]),
    ("calibrate --flight flight --flight rail --out v2.json", &["rail/vehicle.json has low-ar wings", "one wing set"]),
    ("calibrate --flight alone --out v2.json", &["--vehicle"]),
    ("calibrate --flight flight --out flight/vehicle.json", &["--out"]),
    ("calibrate --flight flight --out v2.txt", &[".json or .toml"]),
    ("timeline flight", &["--vehicle"]),
    ("timeline fligth --vehicle flight/vehicle.json", &["no such flight", "did you mean `flight`"]),
    ("timeline flight --vehicle nowhere.json", &["glider calibrate"]),
    ("timeline flight --vehicle flight/vehicle.json --out t.txt", &[".svg"]),
    ("timeline flight --vehicle flight/vehicle.json --dives-per-alarm 0", &["1000 is usual"]),
    ("fleet flight", &["--out"]),
    ("fleet fligth --out f.parquet", &["no such", "did you mean `flight`"]),
    ("fleet alone --out f.parquet", &["--vehicle"]),
    ("fleet flight --out f.csv", &[".parquet"]),
    ("fleet flight --vehicle nowhere.json --out f.parquet", &["glider calibrate"]),
    ("fleet flight --shard 3/2 --out f.parquet", &["2/8"]),
    ("fleet flight --false-names 2 --out f.parquet", &["0.05 is usual"]),
    ("fleet merge flight/flight.csv", &["flight.csv", "Parquet"]),
    ("fleet merge nothing.parquet", &["no such file"]),
    ("scorecard timeline --only drg", &["drag", "leak"]),
    ("faults --shard 3/2 --out p.json", &["2/8"]),
    ("faults --shard 2/3", &["--out part2.json"]),
    ("faults --shard 2/3 --out p.txt", &[".json"]),
    ("faults --bus 9 --resume", &["--shard, --resume and --cache"]),
    ("faults --seat pty --shard 2/3 --out p.json", &["in this process"]),
    ("faults --sample 9 merge p.json", &["stands after it"]),
    ("faults merge nothing.json", &["no such file"]),
    ("faults merge flight/vehicle.json", &["vehicle.json", "no part of a campaign", "--shard I/N"]),
    ("scorecard merge flight/flight.csv", &["flight.csv", "line 1, column"]),
    ("--jsn", &["--json"]),
    // cannot be written: a file stands where a folder should
    ("plot polar --out notes.txt/p.svg", &["notes.txt"]),
    ("plot polar --out notes.txt/p.pdf", &["notes.txt"]),
    ("report --flight flight --out notes.txt/r.html", &["notes.txt"]),
    ("fly --log notes.txt/log", &["notes.txt"]),
    ("export flight --to csv --out notes.txt/f.csv", &["notes.txt"]),
    ("table --out notes.txt/table", &["notes.txt"]),
    ("polar --out notes.txt/polar", &["notes.txt"]),
    ("import whole.nc --out notes.txt/x", &["notes.txt"]),
    ("diagnose --quick --flight flight --predict notes.txt/p.csv", &["notes.txt"]),
    // with a wrong unit, or one too many
    ("fly --mission unit.toml", &["unit.toml:2:15", "20 m", "a number"]),
    ("fly --truth percent.toml", &["percent.toml:3:9", "a number"]),
    ("compare --flight kilograms", &["vehicle.json", "mass_kg"]),
    ("fly --realtime 10x", &["--realtime"]),
    ("fly --seed 1e3", &["seed"]),
    ("plot polar --width 8cm --out p.svg", &["column (84 mm)", "mm"]),
    ("plot polar --width 20 --out p.svg", &["from 60"]),
    ("plot polar --height 60 --out p.svg", &["--width"]),
    // cut in the middle
    ("compare --flight cut", &["flight.csv, line", "cut off"]),
    ("compare --flight cut --vehicle flight/vehicle.json", &["flight.csv"]),
    ("compare --flight header", &["flight.csv"]),
    ("import cut.nc --out x", &["cut.nc"]),
    ("fly --table cut.bin", &["cut.bin"]),
    // a file of another kind
    ("compare --flight flight/vehicle.json", &["is a vehicle file", "expected is a flight"]),
    ("compare --flight flight/mission.toml", &["is a mission file", "expected is a flight"]),
    ("compare --flight flight --vehicle flight/mission.toml", &["is a mission file", "glider list vehicles"]),
    ("compare --flight flight --vehicle flight/flight.csv", &["is a csv", "expected is a vehicle file"]),
    ("compare --flight flight --vehicle flight", &["is the folder of a flight", "did you mean `flight/vehicle.json`"]),
    ("diagnose --flight flight --vehicle slocum-standrd", &["no such vehicle file", "did you mean `slocum-standard`"]),
    ("compare --flight flight --vehicle slocum_low_ar", &["did you mean `slocum-low-ar`", "glider calibrate"]),
    ("compare --flight flight --vehicle elsewhere/slocum-standard.toml", &["no such vehicle file"]),
    ("report --flight flight --vehicle seaglider", &["is a class", "glider import LOG --class seaglider"]),
    ("fleet flight --vehicle paper-standrd --out f.parquet", &["did you mean `paper-standard`"]),
    ("polar --vehicle flight", &["is the folder of a flight", "flight/vehicle.json"]),
    ("polar --vehicle flight/mission.toml", &["is a mission file"]),
    ("table --vehicle hidden.toml", &["is a truth file"]),
    ("table --vehicle slocum-standrd", &["did you mean `slocum-standard`"]),
    ("fly --mission mission.json", &["is a JSON file", "TOML with [[leg]]"]),
    ("fly --mission flight", &["is the folder of a flight", "mission file"]),
    ("fly --mission flight/vehicle.json", &["is a vehicle file", "mission file"]),
    ("fly --mission flight/flight.csv", &["is a csv"]),
    ("fly --mission hidden.toml", &["is a truth file"]),
    ("fly --truth flight/mission.toml", &["is a mission file", "docs/truth-file.md"]),
    ("fly --truth flight", &["is the folder of a flight"]),
    ("fly --truth effet.toml", &["no such truth file", "did you mean `effect.toml`"]),
    ("fly --table flight", &["is the folder of a flight", "glider table"]),
    ("fly --table flight/flight.csv", &["is a csv", "glider table"]),
    ("fly --table flight/mission.toml", &["is a mission file"]),
    ("fly --table table/standrd.bin", &["did you mean `standard.bin`"]),
    ("fly --wings low-ar --table table/standard.bin", &["other wing set"]),
    ("fly --config flight/mission.toml", &["is a mission file", "controller configuration"]),
    ("fly --world flight/mission.toml", &["is a mission file"]),
    ("fly --seat qemu --elf flight/vehicle.json", &["is a vehicle file", "firmware image"]),
    ("fly --seat qemu --elf notes.txt", &["no firmware image"]),
    ("fly --seat flight", &["is a directory", "in-process"]),
    ("fly --seat COM3", &["no such file", "in-process"]),
    ("compare --flight whole.nc --vehicle flight/vehicle.json", &["is a NetCDF file", "glider import"]),
    ("export flight/vehicle.json --to csv", &["is a vehicle file"]),
    ("export fligth --to csv", &["no such flight", "did you mean `flight`"]),
    ("import flight/vehicle.json --out x", &["of no known kind"]),
    ("import flight/mission.toml --out x", &["of no known kind"]),
    ("import empty/flight.csv --out x", &["is empty"]),
    ("import row/flight.csv --out x", &["only 1 value"]),
    ("import flight/flight.csv --out flight", &["nothing is overwritten"]),
    ("import flight/flight.csv --out flight --force", &["is or holds flight/flight.csv", "another folder"]),
    ("import flight --out flight --force", &["is or holds flight", "another folder"]),
    ("import alone/flight.csv --out flight --force", &["holds", "mission.toml", "which would be lost"]),
    ("import alone/flight.csv --out kilograms --force", &["has no import.json"]),
    ("import alone/flight.csv --out notes.txt --force", &["is a file"]),
    ("import alone/flight.csv --out broken", &["nothing is overwritten", "--force"]),
    ("import alone/flight.csv cut/flight.csv --out x", &["one csv is one flight"]),
    ("import packed.csv.gz --out x", &["gunzip it first"]),
    ("import /dev/zero --out x", &["is no regular file"]),
    ("compare --flight both", &["both/vehicle.json: lies beside both/vehicle.toml", "--vehicle"]),
    ("import both --out x", &["both/vehicle.json: lies beside both/vehicle.toml", "--vehicle"]),
    ("fleet both --out f.parquet", &["both/vehicle.json: lies beside", "--vehicle"]),
    ("compare --flight flight --vehicle wide.json", &["wide.json: is UTF-16", "save it as UTF-8"]),
    ("compare --flight flight --vehicle slip.json", &["slip.json, line", "did you mean `sensors`?"]),
    ("serve --flight flight/vehicle.json --port 0", &["is a vehicle file"]),
    ("serve --flight alone --port 0", &["no vehicle.json"]),
    ("serve --flight cut --port 0", &["flight.csv, line"]),
    ("monitor flight/flight.csv", &["is a file", "serial port"]),
    ("monitor table.bin", &["is a file", "serial port"]),
    ("fly --mission see", &["did you mean `sea`?"]),
    ("upload /dev/no-such-port table-standard flight/vehicle.json", &["is a vehicle file", "glider table"]),
    ("upload /dev/no-such-port table-standard table.bin", &["table.bin", "glider table"]),
    ("upload /dev/no-such-port config flight/mission.toml", &["is a mission file"]),
    ("upload /dev/no-such-port tabel table.bin", &["table-standard"]),
    ("launch --mission shallow /dev/no-such-port", &["/dev/no-such-port"]),
    ("launch /dev/no-such-port", &["--mission"]),
    ("autopsy flight/vehicle.json", &["no record of a board"]),
    ("autopsy nothing.bin", &["nothing.bin"]),
    // an output that is an input, or somebody's
    ("loop --out flight", &["holds a flight"]),
    ("loop --flight flight --out flight", &["holds a flight"]),
    ("add stall --flight flight --out flight/vehicle.json --force", &["belongs to the flight"]),
    ("report --flight flight --out flight/flight.csv --force", &["belongs to the flight"]),
    ("plot flight --flight flight --out flight/flight.csv --force", &["belongs to the flight"]),
    ("export flight --to csv --out flight/flight.csv --force", &["belongs to the flight"]),
    ("next-flight --flight flight --out flight/mission.toml", &["exists", "--force"]),
    ("diagnose --flight flight --predict flight/flight.csv --force", &["belongs to the flight"]),
    ("add stall --flight flight --out flight", &["is an input of this command"]),
    // cannot be written at all
    ("plot polar --out /proc/p.svg", &["cannot write /proc/p.svg"]),
    ("fly --log /proc/x", &["/proc/x: cannot create"]),
    ("import flight/flight.csv --out /proc/x", &["cannot write /proc/x"]),
    ("table --out /proc/x", &["/proc/x: cannot make"]),
    ("loop --out /proc/x", &["/proc/x: cannot make"]),
    // empty, or of one row
    ("compare --flight row", &["only 1 value"]),
    ("diagnose --flight row", &["only 1 value"]),
    ("calibrate --flight row --out v2.json", &["only 1 value"]),
    // missions and truths that cannot be
    ("fly --mission negative.toml", &["negative.toml:2:15", "outside"]),
    ("fly --mission legs.toml", &["legs.toml:1:3", "did you mean `leg`"]),
    ("fly --mission no_legs.toml", &["no [[leg]]"]),
    ("fly --mission Sweep", &["did you mean `sweep`"]),
    ("fly --truth no_size.toml", &["no_size.toml:1:1", "`value`"]),
    ("fly --truth huge.toml", &["huge.toml:3:9", "within"]),
    ("power --mission sweeep", &["did you mean `sweep`"]),
    // as a newcomer guesses
    ("compare flight", &["glider compare --flight flight"]),
    ("diagnose flight", &["glider diagnose --flight flight"]),
    ("report flight", &["glider report --flight flight"]),
    ("effects", &["list effects"]),
    ("mission", &["list missions"]),
    ("list vehicles slocum", &["list effects NAME"]),
    ("diagnose --flight", &["--flight"]),
    ("diagnose", &["--flight"]),
    ("plot polar", &["--out"]),
    ("export flight --to nc", &["netcdf"]),
    ("completions basch", &["bash"]),
    ("serve --port abc", &["--port"]),
    ("fly --fault hull:leek", &["leak"]),
    ("fly --fault hull:leak@dive+abc", &["120s"]),
    ("loop --flight fligth", &["no such flight", "did you mean `flight`"]),
    ("scorecard real --flights nowhere", &["nowhere"]),
    // more that a newcomer tries
    ("fly shallow", &["glider fly --mission shallow"]),
    ("fly --effect stall=0.2", &["--truth", "docs/truth-file.md"]),
    ("fly --misson sweep", &["--mission"]),
    ("fly --mission shallow --log flight/flight.csv", &["cannot create this log directory"]),
    ("fly --fault depth:stuck@dive+-5s", &["120s"]),
    ("polar --effect stal=0.1", &["did you mean `stall`", "glider list effects"]),
    ("polar --effect stall", &["NAME=SIZE", "stall=0.1"]),
    ("polar --effect stall=abc", &["not a number"]),
    ("compare --flight flight --test fligth", &["no such flight", "did you mean `flight`"]),
    ("compare --flight flight --test flight", &["the same rows as --flight flight"]),
    ("compare --flight flight --test again", &["the same rows as --flight flight"]),
    ("compare --flight twice", &["flight.csv, line 1, column m_pitch_rad", "stands twice"]),
    ("export flight --to csv --start 1800-01-01T00:00:00Z --out s.csv", &["--start 1800", "between 1990"]),
    ("export flight --to csv --start 9999 --out s.csv", &["date of the first row", "the log spans 0 to "]),
    ("export flight --to csv --start yesterday --out s.csv", &["--start yesterday", "2026-05-02"]),
    ("compare --flight flight --test flight/vehicle.json", &["is a vehicle file", "expected is a flight"]),
    ("import flight/flight.csv --class slocum200 --out x", &["did you mean `slocum-200`"]),
    ("import alone --out notes.txt/x --class seglider", &["did you mean `seaglider`"]),
    ("add stall --flight flight --out v.csv", &[".json or .toml"]),
    ("report --flight flight --out r.pdf", &[".html"]),
    ("next-flight --flight flight --out next.json", &[".toml"]),
    ("list vehicle slocum", &["vehicles"]),
    ("table --vehicle flight/vehicle.json --vehicle flight/vehicle.json", &["one per wing set"]),
    ("surfacing notes.txt", &["no messages of a surfacing"]),
    ("faults --sample abc", &["--sample"]),
    ("fly --table nowhere-sea --mission shallow", &["no such table"]),
    ("scorecard discovery --cases 0", &["--cases", "at least 1"]),
    ("faults --healthy 0", &["--healthy"]),
    ("faults --sample 0", &["--sample", "at least 1"]),
    ("surfacing flight/flight.csv", &["is a csv", ".srf"]),
    ("replay flight --watch est_depth_m", &["--at", "--step"]),
    ("replay flight --at 10 --cycles 0", &["--cycles", "at least 1"]),
    ("margins --out notes.txt", &["is a file", "name a folder"]),
    ("replay flight --at nan", &["--at NaN", "the last cycle"]),
    ("replay flight --at 1e9", &["--at 1000000000", "the last cycle"]),
    ("history none.history", &["no such history", "glider calibrate"]),
    ("history flight/vehicle.json", &["no head of a history", "glider calibrate"]),
    ("compare --flight broken", &["vehicle.json, line 1, column 15: EOF"]),
    // watched
    ("monitor alone/..", &["no flight is logged", "glider fly"]),
    ("monitor flight --log x", &["serial port"]),
    ("monitor flight --flight-log x", &["serial port"]),
];

#[test]
fn a_port_that_is_taken_is_named_with_the_way_out() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("bound").port().to_string();
    let (code, text) = glider(&["serve", "--port", &port], &std::env::temp_dir());
    assert!(code == 2 && text.contains(&port) && text.contains("--port"), "{code}: {text}");
    // A port that is not there is no reason to speak of seats where there are none.
    let (code, text) = glider(&["monitor", "/dev/no-such-port"], &std::env::temp_dir());
    assert!(code == 2 && !text.contains("--seat"), "{code}: {text}");
}

/// A line that is silent for a minute is waited for in words: what for, how long, and at which speed, at once.
#[test]
fn a_backseat_that_does_not_speak_is_waited_for_in_words() {
    let (_other, port) = serialport::TTYPort::pair().expect("a pseudo-terminal");
    let name = serialport::SerialPort::name(&port).expect("its name");
    let line = ["fly", "--seat", &name, "--extctl", "--mission", "shallow"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_glider"))
        .args(line)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut said = std::io::BufReader::new(child.stderr.take().expect("piped"));
    let mut text = String::new();
    while !text.contains("Ctrl-C") && std::io::BufRead::read_line(&mut said, &mut text).is_ok_and(|n| n > 0) {}
    let waits = child.try_wait().expect("our own child").is_none();
    child.kill().expect("it was waiting");
    let _ = child.wait();
    assert!(text.contains(&name) && text.contains("60 s") && text.contains("9600 baud"), "{text}");
    assert!(waits, "said before it gives up");
    assert!(text.lines().all(|l| l.chars().count() <= 80), "{text}");
}

#[test]
fn every_wrong_use_is_answered_with_the_remedy_and_exit_code_2() {
    let folder = folder();
    let before = listing(&folder.0);
    let mut bad = String::new();
    for (line, says) in WRONG {
        let args: Vec<&str> = line.split_whitespace().collect();
        let (code, text) = glider(&args, &folder.0);
        let missing: Vec<&&str> = says.iter().filter(|s| !text.contains(**s)).collect();
        if code != 2 || !missing.is_empty() || text.contains("panicked") {
            bad += &format!("glider {line}\n  exit code {code}, without {missing:?}:\n  {}\n", text.trim().replace('\n', "\n  "));
        }
    }
    assert!(bad.is_empty(), "{bad}");
    assert_eq!(before, listing(&folder.0), "nothing was written");
}

/// Every file below a folder, with its length.
fn listing(folder: &Path) -> Vec<(PathBuf, u64)> {
    let mut out = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() { out.extend(listing(&path)) } else { out.push((path.clone(), std::fs::metadata(&path).map_or(0, |m| m.len()))) }
    }
    out.sort();
    out
}

#[test]
fn an_error_under_json_is_one_json_document() {
    let work = std::env::temp_dir();
    for line in ["compare --flight nowhere-at-all --json", "compare --flihgt x --json", "fly --json --wings low"] {
        let args: Vec<&str> = line.split_whitespace().collect();
        let out = Command::new(env!("CARGO_BIN_EXE_glider")).args(&args).current_dir(&work).output().expect("it starts");
        let answer: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap_or_else(|e| panic!("{line}: {e}"));
        assert!(answer["error"].as_str().is_some_and(|e| !e.is_empty()) && answer["exit_code"] == 2, "{line}: {answer}");
        assert_eq!(out.status.code(), Some(2), "{line}");
    }
}

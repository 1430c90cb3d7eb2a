//! `glider upload` and `glider monitor` against a board behind a terminal: a
//! controller with a flash part, and the image in QEMU.

use control::{Config, Settings};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use helm::{Boot, Helm, Vault};
use plant::World;
use rig::flight::board_log::Image;
use rig::flight::closed_loop::{Setup, fly};
use rig::flight::onboard_log::{self, Wanted};
use rig::flight::{mission_file, utc, worlds};
use rig::seats::clock;
use rig::seats::port::Port;
use rig::seats::pty::Terminal;
use rig::seats::qemu::{self, Qemu};
use rig::seats::{Link, Seat};
use serde_json::Value;
use signals::link::MAX_WIRE;
use signals::{Phase, encode};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex};
use std::time::Instant;

const SECTOR: usize = 4096;

/// 1 MiB of NOR flash in memory that outlives its driver.
#[derive(Clone)]
struct Part(Arc<Mutex<Vec<u8>>>);

#[derive(Debug)]
struct Never;

impl NorFlashError for Never {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Part {
    type Error = Never;
}

impl ReadNorFlash for Part {
    const READ_SIZE: usize = 1;
    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Never> {
        let at = offset as usize;
        bytes.copy_from_slice(&self.0.lock().unwrap()[at..at + bytes.len()]);
        Ok(())
    }
    fn capacity(&self) -> usize {
        self.0.lock().unwrap().len()
    }
}

impl NorFlash for Part {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SECTOR;
    fn erase(&mut self, from: u32, to: u32) -> Result<(), Never> {
        self.0.lock().unwrap()[from as usize..to as usize].fill(0xff);
        Ok(())
    }
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Never> {
        let mut all = self.0.lock().unwrap();
        all.iter_mut().skip(offset as usize).zip(bytes).for_each(|(to, from)| *to &= from);
        Ok(())
    }
}

type Shared = Arc<Mutex<Helm<Vault<Part>>>>;

/// A board with its log flash, behind a terminal: marks, answers and logs as the image's loop does.
fn served(sectors: usize) -> (Terminal, Part, Shared) {
    let part = Part(Arc::new(Mutex::new(vec![0xff; sectors * SECTOR])));
    let mut vault = Vault::new();
    vault.attach(part.clone());
    let shared = Arc::new(Mutex::new(Helm::new(Config::default(), Boot::default(), vault)));
    let (helm, started) = (Arc::clone(&shared), Instant::now());
    let terminal = Terminal::serve(move |bytes, out| {
        let mut helm = helm.lock().unwrap();
        helm.utc.tick(started.elapsed().as_millis() as u64);
        for byte in bytes {
            let Some(answer) = helm.byte(*byte) else { continue };
            helm.keep_mark();
            let mut wire = [0u8; MAX_WIRE];
            let n = encode(&answer, &mut wire).unwrap();
            out.extend_from_slice(&wire[..n]);
            helm.keep_log();
        }
    });
    (terminal.unwrap(), part, shared)
}

fn board(sectors: usize) -> (Terminal, Part) {
    let (terminal, part, _) = served(sectors);
    (terminal, part)
}

fn scratch(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("glider-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// The program, beside the one that tests it.
fn program() -> PathBuf {
    let mut exe = std::env::current_exe().unwrap();
    exe.pop();
    exe.pop();
    exe.join("glider")
}

/// Runs the program; its JSON.
fn glider(args: &[&str]) -> Value {
    let out = Command::new(program()).args(args).arg("--json").output().expect("build it with cargo build -p hil-host");
    assert!(out.status.success(), "glider {args:?}: {}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap()
}

/// The same where a document a line comes until the end: the last one.
fn last_document(args: &[&str]) -> Value {
    let out = Command::new(program()).args(args).arg("--json").output().expect("it starts");
    assert!(out.status.success(), "glider {args:?}: {}", String::from_utf8_lossy(&out.stderr));
    let text = String::from_utf8(out.stdout).unwrap();
    let documents: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    documents.last().unwrap().clone()
}

#[test]
fn hil_objects_are_uploaded_read_back_and_rolled_back_by_the_command() {
    let (terminal, _) = board(64);
    let folder = scratch("upload");
    let file = |name: &str, text: &[u8]| {
        let path = folder.join(name);
        std::fs::write(&path, text).unwrap();
        path.to_string_lossy().into_owned()
    };
    let built_in = glider(&["upload", &terminal.name, "config", "--read"]);
    assert!(built_in["content"].as_str().unwrap().contains("crush_depth_m = 250.0"));

    let first = file("a.toml", b"vehicle = \"slocum-100\"\n");
    let second = file("b.toml", b"crush_depth_m = 240\n");
    for name in [&first, &second] {
        let said = glider(&["upload", &terminal.name, "config", name]);
        assert_eq!((&said["kept_on_flash"], &said["crc"]), (&Value::Bool(true), &said["in_use_crc"]), "{said}");
    }
    let read = |object| glider(&["upload", &terminal.name, object, "--read"])["content"].as_str().map(str::to_owned);
    assert!(read("config").unwrap().contains("crush_depth_m = 240.0"));
    // A mission is judged by the board's configuration: 150 m is too deep for the vehicle of the first one only.
    let mission = file("m.toml", b"[[leg]]\ndives = 2\ndepth_max_m = 150\n");
    assert_eq!(glider(&["upload", &terminal.name, "mission", &mission])["kept_on_flash"], true);
    assert!(read("mission").unwrap().contains("150"));
    assert_eq!(glider(&["upload", &terminal.name, "config", "--rollback"])["rolled_back"], true);
    let back = read("config").unwrap();
    assert_eq!(back, rig::flight::config_file::write(&Config::new(Settings::slocum_100()).unwrap()).unwrap());

    let table = file("t.bin", polar::generated::LOW_ASPECT_RATIO);
    assert_eq!(glider(&["upload", &terminal.name, "table-low-ar", &table])["bytes"], polar::generated::LOW_ASPECT_RATIO.len());
    let copy = folder.join("copy.bin").to_string_lossy().into_owned();
    glider(&["upload", &terminal.name, "table-low-ar", &copy, "--read"]);
    assert_eq!(std::fs::read(&copy).unwrap(), polar::generated::LOW_ASPECT_RATIO);
}

/// Three healthy flights make the history that the command stores; a flight with half as much drag again departs from it, one without
/// does not, and `diagnose` says the same of their messages.
#[test]
fn hil_an_uploaded_history_raises_the_flag_after_a_drag_change() {
    let folder = scratch("departs");
    let path = |name: &str| folder.join(name).to_string_lossy().into_owned();
    let file = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.join(name), bytes).unwrap();
        path(name)
    };
    // The board reckons pressure with this density.
    let truth = file("truth.toml", b"[sensors]\ndepth_density_kg_m3 = 1025.0\n");
    let mut calibrate = vec!["calibrate".to_owned(), "--one-deployment".into(), "--out".into(), path("known.json")];
    for seed in ["1", "2", "3"] {
        glider(&["fly", "--mission", "sea", "--seed", seed, "--truth", &truth, "--log", &path(seed)]);
        calibrate.extend(["--flight".into(), path(seed)]);
    }
    glider(&calibrate.iter().map(String::as_str).collect::<Vec<_>>());
    let mut setup = Setup::new(mission_file::built_in("sea").unwrap());
    let built_in = file("built-in.toml", rig::flight::config_file::write(&setup.config).unwrap().as_bytes());
    // The board judges by the hull of the vehicle file.
    let c = logs::vehicle::read(&folder.join("known.json")).unwrap().constants;
    let hull = control::config::Hull {
        mass_kg: c.mass_kg as f32,
        volume_m3: c.hull_volume_m3 as f32,
        compressibility_per_pa: c.compressibility_per_pa as f32,
        expansion_per_k: c.thermal_expansion_per_k as f32,
        reference_degc: c.reference_temperature_degc as f32,
    };
    setup.config = Config::new(Settings { hull, ..*setup.config.settings() }).unwrap();
    let config = file("config.toml", rig::flight::config_file::write(&setup.config).unwrap().as_bytes());

    for (drag, departs) in [(0.0, false), (0.5, true)] {
        let (terminal, _, helm) = served(64);
        let history = ["upload", &terminal.name, "history", &path("known.history")];
        glider(&["upload", &terminal.name, "config", &built_in]);
        let refused = Command::new(program()).args(history).output().unwrap();
        let words = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(refused.status.code() == Some(2) && words.contains("70.0 kg") && words.contains("[hull]"), "{words}");
        glider(&["upload", &terminal.name, "config", &config]);
        let said = glider(&history);
        assert_eq!((&said["bytes"], &said["kept_on_flash"]), (&Value::from(192), &Value::Bool(true)), "{said}");
        let mut scenario = plant::Scenario { seed: 9, ..worlds::for_mission(&setup.mission) };
        scenario.sensors.depth_density_kg_m3 = Some(1025.0);
        scenario.effects.push(plant::Effect { kind: plant::EffectKind::DragLevelError, value: drag, aux: None });
        let mut link = Link::new(Port::open(&terminal.name).unwrap());
        fly(&mut World::new(scenario).unwrap(), &mut link, &setup, &mut |_| Ok(())).unwrap();
        let (packet, flags) = helm.lock().unwrap().said_of_glides().expect("enough to judge");
        let message = signals::Surfacing { phase: Phase::Done, packet: Some(packet), flags, ..signals::Surfacing::default() };
        let message = file("one.srf", &message.encode());
        let said = glider(&["diagnose", "--flight", &message, "--history", &path("known.history"), "--config", &config]);
        assert_eq!(flags.contains(signals::Flags::DEPARTS), departs, "{said}");
        let named = said["history"]["class"][0]["number"].as_str();
        assert_eq!(named, departs.then_some("drag_level"), "{said}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn hil_the_flight_log_of_the_board_is_the_flight_that_was_flown() {
    // 24 sectors of log: a flight of 4 dives fits, the second one goes round the ring.
    let (terminal, _) = board(2 * helm::storage::OBJECTS + 24);
    let mut flown = Vec::new();
    let mut link = Link::new(Port::open(&terminal.name).unwrap());
    for seed in [1, 2] {
        let mission = mission_file::built_in("shallow").unwrap();
        let mut world = World::new(plant::Scenario { seed, ..worlds::for_mission(&mission) }).unwrap();
        let watch = &mut |c: &rig::flight::cycle::Cycle<'_>| {
            flown.push((*c.frame, *c.answer));
            Ok(())
        };
        fly(&mut world, &mut link, &Setup::new(mission), watch).unwrap();
    }
    let read = |link: &mut Link<Port>, wanted| {
        let found = onboard_log::read(link, &wanted, |_| {}).unwrap();
        assert!(found.cycles.iter().all(|c| c.0.is_none()), "nobody set its clock");
        found.cycles.into_iter().map(|(_, frame, answer)| (frame, answer)).collect::<Vec<_>>()
    };
    let logged = read(&mut link, Wanted::ALL);
    assert!(logged.len() > 500 && logged.len() < flown.len(), "{} of {}", logged.len(), flown.len());
    assert_eq!(logged, flown[flown.len() - logged.len()..], "the newest, in order, without a gap");
    let newest = read(&mut link, Wanted::newest(2));
    assert!(newest.len() < 80 && newest[..] == flown[flown.len() - newest.len()..]);
    drop(link);

    let folder = scratch("flight-log");
    let to = folder.join("log").to_string_lossy().into_owned();
    let said = glider(&["monitor", &terminal.name, "--flight-log", &to, "--last", "300"]);
    assert_eq!(said["cycles"], 300);
    let flights = said["flights"].as_array().unwrap();
    let csv = std::fs::read_to_string(PathBuf::from(flights.last().unwrap().as_str().unwrap()).join("flight.csv")).unwrap();
    let last = flown.last().unwrap();
    assert_eq!(last.1.trace.phase, Phase::Done);
    assert_eq!(csv.lines().count(), 301);
    assert!(csv.lines().last().unwrap().contains(",6,4,"), "phase done after four dives: {:?}", csv.lines().last());

    let (empty, _) = board(16);
    let mut link = Link::new(Port::open(&empty.name).unwrap());
    assert!(read(&mut link, Wanted::ALL).is_empty());
}

#[test]
fn hil_the_log_is_dated_by_this_computer_and_read_by_ranges_of_time() {
    let (terminal, _) = board(96);
    let folder = scratch("dated");
    let config = folder.join("a.toml");
    std::fs::write(&config, "vehicle = \"slocum-100\"\n").unwrap();
    let config = config.to_string_lossy().into_owned();
    let said = glider(&["upload", &terminal.name, "config", &config]);
    assert!(said["clock"]["was_off_s"].is_null() && said["clock"]["off_s"].as_f64().unwrap().abs() < 0.5, "{said}");
    let said = glider(&["upload", &terminal.name, "config", &config]);
    assert!(said["clock"]["was_off_s"].as_f64().unwrap().abs() < 0.5, "known now: {said}");

    let mut link = Link::new(Port::open(&terminal.name).unwrap());
    let mut clocks = Vec::new();
    for hours in [0.0, 3.0] {
        let manifest = link.hello().unwrap();
        // The second flight of the day, by a computer whose clock says so.
        let setting = clock::set(&mut link, &|| clock::system_ms() + 3.6e6 * hours).unwrap();
        let clock::Setting::Set { before: Some(before), .. } = setting else { panic!("{setting:?}") };
        assert!((before.off_s + 3600.0 * hours).abs() < 0.5, "{setting:?}");
        let mission = mission_file::built_in("shallow").unwrap();
        link.configure(&manifest, &worlds::config(&mission)).unwrap();
        link.begin(&mission).unwrap();
        // UTC dates records and is not moved under them.
        assert!(clock::set(&mut link, &clock::system_ms).is_err());
        let mut world = World::new(worlds::for_mission(&mission)).unwrap();
        clocks.push(clock::system_ms() + 3.6e6 * hours);
        for _ in 0..150 {
            let answer = link.exchange(&world.sense()).unwrap();
            world.advance(&answer.command, 4.0);
        }
        link.recall().unwrap();
        for _ in 0..600 {
            let answer = link.exchange(&world.sense()).unwrap();
            world.advance(&answer.command, 4.0);
        }
        link.recover().unwrap();
    }
    let all = onboard_log::read(&mut link, &Wanted::ALL, |_| {}).unwrap();
    assert_eq!(all.cycles.len(), 1_500);
    let off = |c: &onboard_log::Logged, start: f64| c.0.map_or(f64::NAN, |utc| utc.ms as f64 - start);
    assert!(off(&all.cycles[0], clocks[0]).abs() < 1e3 && off(&all.cycles[750], clocks[1]).abs() < 1e3);
    let middle = clocks[1] as u64 - 3_600_000;
    for (from_ms, to_ms, first) in [(None, Some(middle), 0), (Some(middle), None, 750), (Some(middle), Some(middle + 1), 0)] {
        let part = onboard_log::read(&mut link, &Wanted { from_ms, to_ms, ..Wanted::ALL }, |_| {}).unwrap();
        let due = if from_ms.is_some() && to_ms.is_some() { &[][..] } else { &all.cycles[first..first + 750] };
        assert_eq!((&part.cycles[..], part.undated), (due, 0));
        assert!(part.sectors <= all.sectors / 2 + 1, "only what is wanted is read: {} of {}", part.sectors, all.sectors);
    }
    drop(link);
    let to = folder.join("log").to_string_lossy().into_owned();
    let said =
        glider(&["monitor", &terminal.name, "--flight-log", &to, "--from", &utc::iso(middle), "--to", &utc::iso(middle + 36_000_000)]);
    assert_eq!((&said["cycles"], &said["undated"]), (&750.into(), &0.into()));
    let flight = PathBuf::from(said["flights"][0].as_str().unwrap());
    let csv = std::fs::read_to_string(flight.join("flight.csv")).unwrap();
    let at = csv.lines().next().unwrap().split(',').position(|c| c == "utc_s").unwrap();
    let utc_s: f64 = csv.lines().nth(1).unwrap().split(',').nth(at).unwrap().parse().unwrap();
    assert!((utc_s - clocks[1] * 1e-3).abs() < 1.0, "{utc_s}");
}

#[test]
fn a_board_without_a_log_flash_says_so() {
    let terminal = Terminal::with_controller().unwrap();
    let mut link = Link::new(Port::open(&terminal.name).unwrap());
    let e = onboard_log::read(&mut link, &Wanted::ALL, |_| {}).unwrap_err().to_string();
    assert!(e.contains("no flight log") && !e.contains('\n'), "{e}");
}

/// The image under test; says loudly why not.
fn image() -> Option<PathBuf> {
    if !qemu::is_installed() {
        println!("skipped: no qemu-system-arm on this machine (scripts/setup-target installs it)");
        return None;
    }
    qemu::find_image().inspect_err(|e| println!("skipped: {e:#}")).ok()
}

#[test]
fn hil_the_image_is_watched_and_its_log_decoded() {
    let Some(elf) = image() else { return };
    let folder = scratch("monitor");
    let log = folder.join("log.bin");
    let mut link = Link::new(Qemu::start(&elf, Some(log.clone())).unwrap());
    let manifest = link.hello().unwrap();
    let mission = mission_file::built_in("shallow").unwrap();
    link.configure(&manifest, &worlds::config(&mission)).unwrap();
    link.begin(&mission).unwrap();
    let mut world = World::new(worlds::for_mission(&mission)).unwrap();
    for _ in 0..20 {
        let answer = link.exchange(&world.sense()).unwrap();
        world.advance(&answer.command, 4.0);
    }
    let decoded = |bytes: &[u8]| {
        let image = Image::read(&elf).unwrap();
        let (mut stream, mut lines) = (image.stream(), Vec::new());
        stream.take(bytes, |line| lines.push(line));
        assert_eq!(stream.damaged, 0, "{lines:#?}");
        lines
    };
    let told = |lines: &[String], words: &str| assert!(lines.iter().any(|l| l.contains(words)), "{words}: {lines:#?}");
    // As it leaves the chip by USART2.
    let lines = decoded(&std::fs::read(&log).unwrap());
    for words in ["INFO firmware 0.", "WARN no log flash", "seat: frames come from the host", "mission taken, table", "phase 1"] {
        told(&lines, words);
    }
    // As a debug probe reads it out of RAM: 512 bytes, what did not fit is dropped whole.
    let rtt = decoded(&rtt(link.wire(), &elf, &folder));
    told(&rtt, "INFO firmware 0.");
    assert!(rtt.iter().all(|l| lines.contains(l)), "{rtt:#?} {lines:#?}");

    // What `glider monitor` shows of it, on the same terminal.
    let name = link.wire().terminal().to_owned();
    let before =
        link.request("a report", &signals::ToBoard::Report, |a| if let signals::ToHost::Counters(c) = a { Some(c) } else { None }).unwrap();
    link.wire().unplug();
    let (elf, log) = (elf.to_string_lossy().into_owned(), log.to_string_lossy().into_owned());
    let shown = glider(&["monitor", &name, "--log", &log, "--elf", &elf, "--seconds", "1"]);
    // The emulated chip is deaf until its receiver is on: a hello on the way then is cut, and counted.
    assert!(before.damaged <= 1, "{before:?}");
    assert!(shown["accepted"].as_u64().unwrap() > u64::from(before.accepted) && shown["hil"] == true, "{shown}");
    assert_eq!(shown["damaged"], before.damaged, "nothing is damaged once it hears: {shown}");
    let text: Vec<String> = shown["log"].as_array().unwrap().iter().map(|l| l.as_str().unwrap().to_owned()).collect();
    told(&text, "mission taken, table");
}

/// Memory of the emulated chip.
fn memory(qemu: &mut Qemu, at: u64, length: u64, folder: &Path) -> Vec<u8> {
    let file = folder.join(format!("memory-{at:x}"));
    qemu.monitor(&format!("pmemsave {at:#x} {length:#x} \"{}\"", file.display())).unwrap();
    for _ in 0..200 {
        match std::fs::read(&file) {
            Ok(bytes) if bytes.len() as u64 == length => return bytes,
            _ => std::thread::sleep(std::time::Duration::from_millis(20)),
        }
    }
    panic!("QEMU does not write {}", file.display());
}

/// What lies in the board's RTT channel: control block by its symbol, then as SEGGER lays it out.
fn rtt(qemu: &mut Qemu, elf: &Path, folder: &Path) -> Vec<u8> {
    use object::{Object, ObjectSymbol};
    let image = std::fs::read(elf).unwrap();
    let file = object::File::parse(&*image).unwrap();
    let at = file.symbol_by_name("_SEGGER_RTT").expect("the image has an RTT channel").address();
    let block = memory(qemu, at, 48, folder);
    assert_eq!(&block[..10], b"SEGGER RTT");
    let word = |i: usize| u64::from(u32::from_le_bytes(block[i..i + 4].try_into().unwrap()));
    let (buffer, written, read) = (word(28), word(36), word(40));
    assert_eq!(read, 0, "nobody read");
    memory(qemu, buffer, written, folder)
}

#[test]
fn hil_a_board_with_a_log_shows_what_its_vehicle_does() {
    let (terminal, _) = board(64);
    let mut mission = mission_file::load("shallow", worlds::limits).unwrap();
    mission.legs[0].dives = 1;
    let mut world = World::new(worlds::for_mission(&mission)).unwrap();
    let mut link = Link::new(Port::open(&terminal.name).unwrap());
    let mut last = None;
    fly(&mut world, &mut link, &Setup::new(mission), &mut |cycle| {
        last = Some((cycle.frame.pitch_rad, cycle.answer.trace));
        Ok(())
    })
    .unwrap();
    drop(link);
    let (pitch, trace) = last.unwrap();
    let shown = glider(&["monitor", &terminal.name, "--seconds", "1"]);
    let flight = &shown["flight"];
    assert_eq!(flight["phase"], format!("{:?}", trace.phase), "{shown}");
    let near = |key: &str, value: f64, by: f64| {
        assert!(flight[key].as_f64().is_some_and(|v| (v - value).abs() <= by), "{key}: {} and {value}", flight[key]);
    };
    near("depth_m", trace.depth_m.into(), 0.002);
    near("alpha_deg", f64::from(trace.alpha_rad).to_degrees(), 0.002);
    let signals::Reading::Sampled { value, .. } = pitch else { panic!("a pitch") };
    near("pitch_deg", f64::from(value).to_degrees(), 0.002);
    assert!(flight["battery_v"].as_f64().is_some_and(|v| (8.0..18.0).contains(&v)) && flight["abort"].is_null(), "{shown}");
}

#[test]
fn a_flight_is_watched_while_another_program_flies_it() {
    let folder = scratch("watched");
    let log = folder.join("log");
    let mut exe = std::env::current_exe().unwrap();
    exe.pop();
    exe.pop();
    // Half an hour in about nine seconds.
    let flight = ["fly", "--realtime", "200", "--fault", "hull:leak@dive+300s", "--log"];
    let mut child = Command::new(exe.join("glider")).args(flight).arg(&log).stdout(std::process::Stdio::null()).spawn().unwrap();
    let until = std::time::Instant::now() + std::time::Duration::from_secs(20);
    while !log.join("flight.csv.unfinished").exists() && std::time::Instant::now() < until {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let name = log.to_string_lossy().into_owned();
    let early = glider(&["monitor", &name, "--seconds", "0.5"]);
    assert!(early["end"].is_null() && early["flight"]["abort"].is_null(), "{early}");
    assert!(early["flight"]["battery_v"].as_f64().is_some_and(|v| v > 8.0), "{early}");
    // To its end, without being told when that is.
    let late = last_document(&["monitor", &name]);
    assert!(child.wait().unwrap().success());
    assert_eq!((&late["end"], &late["flight"]["abort"]), (&Value::from("safe: Leak"), &Value::from("Leak")), "{late}");
    assert!(late["flight"]["time_s"].as_f64() > early["flight"]["time_s"].as_f64(), "{early} {late}");
    std::fs::remove_dir_all(&folder).unwrap();
}

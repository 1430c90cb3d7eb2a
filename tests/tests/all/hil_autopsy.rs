//! `glider autopsy` of the flight image in QEMU, whose faults are provoked from outside through QEMU's gdb stub, and of a board
//! behind a terminal whose watchdog has bitten: QEMU has none.

use control::Config;
use helm::black_box::{BlackBox, WORDS};
use helm::{Boot, Content, Helm, Kept, RamStorage, Storage};
use object::{Object as _, ObjectSection, ObjectSymbol};
use plant::World;
use rig::flight::{mission_file, worlds};
use rig::seats::pty::Terminal;
use rig::seats::qemu::{self, Qemu};
use rig::seats::{Link, Seat};
use serde_json::Value;
use signals::autopsy::flag;
use signals::link::MAX_WIRE;
use signals::{Answer, Object, Phase, Refusal, encode};
use std::path::{Path, PathBuf};
use std::process::Command;
use tests::gdb_stub::Stub;

/// The image under test; says loudly why not.
fn image() -> Option<PathBuf> {
    if !qemu::is_installed() {
        println!("skipped: no qemu-system-arm on this machine (scripts/setup-target installs it)");
        return None;
    }
    qemu::find_image().inspect_err(|e| println!("skipped: {e:#}")).ok()
}

/// Runs the program; exit code, standard output, standard error.
fn glider(args: &[&str]) -> (i32, String, String) {
    let exe = std::env::current_exe().unwrap();
    let program = exe.ancestors().nth(2).unwrap().join("glider");
    let out = Command::new(program).args(args).output().expect("build it with cargo build -p hil-host");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (out.status.code().unwrap(), text(&out.stdout), text(&out.stderr))
}

fn json(args: &[&str], code: i32) -> Value {
    let (got, out, err) = glider(&[args, &["--json"]].concat());
    assert_eq!(got, code, "glider {args:?}: {out} {err}");
    serde_json::from_str(&out).unwrap()
}

fn scratch(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("glider-autopsy-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// The image in QEMU with a mission under way.
fn under_way(elf: &Path) -> (Link<Qemu>, World) {
    let mut link = Link::new(Qemu::start(elf, None).unwrap());
    let manifest = link.hello().unwrap();
    let mission = mission_file::built_in("shallow").unwrap();
    link.configure(&manifest, &worlds::config(&mission)).unwrap();
    link.begin(&mission).unwrap();
    let mut world = World::new(worlds::for_mission(&mission)).unwrap();
    for _ in 0..80 {
        fly(&mut link, &mut world);
    }
    (link, world)
}

fn fly(link: &mut Link<Qemu>, world: &mut World) -> Answer {
    let answer = link.exchange(&world.sense()).unwrap();
    world.advance(&answer.command, 4.0);
    answer
}

/// Stops the image where a function begins (a part of its mangled name), has `harm` done to it, and flies on until it has come up
/// again in SAFE. The line is let go of.
fn harmed(elf: &Path, function: &str, harm: impl FnOnce(&mut Stub)) -> Link<Qemu> {
    let bytes = std::fs::read(elf).unwrap();
    let file = object::File::parse(&*bytes).unwrap();
    let symbol = file.symbols().find(|s| s.name().is_ok_and(|n| n.contains(function))).unwrap_or_else(|| panic!("no {function}"));
    let at = symbol.address() & !1;
    let (mut link, mut world) = under_way(elf);
    let mut stub = Stub::attach(link.wire());
    stub.stop();
    stub.breakpoint(at, true);
    stub.run();
    let flight = std::thread::spawn(move || {
        let safe = (0..50).any(|_| fly(&mut link, &mut world).trace.phase == Phase::Safe);
        (link, safe)
    });
    stub.stopped();
    stub.breakpoint(at, false);
    harm(&mut stub);
    stub.run();
    let (mut link, safe) = flight.join().unwrap();
    assert!(safe, "a fault in flight comes up in SAFE");
    link.wire().unplug();
    link
}

/// First and last line of a function, by its text: from `fn name` to the brace that closes it.
fn lines_of(file: &str, name: &str) -> Vec<(usize, usize)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let lines: Vec<&str> = text.lines().collect();
    let begins = |line: &str| line.contains(&format!("fn {name}(")) || line.contains(&format!("fn {name}<"));
    let from = lines.iter().enumerate().filter(|(_, line)| begins(line));
    from.map(|(i, line)| {
        let indent = line.len() - line.trim_start().len();
        let closes = format!("{}}}", " ".repeat(indent));
        (i + 1, i + 1 + lines[i..].iter().position(|l| **l == closes).expect("an end"))
    })
    .collect()
}

#[test]
fn hil_a_provoked_fault_is_named_by_function_and_line() {
    let Some(elf) = image() else { return };
    let folder = scratch("fault");
    // `Belief::take(&mut self, …)` of a belief that lies where nothing is.
    let mut link = harmed(&elf, "6belief6Belief4take17h", |stub| stub.register(0, 0x6000_0000));
    let name = link.wire().terminal().to_owned();
    let saved = folder.join("board.autopsy").to_string_lossy().into_owned();
    let elf_name = elf.to_string_lossy().into_owned();
    let said = json(&["autopsy", &name, "--elf", &elf_name, "--out", &saved], 0);
    let fault = &said["fault"];
    assert_eq!(fault["cause"], "fault", "{said:#}");
    assert!(fault["what"].as_str().unwrap().starts_with("precise data bus error at address 0x600000"), "{said:#}");
    let places = fault["at"].as_array().unwrap();
    // What reads the belief first: `take` itself, or its check of all numbers, as the compiler inlines them.
    let outermost = places.last().unwrap()["function"].as_str().unwrap();
    assert!(["take", "heal"].iter().any(|f| outermost == format!("control::belief::Belief::{f}")), "{said:#}");
    for place in places {
        let (function, file) = (place["function"].as_str().unwrap(), place["file"].as_str().unwrap());
        let line = place["line"].as_u64().unwrap() as usize;
        if file.starts_with("firmware/") {
            let spans = lines_of(file, function.trim_end_matches("::{{closure}}").rsplit("::").next().unwrap());
            assert!(spans.iter().any(|s| (s.0..=s.1).contains(&line)), "{function} {file}:{line} is not in {spans:?}");
        }
    }
    // Called by the law's step.
    let callers = fault["callers"].as_array().unwrap();
    let called = std::iter::once(&fault["link"]).chain(callers).any(|p| p.to_string().contains("control::step"));
    assert!(called, "{said:#}");
    // The cycles before it, in order, and none of those flown since.
    let cycles = fault["cycles"].as_array().unwrap();
    let numbers: Vec<u64> = cycles.iter().map(|c| c["seq"].as_u64().unwrap()).collect();
    assert_eq!(cycles.len(), 64);
    // Frames 0 to 79 are flown before, 50 at most until it comes. One that the host asks again, on a busy machine, is kept again.
    assert!(numbers.windows(2).all(|w| (w[0]..=w[0] + 1).contains(&w[1])), "{numbers:?}");
    assert!((79..130).contains(numbers.last().unwrap()), "{numbers:?}");
    assert!(cycles.iter().all(|c| c["abort"].is_null()), "{said:#}");

    // The same from the file, for a person: 80 columns, the answer last.
    let (code, text, _) = glider(&["autopsy", &saved, "--elf", &elf_name]);
    println!("{text}");
    assert!(code == 0 && text.lines().all(|l| l.chars().count() <= 80), "{text}");
    let tail = text.rsplit("what happened").next().unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(tail.contains("precise data bus error") && tail.contains(".rs:"), "{text}");

    // Another image names no line, and says which would.
    let bytes = std::fs::read(&elf).unwrap();
    let at = object::File::parse(&*bytes).unwrap().section_by_name(".rodata").unwrap().file_range().unwrap().0 as usize;
    let mut other = bytes.clone();
    other[at + 8] ^= 1;
    let other_name = folder.join("other.elf");
    std::fs::write(&other_name, other).unwrap();
    let (code, out, err) = glider(&["autopsy", &saved, "--elf", other_name.to_str().unwrap()]);
    assert!(code == 2 && out.is_empty() && err.contains(fault["image"].as_str().unwrap()) && err.contains("--elf"), "{out}{err}");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn hil_a_stack_that_leaves_its_ram_and_one_in_its_canary_are_named() {
    let Some(elf) = image() else { return };
    let elf_name = elf.to_string_lossy().into_owned();
    let mut link = harmed(&elf, "6belief6Belief4take17h", |stub| stub.register(13, 0x2000_0008));
    let said = json(&["autopsy", link.wire().terminal(), "--elf", &elf_name], 0);
    assert!(said["fault"]["what"].as_str().unwrap().starts_with("stack overflow: the stack left its RAM"), "{said:#}");
    drop(link);
    let mut link = harmed(&elf, "6belief6Belief4take17h", |stub| stub.write(0x2000_0000, 0));
    let said = json(&["autopsy", link.wire().terminal(), "--elf", &elf_name], 0);
    assert_eq!((&said["fault"]["cause"], &said["fault"]["at"]), (&Value::from("stack"), &Value::Array(vec![])), "{said:#}");
    assert!(said["fault"]["time_s"].as_f64().is_some_and(|s| s > 0.0), "{said:#}");
}

#[test]
fn hil_a_clean_image_and_one_reset_by_its_pin_keep_nothing() {
    let Some(elf) = image() else { return };
    let (mut link, mut world) = under_way(&elf);
    let name = link.wire().terminal().to_owned();
    link.reset().unwrap();
    fly(&mut link, &mut world);
    link.wire().unplug();
    let said = json(&["autopsy", &name], 1);
    assert!(said["fault"].is_null() && said["why"].as_str().unwrap().starts_with("a clean board"), "{said:#}");
    assert_eq!(said["present"]["run"], 2, "{said:#}");
}

/// Objects in RAM, and a recorder.
struct WithRecorder(RamStorage, BlackBox<[u32; WORDS]>);

impl Storage for WithRecorder {
    fn load(&mut self, object: Object, out: &mut Content) -> bool {
        self.0.load(object, out)
    }
    fn save(&mut self, object: Object, bytes: &[u8]) -> Result<Kept, Refusal> {
        self.0.save(object, bytes)
    }
    fn rollback(&mut self, object: Object) -> Result<Kept, Refusal> {
        self.0.rollback(object)
    }
    fn read_autopsy(&mut self, at: u32, out: &mut [u8]) -> u32 {
        self.1.read(at, out)
    }
}

/// A board whose RAM is `memory` after a reset with these flags, and what its RAM is then.
fn board(memory: [u32; WORDS], flags: u8) -> (Terminal, [u32; WORDS]) {
    let mut recorder = BlackBox::new(memory);
    recorder.open(flags, [0, 1, 0], 0x1234_abcd);
    for seq in 0..100u32 {
        let mut answer = Answer::default();
        (answer.command.seq, answer.trace.phase, answer.trace.depth_m) = (seq, Phase::Dive, 0.1 * seq as f32);
        recorder.cycle(&answer, 4_000 * u64::from(seq));
    }
    let memory = *recorder.memory();
    let mut helm = Helm::new(Config::default(), Boot::default(), WithRecorder(RamStorage::new(), recorder));
    let terminal = Terminal::serve(move |bytes, out| {
        for byte in bytes {
            let Some(answer) = helm.byte(*byte) else { continue };
            let mut wire = [0u8; MAX_WIRE];
            let n = encode(&answer, &mut wire).unwrap();
            out.extend_from_slice(&wire[..n]);
        }
    });
    (terminal.unwrap(), memory)
}

#[test]
fn hil_a_watchdog_and_a_damaged_record_are_told_apart_from_a_clean_board() {
    let (_, flown) = board([0; WORDS], flag::POWER);
    let (terminal, _) = board(flown, flag::WATCHDOG | flag::PIN);
    let (code, text, err) = glider(&["autopsy", &terminal.name]);
    assert!(code == 0 && text.contains("watchdog: the loop stood still") && text.contains("396.00"), "{text}{err}");
    assert!(text.contains("reset by       the watchdog") && text.lines().all(|l| l.chars().count() <= 80), "{text}");
    // The same RAM with one flipped bit.
    let mut damaged = flown;
    damaged[3] ^= 1 << 9;
    let (terminal, _) = board(damaged, flag::WATCHDOG | flag::PIN);
    let (code, text, _) = glider(&["autopsy", &terminal.name]);
    assert!(code == 1 && text.contains("nothing kept"), "{text}");
    // A controller without such a memory.
    let simulated = Terminal::with_controller().unwrap();
    let (code, text, _) = glider(&["autopsy", &simulated.name]);
    assert!(code == 1 && text.contains("nothing kept"), "{text}");
}

#[test]
fn what_is_no_record_is_refused_with_the_remedy() {
    let folder = scratch("refused");
    let put = |name: &str, bytes: &[u8]| {
        let path = folder.join(name);
        std::fs::write(&path, bytes).unwrap();
        path.to_string_lossy().into_owned()
    };
    let (terminal, _) = board([0; WORDS], flag::POWER);
    let (_, flown) = board([0; WORDS], flag::POWER);
    let (bitten, _) = board(flown, flag::WATCHDOG);
    let there = put("there.autopsy", b"");
    let folder_name = folder.to_string_lossy().into_owned();
    for (args, words) in [
        (vec![put("cut.autopsy", &[1; 33])], "--out FILE"),
        (vec![folder_name], "folder"),
        (vec!["/dev/no-such-port".to_owned()], "/dev/no-such-port"),
        (vec![terminal.name.clone(), "--out".to_owned(), there], "--force"),
        (vec![terminal.name.clone(), "--out".to_owned(), "board.txt".to_owned()], ".autopsy"),
        (vec![bitten.name.clone(), "--elf".to_owned(), put("text.elf", b"no ELF")], "scripts/build-firmware"),
    ] {
        let all: Vec<&str> = std::iter::once("autopsy").chain(args.iter().map(String::as_str)).collect();
        let (code, out, err) = glider(&all);
        assert!(code == 2 && out.is_empty() && err.contains(words), "{args:?}: {code} {out}{err}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

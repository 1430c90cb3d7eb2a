//! Damaged logs of every format: an import ends in a flight or in one line, never in a panic, a hang or a machine without memory.
//!
//! Seeded, so that a failure can be repeated. GLIDER_MUTATIONS says how many inputs (default 3 000; the full campaign 300 000, with
//! coverage as its guide: `scripts/mutate`). GLIDER_COVERAGE names the profile that an instrumented build keeps up to date: an input
//! that reaches code which none before it reached is changed further. Inputs that fail are kept in the folder GLIDER_FINDINGS
//! (default: beside the temporary files), and the campaign goes on.
//!
//! Every byte that is allocated is counted: these tests start themselves again, so that no other one allocates beside them.
//! `scripts/mutate` runs them with GLIDER_TEST_ALONE, in its own process.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use super::made_logs;
use super::mutations::{Random, mutate};
use super::old_hdf5;

#[global_allocator]
static MEMORY: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

/// Samples are 1 to 70 kB: no import of one may take more.
const MOST_BYTES: usize = 256 << 20;
const MOST_SECONDS: f64 = 5.0;

/// Files of one flight, by name.
type Sample = Vec<(String, Vec<u8>)>;

fn files(folder: &Path) -> Sample {
    let mut all: Vec<PathBuf> = std::fs::read_dir(folder).expect("samples").map(|e| e.expect("an entry").path()).collect();
    all.retain(|p| p.is_file() && p.extension().is_none_or(|e| e != "json"));
    all.sort();
    let name = |p: &Path| p.file_name().expect("a name").to_string_lossy().into_owned();
    all.iter().map(|p| (name(p), std::fs::read(p).expect("a sample"))).collect()
}

/// The samples of every format: those of the folder, and Slocum binaries, plain and packed with their list, a classic NetCDF and
/// a csv of the project's own format, which are made here.
fn samples(work: &Path) -> Vec<Sample> {
    let formats = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats");
    let mut folders: Vec<PathBuf> = std::fs::read_dir(formats).expect("samples").map(|e| e.expect("an entry").path()).collect();
    folders.sort();
    let mut all: Vec<Sample> = folders.iter().filter(|f| !f.ends_with("ad2cp_midas")).map(|f| files(f)).collect();
    // The speeds of a current profiler are read beside a flight.
    let mut profiler = files(&folders.iter().find(|f| f.ends_with("ad2cp_midas")).expect("a sample").clone());
    profiler.extend(files(&folders.iter().find(|f| f.ends_with("seaexplorer_sub")).expect("a sample").clone()));
    all.push(profiler);
    let made = |fill: &dyn Fn(&Path)| {
        let _ = std::fs::remove_dir_all(work);
        std::fs::create_dir_all(work).expect("a folder");
        fill(work);
        files(work)
    };
    let plain = made(&|f| made_logs::pair(f, "a", "alpha", made_logs::START, |t| t));
    all.push(plain.iter().flat_map(|(name, bytes)| packed(name, bytes)).collect());
    all.push(plain);
    all.push(made(&|f| made_logs::netcdf(&f.join("mission.nc"), &["time"], &made_logs::variables(made_logs::USUAL))));
    all.push(vec![("old.nc".into(), old_hdf5())]);
    let mut rows = String::from("time_s,segment,pressure_dbar,m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3\n");
    (0..made_logs::CYCLES).for_each(|k| {
        let (dbar, pitch, cc) = made_logs::at(k);
        rows += &format!("{},{},{dbar:.3},{pitch},{cc},1025.1\n", 4 * k, k / 130);
    });
    all.push(vec![("flight.csv".into(), rows.into_bytes())]);
    all
}

/// The same variables as HDF5 wrote them before it had checksums.
fn old_hdf5() -> Vec<u8> {
    let mut file = old_hdf5::OldHdf5::new();
    let mut variables: Vec<(&str, u64)> = made_logs::variables(made_logs::USUAL)
        .iter()
        .map(|(name, unit, standard, values)| (*name, file.variable(&[("units", unit), ("standard_name", standard)], values)))
        .collect();
    variables.sort_unstable();
    let root = file.group(&variables);
    file.file(root)
}

/// A plain Slocum file with its list as the packed kind and its sensor list: LZ4 blocks, and a `.cac` named by its checksum.
fn packed(name: &str, plain: &[u8]) -> Sample {
    let place = |part: &[u8]| plain.windows(part.len()).position(|w| w == part).expect("a part of the file");
    let (list, data) = (place(b"s: T"), place(b"sa\x34\x12"));
    let sum = format!("{:08X}", crc::Crc::<u32>::new(&crc::CRC_32_JAMCRC).checksum(&plain[list..data]));
    let header = String::from_utf8_lossy(&plain[..list]);
    let header = header.replace("crc:    00000000", &format!("crc:    {sum}")).replace("factored:    0", "factored:    1");
    let whole = [header.as_bytes(), &plain[data..]].concat();
    let blocks = whole.chunks(2000).map(lz4_flex::block::compress);
    let bytes = blocks.flat_map(|b| [&(b.len() as u16).to_be_bytes()[..], &b].concat()).collect();
    let (stem, ending) = name.rsplit_once('.').expect("an ending");
    let ending = ending.replace("bd", "cd");
    vec![(format!("{stem}.{ending}"), bytes), (format!("{}.cac", sum.to_lowercase()), plain[list..data].to_vec())]
}

/// Counters of the code reached so far, as an instrumented program keeps them in its profile.
struct Coverage {
    profile: Option<PathBuf>,
    /// Counters that are not zero, and all.
    reached: (usize, usize),
}

impl Coverage {
    fn watched() -> Self {
        Self { profile: std::env::var_os("GLIDER_COVERAGE").map(PathBuf::from), reached: (0, 0) }
    }

    /// Whether anything was reached for the first time since the last call.
    fn grew(&mut self) -> bool {
        let Some(bytes) = self.profile.as_ref().and_then(|p| std::fs::read(p).ok()) else { return false };
        let now = counters(&bytes).expect("a raw profile of LLVM, version 9 or 10");
        std::mem::replace(&mut self.reached, now).0 < now.0
    }
}

/// Counters that are not zero, and all, of a raw profile (LLVM, `InstrProfData.inc`: 14 to 16 words of header, identifiers, records of
/// functions, counters of 8 bytes).
fn counters(profile: &[u8]) -> Option<(usize, usize)> {
    let word = |k: usize| Some(usize::try_from(u64::from_le_bytes(profile.get(8 * k..8 * k + 8)?.try_into().ok()?)).unwrap_or(usize::MAX));
    let version = word(1)? & 0xFFFF;
    let (header, record) = match version {
        9 => (14 * 8, 64),
        10 => (16 * 8, 64),
        _ => return None,
    };
    let (identifiers, records, padding, count) = (word(2)?, word(3)?, word(4)?, word(5)?);
    let from = header + identifiers + records * record + padding;
    let counters = profile.get(from..from + 8 * count)?;
    Some((counters.chunks(8).filter(|c| c.iter().any(|b| *b != 0)).count(), count))
}

/// Time this thread has computed, s; that of the clock where the system does not tell.
fn computed_s(thread: &str, since: Instant) -> f64 {
    let stat = std::fs::read_to_string(format!("/proc/{thread}/schedstat")).ok();
    let nanoseconds = stat.and_then(|t| t.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| since.elapsed().as_secs_f64(), |n| n * 1e-9)
}

/// Damaged texts that no import reads: vehicle files, expressions of effects, arrays of numpy: read, or refused in one line.
fn own_formats(vehicles: &[String], random: &mut Random) {
    let mut changed = |text: &[u8]| {
        let mut bytes = text.to_vec();
        mutate(&mut bytes, random);
        bytes
    };
    let class = crate::import::classes::Class::ALL[changed(b"some bytes").len() % 6];
    let mut said = Vec::new();
    for text in vehicles.iter().cloned().chain([class.draft().toml() + "hull_volume_m3 = 0.06\n"]) {
        let name = if text.starts_with('{') { "v.json" } else { "v.toml" };
        let text = String::from_utf8_lossy(&changed(text.as_bytes())).into_owned();
        said.extend(crate::vehicle::parse_text(&text, Path::new(name)).err().map(|e| e.to_string()));
    }
    let text = String::from_utf8_lossy(&changed(b"cd += k*alpha^2*exp(-p/1e5) + a*sin(2*pi*t/600)*ln(1+abs(roll))")).into_owned();
    // Its errors show the place, below the text.
    let _ = crate::vehicle::expression::parse(&text);
    let mut array = b"\x93NUMPY\x01\x00\x40\x00{'descr': '<f8', 'fortran_order': False, 'shape': (6, 4), }     \n".to_vec();
    array.extend([0.0, 4.0, 8.0, 12.0].into_iter().chain([0.0; 20]).flat_map(f64::to_le_bytes));
    said.extend(crate::import::comet::flight(&changed(&array)).err().map(|e| e.to_string()));
    for one in said {
        assert!(!one.trim_end().contains('\n'), "{one}");
    }
}

/// Runs the test of this name in a process of its own; whether this is that process.
fn alone(test: &str) -> bool {
    const ALONE: &str = "GLIDER_TEST_ALONE";
    if std::env::var_os(ALONE).is_some() {
        return true;
    }
    let program = std::env::current_exe().expect("this program");
    let test = format!("tests::prop_mutated_files::{test}");
    let ended = std::process::Command::new(program).args(["--exact", &test, "--nocapture"]).env(ALONE, "1").output().expect("runs");
    let text = String::from_utf8_lossy(&ended.stdout).into_owned() + &String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success() && text.contains("1 passed"), "{text}");
    false
}

/// Bytes that an import may take: by the size of the files, and what reading any file takes.
const PER_BYTE: usize = 20;
const FOR_ANY: usize = 16 << 20;

#[test]
fn prop_memory_is_bounded_by_the_size_of_the_files() {
    if !alone("prop_memory_is_bounded_by_the_size_of_the_files") {
        return;
    }
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats");
    let mut folders: Vec<PathBuf> = std::fs::read_dir(&samples).expect("samples").map(|e| e.expect("an entry").path()).collect();
    if let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) {
        let real = ["seaglider_sg561", "seaglider_sg171", "seaexplorer_sea035", "slocum_comet2016/raw", "slocum_comet2019/raw"];
        folders.extend(real.map(|name| root.join(name)));
    }
    for folder in folders {
        let size: usize = files(&folder).iter().map(|f| f.1.len()).sum();
        let before = MEMORY.current_usage();
        MEMORY.reset_peak_usage();
        let read = crate::import::import(&folder, &[]).map_or_else(|e| e.to_string(), |i| format!("{} rows", i.flight.len()));
        let peak = MEMORY.peak_usage().saturating_sub(before);
        eprintln!("{}: {} kB take {} kB, {read}", folder.display(), size / 1000, peak / 1000);
        assert!(peak < PER_BYTE * size + FOR_ANY, "{}: {peak} bytes of {size}", folder.display());
    }
}

/// What an import of this one file ends in.
fn of_file(name: &str, bytes: &[u8]) -> Result<usize, String> {
    let path = std::env::temp_dir().join(format!("glider-{}-{name}", std::process::id()));
    std::fs::write(&path, bytes).expect("written");
    let read = crate::import::import(&path, &[]).map(|i| i.flight.len()).map_err(|e| e.to_string());
    std::fs::remove_file(&path).expect("removed");
    read
}

#[test]
fn regress_groups_of_hdf5_without_an_end_are_refused() {
    if !alone("regress_groups_of_hdf5_without_an_end_are_refused") {
        return;
    }
    assert!(of_file("old.nc", &old_hdf5()).is_ok_and(|rows| rows > 200), "{:?}", of_file("old.nc", &old_hdf5()));
    let with = |fill: &dyn Fn(&mut old_hdf5::OldHdf5) -> u64| {
        let mut file = old_hdf5::OldHdf5::new();
        let root = fill(&mut file);
        file.file(root)
    };
    let itself = with(&|f| f.group(&[("again", f.next())]));
    // Where the root comes to stand is known once it was made.
    let circle = |root: u64| {
        move |f: &mut old_hdf5::OldHdf5| {
            let inner = f.group(&[("up", root)]);
            f.group(&[("down", inner)])
        }
    };
    let root = circle(0)(&mut old_hdf5::OldHdf5::new());
    let deep = with(&|f| (0..100_000).fold(f.group(&[]), |inside, _| f.group(&[("a", inside)])));
    let wide = with(&|f| (0..14).fold(f.group(&[]), |inside, _| f.group(&[("a", inside), ("b", inside)])));
    for (name, bytes, why) in [
        ("itself.nc", itself, "group again holds itself"),
        ("circle.nc", with(&circle(root)), "group up holds itself"),
        ("deep.nc", deep, "nested more than 16 deep"),
        ("wide.nc", wide, "more than 20000 groups and variables"),
    ] {
        let (began, before) = (Instant::now(), MEMORY.current_usage());
        MEMORY.reset_peak_usage();
        let refused = of_file(name, &bytes).expect_err(name);
        assert!(refused.contains(why), "{refused}");
        let (took, peak) = (began.elapsed().as_secs_f64(), MEMORY.peak_usage().saturating_sub(before));
        assert!(took < MOST_SECONDS && peak < MOST_BYTES / 4, "{name}: {took} s, {} MB", peak >> 20);
    }
}

#[test]
fn regress_time_of_a_table_grows_with_its_columns() {
    if !alone("regress_time_of_a_table_grows_with_its_columns") {
        return;
    }
    let began = Instant::now();
    let table = |columns: usize| {
        let names: Vec<String> = (0..columns).map(|k| format!("column_{k}")).collect();
        let numbers = vec!["1.5"; columns].join(",");
        let row = |k: usize| format!("{},{},0.1,100,1025,{numbers}\n", 4 * k, k % 60);
        let head = format!("time_s,pressure_dbar,m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3,{}\n", names.join(","));
        let before = computed_s("thread-self", began);
        let _ = of_file("wide.csv", (head + &(0..5).map(row).collect::<String>()).as_bytes());
        computed_s("thread-self", began) - before
    };
    let took = [2_000, 20_000].map(table);
    // Ten times as long where it is linear, a hundred times where it is not.
    assert!(took[1] < 2.0 && took[1] < 30.0 * took[0].max(0.01), "{took:?} s");
}

/// What is imported: a sample, which of its files was changed, and to what; whether it stands alone; whether it is named itself.
#[derive(Clone)]
struct Input {
    sample: usize,
    victim: usize,
    bytes: Vec<u8>,
    alone: bool,
    named: bool,
}

impl Input {
    fn write(&self, sample: &Sample, folder: &Path) -> PathBuf {
        let _ = std::fs::remove_dir_all(folder);
        std::fs::create_dir_all(folder).expect("a folder");
        for (j, (name, sound)) in sample.iter().enumerate().filter(|(j, _)| *j == self.victim || !self.alone) {
            std::fs::write(folder.join(name), if j == self.victim { &self.bytes } else { sound }).expect("written");
        }
        if self.named { folder.join(&sample[self.victim].0) } else { folder.to_path_buf() }
    }
}

/// Imports, and says what was wrong with how it ended; whether there is a flight.
fn import(path: &Path, began: Instant) -> Result<bool, String> {
    let (before, started) = (MEMORY.current_usage(), computed_s("thread-self", began));
    MEMORY.reset_peak_usage();
    let ended = std::panic::catch_unwind(|| crate::import::import_all(&[path.to_path_buf()], &[], None));
    let (took, peak) = (computed_s("thread-self", began) - started, MEMORY.peak_usage().saturating_sub(before));
    if took > MOST_SECONDS {
        return Err(format!("{took} s"));
    }
    if peak > MOST_BYTES {
        return Err(format!("{} MB", peak >> 20));
    }
    match ended.map_err(|_| "panics")? {
        Ok(imported) => {
            let f = imported.flight;
            let times = f.time_s.iter().all(|t| t.is_finite()) && f.time_s.windows(2).all(|w| w[1] > w[0]);
            if !times || f.pressure_pa.iter().any(|p| p.is_infinite()) {
                return Err("a flight with times out of order or infinite pressures".into());
            }
            Ok(true)
        }
        Err(e) if e.to_string().contains('\n') => Err(format!("refused in several lines: {e}")),
        Err(_) => Ok(false),
    }
}

/// Ends the program where one input has computed for far too long: an endless loop ends in no other way. The input stays where it is.
fn watch(inputs: &'static AtomicU64) {
    let thread = std::fs::read_link("/proc/thread-self").map_or_else(|_| "self".into(), |p| p.to_string_lossy().into_owned());
    std::thread::spawn(move || {
        let began = Instant::now();
        let (mut input, mut since) = (u64::MAX, 0.0);
        loop {
            std::thread::sleep(std::time::Duration::from_secs(1));
            let now = computed_s(&thread, began);
            if inputs.load(Ordering::Relaxed) != input {
                (input, since) = (inputs.load(Ordering::Relaxed), now);
            } else if now - since > 4.0 * MOST_SECONDS {
                eprintln!("input {input} hangs; it lies among the temporary files");
                std::process::abort();
            }
        }
    });
}

#[test]
fn prop_damaged_files_end_in_a_flight_or_in_one_line() {
    static INPUTS: AtomicU64 = AtomicU64::new(0);
    if !alone("prop_damaged_files_end_in_a_flight_or_in_one_line") {
        return;
    }
    let count: usize = std::env::var("GLIDER_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(3000);
    let work = std::env::temp_dir().join(format!("glider-mutated-{}", std::process::id()));
    let kept = std::env::var_os("GLIDER_FINDINGS").map_or_else(|| work.with_extension("findings"), PathBuf::from);
    let samples = samples(&work);
    let formats = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats");
    let vehicles = ["og1", "seaexplorer_sub"].map(|f| std::fs::read_to_string(formats.join(f).join("vehicle.json")).expect("a vehicle"));
    let mut random = Random(std::env::var("GLIDER_SEED").ok().and_then(|n| n.parse().ok()).unwrap_or(0x9E37_79B9_7F4A_7C15));
    let (mut coverage, began) = (Coverage::watched(), Instant::now());
    watch(&INPUTS);
    let (mut found, mut findings): (Vec<Input>, Vec<String>) = (Vec::new(), Vec::new());
    let (mut flights, mut refused) = (0, 0);
    for n in 0..count {
        INPUTS.store(n as u64, Ordering::Relaxed);
        if n.is_multiple_of(8) && std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| own_formats(&vehicles, &mut random))).is_err() {
            findings.push(format!("input {n}, a vehicle file, an expression or an array: panics"));
        }
        // Half of them go on from what reached new code.
        let mut input = if !found.is_empty() && random.below(2) == 0 {
            found[random.below(found.len())].clone()
        } else {
            let sample = n % samples.len();
            let victim = random.below(samples[sample].len());
            Input { sample, victim, bytes: samples[sample][victim].1.clone(), alone: false, named: false }
        };
        mutate(&mut input.bytes, &mut random);
        (input.alone, input.named) = (random.below(3) == 0, random.below(2) == 0);
        let path = input.write(&samples[input.sample], &work);
        match import(&path, began) {
            Ok(true) => flights += 1,
            Ok(false) => refused += 1,
            Err(what) => {
                let place = kept.join(n.to_string());
                input.write(&samples[input.sample], &place);
                findings.push(format!("input {n}, {}: {what}", place.join(&samples[input.sample][input.victim].0).display()));
                eprintln!("{}", findings[findings.len() - 1]);
            }
        }
        if coverage.grew() && n > samples.len() {
            found.push(input);
        }
        if (n + 1).is_multiple_of(10_000) || n + 1 == count {
            let (reached, all) = coverage.reached;
            let s = began.elapsed().as_secs();
            eprintln!(
                "{} inputs, {s} s: {flights} flights, {refused} refused, {} failed; {} reached new code: {reached} of {all} regions",
                n + 1,
                findings.len(),
                found.len()
            );
        }
    }
    let _ = std::fs::remove_dir_all(&work);
    assert!(findings.is_empty(), "{findings:#?}");
    assert!(flights > count / 20 && refused > count / 100, "{flights} flights, {refused} refused");
    assert!(coverage.profile.is_none() || !found.is_empty(), "an instrumented build whose profile stays as it is");
}

//! Damaged logs of every format: an import ends in a flight or in one line, never in a panic, a hang or a machine without memory.
//!
//! Seeded, so that a failure can be repeated. GLIDER_MUTATIONS says how many inputs (default 3 000; the full campaign 300 000, with
//! coverage as its guide: `scripts/mutate`). GLIDER_COVERAGE names the profile that an instrumented build keeps up to date: an input
//! that reaches code which none before it reached is changed further.

use std::path::{Path, PathBuf};
use std::time::Instant;

#[global_allocator]
static MEMORY: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

/// Samples are 1 to 70 kB: no import of one may take more.
const MOST_BYTES: usize = 256 << 20;
const MOST_SECONDS: f64 = 5.0;

/// xorshift64*, seeded.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(6) {
        if bytes.is_empty() {
            return;
        }
        // Half of all hits in the first kilobyte, where the structure is.
        let reach = if random.below(2) == 0 { bytes.len().min(1024) } else { bytes.len() };
        let at = random.below(reach);
        match random.below(8) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = [0, 0xFF, 0x7F, 0x80, b'\n', b',', b'9', b'-'][random.below(8)],
            2 => bytes.truncate(at),
            3 => {
                let end = (at + 1 + random.below(64)).min(bytes.len());
                bytes.drain(at..end);
            }
            4 => {
                let end = (at + 1 + random.below(256)).min(bytes.len());
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            5 => {
                let value = [u64::MAX, 1 << 31, 1 << 40, 0, 1_000_000][random.below(5)].to_le_bytes();
                let size = [2, 4, 8][random.below(3)].min(bytes.len() - at);
                bytes[at..at + size].copy_from_slice(&value[..size]);
            }
            6 => {
                let text: &[u8] =
                    [b"1e308".as_slice(), b"nan", b"-9999999999999", b"inf", b"1e-300", b"99999999999999999999"][random.below(6)];
                bytes.splice(at..at, text.iter().copied());
            }
            _ => {
                let other = random.below(bytes.len());
                bytes.swap(at, other);
            }
        }
    }
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> = std::fs::read_dir(folder).expect("samples").map(|e| e.expect("an entry").path()).collect();
    all.retain(|p| p.is_file() && p.extension().is_none_or(|e| e != "json"));
    all.sort();
    all
}

/// Counters of the code reached so far, as an instrumented program keeps them in its profile.
struct Coverage(Option<PathBuf>, usize);

impl Coverage {
    fn watched() -> Self {
        Self(std::env::var_os("GLIDER_COVERAGE").map(PathBuf::from), 0)
    }

    /// Whether anything was reached for the first time since the last call.
    fn grew(&mut self) -> bool {
        let Some(bytes) = self.0.as_ref().and_then(|p| std::fs::read(p).ok()) else { return false };
        // All but the counters stays as it is.
        let reached = bytes.chunks(8).filter(|c| c.iter().any(|b| *b != 0)).count();
        std::mem::replace(&mut self.1, reached) < reached
    }
}

/// Time this thread has computed, s; that of the clock where the system does not tell.
fn computed_s(since: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|t| t.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| since.elapsed().as_secs_f64(), |n| n * 1e-9)
}

/// Damaged vehicle files and flights of the project's own format: read, or refused in one line.
fn own_formats(vehicles: &[String], random: &mut Random) {
    let mut text = match random.below(3) {
        0 => discovery::import::classes::Class::ALL[random.below(6)].draft().toml() + "hull_volume_m3 = 0.06\n",
        _ => vehicles[random.below(vehicles.len())].clone(),
    };
    let toml = !text.starts_with('{');
    let mut rows = String::from("time_s,segment,pressure_dbar,m_pitch_rad,m_ballast_pumped_cc,sci_density_kg_m3\n");
    (0..40).for_each(|i| rows += &format!("{},{},{}.5,-0.4,-200,1025.1\n", 4 * i, i / 20, i % 20));
    for (text, flight) in [(&mut text, false), (&mut rows, true)] {
        let mut bytes = std::mem::take(text).into_bytes();
        mutate(&mut bytes, random);
        let text = String::from_utf8_lossy(&bytes);
        let said = if flight {
            discovery::record::csv::parse(&text, Path::new("f.csv"), "f").err()
        } else {
            discovery::vehicle::parse_text(&text, Path::new(if toml { "v.toml" } else { "v.json" })).err()
        };
        assert!(said.is_none_or(|e| !e.to_string().trim_end().contains('\n')), "{text}");
    }
}

/// The counter of memory is one for all tests.
static ALONE: std::sync::Mutex<()> = std::sync::Mutex::new(());

/// Bytes that an import may take: by the size of the files, and what reading any file takes.
const PER_BYTE: usize = 20;
const FOR_ANY: usize = 16 << 20;

#[test]
fn prop_memory_is_bounded_by_the_size_of_the_files() {
    let _alone = ALONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats");
    let mut folders: Vec<PathBuf> = std::fs::read_dir(&samples).expect("samples").map(|e| e.expect("an entry").path()).collect();
    if let Some(root) = std::env::var_os("GLIDER_FLIGHTS").map(PathBuf::from) {
        let real = ["seaglider_sg561", "seaglider_sg171", "seaexplorer_sea035", "slocum_comet2016/raw", "slocum_comet2019/raw"];
        folders.extend(real.map(|name| root.join(name)));
    }
    for folder in folders {
        let size: u64 = files(&folder).iter().map(|p| std::fs::metadata(p).map_or(0, |m| m.len())).sum();
        let before = MEMORY.current_usage();
        MEMORY.reset_peak_usage();
        let read = discovery::import::import(&folder, &[]).map_or_else(|e| e.to_string(), |i| format!("{} rows", i.flight.len()));
        let peak = MEMORY.peak_usage().saturating_sub(before);
        eprintln!("{}: {} kB take {} kB, {read}", folder.display(), size / 1000, peak / 1000);
        assert!(peak < PER_BYTE * usize::try_from(size).expect("small") + FOR_ANY, "{}: {peak} bytes of {size}", folder.display());
    }
}

/// What has been imported: folder, which of its files was changed, and to what.
type Input = (usize, usize, Vec<u8>);

#[test]
fn prop_damaged_files_end_in_a_flight_or_in_one_line() {
    let _alone = ALONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let count: usize = std::env::var("GLIDER_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(3000);
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats");
    let folders: Vec<Vec<PathBuf>> = std::fs::read_dir(&samples).expect("samples").map(|e| files(&e.expect("an entry").path())).collect();
    let sound: Vec<Vec<Vec<u8>>> = folders.iter().map(|f| f.iter().map(|p| std::fs::read(p).expect("a sample")).collect()).collect();
    let work = std::env::temp_dir().join(format!("glider-mutated-{}", std::process::id()));
    let mut random = Random(std::env::var("GLIDER_SEED").ok().and_then(|n| n.parse().ok()).unwrap_or(0x9E37_79B9_7F4A_7C15));
    let mut coverage = Coverage::watched();
    let vehicles: Vec<String> = folders.iter().filter_map(|f| std::fs::read_to_string(f[0].with_file_name("vehicle.json")).ok()).collect();
    let began = Instant::now();
    let mut found: Vec<Input> = Vec::new();
    let (mut flights, mut refused) = (0, 0);
    for n in 0..count {
        if n.is_multiple_of(8) {
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| own_formats(&vehicles, &mut random)))
                .unwrap_or_else(|_| panic!("input {n}, a vehicle or a flight: panics"));
        }
        // Half of them go on from what reached new code.
        let (k, victim, mut bytes) = if !found.is_empty() && random.below(2) == 0 {
            found[random.below(found.len())].clone()
        } else {
            let k = n % folders.len();
            let victim = random.below(folders[k].len());
            (k, victim, sound[k][victim].clone())
        };
        mutate(&mut bytes, &mut random);
        let _ = std::fs::remove_dir_all(&work);
        std::fs::create_dir_all(&work).expect("a folder");
        // The file alone, or among its sound neighbours.
        let alone = random.below(3) == 0;
        for (j, path) in folders[k].iter().enumerate().filter(|(j, _)| *j == victim || !alone) {
            let content = if j == victim { &bytes } else { &sound[k][j] };
            std::fs::write(work.join(path.file_name().expect("a name")), content).expect("written");
        }
        let named = work.join(folders[k][victim].file_name().expect("a name"));
        let input = if alone || random.below(2) == 0 { named.clone() } else { work.clone() };
        let (before, started) = (MEMORY.current_usage(), computed_s(began));
        MEMORY.reset_peak_usage();
        // The speeds of a current profiler are read beside a flight.
        let mut inputs = vec![input];
        inputs.extend(folders[k][victim].parent().filter(|f| f.ends_with("ad2cp_midas")).map(|f| f.with_file_name("seaexplorer_sub")));
        let ended = std::panic::catch_unwind(|| discovery::import::import_all(&inputs, &[], None));
        let (took, peak) = (computed_s(began) - started, MEMORY.peak_usage().saturating_sub(before));
        let what = format!("input {n}, {}", named.display());
        match ended.unwrap_or_else(|_| panic!("{what}: panics")) {
            Ok(imported) => {
                flights += 1;
                let f = imported.flight;
                assert!(f.time_s.iter().all(|t| t.is_finite()) && f.time_s.windows(2).all(|w| w[1] > w[0]), "{what}: time");
                assert!(f.pressure_pa.iter().all(|p| !p.is_infinite()), "{what}: pressure");
            }
            Err(e) => {
                refused += 1;
                assert!(!e.to_string().contains('\n'), "{what}: {e}");
            }
        }
        assert!(took < MOST_SECONDS, "{what}: {took} s");
        assert!(peak < MOST_BYTES, "{what}: {} MB", peak >> 20);
        if coverage.grew() && n > folders.len() {
            found.push((k, victim, bytes));
        }
        if (n + 1).is_multiple_of(10_000) {
            let reached = coverage.1;
            eprintln!(
                "{} inputs, {} s: {} reached new code, {reached} words of the profile are set",
                n + 1,
                began.elapsed().as_secs(),
                found.len()
            );
        }
    }
    let _ = std::fs::remove_dir_all(&work);
    eprintln!("{count} inputs: {flights} flights, {refused} refused, {} reached new code", found.len());
    assert!(flights > count / 20 && refused > count / 100, "{flights} flights, {refused} refused");
    assert!(coverage.0.is_none() || !found.is_empty(), "an instrumented build whose profile stays as it is");
}

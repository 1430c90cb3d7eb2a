//! Damaged logs of every format: an import ends in a flight or in one line, never in a panic, a hang or a machine without memory.
//!
//! Seeded, so that a failure can be repeated. GLIDER_MUTATIONS says how many inputs (default 3 000; the full campaign 300 000).

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

#[test]
fn prop_damaged_files_end_in_a_flight_or_in_one_line() {
    let count: usize = std::env::var("GLIDER_MUTATIONS").ok().and_then(|n| n.parse().ok()).unwrap_or(3000);
    let samples = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats");
    let folders: Vec<Vec<PathBuf>> = std::fs::read_dir(&samples).expect("samples").map(|e| files(&e.expect("an entry").path())).collect();
    let work = std::env::temp_dir().join(format!("glider-mutated-{}", std::process::id()));
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let (mut flights, mut refused) = (0, 0);
    for n in 0..count {
        let folder = &folders[n % folders.len()];
        let victim = random.below(folder.len());
        let _ = std::fs::remove_dir_all(&work);
        std::fs::create_dir_all(&work).expect("a folder");
        // The file alone, or among its sound neighbours.
        let alone = random.below(3) == 0;
        for (k, path) in folder.iter().enumerate().filter(|(k, _)| *k == victim || !alone) {
            let mut bytes = std::fs::read(path).expect("a sample");
            if k == victim {
                mutate(&mut bytes, &mut random);
            }
            std::fs::write(work.join(path.file_name().expect("a name")), bytes).expect("written");
        }
        let named = work.join(folder[victim].file_name().expect("a name"));
        let input = if alone || random.below(2) == 0 { named.clone() } else { work.clone() };
        let (before, started) = (MEMORY.current_usage(), Instant::now());
        MEMORY.reset_peak_usage();
        let ended = std::panic::catch_unwind(|| discovery::import::import(&input, &[]));
        let (took, peak) = (started.elapsed().as_secs_f64(), MEMORY.peak_usage().saturating_sub(before));
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
    }
    let _ = std::fs::remove_dir_all(&work);
    eprintln!("{count} inputs: {flights} flights, {refused} refused");
    assert!(flights > count / 10 && refused > count / 100, "{flights} flights, {refused} refused");
}

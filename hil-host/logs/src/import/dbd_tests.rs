//! Files are made here by an encoder written for the tests, so no vehicle's file needs to be in the repository.

use super::*;

/// Writes one file of three sensors: time (8 bytes), pitch (4), state (1).
pub struct Encoder {
    order: Order,
    bytes: Vec<u8>,
    previous: [f64; 3],
}

const LIST: &str =
    "s: T    0    0 8 m_present_time timestamp\ns: T    1    1 4 m_pitch rad\ns: F    2   -1 4 m_roll rad\ns: T    3    2 1 x_state enum\n";

fn list_crc() -> String {
    format!("{:08x}", crc::Crc::<u32>::new(&crc::CRC_32_JAMCRC).checksum(LIST.as_bytes()))
}

impl Encoder {
    fn new(order: Order, factored: bool) -> Self {
        let header = format!(
            "dbd_label:    DBD(dinkum_binary_data)file\nencoding_ver:    5\nnum_ascii_tags:    14\nall_sensors:    T\nthe8x3_filename:    00010001\nfull_filename:    ours-2026-001-0-1\nfilename_extension:    dbd\nmission_name:    OURS.MI\nfileopen_time:    Thu_Jan__1_00:00:00_2026\ntotal_num_sensors:    4\nsensors_per_cycle:    3\nstate_bytes_per_cycle:    1\nsensor_list_crc:    {}\nsensor_list_factored:    {}\n",
            list_crc().to_uppercase(),
            u8::from(factored)
        );
        let mut out = Self { order, bytes: header.into_bytes(), previous: [f64::NAN; 3] };
        if !factored {
            out.bytes.extend(LIST.bytes());
        }
        out.bytes.extend(b"sa");
        out.put(2, f64::from(0x1234));
        out.put(4, f64::from(123.456_f32));
        out.put(8, 123_456_789.123_45);
        // The opening cycle: old values under the time of the first true cycle.
        out.cycle([1000.0, -9.0, 77.0]);
        out
    }

    fn put(&mut self, size: usize, value: f64) {
        let mut bytes = match size {
            1 => vec![(value as i8).cast_unsigned()],
            2 => (value as i16).to_le_bytes().to_vec(),
            4 => (value as f32).to_le_bytes().to_vec(),
            _ => value.to_le_bytes().to_vec(),
        };
        if self.order == Order::Big {
            bytes.reverse();
        }
        self.bytes.extend(bytes);
    }

    fn cycle(&mut self, values: [f64; 3]) {
        let mut state = 0_u8;
        let mut fresh = Vec::new();
        for (k, value) in values.into_iter().enumerate() {
            let bits = if value.is_nan() {
                0
            } else if value == self.previous[k] {
                1
            } else {
                fresh.push(([8, 4, 1][k], value));
                self.previous[k] = value;
                2
            };
            state |= bits << (6 - 2 * k);
        }
        self.bytes.extend([b'd', state]);
        for (size, value) in fresh {
            self.put(size, value);
        }
    }

    fn end(mut self) -> Vec<u8> {
        self.bytes.push(b'X');
        self.bytes
    }
}

fn values(k: usize) -> [f64; 3] {
    let pitch = if k % 3 == 2 { f64::NAN } else { f64::from((0.01 * (k / 2) as f64) as f32) };
    [1000.0 + k as f64 * 4.0, pitch, f64::from((k / 5) as u8)]
}

fn file(order: Order, factored: bool, cycles: usize) -> Vec<u8> {
    let mut out = Encoder::new(order, factored);
    for k in 0..cycles {
        out.cycle(values(k));
    }
    out.end()
}

fn lz4(bytes: &[u8], block: usize) -> Vec<u8> {
    bytes
        .chunks(block)
        .flat_map(|plain| {
            let packed = lz4_flex::block::compress(plain);
            [(packed.len() as u16).to_be_bytes().to_vec(), packed].concat()
        })
        .collect()
}

fn read_all(bytes: &[u8]) -> DbdFile {
    read(bytes, |crc| (crc == list_crc()).then(|| LIST.as_bytes().to_vec()), |_| true).expect("a readable file")
}

fn assert_cycles(file: &DbdFile, cycles: impl Iterator<Item = usize>) {
    let cycles: Vec<usize> = cycles.collect();
    assert_eq!(file.cycles, cycles.len());
    for (row, k) in cycles.into_iter().enumerate() {
        for (name, want) in ["m_present_time", "m_pitch", "x_state"].into_iter().zip(values(k)) {
            let got = file.columns[name].1[row];
            assert!(got == want || (got.is_nan() && want.is_nan()), "cycle {k} {name}: {got} instead of {want}");
        }
    }
}

#[test]
fn prop_decoding_undoes_encoding_in_both_byte_orders_and_packings() {
    for order in [Order::Little, Order::Big] {
        for factored in [false, true] {
            let plain = file(order, factored, 200);
            for bytes in [plain.clone(), lz4(&plain, 700), lz4(&plain, LZ4_BLOCK)] {
                let read = read_all(&bytes);
                assert_eq!(read.problems, Vec::<String>::new());
                assert_eq!(read.columns["m_pitch"].0, "rad");
                assert!(!read.columns.contains_key("m_roll"), "not stored in this file");
                assert_cycles(&read, 0..200);
            }
        }
    }
}

#[test]
fn the_opening_cycle_is_no_sample_but_serves_as_before() {
    let mut out = Encoder::new(Order::Little, true);
    out.cycle([1000.0, f64::NAN, 77.0]);
    out.cycle([1004.0, 0.25, 77.0]);
    let read = read_all(&out.end());
    assert_eq!(read.cycles, 2);
    assert_eq!(read.columns["m_present_time"].1, [1000.0, 1004.0]);
    assert_eq!(read.columns["x_state"].1, [77.0, 77.0]);
    let pitch = &read.columns["m_pitch"].1;
    assert!(pitch[0].is_nan() && pitch[1] == 0.25, "{pitch:?}");
}

/// A file that does not open with such a cycle keeps its first one.
#[test]
fn a_first_cycle_with_a_silent_sensor_is_a_sample() {
    let mut out = Encoder::new(Order::Little, true);
    let opening = out.bytes.len() - (2 + 8 + 4 + 1);
    out.bytes.truncate(opening);
    out.previous = [f64::NAN; 3];
    out.cycle([1000.0, f64::NAN, 3.0]);
    assert_eq!(read_all(&out.end()).columns["m_present_time"].1, [1000.0]);
}

#[test]
fn a_damaged_block_names_itself_and_the_rest_is_kept() {
    let plain = file(Order::Little, true, 600);
    let mut bytes = lz4(&plain, 1000);
    // Walk to block 3 and spoil its first token.
    let mut at = 0;
    for _ in 0..3 {
        at += 2 + usize::from(u16::from_be_bytes([bytes[at], bytes[at + 1]]));
    }
    bytes[at + 2..at + 12].fill(0xFF);
    let read = read_all(&bytes);
    assert!(read.problems[0].starts_with(&format!("block 3 at byte {at} is damaged")), "{:?}", read.problems);
    let time = &read.columns["m_present_time"].1;
    assert!(read.cycles > 450 && read.cycles < 600, "{} cycles", read.cycles);
    assert!(time.windows(2).all(|w| w[1] > w[0]), "time runs on after the hole");
    assert_eq!(time.last(), Some(&values(599)[0]));
}

#[test]
fn a_stray_byte_costs_a_few_cycles_not_the_file() {
    let mut bytes = file(Order::Little, true, 300);
    let middle = bytes.len() / 2;
    bytes.splice(middle..middle + 3, [0xAA; 5]);
    let read = read_all(&bytes);
    assert!(!read.problems.is_empty());
    assert!(read.cycles > 280, "{} cycles of 300", read.cycles);
    assert_eq!(read.columns["m_present_time"].1.last(), Some(&values(299)[0]));
}

#[test]
fn a_cut_file_keeps_what_is_there() {
    let bytes = file(Order::Big, true, 100);
    let read = read_all(&bytes[..bytes.len() - 8]);
    assert!(read.problems[0].contains("cut"), "{:?}", read.problems);
    assert_cycles(&read, 0..99);
}

#[test]
fn what_is_missing_is_said() {
    let bytes = file(Order::Little, true, 3);
    let none = |_: &str| None;
    let refused = |bytes: &[u8], why: &str| assert!(read(bytes, none, |_| true).is_err_and(|e| e.contains(why)), "{why}");
    refused(&bytes, &format!("needs its sensor list {}.cac", list_crc()));
    refused(b"", "no dbd_label");
    refused(b"\x00\x04abcd", "no dbd_label");
    refused(&bytes[..60], "damaged header");
}

#[test]
fn prop_noise_never_panics() {
    let plain = file(Order::Little, true, 50);
    let packed = lz4(&plain, 300);
    let mut state = 7_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    };
    for _ in 0..3000 {
        let mut bytes = if random() % 2 == 0 { plain.clone() } else { packed.clone() };
        for _ in 0..1 + random() % 6 {
            let at = random() % bytes.len();
            bytes[at] = random() as u8;
        }
        bytes.truncate(1 + random() % (2 * bytes.len()));
        // Refused or read; both are fine.
        let _ = read(&bytes, |_| Some(LIST.as_bytes().to_vec()), |_| true);
    }
}

#[test]
fn a_list_that_is_not_the_one_of_its_name_is_refused() {
    let bytes = file(Order::Little, true, 20);
    let other = LIST.replace("m_pitch rad", "m_depth m");
    let e = read(&bytes, |_| Some(other.clone().into_bytes()), |_| true).expect_err("refused");
    assert!(e.to_string().contains("checksum"), "{e}");
    // Line ends that a mail program changed do no harm.
    assert!(read(&bytes, |_| Some(LIST.replace('\n', "\r\n").into_bytes()), |_| true).is_ok());
}

#[test]
fn a_small_file_that_unpacks_to_a_large_one_is_cut() {
    let mut plain = file(Order::Little, false, 20);
    plain.pop();
    let old = plain.len();
    // Cycles of two bytes that repeat three values each.
    plain.extend([b'd', 0b0101_0100].repeat(8 << 20));
    let packed = lz4(&plain, 32 << 10);
    assert!(packed.len() < 200_000, "{}", packed.len());
    let read = read_all(&packed);
    assert!(read.problems.iter().any(|p| p.contains("more than 20 times")), "{:?}", read.problems);
    let cells: usize = read.columns.values().map(|c| c.1.len()).sum();
    assert!(8 * cells < 20 * packed.len() + (12 << 20), "{cells} cells of {} packed bytes, {old}", packed.len());
}

/// With a long list of sensors every byte of damage that looks like a cycle was decoded whole, four times: minutes for some megabytes.
#[test]
fn regress_looking_for_a_cycle_after_damage_ends() {
    let sensor = Sensor { name: "x".into(), unit: String::new(), bytes: 8, stored: true };
    let sensors = vec![sensor; 1000];
    let damage = vec![b'd'; 5000];
    let mut decoder = Decoder::new(&sensors, 250, Order::Little, |_| true);
    (decoder.steps, decoder.cycles) = (100_000, 1);
    let mut problems = Vec::new();
    decoder.stretch("here", &damage, &mut problems);
    assert_eq!(problems, ["5000 bytes after here have no whole cycle"]);
    // 4 x 1000 states a place.
    assert_eq!(decoder.steps, 0);
    // What is sound after a small hole is found.
    let mut bytes = vec![0xee, b'd', 0xff];
    (0..6).for_each(|_| bytes.extend([&[b'd'][..], &[0; 250]].concat()));
    let mut decoder = Decoder { steps: 100_000, cycles: 1, ..Decoder::new(&sensors, 250, Order::Little, |_| true) };
    decoder.stretch("here", &bytes, &mut Vec::new());
    assert!(decoder.cycles >= 5 && decoder.steps < 100_000, "{}", decoder.cycles);
}

#[test]
fn regress_what_stands_behind_a_list_that_is_cut_is_shown_in_few_letters() {
    let text = file(Order::Little, false, 60);
    let last = b"s: T    3    2 1 x_state enum\n";
    let at = text.windows(last.len()).position(|w| w == last).expect("the last line");
    let cut = [&text[..at], &text[at + last.len()..]].concat();
    let e = read(&cut, |_| None, |_| true).expect_err("refused").to_string();
    assert!(e.contains("sensor list") && e.len() < 120 && e.bytes().all(|b| (b' '..=b'~').contains(&b)), "{e:?}");
}

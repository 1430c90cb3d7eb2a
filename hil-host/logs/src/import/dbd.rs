//! Reads one Slocum binary data file: dbd, ebd, sbd, tbd, mbd, nbd and their LZ4 forms dcd, ecd, scd, tcd, mcd, ncd.
//!
//! Layout (Teledyne Webb Research, "Dinkum binary data format"):
//! ```text
//! header      ASCII lines "key: value"; num_ascii_tags says how many
//! sensor list ASCII lines "s: T|F index stored_index bytes name unit"; when factored it is in a
//!             cache file instead, named by sensor_list_crc: 11d38bfd.cac (or LZ4: .ccc)
//! known cycle 's' 'a' int16 0x1234 float 123.456 double 123456789.12345: tells the byte order
//! cycles      'd', two bits of state per stored sensor (0 nothing, 1 as before, 2 new value follows),
//!             the new values in sensor order; the file ends with 'X'
//! opening     the first cycle, in which every sensor has a new value: the last one it had, whenever that was
//!             taken, under the time of opening. No samples, so it only serves "as before"
//! ```
//! LZ4 forms are a run of blocks, each with a two-byte big-endian length; a block
//! holds up to 32 KiB and stands alone.
//!
//! A damaged stretch is named by its place and skipped: reading goes on at the
//! next place from which several cycles follow one another without fault, and
//! "as before" is not believed across the hole.

use std::collections::BTreeMap;

use super::report::shown;

/// One sensor of the list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sensor {
    /// Name, e.g. `m_pitch`.
    pub name: String,
    /// Unit as the vehicle writes it, e.g. `rad`.
    pub unit: String,
    /// Bytes of one value: 1, 2, 4 or 8.
    pub bytes: usize,
    /// Whether this file stores it.
    stored: bool,
}

/// A sensor list: from the file itself or from its cache file.
pub type SensorList = Vec<Sensor>;

/// A decoded file.
#[derive(Clone, Debug)]
pub struct DbdFile {
    /// Header lines.
    pub header: BTreeMap<String, String>,
    /// Unit and values of the sensors asked for and stored; NaN where a cycle has none.
    pub columns: BTreeMap<String, (String, Vec<f64>)>,
    /// Number of cycles.
    pub cycles: usize,
    /// What was damaged, and where.
    pub problems: Vec<String>,
}

const NOT_DBD: &str = "is not a Slocum binary file (no dbd_label)";

fn header_of(what: &str) -> String {
    format!("has a damaged header: {what}")
}

fn list_of(what: &str) -> String {
    format!("has a damaged sensor list: \"{what}\"")
}

/// Bytes that follow one another without a hole, with their place in the file for messages.
struct Stretch {
    place: String,
    bytes: Vec<u8>,
}

/// Reads a file; `cache` is asked for the sensor list of a factored file by its crc, `wanted` which sensors to keep.
///
/// # Errors
/// Why it cannot be read at all, as the end of a sentence about it.
pub fn read(bytes: &[u8], cache: impl Fn(&str) -> Option<Vec<u8>>, wanted: impl Fn(&str) -> bool) -> Result<DbdFile, String> {
    let mut problems = Vec::new();
    let stretches = stretches(bytes, b"dbd_label", &mut problems).ok_or(NOT_DBD)?;
    let (first, others) = stretches.split_first().ok_or(NOT_DBD)?;
    let (header, mut rest) = header(&first.bytes)?;
    let entry = |key: &str| header.get(key).map(String::as_str).ok_or_else(|| header_of(&format!("no {key}")));
    let count = |key: &str| -> Result<usize, String> {
        entry(key)?.parse().map_err(|_| header_of(&format!("{key}: {}", header.get(key).map_or("", String::as_str))))
    };
    let total = count("total_num_sensors")?;
    let per_cycle = count("sensors_per_cycle")?;
    let state_bytes = count("state_bytes_per_cycle")?;
    if state_bytes != per_cycle.div_ceil(4) {
        return Err(header_of(&format!("{state_bytes} state bytes cannot hold {per_cycle} sensors")));
    }
    let sensors = if entry("sensor_list_factored")? == "0" {
        let (sensors, after) = sensor_list(rest, total)?;
        rest = after;
        sensors
    } else {
        let crc = entry("sensor_list_crc")?.to_ascii_lowercase();
        let text = cache(&crc).ok_or_else(|| {
            format!(
                "needs its sensor list {crc}.cac: put it beside the file or in a folder cac or cache there, or name its folder with --cache"
            )
        })?;
        let text = stretches_text(&text);
        if !has_crc(&text, &crc) {
            return Err(format!(
                "needs its sensor list {crc}.cac, and the file of this name does not have the checksum it is named by: fetch it again"
            ));
        }
        sensor_list(&text, total)?.0
    };
    let stored: Vec<Sensor> = sensors.into_iter().filter(|s| s.stored).collect();
    if stored.len() != per_cycle {
        return Err(list_of(&format!("{} sensors are marked as stored, the header says {per_cycle}", stored.len())));
    }
    let (order, rest) =
        known_cycle(rest).ok_or("has no known cycle after the header: the sensor list does not belong to it or it is cut")?;
    let mut decoder = Decoder::new(&stored, state_bytes, order, wanted);
    decoder.room = 8 * (bytes.len() * UNPACKED / 4 + SMALLEST);
    decoder.steps = bytes.len().saturating_mul(STATES_AFTER_A_HOLE).saturating_add(SMALLEST);
    decoder.stretch(&first.place, rest, &mut problems);
    for stretch in others {
        decoder.hole();
        decoder.stretch(&stretch.place, &stretch.bytes, &mut problems);
    }
    let Decoder { columns, cycles, .. } = decoder;
    let columns = stored.iter().zip(columns).filter_map(|(s, c)| c.map(|c| (s.name.clone(), (s.unit.clone(), c)))).collect();
    Ok(DbdFile { header, columns, cycles, problems })
}

/// Whether a sensor list has the checksum it is named by: CRC-32 without the last inversion, over its text.
fn has_crc(text: &[u8], name: &str) -> bool {
    let sum = crc::Crc::<u32>::new(&crc::CRC_32_JAMCRC);
    let of = |bytes: &[u8]| format!("{:08x}", sum.checksum(bytes));
    // Mail and editors change the ends of lines.
    of(text) == name || of(&text.iter().copied().filter(|b| *b != b'\r').collect::<Vec<_>>()) == name
}

/// Text of a cache file, plain or LZ4.
fn stretches_text(bytes: &[u8]) -> Vec<u8> {
    stretches(bytes, b"s: ", &mut Vec::new()).map_or_else(Vec::new, |s| s.into_iter().flat_map(|s| s.bytes).collect())
}

/// The file as it is if it starts with `start`, else its LZ4 blocks if those do.
fn stretches(bytes: &[u8], start: &[u8], problems: &mut Vec<String>) -> Option<Vec<Stretch>> {
    if bytes.starts_with(start) {
        return Some(vec![Stretch { place: "the header".into(), bytes: bytes.to_vec() }]);
    }
    let mut out: Vec<Stretch> = Vec::new();
    let (mut at, mut block, mut joined) = (0, 0, false);
    let room = bytes.len() * UNPACKED + SMALLEST;
    while let Some([a, b]) = bytes.get(at..at + 2) {
        let length = usize::from(u16::from_be_bytes([*a, *b]));
        let Some(packed) = bytes.get(at + 2..at + 2 + length) else {
            problems.push(format!("block {block} at byte {at} is cut: {length} bytes promised, {} there", bytes.len() - at - 2));
            break;
        };
        match lz4_flex::block::decompress(packed, LZ4_BLOCK) {
            Ok(plain) if block > 0 || plain.starts_with(start) => match out.last_mut() {
                Some(last) if joined => last.bytes.extend(plain),
                _ => out.push(Stretch { place: format!("block {block} at byte {at}"), bytes: plain }),
            },
            Ok(_) => return None,
            Err(e) if block > 0 => {
                problems.push(format!("block {block} at byte {at} is damaged ({e}); its {length} bytes are skipped"));
                joined = false;
                (at, block) = (at + 2 + length, block + 1);
                continue;
            }
            Err(_) => return None,
        }
        joined = true;
        (at, block) = (at + 2 + length, block + 1);
        let plain: usize = out.last().map_or(0, |s| s.bytes.len());
        if plain > room {
            problems.push(format!("unpacks to more than {UNPACKED} times its {} bytes: cut at byte {at}", bytes.len()));
            break;
        }
    }
    (!out.is_empty()).then_some(out)
}

/// A packed log is at most so many times smaller than it is plain (usual: 3), and its values than its bytes; and this much more.
const UNPACKED: usize = 20;
const SMALLEST: usize = 1 << 20;

/// States looked at for a cycle after a hole, for each byte of a file: noise of 500 sensors takes 8.
const STATES_AFTER_A_HOLE: usize = 200;

/// Largest plain size of a block, bytes.
const LZ4_BLOCK: usize = 32 * 1024;

type Header = BTreeMap<String, String>;

fn header(bytes: &[u8]) -> Result<(Header, &[u8]), String> {
    let mut header = BTreeMap::new();
    let mut rest = bytes;
    let mut lines = 14;
    while header.len() < lines {
        let end = rest.iter().position(|b| *b == b'\n').ok_or_else(|| header_of("it is cut"))?;
        let line = String::from_utf8_lossy(&rest[..end]);
        let (key, value) = line.split_once(':').ok_or_else(|| header_of(&format!("\"{line}\"")))?;
        header.insert(key.trim().to_owned(), value.trim().to_owned());
        if let Some(n) = header.get("num_ascii_tags") {
            lines = n.parse().map_err(|_| header_of(&format!("num_ascii_tags: {n}")))?;
        }
        rest = &rest[end + 1..];
    }
    Ok((header, rest))
}

fn sensor_list(bytes: &[u8], total: usize) -> Result<(SensorList, &[u8]), String> {
    let mut out = Vec::with_capacity(total.min(1 << 16));
    let mut rest = bytes;
    while out.len() < total {
        let end = rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
        let line = String::from_utf8_lossy(&rest[..end]);
        let fields: Vec<&str> = line.split_whitespace().collect();
        // What stands behind a list that is cut is binary.
        let plain = || shown(&line).replace(|c: char| !c.is_ascii_graphic() && c != ' ', "?");
        let bad = || list_of(&format!("{} (line {} of {total})", plain(), out.len() + 1));
        let [tag, in_use, _, index, bytes, name, unit @ ..] = fields.as_slice() else { return Err(bad()) };
        let size: usize = bytes.parse().map_err(|_| bad())?;
        if *tag != "s:" || ![1, 2, 4, 8].contains(&size) {
            return Err(bad());
        }
        out.push(Sensor {
            name: (*name).to_owned(),
            unit: unit.first().copied().unwrap_or("").to_owned(),
            bytes: size,
            stored: *in_use == "T" && *index != "-1",
        });
        rest = rest.get(end + 1..).unwrap_or(&[]);
    }
    Ok((out, rest))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    Little,
    Big,
}

fn known_cycle(bytes: &[u8]) -> Option<(Order, &[u8])> {
    let [b's', b'a', a, b, rest @ ..] = bytes else { return None };
    let order = match (i16::from_le_bytes([*a, *b]), i16::from_be_bytes([*a, *b])) {
        (0x1234, _) => Order::Little,
        (_, 0x1234) => Order::Big,
        _ => return None,
    };
    let (float, rest) = rest.split_first_chunk::<4>()?;
    let (double, rest) = rest.split_first_chunk::<8>()?;
    let (float, double) = match order {
        Order::Little => (f32::from_le_bytes(*float), f64::from_le_bytes(*double)),
        Order::Big => (f32::from_be_bytes(*float), f64::from_be_bytes(*double)),
    };
    ((float - 123.456).abs() < 1e-3 && (double - 123_456_789.123_45).abs() < 1e-3).then_some((order, rest))
}

/// So many cycles in a row without fault are not chance: each has a tag (1 in 256) and no forbidden state.
const CYCLES_TO_TRUST: usize = 4;

struct Decoder<'a> {
    sensors: &'a [Sensor],
    state_bytes: usize,
    order: Order,
    columns: Vec<Option<Vec<f64>>>,
    previous: Vec<f64>,
    cycles: usize,
    ended: bool,
    /// The next cycle is the first of the file.
    opening: bool,
    /// Bytes that values may still take: a cycle of a few bytes can repeat them all.
    room: usize,
    /// States that may still be looked at for a cycle after a hole: with a long list of sensors each byte of damage may look like one.
    steps: usize,
}

impl<'a> Decoder<'a> {
    fn new(sensors: &'a [Sensor], state_bytes: usize, order: Order, wanted: impl Fn(&str) -> bool) -> Self {
        let columns = sensors.iter().map(|s| wanted(&s.name).then(Vec::new)).collect();
        Self {
            sensors,
            state_bytes,
            order,
            columns,
            previous: vec![f64::NAN; sensors.len()],
            cycles: 0,
            ended: false,
            opening: true,
            room: usize::MAX,
            steps: usize::MAX,
        }
    }

    /// Something is missing here: no value is known any more.
    fn hole(&mut self) {
        self.previous.fill(f64::NAN);
        self.opening = false;
    }

    fn stretch(&mut self, place: &str, bytes: &[u8], problems: &mut Vec<String>) {
        let mut at = 0;
        // Bytes after a hole start in the middle of a cycle.
        let mut lost = self.cycles > 0 && self.previous.iter().all(|v| v.is_nan());
        while at < bytes.len() && !self.ended {
            if lost {
                let Some(next) = self.next_trusted(bytes, at) else {
                    problems.push(format!("{} bytes after {place} have no whole cycle", bytes.len() - at));
                    return;
                };
                if next > at {
                    problems.push(format!("{} bytes skipped after {place}, byte {at} of it", next - at));
                }
                (at, lost) = (next, false);
            }
            match bytes[at] {
                b'X' => self.ended = true,
                b'd' => match self.cycle_length(&bytes[at..]) {
                    Some(_) if self.room < 8 * self.columns.len() => {
                        problems.push(format!("holds more values than a file of its size: cut after {} cycles", self.cycles));
                        self.ended = true;
                    }
                    Some(length) => {
                        self.cycle(&bytes[at..at + length]);
                        at += length;
                    }
                    None if self.fits(&bytes[at..]) => {
                        problems.push(format!("cycle {} after {place}, byte {at} of it, has a state that does not exist", self.cycles));
                        self.hole();
                        (at, lost) = (at + 1, true);
                    }
                    None => {
                        problems.push(format!("the last cycle is cut ({} bytes after {place}, byte {at} of it)", bytes.len() - at));
                        return;
                    }
                },
                tag => {
                    problems.push(format!("tag {tag:#04x} instead of a cycle after {place}, byte {at} of it"));
                    self.hole();
                    (at, lost) = (at + 1, true);
                }
            }
        }
    }

    /// Whether the state bytes are there at all.
    fn fits(&self, bytes: &[u8]) -> bool {
        bytes.len() > self.state_bytes && self.states(bytes).any(|s| s == 3)
    }

    fn states<'b>(&self, cycle: &'b [u8]) -> impl Iterator<Item = u8> + use<'b> {
        let sensors = self.sensors.len();
        cycle.iter().skip(1).take(self.state_bytes).flat_map(|b| [b >> 6, (b >> 4) & 3, (b >> 2) & 3, b & 3]).take(sensors)
    }

    /// Bytes of the cycle at the start of `bytes`; `None` if it is no cycle or not whole.
    fn cycle_length(&self, bytes: &[u8]) -> Option<usize> {
        if bytes.first() != Some(&b'd') || bytes.len() < 1 + self.state_bytes {
            return None;
        }
        let mut length = 1 + self.state_bytes;
        for (state, sensor) in self.states(bytes).zip(self.sensors) {
            match state {
                0 | 1 => {}
                2 => length += sensor.bytes,
                _ => return None,
            }
        }
        (length <= bytes.len()).then_some(length)
    }

    /// The first place from `at` on from which several cycles follow, as far as there are steps left to look for it.
    fn next_trusted(&mut self, bytes: &[u8], at: usize) -> Option<usize> {
        let each = CYCLES_TO_TRUST * self.sensors.len().max(1);
        let mut looked_at = 0;
        let places = (at..bytes.len()).filter(|k| bytes[*k] == b'd').take(self.steps / each);
        let found = places.inspect(|_| looked_at += 1).find(|k| self.trusted(&bytes[*k..]));
        self.steps -= looked_at * each;
        found
    }

    /// Whether several cycles, or the end, follow from here.
    fn trusted(&self, bytes: &[u8]) -> bool {
        let mut rest = bytes;
        for k in 0..CYCLES_TO_TRUST {
            match self.cycle_length(rest) {
                Some(length) => rest = &rest[length..],
                None => return k > 1 && (rest.is_empty() || rest.first() == Some(&b'X')),
            }
        }
        true
    }

    fn cycle(&mut self, bytes: &[u8]) {
        let mut at = 1 + self.state_bytes;
        let states: Vec<u8> = self.states(bytes).collect();
        let opening = std::mem::take(&mut self.opening) && states.iter().all(|s| *s == 2);
        for (k, state) in states.into_iter().enumerate() {
            let value = match state {
                1 => self.previous[k],
                2 => {
                    let size = self.sensors[k].bytes;
                    let value = number(&bytes[at..at + size], self.order);
                    at += size;
                    self.previous[k] = value;
                    value
                }
                _ => f64::NAN,
            };
            if let Some(column) = &mut self.columns[k]
                && !opening
            {
                column.push(value);
                self.room = self.room.saturating_sub(8);
            }
        }
        self.cycles += usize::from(!opening);
    }
}

fn number(bytes: &[u8], order: Order) -> f64 {
    let little = order == Order::Little;
    match *bytes {
        [a] => f64::from(a.cast_signed()),
        [a, b] => f64::from(if little { i16::from_le_bytes([a, b]) } else { i16::from_be_bytes([a, b]) }),
        [a, b, c, d] => f64::from(if little { f32::from_le_bytes([a, b, c, d]) } else { f32::from_be_bytes([a, b, c, d]) }),
        [a, b, c, d, e, f, g, h] => {
            let bytes = [a, b, c, d, e, f, g, h];
            if little { f64::from_le_bytes(bytes) } else { f64::from_be_bytes(bytes) }
        }
        _ => f64::NAN,
    }
}

#[cfg(test)]
#[path = "dbd_tests.rs"]
mod tests;

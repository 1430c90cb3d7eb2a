//! Short messages of surfacings ([`signals::surfacing`]) as they reach the shore: files of them, or lines of a glider's terminal.

use super::log::degraded;
use anyhow::{bail, ensure};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use signals::Surfacing;
use signals::surfacing::{Glide, MOST_BYTES, SURFACING_BYTES};

/// What stands before a piece of a message on the glider's terminal.
const HEAD: &[u8] = b"surfacing,";

/// What a file says.
#[derive(Debug, Default)]
pub struct Received {
    /// Messages, and where each stands.
    pub messages: Vec<(String, Surfacing)>,
    /// Where one stands that cannot be read, and why.
    pub damaged: Vec<(String, String)>,
}

impl Received {
    /// Takes bytes in which messages stand one after another, whole ones and begun ones; `place` says where a byte stands.
    fn take(&mut self, bytes: &[u8], place: impl Fn(usize) -> String) {
        let (mut at, mut skipped) = (0, None);
        while at < bytes.len() {
            let rest = &bytes[at..];
            let whole = [SURFACING_BYTES, MOST_BYTES].into_iter().find_map(|n| Surfacing::decode(rest.get(..n)?).ok().map(|m| (n, m)));
            if let Some((length, message)) = whole {
                self.damage(skipped.take(), bytes, &place);
                self.messages.push((place(at), message));
                at += length;
            } else {
                skipped.get_or_insert(at);
                at += 1;
            }
        }
        self.damage(skipped, bytes, &place);
    }

    /// A message that cannot be read begins at `from`.
    fn damage(&mut self, from: Option<usize>, bytes: &[u8], place: impl Fn(usize) -> String) {
        if let Some(from) = from {
            let rest = &bytes[from..];
            let length = if rest.first() == Some(&2) { MOST_BYTES } else { SURFACING_BYTES };
            let why = rest
                .get(..length)
                .map_or_else(|| "cut short".to_owned(), |m| Surfacing::decode(m).map_or_else(|e| format!("{e:?}"), |_| String::new()));
            self.damaged.push((place(from), why));
        }
    }
}

/// Whether a file that begins with these bytes is one of messages: its first is whole, or it has a line with a piece of one.
#[must_use]
pub fn begins(bytes: &[u8]) -> bool {
    let first = [SURFACING_BYTES, MOST_BYTES].iter().any(|n| bytes.get(..*n).is_some_and(|m| Surfacing::decode(m).is_ok()));
    first || bytes.windows(HEAD.len()).any(|w| w == HEAD) && read(bytes).is_ok_and(|r| !r.messages.is_empty())
}

/// Reads a file: messages of 54 or 163 bytes one after another, or a terminal's text with lines of their pieces.
///
/// # Errors
/// There is none in it, or all are damaged.
pub fn read(bytes: &[u8]) -> anyhow::Result<Received> {
    let mut received = Received::default();
    let mut text = false;
    // Bytes of the lines so far, and where each line's begin.
    let (mut stream, mut places): (Vec<u8>, Vec<(usize, String)>) = (Vec::new(), Vec::new());
    let mut no_pieces = Vec::new();
    for (number, line) in bytes.split(|b| *b == b'\n').enumerate() {
        let Some(at) = line.windows(HEAD.len()).position(|w| w == HEAD) else { continue };
        text = true;
        let from = at + HEAD.len();
        let place = format!("line {}, column {}", number + 1, from + 1);
        let is_digit = |b: &&u8| b.is_ascii_alphanumeric() || b"+/=".contains(b);
        let block: Vec<u8> = line[from..].iter().take_while(is_digit).copied().collect();
        match STANDARD.decode(block) {
            Ok(piece) => {
                places.push((stream.len(), place));
                stream.extend(piece);
            }
            Err(why) => no_pieces.push((place, why.to_string())),
        }
    }
    if text {
        let place = |at: usize| places.iter().rev().find(|p| p.0 <= at).map_or_else(String::new, |p| p.1.clone());
        received.take(&stream, place);
        received.damaged.extend(no_pieces);
    } else {
        received.take(bytes, |at| format!("byte {at}"));
        ensure!(
            !received.messages.is_empty() || bytes.len() >= SURFACING_BYTES,
            "no messages of a surfacing: neither {SURFACING_BYTES} or {MOST_BYTES} bytes each (it has {}) nor lines of a glider's terminal with `surfacing,`",
            bytes.len()
        );
    }
    if let (true, Some((place, why))) = (received.messages.is_empty(), received.damaged.first()) {
        bail!("{place}: damaged ({why}); fetch the file again, or the next one");
    }
    Ok(received)
}

/// Way in depth that the law's table says of the glides, m.
#[must_use]
pub fn way_by_table_m(glide: &Glide) -> f64 {
    f64::from(glide.speed_m_s) * f64::from(glide.path_rad).sin().abs() * f64::from(glide.time_s)
}

fn glide(g: &Glide) -> Value {
    json!({ "time_s": g.time_s, "way_m": g.way_m, "way_by_table_m": way_by_table_m(g), "pitch_deg": g.pitch_rad.to_degrees(),
        "path_deg": g.path_rad.to_degrees(), "speed_m_s": g.speed_m_s })
}

/// A message as JSON.
#[must_use]
pub fn document(place: &str, m: &Surfacing) -> Value {
    let [down, up] = &m.glides;
    json!({ "place": place, "phase": format!("{:?}", m.phase), "abort": m.abort.map(|a| format!("{a:?}")), "leak": format!("{:?}", m.leak),
        "weight": format!("{:?}", m.weight), "fix": m.surface.gps_fix, "comms": m.surface.comms, "seq": m.seq, "time_s": m.time_s,
        "dives": m.dives, "degraded": degraded(m.flags), "table": format!("{:08x}", m.table_id), "deepest_m": m.deepest_m, "battery_v": m.battery_v,
        "charge": m.charge, "hull_pa": m.vacuum_pa, "glides": { "down": glide(down), "up": glide(up) } })
}

/// A message for a person, at most 80 columns.
#[must_use]
pub fn rows(place: &str, m: &Surfacing) -> Vec<String> {
    let abort = m.abort.map_or_else(|| "no abort".to_owned(), |a| format!("aborted: {a:?}"));
    let known =
        |value: Option<f32>, scale: f32, unit: &str| value.map_or_else(|| "unknown".to_owned(), |v| format!("{:.1} {unit}", v * scale));
    let yes = |is: bool| if is { "yes" } else { "no" };
    let flags = degraded(m.flags);
    let mut rows = vec![
        format!("{place}: frame {}, {} s after the start", m.seq, m.time_s),
        format!("state          {:?}, {abort}, {} dives, table {:08x}", m.phase, m.dives, m.table_id),
        format!("hull           leak {:?}, weight {:?}, pressure {} at most", m.leak, m.weight, known(m.vacuum_pa, 1e-3, "kPa")),
        format!("battery        {} at least, charge {}", known(m.battery_v, 1.0, "V"), known(m.charge, 100.0, "%")),
        format!("surface        fix {}, shore heard {}", yes(m.surface.gps_fix), yes(m.surface.comms)),
        format!("degraded       {}", if flags.is_empty() { "never".to_owned() } else { flags.join(", ") }),
        format!("glides         deepest {:.1} m", m.deepest_m),
        "               time s   way m   by table   pitch°   path°   m/s".to_owned(),
    ];
    for (name, g) in ["down", "up"].into_iter().zip(&m.glides) {
        rows.push(format!(
            "{name:<14} {:>6.0}  {:>6.1}   {:>8.1}   {:>6.1}  {:>6.1}  {:>4.2}",
            g.time_s,
            g.way_m,
            way_by_table_m(g),
            g.pitch_rad.to_degrees(),
            g.path_rad.to_degrees(),
            g.speed_m_s
        ));
    }
    rows
}

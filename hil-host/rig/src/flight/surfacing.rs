//! Short messages of surfacings ([`signals::surfacing`]) as they reach the shore: files of them, or lines of a glider's terminal.

use super::log::degraded;
use anyhow::{bail, ensure};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use signals::Surfacing;
use signals::surfacing::{Glide, SURFACING_BYTES};

/// What stands before a message on the glider's terminal.
const HEAD: &[u8] = b"surfacing,";
/// Characters of a message there.
const TEXT: usize = SURFACING_BYTES.div_ceil(3) * 4;

/// What a file says.
#[derive(Debug, Default)]
pub struct Received {
    /// Messages, and where each stands.
    pub messages: Vec<(String, Surfacing)>,
    /// Where one stands that cannot be read, and why.
    pub damaged: Vec<(String, String)>,
}

/// Reads a file: messages of 54 bytes one after another, or a terminal's text with lines of them.
///
/// # Errors
/// There is none in it, or all are damaged.
pub fn read(bytes: &[u8]) -> anyhow::Result<Received> {
    let mut received = Received::default();
    let mut take = |place: String, message: Result<Vec<u8>, String>| {
        let read = message.and_then(|bytes| Surfacing::decode(&bytes).map_err(|e| format!("{e:?}")));
        match read {
            Ok(message) => received.messages.push((place, message)),
            Err(why) => received.damaged.push((place, why)),
        }
    };
    let mut text = false;
    for (number, line) in bytes.split(|b| *b == b'\n').enumerate() {
        let Some(at) = line.windows(HEAD.len()).position(|w| w == HEAD) else { continue };
        text = true;
        let from = at + HEAD.len();
        let place = format!("line {}, column {}", number + 1, from + 1);
        let block = line.get(from..from + TEXT).ok_or_else(|| format!("cut short: {} of {TEXT} characters", line.len() - from));
        take(place, block.and_then(|block| STANDARD.decode(block).map_err(|e| e.to_string())));
    }
    if !text {
        ensure!(
            !bytes.is_empty() && bytes.len().is_multiple_of(SURFACING_BYTES),
            "no messages of a surfacing: neither {SURFACING_BYTES} bytes each (it has {}) nor lines of a glider's terminal with `surfacing,`",
            bytes.len()
        );
        for (number, message) in bytes.chunks(SURFACING_BYTES).enumerate() {
            take(format!("byte {}", number * SURFACING_BYTES), Ok(message.to_vec()));
        }
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

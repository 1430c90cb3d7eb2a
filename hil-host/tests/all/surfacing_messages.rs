//! `glider surfacing`: the short messages of surfacings, from files and from a terminal's log.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use discovery::history::glide::Glider;
use discovery::history::numbers::{BALLAST_OFFSET, DRAG_LEVEL, Numbers};
use discovery::history::rows::{Row, Unit};
use evidence::{Cycle, Dives};
use hil_host::packets::board;
use polar::Table;
use rig::flight::surfacing::{document, read, rows};
use rig::flight::vehicles;
use signals::surfacing::{GLIDES_BYTES, Glide};
use signals::{Abort, Flags, Phase, Surfacing, Wings};
use std::path::Path;
use std::process::Command;

fn message(seq: u32) -> Surfacing {
    let dive = Glide { time_s: 296.0, way_m: 29.6, pitch_rad: -0.4, path_rad: -0.44, speed_m_s: 0.25 };
    let glides = [dive, Glide { pitch_rad: 0.4, path_rad: 0.44, ..dive }];
    Surfacing { seq, phase: Phase::Safe, abort: Some(Abort::Leak), flags: Flags::DEGRADED, deepest_m: 27.0, glides, ..Surfacing::default() }
}

#[test]
fn files_and_terminals_are_read_and_damage_is_named_by_its_place() {
    let file = [message(7).encode(), message(8).encode()].concat();
    let received = read(&file).expect("two");
    assert_eq!(received.messages.iter().map(|(place, m)| (place.as_str(), m.seq)).collect::<Vec<_>>(), [("byte 0", 7), ("byte 54", 8)]);
    let with_packet = Surfacing { packet: Some([7; GLIDES_BYTES]), ..message(8) }.encode();
    // A file that was begun anew after its first piece.
    let again = [&file[..], &with_packet[..55], &with_packet].concat();
    let received = read(&again).expect("three");
    assert_eq!(
        received.messages.iter().map(|(p, m)| (p.as_str(), m.packet.is_some())).collect::<Vec<_>>(),
        [("byte 0", false), ("byte 54", false), ("byte 163", true)]
    );
    assert_eq!(received.damaged.len(), 1);
    let pieces: Vec<String> =
        with_packet.chunks(55).map(|piece| format!("surfacing,{}\r\nother words\r\n", STANDARD.encode(piece))).collect();
    assert_eq!(read(pieces.concat().as_bytes()).expect("one").messages[0].1.packet, Some([7; GLIDES_BYTES]));
    let line = |m: &Surfacing| format!("surfacing,{}", STANDARD.encode(m.encode()));
    let good = line(&message(9));
    let call = format!("GliderDos I -3 >\r\nextctl: {good}\r\n{}\r\n{}\r\n", good.replace('A', "B"), &good[..40]);
    let received = read(call.as_bytes()).expect("one");
    assert_eq!((received.messages.len(), received.messages[0].1.seq, received.messages[0].0.as_str()), (1, 9, "line 2, column 19"));
    assert_eq!(received.damaged.iter().map(|(p, _)| p.as_str()).collect::<Vec<_>>(), ["line 3, column 11", "line 4, column 11"]);
    let refused = |bytes: &[u8]| read(bytes).expect_err("refused").to_string();
    assert!(refused(&file[..53]).contains("it has 53") && refused(b"").contains("it has 0"));
    assert!(refused(&[0; 54]).starts_with("byte 0: damaged"));
}

#[test]
fn what_is_shown_fits_the_terminal_and_says_the_evidence() {
    let rows = rows("line 12345, column 123", &message(u32::MAX));
    assert!(rows.iter().all(|row| row.chars().count() <= 80), "{rows:#?}");
    let all = rows.join("\n");
    for said in ["Safe, aborted: Leak", "flies worse than the table", "29.6       31.5    -22.9   -25.2  0.25"] {
        assert!(all.contains(said), "{said}: {all}");
    }
    assert_eq!(document("byte 0", &message(1))["glides"]["up"]["time_s"], 296.0);
}

#[test]
fn the_command_prints_a_message_and_its_exit_code_says_how_it_stands() {
    let folder = std::env::temp_dir().join(format!("glider-surfacing-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join("6956a0c4.srf");
    let run = |bytes: &[u8], more: &[&str]| {
        std::fs::write(&path, bytes).expect("written");
        let out = Command::new(env!("CARGO_BIN_EXE_glider")).arg("surfacing").arg(&path).args(more).output().expect("runs");
        (out.status.code(), String::from_utf8_lossy(&out.stdout).into_owned(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let well = Surfacing { phase: Phase::Comms, abort: None, ..message(3) };
    let (code, said, _) = run(&well.encode(), &[]);
    assert!(code == Some(0) && said.contains("Comms, no abort"), "{said}");
    assert_eq!(run(&message(3).encode(), &[]).0, Some(1), "an abort");
    let (_, said, _) = run(&well.encode(), &["--json"]);
    let said: serde_json::Value = serde_json::from_str(&said).expect("one document");
    assert_eq!((&said["messages"][0]["seq"], &said["damaged"]), (&3.into(), &serde_json::json!([])));
    let (code, _, said) = run(b"no message", &[]);
    assert!(code == Some(2) && said.contains("6956a0c4.srf") && said.contains("it has 10"), "{said}");
    std::fs::remove_dir_all(&folder).expect("removed");
}

/// Messages of a mission of 30 days, two a day, of a vehicle that is a little another from dive to dive; from message `event` on with
/// half as much drag again.
fn mission(event: usize) -> Vec<u8> {
    const MESSAGES: usize = 60;
    let vehicle = vehicles::read(Path::new("slocum-standard-sea")).expect("built in");
    let glider = Glider::new(&vehicle, 14.0, 200e-6);
    let (constants, bytes) = board(&glider, &Numbers::zeros(), Wings::Standard).expect("a table");
    let table = Table::parse(&bytes, Wings::Standard).expect("parses");
    let neutral_kg_m3 = 1025.0 + glider.claims()[BALLAST_OFFSET] / glider.hull_m3();
    let mut seed = 3_u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f64 / (1_u64 << 23) as f64 - 1.0
    };
    let (mut dives, mut out) = (Dives::new(), Vec::new());
    for k in 0..MESSAGES {
        let mut x = Numbers::from_fn(|_, _| 0.05 * noise());
        if k >= event {
            x[DRAG_LEVEL] += 1.5_f64.ln() / glider.sizes[DRAG_LEVEL];
        }
        let x = glider.moved(&x);
        let (mut s, mut p) = (k as f64 * 43_200.0, 2e4);
        for way in [-1.0, 1.0, -1.0, 1.0] {
            let pitch_rad = way * (0.4 + 0.08 * noise());
            let (mut rise_m_s, mut cycles) = (0.0, 0);
            while (1e4..1.6e6).contains(&p) && cycles < 3000 {
                let (density_kg_m3, temperature_degc) = (neutral_kg_m3 + 4.4e-7 * p, 20.0 - 6e-6 * p);
                let (ballast_m3, roll_rad, heading_rad) = (way * 2e-4, 0.0, 0.0);
                let row = Row {
                    time_s: s,
                    pressure_pa: p,
                    rise_m_s: way,
                    density_kg_m3,
                    temperature_degc,
                    pitch_rad,
                    roll_rad,
                    heading_rad,
                    ballast_m3,
                    way,
                    block: 0,
                };
                // Water changes little in 20 s.
                if cycles % 5 == 0 {
                    rise_m_s = glider.rises(&Unit { rows: vec![row], ..Unit::default() }, &x)[0];
                }
                cycles += 1;
                dives.take(
                    &constants,
                    &table,
                    &Cycle {
                        time_us: (s * 1e6) as u64,
                        pressure_pa: (p + 300.0 * noise()) as f32,
                        pitch_rad: pitch_rad as f32,
                        roll_rad: 0.0,
                        ballast_m3: ballast_m3 as f32,
                        density_kg_m3: density_kg_m3 as f32,
                        temperature_degc: temperature_degc as f32,
                    },
                );
                (s, p) = (s + 4.0, p - rise_m_s * 4.0 * density_kg_m3 * 9.81);
            }
            p = if way < 0.0 { 1.59e6 } else { 1.1e4 };
        }
        let packet = dives.packet(constants.id()).encode();
        dives.begin();
        let message = Surfacing { phase: Phase::Comms, time_s: s as u32, deepest_m: 158.0, packet, ..Surfacing::default() };
        out.extend_from_slice(&message.encode());
    }
    out
}

/// Packets are all there is of it: what changed, and when, by the commands that read logs.
#[test]
fn a_mission_of_thirty_days_is_judged_from_its_packets_alone() {
    let folder = std::env::temp_dir().join(format!("glider-packets-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let glider = |arguments: &[&str]| {
        let out = Command::new(env!("CARGO_BIN_EXE_glider")).current_dir(&folder).args(arguments).output().expect("runs");
        let said = String::from_utf8_lossy(&out.stdout).into_owned();
        (
            out.status.code(),
            serde_json::from_str::<serde_json::Value>(&said).unwrap_or_default(),
            String::from_utf8_lossy(&out.stderr).into_owned(),
        )
    };
    std::fs::write(folder.join("quiet.srf"), mission(usize::MAX)).expect("written");
    std::fs::write(folder.join("event.srf"), mission(40)).expect("written");
    let timeline = |file: &str| glider(&["timeline", file, "--vehicle", "slocum-standard-sea", "--json"]).1;
    let quiet = timeline("quiet.srf");
    assert_eq!((quiet["dives"].as_array().map(Vec::len), quiet["changes"].as_array().map(Vec::len)), (Some(60), Some(0)), "{quiet:#}");
    assert!(quiet["dives"][59]["day"].as_f64().is_some_and(|d| (29.0..30.0).contains(&d)), "{:#}", quiet["dives"][59]);
    let event = timeline("event.srf");
    let change = &event["changes"][0];
    assert_eq!((change["kind"].as_str(), change["dive"].as_u64()), (Some("snag"), Some(41)), "{change:#}");
    // A packet is a straight line from the constants on board: w² falls by 1 - 1/1.5 of itself, which is as much of ln of the drag.
    let expected = 100.0 * (1.0_f64 / 3.0).exp_m1();
    let size = |end: &str| change["size"][end].as_f64().expect("a number");
    assert!(size("low") < expected && size("high") > expected && size("high") - size("low") < 15.0, "{change:#}");
    // The first dive of the event, beside those before it.
    std::fs::write(folder.join("first.srf"), &mission(40)[..41 * 163]).expect("written");
    let (code, said, _) = glider(&["diagnose", "--flight", "first.srf", "--vehicle", "slocum-standard-sea", "--json"]);
    assert_eq!((code, said["history"]["class"][0]["number"].as_str()), (Some(0), Some("drag_level")), "{said:#}");
    // Elsewhere it is named as what it is.
    let (code, _, said) = glider(&["compare", "--flight", "quiet.srf", "--vehicle", "slocum-standard-sea"]);
    assert!(code == Some(2) && said.contains("messages of surfacings"), "{said}");
    std::fs::remove_dir_all(&folder).expect("removed");
}

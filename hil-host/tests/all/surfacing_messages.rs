//! `glider surfacing`: the short messages of surfacings, from files and from a terminal's log.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use rig::flight::surfacing::{document, read, rows};
use signals::surfacing::{GLIDES_BYTES, Glide};
use signals::{Abort, Flags, Phase, Surfacing};
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

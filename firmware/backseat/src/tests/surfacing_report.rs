//! The report of a surfacing to the shore, and by which way.

use super::bench::{Bench, line};
use crate::base64::decode;
use crate::sensors::List;
use crate::{Generation, State};
use signals::{Flags, Phase, Surfacing};

fn list(generation: Generation) -> List {
    List { generation, ..List::default() }
}

/// Up from a dive, the shore heard in the last of these cycles.
fn surfaced(generation: Generation) -> Bench {
    let mut bench = Bench::new(list(generation));
    bench.open();
    for (phase, depth_m) in [(Phase::Dive, 3.0), (Phase::Dive, 8.0), (Phase::Climb, 4.0), (Phase::Comms, 0.4)] {
        bench.law.answers = Some((phase, depth_m));
        bench.cycle(f64::from(depth_m));
    }
    assert_eq!(bench.session.state(), State::Ready);
    assert!(!bench.said.contains("$FW"), "the shore was not heard yet");
    bench
}

fn comms(bench: &mut Bench) {
    let _ = bench.said();
    bench.hear(line("SD,29:1").as_bytes());
    bench.cycle(0.3);
}

/// The field after a head, decoded.
fn message(said: &str, head: &str) -> Surfacing {
    let block = said.split(head).nth(1).and_then(|rest| rest.split('*').next()).expect("said");
    let mut bytes = Vec::new();
    decode(block.as_bytes(), |b| bytes.push(b)).expect("base64");
    Surfacing::decode(&bytes).expect("a message")
}

#[test]
fn a_surfacing_is_told_once_as_a_file_and_on_the_terminal() {
    let mut bench = surfaced(Generation::Newer);
    comms(&mut bench);
    let said = bench.said();
    assert_eq!((said.matches("$FW,").count(), said.matches("$FO,").count(), said.matches("$FC").count()), (1, 1, 0), "{said}");
    let name = said.split("$FW,").nth(1).and_then(|s| s.split('*').next()).expect("a name");
    assert!(name.ends_with(".srf,logs") && name.len() == 17 && name.starts_with("69"), "the glider's time in hex: {name}");
    let in_file = message(&said, "$FO,");
    assert_eq!(in_file, message(&said, "$TXT,surfacing,"));
    assert_eq!((in_file.phase, in_file.deepest_m, in_file.surface.comms), (Phase::Comms, 8.0, true));
    bench.hear(b"$NEXT*07\r\n");
    bench.wait(30_000);
    let said = bench.said();
    assert!(said.contains("$FC*05") && !said.contains("$FW"), "{said}");
    // Not again until the next dive.
    for _ in 0..20 {
        comms(&mut bench);
        assert!(!bench.said.contains("$FW") && !bench.said.contains("$TXT"));
    }
    bench.law.answers = Some((Phase::Dive, 9.0));
    bench.cycle(9.0);
    bench.law.answers = Some((Phase::Comms, 0.4));
    comms(&mut bench);
    assert!(bench.said.contains("$FW"));
}

#[test]
fn a_file_that_nobody_takes_is_offered_four_times_and_then_given_up() {
    let mut bench = surfaced(Generation::Newer);
    comms(&mut bench);
    for _ in 0..20 {
        bench.cycle(0.3);
        bench.hear(b"$ER,1*0A\r\n");
    }
    assert_eq!((bench.said.matches("$FW,").count(), bench.said.matches("$TXT").count(), bench.said.matches("$FC").count()), (4, 1, 0));
    bench.hear(b"$NEXT*07\r\n");
    assert!(!bench.said.contains("$FC"));
}

#[test]
fn without_word_from_shore_the_file_is_written_after_a_minute() {
    let mut bench = surfaced(Generation::Newer);
    for _ in 0..13 {
        bench.cycle(0.3);
        assert!(!bench.said.contains("$FW"));
    }
    bench.cycle(0.3);
    assert!(!message(&bench.said(), "$FO,").surface.comms);
}

#[test]
fn the_older_software_is_sent_the_file_unasked_and_no_text() {
    let mut bench = surfaced(Generation::Older);
    comms(&mut bench);
    let said = bench.said();
    let order = ["$FW,", "$FO,", "$FC*05"].map(|s| said.find(s).expect("said"));
    assert!(order.is_sorted() && !said.contains("$TXT"), "{said}");
    bench.wait(60_000);
    assert!(!bench.said.contains("$F"));
}

/// The bytes of all blocks after a head.
fn pieces(said: &str, head: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    for rest in said.split(head).skip(1) {
        decode(rest.split('*').next().expect("a frame").as_bytes(), |b| bytes.push(b)).expect("base64");
    }
    bytes
}

#[test]
fn a_packet_of_the_glides_goes_in_three_pieces_each_way() {
    for generation in [Generation::Newer, Generation::Older] {
        let mut bench = surfaced(generation);
        bench.law.glides = Some((core::array::from_fn(|i| i as u8), Flags::DEPARTS));
        let mut said = String::new();
        for _ in 0..4 {
            comms(&mut bench);
            said += &bench.said();
            bench.hear(b"$NEXT*07\r\n");
            said += &bench.said();
        }
        assert_eq!((said.matches("$FW,").count(), said.matches("$FO,").count(), said.matches("$FC*05").count()), (1, 3, 1), "{said}");
        let filed = pieces(&said, "$FO,");
        let message = Surfacing::decode(&filed).expect("a message");
        assert_eq!((message.packet, message.deepest_m), (Some(core::array::from_fn(|i| i as u8)), 8.0));
        assert!(message.flags.contains(Flags::DEPARTS));
        if generation == Generation::Newer {
            assert_eq!(pieces(&said, "$TXT,surfacing,"), filed);
        }
        assert_eq!(bench.session.counters().dropped, 0);
        // It is told once.
        bench.law.answers = Some((Phase::Dive, 9.0));
        bench.cycle(9.0);
        bench.law.answers = Some((Phase::Comms, 0.4));
        comms(&mut bench);
        assert!(Surfacing::decode(&pieces(&bench.said(), "$FO,")).is_ok_and(|m| m.packet.is_none()));
    }
}

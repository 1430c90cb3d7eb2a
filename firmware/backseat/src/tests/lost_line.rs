//! A mission under way comes up whatever the line does: from boot on, in every state, by a bounded time.

use super::bench::{Bench, line};
use crate::State;
use crate::sensors::List;
use signals::Phase;

/// A board that a reset interrupted in a mission.
fn after_a_reset() -> Bench {
    let mut bench = Bench::new(List::default());
    bench.law.under_way = true;
    bench
}

/// Times at which something was said, s.
fn times(bench: &mut Bench, seconds: u64, what: &str) -> Vec<f64> {
    let mut at = Vec::new();
    for _ in 0..seconds * 10 {
        let before = bench.said.matches(what).count();
        bench.wait(100);
        if bench.said.matches(what).count() > before {
            at.push(bench.now_ms as f64 * 1e-3);
        }
    }
    at
}

#[test]
fn a_line_that_never_speaks_is_lost_a_minute_after_a_reset() {
    let mut bench = after_a_reset();
    bench.wait(59_000);
    assert_eq!((bench.session.state(), bench.said.as_str(), bench.law.lost), (State::Wait, "", None));
    let emergency = times(&mut bench, 120, "$MD,67,2*");
    assert_eq!(bench.session.state(), State::Lost);
    assert!(emergency.first().is_some_and(|t| *t <= 64.2), "{emergency:?}");
    assert!(emergency.len() > 5 && emergency.windows(2).all(|w| w[1] - w[0] <= 17.0), "{emergency:?}");
    assert!(!bench.said.contains("$SW"), "no sensor is written before the list was read: {}", bench.said);
    // It speaks again: the list is read first. Ours: full buoyancy is written, and the abort stays.
    for _ in 0..10 {
        bench.hear(line("SD,9:20").as_bytes());
        bench.wait(400);
    }
    assert_eq!(bench.session.state(), State::Linked);
    let ini = bench.ini();
    bench.serve(&ini, 3_000);
    for _ in 0..3 {
        bench.hear(line("SD,31:0").as_bytes());
        bench.cycle(20.0);
    }
    assert!(bench.session.state() == State::Ready && bench.said.contains("$SW,0:236.000000"), "{}", bench.said);
    assert!(!bench.said.contains("$SW,0:-"));
}

#[test]
fn a_board_without_a_mission_waits_in_silence_for_as_long_as_it_takes() {
    let mut bench = Bench::new(List::default());
    bench.wait(2 * 3600 * 1000);
    assert_eq!((bench.session.state(), bench.said.as_str(), bench.law.lost), (State::Wait, "", None));
    bench.open();
    bench.cycle(10.0);
    assert_eq!(bench.session.state(), State::Ready);
    assert!(bench.said.contains("$SW,0:-236"));
}

#[test]
fn after_a_reset_another_list_is_never_written_to_nor_its_mode() {
    let mut bench = after_a_reset();
    bench.hear(b"$HI*01\r\n");
    let other = bench.ini().replace("m_pitch rad\nm_roll rad", "m_roll rad\nm_pitch rad");
    bench.serve(&other, 30_000);
    bench.wait(200_000);
    assert!(bench.session.state() == State::Mute && bench.law.lost.is_some());
    assert!(!bench.said.contains("$SW") && !bench.said.contains("$MD"), "{}", bench.said);
}

#[test]
fn a_list_that_cannot_be_read_in_a_mission_gets_the_emergency_bit_alone() {
    let mut bench = after_a_reset();
    bench.hear(b"$HI*01\r\n");
    let emergency = times(&mut bench, 150, "$MD,67,2*");
    assert_eq!(bench.session.state(), State::Mute);
    assert!(emergency.first().is_some_and(|t| *t <= 64.2) && emergency.len() > 4, "{emergency:?}");
    assert!(!bench.said.contains("$SW"));
    // Without a mission it is mute, and says nothing but why.
    let mut bench = Bench::new(List::default());
    bench.hear(b"$HI*01\r\n");
    bench.wait(150_000);
    assert!(bench.session.state() == State::Mute && !bench.said.contains("$MD"));
}

#[test]
fn sentences_that_say_nothing_are_a_silence() {
    for reset in [false, true] {
        let mut bench = if reset { after_a_reset() } else { Bench::new(List::default()) };
        bench.open();
        if !reset {
            bench.cycle(10.0);
            assert!(bench.said.contains("$SW,0:-236"));
        }
        let (from_s, mut lost_s) = (bench.now_ms / 1000, None);
        for i in 0..40 {
            bench.hear(line(if i % 2 == 0 { "SD,99:1" } else { "SD,9:69696969" }).as_bytes());
            bench.wait(4000);
            if bench.session.state() == State::Lost {
                lost_s.get_or_insert(bench.now_ms / 1000 - from_s);
            }
        }
        // What was believed at the opening makes a step up to ten seconds later.
        assert!(lost_s.is_some_and(|s| s <= 76), "{reset}: {lost_s:?}");
        assert_eq!(bench.session.state(), State::Lost, "{reset}: they do not end it either");
        assert!(bench.said.contains("$MD,67,2*") && bench.said.contains("$SW,0:236.000000"), "{reset}: {}", bench.said);
    }
}

#[test]
fn a_sentence_now_and_then_does_not_silence_a_lost_line() {
    let mut bench = Bench::new(List::default());
    bench.open();
    bench.cycle(20.0);
    bench.wait(65_000);
    assert_eq!(bench.session.state(), State::Lost);
    let _ = bench.said();
    let mut emergency = Vec::new();
    for _ in 0..10 {
        bench.hear(line("SD,9:20").as_bytes());
        emergency.extend(times(&mut bench, 30, "$MD,67,2*"));
    }
    assert_eq!(bench.session.state(), State::Lost);
    assert!(emergency.len() > 15 && emergency.windows(2).all(|w| w[1] - w[0] <= 20.1), "{emergency:?}");
    assert!(bench.said.matches("$SW,0:236.000000").count() > 60);
}

#[test]
fn a_program_that_stops_for_good_below_is_lost_after_a_reset_too() {
    for reset in [false, true] {
        let mut bench = if reset { after_a_reset() } else { Bench::new(List::default()) };
        bench.open();
        if !reset {
            bench.cycle(30.0);
        }
        bench.hear(line("SD,9:31").as_bytes());
        bench.hear(b"$BY*1B\r\n");
        let _ = bench.said();
        bench.wait(595_000);
        assert_eq!((bench.session.state(), bench.said.as_str()), (State::Paused, ""), "{reset}");
        bench.wait(20_000);
        assert_eq!(bench.session.state(), State::Lost, "{reset}");
        assert!(bench.said.contains("$MD,67,2*") && !bench.said.contains("$SW"), "{reset}: its list may be another one: {}", bench.said);
        let _ = bench.said();
        for _ in 0..10 {
            bench.hear(line("SD,9:31").as_bytes());
            bench.wait(400);
        }
        assert!(bench.session.state() == State::Linked && bench.said.contains("$FR,extctl.ini"), "{reset}: {}", bench.said);
    }
}

#[test]
fn after_a_reset_safe_is_ordered_though_the_glider_does_not_say_it_flies() {
    let opened = || {
        let mut bench = after_a_reset();
        bench.law.answers = Some((Phase::Safe, 20.0));
        bench.hear(b"$SD,9:42.75*12\r\n");
        bench.wait(200);
        let ini = bench.ini();
        bench.send_file(&ini);
        bench.wait(300);
        assert_eq!(bench.session.state(), State::Ready);
        bench
    };
    let mut bench = opened();
    for _ in 0..3 {
        bench.cycle(42.0);
    }
    assert!(bench.said.contains("$SW,0:236.000000") && bench.said.contains("$MD,67,2*"), "{}", bench.said);
    // In the glider's shell nothing is ordered, but steps go on: else nobody would see the vehicle afloat, and SAFE could not be left.
    let mut bench = opened();
    let _ = bench.said();
    for _ in 0..3 {
        bench.hear(line("SD,31:1").as_bytes());
        bench.cycle(0.3);
    }
    assert!(!bench.said.contains("$SW") && bench.law.frames.len() >= 3, "{} {}", bench.law.frames.len(), bench.said);
}

#[test]
fn a_limit_that_swapped_digits_make_is_not_believed() {
    let mut bench = Bench::new(List { echo: true, ..List::default() });
    bench.hear(line("SD,37:226,38:0.382,39:0.45").as_bytes());
    let limits = bench.session.limits();
    assert!((limits.ballast_m3 - 226e-6).abs() < 1e-9, "{limits:?}");
    // The same checksum, and a tenth of the buoyancy.
    bench.hear(line("SD,37:22.6,38:0.328").as_bytes());
    assert_eq!(bench.session.limits(), limits);
    assert_eq!(bench.session.counters().too_fast, 2);
}

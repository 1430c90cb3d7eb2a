//! The board's half of the line alone: what it does with what it hears.

use super::bench::{Bench, limits, line};
use crate::sensors::List;
use crate::{Generation, Limits, State, Targets};
use signals::{ActuatorCommand, Reading, SensorFrame};

#[test]
fn test_01_a_first_line_gives_a_frame_and_only_the_glider_speaks_first() {
    let mut bench = Bench::new(List::default());
    bench.wait(30_000);
    assert_eq!((bench.said().as_str(), bench.session.state()), ("", State::Wait));
    bench.hear(b"$HI*01\r\n$SD,8:1767225604.01,9:42.75,11:-0.3491*39\r\n");
    assert_eq!(bench.session.state(), State::Linked);
    let f = bench.session.frame(bench.now());
    assert_eq!(f.depth_m, Reading::Sampled { value: 42.75, age_ms: 2000 });
    assert_eq!(f.pitch_rad, Reading::Sampled { value: -0.3491, age_ms: 2000 });
    let blank = SensorFrame { seq: f.seq, time: f.time, depth_m: f.depth_m, pitch_rad: f.pitch_rad, ..SensorFrame::default() };
    assert_eq!(f, blank, "all others are missing");
}

#[test]
fn test_02_a_wrong_checksum_and_none_leave_the_depth_as_old_as_it_was() {
    let mut bench = Bench::new(List::default());
    bench.hear(b"$SD,9:41.5*21\r\n");
    bench.hear(line("SD,9:41.5").as_bytes());
    bench.wait(4000);
    let before = bench.session.faults().damaged;
    bench.hear(b"$SD,9:42.75*2A\r\n$SD,9:42.75\r\n");
    assert_eq!(bench.session.faults().damaged, before + 2);
    assert_eq!(bench.session.frame(bench.now()).depth_m, Reading::Sampled { value: 41.5, age_ms: 6000 });
}

#[test]
fn test_03_swapped_digits_pass_the_checksum_and_not_the_rate_gate() {
    let mut bench = Bench::new(List::default());
    bench.hear(b"$SD,9:42.75*12\r\n");
    bench.wait(4000);
    bench.hear(b"$SD,9:24.75*12\r\n");
    assert_eq!(bench.session.faults().damaged, 0);
    assert_eq!(bench.session.counters().too_fast, 1);
    assert_eq!(bench.session.frame(bench.now()).depth_m, Reading::Sampled { value: 42.75, age_ms: 6000 });
}

#[test]
fn test_04_noise_nul_and_glue() {
    for bytes in [b"xx$S$SD,9:42.75*12\r\n".as_slice(), b"\0$SD,9:42.75*12\r\n", b"$SD,11:-0.3491*3D$SD,9:42.75*12\r\n"] {
        let mut bench = Bench::new(List::default());
        bench.hear(bytes);
        assert_eq!(bench.session.frame(bench.now()).depth_m, Reading::Sampled { value: 42.75, age_ms: 2000 });
    }
}

#[test]
fn test_05_an_unknown_sensor_is_counted_and_an_error_is_survived() {
    let mut bench = Bench::new(List::default());
    bench.open();
    bench.hear(b"$SD,99:1.0,9:11.0*15\r\n$ER,1*0A\r\n");
    bench.hear(line("SD,99:1.0,9:11.0").as_bytes());
    assert_eq!((bench.session.counters().unknown_pairs, bench.session.counters().errors), (1, 1));
    assert_eq!(bench.session.state(), State::Ready);
    assert_eq!(bench.session.frame(bench.now()).depth_m, Reading::Sampled { value: 11.0, age_ms: 2000 });
}

#[test]
fn test_06_what_is_no_depth_is_refused() {
    for (sentence, depth) in [
        ("$SD,9:nan*59\r\n", Reading::Missing),
        ("$SD,9:*38\r\n", Reading::Missing),
        ("$SD,9:69696969*38\r\n", Reading::Missing),
        ("$SD,9:4.2e1*44\r\n", Reading::Sampled { value: 42.0, age_ms: 2000 }),
    ] {
        let mut bench = Bench::new(List::default());
        bench.hear(sentence.as_bytes());
        assert_eq!(bench.session.faults().damaged, 0, "{sentence}");
        assert_eq!(bench.session.frame(bench.now()).depth_m, depth, "{sentence}");
    }
}

#[test]
fn test_07_wrong_units_are_refused_or_read_as_next_to_nothing() {
    let mut bench = Bench::new(List::default());
    bench.hear(b"$SD,11:-20.0*30\r\n$SD,14:0.000236*1D\r\n$SD,23:79300*3D\r\n");
    let f = bench.session.frame(bench.now());
    assert_eq!((f.pitch_rad, f.vacuum_pa, bench.session.counters().out_of_range), (Reading::Missing, Reading::Missing, 2));
    let Reading::Sampled { value, .. } = f.ballast_m3 else { panic!("a volume") };
    assert!((value - 2.36e-10).abs() < 1e-15, "{value}");
}

#[test]
fn test_08_a_command_is_exactly_two_sentences() {
    let command = ActuatorCommand { ballast_m3: 236e-6, battery_mass_m: 0.0127, fin_rad: 0.1, ..Default::default() };
    let values = crate::orders::parameters(&command, &Targets { dive_m: 195.0, climb_m: 2.0 }, &limits());
    let text = |limits: &Limits, command: &ActuatorCommand| -> Vec<String> {
        let values = crate::orders::parameters(command, &Targets { dive_m: 195.0, climb_m: 2.0 }, limits);
        let bodies = crate::orders::sentences(&values).expect("written");
        bodies.iter().map(|b| String::from_utf8_lossy(&crate::sentence::framed(b).expect("framed")).into_owned()).collect()
    };
    assert_eq!(values[0], 236.0);
    assert_eq!(text(&limits(), &command), ["$SW,0:236.000000,1:0.500000,2:0.100000*3C\r\n", "$SW,3:195.000000,4:2.000000*0C\r\n"]);
    // The limit that the glider tells is never exceeded.
    let narrow = Limits { battery_m: 0.382 * 0.0254, ..limits() };
    let far = ActuatorCommand { battery_mass_m: 0.0254, ..command };
    assert_eq!(text(&narrow, &far)[0], line_of("SW,0:236.000000,1:0.382000,2:0.100000"));
    // What is no number, and what the glider takes for a link to a parameter, is not sent.
    let absurd = ActuatorCommand { fin_rad: f32::NAN, ..command };
    for (command, dive_m) in [(absurd, 195.0), (command, 1e6)] {
        let values = crate::orders::parameters(&command, &Targets { dive_m, climb_m: 2.0 }, &limits());
        assert!(crate::orders::sentences(&values).is_err(), "{values:?}");
    }
}

fn line_of(body: &str) -> String {
    format!("${body}*{:02X}\r\n", crate::line::checksum(body.as_bytes()))
}

#[test]
fn test_09_silence_of_the_glider_aborts_after_its_timeout_for_good() {
    let mut bench = Bench::new(List::default());
    bench.open();
    for i in 0..10 {
        bench.cycle(10.0 + f64::from(i));
    }
    bench.hear(line(&format!("SD,8:{},9:20", 1_767_225_600.0 + bench.now_ms as f64 * 1e-3)).as_bytes());
    bench.wait(400);
    let _ = bench.said();
    bench.wait(59_000 - 400);
    assert!(bench.law.lost.is_none() && bench.session.state() == State::Late, "no abort at 59 s");
    bench.wait(5_000);
    assert!(bench.law.lost.is_some(), "told at 64 s");
    assert_eq!(bench.session.state(), State::Lost);
    let said = bench.said();
    assert!(said.contains("$MD,67,2*") && said.contains("$SW,0:236.000000"), "{said}");
    bench.wait(32_000);
    let said = bench.said();
    assert!(said.matches("$MD,67,2*").count() >= 2, "the surface bit at least every 16 s: {said}");
    assert!(!said.contains("$SW,0:-"), "full buoyancy only: {said}");
    for _ in 0..12 {
        bench.cycle(20.0);
    }
    assert_eq!(bench.session.state(), State::Listen);
    assert!(!bench.said().contains("$SW,0:-"), "the abort stays");
}

#[test]
fn test_11_a_pause_and_a_reset_without_hi_open_the_session_again() {
    let mut bench = Bench::new(List::default());
    bench.open();
    for i in 0..5 {
        bench.cycle(40.0 + f64::from(i) * 0.5);
    }
    bench.hear(b"$BY*1B\r\n");
    assert_eq!(bench.session.state(), State::Paused);
    let frames = bench.law.frames.len();
    bench.wait(20_000);
    assert_eq!(bench.session.state(), State::Paused);
    bench.open();
    assert_eq!(bench.session.state(), State::Ready, "open again within two cycles");
    bench.cycle(42.0);
    assert!(bench.law.lost.is_none() && bench.law.frames.len() > frames);
    // A reset of the board: no HI comes.
    let mut bench = Bench::new(List::default());
    bench.hear(b"$SD,9:42.75*12\r\n");
    assert_eq!(bench.session.state(), State::Linked);
    bench.wait(200);
    assert!(bench.said().contains("$FR,extctl.ini,config*4C"));
    let ini = bench.ini();
    bench.send_file(&ini);
    bench.wait(300);
    assert_eq!(bench.session.state(), State::Ready);
}

#[test]
fn test_12_another_list_is_never_written_to_a_damaged_one_read_again() {
    for generation in [Generation::Older, Generation::Newer] {
        let list = List { generation, ..List::default() };
        let mut bench = Bench::new(list);
        bench.hear(b"$HI*01\r\n");
        let exchanged = bench.ini().replace("m_pitch rad\nm_roll rad", "m_roll rad\nm_pitch rad");
        bench.serve(&exchanged, 20_000);
        assert_eq!(bench.session.state(), State::Mute);
        for _ in 0..20 {
            bench.cycle(20.0);
        }
        let said = bench.said();
        assert_eq!(said.matches("$TXT").count(), usize::from(generation == Generation::Newer), "{said}");
        assert!(!said.contains("$SW") && !said.contains("$MD"), "{said}");
    }
    // 1,800 bytes in three blocks, the second damaged once.
    let mut bench = Bench::new(List::default());
    let long = bench.ini() + &format!("# {}\n", "x".repeat(80)).repeat(20);
    assert!(long.len() > 1800);
    bench.hear(b"$HI*01\r\n");
    bench.wait(200);
    let encoded = |block: &[u8]| {
        let mut out = heapless::Vec::<u8, 900>::new();
        crate::base64::encode(block, &mut out).expect("room");
        line(&format!("FI,{}", String::from_utf8_lossy(&out)))
    };
    let mut blocks = long.as_bytes().chunks(600);
    bench.hear(encoded(blocks.next().expect("first")).as_bytes());
    bench.hear(encoded(blocks.next().expect("second")).replace('A', "B").as_bytes());
    let _ = bench.said();
    bench.serve(&long, 20_000);
    assert_eq!(bench.said.matches("$FR,").count(), 1, "asked for again");
    bench.cycle(42.0);
    assert_eq!(bench.session.state(), State::Ready);
    assert!(bench.said().matches("$GO*08").count() >= 3);
}

#[test]
fn parameters_that_do_not_come_back_end_in_silence_of_the_board() {
    let list = List { echo: true, ..List::default() };
    let mut bench = Bench::new(list);
    bench.open();
    assert_eq!(bench.session.state(), State::Linked, "echoes are waited for");
    bench.wait(100_000);
    assert_eq!(bench.session.state(), State::Mute);
    let mut bench = Bench::new(list);
    bench.open();
    bench.hear(line("SD,32:236,33:0,34:0,35:10,36:2").as_bytes());
    bench.wait(200);
    assert_eq!(bench.session.state(), State::Ready);
}

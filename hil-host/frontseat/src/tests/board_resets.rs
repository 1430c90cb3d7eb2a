//! A board that is reset in flight, its line dead or alive; a vehicle in SAFE that is afloat; reports to the shore.

use super::flights::{BOTH, aborts, flown, mid_dive, shallow, unit, written};
use crate::Switches;
use crate::board::Board;
use crate::flight::{Backseat, Event, Outcome, Setup, Trial};
use rayon::prelude::*;
use signals::{Abort, Micros, Phase, Refusal, Surfacing, ToBoard, ToHost, Wings};

/// A board that is reset once.
struct Reset {
    board: Board,
    at: Option<Micros>,
}

impl Backseat for Reset {
    fn pass(&mut self, now: Micros, heard: &[u8], said: &mut Vec<u8>) -> anyhow::Result<()> {
        if self.at.take_if(|at| *at <= now).is_some() {
            self.board.reset(now);
        }
        self.board.pass(now, heard, said)
    }
}

fn reset_at(trial: &Trial, at_s: f64, change: impl FnOnce(&mut Setup)) -> (Outcome, Board) {
    let mut board = Reset { board: trial.board().expect("a board"), at: Some(Micros((at_s * 1e6) as u64)) };
    let out = trial.over_the_line(&mut board, change).expect("a flight");
    (out, board.board)
}

/// Times of the emergency bit, s.
fn emergency(out: &Outcome) -> Vec<f64> {
    out.taken.iter().filter(|(_, body)| body == "MD,67,2").map(|(t, _)| *t).collect()
}

#[test]
fn after_a_reset_on_a_line_that_stays_silent_the_vehicle_comes_up() {
    let at = mid_dive();
    let (out, _) = reset_at(&shallow(Wings::Standard), at, |setup| setup.events = vec![(at - 1.0, Event::GliderSilent(true))]);
    assert!(written(&out, 0, at - 60.0).iter().any(|cc| *cc < -200.0), "it was gliding down");
    assert!(written(&out, 0, at + 5.0).is_empty(), "no list was read: nothing is written");
    assert!(emergency(&out).first().is_some_and(|t| *t < at + 70.0), "{:?}", emergency(&out));
    assert!(out.home && out.aborted.is_none() && out.duration_s < at + 1500.0, "{:?} {}", out.doing, out.duration_s - at);
}

#[test]
fn after_a_reset_on_a_living_line_full_buoyancy_is_ordered() {
    let at = mid_dive();
    let (out, _) = reset_at(&shallow(Wings::LowAspectRatio), at, |_| ());
    let after = written(&out, 0, at + 5.0);
    assert!(!after.is_empty() && after.iter().all(|cc| *cc > 225.0), "{after:?}");
    assert!(out.home && emergency(&out).first().is_some_and(|t| *t < at + 40.0));
    assert_eq!(written(&out, 7, at + 5.0).last().copied(), Some(f64::from(Abort::Reset as u8)));
}

/// A reset at any time of a mission, and at the same time the line from the glider dead for good, or for a while.
#[test]
fn prop_a_reset_at_any_time_on_a_dead_or_living_line_comes_home() {
    let lost: Vec<String> = (0..60u64)
        .into_par_iter()
        .filter_map(|seed| {
            let draw = |n: u64| unit(seed * 64 + n);
            let mut trial = shallow(BOTH[(seed % 2) as usize]);
            (trial.mission.legs[0].dives, trial.scenario.seed) = (2, seed);
            let at = 30.0 + 1500.0 * draw(1);
            let back = if seed % 3 == 0 { f64::INFINITY } else { at + 400.0 * draw(2) };
            let silent = seed % 4 != 3;
            let events = vec![(at - 2.0 * draw(3), Event::GliderSilent(silent)), (back, Event::GliderSilent(false))];
            let (out, _) = reset_at(&trial, at, |setup| setup.events = events);
            let fine = out.home && out.aborted.is_none() && out.max_depth_m < 33.0 && out.duration_s < at + 2400.0;
            (!fine).then(|| {
                format!("seed {seed}, reset at {at:.0} s, back at {back:.0} s: {:?} {:?} {:.0} s", out.doing, out.aborted, out.duration_s)
            })
        })
        .collect();
    assert!(lost.is_empty(), "{lost:#?}");
}

/// Over our own line.
fn recovered(board: &mut Board) -> ToHost {
    board.helm().handle(ToBoard::Recovered)
}

#[test]
fn safe_is_left_when_the_glider_shows_the_vehicle_afloat_and_goes_on_to() {
    let at = mid_dive();
    let (out, mut board) = reset_at(&shallow(Wings::Standard), at, |_| ());
    assert!(out.home);
    let end = Micros((out.duration_s * 1e6) as u64);
    // In the glider's shell, its program alive: seen afloat until a moment ago.
    let mut silent = Vec::new();
    board.pass(end.plus(Micros::from_secs(5)), b"", &mut silent).expect("a pass");
    let mut copy = board.helm().clone();
    assert_eq!(copy.handle(ToBoard::Recovered), ToHost::Done { crc: 0 });
    // Nothing heard since: it may be anywhere.
    board.pass(end.plus(Micros::from_secs(20)), b"", &mut silent).expect("a pass");
    assert_eq!(recovered(&mut board), ToHost::Refused(Refusal::NotAfloat));
}

/// The messages that the glider has.
fn messages(out: &Outcome) -> Vec<Surfacing> {
    out.files.values().map(|bytes| Surfacing::decode(bytes).expect("a message")).collect()
}

#[test]
fn every_surfacing_is_reported_with_the_evidence_of_its_glides() {
    for needs_close in [false, true] {
        let mut trial = shallow(Wings::Standard);
        trial.mission.surface_every = 2;
        let out = trial
            .over_the_line(&mut trial.board().expect("a board"), |setup| setup.switches = Switches { needs_close, ..Switches::default() })
            .expect("a flight");
        let received = messages(&out);
        assert_eq!((out.dives, received.len()), (4, 2), "{:?}", out.files.keys());
        assert_eq!(
            received.iter().map(|m| (m.phase, m.dives, m.abort)).collect::<Vec<_>>(),
            [(Phase::Comms, 2, None), (Phase::Done, 4, None)]
        );
        for message in &received {
            let [down, up] = message.glides;
            assert!((25.0..30.0).contains(&message.deepest_m) && down.pitch_rad < -0.2 && up.pitch_rad > 0.2, "{message:?}");
            for glide in [down, up] {
                let by_table_m = f64::from(glide.speed_m_s) * f64::from(glide.path_rad).sin().abs() * f64::from(glide.time_s);
                assert!((f64::from(glide.way_m) / by_table_m - 1.0).abs() < 0.1, "a vehicle of its table: {glide:?} {by_table_m}");
            }
        }
        let on_terminal = out.log.iter().filter(|line| line.contains("surfacing,")).count();
        assert_eq!(on_terminal, 2, "{:?}", out.log);
    }
}

#[test]
fn a_lost_mission_tells_why_it_came_up() {
    let at = mid_dive();
    let out = flown(|setup| setup.events = vec![(at, Event::GliderSilent(true)), (at + 120.0, Event::GliderSilent(false))]);
    let received = messages(&out);
    assert!(out.home && received.last().is_some_and(|m| m.phase == Phase::Safe && m.abort == Some(Abort::LinkLost)), "{received:?}");
}

/// All sensors in every cycle and the list's file besides: at a quarter of the line's speed they fill it, and the mission is flown whole.
/// Where the list cannot come through in time the board is mute, and the vehicle floats.
#[test]
fn a_full_line_flies_whole_and_an_overfull_one_floats() {
    let full = flown(|setup| setup.baud = 2400.0);
    assert!(full.home && full.dives == 4 && aborts(&full).iter().all(|a| *a == -1.0), "{:?} {}", full.doing, full.dives);
    // A bit left over from a mission before would surface the glider at once.
    let first = full.taken.iter().position(|(_, body)| body.starts_with("SW,0:-"));
    let cleared = full.taken.iter().position(|(_, body)| body == "MD,67,0");
    assert!(cleared.is_some() && cleared < first, "{cleared:?} {first:?}");
    let overfull = flown(|setup| setup.baud = 1900.0);
    assert!(overfull.home && overfull.max_depth_m < 2.0, "{}", overfull.max_depth_m);
    assert!(overfull.log.iter().any(|line| line.contains("cannot be read")) && written(&overfull, 0, 0.0).is_empty());
}

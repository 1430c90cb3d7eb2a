//! A recorded flight stepped through the law again: the same bits from every seat, and planted changes found.

use control::mutant::{Mutant, Watch, set};
use plant::World;
use rig::campaign::lattice::{Case, cases, spread};
use rig::campaign::mutation::meant_for;
use rig::flight::closed_loop::{Setup, fly};
use rig::flight::frames::{Entry, Start};
use rig::flight::recorder::Recorder;
use rig::flight::{mission_file, onboard_log, own_parts, worlds};
use rig::replay::bisect::bisect;
use rig::replay::play::{Played, play};
use rig::replay::record::Record;
use rig::replay::stepper::Stepper;
use rig::seats::in_process::InProcess;
use rig::seats::pty::Pty;
use rig::seats::qemu::{self, Qemu};
use rig::seats::{Link, Seat};
use signals::{Micros, Mission, SensorFrame, Wings};
use std::time::Instant;

fn start(setup: &Setup) -> Start {
    let table = setup.table.clone().unwrap_or_default();
    Start { settings: *setup.config.settings(), mission: setup.mission.clone(), table }
}

fn recorded(world: &mut World, seat: &mut dyn Seat, setup: &Setup) -> Record {
    let (mut entries, mut resets) = (vec![Entry::Start(start(setup))], 0);
    fly(world, seat, setup, &mut |c| {
        if c.resets != std::mem::replace(&mut resets, c.resets) {
            entries.push(Entry::Reset);
        }
        if c.answer.command.seq == c.frame.seq {
            entries.push(Entry::Cycle(*c.frame, *c.answer));
        }
        Ok(())
    })
    .unwrap();
    Record::of(&entries, None).unwrap()
}

fn of_case(case: &Case) -> Record {
    let setup = Setup::new(case.mission());
    recorded(&mut World::new(case.scenario()).unwrap(), &mut Link::new(InProcess::default()), &setup)
}

fn here(record: &Record) -> Played {
    play(&mut Link::new(InProcess::default()), record, None, &mut |_, _| true).unwrap()
}

/// So many missions of the campaign, resets among them, give their bits again.
fn replayed(missions: usize) -> usize {
    let sound: Vec<Case> = cases().into_iter().filter(|c| c.line.is_none()).collect();
    let mut cycles = 0;
    for case in spread(sound, missions) {
        let record = of_case(&case);
        let played = here(&record);
        assert!(played.is_equal() && record.ends.is_none(), "{}: {:?}, {:?}", case.name(), played.first, record.ends);
        cycles += played.cycles;
    }
    println!("{cycles} cycles replayed, none differs");
    cycles
}

#[test]
fn replay_missions_with_faults_give_the_recorded_bits() {
    let cycles = replayed(60);
    assert!(cycles > 30_000, "{cycles}");
}

#[test]
#[ignore = "minutes of one core"]
fn replay_a_million_cycles_give_the_recorded_bits() {
    let cycles = replayed(2_000);
    assert!(cycles > 1_000_000, "{cycles}");
}

#[test]
fn hil_every_seat_gives_the_recorded_bits() {
    let mission = mission_file::built_in("shallow").unwrap();
    for wings in [Wings::Standard, Wings::LowAspectRatio] {
        let setup = Setup::new(Mission { wings, ..mission.clone() });
        let folder = std::env::temp_dir().join(format!("hil-replay-{}-{wings:?}", std::process::id()));
        let mut world = World::new(worlds::for_mission(&setup.mission)).unwrap();
        let mut recorder = Recorder::create(&folder, &world, &setup).unwrap();
        fly(&mut world, &mut Link::new(Pty::new().unwrap()), &setup, &mut |c| recorder.push(c)).unwrap();
        recorder.finish(serde_json::json!({})).unwrap();
        let record = Record::read(&folder, None).unwrap();
        std::fs::remove_dir_all(&folder).unwrap();
        assert!(here(&record).is_equal() && record.steps.len() > 300, "{wings:?}");
        if qemu::is_installed()
            && let Ok(image) = qemu::find_image()
        {
            let played = play(&mut Link::new(Qemu::start(&image, None).unwrap()), &record, None, &mut |_, _| true).unwrap();
            assert!(played.is_equal(), "{wings:?}, the image: {:?}", played.first);
        } else {
            println!("skipped: no image in QEMU on this machine");
        }
    }
}

/// A board on its own parts: as it was seen to answer, and as its flash kept it.
#[test]
fn hil_a_board_on_its_own_parts_and_its_flash_log_give_the_bits() {
    let setup = Setup::new(mission_file::built_in("shallow").unwrap());
    let mut board = own_parts::board(World::new(worlds::for_mission(&setup.mission)).unwrap(), &setup);
    let mut entries = vec![Entry::Start(start(&setup))];
    own_parts::fly(
        &mut board,
        &setup,
        &mut |c| {
            entries.push(Entry::Cycle(*c.frame, *c.answer));
            Ok(())
        },
        &mut |_| {},
    )
    .unwrap();
    let seen = Record::of(&entries, None).unwrap();
    let played = here(&seen);
    assert!(played.is_equal() && seen.ends.is_none(), "{:?} {:?}", played.first, seen.ends);
    let found = onboard_log::read(&mut board, &onboard_log::Wanted::ALL, |_| {}).unwrap();
    let kept: Vec<Entry> = found.cycles.iter().map(|(_, frame, answer)| Entry::Cycle(*frame, *answer)).collect();
    assert!(Record::of(&kept, None).is_err(), "a board's log does not hold its mission");
    let kept = Record::of(&kept, Some(start(&setup))).unwrap();
    assert!(here(&kept).is_equal() && kept.steps.len() + 2 >= seen.steps.len(), "{} of {}", kept.steps.len(), seen.steps.len());
}

/// The first change of a row of sixteen laws is found, and the watch that it broke is named.
#[test]
fn replay_a_planted_change_of_a_watch_is_found_and_named() {
    let all: Vec<Case> = cases().into_iter().filter(|c| c.line.is_none() && c.faults.len() == 1).collect();
    let (mut planted, mut missed) = (0, Vec::new());
    for (n, watch) in Watch::ALL.iter().copied().enumerate() {
        let broken = |record: &Record| {
            set(&[Mutant::Blind(watch)]);
            let played = here(record);
            set(&[]);
            played
        };
        let of_watch = all.iter().filter(|c| c.name().contains(meant_for(watch))).take(6);
        let Some((record, new)) = of_watch.map(of_case).map(|r| (broken(&r), r)).find(|(p, _)| !p.is_equal()).map(|(p, r)| (r, p)) else {
            continue;
        };
        planted += 1;
        let place = 1 + (7 * n + 3) % 15;
        let found = bisect(16, |i| Ok(if i < place { here(&record) } else { new.clone() })).unwrap().unwrap();
        assert!(found.asked <= 6 && found.index == place, "{watch:?}: {} instead of {place}", found.index);
        let first = new.first.unwrap();
        let named = Stepper::new(&record, None).unwrap().broken_alike(first.cycle, &first.answer);
        if !named.iter().any(|m| matches!(m, Mutant::Blind(w) | Mutant::Slow(w) if *w == watch)) {
            missed.push(watch);
        }
        println!("{watch:?} at {:.0} s: {}; named {named:?}", record.time_s(first.cycle), first.differences[0].words());
    }
    println!("{planted} planted, not named: {missed:?}");
    assert!(planted >= 20 && missed.is_empty(), "{planted} planted, not named: {missed:?}");
}

/// A month of cycles: going to any time costs steps between two copies, not the month.
#[test]
fn accuracy_a_seek_in_a_month_lands_on_the_cycle_and_is_short() {
    let (setup, mut entries) = (Setup::new(mission_file::built_in("shallow").unwrap()), Vec::new());
    entries.push(Entry::Start(start(&setup)));
    let mut seat = Link::new(InProcess::default());
    let manifest = seat.hello().unwrap();
    seat.configure(&manifest, &setup.config).unwrap();
    seat.begin(&setup.mission).unwrap();
    // Thirty days of 4 s at the surface in SAFE: what the sensors say does not matter to how long a step takes.
    for seq in 0..648_000 {
        let frame = SensorFrame { seq, time: Micros::from_secs(4 * u64::from(seq)), ..SensorFrame::default() };
        entries.push(Entry::Cycle(frame, Default::default()));
    }
    let record = Record::of(&entries, None).unwrap();
    let mut stepper = Stepper::new(&record, None).unwrap();
    let began = Instant::now();
    stepper.seek(record.steps.len());
    let whole = began.elapsed();
    // Of three rounds the shortest: others share the computer.
    let places = [3, 647_999, 100_000, 333_333, 12, 500_500];
    let mut shortest = [f64::INFINITY; 6];
    for _ in 0..3 {
        for (index, shortest) in places.into_iter().zip(&mut shortest) {
            let began = Instant::now();
            stepper.seek(index);
            *shortest = shortest.min(began.elapsed().as_secs_f64());
            assert_eq!(stepper.at(), index);
        }
    }
    let longest = shortest.into_iter().fold(0.0, f64::max);
    println!("all {:.1} s, the longest seek {:.1} ms", whole.as_secs_f64(), 1e3 * longest);
    assert!(longest < 0.02 * whole.as_secs_f64(), "{longest} s of {whole:?}");
}

#[test]
fn replay_shows_what_the_law_had_learned_of_its_table() {
    let setup = Setup::new(mission_file::built_in("shallow").unwrap());
    for error in [0.4, -0.3] {
        let mut scenario = worlds::for_mission(&setup.mission);
        scenario.effects.push(plant::Effect { kind: plant::EffectKind::DragLevelError, value: error, aux: None });
        let record = recorded(&mut World::new(scenario).unwrap(), &mut Link::new(InProcess::default()), &setup);
        let mut stepper = Stepper::new(&record, None).unwrap();
        assert_eq!(stepper.learned(), None, "no mission has begun");
        stepper.seek(1);
        assert_eq!(stepper.learned(), Some([1.0; 3]), "the table as it is");
        stepper.seek(record.steps.len() - 1);
        let [drag, ..] = stepper.learned().expect("still flying");
        assert!((drag - 1.0) * error.signum() as f32 > 0.03, "a drag {error} off was learned as {drag}");
    }
}

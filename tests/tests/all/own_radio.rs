//! The board's own radio: a modem that works, one that does not, and none, on the same flights.

use bay::radio::TRIES;
use control::Config;
use control::config::Settings;
use parts::iridium::Fault;
use plant::World;
use rig::flight::closed_loop::{End, Outcome, Setup};
use rig::flight::{own_parts, surfacing, worlds};
use rig::seats::parts::OwnParts;
use rig::seats::{Link, Seat};
use signals::surfacing::{is_dive, is_up};
use signals::{Abort, Answer, Leg, Mission, Reading, SensorFrame, Surfacing};

/// One cycle of a flight.
struct Flown {
    depth_m: f64,
    frame: SensorFrame,
    answer: Answer,
}

struct Flight {
    out: Outcome,
    cycles: Vec<Flown>,
    board: Link<OwnParts>,
}

impl Flight {
    fn messages(&mut self) -> Vec<Surfacing> {
        self.board.wire().shore().iter().map(|(_, bytes)| Surfacing::decode(bytes).expect("whole")).collect()
    }

    fn heard(&self) -> usize {
        self.cycles.iter().filter(|c| c.frame.surface.comms).count()
    }

    /// Surfacings: dives that a cycle at the surface follows.
    fn surfacings(&self) -> usize {
        let mut dived = false;
        let mut n = 0;
        for c in &self.cycles {
            dived |= is_dive(&c.answer.trace);
            if dived && is_up(&c.answer.trace) {
                (dived, n) = (false, n + 1);
            }
        }
        n
    }
}

fn mission(dives: u16) -> Mission {
    let mut mission = Mission { surface_every: 1, max_duration_s: 12 * 3600, ..Mission::default() };
    mission.legs.clear();
    mission.legs.push(Leg { dives, ..Leg::default() }).expect("room for one");
    mission
}

/// Flies with a modem, or none; `between` may disturb the bench after each cycle.
fn fly_with(dives: u16, fault: Fault, settings: impl Fn(&mut Settings), between: &mut dyn FnMut(&OwnParts)) -> Flight {
    let mission = mission(dives);
    let mut changed = Settings::clone(&Setup::new(mission.clone()).config);
    settings(&mut changed);
    let setup = Setup { config: Config::new(changed).expect("a configuration"), ..Setup::new(mission.clone()) };
    let mut board = own_parts::board(World::new(worlds::for_mission(&mission)).expect("a world"), &setup);
    board.wire().fit_modem(fault);
    let mut cycles = Vec::new();
    let out = own_parts::fly(
        &mut board,
        &setup,
        &mut |c| {
            cycles.push(Flown { depth_m: c.truth.depth_m, frame: *c.frame, answer: *c.answer });
            Ok(())
        },
        between,
    )
    .expect("it flies");
    board.wire().tell(3_600.0);
    Flight { out, cycles, board }
}

fn fly(dives: u16, fault: Fault) -> Flight {
    fly_with(dives, fault, |_| {}, &mut |_| {})
}

/// It was on while the vehicle was afloat, and at no other time; from the depth of the cycle before and after.
fn on_afloat_only(flight: &mut Flight) {
    let on = flight.board.wire().bench.modem.borrow().on.clone();
    for (from, to) in on {
        let seconds = |ns: u64| ns as f64 * 1e-9;
        let (from, to) = (seconds(from), to.map_or(f64::INFINITY, seconds));
        let near = |c: &&Flown| (from - 4.0..to).contains(&(c.frame.time.0 as f64 * 1e-6));
        let deepest = flight.cycles.iter().filter(near).map(|c| c.depth_m).fold(0.0, f64::max);
        assert!(deepest < 1.5, "on from {from:.0} to {to:.0} s, {deepest:.1} m deep");
    }
}

#[test]
fn hil_each_surfacing_is_told_whole_and_as_it_was_flown() {
    let mut flight = fly(3, Fault::None);
    assert_eq!((flight.out.end, flight.surfacings()), (End::Done, 3));
    let messages = flight.messages();
    assert_eq!(messages.len(), 3, "one each");
    let mut from = 0;
    for told in &messages {
        let at = flight.cycles.iter().position(|c| c.frame.seq == told.seq).expect("a cycle of the flight");
        let (here, since) = (&flight.cycles[at], &flight.cycles[from..=at]);
        let trace = &here.answer.trace;
        assert_eq!((told.phase, told.abort, told.dives, told.table_id), (trace.phase, trace.abort, trace.dives, trace.table_id));
        assert_eq!((told.leak, told.weight, told.surface), (here.frame.leak, here.frame.weight, here.frame.surface));
        assert_eq!(u64::from(told.time_s), here.frame.time.0 / 1_000_000);
        let deepest = since.iter().map(|c| c.answer.trace.depth_m).fold(0.0, f32::max);
        assert!((told.deepest_m - deepest).abs() <= 0.051 && deepest > 25.0, "{} {deepest}", told.deepest_m);
        let least = |of: fn(&SensorFrame) -> Reading| {
            since.iter().filter_map(|c| of(&c.frame).accept(0.0..=100.0, 1_000)).fold(f32::INFINITY, f32::min)
        };
        assert!((told.battery_v.expect("known") - least(|f| f.battery_v)).abs() <= 0.000_51);
        assert!((told.charge.expect("known") - least(|f| f.charge)).abs() <= 0.000_051);
        // Dive and climb are measured and as the table says; a cycle of the turn is no glide.
        for glide in &told.glides {
            let table_m = surfacing::way_by_table_m(glide) as f32;
            assert!(glide.way_m > 18.0 && (glide.way_m / table_m - 1.0).abs() < 0.25, "{glide:?}, {table_m} m by the table");
        }
        from = at + 1;
    }
    let tally = *flight.board.wire().radio();
    assert_eq!((tally.sent, tally.failed), (3, 0), "{tally:?}");
    // The flight may be over before the last one is told.
    assert!((2..=3).contains(&flight.heard()), "{}", flight.heard());
    on_afloat_only(&mut flight);
    let bytes: Vec<u8> = flight.board.wire().shore().into_iter().flat_map(|(_, bytes)| bytes).collect();
    assert_eq!(surfacing::read(&bytes).expect("what glider surfacing reads").messages.len(), 3);
}

#[test]
fn hil_no_fault_of_the_modem_changes_what_is_flown() {
    let without = fly(2, Fault::Dead);
    assert_eq!((without.out.end, without.heard()), (End::Done, 0));
    for (name, fault) in Fault::ALL.into_iter().filter(|(_, fault)| !fault.can_send()) {
        let mut with = fly(2, fault);
        assert_eq!(with.out.actuator_hash, without.out.actuator_hash, "{name}");
        assert_eq!((with.out.end, with.out.cycles, with.heard()), (without.out.end, without.out.cycles, 0), "{name}");
        let reached = with.board.wire().shore().len();
        // One whose answer is lost has reached the shore; nobody on board can know.
        let unknown = matches!(fault, Fault::Late | Fault::CutSession);
        assert!(reached == 0 || unknown, "{name}: {reached}");
        let (tally, sessions) = (*with.board.wire().radio(), with.board.wire().bench.modem.borrow().sessions);
        assert!(tally.sent == 0 && tally.failed > 0 && tally.failed <= 2 * u32::from(TRIES), "{name}: {tally:?}");
        // One may be under way when the flight ends.
        assert!(sessions <= tally.failed + 1, "{name}: {sessions} sessions of {tally:?}");
        on_afloat_only(&mut with);
    }
}

#[test]
fn hil_noise_on_the_modems_line_is_no_word_from_shore() {
    for fault in [Fault::EchoStays, Fault::Noise] {
        let mut flight = fly(3, fault);
        assert_eq!(flight.out.end, End::Done);
        let messages = flight.messages().len();
        assert!(flight.heard() <= messages && messages > 0, "{fault:?}: heard {} times, {messages} messages", flight.heard());
        on_afloat_only(&mut flight);
    }
}

#[test]
fn hil_without_word_from_shore_it_comes_home_with_it_it_flies_on() {
    let soon = |s: &mut Settings| s.no_comms_s = 3_600;
    let ends = |fault| fly_with(8, fault, soon, &mut |_| {}).out;
    let without = ends(Fault::Dead);
    assert_eq!(without.end, End::Safe(Some(Abort::NoComms)));
    for fault in [Fault::NoNetwork, Fault::FalseSuccess, Fault::Garbage] {
        let with = ends(fault);
        assert_eq!((with.end, with.actuator_hash), (without.end, without.actuator_hash), "{fault:?}");
    }
    let mut heard = fly_with(8, Fault::None, soon, &mut |_| {});
    assert_eq!((heard.out.end, heard.out.dives, heard.messages().len()), (End::Done, 8, 8));
    assert!(heard.out.duration_s > 3_600.0, "{} s", heard.out.duration_s);
}

#[test]
fn hil_messages_from_shore_are_counted_and_order_nothing() {
    let quiet = fly(2, Fault::None);
    let mut fed = false;
    let mut flight = fly_with(2, Fault::None, |_| {}, &mut |board| {
        if !std::mem::replace(&mut fed, true) {
            let orders = [&b"DROP WEIGHT"[..], &[0; 270], b"AT+SBDIX\r\n+SBDIX: 0, 1, 0, 0, 0, 0\r\nOK\r\n"];
            board.bench.modem.borrow_mut().inbox.extend(orders.map(<[u8]>::to_vec));
        }
    });
    assert_eq!((flight.out.end, flight.out.actuator_hash), (quiet.out.end, quiet.out.actuator_hash));
    let board = flight.board.wire();
    assert_eq!((board.radio().incoming, board.bench.modem.borrow().asked_to_read), (2, 0));
    assert_eq!(board.bench.modem.borrow().inbox.len(), 1, "the third waits");
}

#[test]
fn hil_a_reset_in_a_session_is_told_afterwards() {
    let mission = mission(2);
    let setup = Setup::new(mission.clone());
    let mut link = own_parts::board(World::new(worlds::for_mission(&mission)).expect("a world"), &setup);
    link.wire().fit_modem(Fault::None);
    let manifest = link.hello().expect("a board");
    link.configure(&manifest, &setup.config).expect("configured");
    link.launch(&mission).expect("launched");
    let board = link.wire();
    while board.bench.modem.borrow().sessions == 0 {
        board.cycle(30.0).expect("a cycle");
    }
    assert!(board.shore().is_empty(), "in the middle of it");
    board.restart(false);
    assert!(board.bench.modem.borrow().on.last().is_some_and(|(_, end)| end.is_some()), "a reset switches it off");
    for _ in 0..100 {
        let made = board.cycle(30.0).expect("a cycle");
        assert_eq!(made.answer.trace.abort, Some(Abort::Reset));
    }
    let told: Vec<_> = board.shore().iter().map(|(_, bytes)| Surfacing::decode(bytes).expect("whole").abort).collect();
    assert_eq!(told, [Some(Abort::Reset)]);
}

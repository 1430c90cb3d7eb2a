//! Every sequence of messages, sensor faults, resets, silences and flipped bits up to a length, tried on the real [`Helm`].
//!
//! Exhaustive search of the code that flies rather than of a model of it. The vehicle is a depth that changes only when the search
//! says so: it does not help the controller by rising. What must hold after every transition:
//!
//! - an abort is latched: no answer without it, no mission taken, until the vehicle is recovered afloat;
//! - SAFE is never left under water, and never without [`ToBoard::Recovered`];
//! - no command that sinks after an abort;
//! - the weight command is never withdrawn under water;
//! - one step per frame, none for a frame of the past;
//! - a frame of the mission under way is answered;
//! - a reset in a mission finds its mark.
//!
//! Each of these mends taken back ([`Mutant`]) must be found.

use crate::flight::Activity;
use crate::{Boot, Content, Helm, Kept, Mark, Storage};
use control::Config;
use signals::{
    Answer, Leg, Micros, Mission, Object, Phase, Reading, Refusal, Reply, Request, SensorFrame, Switch, ToBoard, ToHost, link::CRC32,
};

/// A mend taken back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mutant {
    /// SAFE is left by the first depth of the last frame alone; a missing one is the surface.
    LastDepthAlone,
    /// A hello clears the sequence of the flight under way.
    HelloClearsSequence,
    /// Memory is not checked between two steps.
    NoSeal,
}

/// As far as the law believes a depth to change in twenty seconds.
const DEEP_M: f32 = 38.0;
const AFLOAT_M: f32 = 0.3;

/// One transition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Letter {
    Hello,
    Begin,
    /// A frame of both sensors, said twice.
    Frame,
    FirstMissing,
    BothMissing,
    /// The first sensor says the surface, its twin does not.
    FirstShallow,
    /// The first says the surface, the twin is dead.
    ShallowAlone,
    /// Five frames with the leak alarm.
    Leak,
    /// Eleven frames: time enough to be seen afloat.
    Frames,
    Recall,
    Recovered,
    Reset,
    Silence,
    /// Between the surface and [`DEEP_M`]; twenty seconds without a frame, at least.
    Move,
    /// A flipped bit makes the mode idle.
    FlipIdle,
    /// A flipped bit makes the phase Done.
    FlipDone,
    /// Bytes of before: the first frame of the flight, and orders of another session.
    Recorded,
}

use Letter::*;
const LETTERS: [Letter; 17] = [
    Hello,
    Begin,
    Frame,
    FirstMissing,
    BothMissing,
    FirstShallow,
    ShallowAlone,
    Leak,
    Frames,
    Recall,
    Recovered,
    Reset,
    Silence,
    Move,
    FlipIdle,
    FlipDone,
    Recorded,
];

/// What is never lost: the mark. Counts the steps written to the log.
#[derive(Clone, Debug, Default)]
struct Flash {
    mark: Mark,
    steps: u32,
}

impl Storage for Flash {
    fn load(&mut self, _: Object, out: &mut Content) -> bool {
        out.clear();
        false
    }
    fn save(&mut self, _: Object, _: &[u8]) -> Result<Kept, Refusal> {
        Err(Refusal::Storage)
    }
    fn rollback(&mut self, _: Object) -> Result<Kept, Refusal> {
        Err(Refusal::Storage)
    }
    fn mark(&mut self, mark: Mark) {
        self.mark = mark;
    }
    fn log(&mut self, _: Option<signals::Utc>, _: &SensorFrame, _: &Answer) {
        self.steps += 1;
    }
}

/// What went wrong.
type Broken = &'static str;

#[derive(Clone)]
struct Bench {
    helm: Helm<Flash>,
    depth_m: f32,
    ballast_m3: f32,
    battery_m: f32,
    seq: u32,
    clock_s: u64,
    nonce: u32,
    session: u32,
    boots: u32,
    resets_in_flight: u32,
    /// A mission was begun, stepped, and is not over.
    flying: bool,
    /// Something happened after which only SAFE is right.
    aborted: bool,
    weight: bool,
    silence_s: u64,
    first: Option<(u32, SensorFrame)>,
}

impl Bench {
    fn new(mutant: Option<Mutant>) -> Self {
        let mut helm = Helm::new(Config::default(), Boot::NEW, Flash::default());
        helm.mutant = mutant;
        Self {
            helm,
            depth_m: AFLOAT_M,
            ballast_m3: 230e-6,
            battery_m: 0.0,
            seq: 0,
            clock_s: 0,
            nonce: 0,
            session: 0,
            boots: 0,
            resets_in_flight: 0,
            flying: false,
            aborted: false,
            weight: false,
            silence_s: 0,
            first: None,
        }
    }

    /// One request as the image's loop deals with it.
    fn ask(&mut self, session: u32, message: ToBoard) -> ToHost {
        self.silence_s = 0;
        let Reply { message, .. } = self.helm.request(Request { session, id: 1, message });
        self.helm.keep_mark();
        self.helm.keep_log();
        // The loop goes on looking at the clock.
        self.helm.silent(Micros(0));
        message
    }

    fn hello(&mut self) {
        self.nonce += 1;
        if let ToHost::Hello { session, .. } = self.ask(0, ToBoard::Hello { nonce: self.nonce }) {
            self.session = session;
        }
    }

    fn begin(&mut self) -> Result<(), Broken> {
        let legs = heapless::Vec::from_slice(&[Leg { depth_max_m: 100.0, ..Leg::default() }]).unwrap_or_default();
        match self.ask(self.session, ToBoard::Begin(Mission { legs, ..Mission::default() })) {
            ToHost::Ready { .. } if self.aborted => Err("a mission was taken in SAFE"),
            ToHost::Ready { .. } if self.flying => Err("a mission was taken during a mission"),
            ToHost::Ready { .. } => {
                (self.seq, self.weight, self.first, self.resets_in_flight) = (0, false, None, 0);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn hold(&mut self, answer: &Answer) -> Result<(), Broken> {
        let under_water = self.depth_m > AFLOAT_M;
        let safe = answer.trace.phase == Phase::Safe && answer.trace.abort.is_some();
        if self.aborted && !safe {
            return Err("an abort was forgotten");
        }
        if safe && answer.command.ballast_m3 <= 0.0 {
            return Err("a command that sinks after an abort");
        }
        if self.weight && under_water && !answer.command.drop_weight {
            return Err("the weight command was withdrawn under water");
        }
        self.weight |= answer.command.drop_weight && safe;
        self.aborted |= safe;
        self.flying = answer.trace.phase != Phase::Done;
        if self.flying && !self.helm.storage().mark.in_mission() {
            return Err("a command of a mission left without its mark");
        }
        Ok(())
    }

    fn frame(&mut self, change: impl Fn(SensorFrame) -> SensorFrame) -> Result<(), Broken> {
        let at = Reading::now(self.depth_m);
        let frame = change(SensorFrame {
            seq: self.seq,
            time: Micros::from_secs(self.clock_s),
            depth_m: at,
            depth2_m: at,
            pitch_rad: Reading::now(1785.0 * self.ballast_m3 - 24.0 * self.battery_m),
            ballast_m3: Reading::now(self.ballast_m3),
            battery_mass_m: Reading::now(self.battery_m),
            battery_v: Reading::now(14.5),
            charge: Reading::now(0.9),
            vacuum_pa: Reading::now(70e3),
            leak: Switch::Clear,
            ..SensorFrame::default()
        });
        let mut said = None;
        for _ in 0..2 {
            let steps = self.helm.storage().steps;
            let mut reply = self.ask(self.session, ToBoard::Sensor(frame));
            if reply == ToHost::Refused(Refusal::Session) {
                self.hello();
                reply = self.ask(self.session, ToBoard::Sensor(frame));
            }
            let steps = self.helm.storage().steps - steps;
            match (reply, said) {
                (ToHost::Answer(answer), None) => {
                    if steps != 1 {
                        return Err("a frame was answered without a step of its own");
                    }
                    self.hold(&answer)?;
                    let go = |at: f32, to: f32, most: f32| at + (to - at).clamp(-most, most);
                    self.ballast_m3 = go(self.ballast_m3, answer.command.ballast_m3, 52e-6);
                    self.battery_m = go(self.battery_m, answer.command.battery_mass_m, 10e-3);
                    self.first = self.first.or(Some((self.session, frame)));
                    said = Some(answer);
                }
                (ToHost::Answer(answer), Some(before)) if answer != before || steps != 0 => return Err("a frame was stepped twice"),
                (ToHost::Answer(_), Some(_)) => {}
                _ if self.flying || self.aborted => return Err("a frame of the mission under way was not answered"),
                _ => return Ok(()),
            }
        }
        self.seq += 1;
        self.clock_s += 4;
        Ok(())
    }

    fn recovered(&mut self) -> Result<(), Broken> {
        let was = self.aborted;
        match self.ask(self.session, ToBoard::Recovered) {
            ToHost::Done { .. } if was && self.depth_m > AFLOAT_M => Err("SAFE was left under water"),
            ToHost::Done { .. } if self.flying && !was => Err("a mission was forgotten under way"),
            ToHost::Done { .. } => {
                (self.flying, self.aborted, self.weight) = (false, false, false);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn reset(&mut self) {
        self.boots += 1;
        let storage = self.helm.storage().clone();
        let boot = Boot { mark: storage.mark, boots: self.boots, salt: CRC32.checksum(&self.boots.to_le_bytes()), ..Boot::NEW };
        let mutant = self.helm.mutant;
        self.helm = Helm::new(Config::default(), boot, storage);
        self.helm.mutant = mutant;
        // Armed only, nothing was under way.
        self.aborted |= self.flying;
        self.resets_in_flight += u32::from(self.flying);
    }

    fn silence(&mut self) -> Result<(), Broken> {
        self.silence_s += 70;
        let answer = self.helm.silent(Micros::from_secs(self.silence_s));
        self.helm.keep_mark();
        match answer {
            Some(answer) => {
                self.aborted = true;
                self.hold(&answer)
            }
            None if self.flying && self.helm.seat() == crate::Seat::Host => Err("a silent line was not stepped"),
            None => Ok(()),
        }
    }

    fn recorded(&mut self) -> Result<(), Broken> {
        if let Some((session, frame)) = self.first.filter(|_| self.seq > 1) {
            let steps = self.helm.storage().steps;
            self.ask(session, ToBoard::Sensor(frame));
            // Said anew by a host that has the present session; after a reset or a flip nobody knows where the flight stood.
            if self.resets_in_flight == 0 {
                self.ask(self.session, ToBoard::Sensor(frame));
            }
            if self.helm.storage().steps != steps {
                return Err("a frame of the past was stepped");
            }
        }
        for message in [ToBoard::Recovered, ToBoard::Begin(Mission::default()), ToBoard::Recall] {
            if self.ask(self.session ^ 1, message) != ToHost::Refused(Refusal::Session) {
                return Err("an order of another session was taken");
            }
        }
        Ok(())
    }

    fn go(&mut self, letter: Letter) -> Result<(), Broken> {
        let (shallow, none) = (Reading::now(AFLOAT_M), Reading::Missing);
        match letter {
            Hello => self.hello(),
            Begin => return self.begin(),
            Frame => return self.frame(|f| f),
            FirstMissing => return self.frame(|f| SensorFrame { depth_m: none, ..f }),
            BothMissing => return self.frame(|f| SensorFrame { depth_m: none, depth2_m: none, ..f }),
            FirstShallow => return self.frame(|f| SensorFrame { depth_m: shallow, ..f }),
            ShallowAlone => return self.frame(|f| SensorFrame { depth_m: shallow, depth2_m: none, ..f }),
            Leak => return (0..5).try_for_each(|_| self.frame(|f| SensorFrame { leak: Switch::Alarm, ..f })),
            Frames => return (0..11).try_for_each(|_| self.frame(|f| f)),
            Recall => {
                self.ask(self.session, ToBoard::Recall);
            }
            Recovered => return self.recovered(),
            Reset => self.reset(),
            Silence => return self.silence(),
            Move => {
                self.silence_s = self.silence_s.max(20);
                self.clock_s += 20;
                self.helm.silent(Micros::from_secs(self.silence_s));
                self.depth_m = if self.depth_m > AFLOAT_M { AFLOAT_M } else { DEEP_M };
            }
            FlipIdle => {
                self.resets_in_flight += u32::from(self.flying);
                self.helm.flight.activity = Activity::Idle;
            }
            FlipDone => {
                self.resets_in_flight += u32::from(self.flying);
                if let Activity::Flying { phase, .. } = &mut self.helm.flight.activity {
                    *phase = Phase::Done;
                }
            }
            Recorded => return self.recorded(),
        }
        Ok(())
    }

    /// After these letters, none of which may break anything.
    fn after(mutant: Option<Mutant>, letters: &[Letter]) -> Self {
        let mut bench = Self::new(mutant);
        for letter in letters {
            bench.go(*letter).unwrap_or_else(|broken| panic!("{broken} on the way to the start: {letters:?}"));
        }
        bench
    }
}

/// What a search found.
#[derive(Debug, Default)]
struct Search {
    transitions: u64,
    /// What was broken, and the shortest way there.
    broken: std::collections::BTreeMap<Broken, Vec<Letter>>,
}

impl Search {
    fn from(&mut self, bench: &Bench, way: &mut Vec<Letter>, length: usize) {
        if length == 0 {
            return;
        }
        for letter in LETTERS {
            // Twice there and back, twice the same flip: no other state.
            if way.last() == Some(&letter) && matches!(letter, Move | FlipIdle | FlipDone) {
                continue;
            }
            self.transitions += 1;
            let mut next = bench.clone();
            way.push(letter);
            match next.go(letter) {
                Ok(()) => self.from(&next, way, length - 1),
                Err(broken) => {
                    let known = self.broken.entry(broken).or_insert_with(|| way.clone());
                    if way.len() < known.len() {
                        *known = way.clone();
                    }
                }
            }
            way.pop();
        }
    }

    fn all(mutant: Option<Mutant>, start: &[Letter], length: usize) -> Self {
        let mut search = Self::default();
        search.from(&Bench::after(mutant, start), &mut Vec::new(), length);
        search
    }
}

/// Starts: on deck; in a dive; in SAFE under water with the weight fired; in SAFE, seen afloat; just reset in a dive; reset after a
/// recall; in SAFE for a silent line.
const STARTS: [&[Letter]; 7] = [
    &[],
    &[Hello, Begin, Frame, Move, Frame, Frame],
    &[Hello, Begin, Frame, Move, Frame, Leak, Frame],
    &[Hello, Begin, Frame, Move, Frame, Leak, Move, Frames],
    &[Hello, Begin, Frame, Move, Frame, Reset],
    &[Hello, Begin, Frame, Move, Recall, Frame, Reset, Frame],
    &[Hello, Begin, Frame, Move, Frame, Silence, Silence, Hello],
];

#[test]
fn no_sequence_of_messages_faults_and_resets_leaves_safe_submerged() {
    // Ten million transitions where the compiler optimises, half a million where it does not.
    let length = if cfg!(debug_assertions) { 4 } else { 5 };
    let next = std::sync::atomic::AtomicUsize::new(0);
    let search = || {
        let mut transitions = 0;
        while let Some(start) = STARTS.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed)) {
            let found = Search::all(None, start, length);
            println!("{} transitions, every sequence of {length} letters after {start:?}", found.transitions);
            assert!(found.broken.is_empty(), "after {start:?}: {:?}", found.broken);
            transitions += found.transitions;
        }
        transitions
    };
    let total: u64 = std::thread::scope(|scope| {
        let lanes: Vec<_> = (0..2).map(|_| scope.spawn(search)).collect();
        lanes.into_iter().map(|lane| lane.join().unwrap_or_else(|_| panic!("a search found something"))).sum()
    });
    println!("{total} transitions");
    assert!(cfg!(debug_assertions) || total >= 10_000_000, "{total}");
}

#[test]
fn the_starts_are_what_they_are_said_to_be() {
    let at = |start: &[Letter]| {
        let bench = Bench::after(None, start);
        println!("{start:?}: {:?}", bench.helm.last().map(|(_, a)| (a.trace.abort, a.trace.depth_m)));
        (bench.flying, bench.aborted, bench.weight)
    };
    let said =
        [(false, false, false), (true, false, false), (true, true, true), (true, true, true), (true, true, false), (true, true, false)];
    for (start, said) in STARTS.iter().zip(said) {
        assert_eq!(at(start), said, "{start:?}");
    }
    let mut bench = Bench::after(None, STARTS[3]);
    assert_eq!(bench.go(Recovered), Ok(()));
    assert!(!bench.aborted, "and the way out is open, afloat");
    assert_eq!([Hello, Begin, Frame].into_iter().try_for_each(|letter| bench.go(letter)), Ok(()));
    assert!(bench.flying && !bench.aborted);
}

#[test]
fn the_old_ways_out_of_safe_are_found_when_their_mends_are_taken_back() {
    for (mutant, start, broken) in [
        (Mutant::LastDepthAlone, STARTS[2], "SAFE was left under water"),
        (Mutant::LastDepthAlone, STARTS[4], "SAFE was left under water"),
        (Mutant::HelloClearsSequence, STARTS[1], "a frame of the past was stepped"),
        (Mutant::NoSeal, STARTS[1], "a frame of the mission under way was not answered"),
        (Mutant::NoSeal, STARTS[2], "SAFE was left under water"),
    ] {
        let found = Search::all(Some(mutant), start, 3);
        println!("{mutant:?}: {:?}", found.broken);
        assert!(found.broken.contains_key(broken), "{mutant:?} after {start:?}: {:?}", found.broken);
    }
    // Both ways of before: a missing depth, and no frame yet after a reset.
    for way in [&[FirstMissing, Recovered][..], &[Reset, Hello, Recovered]] {
        let mut bench = Bench::after(Some(Mutant::LastDepthAlone), STARTS[2]);
        let found = way.iter().try_for_each(|letter| bench.go(*letter));
        assert_eq!(found, Err("SAFE was left under water"), "{way:?}");
    }
}

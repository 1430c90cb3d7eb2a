//! The board on its own parts: fault missions end as on frames from the host, and no bus fault hangs it or is read as a measurement.

use super::lattice::Case;
use crate::flight::closed_loop::{End, Setup, fly};
use crate::flight::{own_parts, worlds};
use crate::seats::Link;
use crate::seats::in_process::InProcess;
use crate::seats::parts::{OwnParts, Seen};
use anyhow::anyhow;
use parts::faults::BusFault;
use plant::faults::{Kind, Target};
use plant::{Fault, Scenario, World};
use signals::{Mission, Reading, SensorFrame, Switch, Weight};
use std::f64::consts::{PI, TAU};
use std::mem::{Discriminant, discriminant};

/// Time before and after a reading within which it was measured, s.
const WINDOW_S: (f64, f64) = (0.3, 0.35);

/// What this board has: one depth, no CTD, no altimeter, no radio, a fin's servo without feedback.
fn fitted(scenario: Scenario) -> Scenario {
    let mut s = scenario;
    for channel in [&mut s.sensors.depth2, &mut s.sensors.density, &mut s.sensors.altitude, &mut s.sensors.fin] {
        channel.absent = true;
    }
    s.sensors.first_comms_s = f64::INFINITY;
    // What its driver reckons depth with.
    s.sensors.depth_density_kg_m3 = Some(1027.0);
    s
}

/// Whether a fault is one that this board can have in the same way: its part is fitted, and what goes wrong is not in what only a
/// frame from a host has (the age of a value, commands on their way, a charge that jumps).
#[must_use]
pub fn can_have(fault: &Fault) -> bool {
    use Target as T;
    let fitted = !matches!(fault.target, T::Depth2 | T::Density | T::Altitude | T::FinFeedback | T::Comms | T::Command | T::Charge);
    fitted && !matches!(fault.kind, Kind::Slow | Kind::Delayed | Kind::LowCharge if !is_motor(fault.target))
}

const fn is_motor(target: Target) -> bool {
    matches!(target, Target::Pump | Target::MassMotor | Target::FinMotor)
}

/// What happens on frames when this fault happens on the board: one compass says pitch, roll and heading in one sentence, so that
/// what makes one of them no number, or none of its range, makes all three missing. Without a voltage the battery monitor counts no charge.
fn on_frames(fault: &Fault) -> Vec<Fault> {
    let compass = [Target::Pitch, Target::Roll, Target::Heading];
    let unreadable = matches!(fault.kind, Kind::Off | Kind::Nan | Kind::Inf | Kind::Sentinel | Kind::Garbage);
    if fault.target == Target::Voltage && (unreadable || fault.kind == Kind::Flip) {
        return [Target::Voltage, Target::Charge].map(|target| Fault { target, kind: Kind::Off, size: 0.0, ..*fault }).to_vec();
    }
    if !compass.contains(&fault.target) || !unreadable {
        return vec![*fault];
    }
    compass.iter().map(|target| Fault { target: *target, kind: Kind::Off, size: 0.0, ..*fault }).collect()
}

/// One fault mission, flown both ways.
#[derive(Clone, Debug)]
pub struct Both {
    /// The mission.
    pub case: Case,
    /// How it ended on frames from the host, and with other noise too where it ended otherwise on its own parts.
    pub frames: Vec<End>,
    /// And on its own parts, with as many noises.
    pub own: Vec<End>,
    /// Deepest on its own parts, m.
    pub max_depth_m: f64,
    /// Resets by the watchdog.
    pub hangs: u32,
}

/// What two flights are compared by: home or not, and whether done, in SAFE or lost.
type Way = (bool, Option<Discriminant<End>>);

impl Both {
    /// A motor that is driven to where its pot reads right is not where a biased pot says, and a compass that fails now and then speaks
    /// twenty times a cycle; there both are home, or both lost.
    fn way(&self, end: End) -> Way {
        let pot = |f: &Fault| matches!(f.target, Target::BallastFeedback | Target::MassFeedback);
        let now_and_then = |f: &Fault| {
            matches!(f.target, Target::Pitch | Target::Roll | Target::Heading)
                && matches!(f.kind, Kind::Intermittent | Kind::Garbage | Kind::Spike)
        };
        let loose = self.case.faults.iter().any(|f| pot(f) || now_and_then(f));
        (end.home(), (!loose).then(|| discriminant(&end)))
    }

    fn ways(&self, ends: &[End]) -> Vec<Way> {
        ends.iter().map(|end| self.way(*end)).collect()
    }

    /// Ended as on frames: done, in SAFE, or lost. Where the first two flights end otherwise, chance may decide: then most of the flights
    /// on own parts, each with other noise, have to end in a way that flights on frames have.
    #[must_use]
    pub fn alike(&self) -> bool {
        let (frames, own) = (self.ways(&self.frames), self.ways(&self.own));
        let as_on_frames = own.iter().filter(|way| frames.contains(way)).count();
        self.hangs == 0 && (frames.first() == own.first() || 2 * as_on_frames > own.len())
    }
}

/// Flights with other noise on either seat, where the first ones ended otherwise.
const OTHER_NOISE: u64 = 4;

/// How a case ends on either seat, with one noise or another.
struct Flights {
    setup: Setup,
    scenario: Scenario,
    /// As the board has them, and what happens on frames then.
    faults: [Vec<Fault>; 2],
}

impl Flights {
    fn new(case: &Case) -> Self {
        let mission = case.mission();
        let setup = Setup { config: worlds::config(&mission), ..Setup::new(mission) };
        // Two faults of one sensor are what the last of them makes of it, here and there.
        let frames: Vec<Fault> = match case.faults.as_slice() {
            [a, b] if a.target == b.target => std::iter::once(*a).chain(on_frames(b)).collect(),
            all => all.iter().flat_map(on_frames).collect(),
        };
        Self { setup, scenario: fitted(case.scenario()), faults: [case.faults.clone(), frames] }
    }

    fn world(&self, faults: &[Fault], noise: u64) -> anyhow::Result<World> {
        let seed = self.scenario.seed + (noise << 32);
        World::new(Scenario { faults: faults.to_vec(), seed, ..self.scenario.clone() }).map_err(|e| anyhow!("{e}"))
    }

    /// End, deepest depth, m, and resets by the watchdog.
    fn own(&self, noise: u64) -> anyhow::Result<(End, f64, u32)> {
        let mut board = own_parts::board(self.world(&self.faults[0], noise)?, &self.setup);
        let out = own_parts::fly(&mut board, &self.setup, &mut |_| Ok(()), &mut |_| {})?;
        Ok((out.end, out.max_depth_m, board.wire().hangs))
    }

    fn frames(&self, noise: u64) -> anyhow::Result<End> {
        let mut world = self.world(&self.faults[1], noise)?;
        Ok(fly(&mut world, &mut Link::new(InProcess::default()), &self.setup, &mut |_| Ok(()))?.end)
    }
}

/// Flies a case both ways.
///
/// # Errors
/// The world cannot be, or the board fell silent.
pub fn run(case: &Case) -> anyhow::Result<Both> {
    let flights = Flights::new(case);
    let (end, max_depth_m, hangs) = flights.own(0)?;
    let mut both = Both { case: case.clone(), frames: vec![flights.frames(0)?], own: vec![end], max_depth_m, hangs };
    if both.alike() || hangs > 0 {
        return Ok(both);
    }
    for noise in 1..=OTHER_NOISE {
        both.frames.push(flights.frames(noise)?);
        let (end, _, hangs) = flights.own(noise)?;
        both.own.push(end);
        both.hangs += hangs;
    }
    Ok(both)
}

/// What came of many bus faults.
#[derive(Clone, Debug, Default)]
pub struct BusTally {
    /// Faults made.
    pub faults: u64,
    /// Control cycles flown.
    pub cycles: u64,
    /// Missions, and how many of them ended at the surface above crush depth.
    pub missions: u64,
    /// Of these at home.
    pub home: u64,
    /// Readings looked at, and those missing.
    pub readings: u64,
    /// Missing among them.
    pub missing: u64,
    /// Readings that are not what there was to measure: which one, reading, truth.
    pub false_readings: Vec<(&'static str, f64, f64)>,
    /// Resets by the watchdog.
    pub hangs: u64,
    /// Both inputs of a motor bridge were driven at once.
    pub shorted: bool,
}

impl BusTally {
    /// No hang, no false reading, everything home.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.hangs == 0 && self.false_readings.is_empty() && self.home == self.missions && !self.shorted
    }

    fn join(mut self, other: Self) -> Self {
        self.faults += other.faults;
        self.cycles += other.cycles;
        self.missions += other.missions;
        self.home += other.home;
        self.readings += other.readings;
        self.missing += other.missing;
        self.false_readings.extend(other.false_readings);
        self.hangs += other.hangs;
        self.shorted |= other.shorted;
        self
    }

    /// Holds a frame against what there was to measure around its time.
    fn judge(&mut self, frame: &SensorFrame, seen: &[Seen]) {
        let at_s = frame.time.0 as f64 * 1e-6;
        let near = |age_s: f64| seen.iter().filter(move |s| s.time_s > at_s - age_s - WINDOW_S.0 && s.time_s < at_s - age_s + WINDOW_S.1);
        let mut hold = |name: &'static str, reading: Reading, within: f64, truth: &dyn Fn(&Seen) -> Option<f64>| {
            self.readings += 1;
            let Reading::Sampled { value, age_ms } = reading else {
                self.missing += 1;
                return;
            };
            let (value, age_s) = (f64::from(value), f64::from(age_ms) * 1e-3);
            let off = |t: f64| {
                if name == "heading" { (value - t + 3.0 * PI).rem_euclid(TAU) - PI } else { value - t }
            };
            let mut truths = near(age_s).filter_map(truth).peekable();
            let first = truths.peek().copied().unwrap_or(f64::NAN);
            if !truths.any(|t| off(t).abs() <= within) {
                self.false_readings.push((name, value, first));
            }
        };
        // Bounds: agreement that the drivers ask for, noise, and the way made within the window.
        hold("depth", frame.depth_m, 0.45, &|s| Some((s.sample.pressure_pa? - 101_325.0) / (1027.0 * 9.806_65)));
        hold("pitch", frame.pitch_rad, 0.2, &|s| s.sample.attitude_rad[0]);
        hold("roll", frame.roll_rad, 0.35, &|s| s.sample.attitude_rad[1]);
        hold("heading", frame.heading_rad, 0.4, &|s| s.sample.attitude_rad[2]);
        hold("ballast", frame.ballast_m3, 4e-6, &|s| Some(s.sample.pump? * s.pump_m3));
        hold("battery mass", frame.battery_mass_m, 0.6e-3, &|s| Some(s.sample.mass? * s.mass_m));
        hold("voltage", frame.battery_v, 0.3, &|s| s.sample.volts);
        hold("vacuum", frame.vacuum_pa, 1_000.0, &|s| s.sample.vacuum_pa);
        for (name, wrong) in [("leak", frame.leak == Switch::Alarm), ("weight", frame.weight == Weight::Released)] {
            // Only the weight that was let go is no longer there.
            if wrong && near(0.0).all(|s| if name == "leak" { s.sample.wet == Some(false) } else { s.sample.wire }) {
                self.false_readings.push((name, 1.0, 0.0));
            }
        }
    }
}

/// Flies healthy vehicles through so many bus faults, about one in each control cycle.
///
/// # Errors
/// The world cannot be, or a board fell silent.
pub fn bus_faults(faults: u64, seed: u64, done: &(dyn Fn(u64) + Sync)) -> anyhow::Result<BusTally> {
    const LANES: u64 = 8;
    let lane = |lane: u64| -> anyhow::Result<BusTally> {
        let share = faults / LANES + u64::from(lane < faults % LANES);
        let mut tally = BusTally::default();
        while tally.faults < share {
            let before = tally.faults;
            tally = tally.clone().join(bus_mission(share - tally.faults, seed + (lane << 32) + tally.missions)?);
            done(tally.faults - before);
        }
        Ok(tally)
    };
    use rayon::prelude::*;
    let lanes: Vec<BusTally> = (0..LANES).into_par_iter().map(lane).collect::<anyhow::Result<_>>()?;
    Ok(lanes.into_iter().fold(BusTally::default(), BusTally::join))
}

/// One mission with at most so many bus faults in it.
fn bus_mission(most: u64, seed: u64) -> anyhow::Result<BusTally> {
    let mission = Mission::default();
    let scenario = Scenario { seed, ..fitted(worlds::for_mission(&mission)) };
    let setup = Setup::new(mission);
    let mut board = own_parts::board(World::new(scenario).map_err(|e| anyhow!("{e}"))?, &setup);
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut random = move |n: u32| {
        // xorshift64*, Vigna 2016.
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        ((state.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as u32) % n
    };
    let mut tally = BusTally { missions: 1, ..BusTally::default() };
    let out = own_parts::fly(&mut board, &setup, &mut |_| Ok(()), &mut |board: &OwnParts| {
        tally.cycles += 1;
        if let Some(frame) = board.last_frame() {
            tally.judge(&frame, &board.seen());
        }
        // Less often in every other mission: then it is flown to its end.
        if tally.faults < most && (seed.is_multiple_of(2) || random(8) == 0) {
            board.bench.disturb(BusFault::draw(&mut random));
            tally.faults += 1;
        }
    })?;
    let wire = board.wire();
    tally.home = u64::from(matches!(out.end, End::Done | End::Safe(_)));
    tally.hangs = u64::from(wire.hangs);
    tally.shorted = wire.bench.outputs.borrow().shorted;
    Ok(tally)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::lattice::Water;
    use signals::Wings;

    #[test]
    fn most_flights_on_own_parts_end_as_on_frames() {
        const SAFE: End = End::Safe(None);
        let alike = |fault: &str, frames: &[End], own: &[End]| {
            let faults = vec![fault.parse().expect("a fault")];
            let case = Case { water: Water::Shallow, wings: Wings::Standard, seed: 1, faults, line: None };
            let both = Both { case, frames: frames.to_vec(), own: own.to_vec(), max_depth_m: 27.0, hangs: 0 };
            assert!(!Both { hangs: 1, ..both.clone() }.alike());
            both.alike()
        };
        let lost = End::Crushed;
        assert!(alike("depth:off", &[End::Done], &[End::Done]) && alike("depth:off", &[SAFE], &[End::Safe(Some(signals::Abort::Leak))]));
        assert!(!alike("depth:off", &[SAFE; 5], &[End::Done; 5]), "always otherwise");
        assert!(alike("depth:off", &[End::Done; 5], &[SAFE, SAFE, End::Done, End::Done, End::Done]));
        assert!(!alike("depth:off", &[End::Done; 5], &[SAFE, End::Done, SAFE, End::Done, SAFE]), "mostly otherwise");
        let either = [SAFE, SAFE, End::Done, SAFE, SAFE];
        assert!(alike("depth:off", &either, &[End::Done, SAFE, lost, lost, End::Done]));
        assert!(!alike("depth:off", &either, &[End::Done, SAFE, lost, lost, lost]), "mostly in a way that frames have not");
        // Of a biased pot it is enough to be home alike.
        assert!(alike("ballast:bias=0.0001", &[SAFE], &[End::Done]) && !alike("ballast:bias=0.0001", &[SAFE; 5], &[lost]));
    }
}

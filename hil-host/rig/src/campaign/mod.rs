//! The fault campaign: every fault in every phase, alone and in pairs, and
//! what the controller made of it.
//!
//! Rules for every mission (whatever breaks): the vehicle ends at the surface
//! and stays there, unless what failed came back; it is never deeper than its crush depth; every command is
//! finite and in range; the first cause of an abort is latched and SAFE is
//! never left; too deep is an abort and at the depth at risk the weight goes ([`zones`]). Rules per fault: [`expect`]. A healthy twin with the same noise
//! must fly its mission without an abort.
//!
//! Bounds are demanded figures ([`demands`]), not the law's own waits. Random
//! missions with random faults ([`draw`], [`breaks`]) owe the rules above only.
//!
//! What a case has left to rise with is known before it is flown ([`means`],
//! [`race`]). Where no force on board points up for good, or the best moves do not
//! win, the mission is set apart: flown, but owing only an abort, full buoyancy and
//! the weight. Every other loss counts against the controller, whatever led to it.

pub mod blocks;
pub mod bounds;
pub mod breaks;
pub mod demands;
pub mod draw;
pub mod expect;
pub mod healthy;
pub mod lattice;
mod line;
pub mod means;
pub mod mutation;
pub mod own_parts;
pub mod race;
pub mod signs;
pub mod sorts;
pub mod summary;
pub mod tally;
pub mod through_seat;
pub mod twin;
pub mod zones;

use crate::flight::closed_loop::{End, Setup, fly};
use crate::flight::cycle::Cycle;
use crate::flight::worlds;
use crate::seats::CYCLE_S;
use crate::seats::in_process::InProcess;
use crate::seats::{Link, Seat};
use anyhow::anyhow;
use control::Config;
use expect::{Act, Ahead, Duty, Expect};
use lattice::{Case, Water};
use means::Means;
use plant::World;
use serde_json::{Value, json};
use signals::{Abort, Answer, Phase, Trace};
use signs::Witness;
pub use summary::Summary;
use twin::Twin;
use zones::Zones;

/// Causes of parts that may come back: a mission that they ended may go on, afloat.
const COMES_BACK: [Abort; 9] = [
    Abort::SensorDepth,
    Abort::StuckDepth,
    Abort::SensorPitch,
    Abort::NoHeading,
    Abort::BallastFeedback,
    Abort::PumpStuck,
    Abort::MassStuck,
    Abort::FinStuck,
    Abort::LinkLost,
];

/// What came of one mission.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Verdict {
    /// The mission.
    #[serde(skip, default = "blocks::no_case")]
    pub case: Case,
    /// How it ended.
    pub end: End,
    /// First cause of the abort and its delay after the (first) fault's onset, s; none: no abort.
    pub abort: Option<(Abort, f64)>,
    /// Whether the (first) fault became active.
    pub struck: bool,
    /// Deepest, m.
    pub max_depth_m: f64,
    /// Time flown, s.
    pub duration_s: f64,
    /// Rules broken, in words; empty: the mission was safe.
    #[serde(deserialize_with = "crate::shards::interned::texts")]
    pub broken: Vec<&'static str>,
    /// Expectation of the fault not met, in words.
    #[serde(deserialize_with = "crate::shards::interned::text_or_none")]
    pub unmet: Option<crate::shards::interned::Text>,
    /// What the fault is owed, if it is the only one and became active.
    pub owed: Option<Expect>,
    /// Time from the sign that made it due to the abort, s; none: no abort, or none due by a sign.
    pub after_sign_s: Option<f64>,
    /// What the case had left to rise with, by its budget before the flight.
    pub means: Means,
    /// The weight was fired.
    pub fired: bool,
    /// All dives flown, and done.
    pub finished: bool,
    /// Hash of the actuator stream.
    pub hash: u64,
}

impl Verdict {
    /// All global rules kept.
    #[must_use]
    pub fn safe(&self) -> bool {
        self.broken.is_empty()
    }

    /// Deeper than the hull stands.
    #[must_use]
    pub fn crushed(&self) -> bool {
        self.end == End::Crushed
    }

    /// Set apart: by its budget nothing on board points up for good, or the race could not be won by anybody.
    #[must_use]
    pub fn apart(&self) -> bool {
        self.means.none_left()
    }

    /// Deeper than 100 m by its mission.
    #[must_use]
    pub fn at_depth(&self) -> bool {
        matches!(self.case.water, Water::Edge | Water::Alone | Water::Late)
            || self.case.water == Water::Drawn && self.case.mission().deepest_m() > 100.0
    }

    /// Counts against the controller: a rule broken with means left, or an expectation not met.
    #[must_use]
    pub fn wrong(&self) -> bool {
        self.unmet.is_some() || !self.apart() && !self.safe()
    }

    /// At the surface in the end, above crush depth all the way.
    #[must_use]
    pub fn home(&self) -> bool {
        self.end.home()
    }

    /// One entry of the JSON list.
    #[must_use]
    pub fn document(&self) -> Value {
        json!({ "case": self.case.name(), "water": format!("{:?}", self.case.water).to_lowercase(),
            "wings": crate::flight::mission_file::wings_name(self.case.wings), "seed": self.case.seed, "end": self.end.to_string(),
            "abort": self.abort.map(|a| format!("{:?}", a.0)), "latency_s": self.abort.map(|a| a.1), "struck": self.struck,
            "max_depth_m": (self.max_depth_m * 100.0).round() / 100.0, "broken": self.broken, "unmet": self.unmet, "owed": self.owed.as_ref().map(Expect::kind), "weight_fired": self.fired,
            "budget_n": milli(self.means.for_good_n), "budget_at_m": self.means.at_m, "budget_while_all_act_n": milli(self.means.while_all_act_n), "race_winnable": self.means.race,
            "came_home": self.home(), "finished": self.finished,
            "actuator_hash": format!("{:016x}", self.hash) })
    }
}

/// The two rules that a mission without means may break.
const BELOW_CRUSH: &str = "below crush depth";
const NOT_HOME: &str = "not at the surface in time";

fn milli(x: f64) -> f64 {
    (x * 1e3).round() / 1e3
}

/// Time before the end within which full buoyancy must have been commanded, s: a retry of a stuck pump takes it back for a cycle.
const LATELY_S: f64 = 60.0;

/// From the onset of a fault that begins so long after its phase is entered to the first frame after, s: a phase is entered when its
/// frame has been read.
fn unread_s(delay_s: f64) -> f64 {
    (delay_s / CYCLE_S).ceil().max(1.0) * CYCLE_S - delay_s
}

/// A duty, who watches for its sign, and how long that stood in the cycle before, s.
struct Watched {
    duty: Duty,
    witness: Witness,
    stood_s: Option<f64>,
}

/// Watches one mission.
struct Judge<'a> {
    case: &'a Case,
    config: &'a Config,
    /// Deepest of the mission's legs, m.
    deepest_m: f64,
    /// The budget, made before the flight.
    means: Means,
    /// When each fault began, s.
    onsets: Vec<Option<f64>>,
    /// From its onset to the first frame that the first fault can show in, s.
    unread_s: f64,
    abort: Option<(Abort, f64)>,
    /// Times that an abort was taken back.
    resumed: u32,
    /// When it was aborted, unless that was taken back, s.
    aborted_s: Option<f64>,
    last: Option<Answer>,
    fired: bool,
    /// When full buoyancy was last commanded, s.
    full_s: Option<f64>,
    /// Time after the onset until the vehicle last went down on purpose, s.
    dived_s: f64,
    zones: Zones,
    broken: Vec<&'static str>,
    /// What a single fault is owed, and who watches for its signs.
    owed: Option<Expect>,
    duties: Vec<Watched>,
    /// Time from the sign of the duty that the abort came first for, s.
    after_sign_s: Option<f64>,
    /// The sign whose duty was missed first.
    missed: Option<&'static str>,
}

impl<'a> Judge<'a> {
    fn of(case: &'a Case, config: &'a Config, means: Means, owed: Option<Expect>) -> Self {
        Judge {
            case,
            config,
            deepest_m: f64::from(case.mission().deepest_m()),
            means,
            onsets: vec![None; case.faults.len()],
            unread_s: case.faults.first().map_or(0.0, |f| unread_s(f.delay_s)),
            abort: None,
            resumed: 0,
            aborted_s: None,
            last: None,
            fired: false,
            full_s: None,
            dived_s: 0.0,
            zones: Zones::of(case),
            broken: Vec::new(),
            duties: owed
                .iter()
                .flat_map(Expect::duties)
                .map(|d| Watched { duty: *d, witness: Witness::of(d.sign), stood_s: None })
                .collect(),
            owed,
            after_sign_s: None,
            missed: None,
        }
    }

    /// When the first fault of the case began, s.
    fn onset_s(&self) -> Option<f64> {
        self.onsets.first().copied().flatten()
    }

    fn breaks(&mut self, rule: &'static str) {
        if !self.broken.contains(&rule) {
            self.broken.push(rule);
        }
    }

    /// Whether the (only) fault acts, as far as this cycle's frame and truth can show it.
    fn acts(&self, time_s: f64) -> bool {
        let ends_s = self.case.faults.first().and_then(|f| f.duration_s).unwrap_or(f64::INFINITY);
        self.onset_s().is_some_and(|onset_s| time_s > onset_s && time_s < onset_s + ends_s)
    }

    /// Whether what is owed by a sign was done in time.
    fn witness(&mut self, cycle: &Cycle<'_>) {
        let acts = self.acts(cycle.time_s);
        let trace = &cycle.answer.trace;
        for Watched { duty, witness, stood_s: before_s } in &mut self.duties {
            let now_s = witness.see(cycle, self.config, self.deepest_m, acts);
            // SAFE glides no more: a sign that stood until now led to it.
            let until_s = now_s.or(before_s.map(|s| s + CYCLE_S));
            *before_s = now_s;
            if let (Some(stood_s), Act::Abort, true) = (until_s, duty.act, trace.abort.is_some()) {
                self.after_sign_s = Some(self.after_sign_s.map_or(stood_s, |s| s.max(stood_s)));
            }
            let Some(stood_s) = now_s else { continue };
            // The law reads in the cycle after; a mission that is over owes nothing.
            let due = stood_s > duty.within_s + CYCLE_S && trace.abort.is_none();
            let undone = match duty.act {
                Act::Abort => trace.phase != Phase::Done,
                Act::Turn => trace.phase == Phase::Dive,
            };
            if due && undone {
                self.missed = self.missed.or(Some(duty.sign.name()));
            }
        }
    }

    fn see(&mut self, cycle: &Cycle<'_>) {
        let (time_s, answer) = (cycle.time_s, cycle.answer);
        if self.abort.is_none() {
            self.witness(cycle);
        }
        for (fault, onset) in self.case.faults.iter().zip(&mut self.onsets) {
            if onset.is_none() && fault.phase.is_none_or(|p| p == answer.trace.phase) {
                *onset = Some(time_s + fault.delay_s);
            }
        }
        let c = &answer.command;
        let within = |x: f32, limit: f32| x.is_finite() && x.abs() <= limit * 1.0001;
        if !(within(c.ballast_m3, self.config.pump_m3)
            && within(c.battery_mass_m, self.config.battery_m)
            && within(c.fin_rad, self.config.fin_rad))
        {
            self.breaks("a command is not finite or out of range");
        }
        if c.ballast_m3 >= self.config.pump_m3 * 0.999 {
            self.full_s = Some(time_s);
        }
        let before = self.last.map(|a| a.trace);
        if let Some(b) = before
            && !self.goes_on(&b, cycle)
        {
            if b.abort.is_some() && b.abort != answer.trace.abort {
                self.breaks("the first cause was not latched");
            }
            if b.phase == Phase::Safe && answer.trace.phase != Phase::Safe {
                self.breaks("SAFE was left");
            }
        }
        self.fired |= c.drop_weight;
        let gone = self.fired || cycle.truth.weight_dropped;
        if let Some(rule) = self.zones.see(cycle, self.config, self.deepest_m, gone) {
            self.breaks(rule);
        }
        if let (Phase::Dive, Some(onset)) = (answer.trace.phase, self.onset_s()) {
            self.dived_s = self.dived_s.max(time_s - onset);
        }
        if let Some(cause) = answer.trace.abort {
            self.abort = self.abort.or(Some((cause, time_s - self.onset_s().unwrap_or(time_s))));
            self.aborted_s = self.aborted_s.or(Some(time_s));
        }
        self.last = Some(*answer);
    }

    /// Whether an abort is taken back as it may be: afloat, for a part that may come back, with the weight on board, twice in a mission.
    fn goes_on(&mut self, before: &Trace, cycle: &Cycle<'_>) -> bool {
        let now = &cycle.answer.trace;
        let resumes = before.phase == Phase::Safe
            && before.abort.is_some_and(|cause| COMES_BACK.contains(&cause))
            && matches!((now.phase, now.abort), (Phase::Surface | Phase::Done, None))
            && cycle.truth.at_surface
            && !self.fired
            && self.resumed < demands::RESUMES;
        if resumes {
            self.resumed += 1;
            self.aborted_s = None;
        }
        resumes
    }

    fn dives_left(&self) -> bool {
        self.last.is_some_and(|a| u32::from(a.trace.dives) < self.case.mission().dives())
    }

    /// What is owed beyond the global rules and was not done, in words.
    fn unmet(&self, struck: bool, duration_s: f64) -> Option<&'static str> {
        let fault = match self.case.faults.as_slice() {
            [] if self.abort.is_none() && self.dives_left() => return Some("not all dives were flown"),
            [] => return self.abort.map(|_| "abort without a fault"),
            [one] if struck => one,
            _ => return None,
        };
        let Some(owed) = &self.owed else {
            return (!matches!(self.case.water, Water::Drawn | Water::Alone | Water::Late))
                .then_some("nothing is laid down for this fault");
        };
        if let Some((cause, after_s)) = self.abort {
            if *owed == Expect::Mission {
                return Some("abort for a harmless fault");
            }
            if !owed.causes().contains(&cause) {
                return Some("abort with another cause");
            }
            let over_s = fault.duration_s.map_or(f64::INFINITY, |d| d + bounds::aftermath_s(self.config));
            if after_s > over_s + CYCLE_S {
                return Some("abort long after the fault");
            }
            if !self.duties.is_empty() && self.duties.iter().all(|d| d.duty.sign.exact() && !d.witness.seen()) {
                return Some("abort without its sign");
            }
        }
        // A bound is counted from the first frame that the fault can show in.
        match (owed, self.abort) {
            (Expect::Abort(_, bound), Some((_, after_s))) => (after_s > bound + self.unread_s).then_some("abort too late"),
            // Unless the mission was over before the bound.
            (Expect::Abort(_, bound), None) => {
                self.onset_s().is_none_or(|onset_s| duration_s - onset_s >= bound + CYCLE_S).then_some("no abort")
            }
            (Expect::Home(_, bound), None) => (self.dived_s > bound + CYCLE_S).then_some("did not turn for home"),
            _ => self.missed,
        }
    }

    fn judge(mut self, end: End, max_depth_m: f64, duration_s: f64, hash: u64) -> Verdict {
        match end {
            End::Crushed => self.breaks(BELOW_CRUSH),
            End::TimeUp => self.breaks(NOT_HOME),
            End::Done | End::Safe(_) => {}
        }
        if self.aborted_s.is_some_and(|s| duration_s - s > demands::HOME.0 + max_depth_m / demands::HOME.1) {
            self.breaks(NOT_HOME);
        }
        let (means, finished) = (self.means, end == End::Done && !self.dives_left());
        let struck = self.onset_s().is_some_and(|onset| onset < duration_s);
        let unmet = self.unmet(struck, duration_s);
        let did_all = self.abort.is_some() && self.fired && self.full_s.is_some_and(|at| duration_s - at <= LATELY_S);
        let unmet = match unmet {
            None if means.none_left() && !end.home() && !did_all => Some("lost without abort, full buoyancy and weight"),
            None if means.none_left() && self.broken.iter().any(|rule| ![BELOW_CRUSH, NOT_HOME].contains(rule)) => {
                Some("a rule broken that needs no means")
            }
            unmet => unmet,
        };
        Verdict {
            case: self.case.clone(),
            end,
            abort: self.abort,
            struck,
            max_depth_m,
            duration_s,
            broken: self.broken,
            unmet,
            owed: self.owed.filter(|_| struck),
            after_sign_s: self.after_sign_s,
            means,
            fired: self.fired,
            finished,
            hash,
        }
    }
}

/// Flies one case through a seat.
///
/// # Errors
/// The world cannot be, or the seat failed.
pub fn run_through(case: &Case, seat: &mut dyn Seat) -> anyhow::Result<Verdict> {
    let mission = case.mission();
    let mut world = World::new(case.scenario()).map_err(|e| anyhow!("{e}"))?;
    let setup = Setup { config: worlds::config(&mission), ..Setup::new(mission) };
    let config = setup.config.clone();
    let twin = match case.water {
        Water::Shallow | Water::Edge => Twin::if_needed(case)?,
        Water::Alone | Water::Late | Water::Drawn => Twin::for_budget(case)?,
    };
    // Random missions owe the global rules only.
    let owed = match (case.faults.as_slice(), case.water) {
        ([fault], Water::Alone) => expect::alone(fault),
        ([fault], Water::Shallow | Water::Edge) => {
            expect::expect(fault, &config, &twin.as_ref().map_or(Ahead::NOTHING, |t| t.ahead(fault)))
        }
        _ => None,
    };
    let mut means = Means::of(case, twin.as_ref())?;
    if !means.none_left() && race::is_one(case, &means) {
        means.race = Some(race::can_be_won(case)?);
    }
    let mut judge = Judge::of(case, &config, means, owed);
    let out = fly(&mut world, seat, &setup, &mut |c| {
        judge.see(c);
        Ok(())
    })?;
    Ok(judge.judge(out.end, out.max_depth_m, out.duration_s, out.actuator_hash))
}

/// Flies one case in this process.
///
/// # Errors
/// The world cannot be, or the controller does not answer.
pub fn run(case: &Case) -> anyhow::Result<Verdict> {
    match case.line {
        None => run_through(case, &mut Link::new(InProcess::default())),
        Some(fault) => run_through(case, &mut Link::new(line::BadLine::new(fault, case.seed))),
    }
}

#[cfg(test)]
mod tests;

//! As a Slocum's backseat: the glider's line in, one step of [`helm`], mission parameters out.
//!
//! The same loop on the board and on a laptop (`hil-host/frontseat`). Two ports: the glider's line, and a service line that speaks our own
//! protocol: uploads, counters, the log. Nothing that comes over the service line begins a mission or is flown.

use crate::next_byte;
use crate::run::{BYTES_PER_PASS, HOST_MS, Outside, say, set_options, tick_utc};
use backseat::sensors::List;
use backseat::{Law, Limits, Pump, Session, Setup, State, Targets};
use control::Settings;
use embedded_io::{Read, ReadReady, Write, WriteReady};
use helm::{Helm, Mark, Seat, Storage};
use signals::surfacing::OfGlides;
use signals::{Answer, Micros, Preflight, SensorFrame, Strap, ToBoard, ToHost};

/// Bit/s of the glider's line.
pub const BAUD: u32 = 9_600;
/// Density that a glider's depth is reckoned with, kg/m³: a guess, standard sea water; 1 % of it is 1 % of the second depth.
pub const DENSITY_KG_M3: f32 = 1025.0;
/// The glider's own turn is this far below the deepest turn of ours, m.
const BELOW_M: f32 = 3.0;
/// Depth of the glider's own turn from climb to dive, m.
const CLIMB_TO_M: f32 = 2.0;
/// Step of the battery mass just beyond the glider's dead band of 0.068 in (public default), m. With its own step of 0.4 mm the law
/// trims in steps that the glider ignores: 0.85 and 0.79 of (L/D)max in 0–200 m instead of 0.96 and 0.95.
const BATTERY_STEP_M: f32 = 1.05 * 0.068 * 0.0254;

/// Depth of the glider's own turn for a mission whose deepest turn is at `deepest_m`, m.
#[must_use]
pub fn own_turn_m(deepest_m: f32) -> f32 {
    deepest_m + BELOW_M
}

/// What a board with this configuration knows before the glider speaks.
#[must_use]
pub const fn setup(list: List, config: &Settings, rho_kg_m3: f32) -> Setup {
    let limits =
        Limits { ballast_m3: config.pump_m3, battery_m: config.battery_m, fin_rad: config.fin_rad, battery_step_m: BATTERY_STEP_M };
    Setup { list, rho_kg_m3, limits }
}

/// The list of sensors for a vehicle: that of the newer software, with its echoes; by its pump the oil or the piston.
#[must_use]
pub const fn list(config: &Settings) -> List {
    let pump = if config.pump_rate_m3_s < 8e-6 { Pump::Deep } else { Pump::Shallow };
    List { generation: backseat::Generation::Newer, pump, echo: true }
}

/// Whether the board is a backseat in this run: as its jumper says on deck. A mission that a reset interrupted goes on in the role that it
/// was begun in, whatever the jumper says then.
#[must_use]
pub fn is_role(mark: Mark, jumper: bool) -> bool {
    if mark.in_mission() { mark.seat() == Seat::Backseat } else { jumper }
}

/// The law behind the line: [`helm`] with its stored mission, within the limits that the glider tells.
pub struct BackseatLaw<'a, S> {
    helm: &'a mut Helm<S>,
    /// What the last step answered; none was made.
    pub answer: Option<Answer>,
    /// It was one on a frame.
    heard: bool,
}

impl<'a, S: Storage> BackseatLaw<'a, S> {
    /// Before anything is asked.
    pub const fn new(helm: &'a mut Helm<S>) -> Self {
        Self { helm, answer: None, heard: false }
    }
}

impl<S: Storage> Law for BackseatLaw<'_, S> {
    fn begin(&mut self, limits: &Limits) -> Option<Targets> {
        let within = |s: &Settings| Settings {
            pump_m3: s.pump_m3.min(limits.ballast_m3),
            battery_m: s.battery_m.min(limits.battery_m),
            fin_rad: s.fin_rad.min(limits.fin_rad),
            battery_deadband_m: s.battery_deadband_m.max(limits.battery_step_m).min(limits.battery_m),
            ..*s
        };
        let deepest_m = self.helm.begin_backseat(within).ok()?;
        Some(Targets { dive_m: own_turn_m(deepest_m), climb_m: CLIMB_TO_M })
    }

    fn step(&mut self, frame: &SensorFrame) -> Option<Answer> {
        match self.helm.handle(ToBoard::Sensor(*frame)) {
            ToHost::Answer(answer) => {
                (self.answer, self.heard) = (Some(answer), true);
                Some(answer)
            }
            _ => None,
        }
    }

    fn silent(&mut self, silence: Micros) -> Option<Answer> {
        let answer = self.helm.silent(silence)?;
        (self.answer, self.heard) = (Some(answer), false);
        Some(answer)
    }

    fn glides(&mut self) -> Option<OfGlides> {
        self.helm.said_of_glides()
    }
}

/// The loop's memory between two passes.
#[derive(Debug)]
pub struct RunBackseat<L, M> {
    /// The glider's line.
    pub line: L,
    /// Our own protocol.
    pub service: M,
    /// When a step was finished, and when one on what the glider said, ms.
    stepped_ms: u64,
    heard_ms: u64,
    /// When UTC was kept, ms.
    kept_ms: u64,
    /// Bytes of the glider that were dealt with; wraps.
    pub heard: u32,
}

impl<L: Read + ReadReady + Write + WriteReady, M: Read + ReadReady + Write> RunBackseat<L, M> {
    /// Before the first pass.
    pub fn new(line: L, service: M, outside: &mut impl Outside) -> Self {
        let now_ms = outside.now_ms();
        Self { line, service, stepped_ms: now_ms, heard_ms: now_ms, kept_ms: now_ms, heard: 0 }
    }

    /// One pass: call it when bytes have come, and at least ten times a second.
    pub fn pass<S: Storage, O: Outside>(&mut self, session: &mut Session, helm: &mut Helm<S>, outside: &mut O) {
        tick_utc(helm, outside, &mut self.kept_ms);
        helm.lost_bytes(outside.lost_bytes());
        helm.deck.strapped(Strap::Backseat);
        self.serve(session, helm, outside);
        let now_ms = outside.now_ms();
        let now = Micros::from_millis(now_ms);
        for _ in 0..BYTES_PER_PASS {
            let Some(byte) = next_byte(&mut self.line) else { break };
            session.byte(now, byte);
            // After each one: what comes of them is the same however they are cut into passes.
            self.poll(now, session, helm, outside);
            self.heard = self.heard.wrapping_add(1);
        }
        self.poll(now, session, helm, outside);
        helm.unheard(Micros::from_millis(now_ms.saturating_sub(self.heard_ms)));
        // In a mission a finished step feeds the watchdog, and nothing else; but a silent glider has its time.
        let steps = session.is_stepping();
        if !steps {
            self.stepped_ms = now_ms; // the time it has begins when steps are due again
        }
        let waits = !steps || now_ms.saturating_sub(self.stepped_ms) < HOST_MS;
        if waits || !helm.mark().in_mission() {
            outside.feed();
        }
        while session.has_to_say() && self.line.write_ready().unwrap_or(false) {
            if let Some(byte) = session.next_byte() {
                let _ = self.line.write(&[byte]);
            }
        }
        helm.keep_log();
    }

    /// What is due on the glider's line. First write down that a mission is on, then order: a reset in between is SAFE.
    fn poll<S: Storage, O: Outside>(&mut self, now: Micros, session: &mut Session, helm: &mut Helm<S>, outside: &mut O) {
        let mut law = BackseatLaw::new(helm);
        session.poll(now, &mut law);
        if let Some(answer) = law.answer {
            self.stepped_ms = now.0 / 1000;
            if law.heard {
                self.heard_ms = self.stepped_ms;
            }
            outside.remember(helm.mark(), 0.0);
            helm.keep_mark();
            outside.said(&ToHost::Answer(answer));
            outside.feed();
        }
    }

    /// Our own protocol; an object that was stored before the mission holds for it.
    fn serve<S: Storage, O: Outside>(&mut self, session: &mut Session, helm: &mut Helm<S>, outside: &mut O) {
        for _ in 0..BYTES_PER_PASS {
            let Some(byte) = next_byte(&mut self.service) else { return };
            let Some(reply) = helm.byte(byte) else { continue };
            outside.remember(helm.mark(), 0.0);
            helm.keep_mark();
            set_options(helm, outside);
            if helm.deck.take().is_some() {
                helm.deck.found(Preflight::default());
            }
            if matches!(reply.message, ToHost::Done { .. } | ToHost::Volatile { .. }) && session.state() == State::Wait {
                session.set_up(stored_setup(helm));
            }
            say(&mut self.service, &reply);
            outside.said(&reply.message);
            if helm.take_restart() {
                outside.restart();
            }
        }
    }
}

/// What a board knows before the glider speaks, of the configuration that is stored.
pub fn stored_setup<S: Storage>(helm: &mut Helm<S>) -> Setup {
    let config = helm.next_config();
    setup(list(&config), &config, DENSITY_KG_M3)
}

#[cfg(test)]
mod tests {
    use super::is_role;
    use helm::{Mark, Seat};

    #[test]
    fn in_flight_no_jumper_changes_the_role() {
        for jumper in [false, true] {
            assert_eq!(is_role(Mark::NONE, jumper), jumper);
            assert!(is_role(Mark::mission(Seat::Backseat, None, false), jumper));
            assert!(!is_role(Mark::mission(Seat::Sensors, None, true), jumper));
            assert!(!is_role(Mark::mission(Seat::Host, None, false), jumper));
        }
    }
}

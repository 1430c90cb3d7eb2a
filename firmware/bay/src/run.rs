//! One pass of the loop: bytes in, one step, bytes out; feed the watchdog.

use crate::next_byte;
use crate::parts::{Fitted, Parts};
use crate::strokes::Strokes;
use crate::supplies::COMPASS_LEAD_MS;
use embedded_io::{Read, ReadReady, Write};
use helm::session::CYCLE_MS;
use helm::silence::PATIENCE_MS;
use helm::{Helm, Mark, Seat, Storage, UtcClock};
use signals::link::MAX_WIRE;
use signals::{Micros, Preflight, Reply, Strap, Timebase, ToHost, encode};

/// Most bytes taken from the line before the loop looks at the clock again.
pub(crate) const BYTES_PER_PASS: usize = 256;
/// Longest time without a finished step while a mission waits for its host, ms: its patience and two cycles.
pub(crate) const HOST_MS: u64 = PATIENCE_MS + 2 * CYCLE_MS as u64;
/// Longest time until the next pass, ms; so often UTC is kept.
const PASS_MS: u64 = 1_000;

/// Time after the last byte of the line in which more may come, ms: the chip does not stop.
pub const LINK_MS: u64 = 60_000;
/// Shorter than this it only sleeps, ms: the clock takes 2 ms to come back.
const LEAST_STOP_MS: u64 = 20;

/// How a stop ended.
#[derive(Clone, Copy, Debug)]
pub struct Woken {
    /// The line ended it: its first byte is lost.
    pub by_line: bool,
    /// What the board runs on now, where that changed.
    pub base: Option<Timebase>,
    /// How far time since boot may be off over stops, parts of a million.
    pub ppm: u32,
}

/// What the loop asks of the chip beside its pins.
pub trait Outside {
    /// Time since boot, ms.
    fn now_ms(&mut self) -> u64;
    /// A control step is finished, or there is no mission to step.
    fn feed(&mut self);
    /// Keeps what a reset must find again, where a reset does not clear it.
    fn remember(&mut self, mark: Mark, air_pa: f32);
    /// Keeps UTC over a reset, beside a clock that goes on.
    fn keep_time(&mut self, _utc: &UtcClock) {}
    /// Bytes that the line's port lost since the last call.
    fn lost_bytes(&mut self) -> u32;
    /// What the strap says now.
    fn strap(&mut self) -> Strap;
    /// What was answered or decided, for the log.
    fn said(&mut self, _message: &ToHost) {}
    /// The host wants a restart; what was answered has been sent.
    fn restart(&mut self) {}
    /// Frames come from elsewhere now.
    fn seated(&mut self, _seat: Seat) {}
    /// Sleeps until then at the latest, or until a byte of the line comes; bytes of compass and GPS receiver are kept.
    fn sleep(&mut self, _until_ms: u64) {}
    /// Sets the chip's option bytes; what they are then.
    fn set_options(&mut self) -> Option<u32> {
        None
    }
    /// Stops the chip's clocks until then at the latest, or until the line speaks; time since boot goes on. None: it cannot.
    fn stop(&mut self, _until_ms: u64) -> Option<Woken> {
        None
    }
}

/// UTC of now; once per [`PASS_MS`] it is kept where a reset leaves it alone.
pub(crate) fn tick_utc<S: Storage, O: Outside>(helm: &mut Helm<S>, outside: &mut O, kept_ms: &mut u64) {
    let now_ms = outside.now_ms();
    helm.utc.tick(now_ms);
    if now_ms.saturating_sub(*kept_ms) >= PASS_MS {
        outside.keep_time(&helm.utc);
        *kept_ms = now_ms;
    }
}

/// Sets the chip's option bytes, if that was asked for on deck.
pub(crate) fn set_options<S: Storage, O: Outside>(helm: &mut Helm<S>, outside: &mut O) {
    if helm.deck.take_options() {
        outside.feed();
        helm.deck.options_are(outside.set_options());
    }
}

/// Sends a reply.
pub(crate) fn say(line: &mut impl Write, reply: &Reply) {
    let mut wire = [0; MAX_WIRE];
    if let Ok(n) = encode(reply, &mut wire) {
        // A transmitter that is stuck leaves the host without an answer: it asks again.
        let _ = line.write(wire.get(..n).unwrap_or_default());
    }
}

/// The loop's memory between two passes.
pub struct Run<F: Fitted, L> {
    /// The line to host or ground station.
    pub line: L,
    /// The vehicle's own parts.
    pub parts: Parts<F>,
    seat: Seat,
    strokes: Strokes,
    /// When a frame was answered, when a step was finished.
    frame_ms: u64,
    stepped_ms: u64,
    /// When UTC was kept.
    kept_ms: u64,
    /// When the line last spoke.
    heard_ms: u64,
    strap: Strap,
}

impl<F: Fitted, L: Read + ReadReady + Write> Run<F, L> {
    /// Before the first pass.
    pub fn new(line: L, parts: Parts<F>, outside: &mut impl Outside) -> Self {
        let now_ms = outside.now_ms();
        let (seat, strokes) = (Seat::Open, Strokes::default());
        Self { line, parts, seat, strokes, frame_ms: now_ms, stepped_ms: now_ms, kept_ms: now_ms, heard_ms: now_ms, strap: Strap::Bench }
    }

    /// One pass; returns when the next one is due at the latest, ms.
    pub fn pass<S: Storage, O: Outside>(&mut self, helm: &mut Helm<S>, outside: &mut O) -> u64 {
        tick_utc(helm, outside, &mut self.kept_ms);
        helm.lost_bytes(outside.lost_bytes());
        self.strap = outside.strap();
        helm.deck.strapped(self.strap);
        self.take_bytes(helm, outside);
        let now_ms = outside.now_ms();
        self.parts.listen(now_ms);
        if let Some((fix, came_ms)) = self.parts.antenna.take_fix() {
            helm.utc.fix(fix.utc_s, came_ms);
        }
        self.take_seat(helm, outside, now_ms);
        if self.seat == Seat::Sensors {
            self.fly(helm, outside, now_ms);
        } else {
            self.parts.wake();
        }
        if self.seat == Seat::Open {
            self.check(helm, outside, now_ms);
        }
        if let Some(answer) = helm.silent(Micros::from_millis(now_ms.saturating_sub(self.frame_ms))) {
            self.stepped_ms = now_ms;
            outside.remember(helm.mark(), self.parts.air_pa());
            outside.said(&ToHost::Answer(answer));
        }
        // In a mission a finished step feeds the watchdog, and nothing else; but a host may take its time.
        let waits = self.seat == Seat::Host && now_ms.saturating_sub(self.stepped_ms) < HOST_MS;
        if waits || !helm.mark().in_mission() {
            outside.feed();
        }
        self.due_ms(now_ms)
    }

    /// Between two passes: the chip sleeps, or stops where nothing moves and nobody is expected to speak.
    pub fn rest<S: Storage, O: Outside>(&mut self, helm: &mut Helm<S>, outside: &mut O, until_ms: u64) {
        if self.line.read_ready().unwrap_or(false) {
            return;
        }
        let now_ms = outside.now_ms();
        let long = until_ms.saturating_sub(now_ms) >= LEAST_STOP_MS;
        if !(long && self.may_stop(helm.mark(), now_ms)) {
            return outside.sleep(until_ms);
        }
        let Some(woken) = outside.stop(until_ms) else { return outside.sleep(until_ms) };
        helm.utc.stopped(woken.ppm);
        if let Some(base) = woken.base {
            helm.utc.runs_on(base);
        }
        if woken.by_line {
            self.heard_ms = outside.now_ms();
        }
    }

    /// On own sensors in a mission, the strap taken out, the line silent, nothing driven, nobody listened to.
    fn may_stop(&self, mark: Mark, now_ms: u64) -> bool {
        let alone = self.strap == Strap::Deployment && now_ms.saturating_sub(self.heard_ms) >= LINK_MS;
        alone && self.seat == Seat::Sensors && mark.in_mission() && self.parts.are_still()
    }

    fn take_bytes<S: Storage, O: Outside>(&mut self, helm: &mut Helm<S>, outside: &mut O) {
        for _ in 0..BYTES_PER_PASS {
            let Some(byte) = next_byte(&mut self.line) else { return };
            self.heard_ms = outside.now_ms();
            if let Some(reply) = helm.byte(byte) {
                self.answer(helm, outside, &reply);
            }
        }
    }

    fn answer<S: Storage, O: Outside>(&mut self, helm: &mut Helm<S>, outside: &mut O, reply: &Reply) {
        // First write down that a mission is on, then answer: a reset in between is SAFE.
        outside.remember(helm.mark(), self.parts.air_pa());
        helm.keep_mark();
        say(&mut self.line, reply);
        outside.said(&reply.message);
        if helm.take_restart() {
            outside.restart();
        }
        if matches!(reply.message, ToHost::Answer(_)) {
            self.frame_ms = outside.now_ms();
            self.stepped_ms = self.frame_ms;
            outside.feed();
        }
        helm.keep_log();
    }

    fn take_seat<S: Storage, O: Outside>(&mut self, helm: &mut Helm<S>, outside: &mut O, now_ms: u64) {
        if helm.seat() == self.seat {
            return;
        }
        self.seat = helm.seat();
        outside.seated(self.seat);
        self.parts.rest();
        self.parts.radio.rest(now_ms);
        self.strokes = Strokes::default();
        if self.seat == Seat::Sensors {
            self.parts.fit(helm.config());
            // Launched on deck or afloat: here is the surface. After a reset in flight it is not.
            if !helm.mission_in_progress() {
                self.parts.zero_depth();
            }
        }
        self.stepped_ms = now_ms;
    }

    /// A cycle on the vehicle's own parts, and a look at its motors, if they are due.
    fn fly<S: Storage, O: Outside>(&mut self, helm: &mut Helm<S>, outside: &mut O, now_ms: u64) {
        let since_ms = now_ms.saturating_sub(self.stepped_ms);
        if since_ms >= u64::from(CYCLE_MS) {
            let frame = self.parts.measure(now_ms, since_ms as f32 * 1e-3);
            if let Some(answer) = helm.cycle(&frame) {
                self.stepped_ms = now_ms;
                outside.remember(helm.mark(), self.parts.air_pa());
                helm.keep_mark();
                self.parts.command(answer.command);
                self.parts.doze(outside.now_ms(), answer.trace.phase, frame.depth_m);
                self.parts.radio.take(&frame, &answer, now_ms);
                outside.said(&ToHost::Answer(answer));
                outside.feed();
                helm.keep_log();
            }
        } else if since_ms.saturating_add(COMPASS_LEAD_MS) >= u64::from(CYCLE_MS) {
            self.parts.wake_compass();
        }
        let now_ms = outside.now_ms();
        if self.parts.look_due_ms().is_some_and(|due| due <= now_ms) {
            self.parts.act(now_ms);
        }
    }

    /// On deck: the check that is asked for, and the strokes under way.
    fn check<S: Storage, O: Outside>(&mut self, helm: &mut Helm<S>, outside: &mut O, now_ms: u64) {
        set_options(helm, outside);
        let asked = helm.deck.take();
        if asked == Some(true) && !self.strokes.under_way() {
            self.parts.fit(helm.config());
            self.strokes = Strokes::begin(now_ms);
        }
        if let Some(command) = self.strokes.next(self.parts.scale(), now_ms) {
            self.parts.command(command);
        }
        if self.strokes.under_way() && self.parts.look_due_ms().is_some_and(|due| due <= now_ms) {
            let (pump, mass) = self.parts.act(now_ms);
            self.strokes.see(self.parts.scale(), pump, mass, now_ms);
            if !self.strokes.under_way() {
                self.parts.rest();
            }
        }
        if asked.is_some() {
            let compass = &self.parts.compass;
            let sentences = (compass.whole, compass.refused);
            let found = Preflight {
                pressure_pa: self.parts.pressure_pa(),
                frame: self.parts.measure(now_ms, 0.0),
                pump: self.strokes.pump,
                mass: self.strokes.mass,
                log_bytes: helm.storage().read_log(0, &mut []),
                sentences,
                ..Preflight::default()
            };
            helm.deck.found(found);
        }
    }

    fn due_ms(&self, now_ms: u64) -> u64 {
        let latest = now_ms.saturating_add(PASS_MS);
        if self.seat != Seat::Sensors {
            return latest.min(self.parts.look_due_ms().unwrap_or(latest));
        }
        let cycle = self.stepped_ms.saturating_add(CYCLE_MS as u64);
        let compass = cycle.saturating_sub(COMPASS_LEAD_MS);
        let next = if now_ms < compass { compass } else { cycle };
        latest.min(next).min(self.parts.look_due_ms().unwrap_or(latest))
    }
}

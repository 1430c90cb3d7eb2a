//! When is a step due, and what time is it on the glider?
//!
//! The glider's time comes first in a cycle's sentences; a step is due when the line has been quiet after it, or when the next one
//! comes. Only differences of the glider's clock matter; one that jumps is replaced by ours.

use signals::Micros;

/// The line is quiet: the cycle's sentences are all here.
const QUIET: Micros = Micros::from_millis(300);
/// A step without the glider's time in its sentences: two cycles and a half. Where its line was damaged the depth was in it too, and a
/// step on what is left turns the vehicle; the next cycle's is two seconds away.
const UNTIMED: Micros = Micros::from_secs(10);
/// Farthest the glider's clock may differ from ours over one step, s.
const CLOCK_S: f64 = 5.0;

/// Time of the glider's flight as counted by its own clock, checked by ours.
#[derive(Clone, Copy, Debug)]
struct Anchor {
    glider_s: f64,
    ours: Micros,
    flight: Micros,
}

/// Cycles of the glider as they are heard.
#[derive(Clone, Debug)]
pub(crate) struct Pace {
    anchor: Option<Anchor>,
    timed: bool,
    overdue: bool,
    /// A value was believed since the last step.
    pub(crate) fresh: bool,
    /// When the last step was made.
    pub(crate) stepped: Micros,
}

impl Pace {
    pub(crate) const fn new() -> Self {
        Self { anchor: None, timed: false, overdue: false, fresh: false, stepped: Micros(0) }
    }

    /// A new cycle of the glider begins.
    pub(crate) fn glider_time(&mut self, now: Micros, glider_s: f64) {
        let flight = match self.anchor {
            Some(a) => {
                let (theirs_s, ours_s) = (glider_s - a.glider_s, now.since(a.ours).0 as f64 * 1e-6);
                let span_s = if theirs_s > 0.0 && libm::fabs(theirs_s - ours_s) <= CLOCK_S { theirs_s } else { ours_s };
                a.flight.plus(Micros((span_s * 1e6) as u64))
            }
            None => now,
        };
        self.anchor = Some(Anchor { glider_s, ours: now, flight });
        // The cycle before was not stepped yet: its sentences ran into this one.
        self.overdue |= self.timed;
        self.timed = true;
    }

    /// Time of the frame of now.
    pub(crate) fn flight_time(&self, now: Micros) -> Micros {
        match self.anchor {
            Some(a) if self.timed => a.flight,
            Some(a) => a.flight.plus(now.since(a.ours)),
            None => now,
        }
    }

    /// The glider's clock as it was last heard, s; before that ours.
    pub(crate) fn glider_s(&self, now: Micros) -> f64 {
        self.anchor.map_or(now.0 as f64 * 1e-6, |anchor| anchor.glider_s)
    }

    /// `heard`: when the last sentence came.
    pub(crate) fn is_due(&self, now: Micros, heard: Micros) -> bool {
        let quiet = now.since(heard) >= QUIET;
        if self.timed { self.overdue || quiet } else { self.fresh && quiet && now.since(self.stepped) >= UNTIMED }
    }

    pub(crate) fn step(&mut self, now: Micros) {
        self.forget();
        self.stepped = now;
    }

    /// What was heard belongs to no step any more.
    pub(crate) fn forget(&mut self) {
        (self.timed, self.overdue, self.fresh) = (false, false, false);
    }
}

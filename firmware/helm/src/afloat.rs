//! Whether the vehicle is seen at the surface: the only way out of SAFE.
//!
//! A missing depth is not the surface, nor is a controller that has seen no frame yet. A shallow depth counts when its sensor
//! agrees with its twin, or, where no twin answers, with its own history:
//!
//! | depth sensors | counts | for at least |
//! |---|---|---|
//! | both answer, both shallow, within `AGREE_M` | agreement | `TWINS_MS` |
//! | one answers, no step faster than a glider rises | unbroken history | [`ALONE_MS`] |
//! | any other answer | nothing, and all before it is forgotten | |

use signals::{Micros, Reading, SensorFrame};

/// Deepest depth that is the surface, m: antenna depth, waves and the zero error of a transducer.
pub const SURFACE_M: f32 = 2.0;
/// Two depths farther apart do not agree, m.
const AGREE_M: f32 = 1.0;
/// Time that both sensors must see the surface, ms.
pub const TWINS_MS: u32 = 40_000;
/// Time that a sensor without a twin must see the surface, ms: a guess, ten minutes, in which a vehicle in SAFE rises 120 m or more.
pub const ALONE_MS: u32 = 600_000;
/// A reading older than this is none, ms.
const FRESH_MS: u32 = 3_000;
/// Longest time that one frame counts for, ms: two cycles.
const MOST_MS: u32 = 8_000;
/// Fastest believable change of depth, m/s, and what waves add, m.
const RATE_M_S: f32 = 1.0;
const WAVES_M: f32 = 0.7;

/// What one frame says.
enum Seen {
    /// Two sensors agree on the surface.
    Twins,
    /// The only sensor that answers says so.
    Alone(f32),
    /// Not the surface, or nobody knows.
    No,
}

fn look(frame: &SensorFrame) -> Seen {
    let silent = |r: Reading| match r {
        Reading::Missing => true,
        Reading::Sampled { age_ms, .. } => age_ms > FRESH_MS,
    };
    let shallow = |r: Reading| r.accept(-SURFACE_M..=SURFACE_M, FRESH_MS);
    match (shallow(frame.depth_m), shallow(frame.depth2_m)) {
        (Some(a), Some(b)) if (a - b).abs() <= AGREE_M => Seen::Twins,
        (Some(a), None) if silent(frame.depth2_m) => Seen::Alone(a),
        (None, Some(b)) if silent(frame.depth_m) => Seen::Alone(b),
        _ => Seen::No,
    }
}

/// How long the surface has been seen.
#[derive(Clone, Copy, Debug)]
pub struct Afloat {
    last: Option<Micros>,
    /// Depth of the only sensor in the last frame, m.
    alone_m: Option<f32>,
    twins_ms: u32,
    alone_ms: u32,
}

impl Afloat {
    /// Nothing seen.
    #[must_use]
    pub const fn new() -> Self {
        Self { last: None, alone_m: None, twins_ms: 0, alone_ms: 0 }
    }

    /// Takes one frame of the vehicle.
    pub fn take(&mut self, frame: &SensorFrame) {
        let passed_ms = match self.last {
            Some(last) => u32::try_from(frame.time.since(last).0 / 1_000).unwrap_or(u32::MAX).min(MOST_MS),
            None => 0,
        };
        let before_m = self.alone_m;
        let (twins_ms, alone_ms) = (self.twins_ms.saturating_add(passed_ms), self.alone_ms.saturating_add(passed_ms));
        *self = Self { last: Some(frame.time), ..Self::new() };
        match look(frame) {
            Seen::Twins => (self.twins_ms, self.alone_ms) = (twins_ms, alone_ms),
            Seen::Alone(depth_m) => {
                let step_m = before_m.map_or(0.0, |before| (depth_m - before).abs());
                self.alone_m = Some(depth_m);
                if step_m <= WAVES_M + RATE_M_S * passed_ms as f32 * 1e-3 {
                    self.alone_ms = alone_ms;
                }
            }
            Seen::No => {}
        }
    }

    /// Nothing that counts.
    pub(crate) const fn is_new(&self) -> bool {
        self.twins_ms == 0 && self.alone_ms == 0
    }

    /// Whether the vehicle is seen afloat, for long enough and still.
    #[must_use]
    pub const fn seen(&self) -> bool {
        self.twins_ms >= TWINS_MS || self.alone_ms >= ALONE_MS
    }
}

impl Default for Afloat {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(frames: impl Iterator<Item = (Reading, Reading)>) -> bool {
        let mut afloat = Afloat::new();
        for (i, (depth_m, depth2_m)) in frames.enumerate() {
            afloat.take(&SensorFrame { time: Micros::from_secs(4 * i as u64), depth_m, depth2_m, ..SensorFrame::default() });
        }
        afloat.seen()
    }

    const SHALLOW: Reading = Reading::now(0.3);

    #[test]
    fn two_sensors_count_after_forty_seconds_a_lone_one_after_ten_minutes() {
        let twins = |n| after((0..n).map(|_| (SHALLOW, Reading::now(0.5))));
        assert!(!twins(10) && twins(11));
        let alone = |n| after((0..n).map(|_| (SHALLOW, Reading::Missing)));
        assert!(!alone(150) && alone(151));
        let other = |n| after((0..n).map(|_| (Reading::Missing, SHALLOW)));
        assert!(!other(150) && other(151));
    }

    #[test]
    fn nothing_else_is_the_surface() {
        let old = Reading::Sampled { value: 0.3, age_ms: 60_000 };
        for (a, b) in [
            (Reading::Missing, Reading::Missing),
            (old, old),
            (SHALLOW, Reading::now(60.0)),
            (Reading::now(60.0), SHALLOW),
            (SHALLOW, Reading::now(f32::NAN)),
            (SHALLOW, Reading::now(9999.0)),
            (Reading::now(1.9), Reading::now(0.1)),
            (Reading::now(2.1), Reading::now(2.1)),
            (Reading::now(-30.0), Reading::now(-30.0)),
        ] {
            assert!(!after((0..1000).map(|_| (a, b))), "{a:?} {b:?}");
        }
        assert!(!after((0..160).map(|i| (Reading::now(if i % 100 == 99 { 30.0 } else { 0.3 }), Reading::Missing))), "a broken history");
        assert!(!Afloat::new().seen(), "no frame yet");
    }

    #[test]
    fn a_clock_that_jumps_or_stands_makes_no_time() {
        let mut afloat = Afloat::new();
        for i in 0..5 {
            let time = Micros(u64::MAX / 8 * i);
            afloat.take(&SensorFrame { time, depth_m: SHALLOW, depth2_m: SHALLOW, ..SensorFrame::default() });
        }
        for _ in 0..100 {
            afloat.take(&SensorFrame { time: Micros(7), depth_m: SHALLOW, depth2_m: SHALLOW, ..SensorFrame::default() });
        }
        assert!(!afloat.seen(), "four jumps count for 32 s");
    }
}

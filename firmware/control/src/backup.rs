//! The second way home, written apart from the first.
//!
//! Uses nothing of `senses`, `voyage`, `safety` or their arithmetic: raw
//! readings, whole numbers (cm, µs, counts), four rules, one latch in three
//! copies. If the first way home has a fault, this one must not share it, but for the attitude (below).
//!
//! | rule | fires when |
//! |---|---|
//! | deep | every raw depth beyond working depth + 10 m in three frames running, or the deeper one in nine |
//! | leak | alarm in five frames running, or for 20 s |
//! | silence | no finite depth from either sensor for 11 min, or nothing finite at all for a minute |
//! | time | mission time + 10 min passed |
//!
//! Then: full buoyancy, mass in the middle, fin straight, beacon. Where the first way home already commands full
//! buoyancy and beacon for a cause of its own, it keeps the attitude: it climbs steeper, and on its wings a vehicle
//! that is too heavy sinks at half the rate. The weight goes
//! when every raw depth there is lies within 60 s of sinking at 0.5 m/s of crush depth, or
//! when nothing was heard from a depth sensor for half an hour.

use signals::{Abort, ActuatorCommand, Micros, Reading, SensorFrame, Switch};

/// Longest time between two frames that is believed, µs.
const LONGEST_US: u32 = 120_000_000;

/// The numbers it needs, as whole units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limits {
    pub(crate) deep_cm: i32,
    pub(crate) burn_cm: i32,
    pub(crate) mission_us: u64,
    pub(crate) pump_m3: f32,
}

/// Memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Backup {
    last_us: Option<u64>,
    flown_us: u64,
    deaf_us: u32,
    dumb_us: u32,
    leak_us: u32,
    deep_frames: u32,
    leak_frames: u32,
    burn_frames: u32,
    burning: bool,
    latch: [u8; 3],
}

fn centimetres(reading: Reading) -> Option<i32> {
    match reading {
        Reading::Sampled { value, age_ms } if value > -50.0 && value < 8000.0 && age_ms < 20_000 => Some((value * 100.0) as i32),
        _ => None,
    }
}

impl Backup {
    /// Returns the cause while home is ordered, and whether to burn.
    pub(crate) fn check(&mut self, limits: &Limits, now: Micros, frame: &SensorFrame) -> Option<(Abort, bool)> {
        let passed = match self.last_us {
            Some(last) if now.0 > last => u32::try_from(now.0 - last).map_or(LONGEST_US, |span| span.min(LONGEST_US)),
            _ => 0,
        };
        self.last_us = Some(now.0);
        self.flown_us = self.flown_us.saturating_add(u64::from(passed));

        // The deeper one calls home; for the weight, which does not come back, both must agree.
        let depths = match (centimetres(frame.depth_m), centimetres(frame.depth2_m)) {
            (Some(a), Some(b)) => Some(if a > b { (a, b) } else { (b, a) }),
            (Some(one), None) | (None, Some(one)) => Some((one, one)),
            (None, None) => None,
        };
        match depths {
            Some((deeper, shallower)) => {
                self.deaf_us = 0;
                let weight = if shallower > limits.deep_cm { 3 } else { 1 };
                self.deep_frames = if deeper > limits.deep_cm { self.deep_frames.saturating_add(weight) } else { 0 };
                self.burn_frames = if shallower > limits.burn_cm { self.burn_frames.saturating_add(1) } else { 0 };
            }
            None => self.deaf_us = self.deaf_us.saturating_add(passed),
        }
        if frame.surface.gps_fix || frame.surface.comms {
            (self.deaf_us, self.dumb_us) = (0, 0);
        }
        let speaks = |reading| matches!(reading, Reading::Sampled { value, .. } if value.is_finite());
        let dumb = depths.is_none() && !speaks(frame.pitch_rad) && !speaks(frame.ballast_m3);
        self.dumb_us = if dumb { self.dumb_us.saturating_add(passed) } else { 0 };
        if frame.leak == Switch::Alarm {
            self.leak_frames = self.leak_frames.saturating_add(1);
            self.leak_us = self.leak_us.saturating_add(passed);
        } else {
            self.leak_frames = 0;
            self.leak_us = 0;
        }
        let cause = if self.deep_frames >= 9 {
            1
        } else if self.leak_frames >= 5 || self.leak_us >= 20_000_000 {
            2
        } else if self.deaf_us >= 660_000_000 || self.dumb_us >= 60_000_000 {
            3
        } else if self.flown_us > limits.mission_us {
            4
        } else {
            0
        };
        if cause == 0 && self.latch == [0; 3] {
            return None;
        }
        if cause != 0 && self.voted() == 0 {
            self.latch = [cause; 3];
        }
        let home = match self.voted() {
            0 => return None,
            1 => Abort::OverDepth,
            2 => Abort::Leak,
            3 => Abort::LinkLost,
            4 => Abort::OverTime,
            _ => Abort::Internal,
        };
        self.burning |= self.burn_frames >= 3 || self.deaf_us >= 1_800_000_000;
        Some((home, self.burning))
    }

    /// Two of three copies; three different ones are an abort of their own.
    fn voted(&self) -> u8 {
        let [a, b, c] = self.latch;
        if a == b || a == c {
            a
        } else if b == c {
            b
        } else {
            u8::MAX
        }
    }

    /// What it commands.
    pub(crate) fn command(limits: &Limits, seq: u32, burn: bool) -> ActuatorCommand {
        ActuatorCommand { seq, ballast_m3: limits.pump_m3, battery_mass_m: 0.0, fin_rad: 0.0, drop_weight: burn, beacon: true }
    }
}

#[cfg(test)]
mod tests {
    use super::{Backup, Limits};
    use signals::{Abort, Micros, Reading, SensorFrame, Surface, Switch};

    const LIMITS: Limits = Limits { deep_cm: 21_000, burn_cm: 22_000, mission_us: 3_600_000_000, pump_m3: 236e-6 };

    fn run(frames: impl Iterator<Item = SensorFrame>) -> Vec<Option<(Abort, bool)>> {
        let mut b = Backup::default();
        frames.enumerate().map(|(i, f)| b.check(&LIMITS, Micros::from_secs(4 * i as u64), &f)).collect()
    }

    fn at(depth_m: f32) -> SensorFrame {
        SensorFrame { depth_m: Reading::now(depth_m), ..SensorFrame::default() }
    }

    #[test]
    fn each_rule_fires_on_its_own_and_never_lets_go() {
        let deep = run([50.0, 211.0, 212.0, 213.0, 50.0, 0.0].into_iter().map(at));
        assert_eq!(
            deep.iter().map(|r| r.map(|r| r.0)).collect::<Vec<_>>(),
            [None, None, None, Some(Abort::OverDepth), Some(Abort::OverDepth), Some(Abort::OverDepth)]
        );
        let burn = run([230.0; 4].into_iter().map(at));
        assert_eq!(burn[3], Some((Abort::OverDepth, true)));
        // One of two that is deep calls home, later, and burns nothing.
        for (a, b) in [(230.0, 50.0), (50.0, 230.0)] {
            let one = run((0..12).map(|_| SensorFrame { depth2_m: Reading::now(b), ..at(a) }));
            assert!(one[7].is_none() && one[8..].iter().all(|r| *r == Some((Abort::OverDepth, false))), "{one:?}");
        }
        let leak = run((0..6).map(|_| SensorFrame { leak: Switch::Alarm, ..at(5.0) }));
        assert!(leak[3].is_none() && leak[4] == Some((Abort::Leak, false)));
        let silence = run((0..20).map(|_| SensorFrame::default()));
        assert!(silence[14].is_none() && silence[15].is_some_and(|r| r.0 == Abort::LinkLost));
        let deaf = run((0..200).map(|_| SensorFrame { pitch_rad: Reading::now(0.3), ..SensorFrame::default() }));
        assert!(deaf[164].is_none() && deaf[165].is_some_and(|r| r.0 == Abort::LinkLost));
        // Either receiver hears above water only.
        for (gps_fix, comms) in [(true, false), (false, true)] {
            let surface = Surface { gps_fix, comms };
            assert!(run((0..500).map(|_| SensorFrame { surface, ..SensorFrame::default() })).iter().all(Option::is_none));
        }
        let time = run((0..1000).map(|_| at(10.0)));
        assert!(time[900].is_none() && time[901] == Some((Abort::OverTime, false)));
    }

    #[test]
    fn one_damaged_copy_of_the_latch_changes_nothing() {
        let (leak, all_differ) = (Some((Abort::Leak, false)), Some((Abort::Internal, false)));
        for (latch, home) in
            [([2, 7, 2], leak), ([7, 2, 2], leak), ([2, 2, 7], leak), ([0, 7, 0], None), ([7, 0, 0], None), ([1, 2, 3], all_differ)]
        {
            let mut b = Backup { latch, ..Backup::default() };
            assert_eq!(b.check(&LIMITS, Micros(0), &at(1.0)), home, "{latch:?}");
        }
    }
}

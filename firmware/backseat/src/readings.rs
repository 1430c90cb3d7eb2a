//! What to believe of each sensor, and how old it is.
//!
//! A pair that passed the checksum passes a range and a rate gate before it is believed:
//!
//! ```text
//! |v − last| ≤ slack + rate · (t − t_last)        or three values in a row that agree with each other
//! ```
//! The glider sends what was updated in a cycle; a pair that does not come leaves its sensor growing old, never missing at once. Age is
//! counted from reception, and [`ON_THE_WAY`] on top: the median way from the vehicle's flight computer to the bay (measured in public
//! logs: 1.9 and 2.1 s, at most 4.3 s).

use crate::sensors::{List, MOST, Sensor};
use signals::{Micros, Reading, SensorFrame, Surface, Switch, Weight};

/// Time from sampling to reception, s.
pub const ON_THE_WAY: Micros = Micros::from_secs(2);
/// Longest time over which a rate is believed: beyond, the gate stays as wide as it is then.
const LONGEST_GAP: Micros = Micros::from_secs(20);
/// A state (leak, weight) is known for this long after it was last said: it is sent when looked at, every 60 s at the slowest.
const STATE_HOLDS: Micros = Micros::from_secs(600);
/// Conductivity below which a CTD near the surface is in air, S/m.
const AIR_S_M: f32 = 0.5;
/// Depth from which it is in water whatever it says, m: fresh water conducts less than that.
const IN_WATER_M: f32 = 1.0;
/// Depth above which the shore that was heard goes on being heard, m.
const AT_SURFACE_M: f32 = 1.0;
/// Standard gravity used throughout, m/s².
const GRAVITY_M_S2: f32 = 9.81;
/// Pascals per bar.
const PA_PER_BAR: f32 = 1e5;
/// Metres per inch.
pub const M_PER_INCH: f32 = 0.0254;
/// Cubic centimetres per cubic metre.
pub const CC_PER_M3: f32 = 1e6;
/// One atmosphere, Pa.
const ATMOSPHERE_PA: f32 = 101_325.0;
/// Pascals per inch of mercury.
const PA_PER_INHG: f32 = 3386.39;

/// What became of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// Believed.
    Taken,
    /// Believed though out of reach of the last one: three in a row agreed.
    NewLevel,
    /// Not a number, or out of range.
    OutOfRange,
    /// Out of reach of the last one.
    TooFast,
    /// No sensor of the list.
    UnknownIndex,
    /// A sensor that only we write.
    Ours,
}

#[derive(Clone, Copy, Debug)]
struct Slot {
    value: f32,
    at: Micros,
    seen: bool,
    rejects: u8,
    rejected: f32,
    rejected_at: Micros,
}

impl Slot {
    const EMPTY: Self = Self { value: 0.0, at: Micros(0), seen: false, rejects: 0, rejected: 0.0, rejected_at: Micros(0) };
}

/// Shortest way between two values; headings go round.
fn distance(index: u16, a: f32, b: f32) -> f32 {
    let straight = libm::fabsf(a - b);
    let around = core::f32::consts::TAU - straight;
    if index == Sensor::Heading.index() && around < straight { libm::fabsf(around) } else { straight }
}

/// All sensors as last believed.
#[derive(Clone, Debug)]
pub struct Readings {
    list: List,
    slots: [Slot; MOST],
}

impl Readings {
    /// Nothing heard.
    #[must_use]
    pub const fn new(list: List) -> Self {
        Self { list, slots: [Slot::EMPTY; MOST] }
    }

    /// Of another list: nothing is known.
    pub(crate) fn expect(&mut self, list: List) {
        self.list = list;
        self.clear();
    }

    /// Forgets everything: an index may mean something else from now on.
    pub fn clear(&mut self) {
        self.slots = [Slot::EMPTY; MOST];
    }

    /// Takes a pair of the line.
    pub fn take(&mut self, index: u16, value: Option<f64>, now: Micros) -> Fate {
        let Some(entry) = self.list.get(index) else { return Fate::UnknownIndex };
        if self.list.section(index) != Some(crate::ini::Section::Input) {
            return Fate::Ours;
        }
        let Some(slot) = self.slots.get_mut(usize::from(index)) else { return Fate::UnknownIndex };
        let gate = entry.gate;
        let Some(value) = value.map(|v| v as f32).filter(|v| *v >= gate.low && *v <= gate.high) else { return Fate::OutOfRange };
        let reach = |since: Micros| gate.slack + gate.rate_per_s * since.min(LONGEST_GAP).seconds();
        let near = !slot.seen || distance(index, value, slot.value) <= reach(now.since(slot.at));
        if !near {
            let agrees = slot.rejects > 0 && distance(index, value, slot.rejected) <= reach(now.since(slot.rejected_at));
            slot.rejects = if agrees { slot.rejects.saturating_add(1) } else { 1 };
            (slot.rejected, slot.rejected_at) = (value, now);
            if slot.rejects < 3 {
                return Fate::TooFast;
            }
        }
        *slot = Slot { value, at: now, seen: true, ..Slot::EMPTY };
        if near { Fate::Taken } else { Fate::NewLevel }
    }

    fn slot(&self, sensor: Sensor) -> Option<&Slot> {
        self.slots.get(usize::from(sensor.index())).filter(|slot| slot.seen)
    }

    /// The value believed last, however old.
    #[must_use]
    pub fn last(&self, sensor: Sensor) -> Option<f32> {
        self.slot(sensor).map(|slot| slot.value)
    }

    /// The value of a sensor that was received at or after `since`.
    #[must_use]
    pub fn since(&self, sensor: Sensor, since: Micros) -> Option<f32> {
        self.slot(sensor).filter(|slot| slot.at >= since).map(|slot| slot.value)
    }

    fn state(&self, sensor: Sensor, now: Micros) -> Option<f32> {
        self.slot(sensor).filter(|slot| now.since(slot.at) <= STATE_HOLDS).map(|slot| slot.value)
    }

    fn reading(&self, sensor: Sensor, now: Micros, convert: impl FnOnce(f32) -> f32) -> Reading {
        match self.slot(sensor) {
            Some(slot) => Reading::Sampled { value: convert(slot.value), age_ms: age_ms(now, slot.at) },
            None => Reading::Missing,
        }
    }

    /// The frame of now. `since`: when the last one was made; `rho_kg_m3`: the nominal density of [`SensorFrame::depth_m`].
    #[must_use]
    pub fn frame(&self, now: Micros, since: Micros, rho_kg_m3: f32) -> SensorFrame {
        let same = |v| v;
        let depth_per_bar = PA_PER_BAR / (rho_kg_m3 * GRAVITY_M_S2);
        SensorFrame {
            depth_m: self.reading(Sensor::Depth, now, same),
            depth2_m: self.reading(Sensor::Pressure, now, |bar| bar * depth_per_bar),
            pitch_rad: self.reading(Sensor::Pitch, now, same),
            roll_rad: self.reading(Sensor::Roll, now, same),
            heading_rad: self.reading(Sensor::Heading, now, |h| if h >= core::f32::consts::TAU { h - core::f32::consts::TAU } else { h }),
            ballast_m3: self.reading(Sensor::Ballast, now, |cc| cc / CC_PER_M3),
            battery_mass_m: self.reading(Sensor::BatteryMass, now, |inches| inches * M_PER_INCH),
            fin_rad: self.reading(Sensor::Fin, now, same),
            density_kg_m3: self.density(now),
            temperature_degc: self.reading(Sensor::Temperature, now, same),
            altitude_m: match self.slot(Sensor::AltimeterStatus) {
                Some(slot) if slot.value == 0.0 => self.reading(Sensor::Altitude, now, same),
                _ => Reading::Missing,
            },
            battery_v: self.reading(Sensor::Voltage, now, same),
            charge: self.reading(Sensor::Charge, now, |percent| percent / 100.0),
            vacuum_pa: self.reading(Sensor::Vacuum, now, |inhg| ATMOSPHERE_PA - PA_PER_INHG * inhg),
            leak: self.leak(now),
            weight: match self.state(Sensor::WeightDrop, now) {
                Some(0.0) => Weight::Held,
                Some(_) => Weight::Released,
                None => Weight::Unknown,
            },
            surface: self.surface(since),
            ..SensorFrame::default()
        }
    }

    fn leak(&self, now: Micros) -> Switch {
        let said = [Sensor::Leak, Sensor::LeakForward, Sensor::LeakScience].map(|s| self.state(s, now));
        if said.iter().flatten().any(|v| *v != 0.0) {
            Switch::Alarm
        } else if said.iter().any(Option::is_some) {
            Switch::Clear
        } else {
            Switch::Unknown
        }
    }

    /// The glider's fix stays at its last value under water: only one received in this cycle counts.
    fn surface(&self, since: Micros) -> Surface {
        let shallow = self.last(Sensor::Depth).is_some_and(|depth| depth < AT_SURFACE_M);
        let heard = |sensor| {
            let known = if shallow { self.last(sensor) } else { self.since(sensor, since) };
            known.is_some_and(|v| v != 0.0)
        };
        Surface { gps_fix: self.since(Sensor::GpsStatus, since) == Some(0.0), comms: heard(Sensor::Console) || heard(Sensor::Iridium) }
    }

    fn density(&self, now: Micros) -> Reading {
        let (Some(c), Some(t), Some(p)) = (self.slot(Sensor::Conductivity), self.slot(Sensor::Temperature), self.slot(Sensor::Pressure))
        else {
            return Reading::Missing;
        };
        let submerged = self.last(Sensor::Depth).is_some_and(|depth| depth > IN_WATER_M);
        if c.value < AIR_S_M && !submerged {
            return Reading::Missing;
        }
        let dbar = if p.value > 0.0 { p.value * 10.0 } else { 0.0 };
        let salinity = crate::seawater::practical_salinity(c.value, t.value, dbar);
        let value = crate::seawater::density_kg_m3(salinity, t.value, dbar);
        Reading::Sampled { value, age_ms: age_ms(now, c.at.min(t.at).min(p.at)) }
    }
}

fn age_ms(now: Micros, at: Micros) -> u32 {
    u32::try_from(now.since(at).plus(ON_THE_WAY).0 / 1_000).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::{Fate, Readings};
    use crate::sensors::{List, Sensor};
    use signals::{Micros, Reading, Switch, Weight};

    fn at(s: u64) -> Micros {
        Micros::from_secs(s)
    }

    #[test]
    fn units_become_ours() {
        let mut r = Readings::new(List::default());
        for (index, value) in [
            (9, 42.75),
            (10, 4.3),
            (14, 236.0),
            (15, 0.5),
            (17, 15.0),
            (18, 4.2914),
            (20, 0.0),
            (19, 12.0),
            (22, 80.0),
            (23, 6.505),
            (24, 0.0),
            (27, 1.0),
        ] {
            assert_eq!(r.take(index, Some(value), at(10)), Fate::Taken, "{index}");
        }
        let f = r.frame(at(11), at(9), 1025.0);
        let value = |r: Reading| r.accept(f32::MIN..=f32::MAX, 3000).expect("three seconds old at most");
        assert!((value(f.depth2_m) - 42.76).abs() < 0.01 && (value(f.battery_mass_m) - 0.0127).abs() < 1e-7);
        assert!((value(f.ballast_m3) - 236e-6).abs() < 1e-10 && (value(f.charge) - 0.8).abs() < 1e-6);
        assert!((value(f.vacuum_pa) - 79_296.5).abs() < 1.0 && (value(f.density_kg_m3) - 1026.17).abs() < 0.05, "{:?}", f.density_kg_m3);
        assert_eq!((f.leak, f.weight, value(f.altitude_m)), (Switch::Clear, Weight::Released, 12.0));
        assert_eq!(f.temperature_degc, Reading::Sampled { value: 15.0, age_ms: 3000 });
        assert_eq!(f.depth_m, Reading::Sampled { value: 42.75, age_ms: 3000 });
    }

    #[test]
    fn a_jump_is_believed_when_three_agree_and_a_heading_goes_round() {
        let mut r = Readings::new(List::default());
        assert_eq!(r.take(9, Some(42.75), at(0)), Fate::Taken);
        assert_eq!(r.take(9, Some(24.75), at(4)), Fate::TooFast);
        assert_eq!(r.take(9, Some(43.0), at(8)), Fate::Taken);
        for (t, fate) in [(12, Fate::TooFast), (16, Fate::TooFast), (20, Fate::NewLevel)] {
            assert_eq!(r.take(9, Some(120.0), at(t)), fate);
        }
        assert_eq!(r.take(13, Some(6.27), at(0)), Fate::Taken);
        assert_eq!(r.take(13, Some(0.02), at(1)), Fate::Taken);
        assert_eq!(r.take(0, Some(1.0), at(1)), Fate::Ours);
        assert_eq!(r.take(32, Some(1.0), at(1)), Fate::UnknownIndex);
    }

    #[test]
    fn a_fix_from_before_the_dive_is_none() {
        let mut r = Readings::new(List::default());
        r.take(Sensor::GpsStatus.index(), Some(0.0), at(10));
        r.take(Sensor::Depth.index(), Some(0.2), at(10));
        r.take(Sensor::Console.index(), Some(1.0), at(10));
        assert!(r.frame(at(10), at(8), 1025.0).surface.gps_fix);
        let later = r.frame(at(30), at(26), 1025.0).surface;
        assert!(!later.gps_fix && later.comms);
        r.take(Sensor::Depth.index(), Some(12.0), at(30));
        assert!(!r.frame(at(31), at(27), 1025.0).surface.comms);
    }
}

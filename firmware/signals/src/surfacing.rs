//! What a vehicle tells the shore at a surfacing, in one short message: state now, and evidence of the glides since the last one.
//!
//! Made for an Iridium SBD, which is paid for by the byte and carries 340 of them (9602 modem): 54 bytes, little endian, or 163 where
//! the glides say something of the vehicle's numbers.
//!
//! Bytes and units: "The message" in `docs/backseat.md`.
//!
//! The evidence is the way in depth, which is measured, compared with speed × sin(path angle) × time, which
//! the law's table says: where they differ over a whole surfacing, the vehicle is not that of its table.

use crate::frame::{Abort, Answer, Flags, Phase, Reading, SensorFrame, Surface, Switch, Trace, Weight};
use crate::link::{CRC32, WireError};

/// Bytes of the message without a packet of the glides, of that packet, and of the message with it.
pub const SURFACING_BYTES: usize = 54;
/// See above.
pub const GLIDES_BYTES: usize = 109;
/// See above.
pub const MOST_BYTES: usize = SURFACING_BYTES + GLIDES_BYTES;
/// Version without and with a packet.
const VERSIONS: [u8; 2] = [1, 2];

/// What the glides say of the vehicle's numbers: their packet, and [`Flags::DEPARTS`] where they depart from its history.
pub type OfGlides = ([u8; GLIDES_BYTES], Flags);

/// A message as bytes: one of the two lengths.
pub type Bytes = heapless::Vec<u8, MOST_BYTES>;
/// Longest time between two cycles that counts as a glide, µs.
const CYCLE_US: u64 = 10_000_000;
/// At the surface above this; a dive is one from the other on, m.
const SURFACE_M: f32 = 1.0;
const DIVE_M: f32 = 5.0;

/// Whether a step of the law finds the vehicle where it can tell: at the surface, waiting there for shore or its end.
#[must_use]
pub const fn is_up(trace: &Trace) -> bool {
    matches!(trace.phase, Phase::Comms | Phase::Done | Phase::Safe) && trace.depth_m < SURFACE_M
}

/// Whether a step belongs to a dive, so that the next surfacing is another one.
#[must_use]
pub const fn is_dive(trace: &Trace) -> bool {
    trace.depth_m > DIVE_M
}

/// Glides in one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Glide {
    /// Time, s.
    pub time_s: f32,
    /// Way in depth as measured, m, down or up alike.
    pub way_m: f32,
    /// Mean pitch, rad.
    pub pitch_rad: f32,
    /// Mean of the estimated path angle, rad, up positive.
    pub path_rad: f32,
    /// Mean of the estimated speed through the water, m/s.
    pub speed_m_s: f32,
}

/// What the message says.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surfacing {
    /// Phase of the law.
    pub phase: Phase,
    /// First cause of an abort.
    pub abort: Option<Abort>,
    /// Water in the hull.
    pub leak: Switch,
    /// The drop weight.
    pub weight: Weight,
    /// A fix, and word from shore.
    pub surface: Surface,
    /// Number of the last frame.
    pub seq: u32,
    /// Its time, s.
    pub time_s: u32,
    /// Dives completed.
    pub dives: u16,
    /// Flags of any cycle since the last message.
    pub flags: Flags,
    /// Table in use.
    pub table_id: u32,
    /// Deepest since the last message, m.
    pub deepest_m: f32,
    /// Lowest voltage, V.
    pub battery_v: Option<f32>,
    /// Lowest charge, 0 to 1.
    pub charge: Option<f32>,
    /// Highest pressure in the hull, Pa.
    pub vacuum_pa: Option<f32>,
    /// Glides down and up.
    pub glides: [Glide; 2],
    /// The packet of what the glides say of the vehicle's numbers.
    pub packet: Option<[u8; GLIDES_BYTES]>,
}

/// Collects the evidence of one surfacing, cycle by cycle.
#[derive(Clone, Copy, Debug, Default)]
pub struct Evidence {
    so_far: Surfacing,
    last: Option<(u64, f32)>,
}

fn lower(so_far: Option<f32>, reading: Reading) -> Option<f32> {
    match (so_far, reading) {
        (Some(least), Reading::Sampled { value, .. }) if value.is_finite() => Some(least.min(value)),
        (None, Reading::Sampled { value, .. }) if value.is_finite() => Some(value),
        _ => so_far,
    }
}

impl Evidence {
    /// Takes one cycle.
    pub fn take(&mut self, frame: &SensorFrame, answer: &Answer) {
        let (told, trace) = (&mut self.so_far, &answer.trace);
        (told.phase, told.abort, told.dives, told.table_id) = (trace.phase, trace.abort, trace.dives, trace.table_id);
        (told.leak, told.weight, told.surface) = (frame.leak, frame.weight, frame.surface);
        (told.seq, told.time_s) = (frame.seq, u32::try_from(frame.time.0 / 1_000_000).unwrap_or(u32::MAX));
        told.flags = told.flags.with(trace.flags);
        told.battery_v = lower(told.battery_v, frame.battery_v);
        told.charge = lower(told.charge, frame.charge);
        if let Reading::Sampled { value, .. } = frame.vacuum_pa
            && value.is_finite()
        {
            told.vacuum_pa = Some(told.vacuum_pa.map_or(value, |most| most.max(value)));
        }
        if !trace.depth_m.is_finite() {
            self.last = None;
            return;
        }
        let depth_m = trace.depth_m;
        told.deepest_m = told.deepest_m.max(depth_m);
        let [down, up] = &mut told.glides;
        let glide = match trace.phase {
            Phase::Dive => Some(down),
            Phase::Climb => Some(up),
            _ => None,
        };
        let now_us = frame.time.0;
        if let (Some(glide), Some((last_us, last_m)), Reading::Sampled { value: pitch_rad, .. }) = (glide, self.last, frame.pitch_rad)
            && let dt_us = now_us.saturating_sub(last_us)
            && dt_us > 0
            && dt_us <= CYCLE_US
            && (pitch_rad + trace.glide_angle_rad + trace.speed_m_s).is_finite()
        {
            let dt_s = dt_us as f32 * 1e-6;
            glide.time_s += dt_s;
            glide.way_m += (depth_m - last_m).abs();
            let share = dt_s / glide.time_s;
            glide.pitch_rad += share * (pitch_rad - glide.pitch_rad);
            glide.path_rad += share * (trace.glide_angle_rad - glide.path_rad);
            glide.speed_m_s += share * (trace.speed_m_s - glide.speed_m_s);
        }
        self.last = Some((now_us, depth_m));
    }

    /// The message will carry what the glides say, or nothing of it.
    pub fn carry(&mut self, glides: Option<OfGlides>) {
        self.so_far.packet = glides.map(|of| of.0);
        self.so_far.flags = self.so_far.flags.with(glides.map_or(Flags(0), |of| of.1));
    }

    /// What is to be told now. Once it is on its way, begin with [`Evidence::default`] anew.
    #[must_use]
    pub const fn told(&self) -> &Surfacing {
        &self.so_far
    }
}

/// All ones: not known. Beyond the range: its end.
fn unsigned(value: Option<f32>, unit: f32) -> [u8; 2] {
    let steps = value.map_or(u16::MAX, |v| if v.is_finite() { ((v / unit + 0.5) as u16).min(u16::MAX - 1) } else { u16::MAX });
    steps.to_le_bytes()
}

fn angle(value: f32) -> [u8; 2] {
    let half = if value < 0.0 { -0.5 } else { 0.5 };
    ((value * 1e4 + half) as i16).to_le_bytes()
}

const fn number_of(leak: Switch, weight: Weight) -> u8 {
    let leak = match leak {
        Switch::Unknown => 0,
        Switch::Clear => 1,
        Switch::Alarm => 2,
    };
    let weight = match weight {
        Weight::Unknown => 0,
        Weight::Held => 1,
        Weight::Released => 2,
    };
    leak | weight << 2
}

impl Surfacing {
    /// The bytes of the message.
    #[must_use]
    pub fn encode(&self) -> Bytes {
        let abort = self.abort.map_or(0, |abort| (abort as u8).saturating_add(1));
        let surface = u8::from(self.surface.gps_fix) << 4 | u8::from(self.surface.comms) << 5;
        let [plain, with_packet] = VERSIONS;
        let version = if self.packet.is_some() { with_packet } else { plain };
        let state = [version, self.phase as u8, abort, number_of(self.leak, self.weight) | surface];
        let [down, up] = self.glides.map(|g| {
            [
                unsigned(Some(g.time_s), 1.0),
                unsigned(Some(g.way_m), 0.1),
                angle(g.pitch_rad),
                angle(g.path_rad),
                unsigned(Some(g.speed_m_s), 1e-3),
            ]
        });
        let least = [
            unsigned(Some(self.deepest_m), 0.1),
            unsigned(self.battery_v, 1e-3),
            unsigned(self.charge, 1e-4),
            unsigned(self.vacuum_pa, 2.0),
        ];
        let body = state
            .into_iter()
            .chain(self.seq.to_le_bytes())
            .chain(self.time_s.to_le_bytes())
            .chain(self.dives.to_le_bytes())
            .chain(self.flags.0.to_le_bytes())
            .chain(self.table_id.to_le_bytes())
            .chain(least.into_iter().chain(down).chain(up).flatten())
            .chain(self.packet.into_iter().flatten());
        let mut bytes: Bytes = body.take(MOST_BYTES - 4).collect();
        let sum = CRC32.checksum(&bytes).to_le_bytes();
        // There is room for it.
        let _ = bytes.extend_from_slice(&sum);
        bytes
    }

    /// What a message says.
    ///
    /// # Errors
    /// Another length, another version, damaged, or a number that means nothing.
    pub fn decode(bytes: &[u8]) -> Result<Self, WireError> {
        let (body, sum) = bytes.split_last_chunk::<4>().ok_or(WireError::Framing)?;
        if ![SURFACING_BYTES, MOST_BYTES].contains(&bytes.len()) {
            return Err(WireError::Framing);
        }
        if CRC32.checksum(body) != u32::from_le_bytes(*sum) {
            return Err(WireError::Crc);
        }
        let [plain, with_packet] = VERSIONS;
        let expected = if bytes.len() == MOST_BYTES { with_packet } else { plain };
        if body.first() != Some(&expected) {
            return Err(WireError::Version(body.first().copied().unwrap_or_default()));
        }
        let mut rest = Rest(body);
        let [_, phase, abort, switches] = rest.take::<4>()?;
        let abort = match abort.checked_sub(1) {
            Some(number) => Some(postcard::from_bytes(&[number]).map_err(|_| WireError::Content)?),
            None => None,
        };
        let mut told = Self {
            phase: postcard::from_bytes(&[phase]).map_err(|_| WireError::Content)?,
            abort,
            leak: [Switch::Unknown, Switch::Clear, Switch::Alarm].get(usize::from(switches & 3)).copied().ok_or(WireError::Content)?,
            weight: [Weight::Unknown, Weight::Held, Weight::Released]
                .get(usize::from(switches >> 2 & 3))
                .copied()
                .ok_or(WireError::Content)?,
            seq: u32::from_le_bytes(rest.take()?),
            time_s: u32::from_le_bytes(rest.take()?),
            dives: u16::from_le_bytes(rest.take()?),
            flags: Flags(u32::from_le_bytes(rest.take()?)),
            table_id: u32::from_le_bytes(rest.take()?),
            deepest_m: rest.unsigned(0.1)?.unwrap_or_default(),
            battery_v: rest.unsigned(1e-3)?,
            charge: rest.unsigned(1e-4)?,
            vacuum_pa: rest.unsigned(2.0)?,
            ..Self::default()
        };
        (told.surface.gps_fix, told.surface.comms) = (switches >> 4 & 1 == 1, switches >> 5 & 1 == 1);
        for glide in &mut told.glides {
            *glide = Glide {
                time_s: rest.unsigned(1.0)?.unwrap_or_default(),
                way_m: rest.unsigned(0.1)?.unwrap_or_default(),
                pitch_rad: rest.angle()?,
                path_rad: rest.angle()?,
                speed_m_s: rest.unsigned(1e-3)?.unwrap_or_default(),
            };
        }
        if !rest.0.is_empty() {
            told.packet = Some(rest.take()?);
        }
        Ok(told)
    }
}

/// What is left to read.
struct Rest<'a>(&'a [u8]);

impl Rest<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], WireError> {
        let (taken, rest) = self.0.split_first_chunk::<N>().ok_or(WireError::Framing)?;
        self.0 = rest;
        Ok(*taken)
    }

    fn unsigned(&mut self, unit: f32) -> Result<Option<f32>, WireError> {
        let steps = u16::from_le_bytes(self.take()?);
        Ok((steps != u16::MAX).then_some(f32::from(steps) * unit))
    }

    fn angle(&mut self) -> Result<f32, WireError> {
        Ok(f32::from(i16::from_le_bytes(self.take()?)) * 1e-4)
    }
}

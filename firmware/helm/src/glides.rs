//! What the glides say of the vehicle's numbers, for the report of a surfacing: cycles of the law into [`evidence`].
//!
//! Outside the seal: nothing steers by it. Without a temperature the thermal expansion is not judged on board.

use control::Settings;
use evidence::{Cycle, Detector, Dives, History, Packet, Vehicle};
use polar::Table;
use signals::surfacing::{GLIDES_BYTES, OfGlides};
use signals::{Answer, Flags, Phase, SensorFrame};

/// Pascal per metre of a frame's depth: standard sea water, as a backseat reckons it. Off by 1 %, all pressures are; so are those of
/// the dives that it is judged by.
pub const PA_PER_M: f32 = 1025.0 * 9.81;
/// Ages at which a pressure, attitude or ballast, and the water are old, ms.
const OLD_MS: [u32; 3] = [10_000, 20_000, 60_000];
/// Fewest rows, and of them in dives and in climbs, that can be judged: as the workbench asks.
const FEWEST: (u16, u16) = (14, 4);

const _: () = assert!(evidence::PACKET_BYTES == GLIDES_BYTES, "the message has room for the packet");

/// The constants that a configuration judges by.
#[must_use]
pub fn vehicle(settings: &Settings) -> Vehicle {
    let (hull, pitch) = (settings.hull, settings.pitch_sensor);
    Vehicle {
        mass_kg: hull.mass_kg,
        volume_m3: hull.volume_m3,
        compressibility_per_pa: hull.compressibility_per_pa,
        expansion_per_k: hull.expansion_per_k,
        reference_degc: hull.reference_degc,
        ballast_gain: 1.0,
        pitch_gain: pitch.per_reading,
        pitch_offset_rad: -pitch.per_reading * pitch.zero_rad,
    }
}

/// The glides since the last report.
#[derive(Clone, Debug)]
pub(crate) struct Glides {
    dives: Dives,
    detector: Detector,
    vehicle_id: u32,
}

impl Glides {
    pub(crate) const fn new() -> Self {
        Self { dives: Dives::new(), detector: Detector::new(), vehicle_id: 0 }
    }

    /// Takes a step of the law.
    pub(crate) fn take(&mut self, settings: &Settings, table: Option<&Table<'_>>, frame: &SensorFrame, answer: &Answer) {
        let Some(cycle) = cycle(frame, answer.trace.phase) else { return self.dives.interrupt() };
        let Some(table) = table else { return };
        let vehicle = vehicle(settings);
        if self.dives.rows() == 0 {
            self.vehicle_id = vehicle.id();
        }
        self.dives.take(&vehicle, table, &cycle);
    }

    /// The packet, where there is enough in it to judge, whether it departs from the vehicle's history, and a new beginning.
    pub(crate) fn said(&mut self, history: Option<&History>) -> Option<OfGlides> {
        let packet = self.dives.packet(self.vehicle_id);
        self.dives.begin();
        let bytes = packet.encode().filter(|_| is_enough(&packet))?;
        let departs = history.is_some_and(|history| self.detector.take(history, &packet));
        Some((bytes, if departs { Flags::DEPARTS } else { Flags(0) }))
    }
}

/// Whether there is enough in a packet to judge.
#[must_use]
pub fn is_enough(packet: &Packet) -> bool {
    let least = packet.climbing.min(packet.rows.saturating_sub(packet.climbing));
    packet.rows >= FEWEST.0 && least >= FEWEST.1
}

/// A cycle of a glide; none of what is no glide, and with a sensor that is missing or old.
#[must_use]
pub fn cycle(frame: &SensorFrame, phase: Phase) -> Option<Cycle> {
    if !matches!(phase, Phase::Dive | Phase::Climb) || frame.weight == signals::Weight::Released {
        return None;
    }
    let [pressure_ms, attitude_ms, water_ms] = OLD_MS;
    let any = f32::MIN..=f32::MAX;
    let (depth_m, age_ms) = [frame.depth2_m, frame.depth_m].into_iter().find_map(|reading| match reading {
        signals::Reading::Sampled { value, age_ms } if value.is_finite() && age_ms <= pressure_ms => Some((value, age_ms)),
        _ => None,
    })?;
    Some(Cycle {
        time_us: frame.time.0.saturating_sub(u64::from(age_ms) * 1000),
        pressure_pa: depth_m * PA_PER_M,
        pitch_rad: frame.pitch_rad.accept(any.clone(), attitude_ms)?,
        roll_rad: frame.roll_rad.accept(any.clone(), attitude_ms).unwrap_or(f32::NAN),
        ballast_m3: frame.ballast_m3.accept(any.clone(), attitude_ms)?,
        density_kg_m3: frame.density_kg_m3.accept(any, water_ms)?,
        temperature_degc: frame.temperature_degc.accept(-5.0..=45.0, water_ms).unwrap_or(f32::NAN),
    })
}

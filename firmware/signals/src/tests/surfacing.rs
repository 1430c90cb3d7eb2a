//! The short message of a surfacing: what goes in comes out, to its steps; what is damaged or means nothing is refused.

use crate::surfacing::{Bytes, GLIDES_BYTES, Glide, SURFACING_BYTES};
use crate::{
    Abort, ActuatorCommand, Answer, Evidence, Flags, Micros, Phase, Reading, SensorFrame, Surface, Surfacing, Switch, Trace, Weight,
    WireError,
};

/// A dive from 0 to 30 m at 0.1 m/s and back up at 0.12 m/s, a cycle each 4 s.
fn flown() -> Evidence {
    let mut evidence = Evidence::default();
    let (mut seq, mut depth_m) = (0u32, 0.0f32);
    for (phase, rate_m_s, pitch_rad, cycles) in
        [(Phase::Dive, 0.1, -0.4, 75), (Phase::InflectLow, 0.0, 0.0, 3), (Phase::Climb, -0.12, 0.45, 62)]
    {
        for _ in 0..cycles {
            depth_m += 4.0 * rate_m_s;
            seq += 1;
            let frame = SensorFrame {
                seq,
                time: Micros::from_secs(4 * u64::from(seq)),
                pitch_rad: Reading::now(pitch_rad),
                battery_v: Reading::now(if seq == 40 { 12.9 } else { 13.4 }),
                charge: if seq < 10 { Reading::Missing } else { Reading::now(0.62) },
                vacuum_pa: Reading::now(79_300.0),
                leak: Switch::Clear,
                weight: Weight::Held,
                surface: Surface { gps_fix: true, comms: false },
                ..SensorFrame::default()
            };
            let flags = if seq == 50 { Flags::DEPTH_PROJECTED } else { Flags::default() };
            let (speed_m_s, glide_angle_rad) = (0.25, pitch_rad * 1.1);
            let trace = Trace { phase, flags, dives: 7, depth_m, speed_m_s, glide_angle_rad, table_id: 0xdead_beef, ..Trace::default() };
            evidence.take(&frame, &Answer { command: ActuatorCommand::default(), trace });
        }
    }
    evidence
}

fn near(a: f32, b: f32, step: f32) {
    assert!((a - b).abs() <= 0.5 * step * 1.001 + 1e-6, "{a} {b} {step}");
}

#[test]
fn a_surfacing_is_told_in_less_than_a_hundred_bytes_and_read_again() {
    let told = *flown().told();
    let bytes = told.encode();
    assert!(SURFACING_BYTES <= 100 && bytes.len() == SURFACING_BYTES);
    let read = Surfacing::decode(&bytes).expect("a message");
    let exact = |s: &Surfacing| (s.phase, s.abort, s.leak, s.weight, s.surface, s.seq, s.time_s, s.dives, s.flags, s.table_id);
    assert_eq!(exact(&read), exact(&told));
    assert_eq!((read.seq, read.time_s, read.flags), (140, 560, Flags::DEPTH_PROJECTED), "a flag of one cycle is not lost");
    near(read.deepest_m, 30.0, 0.1);
    near(read.battery_v.expect("known"), 12.9, 1e-3);
    near(read.charge.expect("known"), 0.62, 1e-4);
    near(read.vacuum_pa.expect("known"), 79_300.0, 2.0);
    // The first cycle has none before it.
    let dive = Glide { time_s: 296.0, way_m: 29.6, pitch_rad: -0.4, path_rad: -0.44, speed_m_s: 0.25 };
    let climb = Glide { time_s: 248.0, way_m: 29.8, pitch_rad: 0.45, path_rad: 0.495, speed_m_s: 0.25 };
    for (read, true_one) in read.glides.iter().zip([dive, climb]) {
        near(read.time_s, true_one.time_s, 1.0);
        near(read.way_m, true_one.way_m, 0.1);
        near(read.pitch_rad, true_one.pitch_rad, 1e-4);
        near(read.path_rad, true_one.path_rad, 1e-4);
        near(read.speed_m_s, true_one.speed_m_s, 1e-3);
    }
}

#[test]
fn every_cause_is_told_and_what_is_not_known_stays_unknown() {
    for number in 0..=Abort::Bottom as u8 {
        let abort = (0..=255).find_map(|n: u8| postcard::from_bytes::<Abort>(&[n]).ok().filter(|a| *a as u8 == number));
        let told = Surfacing { phase: Phase::Safe, abort, leak: Switch::Alarm, weight: Weight::Released, ..Surfacing::default() };
        assert!(abort.is_some());
        assert_eq!(Surfacing::decode(&told.encode()), Ok(told));
    }
    let nothing = Surfacing::default();
    assert_eq!(Surfacing::decode(&nothing.encode()), Ok(nothing));
}

#[test]
fn a_damaged_message_is_refused_wherever_the_bit() {
    let mut evidence = flown();
    let plain = evidence.told().encode();
    evidence.carry(Some(([0xa5; GLIDES_BYTES], Flags::DEPARTS)));
    let with_packet = evidence.told().encode();
    assert!(evidence.told().flags.contains(Flags::DEPARTS));
    assert_eq!((plain.len(), with_packet.len()), (54, 163));
    assert_eq!(
        Surfacing::decode(&with_packet),
        Ok(*evidence.told()).map(|told| Surfacing {
            packet: Some([0xa5; GLIDES_BYTES]),
            flags: told.flags,
            ..Surfacing::decode(&plain).unwrap_or(told)
        })
    );
    for (bytes, bit) in [&plain, &with_packet].into_iter().flat_map(|bytes| (0..8 * bytes.len()).map(move |bit| (bytes, bit))) {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(Surfacing::decode(&damaged), Err(WireError::Crc), "bit {bit}");
    }
    let bytes = plain;
    assert_eq!(Surfacing::decode(&bytes[..53]), Err(WireError::Framing));
    assert_eq!(Surfacing::decode(&with_packet[..54]), Err(WireError::Crc));
    let seal = |mut bytes: Bytes| {
        let sum = crate::link::CRC32.checksum(&bytes[..50]);
        bytes[50..].copy_from_slice(&sum.to_le_bytes());
        bytes
    };
    for (at, value, why) in
        [(0, 2, WireError::Version(2)), (1, 200, WireError::Content), (2, 255, WireError::Content), (3, 3, WireError::Content)]
    {
        let mut other = bytes.clone();
        other[at] = value;
        assert_eq!(Surfacing::decode(&seal(other)), Err(why));
    }
}

#[test]
fn what_is_not_finite_leaves_no_trace_and_a_gap_is_no_glide() {
    let mut evidence = flown();
    let before = *evidence.told();
    for (second, bad) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].into_iter().enumerate() {
        let reading = Reading::now(bad);
        let time = Micros::from_secs(564 + 4 * second as u64);
        let frame =
            SensorFrame { time, pitch_rad: reading, battery_v: reading, charge: reading, vacuum_pa: reading, ..SensorFrame::default() };
        let trace = Trace { phase: Phase::Dive, depth_m: bad, speed_m_s: bad, glide_angle_rad: bad, ..Trace::default() };
        let answer = Answer { command: ActuatorCommand::default(), trace };
        evidence.take(&frame, &answer);
        let mut first = Evidence::default();
        first.take(&frame, &answer);
        let empty = *first.told();
        assert_eq!((empty.battery_v, empty.charge, empty.vacuum_pa, empty.deepest_m), (None, None, None, 0.0));
        // Numbers of a glide that are none, and a time that stands still, between two depths.
        for (second, path_rad) in [(580, -0.4), (580, -0.4), (584, bad)] {
            let frame = SensorFrame { time: Micros::from_secs(second), pitch_rad: Reading::now(-0.4), ..SensorFrame::default() };
            let trace = Trace { phase: Phase::Dive, depth_m: 20.0, glide_angle_rad: path_rad, ..Trace::default() };
            first.take(&frame, &Answer { command: ActuatorCommand::default(), trace });
        }
        assert_eq!(first.told().glides, [Glide::default(); 2]);
        let said = Surfacing { battery_v: Some(bad), charge: Some(1e9), ..Surfacing::default() };
        let read = Surfacing::decode(&said.encode()).expect("a message");
        assert_eq!((read.battery_v, read.charge), (None, Some(6.5534)), "none is not known, too much is the end of the range");
    }
    // Four seconds after a depth that was none, and long after that.
    for second in [576, 900] {
        let late = SensorFrame { time: Micros::from_secs(second), pitch_rad: Reading::now(-0.4), ..SensorFrame::default() };
        let trace = Trace { phase: Phase::Dive, depth_m: 20.0, ..Trace::default() };
        evidence.take(&late, &Answer { command: ActuatorCommand::default(), trace });
    }
    let after = *evidence.told();
    assert_eq!((after.glides, after.deepest_m), (before.glides, before.deepest_m));
    assert_eq!((after.battery_v, after.charge, after.vacuum_pa), (before.battery_v, before.charge, before.vacuum_pa));
}

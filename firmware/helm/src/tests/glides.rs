//! From frames to the report: the packet of the glides, and the flag of a departure from the history that is stored.

use crate::glides::{Glides, PA_PER_M, is_enough, vehicle};
use control::{Config, Settings};
use evidence::glide::linearise;
use evidence::rows::Row;
use evidence::{History, Packet};
use signals::surfacing::OfGlides;
use signals::{Answer, Flags, Micros, Phase, Reading, SensorFrame, Trace, Weight, Wings};

/// Two dives to 150 m, `slower` times as fast as the table says, and what is said of them.
fn said(glides: &mut Glides, history: Option<&History>, slower: f32) -> Option<OfGlides> {
    let config = Config::new(Settings::slocum_100()).expect("valid");
    let (vehicle, table) = (vehicle(&config), polar::builtin(Wings::Standard).expect("built in"));
    let neutral_kg_m3 = vehicle.mass_kg / vehicle.volume_m3;
    let (mut p, mut ms) = (1e4_f32, 0);
    for leg in 0..4 {
        let way = if leg % 2 == 0 { -1.0 } else { 1.0 };
        let phase = if way < 0.0 { Phase::Dive } else { Phase::Climb };
        while (5e3..1.5e6).contains(&p) {
            let (pitch_rad, ballast_m3, temperature_degc) = (way * 0.42, way * 2e-4, 12.0);
            let density_kg_m3 = neutral_kg_m3 + 4.4e-7 * p;
            let row = Row { pressure_pa: p, rise_m_s: way, density_kg_m3, temperature_degc, pitch_rad, ballast_m3, ..Row::default() };
            let speed_m_s = f64::from(linearise(&vehicle, &table, &row, 0.0).expect("steady").square).sqrt() as f32 * slower;
            let now = Reading::now;
            let frame = SensorFrame {
                time: Micros::from_millis(ms),
                depth_m: now(p / PA_PER_M),
                pitch_rad: now(pitch_rad),
                ballast_m3: now(ballast_m3),
                density_kg_m3: now(density_kg_m3),
                temperature_degc: now(temperature_degc),
                ..SensorFrame::default()
            };
            let answer = Answer { trace: Trace { phase, ..Trace::default() }, ..Answer::default() };
            glides.take(&config, Some(&table), &frame, &answer);
            p -= way * speed_m_s * 4.0 * density_kg_m3 * 9.81;
            ms += 4_000;
        }
        p = if way < 0.0 { 1.49e6 } else { 1e4 };
    }
    glides.said(history)
}

#[test]
fn the_flag_is_up_where_the_history_does_not_explain_the_glides() {
    let config = Config::new(Settings::slocum_100()).expect("valid");
    let mut spread = [[0.0; 8]; 8];
    (0..8).for_each(|i| spread[i][i] = 0.1);
    let history = History { vehicle_id: vehicle(&config).id(), usual_level: 1e-5, mean: [0.0; 8], spread };
    let flags = |history: Option<&History>, slower: f32| {
        let (bytes, flags) = said(&mut Glides::new(), history, slower).expect("enough to judge");
        let packet = Packet::decode(&bytes).expect("a packet");
        assert!(packet.rows > 30 && packet.vehicle_id == vehicle(&config).id());
        let mut few = packet;
        for (rows, climbing, enough) in [(14, 4, true), (14, 10, true), (13, 6, false), (14, 3, false), (14, 11, false)] {
            (few.rows, few.climbing) = (rows, climbing);
            assert_eq!(is_enough(&few), enough, "{climbing} of {rows}");
        }
        flags
    };
    // Half as much drag again is a fifth less speed.
    let slow = signals::root::sqrt(1.0 / 1.5);
    assert_eq!(flags(Some(&history), 1.0), Flags(0));
    assert_eq!(flags(Some(&history), slow), Flags::DEPARTS);
    // Without a history, or with that of other constants, nothing is said.
    assert_eq!(flags(None, slow), Flags(0));
    assert_eq!(flags(Some(&History { vehicle_id: 1, ..history }), slow), Flags(0));
}

#[test]
fn a_frame_without_temperature_says_nothing_of_the_expansion() {
    use crate::glides::cycle;
    let now = Reading::now;
    let sound = SensorFrame {
        depth_m: now(50.0),
        pitch_rad: now(-0.4),
        ballast_m3: now(-2e-4),
        density_kg_m3: now(1025.0),
        temperature_degc: now(12.0),
        ..SensorFrame::default()
    };
    let of = |temperature_degc: Reading| cycle(&SensorFrame { temperature_degc, ..sound }, Phase::Dive).expect("a cycle").temperature_degc;
    assert_eq!(of(now(12.0)), 12.0);
    let refused = [Reading::Missing, now(f32::NAN), now(f32::INFINITY), now(9999.0), Reading::Sampled { value: 12.0, age_ms: 60_001 }];
    assert!(refused.into_iter().all(|r| of(r).is_nan()));
    assert_eq!(cycle(&SensorFrame { density_kg_m3: Reading::Missing, ..sound }, Phase::Dive), None);
    assert_eq!(cycle(&sound, Phase::InflectLow), None);
    assert_eq!(cycle(&SensorFrame { weight: Weight::Released, ..sound }, Phase::Climb), None);
    let depth = |age_ms| cycle(&SensorFrame { depth_m: Reading::Sampled { value: 50.0, age_ms }, ..sound }, Phase::Dive);
    assert!(depth(10_000).is_some() && depth(10_001).is_none());
}

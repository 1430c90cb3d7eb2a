//! A mission of 60 days in the log flash of the board: its first record is still there at its end, whatever it did.

use crate::storage::OBJECTS;
use crate::thinning::{AFTER, BEFORE, BURST, EVERY, MISSION_DAYS, PART, ROOM, SELDOM};
use crate::vault::{CYCLE, Logged};
use crate::{Storage, Vault};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use signals::{Abort, ActuatorCommand, Answer, Flags, Micros, Phase, Reading, SensorFrame, TimeSource, Trace, Utc};
use std::convert::Infallible;
use store::Ring;
use store::ring::MAX_ENTRY;

const SECTOR: usize = 4096;
/// Cycles of a mission.
const CYCLES: u32 = (MISSION_DAYS * 86_400 / 4) as u32;
/// Phases of a dive and the share of it that each takes.
const DIVE: [(Phase, f64); 5] =
    [(Phase::Dive, 0.45), (Phase::InflectLow, 0.03), (Phase::Climb, 0.45), (Phase::Surface, 0.01), (Phase::Comms, 0.06)];

/// The part, in memory.
struct Part(Vec<u8>);

impl ErrorType for Part {
    type Error = Infallible;
}

impl ReadNorFlash for Part {
    const READ_SIZE: usize = 1;
    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Infallible> {
        bytes.copy_from_slice(&self.0[offset as usize..offset as usize + bytes.len()]);
        Ok(())
    }
    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Part {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = SECTOR;
    fn erase(&mut self, from: u32, to: u32) -> Result<(), Infallible> {
        self.0[from as usize..to as usize].fill(0xff);
        Ok(())
    }
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Infallible> {
        self.0[offset as usize..offset as usize + bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

/// A cycle with every sensor there.
fn cycle(seq: u32, phase: Phase, dives: u32) -> Logged {
    let value = |x: f32| Reading::Sampled { value: x + 1e-3 * seq as f32, age_ms: 150 };
    let utc = Utc { ms: 1_790_000_000_000 + 4_000 * u64::from(seq), within_ms: 5_000, source: TimeSource::Gps };
    let frame = SensorFrame {
        seq,
        time: Micros::from_secs(4 * u64::from(seq)),
        depth_m: value(10.0),
        depth2_m: value(10.0),
        pitch_rad: value(0.4),
        roll_rad: value(0.0),
        heading_rad: value(1.0),
        ballast_m3: value(1e-4),
        battery_mass_m: value(0.01),
        fin_rad: value(0.1),
        density_kg_m3: value(1025.0),
        temperature_degc: value(12.0),
        altitude_m: value(50.0),
        battery_v: value(13.0),
        charge: value(0.5),
        vacuum_pa: value(7e4),
        ..SensorFrame::default()
    };
    let command = ActuatorCommand { seq, ..ActuatorCommand::default() };
    let trace = Trace { phase, dives: dives as u16, table_id: u32::MAX, ..Trace::default() };
    (Some(utc), frame, Answer { command, trace })
}

/// A mission of dives of so many cycles.
fn dives_of(cycles: u32) -> impl Fn(u32) -> Logged {
    move |seq| {
        let mut share = f64::from(seq % cycles) / f64::from(cycles);
        let of = |(phase, part): &(Phase, f64)| {
            share -= part;
            (share < 0.0).then_some(*phase)
        };
        cycle(seq, DIVE.iter().find_map(of).unwrap_or(Phase::Comms), seq / cycles)
    }
}

/// Flies a mission on a part full of older flights; its records.
fn flown(mission: impl Fn(u32) -> Logged) -> (Vec<Logged>, Vec<Logged>) {
    let mut vault = Vault::new();
    vault.attach(Part(vec![0xff; PART as usize]));
    // Older flights, more than the part holds: dated 1,000 days before.
    for flight in 0..12 {
        vault.begin_log();
        for seq in 0..9_000 {
            let (utc, frame, answer) = dives_of(500)(flight * 9_000 + seq);
            vault.log(utc.map(|utc| Utc { ms: utc.ms - 86_400_000_000, ..utc }), &frame, &answer);
        }
    }
    vault.begin_log();
    let mut events = Vec::new();
    let mut last = None;
    for seq in 0..CYCLES {
        let logged = mission(seq);
        let now = (logged.2.trace.phase, logged.2.trace.abort, logged.2.trace.flags);
        if last.replace(now) != Some(now) {
            events.push(logged);
        }
        vault.log(logged.0, &logged.1, &logged.2);
    }
    assert!(!vault.log_lost());
    let part = vault.part().unwrap();
    let ring = Ring::mount(part, (2 * OBJECTS * SECTOR) as u32).unwrap();
    let mut kept: Vec<Logged> = Vec::new();
    ring.read(part, |kind, data| {
        if kind == CYCLE {
            kept.push(postcard::from_bytes(data).unwrap());
        }
    })
    .unwrap();
    kept.retain(|(utc, ..)| utc.is_some_and(|utc| utc.ms >= 1_790_000_000_000));
    (kept, events)
}

fn seqs(kept: &[Logged]) -> Vec<u32> {
    kept.iter().map(|c| c.1.seq).collect()
}

/// The longest record: every reading and every varint at its largest.
#[test]
fn the_longest_record_fits_an_entry() {
    let r = Reading::Sampled { value: f32::MIN, age_ms: u32::MAX };
    let (utc, frame, answer) = cycle(u32::MAX, Phase::Safe, u32::from(u16::MAX));
    let frame = SensorFrame {
        time: Micros(u64::MAX),
        depth_m: r,
        depth2_m: r,
        pitch_rad: r,
        roll_rad: r,
        heading_rad: r,
        ballast_m3: r,
        battery_mass_m: r,
        fin_rad: r,
        density_kg_m3: r,
        temperature_degc: r,
        altitude_m: r,
        battery_v: r,
        charge: r,
        vacuum_pa: r,
        ..frame
    };
    let utc = utc.map(|utc| Utc { ms: u64::MAX, within_ms: u32::MAX, ..utc });
    let trace = Trace { abort: Some(Abort::Bottom), flags: Flags(u32::MAX), ..answer.trace };
    let record: Logged = (utc, frame, Answer { trace, ..answer });
    let bytes = postcard::to_slice(&record, &mut [0; 2 * MAX_ENTRY]).expect("encoded").len();
    println!("{bytes} bytes of {MAX_ENTRY}");
    assert!(bytes <= MAX_ENTRY, "{bytes}");
}

#[test]
fn sixty_days_of_four_second_cycles_fit_and_no_event_is_missing() {
    println!("{} KiB a lap, {} KiB at once, {:.2} bytes a cycle", ROOM / 1024, BURST / 1024, (ROOM - BURST) as f64 / f64::from(CYCLES));
    // 3-27 m, 0-200 m and 0-1000 m.
    for (length, most_gap, least_whole) in [(135, SELDOM, 0.01), (1_000, SELDOM, 0.25), (5_000, EVERY, 1.0)] {
        let (kept, events) = flown(dives_of(length));
        let seq = seqs(&kept);
        let gap = seq.windows(2).map(|w| w[1] - w[0]).max().unwrap();
        // Turns with every cycle around them.
        let whole = |turn: u32| (turn.saturating_sub(BEFORE as u32)..=turn + u32::from(AFTER)).all(|s| seq.binary_search(&s).is_ok());
        let turns: Vec<u32> = events.iter().map(|e| e.1.seq).filter(|s| *s + 100 < CYCLES && *s > 100_000).collect();
        let share = turns.iter().filter(|t| whole(**t)).count() as f64 / turns.len() as f64;
        let first_hole = seq.iter().zip(0u32..).find(|(s, i)| *s != i).map_or(CYCLES, |(_, i)| i);
        println!(
            "dives of {length} cycles: {} records, {:.0} % of turns whole, all of the first {:.1} h",
            kept.len(),
            100.0 * share,
            f64::from(first_hole) / 900.0
        );
        assert_eq!(seq[0], 0, "the beginning is there");
        assert!(seq.windows(2).all(|w| w[0] < w[1]) && gap <= u32::from(most_gap), "gap of {gap}");
        for event in &events {
            assert!(seq.binary_search(&event.1.seq).is_ok(), "event at {}", event.1.seq);
        }
        assert!(first_hole > 4_500, "{first_hole}");
        assert!(share >= least_whole, "{share}");
    }
}

#[test]
fn a_mission_that_does_its_worst_does_not_overwrite_its_beginning() {
    let steady = dives_of(1_000);
    let flapping = |seq: u32| {
        let mut logged = steady(seq);
        logged.2.trace.flags = Flags(if seq.is_multiple_of(2) { 1 } else { 2 });
        logged.2.trace.phase = if seq.is_multiple_of(3) { Phase::Dive } else { Phase::InflectHigh };
        logged
    };
    let (kept, _) = flown(flapping);
    let seq = seqs(&kept);
    assert_eq!(seq[0], 0);
    assert!(CYCLES - seq[seq.len() - 1] < 100, "and its end is there");
    // An abort is seen with all around it after a month.
    let month = CYCLES / 2 + 7;
    let aborted = |seq: u32| {
        let mut logged = dives_of(135)(seq);
        logged.2.trace.abort = (seq >= month).then_some(Abort::Leak);
        logged
    };
    let seq = seqs(&flown(aborted).0);
    assert!(
        (month - BEFORE as u32..=month + u32::from(AFTER)).filter(|s| seq.binary_search(s).is_err()).count() <= BEFORE,
        "around {month}"
    );
    assert!((month..=month + u32::from(AFTER)).all(|s| seq.binary_search(&s).is_ok()));
}

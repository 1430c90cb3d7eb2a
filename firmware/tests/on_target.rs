//! Tests that run on the target: in QEMU, or on a board with a probe.
//!
//! `scripts/check-firmware` runs them with `-icount shift=0`, where TIM2 counts
//! exactly one per instruction: figures below are instructions, not cycles,
//! and the same in every run. On a board the same counter counts cycles.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    println!("skipped: on-target tests need the target (scripts/check-firmware runs them in QEMU)");
}

/// The flown one.
#[cfg(target_os = "none")]
#[path = "../src/board/fault.rs"]
mod fault;

/// What the boot loader looks for, and the boot loader.
#[cfg(target_os = "none")]
#[path = "../src/facts.rs"]
mod facts;
#[cfg(target_os = "none")]
#[path = "../src/version.rs"]
mod version;

#[cfg(target_os = "none")]
mod target {
    use control::{Config, State};
    use core::cell::Cell;
    use cortex_m_rt::entry;
    use critical_section::Mutex;
    use helm::black_box::{BlackBox, WORDS};
    use helm::{Boot, Helm, RamStorage, Storage};
    use semihosting::{println, process};
    use signals::link::MAX_WIRE;
    use signals::{Micros, Mission, Object, Phase, Reading, Receiver, Reply, Request, SensorFrame, Switch, ToBoard, ToHost, Wings, encode};
    use stm32f4::stm32f405::{Peripherals, TIM2};

    /// Instructions that no whole cycle may exceed: decode, seal, table, law, encode. 1 % of 4 s at 16 MHz are 640,000.
    const CYCLE_WORST: u32 = 40_000;

    /// The same of the cycle after a turn, in which the rows of the leg before are summed up besides.
    const CYCLE_OF_A_SUM: u32 = 72_000;

    /// Instructions that the record of a cycle may take.
    const CYCLE_RECORD: u32 = 2_000;

    static FAILED: Mutex<Cell<bool>> = Mutex::new(Cell::new(false));

    fn claim(what: &str, holds: bool) {
        println!("{} {what}", if holds { "ok  " } else { "FAIL" });
        if !holds {
            critical_section::with(|cs| FAILED.borrow(cs).set(true));
        }
    }

    fn counted<T>(timer: &TIM2, f: impl FnOnce() -> T) -> (u32, T) {
        let start = timer.cnt().read().bits();
        let value = f();
        (timer.cnt().read().bits().wrapping_sub(start), value)
    }

    /// Steps of a flight.
    const STEPS: u32 = 900;

    /// What a flight took, and where it went.
    #[derive(Default)]
    struct Flown {
        most: u32,
        sum: u32,
        phases: u32,
        deepest_m: f32,
    }

    /// A glider that does what it is told: enough for every phase to be met. It has every sensor, so that no step is cheap
    /// for want of one.
    struct Toy {
        depth_m: f32,
        pitch_rad: f32,
        ballast_m3: f32,
        battery_m: f32,
    }

    impl Toy {
        const START: Self = Self { depth_m: 0.1, pitch_rad: 0.0, ballast_m3: 230e-6, battery_m: 0.0 };

        fn frame(&self, seq: u32) -> SensorFrame {
            SensorFrame {
                seq,
                // Both 32-bit wraps, of µs and of ms, have passed long ago.
                time: Micros::from_secs(5_000_000 + 4 * u64::from(seq)),
                depth_m: Reading::now(self.depth_m),
                depth2_m: Reading::now(self.depth_m + 0.1),
                pitch_rad: Reading::now(self.pitch_rad),
                roll_rad: Reading::now(0.01),
                heading_rad: Reading::now(0.2),
                ballast_m3: Reading::now(self.ballast_m3),
                battery_mass_m: Reading::now(self.battery_m),
                fin_rad: Reading::now(0.0),
                density_kg_m3: Reading::now(1025.0),
                temperature_degc: Reading::now(12.0),
                altitude_m: Reading::now((80.0 - self.depth_m).max(1.0)),
                battery_v: Reading::now(14.5),
                charge: Reading::now(0.9),
                vacuum_pa: Reading::now(70_000.0),
                leak: Switch::Clear,
                ..SensorFrame::default()
            }
        }

        /// Four seconds later: slew-limited actuators, pitch by the trim law, 0.2 m/s at full ballast.
        fn obey(&mut self, command: &signals::ActuatorCommand) {
            let go = |at: f32, to: f32, most: f32| at + (to - at).max(-most).min(most);
            self.ballast_m3 = go(self.ballast_m3, command.ballast_m3, 52e-6);
            self.battery_m = go(self.battery_m, command.battery_mass_m, 10e-3);
            self.pitch_rad = 1785.0 * self.ballast_m3 - 24.0 * self.battery_m;
            self.depth_m = (self.depth_m - 4.0 * 870.0 * self.ballast_m3).max(0.1);
        }
    }

    #[entry]
    fn main() -> ! {
        static mut RECORDER: BlackBox<[u32; WORDS]> = BlackBox::new([0; WORDS]);
        static mut HELM: Helm<RamStorage> = Helm::new(Config::for_depth(0.0), Boot::NEW, RamStorage::new());
        static mut DIVES: evidence::Dives = evidence::Dives::new();
        let Some(chip) = Peripherals::take() else { process::exit(2) };
        chip.RCC.apb1enr().modify(|_, w| w.tim2en().enabled());
        chip.TIM2.cr1().modify(|_, w| w.cen().enabled());
        let (empty, ()) = counted(&chip.TIM2, || ());

        let config = Config::default();
        let (parse, table) = counted(&chip.TIM2, || polar::builtin(Wings::Standard));
        let Ok(table) = table else { process::exit(3) };
        // Two legs with different goals: the search for a pitch then also runs in a turn.
        let mut mission = Mission::default();
        let leg = mission.legs.first().copied().unwrap_or_default();
        mission.legs.clear();
        let _ = mission.legs.push(signals::Leg { dives: 1, ..leg });
        let _ = mission.legs.push(signals::Leg { dives: 8, goal: signals::Goal::BestRange { hotel_w: 1.0 }, ..leg });
        let fly = |crying: bool| {
            let mut state = State::new(&config, mission.clone(), Micros(0));
            let mut toy = Toy::START;
            let mut f = Flown::default();
            for seq in 0..STEPS {
                let mut frame = toy.frame(seq);
                if crying && seq % 5 < 2 {
                    (frame.battery_v, frame.charge, frame.vacuum_pa) = (Reading::now(9.0), Reading::now(0.05), Reading::now(95_000.0));
                }
                let (count, answer) = counted(&chip.TIM2, || control::step(&config, Some(&table), &mut state, frame.time, &frame));
                f.most = f.most.max(count - empty);
                f.sum += count - empty;
                f.phases |= 1 << answer.trace.phase as u32;
                f.deepest_m = f.deepest_m.max(toy.depth_m);
                toy.obey(&answer.command);
            }
            f
        };
        let (quiet, crying) = (fly(false), fly(true));
        println!("     control step      at most {}, mean {} over {STEPS} steps", quiet.most, quiet.sum / STEPS);
        println!(
            "       gauges crying   at most {}, mean {}: voltage, charge and vacuum, two looks of five",
            crying.most,
            crying.sum / STEPS
        );
        let (look_up, c) = counted(&chip.TIM2, || table.at(core::hint::black_box(0.11)));
        println!("     table look-up     {} (c_l {})", look_up - empty, c.cl);
        println!("     table check       {} (CRC and values; once per mission)", parse - empty);

        let message = Request { session: u32::MAX, id: 1, message: ToBoard::Sensor(Toy::START.frame(1)) };
        let mut wire = [0; MAX_WIRE];
        let (encoding, n) = counted(&chip.TIM2, || encode(&message, &mut wire).unwrap_or(0));
        let mut receiver = Receiver::new();
        let (decoding, decoded) = counted(&chip.TIM2, || wire.iter().take(n).filter_map(|b| receiver.push::<Request>(*b)).last());
        println!("     frame             {n} bytes: encode {}, decode {}", encoding - empty, decoding - empty);

        RECORDER.open(0, [0; 3], 0);
        let (record, ()) = counted(&chip.TIM2, || RECORDER.cycle(&signals::Answer::default(), 4_000));
        let (sum, _) = counted(&chip.TIM2, || signals::link::CRC32.checksum(polar::generated::STANDARD));
        let per_byte = (sum - empty) / polar::generated::STANDARD.len() as u32;
        println!("     autopsy's record  {} of a cycle; identity of the image {per_byte} a byte, once at start", record - empty);
        claim("a cycle's record takes at most 2000 instructions", record - empty <= CYCLE_RECORD);

        let voyage =
            |f: &Flown| f.deepest_m > 20.0 && f.phases & (1 << Phase::Climb as u32) != 0 && f.phases & (1 << Phase::Safe as u32) == 0;
        claim("the toy glider dived and climbed, and two alarms of five ended nothing", voyage(&quiet) && voyage(&crying));
        claim("what is encoded is decoded", decoded == Some(Ok(message)));

        // Whole cycles: bytes in, seal, uploaded table, law, bytes out.
        claim("a table is stored", HELM.storage().save(Object::Table(Wings::Standard), polar::generated::STANDARD).is_ok());
        let hello = HELM.handle(ToBoard::Hello { nonce: 1 });
        let session = if let ToHost::Hello { session, .. } = hello { session } else { 0 };
        claim("a mission is taken", matches!(HELM.handle(ToBoard::Begin(mission.clone())), ToHost::Ready { .. }));
        let mut toy = Toy::START;
        let mut whole = Flown::default();
        let (mut longer, mut turns, mut phase) = (0, 0, Phase::Surface);
        for seq in 0..STEPS {
            let frame = Request { session, id: seq as u16, message: ToBoard::Sensor(toy.frame(seq)) };
            let n = encode(&frame, &mut wire).unwrap_or(0);
            let mut out = [0; MAX_WIRE];
            let (count, reply) = counted(&chip.TIM2, || {
                let reply = wire.iter().take(n).filter_map(|b| HELM.byte(*b)).last()?;
                encode(&reply, &mut out).ok()?;
                Some(reply)
            });
            whole.most = whole.most.max(count - empty);
            whole.sum += count - empty;
            longer += u32::from(count - empty > CYCLE_WORST);
            whole.deepest_m = whole.deepest_m.max(toy.depth_m);
            if let Some(Reply { message: ToHost::Answer(answer), .. }) = reply {
                whole.phases |= 1 << answer.trace.phase as u32;
                turns += u32::from(answer.trace.phase != phase);
                phase = answer.trace.phase;
                toy.obey(&answer.command);
            }
        }
        println!("     whole cycle       at most {}, mean {}: decode, seal, uploaded table, law, encode", whole.most, whole.sum / STEPS);
        claim("it was flown through the session as well", voyage(&whole));
        println!("       over 40000      {longer} of {STEPS} cycles, with {turns} changes of phase");
        claim("no cycle takes more than 40000 instructions, and 72000 once after a turn", whole.most <= CYCLE_OF_A_SUM && longer <= turns);
        let first = HELM.handle(ToBoard::Sensor(toy.frame(STEPS)));
        let again = HELM.handle(ToBoard::Sensor(toy.frame(STEPS)));
        claim("a repeated frame gets the same answer", matches!(first, ToHost::Answer(_)) && first == again);

        // What the glides say: dives to 200 m and back at 0.2 m/s, all rows steady.
        let vehicle = helm::glides::vehicle(&config);
        let mut says = Flown::default();
        for seq in 0..STEPS {
            let (leg, at) = (seq / 250, (seq % 250) as f32 * 0.8);
            let way = if leg % 2 == 0 { -1.0 } else { 1.0 };
            let cycle = evidence::Cycle {
                time_us: 4_000_000 * u64::from(seq),
                pressure_pa: 1e4 * if way < 0.0 { at } else { 200.0 - at },
                pitch_rad: 0.42 * way,
                roll_rad: 0.01,
                ballast_m3: 230e-6 * way,
                density_kg_m3: 1026.0,
                temperature_degc: 12.0,
            };
            let (count, ()) = counted(&chip.TIM2, || DIVES.take(&vehicle, &table, &cycle));
            says.most = says.most.max(count - empty);
            says.sum += count - empty;
        }
        let (made, packet) = counted(&chip.TIM2, || DIVES.packet(1).encode());
        println!("     glides            at most {}, mean {} a cycle; packet {}", says.most, says.sum / STEPS, made - empty);
        claim("the glides take at most 600 instructions a cycle in the mean", says.sum / STEPS <= 600);
        let known = evidence::History { vehicle_id: 1, usual_level: 1e-5, mean: [0.0; 8], spread: [[0.1; 8]; 8] };
        let summary = DIVES.packet(1);
        let (weighed, _) = counted(&chip.TIM2, || evidence::Detector::new().take(&known, &summary));
        println!("     detector          {} a packet", weighed - empty);
        claim("the detector takes at most 40000 instructions a packet", weighed - empty <= 40_000);
        claim("rows were steady, and their packet is bytes", DIVES.rows() > 50 && packet.is_some());

        // Last, since there is no way back: a stack without end is a fault before it reaches a static.
        let deep = dig(1);
        claim("a stack without end faults", deep == 0);
        process::exit(1)
    }

    /// Calls itself until the stack ends.
    #[inline(never)]
    fn dig(depth: u32) -> u32 {
        let room = core::hint::black_box([depth; 64]);
        if depth == u32::MAX { 0 } else { dig(depth + 1).wrapping_add(room[63]) }
    }

    /// Called by the handler of hard faults, on a fresh stack.
    #[unsafe(no_mangle)]
    extern "C" fn after_fault() -> ! {
        // Else it would have gone through the statics first.
        let fresh = 0u32;
        claim("a stack without end faults, and no static lies below it", (&raw const FAILED).addr() > (&raw const fresh).addr());
        let failed = critical_section::with(|cs| FAILED.borrow(cs).get());
        process::exit(i32::from(failed))
    }

    #[panic_handler]
    fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
        println!("FAIL {info}");
        process::exit(101)
    }
}

//! The loop: bytes in, one step, bytes out; feed the watchdog.

use crate::board::last_words::{self, Cause, LastWords};
use crate::board::line::Line;
use crate::board::spi::Spi;
use crate::board::watchdog::Watchdog;
use crate::board::{canary, clock, log, power_up, safe_outputs};
use crate::own::Own;
use crate::shelf::Shelf;
use crate::version::FIRMWARE;
use control::Config;
use cortex_m_rt::entry;
use heapless::spsc::Queue;
use helm::session::CYCLE_MS;
use helm::silence::PATIENCE_MS;
use helm::{Boot, Helm, Mark, Seat};
use signals::link::MAX_WIRE;
use signals::{Abort, Micros, Phase, Reply, ToHost, encode};
use stm32f4::stm32f405::Peripherals;

/// Time between two looks at the motors on own sensors, ms.
const LOOK_MS: u64 = 200;
/// Most bytes taken from the line before the loop looks at the clock again.
const BYTES_PER_PASS: usize = 256;
/// Longest time without a finished step while a mission waits for its host, ms: its patience and two cycles.
const HOST_MS: u64 = PATIENCE_MS + 2 * CYCLE_MS as u64;

#[entry]
fn main() -> ! {
    static mut QUEUE: Queue<u8, 1024> = Line::queue();
    // SAFETY: the only handle, in the only thread.
    static mut HELM: Helm<Shelf> = Helm::new(Config::for_depth(0.0), Boot::NEW, unsafe { Shelf::new() });

    canary::lay();
    let (Some(chip), Some(mut core)) = (Peripherals::take(), cortex_m::Peripherals::take()) else { last_words::reset(Cause::Unknown) };
    safe_outputs(&chip.RCC, &chip.GPIOC);
    let flags = last_words::reset_flags(&chip.RCC);
    let source = clock::start_crystal(&chip.RCC);
    power_up(&chip.RCC, &chip.GPIOA, &chip.GPIOB);
    let tick_hz = clock::start_tick(&mut core.SYST, &chip.TIM2, 0);
    log::open(&chip.USART2);
    let mut line = Line::open(chip.USART1, QUEUE);
    let helm = HELM;

    // Looking through the log's sectors takes a third of a second: before the watchdog.
    let mark = helm.storage().open(Spi::open(chip.SPI2));
    let mut watchdog = Watchdog::start(chip.IWDG);
    let noise = last_words::noise();
    let found = last_words::read();
    let mut words = found.unwrap_or(LastWords { mark: Mark::NONE, cause: Cause::Unknown, resets: 0, status: 0 });
    // Either record is enough: after a power cut the RAM knows nothing, a broken flash never.
    if let (false, Some(marked)) = (words.mark.in_mission(), mark) {
        words.mark = marked;
    }
    defmt::info!(
        "firmware {=u8}.{=u8}.{=u8} wire {=u8} clock {} tick {=u32} Hz, reset flags {=u8:#x}",
        FIRMWARE[0],
        FIRMWARE[1],
        FIRMWARE[2],
        signals::WIRE_VERSION,
        source,
        tick_hz,
        flags
    );
    match mark {
        Some(mark) => defmt::info!("log flash: mark {=u8}", mark.0),
        None => defmt::warn!("no log flash: uploads stay in RAM, no flight log"),
    }
    if found.is_some() {
        words.resets = words.resets.saturating_add(1);
        defmt::warn!(
            "reset number {=u32}, cause {}, fault status {=u32:#x}, mark {=u8}",
            words.resets,
            words.cause,
            words.status,
            words.mark.0
        );
    }
    (words.cause, words.status) = (Cause::Unknown, 0);
    last_words::write(words);
    helm.booted(Boot { mark: words.mark, boots: words.resets, firmware: FIRMWARE, salt: noise.wrapping_add(words.resets << 8) });

    let mut wire = [0; MAX_WIRE];
    let mut told = (Phase::default(), None);
    let mut attitude_port = Some(chip.USART3);
    let mut own: Option<Own> = None;
    let mut seat = Seat::Open;
    // When a frame was answered, when a step was finished, when the motors were looked at.
    let (mut frame_ms, mut stepped_ms, mut looked_ms) = (clock::now_ms(), clock::now_ms(), 0u64);
    loop {
        canary::check();
        helm.lost_bytes(line.take_lost());
        for _ in 0..BYTES_PER_PASS {
            let Some(byte) = line.next() else { break };
            let Some(reply) = helm.byte(byte) else { continue };
            // First write down that a mission is on, then answer: a reset in between is SAFE.
            remember(&mut words, helm.mark());
            helm.keep_mark();
            if let Ok(n) = encode(&reply, &mut wire) {
                line.send(wire.get(..n).unwrap_or_default());
            }
            tell(&reply, &mut told);
            if matches!(reply.message, ToHost::Answer(_)) {
                frame_ms = clock::now_ms();
                stepped_ms = frame_ms;
                watchdog.feed();
            }
            helm.keep_log();
        }
        let now_ms = clock::now_ms();
        if helm.seat() != seat {
            seat = helm.seat();
            match seat {
                Seat::Host => defmt::info!("seat: frames come from the host"),
                Seat::Sensors => defmt::info!("seat: own sensors"),
                Seat::Open => defmt::info!("seat: on deck"),
            }
            if seat == Seat::Sensors
                && let Some(port) = attitude_port.take()
            {
                let found = own.insert(Own::start(port));
                defmt::info!("own sensors: pressure transducer {=bool}", found.has_pressure());
            }
            if let Some(own) = &mut own {
                own.rest();
            }
            (looked_ms, stepped_ms) = (now_ms, now_ms);
        }
        if let (Some(own), Seat::Sensors) = (&mut own, seat) {
            own.listen(now_ms);
            let since = now_ms.saturating_sub(stepped_ms);
            if since >= u64::from(CYCLE_MS) {
                let frame = own.measure(now_ms, since as f32 * 1e-3);
                if let Some(answer) = helm.cycle(&frame) {
                    stepped_ms = now_ms;
                    remember(&mut words, helm.mark());
                    helm.keep_mark();
                    own.command(answer.command);
                    tell(&Reply { to: 0, message: ToHost::Answer(answer) }, &mut told);
                    watchdog.feed();
                    helm.keep_log();
                }
            }
            let since = now_ms.saturating_sub(looked_ms);
            if since >= LOOK_MS && own.has_command() {
                looked_ms = now_ms;
                own.act(since as f32 * 1e-3);
            }
        }
        if let Some(answer) = helm.silent(Micros::from_millis(now_ms.saturating_sub(frame_ms))) {
            stepped_ms = now_ms;
            remember(&mut words, helm.mark());
            tell(&Reply { to: 0, message: ToHost::Answer(answer) }, &mut told);
        }
        // In a mission a finished step feeds the watchdog, and nothing else; but a host may take its time.
        let waits = seat == Seat::Host && now_ms.saturating_sub(stepped_ms) < HOST_MS;
        if waits || !words.mark.in_mission() {
            watchdog.feed();
        }
        if line.is_idle() {
            cortex_m::asm::wfi();
        }
    }
}

/// Keeps the record of the mission in step; written anew each time, so that a bit that flipped in it does not stay.
fn remember(words: &mut LastWords, mark: Mark) {
    words.mark = mark;
    last_words::write(*words);
}

/// Logs what changed.
fn tell(reply: &Reply, told: &mut (Phase, Option<Abort>)) {
    match &reply.message {
        ToHost::Answer(a) => {
            let now = (a.trace.phase, a.trace.abort);
            if now != *told {
                defmt::info!(
                    "frame {=u32}: phase {=u8} abort {=u8} dives {=u16} depth {=f32} m flags {=u32:#x}",
                    a.command.seq,
                    now.0 as u8,
                    now.1.map_or(255, |abort| abort as u8),
                    a.trace.dives,
                    a.trace.depth_m,
                    a.trace.flags.0
                );
                *told = now;
            }
        }
        ToHost::Hello { nonce, manifest, .. } => defmt::info!("hello {=u32:#x}, mission under way {=bool}", *nonce, manifest.under_way),
        ToHost::Ready { table_id, config, mission } => {
            defmt::info!("mission taken, table {=u32:08x}, configuration {=u32:08x}, mission {=u32:08x}", *table_id, *config, *mission);
        }
        ToHost::Done { crc } => defmt::info!("done {=u32:08x}", *crc),
        ToHost::Volatile { crc } => defmt::warn!("done {=u32:08x}, in RAM only: lost at the next reset", *crc),
        ToHost::Refused(_) => defmt::warn!("refused"),
        ToHost::Continue { .. } | ToHost::Content { .. } | ToHost::Counters(_) => {}
    }
}

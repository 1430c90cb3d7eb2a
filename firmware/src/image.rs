//! The loop: bytes in, one step, bytes out; feed the watchdog.

use crate::board::last_words::{self, Cause, LastWords};
use crate::board::line::Line;
use crate::board::spi::Spi;
use crate::board::watchdog::Watchdog;
use crate::board::{canary, clock, log, power_up};
use crate::own::Own;
use crate::shelf::Shelf;
use crate::version::FIRMWARE;
use control::Config;
use cortex_m_rt::entry;
use heapless::spsc::Queue;
use helm::session::CYCLE_MS;
use helm::{Boot, Helm, Mark, Seat};
use signals::link::MAX_WIRE;
use signals::{Abort, Micros, Phase, ToHost, encode};
use stm32f4::stm32f405::Peripherals;

/// How long after boot a hello may still choose the HIL seat, ms.
const HELLO_WINDOW_MS: u64 = 10_000;
/// Time between two looks at the motors on own sensors, ms.
const LOOK_MS: u64 = 200;
/// Most bytes taken from the line before the loop looks at the clock again.
const BYTES_PER_PASS: usize = 256;

#[entry]
fn main() -> ! {
    static mut QUEUE: Queue<u8, 1024> = Line::queue();
    // SAFETY: the only handle, in the only thread.
    static mut HELM: Helm<Shelf> = Helm::new(Config::for_depth(0.0), Boot::NEW, unsafe { Shelf::new() });

    canary::lay();
    let (Some(chip), Some(mut core)) = (Peripherals::take(), cortex_m::Peripherals::take()) else { last_words::reset(Cause::Unknown) };
    let source = clock::start_crystal(&chip.RCC);
    power_up(&chip.RCC, &chip.GPIOA, &chip.GPIOB);
    let tick_hz = clock::start_tick(&mut core.SYST, &chip.TIM2, 0);
    log::open(&chip.USART2);
    let mut line = Line::open(chip.USART1, QUEUE);
    let helm = HELM;

    // Looking through the log's sectors takes a third of a second: before the watchdog.
    let mark = helm.storage().open(Spi::open(chip.SPI2));
    let mut watchdog = Watchdog::start(chip.IWDG);
    let found = last_words::read();
    let mut words = found.unwrap_or(LastWords { mark: Mark::NONE, cause: Cause::Unknown, resets: 0 });
    // Either record is enough: after a power cut the RAM knows nothing, a broken flash never.
    if let (false, Some(marked)) = (words.mark.in_mission(), mark) {
        words.mark = marked;
    }
    defmt::info!(
        "firmware {=u8}.{=u8}.{=u8} wire {=u8} clock {} tick {=u32} Hz",
        FIRMWARE[0],
        FIRMWARE[1],
        FIRMWARE[2],
        signals::WIRE_VERSION,
        source,
        tick_hz
    );
    match mark {
        Some(mark) => defmt::info!("log flash: mark {=u8}", mark.0),
        None => defmt::warn!("no log flash: uploads stay in RAM, no flight log"),
    }
    if found.is_some() {
        words.resets = words.resets.saturating_add(1);
        defmt::warn!("reset number {=u32}, cause {}, mark {=u8}", words.resets, words.cause, words.mark.0);
    }
    let seat = match (words.mark.in_mission(), words.mark.own_sensors()) {
        (false, _) => Seat::Open,
        (true, false) => Seat::Host,
        (true, true) => Seat::Sensors,
    };
    let boot = Boot {
        reset_during_mission: words.mark.in_mission(),
        first_cause: words.mark.first_cause(),
        boots: words.resets,
        firmware: FIRMWARE,
        seat,
    };
    words.cause = Cause::Unknown;
    last_words::write(words);
    helm.booted(boot);

    let mut wire = [0; MAX_WIRE];
    let mut heard_ms = clock::now_ms();
    let mut told = (Phase::default(), None);
    let mut told_seat = Seat::Open;
    let mut attitude_port = Some(chip.USART3);
    let mut own: Option<Own> = None;
    let (mut looked_ms, mut stepped_ms) = (0u64, 0u64);
    loop {
        canary::check();
        helm.lost_bytes(line.take_lost());
        for _ in 0..BYTES_PER_PASS {
            let Some(byte) = line.next() else { break };
            let Some(answer) = helm.byte(byte) else { continue };
            heard_ms = clock::now_ms();
            // First write down that a mission is on, then answer: a reset in between is SAFE.
            remember(&mut words, helm.mark());
            helm.keep_mark();
            if let Ok(n) = encode(&answer, &mut wire) {
                line.send(wire.get(..n).unwrap_or_default());
            }
            tell(&answer, &mut told);
            watchdog.feed();
            helm.keep_log();
        }
        let now_ms = clock::now_ms();
        if now_ms >= HELLO_WINDOW_MS {
            helm.settle();
        }
        if helm.seat() != told_seat {
            told_seat = helm.seat();
            match told_seat {
                Seat::Host => defmt::info!("seat latched: frames come from the host"),
                Seat::Sensors => defmt::info!("seat latched: own sensors"),
                Seat::Open => {}
            }
        }
        if told_seat == Seat::Sensors
            && let Some(port) = attitude_port.take()
        {
            let found = own.insert(Own::start(port));
            defmt::info!("own sensors: pressure transducer {=bool}", found.has_pressure());
            (looked_ms, stepped_ms) = (now_ms, now_ms);
        }
        if let Some(own) = &mut own {
            own.listen(now_ms);
            let since = now_ms.saturating_sub(stepped_ms);
            if since >= u64::from(CYCLE_MS) {
                stepped_ms = now_ms;
                let frame = own.measure(now_ms, since as f32 * 1e-3);
                if let Some(answer) = helm.cycle(&frame) {
                    remember(&mut words, helm.mark());
                    helm.keep_mark();
                    own.command(answer.command);
                    tell(&ToHost::Answer(answer), &mut told);
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
        if let Some(answer) = helm.silent(Micros::from_millis(now_ms.saturating_sub(heard_ms))) {
            remember(&mut words, helm.mark());
            tell(&ToHost::Answer(answer), &mut told);
        }
        // Reached only by a loop that really polls and steps.
        watchdog.feed();
        if line.is_idle() {
            cortex_m::asm::wfi();
        }
    }
}

/// Keeps the record of the mission in step.
fn remember(words: &mut LastWords, mark: Mark) {
    let next = LastWords { mark, ..*words };
    if next != *words {
        *words = next;
        last_words::write(next);
    }
}

/// Logs what changed.
fn tell(answer: &ToHost, told: &mut (Phase, Option<Abort>)) {
    match answer {
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
        ToHost::Hello { nonce, manifest } => defmt::info!("hello {=u32:#x}, hil {=bool}", *nonce, manifest.hil),
        ToHost::Ready { table_id } => defmt::info!("mission taken, table {=u32:08x}", *table_id),
        ToHost::Done { crc } => defmt::info!("done {=u32:08x}", *crc),
        ToHost::Volatile { crc } => defmt::warn!("done {=u32:08x}, in RAM only: lost at the next reset", *crc),
        ToHost::Refused(_) => defmt::warn!("refused"),
        ToHost::Continue { .. } | ToHost::Content { .. } | ToHost::Counters(_) => {}
    }
}

//! The image: chip and wiring around the loop of [`bay`].
//!
//! | pin | function |
//! |---|---|
//! | PB6, PB7 | I²C clock, data: pressure, ADC, battery gauge |
//! | PC0, PC1 | ballast pump, more and less displaced water |
//! | PC2, PC3 | battery mass, forward and aft |
//! | PC4, PC5 | drop weight, arm and fire |
//! | PC6 | locator beacon |
//! | PC7 | burn wire, high while it is whole |
//! | PC11 | modem: its supply |
//! | PC12, PD2 | modem: its port, UART5 |
//! | PC8 | strap, pulled up: to ground on a bench (hardware in the loop), open in deployment |
//! | PA4 to PA7, PB0 | supplies: compass, GPS receiver, ADC and its inputs, motor bridges, servo; high is on |
//! | PC9 | jumper, pulled down: to 3.3 V the board is a Slocum's backseat ([`crate::backseat_role`]) |

use crate::backseat_role;
use crate::board::last_words::{self, Cause, LastWords};
use crate::board::modem_supply::ModemSupply;
use crate::board::pins::{Drive, Pin, Port, Wait};
use crate::board::registers::Registers;
use crate::board::servo::Servo;
use crate::board::spi::Spi;
use crate::board::standstill::Standstill;
use crate::board::uart::{self, Bytes, Line, Received};
use crate::board::watchdog::Watchdog;
use crate::board::{black_box, canary, clock, log, power_up, safe_outputs};
use crate::chip::Chip;
use crate::shelf::Shelf;
use crate::version::FIRMWARE;
use bay::{Fitted, KeptUtc, Parts, Run, SupplyPins, Wiring};
use control::Config;
use cortex_m_rt::entry;
use devices::options;
use devices::soft_i2c::SoftI2c;
use devices::stop::Stops;
use helm::{Boot, Helm, Mark, Storage};
use signals::{Phase, Timebase};
use stm32f4::stm32f405::Peripherals;

/// Which type of this chip is what.
struct Soldered;

impl Fitted for Soldered {
    type Bus = SoftI2c<Pin, Pin, Wait>;
    type Delay = Wait;
    type Motor = Pin;
    type Out = Pin;
    type In = Pin;
    type Servo = Servo;
    type Compass = Received;
    type Gps = Received;
    type Modem = uart::Modem;
    type ModemPower = ModemSupply;
}

#[entry]
fn main() -> ! {
    static mut LINE: Bytes = uart::queue();
    static mut COMPASS: Bytes = uart::queue();
    static mut GPS: Bytes = uart::queue();
    static mut MODEM: Bytes = uart::queue();
    // SAFETY: the only handle, in the only thread.
    static mut HELM: Helm<Shelf> = Helm::new(Config::for_depth(0.0), Boot::NEW, unsafe { Shelf::new() });

    canary::lay();
    let (Some(chip), Some(mut core)) = (Peripherals::take(), cortex_m::Peripherals::take()) else { last_words::reset(Cause::None) };
    safe_outputs(&chip.RCC, &chip.GPIOC);
    let flags = last_words::reset_flags(&chip.RCC);
    // It runs already where the option bytes or an image on trial want it; what follows takes less than a second.
    let watchdog = Watchdog::start(chip.IWDG);
    // SAFETY: at work here alone, before anything else; then with the calendar clock, whose registers are nobody else's, and in a stop
    // with interrupts held off.
    let mut registers = unsafe { Registers::new() };
    let (base, crystal_hz) = clock::start_crystal(&chip.RCC, &mut registers);
    power_up(&chip.RCC, &mut registers);
    let tick_hz = clock::start_tick(&mut core.SYST, &chip.TIM2, 0);
    let id = black_box::image();
    let fault = black_box::open(flags, FIRMWARE, id);
    log::open(&chip.USART2);
    let line = Line::open(chip.USART1, LINE);
    let helm = HELM;

    // Looking through the log's sectors takes a third of a second.
    let mark = helm.storage().open(Spi::open(chip.SPI2), id);
    let noise = last_words::noise();
    let found = last_words::read();
    let mut words = found.unwrap_or(LastWords { mark: Mark::NONE, resets: 0, air: 0 });
    words.mark = Mark::after_reset(words.mark, mark);
    defmt::info!(
        "firmware {=u8}.{=u8}.{=u8} wire {=u8} crystal {=u32} Hz tick {=u32} Hz, reset flags {=u8:#x}",
        FIRMWARE[0],
        FIRMWARE[1],
        FIRMWARE[2],
        signals::WIRE_VERSION,
        crystal_hz,
        tick_hz,
        flags
    );
    match base {
        Timebase::WrongCrystal => defmt::error!("the crystal is not one of 16 MHz: on the internal oscillator"),
        Timebase::NoCrystal => defmt::warn!("no crystal: on the internal oscillator"),
        _ => {}
    }
    match mark {
        Some(mark) => defmt::info!("log flash: mark {=u8}", mark.0),
        None => defmt::warn!("no log flash: uploads stay in RAM, no flight log"),
    }
    if let Some(image) = helm.storage().image() {
        defmt::info!("image {=u32:08x}, on trial {=bool}", id, image.on_trial());
    }
    if found.is_some() {
        words.resets = words.resets.saturating_add(1);
        defmt::warn!("reset number {=u32}, mark {=u8}", words.resets, words.mark.0);
    }
    if let Some(note) = fault {
        defmt::warn!("kept of a fault: {=str}, PC {=u32:#x}; glider autopsy tells", note.cause.name(), note.registers.pc);
    }
    last_words::write(words);
    helm.booted(Boot { mark: words.mark, boots: words.resets, firmware: FIRMWARE, salt: noise.wrapping_add(words.resets << 8) });

    let strap = Pin::new(Port::C, 8, Drive::Strap);
    let air = f32::from_bits(words.air);
    helm.utc.runs_on(base);
    let option_bytes = options::read(&mut registers);
    helm.deck.options_are(option_bytes);
    let kept_utc = KeptUtc::open(registers, &mut helm.utc, clock::now_ms());
    match helm.utc.utc() {
        Some(utc) => defmt::info!("UTC {=u64} ms, within {=u32} ms", utc.ms, utc.within_ms),
        None => defmt::info!("UTC unknown"),
    }
    let still = Standstill::new(core.SYST, Stops::of(option_bytes));
    let mut hold = Chip { watchdog, words, strap, kept_utc, still, told: (Phase::default(), None) };
    if backseat_role::is_role(words.mark) {
        backseat_role::run(line, chip.USART3, COMPASS, helm, &mut hold);
    }

    let out = |bit| Pin::new(Port::C, bit, Drive::PushPull);
    let open = |bit| Pin::new(Port::B, bit, Drive::OpenDrain);
    let supply = |bit| Pin::new(Port::A, bit, Drive::PushPull);
    let wiring = Wiring::<Soldered> {
        bus: SoftI2c::new(open(6), open(7), Wait),
        delay: Wait,
        pump: (out(0), out(1)),
        mass: (out(2), out(3)),
        release: (out(4), out(5)),
        beacon: out(6),
        wire: Pin::new(Port::C, 7, Drive::Sense),
        bridge_fault: Pin::new(Port::C, 10, Drive::Strap),
        fin: Servo::start(chip.TIM4),
        compass: uart::compass(&chip.USART3, COMPASS),
        gps: uart::gps(&chip.UART4, GPS),
        supplies: SupplyPins {
            compass: supply(4),
            gps: supply(5),
            analog: supply(6),
            bridges: supply(7),
            servo: Pin::new(Port::B, 0, Drive::PushPull),
        },
        // SAFETY: the pins of the modem's lines are set up by this thread alone.
        modem: (uart::Modem::open(chip.UART5, MODEM), ModemSupply::new(unsafe { Registers::new() })),
    };
    let mut parts = Parts::new(wiring, helm.config());
    parts.remember_air(air);
    let mut run = Run::new(line, parts, &mut hold);
    loop {
        canary::check();
        let due_ms = run.pass(helm, &mut hold);
        run.rest(helm, &mut hold, due_ms);
    }
}

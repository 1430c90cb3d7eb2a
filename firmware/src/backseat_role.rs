//! The image as a Slocum's backseat: the glider's line on USART1, our own protocol on the compass' port.
//!
//! The role is read once, at boot, from a jumper between PC9 and 3.3 V. In flight nothing changes it: a mission that a reset
//! interrupted goes on in the role that it was begun in, whatever the pin says then.

use crate::board::canary;
use crate::board::pins::{Drive, Pin, Port, Wait};
use crate::board::uart::{self, Bytes, Line};
use crate::chip::Chip;
use crate::shelf::Shelf;
use backseat::{Generation, Limits, Pump, Session, Setup, sensors::List};
use bay::RunBackseat;
use bay::backseat_role::{BAUD, stored_setup};
use core::sync::atomic::{AtomicU32, Ordering};
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::InputPin;
use helm::{Helm, Mark};
use stm32f4::stm32f405::USART3;

/// Looks at the jumper, a millisecond apart, that must all agree.
const JUMPER_LOOKS: u32 = 5;

/// Bytes of the line dealt with, and passes made: what an emulator's front seat waits for between two moments of its own time.
/// Nothing here reads it: without `used` it would be left out.
#[used]
static PULSE: [AtomicU32; 2] = [AtomicU32::new(0), AtomicU32::new(0)];

/// Until the stored configuration is known.
const UNSET: Setup = Setup {
    list: List { generation: Generation::Newer, pump: Pump::Shallow, echo: true },
    rho_kg_m3: 0.0,
    limits: Limits { ballast_m3: 0.0, battery_m: 0.0, fin_rad: 0.0, battery_step_m: 0.0 },
};

/// Whether this run is one of a backseat.
pub fn is_role(mark: Mark) -> bool {
    bay::backseat_role::is_role(mark, jumper_is_fitted())
}

/// Whether PC9, pulled down, is held at 3.3 V. Open, broken, wet or doubtful: not fitted.
///
/// Stands alone: QEMU has no pins, and is given an image in which this function says yes.
#[inline(never)]
pub fn jumper_is_fitted() -> bool {
    let mut pin = Pin::new(Port::C, 9, Drive::Sense);
    (0..JUMPER_LOOKS).all(|_| {
        Wait.delay_ms(1);
        pin.is_high() == Ok(true)
    })
}

/// Flies the glider whose backseat the board is. No pin of an actuator is touched: they stay low.
pub fn run(line: Line, service: USART3, bytes: &'static mut Bytes, helm: &mut Helm<Shelf>, chip: &mut Chip) -> ! {
    static mut SESSION: Session = Session::new(UNSET);
    // SAFETY: called once, by the only thread; no other reference exists.
    let session = unsafe { &mut *(&raw mut SESSION) };
    session.set_up(stored_setup(helm));
    let mut run = RunBackseat::new(line.at(BAUD), uart::service(service, bytes), chip);
    defmt::info!("role: a Slocum's backseat");
    let (mut state, mut passes) = (session.state(), 0u32);
    loop {
        canary::check();
        run.pass(session, helm, chip);
        if session.state() != state {
            state = session.state();
            defmt::info!("line: state {=u8}", state as u8);
        }
        passes = passes.wrapping_add(1);
        let [heard, passed] = &PULSE;
        heard.store(run.heard, Ordering::Relaxed);
        passed.store(passes, Ordering::Release);
        if run.line.is_idle() && run.service.is_idle() {
            cortex_m::asm::wfi();
        }
    }
}

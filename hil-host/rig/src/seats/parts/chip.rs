//! What the image's chip does for the loop, on the models of the chip's own blocks: time, rest, watchdog, memory over a reset.

use super::OwnFlash;
use bay::run::Outside;
use bay::{KeptUtc, Woken};
use devices::options;
use devices::registers::Registers;
use devices::stop::Stops;
use helm::{Mark, UtcClock};
use parts::Clock;
use signals::{Answer, Strap, Timebase, ToHost};
use std::cell::RefCell;
use std::rc::Rc;

/// Longest time the loop sleeps while bytes may come, ns: as on the chip, whose interrupts wake it.
const NAP_NS: u64 = 20_000_000;

/// The chip's registers.
pub(super) struct Block(pub(super) Rc<RefCell<parts::rtc::Rtc>>);

impl Registers for Block {
    fn read(&mut self, address: u32) -> u32 {
        self.0.borrow_mut().read(address)
    }
    fn write(&mut self, address: u32, value: u32) {
        self.0.borrow_mut().write(address, value);
    }
}

/// The flash interface's.
pub(super) struct FlashBlock(pub(super) Rc<RefCell<parts::options::Options>>);

impl Registers for FlashBlock {
    fn read(&mut self, address: u32) -> u32 {
        self.0.borrow_mut().read(address)
    }
    fn write(&mut self, address: u32, value: u32) {
        self.0.borrow_mut().write(address, value);
    }
}

/// What the chip keeps for the loop.
pub(super) struct Chip {
    pub(super) clock: Clock,
    /// Milliseconds since the bench was switched on, as the chip counted them up to a moment, ns.
    pub(super) counted: (u64, u64),
    pub(super) stops: Stops,
    /// The last rest was a stop.
    pub(super) stopped: bool,
    pub(super) fed_ns: u64,
    /// RAM that a reset does not clear.
    pub(super) ram: Option<(Mark, f32)>,
    pub(super) answer: Option<Answer>,
    pub(super) strap: Strap,
    pub(super) kept_utc: Option<KeptUtc<Block>>,
    pub(super) flash: OwnFlash,
    pub(super) wants_restart: bool,
    pub(super) options: FlashBlock,
}

impl Outside for Chip {
    fn now_ms(&mut self) -> u64 {
        let (ms, at_ns) = self.counted;
        ms + (self.clock.now_ns() - at_ns) / 1_000_000
    }
    fn feed(&mut self) {
        self.fed_ns = self.clock.now_ns();
    }
    fn remember(&mut self, mark: Mark, air_pa: f32) {
        self.ram = Some((mark, air_pa));
    }
    fn keep_time(&mut self, clock: &UtcClock) {
        let now_ms = self.now_ms();
        self.kept_utc.iter_mut().for_each(|kept| kept.keep(clock, now_ms));
    }
    fn lost_bytes(&mut self) -> u32 {
        0
    }
    fn strap(&mut self) -> Strap {
        self.strap
    }
    fn restart(&mut self) {
        self.wants_restart = true;
    }
    fn said(&mut self, message: &ToHost) {
        if let ToHost::Answer(answer) = message {
            self.answer = Some(*answer);
        }
    }
    fn set_options(&mut self) -> Option<u32> {
        options::set(&mut self.options)
    }
    fn sleep(&mut self, until_ms: u64) {
        // A millisecond at least: the tick that wakes it.
        let (now_ns, wait_ms) = (self.clock.now_ns(), until_ms.saturating_sub(self.now_ms()));
        self.clock.until_ns((now_ns + wait_ms * 1_000_000).clamp(now_ns + 1_000_000, now_ns + NAP_NS));
        self.stopped = false;
    }
    fn stop(&mut self, until_ms: u64) -> Option<Woken> {
        let now_ms = self.now_ms();
        let halt = |block: &mut Block| block.0.borrow_mut().halt();
        let woken = self.stops.stop(&mut self.kept_utc.as_mut()?.rtc, now_ms, until_ms.saturating_sub(now_ms), halt)?;
        self.counted = (woken.now_ms, self.clock.now_ns());
        self.stopped = true;
        Some(Woken { by_line: woken.by_line, base: woken.crystal_lost.then_some(Timebase::NoCrystal), ppm: Stops::ppm() })
    }
}

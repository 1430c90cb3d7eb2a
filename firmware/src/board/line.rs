//! Bytes of the line: USART1, 115200 8N1. Received by interrupt into a
//! bounded queue, sent with a bounded wait.

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::peripheral::NVIC;
use critical_section::Mutex;
use heapless::spsc::{Consumer, Producer, Queue};
use stm32f4::stm32f405::{Interrupt, USART1, interrupt};

/// Rate of the line, bit/s.
pub const BAUD: u32 = 115_200;
/// Bytes that may wait: two of the longest frames and a half.
const QUEUE: usize = 1024;
/// Longest wait for room in the transmitter, loops: 10 characters at 16 MHz.
const SEND_WAIT: u32 = 4_000;

static HANDOVER: Mutex<Cell<Option<Producer<'static, u8>>>> = Mutex::new(Cell::new(None));
static LOST: AtomicU32 = AtomicU32::new(0);

/// The line, open.
pub struct Line {
    port: USART1,
    received: Consumer<'static, u8>,
}

impl Line {
    /// Opens the port; from here on bytes arrive by interrupt.
    pub fn open(port: USART1, queue: &'static mut Queue<u8, QUEUE>) -> Self {
        let (producer, received) = queue.split();
        critical_section::with(|cs| HANDOVER.borrow(cs).set(Some(producer)));
        port.brr().write(|w| w.div_mantissa().set((divisor(BAUD) >> 4) as u16).div_fraction().set((divisor(BAUD) & 0xf) as u8));
        port.cr1().write(|w| w.ue().enabled().te().enabled().re().enabled().rxneie().enabled());
        // SAFETY: the handler owns what it touches from the hand-over above on.
        unsafe { NVIC::unmask(Interrupt::USART1) };
        Self { port, received }
    }

    /// An empty queue for [`Line::open`].
    pub const fn queue() -> Queue<u8, QUEUE> {
        Queue::new()
    }

    /// The next byte received.
    pub fn next(&mut self) -> Option<u8> {
        self.received.dequeue()
    }

    /// Whether nothing waits.
    pub fn is_idle(&self) -> bool {
        !self.received.ready()
    }

    /// Sends all bytes; `false` if the transmitter got stuck.
    pub fn send(&mut self, bytes: &[u8]) -> bool {
        bytes.iter().all(|byte| {
            let room = (0..SEND_WAIT).any(|_| self.port.sr().read().txe().bit_is_set());
            if room {
                self.port.dr().write(|w| w.dr().set(u16::from(*byte)));
            }
            room
        })
    }

    /// Bytes lost since the last call: queue full or receiver overrun.
    pub fn take_lost(&mut self) -> u32 {
        critical_section::with(|_| {
            let lost = LOST.load(Ordering::Relaxed);
            LOST.store(0, Ordering::Relaxed);
            lost
        })
    }
}

/// Divider of the baud rate generator, sixteenths (RM0090 30.3.4), rounded.
pub const fn divisor(baud: u32) -> u32 {
    (super::clock::CORE_HZ + baud / 2) / baud
}

#[interrupt]
fn USART1() {
    static mut BYTES: Option<Producer<'static, u8>> = None;
    if BYTES.is_none() {
        *BYTES = critical_section::with(|cs| HANDOVER.borrow(cs).take());
    }
    // SAFETY: this handler alone reads SR and DR of USART1; `Line` only writes DR and reads TXE.
    let port = unsafe { &*USART1::ptr() };
    let status = port.sr().read();
    if status.rxne().bit_is_set() || status.ore().bit_is_set() {
        let byte = port.dr().read().dr().bits() as u8;
        let kept = BYTES.as_mut().is_some_and(|queue| queue.enqueue(byte).is_ok());
        if !kept || status.ore().bit_is_set() {
            LOST.store(LOST.load(Ordering::Relaxed).saturating_add(1), Ordering::Relaxed);
        }
    }
}

//! Ports whose bytes arrive by interrupt into a bounded queue: the line on
//! USART1 (115200 8N1, sent with a bounded wait), the compass on USART3
//! (19200 8N1) and the GPS receiver on UART4 (9600 8N1), listened to only,
//! and the modem on UART5 (19200 8N1), sent without a wait.
//! As a backseat the glider is on USART1 (9600 8N1), our own protocol on USART3 (115200 8N1).

use core::cell::Cell;
use core::convert::Infallible;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use cortex_m::peripheral::NVIC;
use critical_section::Mutex;
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use heapless::spsc::{Consumer, Producer, Queue};
use stm32f4::stm32f405::{Interrupt, UART4, UART5, USART1, USART2, USART3, interrupt, uart4, usart1};

/// Rate of the line, bit/s.
pub const BAUD: u32 = 115_200;
/// Rate of the compass, bit/s: the OS5000's default.
const COMPASS_BAUD: u32 = 19_200;
/// Rate of the GPS receiver, bit/s: that of NMEA 0183 receivers since long.
const GPS_BAUD: u32 = 9_600;
/// Bytes that may wait: two of the line's longest frames and a half; half a second of the compass, longer than any erase.
const QUEUE: usize = 1024;
/// Longest wait for room in the transmitter, loops: 10 characters at 16 MHz.
const SEND_WAIT: u32 = 4_000;

type Handover = Mutex<Cell<Option<Producer<'static, u8>>>>;

static LINE: Handover = Mutex::new(Cell::new(None));
static COMPASS: Handover = Mutex::new(Cell::new(None));
static GPS: Handover = Mutex::new(Cell::new(None));
static MODEM: Handover = Mutex::new(Cell::new(None));
static LOST: AtomicU32 = AtomicU32::new(0);
/// A byte of the line has come since it was last asked.
static HEARD: AtomicBool = AtomicBool::new(false);

/// Room for the bytes of one port.
pub type Bytes = Queue<u8, QUEUE>;

/// An empty queue for one port.
pub const fn queue() -> Bytes {
    Queue::new()
}

/// Bytes that have arrived.
pub struct Received(Consumer<'static, u8>);

impl Received {
    fn by(handover: &Handover, queue: &'static mut Bytes) -> Self {
        let (producer, received) = queue.split();
        critical_section::with(|cs| handover.borrow(cs).set(Some(producer)));
        Self(received)
    }
}

impl ErrorType for Received {
    type Error = Infallible;
}

impl Read for Received {
    /// What is there; never waits.
    fn read(&mut self, out: &mut [u8]) -> Result<usize, Infallible> {
        let mut n = 0usize;
        for (to, byte) in out.iter_mut().zip(core::iter::from_fn(|| self.0.dequeue())) {
            *to = byte;
            n = n.saturating_add(1);
        }
        Ok(n)
    }
}

impl ReadReady for Received {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.0.ready())
    }
}

/// The line, open.
pub struct Line {
    port: &'static usart1::RegisterBlock,
    received: Received,
}

impl Line {
    /// Opens the port; from here on bytes arrive by interrupt.
    pub fn open(_port: USART1, queue: &'static mut Bytes) -> Self {
        // SAFETY: the port was handed over for good; the handler reads SR and DR, this writes the rest.
        let port = unsafe { &*USART1::ptr() };
        let line = Self { port, received: Received::by(&LINE, queue) }.at(BAUD);
        // SAFETY: the handler owns what it touches from the hand-over above on.
        unsafe { NVIC::unmask(Interrupt::USART1) };
        line
    }

    /// The same line at another rate, bit/s.
    pub fn at(self, baud: u32) -> Self {
        let divisor = divisor(baud);
        // The rate may be changed while the port is off.
        self.port.cr1().write(|w| w.ue().disabled());
        self.port.brr().write(|w| w.div_mantissa().set((divisor >> 4) as u16).div_fraction().set((divisor & 0xf) as u8));
        self.port.cr1().write(|w| w.ue().enabled().te().enabled().re().enabled().rxneie().enabled());
        self
    }

    /// Whether nothing waits.
    pub fn is_idle(&self) -> bool {
        !self.received.0.ready()
    }
}

impl ErrorType for Line {
    type Error = Infallible;
}

impl Read for Line {
    fn read(&mut self, out: &mut [u8]) -> Result<usize, Infallible> {
        self.received.read(out)
    }
}

impl ReadReady for Line {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        self.received.read_ready()
    }
}

impl Write for Line {
    /// Sends all bytes; fewer if the transmitter got stuck.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let mut sent = 0usize;
        for byte in bytes {
            if !(0..SEND_WAIT).any(|_| self.port.sr().read().txe().bit_is_set()) {
                break;
            }
            self.port.dr().write(|w| w.dr().set(u16::from(*byte)));
            sent = sent.saturating_add(1);
        }
        Ok(sent)
    }
    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl WriteReady for Line {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.port.sr().read().txe().bit_is_set())
    }
}

/// Opens the compass' port both ways, for our own protocol.
pub fn service(_port: USART3, queue: &'static mut Bytes) -> Line {
    // SAFETY: as in `Line::open`.
    let port = unsafe { &*USART3::ptr() };
    let line = Line { port, received: Received::by(&COMPASS, queue) }.at(BAUD);
    // SAFETY: as in `Line::open`.
    unsafe { NVIC::unmask(Interrupt::USART3) };
    line
}

/// Opens the compass' port: its bytes.
pub fn compass(port: &USART3, queue: &'static mut Bytes) -> Received {
    let received = Received::by(&COMPASS, queue);
    let divisor = divisor(COMPASS_BAUD);
    port.brr().write(|w| w.div_mantissa().set((divisor >> 4) as u16).div_fraction().set((divisor & 0xf) as u8));
    port.cr1().write(|w| w.ue().enabled().re().enabled().rxneie().enabled());
    // SAFETY: as in `Line::open`.
    unsafe { NVIC::unmask(Interrupt::USART3) };
    received
}

/// Opens the GPS receiver's port: its bytes.
pub fn gps(port: &UART4, queue: &'static mut Bytes) -> Received {
    let received = Received::by(&GPS, queue);
    let divisor = divisor(GPS_BAUD);
    port.brr().write(|w| w.div_mantissa().set((divisor >> 4) as u16).div_fraction().set((divisor & 0xf) as u8));
    port.cr1().write(|w| w.ue().enabled().re().enabled().rxneie().enabled());
    // SAFETY: as in `Line::open`.
    unsafe { NVIC::unmask(Interrupt::UART4) };
    received
}

/// The modem's port, both ways.
pub struct Modem {
    port: &'static uart4::RegisterBlock,
    received: Received,
}

impl Modem {
    /// Opens the port.
    pub fn open(_port: UART5, queue: &'static mut Bytes) -> Self {
        // SAFETY: as in `Line::open`.
        let port = unsafe { &*UART5::ptr() };
        let received = Received::by(&MODEM, queue);
        let divisor = divisor(devices::sbd::BAUD);
        port.brr().write(|w| w.div_mantissa().set((divisor >> 4) as u16).div_fraction().set((divisor & 0xf) as u8));
        port.cr1().write(|w| w.ue().enabled().te().enabled().re().enabled().rxneie().enabled());
        // SAFETY: as in `Line::open`.
        unsafe { NVIC::unmask(Interrupt::UART5) };
        Self { port, received }
    }
}

impl ErrorType for Modem {
    type Error = Infallible;
}

impl Read for Modem {
    fn read(&mut self, out: &mut [u8]) -> Result<usize, Infallible> {
        self.received.read(out)
    }
}

impl ReadReady for Modem {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        self.received.read_ready()
    }
}

impl Write for Modem {
    /// Takes one byte, if there is room for it: nothing is waited for.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let Some(byte) = bytes.first().filter(|_| self.port.sr().read().txe().bit_is_set()) else { return Ok(0) };
        self.port.dr().write(|w| w.dr().set(u16::from(*byte)));
        Ok(1)
    }
    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl WriteReady for Modem {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.port.sr().read().txe().bit_is_set())
    }
}

/// Bytes of the line lost since the last call: queue full or receiver overrun.
pub fn take_lost() -> u32 {
    critical_section::with(|_| {
        let lost = LOST.load(Ordering::Relaxed);
        LOST.store(0, Ordering::Relaxed);
        lost
    })
}

/// Whether the line has spoken since the last call.
pub fn take_heard() -> bool {
    critical_section::with(|_| {
        let heard = HEARD.load(Ordering::Relaxed);
        HEARD.store(false, Ordering::Relaxed);
        heard
    })
}

/// Waits, bounded, until the last byte has left line and log: a port that stands still sends half of it.
pub fn let_out() {
    for port in [USART1::ptr(), USART2::ptr()] {
        // SAFETY: status is read only; reading it clears nothing as long as DR is not read after it.
        let port = unsafe { &*port };
        let _ = (0..SEND_WAIT).any(|_| port.sr().read().tc().bit_is_set());
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
        *BYTES = critical_section::with(|cs| LINE.borrow(cs).take());
    }
    // SAFETY: this handler alone reads SR and DR of USART1; `Line` only writes DR and reads TXE.
    let port = unsafe { &*USART1::ptr() };
    let status = port.sr().read();
    if status.rxne().bit_is_set() || status.ore().bit_is_set() {
        let byte = port.dr().read().dr().bits() as u8;
        HEARD.store(true, Ordering::Relaxed);
        let kept = BYTES.as_mut().is_some_and(|queue| queue.enqueue(byte).is_ok());
        if !kept || status.ore().bit_is_set() {
            LOST.store(LOST.load(Ordering::Relaxed).saturating_add(1), Ordering::Relaxed);
        }
    }
}

#[interrupt]
fn USART3() {
    static mut BYTES: Option<Producer<'static, u8>> = None;
    if BYTES.is_none() {
        *BYTES = critical_section::with(|cs| COMPASS.borrow(cs).take());
    }
    // SAFETY: this handler alone reads SR and DR of USART3; a `Line` on it only writes DR and reads TXE.
    let port = unsafe { &*USART3::ptr() };
    let status = port.sr().read();
    if status.rxne().bit_is_set() || status.ore().bit_is_set() {
        let byte = port.dr().read().dr().bits() as u8;
        // Without room a sentence is torn; its checksum says so.
        let _ = BYTES.as_mut().map(|queue| queue.enqueue(byte));
    }
}

#[interrupt]
fn UART4() {
    static mut BYTES: Option<Producer<'static, u8>> = None;
    if BYTES.is_none() {
        *BYTES = critical_section::with(|cs| GPS.borrow(cs).take());
    }
    // SAFETY: as in the handler of USART3: nobody writes to it.
    let port = unsafe { &*UART4::ptr() };
    let status = port.sr().read();
    if status.rxne().bit_is_set() || status.ore().bit_is_set() {
        let byte = port.dr().read().dr().bits() as u8;
        let _ = BYTES.as_mut().map(|queue| queue.enqueue(byte));
    }
}

#[interrupt]
fn UART5() {
    static mut BYTES: Option<Producer<'static, u8>> = None;
    if BYTES.is_none() {
        *BYTES = critical_section::with(|cs| MODEM.borrow(cs).take());
    }
    // SAFETY: as in the handler of USART3: `Modem` only writes DR and reads TXE.
    let port = unsafe { &*UART5::ptr() };
    let status = port.sr().read();
    if status.rxne().bit_is_set() || status.ore().bit_is_set() {
        let byte = port.dr().read().dr().bits() as u8;
        let _ = BYTES.as_mut().map(|queue| queue.enqueue(byte));
    }
}

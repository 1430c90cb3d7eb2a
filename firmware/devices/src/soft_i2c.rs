//! An I²C bus on two open-drain pins, every wait bounded.
//!
//! UM10204 timing for 100 kHz. A part that stretches the clock longer than
//! 1 ms is an error; a data line held low (a part reset in the
//! middle of a byte) is clocked free with nine pulses (UM10204 3.1.16) before
//! every transaction, and reported if that does not help.

use crate::Error;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal::i2c::{self, ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};

/// Half a clock, µs: 100 kHz.
const HALF_US: u32 = 5;
/// Longest clock stretch, half clocks: 1 ms.
const STRETCH_LOOPS: u32 = 200;

/// The bus.
#[derive(Debug)]
pub struct SoftI2c<C, D, T> {
    clock: C,
    data: D,
    delay: T,
}

impl i2c::Error for Error {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Bus => ErrorKind::NoAcknowledge(NoAcknowledgeSource::Unknown),
            Self::Timeout => ErrorKind::Bus,
            _ => ErrorKind::Other,
        }
    }
}

impl<C, D, T> ErrorType for SoftI2c<C, D, T> {
    type Error = Error;
}

impl<C: OutputPin + InputPin, D: OutputPin + InputPin, T: DelayNs> SoftI2c<C, D, T> {
    /// A bus on these pins (open drain, pulled up).
    pub const fn new(clock: C, data: D, delay: T) -> Self {
        Self { clock, data, delay }
    }

    fn half(&mut self) {
        self.delay.delay_us(HALF_US);
    }

    fn data(&mut self, high: bool) -> Result<(), Error> {
        if high { self.data.set_high() } else { self.data.set_low() }.map_err(|_| Error::Bus)
    }

    fn clock_low(&mut self) -> Result<(), Error> {
        self.clock.set_low().map_err(|_| Error::Bus)?;
        self.half();
        Ok(())
    }

    /// Lets the clock rise and waits, bounded, for whoever stretches it.
    fn clock_high(&mut self) -> Result<(), Error> {
        self.clock.set_high().map_err(|_| Error::Bus)?;
        for _ in 0..STRETCH_LOOPS {
            self.half();
            if self.clock.is_high().map_err(|_| Error::Bus)? {
                return Ok(());
            }
        }
        Err(Error::Timeout)
    }

    fn start(&mut self) -> Result<(), Error> {
        self.data(true)?;
        self.clock_high()?;
        // A part cut off in the middle of a byte holds the line: clock it out.
        for _ in 0..9 {
            if self.data.is_high().map_err(|_| Error::Bus)? {
                break;
            }
            self.clock_low()?;
            self.clock_high()?;
        }
        if self.data.is_low().map_err(|_| Error::Bus)? {
            return Err(Error::Timeout);
        }
        self.data(false)?;
        self.half();
        self.clock_low()
    }

    fn stop(&mut self) -> Result<(), Error> {
        self.data(false)?;
        self.half();
        self.clock_high()?;
        self.data(true)?;
        self.half();
        Ok(())
    }

    fn bit_out(&mut self, high: bool) -> Result<(), Error> {
        self.data(high)?;
        self.clock_high()?;
        self.clock_low()
    }

    fn bit_in(&mut self) -> Result<bool, Error> {
        self.data(true)?;
        self.clock_high()?;
        let high = self.data.is_high().map_err(|_| Error::Bus)?;
        self.clock_low()?;
        Ok(high)
    }

    fn byte_out(&mut self, byte: u8) -> Result<(), Error> {
        for bit in (0..8).rev() {
            self.bit_out(byte >> bit & 1 == 1)?;
        }
        if self.bit_in()? { Err(Error::Bus) } else { Ok(()) }
    }

    fn byte_in(&mut self, more: bool) -> Result<u8, Error> {
        let mut byte = 0u8;
        for _ in 0..8 {
            byte = byte << 1 | u8::from(self.bit_in()?);
        }
        self.bit_out(!more)?;
        Ok(byte)
    }

    fn run(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), Error> {
        let mut last_reads = None;
        for operation in operations {
            let reads = matches!(operation, Operation::Read(_));
            if last_reads != Some(reads) {
                self.start()?;
                self.byte_out(address << 1 | u8::from(reads))?;
                last_reads = Some(reads);
            }
            match operation {
                Operation::Write(bytes) => bytes.iter().try_for_each(|b| self.byte_out(*b))?,
                Operation::Read(bytes) => {
                    let mut left = bytes.len();
                    for byte in bytes.iter_mut() {
                        left = left.saturating_sub(1);
                        *byte = self.byte_in(left > 0)?;
                    }
                }
            }
        }
        Ok(())
    }
}

impl<C: OutputPin + InputPin, D: OutputPin + InputPin, T: DelayNs> I2c for SoftI2c<C, D, T> {
    fn transaction(&mut self, address: u8, operations: &mut [Operation<'_>]) -> Result<(), Error> {
        let done = self.run(address, operations);
        // The bus is let go whatever happened; the first error counts.
        let stopped = self.stop();
        done.and(stopped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::convert::Infallible;
    use embedded_hal::digital;
    use embedded_hal_mock::eh1::delay::NoopDelay;
    use std::cell::RefCell;
    use std::rc::Rc;

    /// A part on the bus: 8-bit registers at one address, seen only through the two lines.
    #[derive(Default)]
    struct Part {
        address: u8,
        registers: [u8; 4],
        master: (bool, bool),
        pulls_data: bool,
        /// Holds the clock low for ever.
        holds_clock: bool,
        /// Holds the data line for this many clocks.
        jam: u32,
        was: (bool, bool),
        shift: u16,
        bits: u32,
        state: State,
        pointer: usize,
        edges: u64,
    }

    #[derive(Clone, Copy, Default, PartialEq)]
    enum State {
        #[default]
        Idle,
        Address,
        Pointer,
        Write,
        Read,
    }

    impl Part {
        fn lines(&self) -> (bool, bool) {
            (self.master.0 && !self.holds_clock, self.master.1 && !self.pulls_data && self.jam == 0)
        }

        fn settle(&mut self) {
            let (was, now) = (self.was, self.lines());
            self.was = now;
            self.edges += 1;
            assert!(self.edges < 1_000_000, "the driver does not give up");
            match (was, now) {
                ((true, true), (true, false)) => (self.state, self.bits, self.shift) = (State::Address, 0, 0),
                ((true, false), (true, true)) if self.state != State::Idle => (self.state, self.pulls_data) = (State::Idle, false),
                ((false, _), (true, data)) => {
                    self.jam = self.jam.saturating_sub(1);
                    self.shift = self.shift << 1 | u16::from(data);
                    self.bits += 1;
                }
                ((true, _), (false, _)) => self.fall(),
                _ => {}
            }
            self.was = self.lines();
        }

        fn fall(&mut self) {
            match (self.state, self.bits) {
                (State::Idle, _) => {}
                (State::Read, 9) if self.shift & 1 == 1 => (self.state, self.pulls_data) = (State::Idle, false),
                (State::Read, 8) => self.pulls_data = false,
                (State::Read, bits) => {
                    if bits == 9 {
                        (self.bits, self.pointer) = (0, self.pointer + 1);
                    }
                    self.pulls_data = self.registers[self.pointer % 4] >> (7 - self.bits) & 1 == 0;
                }
                (state, 8) => {
                    let byte = self.shift as u8;
                    self.pulls_data = true;
                    match state {
                        State::Address if byte >> 1 != self.address => (self.state, self.pulls_data) = (State::Idle, false),
                        State::Pointer => self.pointer = byte.into(),
                        State::Write => {
                            self.registers[self.pointer % 4] = byte;
                            self.pointer += 1;
                        }
                        _ => {}
                    }
                }
                (state, 9) => {
                    let read = state == State::Address && self.shift >> 1 & 1 == 1;
                    self.bits = 0;
                    self.pulls_data = read && self.registers[self.pointer % 4] >> 7 == 0;
                    self.state = match state {
                        State::Address if read => State::Read,
                        State::Address => State::Pointer,
                        _ => State::Write,
                    };
                }
                _ => {}
            }
        }
    }

    struct Pin(Rc<RefCell<Part>>, bool);

    impl digital::ErrorType for Pin {
        type Error = Infallible;
    }
    impl OutputPin for Pin {
        fn set_low(&mut self) -> Result<(), Infallible> {
            let mut part = self.0.borrow_mut();
            if self.1 {
                part.master.0 = false
            } else {
                part.master.1 = false
            }
            part.settle();
            Ok(())
        }
        fn set_high(&mut self) -> Result<(), Infallible> {
            let mut part = self.0.borrow_mut();
            if self.1 {
                part.master.0 = true
            } else {
                part.master.1 = true
            }
            part.settle();
            Ok(())
        }
    }
    impl InputPin for Pin {
        fn is_high(&mut self) -> Result<bool, Infallible> {
            let lines = self.0.borrow().lines();
            Ok(if self.1 { lines.0 } else { lines.1 })
        }
        fn is_low(&mut self) -> Result<bool, Infallible> {
            self.is_high().map(|high| !high)
        }
    }

    fn bus(part: Part) -> (Rc<RefCell<Part>>, SoftI2c<Pin, Pin, NoopDelay>) {
        let part = Rc::new(RefCell::new(Part { master: (true, true), was: (true, true), ..part }));
        let bus = SoftI2c::new(Pin(part.clone(), true), Pin(part.clone(), false), NoopDelay::new());
        (part, bus)
    }

    #[test]
    fn writes_and_reads_registers() {
        let (part, mut bus) = bus(Part { address: 0x48, ..Part::default() });
        bus.write(0x48, &[1, 0xa5, 0x3c]).unwrap();
        assert_eq!(part.borrow().registers, [0, 0xa5, 0x3c, 0]);
        let mut got = [0; 2];
        bus.write_read(0x48, &[1], &mut got).unwrap();
        assert_eq!(got, [0xa5, 0x3c]);
    }

    #[test]
    fn nobody_at_the_address_is_an_error() {
        let (_, mut bus) = bus(Part { address: 0x48, ..Part::default() });
        assert_eq!(bus.write(0x49, &[1]), Err(Error::Bus));
        assert_eq!(bus.write(0x48, &[1, 7]), Ok(()), "and the bus is free afterwards");
    }

    #[test]
    fn a_jammed_data_line_is_clocked_free() {
        let (_, mut bus) = bus(Part { address: 0x48, jam: 6, ..Part::default() });
        assert_eq!(bus.write(0x48, &[1, 7]), Ok(()));
    }

    #[test]
    fn a_line_stuck_for_ever_is_given_up_in_bounded_time() {
        let (part, mut bus1) = bus(Part { address: 0x48, jam: u32::MAX, ..Part::default() });
        assert_eq!(bus1.write(0x48, &[1]), Err(Error::Timeout));
        assert!(part.borrow().edges < 200);
        let (part, mut bus2) = bus(Part { address: 0x48, holds_clock: true, ..Part::default() });
        assert_eq!(bus2.write(0x48, &[1]), Err(Error::Timeout));
        assert!(part.borrow().edges < 200);
    }
}

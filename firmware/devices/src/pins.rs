//! Which pin of the chip serves which of its blocks, how fast its driver is, and what holds it while nobody drives it.
//!
//! | speed class | good for | DS8626 table 50, 2.7 V and more |
//! |---|---|---|
//! | [`Speed::Low`] | 4 MHz at 50 pF | the state after a reset |
//! | [`Speed::Medium`] | 25 MHz at 50 pF | |
//!
//! A line whose other end may be without supply is pulled down: pulled up it would feed that part through its protection, open it would
//! be noise. Registers by address, so that the table is tested on a laptop.

use crate::registers::Registers;

/// First of the ports' register blocks, and the distance between two.
const GPIOA: u32 = 0x4002_0000;
const NEXT: u32 = 0x400;
const MODER: u32 = 0x00;
const OSPEEDR: u32 = 0x08;
const PUPDR: u32 = 0x0c;
const AFRL: u32 = 0x20;

/// Class of a pin's driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Speed {
    /// 4 MHz at 50 pF.
    Low = 0,
    /// 25 MHz at 50 pF.
    Medium = 1,
}

impl Speed {
    /// Highest frequency that its edges are good for at 50 pF and 2.7 V, Hz (DS8626 table 50).
    #[must_use]
    pub const fn highest_hz(self) -> u32 {
        match self {
            Self::Low => 4_000_000,
            Self::Medium => 25_000_000,
        }
    }
}

/// What holds a pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pull {
    /// Nothing: the chip drives it, or a part that always has its supply.
    None = 0,
    /// 40 kΩ to 3.3 V.
    Up = 1,
    /// 40 kΩ to ground.
    Down = 2,
}

/// A pin that one of the chip's blocks drives or reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Served {
    /// Port: 0 is A.
    pub port: u8,
    /// Bit of the port.
    pub bit: u8,
    /// Alternate function.
    pub function: u8,
    /// Class of its driver.
    pub speed: Speed,
    /// What holds it.
    pub pull: Pull,
    /// Fastest that it changes, Hz: the clock of its bus, half the bit rate, a servo's pulses.
    pub hz: u32,
}

const fn served(port: u8, bit: u8, function: u8, speed: Speed, pull: Pull, hz: u32) -> Served {
    Served { port, bit, function, speed, pull, hz }
}

/// Lines of the modem: its own pins only while it has its supply.
pub const MODEM: [Served; 2] = [served(2, 12, 8, Speed::Low, Pull::None, 9_600), served(3, 2, 8, Speed::Low, Pull::Up, 9_600)];

/// All others.
pub const PINS: [Served; 12] = [
    // UART4: GPS receiver, which may be off.
    served(0, 0, 8, Speed::Low, Pull::None, 4_800),
    served(0, 1, 8, Speed::Low, Pull::Down, 4_800),
    // USART2: log.
    served(0, 2, 7, Speed::Low, Pull::None, 57_600),
    // USART1: the line. One that nobody is at speaks no noise, and wakes nobody.
    served(0, 9, 7, Speed::Low, Pull::None, 57_600),
    served(0, 10, 7, Speed::Low, Pull::Up, 57_600),
    // TIM4: servo of the fin.
    served(1, 8, 2, Speed::Low, Pull::None, 50),
    // USART3: compass, which may be off; as a backseat our own line.
    served(1, 10, 7, Speed::Low, Pull::None, 57_600),
    served(1, 11, 7, Speed::Low, Pull::Down, 57_600),
    // SPI2: log flash, at 8 MHz.
    served(1, 13, 5, Speed::Medium, Pull::None, 8_000_000),
    served(1, 14, 5, Speed::Medium, Pull::Down, 8_000_000),
    served(1, 15, 5, Speed::Medium, Pull::None, 8_000_000),
    // Select of the log flash: an output that its driver sets up; here its speed and, until then, its pull.
    served(1, 12, 0, Speed::Medium, Pull::Up, 8_000_000),
];

fn put(registers: &mut impl Registers, address: u32, at: u32, width: u32, value: u32) {
    let mask = (1u32 << width).wrapping_sub(1) << at;
    let before = registers.read(address);
    registers.write(address, before & !mask | (value << at) & mask);
}

/// Gives a pin to its block; one without a function stays the input or output that it is.
pub fn connect(registers: &mut impl Registers, pin: &Served) {
    let base = GPIOA.wrapping_add(NEXT.wrapping_mul(u32::from(pin.port)));
    let bit = u32::from(pin.bit) & 15;
    put(registers, base + OSPEEDR, 2 * bit, 2, pin.speed as u32);
    put(registers, base + PUPDR, 2 * bit, 2, pin.pull as u32);
    if pin.function > 0 {
        put(registers, base + AFRL + bit / 8 * 4, bit % 8 * 4, 4, u32::from(pin.function));
        put(registers, base + MODER, 2 * bit, 2, 2);
    }
}

/// Takes a pin from its block: an input, pulled down, as a part without supply asks for.
pub fn release(registers: &mut impl Registers, pin: &Served) {
    let base = GPIOA.wrapping_add(NEXT.wrapping_mul(u32::from(pin.port)));
    let bit = u32::from(pin.bit) & 15;
    put(registers, base + MODER, 2 * bit, 2, 0);
    put(registers, base + PUPDR, 2 * bit, 2, Pull::Down as u32);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[derive(Default)]
    struct Chip(BTreeMap<u32, u32>);

    impl Registers for Chip {
        fn read(&mut self, address: u32) -> u32 {
            self.0.get(&address).copied().unwrap_or_default()
        }
        fn write(&mut self, address: u32, value: u32) {
            self.0.insert(address, value);
        }
    }

    #[test]
    fn validate_each_pin_is_fast_enough_for_what_it_carries_and_no_faster() {
        for pin in PINS.iter().chain(&MODEM) {
            assert!(pin.hz <= pin.speed.highest_hz(), "{pin:?}");
            assert!(pin.speed == Speed::Low || pin.hz > Speed::Low.highest_hz(), "{pin:?}: slower edges would do");
        }
        let mut places: Vec<_> = PINS.iter().chain(&MODEM).map(|p| (p.port, p.bit)).collect();
        places.sort_unstable();
        places.dedup();
        assert_eq!(places.len(), PINS.len() + MODEM.len(), "a pin twice");
    }

    #[test]
    fn what_is_written_is_what_the_table_says_and_nothing_else() {
        let mut chip = Chip::default();
        // PB13: function 5, speed 1, no pull; another pin of the port is left alone.
        chip.write(0x4002_0400, 0x1);
        connect(&mut chip, PINS.iter().find(|p| (p.port, p.bit) == (1, 13)).expect("PB13"));
        let at = |chip: &Chip, address: u32| chip.0.get(&address).copied().unwrap_or_default();
        assert_eq!(at(&chip, 0x4002_0400), 0x1 | 2 << 26);
        assert_eq!((at(&chip, 0x4002_0408), at(&chip, 0x4002_0424)), (1 << 26, 5 << 20));
        // The modem's lines: driven with its supply, inputs pulled down without.
        for pin in &MODEM {
            connect(&mut chip, pin);
        }
        assert_eq!((at(&chip, 0x4002_0800), at(&chip, 0x4002_0824)), (2 << 24, 8 << 16));
        assert_eq!((at(&chip, 0x4002_0c00), at(&chip, 0x4002_0c0c), at(&chip, 0x4002_0c20)), (2 << 4, 1 << 4, 8 << 8));
        for pin in &MODEM {
            release(&mut chip, pin);
        }
        assert_eq!((at(&chip, 0x4002_0800), at(&chip, 0x4002_080c)), (0, 2 << 24));
        assert_eq!((at(&chip, 0x4002_0c00), at(&chip, 0x4002_0c0c)), (0, 2 << 4));
    }

    #[test]
    fn no_input_floats() {
        // Received bytes and MISO: every line that the chip does not drive is held.
        for place in [(0, 1), (0, 10), (1, 11), (1, 14), (3, 2)] {
            let pin = PINS.iter().chain(&MODEM).find(|p| (p.port, p.bit) == place).expect("a pin");
            assert_ne!(pin.pull, Pull::None, "{pin:?}");
        }
    }
}

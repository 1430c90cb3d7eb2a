//! The chip's own flash of the board on its parts: the driver's way to the model of its controller.

use devices::chip_flash::{Journal, Memory, Slots};
use devices::registers::Registers;
use parts::chip_flash::ChipFlash;
use std::cell::RefCell;
use std::rc::Rc;
use store::image::Images;

/// The chip's own flash and its controller.
#[derive(Clone)]
pub struct OwnFlash(pub Rc<RefCell<ChipFlash>>);

impl Registers for OwnFlash {
    fn read(&mut self, address: u32) -> u32 {
        self.0.borrow_mut().read(address)
    }
    fn write(&mut self, address: u32, value: u32) {
        self.0.borrow_mut().write(address, value);
    }
}

impl Memory for OwnFlash {
    fn copy(&mut self, address: u32, out: &mut [u8]) {
        self.0.borrow().copy(address, out);
    }
    fn write_byte(&mut self, address: u32, byte: u8) {
        self.0.borrow_mut().write_byte(address, byte);
    }
}

impl OwnFlash {
    /// Its images.
    #[must_use]
    pub fn images(&self) -> Images<Journal<Self>, Slots<Self>> {
        Images::new(Journal::new(self.clone()), Slots::new(self.clone()))
    }
}

//! What the chip offers, in pieces that can each be lost without harm.

pub mod black_box;
pub mod canary;
pub mod chip_flash;
pub mod clock;
mod fault;
pub mod last_words;
pub mod log;
pub mod modem_supply;
pub mod pins;
pub mod registers;
mod rtt;
pub mod servo;
pub mod spi;
pub mod standstill;
pub mod uart;
pub mod watchdog;

use devices::pins as served;
use devices::registers::Registers;
use stm32f4::stm32f405::{GPIOC, RCC};

/// Drives every output of the actuators low, before anything else: pump, mass, weight and beacon, PC0 to PC6; and the modem's supply, PC11.
pub fn safe_outputs(rcc: &RCC, gpioc: &GPIOC) {
    rcc.ahb1enr().modify(|_, w| w.gpiocen().enabled());
    // SAFETY: BSRR takes any bits; bits 16 to 22 and 27 make the pins low.
    gpioc.bsrr().write(|w| unsafe { w.bits(0x87f << 16) });
    // SAFETY: PC0 to PC6 and PC11 as outputs, two bits each.
    gpioc.moder().modify(|r, w| unsafe { w.bits(r.bits() & !0x00c0_3fff | 0x0040_1555) });
}

/// Clocks to the peripherals in use, and their pins ([`devices::pins`]); the modem's are not connected before it has its supply.
pub fn power_up(rcc: &RCC, registers: &mut impl Registers) {
    rcc.ahb1enr().modify(|_, w| w.gpioaen().enabled().gpioben().enabled().gpiocen().enabled().gpioden().enabled());
    rcc.apb1enr().modify(|_, w| {
        w.tim2en()
            .enabled()
            .tim4en()
            .enabled()
            .usart2en()
            .enabled()
            .usart3en()
            .enabled()
            .uart4en()
            .enabled()
            .uart5en()
            .enabled()
            .spi2en()
            .enabled()
    });
    rcc.apb2enr().modify(|_, w| w.usart1en().enabled());
    served::PINS.iter().for_each(|pin| served::connect(registers, pin));
    served::MODEM.iter().for_each(|pin| served::release(registers, pin));
}

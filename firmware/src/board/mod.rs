//! What the chip offers, in pieces that can each be lost without harm.

pub mod black_box;
pub mod canary;
pub mod chip_flash;
pub mod clock;
mod fault;
pub mod last_words;
pub mod log;
pub mod pins;
pub mod registers;
mod rtt;
pub mod servo;
pub mod spi;
pub mod standstill;
pub mod uart;
pub mod watchdog;

use stm32f4::stm32f405::{GPIOA, GPIOB, GPIOC, GPIOD, RCC};

/// Drives every output of the actuators low, before anything else: pump, mass, weight and beacon, PC0 to PC6; and the modem's supply, PC11.
pub fn safe_outputs(rcc: &RCC, gpioc: &GPIOC) {
    rcc.ahb1enr().modify(|_, w| w.gpiocen().enabled());
    // SAFETY: BSRR takes any bits; bits 16 to 22 and 27 make the pins low.
    gpioc.bsrr().write(|w| unsafe { w.bits(0x87f << 16) });
    // SAFETY: PC0 to PC6 and PC11 as outputs, two bits each.
    gpioc.moder().modify(|r, w| unsafe { w.bits(r.bits() & !0x00c0_3fff | 0x0040_1555) });
}

/// Clocks to the peripherals in use, and the pins of both serial ports.
///
/// | pin | function |
/// |---|---|
/// | PA9, PA10 | USART1 TX, RX: the line (host, or ground station) |
/// | PA0, PA1 | UART4 TX, RX: GPS receiver |
/// | PA2 | USART2 TX: defmt log |
/// | PB10, PB11 | USART3 TX, RX: compass |
/// | PB8 | TIM4 channel 3: servo of the fin |
/// | PC12, PD2 | UART5 TX, RX: modem |
/// | PB12 to PB15 | log flash: select, and SPI2 clock, in, out |
pub fn power_up(rcc: &RCC, gpioa: &GPIOA, gpiob: &GPIOB, gpioc: &GPIOC, gpiod: &GPIOD) {
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
    // A line that nobody is at speaks no noise, and wakes nobody.
    gpioa.pupdr().modify(|_, w| w.pupdr10().pull_up());
    gpioa.afrl().modify(|_, w| w.afrl0().af8().afrl1().af8().afrl2().af7());
    gpioa.afrh().modify(|_, w| w.afrh9().af7().afrh10().af7());
    gpioa
        .moder()
        .modify(|_, w| w.moder0().alternate().moder1().alternate().moder2().alternate().moder9().alternate().moder10().alternate());
    gpioc.afrh().modify(|_, w| w.afrh12().af8());
    gpioc.moder().modify(|_, w| w.moder12().alternate());
    gpiod.afrl().modify(|_, w| w.afrl2().af8());
    // Pulled up: where no modem is fitted the line rests.
    gpiod.pupdr().modify(|_, w| w.pupdr2().pull_up());
    gpiod.moder().modify(|_, w| w.moder2().alternate());
    gpiob.afrh().modify(|_, w| w.afrh8().af2().afrh10().af7().afrh11().af7().afrh13().af5().afrh14().af5().afrh15().af5());
    gpiob.moder().modify(|_, w| {
        w.moder8().alternate().moder10().alternate().moder11().alternate().moder13().alternate().moder14().alternate().moder15().alternate()
    });
}

//! Drivers of the science bay's parts over embedded-hal 1.0 traits.
//!
//! | file | part | datasheet |
//! |---|---|---|
//! | [`pressure`] | TE MS5837-30BA pressure transducer, I²C 0x76 | TE "MS5837-30BA", 2019 |
//! | [`attitude`] | OceanServer OS5000 compass, sentences over UART | OceanServer OS5000 manual 4.0 |
//! | [`adc`] | TI ADS1115: position pots, vacuum sensor, I²C 0x48 | TI SBAS444 |
//! | [`gauge`] | TI INA226 battery gauge, I²C 0x40 | TI SBOS547 |
//! | [`gps`] | any GPS receiver with NMEA 0183, UART | NMEA 0183 |
//! | [`sbd`] | Iridium 9602 or 9603 modem, UART | Iridium 9602 developer's guide, ISU AT command reference |
//! | [`vacuum`] | NXP MPXA6115A internal pressure, through the ADC | NXP MPXA6115A rev 7 |
//! | [`motor`] | pump and battery mass: TI DRV8873 H-bridge and pot | TI SLVSET1 |
//! | [`fin`] | hobby-type servo, 50 Hz pulses | Hitec D646WP |
//! | [`release`] | drop weight: two pins that must be driven in sequence | – |
//! | [`flash`] | Winbond W25Q128JV log flash, SPI | Winbond W25Q128JV rev F |
//! | [`registers`] | the chip's registers, or a model's | |
//! | [`rtc`] | the chip's own calendar clock, register by register | ST RM0090 chapter 26 |
//! | [`stop`] | the chip's STOP mode, and time over it | ST RM0090 chapter 5 |
//! | [`pins`] | which of the chip's pins serves which block, how fast, how held | ST DS8626, RM0090 chapter 8 |
//! | [`options`] | the chip's option bytes | ST RM0090 chapter 3 |
//! | [`crystal`] | the chip's crystal, measured against its internal oscillator | ST RM0090, DS8626 |
//! | [`chip_flash`] | the chip's own flash, for images of the firmware | ST RM0090 chapter 3 |
//! | [`soft_i2c`] | the I²C bus itself, on two open-drain pins | NXP UM10204 |
//!
//! Every wait has a bound, every number from a part is checked before it is
//! used, and what fails is named; the caller turns it into a missing reading.
//! The bus is driven pin by pin because the chip's own I²C block has waits
//! without an end, and a bus held low by a dead part must not stop the loop.
//!
//! # Dependencies
//!
//! * `embedded-hal`, `embedded-io`, `embedded-storage`: buses, serial lines and flash behind traits
#![cfg_attr(not(test), no_std)]

pub mod adc;
pub mod attitude;
pub mod chip_flash;
pub mod crystal;
pub mod fin;
pub mod flash;
pub mod gauge;
pub mod gps;
pub mod motor;
pub mod options;
pub mod pins;
pub mod pressure;
pub mod registers;
pub mod release;
pub mod rtc;
pub mod sbd;
pub mod soft_i2c;
pub mod stop;
pub mod vacuum;

#[cfg(test)]
mod tests;

/// Why a part gave nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// The bus or the part did not answer (NACK, stuck line).
    Bus,
    /// It answered, but not in time.
    Timeout,
    /// CRC or checksum does not match.
    Check,
    /// Another part, or none, is at this address: what it says it is.
    Identity(u16),
    /// The value is outside what the part can measure.
    Range,
}

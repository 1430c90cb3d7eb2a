//! The boot loader: sector 0 of the STM32F405's flash, before every start of the image.
//!
//! What it decides and copies is [`store::image`], tested on a laptop with the power cut at every byte; here are the registers. It
//! never waits without a bound, uses the RAM of the image's stack alone, and leaves the reset flags for the image to read.
//!
//! On a laptop this program prints where the images lie.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    println!("boot loader for STM32F405, flash 0x08000000, journal 0x08004000 (it is part of the image: `cargo flight`)");
    println!("slots of 256 KiB  {:#010x}, 0x08060000, 0x080a0000: runs, staged, before", store::image::RUNS_AT);
    println!("boots on trial    {}", store::image::TRIALS);
}

#[cfg(target_os = "none")]
mod target {
    use core::panic::PanicInfo;
    use cortex_m::peripheral::SCB;
    use devices::chip_flash::{Journal, Memory, Slots, starts_erase};
    use devices::options::{OPTCR, WDG_SW};
    use devices::registers::Registers;
    use store::image::{HEADER, Images, RUNS_AT};

    /// Independent watchdog.
    const IWDG_KR: u32 = 0x4000_3000;
    const IWDG_PR: u32 = 0x4000_3004;
    const IWDG_RLR: u32 = 0x4000_3008;
    /// Reset flags; bit 29: the independent watchdog.
    const RCC_CSR: u32 = 0x4002_3874;
    const IWDGRSTF: u32 = 1 << 29;
    /// Loops before the next try when there is nothing to start: a second or so.
    const PAUSE: u32 = 16_000_000;

    /// The chip.
    struct Chip;

    impl Registers for Chip {
        fn read(&mut self, address: u32) -> u32 {
            // SAFETY: a register of this chip, by the driver's table.
            unsafe { core::ptr::read_volatile(address as *const u32) }
        }
        fn write(&mut self, address: u32, value: u32) {
            if starts_erase(address, value) {
                // An installation is no hang: its erases are counted, and a sector takes 6 s at most, with its words.
                // SAFETY: the key register of the watchdog; without a watchdog it does nothing.
                unsafe { core::ptr::write_volatile(IWDG_KR as *mut u32, 0xaaaa) }
            }
            // SAFETY: a register of this chip, or a word of flash outside of this program.
            unsafe { core::ptr::write_volatile(address as *mut u32, value) }
        }
    }

    impl Memory for Chip {
        fn copy(&mut self, address: u32, out: &mut [u8]) {
            let mut at = address;
            for to in out {
                // SAFETY: flash, inside the driver's sectors.
                *to = unsafe { core::ptr::read_volatile(at as *const u8) };
                at = at.wrapping_add(1);
            }
        }
        fn write_byte(&mut self, address: u32, byte: u8) {
            // SAFETY: flash outside of this program.
            unsafe { core::ptr::write_volatile(address as *mut u8, byte) }
        }
    }

    /// The longest time a watchdog can have: 22 s at least, more than an installation takes.
    fn widen_watchdog() {
        Chip.write(IWDG_KR, 0x5555);
        Chip.write(IWDG_PR, 6);
        Chip.write(IWDG_RLR, 0xfff);
        Chip.write(IWDG_KR, 0xaaaa);
    }

    // No runtime crate: there are no statics to make, and no interrupt comes. Reset makes the FPU usable, as compiled code may use its
    // registers (Armv7-M ARM B3.2.20), and goes on below; every exception is a reset.
    core::arch::global_asm!(
        ".section .vector_table,\"a\",%progbits",
        ".word _stack_start",
        ".word Reset",
        ".rept 14",
        ".word Fault",
        ".endr",
        ".section .text.Reset,\"ax\",%progbits",
        ".global Reset",
        ".type Reset,%function",
        ".thumb_func",
        "Reset:",
        "ldr r0, =0xe000ed88",
        "ldr r1, [r0]",
        "orr r1, r1, #0xf00000",
        "str r1, [r0]",
        "dsb",
        "isb",
        "bl boot_main",
        ".pool",
        ".size Reset, . - Reset",
    );

    #[unsafe(no_mangle)]
    extern "C" fn boot_main() -> ! {
        // The watchdog was started by the reset.
        if Chip.read(OPTCR) & WDG_SW == 0 {
            widen_watchdog();
        }
        let mut images = Images::new(Journal::<Chip>::new(Chip), Slots::<Chip>::new(Chip));
        images.open();
        let Some(start) = images.boot(Chip.read(RCC_CSR) & IWDGRSTF != 0) else {
            cortex_m::asm::delay(PAUSE);
            SCB::sys_reset();
        };
        if start.trial {
            // An image that hangs before it starts its own watchdog does not stay.
            Chip.write(IWDG_KR, 0xcccc);
            widen_watchdog();
        }
        let table = RUNS_AT.wrapping_add(HEADER);
        // SAFETY: the vector table of an image that is whole; this program ends here.
        unsafe {
            (*SCB::PTR).vtor.write(table);
            cortex_m::asm::bootload(table as *const u32)
        }
    }

    #[unsafe(export_name = "Fault")]
    extern "C" fn fault() -> ! {
        SCB::sys_reset()
    }

    #[panic_handler]
    fn panic(_: &PanicInfo<'_>) -> ! {
        SCB::sys_reset()
    }
}

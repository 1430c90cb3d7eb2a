//! What the loop of [`bay`] asks of the chip.

use crate::board::chip_flash::ChipFlash;
use crate::board::last_words::{self, LastWords};
use crate::board::pins::{Pin, Wait};
use crate::board::registers::Registers;
use crate::board::standstill::Standstill;
use crate::board::watchdog::Watchdog;
use crate::board::{black_box, clock, uart};
use bay::{KeptUtc, Outside, Woken};
use cortex_m::peripheral::SCB;
use devices::options;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::InputPin;
use helm::{Mark, Seat, UtcClock};
use signals::{Abort, Clock, Phase, Strap, ToHost};

/// What the chip keeps for the loop.
pub struct Chip {
    pub watchdog: Watchdog,
    pub words: LastWords,
    pub strap: Pin,
    pub kept_utc: KeptUtc<Registers>,
    pub still: Standstill,
    pub told: (Phase, Option<Abort>),
}

impl Outside for Chip {
    fn now_ms(&mut self) -> u64 {
        clock::now_ms()
    }
    fn feed(&mut self) {
        self.watchdog.feed();
    }
    /// Written anew each time, so that a bit that flipped in it does not stay.
    fn remember(&mut self, mark: Mark, air_pa: f32) {
        (self.words.mark, self.words.air) = (mark, air_pa.to_bits());
        last_words::write(self.words);
    }
    fn keep_time(&mut self, clock: &UtcClock) {
        self.kept_utc.keep(clock, clock::now_ms());
    }
    fn lost_bytes(&mut self) -> u32 {
        uart::take_lost()
    }
    fn strap(&mut self) -> Strap {
        match self.strap.is_low() {
            Ok(true) => Strap::Bench,
            Ok(false) => Strap::Deployment,
        }
    }
    fn said(&mut self, message: &ToHost) {
        if let ToHost::Answer(answer) = message {
            black_box::cycle(answer);
        }
        tell(message, &mut self.told);
    }
    fn set_options(&mut self) -> Option<u32> {
        defmt::warn!("option bytes are being set");
        // SAFETY: the images' slots are written from this thread alone, and not now.
        options::set(&mut unsafe { ChipFlash::new() })
    }
    fn sleep(&mut self, until_ms: u64) {
        self.still.sleep(until_ms);
    }
    fn stop(&mut self, until_ms: u64) -> Option<Woken> {
        self.still.stop(&mut self.kept_utc.rtc, until_ms)
    }
    /// The boot loader does the rest; the last characters of the answer leave the port first.
    fn restart(&mut self) {
        defmt::info!("restart, as the host wants");
        Wait.delay_ms(2);
        SCB::sys_reset();
    }
    fn seated(&mut self, seat: Seat) {
        match seat {
            Seat::Host => defmt::info!("seat: frames come from the host"),
            Seat::Sensors => defmt::info!("seat: own sensors"),
            Seat::Open => defmt::info!("seat: on deck"),
            Seat::Backseat => defmt::info!("seat: frames come from the glider"),
        }
    }
}

/// Logs what changed.
fn tell(message: &ToHost, told: &mut (Phase, Option<Abort>)) {
    match message {
        ToHost::Answer(a) => {
            let now = (a.trace.phase, a.trace.abort);
            if now != *told {
                defmt::info!(
                    "frame {=u32}: phase {=u8} abort {=u8} dives {=u16} depth {=f32} m flags {=u32:#x}",
                    a.command.seq,
                    now.0 as u8,
                    now.1.map_or(255, |abort| abort as u8),
                    a.trace.dives,
                    a.trace.depth_m,
                    a.trace.flags.0
                );
                *told = now;
            }
        }
        ToHost::Hello { nonce, manifest, .. } => defmt::info!("hello {=u32:#x}, mission under way {=bool}", *nonce, manifest.under_way),
        ToHost::Ready { table_id, config, mission, .. } => {
            defmt::info!("mission taken, table {=u32:08x}, configuration {=u32:08x}, mission {=u32:08x}", *table_id, *config, *mission);
        }
        ToHost::Done { crc } => defmt::info!("done {=u32:08x}", *crc),
        ToHost::Volatile { crc } => defmt::warn!("done {=u32:08x}, in RAM only: lost at the next reset", *crc),
        ToHost::Refused(_) => defmt::warn!("refused"),
        ToHost::Clock(Clock { utc: Some(utc), .. }) => defmt::info!("UTC {=u64} ms, within {=u32} ms", utc.ms, utc.within_ms),
        ToHost::Continue { .. }
        | ToHost::Content { .. }
        | ToHost::Counters(_)
        | ToHost::Checked(_)
        | ToHost::Clock(_)
        | ToHost::OptionBytes(_) => {}
    }
}

//! The calendar clock of an STM32F405, by address (RM0090 rev 19: 5.4, 7.3 and chapter 26), with its backup domain.
//!
//! What a reset clears and what it leaves alone, both write protections, the initialisation mode, the calendar in BCD, and two
//! oscillators: a crystal that may not start, and the internal one with its pace. The shadow copies are not modelled: they read 0.

use crate::stop::Stop;
use crate::{Clock, Work};

/// Time the crystal takes to start, ns.
const CRYSTAL_START_NS: u64 = 2_000_000_000;
/// Readings of ISR after which the initialisation mode is entered.
const ENTRY: u32 = 200;
/// From the end of a stop to the first instruction, ns (DS8626 table 36: 110 µs at most, flash and regulator in low power).
const WAKE_NS: u64 = 110_000;
/// A stop that nothing ends, ns: the watchdog does.
const FOR_EVER_NS: u64 = 30_000_000_000;
const DAYS: [u64; 12] = [31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31];

/// The block.
#[derive(Debug)]
pub struct Rtc {
    clock: Clock,
    /// Error of the crystal, parts of a million; none: it does not start.
    pub crystal_ppm: Option<f64>,
    /// Error of the internal oscillator, parts of a million of 32 kHz.
    pub internal_ppm: f64,
    /// The block is not there: everything reads 0 (an emulator).
    pub absent: bool,
    /// What else a stop needs.
    pub stop: Stop,
    /// When the line speaks next, ns: a stop ends.
    pub line_ns: Option<u64>,
    // Cleared by a reset.
    apb1enr: u32,
    pwr_cr: u32,
    csr: u32,
    key: u32,
    // Backup domain.
    bdcr: u32,
    crystal_since_ns: u64,
    cr: u32,
    isr: u32,
    init_reads: u32,
    prer: u32,
    wutr: u32,
    /// The wake-up timer has run down.
    woke: bool,
    /// Calendar as it was written, and ticks counted since.
    tr: u32,
    dr: u32,
    ticks: f64,
    counted_ns: u64,
    backup: [u32; 20],
}

impl Rtc {
    /// A block that has never had power, with a good crystal.
    #[must_use]
    pub fn new(clock: Clock) -> Self {
        Self {
            clock,
            crystal_ppm: Some(20.0),
            internal_ppm: 150_000.0,
            absent: false,
            stop: Stop::new(),
            line_ns: None,
            apb1enr: 0,
            pwr_cr: 0,
            csr: 0,
            key: 0,
            bdcr: 0,
            crystal_since_ns: 0,
            cr: 0,
            isr: 0,
            init_reads: 0,
            prer: 0x007f_00ff,
            wutr: 0xffff,
            woke: false,
            tr: 0,
            dr: 0x2101,
            ticks: 0.0,
            counted_ns: 0,
            backup: [0; 20],
        }
    }

    /// A reset of the chip.
    pub fn reset(&mut self) {
        self.count();
        (self.apb1enr, self.pwr_cr, self.csr, self.key) = (0, 0, 0, 0);
        self.stop = self.stop.after_reset();
    }

    /// WFI: in deep sleep the chip stands still until the wake-up timer or the line ends it.
    pub fn halt(&mut self) {
        if !self.stop.is_deep() {
            return;
        }
        let (now_ns, hz) = (self.clock.now_ns(), self.hz());
        // A sixteenth, an eighth, a quarter or half of the oscillator; the timer's own interrupt enabled; not standby.
        let armed = self.cr & 0x4404 == 0x4400 && self.stop.hears_timer() && hz > 0.0 && self.pwr_cr & 2 == 0;
        let timer_ns = (f64::from(self.wutr + 1) * f64::from(16 >> (self.cr & 3)) / hz * 1e9) as u64;
        let timer_ns = if armed { timer_ns } else { FOR_EVER_NS };
        let line_ns = self.line_ns.filter(|at| self.stop.hears_line() && (now_ns..now_ns + timer_ns).contains(at));
        let stopped_ns = line_ns.map_or(timer_ns, |at| at - now_ns);
        self.line_ns = self.line_ns.filter(|_| line_ns.is_none());
        // Regulator and flash in low power; otherwise it takes more.
        if self.pwr_cr & 0x201 == 0x201 {
            self.clock.work(Work::Stop, stopped_ns);
        }
        self.clock.pass_ns(stopped_ns + WAKE_NS);
        self.count();
        self.woke = line_ns.is_none();
        self.stop.ended(line_ns.is_some());
    }

    /// The supply was gone, that of the backup domain too.
    pub fn power_cycle(&mut self) {
        let (crystal_ppm, internal_ppm, absent) = (self.crystal_ppm, self.internal_ppm, self.absent);
        let stop = self.stop.after_reset();
        *self = Self { crystal_ppm, internal_ppm, absent, stop, ..Self::new(self.clock.clone()) };
    }

    fn crystal_runs(&self) -> bool {
        self.bdcr & 1 != 0 && self.crystal_ppm.is_some() && self.clock.now_ns() >= self.crystal_since_ns + CRYSTAL_START_NS
    }

    /// Cycles a second of what is chosen.
    fn hz(&self) -> f64 {
        match (self.bdcr >> 8 & 3, self.bdcr >> 15 & 1) {
            (1, 1) if self.crystal_runs() => 32_768.0 * (1.0 + self.crystal_ppm.unwrap_or(0.0) * 1e-6),
            (2, 1) if self.csr & 1 != 0 => 32_000.0 * (1.0 + self.internal_ppm * 1e-6),
            _ => 0.0,
        }
    }

    fn count(&mut self) {
        let now_ns = self.clock.now_ns();
        if self.isr & 0x40 == 0 {
            self.ticks += (now_ns - self.counted_ns) as f64 * 1e-9 * self.hz();
        }
        self.counted_ns = now_ns;
    }

    /// Seconds since the calendar was written, and the part of one that is left.
    fn elapsed(&self) -> (u64, u32) {
        let (a, s) = (f64::from((self.prer >> 16 & 0x7f) + 1), f64::from((self.prer & 0x7fff) + 1));
        let halves = self.ticks / a;
        ((halves / s) as u64, (s - 1.0 - (halves % s).floor()) as u32)
    }

    /// Time and date, BCD.
    fn calendar(&self) -> (u32, u32) {
        let of = |x: u32| u64::from((x >> 4 & 0xf) * 10 + (x & 0xf));
        let bcd = |x: u64| (16 * (x / 10) + x % 10) as u32;
        let mut s = of(self.tr & 0x7f) + 60 * of(self.tr >> 8 & 0x7f) + 3600 * of(self.tr >> 16 & 0x3f) + self.elapsed().0;
        let (mut day, mut month, mut year) = (of(self.dr & 0x3f), of(self.dr >> 8 & 0x1f), of(self.dr >> 16 & 0xff));
        while s >= 86_400 {
            s -= 86_400;
            day += 1;
            let leap = u64::from(month == 2 && year.is_multiple_of(4));
            if day > DAYS.get(month as usize - 1).copied().unwrap_or(31) + leap {
                (day, month) = (1, month + 1);
            }
            if month > 12 {
                (month, year) = (1, (year + 1) % 100);
            }
        }
        (bcd(s / 3600) << 16 | bcd(s / 60 % 60) << 8 | bcd(s % 60), bcd(year) << 16 | bcd(month) << 8 | bcd(day))
    }

    /// Reads a register.
    pub fn read(&mut self, address: u32) -> u32 {
        if self.absent {
            return 0;
        }
        self.count();
        let direct = self.cr & 0x20 != 0;
        match address {
            0x4002_3840 => self.apb1enr,
            0x4002_3870 => self.bdcr & !2 | u32::from(self.crystal_runs()) << 1,
            0x4002_3874 => self.csr | (self.csr & 1) << 1,
            0x4000_7000 => self.pwr_cr,
            0x4000_2800 if direct => self.calendar().0,
            0x4000_2804 if direct => self.calendar().1,
            0x4000_2808 => self.cr,
            0x4000_280c => {
                if self.isr & 0x80 != 0 {
                    self.init_reads += 1;
                    self.isr |= if self.init_reads >= ENTRY && self.hz() > 0.0 { 0x40 } else { 0 };
                }
                // The wake-up timer may be set while it is off.
                self.isr | u32::from(self.cr & 0x400 == 0) << 2 | u32::from(self.woke) << 10
            }
            0x4000_2810 => self.prer,
            0x4000_2814 => self.wutr,
            0x4000_2828 if direct => self.elapsed().1,
            0x4000_2850..=0x4000_289c => self.backup[(address as usize - 0x4000_2850) / 4],
            _ => self.stop.read(address),
        }
    }

    /// Writes a register.
    pub fn write(&mut self, address: u32, value: u32) {
        self.count();
        let (open, unlocked) = (self.pwr_cr & 0x100 != 0, self.key == 2);
        let (init, init_mode) = (unlocked && self.isr & 0x80 != 0, unlocked && self.isr & 0x40 != 0);
        match address {
            0x4002_3840 => self.apb1enr = value,
            0x4000_7000 if self.apb1enr & 1 << 28 != 0 => self.pwr_cr = value,
            0x4002_3874 => self.csr = value & 1,
            ..=0x4000_27ff | 0x4000_2c00..=0x4002_386f | 0x4002_3878.. => self.stop.write(address, value),
            _ if !open => {}
            0x4002_3870 if value & 1 << 16 != 0 => {
                let (apb1enr, pwr_cr, csr) = (self.apb1enr, self.pwr_cr, self.csr);
                self.power_cycle();
                (self.apb1enr, self.pwr_cr, self.csr) = (apb1enr, pwr_cr, csr);
            }
            0x4002_3870 => {
                if value & !self.bdcr & 1 != 0 {
                    self.crystal_since_ns = self.clock.now_ns();
                }
                // Once chosen, the oscillator stays until the domain is reset.
                let chosen = if self.bdcr & 0x300 != 0 { self.bdcr & 0x300 } else { value & 0x300 };
                self.bdcr = value & 0x8001 | chosen;
            }
            0x4000_2824 => {
                self.key = match (self.key, value) {
                    (0, 0xca) => 1,
                    (1, 0x53) => 2,
                    _ => 0,
                }
            }
            0x4000_2814 if unlocked && self.cr & 0x400 == 0 => self.wutr = value & 0xffff,
            0x4000_280c if unlocked => {
                self.woke &= value & 1 << 10 != 0;
                if value & 0x80 == 0 {
                    (self.isr, self.init_reads) = (0, 0);
                } else if !init {
                    self.isr = 0x80;
                }
            }
            0x4000_2808 if unlocked => self.cr = value,
            0x4000_2810 if init_mode => self.prer = value,
            0x4000_2800 if init_mode => (self.tr, self.ticks) = (value, 0.0),
            0x4000_2804 if init_mode => (self.dr, self.ticks) = (value, 0.0),
            0x4000_2850..=0x4000_289c => self.backup[(address as usize - 0x4000_2850) / 4] = value,
            _ => {}
        }
    }
}

//! What a board kept of a fault ([`signals::autopsy`]): its bytes, and what they mean in words.

use anyhow::ensure;
use serde_json::{Value, json};
use signals::autopsy::{CYCLE, Cause, Cycle, NOTE, Note, RUN, Registers, flag};
use signals::{Abort, Phase};

/// What was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Autopsy {
    /// The run that goes on; `None`: its note is damaged.
    pub present: Option<Note>,
    /// The last run that a fault ended.
    pub fault: Option<Ended>,
    /// There is a record of a fault, and it does not match its CRC.
    pub is_damaged: bool,
}

/// A run that a fault ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Ended {
    /// Why, where, when.
    pub note: Note,
    /// Its last finished cycles that are whole, oldest first.
    pub cycles: Vec<Cycle>,
}

impl Autopsy {
    /// From the bytes of a board or a file; `None` where there are none: a controller without such a memory.
    ///
    /// # Errors
    /// No length that such a record has.
    pub fn read(bytes: &[u8]) -> anyhow::Result<Option<Self>> {
        if bytes.is_empty() {
            return Ok(None);
        }
        let (clean, whole) = (4 * NOTE, 4 * (NOTE + RUN));
        ensure!(
            bytes.len() == clean || bytes.len() == whole,
            "{} bytes are no record of a board ({clean}, or {whole} with a fault): fetch it with glider autopsy PORT --out FILE",
            bytes.len()
        );
        let words: Vec<u32> = bytes.chunks_exact(4).filter_map(|word| Some(u32::from_le_bytes(word.try_into().ok()?))).collect();
        let (present, run) = words.split_first_chunk::<NOTE>().map_or((None, &[][..]), |(note, run)| (Note::read(note), run));
        let fault = run.split_first_chunk::<NOTE>().and_then(|(note, cycles)| {
            let mut cycles: Vec<Cycle> = cycles.chunks_exact(CYCLE).filter_map(|c| Cycle::read(c.try_into().ok()?)).collect();
            // A ring: its oldest record is not its first.
            cycles.sort_by_key(|c| (c.time_cs, c.seq));
            Some(Ended { note: Note::read(note)?, cycles })
        });
        Ok(Some(Self { present, is_damaged: !run.is_empty() && fault.is_none(), fault }))
    }
}

/// Bits of CFSR (Armv7-M ARM B3.2.15) and what they say; `@` is the address that belongs to it.
const STATUS: &[(u32, &str)] = &[
    (1 << 0, "an instruction was fetched from where no code may run"),
    (1 << 1, "access to protected memory@"),
    (1 << 3, "protected memory met while a frame was unstacked"),
    (1 << 4, "protected memory met while a frame was stacked"),
    (1 << 5, "protected memory met while floating-point registers were stacked"),
    (1 << 8, "bus error on an instruction fetch"),
    (1 << 9, "precise data bus error@"),
    (1 << 10, "imprecise data bus error: a write some instructions before the PC"),
    (1 << 11, "bus error while a frame was unstacked"),
    (1 << 12, "bus error while a frame was stacked"),
    (1 << 13, "bus error while floating-point registers were stacked"),
    (1 << 16, "undefined instruction"),
    (1 << 17, "invalid state: a jump to an even address"),
    (1 << 18, "invalid return from an exception"),
    (1 << 19, "coprocessor instruction, and no coprocessor"),
    (1 << 24, "unaligned access"),
    (1 << 25, "division by zero"),
];
const MMAR_VALID: u32 = 1 << 7;
const BFAR_VALID: u32 = 1 << 15;
const STACKING: u32 = 1 << 4 | 1 << 12;
/// First address of the stack's RAM, and one past its last (memory.x).
const STACK: std::ops::Range<u32> = 0x2000_0000..0x2000_4000;

/// What the fault registers say.
#[must_use]
pub fn decode(r: &Registers) -> String {
    let at = |status: u32| match status {
        0x02 if r.cfsr & MMAR_VALID != 0 => format!(" at address {:#010x}", r.mmfar),
        0x200 if r.cfsr & BFAR_VALID != 0 => format!(" at address {:#010x}", r.bfar),
        _ => String::new(),
    };
    let mut found: Vec<String> = STATUS.iter().filter(|s| r.cfsr & s.0 != 0).map(|(bit, words)| words.replace('@', &at(*bit))).collect();
    if r.hfsr & 1 << 1 != 0 {
        found.push("bus error while the vector table was read".to_owned());
    }
    if r.hfsr & 1 << 31 != 0 {
        found.push("breakpoint without a debugger".to_owned());
    }
    if found.is_empty() {
        found.push("hard fault, and its registers name no reason".to_owned());
    }
    let text = found.join("; ");
    if r.cfsr & STACKING != 0 || r.sp != 0 && !STACK.contains(&r.sp) {
        return format!("stack overflow: the stack left its RAM (SP {:#010x}); {text}", r.sp);
    }
    text
}

/// What ended a run, in words.
#[must_use]
pub fn what(note: &Note) -> String {
    let exception = note.registers.xpsr & 0x1ff;
    match note.cause {
        Cause::None => "no fault".to_owned(),
        Cause::Panic => "panic: the program met what it says cannot be".to_owned(),
        Cause::Fault => decode(&note.registers),
        Cause::Stack => "stack overflow: the stack grew into its canary".to_owned(),
        Cause::Interrupt if exception == 2 => "the crystal stopped: the clock security system raised NMI".to_owned(),
        Cause::Interrupt if exception < 16 => format!("exception {exception} came, and nobody handles it"),
        Cause::Interrupt => format!("interrupt {} came, and nobody handles it", exception.saturating_sub(16)),
        Cause::Watchdog => "watchdog: the loop stood still, no cycle was finished in time".to_owned(),
        Cause::Supply => "brown-out: the supply fell below its level for a moment".to_owned(),
    }
}

/// What the chip flags of a reset, in words.
#[must_use]
pub fn reset(flags: u8) -> String {
    // Every reset pulls the pin, and a power-up passes the brown-out level.
    let hidden = flag::PIN | if flags & flag::POWER == 0 { 0 } else { flag::BROWN_OUT };
    let shown = if flags == flag::PIN { flags } else { flags & !hidden };
    let words: Vec<&str> = [
        (flag::POWER, "power-up"),
        (flag::BROWN_OUT, "brown-out"),
        (flag::SOFTWARE, "its program"),
        (flag::WATCHDOG, "the watchdog"),
        (flag::WINDOW, "the window watchdog"),
        (flag::LOW_POWER, "a low-power mode it may not enter"),
        (flag::PIN, "its reset pin"),
    ]
    .into_iter()
    .filter_map(|(bit, word)| (shown & bit != 0).then_some(word))
    .collect();
    if words.is_empty() { "a reset without a flag (an emulator)".to_owned() } else { words.join(", ") }
}

/// Name of a phase.
#[must_use]
pub fn phase(number: u8) -> String {
    postcard::from_bytes::<Phase>(&[number]).map_or_else(|_| number.to_string(), |phase| format!("{phase:?}"))
}

/// Name of an abort; none: there was none.
#[must_use]
pub fn abort(number: u8) -> Option<String> {
    (number != u8::MAX).then(|| postcard::from_bytes::<Abort>(&[number]).map_or_else(|_| number.to_string(), |abort| format!("{abort:?}")))
}

/// A version as people write it.
#[must_use]
pub fn version(firmware: [u8; 3]) -> String {
    firmware.map(|n| n.to_string()).join(".")
}

/// The last cycles as a table of at most 80 columns, with its head.
#[must_use]
pub fn rows(cycles: &[Cycle]) -> Vec<String> {
    let mut rows = vec!["   time s     seq phase       abort           dives depth m pitch° ballast flags".to_owned()];
    rows.extend(cycles.iter().map(|c| {
        format!(
            "{:>9.1} {:>7} {:<11} {:<15} {:>5} {:>7.1} {:>6.1} {:>7.1} {:>5x}",
            f64::from(c.time_cs) / 100.0,
            c.seq,
            phase(c.phase),
            abort(c.abort).unwrap_or_else(|| "-".to_owned()),
            c.dives,
            c.depth_m,
            c.pitch_setpoint_rad.to_degrees(),
            c.ballast_m3 * 1e6,
            c.flags
        )
    }));
    rows
}

/// The last cycles for a program.
#[must_use]
pub fn documents(cycles: &[Cycle]) -> Vec<Value> {
    let document = |c: &Cycle| {
        json!({ "time_s": f64::from(c.time_cs) / 100.0, "seq": c.seq, "phase": phase(c.phase), "abort": abort(c.abort), "dives": c.dives,
            "depth_m": c.depth_m, "pitch_aimed_deg": c.pitch_setpoint_rad.to_degrees(), "ballast_cc": c.ballast_m3 * 1e6, "flags": c.flags })
    };
    cycles.iter().map(document).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use helm::black_box::{BlackBox, WORDS};
    use signals::Answer;
    use signals::autopsy::CALLERS;

    fn registers(cfsr: u32, hfsr: u32) -> Registers {
        Registers { cfsr, hfsr, mmfar: 0x1000_0000, bfar: 0x6000_0000, sp: 0x2000_3f00, ..Registers::default() }
    }

    #[test]
    fn fault_registers_are_said_in_words() {
        for (cfsr, hfsr, words) in [
            (0x8200, 1 << 30, "precise data bus error at address 0x60000000"),
            (0x0200, 1 << 30, "precise data bus error"),
            (0x0400, 1 << 30, "imprecise data bus error: a write some instructions before the PC"),
            (0x0082, 1 << 30, "access to protected memory at address 0x10000000"),
            (1 << 16, 1 << 30, "undefined instruction"),
            (1 << 17, 1 << 30, "invalid state: a jump to an even address"),
            (1 << 25, 1 << 30, "division by zero"),
            (0x0101, 0, "an instruction was fetched from where no code may run; bus error on an instruction fetch"),
            (0, 1 << 1, "bus error while the vector table was read"),
            (0, 1 << 30, "hard fault, and its registers name no reason"),
        ] {
            assert_eq!(decode(&registers(cfsr, hfsr)), words, "{cfsr:#x} {hfsr:#x}");
        }
        let below = Registers { sp: 0x1fff_ff80, ..registers(0x9200, 1 << 30) };
        assert!(decode(&below).starts_with("stack overflow: the stack left its RAM (SP 0x1fffff80)"), "{}", decode(&below));
        assert!(decode(&registers(0x1000, 0)).starts_with("stack overflow"));
        let note = |cause, xpsr| what(&Note { cause, registers: Registers { xpsr, ..Registers::default() }, ..Note::default() });
        assert!(note(Cause::Interrupt, 2).starts_with("the crystal stopped"));
        assert_eq!(note(Cause::Interrupt, 44), "interrupt 28 came, and nobody handles it");
        assert!(note(Cause::Watchdog, 0).starts_with("watchdog: the loop stood still"));
    }

    #[test]
    fn the_flags_of_a_reset_are_said_without_those_that_every_reset_sets() {
        assert_eq!(reset(flag::POWER | flag::BROWN_OUT | flag::PIN), "power-up");
        assert_eq!(reset(flag::PIN), "its reset pin");
        assert_eq!(reset(flag::WATCHDOG | flag::PIN), "the watchdog");
        assert_eq!(reset(flag::BROWN_OUT | flag::PIN), "brown-out");
        assert_eq!(reset(0), "a reset without a flag (an emulator)");
    }

    /// Bytes of a board whose run of 70 cycles a fault ended.
    fn bytes() -> Vec<u8> {
        let mut memory = [0; WORDS];
        for (flags, fault) in [(flag::POWER, true), (flag::SOFTWARE, false)] {
            let mut recorder = BlackBox::new(memory);
            recorder.open(flags, [0, 1, 0], 0xabcd);
            if fault {
                for seq in 0..70 {
                    let mut answer = Answer::default();
                    answer.command.seq = seq;
                    recorder.cycle(&answer, 4_000 * u64::from(seq));
                }
                recorder.fault(Cause::Fault, registers(0x8200, 1 << 30), [0; CALLERS], 280_000);
                memory = *recorder.memory();
            } else {
                let mut all = vec![0; 4 * (NOTE + RUN)];
                assert_eq!(recorder.read(0, &mut all) as usize, all.len());
                return all;
            }
        }
        unreachable!("the second run returns")
    }

    #[test]
    fn a_record_is_read_whole_and_a_damaged_one_is_nothing_kept() {
        let whole = Autopsy::read(&bytes()).expect("a record").expect("bytes");
        let fault = whole.fault.clone().expect("kept");
        assert_eq!((fault.note.cause, fault.note.time_cs, whole.is_damaged), (Cause::Fault, 28_000, false));
        assert_eq!(fault.cycles.iter().map(|c| c.seq).collect::<Vec<_>>(), (6..70).collect::<Vec<_>>());
        assert!(rows(&fault.cycles).iter().all(|row| row.chars().count() <= 80));
        let mut damaged = bytes();
        damaged[4 * NOTE + 50] ^= 4;
        let damaged = Autopsy::read(&damaged).expect("a record").expect("bytes");
        assert_eq!((damaged.fault, damaged.is_damaged), (None, true));
        let mut cycle = bytes();
        cycle[8 * NOTE + 9] ^= 4;
        assert_eq!(Autopsy::read(&cycle).expect("a record").expect("bytes").fault.expect("kept").cycles.len(), 63, "one cycle is lost");
        assert!(Autopsy::read(&bytes()[..100]).expect_err("cut").to_string().contains("--out"));
        assert_eq!(Autopsy::read(&[]).expect("nothing"), None);
        let clean = Autopsy::read(&bytes()[..4 * NOTE]).expect("a record").expect("bytes");
        assert_eq!((clean.fault, clean.is_damaged, clean.present.map(|n| n.run)), (None, false, Some(1)));
    }
}

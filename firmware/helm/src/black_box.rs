//! What is kept of two runs in RAM that a reset does not clear: the present one, and the last one that a fault ended.
//!
//! A run that ends without a fault gives its place to the next one; the record of a fault stays until the next fault or the next
//! power cut, whatever is flown in between. Layout: [`signals::autopsy`].

use signals::Answer;
use signals::autopsy::{CALLERS, CYCLE, CYCLES, Cause, Cycle, NOTE, Note, RUN, Registers};

/// Words of memory for two runs.
pub const WORDS: usize = 2 * RUN;

/// [`WORDS`] words that a reset leaves alone. What is beyond them reads 0 and takes nothing.
pub trait Memory {
    /// The word at a place.
    fn get(&self, at: usize) -> u32;
    /// Writes the word at a place.
    fn set(&mut self, at: usize, word: u32);
}

/// The recorder.
#[derive(Debug)]
pub struct BlackBox<M> {
    memory: M,
    /// Until it is opened nothing is written: what is there has not been looked at.
    open: bool,
    /// Which half is that of the present run; the other one holds the fault, if there was one.
    second: bool,
    is_kept: bool,
    cycles: usize,
}

impl<M: Memory> BlackBox<M> {
    /// Not open yet.
    pub const fn new(memory: M) -> Self {
        Self { memory, open: false, second: false, is_kept: false, cycles: 0 }
    }

    /// Begins a run: `began` are the flags of its reset, `image` the identity of its image. Returns what is kept of a fault.
    pub fn open(&mut self, began: u8, firmware: [u8; 3], image: u32) -> Option<Note> {
        let notes = [self.note(false), self.note(true)];
        let [first, second] = notes;
        // The newest run is the one that has just ended.
        let ended_second = match (first, second) {
            (Some(a), Some(b)) => b.run > a.run,
            (None, Some(_)) => true,
            _ => false,
        };
        let ended = if ended_second { second } else { first };
        let mut kept = if ended_second { first } else { second }.filter(|note| note.cause != Cause::None);
        self.second = ended_second;
        if let Some(mut note) = ended {
            if note.cause == Cause::None {
                note.cause = Cause::by_flags(began);
            }
            if note.cause != Cause::None {
                note.ended = began;
                self.write(ended_second, &note);
                kept = Some(note);
                self.second = !ended_second;
            }
        }
        self.is_kept = kept.is_some();
        let run = ended.map_or(0, |note| note.run.saturating_add(1));
        let start = start(self.second);
        (0..RUN).for_each(|i| self.memory.set(start.saturating_add(i), 0));
        self.write(self.second, &Note { run, began, firmware, image, ..Note::default() });
        self.cycles = 0;
        self.open = true;
        kept
    }

    /// The memory, as it lies there.
    pub const fn memory(&self) -> &M {
        &self.memory
    }

    /// Keeps a finished cycle in place of the oldest.
    pub fn cycle(&mut self, answer: &Answer, now_ms: u64) {
        if self.open {
            let at = start(self.second).saturating_add(NOTE).saturating_add((self.cycles % CYCLES).saturating_mul(CYCLE));
            let words = Cycle::of(answer, hundredths(now_ms)).words();
            words.iter().enumerate().for_each(|(i, word)| self.memory.set(at.saturating_add(i), *word));
            self.cycles = self.cycles.wrapping_add(1);
        }
    }

    /// Notes what ends the present run.
    pub fn fault(&mut self, cause: Cause, registers: Registers, callers: [u32; CALLERS], now_ms: u64) {
        if self.open
            && let Some(note) = self.note(self.second)
        {
            self.write(self.second, &Note { cause, registers, callers, time_cs: hundredths(now_ms), ..note });
        }
    }

    /// Copies from byte `at` on what may be read; returns its whole length, bytes.
    pub fn read(&self, at: u32, out: &mut [u8]) -> u32 {
        let words = match (self.open, self.is_kept) {
            (false, _) => 0,
            (true, false) => NOTE,
            (true, true) => NOTE + RUN,
        };
        for (i, byte) in out.iter_mut().enumerate() {
            let place = (at as usize).saturating_add(i);
            let word = place / 4;
            if word >= words {
                break;
            }
            let (second, word) = if word < NOTE { (self.second, word) } else { (!self.second, word.saturating_sub(NOTE)) };
            let bytes = self.memory.get(start(second).saturating_add(word)).to_le_bytes();
            *byte = bytes.get(place % 4).copied().unwrap_or_default();
        }
        (words * 4) as u32
    }

    fn note(&self, second: bool) -> Option<Note> {
        let mut words = [0; NOTE];
        let start = start(second);
        words.iter_mut().enumerate().for_each(|(i, word)| *word = self.memory.get(start.saturating_add(i)));
        Note::read(&words)
    }

    fn write(&mut self, second: bool, note: &Note) {
        let start = start(second);
        note.words().iter().enumerate().for_each(|(i, word)| self.memory.set(start.saturating_add(i), *word));
    }
}

const fn start(second: bool) -> usize {
    if second { RUN } else { 0 }
}

/// Hundredths of a second: in 32 bits for longer than any mission.
fn hundredths(ms: u64) -> u32 {
    u32::try_from(ms / 10).unwrap_or(u32::MAX)
}

impl Memory for [u32; WORDS] {
    fn get(&self, at: usize) -> u32 {
        <[u32]>::get(self, at).copied().unwrap_or_default()
    }
    fn set(&mut self, at: usize, word: u32) {
        if let Some(place) = self.get_mut(at) {
            *place = word;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use signals::autopsy::flag;

    const FLAGS: Registers = Registers { cfsr: 0x8200, hfsr: 0, mmfar: 0, bfar: 0, sp: 0, pc: 0x0800_1234, lr: 0, xpsr: 0 };

    /// The chip after a reset: what is in RAM stays, the recorder begins anew.
    fn reset(before: BlackBox<[u32; WORDS]>, flags: u8) -> (BlackBox<[u32; WORDS]>, Option<Note>) {
        let mut next = BlackBox::new(before.memory);
        let kept = next.open(flags, [0, 1, 0], 0xabcd);
        (next, kept)
    }

    fn fly(recorder: &mut BlackBox<[u32; WORDS]>, cycles: u32) {
        for seq in 0..cycles {
            let mut answer = Answer::default();
            answer.command.seq = seq;
            recorder.cycle(&answer, u64::from(seq) * 4_000);
        }
    }

    /// What a host gets: the bytes in pieces, as words.
    fn words(recorder: &BlackBox<[u32; WORDS]>) -> Vec<u32> {
        let mut bytes = vec![];
        loop {
            let mut piece = [0; 100];
            let length = recorder.read(bytes.len() as u32, &mut piece) as usize;
            let more = piece.len().min(length - bytes.len());
            bytes.extend_from_slice(&piece[..more]);
            if more == 0 {
                return bytes.chunks(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
            }
        }
    }

    #[test]
    fn noise_is_nothing_and_a_clean_run_leaves_nothing() {
        let mut noise = [0; WORDS];
        let mut x = 1u32;
        noise.iter_mut().for_each(|word| {
            x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *word = x;
        });
        let (mut first, kept) = reset(BlackBox::new(noise), flag::POWER | flag::BROWN_OUT | flag::PIN);
        assert_eq!((kept, words(&first).len()), (None, NOTE));
        fly(&mut first, 10);
        let (second, kept) = reset(first, flag::PIN);
        assert_eq!(kept, None);
        let present = Note::read(words(&second)[..].try_into().unwrap()).unwrap();
        assert_eq!((present.run, present.began, present.image), (1, flag::PIN, 0xabcd));
        // A fault is written into a whole note only.
        let mut hurt = second;
        [0, RUN].into_iter().for_each(|at| hurt.memory[at] ^= 1);
        hurt.fault(Cause::Fault, FLAGS, [0; CALLERS], 0);
        assert_eq!(reset(hurt, flag::SOFTWARE).1, None);
    }

    #[test]
    fn a_fault_is_kept_with_its_last_cycles_until_the_next_one() {
        let (mut first, _) = reset(BlackBox::new([0; WORDS]), flag::POWER);
        fly(&mut first, 100);
        first.fault(Cause::Fault, FLAGS, [0; CALLERS], 400_120);
        let (mut second, kept) = reset(first, flag::SOFTWARE);
        let note = kept.unwrap();
        assert_eq!(
            (note.cause, note.run, note.time_cs, note.ended, note.registers.pc),
            (Cause::Fault, 0, 40_012, flag::SOFTWARE, FLAGS.pc)
        );
        fly(&mut second, 200);
        // Resets by its pin, and flights after them, leave it.
        let (mut third, kept) = reset(second, flag::PIN);
        assert_eq!(kept, Some(note));
        fly(&mut third, 3);
        let (mut fourth, kept) = reset(third, flag::PIN);
        assert_eq!(kept, Some(note));
        let all = words(&fourth);
        assert_eq!(all.len(), NOTE + RUN);
        assert_eq!(Note::read(all[NOTE..2 * NOTE].try_into().unwrap()), Some(note));
        let mut cycles: Vec<u32> = all[2 * NOTE..].chunks(CYCLE).map(|c| Cycle::read(c.try_into().unwrap()).expect("whole").seq).collect();
        cycles.sort_unstable();
        assert_eq!(cycles, (36..100).collect::<Vec<_>>());
        // The next fault takes its place.
        fly(&mut fourth, 2);
        let (fifth, kept) = reset(fourth, flag::WATCHDOG | flag::PIN);
        assert_eq!(kept.map(|note| (note.cause, note.run)), Some((Cause::Watchdog, 3)));
        let cycles = words(&fifth)[2 * NOTE..].chunks(CYCLE).filter_map(|c| Cycle::read(c.try_into().unwrap())).count();
        assert_eq!(cycles, 2, "cycles of other runs are none of this one");
    }

    #[test]
    fn a_damaged_record_is_nothing_and_nothing_is_written_before_it_is_open() {
        for bit in (0..32 * NOTE).step_by(7) {
            let (mut first, _) = reset(BlackBox::new([0; WORDS]), flag::POWER);
            first.fault(Cause::Panic, FLAGS, [0; CALLERS], 5);
            first.memory[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(reset(first, flag::SOFTWARE).1, None, "bit {bit}");
        }
        let mut closed = BlackBox::new([7; WORDS]);
        closed.cycle(&Answer::default(), 0);
        closed.fault(Cause::Panic, FLAGS, [0; CALLERS], 0);
        assert_eq!((closed.memory, closed.read(0, &mut [0; 9])), ([7; WORDS], 0));
    }
}

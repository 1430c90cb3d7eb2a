//! Whether the stack stayed where it belongs: words of a pattern at the end of
//! its RAM, below which an overflow is a fault.

use super::last_words::{Cause, reset};

const PATTERN: u32 = 0x5afe_57ac;
const CANARY_WORDS: usize = 16;

unsafe extern "C" {
    /// First address of RAM, from `memory.x`.
    static mut _stack_end: u32;
}

/// Lays the pattern. Call first, from the shallowest stack there is.
pub fn lay() {
    for i in 0..CANARY_WORDS {
        // SAFETY: the stack is proven not to reach this far, and nothing else lies here.
        unsafe { (&raw mut _stack_end).add(i).write_volatile(PATTERN) };
    }
}

/// Resets into SAFE if the stack has reached the pattern.
pub fn check() {
    // SAFETY: as in `lay`.
    let intact = (0..CANARY_WORDS).all(|i| unsafe { (&raw const _stack_end).add(i).read_volatile() } == PATTERN);
    if !intact {
        reset(Cause::Stack);
    }
}

//! Whether the stack stayed where it belongs: words of a pattern between the
//! statics and the deepest the stack may reach.

use super::last_words::{Cause, reset};

const PATTERN: u32 = 0x5afe_57ac;
const WORDS: usize = 16;

unsafe extern "C" {
    /// End of the statics, from cortex-m-rt's linker script.
    static mut __sheap: u32;
}

/// Lays the pattern. Call first, from the shallowest stack there is.
pub fn lay() {
    for i in 0..WORDS {
        // SAFETY: the RAM between the statics and the stack belongs to nobody else; there is no heap.
        unsafe { (&raw mut __sheap).add(i).write_volatile(PATTERN) };
    }
}

/// Resets into SAFE if the stack has reached the pattern.
pub fn check() {
    // SAFETY: as in `lay`.
    let intact = (0..WORDS).all(|i| unsafe { (&raw const __sheap).add(i).read_volatile() } == PATTERN);
    if !intact {
        reset(Cause::Stack);
    }
}

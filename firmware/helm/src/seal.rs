//! Whether memory still is as it was left: a sum over it, taken after a step and checked before the next.
//!
//! A controller rests 99.9 % of its time, so that is when a bit flips. Every value is looked at as words of memory, before any
//! code takes it for a number, a length or the tag of an enumeration.

// The one place of this room that looks at memory as such.
#![allow(unsafe_code)]

/// Two sums over a value's words, as Fletcher's: the first finds every flip of one bit, the second words that changed places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Sum(u32, u32);

impl Sum {
    /// That of nothing.
    pub(crate) const NONE: Self = Self(0, 0);

    /// Over the memory of `value`, gaps between its fields included: nothing writes them between two sums.
    #[inline(never)]
    pub(crate) fn over<T>(value: &T) -> Self {
        const { assert!(align_of::<T>() >= align_of::<u32>()) };
        let first = (&raw const *value).cast::<u32>();
        let (mut a, mut b) = (0x5EA1_ED00u32, 0u32);
        for word in 0..size_of::<T>() / size_of::<u32>() {
            // SAFETY: inside `value` and aligned; a volatile read takes what lies there, whatever it means.
            a = a.wrapping_add(unsafe { first.add(word).read_volatile() });
            b = b.wrapping_add(a);
        }
        Self(a, b)
    }
}

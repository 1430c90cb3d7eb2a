//! Watches broken on purpose: trials of whoever judges the law.
//!
//! With the feature `mutants` one watch at a time can be made blind, or to wait
//! twice as long; a campaign that does not notice is not worth much. Without the
//! feature (the flight image) every hook is a constant and none of this exists.

macro_rules! watches {
    ($(#[doc = $words:literal] $name:ident = $waits:literal,)*) => {
        /// What looks for one kind of fault, or acts on it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum Watch { $(#[doc = $words] $name,)* }
        impl Watch {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$name,)*];
            /// Whether it waits before it acts.
            #[must_use]
            pub const fn waits(self) -> bool { match self { $(Self::$name => $waits,)* } }
            /// What it looks for, and what it does.
            #[must_use]
            pub const fn words(self) -> &'static str { match self { $(Self::$name => $words.trim_ascii(),)* } }
        }
    };
}

watches! {
    /// Leak detector, three samples of five: abort.
    Leak = false,
    /// Leak detector that does not answer: home.
    Detector = true,
    /// Hull vacuum: abort.
    Vacuum = false,
    /// Battery voltage: abort.
    Volts = false,
    /// Charge: abort.
    Charge = false,
    /// No depth: abort.
    NoDepth = true,
    /// One of two depth sensors lost: come home.
    Unbacked = true,
    /// Two depths apart: abort.
    DepthsApart = true,
    /// Afloat with a depth that says otherwise: abort.
    AfloatOffset = false,
    /// Too deep: abort.
    OverDepth = false,
    /// A depth that does not move: abort.
    DepthStuck = true,
    /// Bound of depth drift since the last surfacing: dive ends.
    DriftEndsDive = false,
    /// The same: surface.
    DriftSurfaces = false,
    /// A load in a dive: turn.
    LoadInDive = true,
    /// A load in a climb: pump, abort, weight.
    LoadInClimb = true,
    /// No pitch for too long: abort.
    PitchLost = true,
    /// A pitch that stands still: not used.
    PitchStill = true,
    /// A pitch opposed to pump and battery: not used.
    PitchOpposed = true,
    /// No heading: home.
    HeadingLost = true,
    /// No pump feedback: abort.
    PumpFeedback = true,
    /// Pump that runs the wrong way: abort.
    PumpAway = false,
    /// Pump without way: retries, abort.
    PumpTries = true,
    /// Battery that runs the wrong way: abort.
    MassAway = false,
    /// Battery without way: stopped.
    MassStops = true,
    /// Battery stopped for long: abort.
    MassLost = true,
    /// Fin away from its command: abort.
    Fin = true,
    /// Sinking on with the pump out: abort, weight.
    SinksOn = true,
    /// At the depth at risk: weight.
    AtRisk = false,
    /// A leak far below: weight.
    LeakWeight = false,
    /// No depth and no pump: weight.
    BlindWeight = false,
    /// No metre gained since the abort: weight.
    NotRising = true,
    /// Floats below the surface: abort.
    FloatsBelow = true,
    /// The weight went by itself: abort.
    WeightLost = false,
    /// A dive without way: turned round.
    DiveNoWay = true,
    /// A climb without way: abort.
    ClimbNoWay = true,
}

/// How one watch is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mutant {
    /// It does nothing.
    Blind(Watch),
    /// It waits twice as long.
    Slow(Watch),
}

impl Mutant {
    /// All there are.
    pub fn all() -> impl Iterator<Item = Self> {
        let slow = Watch::ALL.iter().filter(|w| w.waits()).map(|w| Self::Slow(*w));
        Watch::ALL.iter().map(|w| Self::Blind(*w)).chain(slow)
    }
}

#[cfg(feature = "mutants")]
mod active {
    use super::{Mutant, Watch};
    use core::sync::atomic::{AtomicU64, Ordering};

    /// A bit for each watch.
    static BLIND: AtomicU64 = AtomicU64::new(0);
    static SLOW: AtomicU64 = AtomicU64::new(0);

    /// Breaks the law of this whole process in all these ways, or mends it where there are none.
    pub fn set(mutants: &[Mutant]) {
        let (mut blind, mut slow) = (0, 0);
        for mutant in mutants {
            match *mutant {
                Mutant::Blind(w) => blind |= 1 << w as u8,
                Mutant::Slow(w) => slow |= 1 << w as u8,
            }
        }
        BLIND.store(blind, Ordering::Relaxed);
        SLOW.store(slow, Ordering::Relaxed);
    }

    impl Watch {
        pub(crate) fn enabled(self) -> bool {
            BLIND.load(Ordering::Relaxed) >> self as u8 & 1 == 0
        }

        pub(crate) fn after(self, s: f32) -> f32 {
            if SLOW.load(Ordering::Relaxed) >> self as u8 & 1 == 1 { 2.0 * s } else { s }
        }
    }
}

#[cfg(feature = "mutants")]
pub use active::set;

#[cfg(not(feature = "mutants"))]
impl Watch {
    /// Whether it does its work.
    #[inline(always)]
    pub(crate) const fn enabled(self) -> bool {
        true
    }

    /// How long it waits, s.
    #[inline(always)]
    pub(crate) const fn after(self, s: f32) -> f32 {
        s
    }
}

//! Work that its caller may stop, a person at a keyboard say. The flag goes with the thread that works; threads that it starts take it over.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that is up once the end of the work is asked for.
pub type Flag = Arc<AtomicBool>;

/// What work that was stopped unwinds with.
#[derive(Clone, Copy, Debug)]
pub struct Stopped;

thread_local! {
    static FLAG: RefCell<Option<Flag>> = const { RefCell::new(None) };
}

/// The flag of this thread's work.
#[must_use]
pub fn flag() -> Option<Flag> {
    FLAG.with_borrow(Clone::clone)
}

/// From now on this thread's work ends when this flag is up.
pub fn heed(flag: Option<Flag>) {
    FLAG.set(flag);
}

/// Works under a flag, on whatever thread, which goes back to its own afterwards.
pub fn heeding<T>(flag: Option<Flag>, work: impl FnOnce() -> T) -> T {
    let own = FLAG.replace(flag);
    let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work));
    FLAG.set(own);
    done.unwrap_or_else(|e| std::panic::resume_unwind(e))
}

/// Ends the work of this thread, by unwinding with [`Stopped`], if that is asked for. Called wherever work of a second begins.
pub fn here() {
    if FLAG.with_borrow(|flag| flag.as_ref().is_some_and(|f| f.load(Ordering::Relaxed))) {
        std::panic::resume_unwind(Box::new(Stopped));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_goes_on_until_its_flag_is_up() {
        here();
        let flag = Flag::default();
        let of_work = flag.clone();
        let work = std::thread::spawn(move || {
            heed(Some(of_work));
            here();
            super::flag().expect("its own").store(true, Ordering::Relaxed);
            here();
        });
        let ended = work.join().expect_err("stopped");
        assert!(ended.is::<Stopped>() && flag.load(Ordering::Relaxed));
        here();
    }
}

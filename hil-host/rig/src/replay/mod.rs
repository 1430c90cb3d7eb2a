//! A recorded flight stepped through a law again, and compared bit by bit.
//!
//! [`record`] reads what was recorded, [`law`] opens the law that is asked (the one built here, an image in QEMU, a program, a
//! commit), [`play`] steps one through the other, [`difference`] says what differs in words, [`stepper`] goes to any time of a
//! flight, [`bisect`] finds the change between two laws.
//!
//! The sensors are those of the record. Up to the first order that differs, what the law says is what it would have said in the
//! flight; after it the vehicle would have flown on differently, and the recorded sensors are no longer its own.

pub mod bisect;
pub mod difference;
pub mod law;
pub mod play;
pub mod record;
pub mod stepper;

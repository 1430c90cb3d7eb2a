//! Who is at the other end of the line.

use signals::Micros;

/// The board at the other end of the line.
pub trait Backseat {
    /// Time passes to `now`; the board hears bytes and says some.
    ///
    /// # Errors
    /// The line is gone.
    fn pass(&mut self, now: Micros, heard: &[u8], said: &mut Vec<u8>) -> anyhow::Result<()>;
}

/// No board.
pub struct Nobody;

impl Backseat for Nobody {
    fn pass(&mut self, _: Micros, _: &[u8], _: &mut Vec<u8>) -> anyhow::Result<()> {
        Ok(())
    }
}

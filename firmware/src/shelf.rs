//! Where the board keeps uploaded objects, the mark of a mission and the log:
//! on the log flash where it answers, else in RAM.

use crate::board::black_box;
use crate::board::pins::Wait;
use crate::board::spi::Spi;
use devices::flash::Flash;
use helm::{Content, Kept, Mark, Storage, Vault};
use signals::{Answer, Object, Refusal, SensorFrame, Utc};

static mut VAULT: Vault<Flash<Spi, Wait>> = Vault::new();

/// The one storage of the board: a handle without a size, so that the
/// controller can be built at compile time.
pub struct Shelf(());

impl Shelf {
    /// The handle.
    ///
    /// # Safety
    /// At most one may exist, used by the main loop only.
    pub const unsafe fn new() -> Self {
        Self(())
    }

    /// Looks for the log flash; the mark on it, `None` if there is no part.
    #[inline(never)]
    pub fn open(&mut self, spi: Spi) -> Option<Mark> {
        let part = Flash::start(spi, Wait).ok()?;
        Some(self.vault().attach(part))
    }

    fn vault(&mut self) -> &mut Vault<Flash<Spi, Wait>> {
        // SAFETY: one handle exists (see `new`), borrowed mutably here.
        unsafe { &mut *(&raw mut VAULT) }
    }
}

impl Storage for Shelf {
    fn load(&mut self, object: Object, out: &mut Content) -> bool {
        self.vault().load(object, out)
    }
    fn save(&mut self, object: Object, bytes: &[u8]) -> Result<Kept, Refusal> {
        self.vault().save(object, bytes)
    }
    fn rollback(&mut self, object: Object) -> Result<Kept, Refusal> {
        self.vault().rollback(object)
    }
    fn mark(&mut self, mark: Mark) {
        self.vault().mark(mark);
    }
    fn begin_log(&mut self) {
        self.vault().begin_log();
    }
    fn log(&mut self, utc: Option<Utc>, frame: &SensorFrame, answer: &Answer) {
        self.vault().log(utc, frame, answer);
    }
    fn log_lost(&mut self) -> bool {
        self.vault().log_lost()
    }
    fn read_log(&mut self, at: u32, out: &mut [u8]) -> u32 {
        self.vault().read_log(at, out)
    }
    fn read_autopsy(&mut self, at: u32, out: &mut [u8]) -> u32 {
        black_box::read(at, out)
    }
}

//! Where the board keeps uploaded objects.

use helm::{Content, Kept, RamStorage, Storage};
use signals::{Object, Refusal};

static mut RAM: RamStorage = RamStorage::new();

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

    fn ram(&mut self) -> &mut RamStorage {
        // SAFETY: one handle exists (see `new`), borrowed mutably here.
        unsafe { &mut *(&raw mut RAM) }
    }
}

impl Storage for Shelf {
    fn load(&mut self, object: Object, out: &mut Content) -> bool {
        self.ram().load(object, out)
    }
    fn save(&mut self, object: Object, bytes: &[u8]) -> Result<Kept, Refusal> {
        self.ram().save(object, bytes)
    }
    fn rollback(&mut self, object: Object) -> Result<Kept, Refusal> {
        self.ram().rollback(object)
    }
}

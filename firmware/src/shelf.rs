//! Where the board keeps uploaded objects, the mark of a mission and the log:
//! on the log flash where it answers, else in RAM. Images of the firmware lie
//! on the chip's own flash.

use crate::board::black_box;
use crate::board::chip_flash::ChipFlash;
use crate::board::pins::Wait;
use crate::board::spi::Spi;
use devices::chip_flash::{Journal, Slots};
use devices::flash::Flash;
use helm::{Ask, Content, Kept, Mark, Storage, Vault, WithImages};
use signals::{Answer, Image, Object, Refusal, SensorFrame, Utc};
use store::image::Images;

type Kinds = WithImages<Vault<Flash<Spi, Wait>>, Journal<ChipFlash>, Slots<ChipFlash>>;

// SAFETY: the only handles; both are used by the one storage, one after the other.
static mut VAULT: Kinds =
    WithImages::new(Vault::new(), unsafe { Images::new(Journal::new(ChipFlash::new()), Slots::new(ChipFlash::new())) });

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

    /// Looks where the image of this identity stands, and for the log flash; the mark on it, `None` if there is no part.
    #[inline(never)]
    pub fn open(&mut self, spi: Spi, id: u32) -> Option<Mark> {
        self.vault().open(id);
        let part = Flash::start(spi, Wait).ok()?;
        Some(self.vault().rest.attach(part))
    }

    fn vault(&mut self) -> &mut Kinds {
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
    fn image(&self) -> Option<Image> {
        // SAFETY: as in `vault`, and only read.
        unsafe { (*(&raw const VAULT)).image() }
    }
    fn ask_images(&mut self, ask: Ask<'_>) -> Result<u32, Refusal> {
        self.vault().ask_images(ask)
    }
}

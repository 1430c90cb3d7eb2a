//! Images of the firmware beside what else is stored: [`store::image`] behind [`Storage`].

use crate::mark::Mark;
use crate::storage::{Ask, Content, Kept, Storage};
use embedded_storage::nor_flash::NorFlash;
use signals::{Answer, Image, Object, Older, Refusal, SensorFrame, Standing, Utc};
use store::image::{self, Error, Images};

/// A storage, and the images of a chip that runs one of them.
#[derive(Debug)]
pub struct WithImages<S, J, F> {
    /// Everything else.
    pub rest: S,
    /// The images.
    pub images: Images<J, F>,
    id: u32,
}

impl<S, J: NorFlash, F: NorFlash> WithImages<S, J, F> {
    /// Nothing is known of the images before [`WithImages::open`].
    pub const fn new(rest: S, images: Images<J, F>) -> Self {
        Self { rest, images, id: 0 }
    }

    /// Looks where the image that runs stands; `id` is its identity, reckoned over its own flash.
    pub fn open(&mut self, id: u32) {
        self.id = id;
        self.images.open();
    }
}

/// Why an image is not taken, on the line.
const fn refused(why: Error) -> Refusal {
    match why {
        Error::Length => Refusal::TooLong,
        Error::OutOfOrder => Refusal::OutOfOrder,
        Error::Corrupt => Refusal::Corrupt,
        Error::Board => Refusal::OtherBoard,
        Error::Older => Refusal::Older,
        Error::OnTrial => Refusal::OnTrial,
        Error::NothingBefore => Refusal::NothingBefore,
        _ => Refusal::Storage,
    }
}

impl<S: Storage, J: NorFlash, F: NorFlash> Storage for WithImages<S, J, F> {
    fn load(&mut self, object: Object, out: &mut Content) -> bool {
        self.rest.load(object, out)
    }
    fn save(&mut self, object: Object, bytes: &[u8]) -> Result<Kept, Refusal> {
        self.rest.save(object, bytes)
    }
    fn rollback(&mut self, object: Object) -> Result<Kept, Refusal> {
        self.rest.rollback(object)
    }
    fn mark(&mut self, mark: Mark) {
        self.rest.mark(mark);
    }
    fn begin_log(&mut self) {
        self.rest.begin_log();
    }
    fn log(&mut self, utc: Option<Utc>, frame: &SensorFrame, answer: &Answer) {
        self.rest.log(utc, frame, answer);
    }
    fn log_lost(&mut self) -> bool {
        self.rest.log_lost()
    }
    fn read_log(&mut self, at: u32, out: &mut [u8]) -> u32 {
        self.rest.read_log(at, out)
    }
    fn read_autopsy(&mut self, at: u32, out: &mut [u8]) -> u32 {
        self.rest.read_autopsy(at, out)
    }

    fn image(&self) -> Option<Image> {
        let standing = match self.images.standing() {
            image::Standing::Flashed => Standing::Flashed,
            image::Standing::Confirmed => Standing::Confirmed,
            image::Standing::Trial(boots_left) => Standing::Trial { boots_left },
            image::Standing::RolledBack => Standing::RolledBack,
            image::Standing::Leaving => Standing::Leaving,
        };
        Some(Image { id: self.id, standing })
    }

    #[inline(never)]
    fn ask_images(&mut self, ask: Ask<'_>) -> Result<u32, Refusal> {
        let images = &mut self.images;
        match ask {
            Ask::Begin(length) => images.begin(length).map(|()| 0),
            Ask::Piece(at, bytes) => images.piece(at, bytes),
            Ask::Commit { length, crc, older, running } => images.commit(length, crc, older == Older::Taken, running).map(u32::from),
            Ask::Abandon => {
                images.abandon();
                Ok(0)
            }
            Ask::Confirm => images.confirm(self.id).map(|()| 0),
            Ask::GoBack => images.go_back().map(|()| 0),
        }
        .map_err(refused)
    }
}

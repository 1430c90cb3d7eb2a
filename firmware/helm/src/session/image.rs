//! Images of the firmware over the line: staged on deck, installed by a restart, confirmed by a finished step.

use super::Helm;
use crate::objects;
use crate::storage::{Ask, Storage};
use crate::upload::Incoming;
use polar::Table;
use signals::{Object, Phase, Refusal, ToHost, Wings};

impl<S: Storage> Helm<S> {
    /// An upload begins; what was not complete of the one before is gone.
    #[inline(never)]
    pub(super) fn upload(&mut self, object: Object, length: u32, crc: u32) -> Result<u32, Refusal> {
        self.on_deck()?;
        let Object::Image(older) = object else {
            if self.incoming != Incoming::None {
                self.abandon();
            }
            return self.staging.begin(object, length, crc);
        };
        if let Incoming::Open { older: o, length: l, crc: c, there } = self.incoming
            && (o, l, c) == (older, length, crc)
        {
            return Ok(there); // asked again: go on where it stands
        }
        self.abandon();
        self.storage.ask_images(Ask::Begin(length))?;
        self.incoming = Incoming::Open { older, length, crc, there: 0 };
        Ok(0)
    }

    /// A piece of what is being uploaded.
    #[inline(never)]
    pub(super) fn piece(&mut self, offset: u32, data: &[u8]) -> Result<u32, Refusal> {
        self.on_deck()?;
        let Incoming::Open { length, there, .. } = &mut self.incoming else { return self.staging.chunk(offset, data) };
        if u32::try_from(data.len()).ok().and_then(|n| offset.checked_add(n)).is_none_or(|end| end > *length) {
            return Err(Refusal::TooLong);
        }
        *there = self.storage.ask_images(Ask::Piece(offset, data))?;
        Ok(*there)
    }

    pub(super) fn commit_image(&mut self) -> Result<ToHost, Refusal> {
        let crc = match self.incoming {
            Incoming::None => return Err(Refusal::OutOfOrder),
            Incoming::Closed { crc } => crc,
            Incoming::Open { older, length, crc, there } => {
                if there != length {
                    return Err(Refusal::OutOfOrder);
                }
                self.storage.ask_images(Ask::Commit { length, crc, older, running: self.firmware })?;
                self.incoming = Incoming::Closed { crc };
                crc
            }
        };
        Ok(ToHost::Done { crc })
    }

    /// Nothing half sent is kept.
    pub(super) fn abandon(&mut self) {
        self.staging.abandon();
        if self.incoming != Incoming::None {
            self.incoming = Incoming::None;
            let _ = self.storage.ask_images(Ask::Abandon);
        }
    }

    /// An image that has not flown a step on the bench flies no vehicle.
    pub(super) fn tried(&self) -> Result<(), Refusal> {
        match self.storage.image() {
            Some(image) if image.on_trial() => Err(Refusal::OnTrial),
            _ => Ok(()),
        }
    }

    pub(super) fn restart(&mut self) -> Result<ToHost, Refusal> {
        self.on_deck()?;
        self.restart = true;
        Ok(ToHost::Done { crc: 0 })
    }

    /// A restart is wanted, once.
    pub const fn take_restart(&mut self) -> bool {
        core::mem::replace(&mut self.restart, false)
    }

    /// A step is finished, its answer sent and written down: an image on trial whose tables can be read has proved itself. One in SAFE
    /// has not: that is what follows a reset in flight.
    pub(super) fn confirm_image(&mut self, phase: Phase) {
        if phase == Phase::Safe || self.tried().is_ok() {
            return;
        }
        let reads = |wings: Wings| Table::parse(objects::built_in(wings), wings).is_ok();
        if reads(Wings::Standard) && reads(Wings::LowAspectRatio) {
            // If its flash does not take it, the next step tries again.
            let _ = self.storage.ask_images(Ask::Confirm);
        }
    }
}

//! Objects over the line: what is uploaded is checked and kept, what is kept is rolled back or read back.

use super::Helm;
use crate::flight::Activity;
use crate::objects;
use crate::storage::{Ask, Content, Kept, Storage};
use crate::upload::Incoming;
use signals::messages::CHUNK;
use signals::{Object, Phase, Refusal, ToHost};

impl<S: Storage> Helm<S> {
    /// Objects change on deck only: not while a mission is armed or flown.
    pub(super) fn on_deck(&self) -> Result<(), Refusal> {
        match (&self.flight.activity, self.flight.phase()) {
            (Activity::Idle, _) | (_, Some(Phase::Done)) => Ok(()),
            (_, Some(Phase::Safe)) => Err(Refusal::Safe),
            _ => Err(Refusal::UnderWay),
        }
    }

    #[inline(never)]
    pub(super) fn commit(&mut self) -> Result<ToHost, Refusal> {
        self.on_deck()?;
        if self.incoming != Incoming::None {
            return self.commit_image();
        }
        if let Some((crc, kept)) = self.staging.just_taken() {
            return Ok(said(kept, crc));
        }
        let (object, crc, bytes) = self.staging.complete()?;
        let config = objects::select_config(&mut self.storage, &self.built_in);
        objects::check(object, bytes, &config)?;
        let kept = self.storage.save(object, bytes)?;
        self.staging.close(crc, kept);
        Ok(said(kept, crc))
    }

    #[inline(never)]
    pub(super) fn rollback(&mut self, object: Object) -> Result<ToHost, Refusal> {
        self.on_deck()?;
        self.abandon();
        if let Object::Image(_) = object {
            return self.storage.ask_images(Ask::GoBack).map(|_| ToHost::Done { crc: 0 });
        }
        let kept = self.storage.rollback(object)?;
        Ok(said(kept, objects::identity(&mut self.storage, &self.built_in, object)))
    }

    #[inline(never)]
    pub(super) fn read_back(&mut self, object: Object, offset: u32) -> Result<ToHost, Refusal> {
        let mut piece = [0; CHUNK];
        let length = match object {
            Object::Log => self.storage.read_log(offset, &mut piece),
            Object::Autopsy => self.storage.read_autopsy(offset, &mut piece),
            _ => {
                let mut bytes = Content::new();
                objects::in_use(&mut self.storage, &self.built_in, object, &mut bytes);
                let rest = bytes.get(offset as usize..).unwrap_or_default();
                piece.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
                bytes.len() as u32
            }
        };
        let offset = offset.min(length);
        let there = length.saturating_sub(offset) as usize;
        let mut data = heapless::Vec::new();
        piece.iter().take(there).try_for_each(|b| data.push(*b)).map_err(|_| Refusal::TooLong)?;
        Ok(ToHost::Content { offset, length, data })
    }
}

const fn said(kept: Kept, crc: u32) -> ToHost {
    match kept {
        Kept::ForGood => ToHost::Done { crc },
        Kept::UntilReset => ToHost::Volatile { crc },
    }
}

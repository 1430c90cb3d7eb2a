//! Which bytes are a usable object, and which one is in use.

use crate::storage::{Content, Storage};
use control::Config;
use polar::Table;
use signals::link::CRC32;
use signals::{Mission, Object, Refusal, Wings};

/// The table built into the image.
#[must_use]
pub fn built_in(_wings: Wings) -> &'static [u8] {
    &[]
}

/// Refuses an uploaded object that could not be flown.
///
/// # Errors
/// [`Refusal::WrongTable`], [`Refusal::Corrupt`] or why the mission is refused.
pub fn check(object: Object, bytes: &[u8], config: &Config) -> Result<(), Refusal> {
    match object {
        Object::Table(wings) => Table::parse(bytes, wings).map(|_| ()).map_err(|_| Refusal::WrongTable),
        Object::Mission => {
            let mission = mission(bytes).ok_or(Refusal::Corrupt)?;
            mission.validate(config.working_depth_m, config.pump_m3).map_err(Refusal::Mission)
        }
        Object::Config => Err(Refusal::Corrupt),
    }
}

/// A mission from its stored bytes (postcard).
#[must_use]
pub fn mission(bytes: &[u8]) -> Option<Mission> {
    match postcard::take_from_bytes(bytes) {
        Ok((mission, [])) => Some(mission),
        _ => None,
    }
}

/// Copies the table a mission would be flown with to `out`: the uploaded one
/// if it is good, else the built-in one. Returns its identity, 0 for none.
pub fn select_table(storage: &mut impl Storage, wings: Wings, out: &mut Content) -> u32 {
    if storage.load(Object::Table(wings), out)
        && let Ok(table) = Table::parse(out, wings)
    {
        return table.id();
    }
    out.clear();
    if out.extend_from_slice(built_in(wings)).is_err() {
        return 0;
    }
    Table::parse(out, wings).map_or(0, |table| table.id())
}

/// Copies what is in use of `object` to `out` for read-back; empty if nothing
/// is stored and nothing is built in.
pub fn in_use(storage: &mut impl Storage, object: Object, out: &mut Content) {
    match object {
        Object::Table(wings) => {
            select_table(storage, wings, out);
        }
        Object::Config | Object::Mission => {
            if !storage.load(object, out) {
                out.clear();
            }
        }
    }
}

/// CRC-32 of what is in use; 0 where there is nothing.
pub fn identity(storage: &mut impl Storage, object: Object) -> u32 {
    let mut bytes = Content::new();
    match object {
        Object::Table(wings) => select_table(storage, wings, &mut bytes),
        Object::Config | Object::Mission => {
            if storage.load(object, &mut bytes) {
                CRC32.checksum(&bytes)
            } else {
                0
            }
        }
    }
}

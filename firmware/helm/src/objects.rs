//! Which bytes are a usable object, and which one is in use.

use crate::limits;
use crate::storage::{Content, MAX_OBJECT, Storage, fill};
use control::{Config, config::Settings};
use evidence::History;
use polar::Table;
use signals::link::CRC32;
use signals::{Mission, Object, Refusal, Wings};

/// The table built into the image.
#[must_use]
pub const fn built_in(wings: Wings) -> &'static [u8] {
    match wings {
        Wings::Standard => polar::generated::STANDARD,
        Wings::LowAspectRatio => polar::generated::LOW_ASPECT_RATIO,
    }
}

/// Refuses an uploaded object that could not be flown.
///
/// # Errors
/// [`Refusal::WrongTable`], [`Refusal::Corrupt`], [`Refusal::Limit`] or why the mission is refused.
pub fn check(object: Object, bytes: &[u8], config: &Config) -> Result<(), Refusal> {
    match object {
        Object::Table(wings) => Table::parse(bytes, wings).map(|_| ()).map_err(|_| Refusal::WrongTable),
        Object::Mission => {
            let mission = mission(bytes).ok_or(Refusal::Corrupt)?;
            mission.validate(config.working_depth_m, config.pump_m3).map_err(Refusal::Mission)
        }
        Object::Config => {
            let config = config_of(bytes).ok_or(Refusal::Corrupt)?;
            limits::check(&config).map_err(|e| Refusal::Limit(e.limit))
        }
        Object::History => History::decode(bytes).map(|_| ()).ok_or(Refusal::Corrupt),
        Object::Log | Object::Autopsy | Object::Image(_) => Err(Refusal::Storage),
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

/// A configuration from its stored bytes (postcard of [`Settings`]), checked.
#[must_use]
pub fn config_of(bytes: &[u8]) -> Option<Config> {
    match postcard::take_from_bytes::<Settings>(bytes) {
        Ok((settings, [])) => Config::new(settings).ok(),
        _ => None,
    }
}

/// The stored form of a configuration.
pub fn config_bytes(config: &Config, out: &mut Content) {
    let mut buffer = [0u8; MAX_OBJECT];
    fill(out, postcard::to_slice(config.settings(), &mut buffer).unwrap_or_default());
}

/// The stored form of a mission.
pub fn mission_bytes(mission: &Mission, out: &mut Content) {
    let mut buffer = [0u8; MAX_OBJECT];
    fill(out, postcard::to_slice(mission, &mut buffer).unwrap_or_default());
}

/// CRC-32 of a configuration's stored form.
#[must_use]
pub fn config_id(config: &Config) -> u32 {
    let mut bytes = Content::new();
    config_bytes(config, &mut bytes);
    CRC32.checksum(&bytes)
}

/// CRC-32 of a mission's stored form.
#[must_use]
pub fn mission_id(mission: &Mission) -> u32 {
    let mut buffer = [0u8; MAX_OBJECT];
    postcard::to_slice(mission, &mut buffer).map_or(0, |bytes| CRC32.checksum(bytes))
}

/// Copies the uploaded table of `wings` to `out` if there is a good one, and
/// says its identity; else leaves `out` empty.
pub fn uploaded_table(storage: &mut impl Storage, wings: Wings, out: &mut Content) -> Option<u32> {
    if storage.load(Object::Table(wings), out)
        && let Ok(table) = Table::parse(out, wings)
    {
        return Some(table.id());
    }
    out.clear();
    None
}

/// Copies the table a mission would be flown with to `out`: the uploaded one
/// if it is good, else the built-in one. Returns its identity, 0 for none.
pub fn select_table(storage: &mut impl Storage, wings: Wings, out: &mut Content) -> u32 {
    if let Some(id) = uploaded_table(storage, wings, out) {
        return id;
    }
    fill(out, built_in(wings));
    Table::parse(out, wings).map_or(0, |table| table.id())
}

/// The configuration the next mission is flown with: the stored one if it is
/// good and within its limits, else `built_in`.
pub fn select_config(storage: &mut impl Storage, built_in: &Config) -> Config {
    let mut bytes = Content::new();
    if storage.load(Object::Config, &mut bytes)
        && let Some(config) = config_of(&bytes)
        && limits::check(&config).is_ok()
    {
        return config;
    }
    built_in.clone()
}

/// Copies what is in use of `object` to `out`; empty if nothing is stored and
/// nothing is built in.
pub fn in_use(storage: &mut impl Storage, built_in: &Config, object: Object, out: &mut Content) {
    match object {
        Object::Table(wings) => {
            select_table(storage, wings, out);
        }
        Object::Config => config_bytes(&select_config(storage, built_in), out),
        Object::Mission | Object::History | Object::Log | Object::Autopsy | Object::Image(_) => {
            if !storage.load(object, out) {
                out.clear();
            }
        }
    }
}

/// Identity of what is in use (of a table its own, else the CRC-32 of its
/// bytes); 0 where there is nothing.
pub fn identity(storage: &mut impl Storage, built_in: &Config, object: Object) -> u32 {
    let mut bytes = Content::new();
    if let Object::Table(wings) = object {
        return select_table(storage, wings, &mut bytes);
    }
    in_use(storage, built_in, object, &mut bytes);
    if bytes.is_empty() { 0 } else { CRC32.checksum(&bytes) }
}

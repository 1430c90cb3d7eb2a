//! Work that is dealt to machines in shards, kept item by item, and put together again.
//!
//! The plan of a campaign is a list of items that depends on its options alone. Each item has a key: the hash of all that goes into it, the
//! program included. What is done is kept under its key ([`kept`]), by whoever did it, so a run that is stopped or killed goes on where it
//! was ([`work`]); a [`shard`] does every n-th item and leaves its results as one file ([`part`]). Parts are merged by running the plan
//! with nothing but them: the report is that of one run, and does not depend on shards, their order, or breaks.

pub mod interned;
pub mod kept;
pub mod part;
pub mod shard;
pub mod work;

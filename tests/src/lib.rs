//! The room `tests`: see its Cargo.toml description.

pub mod gdb_stub;

//! The room `hydro`: see its Cargo.toml description.

pub mod effects;

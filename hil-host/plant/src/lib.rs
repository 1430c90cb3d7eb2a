//! The room `plant`: see its Cargo.toml description.

pub mod trials;

//! The room `plant`: see its Cargo.toml description.

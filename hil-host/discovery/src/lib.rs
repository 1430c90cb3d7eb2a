//! The room `discovery`: see its Cargo.toml description.

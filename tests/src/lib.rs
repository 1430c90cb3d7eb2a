//! The room `tests`: see its Cargo.toml description.

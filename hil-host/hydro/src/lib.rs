//! The room `hydro`: see its Cargo.toml description.

//! The room `helm`: see its Cargo.toml description.
#![cfg_attr(not(test), no_std)]

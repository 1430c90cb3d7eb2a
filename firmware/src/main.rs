//! Board image.
fn main() {}

//! The controller behind standard input and output: the bytes of the line in, its answers out.
//!
//! `glider replay FLIGHT --law PROGRAM` steps a recorded flight through it, `--law COMMIT` builds it from that commit's sources.

use control::Config;
use helm::{Boot, Helm, RamStorage};
use signals::encode;
use signals::link::MAX_WIRE;
use std::io::{Read, Write};

fn main() -> std::io::Result<()> {
    let mut helm = Helm::new(Config::default(), Boot::default(), RamStorage::default());
    let (mut input, mut output) = (std::io::stdin().lock(), std::io::stdout().lock());
    let mut bytes = [0; 4096];
    loop {
        let n = input.read(&mut bytes)?;
        if n == 0 {
            return Ok(());
        }
        for byte in bytes.iter().take(n) {
            if let Some(answer) = helm.byte(*byte) {
                let mut wire = [0; MAX_WIRE];
                if let Ok(n) = encode(&answer, &mut wire) {
                    output.write_all(wire.get(..n).unwrap_or_default())?;
                }
            }
        }
        output.flush()?;
    }
}

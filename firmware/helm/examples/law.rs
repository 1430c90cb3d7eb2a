//! The controller behind standard input and output: the bytes of the line in, its answers out.
//!
//! `glider replay FLIGHT --law PROGRAM` steps a recorded flight through it, `--law COMMIT` builds it from that commit's sources.

use control::Config;
use helm::{Boot, Helm, RamStorage};
use signals::link::MAX_WIRE;
use signals::{Receiver, Refusal, Reply, Request, ToHost, WireError, encode};
use std::io::{Read, Write};

fn main() -> std::io::Result<()> {
    let mut helm = Helm::new(Config::default(), Boot::default(), RamStorage::default());
    let mut heard = Receiver::new();
    let (mut input, mut output) = (std::io::stdin().lock(), std::io::stdout().lock());
    let mut bytes = [0; 4096];
    loop {
        let n = input.read(&mut bytes)?;
        if n == 0 {
            return Ok(());
        }
        for byte in bytes.iter().take(n) {
            // A frame of another version of the line: any frame of this one says which it is.
            let other = matches!(heard.push::<Request>(*byte), Some(Err(WireError::Version(_))));
            let refused = other.then_some(Reply { to: 0, message: ToHost::Refused(Refusal::NotNow) });
            if let Some(answer) = helm.byte(*byte).or(refused) {
                let mut wire = [0; MAX_WIRE];
                if let Ok(n) = encode(&answer, &mut wire) {
                    output.write_all(wire.get(..n).unwrap_or_default())?;
                }
            }
        }
        output.flush()?;
    }
}

//! One byte of a port that never waits: the board's line, compass and GPS receiver.

use embedded_io::{Read, ReadReady};

/// The next byte that has come; none where none has, or the port fails.
pub fn next_byte<U: Read + ReadReady>(port: &mut U) -> Option<u8> {
    let mut byte = [0; 1];
    let came = port.read_ready().unwrap_or(false) && port.read(&mut byte).unwrap_or(0) > 0;
    let [byte] = byte;
    came.then_some(byte)
}

//! Which attitude holds: sentences of the compass, byte by byte, and their age.
//!
//! The checksum of a sentence is eight bits of XOR: two flips in one column
//! pass it. So an attitude holds when the sentence before says nearly the same;
//! at five or ten sentences a second no glider turns faster.

use crate::next_byte;
use devices::attitude::{Attitude, Reader};
use embedded_io::{Read, ReadReady};

/// Two sentences in a row do not differ by more, rad: pitch; roll; heading.
const AGREE_RAD: (f32, f32, f32) = (0.15, 0.3, 0.3);
/// Most bytes taken at once: what the port's buffer holds.
const MOST: usize = 1024;

/// The compass behind its port.
#[derive(Debug)]
pub struct Compass<U> {
    port: U,
    reader: Reader,
    before: Option<Attitude>,
    held: Option<(Attitude, u64)>,
    /// Sentences read whole.
    pub whole: u32,
    /// Sentences refused.
    pub refused: u32,
}

impl<U: Read + ReadReady> Compass<U> {
    /// A compass that has not spoken yet.
    pub fn new(port: U) -> Self {
        Self { port, reader: Reader::default(), before: None, held: None, whole: 0, refused: 0 }
    }

    /// It was switched on: what it said before is of another time.
    pub fn begin(&mut self) {
        (self.reader, self.before) = (Reader::default(), None);
    }

    /// Takes the bytes that have come.
    pub fn listen(&mut self, now_ms: u64) {
        for _ in 0..MOST {
            let Some(byte) = next_byte(&mut self.port) else { return };
            match self.reader.push(byte) {
                Some(Ok(attitude)) => {
                    self.whole = self.whole.saturating_add(1);
                    if self.before.is_some_and(|before| agree(&before, &attitude)) {
                        self.held = Some((attitude, now_ms));
                    }
                    self.before = Some(attitude);
                }
                Some(Err(_)) => self.refused = self.refused.saturating_add(1),
                None => {}
            }
        }
    }

    /// The attitude that holds, and when it was said, ms.
    pub const fn attitude(&self) -> Option<&(Attitude, u64)> {
        self.held.as_ref()
    }
}

fn agree(a: &Attitude, b: &Attitude) -> bool {
    let turn = (a.heading_rad - b.heading_rad).abs();
    let turn = if turn > core::f32::consts::PI { core::f32::consts::TAU - turn } else { turn };
    (a.pitch_rad - b.pitch_rad).abs() <= AGREE_RAD.0 && (a.roll_rad - b.roll_rad).abs() <= AGREE_RAD.1 && turn <= AGREE_RAD.2
}

#[cfg(test)]
mod tests {
    use super::Compass;
    use core::convert::Infallible;
    use embedded_io::{ErrorType, Read, ReadReady};

    struct Bytes(Vec<u8>);
    impl ErrorType for Bytes {
        type Error = Infallible;
    }
    impl Read for Bytes {
        fn read(&mut self, out: &mut [u8]) -> Result<usize, Infallible> {
            let n = out.len().min(self.0.len());
            out[..n].copy_from_slice(&self.0[..n]);
            self.0.drain(..n);
            Ok(n)
        }
    }
    impl ReadReady for Bytes {
        fn read_ready(&mut self) -> Result<bool, Infallible> {
            Ok(!self.0.is_empty())
        }
    }

    fn sentences(bodies: &[&str]) -> Bytes {
        let one = |body: &&str| format!("${body}*{:02X}\r\n", body.bytes().fold(0, |x, b| x ^ b)).into_bytes();
        Bytes(bodies.iter().flat_map(one).collect())
    }

    #[test]
    fn an_attitude_holds_when_two_sentences_agree() {
        let mut compass = Compass::new(sentences(&["C1.0P5.0R0.0"]));
        compass.listen(10);
        assert!(compass.attitude().is_none(), "one alone");
        compass.port = sentences(&["C359.5P5.2R0.1"]);
        compass.listen(210);
        assert!(compass.attitude().is_some_and(|(a, at)| *at == 210 && (a.pitch_rad - 0.0908).abs() < 1e-3));
        compass.port = sentences(&["C0.0P45.2R0.1", "C0.0P5.2R0.1"]);
        compass.listen(410);
        assert!(compass.attitude().is_some_and(|(_, at)| *at == 210), "a wild one and the one after it");
        compass.port = sentences(&["C0.0P5.3R0.1"]);
        compass.listen(610);
        assert!(compass.attitude().is_some_and(|(_, at)| *at == 610));
        assert_eq!((compass.whole, compass.refused), (5, 0));
        compass.begin();
        compass.port = sentences(&["C0.0P5.3R0.1"]);
        compass.listen(4_610);
        assert!(compass.attitude().is_some_and(|(_, at)| *at == 610), "switched on anew: one alone");
    }
}

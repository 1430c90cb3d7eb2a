//! What the modem says, line by line: byte by byte, memory and work bounded.
//!
//! A number is digits and nothing else, and a line has all of its fields or means nothing: a line from which a character is
//! missing is no other answer. No checksum protects these lines, so the driver believes no single one of them.

/// Longest line that is looked at, bytes; the longest that is meant has 50.
const LONGEST_ANSWER: usize = 64;

/// What a session came to: `+SBDIX: 0, 37, 1, 2, 6, 0`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// Of the message from here: 0 to 4 is there, all else is not.
    pub status: u16,
    /// Number of the session.
    pub number: u16,
    /// Of a message from shore: 0 none, 1 one is in the modem, 2 an error.
    pub incoming: u16,
    /// Messages that wait at the gateway.
    pub waiting: u16,
}

/// One line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Said {
    /// `OK`
    Ok,
    /// `ERROR`
    Error,
    /// `READY`: the bytes of the message are waited for.
    Ready,
    /// A digit alone: how a write ended; 0 is well.
    Written(u8),
    /// `+CSQ:3`: bars, 0 to 5.
    Signal(u8),
    /// `+SBDS: 1, 37, 0, -1`: whether a message waits to be sent, and the number of the next session.
    Status {
        /// A message is in the buffer that is sent from.
        loaded: bool,
        /// Number of the next session.
        next: u16,
    },
    /// `+SBDIX: …`
    Ended(Ended),
    /// Anything else: an echo, a ring, damage.
    Other,
}

/// Collects lines.
#[derive(Clone, Copy, Debug)]
pub struct Lines {
    line: [u8; LONGEST_ANSWER],
    length: usize,
    /// Longer than any that is meant: passed over up to its end.
    too_long: bool,
}

impl Lines {
    /// Before the first byte.
    #[must_use]
    pub const fn new() -> Self {
        Self { line: [0; LONGEST_ANSWER], length: 0, too_long: false }
    }

    /// Takes one byte; a finished line that is not empty says something.
    pub fn push(&mut self, byte: u8) -> Option<Said> {
        if byte == b'\r' || byte == b'\n' {
            let said = match self.line.get(..self.length) {
                _ if self.too_long => Some(Said::Other),
                Some([]) | None => None,
                Some(line) => Some(read(line)),
            };
            (self.length, self.too_long) = (0, false);
            return said;
        }
        match self.line.get_mut(self.length) {
            Some(place) => {
                *place = byte;
                self.length = self.length.saturating_add(1);
            }
            None => self.too_long = true,
        }
        None
    }
}

impl Default for Lines {
    fn default() -> Self {
        Self::new()
    }
}

/// What a line says.
#[must_use]
pub fn read(line: &[u8]) -> Said {
    match line {
        b"OK" => Said::Ok,
        b"ERROR" => Said::Error,
        b"READY" => Said::Ready,
        [digit @ b'0'..=b'9'] => Said::Written(digit.wrapping_sub(b'0')),
        _ => fields(line).unwrap_or(Said::Other),
    }
}

fn fields(line: &[u8]) -> Option<Said> {
    if let Some(rest) = line.strip_prefix(b"+CSQ:") {
        let [bars] = numbers(rest)?;
        return (bars <= 5).then_some(Said::Signal(bars as u8));
    }
    if let Some(rest) = line.strip_prefix(b"+SBDS:") {
        // Without a message from shore its number is -1.
        let rest = rest.strip_suffix(b"-1").map_or(Ok(rest), Err);
        let [loaded, next, _] = match rest {
            Err(front) => numbers(front.strip_suffix(b", ").or(front.strip_suffix(b","))?)?,
            Ok(all) => {
                let [loaded, next, incoming, _] = numbers(all)?;
                [loaded, next, incoming]
            }
        };
        return (loaded <= 1).then_some(Said::Status { loaded: loaded == 1, next });
    }
    let [status, number, incoming, _, _, waiting] = numbers(line.strip_prefix(b"+SBDIX:")?)?;
    (incoming <= 2).then_some(Said::Ended(Ended { status, number, incoming, waiting }))
}

/// Exactly so many numbers, with commas between them and at most one space before each.
fn numbers<const N: usize>(text: &[u8]) -> Option<[u16; N]> {
    let mut found = [0; N];
    let mut parts = text.split(|byte| *byte == b',');
    for place in &mut found {
        let part = parts.next()?;
        *place = number(part.strip_prefix(b" ").unwrap_or(part))?;
    }
    parts.next().is_none().then_some(found)
}

fn number(digits: &[u8]) -> Option<u16> {
    if digits.is_empty() {
        return None;
    }
    digits.iter().try_fold(0u16, |so_far, byte| {
        let digit = (*byte as char).to_digit(10)? as u16;
        so_far.checked_mul(10)?.checked_add(digit)
    })
}

#[cfg(test)]
mod tests {
    use super::{Ended, Lines, Said, read};

    #[test]
    fn validate_answers_of_the_command_reference() {
        assert_eq!(
            read(b"+SBDIX: 0, 37, 1, 2, 6, 9"),
            Said::Ended(Ended { status: 0, number: 37, incoming: 1, waiting: 9 }),
            "as in the reference"
        );
        assert_eq!(read(b"+SBDIX:32,65535,2,0,0,0"), Said::Ended(Ended { status: 32, number: 65_535, incoming: 2, waiting: 0 }));
        assert_eq!(read(b"+SBDS: 1, 37, 0, -1"), Said::Status { loaded: true, next: 37 });
        assert_eq!(read(b"+SBDS:0,38,1,12"), Said::Status { loaded: false, next: 38 });
        assert_eq!((read(b"+CSQ:5"), read(b"+CSQ: 0")), (Said::Signal(5), Said::Signal(0)));
        assert_eq!((read(b"OK"), read(b"ERROR"), read(b"READY"), read(b"2")), (Said::Ok, Said::Error, Said::Ready, Said::Written(2)));
    }

    #[test]
    fn what_is_damaged_is_no_answer() {
        for line in [
            &b"+SBDIX: 0, 37, 1, 2, 6"[..],
            b"+SBDIX: 0, 37, 1, 2, 6, 9, 1",
            b"+SBDIX: 0, 37, 1, 2, 6, ",
            b"+SBDIX: 0 37, 1, 2, 6, 9",
            b"+SBDIX: 0, 65536, 1, 2, 6, 9",
            b"+SBDIX: 0, 37, 3, 2, 6, 9",
            b"+SBDIX: , 37, 1, 2, 6, 9",
            b"+SBDIX: +0, 37, 1, 2, 6, 9",
            b"+SBDIX:  0, 37, 1, 2, 6, 9",
            b"SBDIX: 0, 37, 1, 2, 6, 9",
            b"+SBDS: 2, 37, 0, -1",
            b"+SBDS: 1, 37, 0-1",
            b"+SBDS: 1, 37, -1",
            b"+CSQ:6",
            b"+CSQ:",
            b"+CSQF:3",
            b"AT+SBDIX",
            b"SBDRING",
            b"OKAY",
            b"\xff\xfe",
        ] {
            assert_eq!(read(line), Said::Other, "{}", String::from_utf8_lossy(line));
        }
    }

    #[test]
    fn a_line_too_long_is_passed_over_up_to_its_end() {
        let mut lines = Lines::new();
        let mut all = vec![b'O'; 5_000];
        all.extend(b"K\r\n\r\nOK\r\n");
        let said: Vec<Said> = all.into_iter().filter_map(|byte| lines.push(byte)).collect();
        assert_eq!(said, [Said::Other, Said::Ok]);
    }
}

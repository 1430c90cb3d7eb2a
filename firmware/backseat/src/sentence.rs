//! What a sentence says, and how ours are written.
//!
//! | from the glider | | from us | |
//! |---|---|---|---|
//! | `HI` | its program started | `SW,i:v,…` | write sensors |
//! | `BY` | it stops | `MD,mask,value` | mode bits under the mask |
//! | `SD,i:v,…` | sensors that were updated | `TXT,text` | a line for the pilot (newer generation) |
//! | `FI,block` / `FI` | block of a file / its end | `FR,name,dir` | read a file |
//! | `NEXT` | block taken | `GO` | the next block (newer generation) |
//! | `DIR,names` | list of files | `FW`, `FO`, `FC`, `LS` | write a file, list files |
//! | `ER,code` | error; the codes are not public | | |

use crate::Unfit;

use crate::{line, number};

/// A sentence of the glider.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FromGlider<'a> {
    /// Its program started.
    Hi,
    /// It stops. A cut `B` counts as well.
    By,
    /// Sensors that were updated.
    Sensors(Pairs<'a>),
    /// A block of a file in base64; empty: the file's end.
    File(&'a [u8]),
    /// A block of ours was taken.
    Next,
    /// File names.
    Directory(&'a [u8]),
    /// An error.
    Error(&'a [u8]),
    /// None of these.
    Unknown,
}

/// Reads the body of a sentence.
#[must_use]
pub fn read(body: &[u8]) -> FromGlider<'_> {
    let mut parts = body.splitn(2, |b| *b == b',');
    let kind = parts.next().unwrap_or_default();
    let rest = parts.next().unwrap_or_default();
    match kind {
        b"HI" => FromGlider::Hi,
        b"BY" | b"B" => FromGlider::By,
        b"SD" => FromGlider::Sensors(Pairs(rest)),
        b"FI" => FromGlider::File(rest),
        b"NEXT" => FromGlider::Next,
        b"DIR" => FromGlider::Directory(rest),
        b"ER" => FromGlider::Error(rest),
        _ => FromGlider::Unknown,
    }
}

/// Pairs of index and value; `None` for a pair that is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pairs<'a>(&'a [u8]);

impl<'a> Pairs<'a> {
    /// The fields after the sentence's type.
    #[must_use]
    pub const fn of(fields: &'a [u8]) -> Self {
        Self(fields)
    }

    /// One by one.
    pub fn iter(self) -> impl Iterator<Item = Option<(u16, Option<f64>)>> + 'a {
        self.0.split(|b| *b == b',').filter(|field| !field.is_empty()).map(|field| {
            let colon = field.iter().position(|b| *b == b':')?;
            let index = number::index(field.get(..colon)?)?;
            Some((index, number::parse(field.get(colon.saturating_add(1)..)?)))
        })
    }
}

/// Longest sentence we write, without its frame: four pairs of `63:-999999.999999,`, or a text.
pub const LONGEST_BODY: usize = 96;

/// The body of a sentence of ours while it is written.
pub type Body = heapless::Vec<u8, LONGEST_BODY>;

/// Begins a body with its type and text fields.
///
/// # Errors
/// Longer than [`LONGEST_BODY`].
pub fn words(parts: &[&[u8]]) -> Result<Body, Unfit> {
    let mut body = Body::new();
    for (i, part) in parts.iter().enumerate() {
        if i > 0 {
            body.push(b',').map_err(|_| Unfit)?;
        }
        line::put(part, &mut body)?;
    }
    Ok(body)
}

/// `SW` of at most four pairs.
///
/// # Errors
/// A value that must not be written: not finite, or one that the glider takes for a link.
pub fn write_sensors(pairs: &[(u16, f64)]) -> Result<Body, Unfit> {
    let mut body = words(&[b"SW"])?;
    for (index, value) in pairs {
        body.push(b',').map_err(|_| Unfit)?;
        number::whole(u64::from(*index), 1, &mut body)?;
        body.push(b':').map_err(|_| Unfit)?;
        number::write(*value, &mut body)?;
    }
    Ok(body)
}

/// `MD`: the bits of `mask` become those of `value`, the others stay.
///
/// # Errors
/// No room.
pub fn mode(mask: u32, value: u32) -> Result<Body, Unfit> {
    let mut body = words(&[b"MD"])?;
    for number in [mask, value] {
        body.push(b',').map_err(|_| Unfit)?;
        number::whole(u64::from(number), 1, &mut body)?;
    }
    Ok(body)
}

/// The body with its frame.
pub type Framed = heapless::Vec<u8, { LONGEST_BODY + 6 }>;

/// Frames a body.
///
/// # Errors
/// Never: there is room for the frame.
pub fn framed(body: &Body) -> Result<Framed, Unfit> {
    let mut out = Framed::new();
    line::seal(body, &mut out)?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::{FromGlider, framed, mode, read, words, write_sensors};

    #[test]
    fn validate_sentences_of_public_projects() {
        for (body, text) in [
            (write_sensors(&[(0, -236.0), (1, 0.5), (2, 0.1)]), "$SW,0:-236.000000,1:0.500000,2:0.100000*11\r\n"),
            (mode(3, 1), "$MD,3,1*0B\r\n"),
            (words(&[b"TXT", b"42.000000"]), "$TXT,42.000000*5C\r\n"),
            (words(&[b"FR", b"extctl.ini", b"config"]), "$FR,extctl.ini,config*4C\r\n"),
            (words(&[b"FW", b"bsd.log", b"logs"]), "$FW,bsd.log,logs*39\r\n"),
            (words(&[b"FO", b"b2sK"]), "$FO,b2sK*4D\r\n"),
            (words(&[b"FC"]), "$FC*05\r\n"),
            (words(&[b"LS", b"logs", b".log"]), "$LS,logs,.log*42\r\n"),
        ] {
            assert_eq!(framed(&body.expect("written")).expect("framed").as_slice(), text.as_bytes());
        }
    }

    #[test]
    fn pairs_are_parsed_whole_and_a_bad_one_spoils_no_other() {
        let FromGlider::Sensors(pairs) = read(b"SD,8:1767225604.01,15:0.5,9:nan,,5,x:1,11:-0.3491") else { panic!("SD") };
        let got: Vec<_> = pairs.iter().collect();
        assert_eq!(
            got,
            [Some((8, Some(1_767_225_604.01))), Some((15, Some(0.5))), Some((9, None)), None, None, Some((11, Some(-0.3491))),]
        );
        assert_eq!(read(b"B"), FromGlider::By);
        assert_eq!(read(b"FI"), FromGlider::File(b""));
        assert_eq!(read(b"XY,1"), FromGlider::Unknown);
        assert!(write_sensors(&[(0, 1e6)]).is_err() && write_sensors(&[(0, f64::NAN)]).is_err());
    }
}

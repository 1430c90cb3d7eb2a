//! The glider's list of sensors, `extctl.ini`: what an index on the line means.
//!
//! ```text
//! mp                       # newer generation only: mission parameters, no unit
//! u_mission_param_a
//! os                       # what the backseat writes
//! sci_generic_a nodim
//! is                       # what the glider sends
//! m_depth m
//! baud 9600                # number on this line or the next
//! packet_size 600
//! ```
//! An index counts the sensors from 0 through all sections. Comments (`#`) and empty lines do not count. A board and a glider with
//! different files talk nonsense with right checksums: the file is compared before the first write.

/// Part of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Section {
    /// Mission parameters: written by the backseat.
    Mission,
    /// Other sensors that the backseat writes.
    Output,
    /// Sensors that the glider sends.
    Input,
}

/// Longest line, bytes; longer ones are an error.
pub const LONGEST_INI_LINE: usize = 120;
/// Longest name of a sensor, bytes.
pub const NAME: usize = 48;

/// What a line holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Item {
    /// A sensor.
    Sensor {
        /// Its index on the line.
        index: u16,
        /// Its section.
        section: Section,
        /// Its name.
        name: heapless::String<NAME>,
        /// Whether a unit follows the name.
        has_unit: bool,
    },
    /// Line speed, baud.
    Baud(u32),
    /// Bytes of a file in one block.
    PacketSize(u32),
}

/// Why a file is no list of sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IniError {
    /// A sensor before the first section.
    NoSection,
    /// A line too long, or with bytes that are no text.
    Line,
    /// Too many words, or a number that is none.
    Words,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Expects {
    Nothing,
    Sensors(Section),
    Baud,
    PacketSize,
}

/// Reads a file byte by byte.
#[derive(Clone, Debug)]
pub struct Reader {
    line: heapless::Vec<u8, LONGEST_INI_LINE>,
    overflown: bool,
    expects: Expects,
    next: u16,
}

impl Default for Reader {
    fn default() -> Self {
        Self::new()
    }
}

impl Reader {
    /// At the file's beginning.
    #[must_use]
    pub const fn new() -> Self {
        Self { line: heapless::Vec::new(), overflown: false, expects: Expects::Nothing, next: 0 }
    }

    /// Sensors read so far.
    #[must_use]
    pub const fn sensors(&self) -> u16 {
        self.next
    }

    /// Takes a byte; answers at the end of a line that holds something.
    pub fn push(&mut self, byte: u8) -> Option<Result<Item, IniError>> {
        if byte != b'\n' && byte != b'\r' {
            self.overflown |= self.line.push(byte).is_err();
            return None;
        }
        self.end_of_line()
    }

    /// At the file's end: its last line may lack the line end.
    pub fn finish(&mut self) -> Option<Result<Item, IniError>> {
        self.end_of_line()
    }

    fn end_of_line(&mut self) -> Option<Result<Item, IniError>> {
        let (line, overflown) = (core::mem::take(&mut self.line), core::mem::take(&mut self.overflown));
        if overflown {
            return Some(Err(IniError::Line));
        }
        let text = line.split(|b| *b == b'#').next().unwrap_or_default();
        let Ok(text) = core::str::from_utf8(text) else { return Some(Err(IniError::Line)) };
        let mut words = text.split_ascii_whitespace();
        let first = words.next()?;
        let second = words.next();
        if words.next().is_some() {
            return Some(Err(IniError::Words));
        }
        let section = match first {
            "mp" => Some(Expects::Sensors(Section::Mission)),
            "os" => Some(Expects::Sensors(Section::Output)),
            "is" => Some(Expects::Sensors(Section::Input)),
            "baud" => Some(Expects::Baud),
            "packet_size" => Some(Expects::PacketSize),
            _ => None,
        };
        match (section, second) {
            (Some(section), None) => {
                self.expects = section;
                None
            }
            (Some(Expects::Baud), Some(number)) => Some(number.parse().map(Item::Baud).map_err(|_| IniError::Words)),
            (Some(Expects::PacketSize), Some(number)) => Some(number.parse().map(Item::PacketSize).map_err(|_| IniError::Words)),
            (Some(_), Some(_)) => Some(Err(IniError::Words)),
            (None, _) => Some(self.content(first, second)),
        }
    }

    fn content(&mut self, first: &str, second: Option<&str>) -> Result<Item, IniError> {
        match self.expects {
            Expects::Nothing => Err(IniError::NoSection),
            Expects::Baud => first.parse().map(Item::Baud).map_err(|_| IniError::Words),
            Expects::PacketSize => first.parse().map(Item::PacketSize).map_err(|_| IniError::Words),
            Expects::Sensors(section) => {
                let name = heapless::String::try_from(first).map_err(|_| IniError::Line)?;
                let index = self.next;
                self.next = self.next.saturating_add(1);
                Ok(Item::Sensor { index, section, name, has_unit: second.is_some() })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{IniError, Item, Reader, Section};
    use proptest::prelude::*;

    fn items(text: &str) -> Result<Vec<Item>, IniError> {
        let mut reader = Reader::new();
        let mut all: Vec<_> = text.bytes().filter_map(|b| reader.push(b)).collect();
        all.extend(reader.finish());
        all.into_iter().collect()
    }

    fn names(text: &str) -> Vec<(u16, Section, String)> {
        let sensor = |item| match item {
            Item::Sensor { index, section, name, .. } => Some((index, section, name.as_str().to_owned())),
            _ => None,
        };
        items(text).expect("reads").into_iter().filter_map(sensor).collect()
    }

    #[test]
    fn both_generations_are_read_and_the_index_runs_through_all_sections() {
        let older = names("os\nu_mission_param_a X\nsci_generic_a nodim\nis\nm_depth m");
        assert_eq!(older.iter().map(|s| (s.0, s.1)).collect::<Vec<_>>(), [(0, Section::Output), (1, Section::Output), (2, Section::Input)]);
        let text = "# ours\nmp # parameters\r\nu_mission_param_a\r\n\r\nos\nos_like_name nodim # not a section\nis\nm_depth m\n# m_pitch rad\n\
                    m_roll rad\nbaud\n9600\npacket_size 600 # bytes\n";
        let newer = names(text);
        assert_eq!(
            newer.iter().map(|s| (s.0, s.2.as_str())).collect::<Vec<_>>(),
            [(0, "u_mission_param_a"), (1, "os_like_name"), (2, "m_depth"), (3, "m_roll")]
        );
        let all = items(text).expect("reads");
        assert!(all.contains(&Item::Baud(9600)) && all.contains(&Item::PacketSize(600)), "{all:?}");
        assert_eq!(names("mp\nos\nis\nsci_water_temp degC\n").len(), 1, "empty sections are legal");
    }

    #[test]
    fn what_is_no_list_is_refused() {
        assert_eq!(items("m_depth m\n"), Err(IniError::NoSection));
        assert_eq!(items("is\nm_depth m deep\n"), Err(IniError::Words));
        assert_eq!(items("is\nbaud\nfast\n"), Err(IniError::Words));
        assert_eq!(items(&format!("is\n{}\n", "m".repeat(200))), Err(IniError::Line));
    }

    proptest! {
        #[test]
        fn prop_noise_is_read_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            let mut reader = Reader::new();
            for b in &bytes {
                let _ = reader.push(*b);
            }
            let _ = reader.finish();
            prop_assert!(usize::from(reader.sensors()) <= bytes.len());
        }
    }
}

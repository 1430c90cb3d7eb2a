//! HDF5 as its first versions write it (superblock 0, symbol tables, HDF5 File Format Specification 3.0, II.A to IV): no checksum stops
//! a byte that was changed.

/// A file under way: objects are addressed by their place.
pub struct OldHdf5(Vec<u8>);

const NONE: u64 = u64::MAX;
const SUPERBLOCK: usize = 96;
/// IEEE double, little endian; a scalar.
const DOUBLE: [u8; 20] = [0x11, 0x20, 0x3F, 0, 8, 0, 0, 0, 0, 0, 64, 0, 52, 11, 0, 52, 0xFF, 3, 0, 0];
const SCALAR: [u8; 8] = [1, 0, 0, 0, 0, 0, 0, 0];

fn words(all: &[u64]) -> Vec<u8> {
    all.iter().flat_map(|w| w.to_le_bytes()).collect()
}

fn padded(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

/// An object header of these messages, by type.
fn header(messages: &[(u16, Vec<u8>)]) -> Vec<u8> {
    let message = |(kind, data): &(u16, Vec<u8>)| {
        let data = padded(data.clone());
        [&kind.to_le_bytes()[..], &(data.len() as u16).to_le_bytes(), &[0; 4], &data].concat()
    };
    let body = messages.iter().map(message).collect::<Vec<_>>().concat();
    let count = (messages.len() as u16).to_le_bytes();
    [&[1, 0][..], &count, &1_u32.to_le_bytes(), &(body.len() as u32).to_le_bytes(), &[0; 4], &body].concat()
}

/// A text attribute.
fn attribute(name: &str, value: &str) -> (u16, Vec<u8>) {
    let text = [&[0x13, 0, 0, 0][..], &(value.len() as u32).to_le_bytes()].concat();
    let sizes = [name.len() as u16 + 1, 8, 8].map(u16::to_le_bytes).concat();
    let name = padded([name.as_bytes(), &[0]].concat());
    (0x0C, [&[1, 0][..], &sizes, &name, &text, &SCALAR, value.as_bytes()].concat())
}

impl OldHdf5 {
    pub fn new() -> Self {
        Self(vec![0; SUPERBLOCK])
    }

    /// Where the next group comes to stand.
    pub fn next(&self) -> u64 {
        self.0.len() as u64
    }

    fn add(&mut self, bytes: Vec<u8>) -> u64 {
        let at = self.next();
        self.0.extend(padded(bytes));
        at
    }

    /// A variable of doubles with its attributes.
    pub fn variable(&mut self, attributes: &[(&str, &str)], values: &[f64]) -> u64 {
        let rows = values.len() as u64;
        let data = self.add(values.iter().flat_map(|v| v.to_le_bytes()).collect());
        let space = [&[1, 1, 0, 0, 0, 0, 0, 0][..], &rows.to_le_bytes()].concat();
        let layout = [&[3, 1][..], &words(&[data, 8 * rows])].concat();
        let mut messages = vec![(0x01, space), (0x03, DOUBLE.to_vec()), (0x08, layout)];
        messages.extend(attributes.iter().map(|(name, value)| attribute(name, value)));
        self.add(header(&messages))
    }

    /// A group of these members, in the order of their names.
    pub fn group(&mut self, members: &[(&str, u64)]) -> u64 {
        let mut names = vec![0; 8];
        let mut symbols = [&b"SNOD\x01\0"[..], &(members.len() as u16).to_le_bytes()].concat();
        for (name, address) in members {
            symbols.extend(words(&[names.len() as u64, *address, 0, 0, 0]));
            names.extend(padded([name.as_bytes(), &[0]].concat()));
        }
        let at = self.next();
        let (heap, tree) = (at + 40, at + 40 + 32 + names.len() as u64);
        let node = tree + 48;
        self.add(header(&[(0x11, words(&[tree, heap]))]));
        self.add([&b"HEAP\0\0\0\0"[..], &words(&[names.len() as u64, 1, heap + 32]), &names].concat());
        self.add([&b"TREE\0\0\x01\0"[..], &words(&[NONE, NONE, 0, node, names.len() as u64 - 8])].concat());
        self.add(symbols);
        at
    }

    /// The whole file.
    pub fn file(mut self, root: u64) -> Vec<u8> {
        let sizes = [&b"\x89HDF\r\n\x1a\n\0\0\0\0\0\x08\x08\0"[..], &[4, 0, 16, 0, 0, 0, 0, 0]].concat();
        let end = self.next();
        let superblock = [&sizes[..], &words(&[0, NONE, end, NONE, 0, root, 0, 0, 0])].concat();
        self.0[..SUPERBLOCK].copy_from_slice(&superblock);
        self.0
    }
}

//! The image a board runs, as its ELF knows it: its identity, and which line of source an address comes from.

use anyhow::{Context as _, ensure};
use gimli::{EndianRcSlice, RunTimeEndian};
use logs::record::bounded;
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use serde_json::{Value, json};
use signals::link::CRC32;
use std::path::Path;
use std::rc::Rc;

/// Sections that are the image, in the order in which the board sums them.
const PARTS: [&str; 3] = [".text", ".rodata", ".data"];

/// An image with its line tables.
pub struct ImageLines {
    /// Identity: CRC-32 of code, constants and initial values, as the board reckons it over its flash.
    pub id: u32,
    lines: addr2line::Context<EndianRcSlice<RunTimeEndian>>,
    /// Functions by address: first, one past the last, name.
    functions: Vec<(u64, u64, String)>,
}

/// A place in the source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Function, demangled.
    pub function: String,
    /// File as the project or its crate names it, and line; unknown of code that was compiled without.
    pub line: Option<(String, u32)>,
}

impl Place {
    /// As people write it.
    #[must_use]
    pub fn text(&self) -> String {
        match &self.line {
            Some((file, line)) => format!("{}, {file}:{line}", self.function),
            None => self.function.clone(),
        }
    }

    /// For a program.
    #[must_use]
    pub fn document(&self) -> Value {
        let (file, line) = self.line.clone().unzip();
        json!({ "function": self.function, "file": file, "line": line })
    }
}

impl ImageLines {
    /// Reads an image.
    ///
    /// # Errors
    /// Not readable, not an image of the board.
    pub fn read(elf: &Path) -> anyhow::Result<Self> {
        let name = elf.display();
        let bytes = bounded::bytes(elf, bounded::LOG)
            .with_context(|| format!("{name}: cannot read this image; scripts/build-firmware makes one"))?;
        let file = object::File::parse(&*bytes).with_context(|| format!("{name}: not an ELF image; scripts/build-firmware makes one"))?;
        ensure!(file.architecture() == object::Architecture::Arm, "{name}: an ELF for another processor; scripts/build-firmware makes one");
        let mut digest = CRC32.digest();
        for part in PARTS {
            let section = file.section_by_name(part).with_context(|| format!("{name}: no section {part}: not an image of the board"))?;
            digest.update(section.data().with_context(|| format!("{name}: section {part} is cut"))?);
        }
        let load = |id: gimli::SectionId| -> Result<_, gimli::Error> {
            let data = file.section_by_name(id.name()).and_then(|s| s.data().ok()).unwrap_or_default();
            Ok(EndianRcSlice::new(Rc::from(data), RunTimeEndian::Little))
        };
        let dwarf = gimli::Dwarf::load(load).with_context(|| format!("{name}: its line tables are damaged"))?;
        let lines = addr2line::Context::from_dwarf(dwarf).with_context(|| format!("{name}: its line tables are damaged"))?;
        let mut functions: Vec<(u64, u64, String)> = file
            .symbols()
            .filter(|s| s.kind() == SymbolKind::Text && s.size() > 0)
            .filter_map(|s| {
                let first = s.address() & !1;
                Some((first, first + s.size(), addr2line::demangle_auto(s.name().ok()?.into(), None).into_owned()))
            })
            .collect();
        functions.sort();
        Ok(Self { id: digest.finalize(), lines, functions })
    }

    /// Where an instruction comes from: the innermost function first, then those it is inlined into. Empty: no code of this image.
    #[must_use]
    pub fn at(&self, address: u32) -> Vec<Place> {
        let probe = u64::from(address & !1);
        let Some((.., symbol)) = self.functions.iter().find(|f| (f.0..f.1).contains(&probe)) else { return Vec::new() };
        let mut places = Vec::new();
        if let Ok(mut frames) = self.lines.find_frames(probe).skip_all_loads() {
            while let Ok(Some(frame)) = frames.next() {
                let name = frame.function.as_ref().and_then(|f| Some(f.demangle().ok()?.into_owned()));
                let line = frame.location.and_then(|l| Some((short(l.file?), l.line?)));
                places.push(Place { function: plain(&name.unwrap_or_else(|| symbol.clone())), line });
            }
        }
        if places.is_empty() {
            places.push(Place { function: plain(symbol), line: None });
        }
        places
    }

    /// The call that returns to an address.
    #[must_use]
    pub fn before(&self, returns_to: u32) -> Vec<Place> {
        self.at((returns_to & !1).saturating_sub(2))
    }
}

/// A function's name without the hash that the compiler adds.
fn plain(name: &str) -> String {
    match name.rsplit_once("::h") {
        Some((path, hash)) if hash.len() == 16 && hash.bytes().all(|b| b.is_ascii_hexdigit()) => path.to_owned(),
        _ => name.to_owned(),
    }
}

/// A file from the root of this project, of its crate, or of Rust's library.
fn short(file: &str) -> String {
    if let Some((_, of_crate)) = file.split_once("/registry/src/") {
        return of_crate.split_once('/').map_or(of_crate, |(_, path)| path).to_owned();
    }
    ["firmware/", "library/"]
        .iter()
        .find_map(|root| file.rfind(&format!("/{root}")).and_then(|at| file.get(at + 1..)))
        .unwrap_or(file)
        .to_owned()
}

#[cfg(test)]
mod tests {
    use super::{plain, short};

    #[test]
    fn files_are_named_from_their_root_and_functions_without_a_hash() {
        assert_eq!(short("/somewhere/else/firmware/control/src/lib.rs"), "firmware/control/src/lib.rs");
        assert_eq!(short("/r/.cargo/registry/src/index-1949/postcard-1.1.3/src/de/mod.rs"), "postcard-1.1.3/src/de/mod.rs");
        assert_eq!(short("/rustc/0123/library/core/src/num/mod.rs"), "library/core/src/num/mod.rs");
        assert_eq!(short("src/main.rs"), "src/main.rs");
        assert_eq!(plain("control::step::he01b9890ef11fd43"), "control::step");
        assert_eq!(plain("control::hold::here"), "control::hold::here");
    }
}

//! What is in the ELF: functions with their code, sizes, addresses taken.

use anyhow::{Result, ensure};
use object::elf::FileHeader32;
use object::read::elf::ElfFile;
use object::{Endianness, Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind, SymbolKind};
use std::collections::{BTreeMap, BTreeSet};

/// First address of RAM.
const RAM_START: u64 = 0x2000_0000;

/// One function of the image.
pub struct Function {
    /// Demangled, without its hash.
    pub name: String,
    /// First address, Thumb bit cleared.
    pub start: u32,
    /// Its code as halfwords with their addresses, literal pools and tables left out.
    pub code: Vec<(u32, u16)>,
    /// One past its last byte.
    pub end: u32,
}

/// What lies in flash before the image: the boot loader, judged by itself, and its journal.
const BEFORE: &[&str] = &[".boot", ".journal0", ".journal1"];

/// The parts of an ELF this tool looks at.
pub struct Image {
    /// By address.
    pub functions: Vec<Function>,
    /// Bytes of flash.
    pub flash: u64,
    /// Bytes of RAM taken by statics.
    pub statics: u64,
    /// Bytes of RAM set apart for the stack.
    pub stack: u64,
    /// Words outside code that may be a function's address.
    pub words: BTreeSet<u32>,
    /// Exception handlers by their numbers, as the vector table names them.
    pub vectors: BTreeMap<u32, u32>,
}

impl Image {
    /// Reads an ELF.
    pub fn read(bytes: &[u8]) -> Result<Self> {
        let elf: ElfFile<'_, FileHeader32<Endianness>> = ElfFile::parse(bytes)?;
        ensure!(elf.architecture() == object::Architecture::Arm, "built for another processor");
        let (mut flash, mut statics) = (0, 0);
        for section in elf.sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            if sh_flags & u64::from(object::elf::SHF_ALLOC) == 0 || section.name().is_ok_and(|name| BEFORE.contains(&name)) {
                continue;
            }
            let uninitialized = section.kind() == SectionKind::UninitializedData;
            statics += if section.address() >= RAM_START { section.size() } else { 0 };
            flash += if uninitialized { 0 } else { section.size() };
        }

        // Mapping symbols tell code ($t) from data ($d) inside .text.
        let mut mapping: Vec<(u32, bool)> = elf
            .symbols()
            .filter_map(|s| match s.name().ok()?.get(..2)? {
                "$t" => Some((s.address() as u32, true)),
                "$d" => Some((s.address() as u32, false)),
                _ => None,
            })
            .collect();
        mapping.sort_unstable();
        let is_code = |address: u32| mapping.partition_point(|m| m.0 <= address).checked_sub(1).is_none_or(|i| mapping[i].1);

        let mut words = BTreeSet::new();
        let mut vectors = BTreeMap::new();
        let mut code: Vec<(u32, u16)> = vec![];
        for section in elf.sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else { continue };
            if sh_flags & u64::from(object::elf::SHF_ALLOC) == 0 || section.name().is_ok_and(|name| BEFORE.contains(&name)) {
                continue;
            }
            let data = section.data()?;
            let at = section.address() as u32;
            let is_text = section.kind() == SectionKind::Text;
            let is_vectors = section.name() == Ok(".vector_table");
            for (i, word) in data.chunks_exact(4).enumerate() {
                let address = at + 4 * i as u32;
                let value = u32::from_le_bytes([word[0], word[1], word[2], word[3]]);
                if is_vectors {
                    vectors.insert(i as u32, value & !1);
                } else if !is_text || !is_code(address) {
                    words.insert(value);
                }
            }
            if is_text {
                let halves = data.chunks_exact(2).enumerate();
                code.extend(halves.map(|(i, h)| (at + 2 * i as u32, u16::from_le_bytes([h[0], h[1]]))));
            }
        }
        code.sort_unstable();
        code.retain(|(address, _)| is_code(*address));

        let mut starts: Vec<(u32, u32, String)> = elf
            .symbols()
            .filter(|s| s.kind() == SymbolKind::Text && s.size() > 0)
            .filter_map(|s| {
                let start = s.address() as u32 & !1;
                Some((start, start + s.size() as u32, format!("{:#}", rustc_demangle::demangle(s.name().ok()?))))
            })
            .collect();
        starts.sort();
        starts.dedup_by_key(|f| f.0);
        ensure!(!starts.is_empty(), "no function symbols: stripped?");
        let functions = starts
            .into_iter()
            .map(|(start, end, name)| {
                let from = code.partition_point(|c| c.0 < start);
                let to = code.partition_point(|c| c.0 < end);
                Function { name, start, end, code: code[from..to].to_vec() }
            })
            .collect();
        let top = elf.symbol_by_name("_stack_start").map_or(RAM_START, |s| s.address());
        Ok(Self { functions, flash, statics, stack: top.saturating_sub(RAM_START), words, vectors })
    }
}

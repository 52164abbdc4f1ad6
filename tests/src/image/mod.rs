//! What can be proved about a linked board image without running it: what it occupies, whether a
//! panic can be reached, how deep the stack can get.

mod stack;
mod thumb;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::{env, fs};

use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSection, ObjectSymbol, SymbolKind};

pub use stack::{StackError, StackUse};

/// A linked image.
#[derive(Debug)]
pub struct Image {
    functions: BTreeMap<u32, Function>,
    sections: BTreeMap<String, Section>,
    names: Vec<String>,
    /// Words outside the code and the vector table, which may be addresses of functions.
    words: BTreeSet<u32>,
    flash_bytes: u32,
}

#[derive(Debug, Clone)]
struct Function {
    name: String,
    address: u32,
    code: Vec<u8>,
    /// Addresses from which on there is data (true) or code (false), ascending.
    data: Vec<(u32, bool)>,
}

#[derive(Debug, Clone, Copy)]
struct Section {
    address: u32,
    bytes: u32,
}

/// An exception's frame with the registers of the floating-point unit, and 4 bytes to align it: ARMv7-M Architecture
/// Reference Manual, DDI 0403E, B1.5.7.
const EXCEPTION_BYTES: u32 = 26 * 4 + 4;

/// Where RAM begins; see memory.x.
const RAM: std::ops::Range<u32> = 0x2000_0000..0x2002_0000;

impl Image {
    /// Bytes of RAM that the boards have.
    pub const RAM_BYTES: u32 = RAM.end - RAM.start;

    /// The idle loop; the drive loop at priority 2, which interrupts it; the receivers at priority 3, which interrupt
    /// both and not each other, the deeper one standing for both.
    pub const LEVELS: [&str; 3] = ["main", "SysTick", "USART3"];

    /// Where `cargo image-<board>` puts its image.
    pub fn path(board: &str) -> PathBuf {
        let target = env::var_os("CARGO_TARGET_DIR").map_or_else(
            || Path::new(env!("CARGO_MANIFEST_DIR")).join("../target"),
            PathBuf::from,
        );
        target.join("thumbv7em-none-eabihf/firmware").join(board)
    }

    /// Reads the image of a board.
    ///
    /// # Panics
    /// If it has not been built, saying how, or is no such image.
    pub fn of(board: &str) -> Self {
        let path = Self::path(board);
        let bytes = fs::read(&path).unwrap_or_else(|error| {
            panic!(
                "{}: {error}; build it with: cargo image-{board}",
                path.display()
            )
        });
        Self::parse(&bytes)
    }

    fn parse(bytes: &[u8]) -> Self {
        let elf = ElfFile32::<Endianness>::parse(bytes).expect("an ELF file of 32 bits");
        let (mut sections, mut words) = (BTreeMap::new(), BTreeSet::new());
        for section in elf.sections() {
            let name = section.name().expect("a section's name").to_owned();
            let (address, bytes) = (section.address() as u32, section.size() as u32);
            if [".rodata", ".data"].contains(&name.as_str()) {
                let (chunks, _) = section.data().expect("a section's data").as_chunks();
                words.extend(chunks.iter().copied().map(u32::from_le_bytes));
            }
            sections.insert(name, Section { address, bytes });
        }
        let flash_bytes = elf
            .elf_program_headers()
            .iter()
            .filter(|segment| segment.p_type(Endianness::Little) == object::elf::PT_LOAD)
            .map(|segment| segment.p_filesz(Endianness::Little))
            .sum();
        Self {
            functions: functions(&elf),
            names: elf
                .symbols()
                .filter_map(|symbol| symbol.name().ok().map(str::to_owned))
                .collect(),
            sections,
            words,
            flash_bytes,
        }
    }

    /// Bytes of flash: code, constants, and the first values of variables.
    pub fn flash_bytes(&self) -> u32 {
        self.flash_bytes
    }

    /// Bytes of RAM taken by variables, whatever the program does; the stack comes on top.
    pub fn static_ram_bytes(&self) -> u32 {
        self.sections
            .values()
            .filter(|section| RAM.contains(&section.address))
            .map(|section| section.bytes)
            .sum()
    }

    /// Signs of a reachable panic: the marker of the panic handler, and functions that panic.
    pub fn panics(&self) -> Vec<String> {
        let marker = self.sections.get(".panic");
        let marker = marker.filter(|section| section.bytes != 0);
        let names = self.names.iter().filter(|name| {
            ["panicking", "begin_unwind", "unwrap_failed"]
                .iter()
                .any(|panic| name.contains(panic))
        });
        marker
            .map(|_| "section .panic".to_owned())
            .into_iter()
            .chain(names.cloned())
            .collect()
    }

    /// Most bytes of stack that are ever in use: the deepest path of every level, each on top of the one it
    /// interrupts, with what the exceptions put there, and a fault on top of all.
    pub fn stack_bound(&self) -> Result<u32, StackError> {
        let mut bytes = 0;
        for handler in Self::LEVELS {
            bytes += self.stack_of(handler)?.bytes + EXCEPTION_BYTES;
        }
        Ok(bytes)
    }

    /// How deep the stack gets at most from the exception handler (or `Reset`) of this name, without what an exception
    /// puts there.
    pub fn stack_of(&self, handler: &str) -> Result<StackUse, StackError> {
        stack::of(&self.functions, &self.words, handler)
    }
}

/// All functions with their code. Several names for one address count as one function.
fn functions(elf: &ElfFile32<'_>) -> BTreeMap<u32, Function> {
    let text = elf.section_by_name(".text").expect("a section .text");
    let (start, code) = (text.address() as u32, text.data().expect("the code"));
    let mut data: Vec<(u32, bool)> = elf
        .symbols()
        .filter_map(|symbol| match symbol.name().unwrap_or_default().get(..2) {
            Some("$d") => Some((symbol.address() as u32, true)),
            Some("$t") => Some((symbol.address() as u32, false)),
            _ => None,
        })
        .collect();
    data.sort_unstable();
    let symbols: Vec<_> = elf
        .symbols()
        .filter(|symbol| symbol.kind() == SymbolKind::Text)
        // Bit 0 marks Thumb code.
        .map(|symbol| (symbol.address() as u32 & !1, symbol))
        .collect();
    let sizes = sizes(
        symbols
            .iter()
            .map(|(address, symbol)| (*address, symbol.size() as u32)),
        start + code.len() as u32,
    );
    let mut functions = BTreeMap::new();
    for (address, symbol) in symbols {
        let begin = address.wrapping_sub(start) as usize;
        let Some(code) = code.get(begin..begin + sizes[&address] as usize) else {
            continue;
        };
        functions.entry(address).or_insert_with(|| Function {
            name: symbol.name().unwrap_or_default().to_owned(),
            address,
            code: code.to_vec(),
            data: data.clone(),
        });
    }
    functions
}

/// Bytes of each function, by the addresses and sizes of its symbols. One that says no size, as assembly may leave it
/// out, reaches to the next one, the last to the end of the code: rather too far than not to be looked at.
fn sizes(symbols: impl Iterator<Item = (u32, u32)>, end: u32) -> BTreeMap<u32, u32> {
    let mut sizes = BTreeMap::<u32, u32>::new();
    for (address, size) in symbols {
        let largest = sizes.entry(address).or_default();
        *largest = (*largest).max(size);
    }
    let mut next = end;
    for (address, size) in sizes.iter_mut().rev() {
        if *size == 0 {
            *size = next.saturating_sub(*address);
        }
        next = *address;
    }
    sizes
}

#[cfg(test)]
mod tests {
    use super::sizes;

    #[test]
    fn a_function_without_a_size_reaches_to_the_next_one() {
        let symbols = [(0x10, 0), (0x10, 6), (0x20, 0), (0x28, 4), (0x30, 0)];
        let expected = [(0x10, 6), (0x20, 8), (0x28, 4), (0x30, 0x10)];
        assert_eq!(sizes(symbols.into_iter(), 0x40), expected.into());
    }
}

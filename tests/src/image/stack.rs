//! A bound on the stack: frames along the deepest path of the call graph.
//!
//! The frame of a function is taken to be all that its instructions push, on whatever path. A
//! function that jumps to another one counts as calling it, and one that calls through a pointer as
//! calling every function whose address is found in code or data. All that only makes the bound
//! larger. One kind of call through a register is told apart: to save bytes, the compiler loads the
//! address of a function that is called several times into a register and calls that. Such an
//! address is taken to be called there and not handed on.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use super::Function;
use super::thumb::{Effect, effect, length, registers};

/// The deepest path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StackUse {
    /// Bytes along it.
    pub bytes: u32,
    /// Functions along it, with their frames in bytes.
    pub path: Vec<(String, u32)>,
}

/// Why there is no bound.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StackError {
    /// There is no function of this name, or at this address.
    Missing(String),
    /// Functions call each other in a ring.
    Recursion(Vec<String>),
    /// A function takes stack by the amount.
    Unknown(String),
}

impl fmt::Display for StackError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing(name) => write!(f, "there is no function {name}"),
            Self::Recursion(path) => write!(f, "recursion: {}", path.join(" → ")),
            Self::Unknown(name) => write!(f, "{name} takes stack by an amount that is not known"),
        }
    }
}

#[derive(Default)]
struct Frame {
    bytes: u32,
    calls: Vec<u32>,
    calls_pointer: bool,
    /// Numbers that the function makes, some of which may be addresses.
    numbers: Vec<u32>,
}

/// Bound for the function of this name.
pub(super) fn of(
    functions: &BTreeMap<u32, Function>,
    words: &BTreeSet<u32>,
    name: &str,
) -> Result<StackUse, StackError> {
    let function = functions
        .values()
        .find(|function| function.name == name)
        .ok_or_else(|| StackError::Missing(name.to_owned()))?;
    let frames = functions
        .values()
        .map(|function| Ok((function.address, frame(function)?)));
    let frames: BTreeMap<_, _> = frames.collect::<Result<_, _>>()?;
    let numbers = frames
        .values()
        .flat_map(|frame| &frame.numbers)
        .chain(words);
    // Bit 0 marks Thumb code.
    let addresses = numbers
        .filter(|number| *number & 1 == 1)
        .map(|number| number & !1);
    let pointers = addresses
        .filter(|address| functions.contains_key(address))
        .collect();
    let mut search = Search {
        functions,
        frames,
        pointers,
        known: BTreeMap::new(),
        under_way: Vec::new(),
    };
    search.deepest(function.address)
}

struct Search<'a> {
    functions: &'a BTreeMap<u32, Function>,
    frames: BTreeMap<u32, Frame>,
    /// What a pointer may point to.
    pointers: BTreeSet<u32>,
    known: BTreeMap<u32, StackUse>,
    under_way: Vec<u32>,
}

impl Search<'_> {
    fn deepest(&mut self, address: u32) -> Result<StackUse, StackError> {
        if let Some(known) = self.known.get(&address) {
            return Ok(known.clone());
        }
        let function = self
            .functions
            .get(&address)
            .ok_or_else(|| StackError::Missing(format!("at {address:#x}")))?;
        if self.under_way.contains(&address) {
            let ring = self.under_way.iter().chain([&address]);
            let names = ring.filter_map(|address| self.functions.get(address));
            return Err(StackError::Recursion(
                names.map(|function| function.name.clone()).collect(),
            ));
        }
        let missing = || StackError::Missing(format!("at {address:#x}"));
        self.under_way.push(address);
        let frame = self.frames.get(&address).ok_or_else(missing)?;
        let (bytes, mut calls) = (frame.bytes, frame.calls.clone());
        if frame.calls_pointer {
            calls.extend(&self.pointers);
        }
        let mut below = StackUse {
            bytes: 0,
            path: Vec::new(),
        };
        // Among the words of a register that is called there may be numbers of another kind.
        calls.retain(|call| self.functions.contains_key(call));
        for call in calls {
            let called = self.deepest(call)?;
            if called.bytes >= below.bytes {
                below = called;
            }
        }
        self.under_way.pop();
        let mut path = vec![(function.name.clone(), bytes)];
        path.extend(below.path);
        let deepest = StackUse {
            bytes: bytes + below.bytes,
            path,
        };
        self.known.insert(address, deepest.clone());
        Ok(deepest)
    }
}

fn frame(function: &Function) -> Result<Frame, StackError> {
    let inside = function.address..function.address + function.code.len() as u32;
    let mut frame = Frame::default();
    let (mut lower, mut uses) = ([0; 16], [const { RegisterUse::NONE }; 16]);
    let mut words = BTreeMap::new();
    let half_word = |offset: u32| {
        let bytes = function.code.get(offset as usize..)?.first_chunk()?;
        Some(u16::from_le_bytes(*bytes))
    };
    let mut offset = 0;
    while let Some(first) = half_word(offset) {
        let address = function.address + offset;
        let following = function
            .data
            .partition_point(|(start, _)| *start <= address);
        if following > 0 && function.data[following - 1].1 {
            let word = u32::from(half_word(offset + 2).unwrap_or_default()) << 16;
            words.insert(address, word | u32::from(first));
            offset += 2;
            continue;
        }
        let second = half_word(offset + 2).unwrap_or_default();
        let effect = effect(address, first, second);
        match effect {
            Effect::None => {}
            Effect::Push(bytes) => frame.bytes += bytes,
            Effect::PushUnknown => return Err(StackError::Unknown(function.name.clone())),
            Effect::Indirect => frame.calls_pointer = true,
            Effect::CallRegister(register) => uses[usize::from(register)].calls = true,
            Effect::Load { register, from } => uses[usize::from(register)].loads.push(from),
            Effect::LowerHalf { register, value } => lower[usize::from(register)] = value,
            Effect::UpperHalf { register, value } => {
                let low = u32::from(lower[usize::from(register)]);
                frame.numbers.push(u32::from(value) << 16 | low);
            }
            Effect::Jump(target) if inside.contains(&target) => {}
            Effect::Call(target) | Effect::Jump(target) => frame.calls.push(target),
        }
        if !matches!(effect, Effect::CallRegister(_) | Effect::Load { .. }) {
            let used = registers(first, second);
            for (register, other) in uses.iter_mut().enumerate() {
                other.otherwise |= used >> register & 1 == 1;
            }
        }
        offset += length(first);
    }
    let (mut called, mut known_elsewhere) = (BTreeSet::<u32>::new(), BTreeSet::<u32>::new());
    for register in &uses {
        let only_called = !register.otherwise && !register.loads.is_empty();
        frame.calls_pointer |= register.calls && !only_called;
        let loaded = if register.calls {
            &mut called
        } else {
            &mut known_elsewhere
        };
        loaded.extend(&register.loads);
    }
    for (address, word) in words {
        if called.contains(&address) {
            frame.calls.push(word & !1);
        }
        if !called.contains(&address) || known_elsewhere.contains(&address) {
            frame.numbers.push(word);
        }
    }
    Ok(frame)
}

/// What a function does with a register.
struct RegisterUse {
    /// Addresses of the words that it loads into it.
    loads: Vec<u32>,
    /// It calls what the register points to.
    calls: bool,
    /// It does something else with it.
    otherwise: bool,
}

impl RegisterUse {
    const NONE: Self = Self {
        loads: Vec::new(),
        calls: false,
        otherwise: false,
    };
}

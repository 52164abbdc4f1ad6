//! A bound on the stack: frames along the deepest path of the call graph.
//!
//! The frame of a function is taken to be all that its instructions push, on whatever path. A
//! function that jumps to another one counts as calling it, and one that calls through a pointer as
//! calling every function whose address is found in code or data. All that only makes the bound
//! larger. A call or jump to where no function is known is an error, for what is not known has no
//! bound. One kind of call through a register is told apart: to save bytes, the compiler loads the
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
    /// Words of registers that are called and used otherwise, too: addresses of functions, or other numbers.
    perhaps_calls: Vec<u32>,
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
        let is_function = |address: &&u32| self.functions.contains_key(address);
        calls.extend(frame.perhaps_calls.iter().filter(is_function));
        if frame.calls_pointer {
            calls.extend(&self.pointers);
        }
        let mut below = StackUse {
            bytes: 0,
            path: Vec::new(),
        };
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
    let [mut only_called, mut perhaps_called, mut known_elsewhere] =
        [const { BTreeSet::<u32>::new() }; 3];
    for register in &uses {
        let is_only_called = !register.otherwise && !register.loads.is_empty();
        frame.calls_pointer |= register.calls && !is_only_called;
        let loaded = match (register.calls, is_only_called) {
            (true, true) => &mut only_called,
            (true, false) => &mut perhaps_called,
            (false, _) => &mut known_elsewhere,
        };
        loaded.extend(&register.loads);
    }
    for (address, word) in words {
        let called = only_called.contains(&address);
        let perhaps = perhaps_called.contains(&address);
        if called {
            frame.calls.push(word & !1);
        } else if perhaps {
            frame.perhaps_calls.push(word & !1);
        }
        if !(called || perhaps) || known_elsewhere.contains(&address) {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// push {r4, lr}; then the rest.
    fn function(address: u32, rest: &[u16]) -> (u32, Function) {
        let words = [&[0xb510], rest].concat();
        let function = Function {
            name: format!("f{address:x}"),
            address,
            code: words.iter().flat_map(|word| word.to_le_bytes()).collect(),
            // A literal follows eight bytes of code.
            data: vec![(address, false), (address + 8, true), (address + 12, false)],
        };
        (address, function)
    }

    fn bytes(functions: &[(u32, Function)]) -> Result<u32, StackError> {
        let functions = functions.iter().cloned().collect();
        of(&functions, &BTreeSet::new(), "f100").map(|used| used.bytes)
    }

    const RETURN: [u16; 1] = [0x4770];

    /// A call, a far jump, a near one and a near one on a condition, all to 0x11c where they follow the push of `f100`.
    const DIRECT: [&[u16]; 4] = [&[0xf000, 0xf80b], &[0xf000, 0xb80b], &[0xe00b], &[0xd00b]];

    #[test]
    fn what_is_called_adds_up() {
        for code in DIRECT {
            let graph = [function(0x100, code), function(0x11c, &RETURN)];
            assert_eq!(bytes(&graph), Ok(16), "{code:x?}");
        }
    }

    #[test]
    fn a_direct_call_or_jump_to_no_function_is_an_error() {
        for code in DIRECT {
            let graph = [function(0x100, code), function(0x120, &RETURN)];
            let missing = StackError::Missing("at 0x11c".to_owned());
            assert_eq!(bytes(&graph), Err(missing), "{code:x?}");
        }
    }

    #[test]
    fn what_a_register_holds_is_a_function_only_if_nothing_else_is_done_with_it() {
        // ldr r3, [pc, #4]; blx r3; then a return, or an addition to r3; the literal.
        let calls = |third, literal: u16| [0x4b01, 0x4798, third, literal, 0];
        let graph = |third, literal| {
            [
                function(0x100, &calls(third, literal)),
                function(0x120, &RETURN),
            ]
        };
        assert_eq!(bytes(&graph(0x4770, 0x121)), Ok(16));
        let missing = StackError::Missing("at 0x130".to_owned());
        assert_eq!(bytes(&graph(0x4770, 0x131)), Err(missing));
        assert_eq!(bytes(&graph(0x3301, 0x121)), Ok(16));
        assert_eq!(bytes(&graph(0x3301, 0x131)), Ok(8));
    }
}

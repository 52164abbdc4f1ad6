//! As much of the Thumb-2 instruction set as it takes to see where the stack grows and what is
//! called. Source: ARMv7-M Architecture Reference Manual, DDI 0403E, A5 and A7.

/// What an instruction does that matters here.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Effect {
    /// Nothing of it.
    None,
    /// The stack grows by so many bytes.
    Push(u32),
    /// The stack grows by an amount that is not in the instruction.
    PushUnknown,
    /// A function is called.
    Call(u32),
    /// A jump, to another function or inside this one.
    Jump(u32),
    /// A call of the function that a register points to.
    CallRegister(u16),
    /// A jump to an address in a register or in memory.
    Indirect,
    /// A register is loaded from an address near the instruction.
    Load {
        /// The register.
        register: u16,
        /// Address of the word.
        from: u32,
    },
    /// The lower half of a register is set.
    LowerHalf {
        /// The register.
        register: u16,
        /// Its lower half; the upper one becomes 0.
        value: u16,
    },
    /// The upper half of a register is set.
    UpperHalf {
        /// The register.
        register: u16,
        /// Its upper half.
        value: u16,
    },
}

/// Length in bytes of the instruction that begins with this half-word.
pub(super) fn length(first: u16) -> u32 {
    if first >> 11 >= 0b11101 { 4 } else { 2 }
}

/// Effect of the instruction at an address; `second` is not looked at if it is a short one.
pub(super) fn effect(address: u32, first: u16, second: u16) -> Effect {
    if length(first) == 2 {
        short(address, first)
    } else {
        long(address, first, second)
    }
}

fn short(address: u32, word: u16) -> Effect {
    let low_byte = u32::from(word & 0xff);
    match word {
        // push {registers, lr}
        0xb400..=0xb5ff => Effect::Push(4 * (word & 0x1ff).count_ones()),
        // sub sp, #
        0xb080..=0xb0ff => Effect::Push(4 * (low_byte & 0x7f)),
        // mov sp, register; add sp, register. From r7, the frame pointer, it is a return.
        _ if word & 0xff87 == 0x4685 && word != 0x46bd => Effect::PushUnknown,
        _ if word & 0xff87 == 0x4485 => Effect::PushUnknown,
        // blx register
        _ if word & 0xff87 == 0x4780 => Effect::CallRegister(word >> 3 & 0xf),
        // ldr register, [pc, #]
        0x4800..=0x4fff => Effect::Load {
            register: word >> 8 & 7,
            from: ((address + 4) & !3) + 4 * low_byte,
        },
        // bx lr returns, bx register jumps; so does mov pc, register.
        0x4770 => Effect::None,
        _ if word & 0xff87 == 0x4700 || word & 0xff87 == 0x4687 => Effect::Indirect,
        // b<condition>; 0xde and 0xdf are udf and svc.
        0xd000..=0xddff => Effect::Jump(relative(address, low_byte << 1, 9)),
        // b
        0xe000..=0xe7ff => Effect::Jump(relative(address, u32::from(word & 0x7ff) << 1, 12)),
        _ => Effect::None,
    }
}

fn long(address: u32, first: u16, second: u16) -> Effect {
    let (high, low) = (u32::from(first), u32::from(second));
    match first {
        // push.w {registers}: stmdb sp!
        0xe92d => Effect::Push(4 * second.count_ones()),
        // vpush: vstmdb sp!
        0xed2d | 0xed6d => Effect::Push(4 * (low & 0xff)),
        // str register, [sp, #-]!
        0xf84d if second & 0x0f00 == 0x0d00 => Effect::Push(low & 0xff),
        // strd registers, [sp, #-]!
        0xe96d => Effect::Push(4 * (low & 0xff)),
        // sub.w sp, sp, #
        0xf1ad | 0xf5ad if second & 0x8f00 == 0x0d00 => Effect::Push(expand_immediate(
            (high >> 10 & 1) << 11 | (low >> 12 & 7) << 8 | low & 0xff,
        )),
        // subw sp, sp, #
        0xf2ad | 0xf6ad if second & 0x8f00 == 0x0d00 => {
            Effect::Push((high >> 10 & 1) << 11 | (low >> 12 & 7) << 8 | low & 0xff)
        }
        // sub.w sp, sp, register
        0xebad if second & 0x0f00 == 0x0d00 => Effect::PushUnknown,
        // ldr.w pc, [register]; from [sp], # it is a return.
        0xf85d if second == 0xfb04 => Effect::None,
        _ if first & 0xff70 == 0xf850 && second >> 12 == 0xf => Effect::Indirect,
        // ldr.w register, [pc, #]
        0xf8df => Effect::Load {
            register: second >> 12,
            from: ((address + 4) & !3) + (low & 0xfff),
        },
        // movw and movt register, #
        _ if first & 0xfbf0 == 0xf240 && second >> 15 == 0 => Effect::LowerHalf {
            register: second >> 8 & 0xf,
            value: half(first, second),
        },
        _ if first & 0xfbf0 == 0xf2c0 && second >> 15 == 0 => Effect::UpperHalf {
            register: second >> 8 & 0xf,
            value: half(first, second),
        },
        // Branches: 11110 S ..., second half-word 1 L ...
        _ if first >> 11 == 0b11110 && second >> 15 == 1 => branch(address, high, low),
        _ => Effect::None,
    }
}

/// A bit for every register that the instruction may read or write, saving and restoring on the stack apart. Where the
/// encoding is not looked at closely there are some too many.
pub(super) fn registers(first: u16, second: u16) -> u16 {
    let bit = |field: u16| 1 << (field & 0xf);
    let low = |shift: u16| bit(first >> shift & 7);
    if length(first) == 4 {
        return match first {
            // push.w, pop.w, vpush, vpop
            0xe92d | 0xe8bd | 0xed2d | 0xed6d | 0xecbd | 0xecfd => 0,
            // Branches
            _ if first >> 11 == 0b11110 && second >> 15 == 1 => 0,
            // Floating point: a base, a number that is moved
            _ if first & 0xec00 == 0xec00 => bit(first) | bit(second >> 12),
            // ldm, stm
            _ if first & 0xfe40 == 0xe800 => bit(first) | second,
            _ => bit(first) | bit(second) | bit(second >> 8) | bit(second >> 12),
        };
    }
    match first {
        0x0000..=0x1fff => low(0) | low(3) | low(6),
        0x2000..=0x3fff | 0x4800..=0x4fff | 0x9000..=0xafff => low(8),
        0x4000..=0x43ff | 0x6000..=0x8fff | 0xb200..=0xb2ff | 0xba00..=0xbaff => low(0) | low(3),
        0x4400..=0x47ff => bit(first >> 4 & 8 | first & 7) | bit(first >> 3),
        0x5000..=0x5fff => low(0) | low(3) | low(6),
        // cbz, cbnz
        0xb100..=0xb1ff | 0xb300..=0xb3ff | 0xb900..=0xb9ff | 0xbb00..=0xbbff => low(0),
        // ldm, stm
        0xc000..=0xcfff => low(8) | first & 0xff,
        // Adjusting sp, push, pop, hints, branches
        _ => 0,
    }
}

/// The 16 bits of movw and movt.
fn half(first: u16, second: u16) -> u16 {
    (first & 0xf) << 12 | (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xff
}

fn branch(address: u32, high: u32, low: u32) -> Effect {
    let sign = high >> 10 & 1;
    let (j1, j2) = (low >> 13 & 1, low >> 11 & 1);
    let (i1, i2) = (!(j1 ^ sign) & 1, !(j2 ^ sign) & 1);
    let far = sign << 24 | i1 << 23 | i2 << 22 | (high & 0x3ff) << 12 | (low & 0x7ff) << 1;
    match low >> 12 & 0b1101 {
        // bl
        0b1101 => Effect::Call(relative(address, far, 25)),
        // b.w
        0b1001 => Effect::Jump(relative(address, far, 25)),
        // b<condition>.w; conditions 14 and 15 are system instructions.
        0b1000 if high >> 7 & 7 != 7 => {
            let near = sign << 20 | j2 << 19 | j1 << 18 | (high & 0x3f) << 12 | (low & 0x7ff) << 1;
            Effect::Jump(relative(address, near, 21))
        }
        _ => Effect::None,
    }
}

/// Target of a branch by a signed offset of so many bits; the program counter is 4 bytes ahead.
fn relative(address: u32, offset: u32, bits: u32) -> u32 {
    let unused = 32 - bits;
    let signed = (offset << unused) as i32 >> unused;
    address.wrapping_add(4).wrapping_add_signed(signed)
}

/// ThumbExpandImm of 12 bits, DDI 0403E, A5.3.2.
fn expand_immediate(bits: u32) -> u32 {
    let byte = bits & 0xff;
    match bits >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte << 24 | byte << 16 | byte << 8 | byte,
        _ => (0x80 | byte & 0x7f).rotate_right(bits >> 7),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instructions_as_the_assembler_writes_them() {
        let at = 0x0800_1000;
        for (first, second, expected) in [
            (0xb5f0, 0, Effect::Push(20)),          // push {r4-r7, lr}
            (0xb082, 0, Effect::Push(8)),           // sub sp, #8
            (0xe92d, 0x4ff0, Effect::Push(36)),     // push.w {r4-r11, lr}
            (0xed2d, 0x8b10, Effect::Push(64)),     // vpush {d8-d15}
            (0xf5ad, 0x7d12, Effect::Push(584)),    // sub.w sp, sp, #584
            (0xf2ad, 0x4d34, Effect::Push(0x434)),  // subw sp, sp, #1076
            (0xf84d, 0x8d04, Effect::Push(4)),      // str r8, [sp, #-4]!
            (0xebad, 0x0d04, Effect::PushUnknown),  // sub.w sp, sp, r4
            (0x46a5, 0, Effect::PushUnknown),       // mov sp, r4
            (0x46bd, 0, Effect::None),              // mov sp, r7
            (0xf000, 0xf800, Effect::Call(at + 4)), // bl .+4
            (0xf7ff, 0xfffe, Effect::Call(at)),     // bl .
            (0xf000, 0xb802, Effect::Jump(at + 8)), // b.w .+8
            (0xf43f, 0xaffe, Effect::Jump(at)),     // beq.w .
            (0xe7fe, 0, Effect::Jump(at)),          // b .
            (0xd1fe, 0, Effect::Jump(at)),          // bne .
            (0x4798, 0, Effect::CallRegister(3)),   // blx r3
            (
                0x4d02,
                0,
                Effect::Load {
                    register: 5,
                    from: at + 4 + 8,
                },
            ), // ldr r5, [pc, #8]
            (0x4718, 0, Effect::Indirect),          // bx r3
            (0x4770, 0, Effect::None),              // bx lr
            (0xf3bf, 0x8f5f, Effect::None),         // dmb
            (0xf3ef, 0x8011, Effect::None),         // mrs r0, basepri
            (0xf85d, 0xfb04, Effect::None),         // pop.w {pc}
            (
                0xf642,
                0x73cd,
                Effect::LowerHalf {
                    register: 3,
                    value: 0x2fcd,
                },
            ), // movw r3, #0x2fcd
            (
                0xf6c0,
                0x0100,
                Effect::UpperHalf {
                    register: 1,
                    value: 0x0800,
                },
            ), // movt r1, #0x800
        ] {
            assert_eq!(
                effect(at, first, second),
                expected,
                "{first:04x} {second:04x}"
            );
        }
    }
}

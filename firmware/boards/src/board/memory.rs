//! Copying and clearing memory, small.

core::arch::global_asm!(include_str!("memory.s"));

//! The control register of the floating-point environment of x86-64.
#![allow(unsafe_code)]

use std::arch::asm;

pub(crate) fn mxcsr() -> u32 {
    let mut value = 0u32;
    // SAFETY: the instruction stores the four bytes of the variable.
    unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut value, options(nostack)) };
    value
}

pub(crate) fn set_mxcsr(value: u32) {
    // SAFETY: the instruction loads four bytes. The tests set no reserved bit, and compute only in
    // the environment that they set for it.
    unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const value, options(nostack)) };
}

//! The environment of x86-64 around a call that unwinds. Around other calls it is tested with every
//! function of every FMU, in tests/conformance, and with hosts in C, tests/relations/test_hosts.py.
#![cfg(target_arch = "x86_64")]
#![allow(unsafe_code)]

use float_environment::in_default;
use std::arch::asm;
use std::panic::{catch_unwind, resume_unwind};

fn mxcsr() -> u32 {
    let mut value = 0u32;
    // SAFETY: the instruction stores the four bytes of the variable.
    unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut value, options(nostack)) };
    value
}

fn set_mxcsr(value: u32) {
    // SAFETY: the instruction loads four bytes. The tests set no reserved bit, and compute only in
    // the environment that they set for it.
    unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const value, options(nostack)) };
}

/// Rounding down, up and toward zero, flushing to zero, traps, and all flags.
const OTHERS: [u32; 6] = [0x3f80, 0x5f80, 0x7f80, 0x9fc0, 0x1900, 0x1fbf];

#[test]
fn the_callers_environment_is_restored_when_the_body_unwinds() {
    for other in OTHERS {
        set_mxcsr(other);
        let thrown = catch_unwind(|| in_default(|| resume_unwind(Box::new(()))));
        let after = mxcsr();
        set_mxcsr(0x1f80);
        assert!(thrown.is_err());
        assert_eq!(after, other, "{other:#x}");
    }
}

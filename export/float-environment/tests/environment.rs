//! The environment of x86-64 around a call. Hosts in C, tests/relations/test_hosts.py, have the
//! x87 unit and its pending exceptions too.
#![cfg(target_arch = "x86_64")]
#![allow(unsafe_code)]

use float_environment::in_default;
use std::arch::asm;
use std::hint::black_box;
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

/// Returns the environment before, the one in force during `body`, and the one after it.
fn around(other: u32, body: impl Fn()) -> [u32; 3] {
    set_mxcsr(other);
    let before = mxcsr();
    let during = in_default(|| {
        let during = mxcsr();
        body();
        during
    });
    let after = mxcsr();
    set_mxcsr(0x1f80);
    [before, during, after]
}

#[test]
fn the_callers_environment_is_left_and_restored_with_its_flags() {
    for other in OTHERS {
        // A division by zero, an inexact result, and an environment that is left behind.
        let body = || {
            assert_eq!(black_box(1.0) / black_box(0.0), f64::INFINITY);
            assert_eq!(black_box(1.0) / black_box(3.0), 0.333_333_333_333_333_3);
            set_mxcsr(0x7f80);
        };
        assert_eq!(around(other, body), [other, 0x1f80, other], "{other:#x}");
    }
}

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

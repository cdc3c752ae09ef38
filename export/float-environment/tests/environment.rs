//! The environment of x86-64 around a call that unwinds. Around other calls it is tested with every
//! function of every FMU, in tests/conformance, and with hosts in C, tests/relations/test_hosts.py.
#![cfg(target_arch = "x86_64")]

mod mxcsr;

use float_environment::in_default;
use mxcsr::{mxcsr, set_mxcsr};
use std::panic::{catch_unwind, resume_unwind};

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

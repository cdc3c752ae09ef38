//! The registers of aarch64.

use std::arch::asm;

/// An environment that was left, and is in force again when this is dropped.
pub(crate) struct Environment {
    control: u64,
    status: u64,
}

impl Environment {
    /// Leaves the present environment for the default one.
    #[inline]
    pub(crate) fn leave() -> Self {
        let status;
        // SAFETY: the instruction only reads the register.
        unsafe { asm!("mrs {}, fpsr", out(reg) status, options(nomem, nostack, preserves_flags)) };
        let environment = Self { control: control(), status };
        set_control(0);
        environment
    }
}

impl Drop for Environment {
    #[inline]
    fn drop(&mut self) {
        set_control(self.control);
        // SAFETY: the value was in the register. A flag raises no exception.
        unsafe { asm!("msr fpsr, {}", in(reg) self.status, options(nomem, nostack)) };
    }
}

#[inline]
fn control() -> u64 {
    let control;
    // SAFETY: the instruction only reads the register.
    unsafe { asm!("mrs {}, fpcr", out(reg) control, options(nomem, nostack, preserves_flags)) };
    control
}

/// Sets the control register. Writing it can take long, so it is left as it is if it is right.
#[inline]
fn set_control(value: u64) {
    if control() != value {
        // SAFETY: the value was in the register, or is the default.
        unsafe { asm!("msr fpcr, {}", in(reg) value, options(nomem, nostack)) };
    }
}

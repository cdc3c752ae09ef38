//! The registers of x86-64.

use std::arch::asm;

const MXCSR: u32 = 0x1f80;
const CONTROL_WORD: u16 = 0x37f;
/// Bits of the control word that mask exceptions.
const MASKS: u16 = 0x3f;

/// An environment that was left, and is in force again when this is dropped.
pub(crate) struct Environment {
    mxcsr: u32,
    control_word: u16,
    /// Whole environment of the x87 unit, if it traps exceptions.
    x87: Option<[u32; 7]>,
}

impl Environment {
    /// Leaves the present environment for the default one.
    #[inline]
    pub(crate) fn leave() -> Self {
        let mut mxcsr = 0u32;
        // SAFETY: the instruction stores the four bytes of the variable.
        unsafe { asm!("stmxcsr [{}]", in(reg) &raw mut mxcsr, options(nostack, preserves_flags)) };
        set_mxcsr(MXCSR);
        let control_word = control_word();
        let x87 = (control_word & MASKS != MASKS).then(|| {
            let mut x87 = [0u32; 7];
            // SAFETY: the instruction stores 28 bytes. It does not wait for a pending exception,
            // which stays in the stored bytes, and masks all exceptions.
            unsafe { asm!("fnstenv [{}]", in(reg) &raw mut x87, options(nostack)) };
            x87
        });
        set_control_word(CONTROL_WORD);
        Self { mxcsr, control_word, x87 }
    }
}

impl Drop for Environment {
    #[inline]
    fn drop(&mut self) {
        if control_word() & MASKS != MASKS {
            // SAFETY: the instruction clears the exceptions of the x87 unit, without waiting for
            // one. Exceptions that trap here are left by a library that was called.
            unsafe { asm!("fnclex", options(nomem, nostack)) };
        }
        match &self.x87 {
            // SAFETY: the instruction loads the 28 bytes that fnstenv stored. No exception is
            // pending, and one that it brings back is raised by the caller's next instruction.
            Some(x87) => unsafe { asm!("fldenv [{}]", in(reg) &raw const *x87, options(nostack)) },
            None => set_control_word(self.control_word),
        }
        set_mxcsr(self.mxcsr);
    }
}

#[inline]
fn set_mxcsr(value: u32) {
    // SAFETY: the instruction loads the four bytes of a value that was in the register, or that
    // sets no reserved bit. Loading a flag raises no exception.
    unsafe { asm!("ldmxcsr [{}]", in(reg) &raw const value, options(nostack)) };
}

#[inline]
fn control_word() -> u16 {
    let mut word = 0u16;
    // SAFETY: the instruction stores the two bytes of the variable. It waits for no exception.
    unsafe { asm!("fnstcw [{}]", in(reg) &raw mut word, options(nostack, preserves_flags)) };
    word
}

/// Sets the control word of the x87 unit, of which no exception may be pending.
#[inline]
fn set_control_word(word: u16) {
    // SAFETY: the instruction loads the two bytes of the variable.
    unsafe { asm!("fldcw [{}]", in(reg) &raw const word, options(nostack)) };
}

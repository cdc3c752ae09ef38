//! Values of an instance's variables.

use crate::interface::{OK, Status, Text};
use crate::{Instance, c, ok};
use model_description::variable::VariableKind;
use std::ffi::{CStr, c_int};
use std::ptr::null;

/// Bits of all calculated variables of an instance, in order.
pub type Bits = Vec<u64>;

impl Instance {
    /// Sets a Real variable to a value.
    pub fn set_real(&self, reference: u32, value: f64) -> Status {
        c!(self, fmi2SetReal(self.component, &reference, 1, &value))
    }

    /// Returns the value of a Real variable.
    #[track_caller]
    pub fn real(&self, reference: u32) -> f64 {
        let mut value = f64::NAN;
        ok!(self, fmi2GetReal(&reference, 1, &mut value));
        value
    }

    /// Sets an enumeration to the item with that name.
    pub fn choose(&self, name: &str, item: &str) {
        let reference = self.fmu.reference(name);
        let VariableKind::Enumeration { enumeration_type, .. } =
            &self.fmu.description.variables[reference as usize].kind
        else {
            panic!("{name} is not an enumeration");
        };
        let numbered = enumeration_type.items.iter().zip(1..);
        let value: c_int =
            numbered.filter(|((name, _), _)| name == item).map(|(_, i)| i).next().expect("an item");
        ok!(self, fmi2SetInteger(&reference, 1, &value));
    }

    /// Sets a String variable to a value.
    pub fn set_string(&self, name: &str, value: &CStr) -> Status {
        let value = value.as_ptr();
        c!(self, fmi2SetString(self.component, &self.fmu.reference(name), 1, &value))
    }

    /// Returns the bits of the variables, read with one call per type.
    pub fn bits(&self, references: &[u32]) -> Bits {
        let variables = &self.fmu.description.variables;
        let mut bits = vec![0; references.len()];
        macro_rules! read {
            ($kind:pat, $get:ident, $empty:expr, $bits_of:expr) => {
                let numbered = references.iter().copied().enumerate();
                let (places, list): (Vec<usize>, Vec<u32>) = numbered
                    .filter(|&(_, reference)| matches!(variables[reference as usize].kind, $kind))
                    .unzip();
                let mut values = vec![$empty; list.len()];
                let room = values.as_mut_ptr();
                self.ok(c!(self, $get(self.component, list.as_ptr(), list.len(), room)));
                for (place, value) in places.into_iter().zip(values) {
                    bits[place] = $bits_of(value);
                }
            };
        }
        let whole = |value: c_int| value as u64;
        let text = |text: Text| {
            // SAFETY: the call succeeded, so the text is NUL-terminated and lives until the next
            // fmi2GetString.
            let bytes = unsafe { CStr::from_ptr(text) }.to_bytes().iter();
            bytes.fold(7, |sum: u64, &byte| sum.wrapping_mul(257).wrapping_add(u64::from(byte)))
        };
        read!(VariableKind::Real { .. }, fmi2GetReal, 0.0, f64::to_bits);
        read!(
            VariableKind::Integer { .. } | VariableKind::Enumeration { .. },
            fmi2GetInteger,
            0,
            whole
        );
        read!(VariableKind::Boolean { .. }, fmi2GetBoolean, 0, whole);
        read!(VariableKind::String { .. }, fmi2GetString, null(), text);
        bits
    }

    /// Returns the first variable whose value is none: not finite, no item of its enumeration, or
    /// neither true nor false.
    pub fn wrong_value(&self) -> Option<String> {
        let component = self.component;
        let variables = &self.fmu.description.variables;
        for (variable, reference) in variables.iter().zip(0_u32..) {
            let (mut real, mut whole) = (0.0, 0);
            let is_wrong = match &variable.kind {
                VariableKind::Real { .. } => {
                    let status = c!(self, fmi2GetReal(component, &reference, 1, &mut real));
                    status == OK && !real.is_finite()
                }
                VariableKind::Enumeration { enumeration_type, .. } => {
                    let status = c!(self, fmi2GetInteger(component, &reference, 1, &mut whole));
                    status == OK
                        && !(1..).zip(&enumeration_type.items).any(|(item, _)| item == whole)
                }
                VariableKind::Boolean { .. } => {
                    let status = c!(self, fmi2GetBoolean(component, &reference, 1, &mut whole));
                    status == OK && !(0..=1).contains(&whole)
                }
                VariableKind::Integer { .. } | VariableKind::String { .. } => false,
            };
            if is_wrong {
                return Some(format!("{} = {real}, {whole}", variable.name));
            }
        }
        None
    }
}

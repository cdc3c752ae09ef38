//! Types of the values of variables, and the checks of these values.

use model_description::variable::{EnumerationType, VariableKind};

/// Type of a variable's value, with the functions by which the shell checks it.
pub(crate) trait Scalar: PartialEq + Sized {
    const TYPE: &'static str;
    /// Whether replacing this value by `other` would change nothing.
    fn same(&self, other: &Self) -> bool {
        self == other
    }
    /// Says why the value cannot be given to the importer as that of a variable of this kind, or
    /// `None` if it can.
    fn unpresentable(&self, _kind: &VariableKind) -> Option<&'static str> {
        None
    }
    /// Says why the value is not allowed for a variable of this kind, or `None` if it is.
    fn problem(&self, _kind: &VariableKind) -> Option<String> {
        None
    }
}

impl Scalar for f64 {
    const TYPE: &'static str = "Real";
    fn same(&self, other: &Self) -> bool {
        // Zero and −0 are equal, but results computed from them can differ.
        self.to_bits() == other.to_bits()
    }
    fn unpresentable(&self, _kind: &VariableKind) -> Option<&'static str> {
        (!self.is_finite())
            .then_some("is not a finite number; an input or a parameter is too large")
    }
    fn problem(&self, kind: &VariableKind) -> Option<String> {
        if !self.is_finite() {
            return Some("is not a finite number".into());
        }
        match kind {
            VariableKind::Real { min: Some(min), .. } if self < min => {
                Some(format!("is below the minimum {min}"))
            }
            VariableKind::Real { max: Some(max), .. } if self > max => {
                Some(format!("is above the maximum {max}"))
            }
            _ => None,
        }
    }
}

impl Scalar for i32 {
    const TYPE: &'static str = "Integer or Enumeration";
    fn unpresentable(&self, kind: &VariableKind) -> Option<&'static str> {
        // Only a value that `Enumeration::number` does not find has no number.
        (matches!(kind, VariableKind::Enumeration { .. }) && *self < 1)
            .then_some("holds a value that its enumeration does not list")
    }
    fn problem(&self, kind: &VariableKind) -> Option<String> {
        match kind {
            VariableKind::Integer { min: Some(min), .. } if self < min => {
                Some(format!("is below the minimum {min}"))
            }
            VariableKind::Integer { max: Some(max), .. } if self > max => {
                Some(format!("is above the maximum {max}"))
            }
            VariableKind::Enumeration {
                enumeration_type: EnumerationType { name, items, .. },
                ..
            } if *self < 1 || *self as usize > items.len() => {
                Some(format!("is not an item of {name}: these are 1 to {}", items.len()))
            }
            _ => None,
        }
    }
}

impl Scalar for bool {
    const TYPE: &'static str = "Boolean";
}

impl Scalar for String {
    const TYPE: &'static str = "String";
}

//! Types of variables' values and what is allowed for them.

use model_description::variable::Kind;

/// Type of a variable's value, with the functions by which the shell checks it.
pub(crate) trait Scalar: PartialEq + Sized {
    const TYPE: &'static str;
    /// Whether replacing this value by `other` would change nothing.
    fn same(&self, other: &Self) -> bool {
        self == other
    }
    /// Says why the value cannot be given to the importer as that of a variable of this kind, or
    /// `None` if it can.
    fn unpresentable(&self, _kind: &Kind) -> Option<&'static str> {
        None
    }
    /// Says why the value is not allowed for a variable of this kind, or `None` if it is.
    fn problem(&self, _kind: &Kind) -> Option<String> {
        None
    }
}

impl Scalar for f64 {
    const TYPE: &'static str = "Real";
    fn same(&self, other: &Self) -> bool {
        // Zero and −0 are equal, but results computed from them can differ.
        self.to_bits() == other.to_bits()
    }
    fn unpresentable(&self, _kind: &Kind) -> Option<&'static str> {
        (!self.is_finite())
            .then_some("is not a finite number; an input or a parameter is too large")
    }
    fn problem(&self, kind: &Kind) -> Option<String> {
        if !self.is_finite() {
            return Some("is not a finite number".into());
        }
        match kind {
            Kind::Real { min: Some(min), .. } if self < min => {
                Some(format!("is below the minimum {min}"))
            }
            Kind::Real { max: Some(max), .. } if self > max => {
                Some(format!("is above the maximum {max}"))
            }
            _ => None,
        }
    }
}

impl Scalar for i32 {
    const TYPE: &'static str = "Integer or Enumeration";
    fn unpresentable(&self, kind: &Kind) -> Option<&'static str> {
        // Only a value that `Enumeration::number` does not find has no number.
        (matches!(kind, Kind::Enumeration { .. }) && *self < 1)
            .then_some("holds a value that its enumeration does not list")
    }
    fn problem(&self, kind: &Kind) -> Option<String> {
        match kind {
            Kind::Integer { min: Some(min), .. } if self < min => {
                Some(format!("is below the minimum {min}"))
            }
            Kind::Integer { max: Some(max), .. } if self > max => {
                Some(format!("is above the maximum {max}"))
            }
            Kind::Enumeration { of, .. } if *self < 1 || *self as usize > of.items.len() => {
                Some(format!("is not an item of {}: these are 1 to {}", of.name, of.items.len()))
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

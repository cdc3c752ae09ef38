//! Settings that are declared once, on the fields of a structure: name, unit, range, typical
//! magnitude, and one sentence. Variable tables, range checks, files of values and documentation
//! follow from the declarations.
//!
//! ```
//! use settings::{Choice, Declared, check, read};
//!
//! /// Signs of the law.
//! #[derive(Clone, Copy, Debug, PartialEq, Choice)]
//! enum Form {
//!     /// Signs with which the error decays.
//!     Corrected,
//!     /// Signs as printed.
//!     AsPrinted,
//! }
//!
//! #[derive(Clone, Debug, Declared)]
//! struct Pd {
//!     /// Signs of the law.
//!     form: Form,
//!     /// Gain on the tracking error.
//!     #[setting(name = "gain.p", unit = "1/s2", min = 0.0, nominal = 1.0)]
//!     p: f64,
//!     /// Largest angle that the law tolerates.
//!     #[setting(unit = "rad", above = 0.0, max = 1.5)]
//!     largest_angle: f64,
//! }
//!
//! let mut pd = Pd { form: Form::Corrected, p: 0.0, largest_angle: 0.0 };
//! let file = "form = 'asPrinted'\ngain.p = 0.5\nlargestAngle = '20 deg'";
//! read(&mut pd, &toml::from_str(file)?)?;
//! assert_eq!((pd.form, pd.p, pd.largest_angle), (Form::AsPrinted, 0.5, 20_f64.to_radians()));
//!
//! pd.p = -0.5;
//! assert_eq!(check(&pd).unwrap_err().to_string(), "gain.p = -0.5 must be at least 0");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # The attribute `#[setting(…)]`
//! | key | meaning |
//! |---|---|
//! | `name` | name of the setting; by default the name of the field in camel case. Below a structure, names are joined by dots; an empty name adds nothing |
//! | `unit` | unit of measure, such as `"rad/s2"` |
//! | `rate` | the unit is that of the time derivative of the field that holds the structure |
//! | `min`, `max`, `above`, `below` | ends of the range; the last two are not allowed themselves |
//! | `nominal` | typical magnitude |
//! | `start` | value at the start, where no file has it, for [`start`] |
//! | `each` | for arrays and vectors: a constant with the ending of each name, and what the entry is for |
//! | `part` | the sentence continues that of the field that holds the structure |
//! | `text` | sentence for users, where it has to differ from the documentation comment |
//! | `used_with` | condition on other settings under which the setting has an effect, as `"profile = constant or sine"`; it is added to that of the structure, whose name `~` stands for |
//! | `skip` | the field is no setting |
//!
//! A field inherits the declarations that it lacks from the field that holds its structure.

mod access;
mod check;
mod choice;
mod place;
mod read;

pub use access::{Field, Numbered};
pub use check::{Invalid, check, names};
pub use choice::{Choice, Items};
pub use place::{About, Place};
pub use read::{Misread, change, read};
pub use settings_derive::{Choice, Declared};

use nalgebra::{Matrix3, Vector3};

/// A value whose settings are declared. Structures and enumerations derive it.
pub trait Declared {
    /// Adds the settings of a value of this type, which lies at `place`, in the order of its
    /// fields.
    fn declare(place: &Place, list: &mut Vec<Setting>)
    where
        Self: Sized;

    /// Returns the field of the setting with this index, or the index less the number of settings
    /// if there are not so many.
    ///
    /// # Errors
    /// Returns that difference.
    fn field(&mut self, index: usize) -> Result<Field<'_>, usize>;
}

/// A setting as its user sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Name, and everything else that is declared.
    pub place: Place,
    /// Type of its values.
    pub kind: Kind,
}

/// Type of a setting's values.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// Numbers.
    Real,
    /// Integers, and whether there are negative ones.
    Integer(bool),
    /// Truth values.
    Boolean,
    /// Items of an enumeration.
    Choice(Items),
    /// Texts.
    Text,
}

/// Returns the settings of a type, in the order of its fields.
pub fn settings<S: Declared>() -> Vec<Setting> {
    let mut list = Vec::new();
    S::declare(&Place::default(), &mut list);
    list
}

/// Returns the default value of a type with the declared start values.
pub fn start<S: Declared + Default>() -> S {
    let mut value = S::default();
    for (index, setting) in settings::<S>().into_iter().enumerate() {
        match (value.field(index), setting.place.start) {
            (Ok(Field::Real(field)), Some(start)) => *field = start,
            (Ok(Field::Integer(field)), Some(start)) => {
                field.set_number(start as i64);
            }
            _ => {}
        }
    }
    value
}

macro_rules! declared {
    ($($type:ty: $field:ident, $kind:expr;)*) => {$(
        impl Declared for $type {
            fn declare(place: &Place, list: &mut Vec<Setting>) {
                list.push(Setting { place: place.clone(), kind: $kind });
            }

            fn field(&mut self, index: usize) -> Result<Field<'_>, usize> {
                index.checked_sub(1).map_or(Ok(Field::$field(self)), Err)
            }
        }
    )*};
}
declared! {
    f64: Real, Kind::Real;
    bool: Boolean, Kind::Boolean;
    String: Text, Kind::Text;
    i32: Integer, Kind::Integer(true);
    u32: Integer, Kind::Integer(false);
    u64: Integer, Kind::Integer(false);
    usize: Integer, Kind::Integer(false);
}

impl<T: Declared, const N: usize> Declared for [T; N] {
    fn declare(place: &Place, list: &mut Vec<Setting>) {
        for i in 0..N {
            T::declare(&place.entry(i), list);
        }
    }

    fn field(&mut self, mut index: usize) -> Result<Field<'_>, usize> {
        for entry in self {
            match entry.field(index) {
                Ok(field) => return Ok(field),
                Err(rest) => index = rest,
            }
        }
        Err(index)
    }
}

impl Declared for Vector3<f64> {
    fn declare(place: &Place, list: &mut Vec<Setting>) {
        <[f64; 3]>::declare(place, list);
    }

    fn field(&mut self, index: usize) -> Result<Field<'_>, usize> {
        self.get_mut(index).map(Field::Real).ok_or(index.wrapping_sub(3))
    }
}

impl Declared for Matrix3<f64> {
    fn declare(place: &Place, list: &mut Vec<Setting>) {
        for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
            f64::declare(&place.cell(row, column), list);
        }
    }

    fn field(&mut self, index: usize) -> Result<Field<'_>, usize> {
        self.get_mut((index / 3, index % 3)).map(Field::Real).ok_or(index.wrapping_sub(9))
    }
}

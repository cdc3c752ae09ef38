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
//! | `rate` | the unit is that of the rate of what has the unit of the field that holds the structure |
//! | `min`, `max`, `above`, `below` | ends of the range; the last two are not allowed themselves |
//! | `nominal` | typical magnitude |
//! | `start` | value at the start, where no file has it, for [`start`] |
//! | `each` | for arrays and vectors: a constant with the ending of each name, and what the entry is for |
//! | `part` | the sentence continues that of the field that holds the structure |
//! | `text` | sentence for users, where it has to differ from the documentation comment |
//! | `skip` | the field is no setting |
//!
//! What a field does not declare, it takes from the field that holds its structure.

mod access;
mod check;
mod choice;
mod place;
mod read;

pub use access::{Access, Integer, Path, Setting};
pub use check::{Invalid, check, names};
pub use choice::{Choice, Items};
pub use place::{About, Place};
pub use read::{Misread, change, read};
pub use settings_derive::{Choice, Declared};

use nalgebra::{Matrix3, Vector3};

/// A value whose settings are declared. Structures and enumerations derive it.
pub trait Declared: Sized + 'static {
    /// Adds the settings of this value to the list. `place` is where the value lies among the
    /// settings of `S`, and `path` leads to it.
    fn declare<S: 'static>(place: &Place, path: Path<S, Self>, list: &mut Vec<Setting<S>>);
}

/// Returns the settings of a type, in the order of its fields.
pub fn settings<S: Declared>() -> Vec<Setting<S>> {
    let mut list = Vec::new();
    S::declare(&Place::default(), Path::new(|settings: &mut S| settings), &mut list);
    list
}

/// Returns the default value of a type with the declared start values.
pub fn start<S: Declared + Default>() -> S {
    let mut value = S::default();
    for setting in settings::<S>() {
        match (&setting.access, setting.place.start) {
            (Access::Real(path), Some(start)) => *path.field(&mut value) = start,
            (Access::Integer(integer, _), Some(start)) => {
                (integer.set)(&mut value, start as i64);
            }
            _ => {}
        }
    }
    value
}

impl Declared for f64 {
    fn declare<S: 'static>(place: &Place, path: Path<S, Self>, list: &mut Vec<Setting<S>>) {
        list.push(Setting::new(place, Access::Real(path)));
    }
}

impl Declared for bool {
    fn declare<S: 'static>(place: &Place, path: Path<S, Self>, list: &mut Vec<Setting<S>>) {
        list.push(Setting::new(place, Access::Boolean(path)));
    }
}

impl Declared for String {
    fn declare<S: 'static>(place: &Place, path: Path<S, Self>, list: &mut Vec<Setting<S>>) {
        list.push(Setting::new(place, Access::Text(path)));
    }
}

macro_rules! declared_integer {
    ($($kind:ty),*) => {$(
        impl Declared for $kind {
            fn declare<S: 'static>(
                place: &Place,
                path: Path<S, Self>,
                list: &mut Vec<Setting<S>>,
            ) {
                list.push(Setting::integer(place, path));
            }
        }
    )*};
}
declared_integer!(i32, u32, u64, usize);

impl<T: Declared, const N: usize> Declared for [T; N] {
    fn declare<S: 'static>(place: &Place, path: Path<S, Self>, list: &mut Vec<Setting<S>>) {
        for i in 0..N {
            T::declare(&place.entry(i), path.to(move |array: &mut Self| &mut array[i]), list);
        }
    }
}

impl Declared for Vector3<f64> {
    fn declare<S: 'static>(place: &Place, path: Path<S, Self>, list: &mut Vec<Setting<S>>) {
        for i in 0..3 {
            f64::declare(&place.entry(i), path.to(move |vector: &mut Self| &mut vector[i]), list);
        }
    }
}

impl Declared for Matrix3<f64> {
    fn declare<S: 'static>(place: &Place, path: Path<S, Self>, list: &mut Vec<Setting<S>>) {
        for (row, column) in (0..3).flat_map(|row| (0..3).map(move |column| (row, column))) {
            let entry = path.to(move |matrix: &mut Self| &mut matrix[(row, column)]);
            f64::declare(&place.cell(row, column), entry, list);
        }
    }
}

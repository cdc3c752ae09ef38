//! Settings that are declared once, on the fields of a structure: name, unit, range, typical
//! magnitude, and one sentence. Variable tables, range checks, files of values and documentation
//! follow from the declarations. Inputs and outputs of a model are declared in the same way.
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
//! | `each` | for arrays, vectors and the rows of a matrix: a constant with the ending of each name, and what the entry is for |
//! | `columns` | the same for the columns of a matrix, or for the entries of vectors in an array |
//! | `units`, `nominals` | constants with the unit and the typical magnitude of each entry of an array or a vector |
//! | `by_column` | the entries of an array of structures are listed field by field |
//! | `part` | the sentence continues that of the field that holds the structure |
//! | `text` | sentence for users, where it has to differ from the documentation comment |
//! | `used_with` | condition on other settings under which the setting has an effect, as `"profile = constant or sine"`; it is added to that of the structure, whose name `~` stands for |
//! | `input`, `output`, `local` | the value is no setting, but an input, an output or a local variable of a model |
//! | `file` | the value is no parameter of a model: a file of values sets it, see [`read_file`] |
//! | `discrete` | it changes at events or communication points only |
//! | `optional` | the input may stay unconnected |
//! | `derivative` | name of the state whose time derivative the value is |
//! | `depends_on` | an array with the names of inputs and states on which the value depends at the same instant; `*` at the end stands for any rest of a name |
//! | `skip` | the field is not declared |
//!
//! A field inherits the declarations that it lacks from the field that holds its structure. Entries
//! without a declared ending are numbered from 1, and their numbers stand at the end of names, as in
//! `row.time[2]`. A name with `+` before it continues the name of the structure without a dot.
//!
//! In sentences and conditions, `{}` stands for what the entry is for, `{.}` for the ending of its
//! name, and `{#}` for its number, in a matrix that of the column; so does `{.}` in `derivative` and
//! `depends_on`. Without `{}` the sentence of an entry ends with its purpose in brackets. If the
//! sentence of a structure has `{}` or `{.}`, they stand for the sentence and the name of each field.

mod access;
mod check;
mod choice;
mod place;
mod read;

pub use access::{Field, Number, Numbered, Settings};
pub use check::{Invalid, check, names};
pub use choice::{Choice, Items};
pub use place::{About, Entry, Place, Role};
pub use read::{Misread, change, read, read_file};
pub use settings_derive::{Choice, Declared};

use nalgebra::SMatrix;

/// A value whose settings are declared. Structures and enumerations derive it.
///
/// # Safety
/// At the offset of each setting, counted from that of the place, every value of this type holds a
/// field of the setting's type.
#[allow(unsafe_code, reason = "fields are reached by their offsets")]
pub unsafe trait Declared {
    /// Adds the settings of a value of this type, which lies at `place`, in the order of its
    /// fields.
    fn declare(place: &Place, list: &mut Vec<Setting>)
    where
        Self: Sized;
}

/// A setting as its user sees it.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Name, and everything else that is declared.
    pub place: Place,
    /// Type of its values.
    pub kind: Kind,
}

/// Type of a setting's values.
#[derive(Clone, Debug)]
pub enum Kind {
    /// Numbers.
    Real,
    /// Integers, and whether there are negative ones.
    Integer(bool, Number),
    /// Truth values.
    Boolean,
    /// Items of an enumeration.
    Choice(Items, Number),
    /// Texts.
    Text,
}

/// Returns the settings of a type, in the order of its fields.
pub fn settings<S: Declared>() -> Settings<S> {
    Settings::new()
}

/// Returns the default value of a type with the declared start values.
pub fn start<S: Declared + Default>() -> S {
    let mut value = S::default();
    let settings = settings::<S>();
    for (index, setting) in settings.iter().enumerate() {
        match (settings.field(&mut value, index), setting.place.start) {
            (Field::Real(field), Some(start)) => *field = start,
            (Field::Integer(field), Some(start)) => {
                field.set_number(start as i64);
            }
            _ => {}
        }
    }
    value
}

macro_rules! declared {
    ($($type:ty: $kind:expr;)*) => {$(
        // SAFETY: The only field is the value itself.
        #[allow(unsafe_code, reason = "its type is that of the kind")]
        unsafe impl Declared for $type {
            fn declare(place: &Place, list: &mut Vec<Setting>) {
                list.push(Setting { place: place.clone(), kind: $kind });
            }
        }
    )*};
}
declared! {
    f64: Kind::Real;
    bool: Kind::Boolean;
    String: Kind::Text;
    i32: Kind::Integer(true, |field| field.cast::<Self>());
    u32: Kind::Integer(false, |field| field.cast::<Self>());
    u64: Kind::Integer(false, |field| field.cast::<Self>());
    usize: Kind::Integer(false, |field| field.cast::<Self>());
}

// SAFETY: The entries of an array lie one after the other.
#[allow(unsafe_code, reason = "each entry has its offset")]
unsafe impl<T: Declared, const N: usize> Declared for [T; N] {
    fn declare(place: &Place, list: &mut Vec<Setting>) {
        let mut entries = Vec::new();
        for i in 0..N {
            T::declare(&place.entry(i, i * size_of::<T>()), &mut entries);
        }
        if !place.by_column {
            return list.append(&mut entries);
        }
        let fields = entries.len() / N.max(1);
        for field in 0..fields {
            list.extend(entries.iter().skip(field).step_by(fields).cloned());
        }
    }
}

// SAFETY: The offsets are those of a value of the type, which holds its entries itself.
#[allow(unsafe_code, reason = "each entry has its offset")]
unsafe impl<const R: usize, const C: usize> Declared for SMatrix<f64, R, C> {
    fn declare(place: &Place, list: &mut Vec<Setting>) {
        let sample = Self::zeros();
        for (row, column) in (0..R).flat_map(|row| (0..C).map(move |column| (row, column))) {
            let offset = (&raw const sample[(row, column)]).addr() - (&raw const sample).addr();
            let place =
                if C == 1 { place.entry(row, offset) } else { place.cell(row, column, offset) };
            f64::declare(&place, list);
        }
    }
}

//! Access to the fields of declared values by their offsets.

use crate::choice::Choice;
use crate::{Declared, Kind, Place, Setting};
use std::marker::PhantomData;
use std::ops::Deref;

/// The field of a setting.
pub enum Field<'a> {
    /// A number.
    Real(&'a mut f64),
    /// An integer.
    Integer(&'a mut dyn Numbered),
    /// A truth value.
    Boolean(&'a mut bool),
    /// A choice, by the position of its item from 0.
    Choice(&'a mut dyn Numbered),
    /// A text.
    Text(&'a mut String),
}

/// Conversion of the address of an integer or a choice to a pointer of its type.
pub type Number = fn(*mut ()) -> *mut dyn Numbered;

/// The settings of a type, in the order of its fields.
#[derive(Clone, Debug)]
pub struct Settings<S> {
    list: Vec<Setting>,
    holder: PhantomData<fn(S)>,
}

impl<S: Declared> Settings<S> {
    pub(crate) fn new() -> Self {
        let mut list = Vec::new();
        S::declare(&Place::default(), &mut list);
        Self { list, holder: PhantomData }
    }

    /// Returns the field of the setting at a position in this list.
    #[allow(unsafe_code, reason = "the field is found by its offset")]
    pub fn field<'a>(&self, value: &'a mut S, index: usize) -> Field<'a> {
        let Setting { place, kind } = &self.list[index];
        let start = (&raw mut *value).cast::<u8>();
        // SAFETY: `S` promises that this offset of its values holds a field of this type, and the
        // value is borrowed for as long as the field.
        unsafe {
            let field = start.add(place.offset).cast::<()>();
            match kind {
                Kind::Real => Field::Real(&mut *field.cast()),
                Kind::Integer(_, number) => Field::Integer(&mut *number(field)),
                Kind::Boolean => Field::Boolean(&mut *field.cast()),
                Kind::Choice(_, number) => Field::Choice(&mut *number(field)),
                Kind::Text => Field::Text(&mut *field.cast()),
            }
        }
    }
}

impl<S> Deref for Settings<S> {
    type Target = [Setting];
    fn deref(&self) -> &[Setting] {
        &self.list
    }
}

/// A value that is encoded as an integer.
pub trait Numbered {
    /// Returns the integer.
    fn number(&self) -> i64;

    /// Sets the value, and returns whether there is one for this integer.
    fn set_number(&mut self, number: i64) -> bool;
}

macro_rules! numbered {
    ($($kind:ty),*) => {$(
        impl Numbered for $kind {
            fn number(&self) -> i64 {
                (*self).try_into().unwrap_or(i64::MAX)
            }

            fn set_number(&mut self, number: i64) -> bool {
                let value = Self::try_from(number).ok();
                value.map(|value| *self = value).is_some()
            }
        }
    )*};
}
numbered!(i32, u32, u64, usize);

/// The position of the item, or −1 for one that a hand-written list leaves out.
impl<C: Choice> Numbered for C {
    fn number(&self) -> i64 {
        let place = C::ITEMS.iter().position(|item| item.0 == *self);
        place.and_then(|place| i64::try_from(place).ok()).unwrap_or(-1)
    }

    fn set_number(&mut self, number: i64) -> bool {
        let item = usize::try_from(number).ok().and_then(|place| C::ITEMS.get(place));
        item.map(|item| *self = item.0).is_some()
    }
}

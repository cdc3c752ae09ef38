//! Access to the field of a setting.

use crate::choice::Choice;

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

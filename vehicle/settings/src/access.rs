//! A setting, and access to its field.

use crate::choice::{Choice, Items};
use crate::place::Place;
use std::sync::Arc;

/// The way from a structure `S` to a field `T` in it.
pub struct Path<S, T>(Arc<dyn Fn(&mut S) -> &mut T + Send + Sync>);

impl<S, T> Clone for Path<S, T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<S: 'static, T: 'static> Path<S, T> {
    /// Makes a path of a function that returns the field.
    pub fn new(field: impl Fn(&mut S) -> &mut T + Send + Sync + 'static) -> Self {
        Self(Arc::new(field))
    }

    /// Returns the field.
    pub fn field<'a>(&self, settings: &'a mut S) -> &'a mut T {
        (self.0)(settings)
    }

    /// Continues the path to a field of the field.
    pub fn to<U: 'static>(
        &self,
        field: impl Fn(&mut T) -> &mut U + Send + Sync + 'static,
    ) -> Path<S, U> {
        let path = self.clone();
        Path::new(move |settings: &mut S| field(path.field(settings)))
    }
}

/// Access to a field whose values are numbered.
pub struct Integer<S> {
    /// Function that returns the value.
    pub get: Box<dyn Fn(&mut S) -> i64 + Send + Sync>,
    /// Function that sets the value, and returns whether the field can hold it.
    pub set: Box<dyn Fn(&mut S, i64) -> bool + Send + Sync>,
}

/// Access to the field of a setting.
pub enum Access<S> {
    /// A number.
    Real(Path<S, f64>),
    /// An integer, and whether its type has negative numbers.
    Integer(Integer<S>, bool),
    /// A truth value.
    Boolean(Path<S, bool>),
    /// An item of an enumeration, by its position from 0.
    Choice(Integer<S>, Items),
    /// A text.
    Text(Path<S, String>),
}

/// A setting of `S`: what its user has to know, and access to its field.
pub struct Setting<S> {
    /// Name, and everything else that is declared.
    pub place: Place,
    /// Access to the field.
    pub access: Access<S>,
}

impl<S: 'static> Setting<S> {
    /// Makes a setting that lies at a place.
    pub fn new(place: &Place, access: Access<S>) -> Self {
        Self { place: place.clone(), access }
    }

    /// Makes a setting with an integer field.
    pub fn integer<I>(place: &Place, path: Path<S, I>) -> Self
    where
        I: Copy + TryFrom<i64> + TryInto<i64> + 'static,
    {
        let writing = path.clone();
        let access = Integer {
            get: Box::new(move |settings| (*path.field(settings)).try_into().unwrap_or(i64::MAX)),
            set: Box::new(move |settings, value| {
                let value = I::try_from(value).ok();
                value.map(|value| *writing.field(settings) = value).is_some()
            }),
        };
        Self::new(place, Access::Integer(access, I::try_from(-1).is_ok()))
    }

    /// Makes a setting whose field is a choice. Without a sentence it has that of its type.
    pub fn choice<C: Choice>(place: &Place, path: Path<S, C>) -> Self {
        let writing = path.clone();
        // A value that a hand-written list leaves out has no number.
        let number = |value: &C| {
            let place = C::ITEMS.iter().position(|item| item.0 == *value);
            place.and_then(|place| i64::try_from(place).ok()).unwrap_or(-1)
        };
        let access = Integer {
            get: Box::new(move |settings| number(path.field(settings))),
            set: Box::new(move |settings, number| {
                let item = usize::try_from(number).ok().and_then(|i| C::ITEMS.get(i));
                item.map(|item| *writing.field(settings) = item.0).is_some()
            }),
        };
        let mut place = place.clone();
        if place.text.is_empty() {
            place.text = C::TEXT.to_owned();
        }
        Self::new(&place, Access::Choice(access, C::items()))
    }
}

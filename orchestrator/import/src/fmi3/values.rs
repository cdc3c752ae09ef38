//! Values on their way between the types of the master and those of FMI 3.0. A Float32 is read
//! without loss, and set to the nearest value; an integer that does not fit is refused.

#![allow(unsafe_code)]

use super::functions::{Functions, call};
use super::layout::{Arrays, Layout};
use crate::library::FmuInstance;
use fmi_master::description::ScalarType;
use fmi_master::instance::{CallFailure, Outcome};
use std::ffi::c_void;

/// Largest number of lists of variables that are remembered.
const LISTS: usize = 64;

/// Lists of variables that were transferred, so that a step allocates nothing.
#[derive(Default)]
pub(super) struct Lists(Vec<List>);

/// A list of variables, grouped by their types in FMI 3.0.
struct List {
    references: Vec<u32>,
    groups: Vec<Group>,
}

/// Variables of one type, which are transferred by one call, with the whole arrays that they are
/// part of.
struct Group {
    scalar: ScalarType,
    arrays: Arrays,
    /// Places of the variables in the list.
    places: Vec<usize>,
    /// Room for the values, whose type is at most this large.
    buffer: Vec<u64>,
}

impl Lists {
    fn list(&mut self, layout: &Layout, references: &[u32]) -> &mut List {
        let known = self.0.iter().position(|list| list.references == references);
        let place = known.unwrap_or_else(|| {
            if self.0.len() >= LISTS {
                self.0.clear();
            }
            self.0.push(List::new(layout, references));
            self.0.len() - 1
        });
        &mut self.0[place]
    }

    /// Reads variables.
    pub(super) fn get<V: Carried>(
        &mut self,
        unit: &mut FmuInstance<Functions>,
        layout: &Layout,
        references: &[u32],
        values: &mut [V],
    ) -> Outcome {
        assert_eq!(references.len(), values.len(), "as many values as references");
        for group in &mut self.list(layout, references).groups {
            let buffer = group.buffer.as_mut_ptr().cast();
            group.transfer(unit, false, buffer)?;
            V::decode(group, values).map_err(|(place, value)| {
                let name = layout.name(references[place]);
                let text =
                    format!("\"{name}\" is {value}, and this program reads integers of 32 bits");
                CallFailure::answer(call(group.scalar, false), text)
            })?;
        }
        Ok(())
    }

    /// Sets variables. Elements of an array that are not among them keep their values.
    pub(super) fn set<V: Carried>(
        &mut self,
        unit: &mut FmuInstance<Functions>,
        layout: &Layout,
        references: &[u32],
        values: &[V],
    ) -> Outcome {
        assert_eq!(references.len(), values.len(), "as many values as references");
        for group in &mut self.list(layout, references).groups {
            let buffer = group.buffer.as_mut_ptr().cast();
            if group.places.len() < group.arrays.count {
                group.transfer(unit, false, buffer)?;
            }
            V::encode(group, values).map_err(|(place, value)| {
                let (name, scalar) = (layout.name(references[place]), group.scalar);
                let text = format!("\"{name}\" is of type {scalar:?}, which cannot be {value}");
                CallFailure::new(call(scalar, true), text)
            })?;
            group.transfer(unit, true, buffer)?;
        }
        Ok(())
    }
}

impl List {
    fn new(layout: &Layout, references: &[u32]) -> Self {
        let mut groups: Vec<Group> = Vec::new();
        for (position, reference) in references.iter().enumerate() {
            let place = layout.place(*reference);
            let known = groups.iter().position(|group| group.scalar == place.scalar);
            let group = known.unwrap_or(groups.len());
            if known.is_none() {
                let (arrays, places, buffer) = <_>::default();
                groups.push(Group { scalar: place.scalar, arrays, places, buffer });
            }
            groups[group].arrays.push(place);
            groups[group].places.push(position);
        }
        for group in &mut groups {
            group.buffer = vec![0; group.arrays.count];
        }
        Self { references: references.to_vec(), groups }
    }
}

impl Group {
    /// Gets or sets values; there must be room for all elements of the arrays.
    fn transfer(
        &self,
        unit: &mut FmuInstance<Functions>,
        sets: bool,
        values: *mut c_void,
    ) -> Outcome {
        let name = call(self.scalar, sets);
        let functions = if sets { &unit.functions().set } else { &unit.functions().get };
        let Some(function) = functions[self.scalar as usize] else {
            return Err(CallFailure::new(name, "its library has no such function"));
        };
        let Arrays { references, count, .. } = &self.arrays;
        // SAFETY: the instance is alive, both arrays have the lengths that are passed, and the
        // function takes values of this type. It only reads values that it sets.
        unit.call(name, |_, handle| unsafe {
            function(handle, references.as_ptr(), references.len(), values, *count)
        })
    }

    fn decode_as<T: Plain, V>(
        &self,
        values: &mut [V],
        convert: impl Fn(T) -> Option<V>,
    ) -> Result<(), Misfit> {
        // SAFETY: `Plain` promises that the buffer has room for that many values, and that any bits
        // are such values.
        let own = unsafe {
            std::slice::from_raw_parts(self.buffer.as_ptr().cast::<T>(), self.buffer.len())
        };
        for (place, element) in self.places.iter().zip(&self.arrays.elements) {
            let value = own[*element];
            values[*place] = convert(value).ok_or_else(|| (*place, value.to_string()))?;
        }
        Ok(())
    }

    fn encode_as<T: Plain, V: Copy + ToString>(
        &mut self,
        values: &[V],
        convert: impl Fn(V) -> Option<T>,
    ) -> Result<(), Misfit> {
        let own = self.buffer.as_mut_ptr().cast::<T>();
        // SAFETY: as in `decode_as`.
        let own = unsafe { std::slice::from_raw_parts_mut(own, self.buffer.len()) };
        for (place, element) in self.places.iter().zip(&self.arrays.elements) {
            let value = values[*place];
            own[*element] = convert(value).ok_or_else(|| (*place, value.to_string()))?;
        }
        Ok(())
    }
}

/// Place in the list of a value that does not fit, with the value.
type Misfit = (usize, String);

/// A type of C of at most 8 bytes, of which any bits are a value.
///
/// # Safety
/// It must be one.
unsafe trait Plain: Copy + ToString {}

/// A type of the master.
#[expect(private_interfaces, reason = "only this module has other types")]
pub(super) trait Carried: Copy {
    /// Takes values out of the group's buffer.
    fn decode(group: &Group, values: &mut [Self]) -> Result<(), Misfit>;
    /// Puts values into the group's buffer.
    fn encode(group: &mut Group, values: &[Self]) -> Result<(), Misfit>;
}

#[expect(private_interfaces, reason = "as in the trait")]
impl Carried for f64 {
    fn decode(group: &Group, values: &mut [Self]) -> Result<(), Misfit> {
        match group.scalar {
            ScalarType::Float32 => group.decode_as(values, |value: f32| Some(value.into())),
            _ => group.decode_as(values, Some),
        }
    }

    fn encode(group: &mut Group, values: &[Self]) -> Result<(), Misfit> {
        // A number that is too large must not become an infinite one.
        let narrow = |value: f64| {
            let narrow = value as f32;
            (narrow.is_finite() || !value.is_finite()).then_some(narrow)
        };
        match group.scalar {
            ScalarType::Float32 => group.encode_as(values, narrow),
            _ => group.encode_as(values, Some),
        }
    }
}

macro_rules! whole {
    ($($scalar:ident = $type:ty),*) => {
        $(
            // SAFETY: any bits are such a number, which has at most 8 bytes.
            unsafe impl Plain for $type {}
        )*

        #[expect(private_interfaces, reason = "as in the trait")]
        impl Carried for i32 {
            fn decode(group: &Group, values: &mut [Self]) -> Result<(), Misfit> {
                match group.scalar {
                    $(ScalarType::$scalar => {
                        group.decode_as(values, |value: $type| value.try_into().ok())
                    })*
                    // A truth value of C is a byte.
                    _ => group.decode_as(values, |value: u8| Some(value.into())),
                }
            }

            fn encode(group: &mut Group, values: &[Self]) -> Result<(), Misfit> {
                match group.scalar {
                    $(ScalarType::$scalar => {
                        group.encode_as(values, |value| <$type>::try_from(value).ok())
                    })*
                    _ => group.encode_as(values, |value| Some(u8::from(value != 0))),
                }
            }
        }
    };
}

whole!(
    Int8 = i8,
    UInt8 = u8,
    Int16 = i16,
    UInt16 = u16,
    Int32 = i32,
    UInt32 = u32,
    Int64 = i64,
    UInt64 = u64
);
// SAFETY: any bits are such a number, which has at most 8 bytes.
unsafe impl Plain for f32 {}
// SAFETY: as above.
unsafe impl Plain for f64 {}

//! Copies of memories without allocation.

/// Implements `Clone` for a type of which only the given fields own memory. `clone_from`, by which
/// a memory is copied at every tick, keeps what these fields have allocated; the derived one would
/// allocate anew. The brackets hold the parameters of the type.
macro_rules! clone_in_place {
    ([$($parameters:tt)*] $type:ty { $($field:ident),+ }) => {
        #[allow(clippy::needless_update)] // Some types have no other fields.
        impl<$($parameters)*> Clone for $type {
            fn clone(&self) -> Self {
                Self { $($field: self.$field.clone(),)+ ..*self }
            }

            fn clone_from(&mut self, source: &Self) {
                let Self { $(mut $field,)+ .. } = std::mem::take(self);
                $($field.clone_from(&source.$field);)+
                *self = Self { $($field,)+ ..*source };
            }
        }
    };
}

pub(crate) use clone_in_place;

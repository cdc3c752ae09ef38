//! Enumerations whose variants are the values of a setting.

use crate::{Kind, Place, Setting};

/// An enumeration without fields. Derived, its names are those of the variants in camel case, and
/// the sentences are the documentation comments.
pub trait Choice: Copy + PartialEq + Send + Sync + 'static {
    /// Name of the enumeration.
    const NAME: &'static str;
    /// Subject of the choice, in one sentence.
    const TEXT: &'static str;
    /// The variants, each with its name and its meaning.
    const ITEMS: &'static [(Self, &'static str, &'static str)];

    /// Returns the texts of the enumeration.
    fn items() -> Items {
        let items = Self::ITEMS.iter().map(|(_, name, text)| (*name, *text)).collect();
        Items { name: Self::NAME, text: Self::TEXT, items }
    }

    /// Returns the setting at a place. Without a sentence it has that of the enumeration.
    fn setting(place: &Place) -> Setting {
        let mut place = place.clone();
        if place.text.is_empty() {
            Self::TEXT.clone_into(&mut place.text);
        }
        Setting { place, kind: Kind::Choice(Self::items(), |field| field.cast::<Self>()) }
    }
}

/// Texts of a [`Choice`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Items {
    /// Name of the enumeration.
    pub name: &'static str,
    /// Subject of the choice, in one sentence.
    pub text: &'static str,
    /// Name and meaning of each item.
    pub items: Vec<(&'static str, &'static str)>,
}

//! The master's value references, each of which stands for a scalar, and what FMI 3.0 calls them.

use fmi_master::description::{ModelDescription, Place, VariableKind};
use std::collections::BTreeMap;

/// Scalar variables by the master's value references.
pub(crate) struct Layout {
    places: Vec<Place>,
    names: Vec<String>,
    /// Whether instances have event mode.
    pub(super) has_events: bool,
    /// Whether there are inputs.
    pub(super) has_inputs: bool,
}

impl Layout {
    /// Lists the variables of an FMU, for instances for model exchange if it `exchanges`.
    ///
    /// # Errors
    /// Returns a line that names a clock which this program cannot tick.
    pub(crate) fn new(description: &ModelDescription, exchanges: bool) -> Result<Self, String> {
        let interface = description.co_simulation.as_ref();
        let has_events =
            exchanges || interface.is_some_and(|interface| interface.has("hasEventMode"));
        let has_inputs = description.variables.iter().any(|known| known.causality == "input");
        let mut names = vec![String::new(); description.places.len()];
        for variable in &description.variables {
            let name = &variable.name;
            if let VariableKind::Clock { interval } = &variable.kind {
                if variable.causality == "input" && interval != "triggered" {
                    return Err(format!(
                        "has the clock \"{name}\" ({interval}), which the importer has to tick: export the model so that it ticks its clocks itself"
                    ));
                }
                if !has_events {
                    return Err(format!(
                        "has the clock \"{name}\", but no event mode, which FMI 3.0 demands: export the model with hasEventMode"
                    ));
                }
            }
            // An alias comes after the variable itself.
            if let Some(known) = names.get_mut(variable.reference as usize).filter(|n| n.is_empty())
            {
                known.clone_from(name);
            }
        }
        Ok(Self { places: description.places.clone(), names, has_events, has_inputs })
    }

    /// Returns the place of a variable.
    pub(super) fn place(&self, reference: u32) -> Place {
        self.places[reference as usize]
    }

    /// Returns the name of a variable.
    pub(super) fn name(&self, reference: u32) -> &str {
        &self.names[reference as usize]
    }
}

/// The arrays that scalar variables belong to, with all their elements.
#[derive(Default)]
pub(super) struct Arrays {
    /// Value references of FMI 3.0.
    pub(super) references: Vec<u32>,
    /// Number of elements of all arrays.
    pub(super) count: usize,
    /// Places of the scalar variables among these elements.
    pub(super) elements: Vec<usize>,
    /// Places of the first elements, by the value references.
    firsts: BTreeMap<u32, usize>,
}

impl Arrays {
    pub(super) fn push(&mut self, place: Place) {
        let first = *self.firsts.entry(place.reference).or_insert_with(|| {
            self.references.push(place.reference);
            self.count += place.length;
            self.count - place.length
        });
        self.elements.push(first + place.element);
    }
}

impl FromIterator<Place> for Arrays {
    fn from_iter<T: IntoIterator<Item = Place>>(places: T) -> Self {
        let mut arrays = Self::default();
        places.into_iter().for_each(|place| arrays.push(place));
        arrays
    }
}

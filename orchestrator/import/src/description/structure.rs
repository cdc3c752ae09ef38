//! The model structure: which variables are derivatives, and on which ones outputs depend.

use crate::xml::Element;
use std::collections::BTreeMap;

/// Largest number of elements that a list may have.
pub(super) const MOST: usize = 1_000_000;

/// Positions of a variable of the file: those of its first element, and of the first elements of
/// its aliases, with the number of elements.
#[derive(Default)]
pub(super) struct Positions {
    pub(super) firsts: Vec<usize>,
    pub(super) length: usize,
}

/// The variables by the numbers with which the model structure refers to them.
pub(super) struct Known {
    /// Attribute that holds such a number, and what it is.
    pub(super) key: (&'static str, &'static str),
    pub(super) positions: BTreeMap<u32, Positions>,
}

impl Known {
    fn find(&self, entry: &Element, number: u32) -> Result<&Positions, String> {
        let (_, kind) = self.key;
        self.positions.get(&number).ok_or_else(|| {
            format!("{} refers to the {kind} {number}, which no variable has", entry.title())
        })
    }

    /// Returns the variable that an entry is about.
    fn subject(&self, entry: &Element) -> Result<&Positions, String> {
        let (key, kind) = self.key;
        let number = entry.parsed(key, &format!("of the kind {kind}"))?;
        self.find(entry, number.ok_or_else(|| format!("{} has no attribute {key}", entry.title()))?)
    }

    /// Returns the positions of all elements of the variables that the entries are about.
    pub(super) fn listed<'a>(
        &self,
        entries: impl Iterator<Item = &'a Element>,
    ) -> Result<Vec<usize>, String> {
        let mut listed = Vec::new();
        for entry in entries {
            let Positions { firsts, length } = self.subject(entry)?;
            listed.extend(firsts[0]..firsts[0] + length);
            if listed.len() > MOST {
                return Err(format!("lists more than {MOST} elements as {}", entry.name));
            }
        }
        Ok(listed)
    }

    /// Returns the positions of the variables that each output depends on, by the position of the
    /// output. Only outputs that declare their dependencies have an entry. Elements of an array
    /// depend on all elements of others.
    pub(super) fn dependencies<'a>(
        &self,
        outputs: impl Iterator<Item = &'a Element>,
    ) -> Result<BTreeMap<usize, Vec<usize>>, String> {
        let mut dependencies = BTreeMap::new();
        for output in outputs {
            let Positions { firsts, length } = self.subject(output)?;
            let Some(text) = output.attribute("dependencies") else { continue };
            let mut needed = Vec::new();
            for text in text.split_whitespace() {
                let (title, kind) = (output.title(), self.key.1);
                let known = text.parse();
                let known = known
                    .map_err(|_| format!("\"{}\" in {title} is no {kind}", text.escape_default()));
                let Positions { firsts, length } = self.find(output, known?)?;
                needed.extend(firsts[0]..firsts[0] + length);
            }
            // Without an entry an output depends on everything.
            if needed.len().saturating_mul(*length) > MOST {
                continue;
            }
            for first in firsts {
                let outputs = *first..first + length;
                dependencies.extend(outputs.map(|output| (output, needed.clone())));
            }
        }
        Ok(dependencies)
    }
}

//! Reads the variables of FMI 3.0. The elements of an array become scalar variables, whose names
//! end in their indices, such as `x[1,2]`; an alias becomes a variable of the same place.

use super::structure::{Known, MOST, Positions};
use super::{Listed, Types, bound, enumeration, named, real, reference};
use crate::xml::Element;
use fmi_master::description::{Array, Place, ScalarType, Variable, VariableKind};
use std::collections::BTreeMap;

/// Types by the names of their elements. An `Enumeration` has the functions of `Int64`.
const TYPES: [(&str, ScalarType); 15] = [
    ("Float64", ScalarType::Float64),
    ("Float32", ScalarType::Float32),
    ("Int8", ScalarType::Int8),
    ("UInt8", ScalarType::UInt8),
    ("Int16", ScalarType::Int16),
    ("UInt16", ScalarType::UInt16),
    ("Int32", ScalarType::Int32),
    ("UInt32", ScalarType::UInt32),
    ("Int64", ScalarType::Int64),
    ("UInt64", ScalarType::UInt64),
    ("Boolean", ScalarType::Boolean),
    ("String", ScalarType::String),
    ("Binary", ScalarType::Binary),
    ("Clock", ScalarType::Clock),
    ("Enumeration", ScalarType::Int64),
];

/// Reads all variables of a description, with the dependencies of outputs on inputs.
pub(super) fn read(root: &Element, types: &Types) -> Result<Listed, String> {
    let elements = root.child("ModelVariables").map(|list| &list.children[..]).unwrap_or_default();
    let mut listed = Listed::default();
    let mut positions: BTreeMap<u32, Positions> = BTreeMap::new();
    // Positions of derivatives with the value references of their states.
    let mut derivatives: Vec<(usize, u32)> = Vec::new();
    for element in elements {
        let Some((_, scalar)) = TYPES.iter().find(|(name, _)| *name == element.name) else {
            continue;
        };
        let (reference, variable) = (reference(element)?, variable(element, *scalar, types)?);
        let shape = shape(element, elements)?;
        let length = shape.iter().try_fold(1_usize, |product, size| product.checked_mul(*size));
        let length = length.filter(|length| listed.variables.len().saturating_add(*length) <= MOST);
        let length = length.ok_or_else(|| {
            format!("{} has more elements than are supported, {MOST}", element.title())
        })?;
        let starts = starts(element);
        if let Some(state) = element.parsed("derivative", "a value reference")? {
            derivatives.push((listed.variables.len(), state));
        }
        let first_place = listed.places.len();
        listed.places.extend((0..length).map(|number| Place {
            scalar: *scalar,
            reference,
            element: number,
            length,
        }));
        let positions = positions.entry(reference).or_default();
        positions.length = length;
        let aliases = element.children.iter().filter(|child| child.name == "Alias");
        for variable in
            std::iter::once(Ok(variable.clone())).chain(aliases.map(|a| alias(a, &variable)))
        {
            let (variable, first) = (variable?, listed.variables.len());
            let is_alias = !positions.firsts.is_empty();
            positions.firsts.push(first);
            let starts = if is_alias { &[][..] } else { &starts[..] };
            listed.variables.extend((0..length).map(|number| Variable {
                name: format!("{}{}", variable.name, indices(number, &shape)),
                // At most `MOST`.
                reference: (first_place + number) as u32,
                // A single value holds for all elements.
                start: starts.get(number).or(starts.first().filter(|_| starts.len() == 1)).cloned(),
                ..variable.clone()
            }));
            if !shape.is_empty() {
                let array = Array { shape: shape.clone(), elements: first..first + length };
                listed.arrays.insert(variable.name, array);
            }
        }
    }
    for (first, state) in derivatives {
        if let Some(Positions { firsts, length }) = positions.get(&state) {
            let variables = listed.variables[first..].iter_mut().take(*length);
            variables
                .zip(firsts[0]..)
                .for_each(|(variable, state)| variable.derivative_of = Some(state));
        }
    }
    let known = Known { key: ("valueReference", "value reference"), positions };
    listed.dependencies = known.dependencies(entries(root, "Output"))?;
    listed.derivatives = known.listed(entries(root, "ContinuousStateDerivative"))?;
    listed.event_indicators = known.listed(entries(root, "EventIndicator"))?.len();
    Ok(listed)
}

fn variable(element: &Element, scalar: ScalarType, types: &Types) -> Result<Variable, String> {
    let declared = element.attribute("declaredType").and_then(|name| types.get(name)).copied();
    let kind = match (element.name.as_str(), scalar) {
        ("Enumeration", _) => enumeration(element, declared)?,
        (_, ScalarType::Float64 | ScalarType::Float32) => real(element, declared)?,
        (_, ScalarType::Boolean) => VariableKind::Boolean,
        (_, ScalarType::String) => VariableKind::String,
        (_, ScalarType::Binary) => VariableKind::Binary,
        (_, ScalarType::Clock) => VariableKind::Clock {
            interval: element.attribute("intervalVariability").unwrap_or_default().to_string(),
        },
        (_, whole) => {
            let (least, largest) = limits(whole);
            let bound = |name: &str| bound::<i128>(name, "a whole number", element, declared);
            let min = bound("min")?.unwrap_or(least).max(least);
            let max = bound("max")?.unwrap_or(largest).min(largest);
            // What is beyond 32 bits bounds none of the values that are transferred.
            VariableKind::Integer { min: i32::try_from(min).ok(), max: i32::try_from(max).ok() }
        }
    };
    let causality = element.attribute("causality").unwrap_or_default();
    let variability = match kind {
        _ if causality.to_lowercase().ends_with("parameter") => "fixed",
        VariableKind::Real { .. } => "continuous",
        _ => "discrete",
    };
    named(element, kind, variability)
}

/// Returns the smallest and the largest whole number of a type.
fn limits(scalar: ScalarType) -> (i128, i128) {
    match scalar {
        ScalarType::Int8 => (i8::MIN.into(), i8::MAX.into()),
        ScalarType::UInt8 => (0, u8::MAX.into()),
        ScalarType::Int16 => (i16::MIN.into(), i16::MAX.into()),
        ScalarType::UInt16 => (0, u16::MAX.into()),
        ScalarType::Int32 => (i32::MIN.into(), i32::MAX.into()),
        ScalarType::UInt32 => (0, u32::MAX.into()),
        ScalarType::UInt64 => (0, u64::MAX.into()),
        _ => (i64::MIN.into(), i64::MAX.into()),
    }
}

/// Returns an alias of a variable. That of an input or a parameter can be read only, because the
/// variable itself is set.
fn alias(alias: &Element, variable: &Variable) -> Result<Variable, String> {
    let mut renamed = Variable { name: alias.required("name")?.to_string(), ..variable.clone() };
    if let Some(text) = alias.attribute("description") {
        renamed.description = text.to_string();
    }
    if let (Some(other), VariableKind::Real { display_unit, .. }) =
        (alias.attribute("displayUnit"), &mut renamed.kind)
    {
        *display_unit = Some(other.to_string());
    }
    if renamed.causality != "output" {
        renamed.causality = "local".into();
    }
    Ok(renamed)
}

/// Returns the number of elements along each dimension, which may be the start value of a
/// structural parameter.
fn shape(element: &Element, elements: &[Element]) -> Result<Vec<usize>, String> {
    let dimensions = element.children.iter().filter(|child| child.name == "Dimension");
    let size = |dimension: &Element| -> Result<usize, String> {
        const KIND: &str = "a number of elements";
        let start = match dimension.parsed::<u32>("valueReference", "a value reference")? {
            None => dimension.parsed("start", KIND)?,
            Some(reference) => {
                let text = reference.to_string();
                let of = |e: &&Element| e.attribute("valueReference").map(str::trim) == Some(&text);
                let parameter = elements.iter().find(of);
                parameter.map_or(Ok(None), |parameter| parameter.parsed("start", KIND))?
            }
        };
        start.ok_or_else(|| format!("{} has a dimension of unknown size", element.title()))
    };
    dimensions.map(size).collect()
}

/// Returns the start values of all elements, or the one that they have in common.
fn starts(element: &Element) -> Vec<String> {
    if let Some(start) = element.attribute("start") {
        return start.split_whitespace().map(ToString::to_string).collect();
    }
    let starts = element.children.iter().filter(|child| child.name == "Start");
    starts.filter_map(|start| start.attribute("value").map(ToString::to_string)).collect()
}

/// Writes the indices of an element, which count from 1; nothing for a scalar.
pub fn indices(number: usize, shape: &[usize]) -> String {
    let mut rest = number;
    let mut indices: Vec<String> = Vec::new();
    for size in shape.iter().rev() {
        indices.push((rest % size + 1).to_string());
        rest /= size;
    }
    indices.reverse();
    if indices.is_empty() { String::new() } else { format!("[{}]", indices.join(",")) }
}

/// Returns the entries of the model structure with this name.
fn entries<'a>(root: &'a Element, name: &'a str) -> impl Iterator<Item = &'a Element> {
    let all = root.child("ModelStructure").into_iter().flat_map(|list| &list.children);
    all.filter(move |child| child.name == name)
}

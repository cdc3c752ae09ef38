//! Reads `modelDescription.xml`. (The reader in `fmi-rs` drops unit definitions and all types but
//! the first.)

mod fmi3;
mod structure;

pub use fmi3::indices;

use crate::xml::Element;
use fmi_master::description::{
    Array, ByName, DefaultExperiment, Interface, ModelDescription, Place, Variable, VariableKind,
};
use fmi_master::quantity::UnitDefinition;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::str::FromStr;
use structure::{Known, Positions};

/// Values of `causality` that FMI 2.0, section 2.2.7, allows, and the one that FMI 3.0 adds.
pub const CAUSALITIES: [&str; 7] = [
    "structuralParameter",
    "parameter",
    "calculatedParameter",
    "input",
    "output",
    "local",
    "independent",
];
/// Values of `variability` that the same section allows.
pub const VARIABILITIES: [&str; 5] = ["constant", "fixed", "tunable", "discrete", "continuous"];
/// Names that the standard gives to the exponents of a base unit.
const BASE: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

/// Parses the text of `modelDescription.xml`.
///
/// # Errors
/// Returns a line that says what is wrong with the text, and where.
pub fn parse(text: &str) -> Result<ModelDescription, String> {
    let root = &Element::parse(text)?;
    let fmi_version = version(root)?;
    let is_fmi3 = fmi_version.starts_with("3.");
    let types = types(root);
    let Listed { mut variables, dependencies, derivatives, event_indicators, places, arrays } =
        if is_fmi3 {
            fmi3::read(root, &types)?
        } else {
            let variables = root.list("ModelVariables", "ScalarVariable");
            let variables: Vec<_> =
                variables.map(|each| variable(each, &types)).collect::<Result<_, _>>()?;
            let position = |first: usize| Positions { firsts: vec![first], length: 1 };
            // An index counts from 1.
            let positions = (1..).zip((0..variables.len()).map(position)).collect();
            let known = Known { key: ("index", "index"), positions };
            Listed {
                dependencies: known.dependencies(unknowns(root, "Outputs"))?,
                derivatives: known.listed(unknowns(root, "Derivatives"))?,
                event_indicators: root
                    .parsed("numberOfEventIndicators", "a whole number from 0 on")?
                    .unwrap_or(0),
                variables,
                ..Listed::default()
            }
        };
    mark_optional(root, &mut variables);
    let text = |name: &str| root.attribute(name).unwrap_or_default().to_string();
    let experiment = root.child("DefaultExperiment");
    let proposed = |name: &str| experiment.map_or(Ok(None), |element| element.number(name));
    let units = root.list("UnitDefinitions", "Unit");
    Ok(ModelDescription {
        model_name: text("modelName"),
        guid: text(if is_fmi3 { "instantiationToken" } else { "guid" }),
        description: text("description"),
        version: text("version"),
        generation_tool: text("generationTool"),
        co_simulation: root.child("CoSimulation").map(interface).transpose()?,
        model_exchange: root.child("ModelExchange").map(interface).transpose()?,
        scheduled_execution: root.child("ScheduledExecution").map(interface).transpose()?,
        default_experiment: DefaultExperiment {
            start: proposed("startTime")?,
            stop: proposed("stopTime")?,
            step: proposed("stepSize")?,
            tolerance: proposed("tolerance")?,
        },
        units: units.map(unit).collect::<Result<_, _>>()?,
        derivatives,
        event_indicators,
        dependencies,
        places,
        arrays,
        is_lookup_table: false,
        has_structure: root.child("ModelStructure").is_some(),
        variables,
        by_name: ByName::default(),
        fmi_version,
    })
}

/// Definitions of types by name.
type Types<'a> = BTreeMap<&'a str, &'a Element>;

fn types(root: &Element) -> Types<'_> {
    let types = root.child("TypeDefinitions").into_iter().flat_map(|list| &list.children);
    types.filter_map(|kind| Some((kind.attribute("name")?, kind))).collect()
}

/// Returns the version of FMI, which must be one that can be read.
fn version(root: &Element) -> Result<String, String> {
    if root.name != "fmiModelDescription" {
        return Err(format!("is not an FMI description: it begins with {}", root.title()));
    }
    let version = root.required("fmiVersion")?.to_string();
    if version != "2.0" && !version.starts_with("2.0.") && !version.starts_with("3.") {
        return Err(format!(
            "is an FMU for FMI {version}, this program runs FMI 2.0 and 3.0: export the model for one of them"
        ));
    }
    Ok(version)
}

/// Marks the inputs that may stay unconnected, which annotations of the file list.
fn mark_optional(root: &Element, variables: &mut [Variable]) {
    let tools =
        root.list("VendorAnnotations", "Tool").chain(root.list("Annotations", "Annotation"));
    let inputs = tools.flat_map(|tool| tool.list("Optional", "Input"));
    let names: BTreeSet<&str> = inputs.filter_map(|input| input.attribute("name")).collect();
    for variable in variables {
        variable.is_optional = names.contains(&*variable.name);
    }
}

/// The variables of a description.
#[derive(Default)]
struct Listed {
    variables: Vec<Variable>,
    dependencies: BTreeMap<usize, Vec<usize>>,
    derivatives: Vec<usize>,
    event_indicators: usize,
    places: Vec<Place>,
    arrays: BTreeMap<String, Array>,
}

fn interface(element: &Element) -> Result<Interface, String> {
    Ok(Interface {
        model_identifier: element.required("modelIdentifier")?.to_string(),
        capabilities: element.truths().map(String::from).collect(),
    })
}

/// Reads a unit as FMI and SSP define it.
///
/// # Errors
/// Returns an error if an attribute is missing or is not a number.
pub fn unit(element: &Element) -> Result<UnitDefinition, String> {
    let scale = |element: &Element| -> Result<(f64, f64), String> {
        Ok((element.number("factor")?.unwrap_or(1.0), element.number("offset")?.unwrap_or(0.0)))
    };
    let base = element.child("BaseUnit");
    let (factor, offset) = base.map_or(Ok((1.0, 0.0)), scale)?;
    let exponents = |base: &Element| -> Result<[i32; 8], String> {
        let mut exponents = [0; 8];
        for (exponent, name) in exponents.iter_mut().zip(BASE) {
            *exponent = base.parsed(name, "a whole number")?.unwrap_or(0);
        }
        Ok(exponents)
    };
    let displays =
        element.children.iter().filter(|child| child.name == "DisplayUnit").map(|display| {
            let (factor, offset) = scale(display)?;
            Ok((display.required("name")?.to_string(), factor, offset))
        });
    Ok(UnitDefinition {
        name: element.required("name")?.to_string(),
        exponents: base.map(exponents).transpose()?,
        factor,
        offset,
        displays: displays.collect::<Result<_, String>>()?,
    })
}

fn variable(element: &Element, types: &Types) -> Result<Variable, String> {
    let kinds = ["Real", "Integer", "Boolean", "String", "Enumeration"];
    let typed = kinds.iter().find_map(|kind| element.child(kind));
    let typed = typed.ok_or_else(|| format!("{} has no type", element.title()))?;
    // An attribute of the variable itself takes precedence over that of its declared type.
    let declared =
        typed.attribute("declaredType").and_then(|name| types.get(name)?.child(&typed.name));
    let kind = match typed.name.as_str() {
        "Real" => real(typed, declared)?,
        "Integer" => {
            let bound = |name: &str| bound::<i32>(name, "a whole number", typed, declared);
            VariableKind::Integer { min: bound("min")?, max: bound("max")? }
        }
        "Boolean" => VariableKind::Boolean,
        "String" => VariableKind::String,
        _ => enumeration(element, declared)?,
    };
    let variable = named(element, kind, "continuous")?;
    Ok(Variable {
        reference: reference(element)?,
        start: typed.attribute("start").map(ToString::to_string),
        // Indices in the file count from 1.
        derivative_of: typed
            .parsed::<usize>("derivative", "an index from 1 on")?
            .and_then(|index| index.checked_sub(1)),
        ..variable
    })
}

/// Returns a bound, which messages call a `kind`.
fn bound<T: FromStr>(
    name: &str,
    kind: &str,
    typed: &Element,
    declared: Option<&Element>,
) -> Result<Option<T>, String> {
    match typed.parsed(name, kind)? {
        None => declared.map_or(Ok(None), |declared| declared.parsed(name, kind)),
        bound => Ok(bound),
    }
}

fn real(typed: &Element, declared: Option<&Element>) -> Result<VariableKind, String> {
    let text = |name: &str| {
        typed.attribute(name).or_else(|| declared?.attribute(name)).map(ToString::to_string)
    };
    let bound = |name: &str| bound(name, "a number", typed, declared);
    Ok(VariableKind::Real {
        unit: text("unit"),
        display_unit: text("displayUnit"),
        is_relative: matches!(
            text("relativeQuantity").as_deref().map(str::trim),
            Some("true" | "1")
        ),
        min: bound("min")?,
        max: bound("max")?,
        nominal: bound("nominal")?,
    })
}

fn enumeration(element: &Element, declared: Option<&Element>) -> Result<VariableKind, String> {
    let declared = declared.ok_or_else(|| format!("{} has no type definition", element.title()))?;
    let item = |item: &Element| {
        let value = item.parsed("value", "a whole number of 32 bits")?;
        let value = value.ok_or_else(|| format!("{} has no attribute value", item.title()))?;
        Ok((item.required("name")?.to_string(), value))
    };
    let items = declared.children.iter().filter(|child| child.name == "Item");
    Ok(VariableKind::Enumeration { items: items.map(item).collect::<Result<_, String>>()? })
}

fn reference(element: &Element) -> Result<u32, String> {
    let reference = element.parsed("valueReference", "a whole number from 0 to 4294967295")?;
    reference.ok_or_else(|| format!("{} has no attribute valueReference", element.title()))
}

/// Returns a variable of this kind with the name and the attributes that do not depend on its type.
fn named(
    element: &Element,
    kind: VariableKind,
    variability: &'static str,
) -> Result<Variable, String> {
    let keyword = |name: &str, default: &'static str| {
        let text = element.attribute(name).unwrap_or(default);
        let keyword = CAUSALITIES.iter().chain(&VARIABILITIES).find(|keyword| **keyword == text);
        // Keywords of the standard are not copied for each variable.
        keyword.map_or_else(|| Cow::Owned(text.to_string()), |keyword| Cow::Borrowed(*keyword))
    };
    Ok(Variable {
        name: element.required("name")?.to_string(),
        description: element.attribute("description").unwrap_or_default().to_string(),
        causality: keyword("causality", "local"),
        variability: keyword("variability", variability),
        kind,
        ..Variable::default()
    })
}

/// Returns the entries of a list of the model structure.
fn unknowns<'a>(root: &'a Element, list: &'a str) -> impl Iterator<Item = &'a Element> {
    root.child("ModelStructure").into_iter().flat_map(move |it| it.list(list, "Unknown"))
}

#[cfg(test)]
mod tests;

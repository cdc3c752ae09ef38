//! Parameter sets that are bound to a component or a system, and their mappings.

use super::STRUCTURE;
use super::value::{Passage, Quantity};
use fmi_master::quantity::UnitDefinition;
use fmu_import::archive;
use fmu_import::description;
use fmu_import::xml::{self, Element};
use percent_encoding::percent_decode_str;
use std::path::Path;
use std::rc::Rc;

/// A value that an archive gives to a variable.
#[derive(Debug)]
pub(super) struct Given {
    /// Name of the component or system that the value is bound to.
    pub(super) owner: String,
    /// Name of the variable within its owner.
    pub(super) name: String,
    pub(super) quantity: Quantity,
    pub(super) passage: Passage,
    /// File that holds the value.
    pub(super) file: String,
}

/// Collects the values that are bound to a component or a system, in their order. The units of the
/// archive hold beside those that a set defines.
pub(super) fn read(
    element: &Element,
    owner: &str,
    folder: &Path,
    values: &mut Vec<Given>,
    units: &[UnitDefinition],
) -> Result<(), String> {
    for binding in element.list("ParameterBindings", "ParameterBinding") {
        let prefix = binding.attribute("prefix").unwrap_or_default();
        let of_owner = |fault: String| match owner {
            "" => format!("the parameters of the system: {fault}"),
            owner => format!("the parameters of \"{owner}\": {fault}"),
        };
        let (set, file) = content(binding, "ParameterValues", "ParameterSet", folder)
            .and_then(|set| set.ok_or_else(|| "there is a ParameterBinding without values".into()))
            .map_err(of_owner)?;
        let own = set.list("Units", "Unit").map(description::unit);
        let units = own.chain(units.iter().cloned().map(Ok)).collect::<Result<Rc<_>, _>>()?;
        let mapping = match binding.child("ParameterMapping") {
            None => None,
            Some(mapping) => content(mapping, "ParameterMapping", "ParameterMapping", folder)
                .and_then(|set| set.ok_or_else(|| "there is an empty ParameterMapping".into()))
                .map(|(mapping, _)| Some(mapping))
                .map_err(of_owner)?,
        };
        for parameter in set.list("Parameters", "Parameter") {
            let source = format!("{prefix}{}", parameter.required("name")?);
            let mut give = |name: &str, passage| -> Result<(), String> {
                let quantity = Quantity::read(parameter, &units).map_err(of_owner)?;
                let (owner, name, file) = (owner.to_string(), name.to_string(), file.clone());
                values.push(Given { owner, name, quantity, passage, file });
                Ok(())
            };
            let Some(mapping) = &mapping else {
                give(&source, Passage::PLAIN)?;
                continue;
            };
            // A parameter without an entry is not applied.
            let entries = mapping.children.iter().filter(|entry| entry.name == "MappingEntry");
            for entry in entries {
                if entry.required("source")? == source {
                    give(entry.required("target")?, Passage::read(entry).map_err(of_owner)?)?;
                }
            }
        }
    }
    Ok(())
}

/// Returns what a binding or a mapping refers to, or what it holds, with the name of the file.
fn content(
    element: &Element,
    holder: &str,
    name: &str,
    folder: &Path,
) -> Result<Option<(Element, String)>, String> {
    if element.attribute("sourceBase").is_some_and(|base| base != "SSD") {
        return Err("they are in a file inside of an FMU, which is not supported: copy the file \
                    into the archive and leave out sourceBase"
            .into());
    }
    let known = ["application/x-ssp-parameter-set", "application/x-ssp-parameter-mapping"];
    if let Some(kind) = element.attribute("type").filter(|kind| !known.contains(kind)) {
        return Err(format!(
            "they are of type {kind}, which is not supported: write them as SSV and SSM files"
        ));
    }
    let Some(source) = element.attribute("source").filter(|source| !source.is_empty()) else {
        let inline = if element.name == holder { Some(element) } else { element.child(holder) };
        let content = inline.and_then(|inline| inline.child(name));
        return Ok(content.map(|content| (content.clone(), STRUCTURE.to_string())));
    };
    let source = path(source)?;
    let fault = |message: String| format!("{source}: {message}");
    let bytes = std::fs::read(folder.join(&source)).map_err(|error| fault(error.to_string()))?;
    let content = xml::decode(&bytes).and_then(|text| Element::parse(&text)).map_err(fault)?;
    if content.name != name {
        return Err(fault(format!("is a {}, not a {name}", content.name)));
    }
    Ok(Some((content, source)))
}

/// Converts the URI of a file to its path in the archive.
pub(super) fn path(uri: &str) -> Result<String, String> {
    let path =
        percent_decode_str(uri).decode_utf8().map_err(|_| format!("\"{uri}\" is not UTF-8"))?;
    let path = archive::with_slashes(&path);
    match archive::unsafe_name(&path) {
        Some(reason) => Err(format!("the file \"{}\" {reason}", path.escape_default())),
        None => Ok(path),
    }
}

//! JSON Schemas of experiment, study and campaign files, made from the types that read them, so
//! that editors can complete and check these files.
//!
//! Keys that a file leaves out may come from one that it extends. A schema therefore knows
//! every key and its type but requires none; missing keys are reported when the file is read.

use campaign::definition::Campaign;
use cosim::experiment::Experiment;
use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use study::definition::Study;

/// FileKind of file that a schema describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum FileKind {
    /// The file describes an experiment.
    Experiment,
    /// The file describes a study.
    Study,
    /// The file describes a campaign.
    Campaign,
    /// The file describes a vehicle, which parameters vehicle.file name.
    Vehicle,
}

/// Returns the schema of a kind of file as text.
pub(crate) fn text(kind: FileKind) -> String {
    let mut schema = match kind {
        // The types that read this file are in the FMUs, and their test makes the schema.
        FileKind::Vehicle => return include_str!("../schema/vehicle.json").into(),
        FileKind::Campaign => schema_of::<Campaign>(&[]),
        FileKind::Experiment => schema_of::<Experiment>(&[(
            "unset",
            texts(
                "Parameters, as component.parameter, that an extended file sets and that are left at the FMU's start value here.",
            ),
        )]),
        FileKind::Study => {
            let lists = json!({
                "description": "Lists of rows by name. A table with `for` is repeated for each row of a list.",
                "type": "object",
                "additionalProperties": { "type": "array", "items": { "type": "object" } },
            });
            let mut schema = schema_of::<Study>(&[("lists", lists)]);
            if let Some(Value::Object(run)) = schema.pointer_mut("/definitions/Run/properties") {
                let extends =
                    "Id of a run before this one, whose keys this one has as far as it lacks them.";
                run.insert("extends".into(), json!({ "description": extends, "type": "string" }));
            }
            for name in listed(schema.as_value()) {
                let each = json!({
                    "description": "A list of rows, or its name, or several names. The table is repeated for each row, or for each combination of rows, and each name in braces is replaced by the row's value.",
                    "type": ["string", "array"],
                    "items": { "type": ["string", "object"] },
                });
                if let Some(definition) = schema.pointer_mut(&format!("{name}/properties")) {
                    definition["for"] = each;
                }
            }
            RecursiveTransform(with_rows).transform(&mut schema);
            schema
        }
    };
    RecursiveTransform(|schema: &mut Schema| drop(schema.remove("required")))
        .transform(&mut schema);
    // A schema is plain JSON, so that this cannot fail.
    serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n"
}

fn schema_of<T: JsonSchema>(further: &[(&str, Value)]) -> Schema {
    let mut schema = SchemaSettings::draft07().into_generator().into_root_schema_for::<T>();
    let extends = texts(
        "Files that this one extends, with paths relative to this file. A later file takes precedence over earlier ones.",
    );
    if let Some(properties) = properties(&mut schema) {
        properties.insert("extends".into(), extends);
        properties.extend(further.iter().map(|(key, value)| ((*key).to_string(), value.clone())));
    }
    schema
}

fn properties(schema: &mut Schema) -> Option<&mut Map<String, Value>> {
    schema.get_mut("properties").and_then(Value::as_object_mut)
}

fn texts(description: &str) -> Value {
    json!({ "description": description, "type": ["string", "array"], "items": { "type": "string" } })
}

/// Returns the places of the definitions of tables in lists, which may have the key `for`.
fn listed(schema: &Value) -> BTreeSet<String> {
    let inner: Vec<&Value> = match schema {
        Value::Object(object) => object.values().collect(),
        Value::Array(items) => items.iter().collect(),
        _ => Vec::new(),
    };
    let own = schema.pointer("/items/$ref").and_then(Value::as_str);
    let own = own.and_then(|name| name.strip_prefix('#')).map(str::to_string);
    inner.into_iter().flat_map(listed).chain(own).collect()
}

/// Allows the name of a row's value in braces in place of a number, a truth value, a list or values
/// by name.
fn with_rows(schema: &mut Schema) {
    let is_map = schema.get("properties").is_none();
    let is_replaced = |name: &Value| {
        ["number", "integer", "boolean", "array"].iter().any(|kind| name == kind)
            || is_map && name == "object"
    };
    let kinds = match schema.get("type") {
        Some(Value::Array(kinds)) if !kinds.contains(&json!("string")) => kinds.clone(),
        Some(kind @ Value::String(_)) => vec![kind.clone()],
        _ => return,
    };
    if kinds.iter().any(is_replaced) {
        schema.insert("type".into(), kinds.into_iter().chain([json!("string")]).collect());
        schema.insert("pattern".into(), json!("^\\{\\w+\\}$"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn the_stored_schemas_are_those_of_the_types() {
        let kinds = [
            (FileKind::Experiment, "experiment"),
            (FileKind::Study, "study"),
            (FileKind::Campaign, "campaign"),
        ];
        for (kind, name) in kinds {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("schema/{name}.json"));
            let stored = std::fs::read_to_string(&path).unwrap();
            assert!(
                stored == text(kind),
                "{} is out of date: run scripts/update-generated",
                path.display()
            );
        }
    }
}

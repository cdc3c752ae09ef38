//! Options of the command line that choose an item of an enumeration of files.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use schemars::{JsonSchema, SchemaGenerator};
use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::Error;
use serde_json::Value;

/// Makes a parser of the items of an enumeration. Their names are those in files, and their texts
/// those of their documentation. The `aliases` of items are not shown.
pub fn choice<T>(
    aliases: &'static [(&'static str, &'static str)],
) -> impl TypedValueParser<Value = T>
where
    T: JsonSchema + for<'de> Deserialize<'de> + Clone + Send + Sync + 'static,
{
    let schema = T::json_schema(&mut SchemaGenerator::default());
    let items = schema.get("oneOf").and_then(Value::as_array).cloned().unwrap_or_default();
    let item = |item: &Value| {
        let name = item.get("const")?.as_str()?;
        let aliases = aliases.iter().filter(|(item, _)| *item == name).map(|(_, alias)| *alias);
        Some(PossibleValue::new(name.to_string()).help(text(item)).aliases(aliases))
    };
    PossibleValuesParser::new(items.iter().filter_map(item))
        .try_map(|name| T::deserialize(IntoDeserializer::<Error>::into_deserializer(name)))
}

/// Returns the description in a schema, without line breaks and without the full stop.
fn text(schema: &Value) -> String {
    let text = schema["description"].as_str().unwrap_or_default().replace('\n', " ");
    text.strip_suffix('.').unwrap_or(&text).to_string()
}

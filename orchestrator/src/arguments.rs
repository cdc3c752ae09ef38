//! Arguments that several commands share, and their conversion for the libraries.

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use cosim::experiment::{self, Coupling, OnInvalid};
use schemars::{JsonSchema, SchemaGenerator};
use serde::Deserialize;
use serde::de::IntoDeserializer;
use serde::de::value::Error;
use serde_json::Value;

/// Settings of an experiment that the command line may change.
#[derive(Clone, Args)]
#[command(next_help_heading = "Changes of the experiment")]
pub(crate) struct Overrides {
    /// Set a parameter: `plant.disturbance.seed=7`, `controller.constraints=paper`,
    /// `plant.disturbance.bound="1 deg/s2"`.
    #[arg(long = "set", value_name = "COMPONENT.PARAMETER=VALUE")]
    set: Vec<String>,
    /// Replace the FMU of a component: `controller=MyLaw.fmu`, or by its name `controller=LQR`.
    /// Settings, recorded variables and unconnected inputs of the experiment that the new FMU does
    /// not have are left out.
    #[arg(long = "fmu", value_name = "COMPONENT=FMU")]
    fmu: Vec<String>,
    /// Stop time of the simulation, s.
    #[arg(long, value_name = "SECONDS")]
    stop: Option<f64>,
    /// Length of the communication step, s.
    #[arg(long, value_name = "SECONDS")]
    step: Option<f64>,
    /// Choose how components are stepped and values are passed on.
    #[arg(long, value_parser = choice::<Coupling>(&[("sequential", "gauss-seidel")]))]
    coupling: Option<Coupling>,
    /// Choose what happens if an instance gives a value that is not finite, or not valid for its
    /// type.
    #[arg(long, value_parser = choice::<OnInvalid>(&[]))]
    on_invalid: Option<OnInvalid>,
    /// Let the program at the other end of standard input and output give the moment in place of
    /// the controller: the law's name, and what identifies it. The Python package does so.
    #[arg(long, value_name = "NAME HASH", hide = true)]
    pub(crate) law: Option<String>,
    #[command(flatten)]
    isolation: Protection,
}

/// Processes of instances and their limits. The texts are those of the section `[isolation]`.
#[derive(Clone, Args)]
#[command(next_help_heading = "Processes of instances")]
pub(crate) struct Protection {
    #[arg(long, help = key("isolate"), value_name = "BOOL", num_args = 0..=1, default_missing_value = "true", require_equals = true)]
    isolate: Option<bool>,
    #[arg(long, help = key("call_timeout"), value_name = "SECONDS")]
    call_timeout: Option<f64>,
    #[arg(long = "unit-memory", help = key("memory"), value_name = "MIB")]
    memory: Option<u64>,
    #[arg(long = "unit-cpu", help = key("cpu"), value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..))]
    cpu: Option<u64>,
    #[arg(long, help = key("sandbox"), value_name = "BOOL", num_args = 0..=1, default_missing_value = "true", require_equals = true)]
    sandbox: Option<bool>,
}

impl From<Overrides> for experiment::Overrides {
    fn from(overrides: Overrides) -> Self {
        let Overrides { set, fmu, stop, step, coupling, on_invalid, law, isolation } = overrides;
        Self { set, fmu, stop, step, coupling, on_invalid, law, isolation: isolation.into() }
    }
}

impl From<Protection> for experiment::Protection {
    fn from(protection: Protection) -> Self {
        let Protection { isolate, call_timeout, memory, cpu, sandbox } = protection;
        Self { isolate, call_timeout, memory, cpu, sandbox }
    }
}

/// Makes a parser of the items of an enumeration. Their names are those in files, and their texts
/// those of their documentation. The `aliases` of items are not shown.
pub(crate) fn choice<T>(
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

/// Returns the documentation of a key of `[isolation]`.
fn key(name: &str) -> String {
    let schema = experiment::Protection::json_schema(&mut SchemaGenerator::default());
    schema.pointer(&format!("/properties/{name}")).map_or(String::new(), text)
}

/// Returns the description in a schema, without line breaks and without the full stop.
fn text(schema: &Value) -> String {
    let text = schema["description"].as_str().unwrap_or_default().replace('\n', " ");
    text.strip_suffix('.').unwrap_or(&text).to_string()
}

//! Values of parameters, and what connections and parameter mappings make of them.

use fmi_master::quantity::{self, Scaling, UnitDefinition};
use fmu_import::xml::Element;
use toml::Value;

/// A value with its unit, if it has one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Quantity {
    pub(super) value: Value,
    pub(super) unit: Option<String>,
}

/// Reads a value of one of the types of SSP.
fn typed(kind: &str, text: &str) -> Result<Value, String> {
    let fault = |what: &str| format!("\"{text}\" is not a valid {what}");
    let trimmed = text.trim();
    Ok(match kind {
        "Real" | "Float64" | "Float32" => {
            Value::Float(trimmed.parse().map_err(|_| fault("real number"))?)
        }
        "Integer" | "Int8" | "Int16" | "Int32" | "Int64" | "UInt8" | "UInt16" | "UInt32"
        | "UInt64" => Value::Integer(trimmed.parse().map_err(|_| fault("integer"))?),
        "Boolean" => match trimmed {
            "true" | "1" => Value::Boolean(true),
            "false" | "0" => Value::Boolean(false),
            _ => return Err(fault("boolean")),
        },
        "String" | "Enumeration" => Value::String(text.to_string()),
        other => {
            return Err(format!(
                "type {other} is not supported: leave the parameter out, or give it one of the \
                 types Real, Integer, Boolean, String and Enumeration"
            ));
        }
    })
}

impl Quantity {
    /// Reads the value of a parameter of a parameter set.
    pub(super) fn read(parameter: &Element) -> Result<Self, String> {
        let name = parameter.required("name")?;
        let fault = |message: String| format!("the parameter \"{name}\": {message}");
        let is_value = |child: &&Element| !matches!(&*child.name, "Annotations" | "Dimension");
        let element = parameter.children.iter().find(is_value);
        let element = element.ok_or_else(|| fault("has no value".into()))?;
        let value = typed(&element.name, element.required("value")?).map_err(fault)?;
        // Some tools write units in brackets, which belong to no definition.
        let bare = |unit: &str| Some(unit.strip_prefix('[')?.strip_suffix(']')?.to_string());
        let unit = element.attribute("unit").map(|unit| bare(unit).unwrap_or_else(|| unit.into()));
        Ok(Self { value, unit })
    }

    /// Returns the value in this unit. A value without a unit is in that unit already.
    fn converted(mut self, unit: Option<&str>, units: &[UnitDefinition]) -> Result<Self, String> {
        let Some(unit) = unit else { return Ok(self) };
        if let (Value::Float(number), Some(from)) = (&self.value, &self.unit) {
            let text = format!("{number:?} {from}");
            self.value = Value::Float(quantity::convert(&text, Some(unit), units)?);
        }
        self.unit = Some(unit.to_string());
        Ok(self)
    }
}

/// A transformation of SSP 1.0.1, section 4.5.2.
#[derive(Clone, Debug)]
enum Transformation {
    Linear(Scaling),
    /// Replaces values of this type, and keeps those that have no entry.
    Table(&'static str, Vec<(Value, Value)>),
}

impl Transformation {
    fn read(element: &Element) -> Result<Option<Self>, String> {
        for child in &element.children {
            let kind = match child.name.as_str() {
                "LinearTransformation" => {
                    return Ok(Some(Self::Linear(Scaling {
                        factor: child.number("factor")?.unwrap_or(1.0),
                        offset: child.number("offset")?.unwrap_or(0.0),
                    })));
                }
                "BooleanMappingTransformation" => "Boolean",
                "IntegerMappingTransformation" => "Integer",
                "EnumerationMappingTransformation" => "Enumeration",
                _ => continue,
            };
            let entries = child.children.iter().filter(|entry| entry.name == "MapEntry");
            let entry = |entry: &Element| {
                let side = |name: &str| {
                    typed(kind, entry.required(name)?)
                        .map_err(|fault| format!("{name} of {}: {fault}", entry.title()))
                };
                Ok((side("source")?, side("target")?))
            };
            let entries = entries.map(entry).collect::<Result<_, String>>()?;
            return Ok(Some(Self::Table(kind, entries)));
        }
        Ok(None)
    }

    fn apply(&self, value: Value) -> Result<Value, String> {
        match (self, value) {
            (Self::Linear(scaling), Value::Float(value)) => Ok(Value::Float(scaling.apply(value))),
            (Self::Linear(scaling), Value::Integer(value)) => {
                Ok(Value::Float(scaling.apply(value as f64)))
            }
            (Self::Linear(_), value) => Err(format!("{value} is no number to be scaled")),
            (Self::Table("Boolean", entries), value @ Value::Boolean(_))
            | (Self::Table("Integer", entries), value @ Value::Integer(_))
            | (Self::Table("Enumeration", entries), value @ Value::String(_)) => {
                let entry = entries.iter().find(|(source, _)| *source == value);
                Ok(entry.map_or(value, |(_, target)| target.clone()))
            }
            (Self::Table(kind, _), value) => {
                Err(format!("{value} is not of the type that its {kind}MappingTransformation maps"))
            }
        }
    }
}

/// What a connection or a mapping makes of the values that pass it: a conversion of the unit, and
/// a transformation afterwards.
#[derive(Clone, Debug)]
pub(super) struct Passage {
    transformation: Option<Transformation>,
    /// Whether units are converted.
    pub(super) converts: bool,
}

impl Passage {
    /// The passage that only converts units.
    pub(super) const PLAIN: Self = Self { transformation: None, converts: true };

    /// Reads the passage of a connection, or of an entry of a mapping.
    pub(super) fn read(element: &Element) -> Result<Self, String> {
        let suppresses = element.truth("suppressUnitConversion")?;
        let transformation = Transformation::read(element)?;
        Ok(Self { transformation, converts: suppresses != Some(true) })
    }

    /// Returns the value after the passage, in the unit of the variable or connector where it
    /// ends. Without a unit there, the value keeps its own.
    pub(super) fn apply(
        &self,
        quantity: Quantity,
        unit: Option<&str>,
        units: &[UnitDefinition],
    ) -> Result<Quantity, String> {
        let own = quantity.unit.filter(|_| self.converts);
        let mut quantity = Quantity { unit: own, ..quantity }.converted(unit, units)?;
        if let Some(transformation) = &self.transformation {
            quantity.value = transformation.apply(quantity.value)?;
        }
        Ok(quantity)
    }

    /// Returns the scaling of a passage between two components.
    pub(super) fn scaling(&self) -> Result<Scaling, String> {
        match &self.transformation {
            None => Ok(Scaling::default()),
            Some(Transformation::Linear(scaling)) => Ok(*scaling),
            Some(Transformation::Table(kind, _)) => Err(format!(
                "has a {kind}MappingTransformation, which is supported for parameters only: let \
                 the FMU that gives the value map it"
            )),
        }
    }
}

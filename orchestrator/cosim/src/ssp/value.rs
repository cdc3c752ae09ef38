//! Values of parameters, and what connections and parameter mappings make of them.

use fmi_master::quantity::{self, Scaling, UnitDefinition};
use fmu_import::xml::Element;
use std::rc::Rc;
use toml::Value;

/// A unit by its name, with the units among which it is defined.
#[derive(Clone, Debug)]
pub(super) struct Unit {
    pub(super) name: String,
    pub(super) units: Rc<[UnitDefinition]>,
    /// Whether the values are differences, whose units have no offset.
    pub(super) is_relative: bool,
}

impl Unit {
    /// Returns the unit for differences, if they are some.
    pub(super) fn relative(self, is_relative: bool) -> Self {
        if !is_relative {
            return self;
        }
        let units = self.units.iter().map(UnitDefinition::of_differences).collect();
        Self { units, is_relative, ..self }
    }

    /// Returns the scaling to another unit. One that is defined nowhere may be a display unit of
    /// the other. Without one of the two, values stay as they are.
    pub(super) fn scaling(from: Option<&Self>, to: Option<&Self>) -> Result<Scaling, String> {
        let (Some(from), Some(to)) = (from, to) else { return Ok(Scaling::default()) };
        let (name, target) = (Some(from.name.as_str()), Some(to.name.as_str()));
        let scaling = if from.units.iter().any(|unit| unit.name == from.name) {
            quantity::conversion(name, &from.units, target, &to.units)
        } else {
            quantity::named(name, target, &to.units)
        };
        scaling.map_err(|units| format!("{units} cannot be converted: they measure different quantities, or one is not defined"))
    }
}

/// A value with its unit, if it has one.
#[derive(Clone, Debug)]
pub(super) struct Quantity {
    pub(super) value: Value,
    pub(super) unit: Option<Unit>,
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
    /// Reads the value of a parameter of a parameter set, for which these units are defined.
    pub(super) fn read(parameter: &Element, units: &Rc<[UnitDefinition]>) -> Result<Self, String> {
        let name = parameter.required("name")?;
        let fault = |message: String| format!("the parameter \"{name}\": {message}");
        let is_value = |child: &&Element| !matches!(&*child.name, "Annotations" | "Dimension");
        let element = parameter.children.iter().find(is_value);
        let element = element.ok_or_else(|| fault("has no value".into()))?;
        let value = typed(&element.name, element.required("value")?).map_err(fault)?;
        // Some tools write units in brackets, which belong to no definition.
        let bare = |unit: &str| Some(unit.strip_prefix('[')?.strip_suffix(']')?.to_string());
        let unit = element.attribute("unit").map(|unit| Unit {
            name: bare(unit).unwrap_or_else(|| unit.into()),
            units: Rc::clone(units),
            is_relative: false,
        });
        Ok(Self { value, unit })
    }

    /// Returns the value in this unit. A value without a unit is in that unit already, and without
    /// a unit there it keeps its own.
    pub(super) fn converted(mut self, unit: Option<Unit>) -> Result<Self, String> {
        let is_relative = unit.as_ref().is_some_and(|unit| unit.is_relative);
        let own = self.unit.map(|own| own.relative(is_relative));
        let scaling = Unit::scaling(own.as_ref(), unit.as_ref())?;
        match self.value {
            Value::Float(number) => self.value = Value::Float(scaling.apply(number)),
            Value::Integer(number) if scaling != Scaling::default() => {
                self.value = Value::Float(scaling.apply(number as f64));
            }
            _ => {}
        }
        self.unit = unit.or(own);
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
/// a transformation afterwards: SSP 1.0.1 and 2.0, `LinearTransformation`.
#[derive(Clone, Debug)]
pub(super) struct Passage {
    transformation: Option<Transformation>,
    /// Whether units are converted.
    converts: bool,
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

    /// Returns the value after the passage, in the unit of the variable or connector where it ends.
    pub(super) fn apply(&self, quantity: Quantity, unit: Option<Unit>) -> Result<Quantity, String> {
        let own = quantity.unit.filter(|_| self.converts);
        let mut quantity = Quantity { unit: own, ..quantity }.converted(unit)?;
        if let Some(transformation) = &self.transformation {
            quantity.value = transformation.apply(quantity.value)?;
        }
        Ok(quantity)
    }

    /// Returns the scaling of the passage from one unit to another.
    pub(super) fn scaling(
        &self,
        from: Option<&Unit>,
        to: Option<&Unit>,
    ) -> Result<Scaling, String> {
        let units = Unit::scaling(from.filter(|_| self.converts), to)
            .map_err(|difference| format!("joins units that do not match: {difference}"))?;
        match &self.transformation {
            None => Ok(units),
            Some(Transformation::Linear(scaling)) => Ok(units.then(*scaling)),
            Some(Transformation::Table(kind, _)) => Err(format!(
                "has a {kind}MappingTransformation, which is supported for parameters only: let \
                 the FMU that gives the value map it"
            )),
        }
    }
}

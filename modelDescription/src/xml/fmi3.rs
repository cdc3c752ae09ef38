//! What `modelDescription.xml` of FMI 3.0 has of its own: section 2.4.

use super::{Attributes, Xml, given, leaf, named, parent, real, write_items, write_optional};
use crate::unit::Unit;
use crate::variable::{Causality, Variability, Variable, VariableKind};
use crate::{ModelDescription, Version};
use std::io;

impl ModelDescription {
    pub(super) fn write_fmi3(&self, xml: &mut Xml) -> io::Result<()> {
        let attributes = self.head("3.0", "instantiationToken");
        parent(xml, "fmiModelDescription", attributes, |xml| {
            self.write_fmi3_interfaces(xml)?;
            self.write_units(xml, vec![&Unit::new("s")])?;
            self.write_fmi3_enumerations(xml)?;
            self.write_categories_and_experiment(xml)?;
            parent(xml, "ModelVariables", vec![], |xml| {
                write_time(xml)?;
                (0..self.variables.len()).try_for_each(|i| self.write_fmi3_variable(xml, i))?;
                (0..self.event_indicators).try_for_each(|i| self.write_indicator(xml, i))
            })?;
            self.write_fmi3_structure(xml)
        })
    }

    fn write_fmi3_interfaces(&self, xml: &mut Xml) -> io::Result<()> {
        let flags = |names: &[&'static str]| -> Attributes {
            names.iter().map(|name| (*name, "true".to_string())).collect()
        };
        let mut common = vec![("modelIdentifier", self.name.clone())];
        common.extend(flags(&["canGetAndSetFMUState", "canSerializeFMUState"]));
        if self.directional_derivatives() {
            let derivatives = ["providesDirectionalDerivatives", "providesAdjointDerivatives"];
            common.extend(flags(&derivatives));
        }
        if self.model_exchange {
            leaf(xml, "ModelExchange", common.clone())?;
        }
        if self.co_simulation {
            common.extend(flags(&[
                "canHandleVariableCommunicationStepSize",
                "mightReturnEarlyFromDoStep",
                "hasEventMode",
            ]));
            leaf(xml, "CoSimulation", common)?;
        }
        Ok(())
    }

    fn write_fmi3_enumerations(&self, xml: &mut Xml) -> io::Result<()> {
        let enumerations = self.enumerations();
        if enumerations.is_empty() {
            return Ok(());
        }
        parent(xml, "TypeDefinitions", vec![], |xml| {
            enumerations.iter().try_for_each(|enumeration| {
                parent(xml, "EnumerationType", named(enumeration), |xml| {
                    write_items(xml, enumeration)
                })
            })
        })
    }

    fn write_indicator(&self, xml: &mut Xml, index: usize) -> io::Result<()> {
        let attributes = vec![
            ("name", format!("eventIndicator[{}]", index + 1)),
            ("valueReference", self.indicator(index)),
            ("description", "Event indicator: an event occurs where its sign changes".into()),
            ("causality", Causality::Local.name().into()),
            ("variability", Variability::Continuous.name().into()),
        ];
        leaf(xml, "Float64", attributes)
    }

    /// Returns the value reference of an event indicator, which comes after the variables of the
    /// table.
    fn indicator(&self, index: usize) -> String {
        reference(self.variables.len() + index)
    }

    fn write_fmi3_variable(&self, xml: &mut Xml, position: usize) -> io::Result<()> {
        let variable = &self.variables[position];
        let mut attributes = vec![
            ("name", variable.name.clone()),
            ("valueReference", reference(position)),
            ("description", variable.description.clone()),
            ("causality", variable.causality.name().into()),
            ("variability", variable.variability.name().into()),
        ];
        let (element, further) = self.element_of(variable);
        attributes.extend(further);
        let text = match &variable.kind {
            VariableKind::String { start } => start.as_ref(),
            _ => None,
        };
        if text.is_none() && !variable.is_optional {
            return leaf(xml, element, attributes);
        }
        parent(xml, element, attributes, |xml| {
            if variable.is_optional {
                write_optional(xml, "Annotation", "type")?;
            }
            text.map_or(Ok(()), |text| leaf(xml, "Start", vec![("value", text.clone())]))
        })
    }

    /// Returns the element of a variable, and the attributes that only this type has.
    fn element_of(&self, variable: &Variable) -> (&'static str, Attributes) {
        let number = |number: Option<i32>| number.map(|number| number.to_string());
        match &variable.kind {
            VariableKind::Real { unit, min, max, nominal, start, derivative_of } => {
                let state = derivative_of.as_deref().and_then(|name| self.position(name));
                let display = unit.as_ref().and_then(|unit| unit.display.as_ref());
                let attributes = given([
                    ("unit", unit.as_ref().map(|unit| unit.name.clone())),
                    ("displayUnit", display.map(|display| display.name.clone())),
                    ("min", min.map(real)),
                    ("max", max.map(real)),
                    ("nominal", nominal.map(real)),
                    ("start", start.map(real)),
                    ("derivative", state.map(reference)),
                ]);
                ("Float64", attributes)
            }
            VariableKind::Integer { min, max, start } => {
                let limits = [("min", number(*min)), ("max", number(*max))];
                ("Int32", [given(limits), given([("start", number(*start))])].concat())
            }
            VariableKind::Boolean { start } => {
                ("Boolean", given([("start", start.map(|start| start.to_string()))]))
            }
            VariableKind::Enumeration { enumeration_type, start } => {
                let name = Some(enumeration_type.name.clone());
                ("Enumeration", given([("declaredType", name), ("start", number(*start))]))
            }
            VariableKind::String { .. } => ("String", vec![]),
        }
    }

    fn write_fmi3_structure(&self, xml: &mut Xml) -> io::Result<()> {
        let states = self.states();
        let unknown = |xml: &mut Xml, element: &str, position, dependencies: Vec<usize>| {
            let list: Vec<_> = dependencies.into_iter().map(reference).collect();
            let attributes =
                vec![("valueReference", reference(position)), ("dependencies", list.join(" "))];
            leaf(xml, element, attributes)
        };
        parent(xml, "ModelStructure", vec![], |xml| {
            for (position, variable) in self.variables.iter().enumerate() {
                if variable.causality == Causality::Output {
                    unknown(xml, "Output", position, self.dependencies(position, &states))?;
                }
            }
            for &(_, derivative) in &states {
                let dependencies = self.dependencies(derivative, &states);
                unknown(xml, "ContinuousStateDerivative", derivative, dependencies)?;
            }
            for position in self.initial_unknowns(&states) {
                let dependencies = self.initial_dependencies(position, &states);
                unknown(xml, "InitialUnknown", position, dependencies)?;
            }
            // Without a list of dependencies they depend on everything.
            (0..self.event_indicators).try_for_each(|index| {
                leaf(xml, "EventIndicator", vec![("valueReference", self.indicator(index))])
            })
        })
    }
}

fn write_time(xml: &mut Xml) -> io::Result<()> {
    let attributes = vec![
        ("name", "time".into()),
        ("valueReference", "0".into()),
        ("description", "Simulation time".into()),
        ("causality", Causality::Independent.name().into()),
        ("variability", Variability::Continuous.name().into()),
        ("unit", "s".into()),
    ];
    leaf(xml, "Float64", attributes)
}

/// Returns the value reference of the variable at a position in the table.
fn reference(position: usize) -> String {
    (position + Version::Fmi3.first_reference()).to_string()
}

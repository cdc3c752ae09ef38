//! Text of an FMU's `modelDescription.xml`: FMI 2.0, section 2.2, and what FMI 3.0 has in common.

mod fmi3;
mod terminals;

use crate::unit::Unit;
use crate::variable::{Causality, EnumerationType, VariableKind};
use crate::{AUTHOR, Error, LICENSE, LOG_CATEGORIES, ModelDescription, Version};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};
use std::borrow::Cow;
use std::io;

/// Name of the tool whose annotation marks the inputs that may stay unconnected.
pub const OPTIONAL: &str = "re-entry-fmus";

type Xml = Writer<Vec<u8>>;
/// Attributes of an element in the order of the schema.
type Attributes = Vec<(&'static str, String)>;

impl ModelDescription {
    /// Returns the text of `modelDescription.xml`.
    ///
    /// # Errors
    /// Reports the contradictions that [`ModelDescription::check`] finds.
    ///
    /// # Panics
    /// This never panics, because writing to memory does not fail and everything written is text.
    pub fn to_xml(&self, version: Version) -> Result<String, Error> {
        self.check()?;
        Ok(document(|xml| match version {
            Version::Fmi2 => self.write(xml),
            Version::Fmi3 => self.write_fmi3(xml),
        }))
    }

    fn write(&self, xml: &mut Xml) -> io::Result<()> {
        // Several importers compare this text; they would refuse "2.0.4".
        let mut attributes = self.head("2.0", "guid");
        if self.model_exchange {
            attributes.push(("numberOfEventIndicators", self.event_indicators.to_string()));
        }
        parent(xml, "fmiModelDescription", attributes, |xml| {
            self.write_interfaces(xml)?;
            self.write_units(xml, vec![])?;
            self.write_enumerations(xml)?;
            self.write_categories_and_experiment(xml)?;
            parent(xml, "ModelVariables", vec![], |xml| {
                (0..self.variables.len()).try_for_each(|i| self.write_variable(xml, i))
            })?;
            self.write_structure(xml)
        })
    }

    /// Returns the attributes that all versions of FMI have. `identity` is the name of the one that
    /// identifies the FMU.
    fn head(&self, version: &str, identity: &'static str) -> Attributes {
        vec![
            ("fmiVersion", version.into()),
            ("modelName", self.name.clone()),
            (identity, self.guid()),
            ("description", self.description.clone()),
            ("author", AUTHOR.into()),
            ("version", self.version.clone()),
            ("license", LICENSE.into()),
            ("generationTool", concat!("fmu-pack ", env!("CARGO_PKG_VERSION")).into()),
            ("variableNamingConvention", "structured".into()),
        ]
    }

    fn write_categories_and_experiment(&self, xml: &mut Xml) -> io::Result<()> {
        parent(xml, "LogCategories", vec![], |xml| {
            LOG_CATEGORIES.iter().try_for_each(|(name, description)| {
                let attributes =
                    vec![("name", (*name).into()), ("description", (*description).into())];
                leaf(xml, "Category", attributes)
            })
        })?;
        let experiment = self.default_experiment;
        let attributes = vec![
            ("startTime", real(experiment.start)),
            ("stopTime", real(experiment.stop)),
            ("tolerance", real(experiment.tolerance)),
            ("stepSize", real(experiment.step)),
        ];
        leaf(xml, "DefaultExperiment", attributes)
    }

    fn write_interfaces(&self, xml: &mut Xml) -> io::Result<()> {
        let mut derivatives = vec![];
        if self.directional_derivatives() {
            derivatives.push(("providesDirectionalDerivative", "true".to_string()));
        }
        let state: Attributes = vec![
            ("canNotUseMemoryManagementFunctions", "true".into()),
            ("canGetAndSetFMUstate", "true".into()),
            ("canSerializeFMUstate", "true".into()),
        ];
        let identifier = vec![("modelIdentifier", self.name.clone())];
        if self.model_exchange {
            let flags = vec![("completedIntegratorStepNotNeeded", "true".into())];
            leaf(
                xml,
                "ModelExchange",
                [identifier.clone(), flags, state.clone(), derivatives.clone()].concat(),
            )?;
        }
        if self.co_simulation {
            let flags = vec![
                ("canHandleVariableCommunicationStepSize", "true".into()),
                ("canInterpolateInputs", "true".into()),
                ("maxOutputDerivativeOrder", "0".into()),
                ("canBeInstantiatedOnlyOncePerProcess", "false".into()),
            ];
            leaf(xml, "CoSimulation", [identifier, flags, state, derivatives].concat())?;
        }
        Ok(())
    }

    /// Writes the units of the variables, and `units` besides.
    fn write_units<'a>(&'a self, xml: &mut Xml, mut units: Vec<&'a Unit>) -> io::Result<()> {
        for variable in &self.variables {
            if let VariableKind::Real { unit: Some(unit), .. } = &variable.kind
                && !units.contains(&unit)
            {
                units.push(unit);
            }
        }
        if units.is_empty() {
            return Ok(());
        }
        units.sort_by(|a, b| a.name.cmp(&b.name));
        parent(xml, "UnitDefinitions", vec![], |xml| {
            units.iter().try_for_each(|unit| {
                parent(xml, "Unit", vec![("name", unit.name.clone())], |xml| {
                    let exponents = [
                        ("kg", unit.kg),
                        ("m", unit.m),
                        ("s", unit.s),
                        ("A", unit.ampere),
                        ("K", unit.kelvin),
                        ("rad", unit.rad),
                    ];
                    let exponents = exponents.into_iter().filter(|(_, power)| *power != 0);
                    leaf(
                        xml,
                        "BaseUnit",
                        exponents.map(|(name, power)| (name, power.to_string())).collect(),
                    )?;
                    unit.display.iter().try_for_each(|display| {
                        let attributes =
                            vec![("name", display.name.clone()), ("factor", real(display.factor))];
                        leaf(xml, "DisplayUnit", attributes)
                    })
                })
            })
        })
    }

    /// Returns the enumeration types of the variables, sorted by name.
    fn enumerations(&self) -> Vec<&EnumerationType> {
        let mut enumerations: Vec<&EnumerationType> = vec![];
        for variable in &self.variables {
            if let VariableKind::Enumeration { enumeration_type, .. } = &variable.kind
                && !enumerations.contains(&enumeration_type)
            {
                enumerations.push(enumeration_type);
            }
        }
        enumerations.sort_by(|a, b| a.name.cmp(&b.name));
        enumerations
    }

    fn write_enumerations(&self, xml: &mut Xml) -> io::Result<()> {
        let enumerations = self.enumerations();
        if enumerations.is_empty() {
            return Ok(());
        }
        parent(xml, "TypeDefinitions", vec![], |xml| {
            enumerations.iter().try_for_each(|enumeration| {
                parent(xml, "SimpleType", named(enumeration), |xml| {
                    parent(xml, "Enumeration", vec![], |xml| write_items(xml, enumeration))
                })
            })
        })
    }

    fn write_variable(&self, xml: &mut Xml, reference: usize) -> io::Result<()> {
        let variable = &self.variables[reference];
        // The attribute `initial` is left out, because the standard's defaults fit: parameters are
        // exact, and outputs and locals are calculated.
        let attributes = vec![
            ("name", variable.name.clone()),
            ("valueReference", reference.to_string()),
            ("description", variable.description.clone()),
            ("causality", variable.causality.name().into()),
            ("variability", variable.variability.name().into()),
        ];
        parent(xml, "ScalarVariable", attributes, |xml| {
            self.write_kind(xml, &variable.kind)?;
            if !variable.is_optional {
                return Ok(());
            }
            write_optional(xml, "Tool", "name")
        })
    }

    fn write_kind(&self, xml: &mut Xml, kind: &VariableKind) -> io::Result<()> {
        match kind {
            VariableKind::Real { unit, min, max, nominal, start, derivative_of } => {
                let index =
                    derivative_of.as_deref().and_then(|name| self.position(name)).map(|i| i + 1);
                let display = unit.as_ref().and_then(|unit| unit.display.as_ref());
                let attributes = [
                    ("unit", unit.as_ref().map(|unit| unit.name.clone())),
                    ("displayUnit", display.map(|display| display.name.clone())),
                    ("min", min.map(real)),
                    ("max", max.map(real)),
                    ("nominal", nominal.map(real)),
                    ("start", start.map(real)),
                    ("derivative", index.map(|i| i.to_string())),
                ];
                leaf(xml, "Real", given(attributes))
            }
            VariableKind::Integer { min, max, start } => {
                let attributes = [("min", *min), ("max", *max), ("start", *start)];
                leaf(
                    xml,
                    "Integer",
                    given(attributes.map(|(name, x)| (name, x.map(|x| x.to_string())))),
                )
            }
            VariableKind::Boolean { start } => {
                leaf(xml, "Boolean", given([("start", start.map(|x| x.to_string()))]))
            }
            VariableKind::Enumeration { enumeration_type, start } => {
                let attributes = [
                    ("declaredType", Some(enumeration_type.name.clone())),
                    ("start", start.map(|x| x.to_string())),
                ];
                leaf(xml, "Enumeration", given(attributes))
            }
            VariableKind::String { start } => {
                leaf(xml, "String", given([("start", start.clone())]))
            }
        }
    }

    fn write_structure(&self, xml: &mut Xml) -> io::Result<()> {
        let states = self.states();
        let is_output = |i: &usize| self.variables[*i].causality == Causality::Output;
        let outputs: Vec<_> = (0..self.variables.len()).filter(is_output).collect();
        let derivatives: Vec<_> = states.iter().map(|&(_, derivative)| derivative).collect();
        let at_runtime = |i| self.dependencies(i, &states);
        let initially = |i| self.initial_dependencies(i, &states);
        parent(xml, "ModelStructure", vec![], |xml| {
            unknowns(xml, "Outputs", &outputs, at_runtime)?;
            unknowns(xml, "Derivatives", &derivatives, at_runtime)?;
            unknowns(xml, "InitialUnknowns", &self.initial_unknowns(&states), initially)
        })
    }
}

/// Returns the text of a document that `write` fills. Writing to memory does not fail.
fn document(write: impl FnOnce(&mut Xml) -> io::Result<()>) -> String {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))
        .and_then(|()| write(&mut xml))
        .expect("writing to memory");
    let mut text = String::from_utf8(xml.into_inner()).expect("only text was written");
    text.push('\n');
    text
}

/// Returns name and description of an enumeration type.
fn named(enumeration: &EnumerationType) -> Attributes {
    vec![("name", enumeration.name.clone()), ("description", enumeration.description.clone())]
}

fn write_items(xml: &mut Xml, enumeration: &EnumerationType) -> io::Result<()> {
    enumeration.items.iter().zip(1..).try_for_each(|((name, description), value)| {
        let attributes = vec![
            ("name", name.clone()),
            ("value", value.to_string()),
            ("description", description.clone()),
        ];
        leaf(xml, "Item", attributes)
    })
}

/// Writes the annotation of an input that may stay unconnected. FMI has no attribute for it, and
/// importers ignore annotations that they do not know.
fn write_optional(xml: &mut Xml, element: &str, attribute: &'static str) -> io::Result<()> {
    parent(xml, "Annotations", vec![], |xml| {
        let tool = vec![(attribute, OPTIONAL.into())];
        parent(xml, element, tool, |xml| leaf(xml, "Optional", vec![]))
    })
}

/// Writes one list of ModelStructure. FMI 2.0 counts variables from 1 here; an empty `dependencies`
/// means that there are none.
fn unknowns(
    xml: &mut Xml,
    name: &str,
    list: &[usize],
    dependencies: impl Fn(usize) -> Vec<usize>,
) -> io::Result<()> {
    if list.is_empty() {
        return Ok(());
    }
    parent(xml, name, vec![], |xml| {
        list.iter().try_for_each(|&i| {
            let indices: Vec<_> =
                dependencies(i).iter().map(|reference| (reference + 1).to_string()).collect();
            leaf(
                xml,
                "Unknown",
                vec![("index", (i + 1).to_string()), ("dependencies", indices.join(" "))],
            )
        })
    })
}

/// Returns the shortest text that reads back as the same number.
fn real(x: f64) -> String {
    format!("{x:?}")
}

fn given<const N: usize>(attributes: [(&'static str, Option<String>); N]) -> Attributes {
    attributes.into_iter().filter_map(|(name, value)| Some((name, value?))).collect()
}

fn attribute((name, value): (&'static str, String)) -> (&'static str, Cow<'static, str>) {
    (name, value.into())
}

fn leaf(xml: &mut Xml, name: &str, attributes: Attributes) -> io::Result<()> {
    let attributes = attributes.into_iter().map(attribute);
    xml.create_element(name).with_attributes(attributes).write_empty().map(drop)
}

fn parent(
    xml: &mut Xml,
    name: &str,
    attributes: Attributes,
    content: impl FnOnce(&mut Xml) -> io::Result<()>,
) -> io::Result<()> {
    let attributes = attributes.into_iter().map(attribute);
    xml.create_element(name).with_attributes(attributes).write_inner_content(content).map(drop)
}

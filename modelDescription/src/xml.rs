//! Text of an FMU's `modelDescription.xml`, FMI 2.0, section 2.2, and FMI 3.0, section 2.4.

mod interfaces;
mod terminals;

use crate::unit::Unit;
use crate::variable::{Causality, EnumerationType, Variability, Variable, VariableKind};
use crate::{AUTHOR, Error, LICENSE, LOG_CATEGORIES, ModelDescription, Version};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};
use std::borrow::Cow;
use std::io;
use std::ops::Range;

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
        Ok(document(|xml| self.write(xml, version)))
    }

    fn write(&self, xml: &mut Xml, version: Version) -> io::Result<()> {
        parent(xml, "fmiModelDescription", self.head(version), |xml| {
            self.write_interfaces(xml, version)?;
            self.write_units(xml, version)?;
            self.write_enumerations(xml, version)?;
            self.write_categories_and_experiment(xml)?;
            if version == Version::Fmi2 {
                self.write_optional(xml, ["VendorAnnotations", "Tool", "name"])?;
            }
            parent(xml, "ModelVariables", vec![], |xml| {
                if version == Version::Fmi3 {
                    beyond_table(xml, "time", 0, "Simulation time", Causality::Independent)?;
                }
                (0..self.variables.len()).try_for_each(|i| self.write_variable(xml, i, version))?;
                let indicators = self.indicators(version);
                indicators.zip(1..).try_for_each(|(reference, number)| {
                    let name = format!("eventIndicator[{number}]");
                    let text = "Event indicator: an event occurs where its sign changes";
                    beyond_table(xml, &name, reference, text, Causality::Local)
                })
            })?;
            self.write_structure(xml, version)?;
            if version == Version::Fmi3 {
                self.write_optional(xml, ["Annotations", "Annotation", "type"])?;
            }
            Ok(())
        })
    }

    /// Writes which inputs may stay unconnected. FMI has no attribute for it, and importers ignore
    /// annotations that they do not know; some refuse those of a single variable.
    fn write_optional(&self, xml: &mut Xml, names: [&'static str; 3]) -> io::Result<()> {
        let [list, tool, attribute] = names;
        let mut optional = self.variables.iter().filter(|variable| variable.is_optional).peekable();
        if optional.peek().is_none() {
            return Ok(());
        }
        parent(xml, list, vec![], |xml| {
            // The schema of FMI 2.0 allows one element of a tool.
            parent(xml, tool, vec![(attribute, OPTIONAL.into())], |xml| {
                parent(xml, "Optional", vec![], |xml| {
                    optional.try_for_each(|input| {
                        leaf(xml, "Input", vec![("name", input.name.clone())])
                    })
                })
            })
        })
    }

    /// Returns the value references of the event indicators, which are variables in FMI 3.0 and
    /// follow those of the table.
    fn indicators(&self, version: Version) -> Range<usize> {
        let first = version.first_reference() + self.variables.len();
        match version {
            Version::Fmi2 => first..first,
            Version::Fmi3 => first..first + self.event_indicators,
        }
    }

    fn head(&self, version: Version) -> Attributes {
        // Several importers compare the version; they would refuse "2.0.4".
        let (standard, identity) = match version {
            Version::Fmi2 => ("2.0", "guid"),
            Version::Fmi3 => ("3.0", "instantiationToken"),
        };
        let mut attributes: Attributes = vec![
            ("fmiVersion", standard.into()),
            ("modelName", self.name.clone()),
            (identity, self.guid()),
            ("description", self.description.clone()),
            ("author", AUTHOR.into()),
            ("version", self.version.clone()),
            ("license", LICENSE.into()),
            ("generationTool", concat!("fmu-pack ", env!("CARGO_PKG_VERSION")).into()),
            ("variableNamingConvention", "structured".into()),
        ];
        if self.model_exchange && version == Version::Fmi2 {
            attributes.push(("numberOfEventIndicators", self.event_indicators.to_string()));
        }
        attributes
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

    fn write_units(&self, xml: &mut Xml, version: Version) -> io::Result<()> {
        let second = Unit::new("s");
        // FMI 3.0 has the time as a variable.
        let mut units = if version == Version::Fmi3 { vec![&second] } else { vec![] };
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

    fn write_enumerations(&self, xml: &mut Xml, version: Version) -> io::Result<()> {
        let mut enumerations = self.enumerations();
        if enumerations.is_empty() {
            return Ok(());
        }
        enumerations.sort_by(|a, b| a.name.cmp(&b.name));
        parent(xml, "TypeDefinitions", vec![], |xml| {
            enumerations.iter().try_for_each(|enumeration| {
                let attributes = vec![
                    ("name", enumeration.name.clone()),
                    ("description", enumeration.description.clone()),
                ];
                let items = |xml: &mut Xml| write_items(xml, enumeration);
                match version {
                    Version::Fmi2 => parent(xml, "SimpleType", attributes, |xml| {
                        parent(xml, "Enumeration", vec![], items)
                    }),
                    Version::Fmi3 => parent(xml, "EnumerationType", attributes, items),
                }
            })
        })
    }

    fn write_variable(&self, xml: &mut Xml, position: usize, version: Version) -> io::Result<()> {
        let variable = &self.variables[position];
        // The attribute `initial` is left out, because the standard's defaults fit: parameters are
        // exact, and outputs and locals are calculated.
        let mut attributes = vec![
            ("name", variable.name.clone()),
            ("valueReference", (position + version.first_reference()).to_string()),
            ("description", variable.description.clone()),
            ("causality", variable.causality.name().into()),
            ("variability", variable.variability.name().into()),
        ];
        let (element, mut further) = self.element_of(&variable.kind);
        if version == Version::Fmi2 {
            return parent(xml, "ScalarVariable", attributes, |xml| leaf(xml, element, further));
        }
        let is_state = |other: &Variable| other.derivative_of() == Some(&variable.name);
        if self.model_exchange && self.variables.iter().any(is_state) {
            // Events may set it, and the importer sets it with all others only.
            attributes.push(("reinit", "true".into()));
        }
        let texts = if element == "String" { std::mem::take(&mut further) } else { vec![] };
        attributes.extend(further);
        let element = match element {
            "Real" => "Float64",
            "Integer" => "Int32",
            same => same,
        };
        if texts.is_empty() {
            return leaf(xml, element, attributes);
        }
        parent(xml, element, attributes, |xml| {
            texts.into_iter().try_for_each(|(_, text)| leaf(xml, "Start", vec![("value", text)]))
        })
    }

    /// Returns the element of FMI 2.0 for a type, with the attributes that only this type has.
    fn element_of(&self, kind: &VariableKind) -> (&'static str, Attributes) {
        let number = |number: Option<i32>| number.map(|number| number.to_string());
        match kind {
            VariableKind::Real { unit, min, max, nominal, start, derivative_of } => {
                // In FMI 2.0 this is the number of the state, counted from 1; in FMI 3.0 it is its
                // value reference, which is the same.
                let state = derivative_of.as_deref().and_then(|name| self.position(name));
                let display = unit.as_ref().and_then(|unit| unit.display.as_ref());
                let attributes = [
                    ("unit", unit.as_ref().map(|unit| unit.name.clone())),
                    ("displayUnit", display.map(|display| display.name.clone())),
                    ("min", min.map(real)),
                    ("max", max.map(real)),
                    ("nominal", nominal.map(real)),
                    ("start", start.map(real)),
                    ("derivative", state.map(|position| (position + 1).to_string())),
                ];
                ("Real", given(attributes))
            }
            VariableKind::Integer { min, max, start } => {
                let attributes = [("min", *min), ("max", *max), ("start", *start)];
                ("Integer", given(attributes.map(|(name, value)| (name, number(value)))))
            }
            VariableKind::Boolean { start } => {
                ("Boolean", given([("start", start.map(|x| x.to_string()))]))
            }
            VariableKind::Enumeration { enumeration_type, start } => {
                let name = Some(enumeration_type.name.clone());
                ("Enumeration", given([("declaredType", name), ("start", number(*start))]))
            }
            VariableKind::String { start } => ("String", given([("start", start.clone())])),
        }
    }

    fn write_structure(&self, xml: &mut Xml, version: Version) -> io::Result<()> {
        let states = self.states();
        let is_output = |i: &usize| self.variables[*i].causality == Causality::Output;
        let outputs: Vec<_> = (0..self.variables.len()).filter(is_output).collect();
        let derivatives: Vec<_> = states.iter().map(|&(_, derivative)| derivative).collect();
        let at_runtime = |i| self.dependencies(i, &states);
        let initially = |i| self.initial_dependencies(i, &states);
        let names = match version {
            Version::Fmi2 => ["Outputs", "Derivatives", "InitialUnknowns"],
            Version::Fmi3 => ["Output", "ContinuousStateDerivative", "InitialUnknown"],
        };
        parent(xml, "ModelStructure", vec![], |xml| {
            unknowns(xml, (version, names[0]), &outputs, at_runtime)?;
            unknowns(xml, (version, names[1]), &derivatives, at_runtime)?;
            unknowns(xml, (version, names[2]), &self.initial_unknowns(&states), initially)?;
            // Without a list of dependencies they depend on everything.
            self.indicators(version).try_for_each(|reference| {
                leaf(xml, "EventIndicator", vec![("valueReference", reference.to_string())])
            })
        })
    }
}

/// Writes a variable that FMI 3.0 has beyond the variable table.
fn beyond_table(
    xml: &mut Xml,
    name: &str,
    reference: usize,
    description: &str,
    causality: Causality,
) -> io::Result<()> {
    let mut attributes: Attributes = vec![
        ("name", name.into()),
        ("valueReference", reference.to_string()),
        ("description", description.into()),
        ("causality", causality.name().into()),
        ("variability", Variability::Continuous.name().into()),
    ];
    if causality == Causality::Independent {
        attributes.push(("unit", "s".into()));
    }
    leaf(xml, "Float64", attributes)
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

/// Writes one list of ModelStructure. FMI 2.0 counts variables from 1 here, which are the value
/// references of FMI 3.0; an empty `dependencies` means that there are none.
fn unknowns(
    xml: &mut Xml,
    (version, name): (Version, &str),
    list: &[usize],
    dependencies: impl Fn(usize) -> Vec<usize>,
) -> io::Result<()> {
    let write = |xml: &mut Xml, element: &str, attribute| {
        list.iter().try_for_each(|&i| {
            let others: Vec<_> =
                dependencies(i).iter().map(|other| (other + 1).to_string()).collect();
            let attributes =
                vec![(attribute, (i + 1).to_string()), ("dependencies", others.join(" "))];
            leaf(xml, element, attributes)
        })
    };
    match version {
        Version::Fmi3 => write(xml, name, "valueReference"),
        Version::Fmi2 if list.is_empty() => Ok(()),
        Version::Fmi2 => parent(xml, name, vec![], |xml| write(xml, "Unknown", "index")),
    }
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

//! The parts of `modelDescription.xml` that the orchestrator needs: variables, units, enumerations,
//! and the dependencies of outputs on inputs. (The reader in `fmi-rs` drops unit definitions and
//! all types but the first.)

use crate::quantity::UnitDefinition;
use crate::xml::Element;
use std::collections::BTreeMap;

/// The model description of an FMU.
#[derive(Clone, Debug, Default)]
pub struct ModelDescription {
    /// FMI version, from the attribute `fmiVersion`.
    pub fmi_version: String,
    /// Name of the model, from the attribute `modelName`.
    pub model_name: String,
    /// Identifier of the build, from the attribute `guid`.
    pub guid: String,
    /// Description of the model, from the attribute `description`.
    pub description: String,
    /// Version of the model, from the attribute `version`.
    pub version: String,
    /// Tool that exported the FMU, from the attribute `generationTool`.
    pub generation_tool: String,
    /// Co-simulation capabilities, if the FMU offers co-simulation.
    pub co_simulation: Option<Interface>,
    /// Model exchange capabilities, if the FMU offers model exchange.
    pub model_exchange: Option<Interface>,
    /// Simulation settings that the FMU proposes.
    pub default_experiment: DefaultExperiment,
    /// Unit definitions of the FMU.
    pub units: Vec<UnitDefinition>,
    /// All variables, in the order of the file.
    pub variables: Vec<Variable>,
    /// Positions, in `variables`, of the variables that each output depends on at the same instant;
    /// only for outputs that declare them.
    pub dependencies: BTreeMap<usize, Vec<usize>>,
    /// Whether the file has a `ModelStructure`, which FMI requires.
    pub has_structure: bool,
}

/// An interface's model identifier and its capability flags.
#[derive(Clone, Debug, Default)]
pub struct Interface {
    /// Name of the library in the archive, without file extension.
    pub model_identifier: String,
    /// Attributes that are set to `true`, as `name`, and attributes with a number, as `name=value`.
    pub capabilities: Vec<String>,
}

impl Interface {
    /// Returns whether a capability flag is set.
    pub fn has(&self, capability: &str) -> bool {
        self.capabilities.iter().any(|name| name == capability)
    }
}

/// Simulation settings that the FMU proposes.
#[derive(Clone, Copy, Debug, Default)]
pub struct DefaultExperiment {
    /// Start time of the simulation, s.
    pub start: Option<f64>,
    /// Stop time of the simulation, s.
    pub stop: Option<f64>,
    /// Length of the communication step, s.
    pub step: Option<f64>,
    /// Relative tolerance of the integration.
    pub tolerance: Option<f64>,
}

/// A scalar variable of an FMU.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Name of the variable.
    pub name: String,
    /// Value reference, which identifies the variable in the get and set calls of its type.
    pub reference: u32,
    /// Description of the variable's meaning.
    pub description: String,
    /// Causality: `parameter`, `input`, `output`, `local`, ….
    pub causality: String,
    /// Variability: `fixed`, `discrete`, `continuous`, ….
    pub variability: String,
    /// Type of the variable, with its attributes.
    pub kind: Kind,
    /// Start value as the file writes it.
    pub start: Option<String>,
}

/// Type of a variable, with the attributes of that type.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A real number, held as a 64-bit float.
    Real {
        /// Name of the unit, if any.
        unit: Option<String>,
        /// Unit in which the value is displayed.
        display_unit: Option<String>,
        /// Smallest allowed value, in the variable's unit.
        min: Option<f64>,
        /// Largest allowed value, in the variable's unit.
        max: Option<f64>,
    },
    /// An integer number of 32 bits.
    Integer {
        /// Smallest allowed value, if any.
        min: Option<i32>,
        /// Largest allowed value, if any.
        max: Option<i32>,
    },
    /// A truth value, true or false.
    Boolean,
    /// A choice among named items.
    Enumeration {
        /// Names of the items, with their values.
        items: Vec<(String, i32)>,
    },
    /// A text of any length.
    String,
}

impl Kind {
    /// Returns the name of the type in FMI.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Real { .. } => "Real",
            Self::Integer { .. } => "Integer",
            Self::Boolean => "Boolean",
            Self::Enumeration { .. } => "Enumeration",
            Self::String => "String",
        }
    }
}

impl ModelDescription {
    /// Parses the text of `modelDescription.xml`.
    ///
    /// # Errors
    /// Returns a line that says what is wrong with the text, and where.
    pub fn parse(text: &str) -> Result<Self, String> {
        read::description(&Element::parse(text)?)
    }

    /// Finds the variable with this name and returns it with its position.
    pub fn find(&self, name: &str) -> Option<(usize, &Variable)> {
        self.variables.iter().enumerate().find(|(_, variable)| variable.name == name)
    }

    /// Returns the names of the variables with this causality.
    pub fn names<'a>(&'a self, causality: &'a str) -> impl Iterator<Item = &'a str> + Clone {
        self.variables.iter().filter(move |v| v.causality == causality).map(|v| v.name.as_str())
    }
}

/// Builds a description from the elements of the file.
mod read {
    use super::{DefaultExperiment, Interface, Kind, ModelDescription, Variable};
    use crate::quantity::UnitDefinition;
    use crate::xml::Element;
    use std::collections::BTreeMap;

    /// Flags of an interface, in the order in which they are shown.
    const FLAGS: [&str; 10] = [
        "needsExecutionTool",
        "canHandleVariableCommunicationStepSize",
        "canInterpolateInputs",
        "canRunAsynchronuously",
        "canBeInstantiatedOnlyOncePerProcess",
        "canNotUseMemoryManagementFunctions",
        "canGetAndSetFMUstate",
        "canSerializeFMUstate",
        "providesDirectionalDerivative",
        "completedIntegratorStepNotNeeded",
    ];
    /// Names that the standard gives to the exponents of a base unit.
    const BASE: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

    type Types<'a> = BTreeMap<&'a str, &'a Element>;

    pub(super) fn description(root: &Element) -> Result<ModelDescription, String> {
        if root.name != "fmiModelDescription" {
            return Err(format!("is no FMI description: it begins with {}", root.title()));
        }
        let fmi_version = root.required("fmiVersion")?.to_string();
        if fmi_version != "2.0" && !fmi_version.starts_with("2.0.") {
            return Err(format!("is an FMU for FMI {fmi_version}, this program runs FMI 2.0"));
        }
        let types = root.list("TypeDefinitions", "SimpleType");
        let types: Types = types.filter_map(|of| Some((of.attribute("name")?, of))).collect();
        let variables = root.list("ModelVariables", "ScalarVariable");
        let variables = variables.map(|of| variable(of, &types)).collect::<Result<Vec<_>, _>>()?;
        let text = |name: &str| root.attribute(name).unwrap_or_default().to_string();
        let experiment = root.child("DefaultExperiment");
        let proposed = |name: &str| experiment.map_or(Ok(None), |element| element.number(name));
        let units = root.list("UnitDefinitions", "Unit");
        Ok(ModelDescription {
            model_name: text("modelName"),
            guid: text("guid"),
            description: text("description"),
            version: text("version"),
            generation_tool: text("generationTool"),
            co_simulation: root.child("CoSimulation").map(interface).transpose()?,
            model_exchange: root.child("ModelExchange").map(interface).transpose()?,
            default_experiment: DefaultExperiment {
                start: proposed("startTime")?,
                stop: proposed("stopTime")?,
                step: proposed("stepSize")?,
                tolerance: proposed("tolerance")?,
            },
            units: units.map(unit).collect::<Result<_, _>>()?,
            dependencies: dependencies(root, variables.len())?,
            has_structure: root.child("ModelStructure").is_some(),
            variables,
            fmi_version,
        })
    }

    fn interface(element: &Element) -> Result<Interface, String> {
        let mut capabilities = Vec::new();
        for name in FLAGS {
            if element.truth(name)? == Some(true) {
                capabilities.push(name.to_string());
            }
        }
        let order: Option<u32> =
            element.parsed("maxOutputDerivativeOrder", "a whole number from 0 on")?;
        if let Some(order) = order.filter(|&order| order > 0) {
            capabilities.push(format!("maxOutputDerivativeOrder={order}"));
        }
        Ok(Interface {
            model_identifier: element.required("modelIdentifier")?.to_string(),
            capabilities,
        })
    }

    fn unit(element: &Element) -> Result<UnitDefinition, String> {
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
        let own = ["Real", "Integer", "Boolean", "String", "Enumeration"];
        let own = own.iter().find_map(|kind| element.child(kind));
        let own = own.ok_or_else(|| format!("{} has no type", element.title()))?;
        // An attribute of the variable itself takes precedence over that of its declared type.
        let declared =
            own.attribute("declaredType").and_then(|name| types.get(name)?.child(&own.name));
        let text = |name: &str| {
            own.attribute(name).or_else(|| declared?.attribute(name)).map(ToString::to_string)
        };
        let kind = match own.name.as_str() {
            "Real" => {
                let bound = |name: &str| match own.number(name)? {
                    None => declared.map_or(Ok(None), |declared| declared.number(name)),
                    own => Ok(own),
                };
                let (min, max) = (bound("min")?, bound("max")?);
                Kind::Real { unit: text("unit"), display_unit: text("displayUnit"), min, max }
            }
            "Integer" => {
                let bound = |name: &str| match own.parsed(name, "a whole number")? {
                    None => declared
                        .map_or(Ok(None), |declared| declared.parsed(name, "a whole number")),
                    own => Ok::<_, String>(own),
                };
                Kind::Integer { min: bound("min")?, max: bound("max")? }
            }
            "Boolean" => Kind::Boolean,
            "String" => Kind::String,
            _ => {
                let declared = declared
                    .ok_or_else(|| format!("{} has no type definition", element.title()))?;
                let item = |item: &Element| {
                    let value = item.parsed("value", "a whole number")?;
                    let value =
                        value.ok_or_else(|| format!("{} has no attribute value", item.title()))?;
                    Ok((item.required("name")?.to_string(), value))
                };
                let items = declared.children.iter().filter(|child| child.name == "Item");
                Kind::Enumeration { items: items.map(item).collect::<Result<_, String>>()? }
            }
        };
        let reference = element.parsed("valueReference", "a whole number from 0 to 4294967295")?;
        let or = |name: &str, default: &str| element.attribute(name).unwrap_or(default).to_string();
        Ok(Variable {
            name: element.required("name")?.to_string(),
            reference: reference
                .ok_or_else(|| format!("{} has no attribute valueReference", element.title()))?,
            description: or("description", ""),
            causality: or("causality", "local"),
            variability: or("variability", "continuous"),
            kind,
            start: own.attribute("start").map(ToString::to_string),
        })
    }

    /// Returns the positions of the inputs that each output depends on, by the position of the
    /// output. Only outputs that declare their dependencies have an entry.
    fn dependencies(
        root: &Element,
        variables: usize,
    ) -> Result<BTreeMap<usize, Vec<usize>>, String> {
        let unknowns =
            root.child("ModelStructure").into_iter().flat_map(|of| of.list("Outputs", "Unknown"));
        let mut dependencies = BTreeMap::new();
        for unknown in unknowns {
            // Indices in the file count from 1.
            let position = |index: usize| {
                let position = index.checked_sub(1).filter(|&position| position < variables);
                position.ok_or_else(|| {
                    format!(
                        "{} names variable {index} of {variables} of ModelStructure",
                        unknown.title()
                    )
                })
            };
            let index = unknown.parsed("index", "a whole number from 1 on")?;
            let output = position(
                index.ok_or_else(|| format!("{} has no attribute index", unknown.title()))?,
            )?;
            if let Some(text) = unknown.attribute("dependencies") {
                let parse = |text: &str| {
                    let fault = || {
                        format!("\"{}\" in {} is no index", text.escape_default(), unknown.title())
                    };
                    text.parse().map_err(|_| fault()).and_then(position)
                };
                dependencies.insert(
                    output,
                    text.split_whitespace().map(parse).collect::<Result<Vec<_>, _>>()?,
                );
            }
        }
        Ok(dependencies)
    }
}

/// Type in which a value is transferred.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Carrier {
    /// A real number as `f64`.
    Real,
    /// An integer or an enumeration's value as `i32`.
    Integer,
    /// A truth value as `i32`, 0 or 1.
    Boolean,
}

impl Carrier {
    /// Returns the type in which values of a kind are transferred; `None` for texts, which are not
    /// transferred.
    pub fn of(kind: &Kind) -> Option<Self> {
        match kind {
            Kind::Real { .. } => Some(Self::Real),
            Kind::Integer { .. } | Kind::Enumeration { .. } => Some(Self::Integer),
            Kind::Boolean => Some(Self::Boolean),
            Kind::String => None,
        }
    }
}

#[cfg(test)]
mod tests;

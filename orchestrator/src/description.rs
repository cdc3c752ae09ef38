//! `modelDescription.xml` as the orchestrator needs it: variables, units, enumerations, and which output depends on which
//! input. (The reader in `fmi-rs` drops unit definitions and all types but the first.)

use crate::quantity::UnitDefinition;
use std::collections::BTreeMap;

/// What an FMU says of itself.
#[derive(Clone, Debug, Default)]
pub struct ModelDescription {
    /// `fmiVersion`.
    pub fmi_version: String,
    /// `modelName`.
    pub model_name: String,
    /// `guid`.
    pub guid: String,
    /// `description`.
    pub description: String,
    /// `version` of the model.
    pub version: String,
    /// `generationTool`.
    pub generation_tool: String,
    /// Co-simulation capabilities, if offered.
    pub co_simulation: Option<Interface>,
    /// Model exchange capabilities, if offered.
    pub model_exchange: Option<Interface>,
    /// The experiment it proposes.
    pub default_experiment: DefaultExperiment,
    /// Unit definitions.
    pub units: Vec<UnitDefinition>,
    /// All variables, in the file's order.
    pub variables: Vec<Variable>,
    /// For each output that declares them: the variables it depends on at the same instant. Positions in `variables`.
    pub dependencies: BTreeMap<usize, Vec<usize>>,
}

/// An interface's model identifier and its capability flags.
#[derive(Clone, Debug, Default)]
pub struct Interface {
    /// Name of the library in the archive, without ending.
    pub model_identifier: String,
    /// The attributes that are set to `true`, and those with a number, as `name` or `name=value`.
    pub capabilities: Vec<String>,
}

impl Interface {
    /// Whether a flag is set.
    pub fn has(&self, capability: &str) -> bool {
        self.capabilities.iter().any(|name| name == capability)
    }
}

/// Simulation settings the FMU proposes.
#[derive(Clone, Copy, Debug, Default)]
pub struct DefaultExperiment {
    /// Start time, s.
    pub start: Option<f64>,
    /// Stop time, s.
    pub stop: Option<f64>,
    /// Step, s.
    pub step: Option<f64>,
    /// Relative tolerance.
    pub tolerance: Option<f64>,
}

/// A scalar variable.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Name.
    pub name: String,
    /// Handle for the get and set calls of its type.
    pub reference: u32,
    /// What it is.
    pub description: String,
    /// `parameter`, `input`, `output`, `local`, ….
    pub causality: String,
    /// `fixed`, `discrete`, `continuous`, ….
    pub variability: String,
    /// Type and what belongs to it.
    pub kind: Kind,
    /// Start value as written.
    pub start: Option<String>,
}

/// Type of a variable.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A 64-bit float.
    Real {
        /// Unit name.
        unit: Option<String>,
        /// Unit it is shown in.
        display_unit: Option<String>,
        /// Smallest allowed value, in the unit.
        min: Option<f64>,
        /// Largest allowed value, in the unit.
        max: Option<f64>,
    },
    /// A 32-bit integer.
    Integer {
        /// Smallest allowed value.
        min: Option<i32>,
        /// Largest allowed value.
        max: Option<i32>,
    },
    /// A truth value.
    Boolean,
    /// One of named items.
    Enumeration {
        /// Item names and their values.
        items: Vec<(String, i32)>,
    },
    /// Text.
    String,
}

impl Kind {
    /// The type's FMI name.
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
    /// Reads the text of `modelDescription.xml`.
    ///
    /// # Errors
    /// One line: what is wrong with the text.
    pub fn parse(text: &str) -> Result<Self, String> {
        let root: xml::Root = quick_xml::de::from_str(text).map_err(|error| error.to_string())?;
        root.try_into()
    }

    /// The variable of this name, with its position.
    pub fn find(&self, name: &str) -> Option<(usize, &Variable)> {
        self.variables.iter().enumerate().find(|(_, variable)| variable.name == name)
    }

    /// Names of the variables with this causality.
    pub fn names<'a>(&'a self, causality: &'a str) -> impl Iterator<Item = &'a str> + Clone {
        self.variables.iter().filter(move |v| v.causality == causality).map(|v| v.name.as_str())
    }
}

/// The file's elements and attributes.
mod xml {
    use super::{DefaultExperiment, Interface, Kind, ModelDescription, Variable};
    use crate::quantity::UnitDefinition;
    use serde::Deserialize;
    use std::collections::BTreeMap;

    #[derive(Deserialize)]
    pub(super) struct Root {
        #[serde(rename = "@fmiVersion")]
        fmi_version: String,
        #[serde(rename = "@modelName", default)]
        model_name: String,
        #[serde(rename = "@guid", default)]
        guid: String,
        #[serde(rename = "@description", default)]
        description: String,
        #[serde(rename = "@version", default)]
        version: String,
        #[serde(rename = "@generationTool", default)]
        generation_tool: String,
        #[serde(rename = "CoSimulation")]
        co_simulation: Option<InterfaceElement>,
        #[serde(rename = "ModelExchange")]
        model_exchange: Option<InterfaceElement>,
        #[serde(rename = "DefaultExperiment")]
        default_experiment: Option<Experiment>,
        #[serde(rename = "UnitDefinitions", default)]
        units: Units,
        #[serde(rename = "TypeDefinitions", default)]
        types: Types,
        #[serde(rename = "ModelVariables", default)]
        variables: Variables,
        #[serde(rename = "ModelStructure", default)]
        structure: Structure,
    }

    #[derive(Deserialize)]
    #[allow(clippy::struct_excessive_bools)] // FMI's own flags.
    struct InterfaceElement {
        #[serde(rename = "@modelIdentifier")]
        model_identifier: String,
        #[serde(rename = "@needsExecutionTool", default)]
        needs_execution_tool: bool,
        #[serde(rename = "@canHandleVariableCommunicationStepSize", default)]
        variable_step: bool,
        #[serde(rename = "@canInterpolateInputs", default)]
        interpolate_inputs: bool,
        #[serde(rename = "@maxOutputDerivativeOrder", default)]
        output_derivative_order: u32,
        #[serde(rename = "@canRunAsynchronuously", default)]
        asynchronous: bool,
        #[serde(rename = "@canBeInstantiatedOnlyOncePerProcess", default)]
        only_once: bool,
        #[serde(rename = "@canNotUseMemoryManagementFunctions", default)]
        no_memory_functions: bool,
        #[serde(rename = "@canGetAndSetFMUstate", default)]
        state: bool,
        #[serde(rename = "@canSerializeFMUstate", default)]
        serialize: bool,
        #[serde(rename = "@providesDirectionalDerivative", default)]
        directional_derivative: bool,
        #[serde(rename = "@completedIntegratorStepNotNeeded", default)]
        no_completed_step: bool,
    }

    impl From<InterfaceElement> for Interface {
        fn from(element: InterfaceElement) -> Self {
            let flags = [
                (element.needs_execution_tool, "needsExecutionTool"),
                (element.variable_step, "canHandleVariableCommunicationStepSize"),
                (element.interpolate_inputs, "canInterpolateInputs"),
                (element.asynchronous, "canRunAsynchronuously"),
                (element.only_once, "canBeInstantiatedOnlyOncePerProcess"),
                (element.no_memory_functions, "canNotUseMemoryManagementFunctions"),
                (element.state, "canGetAndSetFMUstate"),
                (element.serialize, "canSerializeFMUstate"),
                (element.directional_derivative, "providesDirectionalDerivative"),
                (element.no_completed_step, "completedIntegratorStepNotNeeded"),
            ];
            let mut capabilities: Vec<String> =
                flags.iter().filter(|(set, _)| *set).map(|(_, name)| (*name).to_string()).collect();
            if element.output_derivative_order > 0 {
                capabilities.push(format!("maxOutputDerivativeOrder={}", element.output_derivative_order));
            }
            Self { model_identifier: element.model_identifier, capabilities }
        }
    }

    #[derive(Deserialize)]
    struct Experiment {
        #[serde(rename = "@startTime")]
        start: Option<f64>,
        #[serde(rename = "@stopTime")]
        stop: Option<f64>,
        #[serde(rename = "@stepSize")]
        step: Option<f64>,
        #[serde(rename = "@tolerance")]
        tolerance: Option<f64>,
    }

    #[derive(Default, Deserialize)]
    struct Units {
        #[serde(rename = "Unit", default)]
        units: Vec<Unit>,
    }

    #[derive(Deserialize)]
    struct Unit {
        #[serde(rename = "@name")]
        name: String,
        #[serde(rename = "BaseUnit")]
        base: Option<BaseUnit>,
        #[serde(rename = "DisplayUnit", default)]
        displays: Vec<DisplayUnit>,
    }

    #[derive(Deserialize)]
    struct BaseUnit {
        #[serde(rename = "@kg", default)]
        kg: i32,
        #[serde(rename = "@m", default)]
        m: i32,
        #[serde(rename = "@s", default)]
        s: i32,
        #[serde(rename = "@A", default)]
        ampere: i32,
        #[serde(rename = "@K", default)]
        kelvin: i32,
        #[serde(rename = "@mol", default)]
        mol: i32,
        #[serde(rename = "@cd", default)]
        cd: i32,
        #[serde(rename = "@rad", default)]
        rad: i32,
        #[serde(rename = "@factor", default = "one")]
        factor: f64,
        #[serde(rename = "@offset", default)]
        offset: f64,
    }

    #[derive(Deserialize)]
    struct DisplayUnit {
        #[serde(rename = "@name")]
        name: String,
        #[serde(rename = "@factor", default = "one")]
        factor: f64,
        #[serde(rename = "@offset", default)]
        offset: f64,
    }

    fn one() -> f64 {
        1.0
    }

    #[derive(Default, Deserialize)]
    struct Types {
        #[serde(rename = "SimpleType", default)]
        types: Vec<SimpleType>,
    }

    #[derive(Deserialize)]
    struct SimpleType {
        #[serde(rename = "@name")]
        name: String,
        #[serde(rename = "Real")]
        real: Option<Real>,
        #[serde(rename = "Integer")]
        integer: Option<Integer>,
        #[serde(rename = "Enumeration")]
        enumeration: Option<Items>,
    }

    #[derive(Deserialize)]
    struct Items {
        #[serde(rename = "Item", default)]
        items: Vec<Item>,
    }

    #[derive(Deserialize)]
    struct Item {
        #[serde(rename = "@name")]
        name: String,
        #[serde(rename = "@value")]
        value: i32,
    }

    #[derive(Default, Deserialize)]
    struct Variables {
        #[serde(rename = "ScalarVariable", default)]
        variables: Vec<ScalarVariable>,
    }

    #[derive(Deserialize)]
    struct ScalarVariable {
        #[serde(rename = "@name")]
        name: String,
        #[serde(rename = "@valueReference")]
        reference: u32,
        #[serde(rename = "@description", default)]
        description: String,
        #[serde(rename = "@causality", default = "local")]
        causality: String,
        #[serde(rename = "@variability", default = "continuous")]
        variability: String,
        #[serde(rename = "Real")]
        real: Option<Real>,
        #[serde(rename = "Integer")]
        integer: Option<Integer>,
        #[serde(rename = "Boolean")]
        boolean: Option<Plain>,
        #[serde(rename = "String")]
        string: Option<Plain>,
        #[serde(rename = "Enumeration")]
        enumeration: Option<Plain>,
    }

    fn local() -> String {
        "local".into()
    }
    fn continuous() -> String {
        "continuous".into()
    }

    #[derive(Clone, Default, Deserialize)]
    struct Real {
        #[serde(rename = "@declaredType")]
        declared_type: Option<String>,
        #[serde(rename = "@unit")]
        unit: Option<String>,
        #[serde(rename = "@displayUnit")]
        display_unit: Option<String>,
        #[serde(rename = "@min")]
        min: Option<f64>,
        #[serde(rename = "@max")]
        max: Option<f64>,
        #[serde(rename = "@start")]
        start: Option<String>,
    }

    #[derive(Clone, Default, Deserialize)]
    struct Integer {
        #[serde(rename = "@declaredType")]
        declared_type: Option<String>,
        #[serde(rename = "@min")]
        min: Option<i32>,
        #[serde(rename = "@max")]
        max: Option<i32>,
        #[serde(rename = "@start")]
        start: Option<String>,
    }

    #[derive(Deserialize)]
    struct Plain {
        #[serde(rename = "@declaredType")]
        declared_type: Option<String>,
        #[serde(rename = "@start")]
        start: Option<String>,
    }

    #[derive(Default, Deserialize)]
    struct Structure {
        #[serde(rename = "Outputs", default)]
        outputs: Unknowns,
    }

    #[derive(Default, Deserialize)]
    struct Unknowns {
        #[serde(rename = "Unknown", default)]
        unknowns: Vec<Unknown>,
    }

    #[derive(Deserialize)]
    struct Unknown {
        #[serde(rename = "@index")]
        index: usize,
        #[serde(rename = "@dependencies")]
        dependencies: Option<String>,
    }

    impl ScalarVariable {
        fn into_variable(self, types: &BTreeMap<&str, &SimpleType>) -> Result<Variable, String> {
            let declared = |name: &Option<String>| name.as_deref().and_then(|name| types.get(name));
            let (kind, start) = if let Some(own) = self.real {
                let default = declared(&own.declared_type).and_then(|t| t.real.clone()).unwrap_or_default();
                let kind = Kind::Real {
                    unit: own.unit.or(default.unit),
                    display_unit: own.display_unit.or(default.display_unit),
                    min: own.min.or(default.min),
                    max: own.max.or(default.max),
                };
                (kind, own.start)
            } else if let Some(own) = self.integer {
                let default =
                    declared(&own.declared_type).and_then(|t| t.integer.clone()).unwrap_or_default();
                (Kind::Integer { min: own.min.or(default.min), max: own.max.or(default.max) }, own.start)
            } else if let Some(own) = self.boolean {
                (Kind::Boolean, own.start)
            } else if let Some(own) = self.string {
                (Kind::String, own.start)
            } else if let Some(own) = self.enumeration {
                let items =
                    declared(&own.declared_type).and_then(|t| t.enumeration.as_ref()).ok_or_else(|| {
                        format!("the enumeration variable \"{}\" has no type definition", self.name)
                    })?;
                let items = items.items.iter().map(|item| (item.name.clone(), item.value)).collect();
                (Kind::Enumeration { items }, own.start)
            } else {
                return Err(format!("the variable \"{}\" has no type", self.name));
            };
            Ok(Variable {
                name: self.name,
                reference: self.reference,
                description: self.description,
                causality: self.causality,
                variability: self.variability,
                kind,
                start,
            })
        }
    }

    impl From<Unit> for UnitDefinition {
        fn from(unit: Unit) -> Self {
            let base = unit.base.map(|b| ([b.kg, b.m, b.s, b.ampere, b.kelvin, b.mol, b.cd, b.rad], b));
            Self {
                name: unit.name,
                exponents: base.as_ref().map(|(exponents, _)| *exponents),
                factor: base.as_ref().map_or(1.0, |(_, b)| b.factor),
                offset: base.as_ref().map_or(0.0, |(_, b)| b.offset),
                displays: unit.displays.into_iter().map(|d| (d.name, d.factor, d.offset)).collect(),
            }
        }
    }

    impl TryFrom<Root> for ModelDescription {
        type Error = String;

        fn try_from(root: Root) -> Result<Self, String> {
            if root.fmi_version != "2.0" {
                return Err(format!("is an FMU for FMI {}, this program runs FMI 2.0", root.fmi_version));
            }
            let types: BTreeMap<&str, &SimpleType> =
                root.types.types.iter().map(|t| (t.name.as_str(), t)).collect();
            let variables = root
                .variables
                .variables
                .into_iter()
                .map(|variable| variable.into_variable(&types))
                .collect::<Result<Vec<_>, _>>()?;

            // `index` counts from 1.
            let position = |index: usize| {
                index
                    .checked_sub(1)
                    .filter(|&position| position < variables.len())
                    .ok_or_else(|| format!("ModelStructure names variable {index} of {}", variables.len()))
            };
            let mut dependencies = BTreeMap::new();
            for unknown in &root.structure.outputs.unknowns {
                let output = position(unknown.index)?;
                if let Some(text) = &unknown.dependencies {
                    let known = text
                        .split_whitespace()
                        .map(|index| {
                            index.parse().map_err(|_| format!("\"{index}\" is no index")).and_then(position)
                        })
                        .collect::<Result<Vec<_>, _>>()?;
                    dependencies.insert(output, known);
                }
            }

            let default_experiment = root.default_experiment.map_or_else(DefaultExperiment::default, |e| {
                DefaultExperiment { start: e.start, stop: e.stop, step: e.step, tolerance: e.tolerance }
            });
            Ok(Self {
                fmi_version: root.fmi_version,
                model_name: root.model_name,
                guid: root.guid,
                description: root.description,
                version: root.version,
                generation_tool: root.generation_tool,
                co_simulation: root.co_simulation.map(Into::into),
                model_exchange: root.model_exchange.map(Into::into),
                default_experiment,
                units: root.units.units.into_iter().map(Into::into).collect(),
                variables,
                dependencies,
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Demo" guid="{1}" xmlns:xsi="http://x" extra="ignored">
  <CoSimulation modelIdentifier="Demo" canHandleVariableCommunicationStepSize="true" maxOutputDerivativeOrder="1"/>
  <UnitDefinitions>
    <Unit name="rad"><BaseUnit rad="1"/><DisplayUnit name="deg" factor="57.29577951308232"/></Unit>
    <Unit name="m"><BaseUnit m="1"/></Unit>
  </UnitDefinitions>
  <TypeDefinitions>
    <SimpleType name="Angle"><Real unit="rad" max="2"/></SimpleType>
    <SimpleType name="Kind"><Enumeration><Item name="none" value="1"/><Item name="white" value="2"/></Enumeration></SimpleType>
  </TypeDefinitions>
  <LogCategories><Category name="logAll"/></LogCategories>
  <DefaultExperiment stopTime="50" stepSize="0.04"/>
  <VendorAnnotations><Tool name="x"><y/></Tool></VendorAnnotations>
  <ModelVariables>
    <!-- index 1 -->
    <ScalarVariable name="u" valueReference="7" causality="input"><Real declaredType="Angle" start="0.5"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="8" causality="output"><Real unit="m"/><Annotations><Tool name="z"/></Annotations></ScalarVariable>
    <ScalarVariable name="kind" valueReference="9" causality="parameter" variability="fixed"><Enumeration declaredType="Kind" start="2"/></ScalarVariable>
    <ScalarVariable name="z" valueReference="10" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2" dependencies="1"/><Unknown index="4"/></Outputs></ModelStructure>
</fmiModelDescription>"#;

    #[test]
    fn everything_needed_is_read() {
        let description = ModelDescription::parse(TEXT).unwrap();
        assert!(description.co_simulation.as_ref().unwrap().has("canHandleVariableCommunicationStepSize"));
        assert!(description.co_simulation.as_ref().unwrap().has("maxOutputDerivativeOrder=1"));
        assert_eq!(description.default_experiment.stop, Some(50.0));
        assert_eq!(description.units[0].displays[0].0, "deg");
        let (_, u) = description.find("u").unwrap();
        let real = Kind::Real { unit: Some("rad".into()), display_unit: None, min: None, max: Some(2.0) };
        assert_eq!((u.reference, &u.kind, u.start.as_deref()), (7, &real, Some("0.5")));
        let items = vec![("none".to_string(), 1), ("white".to_string(), 2)];
        assert_eq!(description.find("kind").unwrap().1.kind, Kind::Enumeration { items });
        // Declared dependencies are kept apart from none being declared.
        assert_eq!(description.dependencies, BTreeMap::from([(1, vec![0])]));
    }

    #[test]
    fn what_cannot_be_used_is_refused() {
        let other = TEXT.replace("fmiVersion=\"2.0\"", "fmiVersion=\"3.0\"");
        assert!(ModelDescription::parse(&other).unwrap_err().contains("FMI 3.0"));
        let index = TEXT.replace("index=\"4\"", "index=\"5\"");
        assert!(ModelDescription::parse(&index).unwrap_err().contains("variable 5 of 4"));
        let untyped = TEXT.replace("<Real/>", "");
        assert!(ModelDescription::parse(&untyped).unwrap_err().contains("\"z\" has no type"));
        assert!(ModelDescription::parse("<fmiModelDescription").is_err());
    }
}

//! Variables of components, and the connections between them. A name that is wrong is refused with
//! the nearest right name.

use crate::description::{Array, Carrier, ModelDescription, Variable, VariableKind};
use crate::names;
use crate::quantity::Scaling;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Way in which components are stepped and values are passed on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Coupling {
    /// One after the other, each component gets its inputs, is stepped, and passes its outputs on:
    /// later components receive its responses to these inputs.
    #[default]
    Sequential,
    /// All components get their inputs, and then all are stepped: each receives the outputs of the
    /// others after their last step.
    Jacobi,
}

/// A component's name and its FMU's description. Its position in the list of parts is its index.
#[derive(Clone, Copy)]
pub struct Part<'a> {
    /// Name of the component in the experiment.
    pub name: &'a str,
    /// Model description of the component's FMU.
    pub description: &'a ModelDescription,
}

/// A variable of a component.
#[derive(Clone, Copy, Debug, Eq, Hash, PartialEq)]
pub struct Port {
    /// Index of the component.
    pub component: usize,
    /// Position of the variable in the model description.
    pub variable: usize,
    /// Value reference of the variable.
    pub reference: u32,
    /// Type in which the value of the variable is transferred.
    pub carrier: Carrier,
}

/// A connection of one output with one input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wire {
    /// Output that the connection starts from.
    pub from: Port,
    /// Input that the connection ends at.
    pub to: Port,
    /// Conversion of real values on the way.
    pub scaling: Scaling,
}

/// Returns the port of a variable at its position in the description; `None` if values of its type
/// are not transferred.
pub fn port(component: usize, position: usize, variable: &Variable) -> Option<Port> {
    let carrier = Carrier::for_kind(&variable.kind)?;
    Some(Port { component, variable: position, reference: variable.reference, carrier })
}

/// Finds one variable by its full name, if it exists.
pub fn find(path: &str, parts: &[Part]) -> Option<Port> {
    let (name, rest) = names::split(path)?;
    let component = parts.iter().position(|part| part.name == name)?;
    let (position, variable) = parts[component].description.find(rest)?;
    port(component, position, variable)
}

/// Variables as they are written: `component.variable`, or several as `component.prefix.*`.
#[derive(Clone, Copy)]
pub struct Written<'a> {
    /// The text itself.
    pub text: &'a str,
    /// Index of the component.
    pub component: usize,
    /// The component.
    pub part: Part<'a>,
    /// Name or pattern of the variable, which follows that of the component.
    pub rest: &'a str,
}

impl<'a> Written<'a> {
    /// Looks up the component.
    ///
    /// # Errors
    /// Says that the text names no variable, or that there is no such component.
    pub fn new(text: &'a str, parts: &[Part<'a>]) -> Result<Self, String> {
        let (name, rest) = names::split(text)
            .ok_or_else(|| format!("\"{text}\" names no variable: write component.variable"))?;
        let component = parts.iter().position(|part| part.name == name).ok_or_else(|| {
            let hint = names::hint(name, parts.iter().map(|part| part.name));
            format!("there is no component \"{name}\"{hint}")
        })?;
        Ok(Self { text, component, part: parts[component], rest })
    }

    /// Returns the prefix before the `*` of several variables.
    pub fn prefix(&self) -> Option<&'a str> {
        self.rest.strip_suffix('*')
    }

    fn array(&self) -> Option<&'a Array> {
        self.part.description.arrays.get(self.rest)
    }

    fn unknown(&self, causality: &'a str) -> String {
        let hint = names::hint(self.rest, self.part.description.names(causality));
        format!("\"{}\" has no {causality} \"{}\"{hint}", self.part.name, self.rest)
    }

    /// Finds the variable called `name`, which must have this causality.
    fn port(&self, name: &str, causality: &'a str) -> Result<Port, String> {
        let Part { name: component, description } = self.part;
        let (position, variable) = description.find(name).ok_or_else(|| self.unknown(causality))?;
        if variable.causality != causality {
            let hint = names::nearest(name, description.names(causality))
                .map_or(String::new(), |near| format!("; did you mean \"{near}\"?"));
            return Err(format!(
                "\"{component}.{name}\" is of causality {}, not an {causality}{hint}",
                variable.causality
            ));
        }
        port(self.component, position, variable).ok_or_else(|| {
            let what = variable.kind.untransferred().unwrap_or_default();
            format!("\"{component}.{name}\" is {what}, which cannot be connected")
        })
    }
}

/// Why two sides cannot be connected, with the side that is at fault.
#[derive(Debug)]
pub enum Fault {
    /// The outputs are at fault.
    From(String),
    /// The inputs are at fault, or the two do not match.
    To(String),
}

/// Connects outputs with inputs, and determines how values are converted by their units. An output
/// behind a prefix is connected with the input of the same name behind the other prefix, if there
/// is one. An array is connected with an array of the same shape, element by element. If `scaling`
/// is given, it takes the place of the conversion of units.
///
/// # Errors
/// Says which name does not exist or has a wrong causality, or which types or units do not match.
pub fn connect(from: &Written, to: &Written, scaling: Option<Scaling>) -> Result<Vec<Wire>, Fault> {
    let pairs = match (from.prefix(), to.prefix()) {
        (None, None) => elements(from, to)?,
        (Some(from_prefix), Some(to_prefix)) => expand(from, from_prefix, to, to_prefix)?,
        _ => {
            let (from, to) = (from.text, to.text);
            return Err(Fault::To(format!(
                "\"{from}\" and \"{to}\" must both end in * or neither"
            )));
        }
    };
    let wire = |(output, input): (String, String)| {
        let start = from.port(&output, "output").map_err(Fault::From)?;
        let end = to.port(&input, "input").map_err(Fault::To)?;
        let names = format!("\"{}.{output}\" and \"{}.{input}\"", from.part.name, to.part.name);
        let parts = (from.part.description, to.part.description);
        let scaling = conversion(parts, (start, end), &names, scaling);
        Ok(Wire { from: start, to: end, scaling: scaling.map_err(Fault::To)? })
    };
    pairs.into_iter().map(wire).collect()
}

/// Lists the pairs of names of two variables, or of the elements of two arrays.
fn elements(from: &Written, to: &Written) -> Result<Vec<(String, String)>, Fault> {
    let shape = |side: &Written, array: &Array| {
        let sizes: Vec<String> = array.shape.iter().map(usize::to_string).collect();
        format!("\"{}\" is an array of {}", side.text, sizes.join(" × "))
    };
    let (first, second) = match (from.array(), to.array()) {
        (None, None) => return Ok(vec![(from.rest.to_string(), to.rest.to_string())]),
        (Some(a), Some(b)) if a.shape == b.shape => (a, b),
        (Some(a), Some(b)) => {
            return Err(Fault::To(format!("{}, and {}", shape(from, a), shape(to, b))));
        }
        (Some(a), None) => {
            return Err(Fault::To(format!("{}, but \"{}\" is none", shape(from, a), to.text)));
        }
        (None, Some(b)) => {
            return Err(Fault::To(format!("{}, but \"{}\" is none", shape(to, b), from.text)));
        }
    };
    let names = |side: &Written, array: &Array| -> Vec<String> {
        let variables = &side.part.description.variables[array.elements.clone()];
        variables.iter().map(|variable| variable.name.clone()).collect()
    };
    Ok(names(from, first).into_iter().zip(names(to, second)).collect())
}

/// Lists the pairs of names that two patterns match: an output behind the first prefix is paired
/// with the variable of the same name behind the second prefix, if there is one.
fn expand(
    from: &Written,
    from_prefix: &str,
    to: &Written,
    to_prefix: &str,
) -> Result<Vec<(String, String)>, Fault> {
    let outputs: Vec<&str> = from
        .part
        .description
        .names("output")
        .filter_map(|name| name.strip_prefix(from_prefix))
        .collect();
    if outputs.is_empty() {
        return Err(Fault::From(from.unknown("output")));
    }
    let pairs: Vec<_> = outputs
        .iter()
        .map(|rest| (format!("{from_prefix}{rest}"), format!("{to_prefix}{rest}")))
        .filter(|(_, input)| to.part.description.find(input).is_some())
        .collect();
    if pairs.is_empty() {
        return Err(Fault::To(
            if to.part.description.names("input").any(|name| name.starts_with(to_prefix)) {
                format!("\"{}\" and \"{}\" have no name in common", from.text, to.text)
            } else {
                to.unknown("input")
            },
        ));
    }
    Ok(pairs)
}

/// Determines how values of the output are converted to values of the input, by their units.
fn conversion(
    (from, to): (&ModelDescription, &ModelDescription),
    (output, input): (Port, Port),
    names: &str,
    given: Option<Scaling>,
) -> Result<Scaling, String> {
    match (&from.variables[output.variable].kind, &to.variables[input.variable].kind) {
        (a @ VariableKind::Real { .. }, b @ VariableKind::Real { .. }) => given
            .map_or_else(|| from.conversion(a, to, b), Ok)
            .map_err(|difference| format!("the units of {names} do not match: {difference}")),
        (VariableKind::Enumeration { items: a }, VariableKind::Enumeration { items: b })
            if a != b =>
        {
            Err(format!("{names} are enumerations of different items"))
        }
        (a, b) if a.name() == b.name() => Ok(Scaling::default()),
        (a, b) => {
            Err(format!("the types of {names} do not match: {} against {}", a.name(), b.name()))
        }
    }
}

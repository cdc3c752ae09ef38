//! Faults of a model description that do not keep it from being read. FMUs run with most of them,
//! but not in every importer, and not always as intended.

use crate::description::{CAUSALITIES, VARIABILITIES};
use fmi_master::description::{Carrier, ModelDescription, Variable, VariableKind};
use std::collections::{BTreeSet, HashMap, HashSet};

/// Lists the faults of a description, one line for each, in the order of the file.
pub fn faults(description: &ModelDescription) -> Vec<String> {
    let mut faults = Vec::new();
    let identity = if description.is_fmi3() { "instantiationToken" } else { "guid" };
    for (name, text) in [("modelName", &description.model_name), (identity, &description.guid)] {
        if text.is_empty() {
            faults.push(format!("has no {name}"));
        }
    }
    if description.co_simulation.is_none()
        && description.model_exchange.is_none()
        && description.scheduled_execution.is_none()
    {
        faults.push("offers neither co-simulation nor model exchange".to_string());
    }
    let interfaces = [&description.co_simulation, &description.model_exchange];
    if interfaces.into_iter().flatten().any(|interface| interface.has("needsExecutionTool")) {
        faults.push("needs the program that exported it (needsExecutionTool), which a closed process does not reach: --isolate=false runs the FMU with your rights".to_string());
    }
    if !description.has_structure {
        faults.push("has no ModelStructure, which lists the outputs".to_string());
    }
    let units: BTreeSet<&str> = description.units.iter().map(|unit| unit.name.as_str()).collect();
    let (mut names, mut handles) = (HashSet::new(), HashMap::new());
    for variable in &description.variables {
        let name = &variable.name;
        if !names.insert(name) {
            faults.push(format!("two variables are called \"{name}\""));
        }
        // Other variables may share a reference as aliases. Of two that are both set, the later one
        // would overwrite the first.
        if matches!(&*variable.causality, "input" | "parameter") {
            let place = description.place(variable);
            let handle = place
                .map_or((variable.reference, Carrier::for_kind(&variable.kind), 0), |place| {
                    (place.reference, None, place.element)
                });
            if let Some(other) = handles.insert(handle, name) {
                faults.push(format!(
                    "\"{other}\" and \"{name}\" have the same value reference {}",
                    handle.0
                ));
            }
        }
        check_variable(variable, description.is_fmi3(), &units, &mut faults);
    }
    faults
}

fn check_variable(
    variable: &Variable,
    is_fmi3: bool,
    units: &BTreeSet<&str>,
    faults: &mut Vec<String>,
) {
    let Variable { name, causality, variability, kind, .. } = variable;
    if !CAUSALITIES.contains(&&**causality) {
        faults.push(format!(
            "the causality \"{}\" of \"{name}\" is not known",
            causality.escape_default()
        ));
    }
    if !VARIABILITIES.contains(&&**variability) {
        faults.push(format!(
            "the variability \"{}\" of \"{name}\" is not known",
            variability.escape_default()
        ));
    }
    if let VariableKind::Real { unit: Some(unit), .. } = kind
        && !units.contains(unit.as_str())
    {
        faults.push(format!("the unit \"{}\" of \"{name}\" is not defined", unit.escape_default()));
    }
    let bounds = match kind {
        VariableKind::Real { min: Some(min), max: Some(max), .. } => Some((*min, *max)),
        VariableKind::Integer { min: Some(min), max: Some(max) } => {
            Some((f64::from(*min), f64::from(*max)))
        }
        _ => None,
    };
    if let Some((min, max)) = bounds.filter(|(min, max)| min > max) {
        faults
            .push(format!("the smallest value of \"{name}\", {min}, is above its largest, {max}"));
    }
    let start = variable.start.as_deref();
    if let Some(fault) = start.and_then(|start| start_fault(start.trim(), kind, is_fmi3)) {
        let start = variable.start.as_deref().unwrap_or_default().escape_default();
        faults.push(format!("the start value \"{start}\" of \"{name}\" {fault}"));
    }
}

/// Describes the fault of a start value, if it has one. FMI 3.0 has integers of more than 32 bits.
fn start_fault(start: &str, kind: &VariableKind, is_fmi3: bool) -> Option<String> {
    let outside = |below: bool, above: bool| {
        (below || above).then(|| "is outside its min and max".to_string())
    };
    match kind {
        VariableKind::Real { min, max, .. } => match start.parse::<f64>() {
            Ok(value) if value.is_nan() => Some("is not a number".into()),
            Ok(value) => {
                outside(min.is_some_and(|min| value < min), max.is_some_and(|max| value > max))
            }
            Err(_) => Some("is not a number".into()),
        },
        VariableKind::Integer { min, max } => match start.parse::<i128>() {
            Ok(value) if is_fmi3 || i32::try_from(value).is_ok() => outside(
                min.is_some_and(|min| value < min.into()),
                max.is_some_and(|max| value > max.into()),
            ),
            _ if is_fmi3 => Some("is not a whole number".into()),
            _ => Some("is not a whole number of 32 bits".into()),
        },
        VariableKind::Boolean => (!matches!(start, "true" | "false" | "1" | "0"))
            .then(|| "is neither true nor false".into()),
        VariableKind::Enumeration { items } => {
            let is_item =
                start.parse::<i32>().is_ok_and(|value| items.iter().any(|item| item.1 == value));
            (!is_item).then(|| "is no item of its type".into())
        }
        VariableKind::String | VariableKind::Binary | VariableKind::Clock { .. } => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r"<fmiModelDescription fmiVersion='2.0' modelName='a' guid='1'>
  <CoSimulation modelIdentifier='a'/>
  <UnitDefinitions><Unit name='m'/></UnitDefinitions>
  <TypeDefinitions><SimpleType name='K'><Enumeration><Item name='one' value='1'/></Enumeration></SimpleType></TypeDefinitions>
  <ModelVariables>
    <ScalarVariable name='x' valueReference='0' causality='input'><Real unit='m' min='0' max='2' start='1'/></ScalarVariable>
    <ScalarVariable name='n' valueReference='0' causality='parameter' variability='fixed'><Integer start='1' min='0'/></ScalarVariable>
    <ScalarVariable name='b' valueReference='0' causality='parameter' variability='fixed'><Boolean start='true'/></ScalarVariable>
    <ScalarVariable name='k' valueReference='1' causality='parameter' variability='fixed'><Enumeration declaredType='K' start='1'/></ScalarVariable>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>";

    #[test]
    fn each_fault_is_named_by_its_variable() {
        let faults_of = |text: &str| faults(&crate::description::parse(text).unwrap());
        assert_eq!(faults_of(GOOD), Vec::<String>::new());
        for (from, to, fault) in [
            (
                "max='2' start='1'",
                "max='2' start='one'",
                "the start value one of x is not a number",
            ),
            (
                "start='1'/></S",
                "start='3'/></S",
                "the start value 3 of x is outside its min and max",
            ),
            (
                "min='0' max='2' start='1'",
                "min='3' max='2'",
                "the smallest value of x, 3, is above its largest, 2",
            ),
            ("r start='1'", "r start='1.5'", "the start value 1.5 of n is not a whole number"),
            ("='true'", "='yes'", "the start value yes of b is neither true nor false"),
            ("='K' start='1'", "='K' start='2'", "the start value 2 of k is no item"),
            ("Reference='1'", "Reference='0'", "n and k have the same value reference 0"),
            ("unit='m' min", "unit='ell' min", "the unit ell of x is not defined"),
            ("'input'", "'inptu'", "the causality inptu of x is not known"),
            ("<ModelStructure/>", "", "has no ModelStructure"),
            ("'a'/>", "'a' needsExecutionTool='true'/>", "needs the program that exported it"),
        ] {
            let text = GOOD.replacen(from, to, 1);
            assert_ne!(text, GOOD, "{from}");
            let listed: Vec<String> =
                faults_of(&text).iter().map(|fault| fault.replace('"', "")).collect();
            assert!(listed.len() == 1 && listed[0].starts_with(fault), "{fault}: {listed:?}");
        }
    }
}

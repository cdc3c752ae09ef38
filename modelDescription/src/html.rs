//! The page `documentation/index.html` of an FMU, made from its description.

use crate::variable::{Causality, EnumerationType, Variable, VariableKind};
use crate::{AUTHOR, LICENSE, ModelDescription, Version};
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("page.css");

impl ModelDescription {
    /// Returns the page `documentation/index.html`: the FMU's text, then tables of its
    /// variables. The page needs no network.
    pub fn to_html(&self, version: Version) -> String {
        let interface = match (self.co_simulation, self.model_exchange) {
            (true, true) => "co-simulation and model exchange",
            (true, false) => "co-simulation",
            (false, _) => "model exchange",
        };
        let (standard, identity) = match version {
            Version::Fmi2 => ("FMI 2.0", "GUID"),
            Version::Fmi3 => ("FMI 3.0", "Instantiation token"),
        };
        let experiment = self.default_experiment;
        let [start, stop, step] = [experiment.start, experiment.stop, experiment.step].map(number);
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width,initial-scale=1";
                    title { (self.name) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    h1 { (self.name) }
                    p.lead { (self.description) }
                    dl {
                        dt { "Interface" } dd { (standard) ", " (interface) }
                        dt { "Version" } dd { (self.version) }
                        dt { (identity) } dd { code { (self.guid()) } }
                        dt { "Default experiment" }
                        dd { (start) " s to " (stop) " s, communication step " (step) " s" }
                    }
                    (PreEscaped(&self.documentation))
                    (self.table("Parameters", Causality::Parameter))
                    (self.table("Inputs", Causality::Input))
                    (self.table("Outputs", Causality::Output))
                    (self.table("Local variables", Causality::Local))
                    @for enumeration in self.enumerations() {
                        h2 { (enumeration.name) }
                        p { (enumeration.description) }
                        dl {
                            @for ((item, description), value) in enumeration.items.iter().zip(1..) {
                                dt { (value) " " code { (item) } } dd { (description) }
                            }
                        }
                    }
                    p.quiet { (AUTHOR) ". Licence: " (LICENSE) "." }
                }
            }
        };
        page.into_string()
    }

    fn table(&self, title: &str, causality: Causality) -> Markup {
        let rows = || self.variables.iter().filter(|variable| variable.causality == causality);
        let started = rows().any(|variable| !variable.is_calculated());
        html! {
            @if rows().next().is_some() {
                h2 { (title) }
                div.wide tabindex="0" role="region" aria-label=(title) { table {
                    tr {
                        th { "Name" } th { "Unit" } @if started { th { "Start" } }
                        th { "Limits" } th { "Description" }
                    }
                    @for variable in rows() {
                        tr {
                            td { code { (variable.name) } }
                            td { (unit(variable)) }
                            @if started { td { (start_value(variable)) } }
                            td { (limits(variable)) }
                            td { (variable.description) }
                        }
                    }
                } }
            }
        }
    }

    /// Returns the enumerations of the variables, each once.
    pub(crate) fn enumerations(&self) -> Vec<&EnumerationType> {
        let mut seen: Vec<&EnumerationType> = Vec::new();
        for variable in &self.variables {
            if let VariableKind::Enumeration { enumeration_type, .. } = &variable.kind
                && !seen.iter().any(|other| other.name == enumeration_type.name)
            {
                seen.push(enumeration_type);
            }
        }
        seen
    }
}

/// Formats a number with ten significant digits and no trailing zeros: π/180 shown in degrees reads
/// 1, not 1.0000000000000002.
fn number(x: f64) -> String {
    let rounded: f64 = format!("{x:.9e}").parse().expect("a number");
    let text = rounded.to_string();
    if text.len() > 14 { format!("{rounded:e}") } else { text }
}

fn unit(variable: &Variable) -> String {
    match &variable.kind {
        VariableKind::Real { unit: Some(unit), .. } => match &unit.display {
            Some(display) => format!("{} (shown in {})", unit.name, display.name),
            None => unit.name.clone(),
        },
        VariableKind::Real { unit: None, .. } => "–".into(),
        VariableKind::Integer { .. } => "Integer".into(),
        VariableKind::Boolean { .. } => "Boolean".into(),
        VariableKind::Enumeration { enumeration_type, .. } => enumeration_type.name.clone(),
        VariableKind::String { .. } => "String".into(),
    }
}

fn start_value(variable: &Variable) -> String {
    match &variable.kind {
        VariableKind::Real { start: Some(start), unit, .. } => {
            let display = unit.as_ref().and_then(|unit| unit.display.as_ref());
            let shown = display.filter(|_| *start != 0.0);
            let shown = shown
                .map(|display| format!(" = {} {}", number(start * display.factor), display.name));
            number(*start) + &shown.unwrap_or_default()
        }
        VariableKind::Integer { start: Some(start), .. } => start.to_string(),
        VariableKind::Boolean { start: Some(start) } => start.to_string(),
        VariableKind::Enumeration { enumeration_type, start: Some(start) } => {
            let item = usize::try_from(start - 1).ok().and_then(|i| enumeration_type.items.get(i));
            item.map_or_else(|| start.to_string(), |(name, _)| name.clone())
        }
        VariableKind::String { start: Some(start) } => format!("\"{start}\""),
        _ => String::new(),
    }
}

fn limits(variable: &Variable) -> String {
    let (min, max) = match &variable.kind {
        VariableKind::Real { min, max, .. } => (min.map(number), max.map(number)),
        VariableKind::Integer { min, max, .. } => {
            (min.map(|x| x.to_string()), max.map(|x| x.to_string()))
        }
        _ => (None, None),
    };
    match (min, max) {
        (Some(min), Some(max)) => format!("{min} to {max}"),
        (Some(min), None) => format!("≥ {min}"),
        (None, Some(max)) => format!("≤ {max}"),
        (None, None) => String::new(),
    }
}

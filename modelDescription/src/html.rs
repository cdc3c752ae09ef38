//! The page `documentation/index.html` of an FMU, made from its description.

use crate::variable::{Causality, Variable, VariableKind};
use crate::{AUTHOR, LICENSE, ModelDescription, Version};
use quick_xml::escape::escape;
use std::fmt::Write;

const STYLE: &str = include_str!("page.css");

impl ModelDescription {
    /// Returns the page `documentation/index.html`: the FMU's text, then tables of its
    /// variables. The page needs no network.
    ///
    /// # Panics
    /// This never panics, because writing to a string does not fail.
    pub fn to_html(&self, version: Version) -> String {
        let mut page = String::new();
        self.write_html(&mut page, version).expect("writing to a string");
        page
    }

    fn write_html(&self, page: &mut String, version: Version) -> std::fmt::Result {
        let name = escape(&self.name);
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
        write!(
            page,
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
             <title>{name}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
             <h1>{name}</h1>\n<p class=\"lead\">{}</p>\n\
             <dl>\n<dt>Interface</dt><dd>{standard}, {interface}</dd>\n<dt>Version</dt><dd>{}</dd>\n\
             <dt>{identity}</dt><dd><code>{}</code></dd>\n\
             <dt>Default experiment</dt><dd>{} s to {} s, communication step {} s</dd>\n</dl>\n\
             {}\n",
            escape(&self.description),
            escape(&self.version),
            self.guid(),
            number(experiment.start),
            number(experiment.stop),
            number(experiment.step),
            self.documentation,
        )?;
        self.write_table(page, "Parameters", Causality::Parameter)?;
        self.write_table(page, "Inputs", Causality::Input)?;
        self.write_table(page, "Outputs", Causality::Output)?;
        self.write_table(page, "Local variables", Causality::Local)?;
        self.write_enumeration_lists(page)?;
        let (author, license) = (escape(AUTHOR), escape(LICENSE));
        write!(page, "<p class=\"quiet\">{author}. Licence: {license}.</p>\n</body>\n</html>\n")
    }

    fn write_table(
        &self,
        page: &mut String,
        title: &str,
        causality: Causality,
    ) -> std::fmt::Result {
        let rows: Vec<_> =
            self.variables.iter().filter(|variable| variable.causality == causality).collect();
        if rows.is_empty() {
            return Ok(());
        }
        let started = rows.iter().any(|variable| !variable.is_calculated());
        let start = if started { "<th>Start</th>" } else { "" };
        write!(
            page,
            "<h2>{title}</h2>\n<div class=\"wide\" tabindex=\"0\" role=\"region\" aria-label=\"{title}\"><table>\n\
             <tr><th>Name</th><th>Unit</th>{start}<th>Limits</th><th>Description</th></tr>\n"
        )?;
        for variable in rows {
            let start = if started {
                format!("<td>{}</td>", escape(start_value(variable)))
            } else {
                String::new()
            };
            writeln!(
                page,
                "<tr><td><code>{}</code></td><td>{}</td>{start}<td>{}</td><td>{}</td></tr>",
                escape(&variable.name),
                escape(unit(variable)),
                escape(limits(variable)),
                escape(&variable.description),
            )?;
        }
        page.push_str("</table></div>\n");
        Ok(())
    }

    fn write_enumeration_lists(&self, page: &mut String) -> std::fmt::Result {
        let mut seen = vec![];
        for variable in &self.variables {
            let VariableKind::Enumeration { enumeration_type, .. } = &variable.kind else {
                continue;
            };
            if seen.contains(&&enumeration_type.name) {
                continue;
            }
            seen.push(&enumeration_type.name);
            write!(
                page,
                "<h2>{}</h2>\n<p>{}</p>\n<dl>\n",
                escape(&enumeration_type.name),
                escape(&enumeration_type.description)
            )?;
            for ((item, description), value) in enumeration_type.items.iter().zip(1..) {
                let (item, description) = (escape(item), escape(description));
                writeln!(page, "<dt>{value} <code>{item}</code></dt><dd>{description}</dd>")?;
            }
            page.push_str("</dl>\n");
        }
        Ok(())
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

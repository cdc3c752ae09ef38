//! Looks up the parameters that vary.

use crate::distribution::Distribution;
use crate::vary::Vary;
use cosim::document::Source;
use cosim::error::Error;
use cosim::metadata::is_seed;
use cosim::system::System;
use cosim::variation::Target;
use fmi_master::description::VariableKind as Type;
use std::ops::Range;
use toml::Spanned;

/// A parameter that varies, or several that always have the same value.
#[derive(Clone, Debug)]
pub struct Varied {
    /// Name of the first parameter, `component.parameter`, which is that of the column.
    pub name: String,
    /// Unit of the values, or an empty text.
    pub unit: String,
    /// Type of the values.
    pub kind: Type,
    /// Distribution of the values.
    pub distribution: Distribution,
    /// Number of entries, from this one on, whose values are put into ascending order; 0 except in
    /// the first of them.
    pub(crate) sorted: usize,
    pub(crate) targets: Vec<Target>,
    pub(crate) paths: Vec<String>,
    /// Place of the name in the campaign's file.
    pub span: Range<usize>,
}

impl Varied {
    /// Returns whether the values are seeds, which have no order and no effect of their own.
    pub fn is_seed(&self) -> bool {
        self.distribution.seeds().is_some() || is_seed(&self.name)
    }
}

/// Makes the distributions of one `[[vary]]` of a sweep with this seed.
pub(crate) fn distributions(
    vary: &Vary,
    source: &Source,
    system: &System,
    seed: u64,
) -> Result<Vec<Varied>, Error> {
    let mut groups: Vec<(Range<usize>, Vec<String>)> = Vec::new();
    if let Some(parameter) = &vary.parameter {
        groups.push((parameter.span(), parameter.get_ref().names().to_vec()));
    }
    groups.extend(vary.each.iter().map(|name| (name.span(), vec![name.get_ref().clone()])));
    let both = vary.parameter.is_some() && !vary.each.is_empty();
    if groups.is_empty() || both || groups.iter().any(|(_, names)| names.is_empty()) {
        let span = groups.first().map_or(0..0, |(span, _)| span.clone());
        return Err(source.error(&span, "[[vary]] needs either parameter or each"));
    }
    let mut varied = Vec::new();
    for (span, paths) in groups {
        let name = paths[0].clone();
        let fault =
            |problem: String| source.error(&span, format!("[[vary]] \"{name}\": {problem}"));
        let targets = paths.iter().map(|path| {
            system
                .target(path)
                .map_err(|problem| source.error(&span, format!("[[vary]] \"{path}\": {problem}")))
        });
        let targets = targets.collect::<Result<Vec<_>, _>>()?;
        let variable = system.variable(targets[0]);
        for other in &targets[1..] {
            if system.variable(*other).kind.name() != variable.kind.name() {
                return Err(fault("parameters that share a value must be of the same type".into()));
            }
        }
        let distribution = Distribution::new(vary, targets[0], system, seed).map_err(&fault)?;
        let unit = match &variable.kind {
            Type::Real { unit, .. } => unit.clone().unwrap_or_default(),
            _ => String::new(),
        };
        varied.push(Varied {
            name: name.clone(),
            unit,
            kind: variable.kind.clone(),
            distribution,
            sorted: 0,
            targets,
            paths,
            span,
        });
    }
    if vary.sorted {
        let is_real = varied.iter().all(|entry| matches!(entry.kind, Type::Real { .. }));
        let Some(first) = varied.first_mut().filter(|_| is_real && vary.each.len() > 1) else {
            let span = vary.each.first().map_or(0..0, Spanned::span);
            return Err(
                source.error(&span, "[[vary]] sorted is for several real parameters in each")
            );
        };
        first.sorted = vary.each.len();
    }
    Ok(varied)
}

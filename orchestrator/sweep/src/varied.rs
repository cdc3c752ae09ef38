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

    /// Returns the error that refuses this entry of the file `source`.
    pub fn refusal(&self, problem: &str, source: &Source) -> Error {
        refusal(&self.name, &self.span, problem, source)
    }
}

fn refusal(name: &str, span: &Range<usize>, problem: &str, source: &Source) -> Error {
    source.error(span, format!("[[vary]] \"{name}\": {problem}"))
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
        let mut targets = Vec::new();
        for path in &paths {
            let target = system.target(path);
            targets.push(target.map_err(|problem| refusal(path, &span, &problem, source))?);
        }
        let kind = &system.variable(targets[0]).kind;
        let is_other = |target: &Target| system.variable(*target).kind.name() != kind.name();
        let distribution = if targets.iter().any(is_other) {
            Err("parameters that share a value must be of the same type".into())
        } else {
            Distribution::new(vary, targets[0], system, seed)
        };
        varied.push(Varied {
            distribution: distribution
                .map_err(|problem| refusal(&paths[0], &span, &problem, source))?,
            name: paths[0].clone(),
            unit: match kind {
                Type::Real { unit, .. } => unit.clone().unwrap_or_default(),
                _ => String::new(),
            },
            kind: kind.clone(),
            sorted: 0,
            targets,
            paths,
            span,
        });
    }
    if vary.sorted {
        let is_real = varied.iter().all(|entry| matches!(entry.kind, Type::Real { .. }));
        if !is_real || vary.each.len() < 2 {
            let span = vary.each.first().map_or(0..0, Spanned::span);
            let problem = "[[vary]] sorted is for several real parameters in each";
            return Err(source.error(&span, problem));
        }
        varied[0].sorted = varied.len();
    }
    Ok(varied)
}

//! Text of `terminalsAndIcons.xml`, FMI 3.0 section 2.4.9: which variables belong together, so that
//! importers connect them with one line.

use super::{Attributes, document, leaf, parent};
use crate::ModelDescription;
use crate::variable::{Causality, VariableKind};

/// Position of the icon, which fills the default coordinate system.
const EXTENT: [(&str, &str); 4] = [("x1", "-100"), ("y1", "-100"), ("x2", "100"), ("y2", "100")];

impl ModelDescription {
    /// Returns the names of the terminals, each with the names of its members: Real inputs, or Real
    /// outputs, whose names differ behind the last dot only. Terminals of two FMUs match if they
    /// have the same name.
    fn terminals(&self) -> Vec<(&str, Vec<&str>)> {
        let mut terminals: Vec<(&str, Causality, Vec<&str>)> = vec![];
        for variable in &self.variables {
            let is_real = matches!(variable.kind, VariableKind::Real { .. });
            let causality = variable.causality;
            let Some((name, member)) = variable.name.rsplit_once('.') else { continue };
            if !is_real || !matches!(causality, Causality::Input | Causality::Output) {
                continue;
            }
            match terminals.iter_mut().find(|(other, kind, _)| (*other, *kind) == (name, causality))
            {
                Some((_, _, members)) => members.push(member),
                None => terminals.push((name, causality, vec![member])),
            }
        }
        let is_unique = |name| terminals.iter().filter(|(other, _, _)| *other == name).count() == 1;
        let grouped =
            terminals.iter().filter(|(name, _, members)| members.len() > 1 && is_unique(*name));
        grouped.map(|(name, _, members)| (*name, members.clone())).collect()
    }

    /// Returns the text of `terminalsAndIcons/terminalsAndIcons.xml`.
    ///
    /// # Panics
    /// This never panics, because writing to memory does not fail and everything written is text.
    pub fn terminals_to_xml(&self) -> String {
        let owned = |attributes: &[(&'static str, &str)]| -> Attributes {
            attributes.iter().map(|(name, value)| (*name, (*value).into())).collect()
        };
        let terminals = self.terminals();
        document(|xml| {
            parent(xml, "fmiTerminalsAndIcons", owned(&[("fmiVersion", "3.0")]), |xml| {
                parent(xml, "GraphicalRepresentation", vec![], |xml| {
                    leaf(xml, "Icon", owned(&EXTENT))
                })?;
                if terminals.is_empty() {
                    return Ok(());
                }
                parent(xml, "Terminals", vec![], |xml| {
                    terminals.iter().try_for_each(|(name, members)| {
                        let terminal = owned(&[("name", *name), ("matchingRule", "plug")]);
                        parent(xml, "Terminal", terminal, |xml| {
                            members.iter().try_for_each(|member| {
                                let attributes = vec![
                                    ("variableName", format!("{name}.{member}")),
                                    ("memberName", (*member).into()),
                                    ("variableKind", "signal".into()),
                                ];
                                leaf(xml, "TerminalMemberVariable", attributes)
                            })
                        })
                    })
                })
            })
        })
    }
}

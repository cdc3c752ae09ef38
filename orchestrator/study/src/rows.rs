//! Lists of rows, with which a study describes a repeated table only once, and runs that extend
//! other runs.
//!
//! ```toml
//! lists.angles = [{ angle = "alpha", symbol = "α" }, { angle = "beta", symbol = "β" }]
//!
//! [[figure]]
//! panel = [{ for = "angles", label = "{symbol}, deg", signal = "plant.attitude.{angle}" }]
//! ```
//!
//! A table in a list may have the key `for`: the name of a list of rows, or such a list, or several
//! names. It is expanded to one table for each row, and with several lists for each combination, in
//! which the last list changes fastest. The names in braces are replaced by the row's values; a
//! text that is only such a name becomes the value itself, be it a number or a list. The values of
//! a row apply in everything inside the table, and in the rows that are named there.

use cosim::document::overlay;
use fmi_master::names;
use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

/// The place of a fault, and a message that describes it.
pub(crate) type Fault = (Range<usize>, String);

/// Replaces each table with a list of rows by one table for each row.
///
/// # Errors
/// Returns an error that names the list or the value that does not exist.
pub(crate) fn expand(study: &mut DeTable) -> Result<(), Fault> {
    let lists = match study.remove("lists").map(|lists| (lists.span(), lists.into_inner())) {
        None => DeTable::new(),
        Some((_, DeValue::Table(lists))) => lists,
        Some((span, _)) => return Err((span, "lists must be a table".into())),
    };
    study.iter_mut().try_for_each(|(_, value)| inside(value, &lists, &DeTable::new()))
}

/// Adds to each run that extends another one the keys that it lacks, table by table.
///
/// # Errors
/// Returns an error if no run before it has the id that it names.
pub(crate) fn inherit(study: &mut DeTable) -> Result<(), Fault> {
    let Some(DeValue::Array(runs)) = study.get_mut("run").map(Spanned::get_mut) else {
        return Ok(());
    };
    for place in 0..runs.len() {
        let (before, rest) = runs.split_at_mut(place);
        let DeValue::Table(run) = rest[0].get_mut() else { continue };
        let Some(extended) = run.remove("extends") else { continue };
        let extended = (extended.get_ref().as_str().unwrap_or_default(), extended.span());
        let before: Vec<(&str, &DeTable)> = before
            .iter()
            .filter_map(|run| run.get_ref().as_table())
            .filter_map(|run| Some((run.get("id")?.get_ref().as_str()?, run)))
            .collect();
        let Some((_, other)) = before.iter().find(|(id, _)| *id == extended.0) else {
            let hint = names::hint(extended.0, before.iter().map(|(id, _)| *id));
            let message =
                format!("extends: no run before this one has the id \"{}\"{hint}", extended.0);
            return Err((extended.1, message));
        };
        overlay(run, other);
    }
    Ok(())
}

/// Expands the lists inside a value, in which the values of the row `outer` apply.
fn inside<'i>(
    value: &mut Spanned<DeValue<'i>>,
    lists: &DeTable<'i>,
    outer: &DeTable<'i>,
) -> Result<(), Fault> {
    let span = value.span();
    match value.get_mut() {
        DeValue::Table(table) => {
            table.iter_mut().try_for_each(|(_, value)| inside(value, lists, outer))
        }
        DeValue::Array(items) => {
            let mut expanded = DeArray::new();
            for mut item in items.iter().cloned() {
                let each = match item.get_mut() {
                    DeValue::Table(table) => table.remove("for"),
                    _ => None,
                };
                let Some(each) = each else {
                    inside(&mut item, lists, outer)?;
                    expanded.push(item);
                    continue;
                };
                for row in rows(&each, lists, outer)? {
                    let mut copy = item.clone();
                    fill(&mut copy, &row);
                    inside(&mut copy, lists, &row)?;
                    expanded.push(copy);
                }
            }
            *items = expanded;
            Ok(())
        }
        DeValue::String(text) => match variables(text).next() {
            Some((name, _)) => {
                Err((span, format!("\"{text}\": no row here has a value {{{name}}}")))
            }
            None => Ok(()),
        },
        _ => Ok(()),
    }
}

/// Returns the rows of a list, or the combinations of several, each with the values of `outer`.
fn rows<'i>(
    each: &Spanned<DeValue<'i>>,
    lists: &DeTable<'i>,
    outer: &DeTable<'i>,
) -> Result<Vec<DeTable<'i>>, Fault> {
    let several = match each.get_ref() {
        DeValue::Array(items) if items.iter().all(|item| item.get_ref().is_str()) => &items[..],
        _ => std::slice::from_ref(each),
    };
    let mut combined = vec![outer.clone()];
    for list in several {
        let list = match list.get_ref() {
            DeValue::String(name) => lists.get(name.as_ref()).ok_or_else(|| {
                let known: Vec<&str> = lists.keys().map(|key| key.get_ref().as_ref()).collect();
                let hint = names::hint(name, known.iter().copied());
                (list.span(), format!("there is no list \"{name}\"{hint}"))
            })?,
            _ => list,
        };
        let fault = |span| (span, "for needs a list of tables, or names of such lists".to_string());
        let DeValue::Array(rows) = list.get_ref() else { return Err(fault(list.span())) };
        let mut longer = Vec::new();
        for before in &combined {
            for row in rows {
                let mut row = row.clone();
                fill(&mut row, before);
                let DeValue::Table(row) = row.get_mut() else { return Err(fault(row.span())) };
                overlay(row, before);
                longer.push(std::mem::take(row));
            }
        }
        combined = longer;
    }
    Ok(combined)
}

/// Returns the names in braces in a text, each with its place.
fn variables(text: &str) -> impl Iterator<Item = (&str, Range<usize>)> {
    text.match_indices('{').filter_map(|(start, _)| {
        let (name, _) = text[start + 1..].split_once('}')?;
        let is_name =
            !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        is_name.then_some((name, start..start + name.len() + 2))
    })
}

/// Replaces the names in braces by the row's values.
fn fill<'i>(value: &mut Spanned<DeValue<'i>>, row: &DeTable<'i>) {
    match value.get_mut() {
        DeValue::String(text) => {
            let whole = variables(text).find(|(_, place)| *place == (0..text.len()));
            if let Some(other) = whole.and_then(|(name, _)| row.get(name)) {
                *value.get_mut() = other.get_ref().clone();
                return;
            }
            let mut filled = String::with_capacity(text.len());
            let mut done = 0;
            for (name, place) in variables(text) {
                let other = match row.get(name).map(Spanned::get_ref) {
                    Some(DeValue::String(other)) => other.as_ref(),
                    Some(DeValue::Integer(other)) => other.as_str(),
                    Some(DeValue::Float(other)) => other.as_str(),
                    _ => continue,
                };
                filled.push_str(&text[done..place.start]);
                filled.push_str(other);
                done = place.end;
            }
            *text = Cow::Owned(filled + &text[done..]);
        }
        DeValue::Array(items) => items.iter_mut().for_each(|item| fill(item, row)),
        DeValue::Table(table) => table.iter_mut().for_each(|(_, value)| fill(value, row)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;
    use toml::Table;
    use toml::de::Deserializer;

    fn expanded(text: &str) -> Result<Table, Fault> {
        let mut table = DeTable::parse(text).unwrap();
        expand(table.get_mut())?;
        Ok(Table::deserialize(Deserializer::from(table)).unwrap())
    }

    #[test]
    fn an_item_stands_for_each_row_in_order() {
        let text = r#"
lists.axes = [{ a = "alpha", n = 1, set = { "x.y" = 7 } }, { a = "beta", n = 2.5, set = {} }]
lists.laws = [{ law = "LQR of {a}" }, { law = "FBL of {a}" }]
[figure]
panel = [{ for = "axes", label = "angle {a}", at = "{n}", set = "{set}" }, { label = "last" }]
run = [{ for = ["axes", "laws"], label = "{n}: {law}", list = [{ for = [{ m = 3 }], of = "{m}{a}" }] }]
"#;
        let expected = r#"
[figure]
panel = [
    { label = "angle alpha", at = 1, set = { "x.y" = 7 } },
    { label = "angle beta", at = 2.5, set = {} },
    { label = "last" },
]
run = [
    { label = "1: LQR of alpha", list = [{ of = "3alpha" }] },
    { label = "1: FBL of alpha", list = [{ of = "3alpha" }] },
    { label = "2.5: LQR of beta", list = [{ of = "3beta" }] },
    { label = "2.5: FBL of beta", list = [{ of = "3beta" }] },
]
"#;
        assert_eq!(expanded(text).unwrap(), expected.parse().unwrap());
    }

    #[test]
    fn what_is_not_there_is_refused_by_name() {
        let refusal = |text: &str| expanded(text).unwrap_err().1;
        let message = refusal("a = [{ for = \"axs\" }]\n[lists]\naxes = []");
        assert!(message.contains("did you mean \"axes\""), "{message}");
        assert!(refusal("a = [{ for = [{ x = \"1\" }], b = \"{y}\" }]").contains("{y}"));
        assert!(refusal("a = [{ for = [1] }]").contains("list of tables"));
        assert!(refusal("a = [{ for = 1 }]").contains("list of tables"));
    }
}

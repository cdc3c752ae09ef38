//! Templates and lists, with which a study describes a repeated table only once.
//!
//! ```toml
//! [lists]
//! axes = [{ axis = "alpha", symbol = "α" }, { axis = "beta", symbol = "β" }]
//!
//! [templates.error]
//! label = "error of {symbol}, deg"
//! signal = "plant.attitude.{axis} - controller.reference.{axis}"
//!
//! [[figure]]
//! panel = [{ use = "error", each = "axes", x_range = [0.0, 5.0] }]    # two panels
//! ```
//!
//! A table in a list may have the keys `use`, which names one template or several, and `each`,
//! which is a list of rows or the name of one. It then stands for several tables: one for each
//! template and each row, with all templates of the first row first. Each of these is the template,
//! in which the keys of the table itself take precedence. The names in braces are replaced by the
//! row's values; a text that is only such a name becomes the value itself, be it a number or a
//! list. A template may use other templates, and the values of a row apply in everything that is
//! used and listed inside.

use cosim::document::{overlay, texts};
use fmu_import::names;
use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

/// The place of a fault, and a message that describes it.
pub(crate) type Fault = (Range<usize>, String);

/// Largest depth to which templates may use each other. A greater depth must be a circle.
const DEPTH: usize = 32;

/// Replaces each table that uses a template, or that stands for the rows of a list, by the tables
/// that it stands for.
///
/// # Errors
/// Returns an error that names the template, the list or the value that does not exist.
pub(crate) fn expand(study: &mut DeTable) -> Result<(), Fault> {
    let mut shared =
        |key: &str| match study.remove(key).map(|value| (value.span(), value.into_inner())) {
            None => Ok(DeTable::new()),
            Some((_, DeValue::Table(table))) => Ok(table),
            Some((span, _)) => Err((span, format!("{key} must be a table"))),
        };
    let shared = Shared { templates: shared("templates")?, lists: shared("lists")? };
    for (_, value) in study {
        shared.inside(value, &DeTable::new(), 0)?;
        let left_over = |text: &str| match variables(text).next() {
            None => Ok(None),
            Some((name, _)) => Err(format!("\"{text}\": no row here has a value {{{name}}}")),
        };
        rewrite(value, &left_over)?;
    }
    Ok(())
}

/// Replaces each text for which `change` returns another one.
///
/// # Errors
/// Returns the error of `change`, with the place of the text.
pub(crate) fn rewrite(
    value: &mut Spanned<DeValue>,
    change: &impl Fn(&str) -> Result<Option<String>, String>,
) -> Result<(), Fault> {
    let span = value.span();
    match value.get_mut() {
        DeValue::String(text) => {
            if let Some(other) = change(text).map_err(|message| (span, message))? {
                *text = Cow::Owned(other);
            }
            Ok(())
        }
        DeValue::Array(items) => items.iter_mut().try_for_each(|item| rewrite(item, change)),
        DeValue::Table(table) => table.iter_mut().try_for_each(|(_, value)| rewrite(value, change)),
        _ => Ok(()),
    }
}

struct Shared<'i> {
    templates: DeTable<'i>,
    lists: DeTable<'i>,
}

impl<'i> Shared<'i> {
    /// Expands the lists inside a value. The values of `row` apply there.
    fn inside(
        &self,
        value: &mut Spanned<DeValue<'i>>,
        row: &DeTable<'i>,
        depth: usize,
    ) -> Result<(), Fault> {
        match value.get_mut() {
            DeValue::Table(table) => {
                table.iter_mut().try_for_each(|(_, value)| self.inside(value, row, depth))
            }
            DeValue::Array(items) => {
                let mut expanded = DeArray::new();
                for item in items.iter() {
                    self.item(item.clone(), row, depth, &mut expanded)?;
                }
                *items = expanded;
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Adds the tables that an item of a list stands for to `expanded`.
    fn item(
        &self,
        mut item: Spanned<DeValue<'i>>,
        outer: &DeTable<'i>,
        depth: usize,
        expanded: &mut DeArray<'i>,
    ) -> Result<(), Fault> {
        let span = item.span();
        let (mut uses, mut each) = (None, None);
        if let DeValue::Table(table) = item.get_mut() {
            uses = table.remove("use");
            // In a `vary`, each is a list of names.
            let is_names = |each: &Spanned<DeValue>| match each.get_ref() {
                DeValue::Array(items) => {
                    !items.is_empty() && items.iter().all(|item| item.get_ref().is_str())
                }
                _ => false,
            };
            if table.get("each").is_some_and(|each| !is_names(each)) {
                each = table.remove("each");
            }
        }
        if uses.is_none() && each.is_none() {
            self.inside(&mut item, outer, depth)?;
            expanded.push(item);
            return Ok(());
        }
        if depth > DEPTH {
            return Err((span, "templates use each other in a circle".into()));
        }
        for mut row in self.rows(each.as_ref())? {
            overlay(&mut row, outer);
            let mut copy = item.clone();
            substitute(&mut copy, &row);
            let Some(mut uses) = uses.clone() else {
                self.item(copy, &row, depth + 1, expanded)?;
                continue;
            };
            substitute(&mut uses, &row);
            for (name, place) in
                texts(&uses).map_err(|place| (place, "use needs names of templates".into()))?
            {
                let mut template = find(&self.templates, "template", name, place)?.clone();
                substitute(&mut template, &row);
                let mut copy = copy.clone();
                if let (DeValue::Table(copy), DeValue::Table(template)) =
                    (copy.get_mut(), template.get_ref())
                {
                    overlay(copy, template);
                }
                self.item(copy, &row, depth + 1, expanded)?;
            }
        }
        Ok(())
    }

    /// Returns the rows of a list that is named or written out. Without a list there is a single
    /// row without values.
    fn rows(&self, each: Option<&Spanned<DeValue<'i>>>) -> Result<Vec<DeTable<'i>>, Fault> {
        let Some(each) = each else { return Ok(vec![DeTable::new()]) };
        let list = match each.get_ref() {
            DeValue::String(name) => find(&self.lists, "list", name, each.span())?,
            _ => each,
        };
        let row = |row: &Spanned<DeValue<'i>>| match row.get_ref() {
            DeValue::Table(row) => Ok(row.clone()),
            _ => Err((row.span(), "each needs a list of tables".to_string())),
        };
        match list.get_ref() {
            DeValue::Array(rows) => rows.iter().map(row).collect(),
            _ => Err((list.span(), "each needs a list of tables, or the name of one".into())),
        }
    }
}

fn find<'a, 'i>(
    table: &'a DeTable<'i>,
    what: &str,
    name: &str,
    place: Range<usize>,
) -> Result<&'a Spanned<DeValue<'i>>, Fault> {
    table.get(name).ok_or_else(|| {
        let names: Vec<&str> = table.keys().map(|key| key.get_ref().as_ref()).collect();
        (
            place,
            format!("there is no {what} \"{name}\"{}", names::hint(name, names.iter().copied())),
        )
    })
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
fn substitute<'i>(value: &mut Spanned<DeValue<'i>>, row: &DeTable<'i>) {
    match value.get_mut() {
        DeValue::String(text) => {
            let whole = variables(text)
                .find(|(_, place)| *place == (0..text.len()))
                .and_then(|(name, _)| row.get(name));
            if let Some(other) = whole {
                *value.get_mut() = other.get_ref().clone();
            } else {
                *text = Cow::Owned(filled(text, row));
            }
        }
        DeValue::Array(items) => items.iter_mut().for_each(|item| substitute(item, row)),
        DeValue::Table(table) => {
            for (key, mut value) in std::mem::take(table) {
                substitute(&mut value, row);
                let key = Spanned::new(key.span(), Cow::Owned(filled(key.get_ref(), row)));
                table.insert(key, value);
            }
        }
        _ => {}
    }
}

fn filled(text: &str, row: &DeTable) -> String {
    let mut filled = String::with_capacity(text.len());
    let mut done = 0;
    for (name, place) in variables(text) {
        let value = match row.get(name).map(Spanned::get_ref) {
            Some(DeValue::String(value)) => value.as_ref(),
            Some(DeValue::Integer(value)) => value.as_str(),
            Some(DeValue::Float(value)) => value.as_str(),
            _ => continue,
        };
        filled.push_str(&text[done..place.start]);
        filled.push_str(value);
        done = place.end;
    }
    filled + &text[done..]
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
    fn an_item_stands_for_each_row_and_template_in_order() {
        let text = r#"
[lists]
axes = [{ a = "alpha", n = 1 }, { a = "beta", n = 2.5 }]
[templates.angle]
label = "angle {a}"
signal = "plant.{a}"
[templates.error]
label = "error {a}"
inner = { x = 1, y = 2 }
[figure]
panel = [{ use = ["angle", "error"], each = "axes", at = "{n}", "k{n}" = "{runs:{a}}", inner.y = 3 }, { label = "last" }]
"#;
        let expected = r#"
[figure]
panel = [
    { label = "angle alpha", signal = "plant.alpha", at = 1, k1 = "{runs:alpha}", inner = { y = 3 } },
    { label = "error alpha", at = 1, k1 = "{runs:alpha}", inner = { x = 1, y = 3 } },
    { label = "angle beta", signal = "plant.beta", at = 2.5, "k2.5" = "{runs:beta}", inner = { y = 3 } },
    { label = "error beta", at = 2.5, "k2.5" = "{runs:beta}", inner = { x = 1, y = 3 } },
    { label = "last" },
]
"#;
        assert_eq!(expanded(text).unwrap(), expected.parse().unwrap());
    }

    #[test]
    fn a_template_may_use_others_and_hold_lists() {
        let text = r#"
run = [{ use = "{kind}-b", each = [{ kind = "x" }] }]
[templates.x-b]
use = "c"
own = 1
[templates.c]
each = [{ n = "1" }, { n = "2" }]
own = 2
id = "c{n}"
list = [{ use = "d", each = [{ m = "3" }], id = "{m}{n}" }]
[templates.d]
of = "{kind}{n}"
"#;
        let expected = r#"
run = [{ id = "c1", own = 1, list = [{ id = "31", of = "x1" }] }, { id = "c2", own = 1, list = [{ id = "32", of = "x2" }] }]
"#;
        assert_eq!(expanded(text).unwrap(), expected.parse().unwrap());
    }

    #[test]
    fn what_is_not_there_is_refused_by_name() {
        let refusal = |text: &str| expanded(text).unwrap_err().1;
        let message = refusal("a = [{ use = \"anlge\" }]\n[templates.angle]\nb = 1");
        assert!(message.contains("did you mean \"angle\""), "{message}");
        let message = refusal("a = [{ each = \"axs\" }]\n[lists]\naxes = []");
        assert!(message.contains("did you mean \"axes\""), "{message}");
        assert!(refusal("a = [{ each = [{ x = \"1\" }], b = \"{y}\" }]").contains("{y}"));
        assert!(refusal("a = [{ use = \"b\" }]\n[templates.b]\nuse = \"b\"").contains("circle"));
        assert!(refusal("a = [{ use = 1 }]").contains("names of templates"));
        assert!(refusal("a = [{ each = [1] }]").contains("list of tables"));
    }
}

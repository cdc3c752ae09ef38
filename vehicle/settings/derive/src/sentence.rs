//! Texts from documentation comments, and names from Rust's names.

use syn::{Attribute, Expr, ExprLit, Lit, Meta};

/// Returns the first paragraph of a documentation comment in one line, without the full stop at its
/// end.
pub(crate) fn sentence(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| match &attribute.meta {
        Meta::NameValue(pair) if pair.path.is_ident("doc") => match &pair.value {
            Expr::Lit(ExprLit { lit: Lit::Str(text), .. }) => Some(text.value().trim().to_owned()),
            _ => None,
        },
        _ => None,
    });
    let paragraph: Vec<String> = lines.take_while(|line| !line.is_empty()).collect();
    let text = paragraph.join(" ");
    // Links and code are for Rust's documentation.
    let text = text.replace(['`', '[', ']'], "");
    text.strip_suffix('.').map_or(text.clone(), str::to_owned)
}

/// Converts a Rust name, `time_constant` or `BestEffort`, to `timeConstant` or `bestEffort`.
pub(crate) fn camel(name: &str) -> String {
    let mut camel = String::new();
    for (i, part) in name.split('_').enumerate() {
        let mut letters = part.chars();
        match letters.next() {
            Some(first) if i == 0 => camel.extend(first.to_lowercase()),
            Some(first) => camel.extend(first.to_uppercase()),
            None => {}
        }
        camel.push_str(letters.as_str());
    }
    camel
}

/// Returns a sentence as the meaning of an item: with a small first letter, unless it is a symbol
/// or an abbreviation.
pub(crate) fn meaning(sentence: &str) -> String {
    let mut letters = sentence.chars();
    match (letters.next(), sentence.chars().nth(1)) {
        (Some(first), Some(second)) if second.is_lowercase() => {
            first.to_lowercase().chain(letters).collect()
        }
        _ => sentence.to_owned(),
    }
}

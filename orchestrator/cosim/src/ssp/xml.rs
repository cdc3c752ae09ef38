//! XML elements and numbers as an archive has them.

use quick_xml::Writer;
use std::io;

pub(super) type Xml = Writer<Vec<u8>>;

/// Formats a number as the shortest text that reads back as the same number.
pub(super) fn real(value: f64) -> String {
    format!("{value:?}")
}

/// Converts a text to an identifier, because some importers require every name to be one.
pub(super) fn identifier(text: &str) -> String {
    let mut name: String =
        text.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect();
    if !name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        name.insert(0, '_');
    }
    name
}

/// Writes an element without content.
pub(super) fn leaf(xml: &mut Xml, name: &str, attributes: &[(&str, String)]) -> io::Result<()> {
    let attributes = attributes.iter().map(|(name, value)| (*name, value.as_str()));
    xml.create_element(name).with_attributes(attributes).write_empty().map(drop)
}

/// Writes an element with the content that `content` writes.
pub(super) fn element(
    xml: &mut Xml,
    name: &str,
    attributes: &[(&str, String)],
    content: impl FnOnce(&mut Xml) -> io::Result<()>,
) -> io::Result<()> {
    let attributes = attributes.iter().map(|(name, value)| (*name, value.as_str()));
    let writer = xml.create_element(name).with_attributes(attributes);
    writer.write_inner_content(content).map(drop)
}

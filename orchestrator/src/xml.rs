//! XML of other makers: text in any declared encoding, elements whatever their namespace prefix.

use encoding_rs::{Encoding, UTF_8};
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};
use std::collections::BTreeMap;

/// The text of a file: in the encoding of its byte order mark, or else of its XML declaration, or else UTF-8.
///
/// # Errors
/// If the encoding is not known, or the bytes are not of it.
pub fn decode(bytes: &[u8]) -> Result<String, String> {
    let encoding = match Encoding::for_bom(bytes) {
        Some((encoding, _)) => encoding,
        None => match declared_encoding(bytes) {
            Some(label) => Encoding::for_label(label.as_bytes())
                .ok_or_else(|| format!("the encoding \"{}\" is not known", label.escape_default()))?,
            None => UTF_8,
        },
    };
    // With the byte order mark, if there is one, removed.
    let (text, encoding, faulty) = encoding.decode(bytes);
    if faulty { Err(format!("is not {} text", encoding.name())) } else { Ok(text.into_owned()) }
}

/// `latin1` of `<?xml version="1.0" encoding="latin1"?>`. Of all encodings that can be told this way it is ASCII.
fn declared_encoding(bytes: &[u8]) -> Option<String> {
    let end = bytes.iter().take(200).position(|&byte| byte == b'>')?;
    let declaration = std::str::from_utf8(&bytes[..end]).ok()?.trim_start().strip_prefix("<?xml")?;
    let (_, rest) = declaration.split_once("encoding")?;
    let quoted = rest.trim_start().strip_prefix('=')?.trim_start();
    let quote = quoted.chars().next().filter(|quote| matches!(quote, '"' | '\''))?;
    quoted[1..].split_once(quote).map(|(label, _)| label.to_string())
}

/// An element with what is in it, but for text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Element {
    /// Name without prefix.
    pub name: String,
    /// Attributes, by name with prefix.
    attributes: BTreeMap<String, String>,
    /// Elements in it.
    pub children: Vec<Element>,
}

/// Elements may stand in each other this deep.
const DEPTH: usize = 100;

impl Element {
    /// Reads a document.
    ///
    /// # Errors
    /// One line: what is wrong with the text.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut reader = Reader::from_str(text);
        // What is open, the document itself first.
        let mut open = vec![Self::default()];
        loop {
            let at = reader.buffer_position();
            let fault = |what: &str| format!("{what} at byte {at}");
            match reader.read_event().map_err(|error| fault(&error.to_string()))? {
                Event::Start(start) => {
                    if open.len() > DEPTH {
                        return Err(fault(&format!("more than {DEPTH} elements within each other")));
                    }
                    open.push(Self::new(&start).map_err(|error| fault(&error))?);
                }
                Event::Empty(start) => {
                    let element = Self::new(&start).map_err(|error| fault(&error))?;
                    if let Some(parent) = open.last_mut() {
                        parent.children.push(element);
                    }
                }
                Event::End(_) => {
                    let (closed, parent) = (open.pop(), open.last_mut());
                    if let (Some(closed), Some(parent)) = (closed, parent) {
                        parent.children.push(closed);
                    }
                }
                // It could define entities that unfold without end.
                Event::DocType(_) => return Err(fault("a document type definition, which is refused")),
                Event::Eof => break,
                _ => {}
            }
        }
        if open.len() > 1 {
            return Err(format!("the element \"{}\" is not closed", open[open.len() - 1].name));
        }
        match open.pop().map(|document| document.children) {
            Some(mut roots) if roots.len() == 1 => Ok(roots.remove(0)),
            _ => Err("there must be exactly one root element".into()),
        }
    }

    fn new(start: &BytesStart) -> Result<Self, String> {
        let mut attributes = BTreeMap::new();
        for attribute in start.attributes() {
            let attribute = attribute.map_err(|error| error.to_string())?;
            let value =
                attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|error| error.to_string())?;
            attributes.insert(attribute.key.as_ref().to_string(), value.into_owned());
        }
        Ok(Self { name: start.local_name().as_ref().to_string(), attributes, children: Vec::new() })
    }

    /// The attribute of this name.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.get(name).map(String::as_str)
    }

    /// The attribute of this name, which must be there.
    ///
    /// # Errors
    /// Names element and attribute.
    pub fn required(&self, name: &str) -> Result<&str, String> {
        self.attribute(name).ok_or_else(|| format!("an element {} has no attribute {name}", self.name))
    }

    /// The attribute of this name as a number, if it is there.
    ///
    /// # Errors
    /// If it is no number.
    pub fn number(&self, name: &str) -> Result<Option<f64>, String> {
        let parse = |text: &str| {
            let fault = || format!("{name} = \"{text}\" of an element {} is no number", self.name);
            text.trim().parse().map_err(|_| fault())
        };
        self.attribute(name).map(parse).transpose()
    }

    /// The first element of this name in it.
    pub fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.name == name)
    }

    /// All elements called `name` in the element called `list` in it.
    pub fn list<'a>(&'a self, list: &str, name: &'a str) -> impl Iterator<Item = &'a Self> {
        let children = self.child(list).map(|list| list.children.as_slice()).unwrap_or_default();
        children.iter().filter(move |child| child.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_of_every_declared_encoding_is_read() {
        let of = |declaration: &str, rest: &[u8]| decode(&[declaration.as_bytes(), rest].concat());
        assert_eq!(
            of("<?xml version='1.0' encoding='ISO-8859-1'?>", b"\xfc").unwrap().chars().last(),
            Some('ü')
        );
        assert_eq!(
            of("<?xml version=\"1.0\" encoding = \"utf-8\"?>", "ü".as_bytes()).unwrap().chars().last(),
            Some('ü')
        );
        assert_eq!(of("\u{feff}<a/>", b"").unwrap(), "<a/>");
        let wide: Vec<u8> = "\u{feff}<a b='ü'/>".encode_utf16().flat_map(u16::to_le_bytes).collect();
        assert_eq!(decode(&wide).unwrap(), "<a b='ü'/>");
        assert!(of("<a>", b"\xfc").unwrap_err().contains("UTF-8"));
        assert!(of("<?xml encoding='klingon'?>", b"").unwrap_err().contains("klingon"));
    }

    #[test]
    fn elements_are_found_whatever_their_prefix() {
        let text = "<?xml version='1.0'?><!-- x --><s:a xmlns:s='y' n='1&lt;2'><list><s:b i='1'/><c/><b i='2'>t</b></list></s:a>";
        let root = Element::parse(text).unwrap();
        assert_eq!((root.name.as_str(), root.attribute("n")), ("a", Some("1<2")));
        let numbers: Vec<_> = root.list("list", "b").map(|b| b.number("i").unwrap()).collect();
        assert_eq!(numbers, [Some(1.0), Some(2.0)]);
        assert!(root.required("m").unwrap_err().contains("attribute m"));
    }

    #[test]
    fn broken_and_hostile_text_is_refused_in_one_line() {
        let deep = "<a>".repeat(200) + &"</a>".repeat(200);
        let bomb = "<!DOCTYPE a [<!ENTITY b \"bbbb\"><!ENTITY c \"&b;&b;\">]><a n='&c;'/>";
        for text in ["", "<a", "<a><b></a>", "<a>", "<a/><b/>", "<a n=1/>", "<a n='&c;'/>", &deep, bomb] {
            let message = Element::parse(text).unwrap_err();
            assert_eq!(message.lines().count(), 1, "{text}: {message}");
        }
    }
}

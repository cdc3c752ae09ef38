//! Reads XML of any exporter: text in any declared encoding, and elements with any namespace
//! prefix. Writes elements in the same form.

use encoding_rs::{Encoding, UTF_8};
use quick_xml::events::{BytesDecl, BytesStart, Event};
use quick_xml::{Reader, Writer, XmlVersion};
use std::io;
use std::str::FromStr;

/// Decodes the text of a file. The encoding is that of its byte order mark, or otherwise that of
/// its XML declaration, or otherwise UTF-8.
///
/// # Errors
/// Returns an error if the encoding is unknown, or if the bytes are not valid in it.
pub fn decode(bytes: &[u8]) -> Result<String, String> {
    let encoding = match Encoding::for_bom(bytes) {
        Some((encoding, _)) => encoding,
        None => match declared_encoding(bytes) {
            Some(label) => Encoding::for_label(label.as_bytes()).ok_or_else(|| {
                format!("the encoding \"{}\" is not known", label.escape_default())
            })?,
            None => UTF_8,
        },
    };
    // Decoding removes the byte order mark, if there is one.
    let (text, encoding, faulty) = encoding.decode(bytes);
    if faulty { Err(format!("is not {} text", encoding.name())) } else { Ok(text.into_owned()) }
}

/// Returns the encoding that an XML declaration names, such as `latin1` in `<?xml version="1.0"
/// encoding="latin1"?>`. The declaration can be read as ASCII in all encodings for which this is
/// needed.
fn declared_encoding(bytes: &[u8]) -> Option<String> {
    let end = bytes.iter().take(200).position(|&byte| byte == b'>')?;
    let declaration =
        std::str::from_utf8(&bytes[..end]).ok()?.trim_start().strip_prefix("<?xml")?;
    let (_, rest) = declaration.split_once("encoding")?;
    let quoted = rest.trim_start().strip_prefix('=')?.trim_start();
    let quote = quoted.chars().next().filter(|quote| matches!(quote, '"' | '\''))?;
    quoted[1..].split_once(quote).map(|(label, _)| label.to_string())
}

/// An XML element with its attributes and child elements, but without text. It is read or made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Element {
    /// Name of the element, without namespace prefix if it was read.
    pub name: String,
    /// Line where the element begins, counted from 1, if it was read.
    pub line: usize,
    /// Attributes of the element, each a name with prefix and a value.
    attributes: Vec<(String, String)>,
    /// Elements that are nested directly in this one.
    pub children: Vec<Element>,
}

/// Depth below which nested elements are not stored. Annotations of some exporters are nested so
/// deeply, but no element that is needed is.
const DEPTH: usize = 100;

impl Element {
    /// Reads an XML document from its text.
    ///
    /// # Errors
    /// Returns one line that says what is wrong with the text.
    pub fn parse(text: &str) -> Result<Self, String> {
        let close = |open: &mut Vec<Self>, element: Self| {
            if let Some(parent) = open.last_mut() {
                parent.children.push(element);
            }
        };
        let mut reader = Reader::from_str(text);
        // Stack of the elements that are open; the first one represents the document itself.
        let mut open = vec![Self::default()];
        let (mut line, mut counted) = (1, 0);
        // Number of open elements that are too deep to be kept.
        let mut deeper = 0_usize;
        loop {
            let at =
                usize::try_from(reader.buffer_position()).unwrap_or(usize::MAX).min(text.len());
            line += text.get(counted..at).unwrap_or_default().matches('\n').count();
            counted = at;
            let fault = |what: &str| format!("{what} in line {line}");
            match reader.read_event().map_err(|error| fault(&error.to_string()))? {
                Event::Start(start) => {
                    if open.len() > DEPTH {
                        deeper += 1;
                        continue;
                    }
                    open.push(Self::read(&start, line).map_err(|error| fault(&error))?);
                }
                Event::Empty(start) => {
                    let element = Self::read(&start, line).map_err(|error| fault(&error))?;
                    if deeper == 0 {
                        close(&mut open, element);
                    }
                }
                Event::End(_) if deeper > 0 => deeper -= 1,
                Event::End(_) => {
                    if let Some(closed) = open.pop().filter(|_| !open.is_empty()) {
                        close(&mut open, closed);
                    }
                }
                // A document type definition could define entities that expand without end.
                Event::DocType(_) => {
                    return Err(fault("a document type definition, which is refused"));
                }
                Event::Eof => break,
                _ => {}
            }
        }
        if open.len() > 1 {
            return Err(format!("{} is not closed", open[open.len() - 1].title()));
        }
        match open.pop().map(|document| document.children) {
            Some(mut roots) if roots.len() == 1 => Ok(roots.remove(0)),
            _ => Err("there must be exactly one root element".into()),
        }
    }

    fn read(start: &BytesStart, line: usize) -> Result<Self, String> {
        let mut attributes = Vec::new();
        for attribute in start.attributes() {
            let attribute = attribute.map_err(|error| error.to_string())?;
            let value = attribute
                .normalized_value(XmlVersion::Implicit1_0)
                .map_err(|error| error.to_string())?;
            attributes.push((attribute.key.as_ref().to_string(), value.into_owned()));
        }
        Ok(Self {
            name: start.local_name().as_ref().to_string(),
            line,
            attributes,
            children: Vec::new(),
        })
    }

    /// Makes an element with these attributes.
    pub fn new<'a>(name: &str, attributes: impl IntoIterator<Item = (&'a str, String)>) -> Self {
        let attributes = attributes.into_iter().map(|(name, value)| (name.into(), value));
        Self { name: name.into(), attributes: attributes.collect(), ..Self::default() }
    }

    /// Adds child elements.
    #[must_use]
    pub fn holding(mut self, children: impl IntoIterator<Item = Self>) -> Self {
        self.children.extend(children);
        self
    }

    /// Writes the element as a document.
    ///
    /// # Errors
    /// Returns an error if a name or a value cannot be written as XML.
    pub fn document(&self) -> io::Result<Vec<u8>> {
        let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
        xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
        self.write(&mut xml)?;
        Ok([&xml.into_inner()[..], b"\n"].concat())
    }

    fn write(&self, xml: &mut Writer<Vec<u8>>) -> io::Result<()> {
        let attributes = self.attributes.iter().map(|(name, value)| (&**name, &**value));
        let element = xml.create_element(self.name.as_str()).with_attributes(attributes);
        if self.children.is_empty() {
            return element.write_empty().map(drop);
        }
        let write_children =
            |xml: &mut _| self.children.iter().try_for_each(|child| child.write(xml));
        element.write_inner_content(write_children).map(drop)
    }

    /// Returns the title of the element for messages: its kind, its name if it has one, and its
    /// line.
    pub fn title(&self) -> String {
        let name = self.attribute("name").map(|name| format!(" \"{}\"", shortened(name)));
        format!("the element {}{} in line {}", self.name, name.unwrap_or_default(), self.line)
    }

    /// Returns the value of the attribute with this name, if it is present.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(other, _)| other == name).map(|(_, value)| value.as_str())
    }

    /// Returns the attribute with this name, which must be present.
    ///
    /// # Errors
    /// Returns an error that names the element and the attribute if it is missing.
    pub fn required(&self, name: &str) -> Result<&str, String> {
        self.attribute(name).ok_or_else(|| format!("{} has no attribute {name}", self.title()))
    }

    /// Returns the attribute with this name as a number, if it is present.
    ///
    /// # Errors
    /// Returns an error if the value of the attribute is not a number.
    pub fn number(&self, name: &str) -> Result<Option<f64>, String> {
        self.parsed(name, "a number")
    }

    /// Returns the attribute with this name as a truth value, if it is present.
    ///
    /// # Errors
    /// Returns an error if the value of the attribute is not a truth value.
    pub fn truth(&self, name: &str) -> Result<Option<bool>, String> {
        match self.attribute(name).map(str::trim) {
            None => Ok(None),
            Some("true" | "1") => Ok(Some(true)),
            Some("false" | "0") => Ok(Some(false)),
            Some(_) => Err(self.refusal(name, "true or false")),
        }
    }

    /// Returns the names of the attributes whose value is true.
    pub fn truths(&self) -> impl Iterator<Item = &str> {
        let truths =
            self.attributes.iter().filter(|(_, value)| matches!(value.trim(), "true" | "1"));
        truths.map(|(name, _)| name.as_str())
    }

    /// Returns the attribute with this name as a `T`, if it is present. Messages call a `T` a
    /// `kind`.
    ///
    /// # Errors
    /// Returns an error if the value of the attribute is not a `T`.
    pub fn parsed<T: FromStr>(&self, name: &str, kind: &str) -> Result<Option<T>, String> {
        let parse = |text: &str| text.trim().parse().map_err(|_| self.refusal(name, kind));
        self.attribute(name).map(parse).transpose()
    }

    fn refusal(&self, name: &str, kind: &str) -> String {
        let text = shortened(self.attribute(name).unwrap_or_default());
        format!("{name} = \"{text}\" of {} is not {kind}", self.title())
    }

    /// Returns the first child element with this name.
    pub fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.name == name)
    }

    /// Returns all elements called `name` in the child element called `list`.
    pub fn list<'a>(&'a self, list: &str, name: &'a str) -> impl Iterator<Item = &'a Self> {
        let children = self.child(list).map(|list| list.children.as_slice()).unwrap_or_default();
        children.iter().filter(move |child| child.name == name)
    }
}

/// Shortens a text for messages.
fn shortened(text: &str) -> String {
    const LONGEST: usize = 60;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", text[..end].escape_default()),
        None => text.escape_default().to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_of_every_declared_encoding_is_read() {
        let decoded =
            |declaration: &str, rest: &[u8]| decode(&[declaration.as_bytes(), rest].concat());
        let latin = "<?xml version='1.0' encoding='ISO-8859-1'?>";
        assert!(decoded(latin, b"\xfc").unwrap().ends_with('ü'));
        let utf8 = "<?xml version=\"1.0\" encoding = \"utf-8\"?>";
        assert!(decoded(utf8, "ü".as_bytes()).unwrap().ends_with('ü'));
        assert_eq!(decoded("\u{feff}<a/>", b"").unwrap(), "<a/>");
        let wide: Vec<u8> =
            "\u{feff}<a b='ü'/>".encode_utf16().flat_map(u16::to_le_bytes).collect();
        assert_eq!(decode(&wide).unwrap(), "<a b='ü'/>");
        assert!(decoded("<a>", b"\xfc").unwrap_err().contains("UTF-8"));
        assert!(decoded("<?xml encoding='klingon'?>", b"").unwrap_err().contains("klingon"));
    }

    #[test]
    fn elements_are_found_whatever_their_prefix() {
        let text = "<?xml version='1.0'?><!-- x --><s:a xmlns:s='y' n='1&lt;2'><list><s:b i='1'/><c/><b i='2'>t</b></list></s:a>";
        let root = Element::parse(text).unwrap();
        assert_eq!((root.name.as_str(), root.attribute("n")), ("a", Some("1<2")));
        let numbers: Vec<_> = root.list("list", "b").map(|b| b.number("i").unwrap()).collect();
        assert_eq!(numbers, [Some(1.0), Some(2.0)]);
        assert!(root.required("m").unwrap_err().contains("attribute m"));
        let lines = Element::parse("<a>\n<b name='x'\n n='-1'/>\n\n<c>\n</c></a>").unwrap();
        assert_eq!((lines.children[0].line, lines.children[1].line), (2, 5));
        let fault = lines.children[0].parsed::<u32>("n", "a whole number from 0 on").unwrap_err();
        assert_eq!(
            fault,
            "n = \"-1\" of the element b \"x\" in line 2 is not a whole number from 0 on"
        );
        assert!(Element::parse("<a>\n<b></a>").unwrap_err().contains("line 2"));
    }

    #[test]
    fn what_is_deep_within_others_is_passed_over() {
        let deep = "<a>".repeat(100_000) + "<b/>" + &"</a>".repeat(100_000);
        let root = Element::parse(&format!("<r>{deep}<c/></r>")).unwrap();
        assert_eq!(
            root.children.iter().map(|child| child.name.as_str()).collect::<Vec<_>>(),
            ["a", "c"]
        );
        assert!(Element::parse(&"<a>".repeat(200)).unwrap_err().contains("not closed"));
    }

    #[test]
    fn broken_and_hostile_text_is_refused_in_one_line() {
        let bomb = "<!DOCTYPE a [<!ENTITY b \"bbbb\"><!ENTITY c \"&b;&b;\">]><a n='&c;'/>";
        for text in ["", "<a", "<a><b></a>", "<a>", "<a/><b/>", "<a n=1/>", "<a n='&c;'/>", bomb] {
            let message = Element::parse(text).unwrap_err();
            assert_eq!(message.lines().count(), 1, "{text}: {message}");
        }
    }
}

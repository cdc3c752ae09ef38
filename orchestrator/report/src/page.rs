//! The page of a study, of a campaign or of a search: a heading and sections with texts, tables,
//! figures and verdicts.

use crate::figure::{Figure, svg};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use std::io::Write;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// A page of a report.
#[derive(Clone, Debug, Default)]
pub struct Page {
    /// Title of the page, in one line.
    pub title: String,
    /// Line below the title.
    pub about: String,
    /// Result of the whole in a sentence, or an empty text.
    pub answer: String,
    /// Sections, in order. Those without content are left out.
    pub sections: Vec<Section>,
}

/// A section of a page.
#[derive(Clone, Debug, Default)]
pub struct Section {
    /// Id, by which links refer to the section, or an empty text.
    pub id: &'static str,
    /// Name of the section in the navigation, or an empty text.
    pub name: &'static str,
    /// Heading above the content, or an empty text.
    pub heading: &'static str,
    /// Class of the style sheet, if the section has one.
    pub class: Option<&'static str>,
    /// Whether the content is hidden until a reader opens the section.
    pub is_folded: bool,
    /// Content of the section.
    pub content: Markup,
}

impl Section {
    /// Returns a section whose name in the navigation is its heading.
    pub fn new(id: &'static str, heading: &'static str, content: Markup) -> Self {
        Self { id, name: heading, heading, content, ..Self::default() }
    }

    /// Returns the section with another heading than its name.
    #[must_use]
    pub fn headed(self, heading: &'static str) -> Self {
        Self { heading, ..self }
    }

    /// Returns the section with its content folded.
    #[must_use]
    pub fn folded(self) -> Self {
        Self { is_folded: true, ..self }
    }

    fn markup(&self) -> Markup {
        let Self { id, heading, class, content, .. } = self;
        let id = Some(id).filter(|id| !id.is_empty());
        html! {
            @if self.is_folded {
                details id=[id] class=[class] { summary { h2 { (heading) } } (content) }
            } @else {
                section id=[id] class=[class] { @if !heading.is_empty() { h2 { (heading) } } (content) }
            }
        }
    }
}

impl Page {
    /// Returns the text of the page, which needs no other file and no network.
    pub fn text(&self) -> String {
        let sections: Vec<&Section> =
            self.sections.iter().filter(|section| !section.content.0.is_empty()).collect();
        let named = sections.iter().filter(|section| !section.name.is_empty());
        document(
            &self.title,
            &[STYLE],
            &html! {
                header {
                    h1 { (self.title) }
                    p.paper { (self.about) }
                    @if !self.answer.is_empty() { p.answer { (self.answer) } }
                    nav { @for section in named { a href=(format!("#{}", section.id)) { (section.name) } " " } }
                }
                main { @for section in sections { (section.markup()) } }
                script { (PreEscaped(SCRIPT)) }
            },
        )
    }
}

/// Returns the text of a page with these style sheets and this body.
pub(crate) fn document(title: &str, styles: &[&str], body: &Markup) -> String {
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                @for style in styles { style { (PreEscaped(style)) } }
            }
            body { (body) }
        }
    };
    markup.into_string()
}

/// Returns a text in paragraphs, which empty lines separate.
pub fn paragraphs(text: &str) -> Markup {
    let paragraphs = text.split("\n\n").map(str::trim).filter(|paragraph| !paragraph.is_empty());
    html! { @for paragraph in paragraphs { p { (paragraph) } } }
}

/// Returns a table with these headings; without any it has rows alone.
pub fn table(headings: &[&str], rows: impl IntoIterator<Item = Vec<Markup>>) -> Markup {
    html! {
        div.scroll { table.numbers {
            @if !headings.is_empty() { thead { tr { @for heading in headings { th { (heading) } } } } }
            tbody { @for row in rows { tr { @for cell in row { td { (cell) } } } } }
        } }
    }
}

/// Returns a figure with its title, and a caption below it.
pub fn figure(figure: &Figure, caption: &Markup) -> Markup {
    html! {
        figure {
            h3 { (figure.title) }
            div.plot { (PreEscaped(svg::element(figure))) }
            @if !caption.0.is_empty() { figcaption { (caption) } }
        }
    }
}

/// Returns a verdict in words: good, bad, or neither.
pub fn verdict(is_good: Option<bool>, words: &str) -> Markup {
    let class = match is_good {
        Some(true) => "verdict holds",
        Some(false) => "verdict not",
        None => "verdict partly",
    };
    html! { span class=(class) { (words) } }
}

/// Returns a drawing for a folded part of a page. It is kept compressed, and the page's script puts
/// it there when the part is opened or printed.
pub fn folded(drawing: &str) -> Markup {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
    // Writing to memory does not fail.
    let compressed = encoder.write_all(drawing.as_bytes()).and_then(|()| encoder.finish());
    html! { div.plot data-folded=(STANDARD.encode(compressed.unwrap_or_default())) {} }
}

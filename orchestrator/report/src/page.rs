//! The common parts of the pages of studies and campaigns.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use maud::{Markup, PreEscaped, html};
use std::io::Write;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Returns the head of the page of a report, with the style of all reports.
pub fn head(title: &str) -> Markup {
    html! {
        head {
            meta charset="utf-8";
            meta name="viewport" content="width=device-width, initial-scale=1";
            title { (title) }
            style { (PreEscaped(STYLE)) }
        }
    }
}

/// Returns a drawing for a folded part of a page. It is kept compressed, and the page's script puts
/// it there when the part is opened or printed.
pub fn folded(drawing: &str) -> Markup {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::best());
    // Writing to memory does not fail.
    let compressed = encoder.write_all(drawing.as_bytes()).and_then(|()| encoder.finish());
    html! { div.plot data-folded=(STANDARD.encode(compressed.unwrap_or_default())) {} }
}

/// Returns the script that lets a reader look into the figures of a page. It stands at the end of
/// the body.
pub fn script() -> Markup {
    html! { script { (PreEscaped(SCRIPT)) } }
}

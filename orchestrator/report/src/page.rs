//! What the pages of studies and campaigns have in common.

use maud::{Markup, PreEscaped, html};

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

/// Returns the script that lets a reader look into the figures of a page. It stands at the end of
/// the body.
pub fn script() -> Markup {
    html! { script { (PreEscaped(SCRIPT)) } }
}

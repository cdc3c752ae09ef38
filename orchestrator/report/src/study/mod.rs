//! A paper's comparison as data: which experiments are run, over which seeds; what is drawn and tabulated of them; what the
//! paper prints; and what it claims. `orchestrator reproduce` runs it and writes the report.
//!
//! All keys stand in docs/studies.md, and in `orchestrator/schema/study.json` for editors.

pub mod claims;
pub mod comparisons;
pub mod definition;
pub mod drawings;
mod figures;
mod grid;
mod kept;
mod load;
mod output;
mod page;
mod part;
pub mod reproduce;
mod results;
mod runs;
mod template;
mod texts;
mod values;

//! A paper's comparison as data: which experiments are run and in which cases, what is drawn and
//! tabulated, which numbers the paper prints, and what it claims. `orchestrator reproduce` runs a
//! study and writes its report.
//!
//! docs/studies.md explains all keys; `orchestrator/schema/study.json` describes them for editors.

pub mod claims;
mod comparisons;
mod curves;
pub mod definition;
mod drawings;
mod figures;
mod grid;
mod load;
mod origin;
mod output;
mod page;
mod part;
pub mod reproduce;
mod results;
mod rows;
mod runs;
mod table;
mod texts;
mod values;

//! Campaigns: thousands of cases of one experiment, in which parameters vary.
//!
//! A campaign ([`definition`]) is prepared once ([`plan`]): every name is looked up, and each
//! parameter gets a distribution ([`distribution`]). The [`design`] says where in the parameter
//! space case k lies; this depends on the campaign's seed and k alone, so that any case can be
//! flown again by itself. A [`flight`] flies one case after the other with the same instances,
//! which are reset between cases. The cases are divided into parts, whose results are kept in files
//! of their own ([`parts`], [`table`]) until all are merged ([`run`]); other machines can fly some
//! of them, with the files of a [`bundle`]. [`statistics`] and [`sensitivity`] say what the cases
//! show ([`findings`]), and [`report`] draws it. [`search`] looks for the worst case.

pub mod bundle;
pub mod changes;
mod correlation;
pub mod definition;
pub mod design;
pub mod distribution;
pub mod error;
pub mod findings;
pub mod flight;
pub mod parts;
pub mod plan;
pub mod prepare;
pub mod report;
pub mod run;
pub mod search;
pub mod sensitivity;
pub mod statistics;
pub mod table;
mod texts;

//! Campaigns: thousands of cases of one experiment, in which parameters vary.
//!
//! A campaign ([`definition`]) is a sweep with limits: it is prepared once ([`plan`]), and a
//! `flight` flies its cases. Their parts are kept until all are merged ([`run`]). [`findings`] and
//! `sensitivity` evaluate the cases, and `report` shows the results. [`search`] looks for the
//! worst case.

pub mod definition;
pub mod findings;
mod flight;
pub mod plan;
mod prepare;
mod report;
pub mod run;
pub mod search;
mod sensitivity;

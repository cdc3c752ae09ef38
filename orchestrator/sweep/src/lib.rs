//! Sweeps: cases of one experiment that differ in the values of parameters.
//!
//! A [`cases::Sweep`] is prepared once: every name is looked up, and each parameter that varies
//! ([`vary`]) gets a `distribution`. The `design` says where in the parameter space case k
//! lies; this depends on the seed and k alone, so that any case can be flown again by itself. A
//! [`flight`] flies one case after the other with the same instances, which are reset between
//! cases. The cases are divided into [`parts`], which a [`runner`] flies on several threads; the
//! results of a finished part are kept in a file ([`table`]) and not computed again. Campaigns and studies are
//! built on this: a campaign asks how often limits are broken, a study compares with a paper.

pub mod cases;
mod closed;
mod design;
mod distribution;
pub mod error;
pub mod flight;
pub mod parts;
pub mod runner;
pub mod statistics;
pub mod table;
pub mod texts;
mod threads;
pub mod track;
pub mod varied;
pub mod vary;

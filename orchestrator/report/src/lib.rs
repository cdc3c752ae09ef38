//! Draws co-simulated runs: the plot that an experiment asks for, recorded runs as pictures and
//! pages, and the figures and pages that studies and campaigns are made of.

mod coast;
pub mod figure;
pub mod page;
pub mod panels;
pub mod recording;
pub mod run_page;

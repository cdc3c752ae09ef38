//! Steps FMUs along an experiment file and reports what they did. It knows FMUs only: nothing of vehicles or controllers
//! but the names by which an experiment's figures of merit and the live view find their variables.
//!
//! [`experiment`] is read ([`document`]), [`run::Plan`] resolves it ([`wiring`], [`settings`], [`delay`]) against what the archives say
//! ([`fmu`], [`archive`], [`description`], [`quantity`]), [`master`] steps the units ([`mod@unit`]) on integer ticks
//! ([`clock`]), in [`realtime`] if it is asked to, and observers look on: [`recorder`], [`metrics`], [`plot`], [`progress`],
//! [`live`]. [`report`] and [`sidecar`] tell what came of it.
//!
//! A [`study`] runs many experiments, draws [`figure`]s of them, and holds them against what a paper prints.

pub mod catalogue;
pub mod clock;
pub mod delay;
pub mod document;
pub mod error;
pub mod experiment;
pub mod figure;
pub mod folder;
pub mod guarantee;
pub mod inspect;
pub mod interrupt;
pub mod list;
pub mod live;
pub mod master;
pub mod metrics;
pub mod plot;
pub mod progress;
pub mod realtime;
pub mod recorder;
pub mod report;
pub mod run;
pub mod schema;
pub mod search;
pub mod seeds;
pub mod settings;
pub mod sidecar;
pub mod ssp;
pub mod stopwatch;
pub mod study;
pub mod watch;
pub mod wiring;

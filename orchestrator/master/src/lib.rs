//! Steps instances of FMI on integer ticks. Nothing here needs a file, a thread, a process or
//! the wall clock, so that it also runs in a browser.
//!
//! Components are known by their [`description`]. Their connections become pairs of value
//! references ([`wiring`]), parameters become values in the variables' units ([`settings`],
//! [`quantity`]), and [`delay`] says when each connected output is read. The [`master`] then calls
//! the [instances](instance) at the ticks of a [`clock`]. Texts that people write, such as
//! [`names`] with their mistakes, are resolved before that.

pub mod clock;
pub mod delay;
pub mod description;
pub mod instance;
pub mod master;
pub mod names;
pub mod quantity;
pub mod settings;
pub mod wiring;

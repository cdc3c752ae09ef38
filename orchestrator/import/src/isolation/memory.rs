//! The memory that the master and the process of an instance share. It has no name under Unix, so
//! that nobody finds it and nothing of it is left behind: the process inherits it in place of its
//! standard output, which then becomes the same as its standard error.

#[cfg(not(unix))]
mod named;
#[cfg(unix)]
mod unix;

#[cfg(not(unix))]
pub(super) use named::{Memory, inherited};
#[cfg(unix)]
pub(super) use unix::{Memory, inherited};

//! Processors whose environment is not changed.

/// An environment that is always the default one.
pub(crate) struct Environment;

impl Environment {
    pub(crate) fn leave() -> Self {
        Self
    }
}

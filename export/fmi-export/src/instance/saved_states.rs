//! Saved states, which the importer knows by their addresses.

use super::Instance;
use crate::call::Outcome;
use crate::logger::Category;
use crate::model::Failure;
use crate::saved;
use crate::types::FmiStatus;

/// A saved state. It is never empty, so every saved state has its own address.
pub(crate) struct Saved(Box<[u8]>);

impl Instance {
    /// Returns a handle of the present state. With `reuse`, the state behind that handle is
    /// overwritten.
    pub(crate) fn save(&mut self, reuse: Option<*const Saved>) -> Result<*const Saved, Failure> {
        let payload = self.model.save(&self.progress)?;
        let bytes = saved::wrap(&self.guid, self.interface, &payload);
        match reuse {
            Some(handle) => {
                let position = self.find(handle)?;
                self.saved[position].0 = bytes;
                Ok(handle)
            }
            None => Ok(self.keep(bytes)),
        }
    }

    fn keep(&mut self, bytes: Box<[u8]>) -> *const Saved {
        let saved = Box::new(Saved(bytes));
        let handle = &raw const *saved;
        self.saved.push(saved);
        handle
    }

    fn find(&self, handle: *const Saved) -> Result<usize, Failure> {
        let position = self.saved.iter().position(|saved| std::ptr::eq(&raw const **saved, handle));
        position.ok_or_else(|| {
            Failure::Error(
                "this FMUstate was not made by this instance, or was freed; \
                 carry states between instances in serialized form"
                    .into(),
            )
        })
    }

    pub(crate) fn restore(&mut self, handle: *const Saved) -> Outcome {
        let position = self.find(handle)?;
        let payload = saved::unwrap(&self.guid, self.interface, &self.saved[position].0)
            .map_err(Failure::Error)?;
        self.progress = self.model.restore(payload, (self.interface, self.stops.event_mode))?;
        self.progress.extrapolations.reserve(self.description.variables.len());
        self.stale = true;
        self.last_step = FmiStatus::Ok;
        self.has_ended = false;
        self.logger.log(Category::Events, "state restored");
        Ok(())
    }

    pub(crate) fn free_saved(&mut self, handle: *const Saved) -> Outcome {
        let position = self.find(handle)?;
        self.saved.swap_remove(position);
        Ok(())
    }

    pub(crate) fn serialized(&self, handle: *const Saved) -> Result<&[u8], Failure> {
        Ok(&self.saved[self.find(handle)?].0)
    }

    pub(crate) fn deserialize(&mut self, bytes: &[u8]) -> Result<*const Saved, Failure> {
        saved::unwrap(&self.guid, self.interface, bytes).map_err(Failure::Error)?;
        Ok(self.keep(bytes.into()))
    }
}

//! An instance in a process of its own, as the master sees it.
//!
//! Set calls are kept until the next call that needs an answer, and each answer to a step or a get
//! call brings the values of all lists of variables that were read before: at a communication point
//! there is one round trip for the step and one for the exchange of values. A set call that fails
//! is reported by the call that follows it.

use super::process::Process;
use super::protocol::{Action, List, Request, Set};
use fmi_master::description::Carrier;
use fmi_master::instance::{CallFailure, Instance, Outcome};

/// Number of values that are set or read by one message; longer lists are cut.
const CHUNK: usize = 4096;
/// Number of bytes of the values that come with every answer.
const PREFETCHED: usize = 1 << 18;
/// Number of bytes of a text that can be set.
const TEXT: usize = 1 << 19;

/// An instance in a process of its own.
pub(crate) struct RemoteInstance {
    process: Process,
    /// Calls that wait for the next request, and the number of their values.
    sets: Vec<Set>,
    waiting: usize,
    /// Lists whose values come with every answer, and the number of their bytes.
    lists: Vec<List>,
    size: usize,
    /// Lists that could not be read, by their places.
    unread: Vec<(usize, CallFailure)>,
    /// Whether the values of the last answer are those of the lists and still those of the
    /// instance.
    is_fresh: bool,
    /// Step whose answer was not waited for yet.
    begun: Option<Action>,
}

impl RemoteInstance {
    pub(super) fn new(process: Process) -> Self {
        Self {
            process,
            sets: Vec::new(),
            waiting: 0,
            lists: Vec::new(),
            size: 0,
            unread: Vec::new(),
            is_fresh: false,
            begun: None,
        }
    }

    fn ask(&mut self, action: Action, reads: Vec<List>, once: Vec<List>) -> Outcome {
        let sizes = |lists: &[List]| lists.iter().map(List::size).sum::<usize>();
        let once_size = (!once.is_empty()).then(|| sizes(&once));
        self.send(action, reads, once)?;
        self.receive(action, once_size)
    }

    /// Sends calls, and lists to be read from now on or once.
    fn send(&mut self, action: Action, reads: Vec<List>, once: Vec<List>) -> Outcome {
        let sets = std::mem::take(&mut self.sets);
        self.waiting = 0;
        self.is_fresh = false;
        self.begun = None;
        if !action.reads() {
            self.lists.clear();
            self.size = 0;
        }
        self.size += reads.iter().map(List::size).sum::<usize>();
        self.lists.extend(reads.iter().cloned());
        self.process.send(action.call(), &Request { sets, action, reads, once })
    }

    /// Receives the answer to what was sent; `once` is the size of lists that were read once.
    fn receive(&mut self, action: Action, once: Option<usize>) -> Outcome {
        let reply = self.process.reply(action.call())?;
        reply.failure.map_or(Ok(()), Err)?;
        self.unread = reply.unread;
        if action.reads() && self.process.values().len() != once.unwrap_or(self.size) {
            return Err(self.process.undecodable(action.call()));
        }
        self.is_fresh = action.reads() && once.is_none();
        Ok(())
    }

    fn act(&mut self, action: Action) -> Outcome {
        self.ask(action, Vec::new(), Vec::new())
    }

    fn set(&mut self, set: Set, count: usize) -> Outcome {
        self.sets.push(set);
        self.waiting += count;
        self.is_fresh = false;
        if self.waiting >= CHUNK { self.act(Action::Read) } else { Ok(()) }
    }

    /// Returns the bytes of the values of a list.
    fn read(&mut self, carrier: Carrier, references: &[u32]) -> Result<&[u8], CallFailure> {
        let is_it = |list: &List| list.carrier == carrier && list.references == references;
        let mut prefetched = self.lists.iter().position(is_it);
        if prefetched.is_none() {
            let list = List { carrier, references: references.to_vec() };
            if self.size + list.size() > PREFETCHED {
                self.ask(Action::Read, Vec::new(), vec![list])?;
            } else {
                prefetched = Some(self.lists.len());
                self.ask(Action::Read, vec![list], Vec::new())?;
            }
        } else if !self.is_fresh {
            self.act(Action::Read)?;
        }
        // A list that is read only this time is the only one.
        let place = prefetched.unwrap_or(0);
        if let Some((_, failure)) = self.unread.iter().find(|(unread, _)| *unread == place) {
            return Err(failure.clone());
        }
        let begin: usize = self.lists[..place].iter().map(List::size).sum();
        Ok(&self.process.values()[begin..])
    }

    /// Reads variables whose values are sent as N bytes each.
    fn get<T, const N: usize>(
        &mut self,
        carrier: Carrier,
        references: &[u32],
        values: &mut [T],
        decode: fn([u8; N]) -> T,
    ) -> Outcome {
        for (references, values) in references.chunks(CHUNK).zip(values.chunks_mut(CHUNK)) {
            let bytes = self.read(carrier, references)?.as_chunks::<N>().0;
            for (value, bytes) in values.iter_mut().zip(bytes) {
                *value = decode(*bytes);
            }
        }
        Ok(())
    }

    /// Sets variables, by calls of at most [`CHUNK`] values.
    fn set_all<T: Clone>(
        &mut self,
        references: &[u32],
        values: &[T],
        to_set: fn(Vec<u32>, Vec<T>) -> Set,
    ) -> Outcome {
        references.chunks(CHUNK).zip(values.chunks(CHUNK)).try_for_each(|(references, values)| {
            self.set(to_set(references.to_vec(), values.to_vec()), values.len())
        })
    }
}

impl Instance for RemoteInstance {
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
        self.get(Carrier::Real, references, values, f64::from_le_bytes)
    }

    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        self.get(Carrier::Integer, references, values, i32::from_le_bytes)
    }

    fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        self.get(Carrier::Boolean, references, values, i32::from_le_bytes)
    }

    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome {
        self.set_all(references, values, Set::Real)
    }

    fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        self.set_all(references, values, Set::Integer)
    }

    fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        self.set_all(references, values, Set::Boolean)
    }

    fn set_string(&mut self, reference: u32, value: &str) -> Outcome {
        if value.len() > TEXT {
            let message = format!("the text has {} bytes, at most {TEXT} can be set", value.len());
            return Err(CallFailure::new("setString", message));
        }
        // A long text fills the message at once.
        self.set(Set::Text(reference, value.to_string()), 1 + value.len() / 16)
    }

    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
        self.act(Action::EnterInitialization { start, stop })
    }

    fn exit_initialization(&mut self) -> Outcome {
        self.act(Action::ExitInitialization)
    }

    fn begin_step(&mut self, time: f64, step: f64) -> Outcome {
        let action = Action::DoStep { time, step };
        self.send(action, Vec::new(), Vec::new())?;
        self.begun = Some(action);
        Ok(())
    }

    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        let action = Action::DoStep { time, step };
        match self.begun.take() {
            Some(begun) if begun == action => self.receive(action, None),
            _ => self.act(action),
        }
    }

    fn terminate(&mut self) -> Outcome {
        self.act(Action::Terminate)
    }

    fn reset(&mut self) -> Outcome {
        self.act(Action::Reset)
    }
}

//! The process of an instance: it loads the library and makes the calls that the master requests.

use super::channel::{Channel, LARGEST, Slot};
use super::limits;
use super::memory;
use super::protocol::{Action, InstanceArguments, List, Ready, Reply, Request, Set, Setup};
use crate::fmi3::Layout;
use crate::loading::{self, Kind, Refusal};
use crate::log::{Held, Log};
use fmi_master::description::Carrier;
use fmi_master::instance::{Instance, Outcome};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ffi::OsString;
use std::io::{self, Read as _};
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// Serves one instance through the memory that the master shares, and ends when the instance is
/// freed or the master has ended.
///
/// # Errors
/// Returns an error if the memory is not what the master makes, or if a message cannot be decoded.
pub fn serve(arguments: impl Iterator<Item = OsString>) -> io::Result<()> {
    let channel = Arc::new(memory::inherited(arguments)?);
    // The master holds the other end of this pipe, which the system closes when the master ends.
    std::thread::spawn(|| {
        let _ = io::stdin().read(&mut [0]);
        end_group();
        std::process::abort();
    });
    let mut host = Host { channel, number: 0, bytes: Vec::new() };
    let setup: Setup = host.receive()?;
    let held = Arc::new(Held::default());
    let words = Arc::clone(&host.channel);
    let log = |name: &str| {
        Log::held(name, Arc::clone(&held), move |text| words.put(Slot::LastMessage, 1, text))
    };
    let refused = |reason| Ready::Refused { reason, messages: held.take() };
    let exchange = setup.exchange;
    let fmi3 = setup.fmi3.map(|folder| {
        let description = loading::read_description(&folder)?;
        Layout::new(&description, exchange.is_some()).map(Rc::new)
    });
    let kind = match fmi3.transpose() {
        Ok(fmi3) => Kind { fmi3, exchange },
        Err(reason) => return host.send(&refused(reason)),
    };
    let without = match limits::apply(&setup.limits) {
        Ok(without) => without,
        Err(reason) => return host.send(&refused(reason)),
    };
    let InstanceArguments { name, guid, resources } = setup.instance;
    let log = Rc::new(log(&name));
    let (mut instance, version_fault) =
        match loading::loaded(&setup.library, kind, log, (&guid, &resources), None) {
            Ok(loaded) => loaded,
            Err(Refusal::Unloadable(reason)) => return host.send(&Ready::Unloadable(reason)),
            Err(Refusal::Refused(reason)) => return host.send(&refused(reason)),
        };
    host.send(&Ready::Loaded { version_fault, without, messages: held.take() })?;
    let (mut lists, mut values) = (Vec::new(), Vec::new());
    loop {
        let request: Request = host.receive()?;
        if request.action == Action::Free {
            drop(instance);
            return host.send(&Reply { messages: held.take(), ..Reply::default() });
        }
        let reply = answer(instance.as_mut(), request, &mut lists, &mut values);
        host.send_with(&Reply { messages: held.take(), ..reply }, &values)?;
    }
}

/// Ends this process with all processes that the instance has started.
#[cfg(unix)]
fn end_group() {
    use rustix::process::{Signal, getpgrp, kill_process_group};
    // A sandboxed instance has started none, and may not send this signal.
    let _ = kill_process_group(getpgrp(), Signal::KILL);
}

#[cfg(not(unix))]
fn end_group() {}

/// The end of the channel at which requests arrive.
struct Host {
    channel: Arc<Channel>,
    number: u32,
    bytes: Vec<u8>,
}

impl Host {
    fn receive<T: DeserializeOwned>(&mut self) -> io::Result<T> {
        self.number = self.number.wrapping_add(1);
        let goes_on = |_: Duration| Ok::<(), io::Error>(());
        self.channel.wait(Slot::Request, self.number, goes_on)?;
        self.channel.copy(Slot::Request, &mut self.bytes);
        postcard::from_bytes(&self.bytes).map_err(io::Error::other)
    }

    fn send(&mut self, message: &impl Serialize) -> io::Result<()> {
        self.send_with(message, &[])
    }

    /// Sends a message, followed by these bytes.
    fn send_with(&mut self, message: &impl Serialize, behind: &[u8]) -> io::Result<()> {
        self.bytes.clear();
        self.bytes = postcard::to_extend(message, std::mem::take(&mut self.bytes))
            .map_err(io::Error::other)?;
        self.bytes.extend_from_slice(behind);
        if self.bytes.len() > LARGEST {
            return Err(io::Error::other("an answer is too large"));
        }
        self.channel.put(Slot::Reply, self.number, &self.bytes);
        Ok(())
    }
}

/// A list of variables with room for its values.
struct Values {
    list: List,
    reals: Vec<f64>,
    wholes: Vec<i32>,
}

impl Values {
    fn new(list: List) -> Self {
        let count = list.references.len();
        let (reals, wholes) = if list.carrier == Carrier::Real { (count, 0) } else { (0, count) };
        Self { list, reals: vec![0.0; reals], wholes: vec![0; wholes] }
    }

    /// Reads the values and appends their bytes.
    fn read(&mut self, instance: &mut dyn Instance, bytes: &mut Vec<u8>) -> Outcome {
        let references = &self.list.references;
        let outcome = match self.list.carrier {
            Carrier::Real => instance.get_real(references, &mut self.reals),
            Carrier::Integer => instance.get_integer(references, &mut self.wholes),
            Carrier::Boolean => instance.get_boolean(references, &mut self.wholes),
        };
        bytes.extend(self.reals.iter().flat_map(|value| value.to_le_bytes()));
        bytes.extend(self.wholes.iter().flat_map(|value| value.to_le_bytes()));
        outcome
    }
}

/// Makes the calls of a request until one fails, and reads the requested variables.
fn answer(
    instance: &mut dyn Instance,
    request: Request,
    lists: &mut Vec<Values>,
    bytes: &mut Vec<u8>,
) -> Reply {
    let Request { sets, action, reads, once } = request;
    let outcome = sets
        .iter()
        .try_for_each(|values| set(instance, values))
        .and_then(|()| act(instance, action));
    if !action.reads() {
        lists.clear();
    }
    lists.extend(reads.into_iter().map(Values::new));
    bytes.clear();
    let mut reply = Reply { failure: outcome.err(), ..Reply::default() };
    if reply.failure.is_none() && action.reads() {
        let mut once: Vec<Values> = once.into_iter().map(Values::new).collect();
        let read = if once.is_empty() { lists } else { &mut once };
        for (place, list) in read.iter_mut().enumerate() {
            if let Err(failure) = list.read(instance, bytes) {
                reply.unread.push((place, failure));
            }
        }
    }
    reply
}

fn set(instance: &mut dyn Instance, set: &Set) -> Outcome {
    match set {
        Set::Real(references, values) => instance.set_real(references, values),
        Set::Integer(references, values) => instance.set_integer(references, values),
        Set::Boolean(references, values) => instance.set_boolean(references, values),
        Set::Text(reference, value) => instance.set_string(*reference, value),
    }
}

fn act(instance: &mut dyn Instance, action: Action) -> Outcome {
    match action {
        Action::Read | Action::Free => Ok(()),
        Action::EnterInitialization { start, stop } => instance.enter_initialization(start, stop),
        Action::ExitInitialization => instance.exit_initialization(),
        Action::DoStep { time, step } => instance.do_step(time, step),
        Action::Terminate => instance.terminate(),
        Action::Reset => instance.reset(),
    }
}

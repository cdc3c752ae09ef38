//! A control law in the program at the other end of standard input and output, such as a function
//! in Python. It takes the place of the law of a controller's FMU, which stands in for everything
//! else: variables, reference, sampling period, and the limits that the law is judged by.
//!
//! This program writes a message for each request; the other one answers only requests for a
//! moment. A message is its kind as one byte, the number of a flight's law (u64), a time in s
//! (f64), the length of what follows (u32), and what follows, all in little-endian order.

use crate::isolation::page;
use fmi_master::description::{ModelDescription, VariableKind};
use fmi_master::forward;
use fmi_master::instance::{CallFailure, Instance, Outcome};
use parking_lot::Mutex;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Write, stdin, stdout};
#[cfg(unix)]
use std::os::fd::AsFd;
#[cfg(windows)]
use std::os::windows::io::AsHandle;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Kind of a message.
#[derive(Clone, Copy)]
#[repr(u8)]
enum Kind {
    /// A fresh law is to begin a flight. Lines of text follow: the number of the case, empty if it
    /// is none of several, and the name of each value that the law will receive.
    Begin = b'b',
    /// The law is asked for its moment (x, y, z in N m, three f64). Its inputs follow.
    Ask = b'a',
    /// The law is to be as another one is now, whose number follows.
    Copy = b'c',
    /// The law is no longer needed.
    End = b'e',
    /// Output of this program follows.
    Print = b'p',
}

/// One message at a time, with its answer.
static TURN: Mutex<()> = Mutex::new(());
/// Number of the next law.
static NEXT: AtomicU64 = AtomicU64::new(1);

thread_local! {
    static CASE: Cell<Option<u64>> = const { Cell::new(None) };
}

/// Says which case the flights of this thread belong to from now on.
pub fn in_case(case: Option<u64>) {
    CASE.set(case);
    page::in_case(case);
}

/// Standard output as it was when this program began.
static MESSAGES: OnceLock<File> = OnceLock::new();

/// Takes standard output for messages. What else prints there, such as an FMU, prints to standard
/// error from now on.
///
/// # Errors
/// Returns an error if standard output cannot be redirected.
#[allow(unsafe_code)]
pub fn begin() -> io::Result<()> {
    #[cfg(unix)]
    let messages = stdout().as_fd().try_clone_to_owned()?;
    #[cfg(windows)]
    let messages = stdout().as_handle().try_clone_to_owned()?;
    // SAFETY: The call has no effect on memory.
    if unsafe { libc::dup2(2, 1) } == -1 {
        return Err(io::Error::last_os_error());
    }
    let _ = MESSAGES.set(messages.into());
    Ok(())
}

/// Returns the descriptor at which messages are written, if there is a law in another program.
#[cfg(target_os = "linux")]
pub(crate) fn descriptor() -> Option<std::os::fd::RawFd> {
    MESSAGES.get().map(std::os::fd::AsRawFd::as_raw_fd)
}

/// Sends a message, and reads the answer.
fn exchange(kind: Kind, law: u64, time: f64, told: &[u8], answer: &mut [u8]) -> io::Result<()> {
    let _turn = TURN.lock();
    let length = u32::try_from(told.len()).map_err(io::Error::other)?;
    let mut message = Vec::with_capacity(21 + told.len());
    message.push(kind as u8);
    message.extend(law.to_le_bytes());
    message.extend(time.to_le_bytes());
    message.extend(length.to_le_bytes());
    message.extend(told);
    let mut out = MESSAGES.get().ok_or(io::ErrorKind::NotConnected)?;
    out.write_all(&message)?;
    stdin().lock().read_exact(answer)
}

/// Standard output of a program whose law is in another one.
pub struct Printed;

impl Write for Printed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        exchange(Kind::Print, 0, 0.0, bytes, &mut [])?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Variables of a stand-in, by the inputs and the output of the law.
#[derive(Clone, Debug)]
pub(crate) struct Ports {
    /// Real inputs.
    inputs: Vec<u32>,
    /// Reference of the three angles, with two derivatives.
    reference: Vec<u32>,
    /// Inputs to which the reference responds at once.
    external: Vec<u32>,
    moment: Vec<u32>,
    period: u32,
    /// The parameter that chooses the reference, and its value for a reference from outside.
    profile: (u32, i32),
    /// Names of the values that the law receives: inputs, reference, and its last moment.
    names: Vec<String>,
    starts: Vec<f64>,
}

impl Ports {
    /// Finds the variables of a law.
    ///
    /// # Errors
    /// Returns an error that names a variable which the stand-in lacks.
    pub(crate) fn find(description: &ModelDescription) -> Result<Self, String> {
        let named = |name: &str| {
            let found = description.find(name).map(|(place, variable)| (place, variable.reference));
            found.ok_or_else(|| format!("cannot stand in for a law: it has no variable \"{name}\""))
        };
        let kinds = ["reference", "referenceRate", "referenceAcceleration"];
        let angles = ["alpha", "beta", "sigma"];
        let references: Vec<String> =
            kinds.iter().flat_map(|kind| angles.map(|angle| format!("{kind}.{angle}"))).collect();
        let moments = ["x", "y", "z"].map(|axis| format!("moment.{axis}"));
        let found: Vec<_> =
            references.iter().map(|name| named(name)).collect::<Result<_, String>>()?;
        let depended = found.iter().filter_map(|(place, _)| description.dependencies.get(place));
        let external = depended.flatten().map(|place| description.variables[*place].reference);
        let is_real_input = |kind: &VariableKind, causality: &str| {
            causality == "input" && matches!(kind, VariableKind::Real { .. })
        };
        let mut inputs = description.variables.clone();
        inputs.retain(|variable| is_real_input(&variable.kind, &variable.causality));
        let start = |text: &Option<String>| text.as_ref().and_then(|text| text.parse().ok());
        Ok(Self {
            external: external.collect(),
            reference: found.iter().map(|(_, reference)| *reference).collect(),
            moment: moments.iter().map(|name| Ok(named(name)?.1)).collect::<Result<_, String>>()?,
            period: named("period.feedback")?.1,
            profile: {
                let (place, reference) = named("reference.profile")?;
                let mut items = description.variables[place].kind.items().iter();
                let external = items.find(|(name, _)| name == "external");
                (reference, external.map_or(-1, |(_, value)| *value))
            },
            starts: inputs.iter().map(|input| start(&input.start).unwrap_or(0.0)).collect(),
            names: inputs.iter().map(|i| i.name.clone()).chain(references).chain(moments).collect(),
            inputs: inputs.iter().map(|input| input.reference).collect(),
        })
    }
}

/// State that changes from step to step.
#[derive(Clone, Default)]
struct Memory {
    inputs: Vec<f64>,
    reference: Vec<f64>,
    moment: [f64; 3],
    /// Whether the reference responds to inputs that were set for this step.
    responds: bool,
    /// Whether the reference comes from outside.
    is_external: bool,
    start: f64,
    period: f64,
    /// Periods that have begun.
    begun: u64,
}

/// An instance of a controller's FMU whose moment is that of a law in another program.
pub(crate) struct LawInstance {
    stand_in: Box<dyn Instance>,
    ports: Ports,
    law: u64,
    now: Memory,
    /// Kept states, each with the number of a law that is as this one was.
    kept: BTreeMap<usize, (u64, Memory)>,
}

impl LawInstance {
    pub(crate) fn new(stand_in: Box<dyn Instance>, ports: Ports) -> Self {
        let law = NEXT.fetch_add(1, Ordering::Relaxed);
        Self { stand_in, ports, law, now: Memory::default(), kept: BTreeMap::new() }
    }

    fn inside(&mut self, call: impl FnOnce(&mut dyn Instance) -> Outcome) -> Outcome {
        call(self.stand_in.as_mut())
    }

    /// Notes the reference, which is that of the communication point unless it responds to inputs.
    fn read_reference(&mut self) -> Outcome {
        self.stand_in.get_real(&self.ports.reference, &mut self.now.reference)
    }

    /// Asks the law if a period has begun since it was asked last.
    fn ask(&mut self, time: f64) -> Outcome {
        let periods = (time - self.now.start) / self.now.period;
        // Times are rounded, and a period that begins at this instant has begun.
        let begun = (periods * (1.0 + 1e-9) + 1e-9).floor() as u64 + 1;
        if begun <= self.now.begun {
            return Ok(());
        }
        self.now.begun = begun;
        let Memory { inputs, reference, moment, .. } = &self.now;
        let told = inputs.iter().chain(reference).chain(moment);
        let told: Vec<u8> = told.flat_map(|value| value.to_le_bytes()).collect();
        let mut answer = [0; 24];
        sent("doStep", exchange(Kind::Ask, self.law, time, &told, &mut answer))?;
        for (value, bytes) in self.now.moment.iter_mut().zip(answer.as_chunks::<8>().0) {
            *value = f64::from_le_bytes(*bytes);
        }
        Ok(())
    }
}

/// Converts the failure of a message to that of a call.
fn sent(call: &'static str, outcome: io::Result<()>) -> Outcome {
    outcome.map_err(|error| {
        CallFailure::new(call, format!("the program with the control law has ended: {error}"))
    })
}

impl Instance for LawInstance {
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
        self.stand_in.get_real(references, values)?;
        for (reference, value) in references.iter().zip(values) {
            if let Some(axis) = self.ports.moment.iter().position(|moment| moment == reference) {
                *value = self.now.moment[axis];
            }
        }
        Ok(())
    }

    forward! {
        inside: get_integer, get_boolean, set_integer, set_boolean, set_string, terminate
    }

    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome {
        if self.now.inputs.is_empty() {
            self.now.inputs.clone_from(&self.ports.starts);
        }
        for (reference, value) in references.iter().zip(values) {
            if let Some(place) = self.ports.inputs.iter().position(|input| input == reference) {
                self.now.inputs[place] = *value;
            }
            self.now.responds |= self.ports.external.contains(reference);
        }
        self.stand_in.set_real(references, values)
    }

    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
        let case = CASE.get().map_or(String::new(), |case| case.to_string());
        let what = format!("{case}\n{}", self.ports.names.join("\n"));
        let begun = exchange(Kind::Begin, self.law, start, what.as_bytes(), &mut []);
        sent("enterInitializationMode", begun)?;
        self.stand_in.enter_initialization(start, stop)?;
        let mut period = [0.0];
        self.stand_in.get_real(&[self.ports.period], &mut period)?;
        let inputs = if self.now.inputs.is_empty() { &self.ports.starts } else { &self.now.inputs };
        let reference = vec![0.0; self.ports.reference.len()];
        let ([period], mut profile) = (period, [0]);
        self.stand_in.get_integer(&[self.ports.profile.0], &mut profile)?;
        let is_external = profile == [self.ports.profile.1];
        let inputs = inputs.clone();
        self.now = Memory { inputs, reference, is_external, start, period, ..Memory::default() };
        Ok(())
    }

    fn exit_initialization(&mut self) -> Outcome {
        self.stand_in.exit_initialization()?;
        self.now.responds = false;
        self.read_reference()
    }

    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        let responds = std::mem::take(&mut self.now.responds) && self.now.is_external;
        if !responds {
            self.ask(time)?;
        }
        self.stand_in.do_step(time, step)?;
        self.read_reference()?;
        if responds { self.ask(time) } else { Ok(()) }
    }

    fn reset(&mut self) -> Outcome {
        self.now = Memory::default();
        self.stand_in.reset()
    }

    fn save(&mut self, number: usize) -> Outcome {
        self.stand_in.save(number)?;
        let copy = self.kept.get(&number).map(|(law, _)| *law);
        let copy = copy.unwrap_or_else(|| NEXT.fetch_add(1, Ordering::Relaxed));
        let law = self.law.to_le_bytes();
        sent("getFMUstate", exchange(Kind::Copy, copy, 0.0, &law, &mut []))?;
        self.kept.insert(number, (copy, self.now.clone()));
        Ok(())
    }

    fn restore(&mut self, number: usize) -> Outcome {
        self.stand_in.restore(number)?;
        let (copy, memory) = self
            .kept
            .get(&number)
            .ok_or_else(|| CallFailure::new("setFMUstate", "there is no such state"))?;
        let law = copy.to_le_bytes();
        sent("setFMUstate", exchange(Kind::Copy, self.law, 0.0, &law, &mut []))?;
        self.now = memory.clone();
        Ok(())
    }
}

impl Drop for LawInstance {
    fn drop(&mut self) {
        let copies = self.kept.values().map(|(law, _)| *law);
        for law in copies.chain([self.law]) {
            // If the other program has ended, it keeps no law.
            let _ = exchange(Kind::End, law, 0.0, &[], &mut []);
        }
    }
}

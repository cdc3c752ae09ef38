//! The process of an instance, as the master sees it: it is started, asked, watched, and ended.

use super::channel::{Channel, LARGEST, Slot};
use super::ended::ended;
use super::memory::Memory;
use super::protocol::{Action, Ready, Reply, Request, Setup};
use super::settings::{COMMAND, Isolation};
use crate::fmi;
use crate::log::{Log, LogMessage};
use fmi_master::instance::CallFailure;
use parking_lot::Mutex;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::ffi::OsStr;
use std::io::{self, BufRead, BufReader, PipeReader};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time within which an instance must be freed, and its process ended.
const FREE_TIMEOUT: Duration = Duration::from_secs(10);
/// Time within which the last output of an ended process must have arrived.
const OUTPUT_TIMEOUT: Duration = Duration::from_millis(200);
/// Largest number of bytes of a printed line that is passed on.
const LINE: usize = 2000;

/// Failures that came when the run was over.
static LATE: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Returns the failures that came when a run was over, of instances that could not be freed, and
/// clears them.
pub fn late_failures() -> Vec<String> {
    std::mem::take(&mut LATE.lock())
}

/// The process of an instance.
pub(super) struct Process {
    child: Child,
    channel: Channel,
    /// The memory, until the process has opened it.
    memory: Option<Memory>,
    number: u32,
    /// The last message, and the position at which the values behind it begin.
    bytes: Vec<u8>,
    values: usize,
    log: Log,
    printed: Arc<Printed>,
    timeout: Duration,
    /// Number of bytes of memory that it may use.
    memory_limit: Option<u64>,
    /// Call whose answer was not waited for yet.
    pending: Option<&'static str>,
    /// Reason why the process can no longer be called, if so.
    gone: Option<String>,
}

/// Output of the process.
#[derive(Default)]
struct Printed {
    last: Mutex<String>,
    is_over: AtomicBool,
}

/// Reason why a wait has ended without an answer.
enum NoAnswer {
    Ended(ExitStatus),
    Late,
    /// It uses more memory than it may, in bytes.
    Memory(u64),
    Fault(io::Error),
}

impl Process {
    /// Starts a process, which then waits for [`Self::set_up`].
    ///
    /// In a sandbox it works in the `folder` of the archive, which is also its home and its place
    /// for temporary files. Its environment has only language, time zone and library paths.
    pub(super) fn start(
        program: &Path,
        name: &str,
        isolation: &Isolation,
        folder: &Path,
    ) -> io::Result<Self> {
        let (memory, channel) = Memory::new()?;
        let (prints, pipe) = io::pipe()?;
        let mut command = Command::new(program);
        command.arg(COMMAND).stdin(Stdio::piped());
        command.stdout(pipe.try_clone()?).stderr(pipe);
        memory.pass(&mut command)?;
        if isolation.sandbox {
            command.current_dir(folder).env_clear();
            command.envs(std::env::vars_os().filter(|(name, _)| passes(name)));
            command.envs(["HOME", "TMPDIR", "TMP", "TEMP"].map(|name| (name, folder)));
        }
        apart(&mut command);
        let child = command.spawn()?;
        // The command holds the writing end of the pipe, which must be closed when the process
        // ends.
        drop(command);
        let printed = Arc::new(Printed::default());
        let (heard, component) = (Arc::clone(&printed), name.to_string());
        std::thread::spawn(move || heard.listen(&component, prints));
        Ok(Self {
            child,
            channel,
            memory: Some(memory),
            number: 0,
            bytes: Vec::new(),
            values: 0,
            log: Log::new(name),
            printed,
            timeout: isolation.call_timeout,
            memory_limit: isolation.memory,
            pending: None,
            gone: None,
        })
    }

    /// Lets the process load its library and make an instance.
    pub(super) fn set_up(&mut self, setup: &Setup) -> Result<Ready, CallFailure> {
        self.put("instantiate", setup)?;
        let mut ready = self.answer("instantiate")?;
        // Both processes have opened the memory. Systems that cannot remove a file in use remove it
        // later.
        if cfg!(unix) {
            self.memory = None;
        }
        if let Ready::Loaded { messages, .. } | Ready::Refused { messages, .. } = &mut ready {
            self.repeat(std::mem::take(messages));
        }
        self.log.is_instantiated();
        if !matches!(ready, Ready::Loaded { .. }) {
            // The process has ended in order.
            self.gone = Some("there is no instance".into());
        }
        Ok(ready)
    }

    /// Asks for calls and values.
    pub(super) fn ask(
        &mut self,
        call: &'static str,
        request: &Request,
    ) -> Result<Reply, CallFailure> {
        self.send(call, request)?;
        self.reply(call)
    }

    /// Asks without waiting for the answer, which [`Self::reply`] returns.
    pub(super) fn send(
        &mut self,
        call: &'static str,
        request: &Request,
    ) -> Result<(), CallFailure> {
        // An answer that was never fetched is no longer needed.
        if let Some(last) = self.pending.take() {
            self.reply(last)?;
        }
        self.put(call, request)?;
        self.pending = Some(call);
        Ok(())
    }

    /// Waits for the answer to what was sent.
    pub(super) fn reply(&mut self, call: &'static str) -> Result<Reply, CallFailure> {
        self.pending = None;
        let mut reply: Reply = self.answer(call)?;
        self.repeat(std::mem::take(&mut reply.messages));
        Ok(reply)
    }

    fn repeat(&self, messages: Vec<LogMessage>) {
        for LogMessage { status, category, text } in messages {
            self.log.message(fmi::status(status), &category, &text);
        }
    }

    fn put(&mut self, call: &'static str, message: &impl Serialize) -> Result<(), CallFailure> {
        if let Some(reason) = &self.gone {
            return Err(CallFailure::new(call, reason.clone()));
        }
        self.bytes.clear();
        let bytes = postcard::to_extend(message, std::mem::take(&mut self.bytes));
        self.bytes = bytes.map_err(|error| CallFailure::new(call, error.to_string()))?;
        if self.bytes.len() > LARGEST {
            return Err(CallFailure::new(call, "there are too many values for one message"));
        }
        self.number = self.number.wrapping_add(1);
        self.channel.put(Slot::Request, self.number, &self.bytes);
        Ok(())
    }

    fn answer<T: DeserializeOwned>(&mut self, call: &'static str) -> Result<T, CallFailure> {
        let (child, timeout, most) = (&mut self.child, self.timeout, self.memory_limit);
        let waited = self.channel.wait(Slot::Reply, self.number, |waited| match child.try_wait() {
            Ok(Some(status)) => Err(NoAnswer::Ended(status)),
            Err(error) => Err(NoAnswer::Fault(error)),
            Ok(None) if waited > timeout => Err(NoAnswer::Late),
            Ok(None) => match most {
                Some(most) if memory(child.id()) > most => Err(NoAnswer::Memory(most)),
                _ => Ok(()),
            },
        });
        // A process may end right after its last answer.
        if let Err(no_answer) = waited
            && !self.channel.has(Slot::Reply, self.number)
        {
            return Err(self.end(call, &no_answer));
        }
        self.channel.copy(Slot::Reply, &mut self.bytes);
        match postcard::take_from_bytes(&self.bytes) {
            Ok((answer, behind)) => {
                self.values = self.bytes.len() - behind.len();
                Ok(answer)
            }
            Err(_) => Err(self.undecodable(call)),
        }
    }

    /// Returns the bytes of the values that came with the last answer.
    pub(super) fn values(&self) -> &[u8] {
        &self.bytes[self.values..]
    }

    /// Ends a process whose answer cannot be decoded, and returns the failure.
    pub(super) fn undecodable(&mut self, call: &'static str) -> CallFailure {
        self.kill();
        let reason = "its process gave an answer that cannot be decoded";
        self.gone = Some(reason.into());
        CallFailure::new(call, reason)
    }

    fn end(&mut self, call: &'static str, no_answer: &NoAnswer) -> CallFailure {
        let reason = match no_answer {
            NoAnswer::Ended(status) => ended(*status),
            NoAnswer::Late => {
                format!("no answer within {} s (call_timeout)", self.timeout.as_secs_f64())
            }
            NoAnswer::Memory(most) => {
                format!("it uses more than {} MiB of memory (memory)", most >> 20)
            }
            NoAnswer::Fault(error) => format!("its process cannot be watched: {error}"),
        };
        self.kill();
        let output = self.last_message();
        let output = output.map(|text| format!("; its last output: {text}")).unwrap_or_default();
        let reason = reason + &output;
        self.gone = Some(format!("its process has ended: {reason}"));
        CallFailure::new(call, reason)
    }

    /// Returns the last message of the instance about a problem, or else the last line that it
    /// printed.
    fn last_message(&self) -> Option<String> {
        let begin = Instant::now();
        while !self.printed.is_over.load(Ordering::SeqCst) && begin.elapsed() < OUTPUT_TIMEOUT {
            std::thread::sleep(Duration::from_millis(1));
        }
        let mut bytes = Vec::new();
        self.channel.copy(Slot::LastMessage, &mut bytes);
        let logged = String::from_utf8_lossy(&bytes[..bytes.len().min(LINE)]).into_owned();
        let printed = self.printed.last.lock().clone();
        [logged, printed].into_iter().find(|text| !text.is_empty())
    }

    /// Ends the process, if it has not ended already, and all processes that it has started.
    fn kill(&mut self) {
        let _ = self.child.kill();
        end_group(&self.child);
        let _ = self.child.wait();
    }

    /// Frees the instance and ends the process.
    fn free(&mut self) -> Result<(), CallFailure> {
        self.timeout = self.timeout.min(FREE_TIMEOUT);
        // The run ended, by the failure of another instance, before it needed this answer.
        if let Some(last) = self.pending.take()
            && self.reply(last).is_err()
        {
            return Ok(());
        }
        let call = Action::Free.call();
        self.ask(call, &Request { action: Action::Free, ..Request::default() })?;
        let begin = Instant::now();
        loop {
            match self.child.try_wait() {
                Ok(Some(status)) if status.success() => return Ok(()),
                Ok(Some(status)) => return Err(self.end(call, &NoAnswer::Ended(status))),
                Ok(None) if begin.elapsed() > self.timeout => {
                    return Err(self.end(call, &NoAnswer::Late));
                }
                Ok(None) => std::thread::sleep(Duration::from_micros(200)),
                Err(error) => return Err(self.end(call, &NoAnswer::Fault(error))),
            }
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if self.gone.is_none()
            && let Err(failure) = self.free()
        {
            let text =
                format!("{} failed in {}: {}", self.log.component, failure.call, failure.message);
            LATE.lock().push(text);
        }
        self.kill();
    }
}

/// Returns whether a variable of the environment is passed on into a sandbox.
fn passes(name: &OsStr) -> bool {
    let name = name.to_string_lossy();
    name.starts_with("LC_") || ["LANG", "LANGUAGE", "TZ", "LD_LIBRARY_PATH"].contains(&&*name)
}

impl Printed {
    /// Passes on the output of the process, until it ends.
    fn listen(&self, component: &str, prints: PipeReader) {
        let mut prints = BufReader::new(prints);
        let mut line = Vec::new();
        while let Ok(1..) = io::Read::take(&mut prints, LINE as u64).read_until(b'\n', &mut line) {
            let text = String::from_utf8_lossy(&line).trim_end().to_string();
            if !text.is_empty() {
                tracing::info!("{component} prints: {text}");
                *self.last.lock() = text;
            }
            line.clear();
        }
        self.is_over.store(true, Ordering::SeqCst);
    }
}

/// Returns how many bytes of memory a process has written, alone or together with others. The
/// system's limit, which the process sets itself, does not count the latter.
fn memory(process: u32) -> u64 {
    // There is no such file where the system is another one, or when the process has ended.
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let kib = |line: &str| {
        let number = line.strip_prefix("RssAnon:").or_else(|| line.strip_prefix("RssShmem:"))?;
        number.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()
    };
    1024 * status.lines().filter_map(kib).sum::<u64>()
}

/// Gives the process a session of its own: it has no controlling terminal, so Ctrl-C does not reach
/// it (the master ends it in order), and it can write no command into the user's shell.
#[cfg(unix)]
#[allow(unsafe_code)]
fn apart(command: &mut Command) {
    use std::os::unix::process::CommandExt;
    let session = || Ok(rustix::process::setsid().map(drop)?);
    // SAFETY: the closure makes one system call, which may be made between fork and exec.
    unsafe { command.pre_exec(session) };
}

/// Ends the processes of the group that this process leads.
#[cfg(unix)]
fn end_group(leader: &Child) {
    use rustix::process::{Pid, Signal, kill_process_group};
    // The system does not give the number to another group so soon after the leader has ended.
    if let Some(group) = i32::try_from(leader.id()).ok().and_then(Pid::from_raw) {
        let _ = kill_process_group(group, Signal::KILL);
    }
}

#[cfg(not(unix))]
fn end_group(_leader: &Child) {}

/// Keeps Ctrl-C from the process: the master ends it in order.
#[cfg(windows)]
fn apart(command: &mut Command) {
    use std::os::windows::process::CommandExt;
    /// Of Windows' processthreadsapi.h.
    const CREATE_NEW_PROCESS_GROUP: u32 = 0x200;
    command.creation_flags(CREATE_NEW_PROCESS_GROUP);
}

#[cfg(not(any(unix, windows)))]
fn apart(_command: &mut Command) {}

//! A closed process, as its supervisor sees it: it is forked, heard, watched, and ended.

#![allow(unsafe_code)]

use super::ended::ended;
use super::inside::{self, Kind, Link, Pipes};
use super::page::{Doing, Page, SLOTS};
use super::seal::Seal;
use super::{Closing, Ended, LastCall};
use crate::folder::TemporaryFolder;
use crate::warnings;
use fmi_master::instance::CallFailure;
use rustix::fs::{OFlags, fcntl_setfl};
use serde::de::DeserializeOwned;
use std::fs::File;
use std::io::{self, PipeReader, Read, Write};
use std::ops::ControlFlow;
use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::fs::MetadataExt;
use std::os::unix::process::ExitStatusExt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitStatus;
use std::time::{Duration, Instant};

/// Time within which a process that is asked to end must have ended.
const END_TIMEOUT: Duration = Duration::from_millis(800);
/// Time between two looks at a process.
const PAUSE: Duration = Duration::from_millis(1);
/// Largest time that counts between two looks: the supervisor itself may have been stopped.
const LONGEST_PAUSE: Duration = Duration::from_millis(100);
/// Largest number of threads of a process.
const THREADS: u64 = 512;
/// Size of a pipe, in bytes. No more are read at a time: an instance may write as fast as that.
const PIPE: usize = 1 << 20;
/// Largest number of bytes of a printed line that is passed on.
const LINE: usize = 2000;

/// A closed process.
pub struct Closed {
    process: libc::pid_t,
    page: Page,
    /// What it sends.
    messages: PipeReader,
    seal: Seal,
    received: Vec<u8>,
    prints: PipeReader,
    /// The line that it is printing, and the last one.
    printing: Vec<u8>,
    printed: String,
    is_done: bool,
    refusal: Option<String>,
    /// Warnings that it has not printed if it fails.
    warnings: Vec<String>,
    timeout: Duration,
    /// When the process was looked at last, the number of calls of each thread then, and for how
    /// long it has been in this call.
    looked: Instant,
    calls: [(u64, Duration); SLOTS],
    /// Thread whose call is late.
    late: Option<usize>,
    /// Time since the process was asked to end.
    ending: Option<Duration>,
    status: Option<ExitStatus>,
    /// Its home, which is removed when it has ended.
    _home: TemporaryFolder,
}

/// Returns whether the system has Landlock. Its version needs no resource that may be scarce.
pub(super) fn is_there() -> bool {
    // SAFETY: without rules, of size 0, and with this flag the kernel tells its version, and no more.
    unsafe { libc::syscall(libc::SYS_landlock_create_ruleset, 0_usize, 0_usize, 1_u32) > 0 }
}

/// Makes a pipe whose reading end never waits.
fn pipe() -> io::Result<(PipeReader, File)> {
    let (reader, writer) = io::pipe()?;
    fcntl_setfl(&reader, OFlags::NONBLOCK)?;
    // As large as any user may have it, so that a quick run need not wait between two looks.
    // SAFETY: the call takes numbers only.
    unsafe { libc::fcntl(reader.as_raw_fd(), libc::F_SETPIPE_SZ, PIPE) };
    Ok((reader, File::from(OwnedFd::from(writer))))
}

impl Closed {
    /// Forks a closed process that does this work. This process must have one thread.
    ///
    /// # Errors
    /// Returns why the system cannot start the process.
    pub fn begin(closing: &Closing, work: impl FnOnce(&mut Link)) -> Result<Self, Ended> {
        Self::forked(closing, work).map_err(|error| {
            Ended::Refused(format!("this system cannot start a closed process: {error}"))
        })
    }

    fn forked(closing: &Closing, work: impl FnOnce(&mut Link)) -> io::Result<Self> {
        // Locks that other threads hold would stay locked for ever in the new process.
        if std::fs::read_dir("/proc/self/task")?.count() > 1 {
            return Err(io::Error::other("there are other threads"));
        }
        let home = TemporaryFolder::new()?;
        let page = Page::new()?;
        let ((messages, outlet), (prints, print)) = (pipe()?, pipe()?);
        let (seal, supervisor) = (Seal::new(), std::process::id());
        // SAFETY: this process has one thread. The new one leaves its values as they are when it
        // ends, so that nothing of this one is dropped twice.
        let process = unsafe { libc::fork() };
        if process == 0 {
            page.write_here();
            let pipes = Pipes { messages: outlet, seal, prints: print };
            let work = || {
                let link = inside::enter(pipes, closing, home.path(), supervisor);
                let (kind, reason) = match link {
                    Ok(mut link) => {
                        work(&mut link);
                        (Kind::Done, String::new())
                    }
                    Err(reason) => (Kind::Refusal, reason),
                };
                // If nobody listens any more, there is nobody to tell.
                let _ = inside::send_bytes(kind, reason.as_bytes());
            };
            // A panic has been printed.
            let code = catch_unwind(AssertUnwindSafe(work)).map_or(101, |()| 0);
            // SAFETY: this ends the process at once.
            unsafe { libc::_exit(code) };
        }
        if process < 0 {
            return Err(io::Error::last_os_error());
        }
        Ok(Self {
            process,
            page,
            messages,
            seal,
            received: Vec::new(),
            prints,
            printing: Vec::new(),
            printed: String::new(),
            is_done: false,
            refusal: None,
            warnings: Vec::new(),
            timeout: closing.call_timeout,
            looked: Instant::now(),
            calls: [(0, Duration::ZERO); SLOTS],
            late: None,
            ending: None,
            status: None,
            _home: home,
        })
    }

    /// Hears what the process says until it has ended. If `asked` gives a signal, it is passed on
    /// once; if `hear` breaks off, the process is asked to end, and what it says is still heard.
    ///
    /// # Errors
    /// Returns how the process ended before its work was done.
    pub fn hear<M: DeserializeOwned>(
        &mut self,
        asked: impl Fn() -> Option<i32>,
        mut hear: impl FnMut(M) -> ControlFlow<()>,
    ) -> Result<(), Ended> {
        loop {
            self.pass_on(asked());
            if let Some(outcome) = self.look(&mut hear) {
                return outcome;
            }
            std::thread::sleep(PAUSE);
        }
    }

    /// Passes a signal on, which asks the process to end. Further ones are not passed on.
    fn pass_on(&mut self, signal: Option<i32>) {
        if let Some(signal) = signal
            && self.status.is_none()
            && self.ending.is_none()
        {
            // SAFETY: the process was not waited for yet, so that its number is still its own.
            unsafe { libc::kill(self.process, signal) };
            self.ending = Some(Duration::ZERO);
        }
    }

    /// Looks at the process without waiting, and hands on what it has said. Returns how it has
    /// ended, if it has.
    fn look<M: DeserializeOwned>(
        &mut self,
        hear: &mut dyn FnMut(M) -> ControlFlow<()>,
    ) -> Option<Result<(), Ended>> {
        // What it said before its end is there once it has ended.
        let has_ended = self.has_ended();
        self.read_prints();
        let heard = self.read_messages(hear).map_err(|reason| self.garbled(&reason));
        let late = self.late();
        match self.status {
            Some(status) if has_ended && status.success() && self.is_done => Some(heard),
            Some(status) if has_ended => Some(Err(self.failed(&ended(status)))),
            _ => {
                let failed = heard.err().or_else(|| late.map(|reason| self.failed(&reason)))?;
                self.kill();
                Some(Err(failed))
            }
        }
    }

    fn has_ended(&mut self) -> bool {
        if self.status.is_none() {
            let mut status = 0;
            // SAFETY: the pointer is valid for the call, and the process was not waited for yet.
            let ended = unsafe { libc::waitpid(self.process, &raw mut status, libc::WNOHANG) };
            self.status = (ended != 0).then(|| ExitStatus::from_raw(status));
        }
        self.status.is_some()
    }

    fn kill(&mut self) {
        if self.status.is_none() {
            let mut status = 0;
            // SAFETY: the process was not waited for yet, so that its number is still its own.
            unsafe {
                libc::kill(self.process, libc::SIGKILL);
                libc::waitpid(self.process, &raw mut status, 0);
            }
            self.status = Some(ExitStatus::from_raw(status));
        }
    }

    /// Returns why the process is too late or has too many threads, if it is or has.
    fn late(&mut self) -> Option<String> {
        let now = Instant::now();
        let passed = now.duration_since(self.looked).min(LONGEST_PAUSE);
        self.looked = now;
        for (place, calls) in self.page.calls().into_iter().enumerate() {
            let (before, waited) = &mut self.calls[place];
            let is_same = calls % 2 == 1 && calls == *before;
            (*before, *waited) = (calls, if is_same { *waited + passed } else { Duration::ZERO });
            if *waited > self.timeout {
                self.late = Some(place);
            }
        }
        if let Some(ending) = &mut self.ending {
            *ending += passed;
        }
        // A folder has two links besides those to its folders.
        let tasks = std::fs::metadata(format!("/proc/{}/task", self.process));
        if tasks.is_ok_and(|tasks| tasks.nlink() > THREADS + 2) {
            return Some(format!("its process has more than {THREADS} threads"));
        }
        if self.ending > Some(END_TIMEOUT) {
            return Some("its process was asked to end, and did not".into());
        }
        let seconds = self.timeout.as_secs_f64();
        self.late.map(|_| format!("no answer within {seconds} s (call_timeout)"))
    }

    /// Reads what the process has printed.
    fn read_prints(&mut self) {
        for byte in read(&mut self.prints) {
            if byte != b'\n' && self.printing.len() < LINE {
                self.printing.push(byte);
                continue;
            }
            self.end_line();
        }
        if self.status.is_some() {
            self.end_line();
        }
    }

    fn end_line(&mut self) {
        let text = String::from_utf8_lossy(&self.printing).trim_end().to_string();
        if !text.is_empty() {
            tracing::info!("an FMU prints: {text}");
            self.printed = text;
        }
        self.printing.clear();
    }

    /// Reads what the process has sent.
    ///
    /// # Errors
    /// Returns what is wrong with it.
    fn read_messages<M: DeserializeOwned>(
        &mut self,
        hear: &mut dyn FnMut(M) -> ControlFlow<()>,
    ) -> Result<(), String> {
        let undecodable = || "its process sent what cannot be decoded".to_string();
        self.received.extend(read(&mut self.messages));
        let mut received = std::mem::take(&mut self.received);
        let mut left = received.as_slice();
        while let Some((header, rest)) = left.split_first_chunk() {
            let (kind, length) = self.seal.opened(header).ok_or_else(undecodable)?;
            let Some((content, rest)) = rest.split_at_checked(length) else { break };
            if self.is_done {
                return Err(undecodable());
            }
            self.seal.number += 1;
            let text = || String::from_utf8_lossy(content).into_owned();
            match kind {
                b'm' => {
                    let message = postcard::from_bytes(content).map_err(|_| undecodable())?;
                    if hear(message).is_break() {
                        self.pass_on(Some(libc::SIGTERM));
                    }
                }
                b'l' => print(&text()),
                b'w' => self.warnings.push(text()),
                // No instance has been called before.
                b'r' if self.seal.number == 1 => self.refusal = Some(text()),
                b'd' => self.is_done = true,
                _ => return Err(undecodable()),
            }
            left = rest;
        }
        let begin = received.len() - left.len();
        received.drain(..begin);
        self.received = received;
        Ok(())
    }

    /// Describes an end because of what was sent. Only a call that has lasted since the process was
    /// looked at before has certainly sent it.
    fn garbled(&self, reason: &str) -> Ended {
        let calls = self.page.calls();
        let lasts = |place: &usize| calls[*place] % 2 == 1 && calls[*place] == self.calls[*place].0;
        let culprit = (0..SLOTS).find(lasts).and_then(|place| self.page.culprit(Some(place)));
        self.told(reason, culprit)
    }

    /// Describes the end of the process.
    fn failed(&self, reason: &str) -> Ended {
        self.told(reason, self.page.culprit(self.late))
    }

    fn told(&self, reason: &str, culprit: Option<Doing>) -> Ended {
        if let Some(reason) = &self.refusal {
            return Ended::Refused(format!("this system cannot close {reason}"));
        }
        for warning in &self.warnings {
            tracing::warn!("{warning}");
        }
        let output = [self.page.words(), self.printed.clone()];
        let output = output.into_iter().find(|text| !text.is_empty());
        let output = output.map(|text| format!("; its last output: {text}")).unwrap_or_default();
        let message = reason.to_string() + &output;
        let failure = CallFailure::new("a thread of its own", message);
        let mut last =
            LastCall { component: None, time: self.page.time(), case: None, part: None, failure };
        if let Some(Doing { component, call, time, case, part }) = culprit {
            let failure = CallFailure { call: call.into(), ..last.failure };
            last = LastCall { component: Some(component), time, case, part, failure };
        }
        Ended::Failed(Box::new(last))
    }
}

/// Reads what a pipe holds.
fn read(from: &mut PipeReader) -> Vec<u8> {
    let mut bytes = Vec::new();
    // It fails where there is no more.
    let _ = from.take(PIPE as u64).read_to_end(&mut bytes);
    bytes
}

/// Prints a line of a log, without what could change the terminal.
fn print(line: &str) {
    if warnings::is_repeated(line) {
        return;
    }
    let shown = line.trim_end().chars().map(|it| if it.is_control() { ' ' } else { it });
    let _ = writeln!(io::stderr(), "{}", shown.collect::<String>());
}

impl Drop for Closed {
    fn drop(&mut self) {
        self.kill();
    }
}

//! Instances in processes of their own. An instance that crashes, ends its process, or never
//! answers then fails like one that returns an error: the master goes on, and says which instance
//! it was and in which call.
//!
//! | module | what it knows |
//! |---|---|
//! | `channel` | memory that both processes share |
//! | `protocol` | the messages in it |
//! | `host` | the process of the instance, which makes the calls |
//! | `process`, `remote` | its master's side: a process that is watched, and the instance it stands for |
//! | `settings`, `limits`, `sandbox` | what the process may use |

mod channel;
mod host;
mod limits;
mod process;
mod protocol;
mod remote;
#[cfg(target_os = "linux")]
mod sandbox;
mod settings;

pub use host::serve;
pub use process::late_failures;
pub use settings::{COMMAND, Isolation};

use crate::instance::Instance;
use process::Process;
use protocol::{InstanceArguments, Limits, Ready, Setup};
use remote::RemoteInstance;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Program that is started for an instance.
static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// Says that this process' program has the command [`COMMAND`], so that instances can have
/// processes of their own.
pub fn enable() {
    // On Linux this is the program that runs, also if its file was replaced since. Other systems
    // may have such a file, too: under Wine it is Wine itself.
    let own = Path::new("/proc/self/exe");
    let own = if cfg!(target_os = "linux") && own.exists() {
        Ok(own.to_path_buf())
    } else {
        std::env::current_exe()
    };
    if let Ok(own) = own {
        PROGRAM.get_or_init(|| own);
    }
}

/// Returns whether instances can have processes of their own.
pub fn is_enabled() -> bool {
    PROGRAM.get().is_some()
}

/// What became of a library in a process of its own.
pub(crate) enum Loaded<T> {
    /// It was loaded. The text says what is wrong with the version of FMI that it names.
    Whole(T, Option<String>),
    /// The system could not load it, for this reason.
    Unloadable(String),
    /// The instance refused or failed, for this reason.
    Refused(String),
}

/// A library with what is needed to make a process for it.
pub(crate) struct Library<'a> {
    pub(crate) file: PathBuf,
    /// Folder of the unpacked archive.
    pub(crate) folder: &'a Path,
    pub(crate) isolation: &'a Isolation,
}

impl Library<'_> {
    /// Makes an instance in a process of its own.
    pub(crate) fn instantiate(
        self,
        name: &str,
        guid: &str,
        resources: &str,
    ) -> Loaded<Box<dyn Instance>> {
        let (guid, resources) = (guid.into(), resources.into());
        let instance = InstanceArguments { name: name.into(), guid, resources };
        let refused = |reason: &str| Loaded::Refused(format!("the component \"{name}\" {reason}"));
        match self.load(name, Some(instance)) {
            Loaded::Whole(process, fault) => {
                Loaded::Whole(Box::new(RemoteInstance::new(process)), fault)
            }
            Loaded::Unloadable(reason) => Loaded::Unloadable(reason),
            Loaded::Refused(reason) => refused(&reason),
        }
    }

    /// Loads the library in a process of its own, and ends it.
    pub(crate) fn check(self, name: &str) -> Loaded<()> {
        match self.load(name, None) {
            Loaded::Whole(_, fault) => Loaded::Whole((), fault),
            Loaded::Unloadable(reason) => Loaded::Unloadable(reason),
            Loaded::Refused(reason) => Loaded::Refused(reason),
        }
    }

    fn load(self, name: &str, instance: Option<InstanceArguments>) -> Loaded<Process> {
        let Some(program) = PROGRAM.get() else {
            return Loaded::Refused("has no process: this program cannot make any".into());
        };
        let mut process = match Process::start(program, name, self.isolation) {
            Ok(process) => process,
            Err(error) => return Loaded::Refused(format!("has no process: {error}")),
        };
        let limits = Limits {
            memory: self.isolation.memory,
            cpu: self.isolation.cpu,
            folder: self.isolation.sandbox.then(|| self.folder.to_path_buf()),
        };
        match process.set_up(&Setup { library: self.file, instance, limits }) {
            Ok(Ready::Loaded { version_fault, without, .. }) => {
                if let Some(without) = without {
                    crate::warnings::warn_once(format!(
                        "this system does not limit these for instances: {without}"
                    ));
                }
                Loaded::Whole(process, version_fault)
            }
            Ok(Ready::Unloadable(reason)) => Loaded::Unloadable(reason),
            Ok(Ready::Refused { reason, .. }) => Loaded::Refused(reason),
            Err(failure) => {
                Loaded::Refused(format!("failed in {}: {}", failure.call, failure.message))
            }
        }
    }
}

//! Instances in processes of their own. An instance that crashes, ends its process, or never
//! answers then fails like one that returns an error: the master goes on, and names the instance
//! and the call.
//!
//! | module | content |
//! |---|---|
//! | `memory`, `channel` | memory that both processes share, and how it is used |
//! | `protocol` | the messages in it |
//! | `host` | the process of the instance, which makes the calls |
//! | `process`, `ended`, `remote` | the master's side: the process that is watched, how it has ended, and the instance in it |
//! | `settings`, `limits`, `sandbox` | resources that the process may use |

mod channel;
mod ended;
mod host;
mod limits;
mod memory;
mod process;
mod protocol;
mod remote;
#[cfg(target_os = "linux")]
mod sandbox;
mod settings;

pub use host::serve;
pub use process::late_failures;
pub use settings::{COMMAND, Isolation};

use crate::loading::{Kind, Made, Refusal};
use process::Process;
use protocol::{InstanceArguments, Limits, Ready, Setup};
use remote::RemoteInstance;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Program that is started for each instance.
static PROGRAM: OnceLock<PathBuf> = OnceLock::new();

/// Declares that this program has the command [`COMMAND`], so that instances can have processes of
/// their own.
pub fn enable() {
    // On Linux this is the running program, even if its file was replaced since. Other systems may
    // have such a file, too: under Wine it is Wine itself.
    let program = Path::new("/proc/self/exe");
    let program = if cfg!(target_os = "linux") && program.exists() {
        Ok(program.to_path_buf())
    } else {
        std::env::current_exe()
    };
    if let Ok(program) = program {
        PROGRAM.get_or_init(|| program);
    }
}

/// Returns whether instances can have processes of their own.
pub fn is_enabled() -> bool {
    PROGRAM.get().is_some()
}

/// A library with the data that its process needs.
pub(crate) struct Library<'a> {
    pub(crate) file: PathBuf,
    /// Folder of the unpacked archive.
    pub(crate) folder: &'a Path,
    pub(crate) isolation: &'a Isolation,
    pub(crate) kind: Kind,
}

impl Library<'_> {
    /// Makes an instance with this identifier and these resources in a process of its own.
    pub(crate) fn instantiate(
        self,
        name: &str,
        (guid, resources): (&str, &str),
    ) -> Result<Made, Refusal> {
        let (name, guid, resources) = (name.into(), guid.into(), resources.into());
        let (process, fault) = self.load(InstanceArguments { name, guid, resources })?;
        Ok((Box::new(RemoteInstance::new(process)), fault))
    }

    fn load(self, instance: InstanceArguments) -> Result<(Process, Option<String>), Refusal> {
        let refused = |reason: String| Err(Refusal::Refused(reason));
        let Some(program) = PROGRAM.get() else {
            let reason = "has no process of its own, because this program cannot start any";
            return refused(reason.into());
        };
        let mut process = match Process::start(program, &instance.name, self.isolation, self.folder)
        {
            Ok(process) => process,
            Err(error) => return refused(format!("has no process of its own: {error}")),
        };
        let limits = Limits {
            memory: self.isolation.memory,
            cpu: self.isolation.cpu,
            folder: self.isolation.sandbox.then(|| self.folder.to_path_buf()),
        };
        let Kind { fmi3, exchange } = self.kind;
        let fmi3 = fmi3.map(|_| self.folder.to_path_buf());
        let setup = Setup { library: self.file, instance, exchange, limits, fmi3 };
        match process.set_up(&setup) {
            Ok(Ready::Loaded { version_fault, without, .. }) => {
                if let Some(without) = without {
                    crate::warnings::warn_once(format!(
                        "this system cannot limit these for instances: {without}"
                    ));
                }
                Ok((process, version_fault))
            }
            Ok(Ready::Unloadable(reason)) => Err(Refusal::Unloadable(reason)),
            Ok(Ready::Refused { reason, .. }) => refused(reason),
            Err(failure) => refused(format!("failed in {}: {}", failure.call, failure.message)),
        }
    }
}

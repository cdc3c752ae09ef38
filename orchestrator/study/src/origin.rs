//! Where and how the runs of a study were made.

use crate::definition::Study;
use std::path::Path;
use std::process::Command;

/// Returns command, processor, system and revision, as far as they can be known.
pub(crate) fn origin(study: &Study) -> Vec<(String, String)> {
    let mut arguments = std::env::args();
    let program = arguments.next().unwrap_or_default();
    let name = Path::new(&program).file_name().map(|name| name.to_string_lossy().into_owned());
    let command: Vec<String> = name.into_iter().chain(arguments).collect();
    let known = [
        ("Command", Some(command.join(" "))),
        ("Processor", processor()),
        ("System", Some(format!("{} {}", std::env::consts::OS, std::env::consts::ARCH))),
        ("Revision", revision(&study.source.beside(Path::new(".")))),
    ];
    known.into_iter().filter_map(|(what, value)| Some((what.to_string(), value?))).collect()
}

fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_string())
}

/// Returns the commit of the folder, and its date, if git knows one.
fn revision(folder: &Path) -> Option<String> {
    let mut git = Command::new("git");
    git.arg("-C").arg(folder).args(["log", "-1", "--format=%h of %cs"]);
    let output = git.output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_string())
}

//! Where and how the runs of a study were made.

use std::path::Path;

/// Returns command, processor and system, as far as they can be known.
pub(crate) fn origin() -> Vec<(String, String)> {
    let mut arguments = std::env::args();
    let program = arguments.next().unwrap_or_default();
    let name = Path::new(&program).file_name().map(|name| name.to_string_lossy().into_owned());
    let command: Vec<String> = name.into_iter().chain(arguments).collect();
    let known = [
        ("Command", Some(command.join(" "))),
        ("Processor", processor()),
        ("System", Some(format!("{} {}", std::env::consts::OS, std::env::consts::ARCH))),
    ];
    known.into_iter().filter_map(|(what, value)| Some((what.to_string(), value?))).collect()
}

fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_string())
}

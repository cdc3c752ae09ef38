//! Worked examples at the end of the help of each command.

use std::collections::BTreeMap;
use std::fmt::Write;

/// Examples by command: what each does, and its command line.
type Examples = BTreeMap<String, Vec<[String; 2]>>;

fn all() -> Examples {
    // The file is part of the program, and a test reads it.
    toml::from_str(include_str!("examples.toml")).unwrap_or_default()
}

/// Returns the examples of a command as they stand in its help.
pub(crate) fn of(command: &str) -> String {
    let mut text = String::from("Examples:");
    for [does, line] in all().get(command).into_iter().flatten() {
        // Writing to a string cannot fail.
        let _ = write!(text, "\n  {does}:\n    {line}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command_line::definition;

    #[test]
    fn every_command_has_examples_that_the_program_takes() {
        let commands = definition();
        let shown = commands.get_subcommands().filter(|command| !command.is_hide_set());
        let names: Vec<&str> = shown.map(clap::Command::get_name).collect();
        let all = all();
        assert_eq!(names.len(), all.len());
        for name in names {
            let examples = all.get(name).expect(name);
            assert_eq!(examples.len(), 3, "{name}");
            let help = commands.find_subcommand(name).unwrap().get_after_help().expect(name);
            for [_, line] in examples {
                // A line that is wrapped cannot be copied.
                assert!(line.len() <= 76, "{line}");
                assert!(help.to_string().contains(line), "{line}");
                assert!(
                    line.starts_with(&format!("orchestrator {name} "))
                        || line == "orchestrator list"
                );
                let words = line.split_whitespace().map(|word| word.trim_matches('\''));
                if let Err(error) = definition().try_get_matches_from(words) {
                    panic!("{line}: {error}");
                }
            }
        }
    }
}

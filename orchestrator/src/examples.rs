//! Worked examples at the end of the help of each command.

use std::fmt::Write;

/// A command line, and what it does.
type Example = [&'static str; 2];

/// Three examples of each command, by its name.
const EXAMPLES: [(&str, [Example; 3]); 15] = [
    (
        "run",
        [
            ["Fly an experiment by its name", "orchestrator run crmpc-robust"],
            [
                "Fly 20 s with another controller, and replace earlier results",
                "orchestrator run lqr --fmu controller=DLMPC --stop 20 --force",
            ],
            [
                "Fly ten times as fast as real time, into another folder",
                "orchestrator run crmpc-robust --real-time 10 --stop 20 --out out/paced",
            ],
        ],
    ),
    (
        "plot",
        [
            ["Draw the rates of a run", "orchestrator plot out/lqr --signals 'plant.rate.*'"],
            [
                "Draw two runs over one another, from 20 s to 30 s",
                "orchestrator plot out/lqr out/dlmpc --from 20 --to 30 --out both.png",
            ],
            [
                "Fly both side by side in a page",
                "orchestrator plot out/lqr out/crmpc-robust --out both.html",
            ],
        ],
    ),
    (
        "reproduce",
        [
            ["Repeat the comparison of Chai 2022", "orchestrator reproduce crmpc-2022"],
            [
                "Take a quick look, with two cases of each run",
                "orchestrator reproduce exchange --members 2 --out out/quick",
            ],
            [
                "Use one core only",
                "orchestrator reproduce two-loop-smc --jobs 1 --out out/two-loop",
            ],
        ],
    ),
    (
        "campaign",
        [
            ["Fly a campaign", "orchestrator campaign white"],
            [
                "Fly it with another experiment",
                "orchestrator campaign white --experiment lqr --out out/white-lqr",
            ],
            [
                "Fly one of its cases again, with everything recorded",
                "orchestrator campaign white --case 17",
            ],
        ],
    ),
    (
        "falsify",
        [
            ["Look for the worst constant disturbance", "orchestrator falsify worst-constant"],
            [
                "Stop looking after a minute",
                "orchestrator falsify worst-gusts --time 60 --out out/gusts",
            ],
            [
                "Look for the worst case of another controller",
                "orchestrator falsify worst-constant --fmu controller=LQR --out out/worst-lqr",
            ],
        ],
    ),
    (
        "linearise",
        [
            [
                "Write the open loop at rest, where the experiment says",
                "orchestrator linearise rest --out rest.json",
            ],
            [
                "Say where and when the loop is opened",
                "orchestrator linearise lqr --at 10 --open 'plant.moment.*' --out lqr.json",
            ],
            [
                "Take another controller",
                "orchestrator linearise rest --fmu controller=FBL --out fbl.json",
            ],
        ],
    ),
    (
        "margins",
        [
            ["Print the margins at rest", "orchestrator margins rest"],
            [
                "Say where and when the loop is opened",
                "orchestrator margins lqr --at 10 --open 'plant.moment.*'",
            ],
            [
                "Print those of another controller as JSON",
                "orchestrator margins rest --fmu controller=FBL --json",
            ],
        ],
    ),
    (
        "response",
        [
            [
                "Compare flight and linear model at ten frequencies",
                "orchestrator response rest --fmu controller=LQR",
            ],
            [
                "Choose the frequencies",
                "orchestrator response rest --fmu controller=LQR --from 0.5 --to 20 --count 4",
            ],
            [
                "Draw both responses",
                "orchestrator response rest --fmu controller=FBL --plot fbl.svg",
            ],
        ],
    ),
    (
        "pack",
        [
            ["Write crmpc-robust.ssp", "orchestrator pack crmpc-robust"],
            [
                "Pack it with another seed",
                "orchestrator pack lqr --set plant.disturbance.seed=7 --out lqr-7.ssp",
            ],
            [
                "Pack it for libcosim",
                "orchestrator pack lqr --no-enumerations --out lqr-libcosim.ssp",
            ],
        ],
    ),
    (
        "inspect",
        [
            ["Show all variables of an FMU", "orchestrator inspect CRMPC"],
            ["Show some of them", "orchestrator inspect CRMPC 'guarantee.*'"],
            ["Look for faults of an FMU", "orchestrator inspect CRMPC --check"],
        ],
    ),
    (
        "show",
        [
            ["Print an experiment", "orchestrator show crmpc-paper"],
            ["Print a campaign", "orchestrator show white"],
            ["Print a study", "orchestrator show exchange"],
        ],
    ),
    (
        "schema",
        [
            ["Print the schema of experiments", "orchestrator schema experiment"],
            ["Print the schema of studies", "orchestrator schema study"],
            ["Print the schema of campaigns", "orchestrator schema campaign"],
        ],
    ),
    (
        "completions",
        [
            ["Print the script for bash", "orchestrator completions bash"],
            ["Print the script for zsh", "orchestrator completions zsh"],
            ["Print the script for fish", "orchestrator completions fish"],
        ],
    ),
    (
        "man",
        [
            ["Write the pages into a folder", "orchestrator man man/man1"],
            ["Write them where man finds them", "orchestrator man ~/.local/share/man/man1"],
            ["Write them for all users", "orchestrator man /usr/local/share/man/man1"],
        ],
    ),
    (
        "list",
        [
            ["List everything by name", "orchestrator list"],
            ["List what is below a folder, with files", "orchestrator list --long ."],
            ["List everything as JSON", "orchestrator list --json"],
        ],
    ),
];

/// Returns the examples of a command as they stand in its help.
pub(crate) fn of(command: &str) -> String {
    let found = EXAMPLES.iter().find(|(name, _)| *name == command);
    let mut text = String::from("Examples:");
    for [does, line] in found.map_or(&[][..], |(_, examples)| examples) {
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
        assert_eq!(names.len(), EXAMPLES.len());
        for name in names {
            let (_, examples) = EXAMPLES.iter().find(|(other, _)| *other == name).expect(name);
            let help = commands.find_subcommand(name).unwrap().get_after_help().expect(name);
            for [_, line] in examples {
                // A line that is wrapped cannot be copied.
                assert!(line.len() <= 76, "{line}");
                assert!(help.to_string().contains(line), "{line}");
                assert!(
                    line.starts_with(&format!("orchestrator {name} "))
                        || *line == "orchestrator list"
                );
                let words = line.split_whitespace().map(|word| word.trim_matches('\''));
                if let Err(error) = definition().try_get_matches_from(words) {
                    panic!("{line}: {error}");
                }
            }
        }
    }

    #[test]
    fn help_fits_a_terminal_of_80_columns_where_words_allow() {
        let mut commands = definition().term_width(80);
        commands.build();
        for command in commands.get_subcommands_mut() {
            let name = command.get_name().to_string();
            for line in command.render_long_help().to_string().lines() {
                assert!(line.chars().count() <= 80, "{name}: {line}");
            }
        }
    }
}

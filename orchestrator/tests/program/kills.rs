//! Commands that are killed at any time: nothing of them is left behind after the next one, and it
//! gives the same bytes. The variable `KILLS` sets their number.

use crate::hostile::assert_gone;
use crate::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;

const STUDY: &str = r##"
title = "seeds"
paper = "none"
summary = "none"
values = []
signals.out = ["plant.output.integral"]
[[run]]
id = "seeds"
label = "seeds"
color = "#000000"
experiment = "loop.toml"
set = { "gain.pause" = 0.001 }
seeds = ["gain.noise.seed"]
cases = 60
measures = ["last"]
[[measure]]
id = "last"
kind = "last"
signals = "out"
[[figure]]
id = "out"
title = "Output"
runs = ["seeds"]
panel = [{ label = "output", signal = "plant.output.integral" }]
"##;

/// Commands with their results.
const COMMANDS: [(&[&str], &str); 5] = [
    (&["run", "loop.toml", "--force", "--set", "gain.pause=0.02"], "out/loop"),
    (&["campaign", "c.toml"], "out/c"),
    (&["reproduce", "study.toml", "--out", "out/study"], "out/study"),
    (&["campaign", "c.toml", "--worst", "--force"], "out/c-worst"),
    (&["pack", "loop.toml", "--force", "--out", "out/packed/loop.ssp"], "out/packed"),
];

fn bench() -> Bench {
    let bench = Bench::new();
    let vary = "[[vary]]\nparameter = \"gain.pause\"\nlist = [0.0, 0.004]\n";
    let search = "[search]\nlargest = \"largest\"\ncases = 60\n";
    // A list has ends, and so has a search over it.
    let campaign = CAMPAIGN.replace("[1e9, 2.0]", "[1e9, 1e8]");
    fs::write(bench.path("c.toml"), format!("{campaign}{vary}{search}")).unwrap();
    fs::write(bench.path("study.toml"), STUDY).unwrap();
    fs::create_dir(bench.path("temporary")).unwrap();
    bench
}

fn command(bench: &Bench, arguments: &[&str]) -> Command {
    let mut command = bench.command(arguments);
    command.args(if arguments[0] == "pack" { &[][..] } else { &["--quiet"] });
    command.env("TMPDIR", bench.path("temporary")).env("HOSTILE", bench.folder.path());
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

fn complete(bench: &Bench, arguments: &[&str]) {
    let output = command(bench, arguments).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {errors}");
}

/// All files below a folder, with the bytes of those that hold no times.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(inner) = folders.pop() {
        for path in fs::read_dir(inner).unwrap().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
            let is_timeless = ["csv", "parquet", "ssp", "svg"].contains(&extension.as_str());
            let bytes = if is_timeless { fs::read(&path).unwrap() } else { Vec::new() };
            found.insert(path.strip_prefix(folder).unwrap().to_path_buf(), bytes);
        }
    }
    found
}

fn shared_memory() -> usize {
    fs::read_dir("/dev/shm").map_or(0, |entries| {
        let names = entries.flatten().map(|entry| entry.file_name());
        names.filter(|name| name.to_string_lossy().starts_with("fmu-")).count()
    })
}

#[test]
fn what_is_killed_leaves_nothing_behind_and_the_same_bytes_after_all() {
    let kills = std::env::var("KILLS").ok().and_then(|text| text.parse().ok()).unwrap_or(30_u32);
    let (bench, before) = (bench(), shared_memory());
    let mark = bench.folder.path().display().to_string();
    let mut expected = Vec::new();
    for (arguments, out) in COMMANDS {
        let begin = Instant::now();
        complete(&bench, arguments);
        let time = begin.elapsed();
        expected.push((files(&bench.path(out)), time));
        fs::remove_dir_all(bench.path(out)).unwrap();
    }
    let mut killed = 0;
    for kill in 0..kills {
        let place = kill as usize % COMMANDS.len();
        let ((arguments, out), (files_expected, time)) = (COMMANDS[place], &expected[place]);
        let mut child = command(&bench, arguments).spawn().unwrap();
        // Multiples of the golden ratio are spread evenly over the duration.
        let share = (f64::from(kill) * 0.618_033_988_75).fract();
        std::thread::sleep(time.mul_f64(share));
        killed += u32::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
        complete(&bench, arguments);
        let found = files(&bench.path(out));
        let names = |files: &BTreeMap<PathBuf, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
        assert_eq!(names(&found), names(files_expected), "{kill} {arguments:?}");
        assert!(found == *files_expected, "{kill} {arguments:?}: other bytes");
        let left: Vec<_> = fs::read_dir(bench.path("temporary")).unwrap().flatten().collect();
        assert!(left.is_empty(), "{kill} {arguments:?}: {left:?}");
        fs::remove_dir_all(bench.path(out)).unwrap();
    }
    assert!(killed > kills / 3, "{killed} of {kills}");
    assert_eq!(shared_memory(), before);
    assert_gone(&mark, "what was killed");
}

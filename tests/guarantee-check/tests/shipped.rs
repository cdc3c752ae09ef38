//! The plans for every CRMPC in the shipped experiments, studies and campaigns, which are found by
//! reading all files.
#![cfg(feature = "shipped")]

use control::crmpc::{Constraints, Design, Settings};
use guarantee_check::shipped::Scan;
use guarantee_check::tally::check_flights;
use std::path::Path;

#[test]
fn plans_of_all_shipped_settings_are_confirmed() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../orchestrator/experiments");
    let scan = Scan::new(&folder).unwrap();
    assert!(scan.read.iter().all(|&count| count > 0), "{:?}", scan.read);
    // Only parts that other files extend, vehicles, and files of values are not experiments.
    for (file, reason) in &scan.left_out {
        let part = file.parent().is_some_and(|folder| folder.ends_with("base"));
        let exchange =
            file.file_stem().is_some_and(|stem| stem.to_string_lossy().starts_with("any"));
        let values = ["no schema", "vehicle.json"].contains(&reason.as_str());
        assert!(part || exchange || values, "{}: {reason}", file.display());
    }
    let mut done: Vec<Settings> = Vec::new();
    let mut confirmed = 0;
    for shipped in &scan.shipped {
        let s = &shipped.settings;
        let given = s.constraints == Constraints::Robust
            && Design::new(s).is_ok_and(|design| design.accepted_share >= 1.0);
        if !given || done.contains(s) {
            continue;
        }
        let tally = check_flights(s, 0..1, 0.4).unwrap();
        assert_eq!(tally.not_confirmed, 0, "{shipped:?}: {:?}", tally.refuted);
        confirmed += tally.plans;
        done.push(*s);
    }
    assert!(done.len() >= 5 && confirmed >= 5, "{} settings, {confirmed} plans", done.len());
}

#[test]
fn a_study_that_cannot_be_read_is_an_error() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("faulty");
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("study.toml");
    let told = |text: &str| {
        std::fs::write(&file, format!("#:schema study.json\n{text}")).unwrap();
        Scan::new(&folder)
    };
    assert_eq!(told("[lists]\n").unwrap().left_out.len(), 1);
    for text in ["title = \"x\"\nno_key = 1\n", "title = "] {
        let message = told(text).unwrap_err();
        assert!(message.contains("study.toml"), "{message}");
    }
}

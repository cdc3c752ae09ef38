//! Every verdict that the program prints, or writes on a page, where it is good and where it is
//! not. The loop's integrator has the values (1 + gain)^k at tick k, up to 3.

use crate::campaign::bench;
use crate::prelude::*;

#[test]
fn a_run_names_what_is_within_and_what_is_beyond_its_limit() {
    let section = r#"
[observe]
summary = ["largest", "first", "bound"]
[observe.signals]
out = ["plant.output.integral"]
bound = ["gain.largest"]
direct = ["gain.output.direct"]
[observe.metrics]
largest = { label = "largest value", kind = "largest", signals = "out", limit = "bound" }
first = { label = "direct value", kind = "largest", signals = "direct", limit = "bound" }
bound = { label = "bound", kind = "last", signals = "bound" }
"#;
    let bench = Bench::with(&format!("{LOOP}{section}"));
    let outcome = |largest: &str| {
        let set = format!("gain.largest={largest}");
        let arguments = ["--page", "--set", "gain.gain=0.5", "--set", &set];
        let said = bench.flown(&arguments);
        let page = bench.text("out/loop/page.html");
        let verdict = page.split_once("<p class=\"verdict\">").unwrap().1;
        (said, verdict.split_once("</p>").unwrap().0.to_string())
    };
    // The integral reaches 3.375; the gain responds last to 2.25, by half of it.
    let (said, verdict) = outcome("4");
    assert_eq!(said.matches("within its limit 4").count(), 2, "{said}");
    assert!(!said.contains("EXCEEDS") && !said.contains("DEFECT"), "{said}");
    assert!(verdict.contains("light good"), "{verdict}");
    assert!(verdict.ends_with("Within the limit: largest value, direct value."), "{verdict}");
    let (said, verdict) = outcome("3");
    assert!(said.contains("3.3750 m   EXCEEDS its limit 3"), "{said}");
    assert!(said.contains("1.1250 m   within its limit 3"), "{said}");
    assert!(verdict.contains("light bad") && !verdict.contains("light good"), "{verdict}");
    assert!(verdict.contains("Beyond a limit: largest value."), "{verdict}");
    assert!(verdict.ends_with("Within the limit: direct value."), "{verdict}");
    let (said, verdict) = outcome("1");
    assert_eq!(said.matches("EXCEEDS its limit 1").count(), 2, "{said}");
    assert!(!verdict.contains("Within"), "{verdict}");
}

#[test]
fn a_limit_that_is_exceeded_under_a_guarantee_is_called_a_defect() {
    let section = r#"
[observe.signals]
ratio = ["plant.output.integral / gain.gain"]
[observe.guarantee]
in_force = "gain.guarantee.inForce"
keeps = "ratio"
"#;
    let bench = Bench::with(&format!("{LOOP}{section}"));
    let outcome = |largest: &str| {
        let largest = format!("gain.largest={largest}");
        let said = bench.flown(&["--page", "--set", "gain.gain=4", "--set", &largest]);
        let line = said.lines().find(|line| line.starts_with("  guarantee ")).unwrap();
        (line.to_string(), bench.text("out/loop/page.html"))
    };
    // The integral is 1, 5, 25, and the limit is 4. The guarantee is in force up to `largest`.
    let (line, page) = outcome("1000");
    assert!(line.ends_with("a limit was EXCEEDED while it was in force"), "{line}");
    assert!(page.contains("Beyond a limit: guarantee."), "{page}");
    let (line, page) = outcome("1");
    assert!(line.contains("lost at t = 1 s") && !line.contains("DEFECT"), "{line}");
    assert!(!page.contains("Beyond a limit"), "{page}");
}

#[test]
fn a_campaign_says_which_limits_are_kept_and_which_are_broken() {
    let campaign = CAMPAIGN.replace("[1e9, 2.0]", "[1e9]");
    let all_kept = bench(&campaign.replace("at_most = 8.0", "at_most = 27.0"));
    let said = all_kept.says(&["campaign", "c.toml"]);
    assert!(said.contains("broken by 0 of 3, probability at most"), "{said}");
    let text = all_kept.text("out/c/report.html");
    assert!(text.contains("kept by all") && !text.contains("verdict not"), "{text}");
    let broken = bench(&campaign);
    let said = broken.says(&["campaign", "c.toml"]);
    assert!(said.contains("broken by 1 of 3, probability "), "{said}");
    let text = broken.text("out/c/report.html");
    assert!(!text.contains("kept by all"), "{text}");
    assert!(text.contains("<span class=\"verdict not\">broken</span>"), "{text}");
}

#[test]
fn a_search_says_whether_the_worst_case_breaks_a_limit() {
    for (bound, breaks) in [("9.0", false), ("7.0", true)] {
        let text = format!("{RANDOM}[search]\nlargest = \"last\"\ncases = 60\n");
        let bench = bench(&text.replace("at_most = 7.9", &format!("at_most = {bound}")));
        let said = bench.says(&["campaign", "c.toml", "--worst", "--out", "w"]);
        assert_eq!(said.contains("breaks small"), breaks, "{said}");
        let text = bench.text("w/report.html");
        let verdicts = |class: &str, word: &str| {
            text.matches(&format!("<span class=\"{class}\">{word}</span>")).count()
        };
        // Once for the searched measure, once for the limit.
        let (kept, broken) = if breaks { (0, 2) } else { (2, 0) };
        assert_eq!(verdicts("verdict holds", "kept"), kept, "{text}");
        assert_eq!(verdicts("verdict not", "broken"), broken, "{text}");
    }
}

/// Beginning of a study.
const HEAD: &str = r#"
title = "gains"
paper = "-"
summary = "-"
values = []
signals.out = ["plant.output.integral"]
"#;

#[test]
fn a_study_says_of_each_claim_whether_it_holds() {
    let bench = Bench::new();
    let study = r##"
run = [{ id = "a", label = "a", color = "#000000", experiment = "loop.toml", measures = ["last", "never"], set = { "gain.gain" = 1.0 } }]
measure = [
    { id = "last", kind = "last", signals = "out" },
    { id = "never", kind = "leaving", signals = "out", bound = 1e9 },
]
claim = [
    { says = "It ends below nine.", source = "-", check = [{ label = "end", left = "a.measure.last", right = 9.0 }] },
    { says = "It ends below eight.", source = "-", check = [{ label = "end", left = "a.measure.last", right = 8.0 }] },
    { says = "It ends between.", source = "-", check = [
        { label = "below", left = "a.measure.last", right = 9.0 },
        { label = "above", relation = "above", left = "a.measure.last", right = 9.0 },
    ] },
    { says = "It leaves late.", source = "-", check = [{ label = "time", left = "a.measure.never", right = 9.0 }] },
]
"##;
    fs::write(bench.path("study.toml"), format!("{HEAD}{study}")).unwrap();
    let said = bench.says(&["reproduce", "study.toml", "--out", "s", "--fmu-dir", "."]);
    let text = bench.text("s/report.html");
    for (verdict, class, claim) in [
        ("holds", "verdict holds", "It ends below nine."),
        ("does not hold", "verdict not", "It ends below eight."),
        ("holds partly", "verdict partly", "It ends between."),
        ("not judged", "verdict", "It leaves late."),
    ] {
        assert!(said.contains(&format!("  {verdict:<14} {claim}\n")), "{said}");
        let line = format!("<span class=\"{class}\">{verdict}</span><span>{claim}</span>");
        assert!(text.contains(&line), "{verdict}: {text}");
    }
    assert!(
        text.contains("Of 4 claims, 1 holds, 1 holds in part, 1 does not hold, 1 is not judged.")
    );
}

#[test]
fn a_study_flies_on_where_a_case_fails_and_says_so_once() {
    let bench = Bench::new();
    let study = r##"
run = [
    { id = "a", label = "a", color = "#000000", experiment = "loop.toml", measures = ["last"], set = { "plant.fail.time" = 0.5 } },
    { id = "b", label = "b", color = "#000000", experiment = "loop.toml", measures = ["last"] },
]
measure = [{ id = "last", kind = "last", signals = "out" }]
claim = [
    { says = "It ends above zero.", source = "-", check = [{ label = "a", relation = "above", left = "a.measure.last", right = 0.0 }] },
    { says = "So does the other.", source = "-", check = [{ label = "b", relation = "above", left = "b.measure.last", right = 0.0 }] },
]
figure = [{ id = "f", title = "f", caption = "-", runs = ["a", "b"], panel = [{ label = "out", signal = "plant.output.integral" }] }]
"##;
    fs::write(bench.path("study.toml"), format!("{HEAD}{study}")).unwrap();
    let (code, said, errors) =
        bench.call(&["reproduce", "study.toml", "--out", "s", "--fmu-dir", "."]);
    assert_eq!((code, errors.matches("trouble").count()), (1, 0), "{errors}");
    assert_eq!(
        errors.matches("a: 1 of 1 cases failed: plant failed at t = ").count(),
        1,
        "{errors}"
    );
    assert!(said.contains("not judged     It ends above zero."), "{said}");
    assert!(said.contains("holds          So does the other."), "{said}");
    assert!(bench.text("s/report.html").contains("a: 1 of 1 cases failed: plant failed"));
}

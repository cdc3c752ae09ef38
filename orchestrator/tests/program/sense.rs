//! Campaigns that make no sense are refused, seeds separate campaigns, and a failure outside the
//! FMU is not a result.

use crate::campaign::{self, bench};
use crate::prelude::*;
use std::collections::BTreeSet;

/// A campaign in which a text of [`RANDOM`] is replaced.
fn refusal(from: &str, to: &str) -> String {
    assert!(RANDOM.contains(from), "{from}");
    campaign::refusal(&RANDOM.replacen(from, to, 1))
}

const CASES: &str = "cases = 1100";
const MOST: &str = "at_most = 7.9";
const UNIFORM: &str = "uniform = [0.0, \"1000 mm\"]";

#[test]
fn distributions_that_make_no_sense_are_refused_with_the_parameter() {
    for (distribution, said) in [
        ("normal = { mean = 1.0, deviation = -0.1 }", "deviation = -0.1, but it must be above 0"),
        ("normal = { mean = 1.0, deviation = \"-5 %\" }", "deviation = -0.1"),
        ("normal = { mean = 1.0, deviation = 0.0 }", "deviation = 0"),
        ("normal = { mean = 1.0, deviation = inf }", "inf is no finite number"),
        ("normal = { mean = nan, deviation = 1.0 }", "NaN is no finite number"),
        ("normal = { mean = \"inf %\", deviation = 1.0 }", "inf is no finite number"),
        ("uniform = [1.0, 0.0]", "must be larger than the first one"),
        ("uniform = [1.0, 1.0]", "must be larger than the first one"),
        ("uniform = [0.0, inf]", "inf is no finite number"),
        ("uniform = [nan, 1.0]", "NaN is no finite number"),
        ("list = [1.0, nan]", "NaN is no finite number"),
        ("list = [1.0, 2.0, 1.0]", "1.0 is there twice"),
        ("list = [1.0, 2.0]\nweights = [1.0, -1.0]", "must not be negative"),
        ("list = [1.0, 2.0]\nweights = [0.0, 0.0]", "not all zero"),
        ("list = [1.0, 2.0]\nweights = [1.0, inf]", "weights must not be"),
        ("list = [1.0, 2.0]\nweights = [1.0]", "1 weights for 2 values"),
        (
            "normal = { mean = 0.0, deviation = 0.1, within = [2.0, 3.0] }",
            "next to no values between",
        ),
        (
            "normal = { mean = 0.0, deviation = 1.0, within = [0.7, 0.2] }",
            "must be larger than the",
        ),
        ("normal = { mean = 0.0, deviation = 1.0, within = [9.0, 10.0] }", "next to no values"),
        ("normal = { mean = 0.0, deviation = 1.0, within = [8.0, 8.1] }", "next to no values"),
        ("normal = { mean = 0.0, deviation = 1.0, within = [-inf, 1.0] }", "no finite number"),
        ("list = [1.0, 2.0]\nwithin = [0.0, 3.0]", "unknown field `within`"),
        ("uniform = [0.0, 1.0]\nweights = [1.0]", "weights are for a list only"),
        ("uniform = [0.0, 1.0]\nlist = [1.0]", "but there is uniform and list"),
        ("uniform = [0.0, 1.0]\nsorted = true", "sorted is for several real parameters"),
        ("case = 1", "case is for parameters of type Integer"),
    ] {
        let errors = refusal(UNIFORM, distribution);
        assert!(errors.contains(said), "{distribution}: {errors}");
        assert!(errors.contains("gain.gain") || errors.contains("sorted"), "{errors}");
    }
    // Values of a small part at the lower end can be distinguished.
    let tail = "normal = { mean = 0.0, deviation = 1.0, within = [-8.1, -8.0] }";
    bench(&RANDOM.replace(UNIFORM, tail)).says(&["campaign", "c.toml", "--work"]);
}

#[test]
fn a_deviation_keeps_no_limit_of_the_parameter() {
    // It is of a parameter that must not be below 0, about a mean of 1 s.
    let normal = "parameter = \"plant.delay\"\nnormal = { mean = 1.0, deviation = \"0.1 s\" }";
    let text = RANDOM.replace(&format!("parameter = \"gain.gain\"\n{UNIFORM}"), normal);
    bench(&text).says(&["campaign", "c.toml", "--work"]);
}

#[test]
fn keys_that_contradict_each_other_are_refused_with_the_name() {
    let vary = |text: &str| format!("{UNIFORM}\n[[vary]]\n{text}");
    for (to, said) in [
        (vary("parameter = \"gain.gain\"\nlist = [1.0]"), "\"gain.gain\" varies twice"),
        (vary("each = [\"plant.gain\", \"plant.gain\"]\nlist = [1.0]"), "\"plant.gain\" varies t"),
        (vary("parameter = [\"plant.gain\", \"plant.gain\"]\nlist = [1.0]"), "varies twice"),
        (vary("parameter = \"plant.output.integral\"\nlist = [1.0]"), "is of causality output"),
        (vary("parameter = \"plant.*\"\nlist = [1.0]"), "there is no such parameter"),
    ] {
        let errors = refusal(UNIFORM, &to);
        assert!(errors.contains(said), "{to}: {errors}");
    }
    let with = |more: &str| format!("{CASES}\n{more}");
    let limited = |more: &str| format!("{MOST}\n{more}");
    let id = |name: &str| format!("id = \"{name}\"");
    let small = "[[limit]]\nid = \"small\"\nmeasure = \"last\"\nat_most = 1.0";
    for (from, to, said) in [
        (CASES, "cases = 0".into(), "cases = 0"),
        (CASES, with("set = { \"gain.gain\" = 0.5 }"), "gain.gain varies, but [set]"),
        (CASES, with("metrics = [\"samples\", \"samples\"]"), "samples is there twice"),
        (MOST, "at_most = inf".into(), "not a finite number"),
        (MOST, "at_most = nan".into(), "not a finite number"),
        (MOST, limited("at_least = 1.0"), "one of at_most and at_least"),
        (MOST, limited(small), "two [[limit]] with the id small"),
        (MOST, limited("[search]\nlargest = \"last\"\ncases = 0"), "at least 1"),
        ("id = \"last\"", id("time"), "two columns time"),
        ("id = \"last\"", id("gain.gain"), "two columns gain.gain"),
        ("id = \"last\"", id("kept.small"), "two columns kept.small"),
        ("case = 7", "case = 3000000000".into(), "is not between"),
    ] {
        let errors = plain(&refusal(from, &to));
        assert!(errors.contains(said), "{to}: {errors}");
    }
    let bench = bench(RANDOM);
    let set = ["campaign", "c.toml", "--set", "gain.gain=0.5"];
    bench.fails(2, &set, "\"gain.gain\" varies, so that --set");
}

#[test]
fn an_alias_is_the_same_parameter() {
    let alias = |text: String| {
        let variable = "<ScalarVariable name=\"k\" valueReference=\"3\" causality=\"parameter\" variability=\"fixed\"><Real unit=\"m\" start=\"2\"/></ScalarVariable>";
        text.replace("  </ModelVariables>", &format!("{variable}</ModelVariables>"))
    };
    let bench = Bench::made(LOOP, &Recipe { description: &alias, ..Recipe::default() });
    let refused = |text: String| {
        fs::write(bench.path("c.toml"), text).unwrap();
        let (code, _, errors) = bench.call(&["campaign", "c.toml", "--work"]);
        assert_eq!(code, 2, "{errors}");
        errors
    };
    let twice = format!("{UNIFORM}\n[[vary]]\nparameter = \"gain.k\"\nlist = [1.0, 2.0]");
    let errors = refused(RANDOM.replace(UNIFORM, &twice));
    assert!(errors.contains("\"gain.k\" varies twice"), "{errors}");
    let set = "cases = 1100\nset = { \"gain.k\" = 0.5 }";
    let errors = refused(RANDOM.replace("cases = 1100", set));
    assert!(errors.contains("\"gain.gain\" varies, but [set]"), "{errors}");
}

#[test]
fn what_the_design_levels_leaves_without_meaning_is_refused() {
    let two = "list = [1.0, 2.0]";
    for (vary, said) in [
        (
            format!("each = [\"gain.gain\", \"plant.gain\"]\n{two}\nsorted = true"),
            "sorted has no mean",
        ),
        (
            format!("parameter = \"gain.gain\"\n{two}\nweights = [1.0, 2.0]"),
            "weights have no effect",
        ),
        ("parameter = \"gain.gain\"\nuniform = [0.0, 1.0]".into(), "needs single values"),
        ("parameter = \"gain.noise.seed\"\ncase = 1".into(), "needs single values"),
    ] {
        let text = format!(
            "title = \"x\"\nexperiment = \"loop.toml\"\nmetrics = [\"samples\"]\ndesign = \"levels\"\n[[vary]]\n{vary}\n"
        );
        bench(&text).fails(2, &["campaign", "c.toml", "--work"], said);
    }
}

/// Returns the seeds of the cases of a campaign.
fn seeds(bench: &Bench, text: &str) -> Vec<i64> {
    fs::write(bench.path("c.toml"), text).unwrap();
    bench.says(&["campaign", "c.toml", "--quiet"]);
    let table = bench.cases("out/c");
    let place = table[0].split(',').position(|name| name == "plant.noise.seed").unwrap();
    table[1..].iter().map(|row| row.split(',').nth(place).unwrap().parse().unwrap()).collect()
}

#[test]
fn campaigns_of_different_seeds_have_no_case_in_common() {
    let bench = bench(RANDOM);
    let varied = "parameter = \"gain.gain\"\nuniform = [0.0, \"1000 mm\"]\n[[vary]]\nparameter = \"gain.kind\"\nlist = [\"calm\", \"rough\"]\nweights = [3.0, 1.0]\n[[vary]]\n";
    let alone = RANDOM.replace(varied, "").replace("cases = 1100", "cases = 50");
    let mut all = BTreeSet::new();
    for seed in [1, 2, 3, 0, 1_000_000_007] {
        let text = alone.replace("cases = 50", &format!("cases = 50\nseed = {seed}"));
        let found = seeds(&bench, &text);
        let expected: Vec<i64> = (found[0]..).take(50).collect();
        assert_eq!(found, expected);
        assert!(seed != 1 || found[0] == 7, "{found:?}");
        assert!(found.iter().all(|seed| i32::try_from(*seed).is_ok_and(|seed| seed >= 0)));
        assert!(found.into_iter().all(|seed| all.insert(seed)), "{seed}");
    }
}

#[test]
fn more_cases_than_seeds_are_refused() {
    let few = |text: String| {
        let (from, to) = (
            "variability=\"fixed\"><Integer start=\"0\"/>",
            "variability=\"fixed\"><Integer start=\"0\" min=\"0\" max=\"59\"/>",
        );
        assert!(text.contains(from));
        text.replace(from, to)
    };
    let bench = Bench::made(LOOP, &Recipe { description: &few, ..Recipe::default() });
    let text = RANDOM.replace("cases = 1100", "cases = 60\nseed = 5");
    let found = seeds(&bench, &text);
    assert_eq!(found.iter().collect::<BTreeSet<_>>().len(), 60);
    assert!(found.iter().all(|seed| (0..60).contains(seed)), "{found:?}");
    fs::write(bench.path("c.toml"), text.replace("cases = 60", "cases = 61")).unwrap();
    bench.fails(2, &["campaign", "c.toml"], "61 cases need a seed each");
}

#[test]
fn a_campaign_in_which_all_cases_failed_is_no_statistic() {
    let bench = bench(&CAMPAIGN.replace("[1e9, 2.0]", "[1.0, 2.0]"));
    let (code, out, errors) = bench.call(&["campaign", "c.toml"]);
    assert!(code == 1 && errors.contains("6 cases failed, so there are no statistics"), "{errors}");
    assert!(errors.contains("out of propellant at 1") && out.is_empty(), "{errors}{out}");
    assert!(!bench.path("out/c/summary.json").exists() && !bench.path("out/c/parts").exists());
    let table = bench.cases("out/c").concat();
    assert_eq!(table.matches(",failed,").count(), 6, "{table}");
    let search = format!("{CAMPAIGN}[search]\nlargest = \"largest\"\ncases = 10\n");
    // The first step fails, before anything is measured.
    let search = search
        .replace("[1e9, 2.0]", "[-1.0, -2.0]")
        .replace("kind = \"last\"", "kind = \"last\"\nover = [2.5, 3.0]");
    let search = search.replace("largest = \"largest\"", "largest = \"last\"");
    fs::write(bench.path("c.toml"), search).unwrap();
    let (code, out, errors) = bench.call(&["campaign", "c.toml", "--worst"]);
    assert!(code == 1 && errors.contains("no case has a value of last"), "{errors}");
    assert!(!out.contains("worst.toml") && !bench.path("out/c-worst/worst.toml").exists());
}

#[test]
fn an_instance_that_refuses_values_fails_and_one_that_lacks_a_file_is_an_error() {
    // The model refuses gains above 100.
    let bench = bench(&CAMPAIGN.replace("[0.5, 1.0, 2.0]", "[0.5, 500.0]"));
    bench.says(&["campaign", "c.toml"]);
    let table = bench.cases("out/c").concat();
    assert_eq!(table.matches("gain too large: 500").count(), 2, "{table}");
    // It refuses that of the experiment as well: the fault is not in the drawn values.
    let set = "set = { \"plant.gain\" = 500.0 }\n[signals]";
    fs::write(bench.path("c.toml"), CAMPAIGN.replace("[signals]", set)).unwrap();
    bench.fails(1, &["campaign", "c.toml"], "gain too large: 500");
    assert!(!bench.path("out/c/summary.json").exists());
}

#[test]
fn a_file_that_a_text_parameter_names_counts() {
    let text = "cases = 30\nset = { \"gain.text\" = \"profile.csv\" }";
    let bench = bench(&RANDOM.replace("cases = 1100", text));
    let flown = |content: &str| {
        fs::write(bench.path("profile.csv"), content).unwrap();
        bench.says(&["campaign", "c.toml"])
    };
    assert!(flown("1").contains("30 flown now"));
    assert!(flown("1").contains("0 flown now"));
    let again = flown("2");
    assert!(again.contains("this has changed: file profile.csv (6 parts)"), "{again}");
}

#[test]
fn seeds_have_no_sensitivity() {
    let bench = bench(&RANDOM.replace("cases = 1100", "cases = 100"));
    bench.says(&["campaign", "c.toml"]);
    let measure = &bench.json("out/c/summary.json")["measures"][0];
    let rows = measure["sensitivities"].as_array().unwrap();
    let names: Vec<&str> = rows.iter().map(|row| row["parameter"].as_str().unwrap()).collect();
    assert_eq!(names, ["gain.gain", "gain.kind"]);
    // The last value rises with the gain alone.
    assert_eq!(rows[0]["rank_correlation"], 1.0, "{measure}");
    let page = bench.text("out/c/report.html");
    assert!(page.contains("The seeds (plant.noise.seed) have no sensitivity"), "{page}");
}

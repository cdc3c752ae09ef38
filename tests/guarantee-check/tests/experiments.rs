//! Check of the settings of every experiment that claims the guarantee, as its file gives them.

use control::crmpc::{Constraints, Settings};
use guarantee_check::CheckReport;
use std::path::Path;
use toml::{Table, Value};

const GAP: f64 = 3e-3;

/// Converts a value of the file to SI units.
fn quantity(value: &Value) -> f64 {
    match value {
        Value::Float(number) => *number,
        Value::Integer(number) => f64::from(i32::try_from(*number).unwrap()),
        Value::String(text) => {
            let (number, unit) = text.split_once(' ').unwrap();
            assert!(unit.starts_with("deg"), "{text}");
            number.parse::<f64>().unwrap().to_radians()
        }
        other => panic!("{other}"),
    }
}

/// The parameters of the component `controller` in a file and in those that it extends.
fn parameters(file: &Path) -> Table {
    let table: Table = std::fs::read_to_string(file).unwrap().parse().unwrap();
    let bases = match table.get("extends") {
        Some(Value::Array(bases)) => &bases[..],
        Some(base) => std::slice::from_ref(base),
        None => &[],
    };
    let beside = |base: &Value| file.parent().unwrap().join(base.as_str().unwrap());
    let mut merged: Table = bases.iter().flat_map(|base| parameters(&beside(base))).collect();
    let controller = table.get("components").and_then(|components| components.get("controller"));
    let parameters = controller.and_then(|controller| controller.get("parameters"));
    merged.extend(parameters.and_then(Value::as_table).cloned().unwrap_or_default());
    merged
}

/// The settings of the component `controller`.
fn settings(experiment: &str) -> Settings {
    let folder =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../orchestrator/experiments/crmpc-2022");
    let parameters = parameters(&folder.join(experiment));
    assert_eq!(parameters["limit.moment"].as_float(), Some(1.356e5), "a value of the base");
    let mut s = Settings::new(Constraints::Robust);
    for (name, value) in &parameters {
        match name.as_str() {
            "feedback.k1" => s.feedback.k1 = quantity(value),
            "feedback.k2" => s.feedback.k2 = quantity(value),
            "delay" | "measurement.age" => s.delay += quantity(value),
            "disturbance.bound" => s.disturbance_bound = quantity(value),
            "estimation.angleError" => s.angle_error = quantity(value),
            "estimation.rateError" => s.rate_error = quantity(value),
            "estimation.slowAngleError" => s.slow_angle_error = quantity(value),
            "estimation.slowAngleRate" => s.slow_angle_rate = quantity(value),
            "inertia.error" => s.inertia_error = quantity(value),
            "inertia.tensorError" => s.tensor_error = quantity(value),
            "limit.rate" => s.limit_rate = quantity(value),
            "limit.moment" => s.limit_moment = quantity(value),
            "constraints" => assert_eq!(value.as_str(), Some("robust")),
            "initialState" => assert_eq!(value.as_str(), Some("measured")),
            "horizon" => assert_eq!(value.as_integer(), i64::try_from(s.horizon).ok()),
            "period.feedback" => s.period_feedback = quantity(value),
            "period.optimisation" => s.period_optimisation = quantity(value),
            // The bounds do not depend on the other parameters, which have these prefixes.
            _ => {
                let free =
                    ["reference.", "weight.", "terminal.", "tube.", "inertia.I", "saturation"];
                assert!(free.iter().any(|prefix| name.starts_with(prefix)), "{name}");
            }
        }
    }
    s.resolved().unwrap()
}

#[test]
fn every_bound_holds_for_the_experiments() {
    for experiment in ["crmpc-robust.toml", "estimator.toml"] {
        let report = CheckReport::new(&settings(experiment), GAP).unwrap();
        for (_, findings) in report.sections() {
            for finding in findings {
                assert!(finding.holds(), "{experiment}: {finding:?}");
            }
        }
        assert!(report.holds(), "{experiment}");
    }
}

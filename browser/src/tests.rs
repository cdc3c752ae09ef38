//! Requests of the page, and refusals.

use crate::description;
use crate::flight::fly;
use crate::request::Request;
use crate::scenario;
use crate::signals::{ATTITUDE as COLUMNS, ENTRY, plan};
use serde_json::{Value, json};

/// Flies a request. Returns the summary and the signals.
fn flown(request: &Value) -> Result<(Value, Vec<f64>), String> {
    let (summary, signals, _) = flown_with_plans(request)?;
    Ok((summary, signals))
}

fn flown_with_plans(request: &Value) -> Result<(Value, Vec<f64>, Vec<f64>), String> {
    let (mut signals, mut plans) = (vec![], vec![]);
    let request = Request::read(request.to_string().as_bytes());
    let prepared = request.and_then(Request::prepare);
    let summary = prepared.and_then(|(_, closed_loop)| fly(closed_loop, &mut signals, &mut plans));
    let summary = summary.map_err(|error| error.to_string())?;
    Ok((serde_json::to_value(summary).unwrap(), signals, plans))
}

fn refused(set: &Value) -> String {
    flown(&json!({"controller": "lqr", "set": set})).unwrap_err()
}

#[test]
fn every_controller_flies_to_the_end() {
    let choices = scenario::choices().unwrap();
    for choice in choices.iter().filter(|choice| choice.id != "own") {
        let (summary, signals) = flown(&json!({"controller": choice.id})).unwrap();
        assert_eq!(summary["end"], Value::Null, "{}", choice.id);
        let step = summary["step"].as_f64().unwrap();
        assert_eq!(signals.len(), ((50.0 / step).round() as usize + 1) * COLUMNS.len());
        assert_eq!(signals[signals.len() - COLUMNS.len()], 50.0, "{}", choice.id);
        assert!(summary["ems"].as_f64().unwrap().to_degrees() < 3.0, "{}: {summary}", choice.id);
    }
}

#[test]
fn a_text_with_a_display_unit_is_the_number_in_si_units() {
    let flight = |bound: Value| {
        flown(&json!({"controller": "lqr", "set": {"plant.disturbance.bound": bound}})).unwrap()
    };
    let (_, in_degrees) = flight(json!("3 deg/s2"));
    assert_eq!(in_degrees, flight(json!(3.0 / (180.0 / std::f64::consts::PI))).1);
    assert_ne!(in_degrees, flight(json!("2 deg/s2")).1);
}

#[test]
fn the_guarantee_of_crmpc_is_shown_and_only_that() {
    let status = |controller: &str| {
        let (summary, signals) = flown(&json!({"controller": controller})).unwrap();
        let row = &signals[99 * COLUMNS.len()..100 * COLUMNS.len()];
        [13, 14].map(|column| {
            let items = summary["guarantee"][column - 13].as_array().unwrap();
            (items.len(), row[column] as usize)
        })
    };
    assert!(status("crmpc").iter().all(|(items, item)| (1..=*items).contains(item)));
    assert_eq!(status("lqr"), [(0, 0); 2]);
}

#[test]
fn crmpc_shows_each_plan_once_and_others_none() {
    let (_, _, plans) = flown_with_plans(&json!({"controller": "crmpc"})).unwrap();
    let width = plan().len();
    assert_eq!(plans.len(), 250 * width);
    for (index, plan) in plans.chunks(width).enumerate() {
        assert!((plan[0] - 0.2 * index as f64).abs() < 1e-9 && plan[25] == 20.0);
        // Norms and bounds of the rates, then of the moment.
        let limits = [5f64.to_radians(), 135_600.0];
        for (first, limit) in [26, 76].into_iter().zip(limits) {
            let (norms, bounds) = (&plan[first..first + 25], &plan[first + 25..first + 50]);
            let kept = |(norm, bound): (&f64, &f64)| norm <= bound && *bound < limit;
            assert!(norms.iter().zip(bounds).all(kept), "{index}");
        }
    }
    assert!(flown_with_plans(&json!({"controller": "lqr"})).unwrap().2.is_empty());
}

#[test]
fn a_flight_that_cannot_go_on_ends_with_a_reason() {
    let set = json!({"controller.weight.Q[1]": 1e12, "controller.weight.Q[2]": 1e12, "plant.disturbance.bound": 10.0});
    let (summary, signals) = flown(&json!({"controller": "lqr", "set": set})).unwrap();
    let rows = summary["rows"].as_u64().unwrap() as usize;
    assert_eq!(signals.len(), rows * COLUMNS.len());
    assert!(rows < 1251 && summary["end"]["text"].as_str().unwrap().len() > 20, "{summary}");
}

#[test]
fn an_entry_reaches_its_target_and_ends_there() {
    let request = json!({"scenario": "entry", "controller": "lqr"});
    let (summary, signals, plans) = flown_with_plans(&request).unwrap();
    assert_eq!((&summary["end"], plans.len()), (&Value::Null, 0), "{summary}");
    let last = &signals[signals.len() - ENTRY.len()..];
    let at = |name: &str| last[ENTRY.iter().position(|column| *column == name).unwrap()];
    assert!((1700.0..2000.0).contains(&at("time")), "{last:?}");
    assert!((at("guidance.range") - 60e3).abs() < 5e3 && at("plant.motion.speed") < 763.0);
    assert!(summary["moment_ratio"].as_f64().unwrap() < 1.0, "{summary}");
}

#[test]
fn a_lost_attitude_ends_the_flight() {
    let set = json!({"plant.initial.beta": "61 deg"});
    let (summary, signals) = flown(&json!({"controller": "lqr", "set": set})).unwrap();
    assert_eq!((&summary["lost"], &summary["end"]["time"]), (&json!(true), &json!(0.0)));
    assert_eq!(signals.len(), COLUMNS.len());
}

#[test]
fn wrong_requests_are_refused_by_name() {
    let unknown = flown(&json!({"controller": "pid"})).unwrap_err();
    assert!(unknown.contains("'pid'"), "{unknown}");
    // Outside of a page nothing computes its law, and no moment is invented.
    assert!(flown(&json!({"controller": "own"})).unwrap_err().contains("finite"));
    for (set, words) in [
        (json!({"plant.nothing": 1}), "plant.nothing: there is no such parameter"),
        (json!({"planet.x": 1}), "planet: the experiment has no such component"),
        (json!({"plant.disturbance.kind": "pink"}), "has no item \"pink\""),
        (json!({"plant.disturbance.bound": "2 kg"}), "bound: the FMU defines no unit"),
        (json!({"plant.disturbance.bound": -1}), "disturbance.bound"),
        (json!({"plant.disturbance.seed": 1.5}), "must be an integer"),
        (json!({"controller.period.feedback": 0.03}), "controller.period.feedback: stop = 50 s"),
    ] {
        assert!(refused(&set).contains(words), "{set}: {}", refused(&set));
    }
}

#[test]
fn the_page_knows_all_controllers_and_their_parameters() {
    let described = serde_json::to_value(description::describe().unwrap()).unwrap();
    assert_eq!(described["controllers"].as_array().unwrap().len(), 10);
    for controller in described["controllers"].as_array().unwrap() {
        let fmu = &described["fmus"][controller["fmu"].as_str().unwrap()];
        assert!(fmu["parameters"].as_array().unwrap().len() > 12);
    }
    let plant = &described["scenarios"]["attitude"]["components"]["plant"];
    assert_eq!(plant["parameters"]["disturbance.bound"], "2 deg/s2");
    let guidance = &described["scenarios"]["entry"]["components"]["guidance"];
    assert_eq!(guidance["fmu"], "EntryGuidance");
}
